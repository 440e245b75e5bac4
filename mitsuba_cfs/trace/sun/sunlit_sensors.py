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

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.surfaces import SurfaceGroups
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
    return narrow, ReflectingCells(wide, holder, points.some(chosen + shift[chosen]))


def shares_and_derivatives(
    cells: tuple[RoomCells, ReflectingCells],
    inside: TracedScene,
    sensors: tuple[NDArray[np.float64], NDArray[np.float64]],
    *,
    samples: int,
    seed: int = 0,
    by_groups: SurfaceGroups | None = None,
) -> NDArray[np.float64]:
    """Illuminance of sensors by reflection of a unit luminous flux on each cell [1 + N, S, c] [1/m2].

    The first matrix, then its derivatives by ln(rho) of groups of surfaces.

    W' = A' + (A' + A' F + ...) F + (A + A F + ...) F'
    """
    points, normals = (np.atleast_2d(v) for v in sensors)
    local = SurfacePoints((points - inside.centre).astype(np.float32), normals.astype(np.float32))
    narrow, wide = cells[0], cells[1].cells
    every = np.arange(local.size)
    numbers = None if by_groups is None else by_groups.number
    layers = 1 if by_groups is None else 1 + len(by_groups.names)
    first = _reflected(
        narrow,
        inside,
        local,
        every,
        local.size,
        samples=samples,
        seed=seed ^ 0x6A09E667,
        numbers=numbers,
        layers=layers,
    )
    entries = np.ones(narrow.size), (np.arange(narrow.size), cells[1].of)
    joined = sparse.csr_array(entries, shape=(narrow.size, wide.size))
    steps = np.stack([(one @ joined).toarray() for one in first])
    between = _between(cells[1], inside, np.flatnonzero(steps[0].any(axis=0)), seed, numbers, layers)
    whole, found = steps[0].sum(), np.zeros_like(steps)
    for _ in range(BOUNCES):
        met = steps[0]
        steps = np.stack([step @ between[0] for step in steps])
        for number in range(1, layers):
            steps[number] += met @ between[number]
        found += steps
        if steps[0].sum() <= LAST * (whole + found[0].sum()):
            break
    narrowly = np.stack([one.toarray() for one in first])
    shares: NDArray[np.float64] = narrowly / narrow.area + (found / wide.area)[..., cells[1].of]
    return shares


def _between(
    wide: ReflectingCells,
    inside: TracedScene,
    met: NDArray[np.int64],
    seed: int,
    numbers: NDArray[np.int64] | None,
    layers: int,
) -> list[sparse.csr_array]:
    """What cells have of each other [w, w], and its derivatives: of those that some meet, and of what these meet.

    The others, most of them the backs of walls, have no part in any sensor's light.
    """
    size = wide.cells.size
    found, known = [sparse.csr_array((size, size)) for _ in range(layers)], np.zeros(size, dtype=bool)
    while len(met):
        known[met] = True
        added = _reflected(
            wide.cells, inside, wide.starts, met, size, samples=wide.rays, seed=seed, numbers=numbers, layers=layers
        )
        found = [one + more for one, more in zip(found, added, strict=True)]
        others = np.zeros(size, dtype=bool)
        others[found[0].indices] = True
        met = np.flatnonzero(others & ~known)
    return found


def room_light(
    shares: Sequence[NDArray[np.float64]], flux: sparse.csr_array, strength: NDArray[np.float64]
) -> list[NDArray[np.float64]]:
    """Illuminance of sensors by what the room reflects of a group's straight beam [B][S, h].

    Args:
        shares: [B][S, c] of `shares_and_derivatives`, one for each seed of the beam.
        flux: [c, B * h] of the `Beam`.
        strength: [h] illuminance normal to the sun.
    """
    count = len(strength)
    parts = (flux[:, b * count : (b + 1) * count] for b in range(len(shares)))
    return [(share @ part) * strength for share, part in zip(shares, parts, strict=True)]


@dataclass(frozen=True, slots=True)
class OpenBeamLight:
    """Illuminance of sensors by what the room reflects of the sun's beam through an open window group, by a path."""

    hours: NDArray[np.int64]  # [n] of the suns h, those by which some sensor is lit
    light: NDArray[np.float32]  # [B, S, n] per illuminance normal to the sun

    @classmethod
    def of(cls, shares: Sequence[NDArray[np.float64]], flux: sparse.csr_array) -> OpenBeamLight:
        """From the light per flux on each cell [B][S, c] and the flux [c, B * h]."""
        count = flux.shape[1] // len(shares)
        parts = [sparse.csc_array(flux[:, b * count : (b + 1) * count]) for b in range(len(shares))]
        hours = np.flatnonzero(np.any([np.diff(part.indptr) > 0 for part in parts], axis=0))
        light = [share @ part[:, hours] for share, part in zip(shares, parts, strict=True)]
        return cls(hours, np.stack(light).astype(np.float32))


def beam_light(
    by_path: Sequence[OpenBeamLight], tau: NDArray[np.float32], strength: NDArray[np.float64]
) -> list[NDArray[np.float64]]:
    """The same of a system's straight beam, the paths together [B][S, h] [lx].

    Args: tau: [N, h] of `OpenBeam.transmittance`; strength: [h] illuminance normal to the sun.
    """
    batches, sensors = by_path[0].light.shape[:2]
    whole = np.zeros((batches, sensors, len(strength)))
    for one, by_hour in zip(by_path, tau, strict=True):
        whole[..., one.hours] += one.light * (by_hour * strength)[one.hours]
    return list(whole)


def _reflected(
    cells: RoomCells,
    inside: TracedScene,
    starts: SurfacePoints,
    rows: NDArray[np.int64],
    count: int,
    *,
    samples: int,
    seed: int,
    numbers: NDArray[np.int64] | None = None,
    layers: int = 1,
) -> list[sparse.csr_array]:
    """Irradiance of rows by a unit of irradiance on each cell that their rays meet [count, c].

    Followed by its derivatives by ln(rho) of groups of surfaces.

    Args:
        starts: [count * n] places that the rays of each row start from, in turn.
        rows: those that rays are sent from; the others are empty.
        numbers: of each surface's group [F]; None: no derivatives.
    """
    n = starts.size // max(count, 1)
    found = [sparse.csr_array((count, cells.size)) for _ in range(layers)]
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
        cell = cells.of(*hit_faces(inside, point, way, hit, met), met)
        known = [cell, rho]
        if numbers is not None:
            slant = dr.abs(dr.dot(dr.gather(mi.Vector3f, inside.normal, hit.prim_index, met), way))
            known += [dr.gather(mi.UInt32, inside.surface, hit.prim_index, met)]
            known += [inside.diffuse(hit.prim_index, slant, met)]
        cell, rho, *of_surface = tables(*known)
        for layer in range(layers):
            there, weight = cell >= 0, rho
            if layer and numbers is not None:
                surface, weight = of_surface
                there = there & (numbers[surface] == layer - 1)
            kept = np.flatnonzero(there)
            entries = weight[kept].astype(float) / samples, (some[kept // samples], cell[kept])
            found[layer] = found[layer] + sparse.csr_array(sparse.coo_array(entries, shape=(count, cells.size)))
    return found
