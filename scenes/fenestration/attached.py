"""Fenestration data that an IFC file holds for its windows, as systems."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.fenestration import AngularGValue, ShadingState
from bim.model import Window
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import digest
from scenes.fenestration.systems import FenestrationSystem, States, system_of
from scenes.fenestration.thermal_file import ThermalFile

Held = Mapping[str, tuple[ShadingState, ...]]  # by window, as `read_fenestration` gives them


def attached_systems(held: Held, windows: Iterable[Window], path: Path) -> dict[str, States]:
    """The systems by state of each window that has a BSDF attached, by its GUID.

    The state without a name is the usual one and comes first; the others follow in the file's
    order.  Windows whose data are the same share their systems.

    Args: path: of the IFC file.
    """
    equal: dict[str, list[Window]] = {}
    for window in windows:
        states = usual_first(held.get(window.guid, ()))
        if any(state.bands for state in states):
            equal.setdefault(digest(*(_content(state) for state in states)), []).append(window)
    found = {}
    for group in equal.values():
        states = usual_first(held[group[0].guid])
        source = _source([usual_first(held[window.guid])[0] for window in group], path)
        systems = tuple(_system(state, group[0], path, source) for state in states)
        found |= {window.guid: systems for window in group}
    return found


def usual_first(states: Iterable[ShadingState]) -> list[ShadingState]:
    """The states, the one without a name first."""
    return sorted(states, key=lambda state: state.name != "")


def _content(state: ShadingState) -> list:
    bands = [[name, bsdf] for name, bsdf in sorted(state.bands.items())]
    thermal = [state.g_value, state.u_value, state.g_normal, state.g_by_patch]
    beside = None if state.file is None else str(state.file)
    held = [*thermal, state.closure, state.shading_position, state.angular]
    return [state.name, bands, *held, beside]


def _system(state: ShadingState, window: Window, path: Path, source: str) -> FenestrationSystem:
    name = state.name or window.type_name or window.name or window.guid
    if not state.bands:
        label = f"state {state.name!r} has no BSDF" if state.name else "has no BSDF"
        raise DataError(label, file=path, element=f"window {window.name or window.guid}")
    named = "" if state.file is None else f" as {state.file.name}"
    thermal = held_thermal(state)
    angular = thermal.pop("angular") if state.angular is not None else None
    system = system_of(state.bands, name, path=path, source=f"{source}{named}", **thermal)
    return system if angular is None else replace(system, angular=angular)


def _source(states: Iterable[ShadingState], path: Path) -> str:
    """What holds the data of some windows, one state of each."""
    types = dict.fromkeys(state.of_type for state in states)
    names = [name or "without a name" for name in types if name is not None]
    holders = [f"window type {', '.join(names)}"] if names else []
    holders += ["the window itself"] if None in types else []
    return f"what is attached to {' and '.join(holders)} in {path.name}"


def held_thermal(state: ShadingState) -> dict:
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
        "angular": state.angular or beside.angular,
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
