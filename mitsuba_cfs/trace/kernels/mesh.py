"""Meshes and their acceleration structures, which scenes with the same triangles can share."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.surfaces import triangle_areas
from mitsuba_cfs.trace.kernels.sampling import opaque, opaque_vector

FROM = 2048  # triangles; a smaller mesh takes less time to build than a second structure to trace
FARTHEST = 256.0  # from the common origin, where float32 has steps of 3e-5 m [m]


class SolidMesh:
    """Opaque triangles without slivers, their normals, and their acceleration structure."""

    def __init__(self, triangles: NDArray[np.float64]) -> None:
        """From triangles [N, 3, 3] [m]; the structure is built at its first use."""
        self.triangles = triangles
        self.keep = triangle_areas(triangles) > 1e-10  # [N] [m2] slivers have no normal
        solid = triangles[self.keep]
        self.normals = unit_normals(solid)
        corners = solid.reshape(-1, 3) if len(solid) else np.zeros((1, 3))
        self.bounds = np.stack([corners.min(axis=0), corners.max(axis=0)])
        self._scene: mi.Scene | None = None

    @property
    def is_shared(self) -> bool:
        """Whether scenes share its structure: large enough, and close enough to its centre."""
        big = np.count_nonzero(self.keep) >= FROM
        return bool(big and np.ptp(self.bounds, axis=0).max() < 2 * FARTHEST)

    @property
    def middle(self) -> NDArray[np.float64]:
        """Origin [3] of the structure's coordinates, the same for all scenes."""
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
    """A shared mesh in its own coordinates and the panes of one scene, for rays of the scene."""

    def __init__(
        self, mesh: SolidMesh, panes: NDArray[np.float64], centre: NDArray[np.float64]
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
        """Whether rays meet anything."""
        blocked = self._solid.ray_test(self._moved(ray), coherent, active)
        if self._panes is None:
            return blocked
        return blocked | self._panes.ray_test(ray, coherent, active & ~blocked)

    def _moved(self, ray: mi.Ray3f) -> mi.Ray3f:
        moved = mi.Ray3f(ray)
        moved.o = mi.Point3f(ray.o + self._shift)
        return moved


def unit_normals(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit normals [N, 3] of triangles [N, 3, 3], right-handed about their corners."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def scene_of(triangles: NDArray[np.float64]) -> mi.Scene:
    """A Mitsuba scene of one mesh of triangles [N, 3, 3] without shared vertices."""
    return variants.load_scene(variants.triangle_mesh(triangles))
