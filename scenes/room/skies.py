"""The skies of a year and the cached directions of the sun."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.matrices.cache import MatrixCache, kept_or_found
from mitsuba_cfs.methods.scene import Sampling
from mitsuba_cfs.sky.annual import AnnualSky, annual_sky
from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.sky.weather import Weather


def kept_sun(weather: Weather, model: str, cache: MatrixCache | None) -> NDArray[np.float64]:
    """`sun_directions` [H, 3] of a weather, found in a cache or put there.

    The Solar Position Algorithm and the library that brings it take half a second, which a study
    whose matrices are kept would spend on little else.
    """
    place = (weather.latitude_deg, weather.longitude_deg, weather.timezone_h, weather.elevation_m)
    air = (weather.pressure_pa, weather.dry_bulb_c)
    times = np.asarray(weather.midpoints.asi8)
    entry = None if cache is None else cache.entry(
        "sun directions", *place, weather.turned_deg, model, times, *air,
        by=sun_directions.__module__,
    )  # fmt: skip
    return kept_or_found(entry, lambda: sun_directions(weather, model=model))


def skies_for(
    weather: Weather,
    method: str,
    sampling: Sampling,
    cache: MatrixCache | None = None,
    /,
    **choices: str,
) -> AnnualSky:
    """The year's skies as a method needs them; the same for every room.

    Args: cache: where the sun's directions are found and kept; choices: `RoomOptions.sky`.
    """
    with_sun = method != "three-phase"
    towards = kept_sun(weather, choices.get("sun_model", "spa"), cache)
    return annual_sky(
        weather, sampling.subdivision, sun=with_sun, solar=True, towards=towards, **choices
    )
