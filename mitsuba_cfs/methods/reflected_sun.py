"""The sun that surfaces reflect before it reaches the sensors, by shadow rays to its disc.

Patches of the sky and of the window, 3 and 10 to 15 degrees wide, put a sunlit spot in the wrong
place, and few paths of a window meet the sun's patch after a reflection.  In place of

    V T (D - D_d) s_d              the sun that outdoor surfaces reflect to the windows
    B s_d - B_d s_d                its part in the straight view through a group
    (V - V_d) diag(tau) D_d s_d    the sun's beam that the room reflects

the five-phase method computes this light at points that represent the outdoor surfaces
(`mitsuba_cfs.trace.sun.reflected`) and in cells of the room
(`mitsuba_cfs.trace.sun.sunlit_sensors`), in independent batches, which give its standard error.
Rays are traced with open windows; what they give is in the cache for all systems
(`mitsuba_cfs.trace.sun.open_windows`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from mitsuba_cfs.methods.coefficients import GroupCoefficients, beam_matrix, direct_daylight, without_straight
from mitsuba_cfs.methods.phase_matrices import PhaseMatrices
from mitsuba_cfs.phases import times_sky
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.surfaces import SurfaceGroups
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.open_windows import Suns, SunScenes, open_beam_light, seen_through, sunlit_windows
from mitsuba_cfs.trace.sun.sunlit_cells import OpenBeam, RoomCells, transmitted
from mitsuba_cfs.trace.sun.sunlit_sensors import (
    OpenBeamLight,
    beam_light,
    room_cells,
    room_light,
    shares_and_derivatives,
)

BATCHES = 4  # each with its own paths and points
WINDOW_SHARE = 32  # paths of a patch for D, for each that looks for sunlit surfaces
SENSOR_SHARE = 4  # paths of a sensor for V, for each that looks for them
ROOM_SHARE = 2  # paths of a sensor for V, for each that looks for the room's cells
MOST_FLUX = 1 << 24  # entries of the stored fluxes together: 200 MB
Array = NDArray[np.floating]


@dataclass(frozen=True)
class ReflectedSun:
    """The sun reflected to the windows in the hours of a sky, by batch."""

    sky: AnnualSky
    shining: NDArray[np.int64]  # [h] hours L with the sun up
    inside: TracedScene
    outside: TracedScene  # what is in front of the window parts, in the room's coordinates
    before: tuple[NDArray[np.float32], ...]  # [BATCHES][Q, K, h] luminance outside the windows
    by_patches: Array  # D - D_d [Q, K, P], which it replaces; 0 without outdoor surfaces
    # flux on the room's cells by specular path [N][c, BATCHES * h] through each open group, for other sensors,
    # reflectances and states
    fluxes: dict[int, list[sparse.csr_array]] = field(default_factory=dict)

    @property
    def suns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Directions [h, 3] and normal illuminance [h] [lx] of the sun."""
        return self.sky.direction[self.shining], self.sky.illuminance[self.shining]

    @cached_property
    def mean(self) -> NDArray[np.float32]:
        """Luminance outside the windows [Q * K, h], the mean of the batches."""
        first, *others = map(_flat, self.before)
        return np.asarray(sum(others, start=first) / np.float32(BATCHES), dtype=np.float32)

    def part(self, hours: NDArray[np.int64]) -> ReflectedSun:
        """The same in some of the hours L, given by their numbers among them."""
        number = np.searchsorted(self.shining, hours)
        up = np.isin(hours, self.shining)
        before = tuple(values[..., number[up]] for values in self.before)
        return replace(self, sky=self.sky.part(hours), shining=np.flatnonzero(up), before=before, fluxes={})


@dataclass(frozen=True)
class SunlitRoom:
    """Cells of the room, and the light of the sensors per irradiance of each cell [S, c]."""

    cells: RoomCells
    shares: tuple[NDArray[np.float64], ...]  # [BATCHES]


def reflected_sun(matrices: PhaseMatrices, sky: AnnualSky) -> ReflectedSun:
    """The sun reflected to the windows in the hours of a sky, in place of patches."""
    scene, sampling, parts = matrices.scene, matrices.sampling, matrices.parts.groups
    shining = np.flatnonzero((sky.illuminance > 0) & (sky.direction[:, 2] > 0))
    inside = matrices.scenes.scene(scene.interior, scene.groups)
    outside = matrices.scenes.scene(scene.exterior, parts, centre=inside.centre)
    by_patches = matrices.daylight.values - direct_daylight(matrices)
    if not len(scene.exterior.triangles):
        return ReflectedSun(sky, shining, inside, outside, (), by_patches)
    paths = sampling.patch_samples // WINDOW_SHARE // BATCHES
    found = sunlit_windows(
        SunScenes(inside, outside, (scene.exterior, parts), matrices.cache),
        Suns(sky.direction[shining], sky.illuminance[shining]),
        samples=max(paths * len(scene.groups) // len(parts), 4),
        places=sampling.sun_points,
        seeds=_seeds(matrices),
    )
    before = tuple(light.reshape(*by_patches.shape[:2], -1) for light in found)
    return ReflectedSun(sky, shining, inside, outside, before, by_patches)


def sunlit_room(matrices: PhaseMatrices, sun: ReflectedSun) -> SunlitRoom | None:
    """What the sensors see of the room's surfaces; None where these reflect nothing."""
    rooms = _sunlit(matrices, sun, None)
    return rooms[0] if rooms else None


def sunlit_derivatives(matrices: PhaseMatrices, sun: ReflectedSun, by_groups: SurfaceGroups) -> list[SunlitRoom]:
    """The same by ln(rho) of each group of surfaces; none where the surfaces reflect nothing."""
    return _sunlit(matrices, sun, by_groups)[1:]


def _sunlit(matrices: PhaseMatrices, sun: ReflectedSun, by_groups: SurfaceGroups | None) -> list[SunlitRoom]:
    interior = matrices.scene.interior
    if not (interior.reflectance > 0).any():
        return []
    samples = _sensor_samples(matrices, ROOM_SHARE)
    cells = room_cells(sun.inside, samples=samples)
    batches = [
        shares_and_derivatives(
            cells,
            sun.inside,
            matrices.scene.sensors(),
            samples=samples,
            seed=_seed(matrices, batch),
            by_groups=by_groups,
        )
        for batch in range(BATCHES)
    ]
    return [SunlitRoom(cells[0], layers) for layers in zip(*batches, strict=True)]


def reflected_to_sensors(
    matrices: PhaseMatrices, sun: ReflectedSun, groups: Sequence[tuple[int, GroupCoefficients]]
) -> list[tuple[NDArray[np.float64], NDArray[np.float64], Estimate]]:
    """Illuminance to add to that of the sensors through groups in a state each [S, L] [lx].

    Returns: of each group what is added, the part of it that is the sun's beam in the room, and
        what was traced of it, in the hours h with sun [S, h].
    """
    seen = iter(_outdoors_seen(matrices, sun, groups))
    beams = _open_beams(matrices, sun, [g for g, one in groups if beam_matrix(one.optics).any()])
    return [
        _to_sensors(matrices, sun, beams, one, g, next(seen) if one.straight is not None else ()) for g, one in groups
    ]


def _open_beams(matrices: PhaseMatrices, sun: ReflectedSun, groups: Sequence[int]) -> dict[int, list[OpenBeamLight]]:
    """Light of the sensors by the beam through open groups that the room reflects, by specular path."""
    scene, sampling = matrices.scene, matrices.sampling
    if not (scene.interior.reflectance > 0).any():
        return {}
    scenes = _scenes(matrices, sun)
    samples, points, seeds = _sensor_samples(matrices, ROOM_SHARE), sampling.sun_points, tuple(_seeds(matrices))

    @cache
    def room() -> SunlitRoom:
        return _sunlit(matrices, sun, None)[0]

    def traced(g: int) -> list[OpenBeamLight]:
        return [OpenBeamLight.of(room().shares, flux) for flux in _open_flux(matrices, sun, room().cells, g)]

    return {
        g: open_beam_light(scenes, (g, *scene.sensors(), sun.suns[0], samples, points, seeds), partial(traced, g))
        for g in dict.fromkeys(groups)
    }


def _scenes(matrices: PhaseMatrices, sun: ReflectedSun) -> SunScenes:
    """The room and what is in front of its window groups, for sensors that see both."""
    scene = matrices.scene
    key = scene.interior, scene.exterior, tuple(scene.groups), tuple(matrices.parts.groups)
    return SunScenes(sun.inside, sun.outside, key, matrices.cache)


def beams_in_rooms(
    matrices: PhaseMatrices, sun: ReflectedSun, rooms: Sequence[SunlitRoom | None], group: GroupCoefficients, g: int
) -> list[NDArray[np.float64]]:
    """The sun's beam through a group that rooms of one shape reflect to the sensors [n][S, L] [lx].

    Args: rooms: None where the surfaces reflect nothing.
    """
    some = [room for room in rooms if room is not None]
    found = iter(np.mean(beams_by_batch(matrices, sun, some, group, g), axis=0))
    dark = np.zeros((len(matrices.scene.sensors()[0]), len(sun.sky.illuminance)))
    return [dark if room is None else _all_hours(sun, next(found)) for room in rooms]


def beams_by_batch(
    matrices: PhaseMatrices, sun: ReflectedSun, rooms: Sequence[SunlitRoom], group: GroupCoefficients, g: int
) -> Array:
    """The same in the hours with sun, by batch [BATCHES, n, S, h]."""
    S, h = len(matrices.scene.sensors()[0]), len(sun.shining)
    if not rooms:
        return np.zeros((BATCHES, 0, S, h))
    stacked = [np.concatenate([room.shares[b] for room in rooms]) for b in range(BATCHES)]
    light = room_light(stacked, _flux(matrices, sun, rooms[0].cells, group, g), sun.suns[1])
    return np.stack(light).reshape(BATCHES, len(rooms), S, h)


def _flux(
    matrices: PhaseMatrices, sun: ReflectedSun, cells: RoomCells, group: GroupCoefficients, g: int
) -> sparse.csr_array:
    """Flux of the sun's beam through a group on the room's cells [c, BATCHES * h]."""
    tau = _open_beam(matrices, sun, g).transmittance(group.optics.scattering, sun.suns[0])
    return transmitted(_open_flux(matrices, sun, cells, g), tau)


def _open_flux(matrices: PhaseMatrices, sun: ReflectedSun, cells: RoomCells, g: int) -> list[sparse.csr_array]:
    """The same through the open group by specular path, stored with the sun."""
    if g in sun.fluxes:
        return sun.fluxes[g]
    flux = _open_beam(matrices, sun, g).flux(cells, sun.suns[0])
    stored = sum(one.nnz for other in sun.fluxes.values() for one in other)
    if stored + sum(one.nnz for one in flux) <= MOST_FLUX:
        sun.fluxes[g] = flux
    return flux


def _open_beam(matrices: PhaseMatrices, sun: ReflectedSun, g: int) -> OpenBeam:
    return OpenBeam((sun.inside, sun.outside), g, matrices.sampling.sun_points, tuple(_seeds(matrices)))


def _outdoors_seen(
    matrices: PhaseMatrices, sun: ReflectedSun, groups: Sequence[tuple[int, GroupCoefficients]]
) -> list[list[NDArray[np.float32]]]:
    """Light of the sensors from what they see straight through groups [S, h], by batch."""
    straight = [(g, o.optics.scattering) for g, o in groups if o.straight is not None]
    if not sun.before:
        return [[] for _ in straight]
    return seen_through(
        _scenes(matrices, sun),
        straight,
        matrices.scene.sensors(),
        Suns(*sun.suns),
        samples=_sensor_samples(matrices, SENSOR_SHARE),
        places=matrices.sampling.sun_points,
        seeds=_seeds(matrices),
    )


def _to_sensors(
    matrices: PhaseMatrices,
    sun: ReflectedSun,
    beams: Mapping[int, Sequence[OpenBeamLight]],
    group: GroupCoefficients,
    g: int,
    seen: Sequence[NDArray[np.float32]],
) -> tuple[NDArray[np.float64], NDArray[np.float64], Estimate]:
    """`reflected_to_sensors` of one group; seen: of `_outdoors_seen`, none without a beam."""
    parts, in_room = matrices.parts.of(g), []
    rest = [without_straight(matrices, group, q) for q in parts]
    if g in beams and beam_matrix(group.optics).any():
        tau = _open_beam(matrices, sun, g).transmittance(group.optics.scattering, sun.suns[0])
        in_room = beam_light(beams[g], tau, sun.suns[1])

    def light_of(batch: int) -> NDArray[np.float64]:
        """The light of the sensors in the hours with sun [S, h]."""
        light = np.zeros((len(matrices.scene.sensors()[0]), len(sun.shining)))
        if sun.before:
            shares = np.concatenate(rest, axis=1).astype(np.float32)
            light += shares @ _flat(sun.before[batch], parts)
        if seen:
            light += seen[batch]
        if in_room:
            light += in_room[batch]
        return light

    traced = accumulate(light_of, stopping=Stopping(BATCHES))
    by_patches = _by_patches(matrices, sun, group, rest, g)
    in_hours = np.zeros(traced.values.shape)
    for values in in_room:
        in_hours += values / BATCHES
    added = np.asarray(_all_hours(sun, traced.values) - by_patches, dtype=float)
    return added, _all_hours(sun, in_hours), traced


def replaced_luminance(sun: ReflectedSun, weights: NDArray[Any], on_patches: NDArray[Any]) -> Array:
    """Luminance outside windows [Q, K, n], summed over hours, by shadow rays less by patches.

    Args: weights: of the hours [L, n]; on_patches: the sun's weighted sum on the patches [P, n].
    """
    if not sun.before:
        return np.zeros((*sun.by_patches.shape[:2], weights.shape[1]))
    mean = sun.mean @ weights[sun.shining].astype(np.float32)
    return np.asarray(mean.reshape(*sun.by_patches.shape[:2], -1) - sun.by_patches @ on_patches)


def replaced_before(sun: ReflectedSun, shares: Array | None, hours: NDArray[np.int64]) -> Array:
    """The same in each of some hours [h], summed by rows of shares [n, Q * K]: [n, h].

    Without shares [Q * K, h].
    """
    by_patches = sun.by_patches.reshape(np.prod(sun.by_patches.shape[:2]), -1)
    if shares is not None:
        by_patches = shares @ by_patches
    values, number = np.zeros((len(by_patches), len(hours))), np.full(len(sun.sky.lit), -1)
    number[sun.shining] = np.arange(len(sun.shining))
    some = number[hours][number[hours] >= 0]
    if not sun.before or not len(some):
        return values
    light = sun.mean[:, some]
    if shares is not None:  # in single precision, as the windows' light is
        light = shares.astype(np.float32) @ light
    values[:, number[hours] >= 0] = light
    return values - times_sky(by_patches, sun.sky.lit_sun_in(hours))


def replaced_through(sun: ReflectedSun, parts: NDArray[np.int64], shares: Sequence[Array]) -> NDArray[np.float64]:
    """Light of sensors from outdoors by shadow rays less by patches, in all hours [S, L].

    Without what they see straight through the window.

    Args: shares: of the luminance outside each of some window parts [S, K].
    """
    if not sun.before:
        return np.zeros((len(shares[0]), len(sun.sky.illuminance)))
    Q, K = sun.by_patches.shape[:2]
    mean = sun.mean.reshape(Q, K, -1)[parts].reshape(len(parts) * K, -1)
    whole = np.concatenate(shares, axis=1).astype(np.float32) @ mean
    coefficients = sum(one @ sun.by_patches[q] for one, q in zip(shares, parts, strict=True))
    return _all_hours(sun, whole.astype(float)) - times_sky(coefficients, sun.sky.lit_sun)


def _by_patches(
    matrices: PhaseMatrices, sun: ReflectedSun, group: GroupCoefficients, rest: Sequence[Array], g: int
) -> NDArray[np.float64] | float:
    """The sun that the outdoors reflects in V T D s, at the sensors [S, L] [lx]."""
    if not sun.before:
        return 0.0
    pairs = zip(rest, matrices.parts.of(g), strict=True)
    coefficients = sum(shares @ sun.by_patches[q] for shares, q in pairs)
    if group.straight is not None:
        coefficients = coefficients + group.straight.values.values - group.straight.direct
    return times_sky(coefficients, sun.sky.lit_sun)


def _seeds(matrices: PhaseMatrices) -> list[int]:
    return [_seed(matrices, batch) for batch in range(BATCHES)]


def _seed(matrices: PhaseMatrices, batch: int) -> int:
    return matrices.sampling.seed * BATCHES + batch


def _sensor_samples(matrices: PhaseMatrices, share: int) -> int:
    return max(matrices.sampling.sensor_samples // share // BATCHES, 4)


def _flat(before: NDArray[np.float32], parts: NDArray[np.int64] | None = None) -> Array:
    """Luminance [Q, K, h] one part after the other [Q * K, h], of all or of some."""
    if parts is not None and len(parts) < len(before):
        before = before[list(parts)]
    return before.reshape(len(before) * before.shape[1], before.shape[2])


def _all_hours(sun: ReflectedSun, values: Array) -> NDArray[np.float64]:
    """Values [..., h] of the hours with sun as values [..., L] of all."""
    whole = np.zeros((*values.shape[:-1], len(sun.sky.illuminance)))
    whole[..., sun.shining] = values
    return whole
