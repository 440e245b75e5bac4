"""Everything that the page shows of one case, drawn by the figures of a run's report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from scenes.figures.carpet import carpet
from scenes.figures.chart import Chart
from scenes.figures.plan import FloorPlan
from scenes.figures.scale import ColourScale
from scenes.language.catalogue import gettext
from scenes.language.numbers import rounded
from scenes.report import daylight_figures, tables, thermal_figures
from scenes.report.method import METHODS
from scenes.report.names import quantity
from scenes.report.room import error_words
from scenes.results import DaylightResult, GlareResults, RoomYear, RunResult, ThermalResult
from scenes.study.plan import Case, StudyPlan
from scenes.study.store import CaseResult
from scenes.study.study import StudyResult, facing

LEAST_DGP, MOST_DGP = 0.2, 0.5  # of the heat map's colours
TEXT_COLUMNS = ("glare_protection",)


@dataclass(frozen=True, slots=True)
class CasePage:
    """The section of one case."""

    number: int  # from 1, in the table's order
    label: str
    method: str
    why: str
    plans: tuple[FloorPlan, ...]
    error_words: str
    light: Chart
    glare: Chart | None
    comfort: Chart | None
    duration: Chart
    figures: tables.Table

    @property
    def anchor(self) -> str:
        """Of the section."""
        return f"case-{self.number}"


def case_page(study: StudyResult, number: int, room: RoomYear, beside: Sequence[RoomYear] = ()) -> CasePage:
    """Figures and tables of a case.

    Args:
        number: from 1, in the table's order.
        room: its results, of `room_of`.
        beside: those of all cases, which share its scales.
    """
    case, result = study.plan.cases[number - 1], study.results[number - 1]
    building, _ = study.plan.rooms[case.scene]
    times = room.heat.temperatures.index
    run = RunResult(building, times, np.empty((0, 3)), (room,), (), {})
    median = result.arrays["median_illuminance"][:, None]
    by_hour = replace(room, daylight=replace(room.daylight, illuminance=median))
    return CasePage(
        number,
        case_label(study.plan, case),
        method_words(case),
        case.chosen,
        daylight_figures.plans(room, beside),
        error_words(room),
        daylight_figures.illuminance_carpet(run, by_hour),
        glare_map(times, case, result) if "dgp" in result.arrays else None,
        thermal_figures.comfort_carpet(run, room),
        thermal_figures.duration_curve(room, beside),
        figures_table(result),
    )


def case_label(plan: StudyPlan, case: Case) -> str:
    """The case in words, without what is the same in the whole study."""
    room, *conditions = place_parts(plan, case)
    return ", ".join(part for part in (room, case.system, *conditions) if part)


def place_parts(plan: StudyPlan, case: Case) -> tuple[str, str, str, str]:
    """Room, climate, orientation and method of a case; empty where the study has only one."""
    _, space = plan.rooms[case.scene]
    cases = plan.cases
    room = case.room if case.space_name == case.room else f"{case.room} {case.space_name}"
    return (
        room if len({c.scene for c in cases}) > 1 else "",
        case.climate if len({c.climate for c in cases}) > 1 else "",
        f"{facing(space, case.orientation_deg)} ({case.orientation_deg:g}°)"
        if len({c.orientation_deg for c in cases}) > 1
        else "",
        gettext(METHODS[case.options.method]) if len({c.options.method for c in cases}) > 1 else "",
    )


def method_words(case: Case) -> str:
    """How the case was computed, in a few words."""
    method = gettext(METHODS[case.options.method])
    if case.glare == "none":
        return gettext("{method} method, no glare", method=method)
    return gettext("{method} method, {glare} of every occupied hour with the sun up", method=method, glare=case.glare)


def room_of(study: StudyResult, case: Case, result: CaseResult) -> RoomYear:
    """The kept part of a case's results as those of a room."""
    _, space = study.plan.rooms[case.scene]
    arrays = result.arrays

    def group(name: str) -> dict[str, np.ndarray]:
        start = f"{name}/"
        return {k.removeprefix(start): v for k, v in arrays.items() if k.startswith(start)}

    times = pd.DatetimeIndex(arrays["times"].astype("datetime64[s]"), name="time")
    numbers = {k: v for k, v in result.figures.items() if not isinstance(v, str)}
    daylight = DaylightResult(
        arrays["points"],
        arrays["mean_illuminance"][None, :],
        arrays["relative_error"],
        pd.DataFrame(group("sensor")).rename_axis("sensor"),
        numbers,
    )
    heat = ThermalResult(
        pd.DataFrame(group("temperature"), index=times),
        pd.DataFrame(index=times),
        pd.DataFrame(group("comfort"), index=times),
        numbers,
        (),
    )
    return RoomYear(space, daylight, GlareResults(None, ()), heat, {})


def glare_map(times: pd.DatetimeIndex, case: Case, result: CaseResult) -> Chart:
    """DGP of every rated hour as a carpet."""
    f = result.figures
    scale = ColourScale(LEAST_DGP, MOST_DGP, case.glare, "", colours="inferno")
    words = gettext(
        "{glare} of the occupied hours with the sun up, from the middle of the room towards its "
        "largest window. Above 0.40 in {some} h, above 0.45 in {few} h; maximum {most}.",
        glare=case.glare,
        some=rounded(f["glare_disturbing_h"] + f["glare_intolerable_h"], 0),
        few=rounded(f["glare_intolerable_h"], 0),
        most=rounded(f["dgp_max"], 2),
    )
    return carpet(
        times, result.arrays["dgp"], scale, title=gettext("Glare through the year"), explanation=words, digits=3
    )


def figures_table(result: CaseResult) -> tables.Table:
    """Every figure of a case."""
    values = {k: v for k, v in result.figures.items() if v is not None}
    table = tables.values_table(gettext("All results of this case"), values)
    return replace(table, rows=tuple(sorted(table.rows, key=lambda row: row[0].lower())))


def label_of(column: str) -> tables.Column:
    """The heading of a figure's column."""
    q = quantity(column)
    return tables.Column(q.label, q.unit, q.meaning, numeric=column not in TEXT_COLUMNS)
