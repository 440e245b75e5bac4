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

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.trace.kernels.sampling import column, lattice_2d, tables
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.lit_points import SurfacePoints, hit_faces
from mitsuba_cfs.trace.sun.sunlit_cells import RAYS, RoomCells, surface_cells

CELL_RAYS = 128  # from each cell, in each batch, at most
CELL_LEAST = 32  # and at the least: fewer take as long
CELL_SHARE = 32  # rays of a sensor, for each from a cell
LAST = 1e-4  # share of a sensor's light by the last reflection that is counted
BOUNCES = 256  # at most; light falls to `LAST` before in all but white rooms


@dataclass(frozen=True, slots=True)
class ReflectingCells:
    """Cells that light is reflected between, and where their rays start."""

    cells: RoomCells  # [w]
    of: NDArray[np.int64]  # [c] which of them each narrower cell lies in
    starts: SurfacePoints  # [w * rays] evenly over each

    @property
    def rays(self) -> int:
        """From each cell."""
        return self.starts.size // max(self.cells.size, 1)


def room_cells(inside: TracedScene, *, samples: int = CELL_RAYS * CELL_SHARE) -> tuple[RoomCells, ReflectingCells]:
    """The cells of a room's surfaces, and the wider ones that these lie in.

    Args: samples: rays of each sensor; with few of them cells have fewer, their noise far below.
    """
    rays = min(max(samples // CELL_SHARE, CELL_LEAST), CELL_RAYS)
    points = surface_cells(inside)
    narrow, first, count = points.cells, points.first, points.count
    # the wider cells have the points of one narrower cell after the other
    wide, holder = narrow.joined()
    by_holder = np.argsort(holder, kind="stable")
    ends = np.cumsum(count[by_holder])
    shift = np.repeat(first[by_holder] - (ends - count[by_holder]), count[by_holder])
    number = np.bincount(holder, count).astype(np.int64)
    share = (np.arange(rays) + 0.5) / rays
    chosen = (np.cumsum(number) - number)[:, None] + (number[:, None] * share).astype(np.int64)
    chosen = chosen.ravel()
    return narrow, ReflectingCells(wide, holder, points.places.some(chosen + shift[chosen]))


def room_shares(
    cells: tuple[RoomCells, ReflectingCells],
    rooms: Sequence[TracedScene],
    sensors: tuple[NDArray[np.float64], NDArray[np.float64]],
    *,
    samples: int,
    seed: int = 0,
) -> list[NDArray[np.float64]]:
    """Illuminance of sensors by reflection of a unit luminous flux on each cell, in each room [S, c] [1/m2].

    Args:
        rooms: of one shape, with reflectances of their own; all have the same rays.
        sensors: positions and normals [S, 3].
        samples: rays of each sensor.
    """
    points, normals = (np.atleast_2d(v) for v in sensors)
    local = SurfacePoints((points - rooms[0].centre).astype(np.float32), normals.astype(np.float32))
    narrow, wide = cells[0], cells[1].cells
    every = np.arange(local.size)
    firsts = _reflected(narrow, rooms, local, every, local.size, samples=samples, seed=seed ^ 0x6A09E667)
    entries = np.ones(narrow.size), (np.arange(narrow.size), cells[1].of)
    joined = sparse.csr_array(entries, shape=(narrow.size, wide.size))
    steps = [(first @ joined).toarray() for first in firsts]
    met = np.flatnonzero(np.any([step.any(axis=0) for step in steps], axis=0))
    shares = []
    for first, step, between in zip(firsts, steps, _between(cells[1], rooms, met, seed), strict=True):
        later = _reflected_again(step, between)
        shares.append(first.toarray() / narrow.area + (later / wide.area)[:, cells[1].of])
    return shares


def _reflected_again(step: NDArray[np.float64], between: sparse.csr_array) -> NDArray[np.float64]:
    """What cells have of the sensors by all later reflections [S, w], from those of the first."""
    whole, found = step.sum(), np.zeros_like(step)
    for _ in range(BOUNCES):
        step = step @ between
        found += step
        if step.sum() <= LAST * (whole + found.sum()):
            break
    return found


def _between(
    wide: ReflectingCells, rooms: Sequence[TracedScene], met: NDArray[np.int64], seed: int
) -> list[sparse.csr_array]:
    """What cells of each room have of each other [w, w]: of those that some meet, and of what these meet.

    The others, most of them the backs of walls, have no part in any sensor's light.
    """
    size = wide.cells.size
    found, known = [sparse.csr_array((size, size)) for _ in rooms], np.zeros(size, dtype=bool)
    while len(met):
        known[met] = True
        added = _reflected(wide.cells, rooms, wide.starts, met, size, samples=wide.rays, seed=seed)
        found = [one + more for one, more in zip(found, added, strict=True)]
        others = np.zeros(size, dtype=bool)
        for one in added:
            others[one.indices] = True
        met = np.flatnonzero(others & ~known)
    return found


def room_light(
    shares: Sequence[NDArray[np.float64]], flux: sparse.csr_array, strength: NDArray[np.float64]
) -> list[NDArray[np.float64]]:
    """Illuminance of sensors by what the room reflects of a group's straight beam [B][S, h].

    Args:
        shares: [B][S, c] of `room_shares`, one for each seed of the beam.
        flux: [c, B * h] of the `Beam`.
        strength: [h] illuminance normal to the sun.
    """
    count = len(strength)
    parts = (flux[:, b * count : (b + 1) * count] for b in range(len(shares)))
    return [(share @ part) * strength for share, part in zip(shares, parts, strict=True)]


def _reflected(
    cells: RoomCells,
    rooms: Sequence[TracedScene],
    starts: SurfacePoints,
    rows: NDArray[np.int64],
    count: int,
    *,
    samples: int,
    seed: int,
) -> list[sparse.csr_array]:
    """Irradiance of rows by a unit of irradiance on each cell that their rays meet, in each room [count, c].

    Args:
        starts: [count * n] places that the rays of each row start from, in turn.
        rows: those that rays are sent from; the others are empty.
    """
    inside, found = rooms[0], [sparse.csr_array((count, cells.size)) for _ in rooms]
    n = starts.size // max(count, 1)
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
        reflected = [room.whole(hit.prim_index, way, met) for room in rooms]
        met &= reduce(dr.maximum, reflected) > 0
        cell, *reflected = tables(cells.of(*hit_faces(inside, point, way, hit, met), met), *reflected)
        kept = np.flatnonzero(cell >= 0)
        places = some[kept // samples], cell[kept]
        for q, rho in enumerate(reflected):
            entries = rho[kept].astype(float) / samples, places
            found[q] = found[q] + sparse.csr_array(sparse.coo_array(entries, shape=found[q].shape))
    return found
