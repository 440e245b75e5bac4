"""The study file of `cfs thermal`: rooms, weather, shading states, control, gains, set points."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from bim.building_file import check_building_file
from bim.model import BOX_PARTS
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.gloss import ROUGHEST
from mitsuba_cfs.methods import METHODS
from mitsuba_cfs.sky.options import SUN_MODELS
from scenes import plausible
from scenes.fenestration.thermal_file import StateTable
from scenes.heat.measured_weather import MeasuredTable
from scenes.input_options import InputOptions
from scenes.quick import HEAT, picks
from scenes.room.operation import schedules_there
from scenes.room.operation_tables import OperationTables
from scenes.room.options import SKY_LIGHTS, RoomOptions
from scenes.room.schedules import OrSchedule, unknown_name
from scenes.toml_file import OutdoorTable, Positive, ReadTable, Share, TomlTable, read_options, read_table, validated

Part = Literal[BOX_PARTS]  # a side of the box, or all its faces of a kind
Length = Annotated[Positive, plausible.LENGTH]  # [m]
RUN = RoomOptions()  # what is not stated otherwise is as in `cfs run`


class LayerTable(TomlTable):
    """A layer of a construction."""

    name: str = "layer"
    thickness: Annotated[Positive, plausible.LAYER]  # [m]
    conductivity: Annotated[float, plausible.CONDUCTIVITY]  # [W/(m K)]
    density: Annotated[Positive, plausible.DENSITY]  # [kg/m3]
    heat_capacity: Annotated[float, plausible.HEAT_CAPACITY]  # [J/(kg K)]


class WindowTable(TomlTable):
    """A rectangular opening of the box."""

    name: str = ""  # for `windows` of [[control.group]]; none: "window 1" and so on
    x: float
    sill: float
    width: Length
    height: Length
    side: Literal["front", "right", "back", "left", "ceiling"] = "front"
    frame: Annotated[float, Field(ge=0)] = 0.0


class PlateTable(TomlTable):
    """An overhang or a fin: a plate out of a line on a side of the box, as of `bim.shoebox`."""

    start: tuple[float, float]  # x to the right seen from outdoors, y above the floor [m]
    end: tuple[float, float]
    depth: Length  # from the plane of the glass [m]
    side: Literal["front", "right", "back", "left", "ceiling"] = "front"
    reflectance: Share = 0.2


class BoxTable(TomlTable):
    """A box-shaped room in place of a building file."""

    width: Length
    depth: Length
    height: Length
    facing_deg: float = 180.0
    recess: Annotated[float, Field(ge=0)] = 0.0
    window: tuple[WindowTable, ...] = ()
    plate: tuple[PlateTable, ...] = ()
    reflectance: dict[Part, Share] = Field(default_factory=dict)
    specular: dict[Part, Share] = Field(default_factory=dict)  # of a lacquer at normal incidence
    roughness: dict[Part, Annotated[float, Field(ge=0, le=ROUGHEST)]] = Field(default_factory=dict)
    adjacency: dict[Part, Literal["outside", "ground", "space", "adiabatic"]] = Field(default_factory=dict)
    # by side or kind, outermost first
    construction: dict[Part, tuple[LayerTable, ...]] = Field(default_factory=dict)


class TraceTable(TomlTable):
    """How the light is computed: as the choices of those names of a run, with fewer rays."""

    method: Literal[METHODS] = RUN.method
    patch_samples: Annotated[int, Field(ge=64)] = 8192
    sensor_samples: Annotated[int, Field(ge=64)] = 16384
    sun_points: Annotated[int, Field(ge=16)] = RUN.sampling.sun_points
    path_samples: Annotated[int, Field(ge=16)] = RUN.sampling.hour_samples
    sky_subdivision: Literal[1, 2, 4, 6] = 1
    sensor_spacing: Length = RUN.grid.spacing  # [m]
    sensor_height: Length = RUN.grid.height  # above the floor [m]
    sensor_margin: Annotated[float, Field(ge=0)] = RUN.grid.margin  # from the walls [m]
    picture_size: Annotated[int, Field(ge=64)] = RUN.outputs.picture_size  # for `limit_dgp`
    picture_samples: Annotated[int, Field(ge=1)] = RUN.sampling.view_samples
    seed: int = RUN.sampling.seed
    view_factors: bool = True  # of the room's surfaces, for longwave and the person
    sky_light: Literal[SKY_LIGHTS] = RUN.sky_light  # see `RoomOptions`
    sun_model: Literal[SUN_MODELS] = RUN.sun_model  # of the sun's position, see `mitsuba_cfs.sky.sun`


class TransferTable(TomlTable):
    """Air that flows one way between two rooms."""

    source: str  # names or GUIDs of rooms
    target: str
    m3_h: Annotated[float | str, OrSchedule(plausible.FLOW)]


class DesignTable(TomlTable):
    """The loads of design days."""

    outdoor_c: Annotated[float, plausible.OUTDOOR] | None = None  # cold day; None: the weather's


class WindowStateTable(StateTable):
    """A shading state of some windows, or without names of all that no other table names."""

    windows: tuple[str, ...] = ()  # names or GUIDs


class StudyFile(OperationTables, ReadTable, OutdoorTable):
    """A whole study; paths are relative to the file."""

    weather: Path  # an EPW file, or with `measured` a CSV file
    measured: MeasuredTable | None = None
    building: Path | None = None
    spaces: tuple[str, ...] = ()
    couple: bool = False  # heat flows through the walls between the rooms
    air_nodes: tuple[str, ...] = ()  # zones of the building, each with one air
    transfer: tuple[TransferTable, ...] = ()
    design: DesignTable | None = None  # loads of design days too
    likely_layers: bool = False  # windows also with the layers most unlike those that are assumed
    box: BoxTable | None = None
    system: tuple[WindowStateTable, ...] = ()  # states; none: what the building's file holds
    trace: TraceTable = TraceTable()
    step_minutes: Literal[1, 2, 3, 4, 5, 6, 10, 12, 15, 20, 30, 60] = 10

    @property
    def inputs(self) -> InputOptions:
        """The options of its building and rooms."""
        return InputOptions(self.building, self.weather, spaces=self.spaces, **read_options(self))

    @property
    def options(self) -> RoomOptions:
        """How a room of the study is computed."""
        return RoomOptions.of(**self.trace.model_dump(exclude={"view_factors"}), heat_step_s=60.0 * self.step_minutes)

    @model_validator(mode="after")
    def _fits(self) -> StudyFile:
        if self.surface:
            raise ValueError("surface: light by wavelength is computed by cfs run and cfs study")
        if self.heat_island is not None and self.measured is not None:
            raise ValueError("heat_island: measured weather is taken as it is")
        if (self.building is None) == (self.box is None):
            raise ValueError("give either `building` or `[box]`")
        for key in ("spaces", "join", "couple", "air_nodes", "transfer") if self.box is not None else ():
            if getattr(self, key):
                raise ValueError(f"{key}: belongs to a `building`; a box is one room")
        for key in ("transfer", "air_nodes"):
            if getattr(self, key) and not self.couple:
                raise ValueError(f"{key}: needs `couple = true`")
        loads = self.loads
        if self.air_nodes and (loads.slab or loads.heating_faces or loads.cooling_faces):
            raise ValueError("air_nodes: rooms with a heated or cooled face cannot have one air")
        for number, one in enumerate(self.transfer):
            if isinstance(one.m3_h, str) and one.m3_h not in self.schedules:
                fault = unknown_name(one.m3_h, self.schedules)
                raise ValueError(f"transfer.{number}.m3_h: {fault}")
        for one in self.variants:
            if any(r.rule == "predictive" for _, rule in one.control.rules for r in rule.leaves):
                raise ValueError('control.rule: "predictive" is of `cfs run` and `cfs study`')
        if not self.system:
            if self.box is not None and self.box.window:
                raise ValueError("system: is missing; a box holds no fenestration data")
            return self
        for one in self.variants:
            fault = one.control_fault(max(Counter(s.windows for s in self.system).values()))
            if fault is not None:
                raise ValueError("{}: {}".format(*fault))
        return self


def read_study(path: Path, *, quick: bool = False) -> StudyFile:
    """The study of a TOML file, its paths made absolute.

    Args: quick: few rays where the file does not say how many.

    Raises: `DataError` naming the file and the field.
    """
    return study_of(read_table(path), path, quick=quick)


def study_of(table: dict[str, Any], path: Path, *, quick: bool = False) -> StudyFile:
    """The study of a table that was read from a file, as of `read_study`."""
    study = schedules_there(validated(StudyFile, table, path), path)
    here = path.parent
    systems = tuple(
        s.placed(here).model_copy(update={"bsdf": s.bsdf and _there(here, s.bsdf, path)}) for s in study.system
    )
    around = tuple(_there(here, name, path) for name in study.surroundings)
    files = {"weather": _there(here, study.weather, path), "system": systems}
    files["surroundings"] = around
    if quick:
        given = study.trace.model_fields_set
        files["trace"] = study.trace.model_copy(update=picks(HEAT, given))
    if study.building is not None:
        files["building"] = _there(here, study.building, path)
        check_building_file(files["building"])
    return study.model_copy(update=files)


def _there(folder: Path, name: Path, study: Path) -> Path:
    place = folder / name
    if not place.is_file():
        raise DataError(f"no such file: {name}", file=study)
    return place
