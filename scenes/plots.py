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


from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.evaluate import bsdf_values, direct_hemispherical

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
    times, worst = year.heat.temperatures.index, _worst(year)
    if year.annual_glare is not None:
        axes = _carpet(times, year.annual_glare["dgp"].to_numpy(), "DGP", HIGHEST_DGP, axes)
    else:
        axes = _axes(axes)
        shown = sorted(year.glare.pictures, key=lambda picture: picture.hour)
        labels = [f"{times[picture.hour]:%d %b %H h}" for picture in shown]
        axes.bar(labels, [picture.glare["dgp"] for picture in shown], color="0.7")
        axes.set_ylim(0.0, max(1.1 * (worst or 0.0), LIMITS[-1] + 0.05))
        for limit, name in zip(LIMITS, CLASSES[1:], strict=True):
            axes.axhline(limit, color="tab:red", linewidth=0.8)
            axes.text(0.002, limit, name, transform=axes.get_yaxis_transform(), va="bottom")
        axes.tick_params(axis="x", rotation=45)
        axes.set_ylabel("DGP")
    axes.set_title(f"{year.space.label}: glare, {'no picture' if worst is None else f'at worst DGP {worst:.2f}'}")
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


def _worst(year: RoomYear) -> float | None:
    """The highest DGP; None without a rated year and pictures."""
    if year.annual_glare is not None:
        return float(year.annual_glare["dgp"].max())
    return year.glare.worst if year.glare.pictures else None


def _carpet(times: pd.DatetimeIndex, values: np.ndarray, label: str, top: float, axes: Axes | None) -> Axes:
    """Values [H] as colours: days to the right, hours of the day upwards."""
    from matplotlib.dates import date2num

    axes = _axes(axes)
    grid = day_grid(times, values)
    first = date2num(times[0].normalize())
    image = axes.imshow(
        grid, extent=(first, first + grid.shape[1], 0, 24), aspect="auto", vmin=0, vmax=top, interpolation="nearest"
    )
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


THETA_STEP_DEG, PHI_STEP_DEG = 0.5, 1.0
DECADES = 4  # of the colour scale, below the largest value


def plot_hemispheres(bsdf: Bsdf, incident: NDArray[np.float64], title: str) -> Figure:
    """Figure of the BSDF [1/sr] by outgoing direction; `incident` [3] in the window frame.

    Both hemispheres are seen from outdoors: up is up, right is right, polar angle as radius.
    """
    theta = np.radians(np.arange(THETA_STEP_DEG / 2, 90, THETA_STEP_DEG))
    phi = np.radians(np.arange(0, 360, PHI_STEP_DEG) + PHI_STEP_DEG / 2)
    t, p = np.meshgrid(theta, phi, indexing="ij")
    half = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], -1).reshape(-1, 3)
    outwards = 1.0 if incident[2] > 0 else -1.0
    sides = {"reflected": outwards, "transmitted": -outwards}
    values = {kind: bsdf_values(bsdf, incident, half * [1, 1, sign]).reshape(t.shape) for kind, sign in sides.items()}
    highest = max(value.max() for value in values.values())
    norm = LogNorm(max(highest, 1e-9) / 10**DECADES, max(highest, 1e-9))
    figure = Figure(figsize=(11, 5.4), layout="constrained", dpi=130)
    axes = figure.subplots(1, 2, subplot_kw={"projection": "polar"})
    edges = np.radians(np.arange(0, 360 + PHI_STEP_DEG, PHI_STEP_DEG))
    rings = np.arange(0, 90 + THETA_STEP_DEG, THETA_STEP_DEG)
    for axis, (kind, value) in zip(axes, values.items(), strict=True):
        share = direct_hemispherical(bsdf, _block(kind, outwards), incident)[0]
        shown = axis.pcolormesh(edges, rings, np.maximum(value, norm.vmin), norm=norm, cmap="inferno", shading="flat")
        axis.set_title(f"{kind}: {100 * share:.1f} %")
        axis.set_yticks([30, 60, 90], ["30°", "60°", "90°"], color="grey")
        axis.set_xticks(np.radians([0, 90, 180, 270]), ["right", "up", "left", "down"])
        axis.grid(alpha=0.3)
        toward = 1 if kind == "reflected" else -1  # the light, or straight on
        at = np.arctan2(toward * incident[1], toward * incident[0])
        marker, label = ("o", "the light") if kind == "reflected" else ("x", "straight on")
        theta_deg = np.degrees(np.arccos(abs(incident[2])))
        axis.plot(at, theta_deg, marker, mfc="none", mec="cyan", ms=9, label=label)
        axis.legend(loc="lower left", bbox_to_anchor=(-0.15, -0.1))
    figure.colorbar(shown, ax=axes, label="BSDF [1/sr]", shrink=0.85)
    figure.suptitle(title)
    return figure


def _block(kind: str, outwards: float) -> str:
    side = "front" if outwards > 0 else "back"
    return f"{'reflection' if kind == 'reflected' else 'transmission'}_{side}"
