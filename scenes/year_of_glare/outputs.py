"""The files of a year of glare: ratings, classes of each view, heat maps, worst hours."""

from __future__ import annotations

from importlib import metadata
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure

from mitsuba_cfs.files import json_text, replacing, write_table, write_text
from mitsuba_cfs.glare.classes import (
    CLASSES,
    LIMITS,
    class_hours,
    exceeded_share,
    hour_not_exceeded,
    mean_error,
    protection_level,
)
from mitsuba_cfs.images.hdr import write_hdr
from mitsuba_cfs.images.view import format_view
from scenes.figures.carpet import day_grid
from scenes.language.catalogue import gettext
from scenes.language.numbers import rounded, short_month, spoken
from scenes.pictures import write_check_picture, write_falsecolour
from scenes.report.headline import LEVEL_WORDS
from scenes.report.method import METHODS
from scenes.results import method_notes
from scenes.year_of_glare.year import GlareYear, ViewYear, rating_of, used_dgp

KEPT = "ratings"  # folder of the finished ratings, inside that of the results
LOWEST, HIGHEST = 0.15, 0.60  # ends of the heat map's scale
COLOURS = LinearSegmentedColormap.from_list(
    "glare",
    [(0.0, "#26456e"), (0.42, "#9cc3d5"), (0.444, "#f3e7a1"), (0.555, "#f0b04a"), (0.667, "#d9622b"), (1.0, "#7a1022")],
)


def write_view(year: GlareYear, rated: ViewYear, folder: Path) -> dict[str, object]:
    """Write a view's ratings, heat map and pictures; its row of `views.csv`.

    Captions are in the language of `in_language`.
    """
    name = rated.view.name
    write_table(rated.ratings, folder / f"{name}.parquet")
    row = view_row(year, rated)
    write_heat_map(folder / f"{name}_heat_map.png", year, rated)
    for moment, (picture, result) in rated.pictures.items():
        where = folder / f"{name}_{moment:%m-%d_%Hh}"
        dgp = rounded(rated.ratings.dgp[moment], 2)
        title = f"{spoken(moment)}, {year.options.metric} {dgp}"
        write_falsecolour(where.with_suffix(".png"), picture, title=title)
        write_check_picture(Path(f"{where}_sources.png"), result, title=title)
        if year.options.hdr:
            write_hdr(where.with_suffix(".hdr"), picture, rated.view.view)
    return row


def view_row(year: GlareYear, rated: ViewYear) -> dict[str, object]:
    """What a year of a view comes to; shares are of the hours of use."""
    dgp = used_dgp(year, rated.ratings.dgp.to_numpy())
    view = rated.view.view
    hours, errors = class_hours(dgp), rated.ratings.dgp_standard_error
    x, y, z = view.position
    return {
        "view": rated.view.name,
        "x": x,
        "y": y,
        "z": z,
        "direction_x": view.direction[0],
        "direction_y": view.direction[1],
        "direction_z": view.direction[2],
        "hours_of_use": len(dgp),
        **{f"hours_{name}": int(count) for name, count in zip(CLASSES, hours, strict=True)},
        **{f"share_above_{limit:.2f}": exceeded_share(dgp, limit) for limit in LIMITS},
        "dgp_exceeded_in_5_percent": hour_not_exceeded(dgp),
        "protection_en17037": protection_level(dgp),
        "highest_dgp": float(rated.ratings.dgp.max()),
        "highest_dgp_standard_error": float(errors[rated.ratings.dgp.idxmax()]),
        "dgp_standard_error": mean_error(errors),
        **rated.effects,
        "worst_hour": str(rated.ratings.dgp.idxmax()),
        "seconds": round(rated.seconds, 1),
        "VIEW": format_view(view),
    }


def write_heat_map(path: Path, year: GlareYear, rated: ViewYear) -> None:
    """DGP by hour of the day and day of the year (PNG); dark hours are grey."""
    times = year.weather.midpoints
    whole = np.full(len(times), np.nan)
    whole[year.sky.lit] = rated.ratings.dgp.to_numpy()
    grid = day_grid(times, whole)
    figure = Figure(figsize=(9, 3.6), dpi=140)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.07, 0.15, 0.78, 0.70))
    axes.set_facecolor("#d8d8d8")
    days = grid.shape[1]
    image = axes.imshow(
        grid,
        cmap=COLOURS,
        norm=Normalize(LOWEST, HIGHEST),
        aspect="auto",
        extent=(0, days, 0, 24),
        interpolation="nearest",
    )
    starts = pd.date_range(times[0].normalize(), periods=days, freq="D")
    first = np.flatnonzero(starts.day == 1)
    axes.set_xticks(first, [short_month(starts[d].month) for d in first], ha="left", fontsize=8)
    axes.set_yticks(range(0, 25, 3), [f"{h:02d}:00" for h in range(0, 25, 3)], fontsize=8)
    axes.set_ylabel(gettext("Hour of the day (local standard time)"), fontsize=8)
    dgp = used_dgp(year, rated.ratings.dgp.to_numpy())
    start, end = year.options.occupied
    axes.set_title(
        gettext(
            "{metric}, {method}, {room}, {view}: above {limit} in {share} % of the hours of use "
            "({start} to {end} o'clock), protection: {level}",
            metric=year.options.metric,
            method=gettext(METHODS.get(year.options.method, year.options.method)),
            room=year.room,
            view=rated.view.name,
            limit=rounded(0.45, 2),
            share=rounded(100 * exceeded_share(dgp, 0.45), 1),
            start=start,
            end=end,
            level=gettext(LEVEL_WORDS[protection_level(dgp)]),
        ),
        fontsize=8,
        loc="left",
    )
    for hour in (start, end):
        axes.axhline(hour, color="black", linewidth=0.6, linestyle=":")
    bar = figure.colorbar(image, cax=figure.add_axes((0.88, 0.15, 0.02, 0.70)), extend="both")
    ticks = [0.15, 0.25, *LIMITS, 0.60]
    bar.set_ticks(ticks, labels=[rounded(tick, 2) for tick in ticks])
    bar.ax.tick_params(labelsize=8)
    with replacing(path) as part:
        figure.savefig(part)


def write_summary(year: GlareYear, rows: list[dict[str, object]], folder: Path) -> pd.DataFrame:
    """Write the table of views and what the run was made from; the table."""
    table = pd.DataFrame(rows)
    write_table(table, folder / "views.csv", index=False)
    options = year.options
    manifest = {
        "quick": options.quick,
        "room": year.room,
        "options": {name: _plain(value) for name, value in options.named().items()},
        "inputs": year.digest,
        "glare_rule": rating_of(options).rule,
        "fenestration": list(year.fenestration),
        "head": year.head.record,
        "notes": [*year.head.notes, *all_notes(year, table)],
        "hours_with_sun": len(year.sky.lit),
        "version": metadata.version("mitsuba-cfs"),
    }
    write_text(folder / "glare_year.json", json_text(manifest, indent=2) + "\n")
    return table


def all_notes(year: GlareYear, table: pd.DataFrame) -> tuple[str, ...]:
    """Notes on the year besides those of its head; table: a row for each view."""
    return (*year.notes, *method_notes(table.to_dict("records")))


def _plain(value: object) -> object:
    if isinstance(value, tuple):
        return [_plain(one) for one in value]
    return str(value) if isinstance(value, Path) else value
