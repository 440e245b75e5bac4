"""Integrated values of a pane or glazing from its spectral transmittance or reflectance.

Source: EN 410:2011 (as ISO 9050): visible by illuminant D65 and V(lambda) every 10 nm, solar by the
global radiation of its table 2, UV by its table 3, colour rendering index R_a with D65 as
reference (clause 5.6).  D65, V(lambda), the 1931 observer and the eight test colours are those of
colour-science.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

# EN 410 table 2: wavelength [nm], normalised distribution of global solar radiation (air mass 1)
# times the wavelength interval
SOLAR_NM = np.array([*range(300, 800, 20), *range(800, 2100, 50), *range(2100, 2501, 100)], dtype=float)
SOLAR_SHARE = 1e-4 * np.fromstring(
    "5 69 122 145 177 235 268 294 343 339 326 318 321 312 294 289 289 280 273 246 237 220 230 199 "
    "211 330 453 381 220 329 306 185 136 210 211 166 42 10 44 95 123 110 106 93 68 24 5 2 12 30 37 "
    "57 66 60 41 6",
    sep=" ",
)
# EN 410 table 3: UV part of the global radiation in bands 5 nm wide, normalised
UV_NM = np.arange(297.5, 380, 5)
UV_SHARE = 1e-5 * np.fromstring(
    "82 461 1373 2746 4120 5591 6572 7062 7258 7454 7601 7700 7896 8043 8337 8631 9073", sep=" "
)
# share of the weight that may lie outside the data (the UV table's first band: files of panes begin
# at 300 nm); the nearest value stands there
LEFT_OUT = 1e-3


def solar_value(wavelength_nm: ArrayLike, value: ArrayLike) -> float:
    """Solar direct transmittance or reflectance of spectral data [N] (EN 410, 5.3)."""
    return _weighted(wavelength_nm, value, SOLAR_NM, SOLAR_SHARE)


def ultraviolet_value(wavelength_nm: ArrayLike, value: ArrayLike) -> float:
    """Ultraviolet transmittance of spectral data [N], 300 to 380 nm (EN 410, 5.5)."""
    return _weighted(wavelength_nm, value, UV_NM, UV_SHARE)


def visible_value(wavelength_nm: ArrayLike, value: ArrayLike) -> float:
    """Luminous transmittance or reflectance of spectral data [N] (EN 410, 5.2)."""
    nm, _, cmfs, _ = _colour_tables()
    tenth = slice(None, None, 2)
    light = _colour_tables()[1] * cmfs[:, 1]
    return _weighted(wavelength_nm, value, nm[tenth], light[tenth])


def colour_rendering_index(wavelength_nm: ArrayLike, value: ArrayLike) -> float:
    """General colour rendering index R_a of D65 through (or off) spectral data [N].

    Eight test colours under D65 and under D65 x value, chromatic adaptation after von Kries,
    R_i = 100 - 4.6 dE in U* V* W*, R_a their mean (EN 410, 5.6).
    """
    nm, light, cmfs, samples = _colour_tables()
    rising = _rising(wavelength_nm)
    _check_reach(rising, nm, cmfs.sum(axis=1) * light)
    spectrum = light * np.interp(nm, rising, np.asarray(value, dtype=float))
    reference, test = _tristimulus(light, cmfs), _tristimulus(spectrum, cmfs)
    if not test[1] > 0:
        raise ValueError("colour rendering of what passes no light is not defined")
    seen = [_tristimulus(light * s, cmfs) * 100 / reference[1] for s in samples]
    through = [_tristimulus(spectrum * s, cmfs) * 100 / test[1] for s in samples]
    white, own = _uv(reference), _uv(test)
    indices = []
    for a, b in zip(seen, through, strict=True):
        under_reference = _uvw(_uv(a), a[1], white)
        under_test = _uvw(_adapted(_uv(b), own, white), b[1], white)
        indices.append(100 - 4.6 * np.linalg.norm(under_reference - under_test))
    return float(np.mean(indices))


def _weighted(wavelength_nm: ArrayLike, value: ArrayLike, nm: NDArray[Any], weight: NDArray[Any]) -> float:
    """Mean of the data at `nm` by `weight`; the data must reach over where the weight is."""
    rising = _rising(wavelength_nm)
    _check_reach(rising, nm, weight)
    return float(np.interp(nm, rising, np.asarray(value, dtype=float)) @ weight / weight.sum())


def _check_reach(given: NDArray[Any], nm: NDArray[Any], weight: NDArray[Any]) -> None:
    """Raise `ValueError` for data that leave out more than `LEFT_OUT` of the weight."""
    beyond = (nm < given[0] - 1e-6) | (nm > given[-1] + 1e-6)
    if weight[beyond].sum() > LEFT_OUT * weight.sum():
        raise ValueError(f"spectral data from {given[0]:g} to {given[-1]:g} nm: expected {nm[0]:g} to {nm[-1]:g} nm")


def _rising(wavelength_nm: ArrayLike) -> NDArray[np.float64]:
    given = np.asarray(wavelength_nm, dtype=float)
    if given.ndim != 1 or len(given) < 2 or not np.all(np.diff(given) > 0):
        raise ValueError("wavelengths: expected a rising sequence [nm]")
    return given


@cache
def _colour_tables() -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Wavelengths 380 to 780 nm by 5 [N], D65 [N], 1931 observer [N, 3], test colours [8, N]."""
    import colour
    from colour.quality.datasets import SDS_TCS

    shape = colour.SpectralShape(380, 780, 5)
    light = colour.SDS_ILLUMINANTS["D65"].copy().align(shape).values
    cmfs = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape).values
    colours = SDS_TCS["CIE 1995"]
    samples = [colours[f"TCS{n:02d}"].copy().align(shape).values for n in range(1, 9)]
    return shape.wavelengths, light, cmfs, np.array(samples)


def _tristimulus(spectrum: NDArray[Any], cmfs: NDArray[Any]) -> NDArray[np.float64]:
    return spectrum @ cmfs


def _uv(xyz: NDArray[Any]) -> NDArray[np.float64]:
    """CIE 1960 u, v."""
    x, y, z = xyz
    return np.array([4 * x, 6 * y]) / (x + 15 * y + 3 * z)


def _adapted(uv: NDArray[Any], own: NDArray[Any], white: NDArray[Any]) -> NDArray[np.float64]:
    """u, v seen under `own` as it would be under `white` (CIE 13.3)."""
    (c, d), (c_own, d_own), (c_white, d_white) = (
        ((4 - u - 10 * v) / v, (1.708 * v + 0.404 - 1.481 * u) / v) for u, v in (uv, own, white)
    )
    c, d = c * c_white / c_own, d * d_white / d_own
    return np.array([10.872 + 0.404 * c - 4 * d, 5.520]) / (16.518 + 1.481 * c - d)


def _uvw(uv: NDArray[Any], luminance: float, white: NDArray[Any]) -> NDArray[np.float64]:
    """CIE 1964 W*, U*, V*."""
    w = 25 * np.cbrt(luminance) - 17
    return np.array([w, *(13 * w * (uv - white))])
