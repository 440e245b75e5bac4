"""Figures of a room's light by wavelength: melanopic illuminance against glare, and by hour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.glare.classes import LIMITS
from scenes.figures.carpet import carpet
from scenes.figures.chart import Chart, ChartMark, line
from scenes.figures.picture import png_uri
from scenes.figures.scale import ColourScale, Tick, axis_ticks, log_values, plain
from scenes.language.catalogue import gettext, translated
from scenes.language.numbers import percent, rounded, significant
from scenes.report import tables
from scenes.report.headline import occupied
from scenes.results import MELANOPIC_BY_DAY, RoomYear, RunResult, SpectralYear

WIDTH, HEIGHT = 900, 320  # [px] of the picture of all hours
DOT = 3  # [px]
LOWEST_LX, HIGHEST_LX = 10.0, 10_000.0  # of the axis
LEAST_DGP = 0.15  # of the axis
GLARE_LIMIT = LIMITS[1]  # above it glare is disturbing
DOTS = ("#e69f00", "#0072b2", "#cc79a7", "#009e73", "#56b4e9", "#444a52")  # of states, open first


@dataclass(frozen=True, slots=True)
class SpectralFigures:
    """What the page shows of a room's light by wavelength."""

    charts: tuple[Chart, ...]
    table: tables.Table
    notes: str


def spectral_figures(result: RunResult, room: RoomYear) -> SpectralFigures | None:
    """The figures; None where the room was not computed by wavelength."""
    year = room.spectral
    if year is None:
        return None
    charts = [_melanopic_carpet(result, room, year)]
    if room.annual_glare is not None:
        dgp = room.annual_glare["dgp"].to_numpy(dtype=float)
        charts.insert(0, melanopic_against_glare(room, year, dgp))
    table = tables.values_table(gettext("Light at the eye by wavelength"), year.summary)
    return SpectralFigures(tuple(charts), table, " ".join(map(translated, year.notes)))


def melanopic_against_glare(room: RoomYear, year: SpectralYear, dgp: NDArray[np.float64]) -> Chart:
    """Melanopic EDI and DGP [H] of each occupied hour with daylight, in the colour of its state."""
    edi = year.eye["melanopic_edi_lx"].to_numpy(dtype=float)
    used = occupied(room).to_numpy()
    shown = used & np.isfinite(dgp) & (edi >= LOWEST_LX)
    top = max(0.6, float(np.ceil(20 * dgp[shown].max(initial=0.0)) / 20))
    high = max(HIGHEST_LX, float(10 ** np.ceil(np.log10(edi[shown].max(initial=1.0)))))
    (state, names), step = _states(room), tables.step_hours(year.eye.index)
    x = (np.log(edi[shown]) - np.log(LOWEST_LX)) / (np.log(high) - np.log(LOWEST_LX))
    y = (np.clip(dgp[shown], LEAST_DGP, top) - LEAST_DGP) / (top - LEAST_DGP)
    calm = np.nan_to_num(dgp) <= GLARE_LIMIT
    both, count = used & calm & (edi >= MELANOPIC_BY_DAY), max(int(np.count_nonzero(used)), 1)
    x_range, y_range = (np.log(LOWEST_LX), np.log(high)), (LEAST_DGP, top)
    enough = np.log(MELANOPIC_BY_DAY)
    marks = (
        ChartMark(line((enough, enough), y_range, x_range, y_range), "limit", "250 lx"),
        ChartMark(line(x_range, (GLARE_LIMIT,) * 2, x_range, y_range), "limit", f"DGP {GLARE_LIMIT:.2f}"),
    )
    ticks = log_values(LOWEST_LX, high)
    at = 100 * (np.log(ticks) - x_range[0]) / (x_range[1] - x_range[0])
    colours = [DOTS[i % len(DOTS)] for i in range(len(names))]
    legend = tuple(
        (colour, f"{name}: {rounded(step * np.count_nonzero(state[shown] == i), 0)} h")
        for i, (colour, name) in enumerate(zip(colours, names, strict=True))
    )
    return Chart(
        gettext("Melanopic light against glare"),
        gettext(
            "Each dot is an occupied hour with daylight, in the colour of its shading state. Right "
            "of the line the eye receives at least 250 lx melanopic EDI, as CIE recommends by "
            "day; below the other the view is without disturbing glare. Both hold in {both} % of "
            "the occupied hours; melanopic light alone in {enough} %, no glare alone in {calm} %.",
            both=percent(100 * np.count_nonzero(both) / count),
            enough=percent(100 * np.count_nonzero(used & ~calm & (edi >= MELANOPIC_BY_DAY)) / count),
            calm=percent(100 * np.count_nonzero(used & calm & (edi < MELANOPIC_BY_DAY)) / count),
        ),
        gettext("Melanopic EDI at the eye [lx]"),
        gettext("Daylight glare probability"),
        tuple(Tick(float(a), plain(v)) for a, v in zip(at, ticks, strict=True)),
        axis_ticks(*y_range),
        marks,
        picture=png_uri(_dots(x, y, state[shown], colours)),
        classes=legend,
        height=320,
    )


def _states(room: RoomYear) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """The most closed state of the windows in each hour [H], and the states' names."""
    if room.operation is None:
        return np.zeros(len(room.heat.temperatures), dtype=np.int64), (gettext("all hours"),)
    return room.operation.shading.states.max(axis=1), room.operation.states


def _dots(
    x: NDArray[np.float64], y: NDArray[np.float64], state: NDArray[np.int64], colours: list[str]
) -> NDArray[np.uint8]:
    """A picture [HEIGHT, WIDTH, 4] of dots at places 0 to 1, transparent between them."""
    rgba = np.zeros((HEIGHT, WIDTH, 4), dtype=np.uint8)
    column = np.clip((x * (WIDTH - DOT)).astype(int), 0, WIDTH - DOT)
    row = np.clip(((1 - y) * (HEIGHT - DOT)).astype(int), 0, HEIGHT - DOT)
    table = np.array([[int(c[i : i + 2], 16) for i in (1, 3, 5)] + [255] for c in colours])
    for dy, dx in np.ndindex(DOT, DOT):
        rgba[row + dy, column + dx] = table[state]
    return rgba


def _melanopic_carpet(result: RunResult, room: RoomYear, year: SpectralYear) -> Chart:
    """Melanopic EDI at the eye in every hour."""
    edi = year.eye["melanopic_edi_lx"].to_numpy(dtype=float)
    summary = year.summary
    scale = ColourScale(25.0, 2500.0, gettext("Melanopic EDI at the eye"), "lx", True, "cividis")
    return carpet(
        result.times,
        np.where(edi >= 1.0, edi, np.nan),
        scale,
        title=gettext("Melanopic light through the year"),
        explanation=gettext(
            "Melanopic equivalent daylight illuminance at the eye of the view (CIE S 026): at "
            "least 250 lx in {share} % of the occupied hours. The year's light has a melanopic "
            "daylight efficacy ratio of {ratio} (daylight outdoors: {outdoors}). Nights are blank.",
            share=percent(summary["melanopic_250_percent"]),
            ratio=significant(summary["melanopic_der"], 3),
            outdoors=significant(summary["outdoor_melanopic_der"], 3),
        ),
    )
