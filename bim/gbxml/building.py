"""A building from a gbXML file: `read_gbxml`.

A surface belongs to the one or two spaces that it names; for the second one it is turned round.
Openings lie in the plane of their surface.

Sources: gbXML schema 6.01 and 7.03, "Space", "Zone", "Construction", "WindowType", "Schedule",
"WeekSchedule", "DaySchedule".
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property, partial
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from bim.defaults import EPS, FACADE_REFLECTANCE, resistance_layer
from bim.drawn_building import DrawnModel, drawn_building
from bim.gbxml.document import SI, Document, read_document
from bim.model import Building, Construction, Element, MaterialLayer, Space
from bim.planes import newell_normal
from bim.polygon_rooms import DrawnFace, DrawnOpening, DrawnRoom, GlazingValues, SurfaceFinish, triangles_of_rings
from bim.report.issue import Issue
from bim.use import (
    CLOCK,
    DAYS,
    KINDS,
    DayRule,
    ScheduledValue,
    StatedUse,
    YearSchedule,
    day_of_year,
    hourly_means,
    vapour_g_h,
)

# of a window type or an opening: not read
PARTS = (
    "Glaze",
    "Gap",
    "Frame",
    "Blind",
    "Shade",
    "ShadeControl",
    "ShadingCoeff",
    "Reflectance",
    "Emittance",
    "GlazeConductivity",
)
ANGLES = ("incidentAngle", "solarIncidentAngle")  # attributes [deg]
SHADES = ("interiorShadeType", "exteriorShadeType")  # attributes of an opening, not read


class Constructions:
    """What the surfaces and openings of a document refer to, read when they do."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.issues: list[Issue] = []
        self._finishes: dict[str, SurfaceFinish] = {}
        self._windows: dict[str, GlazingValues] = {}

    @cached_property
    def _by_id(self) -> dict[str, dict[str, ElementTree.Element]]:
        return self.document.by_id(("Construction", "Layer", "Material", "WindowType"))

    def finish(self, name: str | None) -> SurfaceFinish:
        """Layers and reflectances of a construction; what it does not state is None."""
        if name is None:
            return SurfaceFinish()
        if name not in self._finishes:
            one = self._by_id["Construction"].get(name)
            if one is None:
                self._missing("constructionIdRef", f"no Construction {name!r:.60}", name)
            self._finishes[name] = SurfaceFinish() if one is None else self._finish(one)
        return self._finishes[name]

    def _missing(self, field: str, reason: str, where: str) -> None:
        issue = Issue("value-not-read", where, {"field": field, "reason": reason})
        if issue not in self.issues:
            self.issues.append(issue)

    def _finish(self, one: ElementTree.Element) -> SurfaceFinish:
        layers = self.document.optional(lambda: self._layers(one), self.issues) or []
        name = _name(one)
        construction = Construction(name, tuple(layers), self.document.file.name) if layers else None
        visible, solar = (self._share(one, "Reflectance", kind) for kind in ("IntVisible", "IntSolar"))
        outer = self._share(one, "Reflectance", "ExtVisible")
        absorbed = self._share(one, "Absorptance", "IntSolar")
        if solar is None and absorbed is not None:
            solar = 1.0 - absorbed
        emissivity = self._share(one, "Emittance", "IntIR")
        finish = SurfaceFinish(construction, visible, solar, outer=outer)
        return finish if emissivity is None else replace(finish, emissivity=emissivity)

    def _layers(self, one: ElementTree.Element) -> list[MaterialLayer]:
        """The layers of a construction, outermost first, as gbXML orders them."""
        layers = []
        for reference in one.iterfind("LayerId"):
            layer = self._referred(one, "Layer", reference.get("layerIdRef"))
            for inner in layer.iterfind("MaterialId"):
                material = self._referred(layer, "Material", inner.get("materialIdRef"))
                layers += self._layer(material)
        return layers

    def _referred(self, owner: ElementTree.Element, kind: str, name: str | None) -> ElementTree.Element:
        return self.document.referred(owner, kind, name, self._by_id)

    def _layer(self, material: ElementTree.Element) -> list[MaterialLayer]:
        """The layer of a material; none where it states no resistance."""
        name = _name(material)
        fields = ("Thickness", "Conductivity", "Density", "SpecificHeat")
        thickness, conductivity, density, capacity = (self._quantity(material, field) for field in fields)
        resistance = self._quantity(material, "R-value")
        if not thickness or not conductivity:
            if not resistance:
                values = {"material": name}
                self.issues.append(Issue("resistance-missing", material.get("id", ""), values))
                return []
        try:
            if thickness and conductivity:
                layer = replace(EPS, name=name, thickness=thickness, conductivity=conductivity)
            else:
                layer = resistance_layer(name, resistance, thickness)
            heavy = density or layer.density, capacity or layer.heat_capacity
            return [replace(layer, density=heavy[0], heat_capacity=heavy[1])]
        except ValueError as error:
            raise self.document.fault(str(error), material) from None

    def is_glass(self, opening: ElementTree.Element) -> bool:
        """Whether an opening of any type has a window type, or a construction that passes light."""
        return opening.get("windowTypeIdRef", "") in self._by_id["WindowType"] or bool(self.transmittance(opening))

    def transmittance(self, surface: ElementTree.Element) -> float | None:
        """Visible transmittance that a surface's construction states."""
        one = self._by_id["Construction"].get(surface.get("constructionIdRef", ""))
        return None if one is None else self._share(one, "Transmittance", "Visible")

    def window(self, opening: ElementTree.Element) -> GlazingValues:
        """What an opening's window type, else its construction states."""
        name = opening.get("windowTypeIdRef") or opening.get("constructionIdRef") or ""
        guid = opening.get("id", "")
        for shade in SHADES:
            if opening.get(shade, "None") not in ("None", "NoShade", ""):
                values = {"element": _name(opening), "part": shade, "glazing": name}
                self.issues.append(Issue("glazing-part-not-read", guid, values))
        known = self._by_id["WindowType"].get(name)
        if known is None:
            known = self._by_id["Construction"].get(name)
        if known is None and name:
            self._missing("windowTypeIdRef", f"no WindowType {name!r:.60}", guid)
        if name not in self._windows:
            values = GlazingValues(name=name) if known is None else self._values(known)
            self._windows[name] = values
        of_type, own = self._windows[name], self._values(opening)  # the opening's own go first
        stated = {field: getattr(own, field) for field in ("u_value", "g_value", "visible", "solar")}
        return replace(of_type, **{field: v for field, v in stated.items() if v is not None})

    def _values(self, known: ElementTree.Element) -> GlazingValues:
        """What a window type states; where its U and g are both nought, it states nothing."""
        name, panes = _name(known), len(known.findall("Glaze")) or None
        g_value = self._share(known, "SolarHeatGainCoeff")
        u_value = self._quantity(known, "U-value") or None
        if u_value is None and g_value == 0:
            values = {"type": name}
            self.issues.append(Issue("window-type-of-zeros", known.get("id", ""), values))
            return GlazingValues(panes=panes, name=name)
        visible, solar = (self._share(known, "Transmittance", k) for k in ("Visible", "Solar"))
        unread = {one.tag for one in known if one.tag in PARTS}
        if None not in (u_value, g_value, visible):  # those of panes and gaps are not needed
            unread -= {"Glaze", "Gap"}
        for part in sorted(unread):
            values = {"element": name, "part": part, "glazing": known.get("id", "")}
            self.issues.append(Issue("glazing-part-not-read", known.get("id", ""), values))
        return GlazingValues(u_value, g_value, visible, solar, panes, name)

    def _quantity(self, owner: ElementTree.Element, name: str) -> float | None:
        """A quantity [SI]; None where it is not stated or cannot be read."""
        return self.document.optional(lambda: self.document.quantity(owner, name), self.issues)

    def _share(self, owner: ElementTree.Element, what: str, kind: str | None = None) -> float | None:
        """A share of 1 of that kind at normal incidence; None as for `_quantity`."""
        return self.document.optional(lambda: self._stated(owner, what, kind), self.issues)

    def _stated(self, owner: ElementTree.Element, what: str, kind: str | None) -> float | None:
        """Raises: `DataError` where it is stated at other angles alone."""
        kinds = (kind, kind and kind.replace("Visible", "Vis"))  # of the schema, earlier exports
        stated = [one for one in owner.iterfind(what) if kind is None or one.get("type") in kinds]
        for one in stated:
            if {one.get(angle, "0") for angle in ANGLES} <= {"0", "0.0", ""}:
                return self._fraction(owner, one)
        if stated:
            raise self.document.fault("expected the value of normal incidence", owner, what)
        return None

    def _fraction(self, owner: ElementTree.Element, one: ElementTree.Element) -> float:
        """A number from 0 to 1, or in per cent."""
        value = self.document.number(one, least=0.0, most=100.0)
        unit = one.get("unit", "Fraction")
        if unit not in ("Fraction", "Percent"):
            message = f"unit {unit[:40]!r}, expected Fraction or Percent"
            raise self.document.fault(message, owner, one.tag)
        value = value / 100.0 if unit == "Percent" else value
        if value > 1:
            raise self.document.fault(f"expected 0 to 1, got {value:g}", owner, one.tag)
        return value


T = TypeVar("T")
WEEKDAYS, WEEKEND = KINDS[:5], KINDS[5:7]
DAY_TYPES = {  # the kinds of days of each; those of design days are in no year
    "Weekday": WEEKDAYS,
    "Weekend": WEEKEND,
    "Holiday": ("holiday",),
    "WeekendOrHoliday": (*WEEKEND, "holiday"),
    "All": KINDS,
    "AllOtherDays": KINDS,
    **{kind[:3].capitalize(): (kind,) for kind in KINDS[:7]},
}
DESIGN_DAYS = ("HeatingDesignDay", "CoolingDesignDay", "CustomDay1", "CustomDay2")
CELSIUS = {"C": (0.0, 1.0), "F": (32.0, 1.8), "K": (273.15, 1.0), "R": (491.67, 1.8)}
HELD = {"Heated": "heating_c", "Cooled": "cooling_c"}
PERSON_AREA = {"SquareMPerPerson": 1.0, "SquareFtPerPerson": 0.3048**2}


class UseReader:
    """The uses of a document's spaces, with the schedules and zones that they refer to."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self._schedules: dict[str, YearSchedule] = {}
        self._issues: list[Issue] = []

    @property
    def issues(self) -> tuple[Issue, ...]:
        """Values that are not used, or may mean something else, each once."""
        return tuple(dict.fromkeys(self._issues))

    def use(self, space: Space) -> StatedUse | None:
        """What the file states of a room's use; None where it states nothing.

        Raises: `DataError` that names the element and the field.
        """
        element = self._by_id["Campus/Building/Space"].get(space.guid)
        if element is None:
            return None
        name = element.get("zoneIdRef")
        zone = self._optional(lambda: self._referred(element, "Zone", name)) if name else None
        stated = self._optional(lambda: dict(self._people(element, space))) or {}
        stated |= dict(self._gains(element, space))
        stated |= dict(self._air(element, zone, stated.get("persons"), space))
        stated |= dict(self._set_points(element, zone))
        return StatedUse(**stated) if stated else None

    def _optional(self, read: Callable[[], T]) -> T | None:
        return self.document.optional(read, self._issues)

    def _quantity(self, owner: ElementTree.Element, name: str) -> float | None:
        """A quantity [SI]; None where it is not stated or cannot be read."""
        return self._optional(lambda: self.document.quantity(owner, name))

    @cached_property
    def _by_id(self) -> dict[str, dict[str, ElementTree.Element]]:
        paths = ("Campus/Building/Space", "Zone", "Schedule", "WeekSchedule", "DaySchedule")
        return self.document.by_id(paths)

    def _share(self, element: ElementTree.Element, field: str) -> YearSchedule | None:
        name = element.get(field) or element.get("scheduleIdRef")
        return None if not name else self._schedule(element, name)

    def _people(self, element: ElementTree.Element, space: Space) -> Iterator[tuple[str, Any]]:
        number = element.find("PeopleNumber")
        if number is None:
            return
        count, unit = self.document.number(number, least=0.0), number.get("unit", "NumberOfPeople")
        if unit in PERSON_AREA:
            count = space.floor_area / (PERSON_AREA[unit] * count) if count else 0.0
        elif unit != "NumberOfPeople":
            raise self.document.fault(f"unit {unit[:40]!r}", element, "PeopleNumber")
        yield "persons", ScheduledValue(count, self._share(element, "peopleScheduleIdRef"))
        heat = {
            one.get("heatGainType", "Total"): self._si("PeopleHeatGain", one, element)
            for one in element.iterfind("PeopleHeatGain")
        }
        if "Latent" not in heat and {"Total", "Sensible"} <= set(heat):
            heat["Latent"] = heat["Total"] - heat["Sensible"]
        if "Sensible" not in heat and {"Total", "Latent"} <= set(heat):
            heat["Sensible"] = heat["Total"] - heat["Latent"]
        if "Sensible" in heat:
            yield "person_w", heat["Sensible"]
        if "Latent" in heat:
            yield "person_vapour_g_h", vapour_g_h(heat["Latent"])
        if set(heat) == {"Total"}:
            self._issues.append(Issue("heat-gain-not-split", self.document.file.name))

    def _gains(self, element: ElementTree.Element, space: Space) -> Iterator[tuple[str, Any]]:
        for field, key, schedule in (
            ("LightPowerPerArea", "lighting_w", "lightScheduleIdRef"),
            ("EquipPowerPerArea", "equipment_w", "equipmentScheduleIdRef"),
        ):
            power = self._optional(partial(self._power, element, field, schedule, space))
            if power is not None:
                yield key, power

    def _power(self, element: ElementTree.Element, field: str, schedule: str, space: Space) -> ScheduledValue | None:
        power = self.document.quantity(element, field)
        if power is None:
            return None
        return ScheduledValue(power * space.floor_area, self._share(element, schedule))

    def _air(
        self,
        element: ElementTree.Element,
        zone: ElementTree.Element | None,
        persons: ScheduledValue | None,
        space: Space,
    ) -> Iterator[tuple[str, Any]]:
        leaks = self._quantity(element, "InfiltrationFlowPerArea")
        if leaks is not None:
            outside = [f.area for f in space.faces if f.adjacency == "outside"]
            outside += [window.area for window in space.windows]
            yield "infiltration_m3_s", ScheduledValue(leaks * sum(outside))
        ventilation = self._optional(lambda: self._ventilation(element, zone, persons, space))
        if ventilation is not None:
            yield "ventilation_m3_s", ventilation

    def _ventilation(
        self,
        element: ElementTree.Element,
        zone: ElementTree.Element | None,
        persons: ScheduledValue | None,
        space: Space,
    ) -> ScheduledValue | None:
        """Outdoor air [m3/s] of the space, else of its zone; None where neither states any."""
        flow, stated = 0.0, False
        amounts = {
            "OAFlowPerArea": space.floor_area,
            "OAFlowPerPerson": 0.0 if persons is None else persons.peak,
            "OAFlowPerSpace": 1.0,
        }
        for owner in (element, zone):
            if owner is None or stated:
                continue
            for field, amount in amounts.items():
                value = self._quantity(owner, field)
                flow, stated = flow + (value or 0.0) * amount, stated or value is not None
            changes = owner.find("AirChangesPerHour")
            if changes is not None:
                flow += self.document.number(changes, least=0.0) * space.volume / 3600.0
                stated = True
        if not stated:
            return None
        name = None if zone is None else zone.get("outAirSchedIdRef")
        return ScheduledValue(flow, None if not name else self._schedule(zone, name))

    def _set_points(self, element: ElementTree.Element, zone: ElementTree.Element | None) -> Iterator[tuple[str, Any]]:
        if zone is None:
            return
        kind = element.get("conditionType", "HeatedAndCooled")
        for word, field, name in (
            ("Heated", "DesignHeatT", "heatSchedIdRef"),
            ("Cooled", "DesignCoolT", "coolSchedIdRef"),
        ):
            if word in kind:
                values = self._optional(partial(self._set_point, zone, field, name))
                if values is not None:
                    yield HELD[word], values

    def _set_point(self, zone: ElementTree.Element, field: str, name: str) -> YearSchedule | None:
        """Set point [C] of a zone's schedule, else its design temperature all year."""
        file_unit = self.document.root.get("temperatureUnit", "C")
        schedule, design = zone.get(name), zone.find(field)
        if schedule:
            values = self._schedule(zone, schedule)
            return YearSchedule(values.name, self._celsius(values.values, file_unit, zone))
        if design is None:
            return None
        stated = np.array(self.document.number(design, least=-459.67, most=1000.0))
        constant = float(self._celsius(stated, design.get("unit", file_unit), zone))
        self._issues.append(Issue("set-point-without-schedule", self.document.file.name, {"field": field}))
        return YearSchedule.constant(field, constant)

    def _celsius(self, values: np.ndarray, unit: str, owner: ElementTree.Element) -> np.ndarray:
        if unit not in CELSIUS:
            raise self.document.fault(f"temperature unit {unit[:40]!r}", owner)
        zero, degree = CELSIUS[unit]
        return (values - zero) / degree

    def _si(self, field: str, one: ElementTree.Element, owner: ElementTree.Element) -> float:
        unit = one.get("unit", next(iter(SI[field])))
        if unit not in SI[field]:
            raise self.document.fault(f"unit {unit[:40]!r}", owner, field)
        return SI[field][unit] * self.document.number(one, least=0.0)

    def _schedule(self, owner: ElementTree.Element, name: str) -> YearSchedule:
        if name not in self._schedules:
            element = self._referred(owner, "Schedule", name)
            label = (element.findtext("Name") or "").strip() or name
            self._schedules[name] = YearSchedule.of_rules(label, self._rules(element))
        return self._schedules[name]

    def _referred(self, owner: ElementTree.Element, kind: str, name: str | None) -> ElementTree.Element:
        return self.document.referred(owner, kind, name, self._by_id)

    def _rules(self, schedule: ElementTree.Element) -> Iterator[DayRule]:
        """The days of a schedule; single kinds of days go before those of several."""
        for part in schedule.iterfind("YearSchedule"):
            dates = self._date(part, "BeginDate", 0), self._date(part, "EndDate", DAYS - 1)
            for reference in part.iterfind("WeekScheduleId"):
                week = self._referred(part, "WeekSchedule", reference.get("weekScheduleIdRef"))
                days = [(self._kinds(one, week), one) for one in week.iterfind("Day")]
                for kinds, one in sorted(days, key=lambda pair: len(pair[0])):
                    day = self._referred(week, "DaySchedule", one.get("dayScheduleIdRef"))
                    if kinds:
                        yield DayRule(self._day(day), kinds, dates)

    def _kinds(self, day: ElementTree.Element, week: ElementTree.Element) -> tuple[str, ...]:
        kind = day.get("dayType", "All")
        if kind not in DAY_TYPES and kind not in DESIGN_DAYS:
            raise self.document.fault(f"{kind[:40]!r}", week, "dayType")
        return DAY_TYPES.get(kind, ())

    def _day(self, day: ElementTree.Element) -> np.ndarray:
        """Hourly values [24] of a day of any number of equal steps."""
        values = [self.document.number(one) for one in day.iterfind("ScheduleValue")]
        if not values or len(values) > CLOCK * 60:
            raise self.document.fault(f"holds {len(values)} values", day, "ScheduleValue")
        return hourly_means([CLOCK * n / len(values) for n in range(len(values))], values)

    def _date(self, part: ElementTree.Element, field: str, default: int) -> int:
        text = (part.findtext(field) or "").strip()
        if not text:
            return default
        try:
            return day_of_year(int(text[5:7]), int(text[8:10]))
        except ValueError:
            raise self.document.fault(f"expected YYYY-MM-DD, got {text[:20]!r}", part, field) from None


# of a surface: kind of the face of its first room, and what lies beyond with one room
SURFACE_KINDS = {
    "InteriorWall": ("wall", "adiabatic"),
    "ExteriorWall": ("wall", "outside"),
    "UndergroundWall": ("wall", "ground"),
    "Roof": ("", "outside"),
    "Ceiling": ("", "adiabatic"),
    "UndergroundCeiling": ("", "ground"),
    "InteriorFloor": ("", "adiabatic"),
    "RaisedFloor": ("floor", "outside"),
    "ExposedFloor": ("floor", "outside"),
    "SlabOnGrade": ("floor", "ground"),
    "UndergroundSlab": ("floor", "ground"),
    "Air": ("", "adiabatic"),
    "EmbeddedColumn": ("wall", "adiabatic"),
}
OUTDOORS = ("Shade", "FreestandingColumn")
LEVEL = 0.7  # a surface whose normal is so near to the vertical is no wall, whatever its type says
REVEAL = 1.0  # but for strips narrower than this [m]: sill and head of a window's recess
DOORS = ("NonSlidingDoor", "Air")
GLAZED = ("FixedWindow", "OperableWindow", "FixedSkylight", "OperableSkylight", "SlidingDoor")


def read_gbxml(path: str | PathLike[str], *, join: Sequence[str] = (), furniture: bool = False) -> Building:
    """The building of a gbXML file, in metres, turned to true north.

    Read are spaces, surfaces, openings, shades, constructions with layers, window types, location;
    people, lamps, equipment, outdoor air and set points of spaces and zones, with their schedules.

    Args:
        join: rooms to make one, as "Hall + Living"; air between them goes.
        furniture: not in gbXML.

    Raises: `DataError` that names file, element and field; what the model lacks is in the
        building's `issues`.
    """
    path = Path(path)
    document = read_document(path)
    building = drawn_building(_Reader(document).drawn(), join=join, furniture=furniture)
    reader = UseReader(document)
    uses = {space.guid: reader.use(space) for space in building.spaces}
    known = {guid: use for guid, use in uses.items() if use is not None}
    return replace(building, uses=known, issues=(*building.issues, *reader.issues))


class _Reader:
    """A document with what its surfaces refer to."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.constructions = Constructions(document)
        self.issues: list[Issue] = []
        self.level: Counter[str] = Counter()  # surfaces that lie level, by the type of wall named
        self.turn = self._turn()

    def drawn(self) -> DrawnModel:
        """The document as polygons."""
        document, root = self.document, self.document.root
        spaces: dict[str, ElementTree.Element] = {}
        for space in document.all("Campus/Building/Space"):
            if spaces.setdefault(space.get("id", ""), space) is not space:
                raise document.fault("is the id of another space too", space, "id")
        faces: dict[str, list[DrawnFace]] = {guid: [] for guid in spaces}
        elements: list[Element] = []
        unplaced: Counter[str] = Counter()
        for surface in document.all("Campus/Surface"):
            ring = document.ring(surface)
            if ring is None:
                raise document.fault("has no polygon", surface, "PlanarGeometry/PolyLoop")
            beside = self._beside(surface, spaces)
            kind = surface.get("surfaceType", "")
            self._note_glass(surface, of_room=kind not in OUTDOORS and bool(beside))
            if kind in OUTDOORS or not beside:
                elements += self._shade(surface, ring @ self.turn.T)
            elif kind not in SURFACE_KINDS:
                unplaced[kind] += 1
            else:
                for number, guid in enumerate(beside):
                    faces[guid].append(self._face(surface, ring @ self.turn.T, beside, number))
        self.issues += [
            Issue("surfaces-of-unknown-type", document.file.name, {"count": n, "type": k[:40]})
            for k, n in unplaced.items()
        ]
        self.issues += [
            Issue("walls-level", document.file.name, {"count": n, "type": k}) for k, n in self.level.items()
        ]
        path = "Campus/Building/BuildingStorey"
        storeys = {guid: _name(one) for guid, one in document.by_id((path,))[path].items()}
        rooms = tuple(
            self._room(one, faces[guid], storeys)
            for guid, one in spaces.items()
            if faces[guid] or not self._is_empty(one)
        )
        places = (("Latitude", 90.0), ("Longitude", 180.0), ("Elevation", 1e5))
        latitude, longitude, elevation = (self._location(*place) for place in places)
        campus = root.find("Campus")
        name = "" if campus is None else _name(campus)
        return DrawnModel(
            document.file,
            name or document.file.stem,
            rooms,
            tuple(elements),
            issues=(*self.issues, *self.constructions.issues),
            latitude_deg=latitude,
            longitude_deg=longitude,
            elevation=(elevation or 0.0) * document.length,
        )

    def _location(self, field: str, most: float) -> float | None:
        element = self.document.root.find(f"Campus/Location/{field}")
        if element is None or not (element.text or "").strip():
            return None
        return self.document.optional(lambda: self.document.number(element, least=-most, most=most), self.issues)

    def _turn(self) -> NDArray[np.float64]:
        """Rotation [3, 3] from the model's axes to the world's, by CADModelAzimuth."""
        azimuth = self._location("CADModelAzimuth", 360.0)
        if not azimuth:
            return np.eye(3)
        values = {"azimuth": azimuth}
        self.issues.append(Issue("model-turned", self.document.file.name, values))
        c, s = np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))
        return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])

    def _beside(self, surface: ElementTree.Element, spaces: dict[str, ElementTree.Element]) -> list[str]:
        """The spaces that a surface names, each once."""
        named = [one.get("spaceIdRef", "") for one in surface.iterfind("AdjacentSpaceId")]
        for name in named:
            if name not in spaces:
                raise self.document.fault(f"no Space {name!r:.60}", surface, "AdjacentSpaceId")
        return list(dict.fromkeys(named))[:2]

    def _note_glass(self, surface: ElementTree.Element, *, of_room: bool) -> None:
        """Report a surface whose construction transmits light, and openings of shades."""
        materials = [surface.get("constructionIdRef", "")]
        materials = materials if self.constructions.transmittance(surface) else []
        if not of_room:
            materials += [_name(opening) for opening in surface.iterfind("Opening")]
        for material in materials:
            values = {"element": _name(surface), "material": material}
            self.issues.append(Issue("shade-taken-as-opaque", surface.get("id", ""), values))

    def _face(
        self, surface: ElementTree.Element, ring: NDArray[np.float64], beside: Sequence[str], number: int
    ) -> DrawnFace:
        """The surface as the face of one of its rooms; number 1 sees its other side."""
        guid, kind = surface.get("id", ""), surface.get("surfaceType", "")
        face_kind, alone = SURFACE_KINDS[kind]
        between = len(beside) == 2
        finish = self.constructions.finish(surface.get("constructionIdRef"))
        if face_kind == "wall" and _is_slab(ring):  # OpenStudio's type of what is adiabatic
            face_kind = ""
            self.level[kind] += not number
        if number:
            ring, finish = ring[::-1], finish.turned()
            guid, face_kind = f"{guid}-2", face_kind if face_kind == "wall" else ""
        return DrawnFace(
            guid,
            _name(surface),
            face_kind,
            (ring,),
            "space" if between else alone,
            beside[1 - number] if between else None,
            finish,
            tuple(
                one
                for k, opening in enumerate(surface.iterfind("Opening"))
                if (one := self._opening(opening, f"{surface.get('id')}-opening-{k}", number))
            ),
            kind == "Air",
        )

    def _opening(self, opening: ElementTree.Element, without_id: str, number: int) -> DrawnOpening | None:
        ring, guid = self.document.ring(opening), opening.get("id") or without_id
        kind = opening.get("openingType", "")
        if ring is None or kind == "Air":
            if not number:
                code = "opening-without-polygon" if ring is None else "opening-of-air"
                self.issues.append(Issue(code, guid, {"element": _name(opening)}))
            return None
        guid = f"{guid}-2" if number else guid
        ring = ring @ self.turn.T
        if kind not in (*GLAZED, *DOORS) and not number:
            reason = f"{kind[:40]!r}, expected of {', '.join((*GLAZED, *DOORS))}"
            values = {"field": "openingType", "reason": reason}
            self.issues.append(Issue("value-not-read", opening.get("id") or without_id, values))
        refers = kind not in DOORS and opening.get("windowTypeIdRef")
        if kind in GLAZED or refers or self.constructions.is_glass(opening):
            values, own = self.constructions.window(opening), opening.get("id") or without_id
            return DrawnOpening(guid, _name(opening), ring, glazing=values, both_sides=own)
        finish = self.constructions.finish(opening.get("constructionIdRef"))
        return DrawnOpening(guid, _name(opening), ring, finish.turned() if number else finish)

    def _shade(self, surface: ElementTree.Element, ring: NDArray[np.float64]) -> list[Element]:
        finish = self.constructions.finish(surface.get("constructionIdRef"))
        value = FACADE_REFLECTANCE if finish.outer is None else finish.outer
        triangles = triangles_of_rings((ring,))
        if not len(triangles):
            return []
        guid = surface.get("id", "")
        return [Element(guid, _name(surface), "IfcShadingDevice", triangles, value, value)]

    def _is_empty(self, space: ElementTree.Element) -> bool:
        """Whether a space that no surface bounds is none: OpenStudio writes groups of shades so."""
        if any(space.find(field) is not None for field in ("Area", "Volume", "ShellGeometry")):
            return False
        values = {"room": _name(space)}
        self.issues.append(Issue("space-without-surfaces", space.get("id", ""), values))
        return True

    def _room(self, space: ElementTree.Element, faces: Sequence[DrawnFace], storeys: dict[str, str]) -> DrawnRoom:
        area, volume = (
            self.document.optional(partial(self.document.size, space, field), self.issues)
            for field in ("Area", "Volume")
        )
        return DrawnRoom(
            space.get("id", ""),
            _name(space),
            tuple(faces),
            storeys.get(space.get("buildingStoreyIdRef", ""), ""),
            stated_area=area or None,
            stated_volume=volume or None,
        )


def _is_slab(ring: NDArray[np.float64]) -> bool:
    """Whether a polygon [N, 3] is nearer to level than to upright, and no strip."""
    normal = newell_normal(ring)
    area = float(np.linalg.norm(normal))
    longest = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1).max()
    return bool(abs(normal[2]) > LEVEL * area) and area > REVEAL * longest


def _name(element: ElementTree.Element) -> str:
    return (element.findtext("Name") or "").strip() or element.get("id", "")
