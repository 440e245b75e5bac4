r"""The dissertation's Tables 4, 7 and 10 remade: DGP, eDGP, sDGP of three methods against slats.

    python -m tests.validation glare_methods \
        --weather CITY.epw --json FILE [--system "5 degrees"]
    python -m tests.validation glare_methods --table FILE [--series FOLDER]

Hours of sunny days in June and September (the dissertation measured from 3 to 6 June behind blinds
and on 4 and 5 September without).  The "measurement" is the DGP of a path-traced picture of the
room with its slats as geometry; the methods know a blind by Klems matrices and a tensor tree only.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.glare.evaluation import GlareOptions, evaluate
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.methods import METHODS
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.light import daylight
from mitsuba_cfs.methods.optics import SystemOptics
from mitsuba_cfs.methods.point_in_time import path_tracing_room, picture_with_disc
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.sky.annual import AnnualSky, annual_sky
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.surfaces import Surfaces
from scenes.pictures import write_falsecolour
from tests.validation.blind_room import TILTS, blind_layer, empty, slats
from tests.validation.glare_room import glare_scene, known_system, lit_hours, measurement, sunny_days
from tests.validation.method_errors import method_matrices

GLARE = ("DGP", "eDGP", "sDGP")
SEED = 7  # of the measurement; the methods have another
DISSERTATION = {  # Tables 4, 7, 10: rMBE, rRMSE, largest and least relative error [%]
    ("three-phase", "DGP"): (-6, 23, 50, -63),
    ("three-phase", "eDGP"): (-5, 25, 58, -62),
    ("three-phase", "sDGP"): (1, 25, 70, -59),
    ("five-phase", "DGP"): (2, 11, 29, -18),
    ("five-phase", "eDGP"): (1, 10, 29, -18),
    ("five-phase", "sDGP"): (2, 16, 43, -42),
    ("point-in-time", "DGP"): (2, 11, 29, -18),
    ("point-in-time", "eDGP"): (2, 10, 21, -17),
    ("point-in-time", "sDGP"): (2, 15, 39, -34),
}


@dataclass(frozen=True)
class GlareCase:
    """A system as geometry and as the methods know it, and the skies it is rated under."""

    name: str
    exterior: Surfaces
    system: SystemOptics
    sky: AnnualSky
    times: tuple[str, ...]
    raised: tuple[float, ...] = (0.0,)  # [m] eyes of the measurement above the view's, for a mean
    sun: str = "source"  # `GlareOptions.sun` of measurement and methods: a source or its pixels


def measured(
    scene: DaylightScene, case: GlareCase, sampling: Sampling, pictures: Path | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """DGP and illuminance [lx] of the room with everything as geometry [H]."""
    geometry, rows = GlareView(scene.view), []
    for height in case.raised:
        eye = np.add(scene.view.position, [0, 0, height])
        raised = replace(scene, view=replace(scene.view, position=tuple(eye)))
        light, row = measurement(raised, case.exterior, case.sky, sampling), []
        room = path_tracing_room(light.scene, light.systems)
        for hour in range(len(case.sky.lit)):
            picture = picture_with_disc(light, room, hour, seed=SEED)
            if case.sun == "source":
                found = evaluate(picture.bare, geometry, discs=picture.discs)
            else:
                found = evaluate(picture.shown, geometry)
            row.append((found.dgp, found.Ev))
            if pictures is not None:
                title = f"{case.name}, {case.times[hour]}: DGP {found.dgp:.3f}"
                name = f"{case.name.replace(' ', '_')}_{hour:02d}.png"
                write_falsecolour(pictures / name, picture.shown, title=title)
        rows.append(row)
    dgp, lux = np.mean(rows, axis=0).T
    return dgp, lux


def rated(scene: DaylightScene, cases: list[GlareCase], sampling: Sampling, pictures: Path | None) -> list[dict]:
    """The measurement and all methods for all cases; a method's scene is traced once."""
    found = []
    for case in cases:
        dgp, lux = measured(scene, case, sampling, pictures)
        found.append(
            {
                "system": case.name,
                "times": list(case.times),
                "Ev": lux.round(1).tolist(),
                "measured": dgp.round(5).tolist(),
                "methods": {},
            }
        )
        print(case.name, "measured", dgp.round(3), file=sys.stderr, flush=True)
    for method in METHODS:
        matrices = method_matrices(method, scene, sampling)
        for metric in GLARE:
            start = time.monotonic()
            for case, run in zip(cases, found, strict=True):
                light = daylight(
                    scene,
                    [[case.system]] * len(scene.groups),
                    case.sky,
                    method=method,
                    sampling=sampling,
                    needs=(),
                    matrices=matrices,
                )
                options = GlareOptions(sun=case.sun)
                dgp = hourly_glare(light, metric, options=options).dgp
                run["methods"][f"{method} {metric}"] = dgp.round(5).tolist()
            seconds = time.monotonic() - start
            print(f"{method} {metric}: {seconds:.0f} s", file=sys.stderr, flush=True)
    return found


def weather_case(name: str, weather: Weather, scene: DaylightScene, days: int, every: int, levels: int) -> GlareCase:
    """A system of `TILTS` in every so-many-th hour of so many days in a month."""
    tilt = TILTS[name]
    chosen = [sunny_days(weather, 9, 4, days)]
    if tilt is not None:
        chosen.append(sunny_days(weather, 6, 4, days))
    hours = lit_hours(weather, np.sort(np.concatenate(chosen)), every)
    layer = None if tilt is None else blind_layer(tilt)
    return GlareCase(
        name,
        empty() if tilt is None else slats(scene.groups[0], tilt),
        known_system(layer, levels=levels),
        annual_sky(weather, hours=hours),
        tuple(f"{t:%m-%d %H:%M}" for t in weather.midpoints[hours]),
    )


def errors(found, reference) -> tuple[float, float, float, float]:
    """Relative mean bias, root mean square, largest and least error [%], of DGP [H]."""
    relative = 100 * (np.asarray(found) / np.asarray(reference) - 1)
    parts = relative.mean(), np.sqrt(np.mean(relative**2)), relative.max(), relative.min()
    return tuple(round(float(part), 1) for part in parts)


def table(runs: list[dict]) -> str:
    """The tables of all systems together, and of each, as Markdown."""
    dgp = np.concatenate([run["measured"] for run in runs])
    lines = [
        f"{len(dgp)} hours, measured DGP {dgp.min():.2f} to {dgp.max():.2f}",
        "",
        " | ".join(["| method, metric", *(r["system"] for r in runs), "all", "dissertation |"]),
        "|" + "---|" * (len(runs) + 3),
    ]
    for method in METHODS:
        for metric in GLARE:
            key = f"{method} {metric}"
            each = [_cell(errors(run["methods"][key], run["measured"])) for run in runs]
            found = np.concatenate([run["methods"][key] for run in runs])
            both = [_cell(errors(found, dgp)), _cell(DISSERTATION[method, metric])]
            lines.append(f"| {method}, {metric} | " + " | ".join(each + both) + " |")
    return "\n".join(lines)


def write_series(runs: list[dict], folder: Path) -> None:
    """DGP of the measurement and of each method's metrics over the hours: Figures 33 to 44 (PNG).

    A picture for each method (36 to 38, 39 to 41, 42 to 44), with the measurement (33 to 35) in it,
    a row for each system, a column for each of its days.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    folder.mkdir(parents=True, exist_ok=True)
    columns = max(len(_days(run)) for run in runs)
    for method in METHODS:
        figure = Figure(figsize=(3.2 * columns, 1.7 * len(runs)), dpi=100, layout="constrained")
        FigureCanvasAgg(figure)
        places = figure.subplots(len(runs), columns, squeeze=False, sharey=True)
        for row, run in zip(places, runs, strict=True):
            for axes in row[len(_days(run)) :]:
                axes.remove()
            for axes, (day, at) in zip(row, _days(run).items(), strict=False):
                _draw_day(axes, run, at, method)
                axes.set_title(f"{run['system']}, {day}, {method}", fontsize=7)
        places[0, 0].legend(fontsize=6)
        figure.savefig(folder / f"glare_{method}.png")


def _days(run: dict) -> dict[str, list[int]]:
    """The hours of each day of a run, by number."""
    found: dict[str, list[int]] = {}
    for i, time_of_day in enumerate(run["times"]):
        found.setdefault(time_of_day.split()[0], []).append(i)
    return found


def _draw_day(axes, run: dict, at: list[int], method: str) -> None:
    clock = [run["times"][i].split()[1].split(":") for i in at]
    hour = [int(h) + int(m) / 60 for h, m in clock]
    measured_dgp = [run["measured"][i] for i in at]
    axes.plot(hour, measured_dgp, "ko-", label="slats as geometry", markersize=3)
    for metric, style in zip(GLARE, ("-", "--", ":"), strict=True):
        values_of = run["methods"][f"{method} {metric}"]
        axes.plot(hour, [values_of[i] for i in at], style, label=metric)
    axes.set_ylim(0, 1.02)
    axes.tick_params(labelsize=7)
    axes.grid(alpha=0.3)


def _cell(found: tuple[float, ...]) -> str:
    bias, square, most, least = found
    return f"{square:g} ({bias:+g}), {least:+g} to {most:+g}"


def main(
    *,
    table_: Annotated[Path | None, "file of a run, to print its table again"] = None,
    weather: Path | None = None,
    system: Annotated[Sequence[str], TILTS, "default: all"] = (),
    days: Annotated[int, "in each month"] = 2,
    every: Annotated[int, "hours from one to the next"] = 3,
    size: Annotated[int, "pixels of a side"] = 180,
    samples: Annotated[int, "paths of a pixel"] = 8,
    levels: Annotated[int, "4^levels cells of the tree"] = 5,
    pictures: Annotated[Path | None, "folder for the measurement's pictures"] = None,
    json_: Path | None = None,
    series: Annotated[Path | None, "folder for the time series, Figures 33 to 44"] = None,
) -> None:
    """Run the systems and print their table."""
    if table_:
        runs = json.loads(table_.read_text())
        print(table(runs))
        if series:
            write_series(runs, series)
        return
    if weather is None:
        raise ValueError("--weather is needed")
    variants.activate()
    if pictures:
        pictures.mkdir(parents=True, exist_ok=True)
    scene, weather = glare_scene(size), read_epw(weather)
    sampling = Sampling(picture_samples=samples, view_samples=2 * samples)
    names = system or list(TILTS)
    cases = [weather_case(name, weather, scene, days, every, levels) for name in names]
    found = rated(scene, cases, sampling, pictures)
    if json_:
        json_.write_text(json.dumps(found, indent=1))
    if series:
        write_series(found, series)
    print(table(found))
