"""Meshes and their acceleration structures, which scenes with the same triangles can share."""

from __future__ import annotations

import atexit

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.surfaces import triangle_areas
from mitsuba_cfs.trace.kernels.sampling import opaque, opaque_vector

KEPT = 4  # meshes that are found again: what stands before a room, by season, and its neighbours'
FROM = 2048  # triangles; fewer are built anew in less time than a second structure takes to trace
FARTHEST = 256.0  # from the common origin, where float32 has steps of 3e-5 m [m]


class KeptMesh:
    """Opaque triangles about their own middle: slivers left out, normals, the structure of all."""

    def __init__(self, triangles: NDArray[np.float64]) -> None:
        """Of triangles [N, 3, 3] [m]; nothing is built before it is asked for."""
        self.triangles = triangles
        self.keep = triangle_areas(triangles) > 1e-10  # [N] [m2] slivers have no normal
        solid = triangles[self.keep]
        self.normals = unit_normals(solid)
        corners = solid.reshape(-1, 3) if len(solid) else np.zeros((1, 3))
        self.bounds = np.stack([corners.min(axis=0), corners.max(axis=0)])
        self._scene: mi.Scene | None = None

    @property
    def is_shared(self) -> bool:
        """Whether scenes share its structure: big enough, and near enough to its middle."""
        big = np.count_nonzero(self.keep) >= FROM
        return bool(big and np.ptp(self.bounds, axis=0).max() < 2 * FARTHEST)

    @property
    def middle(self) -> NDArray[np.float64]:
        """The origin [3] of the structure's coordinates, the same whichever scene asks first."""
        return self.bounds.mean(axis=0)

    @property
    def scene(self) -> mi.Scene:
        """The structure, built once."""
        if self._scene is None:
            self._scene = scene_of(self.triangles[self.keep] - self.middle)
        return self._scene

    def radius(self, centre: NDArray[np.float64]) -> float:
        """The greatest coordinate of the triangles about a centre [m]."""
        return float(np.abs(self.bounds - centre).max())


class SharedScene:
    """Rays in a scene's coordinates before a mesh in its own, and before the scene's panes."""

    def __init__(
        self, mesh: KeptMesh, panes: NDArray[np.float64], centre: NDArray[np.float64]
    ) -> None:
        """Of panes [N, 3, 3] in coordinates about the centre; they are numbered after the mesh."""
        self._solid = mesh.scene
        self._shift = opaque_vector(centre - mesh.middle)
        self._panes = scene_of(panes) if len(panes) else None
        self._first = opaque(int(np.count_nonzero(mesh.keep)), mi.UInt32)

    def ray_intersect_preliminary(
        self, ray: mi.Ray3f, coherent: bool = False, active: mi.Bool = True
    ) -> mi.PreliminaryIntersection3f:
        """The first hit of rays, as of a `mi.Scene` of one mesh."""
        hit = self._solid.ray_intersect_preliminary(self._moved(ray), coherent, active)
        if self._panes is None:
            return hit
        before = mi.Ray3f(ray)
        before.maxt = dr.minimum(ray.maxt, hit.t)
        pane = self._panes.ray_intersect_preliminary(before, coherent, active)
        nearer = pane.is_valid()
        pane.prim_index += self._first
        return dr.select(nearer, pane, hit)

    def ray_test(self, ray: mi.Ray3f, coherent: bool = False, active: mi.Bool = True) -> mi.Bool:
        """Whether anything stands before rays."""
        blocked = self._solid.ray_test(self._moved(ray), coherent, active)
        if self._panes is None:
            return blocked
        return blocked | self._panes.ray_test(ray, coherent, active & ~blocked)

    def _moved(self, ray: mi.Ray3f) -> mi.Ray3f:
        moved = mi.Ray3f(ray)
        moved.o = mi.Point3f(ray.o + self._shift)
        return moved


def kept_mesh(triangles: NDArray[np.float64]) -> KeptMesh:
    """The mesh of triangles [N, 3, 3]; that of equal ones is found again among the last."""
    variant = variants.activate()
    for place, (of, mesh) in enumerate(_last):
        if of == variant and np.array_equal(mesh.triangles, triangles):
            _last.append(_last.pop(place))
            return mesh
    mesh = KeptMesh(triangles)
    if mesh.is_shared:
        _last.append((variant, mesh))
        del _last[:-KEPT]
    return mesh


_last: list[tuple[str, KeptMesh]] = []  # the last used at the end; empty before Dr.Jit ends
atexit.register(_last.clear)


def unit_normals(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit normals [N, 3] of triangles [N, 3, 3], right-handed about their corners."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def scene_of(triangles: NDArray[np.float64]) -> mi.Scene:
    """A Mitsuba scene of one mesh of triangles [N, 3, 3] without shared vertices."""
    n = len(triangles)
    mesh = mi.Mesh("surfaces", vertex_count=3 * n, face_count=n)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = mi.Float(triangles.reshape(-1).astype(np.float32))
    parameters["faces"] = mi.UInt32(np.arange(3 * n, dtype=np.uint32))
    parameters.update()
    return mi.load_dict({"type": "scene", "mesh": mesh})
