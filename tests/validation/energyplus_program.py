"""EnergyPlus as the judge: the models of `models/*.epJSON`, and its own run of them.

`room.epJSON` is Table 15's room with its glazing, facing south; each other file holds what differs
from it, as a JSON merge patch (RFC 7396: `null` removes).
`reference_room` has the same parameters.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from tests.validation.reference_room import ORIENTATIONS

Model = dict[str, dict[str, dict[str, Any]]]
MODELS = Path(__file__).parent / "models"
TIME_FILE = "seconds.txt"  # elapsed and processor seconds of EnergyPlus, beside its results
OUTPUTS = {
    "ROOM:Zone Mean Air Temperature": "T_air",
    "ROOM:Zone Mean Radiant Temperature": "T_mrt",
    "ROOM:Zone Operative Temperature": "T_op",
    "FACADE:Surface Inside Face Temperature": "T_facade",
    "X0:Surface Inside Face Temperature": "T_wall_x0",
    "X4:Surface Inside Face Temperature": "T_wall_x4",
    "BACK:Surface Inside Face Temperature": "T_back",
    "FLOOR:Surface Inside Face Temperature": "T_floor",
    "CEILING:Surface Inside Face Temperature": "T_ceiling",
    "WINDOW:Surface Inside Face Temperature": "T_win_in",
    "WINDOW:Surface Outside Face Temperature": "T_win_out",
    "WINDOW:Surface Outside Face Incident Solar Radiation Rate per Area": "I_inc",
    "WINDOW:Surface Window Transmitted Solar Radiation Rate": "Q_trans",
}


def room_model(orientation: str, *changes: str, outputs: dict[str, str] | None = None, steps: int = 6) -> Model:
    """The room that faces `orientation`, with the changes that files of `models` name, in order.

    Args: changes: names of patches; "dgu" is the room's own glazing.
        outputs: columns by EnergyPlus' names ("KEY:Variable") of hourly outputs; OUTPUTS without.
    """
    model = _read("room")
    for name in changes:
        if name != "dgu":
            model = merged(model, _read(name))
    model["Building"]["main"]["north_axis"] = ORIENTATIONS[orientation] - 180.0
    model["Timestep"]["main"]["number_of_timesteps_per_hour"] = steps
    names = sorted({key.split(":", 1)[1] for key in (OUTPUTS if outputs is None else outputs)})
    hourly = {"key_value": "*", "reporting_frequency": "Hourly"}
    model["Output:Variable"] = {f"out {i}": hourly | {"variable_name": name} for i, name in enumerate(names)}
    return model


def _read(name: str) -> Model:
    return json.loads((MODELS / f"{name}.epJSON").read_text("utf-8"))


def merged(value: Any, patch: Any) -> Any:
    """The value with a JSON merge patch (RFC 7396)."""
    if not isinstance(patch, dict):
        return patch
    result = dict(value) if isinstance(value, dict) else {}
    for key, change in patch.items():
        if change is None:
            result.pop(key, None)
        else:
            result[key] = merged(result.get(key), change)
    return result


def run_energyplus(
    model: Model, epw: Path, folder: Path | None = None, *, outputs: dict[str, str] | None = None
) -> pd.DataFrame:
    """Hourly results [H rows] of EnergyPlus' own run, columns as `outputs` names them."""
    outputs = OUTPUTS if outputs is None else outputs
    with tempfile.TemporaryDirectory() as temporary:
        folder = folder or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        written = folder / "in.epJSON"
        written.write_text(json.dumps(model))
        table = run_written(written, epw)
    missing = sorted(set(outputs) - set(table))
    if missing:
        raise RuntimeError(f"EnergyPlus wrote no {', '.join(missing)}")
    return table[list(outputs)].rename(columns=outputs).astype(float)


HEADER_LINES = 8  # of an EPW file
AT_ENDS = [6, 7, 8, 9, 12, 21]  # its columns with values at the ends of hours, wind's direction not


def with_held_sun(epw: Path, written: Path, steps: int = 6) -> Path:
    """Write the weather in rows of a step, each hour's sun in all its steps; return where.

    From hourly rows EnergyPlus makes the sun of each step from those of two hours, so that a bright
    hour beside a dull one loses a twentieth; from rows of its own steps it takes what they say.
    """
    lines = epw.read_text(encoding="latin-1").splitlines()
    head = lines[:HEADER_LINES]
    periods = head[-1].split(",")
    head[-1] = ",".join([*periods[:2], str(steps), *periods[3:]])
    rows = [line.split(",") for line in lines[HEADER_LINES:] if line.strip()]
    ends = np.array([[float(row[i]) for i in AT_ENDS] for row in rows])
    before = np.roll(ends, 1, axis=0)
    text = head
    for row, first, last in zip(rows, before, ends, strict=True):
        for k in range(1, steps + 1):
            cells = row.copy()
            cells[4] = str(60 * k // steps)
            for i, value in zip(AT_ENDS, first + (last - first) * k / steps, strict=True):
                cells[i] = f"{value:.4f}"
            text.append(",".join(cells))
    written.write_text("\n".join(text) + "\n", encoding="latin-1")
    return written


def run_written(model: Path, epw: Path) -> pd.DataFrame:
    """All hourly outputs [H rows] of a model file, run in its folder in a process of its own."""
    code = (
        "import pathlib, sys, time\nfrom pyenergyplus.api import EnergyPlusAPI\n"
        "api = EnergyPlusAPI()\nstate = api.state_manager.new_state()\n"
        "api.runtime.set_console_output_status(state, False)\n"
        "start, wall = time.process_time(), time.perf_counter()\n"
        "code = api.runtime.run_energyplus(state, sys.argv[1:])\n"
        "took = f'{time.perf_counter() - wall} {time.process_time() - start}'\n"
        f"pathlib.Path(sys.argv[4], {TIME_FILE!r}).write_text(took)\nsys.exit(code)\n"
    )
    folder = model.parent
    command = [sys.executable, "-c", code, "-w", str(epw), "-d", str(folder), str(model)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        report = folder / "eplusout.err"
        text = report.read_text() if report.exists() else done.stderr
        raise RuntimeError(f"EnergyPlus stopped: {text[-1500:]}")
    table = pd.read_csv(folder / "eplusout.csv")
    return table.rename(columns=lambda name: name.split(" [")[0].strip())
