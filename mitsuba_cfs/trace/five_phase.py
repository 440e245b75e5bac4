"""The five-phase method for a year: many window groups, each in many states, from one V and D."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs import phases
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.phases import PhaseMatrices
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.surfaces import Surfaces, WindowGroup
from mitsuba_cfs.trace.direct_sun import (
    Scattering,
    direct_sun_matrix,
    patch_beams,
    through_beams,
)
from mitsuba_cfs.trace.estimate import Stopping


@dataclass(frozen=True, slots=True)
class SystemState:
    """A fenestration system in one state, as the five-phase method takes it."""

    transmission: NDArray[np.float64]  # T [K, K], `KlemsBsdf.transmission_matrix()`
    scattering: Scattering  # of the sun


@dataclass(frozen=True, slots=True)
class SunSeries:
    """The sun of a series of hours."""

    patches: NDArray[np.float64]  # s_d [P, H], the sun alone on the sky's patches [cd/m2]
    direction: NDArray[np.float64]  # [H, 3] towards the middle of its disc
    illuminance: NDArray[np.float64]  # [H] normal to it [lx]


@dataclass(frozen=True, slots=True)
class SunlitRoom:
    """What the sun meets between the sky and the sensors."""

    interior: Surfaces
    exterior: Surfaces
    groups: Sequence[WindowGroup]
    points: NDArray[np.float64]  # [S, 3] sensor positions [m]
    directions: NDArray[np.float64]  # [S, 3] their normals


def five_phase_states(
    room: SunlitRoom,
    matrices: PhaseMatrices,
    states: Sequence[Mapping[str, SystemState]],
    sky: ArrayLike,
    sun: SunSeries,
    *,
    basis: KlemsBasis = KLEMS_FULL,
    window_points: int = 256,
    stopping: Stopping | None = None,
    seed: int = 0,
    progress: Progress = silent,
    cache: MatrixCache | None = None,
) -> list[dict[str, NDArray[np.float64]]]:
    """What each window group gives in each of its states [S, H]: for each group by name.

        V T D s - V_d T D_d s_d + (V - V_d) diag(tau(sun) - tau) D_d s_d + C_ds s_sun

    The third term gives the beam that the room reflects the transmittance of the sun's own angle,
    as C_ds has it; see `mitsuba_cfs.phases.beam_at_sun_angle`.  `phases.scheduled` adds the groups
    up for a schedule of states.  The sun is followed only in hours when it stands before the group.

    Args:
        matrices: V, D and their direct parts, traced with one seed and one number of samples.
        states: for each group its states by name.
        sky: s [P, H], the whole sky, the sun among it.
        window_points, stopping, seed, cache: of `direct_sun_matrix`.
    """
    if matrices.direct_view is None or matrices.direct_daylight is None:
        raise ValueError("the five-phase method needs V_d and D_d, traced with max_depth=1")
    if len(states) != len(room.groups):
        raise ValueError(f"states of {len(states)} groups for {len(room.groups)}")
    count, done, result = sum(map(len, states)), 0, []
    for g, group in enumerate(states):
        found = {}
        for name, state in group.items():
            found[name] = _one_state(
                room, matrices, g, state, np.asarray(sky), sun, basis,
                window_points=window_points, stopping=stopping, seed=seed, cache=cache,
                progress=part(progress, done / count, (done + 1) / count, "direct sun"),
            )  # fmt: skip
            done += 1
        result.append(found)
    return result


def _one_state(
    room: SunlitRoom,
    matrices: PhaseMatrices,
    g: int,
    state: SystemState,
    sky: NDArray[np.float64],
    sun: SunSeries,
    basis: KlemsBasis,
    **options,
) -> NDArray[np.float64]:
    """Illuminance [S, H] by one group in one state."""
    one = slice(g, g + 1)
    view, direct_view = matrices.view[:, one], matrices.direct_view[:, one]
    daylight, direct_daylight = matrices.daylight[one], matrices.direct_daylight[one]
    group, transmission = room.groups[one], [state.transmission]
    whole = phases.three_phase(view, transmission, daylight, sky)
    direct = phases.three_phase(direct_view, transmission, direct_daylight, sun.patches)
    beams = patch_beams([state.scattering], basis)
    at_sun = through_beams(group, [state.scattering], sun.direction)
    found = whole - direct
    found += phases.beam_at_sun_angle(
        view - direct_view, transmission, beams, at_sun, direct_daylight, sun.patches
    )
    lit = np.flatnonzero((sun.illuminance > 0) & (sun.direction @ group[0].frame[2] > 0))
    if not len(lit):
        return found
    towards = sun.direction[lit]
    ways = [state.scattering if k == g else None for k in range(len(room.groups))]
    exact = direct_sun_matrix(
        room.interior, room.exterior, room.groups, ways, room.points, room.directions, towards,
        **options,
    )  # fmt: skip
    found[:, lit] += exact.values * (sun.illuminance[lit] / SUN_SOLID_ANGLE)
    return found
