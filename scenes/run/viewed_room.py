"""A room as `cfs dgp` and `cfs picture` view it: its windows in their first state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from bim.model import COLOURS, Building, Space
from bim.seasons import Season, in_month, seasons
from mitsuba_cfs.images.view import View
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.optics import BsdfOptics
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.progress import Progress
from scenes.fenestration.resolver import fill_windows, source_notes, window_sources
from scenes.fenestration.systems import FenestrationSystem, Given
from scenes.room.glare import band_scenes
from scenes.room.leaks import leak_notes
from scenes.room.windows import room_windows, traced_building
from scenes.run.building import read_building
from scenes.run.inputs import chosen_spaces
from scenes.run.notes import tree_notes


@dataclass(frozen=True, slots=True)
class ViewedRoom:
    """A room with its scene, what fills its windows and what is to be said of them."""

    space: Space
    scene: DaylightScene
    systems: tuple[FenestrationSystem, ...]  # [G]
    optics: list[list[BsdfOptics]]  # [G][1]
    sources: list[dict]  # name, source and windows of each system
    bands: tuple[DaylightScene, ...] = ()  # the scene by red, green and blue, where asked for
    seasons: tuple[Season, ...] = ()  # what stands outdoors in which months
    scenes: tuple[DaylightScene, ...] = ()  # of each season; `scene` is the first

    def notes(self) -> tuple[str, ...]:
        """What fills the windows, what its data lack, and light that is lost; traces a little."""
        own = (note for system in self.systems for note in system.notes)
        holes = leak_notes(self.space, cache=MatrixCache.of_user())
        trees = tree_notes(self.seasons[0].building) if self.seasons else ()
        return tuple(dict.fromkeys([*trees, *source_notes(self.sources), *own, *holes]))


def read_viewed_room(
    file: Path,
    space: str | None,
    join: Sequence[str],
    given: Given,
    view_of: Callable[[Building, Space], View],
    progress: Progress,
    *,
    furniture: bool = False,
    apertures: Sequence[str] = (),
    surroundings: Sequence[Path] = (),
    surroundings_offset: tuple[float, float, float] | None = None,
    colour: bool = False,
    month: int | None = None,
) -> ViewedRoom:
    """The room of a building file, seen in the visible band.

    Args:
        space: its name; None: the first with a window.
        given: what the user gives for all windows.
        view_of: the view of a building's room; it refuses one that is not in it.
        furniture: whether what stands in the room is seen.
        apertures: materials of a Radiance scene's windows.
        surroundings, surroundings_offset: as of `read_building`.
        colour: the scene in three bands too.
        month: 1 to 12, of what stands outdoors; None: all seasons.
    """
    building = read_building(
        file,
        join=join,
        furniture=furniture,
        apertures=apertures,
        surroundings=surroundings,
        surroundings_offset=surroundings_offset,
        progress=progress,
    )
    room = chosen_spaces(building, () if space is None else (space,), file)[0]
    view = view_of(building, room)
    filled = {guid: states[:1] for guid, states in fill_windows(room.windows, given, file).items()}
    windows = room_windows(room, filled)
    building = traced_building(building, filled)
    found = seasons(building)
    if month is not None:
        found = (Season((month,), in_month(building, month)),)
    building = found[0].building
    systems = tuple(system for (system,) in windows.systems)
    visible, *bands = band_scenes(
        building, room, windows.groups, view, ("visible", *(COLOURS if colour else ()))
    )
    others = (
        band_scenes(season.building, room, windows.groups, view, ("visible",))[0]
        for season in found[1:]
    )
    sources = window_sources(room.windows, filled)
    return ViewedRoom(
        room, visible, systems, windows.optics(), sources, tuple(bands), found,
        (visible, *others),
    )  # fmt: skip
