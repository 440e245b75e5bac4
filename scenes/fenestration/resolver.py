"""What fills each window: the one resolver of every command and export.

    flag          --cfs; --u and --g in place of the windows' own U and g
    study file    its [[system]] tables
    attached      BSDF, U and g that the IFC file holds for the window or its type
    stated        U, g and transmittances of the IFC file's property sets, as a clear glazing

The first of them that there is fills a window; where there is none, that is an error that says
what to do.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from bim.building_file import held_states, is_ifc
from bim.model import Window
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.notes import Note
from scenes.fenestration.systems import FenestrationSystem, States, WindowOverrides

NAMED = 5  # windows that one sentence names


def fill_windows(
    windows: Iterable[Window], overrides: WindowOverrides, file: Path | None
) -> dict[str, States]:
    """The systems by state of each window, by its GUID; windows of the same data share theirs.

    Args: file: the IFC file of the windows; None for a box.

    Raises: `DataError` that names the windows that nothing fills, and says what to give.
    """
    windows = list(windows)
    found, unfilled = held_systems(windows, overrides, file)
    for missing, names in unfilled.items():
        attach = (
            ", attach data (cfs ifc attach), or state VisibleLightTransmittance and "
            "SolarHeatGainTransmittance (Pset_DoorWindowGlazingType)"
        )
        raise DataError(
            f"has no BSDF attached {missing}: give {overrides.ask}{attach if is_ifc(file) else ''}",
            file=file,
            element=f"window {_listed(names)}",
        )
    return found


def held_systems(
    windows: Iterable[Window], overrides: WindowOverrides, file: Path | None
) -> tuple[dict[str, States], dict[str, list[str]]]:
    """As `fill_windows`, and the names of the windows that nothing fills by what is missing."""
    windows = list(windows)
    own = _by_name(windows, overrides, file)
    windows = [window for window in windows if window.guid not in own]
    if overrides.states or not windows:
        return own | {window.guid: overrides.states for window in windows}, {}
    if file is None:
        element = f"window {_listed([window.name for window in windows])}" if own else None
        message = f"a box holds no fenestration data: give {overrides.ask}"
        raise DataError(message, element=element, field="box")
    from scenes.fenestration.attached import attached_systems
    from scenes.fenestration.stated import stated_systems, stated_values

    held = held_states(windows, file)
    found = _with_overrides(attached_systems(held, windows, file), overrides)
    left = [window for window in windows if window.guid not in found]
    found |= stated_systems(held, left, file, overrides)
    unfilled: dict[str, list[str]] = {}
    for window in left:
        if window.guid not in found:
            missing = stated_values(held, window, file, overrides).missing(overrides.light_only)
            unfilled.setdefault(missing, []).append(window.name or window.guid)
    return own | found, unfilled


def _by_name(
    windows: list[Window], overrides: WindowOverrides, file: Path | None
) -> dict[str, States]:
    """The systems of the windows that the user names.

    Raises: `DataError` for a name that no window has, or that two systems have.
    """
    found: dict[str, States] = {}
    for names, states in overrides.named:
        for name in names:
            meant = [window.guid for window in windows if name in (window.guid, window.name)]
            if not meant:
                there = _listed([window.name or window.guid for window in windows])
                message = f"no window of the rooms is called {name!r}; there are {there}"
                raise DataError(message, file=file, field="system.windows")
            twice = [guid for guid in meant if guid in found and found[guid] is not states]
            if twice:
                message = f"{name!r} is named with other windows too: name a window's states alike"
                raise DataError(message, file=file, field="system.windows")
            found |= dict.fromkeys(meant, states)
    return found


def _with_overrides(systems: Mapping[str, States], overrides: WindowOverrides) -> dict[str, States]:
    """The systems with the user's U and g; the same ones stay the same."""
    if overrides.u_value is None and overrides.g_value is None:
        return dict(systems)
    known: dict[int, FenestrationSystem] = {}
    for states in systems.values():
        for system in states:
            known.setdefault(id(system), _changed(system, overrides))
    return {guid: tuple(known[id(s)] for s in states) for guid, states in systems.items()}


def _changed(system: FenestrationSystem, overrides: WindowOverrides) -> FenestrationSystem:
    source = system.source
    if overrides.u_value is not None:
        system = replace(system, u_value=overrides.u_value)
        source += ", U of --u"
    if overrides.g_value is not None:
        system = replace(system, g_value=overrides.g_value, g_by_patch=None)
        source += ", g of --g"
    return replace(system, source=source)


def window_sources(windows: Iterable[Window], systems: Mapping[str, States]) -> list[dict]:
    """Each system once: its name, its source, and the windows that it fills."""
    found: dict[int, dict] = {}
    for window in windows:
        for system in systems[window.guid]:
            about = {"system": system.name, "source": system.source, "windows": []}
            of_system = found.setdefault(id(system), about)["windows"]
            of_system.append(window.name or window.guid)
    return list(found.values())


def source_notes(sources: Iterable[dict]) -> tuple[str, ...]:
    """A sentence for each system on what it fills and where it is from."""
    return tuple(
        Note(
            "{windows}: {system}, from {source}.",
            windows=windows_named(one["windows"]),
            system=one["system"],
            source=one["source"],
        )
        for one in sources
    )


def windows_named(names: list[str]) -> str:
    """Windows in words, the first few by name; the noun where their names have it not."""
    listed = _listed(names)
    if all(name.casefold().startswith("window") for name in names):
        return listed if isinstance(listed, Note) else listed[:1].upper() + listed[1:]
    if len(names) == 1:
        return Note("Window {names}", names=listed)
    return Note("Windows {names}", names=listed)


def _listed(names: list[str]) -> str:
    """The first few names, each once with how many have it, and how many windows there are more."""
    counts = list(Counter(names).items())
    shown = [name if count == 1 else f"{name} ({count})" for name, count in counts[:NAMED]]
    left = sum(count for _, count in counts[NAMED:])
    text = ", ".join(shown)
    return Note("{names} and {count} more", names=text, count=left) if left else text
