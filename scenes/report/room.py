"""Everything that the page shows of one room, with its shading states and loads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Space
from scenes.figures.carpet import carpet, class_carpet
from scenes.figures.chart import Chart, ChartMark, box
from scenes.figures.plan import FloorPlan
from scenes.figures.rose import RosePlan
from scenes.figures.scale import ColourScale, round_limits
from scenes.language.catalogue import N_, gettext, ngettext, translated
from scenes.language.numbers import percent, rounded, share
from scenes.report import daylight_figures, glare_figures, spectral_figures, tables, thermal_figures
from scenes.report.glare_figures import compass
from scenes.report.headline import Card, cards, cooled, occupied
from scenes.report.names import quantity
from scenes.report.tables import monthly_gains
from scenes.report.thermal_figures import month_chart
from scenes.results import RoomYear, RunResult, ShadingYear, method_figures, method_notes

STATE_COLOURS = ("#f0e7c8", "#c9b458", "#8f9d3d", "#4f7f4f", "#2c5f66", "#23395b")
LOADS = {"heating_w": "part0", "cooling_w": "part1", "lighting_w": "part2"}
RULES = {
    "always": N_("one state all year"),
    "schedule": N_("by schedule"),
    "irradiance": N_("by irradiance on the windows"),
    "glare": N_("most open state without glare at the view point"),
    "cut-off": N_("most open slats that block the direct sun (cut-off)"),
    "outdoor temperature": N_("closed above an outdoor temperature"),
    "air temperature": N_("closed above an air temperature of the room"),
    "operative temperature": N_("closed above an operative temperature of the room"),
    "wind": N_("open in strong wind"),
    "rain": N_("open in rain"),
    "illuminance": N_("by illuminance on the windows"),
    "work plane": N_("most open state that limits daylight on the work plane"),
    "daylight": N_("most closed state that leaves enough daylight"),
    "sun depth": N_("closed against sun that reaches deep into the room"),
    "day": N_("closed by day"),
    "night": N_("closed by night"),
    "occupied": N_("closed while the room is used"),
    "unoccupied": N_("closed while nobody is there"),
    "cooling": N_("closed while the room is cooled"),
    "heating": N_("closed while the room is heated"),
    "manual": N_("by people"),
    "any": N_("several rules, the most closed state"),
    "all": N_("several rules, the most open state"),
    "function": N_("by a function in Python"),
    "predictive": N_("by plans of the hours ahead (predictive control)"),
}
# reasons of moves besides rules
WAITS = {
    "open_delay_h": N_("end of the delay of openings"),
    "hold_h": N_("end of the least time between moves"),
    "until": N_("event before which it may not open"),
    "most_moves": N_("most moves of a day"),
    "the room's temperature or load": N_("the room's temperature or load"),
}


def state_carpets(result: RunResult, room: RoomYear) -> tuple[Chart, ...]:
    """The shading state of every hour with the sun up, of each group of windows that moves."""
    ran = room.operation
    if ran is None or len(ran.states) < 2:
        return ()
    lit, shading = result.sun[:, 2] > 0, ran.shading
    several = len(shading.groups) > 1
    charts = []
    figures = shading.figures(room.heat.comfort["occupied"].to_numpy(bool), result.times)
    for number, (group, rule, state) in enumerate(zip(shading.groups, shading.rules, shading.states.T, strict=True)):
        count = np.bincount(state[lit], minlength=len(ran.states))
        legend = tuple(
            (STATE_COLOURS[i % len(STATE_COLOURS)], f"{name}: {percent(100 * n / lit.sum())} %")
            for i, (name, n) in enumerate(zip(ran.states, count, strict=True))
        )
        title = gettext("Shading state")
        charts.append(
            class_carpet(
                result.times,
                np.where(lit, state, -1),
                legend,
                title=f"{title}: {group}" if several else title,
                explanation=gettext(
                    "Control: {rule}. {moves} moves a day; open in {open} % of the occupied hours, "
                    "view out in {view} h of them. Hours with the sun up; optical and thermal "
                    "properties change together.",
                    rule=gettext(RULES[rule]) if rule in RULES else rule,
                    moves=rounded(float(figures["moves_per_day"][number]), 1),
                    open=percent(float(figures["state_0_percent"][number])),
                    view=rounded(float(figures["view_h"][number]), 0),
                )
                + _reasons(shading, number),
            )
        )
    return tuple(charts)


def _reasons(shading: ShadingYear, number: int) -> str:
    """A sentence on the conditions that moved a group; empty where there is one at most."""
    words = RULES | WAITS
    counts = {key: int(of[number]) for key, of in shading.moves_by_reason().items() if of[number]}
    if len(counts) < 2:
        return ""
    named = (f"{gettext(words[key])} ({count})" for key, count in counts.items())
    return " " + gettext("Moves of the year by what caused them: {list}.", list="; ".join(named))


def loads_chart(room: RoomYear) -> Chart | None:
    """Heating, cooling and light by month, beside one another; None without any."""
    if room.operation is None:
        return None
    monthly = monthly_gains(room.operation.hours)
    names = [name for name in LOADS if monthly[name].sum() > 0]
    if not names:
        return None
    top = max(round_limits([0, monthly[names].to_numpy().max()])[1], 1.0)
    x_range, y_range = (0.0, float(len(monthly))), (0.0, top)
    width = 0.8 / len(names)
    marks = []
    for number, name in enumerate(names):
        path = "".join(
            box(i + 0.1 + number * width, i + 0.1 + (number + 0.92) * width, 0, v, x_range, y_range)
            for i, v in enumerate(monthly[name])
        )
        marks.append(ChartMark(path, LOADS[name], quantity(name).label, filled=True))
    return month_chart(
        monthly,
        names,
        marks,
        top,
        title=gettext("Heating, cooling and electric light by month"),
        explanation=gettext(
            "Heating and cooling of an ideal system that keeps the set points, and electric light dimmed by daylight."
        ),
    )


def glare_carpet(result: RunResult, room: RoomYear) -> Chart | None:
    """DGP of every hour of the year; None where it was not computed."""
    year = room.annual_glare
    if year is None:
        return None
    dgp = year["dgp"].to_numpy(dtype=float)
    used = dgp_in_use(room)
    text = quantity("dgp").meaning + " " + gettext("Nights are blank.")
    if len(used):
        text += " " + gettext(
            "DGP exceeds 0.40 in {share} % of the {hours} occupied hours.",
            share=percent(100 * float(np.mean(used > 0.40))),
            hours=rounded(len(used), 0),
        )
    scale = ColourScale(0.2, 0.6, gettext("Daylight glare probability"), "", colours="inferno")
    title = gettext("Glare through the year")
    return carpet(result.times, dgp, scale, title=title, explanation=text, digits=2)


def dgp_in_use(room: RoomYear) -> np.ndarray:
    """DGP of the occupied hours; of dark ones it is 0, for nothing dazzles then."""
    year: pd.DataFrame = room.annual_glare
    return year["dgp"].fillna(0.0).to_numpy()[occupied(room).to_numpy()]


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
    glare_plan: RosePlan | None
    spectral: spectral_figures.SpectralFigures | None
    temperature: Chart
    comfort: Chart | None
    duration: Chart
    weeks: tuple[Chart, ...]
    gains: Chart | None
    gains_table: tables.Table
    states: tuple[Chart, ...]
    loads: Chart | None
    loads_table: tables.Table | None
    comfort_table: tables.Table | None  # None: cooled, where adaptive comfort does not hold
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
        glare_table=tables.glare_table(result.times, room.glare.pictures) if room.glare.pictures else None,
        glare_year=glare_carpet(result, room),
        glare_plan=None if room.glare_map is None else glare_figures.glare_plan(room.space, room.glare_map),
        spectral=spectral_figures.spectral_figures(result, room),
        temperature=thermal_figures.temperature_carpet(result, room),
        comfort=thermal_figures.comfort_carpet(result, room),
        duration=thermal_figures.duration_curve(room),
        weeks=thermal_figures.extreme_weeks(room),
        gains=thermal_figures.gains_chart(monthly),
        gains_table=tables.gains_table(monthly),
        states=state_carpets(result, room),
        loads=loads_chart(room),
        loads_table=None
        if room.operation is None
        else tables.values_table(gettext("Annual loads"), _loads(room.operation.summary)),
        comfort_table=None if cooled(room) else tables.values_table(gettext("Comfort"), room.heat.comfort_summary),
        fenestration=tuple(
            tables.values_table(
                str(values.get("system") or gettext("Window with shading")),
                {k: v for k, v in values.items() if k not in ("system", "source")},
            )
            for values in room.heat.fenestration
        ),
    )


def _loads(summary: Mapping[str, float]) -> dict[str, float]:
    """The sums of the year; without lamps there is no energy of the light."""
    dark = () if summary.get("lighting_kwh") else ("lighting_kwh", "leni_kwh_m2")
    return {key: value for key, value in summary.items() if key not in dark}


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
        (gettext("Orientation"), ", ".join(dict.fromkeys(heading(w.normal) for w in space.windows)) or "–"),
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
    return " ".join((noise, *map(translated, method_notes([method_figures(room)]))))
