"""Glare of every lit hour of a room's view."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.glare.evaluation import GlareOptions
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.methods.seasonal_light import SeasonalLight
from mitsuba_cfs.progress import Progress, part
from mitsuba_cfs.sky.weather import Weather

COLUMNS = {
    "dgp": "dgp",
    "dgp_standard_error": "dgp_standard_error",
    "ev": "Ev",
    "dgi": "dgi",
    "ugr": "ugr",
    "sources": "sources",
}


def glare_by_state(
    light: PhaseLight | SeasonalLight, rating: GlareOptions, progress: Progress
) -> NDArray[np.float64]:
    """DGP of every hour in every state [J, H], 0 in the dark."""
    J, count = light.filled.states, len(light.sky.lit)
    lit = [
        hourly_glare(
            light, "DGP", np.full(count, j), options=rating,
            progress=part(progress, j / J, (j + 1) / J, "glare control"),
        ).dgp
        for j in range(J)
    ]  # fmt: skip
    return light.sky.whole_year(np.stack(lit))


def glare_of_year(
    light: PhaseLight | SeasonalLight,
    state: NDArray[np.int64],
    weather: Weather,
    *,
    rating: GlareOptions,
    progress: Progress,
) -> pd.DataFrame:
    """Glare of every hour [H] with the state [L] that holds in it; NaN in the dark."""
    rated = hourly_glare(
        light, "DGP", state, options=rating, progress=part(progress, 0.0, 1.0, "annual glare")
    )
    table = np.full((light.sky.hours, len(COLUMNS)), np.nan)
    table[light.sky.lit] = np.stack([getattr(rated, name) for name in COLUMNS.values()], axis=1)
    frame = pd.DataFrame(table, index=weather.midpoints, columns=list(COLUMNS))
    return frame.rename_axis("time")


def worst_hours(year: pd.DataFrame, count: int) -> list[int]:
    """The hours of the year [indices] of the highest DGP, one a day, the worst first."""
    order = np.argsort(-year["dgp"].fillna(-1).to_numpy(), kind="stable")
    chosen: list[int] = []
    days: set = set()
    for hour in order.tolist():
        day = year.index[hour].date()
        if day not in days and year["dgp"].iloc[hour] == year["dgp"].iloc[hour]:
            chosen.append(hour)
            days.add(day)
        if len(chosen) == count:
            break
    return chosen
