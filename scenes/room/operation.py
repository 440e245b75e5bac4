"""An operation file with its systems, and the use of rooms that a building's file states."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.use import ScheduledValue, StatedUse, YearSchedule
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.metrics.schedules import working_hours
from mitsuba_cfs.notes import Note
from mitsuba_cfs.sky.sun import is_up, sun_directions
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.systems import FenestrationSystem, read_system, system_of_panes
from scenes.fenestration.thermal_file import StateTable, read_reflectance
from scenes.fenestration.thermal_system import checked_system
from scenes.fenestration.tilts import tilt_states
from scenes.language.catalogue import N_
from scenes.room.luminaires import placed_spectrum
from scenes.room.operation_tables import PARTS, GainsTable, OperationTables, RoomsTable, operated_tables
from scenes.room.options import RoomOptions
from scenes.room.schedules import WEEK, ScheduleTable, scheduled_fields
from scenes.room.shading_rules import WEATHER_RULES, ShadingRule
from scenes.toml_file import TomlTable, read_table, validated
from thermal.control import by_schedule, by_threshold
from thermal.emitters import HeatedSlab, IdealLoads
from thermal.errors import ThermalInputError
from thermal.ventilation import (
    Leakage,
    NeighbourAir,
    SupplyAir,
    WindowAiring,
    cross_flow,
    large_opening,
    single_sided,
    stack_height,
)
from thermal.zone import WindowElement

FloatArray = NDArray[np.float64]


def check_schedules(tables: OperationTables, weather: Weather, file: Path | None = None) -> None:
    """Raise `DataError` for hourly values out of bounds or set points that cross."""
    for variant in tables.variants:
        try:
            OperationHours(variant, weather).check()
        except DataError as error:
            if error.file is not None:
                raise
            raise DataError(error.message, file=file, field=error.field) from None


class OperationHours:
    """Values of a room's tables in every hour of a weather's year."""

    def __init__(self, tables: OperationTables, weather: Weather) -> None:
        first = tables.calendar.starts_on
        if first is not None:
            weather = replace(weather, first_weekday=WEEK.index(first))
        self.tables, self.weather = tables, weather

    def _of(self, part: str, key: str) -> FloatArray | float | None:
        """The values [H] of a schedule, or a constant."""
        return self.value(getattr(self.tables, part), key, part)

    def value(self, table: TomlTable, key: str, place: str) -> FloatArray | float | None:
        """The values [H] of a field of a table, or a constant; `place` is the path of the table."""
        if key not in scheduled_fields(table):
            return getattr(table, key)
        name, limits = scheduled_fields(table)[key]
        calendar = self.tables.calendar
        values = self.tables.schedules[name].hourly(self.weather, calendar.holidays)
        try:
            limits.checked(float(values.min()))
            limits.checked(float(values.max()))
        except ValueError as error:
            raise DataError(f"schedule {name!r}: {error}", field=f"{place}.{key}") from None
        return values

    def _while_occupied(self, part: str, key: str) -> FloatArray:
        """The values [H] of a schedule, or a constant in the hours with people."""
        value = self._of(part, key)
        return value if isinstance(value, np.ndarray) else value * self.present

    @cached_property
    def present(self) -> FloatArray:
        """Share of the people that is present [H]; multiplies constant gains and air."""
        value = self._of("gains", "occupied")
        if isinstance(value, np.ndarray):
            return value
        return working_hours(self.weather, *value).astype(float)

    def heat(self, floor_area: float) -> FloatArray:
        """Heat of people and equipment [H] [W]."""
        people = self._while_occupied("gains", "persons") * self.tables.gains.person_w
        return self.equipment(floor_area) + people

    def equipment(self, floor_area: float) -> FloatArray:
        """Power of equipment [H] [W]."""
        by_area = self._while_occupied("gains", "equipment_w_m2") * floor_area
        return by_area + self._while_occupied("gains", "equipment_w")

    def vapour(self) -> FloatArray:
        """Vapour of people and other sources [H] [kg/s]."""
        people = self._while_occupied("gains", "persons") * self.tables.gains.person_vapour_g_h
        return (people + self._while_occupied("gains", "vapour_g_h")) / 3.6e6

    def lamps(self, floor_area: float) -> FloatArray:
        """Power of the lamps without daylight [H] [W]."""
        return self._while_occupied("gains", "lighting_w_m2") * floor_area

    def outdoor_air(self) -> dict[str, Any]:
        """Outdoor air except through opened windows, and neighbours' air, as fields of a zone."""
        night, air = self._of("air", "night_ach"), self.tables.air
        if not isinstance(night, np.ndarray):
            night = night * working_hours(self.weather, *air.night)
        fan = SupplyAir(
            self._while_occupied("air", "ventilation_ach"),
            self._of("air", "supply_c"),
            recovery=air.heat_recovery,
            bypass_above_c=np.inf if air.bypass_above_c is None else air.bypass_above_c,
            least_c=-np.inf if air.least_supply_c is None else air.least_supply_c,
        )
        leaks = Leakage() if air.leakage is None else air.leakage.leakage()
        return {
            "infiltration_ach": self._of("air", "infiltration_ach"),
            "leakage": replace(leaks, factors=air.infiltration_factors),
            "other_air_ach": night,
            "supply": fan,
            "beside": tuple(map(self._neighbour_air, range(len(air.neighbour)))),
        }

    def _neighbour_air(self, number: int) -> NeighbourAir:
        """The air exchanged with a neighbour."""
        table, place = self.tables.air.neighbour[number], f"air.neighbour.{number}"
        beyond, share, flow = (self.value(table, key, place) for key in ("temperature_c", "open", "m3_h"))
        buoyant = 0.0
        if table.width is not None:
            buoyant = large_opening(table.width, table.height, discharge=table.discharge)
        return NeighbourAir(beyond, flow / 3600.0, buoyant, share)

    def airing(self, windows: Sequence[WindowElement], volume: float) -> WindowAiring | None:
        """Airing by opened windows; None if no window is opened.

        Args: volume: of the room [m3].
        """
        table = self.tables.air.windows
        if table is None or not windows:
            return None
        share = self.value(table, "share", "air.windows")
        if not isinstance(share, np.ndarray) and table.when == "occupied":
            share = np.where(self.present > 0, share, table.absent_share)
        if table.closed_in_rain:
            share = np.where(self.rain("air.windows.closed_in_rain"), 0.0, share)
        if table.night_share is not None:
            night = working_hours(self.weather, *self.tables.air.night)
            share = np.where(night, np.minimum(share, table.night_share), share)
        half = np.array([0.5 * w.glazing_height for w in windows])
        middle, areas = np.array([w.height for w in windows]), [w.area for w in windows]
        height = stack_height(middle - half, middle + half)
        if table.ach is not None:
            wind = stack = 0.0
        elif table.flow == "cross":
            azimuth = [np.degrees(np.arctan2(w.normal[0], w.normal[1])) for w in windows]
            wind, stack = cross_flow(areas, azimuth, height)
        else:
            wind, stack = single_sided(sum(areas), height)
        return WindowAiring(
            wind,
            stack,
            both=table.flow == "cross",
            share=share,
            open_above_c=table.open_above_c,
            close_below_c=table.close_below_c,
            least_difference=table.least_difference,
            greatest_wind=table.greatest_wind,
            least_outdoor_c=table.least_outdoor_c,
            heating_while_open=table.heating_while_open,
            flow=(table.ach or 0.0) * volume / 3600.0,
            operative=table.temperature == "operative",
            hybrid=table.hybrid,
        )

    def rain(self, place: str) -> NDArray[np.bool_]:
        """Whether it rains in each interval [H]; dry where the weather has no value.

        Args: place: path of the key that asks. Raises: `DataError` for weather without rain.
        """
        fallen = np.nan_to_num(self._weather("rain_mm", "rain", place))
        if not fallen.any():  # files whose makers had no rain state zeros
            raise DataError(f"the weather of {self.weather.site} has no rain", field=place)
        return fallen > 0

    def _weather(self, key: str, name: str, place: str) -> FloatArray:
        """Values of the weather [H]; `DataError` where it has none."""
        values: FloatArray | None = getattr(self.weather, key)
        if values is None:
            raise DataError(f"the weather of {self.weather.site} has no {name}", field=place)
        return values

    def states(self, rule: ShadingRule, place: str, count: int, closed: int = 1) -> NDArray[np.int64]:
        """Shading states [H] of a rule by schedule or weather for windows with `count` states.

        Args: place: path of the rule's table; closed: the state that a rule by weather closes to.
        """
        if rule.rule == "outdoor temperature":
            outdoors = self._weather("dry_bulb_c", "temperature", f"{place}.rule")
            return by_threshold(outdoors, rule.closes_above_c, rule.opens_below_c, closed=closed)
        if rule.rule == "wind":
            wind = self._weather("wind_speed", "wind", f"{place}.rule")
            return closed - by_threshold(wind, rule.open_above_m_s, closed=closed)
        if rule.rule == "rain":
            return np.where(self.rain(f"{place}.rule"), 0, closed)
        if rule.rule in ("day", "night"):
            up = is_up(sun_directions(self.weather))
            return np.where(up == (rule.rule == "day"), closed, 0)
        if rule.rule in ("occupied", "unoccupied"):
            return np.where((self.present > 0) == (rule.rule == "occupied"), closed, 0)
        if not isinstance(rule.schedule, str):
            return by_schedule(rule.schedule, len(self.weather.times))
        values = self.value(rule, "schedule", place)
        if not np.isin(values, range(count)).all():  # of a CSV file
            message = f"schedule {rule.schedule!r}: a state outside 0 to {count - 1}"
            raise DataError(message, field=f"{place}.schedule")
        return values.astype(np.int64)

    def loads(self) -> IdealLoads:
        """Set points and limits; without a set point never, without a limit unlimited."""
        infinity, stated = float("inf"), self.tables.loads
        heating, cooling = (self._of("loads", key) for key in ("heating_c", "cooling_c"))
        return IdealLoads(
            -infinity if heating is None else heating,
            infinity if cooling is None else cooling,
            stated.heating_limit_w or infinity,
            stated.cooling_limit_w or infinity,
            stated.heating_radiant,
            stated.cooling_radiant,
        )

    def slab(self, surface: str, area: float) -> HeatedSlab:
        """The heated slab of `loads.slab` in a surface of the room.

        Args: surface: its name; area: of the surface [m2].
        """
        table, place = self.tables.loads.slab, "loads.slab"
        heating, cooling = (self.value(table, k, place) for k in ("heating_c", "cooling_c"))
        return HeatedSlab(
            surface,
            table.depth,
            -np.inf if heating is None else heating,
            np.inf if cooling is None else cooling,
            table.heating_w_m2 * area,
            table.cooling_w_m2 * area,
            table.band,
        )

    def check(self) -> None:
        """Raise `DataError` for the first impossible value."""
        for place, table in operated_tables(self.tables):
            for key in scheduled_fields(table):
                self.value(table, key, place)
        for place, rule in self.tables.control.rules:
            for leaf in rule.leaves:
                if leaf.rule in WEATHER_RULES:
                    self.states(leaf, place, 2)
        if self.tables.air.windows is not None and self.tables.air.windows.closed_in_rain:
            self.rain("air.windows.closed_in_rain")
        try:
            self.loads()
        except ThermalInputError as error:
            raise DataError(error.message, field="loads") from None


Tables = TypeVar("Tables", bound=OperationTables)
PREFIX = "of the building's file: "  # of the names of schedules that the building's file contains


# Shading states of the control groups of a room in an hour, from the hour's `ControlHour`
Controller = Callable[[Any], int | Sequence[int] | Mapping[str, int]]
FUNCTION = "function"  # the rule of windows that a `Controller` moves, in results


@dataclass(frozen=True, slots=True)
class SharedYear:
    """The states of a group of windows of several rooms in every hour, and what moved them."""

    states: NDArray[np.int64]  # [H]
    moved_by: NDArray[np.int64]  # [H] number of the reason of each move; -1: none
    reasons: tuple[str, ...]

    def up_to(self, count: int) -> SharedYear:
        """The year of windows with `count` states."""
        return replace(self, states=np.minimum(self.states, count - 1))


@dataclass(frozen=True, slots=True)
class Operation:
    """An operation file and its fenestration systems."""

    file: Path
    tables: OperationTables
    systems: tuple[FenestrationSystem, ...]  # states of every window; empty: the building file's
    controller: Controller | None = None  # of the shading states, in place of the file's rules
    # known states of groups of several rooms, by name: of `shared_states`
    shared: Mapping[str, SharedYear] = field(default_factory=dict)

    def controlled_by(self, controller: Controller) -> Operation:
        """The operation with a function of each hour in place of the file's rules of shading.

        Args: controller: called with the `ControlHour` of each hour of a room, in order; returns
            the state of all its control groups, of each [N], or by name of those that move.
        """
        return replace(self, controller=controller)

    @property
    def files(self) -> tuple[Path, ...]:
        """The BSDF files and CSV schedules that the file names."""
        tables = (schedule.csv for schedule in self.tables.schedules.values())
        states = [table.placed(self.file.parent) for table in self.tables.system]
        panes = [layer.pane for table in states if table.bsdf is None for layer in table.layers]
        named = [None if table.bsdf is None else self.file.parent / table.bsdf for table in states]
        lamps = [one for v in self.tables.variants for one in v.gains.luminaire]
        light = [Path(one.spectrum) for one in lamps if one.spectrum and Path(one.spectrum).is_absolute()]
        colours = [one.spectrum for one in self.tables.surface]
        files = (*named, *panes, *tables, self.tables.control_of, *(one.file for one in lamps), *light, *colours)
        return tuple(path for path in files if path is not None)

    def outdoors(self, weather: Weather) -> Weather:
        """The weather of its rooms, with the urban heat island that the file states.

        Raises: `DataError` outside the range of the heat island's equation.
        """
        island = self.tables.heat_island
        return weather if island is None else island.warmed(weather, self.file)


def read_operation(path: str | PathLike[str]) -> Operation:
    """The operation of a TOML file; paths in it are relative to its folder.

    Raises: `DataError` that names file and field.
    """
    path = Path(path)
    tables = schedules_there(validated(OperationTables, read_table(path), path), path)
    tables = _with_stored_control(tables, path)
    systems = []
    for number, state in enumerate(tables.system):
        bsdf = None if state.bsdf is None else path.parent / state.bsdf
        if bsdf is not None and not bsdf.is_file():
            raise DataError(f"no such file: {state.bsdf}", file=path, field=f"system.{number}.bsdf")
        system = read_state(state.placed(path.parent), bsdf, by=f"[[system]] of {path.name},")
        if any(system.name == other.name for other in systems):
            name = f"{system.name} ({number + 1})" if bsdf is None else bsdf.stem
            system = replace(system, name=name)
        systems.append(replace(system, tilt_deg=state.tilt_deg))
    try:
        return Operation(path, tables, _with_tilts(systems, tables))
    except DataError as error:
        file = path if error.file is None else error.file
        raise DataError(error.message, file=file, field=error.field) from None


def _with_stored_control(tables: OperationTables, path: Path) -> OperationTables:
    """The tables with the control of the IFC file that they name."""
    if tables.control_of is None:
        return tables
    file = (path.parent / tables.control_of).absolute()
    if not file.is_file():
        message = f"no such file: {tables.control_of}"
        raise DataError(message, file=path, field="control_of")
    from scenes.room.stored_control import stored_control  # ifcopenshell, only here

    return tables.model_copy(update={"control": stored_control(file), "control_of": file})


def _with_tilts(systems: Sequence[FenestrationSystem], tables: OperationTables) -> tuple[FenestrationSystem, ...]:
    """The states of the tables' systems and of the tilts between them."""
    step = tables.tilt_step_deg
    return tuple(systems) if step is None else tilt_states(systems, step)


def check_systems(operation: Operation) -> None:
    """Raise `DataError` for a state with inconsistent U, g and BSDF, naming its BSDF file.

    A state given by its panes names the operation file.
    """
    stated = [system for system in operation.systems if system.between is None]
    for table, system in zip(operation.tables.system, stated, strict=True):
        bsdf = table.placed(operation.file.parent).bsdf
        checked_system(system, operation.file if bsdf is None else operation.file.parent / bsdf)


def schedules_there(tables: Tables, path: Path) -> Tables:
    """The tables of a file with absolute paths of CSV schedules.

    Raises: `DataError` for a file that does not exist.
    """
    schedules = {}
    for name, schedule in tables.schedules.items():
        csv = None if schedule.csv is None else (path.parent / schedule.csv).absolute()
        if csv is not None and not csv.is_file():
            field = f"schedules.{name}.csv"
            raise DataError(f"no such file: {schedule.csv}", file=path, field=field)
        schedules[name] = schedule.model_copy(update={"csv": csv})
    surfaces = []
    for number, one in enumerate(tables.surface):
        if one.spectrum is not None:
            file = (path.parent / one.spectrum).absolute()
            if not file.is_file():
                raise DataError(f"no such file: {one.spectrum}", file=path, field=f"surface.{number}.spectrum")
            read_reflectance(file)
            one = one.model_copy(update={"spectrum": file})
        surfaces.append(one)
    update = {"schedules": schedules, "gains": _placed(tables.gains, path), "surface": tuple(surfaces)}
    rooms = tuple(one.model_copy(update={"gains": _placed(one.gains, path)}) for one in tables.rooms)
    return tables.model_copy(update=update | {"rooms": rooms})


def _placed(gains: GainsTable, path: Path) -> GainsTable:
    """Gains with absolute paths of the luminaires' files.

    Raises: `DataError` for a file that does not exist.
    """
    placed = []
    for number, one in enumerate(gains.luminaire):
        file = (path.parent / one.file).absolute()
        if not file.is_file():
            field = f"gains.luminaire.{number}.file"
            raise DataError(f"no such file: {one.file}", file=path, field=field)
        update: dict[str, Path | str] = {"file": file}
        if one.spectrum is not None:
            try:
                update["spectrum"] = placed_spectrum(one.spectrum, path.parent)
            except DataError as error:
                field = f"gains.luminaire.{number}.spectrum"
                raise DataError(error.message, file=error.file or path, field=error.field or field) from None
        placed.append(one.model_copy(update=update))
    return gains.model_copy(update={"luminaire": tuple(placed)}) if placed else gains


def read_state(table: StateTable, path: Path | None, *, by: str = "") -> FenestrationSystem:
    """The system of a shading state from its BSDF file, with U, g and closure of its table.

    Args: path: of the BSDF; None: optics from the panes. by: start of the system's source.
    """
    if path is None:
        system = replace(system_of_panes(table.layers), source=f"{by} layers".strip())
    else:
        system = read_system(
            path, u_value=table.u_value, g_value=table.g_value, see_through=table.straight_share, by=by
        )
    if table.layers:  # their U and g come before those of the BSDF's thermal file
        system = replace(system, u_value=table.u_value, g_value=table.g_value, g_by_patch=None)
    by_patch = table.g_by_patch()
    spectrum = table.spectrum()
    if table.spectral is None and (spectrum is None or not spectrum.whole):
        # that beside the BSDF's file knows its shade too
        spectrum = system.spectrum or spectrum
    return replace(
        system,
        closure=table.closure() or system.closure,
        recipe=table.recipe if table.layers else system.recipe,
        g_by_patch=system.g_by_patch if by_patch is None else by_patch,
        shading_position=table.shading_position or system.shading_position,
        spectrum=spectrum,
    )


def check_states(operation: Operation, states: int) -> None:
    """Raise `DataError` for a control that names states that the windows do not have."""
    for fault in (variant.control_fault(states) for variant in operation.tables.variants):
        if fault is None:
            continue
        field, message = fault
        raise DataError(message, file=operation.file, field=field)


def used_operation(operation: Operation | None, building: Building) -> Operation | None:
    """The operation, completed by the use of rooms in the building's file; None without either."""
    if not building.uses or building.file is None:
        return operation
    tables = OperationTables() if operation is None else operation.tables
    file = building.file if operation is None else operation.file
    systems = () if operation is None else operation.systems
    controller = None if operation is None else operation.controller
    return Operation(file, with_stated_uses(tables, building), systems, controller)


def with_stated_uses(tables: Tables, building: Building) -> Tables:
    """The tables with an entry for each room whose use the building's file states.

    Values of the operation file come before those of the building's file, key by key.

    Raises: `DataError` for an impossible value, naming the building's file.
    """
    if not building.uses:
        return tables
    file = building.file or Path(building.name)
    stated = _Schedules()
    entries = []
    for space in building.spaces:
        use = building.uses.get(space.guid)
        if use is None:
            continue
        own = stated_fields(use, space, stated)
        entries.append(validated(RoomsTable, _entry(tables, building, space, own), file))
    update = {"rooms": (*entries, *tables.rooms), "schedules": stated.tables | tables.schedules}
    return tables.model_copy(update=update)


def stated_note(building: Building, before: str = "") -> tuple[str, ...]:
    """A sentence on rooms whose use is that of the building's file; empty without any.

    Args: before: name of the file whose values come first.
    """
    count = sum(space.guid in building.uses for space in building.spaces)
    if not count or building.file is None:
        return ()
    values = {"count": count, "all": len(building.spaces), "file": building.file.name}
    if not before:
        note = Note("Gains, outdoor air and set points of {count} of {all} rooms are from {file}.", **values)
        return (note,)
    note = Note(
        "Gains, outdoor air and set points of {count} of {all} rooms are from {file}; values of "
        "{operation} take precedence.",
        operation=before,
        **values,
    )
    return (note,)


ASSUMED: Mapping[tuple[str, str], Callable[[Any], Note]] = {  # what nobody states, in words of its value
    ("gains", "equipment_w_m2"): lambda value: Note("equipment {value:g} W/m2", value=value),
    ("gains", "persons"): lambda _one: Note("one person"),
    ("gains", "occupied"): lambda hours: Note("use from {start:g} to {end:g} o'clock", start=hours[0], end=hours[1]),
    ("air", "infiltration_ach"): lambda value: Note("{value:g} air changes per hour", value=value),
}


def unstated_note(source: OperationTables | RoomOptions, building: Building, file: str = "") -> tuple[str, ...]:
    """A sentence on the gains and leaks that nobody states; empty without any.

    Args: source: tables, or the options of rooms without; file: name of the file of the tables.
    """
    if building.spaces and all(space.guid in building.uses for space in building.spaces):
        return ()
    if isinstance(source, RoomOptions):
        people = source.occupancy
        note = Note(
            "Gains and air, as no operation file states them: equipment {equipment:g} W/m2, one person of "
            "{person:g} W per {floor:g} m2, both daily from {start} to {end} o'clock; {air:g} air changes per hour.",
            equipment=people.equipment_w_m2,
            person=people.person_w,
            floor=people.floor_per_person,
            start=people.hours[0],
            end=people.hours[1],
            air=source.infiltration_ach,
        )
        return (note,)
    unstated = [
        Note("{what} ({key})", what=words(getattr(getattr(source, name), key)), key=f"{name}.{key}")
        for (name, key), words in ASSUMED.items()
        if key not in getattr(source, name).model_fields_set
    ]
    if not unstated:
        return ()
    values = reduce(lambda before, one: Note("{before}, {one}", before=before, one=one), unstated)
    return (Note("Not stated in {file}: {values}.", values=values, file=file),)


WEEKDAYS = (N_("Monday"), N_("Tuesday"), N_("Wednesday"), N_("Thursday"), N_("Friday"), N_("Saturday"), N_("Sunday"))


def weekday_note(tables: Iterable[OperationTables], weather: Weather) -> tuple[str, ...]:
    """A sentence on the weekday of 1 January, where schedules by weekday take it from the weather; else empty."""
    variants = (one for table in tables for one in table.variants if one.calendar.starts_on is None)
    if not any(schedule.by_weekday for one in variants for schedule in one.schedules.values()):
        return ()
    first = weather.midpoints[0]
    if weather.first_weekday is not None:
        note = Note(
            "Schedules by weekday: 1 January is a {day}, by the weather file's header.",
            day=Note(WEEKDAYS[weather.first_weekday]),
        )
        return (note,)
    note = Note(
        "Schedules by weekday: 1 January is a {day}, as in {year}, because the weather file's header states none.",
        day=Note(WEEKDAYS[first.replace(month=1, day=1).day_of_week]),
        year=str(first.year),
    )
    return (note,)


def _entry(tables: OperationTables, building: Building, space: Space, own: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """The tables of one room: the building's, then the operation's own, then its `[[rooms]]`."""
    chosen = tables.entry_of(building, space)
    tables_of_room: dict[str, Any] = {"spaces": (space.guid,)}
    for part in PARTS:
        stated = getattr(tables, part).model_fields_set
        fields = {key: value for key, value in own.get(part, {}).items() if key not in stated}
        if chosen is not None:
            entry = getattr(chosen, part)
            fields |= {key: getattr(entry, key) for key in entry.model_fields_set}
        tables_of_room[part] = fields
    return tables_of_room


class _Schedules:
    """Schedules of a building's file as tables with unique names, each schedule once."""

    def __init__(self) -> None:
        self.tables: dict[str, ScheduleTable] = {}
        self._names: dict[tuple[int, float], str] = {}
        self._referenced: list[YearSchedule] = []  # kept alive, so that ids stay unique
        self._counts: Counter[str] = Counter()

    def name(self, schedule: YearSchedule, factor: float = 1.0) -> str:
        """The name of a schedule times a number."""
        key = (id(schedule), factor)
        if key not in self._names:
            self._referenced.append(schedule)
            self._counts[schedule.name] += 1
            count = self._counts[schedule.name]
            name = f"{PREFIX}{schedule.name}{f' {count}' if count > 1 else ''}"
            self._names[key] = name
            self.tables[name] = ScheduleTable.from_file(schedule, factor)
        return self._names[key]

    def value(self, value: ScheduledValue, per: float) -> str | float:
        """The name of the schedule of a quantity divided by a number, or a constant."""
        amount = value.peak / per
        return self.name(value.share, amount) if amount and value.share is not None else amount


def stated_fields(use: StatedUse, space: Space, schedules: _Schedules) -> dict[str, dict[str, Any]]:
    """The fields of a room's tables by part, from its stated use."""
    gains, air, loads = {}, {}, {}
    area, changes = space.floor_area, space.volume / 3600.0
    if use.persons is not None:
        gains["persons"] = use.persons.peak
        if use.persons.share is not None:
            gains["occupied"] = schedules.name(use.persons.share)
    for key, value in (("equipment_w_m2", use.equipment_w), ("lighting_w_m2", use.lighting_w)):
        if value is not None:
            gains[key] = schedules.value(value, area)
    if use.lighting_w is not None and use.lighting_target_lx is None:
        gains["lighting_dimmed"] = False
    for key, value in (("infiltration_ach", use.infiltration_m3_s), ("ventilation_ach", use.ventilation_m3_s)):
        if value is not None:
            air[key] = schedules.value(value, changes)
    for key, schedule in (("heating_c", use.heating_c), ("cooling_c", use.cooling_c)):
        if schedule is not None:
            loads[key] = schedules.name(schedule)
    single = {
        "gains": (
            gains,
            {
                "person_w": use.person_w,
                "person_vapour_g_h": use.person_vapour_g_h,
                "lighting_target_lx": use.lighting_target_lx,
                "radiant_share": use.radiant_share,
            },
        ),
        "air": (air, {"infiltration_factors": use.infiltration_factors, "heat_recovery": use.heat_recovery}),
        "loads": (
            loads,
            {
                "heating_limit_w": use.heating_limit_w,
                "cooling_limit_w": use.cooling_limit_w,
                "humidify_to": use.humidify_to,
                "dehumidify_to": use.dehumidify_to,
            },
        ),
    }
    return {
        part: named | {key: value for key, value in plain.items() if value is not None}
        for part, (named, plain) in single.items()
    }
