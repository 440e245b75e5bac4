"""Rooms whose surfaces have colours: light indoors in a few bands of reflectance.

What sensors receive through the windows after all reflections, V(lambda), depends on the wavelength
by the reflectances of the surfaces alone.  Paths that meet surfaces f, g, ... have the product of
their reflectances, so that V(lambda) is nearly in the span of

    1,  rho_f,  rho_f rho_g,  rho_f m / (1 - m),  rho_f rho_g m / (1 - m)

m the mean reflectance by area.  It is traced in the visible band and in the few channels that
interpolate these functions, with the same random numbers:

    V(lambda) = sum over q of b_q(lambda) V_q

Source of the choice of channels: Drmac and Gugercin 2016, SIAM J. Sci. Comput. 38, A631 (Q-DEIM).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.spectral_factor import SpectralFactor
from mitsuba_cfs.methods.coefficients import beam_matrix
from mitsuba_cfs.methods.phase_light import PhaseLight, beam_by_patches, sensor_light, traced_states
from mitsuba_cfs.methods.phase_matrices import PhaseMatrices, with_exchange, with_sensors
from mitsuba_cfs.methods.reflected_sun import SunlitRoom, beams_in_rooms, sunlit_room
from mitsuba_cfs.spectra.channels import Channels
from mitsuba_cfs.spectra.detectors import visible_mean
from mitsuba_cfs.surfaces import Surfaces

Array = NDArray[np.float64]
BAND_ERROR = 1e-3  # largest part of the functions that the bands leave out, where the constant is 1
MOST_BANDS = 12
MOST_SPECTRA = 12  # of surfaces whose products are taken; of more their principal components
LEAST_WEIGHT = 0.05  # of a channel to which no detector responds
EXACT = 100.0  # weight of the constant: light without a reflection


@dataclass(frozen=True, slots=True)
class ReflectanceBands:
    """Bands in which a room is traced: the visible one, then some of the channels."""

    reflectance: Array  # [Q, F] of the surfaces, that of visible light first
    shares: Array  # [C, Q] b_q


def reflectance_bands(visible: Array, reflectance: Array, area: Array, channels: Channels) -> ReflectanceBands:
    """The bands that interpolate the light of a room.

    Args: visible: [F] reflectances; reflectance: [F, C] by channel; area: [F] of the surfaces [m2].
    """
    whole = np.column_stack([visible, reflectance])  # [F, 1 + C]
    functions, weights = _functions(whole, area / area.sum()), _weights(channels)
    weighted, chosen = functions * weights[:, None], [0]
    while True:
        shares = functions[1:] @ np.linalg.pinv(functions[chosen], rcond=1e-10)
        left_out = (functions[1:] - shares @ functions[chosen]) * weights[1:, None]
        if np.abs(left_out).max(initial=0.0) <= BAND_ERROR or len(chosen) == MOST_BANDS:
            return ReflectanceBands(whole[:, chosen].T, shares)
        # next the channel that the others know least of
        basis = np.linalg.qr(weighted[chosen].T)[0]
        rest = weighted - (weighted @ basis) @ basis.T
        chosen.append(int(np.argmax((rest**2).sum(axis=1))))


def _functions(reflectance: Array, share: Array) -> Array:
    """What the light of a room is made of [1 + C, n], weighted by shares [F] of the area."""
    distinct, of = np.unique(np.round(reflectance, 4), axis=0, return_inverse=True)
    weight = np.bincount(of.ravel(), share).astype(float)
    mean = share @ reflectance
    if len(distinct) > MOST_SPECTRA:
        _, size, right = np.linalg.svd(np.sqrt(weight)[:, None] * distinct, full_matrices=False)
        distinct = size[:MOST_SPECTRA, None] * right[:MOST_SPECTRA]
        weight = np.ones(MOST_SPECTRA)
    first = weight[:, None] * distinct
    second = (first[:, None] * first[None]).reshape(-1, reflectance.shape[1])
    later = mean / np.maximum(1.0 - mean, 0.05)
    constant = np.full((1, reflectance.shape[1]), EXACT)
    functions: Array = np.concatenate([constant, first, second, first * later, second * later]).T
    return functions


def _weights(channels: Channels) -> Array:
    """How much detectors respond to the visible band and to the channels [1 + C], 1 at most."""
    response = np.abs(channels.detection)
    relative = (response / response.max(axis=1, keepdims=True)).max(axis=0)
    return np.concatenate([[1.0], np.maximum(relative, LEAST_WEIGHT)])


@dataclass(frozen=True, slots=True)
class RoomInBand:
    """The room of a light in one of its bands of reflectance."""

    matrices: PhaseMatrices
    mirrored: tuple[tuple[float, ...], ...]  # [G][J] what windows reflect of the room's light, over visible
    beams: tuple[tuple[Array | None, ...], ...]  # [G][J] as `SensorLight.beam_in_room`, of traced states


def rooms_in_bands(
    light: PhaseLight, reflectance: Array | None, factors: Sequence[Sequence[SpectralFactor]], channels: Channels
) -> tuple[tuple[RoomInBand, ...], Array]:
    """The room in each of its bands [Q], that of visible light first, and their shares [C, Q].

    Windows reflect the room's light as surfaces of their own.

    Args:
        reflectance: diffuse reflectance of the interior's surfaces [F, N]; None: all are neutral.
        factors: of the systems of the light [G][J].
    """
    lit, states = sensor_light(light), tuple(map(traced_states, light.systems))
    seen = tuple(tuple(of[j].beam_in_room for j in js) for of, js in zip(lit, states, strict=True))
    interior, matrices = light.scene.interior, light.matrices
    neutral = tuple(tuple(1.0 for _ in of) for of in factors)
    visible = RoomInBand(matrices, neutral, seen)
    if not len(interior.triangles):
        return (visible,), np.ones((channels.count, 1))
    own, by_channel, area = _by_surface(interior, reflectance, channels)
    panes: dict[int, tuple[Array, float]] = {}
    for of, group in zip(factors, light.scene.groups, strict=True):
        panes |= {id(one): (one.mirrored, group.area) for one in of if one.mirrored is not None}
    rows = [spectrum for spectrum, _ in panes.values()]
    bands = reflectance_bands(
        np.array([*own, *map(visible_mean, rows)]),
        np.array([*by_channel, *map(channels.mean, rows)]),
        np.array([*area, *(size for _, size in panes.values())]),
        channels,
    )
    number, surfaces = {key: len(own) + i for i, key in enumerate(panes)}, bands.reflectance[:, : len(own)]
    coloured = np.flatnonzero((surfaces != own).any(axis=1))
    traced = {int(q): _in_band(matrices, _with(interior, surfaces[q])) for q in coloured}
    beams, rooms = dict(zip(traced, _beams(light, list(traced.values()), seen), strict=True)), [visible]
    for q, values in enumerate(bands.reflectance[1:], start=1):
        mirrored = tuple(
            tuple(_over(values, bands.reflectance[0], number.get(id(factor))) for factor in of) for of in factors
        )
        rooms.append(RoomInBand(traced.get(q, matrices), mirrored, beams.get(q, seen)))
    return tuple(rooms), bands.shares


def _over(values: Array, visible: Array, number: int | None) -> float:
    """A value over the visible one; 1 where there is none."""
    if number is None or not visible[number]:
        return 1.0
    return float(values[number] / visible[number])


def _by_surface(interior: Surfaces, reflectance: Array | None, channels: Channels) -> tuple[Array, Array, Array]:
    """Visible reflectance [F], that by channel [F, C] and area [F] of the surfaces.

    Args: reflectance: [F, N]; None: all are neutral.
    """
    F = int(interior.surface.max()) + 1
    if reflectance is not None and len(reflectance) < F:
        raise ValueError(f"reflectance: expected a row for each of {F} surfaces, got {len(reflectance)}")
    visible: Array = np.zeros(F)
    area = np.bincount(interior.surface, interior.areas, F).astype(float)
    visible[interior.surface] = interior.reflectance
    if reflectance is None:
        return visible, np.repeat(visible[:, None], channels.count, axis=1), area
    return visible, np.minimum(channels.mean(reflectance[:F]), _most(interior, F)[:, None]), area


def _most(interior: Surfaces, count: int) -> Array:
    """Largest diffuse reflectance of the surfaces [F]: what their gloss leaves."""
    gloss = interior.gloss or (None,) * count
    return np.array([1.0 if one is None else 1.0 - one.at_normal for one in gloss[:count]])


def _with(interior: Surfaces, values: Array) -> Surfaces:
    """The surfaces with other reflectances [F]."""
    return replace(interior, reflectance=values[interior.surface])


def _in_band(matrices: PhaseMatrices, interior: Surfaces) -> PhaseMatrices:
    """The matrices of the same room with other reflectances: V, and W where it has been traced."""
    scene = replace(matrices.scene, interior=interior, by_groups=None)
    other = with_sensors(replace(matrices, scene=scene, sensors=None, exchange=None, view=None, sunlit=None))
    return with_exchange(other, indoors=matrices.exchange is not None)


def _beams(
    light: PhaseLight, rooms: list[PhaseMatrices], visible: tuple[tuple[Array | None, ...], ...]
) -> list[tuple[tuple[Array | None, ...], ...]]:
    """The sun's beam that each room reflects to the sensors [Q][G][J]."""
    if not rooms:
        return []
    sun, lit, states = light.reflected, sensor_light(light), tuple(map(traced_states, light.systems))
    known: dict[tuple[int, int], list[Array | None]] = {}
    shown: list[SunlitRoom | None] = []
    if sun is not None:
        for one in rooms:
            inside = one.scenes.scene(one.scene.interior, one.scene.groups)
            shown.append(sunlit_room(one, replace(sun, inside=inside)))
    for g, of_group in enumerate(states):
        for i, j in enumerate(of_group):
            group = lit[g][j].coefficients
            if visible[g][i] is None or not beam_matrix(group.optics).any():
                known[g, i] = [visible[g][i]] * len(rooms)
            elif sun is None:
                known[g, i] = [beam_by_patches(replace(light, matrices=one), group, g) for one in rooms]
            else:
                known[g, i] = list(beams_in_rooms(light.matrices, sun, shown, group, g))
    return [
        tuple(tuple(known[g, i][q] for i in range(len(of_group))) for g, of_group in enumerate(states))
        for q in range(len(rooms))
    ]
