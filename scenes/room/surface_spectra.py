"""Reflectance by wavelength of a room's surfaces: stated, of their colour, or neutral."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatch
from functools import cache
from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import Field, model_validator

from bim.colours import GREY, Colour
from bim.model import FACE_KINDS, Element, Face, Space
from mitsuba_cfs.bsdf.colour import reflectance_of_colour, relative_rgb, with_visible
from mitsuba_cfs.notes import Note
from mitsuba_cfs.spectra.detectors import NANOMETRES, illuminant, sensitivities
from scenes.fenestration.thermal_file import read_reflectance, reflectance_of_code
from scenes.toml_file import TomlTable

FloatArray = NDArray[np.float64]
Part = TypeVar("Part", Face, Element)
GROUND = "ground"  # outdoors, as a table selects it


class SurfaceTable(TomlTable):
    """The colour of some surfaces; their visible reflectance stays that of the building."""

    select: Annotated[str, Field(min_length=1)]  # kind of a face, or its name, with * and ?; or `GROUND`
    spectrum: Path | None = None  # CSV file of `REFLECTANCE_COLUMNS`; its shape counts
    colour: str | None = None  # "#rrggbb", sRGB
    material: str | None = None  # one of `materials`

    @model_validator(mode="after")
    def _has_one(self) -> SurfaceTable:
        if [self.spectrum, self.colour, self.material].count(None) != 2:
            raise ValueError("expected spectrum, colour or material")
        if self.colour is not None:
            reflectance_of_code(self.colour)
        if self.material is not None and self.material not in materials():
            raise ValueError(f"material: expected one of {', '.join(materials())}, got {self.material!r}")
        return self

    def selects(self, part: Face | Element) -> bool:
        """Whether it is about a surface."""
        if self.select in FACE_KINDS:
            return isinstance(part, Face) and part.kind == self.select
        return fnmatch(part.name.casefold(), self.select.casefold())

    def shape(self) -> FloatArray:
        """Reflectance [N] of any scale; `DataError` for a file that cannot be read."""
        if self.spectrum is not None:
            return read_reflectance(self.spectrum)
        if self.material is not None:
            return materials()[self.material]
        return reflectance_of_code(str(self.colour))


@cache
def materials() -> dict[str, FloatArray]:
    """Reflectances [N] of materials outdoors; that at 400 nm is taken below.

    Source: means of the spectra of earthlib 1.1.0 (MIT licence, Christopher Anderson): for soil
    those of ICRAF-ISRIC (4168 of 4185), else measured in Santa Barbara (Herold, Roberts, Gardner,
    Dennison 2004, Remote Sensing of Environment 91, 304-319); vegetation is modelled (PROSAIL).
    """
    table = pd.read_csv(Path(__file__).with_suffix(".csv"), index_col=0)
    return {str(name): np.interp(NANOMETRES, table.index, table[name]) for name in table}


def ground_reflectance(tables: Sequence[SurfaceTable]) -> FloatArray | None:
    """Reflectance of the ground outdoors [N], of any scale; None: neutral."""
    return next((table.shape() for table in tables if table.select == GROUND), None)


def in_stated_colours(space: Space, tables: Sequence[SurfaceTable]) -> Space:
    """The room whose surfaces and furniture have the hues under D65 of the tables that select them.

    Of bright surfaces those that `room_reflectance` has, as pale as light by wavelength.
    """
    shapes = [(table, table.shape()) for table in tables if table.select != GROUND]

    def coloured(part: Part) -> Part:
        shape = next((shape for table, shape in shapes if table.selects(part)), None)
        if shape is None:
            return part
        return replace(part, hue=_hue(with_visible(shape, part.reflectance("visible"))))

    faces, furniture = tuple(map(coloured, space.faces)), tuple(map(coloured, space.furniture))
    return replace(space, faces=faces, furniture=furniture)


def _hue(reflectance: FloatArray) -> Colour:
    """Linear sRGB of luminance 1 of a reflectance [N] under D65."""
    observer = illuminant("D65")[:, None] * sensitivities()[-3:].T
    red, green, blue = relative_rgb(*(reflectance @ (observer / observer.sum(axis=0)))).tolist()
    return red, green, blue


def room_reflectance(
    space: Space, tables: Sequence[SurfaceTable] = (), left_out: frozenset[str] = frozenset()
) -> tuple[FloatArray | None, list[str]]:
    """Reflectance of a room's surfaces and furniture [F, N], None where all are neutral, and notes.

    Args: tables: the first that selects a surface counts; left_out: names of faces that are not there.
    """
    parts: list[Face | Element] = [*(face for face in space.faces if face.name not in left_out), *space.furniture]
    tables = [table for table in tables if table.select != GROUND]
    visible = np.array([part.reflectance("visible") for part in parts])
    spectra, coloured, used = np.ones((len(parts), len(NANOMETRES))), 0, [False] * len(tables)
    shapes = [table.shape() for table in tables]
    for f, part in enumerate(parts):
        number = next((i for i, table in enumerate(tables) if table.selects(part)), None)
        if number is not None:
            spectra[f], used[number] = shapes[number], True
        elif part.hue != GREY:
            spectra[f] = reflectance_of_colour(visible[f] * np.array(part.hue))
            coloured += 1
    notes: list[str] = [
        Note(
            "No surface of room {room} is selected by {select}: its spectrum is not used.",
            room=space.label,
            select=one.select,
        )
        for one, is_used in zip(tables, used, strict=True)
        if not is_used
    ]
    if coloured:
        notes.append(
            Note(
                "Room {room}: surfaces with a colour in the model ({count}) have a smooth spectrum of that colour; "
                "state [[surface]] for measured ones.",
                room=space.label,
                count=coloured,
            )
        )
    if not coloured and not any(used):
        return None, notes
    return with_visible(spectra, visible), notes
