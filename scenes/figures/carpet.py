"""Carpet plots: a year at one look, days from left to right and hours of the day upwards."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from scenes.figures.chart import Chart
from scenes.figures.picture import png_uri
from scenes.figures.scale import ColourScale, Tick
from scenes.language.catalogue import gettext
from scenes.language.numbers import short_month


def day_grid(times: pd.DatetimeIndex, values: ArrayLike) -> NDArray[np.float64]:
    """Values [H] as [steps of a day, days]; row 0 is the last step of the day, NaN where none."""
    values = np.asarray(values, dtype=float)
    days = (times.normalize() - times[0].normalize()).days.to_numpy()
    seconds = (times - times.normalize()).total_seconds().to_numpy()
    steps = steps_per_day(times)
    row = np.minimum((seconds / 86400 * steps).astype(int), steps - 1)
    grid = np.full((steps, int(days.max()) + 1), np.nan)
    grid[steps - 1 - row, days] = values
    return grid


def steps_per_day(times: pd.DatetimeIndex) -> int:
    """Number of intervals in a day: from the shortest step between times, at least 24."""
    if len(times) < 2:
        return 24
    gaps = np.diff(times.to_numpy()).astype("timedelta64[s]").astype(int)
    shortest = max(int(gaps[gaps > 0].min()), 60) if (gaps > 0).any() else 3600
    return max(24, round(86400 / shortest))


def month_ticks(times: pd.DatetimeIndex) -> tuple[Tick, ...]:
    """The months in the middle of their days; single dates where there is less than 40 days."""
    first, last = times[0].normalize(), times[-1].normalize()
    count = (last - first).days + 1
    if count < 40:
        step = max(1, count // 7)
        return tuple(
            Tick(100 * (day + 0.5) / count, f"{date.day}", f" {short_month(date.month)}", line=False)
            for day in range(0, count, step)
            for date in [first + pd.Timedelta(days=day)]
        )
    ticks = []
    for start in pd.date_range(first.replace(day=1), last, freq="MS"):
        begin = max((start - first).days, 0)
        end = min((start + pd.offsets.MonthBegin(1) - first).days, count)
        if end - begin >= 14:
            at = 100 * (begin + end) / 2 / count
            name = short_month(start.month)
            ticks.append(Tick(at, name[0], name[1:], line=False))
    return tuple(ticks)


def hour_ticks() -> tuple[Tick, ...]:
    """Every third hour of the day."""
    return tuple(Tick(100 * h / 24, f"{h:02d}", ":00") for h in range(0, 25, 6))


def carpet(
    times: pd.DatetimeIndex, values: ArrayLike, scale: ColourScale, *, title: str, explanation: str, digits: int = 0
) -> Chart:
    """Carpet plot of values [H] in the colours of the scale; NaN is left empty."""
    grid = day_grid(times, values)
    factor = 10**digits
    coded = np.where(np.isnan(grid), -32768, np.clip(np.nan_to_num(grid) * factor, -32767, 32767))
    pointer = {
        "start": f"{times[0]:%Y-%m-%d}",
        "rows": grid.shape[0],
        "days": grid.shape[1],
        "divide": factor,
        "unit": scale.unit,
        "values": np.round(coded).astype(int).ravel().tolist(),
    }
    return _carpet(times, scale.rgba(grid), pointer, title, explanation, scale=scale)


def class_carpet(
    times: pd.DatetimeIndex, classes: ArrayLike, legend: tuple[tuple[str, str], ...], *, title: str, explanation: str
) -> Chart:
    """Carpet plot of class numbers [H] with the legend's colours and names; -1 is left empty."""
    grid = day_grid(times, classes)
    number = np.nan_to_num(grid, nan=-1).astype(int)
    table = np.array([[int(c[i : i + 2], 16) for i in (1, 3, 5)] + [255] for c, _ in legend])
    rgba = np.vstack([table, np.zeros(4, int)]).astype(np.uint8)[number]
    pointer = {
        "start": f"{times[0]:%Y-%m-%d}",
        "rows": grid.shape[0],
        "days": grid.shape[1],
        "names": [name for _, name in legend],
        "values": number.ravel().tolist(),
    }
    return _carpet(times, rgba, pointer, title, explanation, classes=legend)


def _carpet(times, rgba, pointer, title: str, explanation: str, **legend) -> Chart:
    return Chart(
        title,
        explanation,
        x_label=gettext("Day of the year"),
        y_label=gettext("Hour of the day (local standard time)"),
        x_ticks=month_ticks(times),
        y_ticks=hour_ticks(),
        picture=png_uri(rgba),
        carpet=pointer,
        height=230,
        **legend,
    )
