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
        axes.bar(months + 0.16 * (number - 2), values, 0.16, label=name)
    axes.set(xlabel="month", ylabel="kWh/m2", xticks=months)
    axes.legend(fontsize="small")


def duration_panel(year: ThermalYear, axes: Axes) -> None:
    """Operative and outdoor temperature, sorted."""
    for name, label in (("operative_c", "operative"), ("outdoor_c", "outdoors")):
        values = np.sort(year.hours[name].to_numpy())[::-1]
        axes.plot(np.arange(len(values)), values, label=label)
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
    """Gains and losses of the room's heat by month, stacked."""
    flows = [name for name in TERMS if name != "storage"]
    columns = [f"{name.replace(' ', '_')}_w" for name in flows]
    table = year.hours[columns].groupby(year.hours.index.month).sum() / 1e3
    above, below = np.zeros(len(table)), np.zeros(len(table))
    colours = colormaps["tab20"]
    for number, (name, column) in enumerate(zip(flows, columns, strict=True)):
        values = table[column].to_numpy()
        if np.abs(values).max() < 1.0:  # kWh
            continue
        base = np.where(values > 0, above, below)
        axes.bar(table.index, values, bottom=base, label=name, color=colours(number))
        above, below = above + np.maximum(values, 0), below + np.minimum(values, 0)
    axes.set(xlabel="month", ylabel="heat into the room [kWh]")
    axes.legend(fontsize="x-small", ncols=2)
