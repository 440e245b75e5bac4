"""Closed solids from triangle soup: welding, orienting, capping; prisms; the union of solids."""

from __future__ import annotations

from dataclasses import dataclass

import manifold3d
import numpy as np
import shapely
from numpy.typing import NDArray

from bim.mesh_repair import capped, closed_faces, welded_mesh, wound_alike
from bim.planes import Plane, polygons_of, rings_of, triangulated

WELD_STEPS = (1e-6, 1e-4, 1e-3)  # vertices this near are one, tried in turn [m]
SMALLEST_VOLUME = 1e-9  # below a cubic millimetre nothing is a solid [m3]


@dataclass(frozen=True, slots=True)
class Solid:
    """A closed oriented solid, and what had to be done to get it ("" if nothing)."""

    manifold: manifold3d.Manifold
    repair: str = ""

    @property
    def volume(self) -> float:
        """Volume [m3]."""
        return self.manifold.volume()


def solid_of(triangles: NDArray[np.float64]) -> Solid | None:
    """The solid that triangles [N, 3, 3] bound, repaired where that is safe; None if they do not.

    Repairs tried in turn: weld vertices, turn faces to one side, cap holes.
    """
    if len(triangles) < 4:
        return None
    for repair in ("", "welded", "faces-turned", "holes-capped"):
        for distance in WELD_STEPS if repair else WELD_STEPS[:1]:
            vertices, faces = welded_mesh(triangles, distance)
            if len(faces) < 4:
                continue
            if repair in ("faces-turned", "holes-capped"):
                faces = wound_alike(vertices, faces)
            if repair == "holes-capped":
                faces = wound_alike(vertices, capped(vertices, faces))
            manifold = _manifold(vertices, faces)
            if manifold is None:
                continue
            if manifold.volume() < 0:
                manifold = _manifold(vertices, faces[:, ::-1])
                repair = repair or "turned-inside-out"
            if manifold is not None and manifold.volume() > SMALLEST_VOLUME:
                return Solid(manifold, repair)
    return None


@dataclass(frozen=True, slots=True)
class PackedSolid:
    """A solid as arrays that another process can unpack, vertex for vertex."""

    vertices: NDArray[np.float64]  # [V, 3] [m]
    faces: NDArray[np.uint64]  # [T, 3]


def packed(manifold: manifold3d.Manifold) -> PackedSolid:
    """The solid as arrays."""
    mesh = manifold.to_mesh64()
    return PackedSolid(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


def unpacked(solid: PackedSolid) -> manifold3d.Manifold:
    """The solid of these arrays."""
    mesh = manifold3d.Mesh64(np.array(solid.vertices), np.array(solid.faces, dtype=np.uint64))
    return manifold3d.Manifold(mesh).as_original()


def _manifold(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> manifold3d.Manifold | None:
    sound = closed_faces(vertices, faces)
    if sound is None:
        return None
    faces = sound
    mesh = manifold3d.Mesh64(
        np.ascontiguousarray(vertices, dtype=np.float64), np.ascontiguousarray(faces, dtype=np.uint64)
    )
    manifold = manifold3d.Manifold(mesh)
    good = manifold.status() == manifold3d.Error.NoError and not manifold.is_empty()
    return manifold.as_original() if good else None


def prism(polygon: shapely.Geometry, plane: Plane, bottom: float, top: float) -> manifold3d.Manifold | None:
    """Right prism over a (multi)polygon of the plane, between two heights above the plane [m]."""
    parts = []
    for part in polygons_of(polygon):
        flat = triangulated(part)
        low, high = (np.concatenate([flat, np.full((*flat.shape[:2], 1), h)], axis=2) for h in (bottom, top))
        sides = []
        for ring in rings_of(part):
            a, b = ring, np.roll(ring, -1, axis=0)
            a0, b0, a1, b1 = (np.column_stack([p, np.full(len(p), h)]) for h in (bottom, top) for p in (a, b))
            sides += [np.stack([a0, b0, b1], axis=1), np.stack([a0, b1, a1], axis=1)]
        local = np.concatenate([high, low[:, ::-1], *sides])
        solid = solid_of(plane.to_world(local.reshape(-1, 3)).reshape(-1, 3, 3))
        if solid is not None:
            parts.append(solid.manifold)
    if not parts:
        return None
    return parts[0] if len(parts) == 1 else union(parts).as_original()


def union(solids: list[manifold3d.Manifold]) -> manifold3d.Manifold:
    """Union of solids; the triangles of the result remember which solid they come from."""
    return manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)


def triangles_of(manifold: manifold3d.Manifold) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Triangles [N, 3, 3] and the id of the original solid [N] that each comes from."""
    mesh = manifold.to_mesh64()
    vertices = np.asarray(mesh.vert_properties)[:, :3]
    faces = np.asarray(mesh.tri_verts).astype(np.int64)
    runs = np.asarray(mesh.run_index).astype(np.int64) // 3
    ids = np.repeat(np.asarray(mesh.run_original_id).astype(np.int64), np.diff(runs))
    return vertices[faces], ids
