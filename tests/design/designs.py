"""Small designs for the tests: a box, a glazing, a blind, and cases by a formula."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scenes.demo import VENETIAN_BLIND
from scenes.study.store import CaseResult
from scenes.toml_file import read_table
from tests.scenes.study_files import BOX, CLIMATE

GLAZING = VENETIAN_BLIND.with_name("glazing.xml")
LOADS = VENETIAN_BLIND.with_name("loads.toml")
PLAIN = f"""
[[system]]
name = "Glazing"
bsdf = "{GLAZING}"
"""
PANES = """[[system.layers]]
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
BLIND = f"""
[[system]]
name = "Blind"
cost = 300
[system.blind]
paths = 256
{PANES}"""
TILT = """
[[variable]]
key = "system.blind.tilt_deg"
values = [15, 45]
"""
RULE = """
[[variable]]
name = "rule"
[variable.choices]
"lowered" = { "operation.control.rule" = "always", "operation.control.state" = 1 }
"cut-off" = { "operation.control.rule" = "cut-off", "system.blind.tilts_deg" = [30, 75] }
"""
WIDTH = """
[[variable]]
key = "room.box.window.width"
low = 0.4
high = 2.4
step = 0.1
"""
COOLING = """
[[variable]]
name = "set point"
key = "operation.loads.cooling_c"
low = 24
high = 27
step = 0.5
"""
ENERGY = """
[[objective]]
name = "energy"
"""
SEARCH = """
[search]
evaluations = 20
repeats = 1
"""


def design_file(folder: Path, *parts: str, head: str = "", room: str = BOX) -> Path:
    """A design file of these parts."""
    path = folder / "design.toml"
    text = f'operation = "{LOADS}"\nglare = "none"\n{head}' + room + CLIMATE + "".join(parts)
    path.write_text(text, encoding="utf-8")
    return path


def by_formula(case, *, progress=None) -> CaseResult:
    """Figures that follow from the window's width and the cooling set point."""
    window = case.box.window[0]
    if window.width > 2.05:
        raise ValueError("wider than the wall of the formula")
    cooling = read_table(case.inputs.operation)["loads"]["cooling_c"]
    noise = 1e-3 * np.sin(case.options.sampling.seed)
    energy = 100 + 40 * (window.width - 1.2) ** 2 + 5 * (cooling - 25.5) ** 2 + noise
    figures = {"heating_kwh": energy, "cooling_kwh": 0.0, "lighting_kwh": 0.0, "warm_h": 50 * (cooling - 24)}
    return CaseResult(case.key, figures | {"seconds": 0.0})
