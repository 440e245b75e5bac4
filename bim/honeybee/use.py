"""How a honeybee model says that its rooms are used: programs, loads, schedules, set points.

A room's own load goes before its program's, as honeybee-energy has it.

Source: honeybee-schema, "ProgramType", "IdealAirSystem", "ScheduleRuleset", "ScheduleDay",
"ScheduleRule", "ScheduleFixedInterval"; EnergyPlus Engineering Reference, "People": the dry share
of a person's heat.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.honeybee.library import NamedObjects
from bim.honeybee.schema import HoneybeeRoom
from bim.model import Space
from bim.report.issue import Issue, Phrase
from bim.use import (
    ALWAYS,
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
from mitsuba_cfs.errors import DataError

LAST_OF_FEBRUARY = day_of_year(2, 29)
WEEK = KINDS[:7]


class ScheduleLibrary:
    """The schedules of a file, read when something refers to them."""

    def __init__(self, energy: Mapping[str, Any], file: Path) -> None:
        self.objects = NamedObjects(energy, ("schedules",), "construction", file)
        self._found: dict[str, YearSchedule] = {}

    def schedule(self, named: Any) -> YearSchedule:
        """The schedule of a name, or that a load holds itself.

        Raises: `DataError` that names the schedule and its field.
        """
        if isinstance(named, dict):
            return self._read(named)
        name = str(named)
        if name not in self._found:
            held = self.objects.find("schedules", name)
            if held is None:
                raise self.objects.fault(f"no schedule {name!r:.60}", {}, "schedules")
            self._found[name] = self._read(held)
        return self._found[name]

    def _read(self, held: Mapping[str, Any]) -> YearSchedule:
        name = str(held.get("display_name") or held.get("identifier", ""))
        fixed = str(held.get("type", "")).startswith("ScheduleFixedInterval")
        field = "values" if fixed else "day_schedules"
        try:
            if fixed:
                return YearSchedule(name, _fixed(held))
            return YearSchedule.of_rules(name, self._rules(held))
        except DataError:
            raise
        except ValueError as error:
            raise self.objects.fault(f"is no schedule: {error}", held, field) from None

    def _rules(self, held: Mapping[str, Any]) -> Iterator[DayRule]:
        """The rules in their order, the holiday's first; the default day holds elsewhere."""
        days = {str(one.get("identifier")): self._day(one) for one in _objects(held, "day_schedules")}

        def day(named: Any) -> NDArray[np.float64]:
            if isinstance(named, dict):
                return self._day(named)
            if str(named) not in days:
                raise ValueError(f"no day schedule {named!r:.60}")
            return days[str(named)]

        if held.get("holiday_schedule"):
            yield DayRule(day(held["holiday_schedule"]), ("holiday",))
        for rule in _objects(held, "schedule_rules"):
            kinds = tuple(kind for kind in WEEK if rule.get(f"apply_{kind}", False))
            dates = (_date(rule.get("start_date"), 0), _date(rule.get("end_date"), DAYS - 1))
            yield DayRule(day(rule.get("schedule_day")), kinds, dates)
        yield DayRule(day(held.get("default_day_schedule")))

    def _day(self, one: Mapping[str, Any]) -> NDArray[np.float64]:
        times = _numbers(one.get("times") or [[0, 0]], 2)
        if times.shape[1] != 2:
            raise ValueError("expected times of hour and minute")
        starts = (times[:, 0] + times[:, 1] / 60.0).tolist()
        values = _numbers(one.get("values"), 1).tolist()
        if not one.get("interpolate"):
            return hourly_means(starts, values)
        fine = (np.arange(CLOCK * 60) + 0.5) / 60.0
        return np.interp(fine, starts, values).reshape(CLOCK, 60).mean(axis=1)


def _date(listed: Any, default: int) -> int:
    """Month and day as the number of a day; a third entry says that the year is a leap year."""
    if listed is None:
        return default
    return day_of_year(*_integers(listed)[:2])


def _objects(held: Mapping[str, Any], field: str) -> list[Mapping[str, Any]]:
    """The objects that a field lists."""
    listed = held.get(field) or []
    if not isinstance(listed, list) or not all(isinstance(one, dict) for one in listed):
        raise ValueError(f"expected objects in {field}")
    return listed


def _numbers(values: Any, dimensions: int) -> NDArray[np.float64]:
    try:
        result = np.asarray(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        result = np.empty(())
    if result.ndim != dimensions:
        raise ValueError(f"expected numbers, got {values!r:.60}")
    return result


def _integers(values: Any) -> list[int]:
    """Month and day, and whether the year is a leap year."""
    numbers = _numbers(values, 1)
    if len(numbers) < 2 or not np.isfinite(numbers).all():
        raise ValueError(f"expected month and day, got {values!r:.60}")
    return [int(number) for number in numbers]


def _fixed(held: Mapping[str, Any]) -> NDArray[np.float64]:
    """Values by date [366, 8, 24] of those at fixed intervals from a day on."""
    steps = held.get("timestep") or 1
    values = _numbers(held.get("values"), 1)
    is_number = isinstance(steps, int | float)
    if not np.isfinite(values).all() or not is_number or not 1 <= steps <= 60:
        raise ValueError("expected finite values and 1 to 60 of them an hour")
    steps = int(steps)
    hours = values[: len(values) // (steps * CLOCK) * steps * CLOCK].reshape(-1, CLOCK, steps)
    hours = hours.mean(axis=2)
    start = _integers(held.get("start_date") or [1, 1])
    leap = len(start) > 2 and bool(start[2])
    order = [day for day in range(DAYS) if leap or day != LAST_OF_FEBRUARY]
    first = order.index(day_of_year(*start[:2]))
    placeholder = _numbers(held.get("placeholder_value") or 0.0, 0)
    hourly = np.full((DAYS, CLOCK), float(placeholder))
    for number, day in enumerate(hours[: len(order)]):
        hourly[order[(first + number) % len(order)]] = day
    if not leap:
        hourly[LAST_OF_FEBRUARY] = hourly[LAST_OF_FEBRUARY - 1]
    return np.repeat(hourly[:, None, :], len(KINDS), axis=1)


LOADS = ("people", "lighting", "electric_equipment", "gas_equipment", "infiltration", "ventilation", "setpoint")
NOT_READ = (  # fields of a room's extension of energy
    "service_hot_water",
    "process_loads",
    "internal_masses",
    "window_vent_control",
    "fans",
)
INDOORS = 24.0  # at which a person's heat is split [degC]
SEATED = 120.0  # heat of a person at light office work, which honeybee-energy takes [W]
IDEAL = "IdealAirSystem"


class UseLibrary:
    """Programs and loads of a model by room."""

    def __init__(self, energy: Mapping[str, Any], file: Path) -> None:
        self.objects = NamedObjects(energy, ("program_types", "hvacs"), "construction", file)
        self.schedules = ScheduleLibrary(energy, file)
        self._rooms: dict[Issue, list[str]] = {}  # labels of the rooms of each issue

    @property
    def issues(self) -> tuple[Issue, ...]:
        """Uses that are ignored, each once with its rooms."""
        return tuple(
            replace(issue, values=issue.values | {"rooms": tuple(rooms)}) for issue, rooms in self._rooms.items()
        )

    def use(self, room: HoneybeeRoom, space: Space) -> StatedUse | None:
        """The use of a room that became a space; None where the file says nothing of it."""
        own = room.properties.energy
        program = self._program(room)
        loads = {kind: own.get(kind) or program.get(kind) for kind in LOADS}
        loads = {kind: one for kind, one in loads.items() if isinstance(one, dict)}
        for field in NOT_READ:
            if own.get(field) or program.get(field):
                self._report(room, "load-not-used", load=Phrase(field))
        if not loads and not program:
            return None
        parts = _Parts(self, room, space, loads)
        return parts.use()

    def _program(self, room: HoneybeeRoom) -> Mapping[str, Any]:
        name = room.properties.energy.get("program_type")
        if isinstance(name, dict):
            return name
        program = self.objects.find("program_types", str(name)) if name else None
        if name and program is None:
            self._report(room, "program-missing", program=str(name))
        return program or {}

    def hvac(self, room: HoneybeeRoom) -> Mapping[str, Any] | None:
        """The system of a room; None where it has none."""
        name = room.properties.energy.get("hvac")
        if isinstance(name, dict):
            return name
        return (self.objects.find("hvacs", str(name)) or {"type": str(name)}) if name else None

    def _report(self, room: HoneybeeRoom, code: str, **values: str | float | Phrase) -> None:
        issue = Issue(code, self.objects.file.name, {**values, "rooms": ()})
        rooms = self._rooms.setdefault(issue, [])
        if room.label not in rooms:
            rooms.append(room.label)


class _Parts:
    """The loads of one room."""

    def __init__(self, library: UseLibrary, room: HoneybeeRoom, space: Space, loads: Mapping[str, dict]) -> None:
        self.library, self.room, self.space, self.loads = library, room, space, loads
        self.number = library.objects.number
        self.report = partial(library._report, room)

    def use(self) -> StatedUse:
        """All of them as a use; a load that neither room nor program has is none."""
        parts: dict[str, Any] = {}
        for part in (self._people, self._lamps, self._equipment, self._air, self._loads):
            parts |= dict(part())
        return StatedUse(**parts, radiant_share=self._radiant())

    def _of(self, kind: str) -> Mapping[str, Any]:
        return self.loads.get(kind, {})

    def _held(self, kind: str, field: str) -> YearSchedule | None:
        """A schedule that a load names; None where it names none."""
        named = self._of(kind).get(field)
        return None if named is None else self.library.schedules.schedule(named)

    def _share(self, kind: str, field: str = "schedule") -> YearSchedule:
        """The schedule of a load, which is there always without one."""
        return self._held(kind, field) or ALWAYS

    def _people(self) -> Iterator[tuple[str, Any]]:
        people = self._of("people")
        count = self.number(people, "people_per_area", 0.0) * self.space.floor_area
        share = self._share("people", "occupancy_schedule")
        yield "persons", ScheduledValue(count, share)
        if not count:
            return
        heat = _mean_activity(self._held("people", "activity_schedule"), share)
        latent = people.get("latent_fraction")
        dry = sensible_heat(heat) if isinstance(latent, dict | None) else None
        if dry is None:
            dry = heat * (1.0 - self.number(people, "latent_fraction", 0.0, most=1.0))
        yield "person_w", dry
        yield "person_vapour_g_h", vapour_g_h(max(heat - dry, 0.0))

    def _lamps(self) -> Iterator[tuple[str, Any]]:
        lamps = self._of("lighting")
        power = self.number(lamps, "watts_per_area", 0.0) * self.space.floor_area
        yield "lighting_w", ScheduledValue(power, self._share("lighting"))
        if self.number(lamps, "return_air_fraction", 0.0, most=1.0):
            self.report("return-air-heat")
        control = self.room.properties.energy.get("daylighting_control")
        if isinstance(control, dict):
            yield "lighting_target_lx", self.number(control, "illuminance_setpoint", 300.0, least=1)
            self.report("daylighting-control")

    def _equipment(self) -> Iterator[tuple[str, Any]]:
        kinds = [k for k in ("electric_equipment", "gas_equipment") if self._of(k)]
        schedule: YearSchedule | None = None
        for kind in kinds:
            one = self._of(kind)
            away = sum(self.number(one, f, 0.0, most=1.0) for f in ("latent_fraction", "lost_fraction"))
            if away:
                self.report("gain-lost", load=Phrase(kind), percent=100 * away)
            power = self.number(one, "watts_per_area", 0.0) * self.space.floor_area
            part = self._share(kind).times(power * max(1.0 - away, 0.0))
            schedule = part if schedule is None else schedule.plus(part)
        yield ("equipment_w", ScheduledValue(0.0) if schedule is None else ScheduledValue(1.0, schedule))

    def _air(self) -> Iterator[tuple[str, Any]]:
        leaks, fan, space = self._of("infiltration"), self._of("ventilation"), self.space
        flow = self.number(leaks, "flow_per_exterior_area", 0.0) * _exterior_area(space)
        yield "infiltration_m3_s", ScheduledValue(flow, self._share("infiltration"))
        if leaks:
            names = ("constant_coefficient", "temperature_coefficient", "velocity_coefficient")
            a, b, c = (self.number(leaks, name, default) for name, default in zip(names, (1.0, 0.0, 0.0), strict=True))
            yield "infiltration_factors", (a, b, c, 0.0)
        system = self.library.hvac(self.room)
        if system is None:
            yield "ventilation_m3_s", ScheduledValue(0.0)
            if fan:
                self.report("fan-without-system")
            return
        people = self.number(self._of("people"), "people_per_area", 0.0) * space.floor_area
        flow = (
            self.number(fan, "flow_per_person", 0.0) * people
            + self.number(fan, "flow_per_area", 0.0) * space.floor_area
            + self.number(fan, "flow_per_zone", 0.0)
            + self.number(fan, "air_changes_per_hour", 0.0) * space.volume / 3600.0
        )
        yield "ventilation_m3_s", ScheduledValue(flow, self._share("ventilation"))
        recovered = system.get("sensible_heat_recovery")
        if str(system.get("type", "")).startswith(IDEAL) and recovered:
            yield "heat_recovery", self.number(system, "sensible_heat_recovery", 0.0, most=1.0)

    def _loads(self) -> Iterator[tuple[str, Any]]:
        points, system = self._of("setpoint"), self.library.hvac(self.room)
        if system is None:
            if points:
                self.report("set-points-without-system")
            return
        kind = str(system.get("type", ""))
        if not kind.startswith(IDEAL):
            self.report("system-taken-as-ideal", system=kind)
        elif system.get("economizer_type", "DifferentialDryBulb") != "NoEconomizer":
            self.report("economizer")
        for limit in ("heating", "cooling"):
            if isinstance(system.get(f"{limit}_limit"), int | float):
                yield f"{limit}_limit_w", self.number(system, f"{limit}_limit", least=1e-3)
            schedule = self._held("setpoint", f"{limit}_schedule")
            if schedule is not None:
                yield f"{limit}_c", schedule
        for field, target in (("humidifying", "humidify_to"), ("dehumidifying", "dehumidify_to")):
            schedule = self._held("setpoint", f"{field}_schedule")
            if schedule is None:
                continue
            if np.ptp(schedule.values) > 0:
                self.report("humidity-set-point-varies", field=Phrase(field))
            yield target, float(schedule.values.mean())

    def _radiant(self) -> float | None:
        """The radiant share of people, lamps and equipment, by their power."""
        people, area = self._of("people"), self.space.floor_area
        weights = [
            (
                self.number(people, "people_per_area", 0.0) * area * 100.0,
                self.number(people, "radiant_fraction", 0.3, most=1.0),
            )
        ]
        for kind in ("lighting", "electric_equipment", "gas_equipment"):
            one = self._of(kind)
            radiant = self.number(one, "radiant_fraction", 0.0, most=1.0)
            radiant += self.number(one, "visible_fraction", 0.0, most=1.0)
            weights.append((self.number(one, "watts_per_area", 0.0) * area, min(radiant, 1.0)))
        power = sum(watts for watts, _ in weights)
        return sum(watts * share for watts, share in weights) / power if power else None


def sensible_heat(activity: float, air_c: float = INDOORS) -> float:
    """Dry heat of a person of an activity [W], EnergyPlus Engineering Reference, "People"."""
    m, t = activity, air_c
    dry = (
        6.461927
        + 0.946892 * m
        + 2.55737e-5 * m**2
        + 7.139322 * t
        - 0.0627909 * t * m
        + 5.89172e-5 * t * m**2
        - 0.198550 * t**2
        + 9.40018e-4 * t**2 * m
        - 1.49532e-6 * t**2 * m**2
    )
    return float(np.clip(dry, 0.0, activity))


def _mean_activity(activity: YearSchedule | None, share: YearSchedule) -> float:
    """The heat of a person while there are some [W], of a seated one where no schedule says it."""
    total = float(share.values.sum())
    if activity is None or not total:
        return SEATED
    return float((activity.values * share.values).sum() / total)


def _exterior_area(space: Space) -> float:
    """Area of a room's boundary that is exposed to the outdoor air [m2]."""
    faces = sum(face.area for face in space.faces if face.adjacency == "outside")
    return faces + sum(window.area for window in space.windows)
