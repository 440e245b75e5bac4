r"""The sun in a mirror by the command: DGP and illuminance at the eye, whatever the pixels.

    python -m tests.validation mirrored_sun [--sizes 150 300 1200] [--year 150 300]

A room that faces a facade of 7 % reflectance, which mirrors the sun behind the house, and a room
with a polished shelf of 1 % in the sun.  `cfs picture` of one hour with each size; `cfs dgp` of the
year with each size of `--year`, of which the table has the same hour.
"""

from __future__ import annotations

import io
import re
import tempfile
from collections.abc import Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import Annotated

import pandas as pd

from mitsuba_cfs.sky.matrix import DEFAULT_DEW_POINT_C
from scenes.cli import run
from scenes.demo import WEATHER
from tests.validation.geneva import with_dew_point
from tests.validation.radiance_scenes import ROOM, WINDOW, _pane, by_rtrace

HOUSE = ROOM + "\nvoid glass clear\n0\n0\n3 .9 .9 .9\n" + _pane("clear", 0, *WINDOW)
FACADE = (
    "\nvoid mirror facade\n0\n0\n3 .07 .07 .07\n"
    "facade polygon opposite\n0\n0\n12 8 -12 0  -12 -12 0  -12 -12 30  8 -12 30\n"
)
SHELF = (
    "\nvoid mirror polish\n0\n0\n3 .01 .01 .01\npolish polygon shelf\n0\n0\n12 1 .6 .9  4 .6 .9  4 1.6 .9  1 1.6 .9\n"
)
FISHEYE = "-vta -vp {} -vd {} -vu 0 0 1 -vh 180 -vv 180"
SCENES = {  # text, rotation [deg], hour, view
    "facade": (HOUSE + FACADE, 180, "12-23 12:00", FISHEYE.format("-2.5 -2 1.2", "0 1 0")),
    "shelf": (HOUSE + SHELF, 0, "03-21 12:00", FISHEYE.format("2.5 1.5 1.2", "0 -1 -0.3")),
}
SKY = ["--sun-model", "radiance", "--sky-ground", "gendaylit"]


def picture(scene: Path, weather: Path, at: str, view: str, size: int) -> tuple[float, float]:
    """DGP and illuminance at the eye [lx] by `cfs picture`."""
    out = scene.with_suffix(".png")
    words = ["picture", scene, "--weather", weather, "--at", at, "--view", view, "--size", size]
    shown = output([*words, *SKY, "--out", out])
    ((ev, dgp),) = re.findall(r"Ev ([\d,]+) lx, DGP ([\d.]+)", shown)
    return float(dgp), float(ev.replace(",", ""))


def year(scene: Path, weather: Path, at: str, view: str, size: int) -> tuple[float, float]:
    """The same of that hour by `cfs dgp`."""
    out = scene.with_name(f"dgp_{size}")
    words = ["dgp", scene, "--weather", weather, "--view", view, "--size", size, "--worst", 0]
    output([*words, *SKY, "--out", out])
    (file,) = out.glob("*.parquet")
    table = pd.read_parquet(file)
    month, day, hour = map(int, re.split(r"[- :]", at)[:3])
    time = pd.DatetimeIndex(table.index)
    (row,) = table[(time.month == month) & (time.day == day) & (time.hour == hour)].itertuples()
    return float(row.dgp), float(row.Ev)


def output(words: Sequence[object]) -> str:
    """What a command prints; `RuntimeError` where it fails."""
    with redirect_stdout(io.StringIO()) as shown:
        if run(list(map(str, words))):
            raise RuntimeError(" ".join(map(str, words)))
    return shown.getvalue()


def main(
    *,
    sizes: Annotated[Sequence[int], "[px]"] = (150, 300, 1200),
    year_: Annotated[Sequence[int], "[px] of `cfs dgp`"] = (150, 300),
    points: Annotated[int, "eyes of rtrace at one place"] = 4,
) -> None:
    """Print a row for each scene, command and size."""
    print("| scene | | Ev [lx] | DGP |\n|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as temporary:
        weather = with_dew_point(WEATHER, Path(temporary), DEFAULT_DEW_POINT_C)
        for name, (text, turn, at, view) in SCENES.items():
            (Path(temporary) / f"{name}_inner.rad").write_text(text)
            scene = Path(temporary) / f"{name}.rad"
            scene.write_text(f"!xform -rz {turn} {name}_inner.rad\n")
            ev, error = by_rtrace(scene, weather, at, points, view)
            print(f"| {name} | `rtrace` | {ev:,.0f} ± {error:.0f} | |", flush=True)
            for command, each in ((picture, sizes), (year, year_)):
                for size in each:
                    dgp, ev = command(scene, weather, at, view, size)
                    label = "cfs picture" if command is picture else "cfs dgp"
                    print(f"| {name} | `{label}`, {size} | {ev:,.0f} | {dgp:.3f} |", flush=True)
