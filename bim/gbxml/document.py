"""A gbXML file as elements without namespaces, with its units: `read_document`.

Source: gbXML schema 0.37 to 7.03 (https://www.gbxml.org).
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bim.report.issue import Issue
from bim.xml_elements import xml_elements
from mitsuba_cfs.errors import DataError

T = TypeVar("T")
MOST_BYTES = 256 << 20
METRES = {
    "Kilometers": 1e3,
    "Meters": 1.0,
    "Centimeters": 0.01,
    "Millimeters": 1e-3,
    "Miles": 1609.344,
    "Yards": 0.9144,
    "Feet": 0.3048,
    "Inches": 0.0254,
}
SQUARE_METRES = {
    "SquareKilometers": 1e6,
    "SquareMeters": 1.0,
    "SquareCentimeters": 1e-4,
    "SquareMillimeters": 1e-6,
    "SquareMiles": 1609.344**2,
    "SquareYards": 0.9144**2,
    "SquareFeet": 0.3048**2,
    "SquareInches": 0.0254**2,
}
CUBIC_METRES = {
    "CubicKilometers": 1e9,
    "CubicMeters": 1.0,
    "CubicCentimeters": 1e-6,
    "CubicMillimeters": 1e-9,
    "CubicMiles": 1609.344**3,
    "CubicYards": 0.9144**3,
    "CubicFeet": 0.3048**3,
    "CubicInches": 0.0254**3,
}
SIZES = {"Area": ("areaUnit", SQUARE_METRES), "Volume": ("volumeUnit", CUBIC_METRES)}
# units of a quantity's own attribute, as factors to SI
BTU_PER_HOUR, CFM, SQUARE_FOOT = 0.29307107, 4.71947443e-4, 0.3048**2
WATT_PER_AREA = {"WattPerSquareMeter": 1.0, "WattPerSquareFoot": 1 / SQUARE_FOOT}
FLOW_PER_AREA = {
    "LPerSecPerSquareM": 1e-3,
    "CFMPerSquareFoot": CFM / SQUARE_FOOT,
    "CubicMPerHourPerSquareM": 1 / 3600,
    "CubicMPerSecPerSquareM": 1.0,
}
FLOW = {
    "LPerSec": 1e-3,
    "CFM": CFM,
    "CubicMPerHr": 1 / 3600,
    "CubicMPerSec": 1.0,
    "LPerSecPerPerson": 1e-3,
    "CFMPerPerson": CFM,
}
BTU_INCH = 0.1442279  # BTU in/(h ft2 F) in W/(m K)
SI = {
    "U-value": {"WPerSquareMeterK": 1.0, "BtuPerHourSquareFtF": 5.678263},
    "R-value": {"SquareMeterKPerW": 1.0, "HrSquareFtFPerBTU": 1 / 5.678263},
    "Conductivity": {"WPerMeterK": 1.0, "WPerCmC": 100.0, "BtuPerHourFtF": 12 * BTU_INCH},
    "Density": {"KgPerCubicM": 1.0, "GramsPerCubicCm": 1e3, "LbsPerCubicIn": 27679.905, "LbsPerCubicFt": 16.018463},
    "SpecificHeat": {"JPerKgK": 1.0, "BTUPerLbF": 4186.8},
    "Thickness": METRES,
    "PeopleHeatGain": {"WattPerPerson": 1.0, "BtuPerHourPerson": BTU_PER_HOUR},
    "LightPowerPerArea": WATT_PER_AREA,
    "EquipPowerPerArea": WATT_PER_AREA,
    "InfiltrationFlowPerArea": FLOW_PER_AREA,
    "OAFlowPerArea": FLOW_PER_AREA,
    "OAFlowPerPerson": FLOW,
    "OAFlowPerSpace": FLOW,
    "OAFlowPerZone": FLOW,
}


@dataclass(frozen=True, slots=True)
class Document:
    """The root element and the factor of its lengths to metres."""

    file: Path
    root: ElementTree.Element
    length: float

    def fault(self, message: str, element: ElementTree.Element, field: str | None = None):
        """An error that names the file, the element by its id, and the field."""
        name = f"{element.tag} {element.get('id', '')}".strip()
        return DataError(message, file=self.file, element=name, field=field)

    def all(self, path: str) -> Iterator[ElementTree.Element]:
        """The elements of a path that have an id."""
        for element in self.root.iterfind(path):
            if not element.get("id"):
                raise self.fault("has no id", element, "id")
            yield element

    def by_id(self, kinds: Sequence[str]) -> dict[str, dict[str, ElementTree.Element]]:
        """The elements of some paths by their id; nothing refers to those without one."""
        return {kind: {one.get("id", ""): one for one in self.root.iterfind(kind) if one.get("id")} for kind in kinds}

    def referred(
        self,
        owner: ElementTree.Element,
        kind: str,
        name: str | None,
        known: Mapping[str, Mapping[str, ElementTree.Element]],
    ) -> ElementTree.Element:
        """The element that another one refers to.

        Args: known: of `by_id`.
        """
        element = known[kind].get(name or "")
        if element is None:
            raise self.fault(f"no {kind} {name!r:.60}", owner)
        return element

    def number(self, element: ElementTree.Element, *, least: float = -math.inf, most: float = math.inf) -> float:
        """The number that an element holds, within limits."""
        text = (element.text or "").strip()
        try:
            value = float(text)
        except ValueError:
            raise self.fault(f"expected a number, got {text[:40]!r}", element) from None
        if not (math.isfinite(value) and least <= value <= most):
            raise self.fault(f"expected {least:g} to {most:g}, got {text[:40]}", element)
        return value

    @property
    def _length_unit(self) -> str:
        """The unit of lengths that state none, as the schema has it."""
        return next(unit for unit, factor in METRES.items() if factor == self.length)

    def quantity(self, owner: ElementTree.Element, name: str) -> float | None:
        """A quantity [SI] of an element by the unit that it states; None where it has none."""
        element = owner.find(name)
        if element is None:
            return None
        units = SI[name]
        unit = element.get("unit")
        if unit is None:  # of lengths the file's own unit, of the others the SI unit
            unit = self._length_unit if units is METRES else next(iter(units))
        if unit not in units:
            raise self.fault(f"unit {unit[:40]!r}, expected of {', '.join(units)}", owner, name)
        try:
            return units[unit] * self.number(element, least=0.0)
        except DataError as error:
            raise self.fault(error.message, owner, name) from None

    def size(self, owner: ElementTree.Element, name: str) -> float | None:
        """Area [m2] or Volume [m3] of an element by the file's unit; None where it has none."""
        element = owner.find(name)
        if element is None or not (element.text or "").strip():
            return None
        field, units = SIZES[name]
        unit = self.root.get(field, "SquareMeters" if name == "Area" else "CubicMeters")
        if unit not in units:
            message = f"{unit[:40]!r}, expected of {', '.join(units)}"
            raise self.fault(message, self.root, field)
        try:
            return units[unit] * self.number(element, least=0.0)
        except DataError as error:
            raise self.fault(error.message, owner, name) from None

    def optional(self, read: Callable[[], T], issues: list[Issue]) -> T | None:
        """An optional value; None where it cannot be read.

        Args: issues: of the model, to which the fault is added once.
        """
        try:
            return read()
        except DataError as error:
            values = {"field": error.field or "a value", "reason": error.message}
            issue = Issue("value-not-read", error.element or self.file.name, values)
            if issue not in issues:
                issues.append(issue)
            return None

    def ring(self, owner: ElementTree.Element) -> NDArray[np.float64] | None:
        """The polygon [N, 3] [m] of an element's PlanarGeometry; None without one."""
        loop = owner.find("PlanarGeometry/PolyLoop")
        if loop is None:
            return None
        points = []
        for point in loop.iterfind("CartesianPoint"):
            corner = [self._coordinate(one, owner) for one in point.iterfind("Coordinate")]
            if len(corner) != 3:
                message = f"expected 3 coordinates, got {len(corner)}"
                raise self.fault(message, owner, "CartesianPoint")
            points.append(corner)
        if len(points) < 3:
            raise self.fault(f"expected 3 points or more, got {len(points)}", owner, "PolyLoop")
        return self.length * np.asarray(points)

    def _coordinate(self, element: ElementTree.Element, owner: ElementTree.Element) -> float:
        try:
            return self.number(element, least=-1e9, most=1e9)
        except DataError as error:
            raise self.fault(error.message, owner, "Coordinate") from None


def read_document(path: Path) -> Document:
    """The elements of a gbXML file.

    Raises: `DataError` for a file that cannot be read, is no gbXML, or declares entities.
    """
    ((root, _),) = xml_elements(path, "gbXML", depth=1, most_bytes=MOST_BYTES)

    unit = root.get("lengthUnit", "Meters")
    if unit not in METRES:
        message = f"{unit[:40]!r}, expected of {', '.join(METRES)}"
        raise DataError(message, file=path, element="gbXML", field="lengthUnit")
    return Document(path, root, METRES[unit])
