"""The sun's beam through windows that the surfaces of a room reflect to sensors.

    E[s] = sum over cells c of W[s, c] flux[c] / area[c],   W = A + A F + A F F + ...

A is what rays from the sensors have of the cells of the surfaces, F what rays from a cell have of
the others, each times the reflectance met; all sensors share F.  F and what follows on it is of
cells twice as wide, since light that is reflected twice is smooth.  The flux on the cells follows
from rays of the sun through points of the windows, hour by hour, each to where it falls.  A narrow
strip of sun has as many rays for its light as a wide one.

Source: Goral, Torrance, Greenberg, Battaile 1984, "Modeling the interaction of light between
diffuse surfaces"; the cells' irradiance is a mean over each.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.sampling import (
    column,
    lattice_2d,
    opaque,
    opaque_vector,
    pixel_places,
    tables,
    vectors,
)
from mitsuba_cfs.trace.kernels.scattering import Scattering
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.discs import SPREAD
from mitsuba_cfs.trace.sun.lit_points import Places, met_faces, on_disc_of
from mitsuba_cfs.trace.sun.specular_paths import SunWay, sun_ways

CELLS = 4096  # into which the surfaces' area is divided, about, on either side
WIDER = 2  # edge of the cells that light is reflected between, in edges of those
AREA_POINTS = 2**18  # by which the cells' areas are counted
CELL_RAYS = 128  # from each cell, in each batch, at most
CELL_LEAST = 32  # and at the least: fewer take as long
CELL_SHARE = 32  # rays of a sensor, for each from a cell
LAST = 1e-4  # share of a sensor's light by the last reflection that is counted
BOUNCES = 256  # at most; light falls to `LAST` before in all but white rooms
POINTS = 1024  # on each group in each batch, that the sun is followed from
EDGE_SHARE = 4  # of them, one in so many where the sun reaches all
SEARCHED = 4  # of the search for a cell: kernels differ by so many halvings of the table
FACING = 1.49  # of a normal, before its parts are rounded to -1, 0 or 1
RAYS = 2**21  # at once


@dataclass(frozen=True)
class RoomCells:
    """Cells of a room's surfaces, cubes by the surface's side."""

    edge: float  # of the cubes [m], before they are joined
    low: NDArray[np.float64]  # [3] of all
    halvings: int  # of the cubes' numbers, which join them
    keys: NDArray[np.int64]  # [c] sorted
    area: NDArray[np.float64]  # [c] [m2]

    @property
    def size(self) -> int:
        """How many cells there are."""
        return len(self.keys)

    @cached_property
    def _table(self) -> mi.UInt64:
        return column(self.keys, mi.UInt64)

    def of(self, point: mi.Point3f, normal: mi.Vector3f, active: mi.Bool) -> mi.Int32:
        """The cell of each place in a kernel, -1 where there is none."""
        place = (mi.Vector3f(point) - opaque_vector(self.low)) / opaque(self.edge)
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
        found = active & (dr.gather(mi.UInt64, self._table, low, active) == key)
        return dr.select(found, mi.Int32(low), -1)


@dataclass(frozen=True, slots=True)
class ReflectingCells:
    """Cells that light is reflected between, and where their rays start."""

    cells: RoomCells  # [w]
    of: NDArray[np.int64]  # [c] which of them each narrower cell lies in
    starts: Places  # [w * rays] evenly over each

    @property
    def rays(self) -> int:
        """From each cell."""
        return self.starts.size // max(self.cells.size, 1)


def room_cells(
    inside: TracedScene, interior: Surfaces, *, samples: int = CELL_RAYS * CELL_SHARE
) -> tuple[RoomCells, ReflectingCells]:
    """The cells of a room's surfaces, and the wider ones that these lie in.

    Args: samples: rays of each sensor; with few of them cells have fewer, their noise far below.
    """
    rays = min(max(samples // CELL_SHARE, CELL_LEAST), CELL_RAYS)
    area = float(interior.areas.sum())
    edge = float(np.sqrt(max(area, 1e-6) / CELLS))
    low = (interior.triangles.min(axis=(0, 1)) - inside.centre) - 0.37 * edge
    points, side = _points_on(interior, inside)
    cube = np.floor((points.point - low) / edge).astype(np.int64) & 0xFFFF
    keys = ((cube[:, 0] << 37) | (cube[:, 1] << 21) | (cube[:, 2] << 5)) + side
    order = np.argsort(keys, kind="stable")
    found, first = np.unique(keys[order], return_index=True)
    count = np.diff(np.append(first, len(order)))
    narrow = RoomCells(edge, low, 0, found, count * (area / AREA_POINTS))

    # the wider cells have the points of one narrower cell after the other
    wide_keys, holder = np.unique(_joined(found), return_inverse=True)
    wide_area = np.bincount(holder, narrow.area)
    wide = RoomCells(edge, low, WIDER.bit_length() - 1, wide_keys, wide_area)
    by_holder = np.argsort(holder, kind="stable")
    ends = np.cumsum(count[by_holder])
    shift = np.repeat(first[by_holder] - (ends - count[by_holder]), count[by_holder])
    number = np.bincount(holder, count).astype(np.int64)
    share = (np.arange(rays) + 0.5) / rays
    chosen = (np.cumsum(number) - number)[:, None] + (number[:, None] * share).astype(np.int64)
    chosen = chosen.ravel()
    starts = points.some(order[chosen + shift[chosen]])
    return narrow, ReflectingCells(wide, holder, starts)


def _joined(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Keys of the cubes, `WIDER` in a row, that cubes with keys lie in."""
    halvings, number = WIDER.bit_length() - 1, 0xFFFF
    cubes = sum((((keys >> s) & number) >> halvings) << s for s in (37, 21, 5))
    return cubes + (keys & 0x1F)


def room_shares(
    cells: tuple[RoomCells, ReflectingCells],
    inside: TracedScene,
    sensors: tuple[NDArray[np.float64], NDArray[np.float64]],
    *,
    samples: int,
    seed: int = 0,
) -> NDArray[np.float64]:
    """Illuminance of sensors by reflection of a unit luminous flux on each cell [S, c] [1/m2].

    Args:
        sensors: positions and normals [S, 3].
        samples: rays of each sensor.
    """
    points, normals = (np.atleast_2d(v) for v in sensors)
    local = Places((points - inside.centre).astype(np.float32), normals.astype(np.float32))
    narrow, wide = cells[0], cells[1].cells
    every = np.arange(local.size)
    first = _reflected(
        narrow, inside, local, every, local.size, samples=samples, seed=seed ^ 0x6A09E667
    )
    entries = np.ones(narrow.size), (np.arange(narrow.size), cells[1].of)
    step = (first @ sparse.csr_array(entries, shape=(narrow.size, wide.size))).toarray()
    between = _between(cells[1], inside, np.flatnonzero(step.any(axis=0)), seed)
    whole, found = step.sum(), np.zeros_like(step)
    for _ in range(BOUNCES):
        step = step @ between
        found += step
        if step.sum() <= LAST * (whole + found.sum()):
            break
    return first.toarray() / narrow.area + (found / wide.area)[:, cells[1].of]


def _between(
    wide: ReflectingCells, inside: TracedScene, met: NDArray[np.int64], seed: int
) -> sparse.csr_array:
    """What cells have of each other [w, w]: of those that some meet, and of what these meet.

    The others, most of them the backs of walls, have no part in any sensor's light.
    """
    size = wide.cells.size
    found, known = sparse.csr_array((size, size)), np.zeros(size, dtype=bool)
    while len(met):
        known[met] = True
        found = found + _reflected(
            wide.cells, inside, wide.starts, met, size, samples=wide.rays, seed=seed
        )
        others = np.zeros(size, dtype=bool)
        others[found.indices] = True
        met = np.flatnonzero(others & ~known)
    return found


def room_light(
    cells: RoomCells,
    share: NDArray[np.float64],
    scenes: tuple[TracedScene, TracedScene],
    group: int,
    way: Scattering,
    suns: tuple[NDArray[np.float64], NDArray[np.float64]],
    *,
    points: int = POINTS,
    seed: int = 0,
) -> NDArray[np.float64]:
    """Illuminance of sensors [S, h] by what the room reflects of a group's straight beam.

    Args:
        share: [S, c] of `room_shares`.
        scenes: the room, with its window groups, and the outdoors.
        suns: [h, 3] directions, and [h] illuminance normal to them.
        points: on the group, that the sun is followed from where it does not reach all of them.
    """
    towards, strength = suns
    found = np.zeros((len(share), len(towards)))
    beam = _Beam(scenes, group, way, points, seed)
    step = max(RAYS // beam.fewer, 1)
    for start in range(0, len(towards), step):
        hours = slice(start, start + step)
        found[:, hours] = (share @ beam.flux(cells, towards[hours])) * strength[hours]
    return found


@dataclass(frozen=True, slots=True)
class _Beam:
    """The straight beam of a window group."""

    scenes: tuple[TracedScene, TracedScene]
    group: int
    way: Scattering
    points: int
    seed: int

    @property
    def fewer(self) -> int:
        """Points for hours whose sun reaches all of them."""
        return max(self.points // EDGE_SHARE, 1)

    def flux(self, cells: RoomCells, suns: NDArray[np.float64]) -> sparse.csr_array:
        """Luminous flux on the cells [c, h], per unit illuminance normal to the sun."""
        found = sparse.csr_array((cells.size, len(suns)))
        for by in sun_ways(self.scenes[1]):
            before = by.turned(suns) @ self.scenes[0].groups[self.group].frame[2] > -SPREAD
            hours = np.flatnonzero(before)
            if not len(hours):
                continue
            value, position, to_sun = self._entering(by, suns[hours], self.fewer)
            lit = value > 0
            crossed = lit.any(axis=1) & ~lit.all(axis=1)
            value[crossed] = 0
            found = found + self._landed(cells, value, position, to_sun, hours, len(suns))
            hours = hours[crossed]
            step = max(RAYS // self.points, 1)
            for start in range(0, len(hours), step):
                some = hours[start : start + step]
                rays = self._entering(by, suns[some], self.points)
                found = found + self._landed(cells, *rays, some, len(suns))
        return found

    def _entering(
        self, by: SunWay, suns: NDArray[np.float64], points: int
    ) -> tuple[NDArray[np.float32], mi.Point3f, mi.Vector3f]:
        """Flux of rays through points of the windows [h, points], the points and ways out."""
        inside = self.scenes[0]
        lane = dr.arange(mi.UInt32, points * len(suns))
        hour = lane // dr.opaque(mi.UInt32, points)
        point = lane - hour * dr.opaque(mi.UInt32, points)
        # the same points in all hours: an hour's light does not hang on those computed with it
        key = dr.opaque(mi.UInt32, self.seed & 0xFFFFFFFF)
        stream = mi.sample_tea_32(opaque(self.group, mi.UInt32), key)[0]
        position = inside.sample_group(self.group, lattice_2d(point, stream, 0))
        to_sun = on_disc_of(dr.gather(mi.Vector3f, vectors(by.turned(suns)), hour), point)
        local = inside.to_group(self.group, to_sun)
        start = mi.Point3f(position + inside.outward(opaque(self.group, mi.Int32), mi.Bool(True)))
        reaching = by.reaching(mi.Ray3f(start, to_sun), local.z > 0)
        value = dr.select(local.z > 0, local.z * self.way.through(local) * reaching, 0.0)
        value *= opaque(inside.groups[self.group].area / points)
        return value.numpy().reshape(len(suns), points), position, to_sun

    def _landed(
        self,
        cells: RoomCells,
        value: NDArray[np.float32],
        position: mi.Point3f,
        to_sun: mi.Vector3f,
        hours: NDArray[np.int64],
        count: int,
    ) -> sparse.csr_array:
        """Flux on the cells [c, count] by rays [n, points] of some of the hours [n]."""
        inside, flat = self.scenes[0], value.ravel()
        off = inside.outward(opaque(self.group, mi.Int32), mi.Bool(True))
        origin, onwards = mi.Point3f(position - off), mi.Vector3f(-to_sun)
        ray, lit = mi.Ray3f(origin, onwards), column(flat > 0, mi.Bool)
        hit = inside.scene.ray_intersect_preliminary(ray, coherent=False, active=lit)
        lit &= hit.is_valid()
        cell = cells.of(*met_faces(inside, origin, onwards, hit, lit), lit).numpy()
        kept = np.flatnonzero(cell >= 0)
        cell = cell[kept]
        entries = flat[kept].astype(float), (cell, hours[kept // value.shape[1]])
        return sparse.csr_array(sparse.coo_array(entries, shape=(cells.size, count)))


def _reflected(
    cells: RoomCells,
    inside: TracedScene,
    starts: Places,
    rows: NDArray[np.int64],
    count: int,
    *,
    samples: int,
    seed: int,
) -> sparse.csr_array:
    """Irradiance of rows by a unit of irradiance on each cell that their rays meet [count, c].

    Args:
        starts: [count * n] places that the rays of each row start from, in turn.
        rows: those that rays are sent from; the others are empty.
    """
    n, found = starts.size // max(count, 1), sparse.csr_array((count, cells.size))
    block, key = max(1, RAYS // samples), dr.opaque(mi.UInt32, seed & 0xFFFFFFFF)
    points, normals = starts.points(), starts.normals()
    for begin in range(0, len(rows), block):
        some = rows[begin : begin + block]
        lane = dr.arange(mi.UInt32, len(some) * samples)
        place = lane // dr.opaque(mi.UInt32, samples)
        sample = lane - place * dr.opaque(mi.UInt32, samples)
        row = dr.gather(mi.UInt32, column(some, mi.UInt32), place)
        start = row * dr.opaque(mi.UInt32, n) + sample % dr.opaque(mi.UInt32, n)
        point = dr.gather(mi.Point3f, points, start)
        normal = dr.gather(mi.Vector3f, normals, start)
        u = lattice_2d(sample, mi.sample_tea_32(row, key)[0], 0)
        way = mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(u))
        hit = inside.scene.ray_intersect_preliminary(mi.Ray3f(point, way), coherent=False)
        met = hit.is_valid()
        rho = inside.whole(hit.prim_index, way, met)
        met &= rho > 0
        cell = cells.of(*met_faces(inside, point, way, hit, met), met)
        cell, rho = tables(cell, rho)
        kept = np.flatnonzero(cell >= 0)
        entries = rho[kept].astype(float) / samples, (some[kept // samples], cell[kept])
        found = found + sparse.csr_array(sparse.coo_array(entries, shape=found.shape))
    return found


@cache
def _shares_of_corners() -> tuple[NDArray[np.float64], ...]:
    """What points even over a triangle have of its corners, `AREA_POINTS` in turn."""
    u, v = pixel_places(AREA_POINTS).T[:, :, None]
    root = np.sqrt(u)
    return 1 - root, root * (1 - v), root * v


def _points_on(interior: Surfaces, inside: TracedScene) -> tuple[Places, NDArray[np.int64]]:
    """Points even over the area of the surfaces, on both of their sides; numbers of the sides."""
    share = np.cumsum(interior.areas)
    marks = (np.arange(AREA_POINTS) + 0.5) / AREA_POINTS * share[-1]
    triangle = np.minimum(np.searchsorted(share, marks), len(share) - 1)
    corners = interior.triangles.swapaxes(0, 1)
    parts = zip(corners - inside.centre, _shares_of_corners(), strict=True)
    point = sum(corner.take(triangle, axis=0) * part for corner, part in parts)
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    off = (inside.epsilon[0] * normal).take(triangle, axis=0)
    both = np.concatenate([normal, -normal]).astype(np.float32)
    side = (np.round(FACING * both).astype(np.int64) + 1) @ np.array([1, 3, 9])
    of = np.concatenate([triangle, len(share) + triangle])
    points = np.concatenate([point + off, point - off]).astype(np.float32)
    return Places(points, both.take(of, axis=0)), side[of]
