"""The standard error of the sensors' illuminance by the phase methods, from their tracing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.methods.coefficients import (
    GroupCoefficients,
    beam_matrix,
    direct_daylight,
    reflected_shares,
    sensor_matrix,
    without_straight,
)
from mitsuba_cfs.methods.optics import SystemOptics, combinations, neighbours
from mitsuba_cfs.methods.phase_light import PhaseLight, State, coefficients_in_state, sensor_light, states_of
from mitsuba_cfs.methods.reflected_sun import replaced_luminance
from mitsuba_cfs.methods.subdivision import coarse_sky
from mitsuba_cfs.methods.window_reflection import (
    reflects,
    reflects_outdoors,
    variance_by_outdoors,
    variance_by_room,
    with_exchange_of,
)
from mitsuba_cfs.metrics.noise import Noise

Array = NDArray[np.float64]
# by weights of the hours, not negative and 0 in most of them [S, L]; None: 1 everywhere
NoiseOfSums: TypeAlias = Callable[[Array | None], Noise]


def noise_of_sums(light: PhaseLight, state: State | None, illuminance: Array) -> NoiseOfSums:
    """Noise [S + 1] of each sensor's illuminance times weights, summed over the hours, by weights.

    That of V, D, B, C_ds, the reflected sun, and W and X of what windows reflect; those of
    different groups and states are taken as independent.  The error that D leaves as a mean over a
    part of a group is included (`mitsuba_cfs.methods.subdivision`).  What windows reflect, and D's
    means, have the same share of the illuminance as in the mean over all hours.  A state that is the
    mean of two traced ones has the noise of the nearer.

    Args: illuminance: that of the sensors in this state, the eye last [S + 1, L] [lx].
    """
    rows, total = _traced(light, states_of(light, state)), illuminance.sum(axis=1)
    of_method = _of_method(light, rows)

    def noise(weights: Array | None) -> Noise:
        if weights is None:
            return _of_tracing(light, rows, None) + of_method
        weighted = (weights * illuminance).sum(axis=1)
        share = np.divide(weighted, total, out=np.zeros_like(total), where=total > 0)
        return _of_tracing(light, rows, weights) + of_method.scaled(share)

    return noise


def _traced(light: PhaseLight, rows: State) -> State:
    """The states [G, L], of which each mean of two others is the nearer of these."""
    nearer = []
    for row, states in zip(rows, light.systems, strict=True):
        pairs = [neighbours(states, j) for j in range(len(states))]
        own = [j if pair is None else pair[pair[2] > 0.5] for j, pair in enumerate(pairs)]
        nearer.append(np.array(own, dtype=np.int64)[row])
    return np.stack(nearer) if nearer else rows


def relative_error_under(light: PhaseLight, sky: Array, state: int = 0) -> Array:
    """Relative standard error of the sensors under one sky without the sun [S], such as that of DF.

    That of V and D; a group with fewer states is in its last.

    Args: sky: [P] luminance of the patches.
    """
    matrices, sensors = light.matrices, sensor_light(light)
    noise = Noise.none(len(light.scene.sensors()[0]))
    for g, states in enumerate(sensors):
        group = states[min(state, len(states) - 1)].coefficients
        for q in matrices.parts.of(g):
            noise += _part_noise(light, group, q, sky[:, None], None)
        if group.straight is not None:
            noise += Noise.of(*group.straight.values.variance_of(sky))
    count = len(light.scene.points)
    total, error = coefficients_in_state(light, state)[:count] @ sky, noise.standard_error()[:count]
    return np.divide(error, total, out=np.zeros_like(total), where=total > 0)


def _of_tracing(light: PhaseLight, rows: State, weights: Array | None) -> Noise:
    """Noise of each sensor's weighted sum over the hours by V, D, B, C_ds and the reflected sun.

    Of the sun that is computed by shadow rays the matrices have no part.

    Args:
        rows: [G, L] state of each window group in each hour.
        weights: [S, L]; None: 1 everywhere.
    """
    matrices, reflected = light.matrices, light.reflected
    noise = Noise.none(len(light.scene.sensors()[0]))
    outdoors, skies = len(light.scene.outdoor_groups), {}
    for g, row in enumerate(rows):
        for j in np.unique(row):
            one, some = sensor_light(light)[g][j], row == j
            group = one.coefficients
            of_hours = some[:, None] * (np.ones(1) if weights is None else weights.T)
            if some.tobytes() not in skies:  # those of most groups are the same
                skies[some.tobytes()] = _weighted_sky(light, some, weights)
            whole, of_sun, rest = skies[some.tobytes()]
            sun, seen = None, whole
            if reflected is not None and g < outdoors:
                sun, seen = (of_sun, replaced_luminance(reflected, of_hours, of_sun)), rest
            for q in matrices.parts.of(g):
                noise += _part_noise(light, group, q, seen, sun)
            if group.straight is not None:
                noise += Noise.of(*group.straight.values.variance_of(seen.T))
            for beam in one.sun_noise:
                noise += Noise.of(*beam.variance_of(of_hours.T), shared=True)
    return noise


def _weighted_sky(light: PhaseLight, some: NDArray[np.bool_], weights: Array | None) -> tuple[Array, ...]:
    """Sums over some hours: the whole sky, the sun alone, and the rest [P, 1] or [P, S]."""
    sky = light.sky
    if weights is None:
        whole, of_sun, rest = (one[:, None] for one in sky.totals(some))
        return whole, of_sun, rest
    hours = np.flatnonzero(some & weights.any(axis=0))
    factors = weights[:, hours].T
    whole = sky.whole[:, hours] @ factors
    if sky.sun is None:
        return whole, np.zeros_like(whole), np.zeros_like(whole)
    return whole, sky.sun_alone(hours) @ factors, sky.without_sun(hours) @ factors


def _of_method(light: PhaseLight, rows: State) -> Noise:
    """Noise of each sensor's sum over the hours by W and X, and the error of D's means."""
    count, hours = len(light.scene.sensors()[0]), len(light.sky.lit)
    variance = np.zeros(count)
    for kind, some in combinations(rows):
        variance = variance + _exchange_variance(light, light.optics(kind), some)
    for g, row in enumerate(rows):
        means = np.zeros(count)
        for j in np.unique(row):
            means += _error_of_means(light, sensor_light(light)[g][j].coefficients, g, row == j)
        variance = variance + means**2
    shared = variance * hours**2
    return Noise(np.zeros(count), shared, np.zeros(count))


def _exchange_variance(light: PhaseLight, optics: Sequence[SystemOptics], hours: NDArray[np.int64]) -> Array:
    """Variance of each sensor's mean over the sky's hours by the noise of W and X [S].

    Args:
        optics: of the parts [Q] in some of the hours.
        hours: which; the light of the others is taken as 0.
    """
    matrices, sky = with_exchange_of(light.matrices, optics), light.sky
    view = sensor_matrix(matrices)
    variance = np.zeros(len(view.values))
    inwards, outwards = reflects(optics), reflects_outdoors(matrices, optics)
    if not inwards and not outwards:
        return variance
    some = np.isin(np.arange(len(sky.lit)), hours)
    before = matrices.daylight.values @ (sky.totals(some)[0] / len(sky.lit))
    if inwards and matrices.exchange is not None:
        pairs = zip(optics, before, strict=True)
        luminance = np.stack([one.transmission @ values for one, values in pairs])
        variance += variance_by_room(view.values, matrices.exchange, optics, luminance)
    shares = reflected_shares(matrices, optics).before
    if shares is not None and matrices.outdoor_exchange is not None:
        if light.reflected is not None:
            sun = sky.totals(some)[1][:, None]
            replaced = replaced_luminance(light.reflected, some[:, None], sun)[..., 0]
            before = before + replaced / len(sky.lit)
        variance += variance_by_outdoors(shares, matrices.outdoor_exchange, optics, before)
    return variance


def _part_noise(
    light: PhaseLight, group: GroupCoefficients, q: int, sky: Array, sun: tuple[NDArray[np.floating], ...] | None
) -> Noise:
    """Noise of the sensors [S] by V and D of a part of a group in a state.

    Args:
        sky: luminance [P, 1], or that of each sensor [P, S].
        sun: that of the sun on its patches [P, 1 or S], and the luminance that the outdoors
            reflects of it to the window patches, less that in D [Q, K, 1 or S].
    """
    matrices, T = light.matrices, group.optics.transmission
    view, daylight = sensor_matrix(matrices), matrices.daylight.part(np.s_[q])
    before = daylight.values @ sky
    if sun is not None:
        on_patches, replaced = sun
        before = before + daylight.values @ on_patches + replaced[q]
        direct = direct_daylight(matrices)[q] @ on_patches
        through = T @ before - beam_matrix(group.optics) @ direct
    else:
        through = T @ before
    seen = np.maximum(through, 0.0).T
    # the sensors' first reflections are at the same points of the room
    by_view = Noise.of(*view.part(np.s_[:, q]).variance_of(seen), shared=True)
    # the rows of D are independent: each has rays of its own
    by_row = without_straight(matrices, group, q) ** 2 * daylight.variances_of(sky).T
    of_rows = (by_row**2).sum(axis=1) / (daylight.batches - 1)
    by_daylight = Noise(np.zeros(len(by_row)), by_row.sum(axis=1), of_rows)
    return by_view + by_daylight


def _error_of_means(light: PhaseLight, group: GroupCoefficients, g: int, some: NDArray[np.bool_]) -> Array:
    """Error of the sensors' mean [S] by D's means over a group's parts, in some of the hours."""
    matrices = light.matrices
    points, normals = light.scene.sensors()
    whole, _, rest = light.sky.totals(some)
    total = (rest if matrices.five_phase else whole)[:, None]
    mean = coarse_sky(total, matrices.sampling.subdivision)  # of the sum: a hundredth of the work
    if g >= len(matrices.parts.cells) or not mean.any():
        return np.zeros(len(points))
    through = group.optics.transmission
    if group.straight is not None:
        through = through - np.diag(group.beam)
    error: Array = matrices.parts.cells[g].error(points, normals, through, mean / len(some))
    return error[:, 0]
