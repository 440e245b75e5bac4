"""One case of a study: one room, system, orientation, climate and method."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from mitsuba_cfs.matrices.cache import digest
from mitsuba_cfs.source_code import code_version
from scenes.input_options import InputOptions
from scenes.room.options import RoomOptions

if TYPE_CHECKING:
    from scenes.heat.study_file import BoxTable

AUTO = "auto"


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
    surroundings: tuple[InputFile, ...] = ()  # of what stands around the building
    surroundings_offset: tuple[float, float, float] | None = None  # of these files [m]
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
        )


def _plain(table: dict) -> list:
    return [[name, list(v) if isinstance(v, tuple) else v] for name, v in sorted(table.items())]


def with_method(case: Case, method: str, metric: str, why: str) -> Case:
    """The case with the method and the glare metric that `auto` chose for it."""
    return replace(case, options=replace(case.options, method=method), glare=metric, chosen=why)


def program_version() -> str:
    """A hash of the source that computes a case, and of what it is built on."""
    return code_version("scenes.study.one_case")
