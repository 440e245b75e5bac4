"""The skies of a year, with cached directions of the sun."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.matrices.cache import MatrixCache, cached_or_computed
from mitsuba_cfs.methods.scene import Sampling
from mitsuba_cfs.sky.annual import AnnualSky, annual_sky
from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.sky.weather import Weather


def skies_for(
    weather: Weather,
    method: str,
    sampling: Sampling,
    cache: MatrixCache | None = None,
    /,
    **choices: str,
) -> AnnualSky:
    """Sky patches and sun of the year as a method needs them; the same for every room.

    Args: cache: of the sun's directions; choices: `RoomOptions.sky`.
    """
    towards = cached_sun_directions(weather, choices.get("sun_model", "spa"), cache)
    return annual_sky(
        weather, sampling.subdivision, sun=method != "three-phase", solar=True, towards=towards,
        **choices,
    )  # fmt: skip


def cached_sun_directions(
    weather: Weather, model: str, cache: MatrixCache | None
) -> NDArray[np.float64]:
    """Directions to the sun [H, 3] of a weather: `sun_directions`, cached on disk.

    The Solar Position Algorithm and its library take half a second, about as long as all else of a
    study's case whose matrices are cached.
    """
    place = (weather.latitude_deg, weather.longitude_deg, weather.timezone_h, weather.elevation_m)
    air = (weather.pressure_pa, weather.dry_bulb_c)
    times = np.asarray(weather.midpoints.asi8)
    entry = None if cache is None else cache.entry(
        "sun directions", *place, weather.turned_deg, model, times, *air,
        by=sun_directions.__module__,
    )  # fmt: skip
    return cached_or_computed(entry, lambda: sun_directions(weather, model=model))
