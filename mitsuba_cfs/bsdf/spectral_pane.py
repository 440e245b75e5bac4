"""Panes by wavelength: stacks of panes, band averages."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.en410 import (
    colour_rendering_index,
    solar_value,
    ultraviolet_value,
    visible_value,
)
from mitsuba_cfs.bsdf.glazing import CLEAR_ABOVE, coated_values, uncoated_values
from mitsuba_cfs.bsdf.pane_file import read_pane_file
from mitsuba_cfs.bsdf.pane_stack import PaneOptics, StackOptics, stack
from mitsuba_cfs.errors import DataError

FloatArray = NDArray[np.float64]
EMISSIVITY = 0.84  # of glass, where a file states none
SPECTRA = ("EN 410", "ASTM G173 direct", "ASTM G173 global")  # of the sun


@dataclass(frozen=True, slots=True)
class SpectralPane:
    """A pane at normal incidence by wavelength; front is outdoors."""

    name: str
    wavelength_nm: FloatArray  # [N] rising
    transmittance: FloatArray  # [N]
    reflectance_front: FloatArray  # [N]
    reflectance_back: FloatArray  # [N]
    thickness: float  # [m]
    conductivity: float = 1.0  # [W/(m K)]
    emissivity: tuple[float, float] = (EMISSIVITY, EMISSIVITY)
    infrared_transmittance: float = 0.0
    coated: bool = False

    def turned(self) -> SpectralPane:
        """The pane the other way round."""
        return SpectralPane(
            self.name, self.wavelength_nm, self.transmittance, self.reflectance_back,
            self.reflectance_front, self.thickness, self.conductivity, self.emissivity[::-1],
            self.infrared_transmittance, self.coated,
        )  # fmt: skip


def read_spectral_pane(
    path: str | PathLike[str], *, thickness: float | None = None
) -> SpectralPane:
    """The pane of a file, see `pane_file.read_pane_file`.

    Args: thickness: [m] where the file states none.

    Raises: `DataError` that names the file and what is missing.
    """
    file = read_pane_file(path)
    if not len(file.spectrum):
        raise DataError("holds no spectrum", file=file.path, field="spectral_data")
    thickness = file.thickness or thickness
    if not thickness:
        raise DataError("states no thickness", file=file.path)
    front, back = (EMISSIVITY if e is None else e for e in file.emissivity)
    wavelength_nm, tau, rho_front, rho_back = file.spectrum.T
    return SpectralPane(
        file.name, wavelength_nm, tau, rho_front, rho_back, thickness,
        file.conductivity or 1.0, (front, back),
        file.infrared_transmittance or 0.0, file.coated,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class BandValues:
    """A glazing in one band, per angle of incidence [A]."""

    transmittance: FloatArray  # [A]
    reflectance_front: FloatArray  # [A]
    reflectance_back: FloatArray  # [A]
    absorptance: FloatArray  # [A, n] of each pane, for light from outside


def spectral_glazing(
    panes: Sequence[SpectralPane],
    theta: ArrayLike = 0.0,
    *,
    spectrum: str | FloatArray = SPECTRA[0],
) -> Mapping[str, BandValues]:
    """Panes from outside to inside as one glazing in "Solar" and "Visible", by wavelength.

    Each wavelength is combined over all panes before averaging: a coated pane with a
    clear one meets other light than the sun's.

    Args: theta: angles of incidence [A] [rad]; spectrum: of the sun, of `SPECTRA` or as rows of
        wavelength [nm] and irradiance [M, 2]; visible is always D65 and V(lambda).

    Source: EN 410:2011, 5.2 and 5.3; angles as `glazing.pane_values`.
    """
    angles = np.atleast_1d(np.asarray(theta, dtype=float))
    nm, whole = _whole(panes, angles)
    stacked = (whole.tau, whole.rho_front, whole.rho_back, whole.absorptance)
    result = {}
    for band in ("Solar", "Visible"):
        average = visible_average if band == "Visible" else solar_average(spectrum)
        tau, front, back, absorbed = (_averaged(nm, values, average) for values in stacked)
        result[band] = BandValues(tau, front, back, absorbed)
    return result


@dataclass(frozen=True, slots=True)
class SpectralRating:
    """UV transmittance and colour rendering of a glazing by EN 410."""

    ultraviolet: float  # transmittance, 300 to 380 nm
    colour_rendering: float  # R_a of daylight D65 through it


def spectral_rating(panes: Sequence[SpectralPane]) -> SpectralRating:
    """UV transmittance and colour rendering of panes in series, at normal incidence.

    Raises: `ValueError` for spectra that do not reach from 300 to 780 nm, or without transmitted
    light.

    Source: EN 410:2011, 5.5 and 5.6.
    """
    nm, whole = _whole(panes, np.zeros(1))
    tau = whole.tau[:, 0]
    return SpectralRating(ultraviolet_value(nm, tau), colour_rendering_index(nm, tau))


def visible_average(nm: FloatArray, value: FloatArray) -> float:
    """Mean of spectral data [N] by D65 and V(lambda)."""
    return visible_value(nm, value)


Average = Callable[[FloatArray, FloatArray], float]


def solar_average(spectrum: str | FloatArray) -> Average:
    """Solar average of spectral data [N]: EN 410's weights, or a spectrum by trapezoids."""
    if isinstance(spectrum, str) and spectrum == "EN 410":
        return solar_value
    if isinstance(spectrum, str) and spectrum not in SPECTRA:
        raise ValueError(f"spectrum {spectrum!r} is not of {', '.join(SPECTRA)}")
    nm, sun = _g173(spectrum.split()[-1]) if isinstance(spectrum, str) else spectrum.T

    def average(wavelength: FloatArray, value: FloatArray) -> float:
        return float(
            np.trapezoid(np.interp(nm, wavelength, value) * sun, nm) / np.trapezoid(sun, nm)
        )

    return average


@cache
def _g173(kind: str) -> tuple[FloatArray, FloatArray]:
    """Wavelengths [nm] from 300 to 2500 and irradiance of ASTM G173-03, air mass 1.5."""
    from pvlib.spectrum import get_reference_spectra

    table = get_reference_spectra(standard="ASTM G173-03").loc[300.0:2500.0]
    return table.index.to_numpy(dtype=float), table[kind].to_numpy(dtype=float)


def _whole(panes: Sequence[SpectralPane], theta: FloatArray) -> tuple[FloatArray, StackOptics]:
    """Wavelengths [nm] [N] and the optics of all panes together at angles, [N, A]."""
    nm = np.unique(np.concatenate([pane.wavelength_nm for pane in panes]))
    nm = nm[(nm >= 280.0) & (nm <= 4100.0)]
    return nm, stack([_at_angles(pane, nm, theta) for pane in panes])


def _averaged(nm: FloatArray, values: FloatArray, average: Average) -> FloatArray:
    """Averages [A, ...] of values [N, A, ...]."""
    flat = values.reshape(len(nm), -1)
    return np.array([average(nm, column) for column in flat.T]).reshape(values.shape[1:])


def _at_angles(pane: SpectralPane, nm: FloatArray, theta: FloatArray) -> PaneOptics:
    """A pane by wavelength and angle [N, A]."""
    tau, front, back = (
        np.interp(nm, pane.wavelength_nm, values)[:, None]
        for values in (pane.transmittance, pane.reflectance_front, pane.reflectance_back)
    )
    if pane.coated:
        sunlit = solar_value(pane.wavelength_nm, pane.transmittance)
        return PaneOptics(*coated_values(tau, front, back, theta, clear=sunlit > CLEAR_ABOVE))
    passed, returned = uncoated_values(tau, 0.5 * (front + back), theta)
    return PaneOptics(passed, returned, returned)
