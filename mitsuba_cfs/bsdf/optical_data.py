"""Optical data of a building envelope component, as building-envelope-data's schema has them.

A list of `data`, each with `componentCharacteristics` and `dataPoints`; a point has an incidence,
an emergence and results.  Read are values near normal incidence (10 degrees or less): by
wavelength, and the integrals `visible` and `infrared`.  Values of the non-prime surface are the
front's, which often faces the exterior as the schema says, those of the prime surface the back's;
points that name no surface, or `symmetric`, are both's.

Source: github.com/building-envelope-data/api, schemas/opticalData.json 1.1.0 (the form of 1.0 is
read too: `dataPoints` without `data`).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from mitsuba_cfs.errors import DataError

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
        thickness_mm=_stated(_table(own, "physicalProperties", path), "thickness", path),
        conductivity=_stated(_table(own, "materialBulkProperties", path), "conductivity", path),
        coated=_differs(rows, visible, infrared)
        if coated_side is None
        else coated_side not in ("NEITHER", "NA"),
    )


def _differs(
    rows: list[list[float]],
    visible: tuple[float, float, float] | None,
    emissivity: list[float | None],
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
            value = _stated(results, result, path, where)
            if value is not None:
                for side in sides:
                    yield _Point(
                        where, key, side, result, leaves, polar, _share(value, path, where, result)
                    )


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
    polar = _stated(direction, "polar", path, where) if isinstance(direction, dict) else None
    if polar is None or not 0 <= polar <= 90:
        message = "expected polar from 0 to 90 degrees or hemispherical"
        raise DataError(message, file=path, element=where, field="direction")
    return polar


def _key(wavelengths: dict[str, Any], path: Path, where: str) -> Key:
    integral = wavelengths.get("integral")
    if isinstance(integral, str) and integral in INTEGRALS:
        return integral
    nm = _stated(wavelengths, "wavelength", path, where)
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


def _stated(table: dict[str, Any], name: str, path: Path, where: str | None = None) -> float | None:
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
