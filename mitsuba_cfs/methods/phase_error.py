"""The standard error of sensors' light by the matrices of the phase methods."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.methods.optics import SystemOptics
from mitsuba_cfs.methods.phase_scene import PhaseScene
from mitsuba_cfs.methods.reflected_sun import ReflectedSunLight
from mitsuba_cfs.methods.straight_views import StraightViews
from mitsuba_cfs.methods.subdivision import coarse_sky
from mitsuba_cfs.methods.window_reflection import WindowReflection
from mitsuba_cfs.sky.annual import AnnualSky


def matrix_variance(
    traced: PhaseScene,
    straight: StraightViews,
    sky: AnnualSky,
    state: NDArray[np.int64],
    reflected: ReflectedSunLight | None,
) -> NDArray[np.float64]:
    """Variance of each sensor's mean over the hours by V, D and B [S], with what D's means leave.

    Args:
        state: [G, L] of each window group in each hour.
        reflected: the sun that is taken by shadow rays; of it the matrices have no part.
    """
    found = np.zeros(len(traced.scene.sensors()[0]))
    hours = len(sky.lit)
    outdoors = len(traced.scene.outdoor_groups)
    for g, row in enumerate(state):
        left = np.zeros(len(found))
        by_rays = reflected is not None and g < outdoors
        for j in np.unique(row):
            some = row == j
            whole, of_sun, rest = sky.totals(some)
            mean, sun = (rest if by_rays else whole) / hours, None
            if by_rays:
                sun = of_sun / hours, reflected.replaced(some) / hours
            for q in traced.parts.of(g):
                found += _part_variance(traced, straight, (g, j, q), mean, sun)
            seen = straight.matrix(g, j)
            if seen is not None:
                found += seen.error_of(mean) ** 2
            left += _left_by_means(traced, straight, (g, j), sky, some)
        found += left**2
    return found


def exchange_variance(
    traced: PhaseScene,
    mirrored: WindowReflection,
    optics: Sequence[SystemOptics],
    sky: AnnualSky,
    hours: NDArray[np.int64],
    reflected: ReflectedSunLight | None,
) -> NDArray[np.float64]:
    """Variance of each sensor's mean over the sky's hours by the noise of W and X [S].

    Args:
        optics: of the parts [Q] in some of the hours.
        hours: which; in the others the light is taken as none.
        reflected: as for `matrix_variance`.
    """
    found = np.zeros(len(traced.scene.sensors()[0]))
    inwards, outwards = mirrored.reflects(optics), mirrored.reflects_outdoors(optics)
    if not inwards and not outwards:
        return found
    some = np.isin(np.arange(len(sky.lit)), hours)
    before = traced.daylight.values @ (sky.totals(some)[0] / len(sky.lit))
    if inwards:
        through = np.stack([o.transmission @ i for o, i in zip(optics, before, strict=True)])
        found += mirrored.variance_by_room(optics, through)
    if outwards:
        if reflected is not None:
            before = before + reflected.replaced(some) / len(sky.lit)
        found += mirrored.variance_by_outdoors(optics, before)
    return found


def _part_variance(
    traced: PhaseScene,
    straight: StraightViews,
    which: tuple[int, int, int],
    sky: NDArray[np.float64],
    sun: tuple[NDArray[np.float64], NDArray[np.float64]] | None,
) -> NDArray[np.float64]:
    """Variance of the sensors [S] by V and D of a part of a group in a state.

    Args: sky: [P] mean luminance; sun: the sun's on its patches [P], and what the outdoors send
        of it to the windows' patches less what D has of that [Q, K].
    """
    g, j, q = which
    transmission, before = straight.transmission(g, j), traced.daylight.values[q] @ sky
    if sun is not None:
        on_patches, replaced = sun
        before = before + traced.daylight.values[q] @ on_patches + replaced[q]
        direct = traced.direct_daylight[q] @ on_patches
        through = transmission @ before - straight.held(g, j) @ direct
    else:
        through = transmission @ before
    by_view = traced.sensors.part(np.s_[:, q]).error_of(np.maximum(through, 0.0))
    by_daylight = straight.rest(g, j, q) ** 2 @ traced.daylight.part(np.s_[q]).error_of(sky) ** 2
    return by_view**2 + by_daylight


def _left_by_means(
    traced: PhaseScene,
    straight: StraightViews,
    which: tuple[int, int],
    sky: AnnualSky,
    some: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """What means over a group's parts change in the sensors' mean [S] in some of the hours."""
    g, j = which
    points, normals = traced.scene.sensors()
    whole, _, rest = sky.totals(some)
    total = (rest if traced.five_phase else whole)[:, None]
    mean = coarse_sky(total, traced.sampling.subdivision)  # of the sum: a hundredth of the work
    if g >= len(traced.parts.cells) or not mean.any():
        return np.zeros(len(points))
    through = straight.transmission(g, j)
    if straight.matrix(g, j) is not None:
        through = through - np.diag(straight.beam(g, j))
    error = traced.parts.cells[g].error(points, normals, through, mean / len(some))
    return error[:, 0]
