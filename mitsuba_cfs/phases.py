"""Phase methods: matrices times a sky, for illuminance, irradiance and luminance of a year."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray


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
