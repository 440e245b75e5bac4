"""The tables of an operation file: states, control, gains, air, loads, envelope, comfort, plant."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from bim.model import Building, Space
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.weather import Weather, in_city
from scenes import plausible
from scenes.fenestration.thermal_file import StateTable
from scenes.room.schedules import (
    CalendarTable,
    Hours,
    OrSchedule,
    ScheduleTable,
    clock_or_name,
    scheduled_fields,
    tables_within,
    unknown_name,
)
from scenes.room.shading_rules import ControlTable, GroupTable
from scenes.room.surface_spectra import SurfaceTable
from scenes.toml_file import Positive, Share, TomlTable
from thermal.ground import SHIELDS, SOILS
from thermal.ventilation import BLAST, DOE2, DOOR_DISCHARGE, Leakage, aim2, sherman_grimsrud
from thermal.zone import OUTSIDE_ABSORPTANCE, ROUGHNESS, Dimming


class HeatIslandTable(TomlTable):
    """Urban heat island: the street of the room, see `mitsuba_cfs.sky.weather`."""

    sky_view: Share
    vegetation: Share
    hourly_shares: Annotated[tuple[Share, ...], Field(min_length=24, max_length=24)]

    def warmed(self, weather: Weather, file: Path | None) -> Weather:
        """The weather with the air of the street; a note of the weather states the warming.

        Args: file: of the table, named in messages.

        Raises: `DataError` outside the range of the equation.
        """
        try:
            return in_city(weather, self.sky_view, self.vegetation, self.hourly_shares)
        except ValueError as error:
            raise DataError(str(error), file=file, field="heat_island") from error


NAMED = {"constant": (1.0, 0.0, 0.0, 0.0), "doe-2": DOE2, "blast": BLAST}


def _factors(value: Any) -> Any:
    if isinstance(value, str) and value not in NAMED:
        raise ValueError(f"expected four numbers or one of {', '.join(NAMED)}, got {value!r}")
    return NAMED.get(value, value) if isinstance(value, str) else value


Factor = Annotated[float, Field(ge=0)]


class LeakageTable(TomlTable):
    """Leakage from a pressure test: an area at 4 Pa, or a coefficient with its exponent."""

    area_cm2: Annotated[Positive, plausible.LEAK] | None = None
    coefficient: Positive | None = None  # [m3/(s Pa^n)]
    exponent: Annotated[float, Field(ge=0.5, le=1.0)] = 0.67
    stack: Annotated[float, Field(ge=0, le=1)]
    wind: Annotated[float, Field(ge=0, le=1)]
    shelter: Annotated[float, Field(ge=0, le=1)] = 1.0  # of the wind, with `coefficient`

    @model_validator(mode="after")
    def _one_of_both(self) -> LeakageTable:
        if (self.area_cm2 is None) == (self.coefficient is None):
            raise ValueError("give either `area_cm2` or `coefficient`")
        return self

    def leakage(self) -> Leakage:
        """The leakage of the heat balance."""
        if self.area_cm2 is not None:
            return sherman_grimsrud(self.area_cm2, stack=self.stack, wind=self.wind)
        return aim2(self.coefficient, self.exponent, stack=self.stack, wind=self.wind, shelter=self.shelter)


class OpenedTable(TomlTable):
    """Airing by opened windows, EN 16798-7."""

    # share of the glass that opens, while allowed; or a schedule
    share: Annotated[float | str, OrSchedule(plausible.SHARE)] = 0.1
    flow: Literal["single-sided", "cross"] = "single-sided"
    when: Literal["always", "occupied"] = "occupied"  # a share that is a number
    absent_share: Share = 0.0  # "occupied": of the glass while nobody is there, such as tilted
    closed_in_rain: bool = False
    open_above_c: Annotated[float, plausible.TEMPERATURE] = 24.0
    close_below_c: Annotated[float, plausible.TEMPERATURE] = 22.0
    least_difference: Annotated[float, Field(ge=-20, le=20)] = 0.0  # above outdoors [K]
    greatest_wind: Annotated[Positive, plausible.WIND] = 60.0  # [m/s]
    least_outdoor_c: Annotated[float, plausible.OUTDOOR] = 10.0
    # air change of open windows where a standard states it, instead of EN 16798-7's flow
    ach: Annotated[Positive, plausible.AIR_CHANGE] | None = None
    heating_while_open: bool = False  # else they close before the air needs heating
    temperature: Literal["air", "operative"] = "air"  # of the room, of open_above_c, close_below_c
    night_share: Share | None = None  # of the glass, at most, in the hours of `air.night`: burglary
    # open, they replace the fan; they are shut while the room needs cooling besides
    hybrid: bool = False

    @model_validator(mode="after")
    def _do_not_cross(self) -> OpenedTable:
        if self.close_below_c > self.open_above_c:
            raise ValueError("close_below_c: lies above open_above_c")
        return self


class NeighbourAirTable(TomlTable):
    """Air exchanged with a neighbour of known temperature, the same flow each way."""

    temperature_c: Annotated[float | str, OrSchedule(plausible.TEMPERATURE)]
    # of an opening with buoyant exchange, warm air above and cool air below: an open door
    width: Annotated[Positive, plausible.LENGTH] | None = None  # [m]
    height: Annotated[Positive, plausible.LENGTH] | None = None  # [m]
    discharge: Annotated[Positive, Field(le=1)] = DOOR_DISCHARGE
    open: Annotated[float | str, OrSchedule(plausible.SHARE)] = 1.0  # share of its width
    m3_h: Annotated[float | str, OrSchedule(plausible.FLOW)] = 0.0  # at any temperature

    @model_validator(mode="after")
    def _has_a_size_or_a_flow(self) -> NeighbourAirTable:
        if (self.width is None) != (self.height is None):
            raise ValueError("width and height belong together")
        if self.width is None and "m3_h" not in self.model_fields_set:
            raise ValueError("give `width` and `height` of an opening, or `m3_h`")
        return self


class AirTable(TomlTable):
    """Outdoor air."""

    infiltration_ach: Annotated[float | str, OrSchedule(plausible.AIR_CHANGE)] = 0.5
    # a, b, c, d: infiltration (a + b dT + c v + d v^2); "constant", "doe-2" or "blast"
    infiltration_factors: Annotated[tuple[Factor, Factor, Factor, Factor], BeforeValidator(_factors)] = NAMED[
        "constant"
    ]
    leakage: LeakageTable | None = None  # besides the infiltration
    windows: OpenedTable | None = None
    night_ach: Annotated[float | str, OrSchedule(plausible.AIR_CHANGE)] = 0.0  # by night
    night: Hours = (0, 7)
    # of a fan, while occupied; or a schedule
    ventilation_ach: Annotated[float | str, OrSchedule(plausible.AIR_CHANGE)] = 0.0
    heat_recovery: Share = 0.0  # of the fan's air
    bypass_above_c: Annotated[float, plausible.TEMPERATURE] | None = None  # no recovery above
    least_supply_c: Annotated[float, plausible.TEMPERATURE] | None = None  # heated to that
    supply_c: Annotated[float | str | None, OrSchedule(plausible.TEMPERATURE)] = None
    fan_w_m3_s: Annotated[float, plausible.FAN] = 0.0  # electricity of the fan
    neighbour: tuple[NeighbourAirTable, ...] = ()  # rooms that are not simulated
    # each way through every open door between coupled rooms [m3/s]; 0: the doors are shut
    door_m3_s: Annotated[float, plausible.DOOR_FLOW] = 0.0

    @model_validator(mode="after")
    def _one_temperature(self) -> AirTable:
        if self.supply_c is not None and (self.heat_recovery or self.least_supply_c is not None):
            raise ValueError("supply_c: leaves nothing to recover or to heat")
        return self


SetPoint = Annotated[float | str | None, OrSchedule(plausible.TEMPERATURE)]
Cop = Annotated[Positive, plausible.COP]


class SlabTable(TomlTable):
    """Pipes or wires in a construction, with power proportional to the deviation of the air."""

    faces: tuple[str, ...] = ("floor",)  # side of the box, or kind of faces; the largest surface
    depth: Annotated[Positive, plausible.LAYER] = 0.05  # below the inside face [m]
    heating_c: SetPoint = None
    cooling_c: SetPoint = None
    heating_w_m2: Annotated[float, plausible.GAIN] = 60.0  # at full power
    cooling_w_m2: Annotated[float, plausible.GAIN] = 40.0
    band: Annotated[Positive, Field(le=20)] = 2.0  # from none to full power [K]


class LoadsTable(TomlTable):
    """Ideal heating and cooling; a room without set points floats."""

    heating_c: SetPoint = None
    cooling_c: SetPoint = None
    heating_limit_w: Annotated[Positive, plausible.POWER] | None = None
    cooling_limit_w: Annotated[Positive, plausible.POWER] | None = None
    heating_radiant: Share = 0.0  # radiators 0.3, ceilings 0.6
    cooling_radiant: Share = 0.0
    # where the radiant share acts: side of the box, or kind of faces, the largest surface of them;
    # default: all surfaces
    heating_faces: tuple[str, ...] = ()
    cooling_faces: tuple[str, ...] = ()
    slab: SlabTable | None = None
    humidify_to: Annotated[float, plausible.PERCENT] | None = None  # relative humidity [%]
    dehumidify_to: Annotated[float, plausible.PERCENT] | None = None

    @model_validator(mode="after")
    def _do_not_cross(self) -> LoadsTable:
        if isinstance(self.heating_c, float) and isinstance(self.cooling_c, float):
            if self.heating_c > self.cooling_c:
                raise ValueError("the set points cross: heating_c lies above cooling_c")
        low, high = self.humidify_to, self.dehumidify_to
        if low is not None and high is not None and low > high:
            raise ValueError("humidify_to: lies above dehumidify_to")
        return self


class PlantTable(TomlTable):
    """An ideal plant by its COP, and primary energy factors."""

    # heat per final energy: a number, or pairs of outdoor temperature and COP between which it
    # is linear
    heating_cop: Cop | tuple[tuple[Annotated[float, plausible.OUTDOOR], Cop], ...] = 1.0
    cooling_cop: Cop | tuple[tuple[Annotated[float, plausible.OUTDOOR], Cop], ...] = 3.0
    heating_factor: Annotated[float, plausible.FACTOR] = 1.1  # primary per final energy
    electricity_factor: Annotated[float, plausible.FACTOR] = 2.5  # of cooling, fans, lamps, plugs

    @model_validator(mode="after")
    def _rises(self) -> PlantTable:
        for key in ("heating_cop", "cooling_cop"):
            pairs = getattr(self, key)
            if isinstance(pairs, tuple):
                at = [temperature for temperature, _ in pairs]
                if not at or any(b <= a for a, b in pairwise(at)):
                    raise ValueError(f"{key}: expected pairs by rising outdoor temperature")
        return self


KINDS = ("slab", "suspended", "basement", "unheated basement")


class BridgeTable(TomlTable):
    """A thermal bridge to outdoors, along a line or at a point."""

    name: str = ""
    psi: Annotated[float, plausible.PSI] | None = None  # [W/(m K)]
    length: Annotated[Positive, plausible.LENGTH] | None = None  # [m]
    chi: Annotated[float, plausible.CHI] | None = None  # [W/K]
    number: Annotated[int, Field(ge=1)] = 1

    @model_validator(mode="after")
    def _line_or_point(self) -> BridgeTable:
        if (self.psi is None) == (self.chi is None) or (self.psi is None) != (self.length is None):
            raise ValueError("give either `psi` with its `length`, or `chi`")
        return self

    @property
    def conductance(self) -> float:
        """Heat flow per kelvin [W/K]."""
        each = self.chi if self.psi is None else self.psi * self.length
        return self.number * each


class GroundTable(TomlTable):
    """The ground below a room by ISO 13370, for the whole building."""

    kind: Literal[KINDS] = "slab"
    area: Annotated[Positive, plausible.AREA] | None = None  # of the building's floor [m2]
    perimeter: Annotated[Positive, plausible.PERIMETER]  # of it, exposed [m]
    wall_thickness: Annotated[float, plausible.LAYER] = 0.3  # of the walls above [m]
    soil: Literal[tuple(SOILS)] = "sand"  # ISO 13370: where nothing is known
    conductivity: Annotated[Positive, plausible.CONDUCTIVITY] | None = None  # [W/(m K)]
    heat_capacity: Annotated[Positive, plausible.SOIL_CAPACITY] | None = None  # [J/(m3 K)]
    indoor_c: Annotated[float, plausible.TEMPERATURE] = 20.0  # the year's mean inside
    # insulation at the edge of a slab: depth or width [m], resistance [m2 K/W]
    edge: tuple[Positive, Annotated[float, plausible.RESISTANCE]] | None = None
    edge_lies: Literal["vertical", "horizontal"] = "vertical"
    depth: Annotated[Positive, plausible.DEPTH] | None = None  # of a basement's floor [m]
    # above the ground outside: of the floor over a crawl space, of a cellar's walls [m]
    height: Annotated[float, Field(ge=0), plausible.LENGTH] = 0.5
    wall_u: Annotated[Positive, plausible.U_VALUE] = 1.0  # of those walls [W/(m2 K)]
    vents: Annotated[float, Field(ge=0, le=0.5)] = 0.0015  # of a crawl space [m2/m]
    shield: Literal[tuple(SHIELDS)] = "average"
    # of what lies on the ground below a crawl space or cellar, and of a cellar's walls [m2 K/W]
    below_resistance: Annotated[float, plausible.RESISTANCE] = 0.0
    wall_resistance: Annotated[float, plausible.RESISTANCE] = 0.0

    @model_validator(mode="after")
    def _has_its_depth(self) -> GroundTable:
        if (self.depth is not None) != self.kind.endswith("basement"):
            raise ValueError("depth: goes with a basement, and a basement with it")
        if self.edge is not None and self.kind != "slab":
            raise ValueError("edge: belongs to a slab")
        return self


class NeighbourTable(TomlTable):
    """A neighbour of known temperature behind some of a room's faces."""

    faces: tuple[str, ...] = ()  # sides of the box, or kinds of faces: "wall", "floor", "ceiling"
    spaces: tuple[str, ...] = ()  # rooms of the model, by name or GUID
    temperature_c: Annotated[float | str, OrSchedule(plausible.TEMPERATURE)]
    film: Annotated[float, plausible.RESISTANCE] = 0.13  # at the far side [m2 K/W]; 0: its face

    @model_validator(mode="after")
    def _names_some(self) -> NeighbourTable:
        if not self.faces and not self.spaces:
            raise ValueError("name `faces` or `spaces`")
        return self


class EnvelopeTable(TomlTable):
    """Properties of the envelope that a building model does not contain."""

    ground: GroundTable | None = None  # without: by the building's floors, `default_ground`
    neighbour: tuple[NeighbourTable, ...] = ()
    bridge: tuple[BridgeTable, ...] = ()
    # of all outdoor surfaces except frames
    outside_absorptance: Share = OUTSIDE_ABSORPTANCE  # solar
    outside_roughness: Literal[tuple(ROUGHNESS)] = "medium rough"  # DOE-2, for the outside film
    frame_u: Annotated[Positive, plausible.FRAME_U] | None = None  # with films 0.13 and 0.04
    frame_psi: Annotated[float, plausible.PSI] = 0.0  # along the edges of the glass [W/(m K)]


class LuminaireTable(TomlTable):
    """A luminaire of a room by its photometry, or several in a row."""

    file: Path  # .ies (IES LM-63) or .ldt (EULUMDAT)
    zone: str = ""  # of `lighting_zone`
    position: tuple[float, float, float]  # [m]
    turned_deg: float = 0.0  # of C0 from +x, anticlockwise
    number: Annotated[int, Field(ge=1, le=1000)] = 1
    step: tuple[float, float, float] = (0.0, 0.0, 0.0)  # from one to the next [m]
    watts: Annotated[Positive, plausible.POWER] | None = None  # where the file states none
    # of its light: a CIE illuminant ("LED-B3", "FL11"), a CSV file of wavelength_nm and power, or SPDX
    spectrum: str | None = None

    @model_validator(mode="after")
    def _steps(self) -> LuminaireTable:
        if self.number > 1 and not any(self.step):
            raise ValueError("step: several luminaires need a distance")
        return self


class LightingZoneTable(TomlTable):
    """Lamps of a room that one photosensor dims, or none."""

    name: str
    at: tuple[float, float] | None = None  # the sensor's place on the work plane [m]; None: its mean
    share: Share | None = None  # of the room's lamps; with luminaires: those that name the zone
    lighting_dimmed: bool = True  # False: no sensor
    lighting_target_lx: Annotated[Positive, plausible.TARGET] | None = None  # None: the room's
    lighting_sensor_factor: Annotated[float, Field(ge=0.1, le=10)] | None = None  # None: the room's
    lighting_full_lx: Annotated[Positive, plausible.TARGET] | None = None  # at the sensor, by all lamps


class GainsTable(TomlTable):
    """Internal gains during the occupied hours."""

    equipment_w_m2: Annotated[float | str, OrSchedule(plausible.GAIN)] = 8.0
    equipment_w: Annotated[float | str, OrSchedule(plausible.POWER)] = 0.0  # of the room, besides
    persons: Annotated[float | str, OrSchedule(plausible.PERSONS)] = 1.0
    person_w: Annotated[float, plausible.PERSON] = 75.0  # dry
    person_vapour_g_h: Annotated[float, plausible.VAPOUR] = 50.0
    vapour_g_h: Annotated[float | str, OrSchedule(plausible.VAPOUR)] = 0.0  # of other sources
    lighting_w_m2: Annotated[float | str, OrSchedule(plausible.LAMPS)] = 0.0
    lighting_target_lx: Annotated[Positive, plausible.TARGET] = (
        500.0  # mean of the work plane, to which the lamps are dimmed
    )
    lighting_dimmed: bool = True  # False: daylight does not dim the lamps
    lighting_least_light: Annotated[float, Field(ge=0, le=0.99)] = 0.0  # dimmed no further: share
    lighting_least_power: Share = 0.0  # of their power that gives this light
    lighting_off: bool = False  # lamps are off where less light than that is needed
    # what the sensor reads over the mean daylight of the work plane: its error, or its place
    lighting_sensor_factor: Annotated[float, Field(ge=0.1, le=10)] = 1.0
    # of the work plane by the lamps alone; default: the target
    lighting_full_lx: Annotated[Positive, plausible.TARGET] | None = None
    luminaire: tuple[LuminaireTable, ...] = ()  # in place of lighting_w_m2 and lighting_full_lx
    luminaires: Literal["", "model"] = ""  # "model": those of the building's file, in place of `luminaire`
    luminaire_w: Annotated[Positive, plausible.POWER] | None = None  # of the model's that state no power
    lighting_zone: tuple[LightingZoneTable, ...] = ()  # parts of the lamps with sensors of their own
    lighting_standby_w_m2: Annotated[float, plausible.LAMPS] = 0.0  # at all hours, EN 15193-1's W_P
    radiant_share: Share = 0.5
    # clock hours of every day, or a schedule of the share of people; multiplies the constants above
    occupied: Annotated[tuple[int, int] | str, OrSchedule(plausible.SHARE, clock_or_name)] = (8, 18)

    @model_validator(mode="after")
    def _states_lamps_once(self) -> GainsTable:
        if self.luminaire and self.luminaires:
            raise ValueError("luminaires: the file has [[gains.luminaire]] of its own")
        if self.luminaire or self.luminaires:
            for key in ("lighting_w_m2", "lighting_full_lx"):
                if key in self.model_fields_set:
                    raise ValueError(f"{key}: follows from the luminaires")
        return self

    @model_validator(mode="after")
    def _zones_are_whole(self) -> GainsTable:
        names = [zone.name for zone in self.lighting_zone]
        if len(set(names)) < len(names):
            raise ValueError("lighting_zone: two of the same name")
        for number, one in enumerate(self.luminaire):
            if (one.zone in names) != bool(names) or (one.zone and not names):
                raise ValueError(f"luminaire.{number}.zone: expected one of {', '.join(names) or 'none'}")
        shares = [zone.share for zone in self.lighting_zone]
        if self.luminaire and any(share is not None for share in shares):
            raise ValueError("lighting_zone: shares follow from the luminaires")
        if names and self.luminaires:
            raise ValueError("lighting_zone: luminaires of the model name no zones")
        if names and not self.luminaire and abs(sum(share or 0.0 for share in shares) - 1.0) > 1e-6:
            raise ValueError("lighting_zone: shares of the lamps add up to 1")
        return self

    @property
    def zones(self) -> tuple[tuple[float, GainsTable, tuple[float, float] | None], ...]:
        """Share of the lamps, their tables and the sensor's place of each zone; one without zones."""
        if not self.lighting_zone:
            return ((1.0, self, None),)
        found = []
        for zone in self.lighting_zone:
            keys = ("lighting_dimmed", "lighting_target_lx", "lighting_sensor_factor", "lighting_full_lx")
            changed = {key: getattr(zone, key) for key in keys if getattr(zone, key) is not None}
            found.append((zone.share or 0.0, self.model_copy(update=changed | {"lighting_zone": ()}), zone.at))
        return tuple(found)

    @property
    def dims(self) -> bool:
        """Whether daylight dims some of the lamps."""
        return any(tables.dimming is not None for _, tables, _ in self.zones)

    @property
    def dimming(self) -> Dimming | None:
        """How daylight dims the lamps; None: it does not, or by zones (`zones`)."""
        if not (self.lighting_dimmed and self.lighting_w_m2):
            return None
        return Dimming(
            self.lighting_target_lx,
            self.lighting_least_light,
            self.lighting_least_power,
            self.lighting_off,
            self.lighting_sensor_factor,
            self.lighting_full_lx,
        )


class ComfortTable(TomlTable):
    """The person, for PMV and SET."""

    metabolic_rate: Annotated[float, Field(ge=0.7, le=4)] = 1.2  # [met]
    clothing: Annotated[float, Field(ge=0, le=2)] = 0.7  # [clo]
    air_speed: Annotated[float, Field(ge=0, le=2)] = 0.1  # [m/s]
    humidity: Annotated[float, Field(ge=0, le=100)] | None = None  # [%]; None: of the room's air
    mean_radiant: Literal["view factors", "room centre", "area"] = "view factors"


class RoomsTable(TomlTable):
    """Tables of some rooms; their values replace those of the file's tables for all rooms."""

    spaces: tuple[str, ...] = ()  # names or GUIDs
    types: tuple[str, ...] = ()  # of the IFC's space types
    storeys: tuple[str, ...] = ()
    zones: tuple[str, ...] = ()  # IfcZone
    control: ControlTable = ControlTable()
    gains: GainsTable = GainsTable()
    air: AirTable = AirTable()
    loads: LoadsTable = LoadsTable()
    envelope: EnvelopeTable = EnvelopeTable()

    @model_validator(mode="after")
    def _names_some(self) -> RoomsTable:
        if not (self.spaces or self.types or self.storeys or self.zones):
            raise ValueError("name `spaces`, `types`, `storeys` or `zones`")
        return self


PARTS = ("control", "gains", "air", "loads", "envelope")


def operated_tables(tables: TomlTable) -> Iterator[tuple[str, TomlTable]]:
    """The parts of a room's tables and the tables within them, with their paths."""
    for part in PARTS:
        yield from tables_within(getattr(tables, part), part)


Deviation = Annotated[float, Field(ge=0)]


class BandsTable(TomlTable):
    """Standard deviations of inputs for `--bands`, in place of the usual ones; 0: the input is known."""

    reflectance_floor: Deviation | None = None
    reflectance_walls: Deviation | None = None
    reflectance_ceiling: Deviation | None = None
    reflectance_furniture: Deviation | None = None
    reflectance_ground: Deviation | None = None
    transmittance_percent: Deviation | None = None
    sky_percent: Deviation | None = None
    tilt_deg: Deviation | None = None
    g_value: Deviation | None = None
    u_value: Deviation | None = None
    gains_percent: Deviation | None = None
    infiltration_percent: Deviation | None = None
    heating_set_c: Deviation | None = None
    cooling_set_c: Deviation | None = None
    slat_width_mm: Deviation | None = None
    slat_reflectance: Deviation | None = None


def rooms_of(building: Building, table: RoomsTable | GroupTable, place: str) -> set[str]:
    """GUIDs of the rooms that a table names by `spaces`, `storeys` and `zones`.

    Raises: `DataError` for a name that the building does not have.
    """
    guids = {building.room(name).space.guid for name in table.spaces}
    named = {
        "storeys": (table.storeys, building.storey, {space.storey for space in building.spaces}),
        "zones": (table.zones, building.zone, {zone.name for zone in building.zones}),
    }
    for key, (names, spaces_of, known) in named.items():
        for name in names:
            spaces = spaces_of(name)
            if not spaces:
                there = ", ".join(sorted(filter(None, known))) or "none"
                message = f"no {key[:-1]} {name!r}; there are: {there}"
                raise DataError(message, file=building.file, field=f"{place}.{key}")
            guids |= {space.guid for space in spaces}
    return guids


class OperationTables(TomlTable):
    """Operation of rooms: a file of `cfs run` and `cfs study`, a part of `cfs thermal`'s file."""

    system: tuple[StateTable, ...] = ()  # states, open to closed; none: the building file's
    # states at tilts between those of [[system]] with `tilt_deg`, in about these steps [deg]
    tilt_step_deg: Annotated[float, Field(ge=1, le=90)] | None = None
    control_of: Path | None = None  # an IFC file that holds the rules, in place of `control`
    control: ControlTable = ControlTable()
    gains: GainsTable = GainsTable()
    air: AirTable = AirTable()
    loads: LoadsTable = LoadsTable()
    envelope: EnvelopeTable = EnvelopeTable()
    comfort: ComfortTable = ComfortTable()
    plant: PlantTable = PlantTable()
    surface: tuple[SurfaceTable, ...] = ()  # colours, for light by wavelength; the first that fits
    terrain: Literal["country", "suburbs", "city"] = "suburbs"  # of the site, for the wind profile
    heat_island: HeatIslandTable | None = None  # air of a street in place of the weather station's
    rooms: tuple[RoomsTable, ...] = ()  # the first entry that names a room applies to it
    schedules: dict[str, ScheduleTable] = Field(default_factory=dict)
    calendar: CalendarTable = CalendarTable()
    bands: BandsTable = BandsTable()

    @model_validator(mode="after")
    def _has_one_control(self) -> OperationTables:
        if self.control_of is not None and "control" in self.model_fields_set:
            raise ValueError("control_of: the file has [control] of its own")
        return self

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
        """The path of the key that does not fit windows with `states` states, and the fault."""
        planned = self.control.plan_fault  # an entry of `rooms` brings groups of its own
        if planned is not None:
            return planned
        tilted = any(one.tilt_deg is not None for one in self.system)
        for place, rule in self.control.rules:
            fault = rule.fault(states, self.schedules)
            if fault is not None:
                return f"{place}.{fault[0]}", fault[1]
            bare = [r for r in rule.leaves if r.rule == "cut-off" and not r.slat_tilts_deg]
            if bare and not tilted:
                message = f"expected one for each of {states} states, or `tilt_deg` of [[system]]"
                return f"{place}.slat_tilts_deg", message
        return None

    def with_rooms(self, rooms: RoomsTable) -> OperationTables:
        """The tables with the values of an entry of `rooms`."""
        parts = {}
        for part in PARTS:
            stated = getattr(rooms, part)
            update = {key: getattr(stated, key) for key in stated.model_fields_set}
            if part == "control":
                update = self.control.changed_by(rooms.control) | update
            parts[part] = getattr(self, part).model_copy(update=update)
        return self.model_copy(update=parts)

    @property
    def variants(self) -> tuple[OperationTables, ...]:
        """The tables of all rooms, then those of each entry of `rooms`."""
        return (self, *map(self.with_rooms, self.rooms))

    def of_room(self, building: Building, space: Space) -> OperationTables:
        """The tables of one room.

        Raises: `DataError` for a room, a type or a window that the building does not have.
        """
        chosen = self.entry_of(building, space)
        tables = self if chosen is None else self.with_rooms(chosen)
        windows = {name for one in building.spaces for w in one.windows for name in (w.guid, w.name)}
        for number, group in enumerate(tables.control.group):
            for name in group.windows:
                if name not in windows:
                    known = sorted({w.name or w.guid for w in space.windows})
                    there = ", ".join(known[:20]) + (" ..." if len(known) > 20 else "") or "none"
                    message = f"no room has a window {name!r}; this one has: {there}"
                    field = f"control.group.{number}.windows"
                    raise DataError(message, file=building.file, field=field)
            rooms_of(building, group, f"control.group.{number}")
        return tables

    def entry_of(self, building: Building, space: Space) -> RoomsTable | None:
        """The first entry of `rooms` that names a room; None without one.

        Raises: see `of_room`.
        """
        chosen = None
        for number, rooms in reversed(tuple(enumerate(self.rooms))):
            guids = rooms_of(building, rooms, f"rooms.{number}")
            kinds = {one.type_name for one in building.spaces}
            for name in rooms.types:
                if name not in kinds:
                    there = ", ".join(sorted(filter(None, kinds))) or "none"
                    message = f"no space is of type {name!r}; there are: {there}"
                    raise DataError(message, file=building.file, field=f"rooms.{number}.types")
            if space.guid in guids or space.type_name in rooms.types:
                chosen = rooms
        return chosen
