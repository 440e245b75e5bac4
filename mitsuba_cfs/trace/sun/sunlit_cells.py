"""Cells of a room's surfaces, and the flux of the sun's beam on them.

    E[c, h] = flux[c, h] / area[c]

All users share this discretisation of the sunlit surfaces: `sunlit_sensors` has the share of each
cell in the light of the sensors, `sunlit_rows` that in the rows of a picture and in the windows.
Rays follow the sun from points on the windows to the cells, hour by hour.  Each ray carries
the same flux, so that a narrow strip of sun gets as many rays for its light as a wide one, and the
flux is conserved.

Pictures take surfaces close to the one that a pixel shows in finer pieces (`sunlit_rows`): there
the light changes from pixel to pixel, and too few rays would meet a piece to count their flux.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.trace.kernels.sampling import column, lattice_2d, opaque, opaque_vector, vectors
from mitsuba_cfs.trace.kernels.scattering import Scattering
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.even_points import EvenPoints
from mitsuba_cfs.trace.sun.lit_points import SurfacePoints, hit_faces, on_disc_of
from mitsuba_cfs.trace.sun.sorting import joint_keys, order_of
from mitsuba_cfs.trace.sun.specular_paths import SPREAD, SpecularPath, beam_transmittance, specular_sun_paths

CELLS = 4096  # that the surfaces' area is divided into, about, on either side
AREA_POINTS = 2**18  # that the cells' areas are counted by
POINTS = 1024  # on each window group that the sun is followed from
EDGE_SHARE = 4  # one in so many of them for hours whose sun reaches all
SEARCHED = 4  # of the search for a cell: kernels differ by so many halvings of the table
FACING = 1.49  # of a normal, before its parts are rounded to -1, 0 or 1
# Parallel faces in one cube (a skin behind a wall, which no light reaches) are separate cells: the
# distance along the normal replaces the coordinate of the normal's main axis, in steps this much
# smaller.  The weights decide between axes that a slanted normal has equal parts of
THIN, MAIN = 16, (1.0, 1.01, 1.02)
SIDE_NUMBERS = np.array([1, 3, 9], dtype=np.int32)  # of the parts of a normal, -1, 0 or 1, in the number of a side
SHIFT = 5.5 / THIN  # of the first cube before the surfaces, which lie in the middle of a thin one
RAYS = 2**21  # at once


@dataclass(frozen=True)
class RoomCells:
    """Cells of a room's surfaces: the part of a surface in a cube, one side of it; axis c."""

    edge: float  # of the cubes [m], before they are joined
    low: NDArray[np.float64]  # [3] of all
    halvings: int  # of the cubes' numbers, which join them
    keys: NDArray[np.int64]  # [c] of each cube and the side, sorted
    area: NDArray[np.float64]  # [c] [m2]

    @property
    def size(self) -> int:
        """Number of cells."""
        return len(self.keys)

    def joined(self) -> tuple[RoomCells, NDArray[np.int64]]:
        """Cells twice as wide, and which of them each of these lies in [c]."""
        cubes = sum((((self.keys >> s) & 0xFFFF) >> 1) << s for s in (37, 21, 5))
        keys, holder = np.unique(cubes + (self.keys & 0x1F), return_inverse=True)
        area = np.bincount(holder, self.area, len(keys))
        return RoomCells(self.edge, self.low, self.halvings + 1, keys, area), holder

    @cached_property
    def _table(self) -> mi.UInt64:
        return column(self.keys, mi.UInt64)

    def of(self, point: mi.Point3f, normal: mi.Vector3f, active: mi.Bool) -> mi.Int32:
        """The cell of points on surfaces, inside a kernel; -1 where there is none."""
        place = (mi.Vector3f(point) - opaque_vector(self.low)) / opaque(self.edge)
        size = dr.abs(normal) * mi.Vector3f(*MAIN)
        x_main = (size.x >= size.y) & (size.x >= size.z)
        y_main = ~x_main & (size.y >= size.z)
        main = dr.select(x_main, normal.x, dr.select(y_main, normal.y, normal.z))
        along = dr.mulsign(dr.dot(place, normal) * THIN, main)
        place = mi.Vector3f(
            dr.select(x_main, along, place.x),
            dr.select(y_main, along, place.y),
            dr.select(x_main | y_main, place.z, along),
        )
        cube = (mi.Vector3i(dr.floor(place)) & 0xFFFF) >> self.halvings
        side = mi.Vector3i(dr.round(FACING * normal)) + 1
        key = mi.UInt64(cube.x) << 37 | mi.UInt64(cube.y) << 21 | mi.UInt64(cube.z) << 5
        key += mi.UInt64(side.x + 3 * side.y + 9 * side.z)
        low, high = mi.UInt32(0), opaque(self.size - 1, mi.UInt32)
        for _ in range(-(-self.size.bit_length() // SEARCHED) * SEARCHED):
            middle = (low + high) >> 1
            below = dr.gather(mi.UInt64, self._table, middle, active) < key
            low = dr.select(below, dr.minimum(middle + 1, high), low)
            high = dr.select(below, high, middle)
        is_known = active & (dr.gather(mi.UInt64, self._table, low, active) == key)
        return dr.select(is_known, mi.Int32(low), -1)

    def numbers(self, places: SurfacePoints) -> NDArray[np.int32]:
        """The cell of each place [m], -1 where there is none."""
        if not places.size or not self.size:
            return np.full(places.size, -1, dtype=np.int32)
        return self.of(places.points(), places.normals(), mi.Bool(True)).numpy()


@dataclass(frozen=True, slots=True)
class CellPoints:
    """Points even over a room's surfaces, on both sides, in the order of their cells."""

    cells: RoomCells
    first: NDArray[np.int64]  # [c] number of each cell's first point
    count: NDArray[np.int64]  # [c]
    points: EvenPoints | None  # None where the surfaces have no area
    order: NDArray[np.int64]  # number of each among `points`

    def some(self, number: NDArray[np.int64]) -> SurfacePoints:
        """Some of the points, by number in the order of the cells."""
        return SurfacePoints.joined([] if self.points is None else [self.points.some(self.order[number])])


def surface_cells(inside: TracedScene) -> CellPoints:
    """The cells of a room's surfaces, with points on each."""
    return inside.derived(_surface_cells)


def _surface_cells(inside: TracedScene) -> CellPoints:
    interior = inside.surfaces
    none, area = np.empty(0, dtype=np.int64), float(interior.areas.sum())
    if not area > 0:
        return CellPoints(RoomCells(1.0, np.zeros(3), 0, none, np.empty(0)), none, none, None, none)
    edge = float(np.sqrt(max(area, 1e-6) / CELLS))
    low = (interior.triangles.min(axis=(0, 1)) - inside.centre) - SHIFT * edge
    points = EvenPoints(interior, inside.centre, inside.epsilon[0], AREA_POINTS)
    cubes = _cubes_and_sides(points, low, edge)
    keys = joint_keys(cubes)
    order = order_of(keys)
    keys = keys[order]
    first = np.flatnonzero(np.diff(keys, prepend=-1))
    count = np.diff(first, append=len(order))
    x, y, z, side = cubes[:, order[first]].astype(np.int64)
    cells = RoomCells(edge, low, 0, ((x << 37) | (y << 21) | (z << 5)) + side, count * (area / AREA_POINTS))
    return CellPoints(cells, first, count, points, order)


def _cubes_and_sides(points: EvenPoints, low: NDArray[np.float64], edge: float) -> NDArray[np.int32]:
    """The cube of each point, in the coordinates of `RoomCells`, and the number of its side [4, n]."""
    halves = np.empty((4, len(points.normals), points.count), dtype=np.int32)
    along = [points.along(axis) for axis in range(3)]
    for i, normal in enumerate(points.normals):
        places = [coordinate[i] - low[axis] for axis, coordinate in enumerate(along)]
        main = np.argmax(np.abs(normal) * np.array(MAIN), axis=1)
        onwards = np.zeros(points.count)
        for axis, place in enumerate(places):
            place /= edge
            part = points.repeated(normal[:, axis].astype(float))
            part *= place
            onwards += part
        onwards *= points.repeated(np.copysign(THIN, normal[np.arange(len(main)), main]))
        for axis, place in enumerate(places):
            np.copyto(place, onwards, where=points.repeated(main == axis))
            halves[axis, i] = np.floor(place, out=place)
        halves[3, i] = points.repeated((np.round(FACING * normal).astype(np.int32) + 1) @ SIDE_NUMBERS)
    halves[:3] &= 0xFFFF
    return halves.reshape(4, -1)


@dataclass(frozen=True, slots=True)
class OpenBeam:
    """The sun through an open window group, by each specular path, followed to where it falls."""

    scenes: tuple[TracedScene, TracedScene]  # the room with its window groups, and the outdoors
    group: int
    points: int = POINTS  # on the group, for hours whose sun does not reach all of them
    seeds: tuple[int, ...] = (0,)  # of batches B, each with its own points

    @property
    def fewer(self) -> int:
        """Points for hours whose sun reaches all of them."""
        return max(self.points // EDGE_SHARE, 1)

    def paths(self) -> list[SpecularPath]:
        """The specular paths, axis N."""
        return specular_sun_paths(self.scenes[1])

    def transmittance(self, scattering: Scattering, suns: NDArray[np.float64]) -> NDArray[np.float32]:
        """Transmittance of a system's straight beam for suns by each path [N, h]."""
        frame = self.scenes[0].groups[self.group].frame
        return np.stack([beam_transmittance(scattering, by.apparent(suns) @ frame.T) for by in self.paths()])

    def flux(
        self, cells: RoomCells, suns: NDArray[np.float64], through: NDArray[np.bool_] | None = None
    ) -> list[sparse.csr_array]:
        """Luminous flux on the cells by each path [N][c, B * h], per illuminance normal to the sun [m2].

        Args: suns: [h, 3] directions; through: [N, h] those that are followed, by default all.
        """
        facing, count = self.scenes[0].groups[self.group].frame[2], len(suns)
        found = []
        for n, by in enumerate(self.paths()):
            some = by.apparent(suns) @ facing > -SPREAD
            some &= through[n] if through is not None else True
            columns = np.flatnonzero(np.tile(some, len(self.seeds)))
            flux = sparse.csr_array((cells.size, len(self.seeds) * count))
            step = max(RAYS // self.fewer, 1) if cells.size else len(columns) + 1
            for start in range(0, len(columns) if cells.size else 0, step):
                flux = flux + self._flux(by, cells, suns, columns[start : start + step])
            found.append(flux)
        return found

    def _flux(
        self, by: SpecularPath, cells: RoomCells, suns: NDArray[np.float64], columns: NDArray[np.int64]
    ) -> sparse.csr_array:
        """Some of the columns of the flux, the others empty."""
        value = self._entering(by, suns, columns, self.fewer)
        lit = value > 0
        crossed = lit.any(axis=1) & ~lit.all(axis=1)
        value[crossed] = 0
        flux = self._landed(by, cells, suns, columns, value)
        some = columns[crossed]
        step = max(RAYS // self.points, 1)
        for start in range(0, len(some), step):
            part = some[start : start + step]
            flux = flux + self._landed(by, cells, suns, part, self._entering(by, suns, part, self.points))
        return flux

    def _entering(
        self, by: SpecularPath, suns: NDArray[np.float64], columns: NDArray[np.int64], points: int
    ) -> NDArray[np.float32]:
        """Flux of rays through points of the windows [n, points], for some of the columns [n]."""
        inside = self.scenes[0]
        lane = dr.arange(mi.UInt32, points * len(columns))
        position, to_sun = self._rays(by, suns, columns, points, lane)
        local = inside.to_group(self.group, to_sun)
        start = mi.Point3f(position + inside.outward(opaque(self.group, mi.Int32), mi.Bool(True)))
        reaching = by.transmittance(mi.Ray3f(start, to_sun), local.z > 0)
        value = dr.select(local.z > 0, local.z * reaching, 0.0)
        value *= opaque(inside.groups[self.group].area / points)
        return value.numpy().reshape(len(columns), points)

    def _rays(
        self, by: SpecularPath, suns: NDArray[np.float64], columns: NDArray[np.int64], points: int, lane: mi.UInt32
    ) -> tuple[mi.Point3f, mi.Vector3f]:
        """Points on the windows and ways out of rays, numbered by column and point."""
        row = lane // dr.opaque(mi.UInt32, points)
        point = lane - row * dr.opaque(mi.UInt32, points)
        # the same points in all hours: an hour's light does not depend on those computed with it
        batch, hour = np.divmod(columns, len(suns))
        keys = np.array([seed & 0xFFFFFFFF for seed in self.seeds], dtype=np.uint32)[batch]
        key = dr.gather(mi.UInt32, column(keys, mi.UInt32), row)
        stream = mi.sample_tea_32(opaque(self.group, mi.UInt32), key)[0]
        position = self.scenes[0].sample_group(self.group, lattice_2d(point, stream, 0))
        return position, on_disc_of(dr.gather(mi.Vector3f, vectors(by.apparent(suns)[hour]), row), point)

    def _landed(
        self,
        by: SpecularPath,
        cells: RoomCells,
        suns: NDArray[np.float64],
        columns: NDArray[np.int64],
        value: NDArray[np.float32],
    ) -> sparse.csr_array:
        """Flux on the cells [c, B * h] by the rays of some of the columns, with a flux each [n, points]."""
        shape, flat, points = (cells.size, len(self.seeds) * len(suns)), value.ravel(), value.shape[1]
        lit = np.flatnonzero(flat > 0)  # the sun reaches few of the points by way of mirrors
        if not len(lit):
            return sparse.csr_array(shape)
        inside = self.scenes[0]
        position, to_sun = self._rays(by, suns, columns, points, column(lit, mi.UInt32))
        off = inside.outward(opaque(self.group, mi.Int32), mi.Bool(True))
        origin, onwards = mi.Point3f(position - off), mi.Vector3f(-to_sun)
        hit = inside.scene.ray_intersect_preliminary(mi.Ray3f(origin, onwards), coherent=False)
        met = hit.is_valid()
        cell = cells.of(*hit_faces(inside, origin, onwards, hit, met), met).numpy()
        lit, cell = lit[cell >= 0], cell[cell >= 0]
        entries = flat[lit].astype(float), (cell, columns[lit // points])
        return sparse.csr_array(sparse.coo_array(entries, shape=shape))


@dataclass(frozen=True, slots=True)
class Beam:
    """The straight beam of the sun through a window group with a system in it."""

    scenes: tuple[TracedScene, TracedScene]  # as of `OpenBeam`
    group: int
    scattering: Scattering
    points: int = POINTS
    seeds: tuple[int, ...] = (0,)

    def flux(self, cells: RoomCells, suns: NDArray[np.float64]) -> sparse.csr_array:
        """Luminous flux on the cells [c, B * h], per unit illuminance normal to the sun [m2].

        Args: suns: [h, 3] directions.
        """
        open_beam = OpenBeam(self.scenes, self.group, self.points, self.seeds)
        tau = open_beam.transmittance(self.scattering, suns)
        return transmitted(open_beam.flux(cells, suns, tau > 0), tau)


def transmitted(flux: Sequence[sparse.csr_array], tau: NDArray[np.float32]) -> sparse.csr_array:
    """The flux [c, B * h] of all paths [N][c, B * h], each times its transmittance [N, h]."""
    whole = sparse.csr_array(flux[0].shape)
    for one, by_hour in zip(flux, tau, strict=True):
        if one.nnz and by_hour.any():
            times = np.tile(by_hour.astype(float), one.shape[1] // max(len(by_hour), 1))
            whole = whole + one @ sparse.diags_array(times)
    return sparse.csr_array(whole)
