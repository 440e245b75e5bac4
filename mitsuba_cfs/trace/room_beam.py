"""The sun's beam through windows that the surfaces of a room reflect to sensors.

    E[s] = sum over cells c of W[s, c] flux[c] / area[c]

W is what paths from the sensors bring back from a cell per unit of its irradiance; the flux on the
cells follows from rays of the sun through points of the windows, hour by hour, each to where it
falls.  A narrow strip of sun has as many rays for its light as a wide one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.direct_sun import Scattering
from mitsuba_cfs.trace.sampling import lattice_2d, opaque, vectors
from mitsuba_cfs.trace.scene import TracedScene
from mitsuba_cfs.trace.sun_paths import Places, face_places, on_disc_of, reflecting_places
from mitsuba_cfs.trace.sun_ways import sun_ways

CELLS = 1024  # into which the surfaces' area is divided, about
AREA_POINTS = 2**19  # by which the cells' areas are counted
BOUNCES = 32  # surfaces that a path meets at most; roulette ends most before
WINDOW_POINTS = 256  # on each group, that the sun is followed from
FACING = 1.49  # of a normal, before its parts are rounded to -1, 0 or 1
RAYS = 2**21  # at once


@dataclass(frozen=True, slots=True)
class RoomCells:
    """Cells of a room's surfaces, cubes by the surface's side, and what sensors have of them."""

    edge: float  # of the cubes [m]
    low: NDArray[np.float64]  # [3] of all
    keys: NDArray[np.int64]  # [c] sorted
    share: sparse.csr_array  # [S, c] illuminance by unit luminous flux on a cell [1/m2]

    def of(self, places: Places) -> NDArray[np.int64]:
        """The cell of each place, -1 where no path has met it."""
        keys = _keys(places, self.low, self.edge)
        found = np.minimum(np.searchsorted(self.keys, keys), max(len(self.keys) - 1, 0))
        known = self.keys[found] == keys if len(self.keys) else np.zeros(len(keys), dtype=bool)
        return np.where(known, found, -1)


def room_cells(
    inside: TracedScene,
    interior: Surfaces,
    sensors: tuple[NDArray[np.float64], NDArray[np.float64]],
    *,
    samples: int,
    seed: int = 0,
) -> RoomCells:
    """The cells of a room, and how sensors see the light that they reflect.

    Args:
        sensors: positions and normals [S, 3].
        samples: paths of each sensor.
    """
    points, normals = (np.repeat(np.atleast_2d(v), samples, axis=0) for v in sensors)
    local = (points - inside.centre).astype(np.float32)
    met = reflecting_places(inside, Places(local, normals.astype(np.float32)), seed, BOUNCES)
    area = float(interior.areas.sum())
    edge = float(np.sqrt(max(area, 1e-6) / CELLS))
    low = (interior.triangles.min(axis=(0, 1)) - inside.centre) - 0.37 * edge
    keys, cell = np.unique(_keys(met.places, low, edge), return_inverse=True)
    even = np.sort(_keys(_points_on(interior, inside, seed), low, edge))
    counted = np.searchsorted(even, keys, side="right") - np.searchsorted(even, keys)
    cell_area = np.maximum(counted, 1) * area / AREA_POINTS
    entries = met.weight / samples / cell_area[cell], (met.path // samples, cell)
    shape = len(np.atleast_2d(sensors[0])), len(keys)
    return RoomCells(edge, low, keys, sparse.csr_array(sparse.coo_array(entries, shape=shape)))


def room_light(
    cells: RoomCells,
    scenes: tuple[TracedScene, TracedScene],
    scattering: Sequence[Scattering | None],
    suns: NDArray[np.float64],
    strength: NDArray[np.float64],
) -> NDArray[np.float32]:
    """Illuminance of sensors [G, S, h] by what the room reflects of each group's straight beam.

    Args:
        scenes: the room, with its window groups, and the outdoors.
        suns: [h, 3]; strength: [h] illuminance normal to the sun.
    """
    found = np.zeros((len(scattering), cells.share.shape[0], len(suns)), dtype=np.float32)
    step = RAYS // WINDOW_POINTS
    for g, way in enumerate(scattering):
        for start in range(0, len(suns) if way is not None else 0, step):
            hours = slice(start, start + step)
            flux = _flux(cells, scenes, g, way, suns[hours])
            found[g][:, hours] = (cells.share @ flux).toarray() * strength[hours]
    return found


def _flux(
    cells: RoomCells,
    scenes: tuple[TracedScene, TracedScene],
    group: int,
    way: Scattering,
    suns: NDArray[np.float64],
) -> sparse.csr_array:
    """Luminous flux on the cells [c, h] through a group, per unit illuminance normal to the sun."""
    inside, outside = scenes
    lane = dr.arange(mi.UInt32, WINDOW_POINTS * len(suns))
    hour = lane // WINDOW_POINTS
    point = lane - hour * WINDOW_POINTS
    # the same points in all hours: an hour's light does not hang on those computed with it
    position = inside.sample_group(group, lattice_2d(point, opaque(group, mi.UInt32), 0))
    off = inside.outward(opaque(group, mi.Int32), mi.Bool(True))
    flux = sparse.csr_array((len(cells.keys), len(suns)))
    for by in sun_ways(outside):
        to_sun = on_disc_of(dr.gather(mi.Vector3f, vectors(by.turned(suns)), hour), point)
        local = inside.to_group(group, to_sun)
        reaching = by.reaching(mi.Ray3f(mi.Point3f(position + off), to_sun), local.z > 0)
        value = dr.select(local.z > 0, local.z * way.through(local) * reaching, 0.0)
        value *= opaque(inside.groups[group].area / WINDOW_POINTS)
        origin, onwards = mi.Point3f(position - off), mi.Vector3f(-to_sun)
        ray = mi.Ray3f(origin, onwards)
        hit = inside.scene.ray_intersect_preliminary(ray, coherent=False, active=value > 0)
        lit = (value > 0) & hit.is_valid()
        others = lit, value, hour
        places, met, share, column = face_places(inside, origin, onwards, hit, lit, *others)
        kept = np.flatnonzero(met)
        cell = cells.of(places.some(kept))
        kept, cell = kept[cell >= 0], cell[cell >= 0]
        entries = share[kept], (cell, column[kept])
        flux = flux + sparse.csr_array(sparse.coo_array(entries, shape=flux.shape))
    return flux


def _keys(places: Places, low: NDArray[np.float64], edge: float) -> NDArray[np.int64]:
    """One number for each cube and side of the surface [m]."""
    cube = np.floor((places.point - low) / edge).astype(np.int64) & 0xFFFF
    side = (np.round(FACING * places.normal).astype(np.int64) + 1) @ np.array([1, 3, 9])
    return ((cube[:, 0] << 37) | (cube[:, 1] << 21) | (cube[:, 2] << 5)) + side


def _points_on(interior: Surfaces, inside: TracedScene, seed: int) -> Places:
    """Points even over the area of the surfaces, on both of their sides."""
    random = np.random.default_rng(seed)
    share = np.cumsum(interior.areas)
    marks = (np.arange(AREA_POINTS) + 0.5) / AREA_POINTS * share[-1]
    triangle = np.minimum(np.searchsorted(share, marks), len(share) - 1)
    a, b, c = interior.triangles[triangle].swapaxes(0, 1)
    root, v = np.sqrt(random.random(AREA_POINTS))[:, None], random.random(AREA_POINTS)[:, None]
    point = a * (1 - root) + b * root * (1 - v) + c * root * v - inside.centre
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    off = inside.epsilon[0] * normal
    both = np.concatenate([point + off, point - off]), np.concatenate([normal, -normal])
    return Places(both[0].astype(np.float32), both[1].astype(np.float32))
