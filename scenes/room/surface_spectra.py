"""Reflectance by wavelength of a room's surfaces: stated, of their colour, or neutral."""

from __future__ import annotations

import re
from collections.abc import Sequence
from fnmatch import fnmatch
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from bim.colours import GREY, linear_of_display
from bim.model import FACE_KINDS, Element, Face, Space
from mitsuba_cfs.bsdf.colour import reflectance_of_colour, with_visible
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.notes import Note
from mitsuba_cfs.spectra.detectors import NANOMETRES
from scenes.fenestration.thermal_file import csv_columns
from scenes.toml_file import TomlTable

COLUMNS = ("wavelength_nm", "reflectance")
FloatArray = NDArray[np.float64]


class SurfaceTable(TomlTable):
    """The colour of some surfaces; their visible reflectance stays that of the building."""

    select: Annotated[str, Field(min_length=1)]  # kind of a face, or its name, with * and ?
    spectrum: Path | None = None  # CSV file of `COLUMNS`; its shape counts
    colour: str | None = None  # "#rrggbb", sRGB

    @model_validator(mode="after")
    def _has_one(self) -> SurfaceTable:
        if (self.spectrum is None) == (self.colour is None):
            raise ValueError("expected spectrum or colour")
        if self.colour is not None and not re.fullmatch("#[0-9a-fA-F]{6}", self.colour):
            raise ValueError(f"colour: expected #rrggbb, got {self.colour!r}")
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
        code = str(self.colour)
        return reflectance_of_colour(linear_of_display([int(code[i : i + 2], 16) / 255 for i in (1, 3, 5)]))


def read_reflectance(path: Path) -> FloatArray:
    """Reflectance at `NANOMETRES` of a CSV file of `COLUMNS`.

    Raises: `DataError` for a file that cannot be read or does not span 380 to 780 nm.
    """
    columns = csv_columns(path, COLUMNS)
    nm, rho = (columns[name] for name in COLUMNS)
    if len(nm) < 2 or np.any(np.diff(nm) <= 0) or nm[0] > NANOMETRES[0] or nm[-1] < NANOMETRES[-1]:
        raise DataError("expected rising wavelengths from 380 to 780 nm", file=path)
    if rho.min() < 0 or rho.max() > 1 or not rho.any():
        raise DataError("expected reflectances from 0 to 1, not all 0", file=path, field="reflectance")
    return np.interp(NANOMETRES, nm, rho)


def room_reflectance(
    space: Space, tables: Sequence[SurfaceTable] = (), left_out: frozenset[str] = frozenset()
) -> tuple[FloatArray | None, list[str]]:
    """Reflectance of a room's surfaces and furniture [F, N], None where all are neutral, and notes.

    Args: tables: the first that selects a surface counts; left_out: names of faces that are not there.
    """
    parts: list[Face | Element] = [*(face for face in space.faces if face.name not in left_out), *space.furniture]
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
