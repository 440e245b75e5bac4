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

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.sampling import column, lattice_2d, opaque, pixel_places, vectors
from mitsuba_cfs.trace.scene import TracedScene
from mitsuba_cfs.trace.sun_discs import Scattering
from mitsuba_cfs.trace.sun_paths import Places, face_places, on_disc_of
from mitsuba_cfs.trace.sun_ways import SunWay, sun_ways

CELLS = 4096  # into which the surfaces' area is divided, about, on either side
WIDER = 2  # edge of the cells that light is reflected between, in edges of those
AREA_POINTS = 2**18  # by which the cells' areas are counted
CELL_RAYS = 128  # from each cell, in each batch
LAST = 1e-4  # share of a sensor's light by the last reflection that is counted
BOUNCES = 256  # at most; light falls to `LAST` before in all but white rooms
POINTS = 1024  # on each group in each batch, that the sun is followed from
EDGE_SHARE = 4  # of them, one in so many where the sun reaches all
FACING = 1.49  # of a normal, before its parts are rounded to -1, 0 or 1
RAYS = 2**21  # at once


@dataclass(frozen=True, slots=True)
class RoomCells:
    """Cells of a room's surfaces, cubes by the surface's side."""

    edge: float  # of the cubes [m]
    low: NDArray[np.float64]  # [3] of all
    keys: NDArray[np.int64]  # [c] sorted
    area: NDArray[np.float64]  # [c] [m2]
    points: Places  # evenly over the area, cell after cell
    first: NDArray[np.int64]  # [c + 1] of each cell's points

    @property
    def size(self) -> int:
        """How many cells there are."""
        return len(self.keys)

    def of(self, places: Places) -> NDArray[np.int64]:
        """The cell of each place, -1 where there is none."""
        keys = _keys(places, self.low, self.edge)
        found = np.minimum(np.searchsorted(self.keys, keys), self.size - 1)
        return np.where(self.keys[found] == keys, found, -1)


def room_cells(inside: TracedScene, interior: Surfaces) -> tuple[RoomCells, RoomCells]:
    """The cells of a room's surfaces, and the wider ones that these lie in."""
    area = float(interior.areas.sum())
    edge = float(np.sqrt(max(area, 1e-6) / CELLS))
    low = (interior.triangles.min(axis=(0, 1)) - inside.centre) - 0.37 * edge
    points = _points_on(interior, inside)
    return _cells(points, low, edge, area), _cells(points, low, WIDER * edge, area)


def _cells(points: Places, low: NDArray[np.float64], edge: float, area: float) -> RoomCells:
    """Cells of an edge from points even over the area [m2]."""
    keys = _keys(points, low, edge)
    order = np.argsort(keys, kind="stable")
    found, first = np.unique(keys[order], return_index=True)
    first = np.append(first, len(order))
    return RoomCells(
        edge, low, found, np.diff(first) * (area / AREA_POINTS), points.some(order), first
    )


def room_shares(
    cells: tuple[RoomCells, RoomCells],
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
    narrow, wide = cells
    first = _reflected(narrow, inside, local, local.size, samples, seed ^ 0x6A09E667)
    holder = wide.of(narrow.points.some(narrow.first[:-1]))  # [c] the wide cell of each
    entries = np.ones(narrow.size), (np.arange(narrow.size), holder)
    step = (first @ sparse.csr_array(entries, shape=(narrow.size, wide.size))).toarray()
    between = _reflected(wide, inside, _starts(wide), wide.size, CELL_RAYS, seed)
    whole, found = step.sum(), np.zeros_like(step)
    for _ in range(BOUNCES):
        step = step @ between
        found += step
        if step.sum() <= LAST * (whole + found.sum()):
            break
    return first.toarray() / narrow.area + (found / wide.area)[:, holder]


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
            hours = np.arange(len(suns))
            value, position, to_sun = self._entering(by, suns, self.fewer)
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
        places, lit = face_places(inside, origin, onwards, hit, lit, lit)
        kept = np.flatnonzero(lit)
        cell = cells.of(places.some(kept))
        kept, cell = kept[cell >= 0], cell[cell >= 0]
        entries = flat[kept].astype(float), (cell, hours[kept // value.shape[1]])
        return sparse.csr_array(sparse.coo_array(entries, shape=(cells.size, count)))


def _starts(cells: RoomCells) -> Places:
    """Points of the cells that their rays start from [c * CELL_RAYS], evenly over each."""
    share = (np.arange(CELL_RAYS) + 0.5) / CELL_RAYS
    chosen = cells.first[:-1, None] + (np.diff(cells.first)[:, None] * share).astype(np.int64)
    return cells.points.some(chosen.ravel())


def _reflected(
    cells: RoomCells, inside: TracedScene, starts: Places, rows: int, samples: int, seed: int
) -> sparse.csr_array:
    """Irradiance of rows by a unit of irradiance on each cell that their rays meet [rows, c].

    Args: starts: [rows * n] places that the rays of each row start from, in turn.
    """
    n, found = starts.size // max(rows, 1), sparse.csr_array((rows, cells.size))
    block, key = max(1, RAYS // samples), dr.opaque(mi.UInt32, seed & 0xFFFFFFFF)
    for begin in range(0, rows, block):
        lane = dr.arange(mi.UInt32, min(block, rows - begin) * samples)
        row = lane // dr.opaque(mi.UInt32, samples)
        sample = lane - row * dr.opaque(mi.UInt32, samples)
        row += dr.opaque(mi.UInt32, begin)
        start = row * dr.opaque(mi.UInt32, n) + sample % dr.opaque(mi.UInt32, n)
        point = dr.gather(mi.Point3f, starts.points(), start)
        normal = dr.gather(mi.Vector3f, starts.normals(), start)
        u = lattice_2d(sample, mi.sample_tea_32(row, key)[0], 0)
        way = mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(u))
        hit = inside.scene.ray_intersect_preliminary(mi.Ray3f(point, way), coherent=False)
        met = hit.is_valid()
        rho = inside.whole(hit.prim_index, way, met)
        places, met, rho = face_places(inside, point, way, hit, met, met, rho)
        kept = np.flatnonzero(met & (rho > 0))
        cell = cells.of(places.some(kept))
        kept, cell = kept[cell >= 0], cell[cell >= 0]
        entries = rho[kept].astype(float) / samples, (begin + kept // samples, cell)
        found = found + sparse.csr_array(sparse.coo_array(entries, shape=found.shape))
    return found


def _keys(places: Places, low: NDArray[np.float64], edge: float) -> NDArray[np.int64]:
    """One number for each cube and side of the surface [m]."""
    cube = np.floor((places.point - low) / edge).astype(np.int64) & 0xFFFF
    side = (np.round(FACING * places.normal).astype(np.int64) + 1) @ np.array([1, 3, 9])
    return ((cube[:, 0] << 37) | (cube[:, 1] << 21) | (cube[:, 2] << 5)) + side


def _points_on(interior: Surfaces, inside: TracedScene) -> Places:
    """Points even over the area of the surfaces, on both of their sides."""
    share = np.cumsum(interior.areas)
    marks = (np.arange(AREA_POINTS) + 0.5) / AREA_POINTS * share[-1]
    triangle = np.minimum(np.searchsorted(share, marks), len(share) - 1)
    a, b, c = interior.triangles[triangle].swapaxes(0, 1)
    u, v = pixel_places(AREA_POINTS).T[:, :, None]
    root = np.sqrt(u)
    point = a * (1 - root) + b * root * (1 - v) + c * root * v - inside.centre
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    off = inside.epsilon[0] * normal
    both = np.concatenate([point + off, point - off]), np.concatenate([normal, -normal])
    return Places(both[0].astype(np.float32), both[1].astype(np.float32))
