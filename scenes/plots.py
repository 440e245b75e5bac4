"""A room's year as figures of matplotlib, for notebooks; the report draws its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mitsuba_cfs.glare.classes import CLASSES, LIMITS
from scenes.figures.carpet import day_grid
from scenes.figures.scale import round_limits
from scenes.results import RoomYear

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

SHOWN = 99.5  # per cent of the hours that a colour scale holds
HIGHEST_DGP = 0.6  # end of its colour scale, well into the intolerable
SIZE = (9.0, 3.0)  # of a figure [inch]


def illuminance(year: RoomYear, axes: Axes | None = None) -> Axes:
    """The work plane's mean illuminance [lx] by day and hour."""
    mean = year.daylight.illuminance.mean(axis=1, dtype=float)
    top = round_limits([0.0, max(float(np.percentile(mean, SHOWN)), 1.0)])[1]
    axes = _carpet(year.heat.temperatures.index, mean, "mean illuminance [lx]", top, axes)
    axes.set_title(f"{year.space.label}: illuminance of the work plane")
    return axes


def glare(year: RoomYear, axes: Axes | None = None) -> Axes:
    """DGP of every hour where all were rated, else of the pictures, by day and hour."""
    times = year.heat.temperatures.index
    if year.annual_glare is not None:
        axes = _carpet(times, year.annual_glare["dgp"].to_numpy(), "DGP", HIGHEST_DGP, axes)
    else:
        axes = _axes(axes)
        shown = sorted(year.glare.pictures, key=lambda picture: picture.hour)
        labels = [f"{times[picture.hour]:%d %b %H h}" for picture in shown]
        axes.bar(labels, [picture.glare["dgp"] for picture in shown], color="0.7")
        axes.set_ylim(0.0, max(1.1 * year.glare.worst, LIMITS[-1] + 0.05))
        for limit, name in zip(LIMITS, CLASSES[1:], strict=True):
            axes.axhline(limit, color="tab:red", linewidth=0.8)
            axes.text(0.002, limit, name, transform=axes.get_yaxis_transform(), va="bottom")
        axes.tick_params(axis="x", rotation=45)
        axes.set_ylabel("DGP")
    axes.set_title(f"{year.space.label}: glare, at worst DGP {_worst(year):.2f}")
    return axes


def temperatures(year: RoomYear, axes: Axes | None = None) -> Axes:
    """Operative and outdoor temperature [degC] of the year, and the comfort temperature."""
    axes = _axes(axes)
    table, comfort = year.heat.temperatures, year.heat.comfort
    axes.plot(table.index, table["outdoor_c"], color="0.75", linewidth=0.5, label="outdoors")
    axes.plot(table.index, table["operative_c"], linewidth=0.6, label="operative")
    axes.plot(table.index, comfort["comfort_c"], color="tab:green", label="comfort (ASHRAE 55)")
    axes.set_ylabel("temperature [°C]")
    axes.margins(x=0, y=0.15)
    _show_dates(axes)
    axes.legend(loc="upper left", ncols=3, frameon=False)
    axes.set_title(f"{year.space.label}: temperatures")
    return axes


def _worst(year: RoomYear) -> float:
    return year.glare.worst if year.annual_glare is None else float(year.annual_glare["dgp"].max())


def _carpet(
    times: pd.DatetimeIndex, values: np.ndarray, label: str, top: float, axes: Axes | None
) -> Axes:
    """Values [H] as colours: days to the right, hours of the day upwards."""
    from matplotlib.dates import date2num

    axes = _axes(axes)
    grid = day_grid(times, values)
    first = date2num(times[0].normalize())
    image = axes.imshow(
        grid, extent=(first, first + grid.shape[1], 0, 24), aspect="auto", vmin=0, vmax=top,
        interpolation="nearest",
    )  # fmt: skip
    _show_dates(axes)
    axes.set_yticks(range(0, 25, 6))
    axes.set_ylabel("hour")
    axes.figure.colorbar(image, ax=axes, label=label, extend="max")
    return axes


def _show_dates(axes: Axes) -> None:
    from matplotlib.dates import AutoDateLocator, ConciseDateFormatter

    locator = AutoDateLocator()
    axes.xaxis.set_major_locator(locator)
    axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))


def _axes(axes: Axes | None) -> Axes:
    """The axes given, or those of a figure of their own."""
    if axes is not None:
        return axes
    from matplotlib import pyplot

    return pyplot.subplots(figsize=SIZE, layout="constrained")[1]
