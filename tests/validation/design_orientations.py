"""The best of four systems with its rule for each of eight facades: the dissertation's 5.1 and 5.2 reversed.

    python -m tests.validation design_orientations --out FOLDER

Its 5.1 compares four systems in one room of 4 x 5 x 3 m with half of the facade glazed, by daylight
and glare; its 5.2 compares eight orientations of that room with one system, by comfort.  Here
`cfs design` seeks the system with its rule for each orientation.  The weather is the demo's, of Chicago.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated

import pandas as pd

from scenes.cli import run
from scenes.demo import VENETIAN_BLIND, WEATHER

PANES = """
[[system.layers]]
thickness = 0.004
visible = [0.90, 0.08, 0.08]
solar = [0.84, 0.075, 0.075]
gap = { width = 0.016, gas = { argon = 0.9, air = 0.1 } }
[[system.layers]]
thickness = 0.004
visible = [0.88, 0.05, 0.055]
solar = [0.62, 0.27, 0.20]
emissivity = [0.03, 0.84]
"""
DESIGN = (
    """\
title = "Which system and rule for each of eight facades"
methods = ["three-phase"]
glare = "DGP"
operation = "loads.toml"
orientations_deg = [0, 45, 90, 135, 180, 225, 270, 315]

[[room]]
name = "Office"
[room.box]
width = 4
depth = 5
height = 3
[[room.box.window]]
x = 0.2
sill = 0.9
width = 3.6
height = 1.667

[[climate]]
weather = "city.epw"

[options]
sensor_spacing = 1.0
sensor_samples = 2048
patch_samples = 1024
sky_subdivision = 2
picture_size = 64
picture_samples = 4
heat_step_s = 3600

[[system]]
name = "Double glazing"
bsdf = "double.xml"

[[system]]
name = "Solar control glazing"
bsdf = "control.xml"

[[system]]
name = "Screen"
operation = "screen_states.toml"

[[system]]
name = "Blind"
[system.blind]
slat_radius = 0.104
"""
    + PANES
    + """
[[variable]]
name = "system and rule"
[variable.choices."Double glazing"]
system = "Double glazing"
[variable.choices."Solar control glazing"]
system = "Solar control glazing"
[variable.choices."Screen raised without glare"]
system = "Screen"
"operation.control.rule" = "glare"
[variable.choices."Blind at 20° raised without glare"]
system = "Blind"
"system.blind.tilt_deg" = 20
"operation.control.rule" = "glare"
[variable.choices."Blind at 45° raised without glare"]
system = "Blind"
"system.blind.tilt_deg" = 45
"operation.control.rule" = "glare"
[variable.choices."Blind by cut-off"]
system = "Blind"
"system.blind.tilt_deg" = 20
"system.blind.tilts_deg" = [45, 70]
"operation.control.rule" = "cut-off"

[[objective]]
name = "energy"

[[objective]]
name = "daylight autonomy"

[[constraint]]
rule = "en17037 glare"
level = "medium"

[search]
each = "orientation"
method = "all"
quick = false
front = 6
repeats = 1
"""
)
SCREEN = """
[[system]]
bsdf = "double.xml"

[[system]]
bsdf = "screen.xml"
"""


def write_inputs(folder: Path) -> Path:
    """The design file with what it names."""
    folder.mkdir(parents=True, exist_ok=True)
    library = ["bsdf", "library", "--glazing"]
    for name, chosen in (
        ("double", ["double low-e"]),
        ("control", ["double solar control"]),
        ("screen", ["double low-e", "--shade", "screen 5 %, grey"]),
    ):
        if run([*library, *chosen, "--out", str(folder / f"{name}.xml")]) != 0:
            raise RuntimeError("cfs bsdf library failed")
    loads = VENETIAN_BLIND.with_name("loads.toml").read_text(encoding="utf-8")
    (folder / "loads.toml").write_text(loads, encoding="utf-8")
    (folder / "screen_states.toml").write_text(loads + SCREEN, encoding="utf-8")
    shutil.copy(WEATHER, folder / "city.epw")
    (folder / "design.toml").write_text(DESIGN, encoding="utf-8")
    return folder / "design.toml"


def main(*, out: Annotated[Path, "folder for the inputs and the results"], processes: int = 2) -> pd.DataFrame:
    """The candidates that were computed in full, by orientation, the best first."""
    design = write_inputs(out / "inputs")
    results = out / "results"
    if run(["design", str(design), "--out", str(results), "--processes", str(processes)]) != 0:
        raise RuntimeError("cfs design failed")
    table = pd.read_csv(results / "results.csv")
    return table[table["stage"] == "full"].drop(columns=["stage", "error", "cases"])
