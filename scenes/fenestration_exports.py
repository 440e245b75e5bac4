"""What is known of the windows of an IFC file, as the exports take it; nothing is refused."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from bim.building_file import held_states
from bim.exported_glazing import ExportedGlazing, normal_transmittance
from bim.model import Space, Window
from bim.to_energyplus import DEFAULT_G, DEFAULT_U
from bim.to_radiance import FilledGroup
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from scenes.fenestration.resolver import held_systems, source_notes, stated_values, window_sources, windows_named
from scenes.fenestration.systems import FenestrationSystem, WindowOverrides
from scenes.fenestration.thermal_system import ThermalSystem, checked_system, window_optics
from scenes.room.windows import room_windows

LIGHT_ONLY = WindowOverrides(light_only=True)


@dataclass(frozen=True, slots=True)
class KnownFenestration:
    """The first state of each window that has a BSDF or stated values, and what is left."""

    file: Path
    windows: tuple[Window, ...]
    systems: dict[str, FenestrationSystem]  # by window GUID
    unfilled: dict[str, list[str]]  # names of the other windows, by what is missing of them
    overrides: WindowOverrides = LIGHT_ONLY
    several: tuple[str, ...] = ()  # names of windows with further shading states

    def notes(self, without: str = "written without") -> tuple[str, ...]:
        """Where each window's optics come from, and which windows have none, as `without` says."""
        further = f"{windows_named(self.several)}: only the first shading state is written."
        return (*self.sources(), *self.missing(without), *([further] if self.several else []))

    def sources(self) -> tuple[str, ...]:
        """Where each window's optics come from."""
        filled = [window for window in self.windows if window.guid in self.systems]
        return source_notes(window_sources(filled, {guid: (system,) for guid, system in self.systems.items()}))

    def missing(self, without: str) -> tuple[str, ...]:
        """Which windows have no optics, and what follows, as `without` says."""
        return tuple(
            f"{windows_named(names)}: no BSDF is attached {missing}: {without}."
            for missing, names in self.unfilled.items()
        )

    def glazings(self) -> tuple[dict[str, ExportedGlazing], tuple[str, ...]]:
        """Data of each window by GUID as a run uses them, and a sentence on each assumption.

        A window with a BSDF goes with it. A window of which only U, g or a transmittance is known
        gets usual values for the others; one of which nothing is known has no entry.
        """
        heat = {id(s): checked_system(s, self.file) for s in self.systems.values()}
        notes = [note for one in heat.values() for note in one.notes]
        notes += [note for s in self.systems.values() for note in s.notes]
        exported = {
            key: self._exported(system, heat[key]) for key, system in {id(s): s for s in self.systems.values()}.items()
        }
        result = {guid: exported[id(system)] for guid, system in self.systems.items()}
        held = held_states(self.windows, self.file)
        unknown: dict[str, list[str]] = {"U": [], "g": []}
        for window in self.windows:
            if window.guid in self.systems:
                continue
            values = stated_values(held, window, self.file, self.overrides)
            known = values.u_value, values.g_value
            label = window.name or window.guid
            for name, value in zip(unknown, known, strict=True):
                if value is None:
                    unknown[name].append(label)
            if any(value is not None for value in (*known, values.visible, values.solar)):
                result[window.guid] = ExportedGlazing(
                    DEFAULT_U if known[0] is None else known[0],
                    DEFAULT_G if known[1] is None else known[1],
                    values.visible,
                    values.solar,
                )
        for (name, names), value in zip(unknown.items(), (DEFAULT_U, DEFAULT_G), strict=True):
            if names:
                notes.append(f"{windows_named(names)}: no {name} is known, {value:g} is written.")
        return result, tuple(dict.fromkeys(notes))

    def _exported(self, system: FenestrationSystem, heat: ThermalSystem) -> ExportedGlazing:
        visible, solar = normal_transmittance(system.visible), normal_transmittance(system.solar)
        values = heat.fenestration.u_value, float(heat.g_value[0]), visible, solar
        if system.from_values:
            return ExportedGlazing(*values)
        bsdf = BsdfFile({"Visible": system.fine, "Solar": system.solar}, system.name)
        return ExportedGlazing(*values, bsdf, window_optics(system, heat))

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


def glazing_data(spaces: Sequence[Space], file: Path) -> dict[str, str]:
    """The results that a building's file has glazing data for, by window GUID: "all", "light" or "none"."""
    light = known_fenestration(spaces, file).systems
    heat = known_fenestration(spaces, file, WindowOverrides()).systems
    guids = (window.guid for space in spaces for window in space.windows)
    return {guid: "all" if guid in heat else "light" if guid in light else "none" for guid in guids}


def known_fenestration(
    spaces: Iterable[Space], file: Path, overrides: WindowOverrides = LIGHT_ONLY
) -> KnownFenestration:
    """What a building's file holds for the windows of some rooms.

    Args: overrides: of the user, in place of the file's data.
    """
    windows = tuple(window for space in spaces for window in space.windows)
    systems, unfilled = held_systems(windows, overrides, file)
    first = {guid: states[0] for guid, states in systems.items()}
    several = tuple(w.name or w.guid for w in windows if len(systems.get(w.guid, ())) > 1)
    return KnownFenestration(file, windows, first, unfilled, overrides, several)
