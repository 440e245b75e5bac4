"""Panes by wavelength: files of panes, stacks of panes, band averages.

Files are Optics (IGDB) text, IGSDB products, optical data and glazing systems (JSON).
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.en410 import (
    colour_rendering_index,
    solar_value,
    ultraviolet_value,
    visible_value,
)
from mitsuba_cfs.bsdf.glazing import (
    CLEAR_ABOVE,
    Pane,
    PaneOptics,
    StackOptics,
    coated_values,
    stack,
    uncoated_values,
)
from mitsuba_cfs.bsdf.optical_data import is_optical_data, optical_data_of
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason

FloatArray = NDArray[np.float64]
DIFFUSE_ANGLES = 64
VISIBLE_NM = (400.0, 760.0)  # that a spectrum is to cover for visible values
UNCOATED = ("neither", "none", "na", "n/a", "")


@dataclass(frozen=True, slots=True)
class PaneFile:
    """Data in the file of a pane; front is the file's front, None is not stated."""

    path: Path
    name: str
    # [N, 4] wavelength [nm] rising, transmittance, front and back reflectance; N may be 0
    spectrum: FloatArray
    coated: bool = False
    turned: bool = False  # the front is towards the room
    thickness: float | None = None  # [m]
    conductivity: float | None = None  # [W/(m K)]
    emissivity: tuple[float | None, float | None] = (None, None)
    infrared_transmittance: float | None = None
    # transmittance, front and back reflectance for daylight
    visible: tuple[float, float, float] | None = None

    def visible_pane(self) -> Pane:
        """The pane in the visible band: by the values that are stated, else by its spectrum.

        A pane without a coating has the mean of its two measured faces.
        """
        tau, front, back = self.visible or self._of_spectrum()
        if not self.coated:
            front = back = 0.5 * (front + back)
        if self.turned:
            front, back = back, front
        try:
            return Pane(self.name, tau, front, back, self.coated)
        except ValueError as error:
            raise DataError(str(error), file=self.path) from error

    def _of_spectrum(self) -> tuple[float, float, float]:
        nm = self.spectrum[:, 0]
        if not len(nm) or nm[0] > VISIBLE_NM[0] or nm[-1] < VISIBLE_NM[1]:
            low, high = VISIBLE_NM
            message = f"has no spectrum from {low:g} to {high:g} nm"
            raise DataError(message, file=self.path, field="spectral_data")
        tau, front, back = (visible_value(nm, column) for column in self.spectrum[:, 1:].T)
        return tau, front, back


def read_pane_file(path: str | PathLike[str]) -> PaneFile:
    """The pane of an Optics (IGDB) text file, an IGSDB product's or an optical data JSON file.

    Raises: `DataError` that names the file and what is missing.
    """
    path = Path(path)
    text = _text(path)
    if text.lstrip().startswith("{") and '"' in text.lstrip()[:40]:
        document = _json(text, path)
        return (_optical if is_optical_data(document) else product_pane)(document, path)
    return _optics(text, path)


def read_glazing_layers(path: str | PathLike[str]) -> list[PaneFile]:
    """The panes of a glazing system's JSON, whose `layers` hold spectra, the outer one first."""
    path = Path(path)
    panes = []
    layers = _json(_text(path), path).get("layers") or []
    if not isinstance(layers, list):
        raise DataError("expected a list", file=path, field="layers")
    for number, layer in enumerate(layers, start=1):
        where = f"layer {number}"
        kind = layer.get("product_type") if isinstance(layer, dict) else layer
        if kind != "glazing":
            raise DataError(f"is no glass ({str(kind)[:40]})", file=path, element=where)
        try:
            rows = [[float(nm), *row] for nm, row in (layer.get("spectral_data") or {}).items()]
        except (AttributeError, TypeError, ValueError):
            message = "expected shares by wavelength"
            raise DataError(message, file=path, element=where, field="spectral_data") from None
        coated = _is_coated(layer.get("coated_side"))
        turned = bool(layer.get("flipped"))
        panes.append(PaneFile(path, where, _spectrum(rows, path), coated, turned))
    if not panes:
        raise DataError("has no layers", file=path, field="layers")
    return panes


def read_product_file(path: Path) -> dict[str, Any]:
    """The table of an IGSDB product's JSON file."""
    return _json(_text(path), path)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None


def _json(text: str, path: Path) -> dict[str, Any]:
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise DataError(f"is not JSON: {error}", file=path) from None
    if not isinstance(data, dict):
        raise DataError("expected a table of a product", file=path)
    return data


def _optical(document: dict[str, Any], path: Path) -> PaneFile:
    """The pane of building-envelope-data's optical data."""
    data = optical_data_of(document, path)
    spectrum = _spectrum(data.rows, path)
    if not len(spectrum) and data.visible is None:
        message = "has no transmittance and reflectance near normal incidence"
        raise DataError(message, file=path, field="dataPoints")
    return PaneFile(
        path,
        data.name or path.stem,
        spectrum,
        data.coated,
        thickness=None if data.thickness_mm is None else data.thickness_mm / 1000.0,
        conductivity=data.conductivity,
        emissivity=data.emissivity,
        infrared_transmittance=data.infrared_transmittance,
        visible=data.visible,
    )


def product_pane(product: dict[str, Any], path: Path, *, material: bool = False) -> PaneFile:
    """Product of the IGSDB: measured data and visible values.

    Args: material: of a shade, whose sides are kept separate; otherwise a pane is required.
    """
    measured = product.get("measured_data")
    if not isinstance(measured, dict) or not measured:
        raise DataError("is no IGSDB product (measured_data)", file=path)
    kind = product.get("type") or "no type"
    if not material and (kind in ("shading", "material") or measured.get("is_specular") is False):
        raise DataError(f"expected a specular pane, got {kind}", file=path, field="type")
    if measured.get("thickness") is None and product.get("composition"):
        raise DataError("is a shade or a product of parts, not a pane", file=path)
    try:
        rows = (product.get("spectral_data") or {}).get("spectral_data") or []
        rows = [[1e3 * row["wavelength"], row["T"], row["Rf"], row["Rb"]] for row in rows]
    except (KeyError, TypeError, AttributeError) as error:
        message = f"expected rows of wavelength, T, Rf, Rb ({error})"
        raise DataError(message, file=path, field="spectral_data") from None
    summaries = product.get("integrated_results_summary") or [{}]
    if not isinstance(summaries, list) or not isinstance(summaries[0], dict):
        raise DataError("expected a list of tables", file=path, field="integrated_results_summary")
    stated = [_stated(summaries[0], name, path) for name in ("tfvis", "rfvis", "rbvis")]
    tau, front, back = stated
    thickness = _stated(measured, "thickness", path)
    return PaneFile(
        path,
        str(product.get("name") or path.stem),
        _spectrum(rows, path),
        material or _is_coated(product.get("coated_side")),
        thickness=None if thickness is None else thickness / 1000.0,
        conductivity=_stated(measured, "conductivity", path),
        emissivity=(
            _stated(measured, "emissivity_front", path),
            _stated(measured, "emissivity_back", path),
        ),
        infrared_transmittance=_stated(measured, "tir_front", path),
        visible=None if tau is None or front is None or back is None else (tau, front, back),
    )


def _stated(table: dict[str, Any], name: str, path: Path) -> float | None:
    """The finite number that a table states, None where it does not."""
    value = table.get(name)
    try:
        number = None if value is None else float(value)
    except (TypeError, ValueError, OverflowError):
        number = np.nan
    if number is not None and not np.isfinite(number):
        raise DataError(f"expected a number, got {str(value)[:40]!r}", file=path, field=name)
    return number


_HEADER = re.compile(r"^\{(?P<content>.*)\}(?P<value>.*)$")


def _optics(text: str, path: Path) -> PaneFile:
    """The pane of an Optics text file: headers in braces, then wavelength, T, Rf, Rb."""
    headers, rows = {}, []
    for line in text.splitlines():
        header = _HEADER.match(line.strip())
        if header:
            key, _, value = header["content"].partition(":")
            headers[key.strip().lower()] = (value.strip() or header["value"]).strip()
        elif line.strip():
            try:
                rows.append([float(word) for word in line.split()[:4]])
            except ValueError:
                raise DataError(f"is no spectral row: {line.strip()[:40]!r}", file=path) from None
    if not rows or {len(row) for row in rows} != {4}:
        raise DataError("expected rows of wavelength, T, Rf, Rb", file=path)
    if "nano" not in headers.get("units, wavelength units", "").lower():
        rows = [[1000.0 * row[0], *row[1:]] for row in rows]
    numbers = re.findall(r"\d+\.?\d*|\.\d+", headers.get("emissivity, front back", ""))
    front, back, *_ = [*(float(n) for n in numbers[:2]), None, None]
    millimetres = _number(headers.get("thickness"))
    return PaneFile(
        path,
        headers.get("product name") or path.stem,
        _spectrum(rows, path),
        _is_coated(headers.get("coated side")),
        thickness=None if millimetres is None else millimetres / 1000.0,
        conductivity=_number(headers.get("conductivity")),
        emissivity=(front, back),
        infrared_transmittance=_number(headers.get("ir transmittance", "").partition("=")[2]),
    )


def _number(text: str | None) -> float | None:
    try:
        return float(text or "")
    except ValueError:
        return None


def _is_coated(side: Any) -> bool:
    return str(side or "").lower() not in UNCOATED


def _spectrum(rows: Sequence[Sequence[float]], path: Path) -> FloatArray:
    """Rows of wavelength [nm] and shares as an array [N, 4], checked."""
    if not rows:
        return np.zeros((0, 4))
    try:
        table = np.array(rows, dtype=float)
    except (TypeError, ValueError, OverflowError):
        table = np.zeros(0)
    if table.ndim != 2 or table.shape[1] != 4 or not np.isfinite(table).all():
        raise DataError("expected rows of wavelength, T, Rf, Rb", file=path, field="spectral_data")
    table = table[np.argsort(table[:, 0], kind="stable")]
    if np.any(np.diff(table[:, 0]) <= 0):
        raise DataError("names a wavelength twice", file=path, field="spectral_data")
    worst = float(np.max(table[:, 1] + table[:, 2:].max(axis=1)))
    if table[:, 1:].min() < -1e-3 or worst > 1.02:
        message = f"T + R reaches {worst:.3f}: expected shares of 1"
        raise DataError(message, file=path, field="spectral_data")
    return np.column_stack([np.round(table[:, 0], 3), np.clip(table[:, 1:], 0.0, 1.0)])


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


def spectral_transmittance(
    panes: Sequence[SpectralPane], wavelength_nm: ArrayLike, theta: ArrayLike
) -> FloatArray:
    """Transmittance [A, N] of panes in series by angle of incidence [A] [rad] and wavelength [N].

    Source: as of `spectral_glazing`.
    """
    angles = np.atleast_1d(np.asarray(theta, dtype=float))
    nm, whole = _whole(panes, angles)
    wanted = np.asarray(wavelength_nm, dtype=float)
    return np.stack([np.interp(wanted, nm, tau) for tau in whole.tau.T])


def diffuse_reflectance(panes: Sequence[SpectralPane], wavelength_nm: ArrayLike) -> FloatArray:
    """Reflectance [N] of panes in series for diffuse light from the room, by wavelength [N]."""
    sine2 = (np.arange(DIFFUSE_ANGLES) + 0.5) / DIFFUSE_ANGLES  # equal shares of the light
    nm, whole = _whole(panes, np.arcsin(np.sqrt(sine2)))
    return np.interp(np.asarray(wavelength_nm, dtype=float), nm, whole.rho_back.mean(axis=1))


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
