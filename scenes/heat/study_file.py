"""The study file of `cfs thermal`: rooms, weather, shading states, control, gains, set points."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from bim.ifc.corrections import corrections_beside
from bim.ifc.head import check_head
from mitsuba_cfs.errors import DataError
from scenes.quick import HEAT, picks
from scenes.toml_file import read_table, validated
from thermal.closure import Closure
from thermal.glazing import Gap
from thermal.zone import IdealLoads

Positive = Annotated[float, Field(gt=0)]
Share = Annotated[float, Field(ge=0, le=1)]


def _in_order(hours: tuple[int, int]) -> tuple[int, int]:
    """Two clock times of one day: the balance takes no span over midnight."""
    start, end = hours
    if not 0 <= start < end <= 24:
        raise ValueError(f"expected two hours of one day, 0 <= from < to <= 24, got {list(hours)}")
    return hours


Hours = Annotated[
    tuple[int, int], AfterValidator(_in_order), Field(description="clock times from and to")
]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class LayerTable(_Table):
    """A layer of a construction."""

    name: str = "layer"
    thickness: Positive  # [m]
    conductivity: Positive  # [W/(m K)]
    density: Positive  # [kg/m3]
    heat_capacity: Positive  # [J/(kg K)]


class WindowTable(_Table):
    """A rectangular opening of the box."""

    x: float
    sill: float
    width: Positive
    height: Positive
    side: Literal["front", "right", "back", "left", "ceiling"] = "front"
    frame: Annotated[float, Field(ge=0)] = 0.0


class BoxTable(_Table):
    """A box-shaped room in place of a building file."""

    width: Positive
    depth: Positive
    height: Positive
    facing_deg: float = 180.0
    recess: Annotated[float, Field(ge=0)] = 0.0
    window: tuple[WindowTable, ...]
    reflectance: dict[str, Share] = {}
    adjacency: dict[str, Literal["outside", "ground", "space", "adiabatic"]] = {}
    construction: dict[str, tuple[LayerTable, ...]] = {}  # by side or kind, outermost first


class GapTable(_Table):
    """The gas gap of a double glazing, for `u_model = "gap"`."""

    width: Positive  # [m]
    gas: dict[str, Share] = {"argon": 0.9, "air": 0.1}
    emissivity: tuple[Share, Share] = (0.837, 0.03)  # of the two faces that bound it


class ClosureTable(_Table):
    """How a system's thermal model is closed: in a study, and beside a BSDF file."""

    u_model: Literal["constant", "linear", "gap"] = "constant"  # with the temperatures
    gap: GapTable | None = None
    realised_inner_resistance: Positive | None = None  # [m2 K/W], see thermal.blackbox
    realised_outer_resistance: Positive | None = None

    @model_validator(mode="after")
    def _has_its_gap(self) -> ClosureTable:
        if (self.u_model == "gap") != (self.gap is not None):
            raise ValueError('u_model "gap" and a [system.gap] table belong together')
        return self

    def closure(self) -> Closure | None:
        """What the table states; None where it states nothing."""
        if not self.model_fields_set & set(ClosureTable.model_fields):
            return None
        gap = self.gap
        if gap is not None:
            gap = Gap(gap.width, tuple(gap.gas.items()), gap.emissivity)
        return Closure(
            self.u_model, gap, self.realised_inner_resistance, self.realised_outer_resistance
        )


class SystemTable(ClosureTable):
    """One shading state: a BSDF file and what else was measured."""

    bsdf: Path
    u_value: Annotated[float, Field(ge=0.1, le=7)] | None = None
    g_value: Share | None = None


class ControlTable(_Table):
    """Which state holds: states are numbered from 0 in the order of the file."""

    rule: Literal["always", "schedule", "irradiance", "glare", "cut-off"] = "always"
    state: Annotated[int, Field(ge=0)] = 0  # "always"; and the closed one of "irradiance"
    schedule: tuple[int, ...] = ()  # "schedule": 24 states
    close_above: Positive = 200.0  # "irradiance" on the windows [W/m2]
    open_below: Annotated[float, Field(ge=0)] | None = None
    limit_lx: Positive = 3473.0  # "glare": vertical illuminance of the eye; sDGP 0.40
    slat_tilts_deg: tuple[float, ...] = ()  # "cut-off": of each state
    slat_width: Positive = 0.08  # [m]
    slat_spacing: Positive = 0.072  # [m]


class GainsTable(_Table):
    """Heat in the room during the occupied hours."""

    equipment_w_m2: Annotated[float, Field(ge=0)] = 8.0
    persons: Annotated[float, Field(ge=0)] = 1.0
    person_w: Annotated[float, Field(ge=0)] = 75.0
    lighting_w_m2: Annotated[float, Field(ge=0)] = 0.0
    lighting_target_lx: Positive = 500.0  # of the mean on the work plane; daylight dims
    radiant_share: Share = 0.5
    occupied: Hours = (8, 18)


class AirTable(_Table):
    """Outdoor air."""

    infiltration_ach: Annotated[float, Field(ge=0)] = 0.5
    night_ach: Annotated[float, Field(ge=0)] = 0.0  # more of it in these hours
    night: Hours = (0, 7)
    # each way through every open door between coupled rooms [m3/s]; 0: the doors are shut
    door_m3_s: Annotated[float, Field(ge=0)] = 0.0


class LoadsTable(_Table):
    """Ideal heating and cooling; without set points the room floats."""

    heating_c: float | None = None
    cooling_c: float | None = None
    heating_limit_w: Positive | None = None
    cooling_limit_w: Positive | None = None

    def ideal(self) -> IdealLoads:
        """Set points and limits; none stated means never, and without limit."""
        infinity = float("inf")
        return IdealLoads(
            -infinity if self.heating_c is None else self.heating_c,
            infinity if self.cooling_c is None else self.cooling_c,
            self.heating_limit_w or infinity,
            self.cooling_limit_w or infinity,
        )


class ComfortTable(_Table):
    """The person, for PMV and SET."""

    metabolic_rate: Annotated[float, Field(ge=0.7, le=4)] = 1.2  # [met]
    clothing: Annotated[float, Field(ge=0, le=2)] = 0.7  # [clo]
    air_speed: Annotated[float, Field(ge=0, le=2)] = 0.1  # [m/s]
    humidity: Annotated[float, Field(ge=0, le=100)] = 50.0  # relative, indoors [%]
    mean_radiant: Literal["view factors", "room centre", "area"] = "view factors"


class TraceTable(_Table):
    """Rays."""

    patch_samples: Annotated[int, Field(ge=64)] = 8192
    sensor_samples: Annotated[int, Field(ge=64)] = 16384
    sky_subdivision: Literal[1, 2, 4, 6] = 1
    seed: int = 0
    view_factors: bool = True  # of the room's surfaces, for longwave and the person


class StudyFile(_Table):
    """A whole study; paths are relative to the file."""

    weather: Path
    building: Path | None = None
    spaces: tuple[str, ...] = ()
    join: tuple[str, ...] = ()  # rooms to make one, as "Hall + Living"
    couple: bool = False  # heat flows through the walls between the rooms
    box: BoxTable | None = None
    system: tuple[SystemTable, ...] = ()  # states; none: what the building's file holds
    control: ControlTable = ControlTable()
    gains: GainsTable = GainsTable()
    air: AirTable = AirTable()
    loads: LoadsTable = LoadsTable()
    comfort: ComfortTable = ComfortTable()
    trace: TraceTable = TraceTable()
    step_minutes: Literal[1, 2, 3, 4, 5, 6, 10, 12, 15, 20, 30, 60] = 10

    @model_validator(mode="after")
    def _fits(self) -> StudyFile:
        if (self.building is None) == (self.box is None):
            raise ValueError("give either `building` or `[box]`")
        if self.system:
            self.check_states(len(self.system))
        elif self.box is not None:
            raise ValueError("system: is missing; a box holds no fenestration data")
        warm, cool = self.loads.heating_c, self.loads.cooling_c
        if warm is not None and cool is not None and warm > cool:
            raise ValueError("loads: the set points heating_c lies above cooling_c")
        return self

    def check_states(self, states: int) -> None:
        """Raise `ValueError` where the control names states that the windows do not have."""
        rule = self.control.rule
        wanted = self.control.schedule if rule == "schedule" else (self.control.state,)
        if rule == "schedule" and len(wanted) != 24:
            raise ValueError(f"control.schedule: expected 24 states, got {len(wanted)}")
        if any(not 0 <= s < states for s in wanted):
            raise ValueError(f"control: a state outside 0 to {states - 1} ([[system]] tables)")
        if rule == "cut-off" and len(self.control.slat_tilts_deg) != states:
            raise ValueError("control.slat_tilts_deg: expected one for each [[system]]")


def read_study(path: Path, *, quick: bool = False) -> StudyFile:
    """The study of a TOML file, its paths made absolute.

    Args: quick: few rays where the file does not say how many.

    Raises: `DataError` naming the file and the field.
    """
    study = validated(StudyFile, read_table(path), path)
    here = path.parent
    systems = tuple(s.model_copy(update={"bsdf": _there(here, s.bsdf, path)}) for s in study.system)
    found = {"weather": _there(here, study.weather, path), "system": systems}
    if quick:
        given = study.trace.model_fields_set
        found["trace"] = study.trace.model_copy(update=picks(HEAT, given))
    if study.building is not None:
        found["building"] = _there(here, study.building, path)
        check_head(found["building"])
        corrections_beside(found["building"])
    return study.model_copy(update=found)


def _there(folder: Path, name: Path, study: Path) -> Path:
    place = folder / name
    if not place.is_file():
        raise DataError(f"no such file: {name}", file=study)
    return place
