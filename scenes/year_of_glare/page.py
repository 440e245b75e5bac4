"""The page of a year of glare: a plan with a rose at every eye, the worst view, all views."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import shapely
from markupsafe import Markup

from mitsuba_cfs.files import write_text
from mitsuba_cfs.glare.classes import LEVELS, LIMITS
from scenes.figures.plan import PlanFrame, plan_frame, sensor_cells
from scenes.figures.rose import RoseWedge, roses
from scenes.language.catalogue import gettext, in_language, ngettext, translated
from scenes.language.numbers import day_and_month, percent, rounded, spoken
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.quick import NOTE
from scenes.report.headline import LEVEL_WORDS
from scenes.report.method import METHODS
from scenes.report.page import FILES as SHARED
from scenes.report.page import environment, head_lines
from scenes.report.page_files import page_files
from scenes.report.tables import Column, Table
from scenes.year_of_glare.outputs import all_notes
from scenes.year_of_glare.year import GlareYear, rating_of

FILES = page_files("scenes.year_of_glare")
ALONE = 1.5  # [m] between eyes where there is one
NEAR = 0.01  # [m] eyes nearer than this are one


def write_page(year: GlareYear, table: pd.DataFrame, path: Path, page: PageOptions = OWN_PAGE) -> None:
    """Write the page (HTML, needs nothing else but its pictures' files beside it).

    Args: table: a row for each view, as in `views.csv`.
    """
    with in_language(page.language):
        text = (
            environment(FILES)
            .get_template("glare_year.html.j2")
            .render(
                year=year,
                page=page,
                title=page.title or year.room,
                head=head_lines(year.head, all_notes(year, table)),
                facts=(*_facts(year, table), *page.facts),
                plan=_plan(year, table),
                limits=[rounded(limit, 2) for limit in LIMITS],
                worst=_worst(year, table),
                seats=_seats(table),
                views=_views(table),
                style=Markup(SHARED["style.css"]),
                scripts=Markup(SHARED["tables.js"]),
            )
        )
    write_text(path, text)


def _facts(year: GlareYear, table: pd.DataFrame) -> list[tuple[str, str]]:
    options = year.options
    start, end = options.occupied
    rows = [(gettext("Run"), gettext(NOTE))] if options.quick else []
    systems = ", ".join(dict.fromkeys(str(f["system"]) for f in year.fenestration))
    return [
        *rows,
        (gettext("Room"), year.room),
        (gettext("Weather"), year.weather.site),
        (gettext("Fenestration"), systems),
        (
            gettext("Views"),
            ngettext(
                "{views}, {count} view point", "{views}, {count} view points", len(_eyes(table)[1]), views=len(table)
            ),
        ),
        (
            gettext("Hours of use"),
            ngettext(
                "{start} to {end} o'clock, {count} hour",
                "{start} to {end} o'clock, {count} hours",
                int(table["hours_of_use"].iloc[0]),
                start=start,
                end=end,
            ),
        ),
        (gettext("Glare metric"), f"{options.metric}, {gettext(METHODS.get(options.method, options.method))}"),
        (gettext("Glare sources"), translated(rating_of(options).rule)),
    ]


def _eyes(table: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """The eye [V] of each view, and where the eyes are [E, 3]."""
    points = table[["x", "y", "z"]].to_numpy(dtype=float)
    keys = np.round(points / NEAR).astype(np.int64)
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(np.argsort(first))
    return order[number.ravel()], points[np.sort(first)]


def _plan(year: GlareYear, table: pd.DataFrame) -> dict[str, Any]:
    """The plan's SVG with a rose at each eye."""
    eye, points = _eyes(table)
    frame = _frame(year, points)
    cells = sensor_cells(points)
    across = np.linalg.norm(cells[0, 1] - cells[0, 0]) if len(points) > 1 else ALONE
    directions = int(np.bincount(eye).max())
    wedges = [
        RoseWedge(
            np.array([row.x, row.y]),
            np.array([row.direction_x, row.direction_y]),
            tuple(float(getattr(row, _column(limit))) for limit in LIMITS),
            _words(row),
        )
        for row in _renamed(table).itertuples()
    ]
    (box, ratio), body = roses(frame, wedges, 0.47 * float(across), directions)
    return {"box": box, "ratio": ratio, "body": Markup(body), "directions": directions}


def _frame(year: GlareYear, points: np.ndarray) -> PlanFrame:
    if year.space is not None:
        return plan_frame(year.space, points)
    around = shapely.box(*points[:, :2].min(axis=0), *points[:, :2].max(axis=0)).buffer(ALONE)
    return PlanFrame(around, (), sensor_cells(points), points, None)


def _column(limit: float) -> str:
    return f"above_{round(100 * limit)}"


def _renamed(table: pd.DataFrame) -> pd.DataFrame:
    """Names that are Python's."""
    return table.rename(columns={f"share_above_{limit:.2f}": _column(limit) for limit in LIMITS})


def _words(row: Any) -> str:
    shares = ", ".join(
        gettext("{share} % above {limit}", share=percent(100 * getattr(row, _column(limit))), limit=rounded(limit, 2))
        for limit in LIMITS
    )
    return gettext(
        "{view}: {shares}; maximum {highest}, protection: {level}",
        view=row.view,
        shares=shares,
        highest=rounded(row.highest_dgp, 2),
        level=gettext(LEVEL_WORDS[row.protection_en17037]),
    )


def _worst(year: GlareYear, table: pd.DataFrame) -> dict[str, str]:
    """The view that is worst in most hours, and the one with the highest value."""
    most = table.loc[table[f"share_above_{LIMITS[-1]:.2f}"].idxmax()]
    highest = table.loc[table["highest_dgp"].idxmax()]
    moment = pd.Timestamp(highest["worst_hour"])
    picture = f"{highest['view']}_{moment:%m-%d_%Hh}"
    shown = year.options.worst > 0 and year.options.metric != "sDGP"
    return {
        "often": gettext(
            "{view}: {share} % of the hours of use above {limit}",
            view=most["view"],
            share=percent(100 * most[f"share_above_{LIMITS[-1]:.2f}"]),
            limit=rounded(LIMITS[-1], 2),
        ),
        "highest": gettext(
            "{view}: {metric} {value}, {hour}",
            view=highest["view"],
            metric=year.options.metric,
            value=rounded(highest["highest_dgp"], 2),
            hour=spoken(moment),
        ),
        "picture": f"{picture}.png" if shown else "",
        "sources": f"{picture}_sources.png" if shown else "",
    }


def _seats(table: pd.DataFrame) -> Table:
    """Protection by EN 17037 of each eye: in its worst direction and in its best."""
    eye, points = _eyes(table)
    rows = []
    for number, (x, y, _) in enumerate(points):
        own = table[eye == number]
        ranks = own["protection_en17037"].map(LEVELS.index)  # 0 is the best
        share = own[f"share_above_{LIMITS[-1]:.2f}"]
        rows.append(
            (
                str(number + 1),
                rounded(x, 2),
                rounded(y, 2),
                gettext(LEVEL_WORDS[LEVELS[int(ranks.max())]]),
                gettext(LEVEL_WORDS[LEVELS[int(ranks.min())]]),
                percent(100 * float(share.max())),
                rounded(float(own["highest_dgp"].max()), 2),
            )
        )
    limit = rounded(LIMITS[-1], 2)
    columns = (
        Column(gettext("Seat")),
        Column("x", "m"),
        Column("y", "m"),
        Column(gettext("Protection, worst direction"), numeric=False),
        Column(gettext("Protection, best direction"), numeric=False),
        Column(gettext("Above {limit} in the worst direction", limit=limit), "%"),
        Column(gettext("Maximum")),
    )
    return Table(gettext("Protection from glare by seat (EN 17037)"), columns, tuple(rows))


def _views(table: pd.DataFrame) -> Table:
    columns = (
        Column(gettext("View"), numeric=False),
        *(Column(gettext("Above {limit}", limit=rounded(limit, 2)), "%") for limit in LIMITS),
        Column(gettext("Exceeded in 5 %")),
        Column(gettext("Maximum")),
        Column(gettext("Worst hour"), numeric=False),
        Column(gettext("Protection"), numeric=False),
    )
    rows = [
        (
            str(row["view"]),
            *(percent(100 * row[f"share_above_{limit:.2f}"]) for limit in LIMITS),
            rounded(row["dgp_exceeded_in_5_percent"], 2),
            rounded(row["highest_dgp"], 2),
            f"{day_and_month(pd.Timestamp(row['worst_hour']), short=True)} {pd.Timestamp(row['worst_hour']):%H:%M}",
            gettext(LEVEL_WORDS[str(row["protection_en17037"])]),
        )
        for _, row in table.iterrows()
    ]
    return Table(gettext("All views"), columns, tuple(rows))
