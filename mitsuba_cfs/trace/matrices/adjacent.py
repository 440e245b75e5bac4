"""Light between windows: through glass from an adjacent room, by reflection, and as absorbed heat.

`adjacent_daylight` is the daylight matrix D of glass between rooms; `adjacent_view` the irradiance
of sensors by the beam that passes it straight.  Exchange matrices are for windows that reflect, and
absorption matrices state where the light that enters through a window patch is absorbed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.directions import sensors_of
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.surfaces import SurfaceGroups, Surfaces, WindowGroup
from mitsuba_cfs.trace.kernels.bins import DirectionBins
from mitsuba_cfs.trace.kernels.bounce_counts import BounceCounts
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping
from mitsuba_cfs.trace.kernels.path_options import PathOptions
from mitsuba_cfs.trace.kernels.random_walk import PathStarts
from mitsuba_cfs.trace.kernels.rooms import surface_counts
from mitsuba_cfs.trace.kernels.sampling import (
    batch_key,
    empty_sums,
    lattice_2d,
    opaque,
    path_generator,
    sums_of,
    vectors,
)
from mitsuba_cfs.trace.kernels.scene import OPAQUE, SceneCache, TracedScene
from mitsuba_cfs.trace.kernels.window_paths import WindowPaths, window_batches
from mitsuba_cfs.trace.matrices.pixel_view import add_seen_and_reflected


@dr.syntax
def _absorption_kernel(
    tracer: TracedScene,
    matrix: mi.Float64,  # [K * (F + G)], accumulated in place
    starts: PathStarts,  # on the window, into the room; rows are its patches
) -> None:
    """Random walk of a unit of flux; each surface and window absorbs what it does not reflect."""
    row, position, direction = starts.row, starts.position, starts.direction
    generator, max_depth, active = starts.generator, starts.max_depth, starts.active
    F = opaque(tracer.surface_count, mi.UInt32)
    width = opaque(tracer.surface_count + len(tracer.groups), mi.UInt32)
    beta = mi.Float(1.0)
    depth = mi.UInt32(0)
    while active:
        ray = mi.Ray3f(position, direction)
        hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        active &= hit.is_valid()
        group = dr.gather(mi.Int32, tracer.group, hit.prim_index, active)
        surface = dr.gather(mi.UInt32, tracer.surface, hit.prim_index, active)
        origin, towards = position, direction
        position, away, reflectance, _ = tracer.bounce(hit, position, direction, generator, active)
        last = depth + 1 >= max_depth
        slot = row * width + dr.select(group == OPAQUE, surface, F + mi.UInt32(group))
        transmittance, behind = mi.Float(0.0), mi.Bool(False)
        if dr.hint(tracer.panes is not None, mode="scalar"):
            normal = dr.gather(mi.Vector3f, tracer.normal, hit.prim_index, active)
            cosine = dr.dot(normal, towards)
            behind = active & (cosine < 0) & tracer.panes.is_pane(hit.prim_index, active)
            transmittance = tracer.panes.transmittance(hit.prim_index, cosine, active)
            left = reflectance + transmittance
            through = behind | (generator.next_float32() * left < transmittance)
            beyond = origin + towards * hit.t + dr.mulsign(normal, cosine) * tracer.epsilon
            position = dr.select(through, beyond, position)
            away = dr.select(through, towards, away)
        passed = reflectance + transmittance
        absorbed = dr.select(behind, 0.0, dr.select(last, 1.0, 1 - passed))
        dr.scatter_add(matrix, mi.Float64(beta * absorbed), slot, active)
        active &= behind | ~last

        beta *= dr.select(behind, 1.0, passed)
        direction = away
        depth += dr.select(behind, mi.UInt32(0), mi.UInt32(1))
        survival = dr.select(depth > 3, dr.minimum(beta * 4.0, 1.0), 1.0)
        active &= (generator.next_float32() < survival) & (beta > 0)
        beta /= dr.maximum(survival, 1e-6)


def absorption_matrix(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    *,
    window_reflectance: ArrayLike | None = None,
    basis: KlemsBasis = KLEMS_FULL,
    samples: int = 2048,
    max_depth: int = 64,
    stopping: Stopping | None = None,
    seed: int = 0,
    progress: Progress = silent,
    cache: MatrixCache | None = None,
) -> Estimate:
    """Absorption matrices [G, K, F + G]: where a unit of flux of each window patch is absorbed.

        absorbed[f] = sum over g, k of A[g, k, f] Omega_k L[g, k] area_g,   L = T D s

    The first F columns are the surfaces, the last G the inner sides of the window groups: what
    they do not reflect, which is absorbed there or leaves the room.  Each row sums to 1 in a
    closed room; what is missing has left through a gap.  Surfaces that transmit are panes between
    rooms: a ray along their normal is reflected, absorbed or goes straight on; the pane of the
    room beyond, which it meets against its normal, is the same glass and is passed freely.

    Args:
        surfaces: the room in the solar band; `surfaces.surface` names the F surfaces.
        window_reflectance: [G] diffuse solar reflectance of the windows from the room, 0 if none.
        samples: paths for each window patch in each batch.
        cache: of traced matrices, `MatrixCache.of_user()`; none by default.
    """
    paths = PathOptions(int(samples), max_depth, stopping, seed, progress, cache)
    reflectance = np.zeros(len(groups)) if window_reflectance is None else window_reflectance
    reflectance = np.asarray(reflectance, dtype=float)
    tracer = paths.scenes.scene(surfaces, groups, window_reflectance=reflectance)
    width = tracer.surface_count + len(groups)

    def follow(matrix: mi.Float64, of: WindowPaths) -> None:
        normal = tracer.exterior_normal(of.group)
        position = mi.Point3f(of.position - normal * tracer.epsilon)
        depth = dr.opaque(mi.UInt32, max_depth)
        starts = PathStarts(of.row, position, -of.outward, of.generator, depth, mi.Bool(True))
        _absorption_kernel(tracer, matrix, starts)

    batch = window_batches(tracer, DirectionBins(basis), width, samples, seed, follow, stopping=stopping or Stopping())
    return paths.estimate("absorption matrix", batch, surfaces, groups, reflectance, basis, by=__name__)


def window_exchange(
    surfaces: Surfaces, groups: Sequence[WindowGroup], paths: PathOptions, *, by_groups: SurfaceGroups | None = None
) -> Estimate:
    """Radiance that meets the windows from the room, per unit radiance of a patch [G, K, G * K].

        I[g, k] = sum over g', k' of W[g, k, g' k'] L[g', k']

    the mean over a group and over its back's incident patch k, the windows black.  A row sums to
    the share of a patch's view, direct and reflected, that ends on the windows.

    Args:
        surfaces: what the room is made of, in the band of the radiances.
        by_groups: of the surfaces; W is followed by its derivatives by ln(rho) of these, in the last axis
            [G, K, (1 + N) * G * K].
    """
    tracer, bins = paths.scenes.scene(surfaces, groups), DirectionBins(KLEMS_FULL)
    width = len(groups) * bins.size
    layers = 1 if by_groups is None else 1 + len(by_groups.names)
    columns = layers * width
    bounces = None if by_groups is None else BounceCounts([by_groups], surface_counts([surfaces]), width)

    def follow(matrix: mi.Float64, of: WindowPaths) -> None:
        normal = tracer.exterior_normal(of.group)
        add_seen_and_reflected(
            tracer,
            bins,
            matrix,
            mi.Point3f(of.position - normal * tracer.epsilon),
            of.inward(tracer),
            mi.Bool(True),
            row=of.row,
            beta=mi.Float(1),
            layers=layers,
            stream=of.stream,
            sample=of.sample,
            generator=of.generator,
            max_depth=dr.opaque(mi.UInt32, paths.max_depth),
            bounces=bounces,
        )

    stopping = paths.stopping or Stopping()
    batch = window_batches(tracer, bins, columns, paths.samples, paths.seed, follow, stopping=stopping)
    by_number = () if by_groups is None else (by_groups.number,)
    return paths.estimate("window exchange", batch, surfaces, groups, *by_number, by=__name__)


def outdoor_exchange(surfaces: Surfaces, groups: Sequence[WindowGroup], paths: PathOptions) -> Estimate:
    """Radiance that meets the windows from outdoors, per unit that they send there [G, K, G * K].

        I[g, k] = sum over g', k' of X[g, k, g' k'] L[g', k']

    for incident and outgoing patches of the front; arguments as for `window_exchange`.
    """
    exchange = window_exchange(surfaces, [_turned(group) for group in groups], paths)
    theta, phi = KLEMS_FULL.centres()
    patch = KLEMS_FULL.index(theta, np.pi - phi)  # x of the turned windows is that of the others, -
    columns = (np.arange(len(groups))[:, None] * KLEMS_FULL.size + patch).ravel()
    return replace(
        exchange,
        values=exchange.values[:, patch][:, :, columns],
        standard_error=exchange.standard_error[:, patch][:, :, columns],
        covariance=exchange.sum_error[:, patch, None, None] ** 2,  # in one block: columns are moved
    )


def _turned(group: WindowGroup) -> WindowGroup:
    """The same windows facing the other way: their exterior side is the room."""
    turned = (replace(w, triangles=w.triangles[:, ::-1]) for w in group.windows)
    return replace(group, windows=tuple(turned))


def adjacent_daylight(
    surfaces: Surfaces,
    groups: Sequence[WindowGroup],
    luminance: NDArray[np.float64],
    inner: Sequence[WindowGroup],
    paths: PathOptions,
) -> Estimate:
    """Daylight matrices [I, K, P] of glass to an adjacent room: radiance per unit sky radiance.

        D[i, k, p] = sum over g, k' of V[i, k, g k'] (T D)[g k', p]

    V is the radiance incident on the glass from patch k, averaged over its area, per unit radiance
    of a patch of the adjacent room's windows, interreflection included.

    Args:
        surfaces: of the adjacent room.
        groups: its windows, black to light from the room.
        luminance: T D of these windows [G, K, P], towards the adjacent room.
        inner: the glass, with normals into the adjacent room.
    """
    tracer, bins = paths.scenes.scene(surfaces, groups), DirectionBins(KLEMS_FULL)
    starts = paths.scenes.scene(Surfaces.none(), inner, windows_block=False, centre=tracer.centre)
    flat = luminance.reshape(-1, luminance.shape[-1])

    def follow(matrix: mi.Float64, of: WindowPaths) -> None:
        add_seen_and_reflected(
            tracer,
            bins,
            matrix,
            mi.Point3f(of.position + starts.exterior_normal(of.group) * tracer.epsilon),
            of.outward,
            mi.Bool(True),
            row=of.row,
            beta=mi.Float(1),
            stream=of.stream,
            sample=of.sample,
            generator=of.generator,
            max_depth=dr.opaque(mi.UInt32, paths.max_depth),
        )

    view = window_batches(starts, bins, len(flat), paths.samples, paths.seed, follow)
    inputs = surfaces, groups, flat, inner
    return paths.estimate("adjacent daylight", lambda number: view(number) @ flat, *inputs, by=__name__)


Room = tuple[Surfaces, Sequence[WindowGroup]]


@dataclass(frozen=True, slots=True)
class AdjacentRoomLight:
    """An adjacent room with the light of its windows."""

    surfaces: Surfaces
    groups: tuple[WindowGroup, ...]  # axis G
    luminance: NDArray[np.float64]  # T D of these [G, K, P], towards the room
    exterior: Surfaces  # in front of the first groups, which look outdoors
    beam: NDArray[np.float64]  # [G, K] transmittance of the straight beam; 0 of glass to rooms
    daylight: NDArray[np.float64]  # D of these [G, K, P]
    onward: tuple[GlassToRoom, ...] = ()  # rooms behind the last groups

    def rooms(self) -> Iterator[AdjacentRoomLight]:
        """The room itself and all rooms behind it."""
        yield self
        for behind in self.onward:
            yield from behind.room.rooms()


@dataclass(frozen=True, slots=True)
class GlassToRoom:
    """The room behind some window groups, which are parts of one pane."""

    first: int  # number of the first group
    count: int
    beam: NDArray[np.float64]  # [K] transmittance of their straight beam
    room: AdjacentRoomLight


def adjacent_view(
    room: Room,
    group: int,
    beam: NDArray[np.float64],
    beyond: AdjacentRoomLight,
    sensors: tuple[ArrayLike, ArrayLike],
    paths: PathOptions,
) -> Estimate:
    """Irradiance at sensors straight through a window group [S, P], per unit sky radiance.

    Rays of the sensors that meet the group go on into the adjacent room with the probability
    `beam`, and in the same way through glass to rooms behind it.

    Args:
        room: surfaces and window groups of the sensors' room.
        group: number of the window group to the adjacent room.
        beam: [K] transmittance of the straight beam of the group.
        beyond: the adjacent room.
        sensors: positions [S, 3] [m] and normals [S, 3].
    """
    points, directions = sensors_of(*sensors)
    here, bins, n, S = paths.scenes.scene(*room), DirectionBins(KLEMS_FULL), paths.samples, len(points)
    flat = [one.luminance.reshape(-1, one.luminance.shape[-1]) for one in beyond.rooms()]
    place, normal = vectors(points - here.centre, mi.Point3f), vectors(directions)
    passed = mi.Float(np.asarray(beam, dtype=np.float32))

    def batch(number: int) -> NDArray[np.float64]:
        sums = [empty_sums(S * len(one)) for one in flat]
        count, key = dr.opaque(mi.UInt32, n), batch_key(paths.seed, number)
        path = dr.arange(mi.UInt32, S * n)
        sensor = path // count
        sample, stream = path - sensor * count, mi.sample_tea_32(sensor, key)[0]
        local = mi.warp.square_to_cosine_hemisphere(lattice_2d(sample, stream, 0))
        away = mi.Frame3f(dr.gather(mi.Vector3f, normal, sensor)).to_world(local)
        start, generator = dr.gather(mi.Point3f, place, sensor), path_generator(path, key)
        hit = here.scene.ray_intersect_preliminary(mi.Ray3f(start, away), coherent=False)
        active = here.leaves(hit, away, mi.Bool(True))
        active &= dr.gather(mi.Int32, here.group, hit.prim_index, active) == opaque(group, mi.Int32)
        patch = bins.index(here.to_group(group, away))
        active &= generator.next_float32() < dr.gather(mi.Float, passed, patch, active)
        start = start + away * hit.t + here.exterior_normal(group) * here.epsilon
        _add_paths(
            beyond,
            iter(sums),
            bins,
            start,
            mi.Vector3f(away),
            active,
            scenes=paths.scenes,
            centre=here.centre,
            row=sensor,
            stream=stream,
            sample=sample,
            generator=generator,
            max_depth=dr.opaque(mi.UInt32, paths.max_depth),
        )
        dr.eval(*sums)
        each = zip(sums, flat, strict=True)
        return sum(sums_of(one, (S, len(light))) @ light for one, light in each) * (np.pi / n)

    inputs = room, group, beam, beyond, points, directions
    return paths.estimate("adjacent view", batch, *inputs, by=__name__)


def _add_paths(
    room: AdjacentRoomLight,
    sums: Iterator[mi.Float64],
    bins: DirectionBins,
    start: mi.Point3f,
    direction: mi.Vector3f,
    active: mi.Bool,
    *,
    scenes: SceneCache,
    centre: NDArray[np.float64],
    generator: mi.PCG32,
    **paths: Any,
) -> None:
    """Add the light that rays meet in a room, and through its glass in the rooms behind it."""
    tracer, matrix = scenes.scene(room.surfaces, room.groups, centre=centre), next(sums)
    if room.onward:
        ray = mi.Ray3f(start, direction)
        hit = tracer.scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        leaves = tracer.leaves(hit, direction, active)
        group = dr.gather(mi.Int32, tracer.group, hit.prim_index, leaves)
    for behind in room.onward:
        met = leaves & (group >= opaque(behind.first, mi.Int32))
        met &= group < opaque(behind.first + behind.count, mi.Int32)
        passed = mi.Float(np.asarray(behind.beam, dtype=np.float32))
        patch = bins.index(tracer.to_group(behind.first, direction))
        through = met & (generator.next_float32() < dr.gather(mi.Float, passed, patch, met))
        outside = tracer.exterior_normal(behind.first) * tracer.epsilon
        _add_paths(
            behind.room,
            sums,
            bins,
            start + direction * hit.t + outside,
            direction,
            through,
            scenes=scenes,
            centre=centre,
            generator=generator,
            **paths,
        )
        active &= ~met
    add_seen_and_reflected(
        tracer, bins, matrix, start, direction, active, beta=mi.Float(1), generator=generator, **paths
    )
