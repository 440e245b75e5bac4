"""The reference room by `cfs study` in climates of one's own, against EnergyPlus run here.

    python -m tests.validation energyplus_by_study FOLDER --reference DIR \
        --climates ESP_Malaga.084820_SWEC.epw [...]

Writes into FOLDER the BSDF files of three systems, an operation file of each that lets the room
float and one that keeps 20 to 26 degC, and `study.toml`; runs it as `cfs study` does, light too,
sun and sky traced.  EnergyPlus 25.2 computes the same room with its own layers and sun.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.xml import write_bsdf_xml
from scenes.study.study import run_study
from scenes.study.study_file import read_study
from tests.validation.differences import rmse_and_bias
from tests.validation.energyplus_program import room_model, run_energyplus
from tests.validation.energyplus_reference import loads
from tests.validation.energyplus_study import FIRST_HOUR, STUDY
from tests.validation.energyplus_traced import traced_system
from tests.validation.reference_systems import read_optics

PANES = """[[system.layers]]
thickness = 0.006
conductivity = 0.9
solar = [0.775, 0.071, 0.071]
gap = { width = 0.016, gas = { argon = 0.9, air = 0.1 } }
[[system.layers]]
thickness = 0.006
conductivity = 0.9
emissivity = [0.05, 0.84]
solar = [0.60, 0.22, 0.17]
"""
BLIND = """[[system.layers]]
slats = { width = 0.08, spacing = 0.072, tilt_deg = 45.0, thickness = 0.00045 }
edges = [0.1, 0.1, 0.1, 0.1]
gap = { width = 0.1 }
"""
SHADE = """gap = { width = 0.05 }
[[system.layers]]
openness = 0.0
thickness = 0.0005
conductivity = 0.15
edges = [0.05, 0.05, 0.05, 0.05]
"""
LAYERS = {"dgu": PANES, "ext_blind": BLIND + PANES, "int_shade": PANES + SHADE}
KEPT = "[loads]\nheating_c = 20\ncooling_c = 26\n"
HEAT = ("heating_kwh", "cooling_kwh")


def write_files(
    folder: Path, reference: Path, climates: Sequence[Path], orientations: Sequence[float]
) -> Path:
    """The study with all that it names."""
    folder.mkdir(parents=True, exist_ok=True)
    room = STUDY.read_text(encoding="utf-8")
    box = room[room.index("[box]") : room.index("[[system]]")].replace("[box", "[room.box")
    use = room[room.index("[envelope]") : room.index("[trace]")]
    head = [
        f"orientations_deg = {list(orientations)}", 'methods = ["three-phase"]', 'glare = "none"',
        "[options]", "sensor_spacing = 1.5", "[[room]]", 'name = "room"', box,
    ]  # fmt: skip
    for name, layers in LAYERS.items():
        system = traced_system(name, read_optics(reference, name))
        bands = {"Visible": system.visible, "Solar": system.solar}
        write_bsdf_xml(BsdfFile(bands, name=name), folder / f"{name}.xml")
        state = f'[[system]]\nbsdf = "{name}.xml"\nglazing_height = 1.5\n{layers}\n{use}'
        for held, more in (("floating", ""), ("kept", KEPT)):
            (folder / f"{name}_{held}.toml").write_text(state + more, encoding="utf-8")
            head += ["[[system]]", f'name = "{name} {held}"', f'operation = "{name}_{held}.toml"']
    for epw in climates:
        head += ["[[climate]]", f'name = "{epw.stem}"', f'weather = "{epw.resolve().as_posix()}"']
    study = folder / "study.toml"
    study.write_text("\n".join(head) + "\n", encoding="utf-8")
    return study


def ours(study: Path) -> dict[tuple[str, float, str], tuple[dict, np.ndarray]]:
    """Figures and air [degC] of every case, by climate, orientation and name of the system."""
    result = run_study(read_study(study), study.parent / "results")
    if result.failed:
        raise RuntimeError(result.first_error)
    return {
        (case.climate, case.orientation_deg, case.system):
        (found.figures, found.arrays["temperature/air_c"])
        for case, found in zip(result.plan.cases, result.results, strict=True)
    }  # fmt: skip


def compared(
    folder: Path, reference: Path, climates: Sequence[Path], orientations: Sequence[str]
) -> pd.DataFrame:
    """A row for each climate, orientation and system."""
    turns = {"S": 0.0, "W": 90.0, "N": 180.0, "E": 270.0}
    found = ours(write_files(folder, reference, climates, [turns[one] for one in orientations]))
    rows = []
    for epw in climates:
        for orientation in orientations:
            for name in LAYERS:
                key = epw.stem, turns[orientation]
                _, air = found[(*key, f"{name} floating")]
                kept, _ = found[(*key, f"{name} kept")]
                theirs = run_energyplus(room_model(orientation, name), epw)["T_air"].to_numpy()
                needs = list(loads(name, orientation, epw).values())
                rmse, bias = rmse_and_bias(air[FIRST_HOUR:], theirs[FIRST_HOUR:])
                row = {"climate": epw.stem, "facing": orientation, "system": name,
                       "air RMSE": rmse, "bias": bias}  # fmt: skip
                for what, other in zip(HEAT, needs, strict=True):
                    row |= {what: kept[what], f"{what} E+": other}
                rows.append(row)
    return pd.DataFrame(rows)


def main(
    folder: Path,
    *,
    reference: Path,
    climates: Sequence[Path],
    orientations: Annotated[Sequence[str], ("S", "W", "N", "E")] = ("S", "W"),
) -> pd.DataFrame:
    """A row for each climate, orientation and system."""
    variants.activate()
    return compared(folder, reference, climates, orientations)
