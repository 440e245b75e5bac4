"""The grid of a study: every room with every system, orientation, climate and method."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from bim.building_file import held_states
from bim.model import Building, Space
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import digest
from mitsuba_cfs.source_code import code_version
from scenes.chosen_rooms import chosen_spaces
from scenes.cluster import Requirements
from scenes.fenestration.thermal_file import files_beside
from scenes.heat.box import building_or_box
from scenes.input_options import InputOptions
from scenes.room.operation import read_operation
from scenes.room.options import RoomOptions
from scenes.study.study_file import RoomTable, Study, SystemTable
from scenes.toml_file import read_options

if TYPE_CHECKING:
    from scenes.heat.study_file import BoxTable


AUTO = "auto"
COMPUTED_BY = "scenes.study.one_case"  # the module of a case's results


@dataclass(frozen=True, slots=True)
class InputFile:
    """An input file as it was when the study was planned."""

    path: Path
    sha256: str

    @classmethod
    def of(cls, path: Path) -> InputFile:
        """The file with the hash of its bytes."""
        with open(path, "rb") as file:
            return cls(path, hashlib.file_digest(file, "sha256").hexdigest())


@dataclass(frozen=True, slots=True)
class Case:
    """Everything that one result depends on; can be sent to another process."""

    room: str  # name of the [[room]] entry
    space: str  # GUID
    space_name: str
    building: InputFile | BoxTable
    specular: bool
    system: str
    bsdf: InputFile | None  # None: what the building's file holds
    thermal: InputFile | None  # the .toml file beside the BSDF
    u_value: float | None
    g_value: float | None
    climate: str
    weather: InputFile
    orientation_deg: float  # the model is turned clockwise by it
    options: RoomOptions  # the method with them
    operation: InputFile | None  # the file of the room's control, gains and set points
    program: str  # `program_version()` of the plan
    glare: str  # DGP, eDGP, sDGP or none
    chosen: str = ""  # why this method, where `auto` chose it
    referenced: tuple[InputFile, ...] = ()  # BSDF files that the building's names, and those beside
    surroundings: tuple[InputFile, ...] = ()  # around the building
    surroundings_offset: tuple[float, float, float] | None = None  # of these files [m]
    albedo: float | tuple[float, ...] | str | None = None  # of the ground, as of `InputOptions`
    join: tuple[str, ...] = ()  # these four as of `InputOptions`
    furniture: bool = False
    apertures: tuple[str, ...] = ()
    facade_panes: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """A hash of what the numbers depend on: not of names, paths or reasons."""
        files = [s.sha256 if s is not None else None for s in self.files[:4]]
        return digest(
            self.program,
            self.scene,
            files,
            self.u_value,
            self.g_value,
            self.orientation_deg % 360.0,
            _plain(self.options.named()),
            self.glare,
            [source.sha256 for source in self.referenced],
            self.albedo,
        )[:32]

    @property
    def files(self) -> tuple[InputFile | BoxTable | None, ...]:
        """What it is read from; the building last."""
        own = (self.bsdf, self.thermal, self.weather, self.operation)
        return (*own, *self.referenced, *self.surroundings, self.building)

    @property
    def place(self) -> str:
        """The room in words: entry and space, where they differ."""
        return self.room if self.space_name == self.room else f"{self.room} {self.space_name}"

    @property
    def scene(self) -> str:
        """A hash of the room alone: cases that have it share traced matrices."""
        building = self.building
        source = building.sha256 if isinstance(building, InputFile) else building.model_dump_json()
        around = [file.sha256 for file in self.surroundings]
        offset = self.surroundings_offset and list(self.surroundings_offset)
        read = [list(self.join), self.furniture, list(self.apertures), list(self.facade_panes)]
        return digest(source, self.space, around, offset, read)[:32]

    @property
    def inputs(self) -> InputOptions:
        """The options of its building and room."""
        file = self.building.path if isinstance(self.building, InputFile) else None
        return InputOptions(
            file,
            self.weather.path,
            spaces=(self.space,),
            join=self.join,
            furniture=self.furniture,
            apertures=self.apertures,
            facade_panes=self.facade_panes,
            surroundings=tuple(file.path for file in self.surroundings),
            surroundings_offset=self.surroundings_offset,
            albedo=self.albedo,
        )


def _plain(table: dict) -> list:
    return [[name, list(v) if isinstance(v, tuple) else v] for name, v in sorted(table.items())]


def with_method(case: Case, method: str, metric: str, why: str) -> Case:
    """The case with the method and the glare metric that `auto` chose for it."""
    return replace(case, options=replace(case.options, method=method), glare=metric, chosen=why)


def program_version() -> str:
    """A hash of the source that computes a case, and of what it is built on."""
    return code_version(COMPUTED_BY)


def requirements(cases: Iterable[Case]) -> Requirements:
    """What a worker of a cluster needs for these cases: this program, and their files."""
    files = [source for case in cases for source in case.files if isinstance(source, InputFile)]
    return Requirements.of(COMPUTED_BY, {file.path: file.sha256 for file in files})


AS_HELD = "as in the building's file"  # the system of a study that names none


@dataclass(frozen=True, slots=True)
class StudyPlan:
    """A study's grid, and the rooms in it."""

    cases: tuple[Case, ...]
    rooms: dict[str, tuple[Building, Space]]  # by `Case.scene`
    predicted: float | None = None  # time of the cases whose method `auto` chose [s]


def plan_of(study: Study) -> StudyPlan:
    """The grid of a study, ordered so that neighbours share most.

    Raises: `DataError` for a file that cannot be read or has no such room.
    """
    held = SystemTable.model_construct(name=AS_HELD)
    systems = [_of_system(study, system) for system in study.system or (held,)]
    climates = [{"climate": c.name, "weather": InputFile.of(c.weather)} for c in study.climate]
    cases: list[Case] = []
    rooms = {}
    _check_turning(study)
    around = tuple(map(InputFile.of, study.surroundings))
    for room in study.room:
        read = read_options(room, study)
        building, spaces = rooms_of(room, study)
        source = room.box if room.box is not None else InputFile.of(room.building)
        held_files = () if study.system else _referenced(building)
        for space in spaces:
            about = {
                "room": room.name,
                "space": space.guid,
                "space_name": room.name if room.box else space.label,
                "building": source,
                "specular": room.specular,
                **read,
                "surroundings": around,
            }
            mine = [one | {"referenced": (*held_files, *one["referenced"])} for one in systems]
            of_space = list(_of_space(study, about, mine, climates))
            rooms[of_space[0].scene] = building, space
            cases += of_space
    return StudyPlan(tuple(cases), rooms)


def _check_turning(study: Study) -> None:
    """Raise `DataError` for surroundings of a model that is turned: they would turn with it."""
    if study.surroundings and any(angle % 360.0 for angle in study.orientations_deg):
        message = "surroundings stand still: expected [0.0] where there are some"
        raise DataError(message, field="orientations_deg")


def _of_system(study: Study, system: SystemTable) -> dict:
    """The system of a case, with its operation."""
    beside = None if system.bsdf is None else system.bsdf.with_suffix(".toml")
    operation = system.operation or study.operation
    referenced = () if system.bsdf is None else files_beside(system.bsdf)[1:]
    if operation is not None:
        referenced += read_operation(operation).files
    return {
        "system": system.name,
        "bsdf": None if system.bsdf is None else InputFile.of(system.bsdf),
        "thermal": InputFile.of(beside) if beside is not None and beside.is_file() else None,
        "u_value": system.u_value,
        "g_value": system.g_value,
        "operation": None if operation is None else InputFile.of(operation),
        "referenced": tuple(map(InputFile.of, referenced)),
    }


def _of_space(
    study: Study, room: dict, systems: list[dict], climates: list[dict]
) -> Iterator[Case]:
    """Every case of one room."""
    for climate in climates:
        for angle in study.orientations_deg:
            for method in study.methods:
                # an open method keeps the default's place until `auto` is settled
                options = {} if method == AUTO else {"method": method}
                options |= study.options.model_dump()
                for system in systems:
                    yield Case(
                        **room,
                        **system,
                        **climate,
                        orientation_deg=angle,
                        options=RoomOptions.of(**options),
                        program=program_version(),
                        glare=study.glare,
                        chosen=AUTO if method == AUTO else "",
                    )


def _referenced(building: Building) -> tuple[InputFile, ...]:
    """The BSDF files that a building's file names, and the `.toml` files beside them."""
    held = held_states(building.windows, building.file).values()
    named = {state.file for states in held for state in states if state.file is not None}
    beside = (other for file in sorted(named) for other in files_beside(file))
    return tuple(InputFile.of(file) for file in (*sorted(named), *beside) if file.is_file())


def rooms_of(room: RoomTable, study: Study) -> tuple[Building, list[Space]]:
    """The building of an entry and the rooms asked for."""
    options = InputOptions(room.building, None, **read_options(room, study))
    building = building_or_box(room.box, options)
    if room.box is not None:
        return building, list(building.spaces)
    return building, chosen_spaces(building, room.spaces, room.building)
