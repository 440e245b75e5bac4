"""Daylight coefficients: illuminance of the sensors per unit luminance of each sky patch.

    V T D + B - V_d diag(tau) D

B is the outdoors that the sensors see straight through the direct transmittance tau of a window
group.  It replaces V_d and D there: patches of 10 to 15 degrees blur the sky that a sensor sees
(11 % of a sensor's light beside a small opening), and means over a group blur edges that only some
of its points see, and the lobe of a glossy facade.  The three-phase method takes B for groups in
parts, for glass to another room, and where the outdoors is glossy; elsewhere the sum over patches.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.evaluate import held_beams
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.methods.optics import States, SystemOptics, straight_transmittance
from mitsuba_cfs.methods.phase_matrices import INDOOR_DEPTH, OUTDOOR_DEPTH, PhaseMatrices, has_sharp_beam
from mitsuba_cfs.methods.window_reflection import (
    by_way_of_outdoors,
    reflects,
    reflects_outdoors,
    sensor_reflection,
    through,
    with_exchange_of,
)
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping
from mitsuba_cfs.trace.kernels.path_options import PathOptions
from mitsuba_cfs.trace.kernels.scattering import patch_beams
from mitsuba_cfs.trace.matrices.adjacent import adjacent_view
from mitsuba_cfs.trace.matrices.straight_view import straight_view_matrix

BATCHES = 4
ON_DIAGONAL = 0.98  # least share of a direct transmittance that is on T's diagonal
INNER_SHARE = 8  # rays of a sensor that glass to another room is looked for with, for each of V
Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class StraightView:
    """The outdoors or the adjacent room that sensors see through a group in one state."""

    values: Estimate  # B [S, P]
    direct: Array | None  # B_d [S, P], without what the outdoors reflects; None with the three-phase method


@dataclass(frozen=True, slots=True)
class GroupCoefficients:
    """Daylight coefficients of the sensors, the eye last, through one group in one state."""

    optics: SystemOptics
    beam: Array  # tau [K], the direct transmittance on T's diagonal
    straight: StraightView | None  # None where the method takes V T D alone
    whole: Array  # [S, P] V T D + B - V_d diag(tau) D
    by_sun: Array | None  # [S, P] what is computed at the sun's own angle instead; five phases


def group_coefficients(matrices: PhaseMatrices, systems: Sequence[States]) -> tuple[tuple[GroupCoefficients, ...], ...]:
    """Coefficients of each window group in each of its states [G][J].

    Args: matrices: with those of the sensors; systems: the states of each window group [G].
    """
    return tuple(tuple(_of_group(matrices, optics, g) for optics in states) for g, states in enumerate(systems))


def _of_group(matrices: PhaseMatrices, optics: SystemOptics, g: int) -> GroupCoefficients:
    view = sensor_matrix(matrices)
    daylight, beam = matrices.daylight.values, direct_transmittance(matrices, optics, g)
    straight = _straight_view(matrices, optics, g, beam)
    whole = np.zeros((len(view.values), daylight.shape[-1]))
    bare = GroupCoefficients(optics, beam, straight, whole, None)
    for q in matrices.parts.of(g):
        whole += without_straight(matrices, bare, q) @ daylight[q]
    if straight is not None:
        whole = whole + straight.values.values
    if not matrices.five_phase:
        return replace(bare, whole=whole)
    return replace(bare, whole=whole, by_sun=_by_sun(matrices, bare, g))


def _by_sun(matrices: PhaseMatrices, group: GroupCoefficients, g: int) -> Array:
    """The part of the coefficients that five phases replace by the sun at its own angle [S, P].

    V_d T D_d + (V - V_d) T_b D_d + B_d - V_d diag(tau) D_d
    """
    daylight = direct_daylight(matrices)
    coefficients = np.zeros((len(direct_sensor_matrix(matrices)), daylight.shape[-1]))
    for q in matrices.parts.of(g):
        coefficients += sun_shares(matrices, group, q) @ daylight[q]
    if group.straight is None or group.straight.direct is None:
        return coefficients
    return coefficients + group.straight.direct


def sun_shares(matrices: PhaseMatrices, group: GroupCoefficients, q: int) -> Array:
    """Light of the sensors per unit luminance of D_d before a part, replaced by the sun [S, K].

    V_d T + (V - V_d) T_b - V_d diag(tau)
    """
    whole, direct = sensor_matrix(matrices).values[:, q], direct_sensor_matrix(matrices)[:, q]
    lost, beams = group.optics.transmission, beam_matrix(group.optics)
    if group.straight is not None:
        lost = lost - np.diag(group.beam)
    shares: Array = direct @ lost + (whole - direct) @ beams
    return shares


def without_straight(matrices: PhaseMatrices, group: GroupCoefficients, q: int) -> Array:
    """Light of the sensors per unit luminance before a part of a group, without B [S, K].

    V T - V_d diag(tau)
    """
    shares: Array = sensor_matrix(matrices).values[:, q] @ group.optics.transmission
    if group.straight is None:
        return shares
    return shares - direct_sensor_matrix(matrices)[:, q] * group.beam


def direct_transmittance(matrices: PhaseMatrices, optics: SystemOptics, g: int) -> Array:
    """The part of T's diagonal that goes straight on, tau [K], of a group in a state.

    0 where the diagonal has less than the direct transmittance: the cells of a tensor tree span
    patches, and what T has of it beside the diagonal would be counted twice.
    """
    inner = g - len(matrices.scene.outdoor_groups)
    if inner >= 0:
        return matrices.scene.adjacent[inner].beam
    omega = KLEMS_FULL.projected_solid_angles()
    beam = patch_beams([optics.scattering], KLEMS_FULL)[0]
    on_diagonal = straight_transmittance(optics)
    if omega @ on_diagonal < ON_DIAGONAL * (omega @ beam):
        return np.zeros_like(on_diagonal)
    return on_diagonal


def beam_matrix(optics: SystemOptics) -> Array:
    """The part of T that goes straight on, T_b [K, K]."""
    beams = patch_beams([optics.scattering], KLEMS_FULL)[0]
    return held_beams(optics.transmission, beams, KLEMS_FULL)


def _straight_view(matrices: PhaseMatrices, optics: SystemOptics, g: int, beam: Array) -> StraightView | None:
    """B and B_d of a group in a state; None where the method takes none."""
    if not beam.any():
        return None
    scene, chosen = matrices.scene, matrices.sampling
    paths = partial(
        PathOptions, stopping=Stopping(batches=BATCHES), seed=chosen.seed, cache=matrices.cache, scenes=matrices.scenes
    )
    inner = g - len(scene.outdoor_groups)
    if inner >= 0:  # nothing comes straight from the sky
        values = adjacent_view(
            (scene.interior, scene.groups),
            g,
            beam,
            matrices.adjacent[inner],
            scene.sensors(),
            paths(INNER_SHARE * chosen.sensor_samples // BATCHES, INDOOR_DEPTH),
        )
        return StraightView(values, np.zeros_like(values.values) if matrices.five_phase else None)
    if not has_sharp_beam(matrices, g):
        return None
    scattering = [optics.scattering if i == g else None for i in range(len(scene.groups))]

    def traced(depth: int) -> Estimate:
        matrix = straight_view_matrix(
            scene.interior,
            scene.exterior,
            scene.groups,
            scattering,
            *scene.sensors(),
            paths=paths(max(chosen.sensor_samples // BATCHES, 1), depth),
            subdivision=chosen.subdivision,
        )
        return matrix.part(np.s_[g])

    values = traced(OUTDOOR_DEPTH)
    if not matrices.five_phase:
        return StraightView(values, None)
    reflecting = len(scene.exterior.triangles) > 0
    return StraightView(values, traced(1).values if reflecting else values.values)


@dataclass(frozen=True, slots=True)
class ReflectedShares:
    """Light of the sensors per unit luminance outside the windows, by reflection in these.

    None where there is none.
    """

    before: Array | None  # [S, Q * K] light by the room alone, of windows that reflect outdoors
    outwards: Array | None  # [S, Q * K] by way of the outdoors
    coefficients: Array | None  # [S, P] of the sky: by both, the room's and the outdoors' light


def reflected_shares(matrices: PhaseMatrices, optics: Sequence[SystemOptics]) -> ReflectedShares:
    """Light of the sensors by reflection in the windows, computed once for the same systems.

    Args: optics: of the window parts [Q].
    """
    matrices = with_exchange_of(matrices, optics)
    inwards = matrices.exchange if reflects(optics) else None
    outdoors = matrices.outdoor_exchange if reflects_outdoors(matrices, optics) else None
    of = sensor_matrix(matrices), matrices.daylight, inwards, outdoors
    return matrices.recent.of(_reflected_shares, *of, *optics)


def _reflected_shares(
    view: Estimate, daylight: Estimate, exchange: Estimate | None, outdoors: Estimate | None, *optics: SystemOptics
) -> ReflectedShares:
    """Of V, D, W and X."""
    shares: Array | None = None
    whole, before, outwards = view.values.reshape(len(view.values), -1), None, None
    if exchange is not None:
        inwards = sensor_reflection(view.values, exchange.values, optics)
        shares, whole = through(optics, inwards).astype(float), whole + inwards
    if outdoors is not None:
        before = through(optics, whole)
        outwards = by_way_of_outdoors(outdoors.values, optics, before)
        shares = outwards if shares is None else shares + outwards
    of_sky = None
    if shares is not None:
        of_sky = shares @ daylight.values.reshape(shares.shape[1], -1)
    return ReflectedShares(before, outwards, of_sky)


def sensor_matrix(matrices: PhaseMatrices) -> Estimate:
    """V [S, Q, K]; `ValueError` where it has not been traced."""
    if matrices.sensors is None:
        raise ValueError("the matrices have none of the sensors: with_sensors(matrices)")
    return matrices.sensors


def direct_sensor_matrix(matrices: PhaseMatrices) -> Array:
    """V_d [S, Q, K]; `ValueError` where it has not been traced."""
    if matrices.direct_sensors is None:
        raise ValueError("the matrices have no V_d of the sensors: with_sensors(matrices)")
    return matrices.direct_sensors


def direct_daylight(matrices: PhaseMatrices) -> Array:
    """D_d [Q, K, P]; `ValueError` where it has not been traced."""
    if matrices.direct_daylight is None:
        raise ValueError("the matrices have no D_d: with_direct_daylight(matrices)")
    return matrices.direct_daylight
