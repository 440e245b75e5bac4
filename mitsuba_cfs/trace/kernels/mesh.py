"""Meshes and their acceleration structures, which scenes with the same triangles can share."""

from __future__ import annotations

from copy import copy

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.surfaces import triangle_areas
from mitsuba_cfs.trace.kernels.sampling import column, opaque, opaque_vector

FROM = 2048  # triangles; a smaller mesh takes less time to build than a second structure to trace
NOT_HERE = 0xFFFFFFFF  # a room that no ray is of
CLEAR = 2e-5  # beyond a triangle that a ray passes [m]
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


class OwnedMesh(SolidMesh):
    """Surroundings of several rooms: a room's rays pass the triangles of its windows.

    The windows of a room are elements in front of all other rooms.
    """

    def __init__(self, triangles: NDArray[np.float64], owner: NDArray[np.int64]) -> None:
        """From triangles [N, 3, 3] [m], and the room [N] of each; -1: of none, these come first."""
        super().__init__(triangles)
        self.owner = owner[self.keep]
        if (self.owner[1:] < 0)[self.owner[:-1] >= 0].any():
            raise ValueError("owner: expected triangles of no room first")
        self._of_rooms = triangles[owner >= 0].reshape(-1, 3)
        common = int(np.count_nonzero(self.owner < 0))
        solid = triangles[self.keep] - self.middle
        self.common = scene_of(solid[:common]) if common else None
        self.owned = scene_of(solid[common:]) if common < len(solid) else None

    @property
    def middle(self) -> NDArray[np.float64]:
        """The middle of the rooms' windows, however far the surroundings reach [3]."""
        if not len(self._of_rooms):
            return super().middle
        return (self._of_rooms.min(axis=0) + self._of_rooms.max(axis=0)) / 2

    @property
    def clear(self) -> float:
        """How far beyond a window a ray that passes it continues: more than rounding there [m]."""
        far = float(np.abs(self._of_rooms - self.middle).max(initial=0.0))
        return CLEAR * max(1.0, 0.05 * far)


class OwnedScene:
    """An `OwnedMesh` and the panes of its rooms, for rays of which each is of one room."""

    def __init__(
        self,
        mesh: OwnedMesh,
        panes: NDArray[np.float64],
        centre: NDArray[np.float64],
        *,
        room: NDArray[np.int64],
        numbers: NDArray[np.int64],
    ) -> None:
        """Of panes [N, 3, 3] in coordinates about the centre, as rays and hits are.

        Args:
            room: of each pane [N].
            numbers: of the rooms among the owners of the mesh [R].
        """
        self._common, self._owned = mesh.common, mesh.owned
        self._shift = opaque_vector(centre - mesh.middle)
        self._panes = scene_of(panes + (centre - mesh.middle)) if len(panes) else None
        owner = mesh.owner[mesh.owner >= 0]
        room_of_owner = np.full(max(numbers.max(), owner.max(initial=0)) + 1, NOT_HERE)
        room_of_owner[numbers] = np.arange(len(numbers))
        self._clear = opaque(mesh.clear)
        self._first = opaque(len(mesh.owner) - len(owner), mi.UInt32)
        self._first_pane = opaque(len(mesh.owner), mi.UInt32)
        self._owner = column(np.append(room_of_owner[owner], NOT_HERE), mi.UInt32)
        self._room_of_pane = column(np.append(room, 0), mi.UInt32)
        self._room = opaque(0, mi.UInt32)

    def of_lanes(self, room: mi.UInt32) -> OwnedScene:
        """The same scene for rays of the rooms of the lanes."""
        scene = copy(self)
        scene._room = room
        return scene

    def ray_intersect_preliminary(
        self, ray: mi.Ray3f, coherent: bool = False, active: mi.Bool = True
    ) -> mi.PreliminaryIntersection3f:
        """The first hit of rays, as of a `mi.Scene` of one mesh."""
        hit, before = dr.zeros(mi.PreliminaryIntersection3f), mi.Ray3f(ray)
        before.o = mi.Point3f(ray.o + self._shift)
        hit.t = dr.inf
        if self._common is not None:
            hit = self._common.ray_intersect_preliminary(before, coherent, active)
            before.maxt = dr.minimum(before.maxt, hit.t)
        parts = []
        if self._owned is not None:
            parts.append((self._owned, self._owner, self._first, True))
        if self._panes is not None:
            parts.append((self._panes, self._room_of_pane, self._first_pane, False))
        for scene, owner, first, passes in parts:
            nearer = self._first_not_passed(scene, owner, before, active, passes)
            valid = nearer.is_valid()
            nearer.prim_index += first
            hit = dr.select(valid, nearer, hit)
            before.maxt = dr.minimum(before.maxt, hit.t)
        return hit

    def ray_test(self, ray: mi.Ray3f, coherent: bool = False, active: mi.Bool = True) -> mi.Bool:
        """Whether rays meet anything."""
        return self.ray_intersect_preliminary(ray, coherent, active).is_valid()

    @dr.syntax
    def _first_not_passed(
        self, scene: mi.Scene, owner: mi.UInt32, ray: mi.Ray3f, active: mi.Bool, passes: bool
    ) -> mi.PreliminaryIntersection3f:
        """First hits of a mesh but for triangles of the ray's room, or but for those of others.

        Args: passes: whether rays pass those of their room.
        """
        way, gone = mi.Ray3f(ray), mi.Float(0)
        hit = scene.ray_intersect_preliminary(way, coherent=False, active=active)
        passed = self._passes(owner, hit, active, passes)
        while passed:
            step = hit.t * (1 + 1e-6) + self._clear
            gone += step
            way.o = mi.Point3f(way.o + way.d * step)
            way.maxt -= step
            hit = scene.ray_intersect_preliminary(way, coherent=False, active=passed)
            passed = self._passes(owner, hit, passed, passes)
        hit.t += gone
        return hit

    def _passes(
        self, owner: mi.UInt32, hit: mi.PreliminaryIntersection3f, active: mi.Bool, passes: bool
    ) -> mi.Bool:
        """Whether active rays pass the triangles that they hit."""
        active = active & hit.is_valid()
        same = dr.gather(mi.UInt32, owner, hit.prim_index, active) == self._room
        return active & (same if passes else ~same)


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
