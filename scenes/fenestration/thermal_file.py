"""What is known of a fenestration system besides its BSDF, from the `.toml` file beside it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.angular import AngularTable
from mitsuba_cfs.bsdf.spectral_pane import SpectralPane
from mitsuba_cfs.errors import DataError
from scenes.fenestration.angular_file import AngularData
from scenes.fenestration.layer_tables import spectral_panes
from scenes.fenestration.tables import ByPatch, WindowHeatTable
from scenes.toml_file import Share, read_table, validated
from thermal.closure import Closure
from thermal.errors import ThermalInputError


class ThermalTable(WindowHeatTable):
    """The file beside a BSDF: the same as a study's [[system]], and what g was worked out from."""

    angular: AngularData | None = None  # of a specular system, visible
    # layer by layer; for readers, the balance takes g
    inward_fractions: tuple[Share, ...] = ()
    absorptance_blind: ByPatch | None = None
    absorptance_outer_pane: ByPatch | None = None
    absorptance_inner_pane: ByPatch | None = None
    kappa: Share | None = None  # of Kuhn's formula


def files_beside(bsdf: Path) -> tuple[Path, ...]:
    """The `.toml` file beside a BSDF's and the files that it names; none where there is none."""
    path = bsdf.with_suffix(".toml")
    if not path.is_file():
        return ()
    table = validated(ThermalTable, read_table(path), path)
    panes = (layer.pane for layer in table.layers if layer.pane is not None)
    named = (*panes, *(() if table.angular is None else table.angular.files))
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
    panes: tuple[SpectralPane, ...] = ()  # all layers, where each is a file of spectra

    @classmethod
    def read(cls, path: Path) -> ThermalFile:
        """The values of the file; nothing where there is none."""
        if not path.is_file():
            return cls()
        table = validated(ThermalTable, read_table(path), path)
        try:
            placed = table.placed(path.parent)
            closure = placed.closure()
        except ThermalInputError as error:
            raise DataError(str(error), file=path) from error
        return cls(
            table.u_value,
            table.g_value,
            table.g_by_patch(),
            closure,
            table.shading_position,
            None if table.angular is None else table.angular.read(path),
            spectral_panes(placed.layers),
        )
