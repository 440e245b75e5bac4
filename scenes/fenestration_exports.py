"""What is known of the windows of an IFC file, as the exports take it; nothing is refused."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from bim.model import Space, Window
from bim.to_energyplus import DEFAULT_G, DEFAULT_U, UAndG
from bim.to_radiance import FilledGroup
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from scenes.fenestration.resolver import (
    held_systems,
    source_notes,
    stated_u_and_g,
    window_sources,
    windows_named,
)
from scenes.fenestration.systems import FenestrationSystem, WindowOverrides
from scenes.fenestration.thermal_system import checked_system
from scenes.room.windows import room_windows


@dataclass(frozen=True, slots=True)
class KnownFenestration:
    """The first state of each window that has a BSDF or stated values, and what is left."""

    file: Path
    windows: tuple[Window, ...]
    systems: dict[str, FenestrationSystem]  # by window GUID
    unfilled: dict[str, list[str]]  # names of the other windows, by what is missing of them

    def notes(self, without: str = "written without") -> tuple[str, ...]:
        """Where each window's optics come from, and which windows have none, as `without` says."""
        filled = [window for window in self.windows if window.guid in self.systems]
        states = {guid: (system,) for guid, system in self.systems.items()}
        none = (
            f"{windows_named(names)}: no BSDF is attached {missing}: {without}."
            for missing, names in self.unfilled.items()
        )
        return (*source_notes(window_sources(filled, states)), *none)

    def u_and_g(self) -> tuple[dict[str, UAndG], tuple[str, ...]]:
        """U and g of each window as a run takes them, and a sentence on what is not known."""
        heat = {id(s): checked_system(s, self.file) for s in self.systems.values()}
        notes = list(dict.fromkeys(note for one in heat.values() for note in one.notes))
        left = [window for window in self.windows if window.guid not in self.systems]
        result = stated_u_and_g(left, self.file)
        for guid, system in self.systems.items():
            thermal = heat[id(system)]
            result[guid] = thermal.fenestration.u_value, float(thermal.g_value[0])
        for number, (name, value) in enumerate((("U", DEFAULT_U), ("g", DEFAULT_G))):
            names = [w.name or w.guid for w in left if result[w.guid][number] is None]
            if names:
                notes.append(f"{windows_named(names)}: no {name} is known, {value:g} is written.")
        return result, tuple(notes)

    def groups(self, space: Space) -> list[FilledGroup]:
        """The window groups of a room by orientation and system, with their matrices."""
        nothing = FenestrationSystem("unknown", None, None)
        systems = {w.guid: (self.systems.get(w.guid, nothing),) for w in space.windows}
        windows = room_windows(space, systems)
        result = []
        for group, (system,) in zip(windows.groups, windows.systems, strict=True):
            if system is nothing:
                result.append(FilledGroup(group))
                continue
            klems = BsdfFile({"Visible": system.visible, "Solar": system.solar}, system.name)
            tree = None if system.tree is None else BsdfFile({"Visible": system.tree}, system.name)
            result.append(FilledGroup(group, klems, tree))
        return result

    def bsdfs(self, band: str = "visible") -> dict[str, BsdfFile]:
        """The band of each window, the visible one as finely as it is known, by GUID.

        Either stands as the visible one, which is what the scenes' plugins read.
        """
        result = {g: s.fine if band == "visible" else s.solar for g, s in self.systems.items()}
        return {g: BsdfFile({"Visible": bsdf}, self.systems[g].name) for g, bsdf in result.items()}


def known_fenestration(spaces: Iterable[Space], file: Path) -> KnownFenestration:
    """What an IFC file holds for the windows of some rooms."""
    windows = tuple(window for space in spaces for window in space.windows)
    systems, unfilled = held_systems(windows, WindowOverrides(light_only=True), file)
    first = {guid: states[0] for guid, states in systems.items()}
    return KnownFenestration(file, windows, first, unfilled)
