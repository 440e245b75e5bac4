r"""Radiance scenes of others and of our own, as they are: `cfs picture scene.rad` beside `rtrace`.

    python -m tests.validation radiance_scenes [FOLDER] [--points 8] [--seeds 4] [--samples 16]

Illuminance at an eye in the room's middle that looks at the window, under one overcast and one
sunny hour of the EPW, whose dew point is that of gendaylit.  The scenes of FOLDER and those of
`ours` and `further`: panes in series, fabrics, frosted panels, louvres on their side, a facade
opposite.  A scene that is refused has the message in its row.  The table is that of
docs/evidence_buildings.md.

Both programs have the sky on the same patches, as `perezlum.cal` mixes the ground into the sky at
the horizon.  Radiance spreads the straight beam of a `BSDF` over its patch, as `--see-through
FILE=lobe` does here; by default it is specular, which is the row without "lobe".
"""

from __future__ import annotations

import io
import re
import tempfile
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd

from mitsuba_cfs.images.view import parse_view
from mitsuba_cfs.sky.annual import annual_sky
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.matrix import DEFAULT_DEW_POINT_C
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from scenes.cli import run
from scenes.demo import VENETIAN_BLIND, WEATHER
from tests.benchmarks.radiance import environment
from tests.validation.geneva import with_dew_point
from tests.validation.rendered_scene import RenderedScene

FOLDER = Path(__file__).parents[3] / "shared" / "cases" / "radiance"
OFFICE = Path(__file__).parents[2] / "docs" / "tutorials" / "office.rad"
HOURS = {"overcast": "12-21 09:00", "sunny": "03-21 12:00"}  # [month-day hour] of the EPW
VIEW = "-vta -vp 2 4 1.2 -vd 0 -1 0 -vu 0 0 1 -vh 180 -vv 180"
# a negative limit is Russian roulette: a plain one ends paths behind a fabric, 1.5 % of its light
RTRACE = "-ab 12 -aa 0 -ad 20000 -as 0 -lw 1e-8 -lr -32"
SUBDIVISION = 4
LOBE = ["--see-through", f"{VENETIAN_BLIND.name}=lobe"]


def _pane(material: str, y: float, x: Sequence[float] = (0, 4), z: Sequence[float] = (0, 3)) -> str:
    corners = [(x[0], z[0]), (x[1], z[0]), (x[1], z[1]), (x[0], z[1])]
    numbers = "  ".join(f"{a} {y} {b}" for a, b in corners)
    return f"\n{material} polygon {material}_pane\n0\n0\n12 {numbers}\n"


def _glazed(text: str) -> str:
    """The tutorial's office with another glazing."""
    return OFFICE.read_text().replace("void glass glazing\n0\n0\n3 .87 .87 .87\n", text)


def _turned(text: str) -> str:
    """The office with its window's normal into the room."""
    corners = "0.6 0 0.9   3.4 0 0.9   3.4 0 2.5   0.6 0 2.5"
    back = "   ".join(corners.split("   ")[::-1])
    return text.replace(f"12  {corners}", f"12  {back}")


def _cloth(share: float) -> str:
    return f"\nvoid BRTDfunc cloth\n10 0 0 0 {share} {share} {share} 0 0 0 .\n0\n9 .4 .4 .4 .1 .1 .1 .02 .02 .02\n"


def ours() -> dict[str, tuple[str, list[str]]]:
    """Scenes of the tutorial's office, and the options of the command."""
    office = OFFICE.read_text()
    tinted = "\nvoid glass tinted\n0\n0\n3 .4 .4 .4\n"
    narrow = _pane("cloth", 0.1, (0.65, 3.35), (0.9, 2.5))
    niche = "".join(
        f"\n!genbox plaster {name} {width} 0.15 {height} | xform -t {x} 0 {z}\n"
        for name, width, height, x, z in (
            ("left", 0.1, 1.8, 0.5, 0.8),
            ("right", 0.1, 1.8, 3.4, 0.8),
            ("sill", 2.8, 0.1, 0.6, 0.8),
            ("head", 2.8, 0.1, 0.6, 2.5),
        )
    )
    facade = (
        "\nvoid glass facade\n0\n0\n3 .6 .6 .6\nvoid plastic dark\n0\n0\n5 0 0 0 0 0\n"
        "!genbox dark block 16 4 12 | xform -t -6 -10.02 0\n"
    ) + _pane("facade", -6, (-6, 10), (0, 12))
    corners = ["0.01 1 0.5", "0.01 5 0.5", "0.01 5 2.5", "0.01 1 2.5"]
    mirror = "\nvoid mirror silver\n0\n0\n3 .85 .85 .85\nsilver polygon sheet\n0\n0\n12 {}\n"
    outer = tinted + _pane("tinted", -0.05, (0.5, 3.5), (0.8, 2.6))
    trans = "void trans glazing\n0\n0\n7 .8 .8 .8 0 {} .6 .5\n"
    louvres = f"void BSDF glazing\n6 0 {VENETIAN_BLIND} {{}} .\n0\n0\n"
    own = {
        "tinted pane 5 cm outside": office + outer,
        "fabric of 5 %": office + _cloth(0.05) + _pane("cloth", 0.1),
        "fabric of 5 %, 5 cm beside it": office + niche + _cloth(0.05) + narrow,
        "mirror on a wall": office + mirror.format("  ".join(corners)),
        "mirror on a wall, turned": office + mirror.format("  ".join(corners[::-1])),
        "smooth trans": _glazed(trans.format(0)),
        "rough trans": _glazed(trans.format(0.1)),
        "louvres": _glazed(louvres.format("0 0 1")),
        "louvres, pane turned": _turned(_glazed(louvres.format("0 0 1"))),
        "louvres on their side": _glazed(louvres.format("1 0 0")),
        "louvres on their side, pane turned": _turned(_glazed(louvres.format("1 0 0"))),
    }
    scenes: dict[str, tuple[str, list[str]]] = {name: (text, []) for name, text in own.items()}
    scenes |= {f"{name}, lobe": (own[name], LOBE) for name in own if name.startswith("louvres")}
    scenes["glass facade 6 m opposite"] = office + facade, ["--facade-pane", "facade"]
    return scenes


ROOM = """
void plastic grey 0 0 5 .45 .45 .45 0 0
void plastic white 0 0 5 .8 .8 .8 0 0
void plastic ground 0 0 5 .2 .2 .2 0 0
grey polygon floor 0 0 12 0 0 0 5 0 0 5 7 0 0 7 0
white polygon ceiling 0 0 12 0 0 2.8 0 7 2.8 5 7 2.8 5 0 2.8
white polygon north 0 0 12 0 7 0 5 7 0 5 7 2.8 0 7 2.8
grey polygon west 0 0 12 0 0 0 0 7 0 0 7 2.8 0 0 2.8
white polygon east 0 0 12 5 0 0 5 0 2.8 5 7 2.8 5 7 0
grey polygon south 0 0 30 0 0 0 0 0 2.8 5 0 2.8 5 0 0 0 0 0
 1 0 0.7 4 0 0.7 4 0 2.3 1 0 2.3 1 0 0.7
ground polygon plain 0 0 12 -40 -60 -0.1 45 -60 -0.1 45 0 -0.1 -40 0 -0.1
"""
WINDOW = (1, 4), (0.7, 2.3)  # x and z of its opening [m]


def further() -> dict[str, tuple[str, list[str]]]:
    """Scenes of another room, made after the readers and not tuned to."""
    clear, bronze, grey_glass = (
        f"\nvoid glass {name}\n0\n0\n3 {value} {value} {value}\n"
        for name, value in (("clear", 0.9), ("bronze", 0.55), ("smoke", 0.7))
    )
    three = clear + bronze + grey_glass
    for name, y in (("clear", 0.0), ("bronze", -0.02), ("smoke", -0.14)):
        three += _pane(name, y, (0.6, 4.4) if y else WINDOW[0], (0.4, 2.6) if y else WINDOW[1])
    outside = clear + _pane("clear", 0, *WINDOW) + _cloth(0.12)
    outside += _pane("cloth", -0.08, (0.7, 4.3), (0.4, 2.6))
    slanted = f"\nvoid BSDF slats\n6 0 {VENETIAN_BLIND} 0.6 0 0.8 .\n0\n0\n"
    slanted += clear + _pane("clear", 0, *WINDOW) + _pane("slats", -0.1, (0.6, 4.4), (0.3, 2.7))
    tower = (
        "\nvoid glass tower\n0\n0\n3 .5 .5 .5\nvoid plastic core\n0\n0\n5 .02 .02 .02 0 0\n"
        "!genbox core block 20 6 30 | xform -t -12 -18.02 0\n"
    ) + _pane("tower", -12, (-12, 8), (0, 30))
    tower += clear + _pane("clear", 0, *WINDOW)
    return {
        "further: three panes, 2 and 12 cm apart": (ROOM + three, []),
        "further: fabric of 12 %, 8 cm outside": (ROOM + outside, []),
        "further: louvres at 37 degrees and a pane": (ROOM + slanted, []),
        "further: glass tower 12 m opposite": (ROOM + tower, ["--facade-pane", "tower"]),
    }


def by_command(scene: Path, weather: Path, at: str, seeds: int, options: Sequence[str]) -> tuple[float, float] | str:
    """Illuminance at the eye [lx] by `cfs picture` and its standard error, or its refusal."""
    words = [
        "picture",
        scene,
        "--weather",
        weather,
        "--at",
        at,
        "--view",
        VIEW,
        "--sun-model",
        "radiance",
        "--sky-ground",
        "gendaylit",
        "--out",
        scene.with_suffix(".png"),
    ]
    values = []
    for seed in range(seeds):
        with redirect_stdout(io.StringIO()) as shown, redirect_stderr(io.StringIO()) as refusal:
            code = run([*map(str, words), *options, "--seed", str(seed)])
        if code:
            line = refusal.getvalue().strip().splitlines()[-1]
            return f"refused: line {line.rpartition(f'{scene}:')[2].partition(';')[0]}"
        (value,) = re.findall(r"Ev ([\d,.]+) lx", shown.getvalue())
        values.append(float(value.replace(",", "")))
    return float(np.mean(values)), float(np.std(values, ddof=1) / np.sqrt(seeds))


def by_rtrace(scene: Path, weather: Path, at: str, points: int, view: str = VIEW) -> tuple[float, float]:
    """The same by `rtrace` under the same sky, and the standard error of its mean."""
    hours = read_epw(weather)
    date, _, time = at.partition(" ")
    month, day, hour = (int(part) for part in (*date.split("-"), time[:2]))
    midpoints = pd.DatetimeIndex(hours.midpoints)
    chosen = (midpoints.month == month) & (midpoints.day == day) & (midpoints.hour == hour)
    sky = annual_sky(hours, SUBDIVISION, hours=np.flatnonzero(chosen), sun_model="radiance", ground="gendaylit")
    rendered = RenderedScene(scene.parent, scene.name, "", RTRACE)
    luminance = float(sky.illuminance[0]) / SUN_SOLID_ANGLE
    rendered.set_sky(sky.without_sun()[:, 0], SUBDIVISION, sky.direction[0], luminance)
    return rendered.eye_illuminance(parse_view(view), points)


def cells(there: tuple[float, float], here: tuple[float, float] | str) -> list[str]:
    """Both illuminances and their difference [%] with standard errors, as cells of the table.

    A difference of more than 2 % and three of its standard errors is bold.
    """
    ours = here if isinstance(here, str) else f"{here[0]:,.0f} ± {here[1]:,.1f}"
    shown = [f"{there[0]:,.0f} ± {there[1]:,.1f}", ours]
    if isinstance(here, str):
        return [*shown, ""]
    ratio = here[0] / there[0]
    noise = 100 * ratio * float(np.hypot(here[1] / here[0], there[1] / there[0]))
    off = 100 * (ratio - 1)
    text = f"{off:+.1f} ± {noise:.1f}"
    return [*shown, f"**{text}**" if abs(off) > max(2.0, 3 * noise) else text]


def main(
    folder: Path = FOLDER,
    *,
    points: Annotated[int, "eyes of rtrace at one place"] = 8,
    seeds: Annotated[int, "runs of the command"] = 4,
    samples: Annotated[int, "paths per pixel"] = 16,
    size: Annotated[int, "[px]"] = 200,
    weather: Path = WEATHER,
    only: Annotated[Sequence[str], "names of scenes; all by default"] = (),
) -> None:
    """Print a row for each scene [lx] as soon as it is computed."""
    environment()  # says at once where there is no Radiance
    files = {path.name: path.read_text() for path in sorted(folder.glob("*.rad"))}
    scenes: dict[str, tuple[str, list[str]]] = {name: (text, []) for name, text in files.items() if "polygon" in text}
    scenes |= ours() | further()
    columns = [f" {sky}: `rtrace` | `cfs picture` | % |" for sky in HOURS]
    print(f"| scene |{''.join(columns)}\n{'|---' * (1 + 3 * len(HOURS))}|", flush=True)
    with tempfile.TemporaryDirectory() as temporary:
        epw = with_dew_point(weather, Path(temporary), DEFAULT_DEW_POINT_C)
        for number, (name, (text, options)) in enumerate(scenes.items()):
            if only and name not in only:
                continue
            scene, row = Path(temporary) / f"scene_{number}.rad", [name]
            scene.write_text(text)
            more = [*options, "--samples", str(samples), "--size", str(size)]
            for at in HOURS.values():
                here = by_command(scene, epw, at, seeds, more)
                row += cells(by_rtrace(scene, epw, at, points), here)
            print(f"| {' | '.join(row)} |", flush=True)
