"""The tables of a TOML file that say how rooms are operated: states, control, gains, air, loads."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, model_validator

from bim.model import Building, Space
from mitsuba_cfs.errors import DataError
from scenes import plausible
from scenes.fenestration.tables import StateTable
from scenes.room.air_tables import AirTable
from scenes.room.envelope_tables import EnvelopeTable
from scenes.room.heat_island import HeatIslandTable
from scenes.room.load_tables import LoadsTable, PlantTable
from scenes.room.schedules import (
    CLOCK,
    CalendarTable,
    OrSchedule,
    ScheduleTable,
    clock_or_name,
    scheduled_fields,
    states_or_name,
    tables_within,
    unknown_name,
)
from scenes.toml_file import Positive, Share, TomlTable


class ControlTable(TomlTable):
    """Which state holds: states are numbered from 0 in the order of the file."""

    rule: Literal["always", "schedule", "irradiance", "glare", "cut-off"] = "always"
    state: Annotated[int, Field(ge=0)] = 0  # "always"; and the closed one of "irradiance"
    # "schedule": 24 states, or the name of a schedule of states
    schedule: Annotated[tuple[int, ...] | str, OrSchedule(plausible.STATE, states_or_name)] = ()
    close_above: Annotated[Positive, plausible.SUN] = 200.0  # "irradiance" on the windows [W/m2]
    open_below: Annotated[float, plausible.SUN] | None = None
    limit_lx: Annotated[Positive, plausible.EYE] = (
        3473.0  # "glare": vertical illuminance of the eye; sDGP 0.40
    )
    limit_dgp: Share | None = None  # "glare": DGP of every hour's picture in place of Ev
    slat_tilts_deg: tuple[float, ...] = ()  # "cut-off": of each state
    slat_width: Annotated[Positive, plausible.SLAT] = 0.08  # [m]
    slat_spacing: Annotated[Positive, plausible.SLAT] = 0.072  # [m]

    def fault(self, states: int) -> tuple[str, str] | None:
        """The key that does not fit windows of so many states, and what is wrong with it."""
        if isinstance(self.schedule, str):
            return None  # its states are known with the weather
        if self.rule == "schedule" and len(self.schedule) != CLOCK:
            return "schedule", f"expected {CLOCK} states, got {len(self.schedule)}"
        wanted = self.schedule if self.rule == "schedule" else (self.state,)
        if any(not 0 <= state < states for state in wanted):
            return "state", f"a state outside 0 to {states - 1}: the windows have {states}"
        if self.rule == "cut-off" and len(self.slat_tilts_deg) != states:
            return "slat_tilts_deg", f"expected one for each of {states} states"
        return None


class GainsTable(TomlTable):
    """Heat in the room during the occupied hours."""

    equipment_w_m2: Annotated[float | str, OrSchedule(plausible.GAIN)] = 8.0
    persons: Annotated[float | str, OrSchedule(plausible.PERSONS)] = 1.0
    person_w: Annotated[float, plausible.PERSON] = 75.0  # dry
    person_vapour_g_h: Annotated[float, plausible.VAPOUR] = 50.0
    vapour_g_h: Annotated[float | str, OrSchedule(plausible.VAPOUR)] = 0.0  # of all else
    lighting_w_m2: Annotated[float | str, OrSchedule(plausible.LAMPS)] = 0.0
    lighting_target_lx: Annotated[Positive, plausible.TARGET] = (
        500.0  # of the mean on the work plane; daylight dims
    )
    lighting_dimmed: bool = True  # False: daylight does not dim the lamps
    radiant_share: Share = 0.5
    # clock hours of every day, or a schedule of the share that is there: numbers above hold then
    occupied: Annotated[tuple[int, int] | str, OrSchedule(plausible.SHARE, clock_or_name)] = (8, 18)


class ComfortTable(TomlTable):
    """The person, for PMV and SET."""

    metabolic_rate: Annotated[float, Field(ge=0.7, le=4)] = 1.2  # [met]
    clothing: Annotated[float, Field(ge=0, le=2)] = 0.7  # [clo]
    air_speed: Annotated[float, Field(ge=0, le=2)] = 0.1  # [m/s]
    humidity: Annotated[float, Field(ge=0, le=100)] | None = None  # [%]; None: of the room's air
    mean_radiant: Literal["view factors", "room centre", "area"] = "view factors"


class RoomsTable(TomlTable):
    """Rooms that are operated otherwise: what is stated here goes before the file's own tables."""

    spaces: tuple[str, ...] = ()  # names or GUIDs
    types: tuple[str, ...] = ()  # of the IFC's space types
    control: ControlTable = ControlTable()
    gains: GainsTable = GainsTable()
    air: AirTable = AirTable()
    loads: LoadsTable = LoadsTable()
    envelope: EnvelopeTable = EnvelopeTable()

    @model_validator(mode="after")
    def _names_some(self) -> RoomsTable:
        if not self.spaces and not self.types:
            raise ValueError("name `spaces` or `types`")
        return self


PARTS = ("control", "gains", "air", "loads", "envelope")


def operated_tables(tables: TomlTable) -> Iterator[tuple[str, TomlTable]]:
    """The parts of a room's tables and the tables within them, with their places."""
    for part in PARTS:
        yield from tables_within(getattr(tables, part), part)


class OperationTables(TomlTable):
    """How rooms are operated: a file of `cfs run` and `cfs study`, a part of `cfs thermal`'s."""

    system: tuple[StateTable, ...] = ()  # states, from open to closed; none: those of the windows
    control: ControlTable = ControlTable()
    gains: GainsTable = GainsTable()
    air: AirTable = AirTable()
    loads: LoadsTable = LoadsTable()
    envelope: EnvelopeTable = EnvelopeTable()
    comfort: ComfortTable = ComfortTable()
    plant: PlantTable = PlantTable()
    terrain: Literal["country", "suburbs", "city"] = (
        "suburbs"  # what the weather station's wind becomes
    )
    heat_island: HeatIslandTable | None = None  # the air of a street in place of the station's
    rooms: tuple[RoomsTable, ...] = ()  # the first that names a room holds for it
    schedules: dict[str, ScheduleTable] = Field(default_factory=dict)
    calendar: CalendarTable = CalendarTable()

    @model_validator(mode="after")
    def _schedules_are_there(self) -> OperationTables:
        for number, tables in enumerate((self, *self.rooms), -1):
            place = "" if number < 0 else f"rooms.{number}."
            for part, table in operated_tables(tables):
                for key, (name, _) in scheduled_fields(table).items():
                    if name not in self.schedules:
                        fault = unknown_name(name, self.schedules)
                        raise ValueError(f"{place}{part}.{key}: {fault}")
        return self

    def control_fault(self, states: int) -> tuple[str, str] | None:
        """The key of `control` that does not fit windows of so many states, and what is wrong."""
        name = self.control.schedule
        if self.control.rule != "schedule" or not isinstance(name, str):
            return self.control.fault(states)
        wrong = sorted(set(self.schedules[name].stated) - set(range(states)))
        if wrong:
            return "schedule", f"{name!r} has state {wrong[0]:g}: the windows have {states}, from 0"
        return None

    def with_rooms(self, rooms: RoomsTable) -> OperationTables:
        """The tables with what an entry of `rooms` states."""
        found = {}
        for part in PARTS:
            stated = getattr(rooms, part)
            update = {key: getattr(stated, key) for key in stated.model_fields_set}
            found[part] = getattr(self, part).model_copy(update=update)
        return self.model_copy(update=found)

    @property
    def variants(self) -> tuple[OperationTables, ...]:
        """The tables of all rooms, then those of each entry of `rooms`."""
        return (self, *map(self.with_rooms, self.rooms))

    def of_room(self, building: Building, space: Space) -> OperationTables:
        """The tables of one room.

        Raises: `DataError` for a room or a type that the building does not have.
        """
        chosen = self.entry_of(building, space)
        return self if chosen is None else self.with_rooms(chosen)

    def entry_of(self, building: Building, space: Space) -> RoomsTable | None:
        """The first entry of `rooms` that names a room; None without one. Raises: as `of_room`."""
        chosen = None
        for number, rooms in reversed(tuple(enumerate(self.rooms))):
            guids = {building.room(name).space.guid for name in rooms.spaces}
            kinds = {one.type_name for one in building.spaces}
            for name in rooms.types:
                if name not in kinds:
                    there = ", ".join(sorted(filter(None, kinds))) or "none"
                    message = f"no space is of type {name!r}; there are: {there}"
                    raise DataError(message, file=building.file, field=f"rooms.{number}.types")
            if space.guid in guids or space.type_name in rooms.types:
                chosen = rooms
        return chosen
