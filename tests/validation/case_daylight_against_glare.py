"""Chapter 5.1: daylight autonomy against glare of four systems in Malaga.

    python -m tests.validation case_daylight_against_glare --weather MALAGA.epw --out DIR

The room of Figure 67 (4 m x 5 m x 3 m, half of its south facade glazed), the user in its middle,
every hour from 8 to 18: double glazing by itself, with exterior blinds at 45 and 20 degrees, with
an exterior shade.  A study of `cfs study` is written, run (five-phase, DGP of every hour) and
drawn as in Figure 68.  Writes the systems, `study.toml`, the study's results, and
`daylight_against_glare.csv` and `.png`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import pandas as pd

from mitsuba_cfs import variants
from mitsuba_cfs.glare.classes import CLASSES
from scenes.commands.progress_bar import ProgressBar
from scenes.study.store import Store
from scenes.study.study import run_study
from scenes.study.study_file import read_study
from tests.validation.systems import blind_before_glazing, glazing, shade_before_glazing

COLOURS = ("#d9ead3", "#ffe599", "#f6b26b", "#cc4125")  # imperceptible to intolerable
STUDY = """title = "Daylight autonomy against glare, chapter 5.1"
methods = ["five-phase"]
glare = "DGP"

[[room]]
name = "room"
[room.box]
width = 4.0
depth = 5.0
height = 3.0
facing_deg = {facing}
window = [{{ x = 0.0, sill = 0.9, width = 4.0, height = 1.5 }}]

[[climate]]
weather = "{weather}"

[options]
occupied = [8, 18]
picture_size = {size}
"""
SYSTEM = """
[[system]]
name = "{name}"
bsdf = "{file}"
"""


def write_study(weather: Path, out: Path, *, facing: float, size: int) -> Path:
    """The four systems and the study file."""
    systems = {
        "double glazing": glazing(out),
        "blinds at 45 degrees": blind_before_glazing(out, 45.0),
        "exterior shade": shade_before_glazing(out),
        "blinds at 20 degrees": blind_before_glazing(out, 20.0),
    }
    text = STUDY.format(weather=weather.resolve().as_posix(), facing=facing, size=size)
    text += "".join(SYSTEM.format(name=n, file=path.name) for n, path in systems.items())
    path = out / "study.toml"
    path.write_text(text, encoding="utf-8")
    return path


def table_of(rows: list[dict]) -> pd.DataFrame:
    """Daylight autonomy and the shares of the glare classes of each system [%]."""
    result = []
    for row in rows:
        hours = {name: row[f"glare_{name}_h"] for name in CLASSES}
        total = sum(hours.values())
        result.append(
            {"system": row["system"], "daylight autonomy": row["da300"]}
            | {name: 100 * value / total for name, value in hours.items()}
            | {"DGP of the worst hour": row["dgp_max"]}
        )
    return pd.DataFrame(result)


def draw(table: pd.DataFrame, path: Path) -> None:
    """Bars: daylight autonomy, and the glare classes on top of each other."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import numpy as np

    figure, axes = plt.subplots(figsize=(8.0, 4.2), layout="constrained")
    at = np.arange(len(table))
    bars = axes.bar(at - 0.2, table["daylight autonomy"], 0.36, color="#4878a8", label="daylight autonomy, 300 lx")
    axes.bar_label(bars, fmt="%.0f", padding=2)
    below = np.zeros(len(table))
    for name, colour in zip(CLASSES, COLOURS, strict=True):
        axes.bar(at + 0.2, table[name], 0.36, bottom=below, color=colour, label=f"{name} glare")
        below += table[name].to_numpy()
    axes.set_xticks(at, table["system"])
    axes.set_ylabel("hours from 8 to 18 h [%]")
    axes.set_ylim(0, 108)
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(frameon=False, ncols=3, loc="outside lower center")
    figure.savefig(path, dpi=120)
    plt.close(figure)


def main(
    *, weather: Path, out: Path, facing: float = 180.0, size: Annotated[int, "pixels of a picture's side"] = 400
) -> pd.DataFrame:
    """Run the study and write table and figure."""
    out.mkdir(parents=True, exist_ok=True)
    variants.activate()
    study = read_study(write_study(weather, out, facing=facing, size=size))
    with ProgressBar() as progress:
        result = run_study(study, Store(out / "results"), progress=progress)
    table = table_of(result.rows())
    table.round(3).to_csv(out / "daylight_against_glare.csv", index=False)
    draw(table, out / "daylight_against_glare.png")
    return table.round(2)
