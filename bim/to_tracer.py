"""Rooms as what the tracer of `mitsuba_cfs` reads: opaque triangles and window groups."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from bim.model import COLOURS, Building, Element, Face, Space, Window
from bim.names import numbered
from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.images.view import View
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.surfaces import SharedOutdoors, SurfaceGroups, Surfaces, WindowGroup, WindowSurface

SAME_ORIENTATION = 5e-4  # difference between frame axes [1] within a group: 0.03 degrees
COMPASS = ("N", "NE", "E", "SE", "S", "SW", "W", "NW")


def interior_surfaces(space: Space, band: str = "visible") -> Surfaces:
    """The opaque boundary of a room: walls, reveals, frames; surface i is `space.faces[i]`."""
    return _surfaces(space.faces, band)


def furnished_surfaces(space: Space, band: str = "visible") -> Surfaces:
    """What light meets in a room: `interior_surfaces`, then its furniture."""
    return _surfaces([*space.faces, *space.furniture], band)


# Groups of surfaces by whose reflectances light is derived, and the kinds of faces in each
REFLECTANCE_GROUPS = {
    "floor": ("floor",),
    "walls": ("wall", "door", "window frame", "reveal"),
    "ceiling": ("ceiling", "roof"),
    "furniture": (),
}


def reflectance_groups(space: Space) -> SurfaceGroups:
    """The groups of the surfaces of `furnished_surfaces`."""
    names = tuple(REFLECTANCE_GROUPS)
    of_kind = {kind: number for number, kinds in enumerate(REFLECTANCE_GROUPS.values()) for kind in kinds}
    numbers = [of_kind[face.kind] for face in space.faces] + [names.index("furniture")] * len(space.furniture)
    return SurfaceGroups(names, np.array(numbers, dtype=np.int64))


def exterior_surfaces(building: Building, space: Space, band: str = "visible") -> Surfaces:
    """The surroundings of a room's windows: every element but those windows."""
    own = {window.guid for window in space.windows}
    return element_surfaces((e for e in building.elements if e.guid not in own), band)


def outdoors_of_rooms(building: Building, spaces: Sequence[Space], band: str = "visible") -> SharedOutdoors:
    """The surroundings of several rooms: all elements, the windows of the rooms last.

    A room's rays pass the windows of the room; no window may be that of two of the rooms.
    """
    room = {window.guid: i for i, space in enumerate(spaces) for window in space.windows}
    elements = sorted(building.elements, key=lambda element: element.guid in room)
    owner = [room.get(element.guid, -1) for element in elements]
    counts = [len(element.triangles) for element in elements]
    return SharedOutdoors(element_surfaces(elements, band), np.repeat(owner, counts))


def element_surfaces(elements: Iterable[Element], band: str = "visible") -> Surfaces:
    """The surroundings as surfaces; surface i is element i."""
    return _surfaces(elements, band)


def _surfaces(parts: Iterable[Face | Element], band: str) -> Surfaces:
    parts = list(parts)
    if not parts:
        return Surfaces.none()
    counts = [len(part.triangles) for part in parts]
    return Surfaces(
        np.concatenate([part.triangles for part in parts]),
        np.repeat([part.reflectance(band) for part in parts], counts),
        np.repeat(np.arange(len(parts)), counts),
        tuple(part.name for part in parts),
        tuple(part.gloss for part in parts) if any(part.gloss for part in parts) else (),
    )


def window_groups(space: Space) -> list[WindowGroup]:
    """The room's windows in groups of one orientation, the biggest group first.

    The order of windows inside the groups is that of `space.windows`.
    """
    groups = [[space.windows[w] for w in group] for group in orientation_groups(space)]
    names = numbered([orientation_name(group[0]) for group in groups])
    return [
        WindowGroup(name, tuple(WindowSurface(w.name, w.triangles, w.up) for w in group))
        for name, group in zip(names, groups, strict=True)
    ]


def orientation_groups(space: Space) -> list[list[int]]:
    """The numbers, in `space.windows`, of the windows of each of `window_groups`."""
    windows = space.windows
    groups: list[list[int]] = []
    for number, window in enumerate(windows):
        frame = window_frame(window.normal, window.up)
        for group in groups:
            first = windows[group[0]]
            if np.abs(window_frame(first.normal, first.up) - frame).max() < SAME_ORIENTATION:
                group.append(number)
                break
        else:
            groups.append([number])
    # groups of equal area in an order that does not depend on that of the windows
    return sorted(
        groups,
        key=lambda group: (
            -round(sum(windows[w].area for w in group), 6),
            *np.round(windows[group[0]].normal, 3).tolist(),
        ),
    )


def orientation_name(window: Window) -> str:
    """Compass point that the window faces, or "roof" within 30 degrees of straight up."""
    if window.normal[2] > 0.866:
        return "roof"
    azimuth = np.degrees(np.arctan2(window.normal[0], window.normal[1]))
    return COMPASS[int(np.round(azimuth / 45)) % 8]


def band_scenes(
    building: Building, space: Space, groups: Sequence[WindowGroup], view: View, bands: Sequence[str] = COLOURS
) -> tuple[DaylightScene, ...]:
    """The scene of a room with a view in each band."""
    return tuple(
        DaylightScene(furnished_surfaces(space, band), exterior_surfaces(building, space, band), groups, view=view)
        for band in bands
    )
