"""Glass and open doorways between rooms: the same opening in both, and the way of the light."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bim.defaults import ROOM_REFLECTANCE, default_construction
from bim.model import Building, Face, Space, centroid

SAME_SIZE = 0.05  # share by which the pane may differ as the two rooms have it
OPENED = {  # codes of issues of a building whose inner glass and doorways daylight passes
    "glass-between-rooms": "glass-between-rooms-open",
    "rooms-open-to-each-other": "rooms-open-to-each-other-lit",
}
THINNEST = 1e-3  # walls up to this have no reveal [m]
Key = tuple[str, str]  # GUID of a room, name of its face


def panes_between(spaces: Iterable[Space], space: Space) -> dict[str, list[tuple[Face, Face]]]:
    """Panes of a room and the same as the room beyond has them, by the GUID of that room."""
    rooms = {other.guid: other for other in spaces}
    pairs: dict[str, list[tuple[Face, Face]]] = {}
    for face in space.faces:
        other = rooms.get(face.neighbour or "")
        if face.pane is None or other is None or other.guid == space.guid:
            continue
        for back in other.faces:
            if back.pane is None or back.neighbour != space.guid:
                continue
            away = wall_depth(face, back)
            if (
                back.pane.guid == face.pane.guid
                and back.normal @ face.normal < -0.999
                and abs(back.area - face.area) < SAME_SIZE * face.area
                and away > -THINNEST
                and _beside(face, back) < 0.5 * np.sqrt(face.area)
            ):
                pairs.setdefault(other.guid, []).append((face, back))
    return pairs


def rooms_through_panes(building: Building, space: Space, among: Collection[str]) -> list[Space]:
    """The rooms, of those with a GUID `among`, that glass or open doorways join to a room."""
    rooms = {other.guid: other for other in building.spaces if other.guid in among}
    reached, queue = {space.guid: space}, [space]
    while queue:
        for guid in panes_between(building.spaces, queue.pop(0)):
            if guid in rooms and guid not in reached:
                reached[guid] = rooms[guid]
                queue.append(rooms[guid])
    return [room for guid, room in reached.items() if guid != space.guid]


def wall_depth(face: Face, back: Face) -> float:
    """How far the pane of the room beyond lies behind that of the room [m]."""
    return float((centroid(back.triangles) - centroid(face.triangles)) @ face.normal)


def _beside(face: Face, back: Face) -> float:
    """How far the panes' middles lie apart along the wall [m]."""
    step = centroid(back.triangles) - centroid(face.triangles)
    return float(np.linalg.norm(step - (step @ face.normal) * face.normal))


def reveals_between(face: Face, depth: float) -> NDArray[np.float64]:
    """The reveals [E, 2, 3, 3], two triangles an edge of a pane, through the wall behind it."""
    corners, number = np.unique(np.round(face.triangles.reshape(-1, 3), 6), axis=0, return_inverse=True)
    triangles = number.reshape(-1, 3)
    edges = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    a, b = corners[edges[first[count == 1]]].transpose(1, 0, 2)
    step = depth * face.normal
    return np.stack([np.stack([a, b, b + step], axis=1), np.stack([a, b + step, a + step], axis=1)], axis=1)


def touching(building: Building) -> tuple[Building, dict[Key, Key]]:
    """The building with open doorways as one face of both rooms, and each such face's other side.

    The way through the wall belongs to the first of the two rooms, its reveals with it; programs
    that draw walls without thickness have the air of two rooms meet in one polygon.
    """
    sides: dict[Key, Key] = {}
    spaces = []
    for space in building.spaces:
        pairs = [pair for own in panes_between(building.spaces, space).values() for pair in own]
        open_ = [(face, back) for face, back in pairs if face.pane.is_open]
        moved: dict[str, list[Face]] = {}
        for face, back in open_:
            key, other = (space.guid, face.name), (face.neighbour, back.name)
            if key not in sides and other not in sides:
                sides |= {key: other, other: key}
                moved[face.name] = _through(face, back)
        faces = [new for face in space.faces for new in moved.get(face.name, [face])]
        spaces.append(replace(space, faces=tuple(faces)))
    return replace(building, spaces=tuple(spaces)), sides


def _through(face: Face, back: Face) -> Sequence[Face]:
    """The face moved to where the room beyond has it, and the reveals up to there."""
    depth = wall_depth(face, back)
    if depth <= THINNEST:
        return [face]
    rho = ROOM_REFLECTANCE["reveal"]
    return [
        replace(face, triangles=back.triangles[:, ::-1]),
        *(
            Face(
                f"{face.name} reveal {number}",
                "reveal",
                strip,
                "adiabatic",
                default_construction("reveal", "adiabatic"),
                rho,
                rho,
            )
            for number, strip in enumerate(reveals_between(face, depth), start=1)
        ),
    ]


def source_rooms(building: Building, space: Space) -> list[Space]:
    """The rooms from which light reaches a room through inner glass, in one step or several."""
    away = panes_to_windows(building)
    rooms: dict[str, Space] = {}
    queue = light_sources(building, space, away, away.get(space.guid, -1) + 1)
    while queue:
        room = queue.pop(0)
        if room.guid not in rooms:
            rooms[room.guid] = room
            queue += light_sources(building, room, away, away[room.guid])
    return list(rooms.values())


def opened(building: Building) -> Building:
    """The building with open doorways, whose reflectance is that of the room beyond.

    rho f / (1 - rho (1 - f)), rho the mean reflectance of that room, f the doorway's share of its
    surface. Issues that advise this option state that it is in use.

    Source: Sumpner 1892 (the integrating sphere), as for light wells and cavities.
    """
    rooms = {space.guid: space for space in building.spaces}

    def opened_face(face: Face) -> Face:
        beyond = rooms.get(face.neighbour or "")
        if face.pane is None or not face.pane.is_open or beyond is None:
            return face
        visible, solar = (_returned(beyond, face.area, band) for band in ("visible", "solar"))
        return replace(face, reflectance_visible=visible, reflectance_solar=solar)

    spaces = tuple(replace(space, faces=tuple(map(opened_face, space.faces))) for space in building.spaces)
    issues = tuple(replace(issue, code=OPENED.get(issue.code, issue.code)) for issue in building.issues)
    return replace(building, spaces=spaces, issues=issues)


def _returned(room: Space, area: float, band: str) -> float:
    """Share of the light through an opening [m2] of a room that returns through it."""
    parts = [(face.area, face.total_reflectance(band)) for face in room.faces]
    whole = sum(size for size, _ in parts) + sum(window.area for window in room.windows)
    mean = sum(size * reflectance for size, reflectance in parts) / whole
    share = min(area / whole, 1.0)
    return mean * share / (1 - mean * (1 - share))


def panes_to_windows(building: Building) -> dict[str, int]:
    """Number of panes between a room and the nearest window, by GUID; without unlit rooms."""
    rooms = {space.guid: space for space in building.spaces}
    panes = {space.guid: 0 for space in building.spaces if space.windows}
    newest = list(panes)
    while newest:
        reached = {guid for one in newest for guid in panes_between(building.spaces, rooms[one])} - panes.keys()
        panes |= dict.fromkeys(reached, panes[newest[0]] + 1)
        newest = sorted(reached)
    return panes


def light_sources(building: Building, space: Space, away: Mapping[str, int], below: int) -> list[Space]:
    """The rooms behind a room's panes that are fewer than `below` panes away from a window."""
    pairs = panes_between(building.spaces, space)
    return [other for other in building.spaces if other.guid in pairs and away.get(other.guid, below) < below]
