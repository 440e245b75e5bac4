"""A room as a thermal zone: its faces gathered to surfaces, its windows with their fenestration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bim.model import Construction, Face, Space, centroid
from thermal.blackbox import Fenestration
from thermal.zone import Gains, IdealLoads, Layer, OpaqueSurface, WindowElement, Zone

# what lies beyond a face, in the words of `thermal`: a neighbour is taken to be as warm as the room
OUTSIDE = {
    "outside": "outdoor",
    "ground": "ground",
    "space": "twin",
    "adiabatic": "twin",
    "unknown": "adiabatic",
}
THINNEST = 5e-4  # [m] thinner layers (paint, foils) take no part in the heat balance
OFF_THE_WALL = 0.02  # [m] sensors stand this far before the outer face of a wall


@dataclass(frozen=True, slots=True)
class ThermalRoom:
    """A zone and where its parts come from."""

    zone: Zone
    surface_of_face: NDArray[np.int64]  # [faces of the space] surface F of the zone
    outdoor: NDArray[np.int64]  # [N] surfaces that face outdoors
    outdoor_points: NDArray[np.float64]  # [N, 3] before their outer faces [m]
    outdoor_normals: NDArray[np.float64]  # [N, 3]


def thermal_room(
    space: Space,
    fenestration: Fenestration,
    *,
    infiltration_ach: float = 0.5,
    gains: Gains | None = None,
    loads: IdealLoads | None = None,
    ground_level: float = 0.0,
) -> ThermalRoom:
    """The zone of a room; faces alike in direction, neighbour and construction become one surface.

    Windows keep their order.  Frames are surfaces like others.
    """
    groups: dict[tuple, list[int]] = {}
    for i, face in enumerate(space.faces):
        key = (face.kind, face.adjacency, face.construction, *np.round(face.normal, 2))
        groups.setdefault(key, []).append(i)
    surface_of_face = np.empty(len(space.faces), dtype=np.int64)
    surfaces, points = [], []
    for number, members in enumerate(groups.values()):
        faces = [space.faces[i] for i in members]
        surface_of_face[members] = number
        surfaces.append(_surface(f"{faces[0].kind} {number + 1}", faces, ground_level))
        points.append(_outdoor_point(max(faces, key=lambda face: face.area)))
    outdoor = [i for i, surface in enumerate(surfaces) if surface.outside == "outdoor"]
    zone = Zone(
        space.name or space.guid,
        space.volume,
        tuple(surfaces),
        tuple(_windows(space, fenestration, ground_level)),
        infiltration_ach=infiltration_ach,
        gains=gains or Gains(),
        loads=loads or IdealLoads(),
    )
    return ThermalRoom(
        zone,
        surface_of_face,
        np.array(outdoor, dtype=np.int64),
        np.array([points[i] for i in outdoor]).reshape(-1, 3),
        np.array([surfaces[i].normal for i in outdoor]).reshape(-1, 3),
    )


def layers_of(construction: Construction) -> tuple[Layer, ...]:
    """The layers that count for heat, outermost first."""
    return tuple(
        Layer(layer.thickness, layer.conductivity, layer.density, layer.heat_capacity)
        for layer in construction.layers
        if layer.thickness >= THINNEST
    )


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
        absorptance_in=1.0 - mean([face.reflectance_solar for face in faces]),
        height=max(height, 0.5),
    )


def _outdoor_point(face: Face) -> NDArray[np.float64]:
    """A point before the middle of the face's biggest triangle, outside the wall."""
    edges = np.cross(
        face.triangles[:, 1] - face.triangles[:, 0], face.triangles[:, 2] - face.triangles[:, 0]
    )
    middle = face.triangles[np.argmax(np.linalg.norm(edges, axis=1))].mean(axis=0)
    return middle + face.normal * (face.construction.thickness + OFF_THE_WALL)


def _windows(space: Space, fenestration: Fenestration, ground_level: float) -> list[WindowElement]:
    names: dict[str, int] = {}
    windows = []
    for window in space.windows:
        label = window.name or window.guid
        names[label] = names.get(label, 0) + 1
        label = label if names[label] == 1 else f"{label} ({names[label]})"
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
