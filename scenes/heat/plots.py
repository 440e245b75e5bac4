"""Figures of a room's year: energy by month, sorted temperatures, weeks, where the heat goes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from scenes.heat.study import ThermalYear
from thermal.records import TERMS

DEMANDS = ("heat", "cold")
ELECTRICITY = ("electricity fans", "electricity lamps", "electricity equipment")
WEEK = pd.Timedelta(days=7)
SUN_OF = {"facade": "facade sun", "windows": "glass sun"}  # what is absorbed there


def year_figure(year: ThermalYear, path: Path) -> None:
    """Write the figure of a room: four panels."""
    figure = Figure(figsize=(12, 8), layout="constrained")
    axes = figure.subplots(2, 2)
    figure.suptitle(year.name)
    energy_panel(year, axes[0, 0])
    duration_panel(year, axes[0, 1])
    week_panel(year, axes[1, 0])
    balance_panel(year, axes[1, 1])
    figure.savefig(path)


def energy_panel(year: ThermalYear, axes: Axes) -> None:
    """Heat, cold and electricity by month."""
    months = np.arange(1, 13)
    names = [*DEMANDS, *ELECTRICITY]
    for number, name in enumerate(names):
        values = year.energy[f"{name} [kWh/m2]"].to_numpy()
        if not values.any():
            continue
        axes.bar(months + 0.16 * (number - 2), values, 0.16, label=name)
    axes.set(xlabel="month", ylabel="kWh/m2", xticks=months)
    axes.legend(fontsize="small")


def duration_panel(year: ThermalYear, axes: Axes) -> None:
    """Operative and outdoor temperature, sorted."""
    for name, label in (("operative_c", "operative"), ("outdoor_c", "outdoors")):
        values = np.sort(year.hours[name].to_numpy())[::-1]
        axes.plot(_step_h(year) * np.arange(len(values)), values, label=label)
    axes.set(xlabel="hours above", ylabel="temperature [C]")
    axes.legend(fontsize="small")


def week_panel(year: ThermalYear, axes: Axes) -> None:
    """Temperatures of the week with the warmest hour."""
    hours = year.hours
    warmest = hours["operative_c"].idxmax().normalize()
    start = min(max(warmest - WEEK / 2, hours.index[0]), hours.index[-1] - WEEK)
    week = hours.loc[start : start + WEEK]
    for name in ("air_c", "mrt_c", "outdoor_c"):
        axes.plot(week.index, week[name], label=name.removesuffix("_c"))
    axes.set(ylabel="temperature [C]", title="week of the warmest hour")
    axes.tick_params(axis="x", rotation=30)
    axes.legend(fontsize="small")


def balance_panel(year: ThermalYear, axes: Axes) -> None:
    """Gains and losses of the room's heat by month, stacked.

    Walls and panes come with the sun that they absorb: most of it goes straight back outdoors.
    """
    flows = {name: [name] for name in TERMS if name not in ("storage", *SUN_OF.values())}
    flows |= {name: [name, sun] for name, sun in SUN_OF.items()}
    kwh, month = _step_h(year) / 1e3, year.hours.index.month
    colours, above, below = colormaps["tab20"], np.zeros(12), np.zeros(12)
    months = pd.RangeIndex(1, 13)
    for number, (name, terms) in enumerate(flows.items()):
        power = year.hours[[f"{term.replace(' ', '_')}_w" for term in terms]].sum(axis=1)
        values = kwh * power.groupby(month).sum().reindex(months, fill_value=0.0).to_numpy()
        if np.abs(values).max() < 1.0:  # kWh
            continue
        base = np.where(values > 0, above, below)
        axes.bar(months, values, bottom=base, label=name, color=colours(number))
        above, below = above + np.maximum(values, 0), below + np.minimum(values, 0)
    axes.set(xlabel="month", ylabel="heat into the room [kWh]", xticks=months)
    axes.legend(fontsize="x-small", loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _step_h(year: ThermalYear) -> float:
    """Length of the rows of a year [h]."""
    return float((year.hours.index[1] - year.hours.index[0]) / pd.Timedelta(hours=1))
