"""The grid of a study: every room with every system, orientation, climate and method."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from uuid import uuid4

from bim.building_file import chosen_spaces, held_states
from bim.model import Building, Space
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import sha256
from mitsuba_cfs.matrices.cache import digest
from mitsuba_cfs.source_code import code_version
from scenes.cluster import Requirements
from scenes.fenestration.thermal_file import files_beside
from scenes.heat.box import building_or_box
from scenes.input_files import named_files
from scenes.input_options import InputOptions
from scenes.room.operation import Controller, Operation, read_operation
from scenes.room.options import RoomOptions
from scenes.study.study_file import NO_SYSTEM, RoomTable, Study
from scenes.toml_file import ReadTable

if TYPE_CHECKING:
    from scenes.heat.study_file import BoxTable


AUTO = "auto"
COMPUTED_BY = "scenes.study.one_case"  # the module of a case's results
OF_BUILDING = ("building", "linked", "corrections", "surroundings")  # names of files that a room is made of
# options that are no files, of the room and of what is in its windows and outdoors
OF_ROOM = ("spaces", "surroundings_offset", *ReadTable.model_fields)
OF_CASE = ("u_value", "g_value", "see_through", "albedo")


@dataclass(frozen=True, slots=True)
class InputFile:
    """An input file as it was when the study was planned."""

    name: str  # what it is, as of `named_files`
    path: Path
    sha256: str


@dataclass(frozen=True, slots=True)
class PlannedControl:
    """A control function of a case; what it does is not in a file, so that no result is reused."""

    function: Controller
    run: str = field(default_factory=lambda: uuid4().hex)  # of this plan alone


@dataclass(frozen=True, slots=True)
class Case:
    """Everything that one result depends on; can be sent to another process."""

    room: str  # name of the [[room]] entry
    space_name: str
    system: str
    climate: str
    inputs: InputOptions  # the building with its one room, weather, system, operation
    files: tuple[InputFile, ...]  # of the inputs, and those that the building names
    box: BoxTable | None  # in place of a building's file
    specular: bool
    orientation_deg: float  # the model is turned clockwise by it
    options: RoomOptions  # the method with them
    program: str  # `program_version()` of the plan
    glare: str  # DGP, eDGP, sDGP or none
    chosen: str = ""  # why this method, where `auto` chose it
    control: PlannedControl | None = None  # in place of the operation's rules

    @property
    def key(self) -> str:
        """A hash of what the numbers depend on: not of names, paths or reasons."""
        return digest(
            self.program,
            self.scene,
            [[file.name, file.sha256] for file in self.files],
            _plain(self.inputs.named(), OF_CASE),
            self.orientation_deg % 360.0,
            _plain(self.options.named()),
            self.glare,
            *(() if self.control is None else (self.control.run,)),
        )[:32]

    @property
    def place(self) -> str:
        """The room in words: entry and space, where they differ."""
        return self.room if self.space_name == self.room else f"{self.room} {self.space_name}"

    @property
    def scene(self) -> str:
        """A hash of the room alone: cases that have it share traced matrices."""
        files = [[f.name, f.sha256] for f in self.files if f.name.startswith(OF_BUILDING)]
        box = None if self.box is None else self.box.model_dump_json()
        return digest(files, box, _plain(self.inputs.named(), OF_ROOM))[:32]


def _plain(table: dict[str, Any], names: Iterable[str] | None = None) -> list[Any]:
    names = sorted(table) if names is None else names
    values = ((name, table[name]) for name in names)
    return [[name, list(v) if isinstance(v, tuple) else v] for name, v in values]


def with_method(case: Case, method: str, metric: str, why: str) -> Case:
    """The case with the method and the glare metric that `auto` chose for it."""
    return replace(case, options=replace(case.options, method=method), glare=metric, chosen=why)


def program_version() -> str:
    """A hash of the source that computes a case, and of what it is built on."""
    return code_version(COMPUTED_BY)


def requirements(cases: Iterable[Case]) -> Requirements:
    """What a worker of a cluster needs for these cases: this program, and their files."""
    files = {file.path: file.sha256 for case in cases for file in case.files}
    return Requirements.of(COMPUTED_BY, files)


@dataclass(frozen=True, slots=True)
class StudyPlan:
    """A study's grid, and the rooms in it."""

    cases: tuple[Case, ...]
    rooms: dict[str, tuple[Building, Space]]  # by `Case.scene`
    predicted: float | None = None  # time of the cases whose method `auto` chose [s]


RoomsOf = Callable[[RoomTable, Study], tuple[Building, list[Space]]]


class _Read(NamedTuple):
    """Readers that read each file of a study once."""

    operation: Callable[[Path], Operation]
    sha256: Callable[[Path], str]


def plan_of(study: Study, rooms_of: RoomsOf | None = None) -> StudyPlan:
    """The grid of a study, ordered so that neighbours share most.

    Args: rooms_of: reader of the rooms of an entry, for studies of the same buildings.

    Raises: `DataError` for a file that cannot be read or has no such room.
    """
    cases: list[Case] = []
    rooms = {}
    read = _Read(cache(read_operation), cache(sha256))
    _check_turning(study)
    for room in study.room:
        building, spaces = (rooms_of or read_rooms)(room, study)
        held = () if study.system else _held_files(building)
        for space in spaces:
            of_space = list(_of_space(study, room, space, held, read))
            rooms[of_space[0].scene] = building, space
            cases += of_space
    return StudyPlan(tuple(cases), rooms)


def _check_turning(study: Study) -> None:
    """Raise `DataError` for surroundings of a model that is turned: they would turn with it."""
    if study.surroundings and any(angle % 360.0 for angle in study.orientations_deg):
        message = "surroundings stand still: expected [0.0] where there are some"
        raise DataError(message, field="orientations_deg")


def _of_space(study: Study, room: RoomTable, space: Space, held: Iterable[Path], read: _Read) -> Iterator[Case]:
    """Every case of one room.

    Args: held: files that the building names.
    """
    for climate in study.climate:
        systems = []
        for system in study.system or (NO_SYSTEM,):
            options = study.inputs(room, system, climate, spaces=(space.guid,))
            control = None if system.control is None else PlannedControl(system.control)
            systems.append((system.name, options, _input_files(options, held, read), control))
        for angle in study.orientations_deg:
            for method in study.methods:
                # an open method keeps the default's place until `auto` is settled
                chosen = {} if method == AUTO else {"method": method}
                chosen |= study.options.model_dump()
                for name, options, files, control in systems:
                    yield Case(
                        room.name,
                        room.name if room.box else space.label,
                        name,
                        climate.name,
                        options,
                        files,
                        room.box,
                        room.specular,
                        angle,
                        RoomOptions.of(**chosen),
                        program_version(),
                        study.glare,
                        AUTO if method == AUTO else "",
                        control,
                    )


def _input_files(options: InputOptions, held: Iterable[Path], read: _Read) -> tuple[InputFile, ...]:
    """The files of a case with the hashes of their bytes."""
    operation = None if options.operation is None else read.operation(options.operation)
    named = named_files(options, operation) | {f"held_{i}": path for i, path in enumerate(held)}
    return tuple(InputFile(name, path, read.sha256(path)) for name, path in named.items())


def _held_files(building: Building) -> tuple[Path, ...]:
    """The BSDF files that a building's file names, and the `.toml` files beside them."""
    held = held_states(building.windows, building.file).values()
    named = sorted({s.file for states in held for s in states if s.file is not None})
    beside = (other for file in named for other in files_beside(file))
    return tuple(file for file in (*named, *beside) if file.is_file())


def read_rooms(room: RoomTable, study: Study) -> tuple[Building, list[Space]]:
    """The building of an entry and the rooms asked for."""
    building = building_or_box(room.box, study.inputs(room))
    if room.box is not None:
        return building, list(building.spaces)
    return building, chosen_spaces(building, room.spaces, room.building)
