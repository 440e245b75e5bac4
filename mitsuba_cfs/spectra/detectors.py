"""Spectral sensitivities of the eye and the quantities of CIE S 026, CIE 1931 colorimetry.

Spectra are [.., N] at `NANOMETRES`, every nanometre from 380 to 780; spectral irradiance is in
W/(m2 nm).
"""

from __future__ import annotations

import warnings
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
NANOMETRES = np.arange(380.0, 781.0)
EFFICACY = 683.002  # K_m [lm/W], CIE S 026
FARTHEST_DUV = 0.05  # from the Planckian locus that a colour temperature is stated (CIE 015:2018)
LEAST_K, MOST_K = 1667.0, 99_999.0  # within the isotherms that Robertson's method knows
ALPHA_OPIC = ("s_cone", "m_cone", "l_cone", "rod", "melanopic")
# rows of `sensitivities`
DETECTORS = ("photopic", *ALPHA_OPIC, "x", "y", "z")
# CIE S 026:2018, table 1: alpha-opic efficacy of luminous radiation of D65 [W/lm]
D65_EFFICACY = {"s_cone": 0.8173e-3, "m_cone": 1.4558e-3, "l_cone": 1.6289e-3, "rod": 1.4497e-3, "melanopic": 1.3262e-3}


@cache
def sensitivities() -> FloatArray:
    """Sensitivities [9, N] of `DETECTORS`: V(lambda), the five action spectra, CIE 1931 observer.

    Source: CIE S 026:2018, table 2 (CIE data set 10.25039/CIE.DS.vqqhzp5a); V(lambda) and the
    observer are those of colour-science.
    """
    import colour

    path = Path(__file__).with_suffix(".csv")  # every nanometre of `NANOMETRES`
    opic = np.loadtxt(path, delimiter=",", skiprows=1)[:, 1:]
    photopic = colour.SDS_LEFS["CIE 1924 Photopic Standard Observer"]
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    v = np.interp(NANOMETRES, photopic.wavelengths, photopic.values)
    xyz = [np.interp(NANOMETRES, observer.wavelengths, column) for column in observer.values.T]
    return np.array([v, *opic.T, *xyz])


def is_illuminant(name: str) -> bool:
    """Whether a name is that of one of CIE's illuminants."""
    import colour

    return name in colour.SDS_ILLUMINANTS


@cache
def illuminant(name: str) -> FloatArray:
    """Relative power [N] of one of CIE's illuminants, such as "D65", "A", "FL12", "E".

    Raises: `ValueError` for a name that colour-science does not have.
    """
    import colour

    if not is_illuminant(name):
        raise ValueError(f"illuminant {name!r}: expected one of CIE's, such as D65, A, FL12")
    table = colour.SDS_ILLUMINANTS[name]
    power: FloatArray = np.interp(NANOMETRES, table.wavelengths, table.values)
    return power


def visible_mean(spectra: ArrayLike) -> FloatArray:
    """Transmittance or reflectance of visible light [..] of spectra [.., N]; source: EN 410, by D65."""
    weights = illuminant("D65") * sensitivities()[0]
    mean: FloatArray = np.asarray(spectra, dtype=float) @ weights / weights.sum()
    return mean


def detected(spectrum: ArrayLike) -> FloatArray:
    """What `DETECTORS` receive of spectra [.., N]: [.., 9], photopic in lm, the others in W."""
    received = np.asarray(spectrum, dtype=float) @ sensitivities().T
    received[..., 0] *= EFFICACY
    return received


def equivalent_daylight(alpha_opic: ArrayLike, name: str = "melanopic") -> FloatArray:
    """Alpha-opic equivalent daylight (D65) illuminance [lx] of alpha-opic irradiance [W/m2].

    Source: CIE S 026:2018, 3.9.
    """
    return np.asarray(alpha_opic, dtype=float) / D65_EFFICACY[name]


def daylight_efficacy_ratio(spectrum: ArrayLike, name: str = "melanopic") -> FloatArray:
    """Alpha-opic daylight (D65) efficacy ratio [..] of spectra [.., N]; 1 for D65.

    Source: CIE S 026:2018, 3.10.
    """
    received = detected(spectrum)
    return equivalent_daylight(received[..., DETECTORS.index(name)], name) / received[..., 0]


def colour_temperature(xyz: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Correlated colour temperature [..] [K] and Duv [..] of tristimulus values [.., 3].

    NaN where there is no light.  The temperature is NaN where the colour is farther than
    `FARTHEST_DUV` from the Planckian locus, both are NaN where it is not between `LEAST_K` and
    `MOST_K`: neither has a meaning there.

    Source: Robertson 1968, J. Opt. Soc. Am. 58, 1528-1535; Duv: ANSI C78.377, positive above the
    Planckian locus (by colour-science).
    """
    from colour.temperature import uv_to_CCT_Robertson1968

    xyz = np.asarray(xyz, dtype=float)
    x, y, z = np.moveaxis(xyz, -1, 0)
    sum_uv = x + 15 * y + 3 * z
    lit = y > 0
    scale = 1 / np.where(lit, sum_uv, 1.0)
    uv = np.stack([4 * x * scale, 6 * y * scale], axis=-1)[lit]
    result = np.full((2, *y.shape), np.nan)
    if lit.any():
        result[:, lit] = np.asarray(uv_to_CCT_Robertson1968(uv)).T
    beyond = lit & ~((result[0] >= LEAST_K) & (result[0] <= MOST_K))
    result[:, beyond] = np.nan
    result[0, np.abs(np.nan_to_num(result[1])) > FARTHEST_DUV] = np.nan
    return result[0], result[1]


def colour_rendering(spectrum: ArrayLike) -> tuple[float, float]:
    """General colour rendering index R_a and colour fidelity index R_f of a spectrum [N].

    NaN for light without a colour temperature, whose reference light they need.

    Source: CIE 13.3-1995; CIE 224:2017 (R_f of ANSI/IES TM-30-20), by colour-science.
    """
    import colour

    if np.isnan(colour_temperature(detected(spectrum)[-3:])[0]):
        return np.nan, np.nan
    shape = colour.SpectralShape(360, 830, 1)  # of its observers; no light beyond 380 to 780
    whole = np.pad(np.asarray(spectrum, dtype=float), (20, 50))
    power = colour.SpectralDistribution(whole, shape)
    with warnings.catch_warnings(action="ignore"):  # that it aligns its tables
        index: Any = colour.colour_rendering_index(power)
        fidelity: Any = colour.colour_fidelity_index(power, method="ANSI/IES TM-30-18")
    return float(index), float(fidelity)
