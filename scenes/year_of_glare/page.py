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
from scenes.language.numbers import percent, rounded, spoken
from scenes.quick import NOTE
from scenes.report.page import FILES as SHARED
from scenes.report.page import environment
from scenes.report.page_files import page_files
from scenes.report.tables import Column, Table
from scenes.year_of_glare.year import GlareYear, rating_of

FILES = page_files("scenes.year_of_glare")
ALONE = 1.5  # [m] between eyes where there is one
NEAR = 0.01  # [m] eyes nearer than this are one


def write_page(year: GlareYear, table: pd.DataFrame, path: Path) -> None:
    """Write the page (HTML, needs nothing else but its pictures' files beside it).

    Args: table: a row for each view, as in `views.csv`.
    """
    text = (
        environment(FILES)
        .get_template("glare_year.html.j2")
        .render(
            year=year,
            facts=_facts(year, table),
            notes=(*year.head.lines, *year.notes),
            plan=_plan(year, table),
            limits=[f"{limit:.2f}" for limit in LIMITS],
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
    rows = [("Run", NOTE)] if options.quick else []
    return [
        *rows,
        ("Room", year.room),
        ("Weather", year.weather.site),
        ("Fenestration", ", ".join(dict.fromkeys(str(f["system"]) for f in year.fenestration))),
        ("Views", f"{len(table)}, of {len(_eyes(table)[1])} eyes"),
        ("Hours of use", f"{start} to {end} o'clock, {table['hours_of_use'].iloc[0]} hours"),
        ("Rating", f"{options.metric}, {options.method}; {rating_of(options).rule}"),
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
        f"{percent(100 * getattr(row, _column(limit)))} % above {limit:.2f}" for limit in LIMITS
    )
    return (
        f"{row.view}: {shares}; highest {row.highest_dgp:.2f}, protection {row.protection_en17037}"
    )


def _worst(year: GlareYear, table: pd.DataFrame) -> dict[str, str]:
    """The view that is worst in most hours, and the one with the highest value."""
    most = table.loc[table[f"share_above_{LIMITS[-1]:.2f}"].idxmax()]
    highest = table.loc[table["highest_dgp"].idxmax()]
    moment = pd.Timestamp(highest["worst_hour"])
    picture = f"{highest['view']}_{moment:%m-%d_%Hh}"
    shown = year.options.worst > 0 and year.options.metric != "sDGP"
    return {
        "often": f"{most['view']}: {percent(100 * most[f'share_above_{LIMITS[-1]:.2f}'])} % of the "
        f"hours of use above {LIMITS[-1]:.2f}",
        "highest": f"{highest['view']}: {year.options.metric} {highest['highest_dgp']:.2f}, "
        f"{spoken(moment)}",
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
                LEVELS[int(ranks.max())],
                LEVELS[int(ranks.min())],
                percent(100 * float(share.max())),
                rounded(float(own["highest_dgp"].max()), 2),
            )
        )
    columns = (
        Column("Seat"), Column("x", "m"), Column("y", "m"),
        Column("Protection, worst direction", numeric=False),
        Column("Protection, best direction", numeric=False),
        Column(f"Above {LIMITS[-1]:.2f} in the worst direction", "%"), Column("Highest"),
    )  # fmt: skip
    return Table("Protection from glare by seat (EN 17037)", columns, tuple(rows))


def _views(table: pd.DataFrame) -> Table:
    columns = (
        Column("View", numeric=False), *(Column(f"Above {limit:.2f}", "%") for limit in LIMITS),
        Column("Not exceeded in 95 %"), Column("Highest"), Column("Worst hour", numeric=False),
        Column("Protection", numeric=False),
    )  # fmt: skip
    rows = [
        (
            str(row["view"]),
            *(percent(100 * row[f"share_above_{limit:.2f}"]) for limit in LIMITS),
            rounded(row["dgp_exceeded_in_5_percent"], 2),
            rounded(row["highest_dgp"], 2),
            f"{pd.Timestamp(row['worst_hour']):%d %b %H:%M}",
            str(row["protection_en17037"]),
        )
        for _, row in table.iterrows()
    ]
    return Table("All views", columns, tuple(rows))
