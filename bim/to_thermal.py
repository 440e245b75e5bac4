"""A room as a thermal zone: its faces gathered to surfaces, its windows with their fenestration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.model import Construction, Face, Space, centroid
from bim.names import numbered
from thermal.blackbox import Fenestration
from thermal.emitters import IdealLoads
from thermal.zone import Gains, Layer, OpaqueSurface, WindowElement, Zone

# what lies beyond a face, in the words of `thermal`: a neighbour is taken to be as warm as the room
OUTSIDE = {"outside": "outdoor", "ground": "ground", "space": "twin", "adiabatic": "twin", "unknown": "adiabatic"}
THINNEST = 5e-4  # [m] thinner layers (paint, foils) take no part in the heat balance
SAME_AREA = 0.02  # the two faces of a partition differ by this share at most
OPPOSITE = -0.98  # cosine between their normals


@dataclass(frozen=True, slots=True)
class ThermalRoom:
    """A zone and where its parts come from."""

    zone: Zone
    surface_of_face: NDArray[np.int64]  # [faces of the space] surface F of the zone
    outdoor: NDArray[np.int64]  # [N] surfaces that face outdoors
    neighbours: tuple[str | None, ...] = ()  # [F] GUID of the room behind each surface


def thermal_room(
    space: Space,
    fenestration: Fenestration | None,
    *,
    infiltration_ach: float = 0.5,
    gains: Gains | None = None,
    loads: IdealLoads | None = None,
    ground_level: float = 0.0,
) -> ThermalRoom:
    """The zone of a room; faces alike in direction, neighbour and construction become one surface.

    Windows keep their order.  Frames are surfaces like others.

    Args: fenestration: of every window; None for a room without any.
    """
    groups = _faces_of_surfaces(space)
    surface_of_face = np.empty(len(space.faces), dtype=np.int64)
    surfaces = []
    for number, members in enumerate(groups):
        faces = [space.faces[i] for i in members]
        surface_of_face[members] = number
        surfaces.append(_surface(f"{faces[0].kind} {number + 1}", faces, ground_level))
    outdoor = [i for i, surface in enumerate(surfaces) if surface.outside == "outdoor"]
    zone = Zone(
        space.label,
        space.volume,
        tuple(surfaces),
        tuple(_windows(space, fenestration, ground_level)),
        infiltration_ach=infiltration_ach,
        gains=gains or Gains(),
        loads=loads or IdealLoads(),
    )
    return ThermalRoom(zone, surface_of_face, np.array(outdoor, dtype=np.int64), surface_neighbours(space))


def surface_neighbours(space: Space) -> tuple[str | None, ...]:
    """GUID of the room behind each surface [F] of a room's zone; None where there is none."""
    return tuple(space.faces[members[0]].neighbour for members in _faces_of_surfaces(space))


def same_surfaces(a: Space, b: Space) -> bool:
    """Whether the faces of two equal rooms make the same surfaces of a zone in the same order.

    What lies beyond may be another room, of the same kind.
    """
    if len(a.faces) != len(b.faces) or _faces_of_surfaces(a) != _faces_of_surfaces(b):
        return False
    return all(
        (one.kind, one.adjacency, one.construction, one.neighbour is None)
        == (other.kind, other.adjacency, other.construction, other.neighbour is None)
        and one.normal @ other.normal > -OPPOSITE
        and abs(one.area - other.area) <= SAME_AREA * one.area
        for one, other in zip(a.faces, b.faces, strict=True)
    )


def coupled_rooms(spaces: Sequence[Space], rooms: Sequence[ThermalRoom]) -> tuple[list[ThermalRoom], tuple[str, ...]]:
    """The rooms with their shared walls as partitions that heat flows through.

    A surface is joined to the one that lies opposite in the room behind it, of the same area
    within 2 % (both then have the mean); the layers are those of the earlier room's side.  What
    finds no partner, or borders on a room that is not among these, keeps its twin behind it.

    Returns: the rooms, their zones under names that differ, and a sentence for every surface
        whose other face was not found.
    """
    names = numbered([room.zone.name for room in rooms])
    index = {space.guid: number for number, space in enumerate(spaces)}
    surfaces = [list(room.zone.surfaces) for room in rooms]
    notes = []
    for a, room in enumerate(rooms):
        for i, guid in enumerate(room.neighbours):
            b = index.get(guid, -1) if guid else -1
            one = surfaces[a][i]
            if b < 0 or one.partner or one.outside == "known":
                continue
            j = _other_side(one, spaces[a].guid, surfaces[b], rooms[b].neighbours)
            if j < 0:
                notes.append(
                    f"{names[a]}: {one.name} ({one.area:.1f} m2) has no other face in {names[b]}: "
                    "the same room is taken to lie behind it."
                )
                continue
            other = surfaces[b][j]
            area = 0.5 * (one.area + other.area)
            surfaces[a][i] = replace(one, area=area, outside=names[b], partner=other.name)
            surfaces[b][j] = replace(other, area=area, outside=names[a], partner=one.name)
    coupled = [
        replace(room, zone=replace(room.zone, name=name, surfaces=tuple(own)))
        for room, name, own in zip(rooms, names, surfaces, strict=True)
    ]
    return coupled, tuple(notes)


def shared_constructions(spaces: Sequence[Space]) -> list[Space]:
    """The rooms with one construction for both faces of every wall that two of them share.

    Each room's faces were looked through on their own, and the layers found may differ: the second
    of two faces that lie opposite, alike in area, takes the first one's layers turned round.
    """
    index = {space.guid: number for number, space in enumerate(spaces)}
    faces = [list(space.faces) for space in spaces]
    taken: set[tuple[int, int]] = set()
    for a, own in enumerate(faces):
        for i, face in enumerate(own):
            b = index.get(face.neighbour, -1) if face.neighbour else -1
            if b < 0 or (a, i) in taken:
                continue
            gaps = {
                j: float(np.linalg.norm(centroid(other.triangles) - centroid(face.triangles)))
                for j, other in enumerate(faces[b])
                if other.neighbour == spaces[a].guid
                and (b, j) not in taken
                and face.normal @ other.normal < OPPOSITE
                and abs(other.area - face.area) <= SAME_AREA * face.area
            }
            if gaps:
                j = min(gaps, key=gaps.__getitem__)
                taken |= {(a, i), (b, j)}
                turned = replace(face.construction, layers=face.construction.layers[::-1])
                faces[b][j] = replace(faces[b][j], construction=turned)
    return [replace(space, faces=tuple(f)) for space, f in zip(spaces, faces, strict=True)]


def door_links(spaces: Sequence[Space], flow: float) -> NDArray[np.float64]:
    """Air exchanged between rooms [Z, Z] [m3/s] through the open doors that join them.

    flow: each way through one door [m3/s]; 0.65/3 w h sqrt(g h dT/T) by buoyancy, 0.1 for 1 K.
    """
    index = {space.guid: number for number, space in enumerate(spaces)}
    doors = np.zeros((len(spaces), len(spaces)))
    for a, space in enumerate(spaces):
        joined = {
            (face.neighbour, face.element) for face in space.faces if face.kind == "door" and face.neighbour in index
        }
        for neighbour, _ in joined:
            doors[a, index[neighbour]] += 1.0
    return flow * np.maximum(doors, doors.T)


def _faces_of_surfaces(space: Space) -> list[list[int]]:
    """The faces of a room that are one surface of its zone."""
    groups: dict[tuple[Any, ...], list[int]] = {}
    for i, face in enumerate(space.faces):
        key = (face.kind, face.adjacency, face.neighbour, face.construction)
        key += tuple(np.round(face.normal, 2))
        groups.setdefault(key, []).append(i)
    return list(groups.values())


def _other_side(
    one: OpaqueSurface, room: str, others: Sequence[OpaqueSurface], neighbours: Sequence[str | None]
) -> int:
    """The surface of the room behind that is the other face, nearest in area; -1 for none."""
    best, gap = -1, SAME_AREA * one.area
    for j, (other, guid) in enumerate(zip(others, neighbours, strict=True)):
        free = not other.partner and other.outside != "known"
        fits = guid == room and free and one.normal @ other.normal < OPPOSITE
        if fits and abs(other.area - one.area) <= gap:
            best, gap = j, abs(other.area - one.area)
    return best


def layers_of(construction: Construction) -> tuple[Layer, ...]:
    """The layers that count for heat, outermost first; the thickest where none does."""
    thick = [layer for layer in construction.layers if layer.thickness >= THINNEST]
    thick = thick or [max(construction.layers, key=lambda layer: layer.thickness)]
    return tuple(Layer(layer.thickness, layer.conductivity, layer.density, layer.heat_capacity) for layer in thick)


def _surface(name: str, faces: list[Face], ground_level: float) -> OpaqueSurface:
    area = sum(face.area for face in faces)

    def mean(values: list[float]) -> float:
        return float(np.average(values, weights=[face.area for face in faces]))

    height = mean([centroid(face.triangles)[2] for face in faces]) - ground_level
    return OpaqueSurface(
        name,
        area,
        layers_of(faces[0].construction),
        faces[0].normal,
        OUTSIDE[faces[0].adjacency],
        emissivity_in=mean([face.emissivity for face in faces]),
        absorptance_in=1.0 - mean([face.total_reflectance("solar") for face in faces]),
        height=max(height, 0.5),
    )


def _windows(space: Space, fenestration: Fenestration | None, ground_level: float) -> list[WindowElement]:
    labels = numbered([window.name or window.guid for window in space.windows])
    windows = []
    for window, label in zip(space.windows, labels, strict=True):
        corners = window.triangles.reshape(-1, 3)
        slope = np.sqrt(max(1.0 - window.normal[2] ** 2, 1e-6))
        rise = float(np.ptp(corners[:, 2])) / slope
        windows.append(
            WindowElement(
                label,
                window.area,
                window.normal,
                (fenestration,),
                glazing_height=rise if rise > 0.1 else float(np.sqrt(window.area)),
                height=max(window.centre[2] - ground_level, 0.5),
            )
        )
    return windows
