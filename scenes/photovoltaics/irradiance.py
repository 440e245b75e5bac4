"""Irradiance of photovoltaic cells hour by hour, shaded by all that stands around them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pvlib
from numpy.typing import NDArray

from bim.model import Element
from bim.to_tracer import element_surfaces
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import Progress, item, silent
from mitsuba_cfs.sky.matrix import series_matrix, sky_series
from mitsuba_cfs.sky.three_part import three_part
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.trace.matrices.daylight import sky_irradiance_matrix
from mitsuba_cfs.trace.sun.shade import sunlit_shares
from scenes.photovoltaics.modules import PvModule

WHOLE_DEGREES = np.arange(91.0)
SUBDIVISION = 4  # Reinhart's MF of the sky


@dataclass(frozen=True, slots=True)
class CellIrradiance:
    """Irradiance of every group of cells [S], modules in order; sunlit time steps only [h]."""

    steps: NDArray[np.int64]  # [h] time steps of the weather with light
    plain: NDArray[np.float32]  # [S, h] on the plane [W/m2]
    effective: NDArray[np.float32]  # [S, h] less what the glass reflects off normal incidence
    module: NDArray[np.int64]  # [S] number of the module
    diffuse_error: float  # standard error of the effective annual diffuse irradiance, relative


def cell_irradiance(
    elements: Sequence[Element],
    modules: Sequence[PvModule],
    weather: Weather,
    *,
    samples: int = 8192,
    seed: int = 0,
    progress: Progress = silent,
    cache: MatrixCache | None = None,
) -> CellIrradiance:
    """Annual irradiance of the modules' cells, with and without angle-of-incidence losses.

        E = C sky + (C - C_1) sun + share cos(theta) DNI

    C are the sky coefficients with reflections, C_1 those of the sky that the cell sees itself, so
    that the sun's own beam comes from its exact disc and what surfaces reflect of it from C.  For
    the effective irradiance C is weighted by the glass's incidence angle modifier direction by
    direction, and the beam by that of its angle.

    Source: modifier: De Soto, Klein and Beckman 2006, doi:10.1016/j.solener.2005.06.010 (pvlib
    `iam.physical`).
    """
    surfaces = element_surfaces(elements, "solar")
    points = np.concatenate([module.points for module in modules])
    edges = np.concatenate([module.edges for module in modules])
    number = np.repeat(np.arange(len(modules)), [len(module.points) for module in modules])
    normals = np.stack([module.normal for module in modules])[number]
    series = three_part(sky_series(weather, "solar"))
    steps = np.flatnonzero(series.diffuse_horizontal + series.direct_normal > 0)
    sky, sun = (
        series_matrix(series, steps, SUBDIVISION, part, ground_reflectance=weather.albedo, dtype=np.float32)
        for part in ("sky", "sun")
    )
    shares = sunlit_shares(surfaces, points, normals, series.sun[steps], edges=edges, seed=seed, progress=progress)
    cosine = np.maximum(normals @ series.sun[steps].T, 0.0)
    beam = shares * cosine * series.direct_normal[steps]
    modifier = pvlib.iam.physical(WHOLE_DEGREES)
    results, error = [], 0.0
    for before, acceptance in ((0, None), (2, modifier)):
        whole, own = (
            sky_irradiance_matrix(
                surfaces,
                points,
                normals,
                subdivision=SUBDIVISION,
                acceptance=acceptance,
                samples=samples,
                max_depth=depth,
                seed=seed,
                cache=cache,
                progress=item(progress, "sky irradiance", before + k, 4, whole=True),
            )
            for k, depth in enumerate((16, 1), 1)
        )
        diffuse = whole.values.astype(np.float32) @ sky
        diffuse += np.maximum(whole.values - own.values, 0.0).astype(np.float32) @ sun
        annual = sky.sum(axis=1, dtype=float)
        error = float(np.median(whole.error_of(annual) / (whole.values @ annual)))
        taken = 1.0
        if acceptance is not None:
            angle = np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0)))
            taken = np.interp(angle, WHOLE_DEGREES, modifier)
        results.append((diffuse + beam * taken).astype(np.float32))
    return CellIrradiance(steps, *results, number, error)
