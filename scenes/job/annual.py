"""Glare of every lit hour of a room's view."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.glare.annual import AnnualGlare, annual_glare
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.progress import Progress, part
from mitsuba_cfs.sky.weather import Weather
from scenes.job.pictures import PictureMaker

COLUMNS = {"dgp": "dgp", "ev": "Ev", "dgi": "dgi", "ugr": "ugr", "sources": "sources"}


def rated_hours(
    maker: PictureMaker, state: int, columns: NDArray[np.int64], progress: Progress
) -> AnnualGlare:
    """Glare of some lit hours [n] with the windows in a state."""
    pictures = maker.of_state(state, columns)
    return annual_glare(pictures, geometry=GlareView(pictures.view), progress=progress)


def glare_by_state(maker: PictureMaker, progress: Progress) -> NDArray[np.float64]:
    """DGP of every hour in every state [J, H], 0 in the dark."""
    every, J = np.arange(len(maker.skies.lit)), len(maker.lights)
    lit = [
        rated_hours(maker, j, every, part(progress, j / J, (j + 1) / J, "glare control")).dgp
        for j in range(J)
    ]
    return maker.skies.whole_year(np.stack(lit))


def glare_of_year(maker: PictureMaker, weather: Weather, progress: Progress) -> pd.DataFrame:
    """Glare of every hour [H] with the state that holds in it; NaN in the dark."""
    table = np.full((maker.skies.hours, len(COLUMNS)), np.nan)
    used = np.unique(maker.state).tolist()
    for i, j in enumerate(used):
        columns = np.flatnonzero(maker.state == j)
        steps = part(progress, i / len(used), (i + 1) / len(used), "annual glare")
        rated = rated_hours(maker, j, columns, steps)
        table[maker.skies.lit[columns]] = np.stack(
            [getattr(rated, name) for name in COLUMNS.values()], axis=1
        )
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
