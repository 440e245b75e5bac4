"""Surfaces and windows as one Mitsuba mesh, with tables that kernels gather from.

Scenes with the same triangles share a mesh and its acceleration structure.
"""

from __future__ import annotations

import weakref
from collections import OrderedDict
from collections.abc import Callable, Sequence
from copy import copy
from functools import cached_property
from typing import Any, TypeVar

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.surfaces import SharedOutdoors, Surfaces, WindowGroup, area_vectors, triangle_areas
from mitsuba_cfs.trace.kernels.gloss import TracedGloss, TracedPanes
from mitsuba_cfs.trace.kernels.random_walk import diffuse_direction
from mitsuba_cfs.trace.kernels.rooms import TracedRoom, apart, joined_surfaces
from mitsuba_cfs.trace.kernels.sampling import DiscreteDistribution, column, lattice_2d, opaque, opaque_vector, vectors

FROM = 2048  # triangles; a smaller mesh takes less time to build than a second structure to trace
NOT_HERE = 0xFFFFFFFF  # a room that no ray is of
CLEAR = 2e-5  # beyond a triangle that a ray passes [m]
FARTHEST = 256.0  # from the common origin, where float32 has steps of 3e-5 m [m]


class SolidMesh:
    """Opaque triangles without slivers, their normals, and their acceleration structure."""

    def __init__(self, triangles: NDArray[np.float64]) -> None:
        """From triangles [N, 3, 3] [m]; the structure is built at its first use."""
        self.triangles = triangles
        across = area_vectors(triangles)
        area = np.linalg.norm(across, axis=1)
        self.keep = area > 1e-10  # [N] [m2] slivers have no normal
        solid = triangles[self.keep]
        self.normals = across[self.keep] / area[self.keep, None]
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

    def _passes(self, owner: mi.UInt32, hit: mi.PreliminaryIntersection3f, active: mi.Bool, passes: bool) -> mi.Bool:
        """Whether active rays pass the triangles that they hit."""
        active = active & hit.is_valid()
        same = dr.gather(mi.UInt32, owner, hit.prim_index, active) == self._room
        return active & (same if passes else ~same)


class SharedScene:
    """A shared mesh in its own coordinates and the panes of one scene, for rays of the scene."""

    def __init__(self, mesh: SolidMesh, panes: NDArray[np.float64], centre: NDArray[np.float64]) -> None:
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
    normals = area_vectors(triangles)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def scene_of(triangles: NDArray[np.float64]) -> mi.Scene:
    """A Mitsuba scene of one mesh of triangles [N, 3, 3] without shared vertices."""
    return variants.load_scene(variants.triangle_mesh(triangles))


T = TypeVar("T")
SCENES = 8  # kept: what one room is traced by, indoors and outdoors
MESHES = 4  # kept: surroundings of a room, by season, and of its neighbours
OPAQUE = -1  # window index of a triangle that is not glazed
SERIES_GAP = 1.0  # widest between a screen and its panes [m]
SERIES_PLACES = 256  # test points on each window group


class TracedScene:
    """A Mitsuba scene of opaque triangles and window apertures, in coordinates about its centre.

    View paths end at windows, which are black to them.  One mesh holds all triangles: the triangle
    number of a hit selects the normal, the reflectance and the window group.

    No number of a scene is a literal in a kernel (`opaque`), or each room would compile all kernels
    again.
    """

    def __init__(
        self,
        surfaces: Surfaces,
        groups: Sequence[WindowGroup] = (),
        *,
        windows_block: bool = True,
        window_reflectance: ArrayLike | None = None,
        centre: ArrayLike | None = None,
        mesh: SolidMesh | None = None,
        rooms: Sequence[int] = (),
        numbers: Sequence[int] = (),
        reach: float = np.inf,
    ) -> None:
        """Build the scene.

        Args:
            rooms: how many of the groups are those of each room, where there are several.
            numbers: of these rooms as owners of triangles of an `OwnedMesh`.
            reach: of rays; what is further away belongs to another room [m].
            windows_block: if false, a ray passes through the windows.
            window_reflectance: [G] diffuse, of the windows from the room; 0 by default.
            centre: [3] origin of the scene's coordinates; the middle of the windows by default.
            mesh: of the surfaces' triangles, which other scenes share.
        """
        variants.activate()
        windows = [(g, window) for g, group in enumerate(groups) for window in group.windows]
        if not windows and centre is None:
            raise ValueError("a scene needs a window group or a centre")
        glazed = np.concatenate([np.empty((0, 3, 3)), *(w.triangles for _, w in windows)])
        glazed_group = np.concatenate([np.full(len(w.triangles), g) for g, w in windows] or [[]])

        self.surfaces, self.groups = surfaces, tuple(groups)
        rooms = tuple(rooms) or (len(groups),)
        self._room_of_group = np.repeat(np.arange(len(rooms)), rooms)
        self._numbers = np.asarray(numbers, dtype=np.int64)
        self._reach = opaque(reach)
        self._derived: dict[Callable[[TracedScene], Any], Any] = {}
        self._panes = windows_block and bool(windows)
        self.centre = _middle(groups) if centre is None else np.asarray(centre, float)
        self.surface_count = int(surfaces.surface.max()) + 1 if len(surfaces.surface) else 0
        if window_reflectance is None:
            window_reflectance = np.zeros(len(groups))
        glazed_reflectance = np.asarray(window_reflectance, float)[glazed_group.astype(int)]
        blocking = slice(None) if windows_block else slice(0)
        mesh = SolidMesh(surfaces.triangles) if mesh is None else mesh
        self._load_mesh(surfaces, mesh, glazed[blocking], glazed_group[blocking], glazed_reflectance[blocking])
        if windows:
            self._load_windows(glazed, glazed_group)

    def _load_mesh(
        self,
        surfaces: Surfaces,
        mesh: SolidMesh,
        glazed: NDArray[np.float64],
        glazed_group: NDArray[np.int64],
        glazed_reflectance: NDArray[np.float64],
    ) -> None:
        """The mesh, and its tables by triangle: normal, reflectance, surface, window group."""
        solid = surfaces if mesh.keep.all() else surfaces.some(mesh.keep)
        if not len(solid.triangles) + len(glazed):
            solid = _speck(self.centre)
            mesh = SolidMesh(solid.triangles)
        panes = glazed - self.centre
        normals = np.concatenate([mesh.normals, unit_normals(panes)])
        reflectance = np.concatenate([solid.reflectance, glazed_reflectance])
        surface = np.concatenate([solid.surface, np.zeros(len(glazed))])
        no_group = np.full(len(solid.triangles), OPAQUE)
        group = np.concatenate([no_group, glazed_group])

        self.normal = vectors(normals)
        self.reflectance = mi.Float(reflectance.astype(np.float32))
        self.surface = mi.UInt32(surface.astype(np.uint32))
        self.group = mi.Int32(group.astype(np.int32))
        self.gloss = TracedGloss(solid, normals[: len(solid.triangles)], len(glazed)) if (solid.glossy) else None
        self.panes = TracedPanes(solid, len(glazed)) if any(map(bool, solid.transmittance)) else None
        self.scene: mi.Scene | SharedScene | OwnedScene
        if isinstance(mesh, OwnedMesh):
            room = self._room_of_group[glazed_group.astype(int)]
            self.scene = OwnedScene(mesh, panes, self.centre, room=room[: len(panes)], numbers=self._numbers)
        elif mesh.is_shared:
            self.scene = SharedScene(mesh, panes, self.centre)
        else:
            self.scene = scene_of(np.concatenate([solid.triangles - self.centre, panes]))
        radius = max(mesh.radius(self.centre) if len(solid.triangles) else 0.0, _greatest(panes))
        # Offset along the normal that keeps a ray clear of the face it starts on [m]
        self.epsilon = opaque(2e-5 * max(1.0, 0.05 * radius))

    def _load_windows(self, glazed: NDArray[np.float64], glazed_group: NDArray[np.int64]) -> None:
        """Tables by glazed triangle and by group, to sample points on the windows."""
        groups, window_group = self.groups, glazed_group
        areas = triangle_areas(glazed)
        room = self._room_of_group[window_group.astype(int)]
        self._window_area = column(np.bincount(room, areas))
        self.window_triangles = np.bincount(room)  # [R] of each room
        self._glazed_vertices = [vectors(glazed[:, i] - self.centre, mi.Point3f) for i in range(3)]
        self._glazed_group = mi.Int32(window_group.astype(np.int32))
        self._glazed = DiscreteDistribution(areas, room)
        frames = np.stack([g.frame for g in groups])  # [G, 3, 3]
        self._frame_rows = [vectors(frames[:, i]) for i in range(3)]
        self._axes = [tuple(map(opaque_vector, g.frame)) for g in groups]
        of_room = np.bincount(self._room_of_group)
        room_of_group = self._room_of_group
        firsts = np.cumsum(of_room) - of_room
        local = np.arange(len(groups)) - firsts[room_of_group]
        self._group_tables = [column(table, mi.UInt32) for table in (room_of_group, local, of_room[room_of_group])]
        self._glazed_by_group = DiscreteDistribution(areas, window_group)

    def derived(self, function: Callable[[TracedScene], T]) -> T:
        """The result of a function of the scene alone, computed at the first call."""
        if function not in self._derived:
            self._derived[function] = function(self)
        result: T = self._derived[function]
        return result

    def of_lanes(self, room: mi.UInt32) -> TracedScene:
        """The scene for rays of the rooms of the lanes."""
        if not isinstance(self.scene, OwnedScene):
            return self
        tracer = copy(self)
        tracer.scene = self.scene.of_lanes(room)
        return tracer

    def group_in_room(self, group: mi.UInt32) -> tuple[mi.UInt32, mi.UInt32, mi.UInt32]:
        """The room of a group, its number among those of the room, and how many these are."""
        room, local, count = (dr.gather(mi.UInt32, table, group) for table in self._group_tables)
        return room, local, count

    def ray(self, origin: mi.Point3f, direction: mi.Vector3f) -> mi.Ray3f:
        """A ray that ends within the room."""
        return mi.Ray3f(origin, direction, self._reach, 0.0, [])

    def window_area(self, room: mi.UInt32 | None = None) -> mi.Float:
        """Area of all windows of each lane's room; of the first by default."""
        room = opaque(0, mi.UInt32) if room is None else room
        return dr.gather(mi.Float, self._window_area, room)

    def sample_window(
        self, u: mi.Point2f, active: mi.Bool, room: mi.UInt32 | None = None
    ) -> tuple[mi.Point3f, mi.Int32]:
        """A point uniform over the area of all windows of each lane's room, and its group."""
        room = opaque(0, mi.UInt32) if room is None else room
        triangle, reused = self._glazed.sample_reuse(u.x, active, room)
        return self._point(triangle, mi.Point2f(reused, u.y), active), dr.gather(
            mi.Int32, self._glazed_group, triangle, active
        )

    def sample_group(self, group: int | mi.UInt32, u: mi.Point2f) -> mi.Point3f:
        """A point uniform over the area of one group's windows, or of each lane's group."""
        group = opaque(group, mi.UInt32) if isinstance(group, int) else group
        triangle, reused = self._glazed_by_group.sample_reuse(u.x, mi.Bool(True), group)
        return self._point(triangle, mi.Point2f(reused, u.y), mi.Bool(True))

    def window_triangle(self, triangle: mi.UInt32, origin: mi.Point3f) -> tuple[mi.Int32, tuple[mi.Vector3f, ...]]:
        """The group of a window's triangle, and its corners from `origin` in the group's frame."""
        group = dr.gather(mi.Int32, self._glazed_group, triangle)
        corners = (dr.gather(mi.Point3f, v, triangle) - origin for v in self._glazed_vertices)
        return group, tuple(self.to_local(group, corner, mi.Bool(True)) for corner in corners)

    def _point(self, triangle: mi.UInt32, u: mi.Point2f, active: mi.Bool) -> mi.Point3f:
        a, b, c = (dr.gather(mi.Point3f, v, triangle, active) for v in self._glazed_vertices)
        root = dr.sqrt(dr.maximum(1 - u.x, 0))
        return a * (1 - root) + b * (root * (1 - u.y)) + c * (root * u.y)

    def surface_at(
        self, hit: mi.PreliminaryIntersection3f, origin: mi.Point3f, direction: mi.Vector3f, active: mi.Bool
    ) -> tuple[mi.Point3f, mi.Vector3f, mi.Float]:
        """Point of a hit, offset off the surface; normal towards the ray; diffuse reflectance.

        The reflectance is the diffuse one, where there is a gloss that for the ray's angle.
        """
        face = dr.gather(mi.Vector3f, self.normal, hit.prim_index, active)
        face = dr.mulsign(face, -dr.dot(face, direction))
        point = mi.Point3f(origin + direction * hit.t + face * self.epsilon)
        return point, face, self.diffuse(hit.prim_index, -dr.dot(face, direction), active)

    def diffuse(self, triangle: mi.UInt32, cosine: mi.Float, active: mi.Bool) -> mi.Float:
        """Diffuse reflectance of a triangle seen at a cosine to its normal."""
        rho = dr.gather(mi.Float, self.reflectance, triangle, active)
        if self.gloss is None:
            return rho
        return rho * self.gloss.diffuse_share(triangle, cosine, active)

    def whole(self, triangle: mi.UInt32, direction: mi.Vector3f, active: mi.Bool) -> mi.Float:
        """Total reflectance of a triangle for a ray along a direction, diffuse and specular."""
        if self.gloss is None:
            return dr.gather(mi.Float, self.reflectance, triangle, active)
        normal = dr.gather(mi.Vector3f, self.normal, triangle, active)
        cosine = dr.abs(dr.dot(normal, direction))
        gloss = self.gloss.specular(triangle, cosine, active)
        return self.diffuse(triangle, cosine, active) + gloss

    def without_mirrors(self, triangle: mi.UInt32, direction: mi.Vector3f, active: mi.Bool) -> mi.Float:
        """The same without the specular part of smooth mirrors."""
        if self.gloss is None:
            return self.whole(triangle, direction, active)
        normal = dr.gather(mi.Vector3f, self.normal, triangle, active)
        cosine = dr.abs(dr.dot(normal, direction))
        rough = self.gloss.roughness(triangle, active) > 0
        gloss = dr.select(rough, self.gloss.specular(triangle, cosine, active), 0.0)
        return self.diffuse(triangle, cosine, active) + gloss

    def bounce(
        self,
        hit: mi.PreliminaryIntersection3f,
        origin: mi.Point3f,
        direction: mi.Vector3f,
        generator: mi.PCG32,
        active: mi.Bool,
    ) -> tuple[mi.Point3f, mi.Vector3f, mi.Float, mi.Bool]:
        """Point of a hit, direction after it, weight, and whether the reflection is specular."""
        position, face, weight = self.surface_at(hit, origin, direction, active)
        away, mirrored = diffuse_direction(face, generator), mi.Bool(False)
        if self.gloss is not None:
            glossy, towards, weight = self.gloss.leave(hit.prim_index, face, direction, weight, generator, active)
            away = dr.select(glossy, towards, away)
            mirrored = glossy & (self.gloss.roughness(hit.prim_index, glossy) <= 0)
        return position, away, weight, mirrored

    def leaves(self, hit: mi.PreliminaryIntersection3f, direction: mi.Vector3f, active: mi.Bool) -> mi.Bool:
        """Which active rays meet a window from its room side."""
        active = active & hit.is_valid()
        outwards = dr.gather(mi.Vector3f, self.normal, hit.prim_index, active)
        window = dr.gather(mi.Int32, self.group, hit.prim_index, active) != OPAQUE
        return active & window & (dr.dot(outwards, direction) > 0)

    @cached_property
    def panes_in_series(self) -> bool:
        """Whether other panes, such as a screen, are close in front of windows."""
        if not self._panes:
            return False
        number = dr.arange(mi.UInt32, SERIES_PLACES * len(self.groups))
        group = number // SERIES_PLACES
        u, out = lattice_2d(number % SERIES_PLACES, group, 0), self.exterior_normal(group)
        start = self.sample_group(group, u) + out * self.epsilon
        tracer = self.of_lanes(self.group_in_room(group)[0])
        hit = tracer._met(start, out, number >= 0)
        return bool(dr.any(self.leaves(hit, out, hit.t < SERIES_GAP)))

    @dr.syntax
    def met_outdoors(
        self, origin: mi.Point3f, direction: mi.Vector3f, active: mi.Bool
    ) -> tuple[mi.PreliminaryIntersection3f, mi.Point3f]:
        """First hits of outgoing rays beyond the panes that they pass, and the last origins.

        They pass panes met from the room side: the one that they start on, and others outside it.
        """
        origin = mi.Point3f(origin)
        hit = self._met(origin, direction, active)
        passed = self.leaves(hit, direction, active)
        while passed:
            outwards = dr.gather(mi.Vector3f, self.normal, hit.prim_index, passed)
            origin = mi.Point3f(origin + direction * hit.t + outwards * self.epsilon)
            hit = self._met(origin, direction, passed)
            passed = self.leaves(hit, direction, passed)
        return hit, origin

    def hides(self, ray: mi.Ray3f, active: mi.Bool, *, coherent: bool = False) -> mi.Bool:
        """Whether anything outdoors hides rays; they pass panes as in `met_outdoors`."""
        if self._panes:
            return self.met_outdoors(ray.o, ray.d, active)[0].is_valid()
        return self.scene.ray_test(ray, coherent=coherent, active=active)

    def _met(self, origin: mi.Point3f, direction: mi.Vector3f, active: mi.Bool) -> mi.PreliminaryIntersection3f:
        ray = mi.Ray3f(origin, direction)
        return self.scene.ray_intersect_preliminary(ray, coherent=False, active=active)

    def to_local(self, group: mi.Int32, v: mi.Vector3f, active: mi.Bool) -> mi.Vector3f:
        """World vector in the frame of a window group (z is the exterior normal)."""
        x, y, z = (dr.gather(mi.Vector3f, row, group, active) for row in self._frame_rows)
        return mi.Vector3f(dr.dot(x, v), dr.dot(y, v), dr.dot(z, v))

    def to_group(self, group: int, v: mi.Vector3f) -> mi.Vector3f:
        """World vector in the frame of one window group."""
        x, y, z = self._axes[group]
        return mi.Vector3f(dr.dot(x, v), dr.dot(y, v), dr.dot(z, v))

    def exterior_normal(self, group: int | mi.UInt32) -> mi.Vector3f:
        """World direction outdoors of one window group, or of each lane's group."""
        if isinstance(group, int):
            return self._axes[group][2]
        return dr.gather(mi.Vector3f, self._frame_rows[2], group)

    def place(self, point: ArrayLike) -> mi.Point3f:
        """A point of the world [m] in the scene's coordinates."""
        return mi.Point3f(opaque_vector(np.asarray(point, dtype=float) - self.centre))

    def outward(self, group: mi.Int32, active: mi.Bool) -> mi.Vector3f:
        """Offset off a window towards outdoors that keeps a ray clear of its pane."""
        return dr.gather(mi.Vector3f, self._frame_rows[2], group, active) * self.epsilon

    def to_world_any(self, group: mi.Int32, v: mi.Vector3f) -> mi.Vector3f:
        """Vector in the frame of each lane's window group to world axes."""
        x, y, z = (dr.gather(mi.Vector3f, row, group) for row in self._frame_rows)
        return x * v.x + y * v.y + z * v.z

    def to_world(self, group: int, v: mi.Vector3f) -> mi.Vector3f:
        """Vector in the frame of one window group to world axes."""
        x, y, z = self._axes[group]
        return x * v.x + y * v.y + z * v.z


class SceneCache:
    """Traced scenes that several functions share; the last used ones are kept.

    Some twenty functions trace the matrices of one room, and the surroundings of a building have
    tens of thousands of triangles.  Whoever calls several of these functions makes one cache and
    passes it to all of them (`scenes=`).
    """

    def __init__(self, scenes: int = SCENES, meshes: int = MESHES) -> None:
        """Empty; `scenes` and `meshes`: how many to keep."""
        self._most_scenes, self._most_meshes = scenes, meshes
        # with the objects whose ids are in the key, so that no other object gets these ids
        self._scenes: OrderedDict[tuple, tuple[tuple, TracedScene]] = OrderedDict()
        self._meshes: list[tuple[str, SolidMesh]] = []
        self._together: dict[tuple, tuple[tuple, list[TracedRoom], TracedScene]] = {}  # the last one
        self._building: dict[tuple, tuple[tuple, OwnedMesh]] = {}  # the last one
        # surroundings of rooms in a building's mesh, by identity
        self._fronts: dict[int, tuple[Surfaces, SharedOutdoors, int]] = {}
        stores = (self._scenes, self._meshes, self._together, self._building)
        for store in stores:  # at exit: before Dr.Jit ends
            weakref.finalize(self, store.clear)

    def scene(
        self,
        surfaces: Surfaces,
        groups: Sequence[WindowGroup] = (),
        *,
        windows_block: bool = True,
        window_reflectance: ArrayLike | None = None,
        centre: ArrayLike | None = None,
    ) -> TracedScene:
        """The `TracedScene` of these arguments, built if it is not in the cache.

        Surfaces and groups are compared by identity.
        """
        # given or not, one centre is one scene
        values = (window_reflectance, _middle(groups) if centre is None and groups else centre)
        arrays = [None if value is None else np.asarray(value, float) for value in values]
        inputs = (surfaces, *groups)
        key = (
            variants.activate(),
            windows_block,
            *(None if a is None else a.tobytes() for a in arrays),
            *map(id, inputs),
        )
        if key not in self._scenes and id(surfaces) in self._fronts:
            _, outdoors, number = self._fronts[id(surfaces)]
            self._scenes[key] = (
                inputs,
                TracedScene(
                    outdoors.surfaces,
                    groups,
                    windows_block=windows_block,
                    window_reflectance=arrays[0],
                    centre=arrays[1],
                    mesh=self._building_mesh(outdoors),
                    numbers=[number],
                ),
            )
        if key not in self._scenes:
            reflectance, middle = arrays
            self._scenes[key] = (
                inputs,
                TracedScene(
                    surfaces,
                    groups,
                    windows_block=windows_block,
                    window_reflectance=reflectance,
                    centre=middle,
                    mesh=self._mesh(surfaces.triangles),
                ),
            )
        self._scenes.move_to_end(key)
        while len(self._scenes) > self._most_scenes:
            self._scenes.popitem(last=False)
        return self._scenes[key][1]

    def of_surfaces(self, surfaces: Surfaces, centre: ArrayLike) -> TracedScene:
        """A scene of surfaces alone about a centre [3], which is not kept, unlike its mesh."""
        return TracedScene(surfaces, centre=centre, mesh=self._mesh(surfaces.triangles))

    def together(self, rooms: Sequence[TracedRoom]) -> tuple[list[TracedRoom], TracedScene]:
        """Rooms moved apart from each other, and the scene of all of them."""
        if len(rooms) == 1:
            return list(rooms), self.scene(rooms[0].surfaces, rooms[0].groups)
        inputs = tuple(part for room in rooms for part in (room.surfaces, *room.groups))
        key = (variants.activate(), "together", *map(id, inputs))
        if key not in self._together:
            placed, reach = apart(rooms)
            groups = [group for room in placed for group in room.groups]
            self._together.clear()  # it stays the dictionary that is cleared at exit
            self._together[key] = (
                inputs,
                placed,
                TracedScene(
                    joined_surfaces([room.surfaces for room in placed]),
                    groups,
                    centre=np.zeros(3),
                    rooms=[len(room.groups) for room in rooms],
                    reach=reach,
                ),
            )
        return self._together[key][1:]

    def outdoors(self, outdoors: SharedOutdoors, rooms: Sequence[TracedRoom]) -> TracedScene:
        """The scene in front of some rooms of a building; its mesh is built once."""
        mesh = self._building_mesh(outdoors)
        return TracedScene(
            outdoors.surfaces,
            [group for room in rooms for group in room.groups],
            centre=mesh.middle,
            mesh=mesh,
            rooms=[len(room.groups) for room in rooms],
            numbers=[room.number for room in rooms],
        )

    def know_fronts(self, outdoors: SharedOutdoors, fronts: Sequence[Surfaces]) -> None:
        """Trace what is in front of each room, by its number, in the mesh of the building."""
        for number, surfaces in enumerate(fronts):
            self._fronts[id(surfaces)] = surfaces, outdoors, number

    def _building_mesh(self, outdoors: SharedOutdoors) -> OwnedMesh:
        of = outdoors.surfaces.triangles, outdoors.owner
        key = (variants.activate(), *map(id, of))
        if key not in self._building:
            self._building.clear()
            self._building[key] = of, OwnedMesh(*of)
        return self._building[key][1]

    def _mesh(self, triangles: NDArray[np.float64]) -> SolidMesh:
        """The mesh of triangles [N, 3, 3]; equal triangles share one if it is large."""
        variant = variants.activate()
        for place, (of, mesh) in enumerate(self._meshes):
            if of == variant and np.array_equal(mesh.triangles, triangles):
                self._meshes.append(self._meshes.pop(place))
                return mesh
        mesh = SolidMesh(triangles)
        if mesh.is_shared:
            self._meshes.append((variant, mesh))
            del self._meshes[: -self._most_meshes]
        return mesh


def _middle(groups: Sequence[WindowGroup]) -> NDArray[np.float64]:
    """The middle of the corners of all windows' triangles [3]."""
    windows = [window.triangles for group in groups for window in group.windows]
    return np.concatenate(windows).mean(axis=(0, 1))


def _greatest(coordinates: NDArray[np.float64]) -> float:
    return float(np.abs(coordinates).max()) if coordinates.size else 0.0


def _speck(centre: NDArray[np.float64]) -> Surfaces:
    """A black triangle of a square millimetre far below, for scenes without any surface."""
    corners = 1e-3 * np.eye(3) + centre - [0, 0, 1e3]
    return Surfaces(corners[None], np.zeros(1), np.zeros(1, dtype=np.int64))
