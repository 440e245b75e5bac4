"""How a gbXML file says that its spaces are used: people, lamps, equipment, air, set points.

Source: gbXML schema 6.01 and 7.03, "Space", "Zone", "Schedule", "WeekSchedule", "DaySchedule".
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Iterator
from functools import cached_property, partial
from typing import Any, TypeVar

import numpy as np

from bim.gbxml.document import SI, Document
from bim.model import Space
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

T = TypeVar("T")
WEEKDAYS, WEEKEND = KINDS[:5], KINDS[5:7]
DAY_TYPES = {  # the kinds of days of each; those of design days are in no year
    "Weekday": WEEKDAYS, "Weekend": WEEKEND, "Holiday": ("holiday",),
    "WeekendOrHoliday": (*WEEKEND, "holiday"), "All": KINDS, "AllOtherDays": KINDS,
    **{kind[:3].capitalize(): (kind,) for kind in KINDS[:7]},
}  # fmt: skip
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
        found = element.find("PeopleNumber")
        if found is None:
            return
        count, unit = self.document.number(found, least=0.0), found.get("unit", "NumberOfPeople")
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

    def _power(
        self, element: ElementTree.Element, field: str, schedule: str, space: Space
    ) -> ScheduledValue | None:
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

    def _set_points(
        self, element: ElementTree.Element, zone: ElementTree.Element | None
    ) -> Iterator[tuple[str, Any]]:
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
        self._issues.append(
            Issue("set-point-without-schedule", self.document.file.name, {"field": field})
        )
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

    def _referred(
        self, owner: ElementTree.Element, kind: str, name: str | None
    ) -> ElementTree.Element:
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
            raise self.document.fault(f"expected YYYY-MM-DD, got {text[:20]!r}", part, field)\
                from None  # fmt: skip
