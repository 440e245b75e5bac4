r"""Radiance scenes of others and of our own, as they are: `cfs picture scene.rad` beside `rtrace`.

    python -m tests.validation radiance_scenes [FOLDER] [--runs 2] [--samples 64] [--size 300]

Illuminance at an eye in the room's middle that looks at the window, under one overcast and one
sunny hour of the EPW, whose dew point is that of gendaylit.  The scenes of FOLDER and those of
`OURS`: panes in series, a fabric, frosted panels, louvres on their side, a facade opposite.
A scene that is refused has the message in its row.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd

from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.matrix import DEFAULT_DEW_POINT_C
from scenes.demo import VENETIAN_BLIND, WEATHER
from tests.benchmarks.radiance import environment, eye_illuminance
from tests.validation.geneva import with_dew_point

FOLDER = Path(__file__).parents[3] / "shared" / "cases" / "radiance"
OFFICE = Path(__file__).parents[2] / "docs" / "tutorials" / "office.rad"
HOURS = {"overcast": "12-21 09:00", "sunny": "03-21 12:00"}  # [month-day hour] of the EPW
EYE, DIRECTION = (2.0, 4.0, 1.2), (0.0, -1.0, 0.0)


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
    return (
        f"\nvoid BRTDfunc cloth\n10 0 0 0 {share} {share} {share} 0 0 0 .\n0\n"
        "9 .4 .4 .4 .1 .1 .1 .02 .02 .02\n"
    )


def ours() -> dict[str, tuple[str, list[str]]]:
    """Scenes of the tutorial's office, and the options of the command."""
    office = OFFICE.read_text()
    tinted = "\nvoid glass tinted\n0\n0\n3 .4 .4 .4\n"
    narrow = _pane("cloth", 0.1, (0.65, 3.35), (0.9, 2.5))
    niche = "".join(
        f"\n!genbox plaster {name} {width} 0.15 {height} | xform -t {x} 0 {z}\n"
        for name, width, height, x, z in (
            ("left", 0.1, 1.8, 0.5, 0.8), ("right", 0.1, 1.8, 3.4, 0.8),
            ("sill", 2.8, 0.1, 0.6, 0.8), ("head", 2.8, 0.1, 0.6, 2.5),
        )
    )  # fmt: skip
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
    scenes["glass facade 6 m opposite"] = office + facade, ["--facade-pane", "facade"]
    return scenes


def by_command(scene: Path, weather: Path, at: str, options: Sequence[str]) -> float | str:
    """Illuminance at the eye [lx] by `cfs picture`, or its refusal."""
    view = f"-vta -vp {_words(EYE)} -vd {_words(DIRECTION)} -vu 0 0 1 -vh 180 -vv 180"
    words = [
        "picture", scene, "--weather", weather, "--at", at, "--view", view,
        "--sun-model", "radiance", "--sky-ground", "gendaylit", "--out", scene.with_suffix(".png"),
    ]  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-m", "scenes.cli", *map(str, words), *options],
        check=False, capture_output=True, text=True,
    )  # fmt: skip
    if done.returncode:
        return "refused: " + done.stderr.strip().splitlines()[-1].rpartition(f"{scene}:")[2]
    (value,) = re.findall(r"Ev ([\d,]+) lx", done.stdout)
    return float(value.replace(",", ""))


def by_rtrace(scene: Path, weather: Path, at: str, runs: int) -> tuple[float, float]:
    """The same by `rtrace` under gendaylit's sky, and the standard error of its mean."""
    hours = read_epw(weather)
    date, _, time = at.partition(" ")
    month, day, hour = (int(part) for part in (*date.split("-"), time[:2]))
    midpoints = pd.DatetimeIndex(hours.midpoints)
    (row,) = np.flatnonzero(
        (midpoints.month == month) & (midpoints.day == day) & (midpoints.hour == hour)
    )
    place = f"-a {hours.latitude_deg} -o {-hours.longitude_deg} -m {-15 * hours.timezone_h}"
    beam, diffuse = hours.direct_normal[row], hours.diffuse_horizontal[row]
    sky = f"{month} {day} {hour + 0.5} {place} -W {beam:g} {diffuse:g}"
    eye = f"{_words(EYE)} {_words(DIRECTION)}"
    values = [eye_illuminance(scene.parent, [scene.name], sky, eye) for _ in range(runs)]
    return float(np.mean(values)), float(np.std(values, ddof=1) / np.sqrt(runs))


def _words(numbers: Sequence[float]) -> str:
    return " ".join(f"{number:g}" for number in numbers)


def main(
    folder: Path = FOLDER,
    *,
    runs: Annotated[int, "of rtrace"] = 2,
    samples: Annotated[int, "paths per pixel"] = 64,
    size: Annotated[int, "[px]"] = 300,
    weather: Path = WEATHER,
    only: Annotated[Sequence[str], "names of scenes; all by default"] = (),
) -> pd.DataFrame:
    """A row for each scene and hour [lx]."""
    environment()  # says at once where there is no Radiance
    files = {path.name: path.read_text() for path in sorted(folder.glob("*.rad"))}
    scenes = {name: (text, []) for name, text in files.items() if "polygon" in text} | ours()
    rows = []
    with tempfile.TemporaryDirectory() as temporary:
        epw = with_dew_point(weather, Path(temporary), DEFAULT_DEW_POINT_C)
        for number, (name, (text, options)) in enumerate(scenes.items()):
            if only and name not in only:
                continue
            scene = Path(temporary) / f"scene_{number}.rad"
            scene.write_text(text)
            for sky, at in HOURS.items():
                more = [*options, "--samples", str(samples), "--size", str(size)]
                here = by_command(scene, epw, at, more)
                there, error = by_rtrace(scene, epw, at, runs)
                row = {"scene": name, "sky": sky, "rtrace": round(there), "+-": round(error, 1)}
                deviation = 100 * (here / there - 1) if isinstance(here, float) else None
                rows.append(row | {"cfs picture": here, "%": deviation and round(deviation, 1)})
                print(rows[-1], file=sys.stderr)
    return pd.DataFrame(rows)
