"""Figures of a room's heat: carpets of temperature and comfort, duration curve, weeks, gains."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from scenes.figures.carpet import carpet, class_carpet
from scenes.figures.chart import Chart, ChartMark, Readout, box, line
from scenes.figures.scale import ColourScale, Tick, axis_ticks, round_limits
from scenes.language.catalogue import gettext
from scenes.language.numbers import day_and_month, month_name, percent, rounded, short_month
from scenes.report.headline import WARM_C, applicable, comfort_columns, cooled, heated, occupied
from scenes.report.names import quantity
from scenes.report.tables import step_hours
from scenes.results import RoomYear, RunResult

STACKED = ("transmitted_w", "absorbed_outer_w", "absorbed_inner_w")  # do not overlap
CURVES = {"outdoor_c": "outdoor", "air_c": "air", "operative_c": "operative"}
STRICT, COMFORT, WARM, COLD, UNKNOWN = "#3a9d5d", "#a9d8b4", "#d9622b", "#3b6fb6", "#a8a8a8"


def temperature_carpet(result: RunResult, room: RoomYear) -> Chart:
    """Operative temperature of every hour."""
    values = room.heat.temperatures["operative_c"].to_numpy()
    low, high = round_limits(values, 8)
    scale = ColourScale(low, high, gettext("Operative temperature"), "°C", colours="cividis")
    return carpet(
        result.times,
        values,
        scale,
        title=gettext("Operative temperature"),
        digits=1,
        explanation=f"{quantity('operative_c').meaning} {heated(room)}",
    )


def comfort_carpet(result: RunResult, room: RoomYear) -> Chart | None:
    """Adaptive comfort of every occupied hour in classes; None for a cooled room, where it does not hold."""
    comfort = room.heat.comfort
    columns = comfort_columns(comfort)
    if not columns or "comfort_c" not in comfort or cooled(room):
        return None
    operative = room.heat.temperatures["operative_c"].to_numpy()
    neutral = comfort["comfort_c"].to_numpy()
    covered = applicable(comfort).to_numpy()
    within = comfort[columns[-1]].to_numpy(dtype=bool)
    strict = comfort[columns[0]].to_numpy(dtype=bool)
    classes = np.select(
        [~occupied(room).to_numpy(), strict, within, ~covered, operative > neutral], [-1, 0, 1, 4, 2], default=3
    )
    wide, narrow = quantity(columns[-1]).label, quantity(columns[0]).label
    legend = (
        (STRICT, narrow),
        (COMFORT, gettext("{band} only", band=wide)),
        (WARM, gettext("Too warm")),
        (COLD, gettext("Too cold")),
        (UNKNOWN, gettext("Outside the range of the model")),
    )
    share = 100 * np.bincount(classes[classes >= 0], minlength=5) / max((classes >= 0).sum(), 1)
    names = tuple((c, f"{n}: {percent(float(s))} %") for (c, n), s in zip(legend, share, strict=True))
    used = [i for i in range(5) if share[i] > 0]
    order = np.full(6, -1)
    order[used] = np.arange(len(used))
    return class_carpet(
        result.times,
        order[classes],
        tuple(names[i] for i in used),
        title=gettext("Adaptive comfort"),
        explanation=gettext(
            "Occupied hours by operative temperature relative to the adaptive comfort bands; "
            "unoccupied hours are blank."
        ),
    )


def duration_curve(room: RoomYear, beside: Sequence[RoomYear] = ()) -> Chart:
    """Hours of the year above each temperature.

    Args: beside: rooms, or cases of this one, whose temperatures the axis reaches to as well.
    """
    temperatures = room.heat.temperatures
    hours = len(temperatures) * step_hours(temperatures.index)
    curves = {name: temperatures[name].to_numpy() for name in CURVES if name in temperatures}
    others = [one.heat.temperatures[n] for one in beside for n in curves if n in one.heat.temperatures]
    y_range = round_limits(np.concatenate([*curves.values(), *others, [WARM_C]]))
    share = np.linspace(0, 1, 241)
    sorted_curves = {name: np.quantile(v, 1 - share) for name, v in curves.items()}
    x_range = (0.0, hours)
    marks = [ChartMark(line(x_range, (WARM_C, WARM_C), x_range, y_range), "limit", f"{WARM_C:.0f} °C")]
    marks += [
        ChartMark(line(share * hours, v, x_range, y_range), CURVES[name], quantity(name).label)
        for name, v in sorted_curves.items()
    ]
    above = float((curves["operative_c"] > WARM_C).mean()) * hours if "operative_c" in curves else 0
    return Chart(
        gettext("Temperature duration curve"),
        gettext(
            "Hours in which each temperature is exceeded. The operative temperature exceeds "
            "{limit} °C in {above} of all {hours} hours, occupied or not.",
            limit=f"{WARM_C:.0f}",
            above=rounded(above, 0),
            hours=rounded(hours, 0),
        ),
        gettext("Hours exceeded [h]"),
        gettext("Temperature [°C]"),
        axis_ticks(*x_range, 6),
        axis_ticks(*y_range),
        tuple(marks),
        readout=Readout(
            tuple(gettext("exceeded in {hours} h", hours=rounded(s * hours, 0)) for s in share),
            tuple(
                (quantity(n).label, tuple(f"{rounded(float(t), 1)} °C" for t in v)) for n, v in sorted_curves.items()
            ),
        ),
    )


def extreme_weeks(room: RoomYear) -> tuple[Chart, ...]:
    """The warmest and the coldest seven days indoors."""
    temperatures = room.heat.temperatures
    daily = temperatures["operative_c"].resample("D").mean()
    if len(daily) < 8:
        return (week(room, temperatures.index[0].normalize(), gettext("Period")),)
    weekly = daily.rolling(7).mean()
    warm, cold = (day - pd.Timedelta(days=6) for day in (weekly.idxmax(), weekly.idxmin()))
    return (week(room, warm, gettext("Warmest week")), week(room, cold, gettext("Coldest week")))


def week(room: RoomYear, start: pd.Timestamp, title: str) -> Chart:
    """Seven days of temperatures, hour by hour."""
    stop = start + pd.Timedelta(days=7)
    inside = (room.heat.temperatures.index >= start) & (room.heat.temperatures.index < stop)
    part = room.heat.temperatures[inside]
    curves = {name: part[name].to_numpy() for name in CURVES if name in part}
    comfort = room.heat.comfort
    if "comfort_c" in comfort and not cooled(room):
        covered = applicable(comfort)[inside]
        if covered.any():
            curves["comfort_c"] = comfort.loc[inside, "comfort_c"].where(covered).to_numpy()
    x = (part.index - start) / pd.Timedelta(days=1)
    y_range = round_limits(np.concatenate(list(curves.values())))
    marks = [
        ChartMark(line(x, v, (0, 7), y_range), CURVES.get(name, "limit"), quantity(name).label)
        for name, v in curves.items()
    ]
    days = [start + pd.Timedelta(days=i) for i in range(7)]
    ticks = [Tick(100 * (i + 0.5) / 7, f"{d.day}", f" {short_month(d.month)}", False) for i, d in enumerate(days)]
    last = stop - pd.Timedelta(days=1)
    return Chart(
        gettext("{week}: {first} to {last}", week=title, first=day_and_month(start), last=day_and_month(last)),
        gettext("Outdoor and room temperatures.") + f" {heated(room)}",
        gettext("Day"),
        gettext("Temperature [°C]"),
        tuple(ticks),
        axis_ticks(*y_range),
        (ChartMark(_midnights(y_range), "grid"), *marks),
        readout=_readout([f"{day_and_month(t, short=True)} {t:%H:%M}" for t in part.index], curves),
    )


def _midnights(y_range: tuple[float, float]) -> str:
    return "".join(line((i, i), y_range, (0, 7), y_range) for i in range(1, 7))


def _readout(names: Sequence[str], curves: dict[str, np.ndarray]) -> Readout:
    rows = tuple((quantity(name).label, tuple(f"{rounded(float(t), 1)} °C" for t in v)) for name, v in curves.items())
    return Readout(tuple(names), rows)


def gains_chart(monthly: pd.DataFrame) -> Chart | None:
    """Solar energy that enters or is absorbed, stacked by month, against what arrives."""
    incident = next((name for name in monthly if name.startswith("incident")), None)
    parts = [name for name in STACKED if name in monthly]
    if not parts or not len(monthly):
        return None
    tops = [monthly[incident].max()] if incident else []
    y_range = (0.0, max(round_limits([0, monthly[parts].sum(axis=1).max(), *tops])[1], 1.0))
    x_range = (0.0, float(len(monthly)))
    marks = []
    if incident:
        path = "".join(box(i + 0.14, i + 0.86, 0, v, x_range, y_range) for i, v in enumerate(monthly[incident]))
        marks.append(ChartMark(path, "incident", quantity(incident).label, filled=True))
    base = np.zeros(len(monthly))
    for number, name in enumerate(parts):
        top = base + monthly[name].to_numpy()
        path = "".join(
            box(i + 0.2, i + 0.8, a, b, x_range, y_range) for i, (a, b) in enumerate(zip(base, top, strict=True))
        )
        marks.append(ChartMark(path, f"part{min(number, 3)}", quantity(name).label, filled=True))
        base = top
    return month_chart(
        monthly,
        ([incident] if incident else []) + parts,
        marks,
        y_range[1],
        title=gettext("Solar energy by month"),
        explanation=gettext(
            "Solar radiation incident on the glass, transmitted into the room, and absorbed in the "
            "window (a part of it reaches the room as heat)."
        ),
    )


def month_chart(
    monthly: pd.DataFrame, names: Sequence[str], marks: Sequence[ChartMark], top: float, *, title: str, explanation: str
) -> Chart:
    """Marks over months, from 0 to a top [kWh].

    Args: names: columns of `monthly` [kWh] that are shown under the pointer.
    """
    ticks = tuple(
        Tick(100 * (i + 0.5) / len(monthly), name[0], name[1:], False)
        for i, name in enumerate(short_month(m.month) for m in monthly.index)
    )
    rows = tuple((quantity(n).label, tuple(f"{rounded(v, 0)} kWh" for v in monthly[n])) for n in names)
    return Chart(
        title,
        explanation,
        gettext("Month"),
        gettext("Energy [kWh]"),
        ticks,
        axis_ticks(0.0, top),
        tuple(marks),
        readout=Readout(tuple(month_name(m.month) for m in monthly.index), rows),
    )
