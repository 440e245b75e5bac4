"""What is known of a fenestration system besides its BSDF, from the `.toml` file beside it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from mitsuba_cfs.bsdf.angular import AngularTable
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.errors import DataError
from scenes.fenestration.angular_file import AngularData
from scenes.fenestration.tables import ClosureTable
from scenes.toml_file import Share, read_table, validated
from thermal.closure import Closure
from thermal.errors import ThermalInputError
from thermal.gvalue import TYPICAL_SYSTEMS

PATCHES = KLEMS_FULL.size


ByPatch = Annotated[tuple[float, ...], Field(min_length=PATCHES, max_length=PATCHES)]


class ThermalTable(ClosureTable):
    """The file beside a BSDF: the closure as in a study's [[system]], and what else is known."""

    u_value: float | None = None  # [W/(m2 K)]
    g_value: float | None = None  # at normal incidence
    g_value_by_patch: ByPatch | None = None  # for each incident patch of the Klems full basis
    shading_position: Literal[tuple(TYPICAL_SYSTEMS)] | None = None  # of the shade
    angular: AngularData | None = None  # of a specular system, visible
    # What g was worked out from, layer by layer: for readers, the balance takes g
    inward_fractions: tuple[Share, ...] = ()
    absorptance_blind: ByPatch | None = None
    absorptance_outer_pane: ByPatch | None = None
    absorptance_inner_pane: ByPatch | None = None


def files_beside(bsdf: Path) -> tuple[Path, ...]:
    """The `.toml` file beside a BSDF's and the files that it names; none where there is none."""
    path = bsdf.with_suffix(".toml")
    if not path.is_file():
        return ()
    angular = validated(ThermalTable, read_table(path), path).angular
    named = () if angular is None else angular.files
    there = (path.parent / file for file in named)
    return path, *(file for file in there if file.is_file())


@dataclass(frozen=True, slots=True)
class ThermalFile:
    """U, g, closure, place of the shade and angular function, from the file beside a BSDF.

    The file has the name of the XML file; `ThermalTable` says what it may hold.
    """

    u_value: float | None = None
    g_value: float | None = None
    g_value_by_patch: NDArray[np.float64] | None = None  # [K]
    closure: Closure | None = None
    shading_position: str | None = None
    angular: AngularTable | None = None  # visible, of a specular system

    @classmethod
    def read(cls, path: Path) -> ThermalFile:
        """The values of the file; nothing where there is none."""
        if not path.is_file():
            return cls()
        table = validated(ThermalTable, read_table(path), path)
        by_patch = table.g_value_by_patch
        try:
            closure = table.closure()
        except ThermalInputError as error:
            raise DataError(str(error), file=path) from error
        return cls(
            table.u_value,
            table.g_value,
            None if by_patch is None else np.array(by_patch),
            closure,
            table.shading_position,
            None if table.angular is None else table.angular.read(path),
        )
