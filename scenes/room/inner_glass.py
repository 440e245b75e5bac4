"""Glass and open doorways between rooms: window groups whose outdoors is another room with windows.

A doorway is a pane that passes everything.  A room without windows that such panes light passes
light on: each room takes light from rooms that are no more panes away from the nearest window than
it is, and these from rooms that are fewer away.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bim.defaults import GLASS_REFLECTANCE, ROOM_REFLECTANCE
from bim.doorways import THINNEST, panes_between, reveals_between, wall_depth
from bim.model import SHUT_ADVICE, Building, Element, Face, Space
from bim.to_tracer import (
    element_surfaces,
    exterior_surfaces,
    furnished_surfaces,
    window_groups,
)
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.methods.light import SeasonalLight, group_shares
from mitsuba_cfs.methods.optics import BsdfOptics, MatrixOptics, SystemOptics
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.methods.scene import AdjacentRoom, DaylightScene
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.scattering import AngularScattering
from scenes.fenestration.stated import StatedValues, glazing_system
from scenes.fenestration.systems import States
from scenes.room.windows import room_windows

CLEAR = 0.88  # visible transmittance of glass that states none: a float pane of 6 mm, EN 410
PASSES = "daylight passes (--inner-glass)"
PANE = "glass between rooms"  # name of a pane as the room beyond has it: opaque


@dataclass(frozen=True, slots=True)
class InnerGlass:
    """The window groups of a room that look into other rooms, and what they take from there."""

    interior: Surfaces  # the room without this glass
    groups: tuple[WindowGroup, ...]  # axis I
    optics: tuple[tuple[SystemOptics, ...], ...]  # [I], each of one state
    beyond: tuple[AdjacentRoom, ...]  # [I]
    names: tuple[str, ...]  # [I] labels of the rooms beyond
    area: float  # of the glass [m2]
    open_area: float  # of the doorways [m2]
    faces: frozenset[str]  # names of the room's faces that this glass is


def lending_rooms(building: Building, space: Space) -> list[Space]:
    """The rooms that a room gets light from through glass, and those that they get it from."""
    away = _panes_to_windows(building)
    found: dict[str, Space] = {}
    left = _lenders(building, space, away, away.get(space.guid, -1) + 1)
    while left:
        room = left.pop(0)
        if room.guid not in found:
            found[room.guid] = room
            left += _lenders(building, room, away, away[room.guid])
    return list(found.values())


def opened(building: Building) -> Building:
    """The building with its doorways open: each reflects what comes back from the room beyond.

    rho f / (1 - rho (1 - f)), rho the mean reflectance of that room, f the doorway's share of its
    surface.  Problems that asked for this say that it is so.

    Source: Sumpner 1892 (the integrating sphere), as for light wells and cavities.
    """
    rooms = {space.guid: space for space in building.spaces}

    def seen(face: Face) -> Face:
        beyond = rooms.get(face.neighbour or "")
        if face.pane is None or not face.pane.is_open or beyond is None:
            return face
        visible, solar = (_returned(beyond, face.area, band) for band in ("visible", "solar"))
        return replace(face, reflectance_visible=visible, reflectance_solar=solar)

    spaces = tuple(replace(space, faces=tuple(map(seen, space.faces))) for space in building.spaces)
    told = [(one, one.consequence.replace(SHUT_ADVICE, PASSES)) for one in building.problems]
    problems = tuple(replace(one, consequence=text) for one, text in told)
    return replace(building, spaces=spaces, problems=problems)


def _returned(room: Space, area: float, band: str) -> float:
    """Share of the light through an opening [m2] of a room that comes back out of it."""
    parts = [(face.area, face.total_reflectance(band)) for face in room.faces]
    whole = sum(size for size, _ in parts) + sum(window.area for window in room.windows)
    mean = sum(size * reflectance for size, reflectance in parts) / whole
    share = min(area / whole, 1.0)
    return mean * share / (1 - mean * (1 - share))


def inner_glass(
    building: Building, space: Space, systems: Mapping[str, States]
) -> InnerGlass | None:
    """The glass and doorways of a room to rooms that daylight reaches; None where there are none.

    The windows there are in their first state, the glass between is a clear pane of the
    transmittance that it states, a doorway passes all.  The wall's thickness is a tube of reveals
    beyond the glass.

    Args: systems: of the windows of all these rooms, by their GUID.
    """
    away = _panes_to_windows(building)
    return _inner_glass(building, space, systems, away, away.get(space.guid, -1) + 1)


def _inner_glass(
    building: Building,
    space: Space,
    systems: Mapping[str, States],
    away: Mapping[str, int],
    below: int,
) -> InnerGlass | None:
    """That to rooms fewer than so many panes away from a window."""
    found, used = [], []
    dark = AngularScattering(np.zeros(2), np.zeros(2))  # the sun comes by patches
    for other in _lenders(building, space, away, below):
        pairs = panes_between(building, space)[other.guid]
        onward = _inner_glass(building, other, systems, away, away[other.guid])
        scene, transmission = _room_beyond(building, other, pairs, systems, onward)
        used += [face for face, _ in pairs]
        for optics, group in _groups(space, [face for face, _ in pairs]):
            given = MatrixOptics(optics.transmission, dark, reflection=optics.reflection)
            beam = np.diag(optics.transmission)
            named = replace(group, name=f"{group.name}, to {other.label}")
            beyond = AdjacentRoom(scene, transmission, beam)
            found.append((named, (given,), beyond, other.label))
    if not found:
        return None
    names = frozenset(face.name for face in used)
    rest = replace(space, faces=tuple(face for face in space.faces if face.name not in names))
    areas = [sum(f.area for f in used if f.pane.is_open == is_open) for is_open in (False, True)]
    groups = map(tuple, zip(*found, strict=True))
    return InnerGlass(furnished_surfaces(rest), *groups, *areas, names)


def borrowed_share(
    space: Space, light: PhaseLight | SeasonalLight, inner: InnerGlass | None
) -> str:
    """How much of the light of a room's sensors over the year its inner glass gives, in words."""
    if inner is None:
        return ""
    first, sums = len(light.scene.outdoor_groups), group_shares(light)
    share = float(sums[first:].sum() / max(sums.sum(), 1e-9))
    return (
        f"Room {space.label} borrows {100 * share:.0f} % of its daylight through "
        f"{_through(inner)} from {', '.join(dict.fromkeys(inner.names))}; the sun comes through "
        "it by sky patches, blinds there are in their first state, the heat balance has none of it."
    )


def _through(inner: InnerGlass) -> str:
    """What the light comes through, in words."""
    parts = ((inner.area, "glass"), (inner.open_area, "open doorways"))
    return " and ".join(f"{area:.1f} m2 of {what}" for area, what in parts if area > 0)


def _panes_to_windows(building: Building) -> dict[str, int]:
    """How many panes lie between a room and the nearest with windows; of rooms with light only."""
    rooms = {space.guid: space for space in building.spaces}
    found = {space.guid: 0 for space in building.spaces if space.windows}
    newest = list(found)
    while newest:
        reached = {
            guid for one in newest for guid in panes_between(building, rooms[one])
        } - found.keys()
        found |= dict.fromkeys(reached, found[newest[0]] + 1)
        newest = sorted(reached)
    return found


def _lenders(building: Building, space: Space, away: Mapping[str, int], below: int) -> list[Space]:
    """The rooms behind a room's panes that are fewer than so many panes away from a window."""
    pairs = panes_between(building, space)
    return [
        other for other in building.spaces
        if other.guid in pairs and away.get(other.guid, below) < below
    ]  # fmt: skip


def _groups(space: Space, faces: Sequence[Face]) -> list[tuple[SystemOptics, WindowGroup]]:
    """Panes of a room in groups of one orientation and one transmittance, with their optics."""
    by_tau: dict[float | None, list] = {}
    for face in faces:
        tau = None if face.pane.is_open else face.pane.visible_transmittance or CLEAR
        by_tau.setdefault(tau, []).append(face.pane)
    found = []
    for tau, panes in by_tau.items():
        optics: SystemOptics = MatrixOptics(np.eye(KLEMS_FULL.size))
        if tau is not None:
            glass = glazing_system(StatedValues(tau, None, None, None, 1), "the model")
            optics = BsdfOptics(glass.visible, glass.fine, glass.angular)
        groups = window_groups(replace(space, windows=tuple(panes)))
        found += [(optics, group) for group in groups]
    return found


def _room_beyond(
    building: Building,
    room: Space,
    pairs: Sequence[tuple[Face, Face]],
    systems: Mapping[str, States],
    onward: InnerGlass | None,
) -> tuple[DaylightScene, tuple[NDArray[np.float64], ...]]:
    """The room beyond seen from the panes of another one, and T of all glass that lights it."""
    open_ = {back.name for _, back in pairs} | (set() if onward is None else onward.faces)
    kept = [face for face in room.faces if face.name not in open_]
    glass = [
        _piece(face, PANE, face.triangles,
               back.reflectance_visible if back.pane.is_open else GLASS_REFLECTANCE)
        for face, back in pairs
    ]  # fmt: skip
    reveals = [
        _piece(
            face,
            "reveal",
            reveals_between(face, wall_depth(face, back)).reshape(-1, 3, 3),
            ROOM_REFLECTANCE["reveal"],
        )
        for face, back in pairs
        if wall_depth(face, back) > THINNEST
    ]
    windows = room_windows(room, systems)
    scene = DaylightScene(
        element_surfaces([*kept, *room.furniture, *glass, *reveals]),
        exterior_surfaces(building, room),
        (*windows.groups, *(() if onward is None else onward.groups)),
        adjacent=() if onward is None else onward.beyond,
    )
    optics = [*windows.optics(), *(() if onward is None else onward.optics)]
    return scene, tuple(states[0].transmission for states in optics)


def _piece(face: Face, name: str, triangles: NDArray[np.float64], reflectance: float) -> Element:
    """Something of the pane of a face that the room beyond has."""
    return Element(face.pane.guid, name, "IfcWindow", triangles, reflectance, reflectance)
