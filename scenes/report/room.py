"""Everything that the page shows of one room."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bim.model import Space
from scenes.figures.chart import Chart
from scenes.figures.plan import FloorPlan
from scenes.language.catalogue import said
from scenes.report import (
    daylight_figures,
    glare_figures,
    operation_figures,
    tables,
    thermal_figures,
)
from scenes.report.glare_figures import compass
from scenes.report.headline import Card, cards
from scenes.report.numbers import counted, rounded, share
from scenes.results import RoomYear, RunResult


@dataclass(frozen=True, slots=True)
class RoomSection:
    """What every page shows of a room."""

    anchor: str
    name: str
    facts: tuple[tuple[str, str], ...]
    plans: tuple[FloorPlan, ...]


@dataclass(frozen=True, slots=True)
class RoomPage(RoomSection):
    """The section of one room in the report of a run."""

    cards: tuple[Card, ...]
    light: Chart
    daylight_tables: tuple[tables.Table, ...]
    error_words: str
    glare: glare_figures.GlareGallery | None
    glare_table: tables.Table | None
    glare_year: Chart | None
    temperature: Chart
    comfort: Chart | None
    duration: Chart
    weeks: tuple[Chart, ...]
    gains: Chart | None
    gains_table: tables.Table
    states: Chart | None
    loads: Chart | None
    loads_table: tables.Table | None
    comfort_table: tables.Table
    fenestration: tuple[tables.Table, ...]


def room_page(result: RunResult, room: RoomYear, number: int) -> RoomPage:
    """Figures and tables of a room."""
    monthly = tables.monthly_gains(room.heat.gains)
    return RoomPage(
        anchor=f"room-{number}",
        name=room.space.label,
        facts=facts(room.space, room.template),
        cards=cards(result, room),
        plans=daylight_figures.plans(room),
        light=daylight_figures.illuminance_carpet(result, room),
        daylight_tables=(
            tables.values_table(said("Daylight of the room"), room.daylight.room_metrics),
            tables.sensors_table(room),
        ),
        error_words=error_words(room),
        glare=glare_figures.gallery(result, room),
        glare_table=tables.glare_table(result.times, room.glare.pictures)
        if room.glare.pictures
        else None,
        glare_year=operation_figures.glare_carpet(result, room),
        temperature=thermal_figures.temperature_carpet(result, room),
        comfort=thermal_figures.comfort_carpet(result, room),
        duration=thermal_figures.duration_curve(room),
        weeks=thermal_figures.extreme_weeks(room),
        gains=thermal_figures.gains_chart(monthly),
        gains_table=tables.gains_table(monthly),
        states=operation_figures.state_carpet(result, room),
        loads=operation_figures.loads_chart(room),
        loads_table=None
        if room.operation is None
        else tables.values_table(said("Loads of the year"), room.operation.summary),
        comfort_table=tables.values_table(said("Comfort"), room.heat.comfort_summary),
        fenestration=tuple(
            tables.values_table(
                str(values.get("system") or said("The window with its shade")),
                {k: v for k, v in values.items() if k not in ("system", "source")},
            )
            for values in room.heat.fenestration
        ),
    )


def facts(space: Space, template: str = "") -> tuple[tuple[str, str], ...]:
    """Size and windows of the room in words."""
    glass = sum(window.area for window in space.windows)
    count = len(space.windows)
    rows = [
        (said("Floor area"), f"{rounded(space.floor_area, 1)} m²"),
        (said("Air volume"), f"{rounded(space.volume, 0)} m³"),
        (
            said("Windows"),
            said("{count} with {area} m² of glass", count=count, area=rounded(glass, 1)),
        ),
        (said("Facing"), ", ".join(dict.fromkeys(heading(w.normal) for w in space.windows)) or "–"),
        (said("Glass to floor"), f"{rounded(100 * glass / space.floor_area, 0)} %"),
    ]
    if space.storey:
        rows.append((said("Storey"), space.storey))
    if template:
        rows.append((said("Results of"), said("{room}, an equal room", room=template)))
    return tuple(rows)


def heading(normal: NDArray[np.float64]) -> str:
    """The compass direction that a window faces, or "up"."""
    if normal[2] > 0.7:
        return said("up")
    return said(compass(normal))


def error_words(room: RoomYear) -> str:
    """The standard error of the room's illuminances in one sentence."""
    error = room.daylight.relative_error
    return said(
        "Relative standard error of the annual mean illuminance: {mean} % as a mean over "
        "{sensors}, {worst} % at the worst one.",
        mean=share(float(error.mean())),
        sensors=counted(len(error), "sensor"),
        worst=share(float(error.max())),
    )
