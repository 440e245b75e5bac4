"""Fenestration data that an IFC file holds for its windows, as the systems of a run."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.fenestration import AngularGValue, ShadingState
from bim.ifc.fenestration_read import read_fenestration
from bim.model import Window
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import digest
from scenes.job.inputs import System, system_of
from scenes.job.thermal_file import ThermalFile
from scenes.job.windows import States


def attached_systems(path: Path, windows: Iterable[Window]) -> dict[str, States]:
    """The systems by state of each window, by its GUID, from the data attached in the file.

    The state without a name is the usual one and comes first; the others follow in the file's
    order.  Windows whose data are the same share their systems.

    Raises: `DataError` that names the windows without data.
    """
    windows = list(windows)
    held = read_fenestration(path)
    missing = [w for w in windows if w.guid not in held]
    if missing:
        names = ", ".join(w.name or w.guid for w in missing[:5])
        more = f" and {len(missing) - 5} more" if len(missing) > 5 else ""
        raise DataError(
            "no fenestration data attached and no --cfs given (cfs ifc attach writes them)",
            file=path,
            element=f"window {names}{more}",
        )
    known: dict[str, States] = {}
    found = {}
    for window in windows:
        states = sorted(held[window.guid], key=lambda state: state.name != "")
        key = digest(*(_content(state) for state in states))
        if key not in known:
            known[key] = tuple(_system(state, window, path) for state in states)
        found[window.guid] = known[key]
    return found


def _content(state: ShadingState) -> list:
    bands = [[name, bsdf] for name, bsdf in sorted(state.bands.items())]
    thermal = [state.g_value, state.u_value, state.g_normal, state.g_by_patch]
    beside = None if state.file is None else str(state.file)
    return [state.name, bands, *thermal, state.closure, state.shading_position, beside]


def _system(state: ShadingState, window: Window, path: Path) -> System:
    name = state.name or window.type_name or window.name or window.guid
    if not state.bands:
        label = f"state {state.name!r} has no BSDF" if state.name else "has no BSDF"
        raise DataError(label, file=path, element=f"window {window.name or window.guid}")
    return system_of(state.bands, name, path=path, **_thermal(state))


def _thermal(state: ShadingState) -> dict:
    """U, g, closure and place of the shade: of the model, else of the file beside the BSDF's."""
    beside = ThermalFile()
    if state.file is not None:
        beside = ThermalFile.read(state.file.with_suffix(".toml"))
    g_normal, by_patch = state.g_normal, state.g_by_patch
    if state.g_value is not None:
        by_patch = g_by_patch(state.g_value)
    elif g_normal is None and by_patch is None:
        g_normal, by_patch = beside.g_value, beside.g_value_by_patch
    return {
        "u_value": beside.u_value if state.u_value is None else state.u_value,
        "g_value": g_normal,
        "g_by_patch": by_patch,
        "closure": state.closure or beside.closure,
        "shading_position": state.shading_position or beside.shading_position,
    }


def g_by_patch(table: AngularGValue) -> NDArray[np.float64]:
    """g [K] at the middles of the Klems full basis' incident patches, linear between the angles.

    Azimuths are those of the basis; outside the polar angles the nearest value holds.
    """
    theta, phi = KLEMS_FULL.centres()
    by_azimuth = np.stack([np.interp(theta, table.polar, column) for column in table.values.T])
    if len(table.azimuth) == 1:
        return by_azimuth[0]
    return np.array(
        [
            np.interp(p, table.azimuth, column, period=2 * np.pi)
            for p, column in zip(phi, by_azimuth.T, strict=True)
        ]
    )
