"""Everything that the page shows of one room."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bim.model import Space
from scenes.figures.chart import Chart
from scenes.figures.plan import FloorPlan
from scenes.language.catalogue import gettext, ngettext
from scenes.language.numbers import rounded, share
from scenes.report import (
    daylight_figures,
    glare_figures,
    operation_figures,
    tables,
    thermal_figures,
)
from scenes.report.glare_figures import compass
from scenes.report.headline import Card, cards
from scenes.report.method import sun_error_words
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
    states: tuple[Chart, ...]
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
            tables.values_table(gettext("Daylight of the room"), room.daylight.room_metrics),
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
        states=operation_figures.state_carpets(result, room),
        loads=operation_figures.loads_chart(room),
        loads_table=None
        if room.operation is None
        else tables.values_table(gettext("Annual loads"), room.operation.summary),
        comfort_table=tables.values_table(gettext("Comfort"), room.heat.comfort_summary),
        fenestration=tuple(
            tables.values_table(
                str(values.get("system") or gettext("Window with shading")),
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
        (gettext("Floor area"), f"{rounded(space.floor_area, 1)} m²"),
        (gettext("Air volume"), f"{rounded(space.volume, 0)} m³"),
        (
            gettext("Windows"),
            ngettext(
                "{count} window, {area} m² of glass",
                "{count} windows, {area} m² of glass",
                count,
                area=rounded(glass, 1),
            ),
        ),
        (
            gettext("Orientation"),
            ", ".join(dict.fromkeys(heading(w.normal) for w in space.windows)) or "–",
        ),
        (gettext("Glass-to-floor ratio"), f"{rounded(100 * glass / space.floor_area, 0)} %"),
    ]
    if space.storey:
        rows.append((gettext("Storey"), space.storey))
    if template:
        rows.append((gettext("Results from"), gettext("{room} (equal room)", room=template)))
    return tuple(rows)


def heading(normal: NDArray[np.float64]) -> str:
    """The compass direction that a window faces, or upwards."""
    if normal[2] > 0.7:
        return gettext("upwards")
    return gettext(compass(normal))


def error_words(room: RoomYear) -> str:
    """The standard error of the room's illuminances in one sentence."""
    error = room.daylight.relative_error
    noise = ngettext(
        "Relative standard error of the annual mean illuminance: {mean} % at the one sensor.",
        "Relative standard error of the annual mean illuminance: {mean} % on average over {count} "
        "sensors, {worst} % at most.",
        len(error),
        mean=share(float(error.mean())),
        worst=share(float(error.max())),
    )
    return noise + sun_error_words([room])
