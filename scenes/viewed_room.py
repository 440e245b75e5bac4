"""The scene of a room for `cfs dgp` and `cfs picture`: its windows in their first state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from bim.model import COLOURS, Building, Season, Space, in_month, seasons
from bim.to_tracer import band_scenes
from mitsuba_cfs.images.view import View
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.optics import BsdfOptics, SystemOptics
from mitsuba_cfs.methods.scene import DaylightScene
from scenes.fenestration.peaks import as_lobes
from scenes.inputs import Inputs
from scenes.room.leaks import leak_notes
from scenes.room.windows import room_windows


@dataclass(frozen=True, slots=True)
class ViewedRoom:
    """A room as a scene with the optics of its windows."""

    space: Space
    optics: list[list[BsdfOptics]]  # [G][1]
    # the same with lobes where the data do not show whether a peak is specular; None: nowhere
    lobes: list[list[BsdfOptics]] | None
    seasons: tuple[Season, ...]  # surroundings outdoors by months
    scenes: tuple[DaylightScene, ...]  # of each season
    bands: tuple[DaylightScene, ...] = ()  # the first scene by red, green and blue
    tinted: tuple[Sequence[Sequence[SystemOptics]], ...] = ()  # the optics by red, green and blue [3][G][1]

    @property
    def scene(self) -> DaylightScene:
        """The scene of the first season."""
        return self.scenes[0]

    def leaks(self) -> list[str]:
        """Light that is lost through leaks of the model; traces a little."""
        return leak_notes(self.space, cache=MatrixCache.of_user())


def viewed_room(
    inputs: Inputs, view_of: Callable[[Building, Space], View], *, colour: bool = False, month: int | None = None
) -> ViewedRoom:
    """The first room of the inputs, in the visible band.

    Args:
        view_of: the view of a building's room; it refuses one that is not in the room.
        colour: the scene in three bands too.
        month: 1 to 12, of the surroundings; None: all seasons.
    """
    building, room = inputs.building, inputs.spaces[0]
    view = view_of(building, room)
    windows = room_windows(room, inputs.systems)
    times = seasons(building)
    if month is not None:
        times = (Season((month,), in_month(building, month)),)
    visible, *bands = band_scenes(
        times[0].building, room, windows.groups, view, ("visible", *(COLOURS if colour else ()))
    )
    others = (band_scenes(season.building, room, windows.groups, view, ("visible",))[0] for season in times[1:])
    changed = as_lobes(windows.systems)
    lobes = None if changed is None else replace(windows, systems=changed).optics()
    optics = windows.optics()
    tinted = tuple(windows.optics_by_colour(optics)) if colour else ()
    return ViewedRoom(room, optics, lobes, times, (visible, *others), tuple(bands), tinted)
