"""The dissertation's Tables 4, 7 and 10 remade: DGP, eDGP, sDGP of three methods against slats.

    python -m scenes.validation.glare_methods --weather CITY.epw --system "40 degrees" --json FILE
    python -m scenes.validation.glare_methods --table FILE FILE ...

Every third hour of sunny days in June and September (the dissertation measured from 3 to 6 June
and on 4 and 5 September).  The "measurement" is the DGP of a path-traced picture of the room with
its slats as geometry; the methods know a blind by its Klems matrices and its tensor tree only.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs import variants
from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.sky.weather import read_epw
from scenes.methods.methods import METHODS, method_scene
from scenes.methods.place import Place, Quality, Skies, skies_of
from scenes.pictures import write_falsecolour
from scenes.validation import blind_room as daylight
from scenes.validation.glare_room import (
    blind,
    glare_place,
    known_system,
    lit_hours,
    measurement,
    sunny_days,
)

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


def measured(
    place: Place, exterior, skies: Skies, quality: Quality, pictures: Path | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """DGP and illuminance [lx] of the room with everything as geometry [H]."""
    room = measurement(place, exterior, "DGP", quality)
    geometry, dgp, lux = GlareView(place.view), [], []
    for hour in range(skies.hours):
        picture = room.picture(skies, hour, seed=SEED)
        found = evaluate(picture, geometry)
        dgp.append(found.dgp)
        lux.append(found.Ev)
        if pictures is not None:
            title = f"measurement, hour {hour}: DGP {found.dgp:.3f}, {found.count} sources"
            write_falsecolour(pictures / f"measured_{hour:02d}.png", picture, title=title)
    return np.array(dgp), np.array(lux)


def one_system(options, place: Place, quality: Quality) -> dict:
    """The measurement and all methods for one system."""
    weather = read_epw(options.weather)
    tilt = daylight.TILTS[options.system]
    days = [sunny_days(weather, 9, 4, options.days)]
    if tilt is not None:
        days.append(sunny_days(weather, 6, 4, options.days))
    hours = lit_hours(weather, np.sort(np.concatenate(days)), options.every)
    skies = skies_of(weather, hours, subdivision=quality.subdivision)
    slats = None if tilt is None else blind(place, tilt)
    exterior = daylight.empty() if slats is None else slats.exterior
    start = time.monotonic()
    dgp, lux = measured(place, exterior, skies, quality, options.pictures)
    seconds = {"measurement": time.monotonic() - start}
    system = known_system(None if slats is None else slats.layer, levels=options.levels)
    found = {}
    for method in METHODS:
        for metric in GLARE:
            start = time.monotonic()
            scene = method_scene(method, metric, place, quality)
            values = scene.behind(system).values(skies)
            seconds[f"{method} {metric}"] = time.monotonic() - start
            found[f"{method} {metric}"] = values.round(5).tolist()
            print(options.system, method, metric, errors(values, dgp), flush=True)
    return {
        "system": options.system,
        "times": [str(t) for t in weather.midpoints[hours]],
        "sun_on_facade": (skies.direction @ place.groups[0].frame[2] > 0).tolist(),
        "Ev": lux.round(1).tolist(),
        "measured": dgp.round(5).tolist(),
        "methods": found,
        "seconds": {name: round(s, 1) for name, s in seconds.items()},
    }


def errors(found, reference) -> tuple[float, float, float, float]:
    """Relative mean bias, root mean square, largest and least error [%], of DGP [H]."""
    relative = 100 * (np.asarray(found) / np.asarray(reference) - 1)
    parts = relative.mean(), np.sqrt(np.mean(relative**2)), relative.max(), relative.min()
    return tuple(round(float(part), 1) for part in parts)


def table(files: list[Path]) -> str:
    """The tables of all systems together, and of each, as Markdown."""
    runs = [json.loads(file.read_text()) for file in files]
    dgp = np.concatenate([run["measured"] for run in runs])
    lines = [
        f"{len(dgp)} hours, measured DGP {dgp.min():.2f} to {dgp.max():.2f}",
        "",
        "| method, metric | "
        + " | ".join(run["system"] for run in runs)
        + " | all | dissertation |",
        "|" + "---|" * (len(runs) + 3),
    ]
    for method in METHODS:
        for metric in GLARE:
            key = f"{method} {metric}"
            each = [_cell(errors(run["methods"][key], run["measured"])) for run in runs]
            values = np.concatenate([run["methods"][key] for run in runs])
            both = [_cell(errors(values, dgp)), _cell(DISSERTATION[method, metric])]
            lines.append(f"| {method}, {metric} | " + " | ".join(each + both) + " |")
    return "\n".join(lines)


def _cell(found: tuple[float, ...]) -> str:
    bias, square, most, least = found
    return f"{square:g} ({bias:+g}), {least:+g} to {most:+g}"


def main() -> None:
    """Run one system, or print the table of runs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--table", type=Path, nargs="+", help="files of runs to put together")
    parser.add_argument("--weather", type=Path)
    parser.add_argument("--system", choices=daylight.TILTS, default="40 degrees")
    parser.add_argument("--days", type=int, default=2, help="in each month")
    parser.add_argument("--every", type=int, default=3, help="hours from one to the next")
    parser.add_argument("--size", type=int, default=240, help="pixels of a side")
    parser.add_argument("--samples", type=int, default=16, help="paths of a pixel")
    parser.add_argument("--levels", type=int, default=5, help="4^levels cells of the tree")
    parser.add_argument("--pictures", type=Path, help="folder for the measurement's pictures")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    if options.table:
        print(table(options.table))
        return
    if options.weather is None:
        parser.error("--weather is needed")
    variants.activate()
    if options.pictures:
        options.pictures.mkdir(parents=True, exist_ok=True)
    place = glare_place(options.size)
    quality = Quality(path_samples=options.samples, pixel_samples=options.samples)
    found = one_system(options, place, quality)
    if options.json:
        options.json.write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
