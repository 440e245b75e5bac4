"""The standard error of the sensors' illuminance by the phase methods, from their tracing."""

from __future__ import annotations

from collections.abc import Sequence

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
from mitsuba_cfs.methods.optics import SystemOptics, combinations
from mitsuba_cfs.methods.phase_light import (
    PhaseLight,
    State,
    coefficients_in_state,
    sensor_light,
    states_of,
)
from mitsuba_cfs.methods.reflected_sun import replaced_luminance
from mitsuba_cfs.methods.subdivision import coarse_sky
from mitsuba_cfs.methods.window_reflection import (
    reflects,
    reflects_outdoors,
    variance_by_outdoors,
    variance_by_room,
    with_exchange_of,
)

Array = NDArray[np.float64]


def relative_standard_error(light: PhaseLight, state: State | None, illuminance: Array) -> Array:
    """Relative standard error of each sensor's mean over the hours [S + 1], the eye last.

    That of V, D, B, C_ds, the reflected sun, and W and X of what windows reflect; those of
    different groups and states are taken as independent.  The error that D leaves as a mean over a
    part of a group is included (`mitsuba_cfs.methods.subdivision`).

    Args: illuminance: that of the sensors in this state, the eye last [S + 1, L] [lx].
    """
    rows, sensors = states_of(light, state), sensor_light(light)
    variance = _matrix_variance(light, rows)
    for g, row in enumerate(rows):
        share = np.bincount(row, minlength=len(sensors[g])) / len(row)
        sun = sum(w * one.sun_error for w, one in zip(share, sensors[g], strict=True))
        variance = variance + (sun / len(row)) ** 2
    for kind, hours in combinations(rows):
        variance = variance + _exchange_variance(light, light.optics(kind), hours)
    mean = illuminance.mean(axis=1)
    return np.divide(np.sqrt(variance), mean, out=np.zeros_like(mean), where=mean > 0)


def relative_error_under(light: PhaseLight, sky: Array, state: int = 0) -> Array:
    """Relative standard error of the sensors under one sky without the sun [S], such as that of DF.

    That of V and D; a group with fewer states is in its last.

    Args: sky: [P] luminance of the patches.
    """
    matrices, sensors = light.matrices, sensor_light(light)
    count = len(light.scene.points)
    variance = np.zeros(count)
    for g, states in enumerate(sensors):
        group = states[min(state, len(states) - 1)].coefficients
        for q in matrices.parts.of(g):
            variance += _part_variance(light, group, q, sky, None)[:count]
        if group.straight is not None:
            variance += group.straight.values.error_of(sky)[:count] ** 2
    total = coefficients_in_state(light, state)[:count] @ sky
    return np.divide(np.sqrt(variance), total, out=np.zeros_like(total), where=total > 0)


def _matrix_variance(light: PhaseLight, rows: State) -> Array:
    """Variance of each sensor's mean over the hours by V, D and B [S], and by D's means.

    Of the sun that is computed by shadow rays the matrices have no part.

    Args: rows: [G, L] state of each window group in each hour.
    """
    matrices, sky, reflected = light.matrices, light.sky, light.reflected
    variance = np.zeros(len(light.scene.sensors()[0]))
    hours = len(sky.lit)
    outdoors = len(light.scene.outdoor_groups)
    for g, row in enumerate(rows):
        by_means = np.zeros(len(variance))
        for j in np.unique(row):
            group, some = sensor_light(light)[g][j].coefficients, row == j
            whole, of_sun, rest = sky.totals(some)
            if reflected is not None and g < outdoors:
                mean = rest / hours
                sun = of_sun / hours, replaced_luminance(reflected, some) / hours
            else:
                mean, sun = whole / hours, None
            for q in matrices.parts.of(g):
                variance += _part_variance(light, group, q, mean, sun)
            if group.straight is not None:
                variance += group.straight.values.error_of(mean) ** 2
            by_means += _error_of_means(light, group, g, some)
        variance += by_means**2
    return variance


def _exchange_variance(
    light: PhaseLight, optics: Sequence[SystemOptics], hours: NDArray[np.int64]
) -> Array:
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
            before = before + replaced_luminance(light.reflected, some) / len(sky.lit)
        variance += variance_by_outdoors(shares, matrices.outdoor_exchange, optics, before)
    return variance


def _part_variance(
    light: PhaseLight,
    group: GroupCoefficients,
    q: int,
    sky: Array,
    sun: tuple[Array, Array] | None,
) -> Array:
    """Variance of the sensors [S] by V and D of a part of a group in a state.

    Args:
        sky: [P] mean luminance.
        sun: that of the sun on its patches [P], and the luminance that the outdoors reflects of it
            to the window patches, less that in D [Q, K].
    """
    matrices, T = light.matrices, group.optics.transmission
    view = sensor_matrix(matrices)
    before = matrices.daylight.values[q] @ sky
    if sun is not None:
        on_patches, replaced = sun
        before = before + matrices.daylight.values[q] @ on_patches + replaced[q]
        direct = direct_daylight(matrices)[q] @ on_patches
        through = T @ before - beam_matrix(group.optics) @ direct
    else:
        through = T @ before
    by_view = view.part(np.s_[:, q]).error_of(np.maximum(through, 0.0))
    by_daylight = (
        without_straight(matrices, group, q) ** 2
        @ matrices.daylight.part(np.s_[q]).error_of(sky) ** 2
    )
    variance: Array = by_view**2 + by_daylight
    return variance


def _error_of_means(
    light: PhaseLight, group: GroupCoefficients, g: int, some: NDArray[np.bool_]
) -> Array:
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
