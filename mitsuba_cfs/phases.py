"""The products of the phase methods; `mitsuba_cfs.methods` adds them up."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

DARK = 0.05  # share of a sky matrix's entries that are lit, below which only these are multiplied


Sky: TypeAlias = ArrayLike | sparse.csr_array  # [P, H], or of few lit patches `lit_rows` of it


def lit_rows(sky: ArrayLike) -> NDArray[Any] | sparse.csr_array:
    """A sky [P, H] for products: sparse [H, P] if few patches are lit in each hour."""
    sky = np.asarray(sky)
    if not sky.size or np.count_nonzero(sky) > DARK * sky.size:
        return sky
    return sparse.csr_array(sky.T)


def times_sky(matrix: ArrayLike, sky: Sky) -> NDArray[np.float64]:
    """A matrix [..., P] times a sky [P, H], sparse if it holds the sun alone."""
    matrix = np.asarray(matrix)
    lit = sky if isinstance(sky, sparse.csr_array) else lit_rows(sky)
    if isinstance(lit, np.ndarray):
        return np.matmul(matrix, lit)
    hours, patches = lit.shape
    rows = np.ascontiguousarray(matrix.reshape(-1, patches).T)
    return np.ascontiguousarray((lit @ rows).T).reshape(*matrix.shape[:-1], hours)


def room_side_radiance(transmission: Sequence[ArrayLike], daylight: ArrayLike, sky: Sky) -> NDArray[np.float64]:
    """Radiance that each window patch sends into the room, T D s [G, K, H].

    Args:
        transmission: for each group its T [K, K], `KlemsBsdf.transmission_matrix()`.
        daylight: daylight matrices D [G, K, P].
        sky: sky matrix s [P, H], luminance [cd/m2] or radiance [W/m2/sr].
    """
    daylight = np.asarray(daylight)
    if len(transmission) != len(daylight):
        raise ValueError(f"{len(transmission)} transmission matrices for {len(daylight)} groups")
    pairs = zip(transmission, daylight, strict=True)
    hours = sky.shape[0] if isinstance(sky, sparse.csr_array) else np.shape(sky)[1]
    if hours < daylight.shape[1]:  # the least work: few hours before many directions
        return np.stack([np.asarray(t) @ times_sky(d, sky) for t, d in pairs])
    return times_sky(np.stack([np.asarray(t) @ d for t, d in pairs]), sky)


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
    coefficients = sum(view[:, g] @ (np.asarray(transmission[g]) @ daylight[g]) for g in range(len(daylight)))
    return coefficients @ np.asarray(sky)


def sun_beams(
    beams: Sequence[ArrayLike], through_sun: ArrayLike, direct_daylight: ArrayLike, sun: Sky
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The sun's straight beam on window patches, in two forms [G, K, H].

        T_b D_d s_d              as T D s has it, with one transmittance in a whole patch
        diag(tau(sun)) D_d s_d   at the sun's own angle, as C_ds has it

    V T D s + (V - V_d) times the difference gives the beam that the room reflects its own angle
    too.  It takes away no more than V T D s - V_d T D_d s_d holds.

    Args:
        beams: for each group the direct part of its T, T_b [K, K],
            `mitsuba_cfs.bsdf.evaluate.held_beams`.
        through_sun: [G, H] tau(sun), `mitsuba_cfs.trace.sun.direct.through_beams`.
        direct_daylight: D_d [G, K, P].
        sun: s_d [P, H], the sun alone on the sky's patches.
    """
    window = times_sky(direct_daylight, sun)
    by_patch = np.stack([np.asarray(T) @ lit for T, lit in zip(beams, window, strict=True)])
    return by_patch, window * np.asarray(through_sun)[:, None]
