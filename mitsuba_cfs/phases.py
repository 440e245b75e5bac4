"""Phase methods: matrices times a sky, for illuminance, irradiance and luminance of a year."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, slots=True)
class PhaseMatrices:
    """What of a room does not depend on its systems: traced once for all their states."""

    view: NDArray[np.float64]  # V [S, G, K]
    daylight: NDArray[np.float64]  # D [G, K, P]
    direct_view: NDArray[np.float64] | None = None  # V_d [S, G, K], `max_depth=1`
    direct_daylight: NDArray[np.float64] | None = None  # D_d [G, K, P], `max_depth=1`

    def __post_init__(self) -> None:
        (_, groups, patches), shape = self.view.shape, self.daylight.shape
        if shape[:2] != (groups, patches):
            raise ValueError(f"V is {self.view.shape}, D is {shape}: groups or patches differ")
        for name, whole in (("direct_view", self.view), ("direct_daylight", self.daylight)):
            part = getattr(self, name)
            if part is not None and part.shape != whole.shape:
                raise ValueError(f"{name}: expected {whole.shape}, got {part.shape}")


def window_radiance(daylight: ArrayLike, sky: ArrayLike) -> NDArray[np.float64]:
    """Radiance of each window patch seen from the window, D s [G, K, H].

    Args:
        daylight: daylight matrices D [G, K, P].
        sky: sky matrix s [P, H], luminance [cd/m2] or radiance [W/m2/sr].
    """
    return np.matmul(np.asarray(daylight), np.asarray(sky))


def room_side_radiance(
    transmission: Sequence[ArrayLike], daylight: ArrayLike, sky: ArrayLike
) -> NDArray[np.float64]:
    """Radiance that each window patch sends into the room, T D s [G, K, H].

    Args:
        transmission: for each group its T [K, K], `KlemsBsdf.transmission_matrix()`.
        daylight, sky: as for `window_radiance`.
    """
    daylight = np.asarray(daylight)
    if len(transmission) != len(daylight):
        raise ValueError(f"{len(transmission)} transmission matrices for {len(daylight)} groups")
    through = np.stack([np.asarray(t) @ d for t, d in zip(transmission, daylight, strict=True)])
    return np.matmul(through, np.asarray(sky))


def three_phase(
    view: ArrayLike, transmission: Sequence[ArrayLike], daylight: ArrayLike, sky: ArrayLike
) -> NDArray[np.float64]:
    """Illuminance [lx] or irradiance [W/m2] at sensors, E = V T D s [S, H].

    Args:
        view: view matrices V [S, G, K].
        transmission, daylight, sky: as for `room_side_radiance`.

    Source: Ward, Mistrick, Lee, McNeil, Jonsson 2011, LEUKOS 7:241-261.
    """
    view, daylight = np.asarray(view), np.asarray(daylight)
    if view.shape[1] != len(daylight):
        raise ValueError(f"the view matrices have {view.shape[1]} groups, D has {len(daylight)}")
    coefficients = sum(
        view[:, g] @ (np.asarray(transmission[g]) @ daylight[g]) for g in range(len(daylight))
    )
    return coefficients @ np.asarray(sky)


def five_phase(
    three_phase: ArrayLike, direct_three_phase: ArrayLike, direct_sun: ArrayLike, sun: ArrayLike
) -> NDArray[np.float64]:
    """Illuminance with the exact sun, V T D s - V_d T D_d s_d + C_ds s_sun [S, H].

    Args:
        three_phase: V T D s [S, H] under the whole sky.
        direct_three_phase: V_d T D_d s_d [S, H]: direct view (`max_depth=1`), direct daylight
            (`max_depth=1`) and the sun alone on the sky's patches.  Traced with the seed and the
            samples of V and D it is never more than `three_phase`, so nothing gets negative.
        direct_sun: C_ds [S, Q] for the discs Q, see `mitsuba_cfs.trace.direct_sun`.
        sun: luminance [cd/m2] of each disc [Q, H], sparse or dense, or [H] where disc h is the
            sun of hour h.

    Source: McNeil and Lee 2013, "Annual daylighting performance of a passive optical light shelf";
    McNeil 2013, "The five-phase method for simulating complex fenestration with Radiance".
    """
    difference = np.asarray(three_phase) - np.asarray(direct_three_phase)
    direct_sun = np.asarray(direct_sun)
    if getattr(sun, "ndim", 2) == 1:
        return difference + direct_sun * np.asarray(sun)
    return difference + direct_sun @ sun


def beam_at_sun_angle(
    reflected_view: ArrayLike,
    transmission: Sequence[ArrayLike],
    through: ArrayLike,
    through_sun: ArrayLike,
    direct_daylight: ArrayLike,
    sun: ArrayLike,
) -> NDArray[np.float64]:
    """What the five-phase sum lacks where the room reflects the sun's beam [S, H].

        (V - V_d) diag(tau(sun) - tau) D_d s_d

    V T D s passes the beam with one transmittance in a whole patch, C_ds with that of the sun's
    own angle.  Added to the sum this gives the reflected beam the sun's own too.  It takes away no
    more than V T D s - V_d T D_d s_d holds.

    Args:
        reflected_view: V - V_d [S, G, K].
        transmission: for each group its T [K, K].
        through: [G, K] tau, what of T's diagonal goes straight on: the beam at the patches'
            middles, `mitsuba_cfs.trace.direct_sun.patch_beams`.
        through_sun: [G, H] tau(sun), `mitsuba_cfs.trace.direct_sun.through_beams`.
        direct_daylight: D_d [G, K, P].
        sun: s_d [P, H], the sun alone on the sky's patches.
    """
    reflected_view, through_sun = np.asarray(reflected_view), np.asarray(through_sun)
    total = np.zeros((len(reflected_view), through_sun.shape[1]))
    for g, at_sun in enumerate(through_sun):
        patches = np.minimum(np.asarray(through)[g], np.diag(np.asarray(transmission[g])))
        window = np.asarray(direct_daylight)[g] @ np.asarray(sun)
        view = reflected_view[:, g]
        total += (view @ window) * at_sun - (view * patches) @ window
    return total


def three_phase_states(
    view: ArrayLike, states: Sequence[Mapping[str, ArrayLike]], daylight: ArrayLike, sky: ArrayLike
) -> list[dict[str, NDArray[np.float64]]]:
    """What each window group gives in each of its states, V T D s [S, H]: for each group by name.

    Args:
        view, daylight, sky: as for `three_phase`.
        states: for each group its T [K, K] by the state's name, such as
            `[{"up": T_glass, "40 degrees": T_blind}]`.
    """
    view, daylight, sky = np.asarray(view), np.asarray(daylight), np.asarray(sky)
    if not len(states) == view.shape[1] == len(daylight):
        raise ValueError(
            f"states of {len(states)} groups, V of {view.shape[1]}, D of {len(daylight)}"
        )
    return [
        {name: (view[:, g] @ np.asarray(t) @ daylight[g]) @ sky for name, t in group.items()}
        for g, group in enumerate(states)
    ]


def scheduled(
    parts: Sequence[Mapping[str, ArrayLike]], schedule: Sequence[ArrayLike]
) -> NDArray[np.float64]:
    """Illuminance [S, H] when each group is in the state that its schedule names for the hour.

    Args:
        parts: [S, H] of each group by state, `three_phase_states` or
            `mitsuba_cfs.trace.direct_sun.five_phase_states`.
        schedule: for each group the names of its states [H].

    Raises: `ValueError` for a state that the group does not have.
    """
    if len(parts) != len(schedule):
        raise ValueError(f"schedules of {len(schedule)} groups for {len(parts)}")
    total = 0.0
    for g, (group, names) in enumerate(zip(parts, schedule, strict=True)):
        names = np.asarray(names)
        unknown = sorted(set(names.tolist()) - set(group))
        if unknown:
            raise ValueError(f"group {g}: no state {unknown[0]!r}, only {', '.join(group)}")
        chosen = np.zeros(np.shape(next(iter(group.values()))))
        for name, values in group.items():
            hours = names == name
            chosen[:, hours] = np.asarray(values)[:, hours]
        total = total + chosen
    return total
