"""Panes by wavelength: files of panes, stacks of panes, band averages.

Files are Optics (IGDB) text, IGSDB products, optical data and glazing systems (JSON).

Optical data are a list of `data`, each with `componentCharacteristics` and `dataPoints`; a point
has an incidence, an emergence and results.  Read are values near normal incidence (10 degrees or
less): by wavelength, and the integrals `visible` and `infrared`.  Values of the non-prime surface
are the front's, which often faces the exterior as the schema says, those of the prime surface the
back's; points that name no surface, or `symmetric`, are both's.

Source: github.com/building-envelope-data/api, schemas/opticalData.json 1.1.0 (the form of 1.0 is
read too: `dataPoints` without `data`).
"""

from __future__ import annotations

import json
import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import isfinite
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.en410 import colour_rendering_index, solar_value, ultraviolet_value, visible_value
from mitsuba_cfs.bsdf.glazing import CLEAR_ABOVE, Pane, PaneOptics, StackOptics, coated_values, stack, uncoated_values
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason

NEAR_NORMAL_DEG = 10.0  # CIE 130-1998
SCATTERED = 0.05  # that a pane may pass besides what goes straight on
NEGATIVE = 0.02  # that noise may leave of nothing
APART = 0.01  # by which the values of both sides of a pane without a coating may differ
LOW_EMISSIVITY = 0.7  # below it a side is coated
SURFACES = {"nonPrime": ("front",), "prime": ("back",), "symmetric": ("front", "back")}
SIDES = ("front", "back")
RESULTS = ("transmittance", "reflectance", "absorptanceEmittance")
INTEGRALS = ("infrared", "solar", "ultraviolet", "visible", "other")
Key = float | str  # a wavelength [nm] or an integral's name


@dataclass(frozen=True, slots=True)
class OpticalData:
    """Values of a pane near normal incidence; None is not stated."""

    name: str | None
    rows: list[list[float]]  # wavelength [nm], transmittance, front and back reflectance
    visible: tuple[float, float, float] | None
    emissivity: tuple[float | None, float | None]  # front, back
    infrared_transmittance: float | None
    thickness_mm: float | None
    conductivity: float | None  # [W/(m K)]
    coated: bool


@dataclass(frozen=True, slots=True)
class _Point:
    """A result for one surface."""

    where: str
    key: Key
    side: str
    result: str
    emergence: str  # "direct", "diffuse" or "hemispherical"
    polar: float  # of the incident light [degrees], -1 for hemispherical light
    value: float


def is_optical_data(document: dict[str, Any]) -> bool:
    """Whether a JSON document is of this schema, or a component that holds such data."""
    return bool({"data", "dataPoints", "components", "optical"} & document.keys())


def optical_data_of(document: dict[str, Any], path: Path) -> OpticalData:
    """The pane of a document; `DataError` with the data point and field that cannot be used."""
    component, data = _data_set(document, path)
    points = [point for block in _blocks(data, path) for point in _points(*block, path)]
    table = _Table(points, path)
    infrared = [table.value("infrared", side, "absorptanceEmittance") for side in SIDES]
    passed = table.either("infrared", "transmittance")
    for number, side in enumerate(SIDES):
        returned = table.value("infrared", side, "reflectance")
        if infrared[number] is None and returned is not None and passed is not None:
            infrared[number] = 1 - passed - returned
    own = _table(_table(data, "serverSpecific", path), "igsdb", path)
    rows = [[nm, *table.triple(nm)] for nm in table.wavelengths]
    visible = table.triple("visible") if table.has("visible") else None
    coated_side = own.get("coatedSide")
    name = component.get("name") or own.get("marketingName")
    return OpticalData(
        name=name if isinstance(name, str) else None,
        rows=rows,
        visible=visible,
        emissivity=(infrared[0], infrared[1]),
        infrared_transmittance=passed,
        thickness_mm=_value_stated(_table(own, "physicalProperties", path), "thickness", path),
        conductivity=_value_stated(_table(own, "materialBulkProperties", path), "conductivity", path),
        coated=_differs(rows, visible, infrared) if coated_side is None else coated_side not in ("NEITHER", "NA"),
    )


def _differs(
    rows: list[list[float]], visible: tuple[float, float, float] | None, emissivity: list[float | None]
) -> bool:
    """Whether the sides differ as only a coating makes them."""
    triples = [row[1:] for row in rows] + ([list(visible)] if visible else [])
    low = any(e is not None and e < LOW_EMISSIVITY for e in emissivity)
    return low or any(abs(front - back) > APART for _, front, back in triples)


def _data_set(document: dict[str, Any], path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """The component and the optical data of a document that has one of each."""
    component = document
    if "components" in document:
        component = _only(document["components"], "components", path)
    if "optical" not in component:
        return component, component
    return component, _only(component["optical"], "optical", path)


def _only(found: Any, field: str, path: Path) -> dict[str, Any]:
    if not isinstance(found, list) or len(found) != 1 or not isinstance(found[0], dict):
        count = len(found) if isinstance(found, list) else "no list"
        raise DataError(f"expected one of them, got {count}", file=path, field=field)
    return found[0]


def _blocks(data: dict[str, Any], path: Path) -> Iterator[tuple[str, tuple[str, ...], list[Any]]]:
    """Path of each block of data, its sides and its data points."""
    blocks = data.get("data", [data] if "dataPoints" in data else None)
    if not isinstance(blocks, list) or not blocks:
        raise DataError("expected a list of data points", file=path, field="data")
    for number, block in enumerate(blocks, 1):
        where = f"data {number}"
        points = block.get("dataPoints") if isinstance(block, dict) else None
        if not isinstance(points, list) or not points:
            raise DataError("expected a list", file=path, element=where, field="dataPoints")
        traits = _table(block, "componentCharacteristics", path)
        surface = traits.get("surface", "symmetric")
        if not isinstance(surface, str) or surface not in SURFACES:
            message = f"expected one of {', '.join(SURFACES)}, got {str(surface)[:40]!r}"
            raise DataError(message, file=path, element=where, field="surface")
        if traits.get("normalization", "absolute") != "absolute":
            raise DataError("is not absolute", file=path, element=where, field="normalization")
        yield where, SURFACES[surface], points


def _points(block: str, sides: tuple[str, ...], points: list[Any], path: Path) -> Iterator[_Point]:
    """Values of a block's data points near normal incidence."""
    for number, point in enumerate(points, 1):
        where = f"{block}, data point {number}"
        if not isinstance(point, dict):
            raise DataError("expected a table", file=path, element=where)
        incidence, emergence, results = (
            _table(point, name, path, where) for name in ("incidence", "emergence", "results")
        )
        polar = _polar(incidence, path, where)
        leaves = _emergence(emergence, path, where)
        key = _key(_table(incidence, "wavelengths", path, where), path, where)
        if polar is None or leaves is None or _is_polarized(incidence.get("polarization")):
            continue
        for result in RESULTS:
            value = _value_stated(results, result, path, where)
            if value is not None:
                for side in sides:
                    yield _Point(where, key, side, result, leaves, polar, _share(value, path, where, result))


def _share(value: float, path: Path, where: str, field: str) -> float:
    if not -NEGATIVE <= value <= 1 + NEGATIVE:
        raise DataError(f"{value:g} is no share", file=path, element=where, field=field)
    return min(max(value, 0.0), 1.0)


def _polar(incidence: dict[str, Any], path: Path, where: str) -> float | None:
    """Polar angle of near-normal light [degrees], -1 for light from everywhere, else None."""
    direction = incidence.get("direction")
    if direction == "hemispherical":
        return -1.0
    polar = _angle(direction, path, where)
    return polar if polar <= NEAR_NORMAL_DEG else None


def _emergence(emergence: dict[str, Any], path: Path, where: str) -> str | None:
    """How light leaves; None for a single direction away from near-normal light's own."""
    direction = emergence.get("direction")
    if direction in ("diffuse", "hemispherical"):
        return str(direction)
    return "direct" if _angle(direction, path, where) <= NEAR_NORMAL_DEG else None


def _angle(direction: Any, path: Path, where: str) -> float:
    polar = _value_stated(direction, "polar", path, where) if isinstance(direction, dict) else None
    if polar is None or not 0 <= polar <= 90:
        message = "expected polar from 0 to 90 degrees or hemispherical"
        raise DataError(message, file=path, element=where, field="direction")
    return polar


def _key(wavelengths: dict[str, Any], path: Path, where: str) -> Key:
    integral = wavelengths.get("integral")
    if isinstance(integral, str) and integral in INTEGRALS:
        return integral
    nm = _value_stated(wavelengths, "wavelength", path, where)
    if nm is None or nm <= 0:
        message = "expected wavelength or integral"
        raise DataError(message, file=path, element=where, field="wavelengths")
    return nm


def _is_polarized(polarization: Any) -> bool:
    if isinstance(polarization, dict):
        return polarization.get("s") != polarization.get("p")
    return polarization is not None


def _table(owner: Any, name: str, path: Path, where: str | None = None) -> dict[str, Any]:
    """The table of a name, empty where there is none."""
    result = owner.get(name)
    if result is not None and not isinstance(result, dict):
        raise DataError("expected a table", file=path, element=where, field=name)
    return result or {}


def _value_stated(table: dict[str, Any], name: str, path: Path, where: str | None = None) -> float | None:
    """The finite number of a name, with or without its uncertainty; None where there is none."""
    result = table.get(name)
    if isinstance(result, dict):
        result = result.get("uncertainValue", "no uncertainValue")
    if result is None:
        return None
    try:
        value = float("nan") if isinstance(result, bool) else float(result)
    except (TypeError, ValueError, OverflowError):
        value = float("nan")
    if not isfinite(value):
        message = f"expected a number, got {str(result)[:40]!r}"
        raise DataError(message, file=path, element=where, field=name)
    return value


class _Table:
    """The values of data points by wavelength, side and result."""

    def __init__(self, points: list[_Point], path: Path) -> None:
        self.path = path
        self.values: dict[tuple[Key, str, str], dict[str, _Point]] = defaultdict(dict)
        for point in points:
            if point.polar < 0 and point.key != "infrared":
                continue
            known = self.values[point.key, point.side, point.result]
            before = known.get(point.emergence)
            if before and before.polar == point.polar and before.value != point.value:
                raise DataError(
                    f"says otherwise than {before.where}: expected one state of one sample",
                    file=path,
                    element=point.where,
                    field=point.result,
                )
            if before is None or point.polar < before.polar:
                known[point.emergence] = point

    @property
    def wavelengths(self) -> list[float]:
        """Wavelengths [nm] that have values, rising."""
        return sorted({key for key, *_ in self.values if isinstance(key, float)})

    def has(self, key: Key) -> bool:
        """Whether transmittance and a reflectance are there."""
        found = {result for name, _, result in self.values if name == key}
        return {"transmittance", "reflectance"} <= found

    def value(self, key: Key, side: str, result: str) -> float | None:
        """A result of one side, all that leaves."""
        found = self.values.get((key, side, result), {})
        parts = {emergence: point.value for emergence, point in found.items()}
        direct, diffuse = parts.get("direct"), parts.get("diffuse")
        whole = parts.get("hemispherical", direct)
        if "hemispherical" not in parts and diffuse is not None:
            whole = (direct or 0.0) + diffuse
        if result == "transmittance" and whole is not None and key != "infrared":
            scattered = diffuse if direct is None else whole - direct
            if (scattered or 0.0) > SCATTERED:
                where = next(iter(found.values())).where
                message = f"scatters {scattered:.2f} of the light: expected a specular pane"
                raise DataError(message, file=self.path, element=where)
        return whole

    def either(self, key: Key, result: str) -> float | None:
        """A result of the front, else of the back."""
        front, back = (self.value(key, side, result) for side in SIDES)
        return back if front is None else front

    def triple(self, key: Key) -> tuple[float, float, float]:
        """Transmittance, front and back reflectance; a side that is not stated is as the other."""
        passed, returned = (self.either(key, name) for name in RESULTS[:2])
        if passed is None or returned is None:
            missing = RESULTS[0] if passed is None else RESULTS[1]
            element = f"{key:g} nm" if isinstance(key, float) else key
            raise DataError("is not stated", file=self.path, element=element, field=missing)
        back = self.value(key, "back", "reflectance")
        return passed, returned, returned if back is None else back


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
        emissivity=(_stated(measured, "emissivity_front", path), _stated(measured, "emissivity_back", path)),
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
            self.name,
            self.wavelength_nm,
            self.transmittance,
            self.reflectance_back,
            self.reflectance_front,
            self.thickness,
            self.conductivity,
            self.emissivity[::-1],
            self.infrared_transmittance,
            self.coated,
        )


def read_spectral_pane(path: str | PathLike[str], *, thickness: float | None = None) -> SpectralPane:
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
        file.name,
        wavelength_nm,
        tau,
        rho_front,
        rho_back,
        thickness,
        file.conductivity or 1.0,
        (front, back),
        file.infrared_transmittance or 0.0,
        file.coated,
    )


@dataclass(frozen=True, slots=True)
class BandValues:
    """A glazing in one band, per angle of incidence [A]."""

    transmittance: FloatArray  # [A]
    reflectance_front: FloatArray  # [A]
    reflectance_back: FloatArray  # [A]
    absorptance: FloatArray  # [A, n] of each pane, for light from outside


def spectral_glazing(
    panes: Sequence[SpectralPane], theta: ArrayLike = 0.0, *, spectrum: str | FloatArray = SPECTRA[0]
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


def spectral_transmittance(panes: Sequence[SpectralPane], wavelength_nm: ArrayLike, theta: ArrayLike) -> FloatArray:
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
        return float(np.trapezoid(np.interp(nm, wavelength, value) * sun, nm) / np.trapezoid(sun, nm))

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
