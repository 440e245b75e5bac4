"""Derivatives of the sensors' illuminance by reflectances and by the windows' transmittance.

    E = V T D s,    dE / d ln(rho_n) = (dV / d ln(rho_n)) T D s

dV is traced with V, from the same paths (`mitsuba_cfs.trace.kernels.bounce_counts`); the exchange W
between windows that reflect and the cells of the sun's beam in the room have derivatives of their own.
All other matrices are those of the light: a system, a sky or a state costs a product.

    transmittance of the windows   dE / d ln(tau) = E, without what windows reflect
    reflectance of the ground      dE / d ln(rho) = V T D s_ground: E is linear in the sky's patch 0

A derivative by ln(rho) is that by a common factor of all reflectances of the group.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.methods.coefficients import GroupCoefficients, beam_matrix, direct_daylight
from mitsuba_cfs.methods.light import SeasonalLight
from mitsuba_cfs.methods.optics import combinations
from mitsuba_cfs.methods.phase_light import (
    PhaseLight,
    SensorLight,
    State,
    SunNoise,
    beam_by_patches,
    illuminance_of_all,
    sensor_light,
    sky_coefficients,
    states_of,
    traced_states,
    with_means,
)
from mitsuba_cfs.methods.phase_matrices import PhaseMatrices, exchange_by_reflectance
from mitsuba_cfs.methods.reflected_sun import SunlitRoom, beams_by_batch, replaced_through, sunlit_derivatives
from mitsuba_cfs.methods.standard_error import noise_of_sums
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate

Array = NDArray[np.float64]
STEP = 0.02  # of ln(rho), to either side: what windows reflect is not quite linear in V and W


@dataclass(frozen=True, slots=True)
class LightDerivative:
    """Derivative of the illuminance of the sensors, the eye last, by the logarithm of an input."""

    illuminance: Array  # [S + 1, L] dE / d ln(x) [lx]
    error_of_sum: Array  # [S + 1] standard error of its sum over the hours [lx]


def by_reflectances(light: PhaseLight | SeasonalLight, state: State | None = None) -> list[LightDerivative]:
    """Derivatives by ln(rho) of each group of surfaces of the scene [N].

    Args: light: of a scene with `by_groups`; state: as of `illuminance`.

    Raises: `ValueError` for a scene without groups, for path tracing.
    """
    if isinstance(light, PhaseLight):
        return _of_season(light, state)
    rows = states_of(_first(light), state) if state is not None else None
    parts = []
    for one, hours in light.seasons():
        parts.append((_of_season(_phases(one), None if rows is None else rows[:, hours]), hours))
    return [_joined([(derivatives[n], hours) for derivatives, hours in parts]) for n in range(len(parts[0][0]))]


def by_ground(light: PhaseLight | SeasonalLight, state: State | None = None) -> LightDerivative:
    """Derivative by ln(rho) of the ground that the sky's patch 0 stands for.

    Surfaces outdoors, a modelled terrain among them, keep their reflectances.
    """
    if isinstance(light, PhaseLight):
        return _ground_of_season(light, state)
    rows = states_of(_first(light), state) if state is not None else None
    parts = []
    for one, hours in light.seasons():
        parts.append((_ground_of_season(_phases(one), None if rows is None else rows[:, hours]), hours))
    return _joined(parts)


def _ground_of_season(light: PhaseLight, state: State | None) -> LightDerivative:
    rows, ground = states_of(light, state), np.zeros((len(light.scene.sensors()[0]), len(light.sky.lit)))
    variance = np.zeros(len(ground))
    for kind, hours in combinations(rows):
        of_sky = np.asarray(light.sky.whole[0, hours], dtype=float)
        ground[:, hours] = sky_coefficients(light, kind)[:, :1] * of_sky
        for q, optics in enumerate(light.optics(kind)):  # the noise of V alone: D's patch 0 has most paths
            luminance = optics.transmission @ light.matrices.daylight.values[q, :, 0] * of_sky.sum()
            variance += _view(light.matrices).part(np.s_[:, q]).error_of(luminance) ** 2
    return LightDerivative(ground, np.sqrt(variance))


def _of_season(light: PhaseLight, state: State | None) -> list[LightDerivative]:
    groups = light.scene.by_groups
    if groups is None or not light.matrices.sensors_by_reflectance:
        raise ValueError("the scene names no groups of surfaces: DaylightScene(..., by_groups=...)")
    exchange = None if light.matrices.exchange is None else exchange_by_reflectance(light.matrices)
    rooms = [] if light.reflected is None else sunlit_derivatives(light.matrices, light.reflected, groups)
    slopes = [[_slopes(light, g, j, rooms) for j in traced_states(states)] for g, states in enumerate(light.systems)]
    found = []
    for number in range(len(groups.names)):
        of_each = [[one[number] for one in of_group] for of_group in slopes]
        moved = (_moved(light, number, of_each, None if exchange is None else exchange[number], by) for by in (1, -1))
        up, down = (illuminance_of_all(one, state) for one in moved)
        derivative = (up - down) / (2 * STEP)
        noise = noise_of_sums(_slope_light(light, number, of_each), state, derivative)
        found.append(LightDerivative(derivative, noise(None).standard_error()))
    return found


def _slopes(light: PhaseLight, g: int, j: int, rooms: Sequence[SunlitRoom]) -> list[SensorLight]:
    """The derivative of the sensors' light through a group in a state, by each group of surfaces."""
    one, matrices = sensor_light(light)[g][j], light.matrices
    group, T, parts = one.coefficients, one.coefficients.optics.transmission, matrices.parts.of(g)
    passes = matrices.five_phase and beam_matrix(group.optics).any()
    beams = None
    if passes and light.reflected is not None and g < len(light.scene.outdoor_groups) and rooms:
        beams = beams_by_batch(matrices, light.reflected, rooms, group, g)  # [B, N, S, h]
    found = []
    for number, view in enumerate(matrices.sensors_by_reflectance):
        shares = [view.values[:, q] @ T for q in parts]
        whole = sum(share @ matrices.daylight.values[q] for share, q in zip(shares, parts, strict=True))
        if not matrices.five_phase:
            found.append(SensorLight(_coefficients(group, whole, None)))
            continue
        straight = beam_matrix(group.optics)
        by_sun = sum(view.values[:, q] @ straight @ direct_daylight(matrices)[q] for q in parts)
        added = np.zeros((len(view.values), len(light.sky.lit)))
        noise: tuple[SunNoise, ...] = ()
        if light.reflected is not None:
            added += replaced_through(light.reflected, parts, shares)
        elif passes:
            no_direct = np.zeros_like(view.values)
            of_view = replace(matrices, sensors=view, direct_sensors=no_direct)
            added += beam_by_patches(replace(light, matrices=of_view), group, g)
        if beams is not None and light.reflected is not None:
            shining = light.reflected.shining
            traced = _mean_of(beams[:, number])
            added[:, shining] += traced.values
            noise = (SunNoise(traced, np.ones(len(shining)), shining),)
        found.append(SensorLight(_coefficients(group, whole, by_sun), added, np.zeros_like(added), noise))
    return found


def _coefficients(group: GroupCoefficients, whole: Array, by_sun: Array | None) -> GroupCoefficients:
    """Coefficients of a derivative: what is seen straight through has none."""
    return replace(group, beam=np.zeros_like(group.beam), straight=None, whole=whole, by_sun=by_sun)


def _mean_of(batches: NDArray[np.floating]) -> Estimate:
    """The mean of batches [B, S, h] with its standard error."""
    every = batches.astype(float)
    return accumulate(lambda number: every[number], stopping=Stopping(len(every)))


def _moved(
    light: PhaseLight, number: int, slopes: Sequence[Sequence[SensorLight]], exchange: Array | None, sign: int
) -> PhaseLight:
    """The light with the reflectances of a group of surfaces a step of ln(rho) higher or lower."""
    step, matrices = sign * STEP, light.matrices
    view = _view(matrices)
    moved = replace(
        matrices, sensors=replace(view, values=view.values + step * matrices.sensors_by_reflectance[number].values)
    )
    if exchange is not None and matrices.exchange is not None:
        values = matrices.exchange.values + step * exchange
        moved = replace(moved, exchange=replace(matrices.exchange, values=values))
    sensors = []
    for states, lit, of_group in zip(light.systems, sensor_light(light), slopes, strict=True):
        pairs = zip(traced_states(states), of_group, strict=True)
        sensors.append(with_means(states, [_stepped(lit[j], slope, step) for j, slope in pairs]))
    return replace(light, matrices=moved, sensors=tuple(sensors))


def _stepped(one: SensorLight, slope: SensorLight, step: float) -> SensorLight:
    first, change = one.coefficients, slope.coefficients
    by_sun = None
    if first.by_sun is not None and change.by_sun is not None:
        by_sun = first.by_sun + step * change.by_sun
    added = one.added
    if slope.added is not None:
        added = step * slope.added + (0.0 if one.added is None else one.added)
    coefficients = replace(first, whole=first.whole + step * change.whole, by_sun=by_sun)
    return replace(one, coefficients=coefficients, added=added)


def _slope_light(light: PhaseLight, number: int, slopes: Sequence[Sequence[SensorLight]]) -> PhaseLight:
    """The derivative as a light of its own, whose noise is that of dV, D and the sun's beam."""
    view = light.matrices.sensors_by_reflectance[number]
    matrices = replace(light.matrices, sensors=view, direct_sensors=np.zeros_like(view.values))
    pairs = zip(light.systems, slopes, strict=True)
    return replace(light, matrices=matrices, sensors=tuple(with_means(states, of) for states, of in pairs))


def _joined(parts: Sequence[tuple[LightDerivative, NDArray[np.int64]]]) -> LightDerivative:
    """The derivative in all hours, from that in the hours of each season."""
    hours = np.concatenate([of for _, of in parts])
    values = np.concatenate([one.illuminance for one, _ in parts], axis=1)
    whole = np.empty_like(values)
    whole[:, hours] = values
    return LightDerivative(whole, np.sqrt(sum(one.error_of_sum**2 for one, _ in parts)))


def _view(matrices: PhaseMatrices) -> Estimate:
    if matrices.sensors is None:
        raise ValueError("the matrices have none of the sensors: with_sensors(matrices)")
    return matrices.sensors


def _phases(light: object) -> PhaseLight:
    if not isinstance(light, PhaseLight):
        raise ValueError("path tracing has no matrices: expected the light of a phase method")
    return light


def _first(light: SeasonalLight) -> PhaseLight:
    return _phases(light.lights[0])
