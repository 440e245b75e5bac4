"""The study file of `cfs study`: rooms, systems, climates, orientations, methods and options."""

from __future__ import annotations

from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, create_model, model_validator

from mitsuba_cfs.errors import DataError
from scenes import plausible
from scenes.calibration.durations import seconds_of, share_of
from scenes.heat.study_file import BoxTable
from scenes.input_files import peak_share
from scenes.input_options import InputOptions
from scenes.quick import ROOM, picks
from scenes.room.operation import read_operation
from scenes.room.options import CHOICES, RoomOptions, named_types
from scenes.room.schedules import Hours
from scenes.toml_file import OutdoorTable, ReadTable, TomlTable, read_options, read_table, validated

PHASE_METHODS = ("three-phase", "five-phase")
NEED_PHASES = ("spectral", "sensitivities", "bands")  # options
OF_THE_GRID = ("method", "annual_glare")
# Options that mean what a key of an operation file means
OF_TABLES = {
    "occupied": Hours,
    "infiltration_ach": Annotated[float, plausible.AIR_CHANGE],
    "equipment_w_m2": Annotated[float, plausible.GAIN],
    "person_w": Annotated[float, plausible.PERSON],
}
Name = Annotated[str, Field(min_length=1)]


def _peak(text: str) -> str:
    """A text of `--see-through`; `DataError` for another."""
    peak_share(text)
    return text


Peak = Annotated[str, AfterValidator(_peak)]


class _Table(TomlTable):
    model_config = ConfigDict(validate_default=True)


class RoomTable(_Table, ReadTable):
    """Rooms of a building file, or one box."""

    name: str = ""
    building: Path | None = None
    linked: tuple[Path, ...] = ()  # further files of the same building: facade, structure, site
    spaces: tuple[Name, ...] = ()  # names or GUIDs; none: every space with a window
    box: BoxTable | None = None
    specular: bool = False  # something in the room mirrors: glare then needs full pictures
    see_through: tuple[Peak, ...] = ()  # as `--see-through`, of systems of the building's file

    @model_validator(mode="after")
    def _one_source(self) -> RoomTable:
        if (self.building is None) == (self.box is None):
            raise ValueError("give either `building` or `box`")
        if self.box is not None and (self.spaces or self.linked):
            key = "spaces" if self.spaces else "linked"
            raise ValueError(f"`{key}` belong to a `building`; a box is one room")
        return self


class SystemTable(_Table):
    """A fenestration system: its BSDF file, and U and g where that has none beside it.

    An operation file of its own goes before the study's; with `[[system]]` tables it is the states.
    """

    name: str = ""
    bsdf: Path | None = None
    operation: Path | None = None
    u_value: Annotated[float, Field(ge=0.1, le=7)] | None = None  # [W/(m2 K)]
    g_value: Annotated[float, Field(ge=0, le=1)] | None = None
    see_through: tuple[Peak, ...] = ()  # as `--see-through`
    # from Python alone: in place of the rules of its operation, see `Operation.controlled_by`
    control: Annotated[Callable[..., Any] | None, Field(exclude=True)] = None

    @property
    def has_optics(self) -> bool:
        """Whether its optics are its own, so that its operation file has no states."""
        return self.bsdf is not None

    @model_validator(mode="after")
    def _of_a_file(self) -> SystemTable:
        if self.bsdf is None and self.operation is None:
            raise ValueError("give `bsdf`, or `operation` with [[system]] tables in it")
        if self.bsdf is None and not (self.u_value is None and self.g_value is None):
            raise ValueError("`u_value` and `g_value` belong to a `bsdf`")
        if self.control is not None and (self.operation is None or self.bsdf is not None):
            raise ValueError("`control` needs an `operation` with [[system]] tables")
        return self


SYSTEM_TABLE = "a [[system]]"  # how a study gives a system, for messages
NO_SYSTEM = SystemTable.model_construct(name="as in the building's file")


class ClimateTable(_Table):
    """A weather file."""

    name: str = ""
    weather: Path


class AutoTable(_Table):
    """What `auto` in the methods may take, and how good its DGP must be."""

    time_budget: Annotated[float, BeforeValidator(seconds_of)] = "1h"  # of the whole study
    dgp_error: Annotated[float, BeforeValidator(share_of)] = "25%"  # relative, root mean square


def _options_table() -> type[BaseModel]:
    """The options of a room without those that a study has keys for."""
    kinds = named_types()
    columns: dict[str, Any] = {}
    for name, default in RoomOptions().named().items():
        if name not in OF_THE_GRID:
            kind = OF_TABLES.get(name, kinds[name])
            if name in CHOICES:
                kind = Literal[CHOICES[name]]
            if kind in (int, float):
                kind = Annotated[kind, Field(ge=0)]
            columns[name] = (kind, default)
    return create_model("options", __base__=_Table, **columns)


OptionsTable = _options_table()


class Study(_Table, OutdoorTable):
    """A whole study; paths are relative to the file."""

    title: str = ""
    room: Annotated[tuple[RoomTable, ...], Field(min_length=1)]
    system: tuple[SystemTable, ...] = ()  # none: what each building's file holds
    climate: Annotated[tuple[ClimateTable, ...], Field(min_length=1)]
    orientations_deg: Annotated[tuple[float, ...], Field(min_length=1)] = (0.0,)  # clockwise
    methods: Annotated[
        tuple[Literal["three-phase", "five-phase", "point-in-time", "auto"], ...], Field(min_length=1)
    ] = (RoomOptions().method,)
    glare: Literal["DGP", "eDGP", "sDGP", "none"] = "DGP"  # of every occupied hour with sun
    operation: Path | None = None  # control, gains, air, set points: as for `cfs run`
    auto: AutoTable = AutoTable()
    options: OptionsTable = OptionsTable()
    quick: bool = False  # a first look: what the options do not say is chosen by `scenes.quick`

    @model_validator(mode="after")
    def _no_twins(self) -> Study:
        if not self.system and any(room.box is not None for room in self.room):
            raise ValueError("system: is missing; a box holds no fenestration data")
        for key in ("room", "system", "climate"):
            unique(key, [entry.name for entry in getattr(self, key)])
        turned = [angle % 360.0 for angle in self.orientations_deg]
        unique("orientations_deg", turned)
        unique("methods", self.methods)
        for name in NEED_PHASES:
            if getattr(self.options, name) and not set(self.methods) <= set(PHASE_METHODS):
                raise ValueError(f"options.{name}: needs methods of {', '.join(PHASE_METHODS)}")
        return self

    def inputs(
        self,
        room: RoomTable | None,
        system: SystemTable = NO_SYSTEM,
        climate: ClimateTable | None = None,
        spaces: tuple[str, ...] | None = None,
    ) -> InputOptions:
        """The options of a room with a system under a climate.

        Args: room: None for those of the other files; spaces: in place of the room's own.
        """
        tables = (self,) if room is None else (room, self)
        peaks = system.see_through if system is not NO_SYSTEM or room is None else room.see_through
        if spaces is None:
            spaces = () if room is None else room.spaces
        return InputOptions(
            None if room is None else room.building,
            None if climate is None else climate.weather,
            system.bsdf,
            spaces,
            u_value=system.u_value,
            g_value=system.g_value,
            see_through=peaks,
            linked=() if room is None else room.linked,
            operation=system.operation or self.operation,
            **read_options(*tables),
        )

    @property
    def files(self) -> tuple[Path, ...]:
        """Every file that the study names."""
        named = [room.building for room in self.room] + [one for r in self.room for one in r.linked]
        named += [system.bsdf for system in self.system]
        named += [system.operation for system in self.system]
        named += [climate.weather for climate in self.climate] + [self.operation]
        named += self.surroundings
        return tuple(path for path in named if path is not None)


def unique(key: str, values) -> None:
    """Raise `ValueError` for a value that comes twice."""
    seen = set()
    for value in values:
        if value in seen:
            raise ValueError(f"{key}: {value!r} comes twice")
        seen.add(value)


def read_study(path: str | PathLike[str], *, automatic: bool = False, quick: bool = False, **auto: str) -> Study:
    """The study of a TOML file, its paths made absolute and every entry named.

    Args:
        automatic: `auto` in place of the file's methods.
        quick: as if the file said so.
        auto: `time_budget`, `dgp_error` in place of those in the file's `[auto]`.

    Raises: `DataError` naming the file and the key.
    """
    path = Path(path)
    table = read_table(path)
    name_entries(table)
    if automatic:
        table["methods"] = ["auto"]
    if quick:
        table["quick"] = True
    if auto:
        table["auto"] = table.get("auto", {}) | auto
    study = validated(Study, table, path)
    if study.quick:
        chosen = picks(ROOM, study.options.model_fields_set)
        study = study.model_copy(update={"options": study.options.model_copy(update=chosen)})
    return with_places(study, path)


def name_entries(table: dict[str, Any]) -> None:
    """Give rooms, systems and climates without a name that of their file."""
    for key, file in (("room", "building"), ("system", "bsdf"), ("climate", "weather")):
        entries = table.get(key)
        for number, entry in enumerate(entries if isinstance(entries, list) else [], 1):
            if isinstance(entry, dict) and "name" not in entry:
                source = entry.get(file, entry.get("operation"))
                named = Path(source).stem if isinstance(source, str) else f"{key} {number}"
                entry["name"] = named


def with_places(study: Study, path: Path) -> Study:
    """The study with absolute paths of files that are there."""

    def there(name: Path | None, key: str) -> Path | None:
        if name is None:
            return None
        place = (path.parent / name).absolute()
        if not place.is_file():
            raise DataError(f"no such file: {name}", file=path, field=key)
        return place

    result = {}
    for key, file in (("room", "building"), ("system", "bsdf"), ("climate", "weather")):
        entries = []
        for number, entry in enumerate(getattr(study, key)):
            named = [name for name in (file, "operation") if name in type(entry).model_fields]
            update: dict[str, Any] = {n: there(getattr(entry, n), f"{key}.{number}.{n}") for n in named}
            if key == "room":
                field = f"room.{number}.linked"
                update["linked"] = tuple(there(name, field) for name in entry.linked)
            entries.append(entry.model_copy(update=update))
        result[key] = tuple(entries)
    result["operation"] = there(study.operation, "operation")
    result["surroundings"] = tuple(there(name, "surroundings") for name in study.surroundings)
    _check_systems(result["operation"], states=False)
    for system in result["system"]:
        _check_systems(system.operation, states=not system.has_optics)
    return study.model_copy(update=result)


def _check_systems(operation: Path | None, *, states: bool) -> None:
    """Raise `DataError` for an operation file that lacks the states wanted of it, or has others."""
    if operation is None or bool(read_operation(operation).systems) == states:
        return
    message = "the systems of a study are its own: leave [[system]] out"
    if states:
        message = "is missing: a system of a study without `bsdf` has its states in its operation"
    raise DataError(message, file=operation, field="system")
