"""Figures of a room's daylight: plans of the metrics and the year's illuminance as a carpet."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scenes.figures.carpet import carpet
from scenes.figures.chart import Chart
from scenes.figures.plan import FloorPlan, plan, plan_frame
from scenes.figures.scale import ColourScale, round_limits
from scenes.language.catalogue import gettext
from scenes.language.numbers import percent, rounded, significant
from scenes.report.headline import sensor_column
from scenes.report.names import quantity
from scenes.results import RoomYear, RunResult

DARK_LX = 1.0  # less than this is night, left empty


def plans(room: RoomYear, beside: Sequence[RoomYear] = ()) -> tuple[FloorPlan, ...]:
    """Plans of daylight autonomy, useful illuminance, daylight factor, direct sun and the mean.

    Args: beside: rooms, or cases of this one, whose values the scales reach to as well.
    """
    daylight, view = room.daylight, room.glare.view
    eye = (np.asarray(view.position), np.asarray(view.direction)) if room.glare.pictures else None
    frame = plan_frame(room.space, daylight.points, eye)
    pictures = []
    for names in (("da300", "da_300", "da"), ("udi_100_3000", "udi_300_3000", "udi_useful", "udi")):
        if column := useful_column(room, names):
            q = quantity(column)
            values = daylight.sensor_metrics[column].to_numpy(dtype=float)
            scale = ColourScale(0, 100, q.label, "%")
            pictures.append(plan(frame, values, scale, title=q.label, explanation=_mean(values, "%", q.meaning)))
    if column := sensor_column(room, "daylight_factor", "df"):
        values = daylight.sensor_metrics[column].to_numpy(dtype=float)
        scale = _from_zero(_of_all(column, room, beside), gettext("Daylight factor"), "%")
        digits = 1 if scale.high > 1 else 2
        text = _mean(values, "%", quantity("daylight_factor").meaning)
        pictures.append(plan(frame, values, scale, title=gettext("Daylight factor"), explanation=text, digits=digits))
    column = sensor_column(room, "sunlit_hours")
    if column and (every := _of_all(column, room, beside)).any():
        values = daylight.sensor_metrics[column].to_numpy(dtype=float)
        scale = _from_zero(every, gettext("Sunlit hours"), "h")
        text = quantity("sunlit_hours").meaning
        pictures.append(plan(frame, values, scale, title=gettext("Sunlit hours"), explanation=text))
    values = daylight.illuminance.mean(axis=0)
    every = np.concatenate([one.daylight.illuminance.mean(axis=0) for one in (room, *beside)])
    scale = _from_zero(every, gettext("Annual mean illuminance"), "lx")
    text = _mean(values, "lx", quantity("annual_mean").meaning)
    pictures.append(plan(frame, values, scale, title=gettext("Annual mean illuminance"), explanation=text))
    return tuple(pictures)


def _of_all(column: str, room: RoomYear, beside: Sequence[RoomYear]) -> NDArray[np.float64]:
    """A metric of the sensors of a room and those beside it."""
    result = [one.daylight.sensor_metrics for one in (room, *beside)]
    return np.concatenate([one[column].to_numpy(dtype=float) for one in result if column in one])


def useful_column(room: RoomYear, names: tuple[str, ...]) -> str | None:
    """The column of these names; of useful illuminances the one with two limits."""
    columns = list(room.daylight.sensor_metrics)
    ranges = [c for c in columns if c.startswith("udi") and "–" in quantity(c).label]
    if names[0].startswith("udi") and ranges:
        useful = [c for c in ranges if c in names]
        return useful[0] if useful else ranges[-1]
    return sensor_column(room, *names)


def illuminance_carpet(result: RunResult, room: RoomYear) -> Chart:
    """Median over the work plane for each hour."""
    median = np.median(room.daylight.illuminance, axis=1).astype(float)
    lit = median >= DARK_LX
    scale = ColourScale(30, 10000, gettext("Median illuminance"), "lx", logarithmic=True)
    text = gettext("Illuminance exceeded on half of the work plane in each hour; nights are blank.")
    if lit.any():
        text += " " + gettext(
            "Median of the {hours} daylit hours: {lux} lx.",
            hours=rounded(lit.sum(), 0),
            lux=significant(float(np.median(median[lit])), 2),
        )
    values = np.where(lit, median, np.nan)
    return carpet(result.times, values, scale, title=gettext("Illuminance of the work plane"), explanation=text)


def _from_zero(values, label: str, unit: str) -> ColourScale:
    return ColourScale(0.0, top_of_scale(values), label, unit)


def top_of_scale(values) -> float:
    """A round number that no value exceeds; 1 where all are 0 or missing."""
    finite = np.asarray(values, dtype=float)
    finite = finite[np.isfinite(finite)]
    largest = float(finite.max()) if finite.size else 0.0
    return round_limits([0.0, largest])[1] if largest > 0 else 1.0


def _mean(values, unit: str, meaning: str) -> str:
    values = np.asarray(values, dtype=float)
    if not np.isfinite(values).any():
        return meaning
    mean = float(np.nanmean(values))
    text = percent(mean) if unit == "%" else significant(mean, 3)
    return gettext("Mean {value} {unit}.", value=text, unit=unit) + f" {meaning}"
