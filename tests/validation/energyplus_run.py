"""EnergyPlus' own run of a model (epJSON) by pyenergyplus, in a process of its own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pandas as pd

TIME_FILE = "seconds.txt"  # elapsed and processor seconds of EnergyPlus, beside its results


def run_written(model: Path, epw: Path) -> pd.DataFrame:
    """All hourly outputs [H rows] of a model that is there as a file, by EnergyPlus' names."""
    table = pd.read_csv(run_model(model, epw))
    return table.rename(columns=lambda name: name.split(" [")[0].strip())


def run_model(model: Path, epw: Path) -> Path:
    """EnergyPlus' own run in the folder of the model; the file of its hourly results."""
    place = model.parent
    code = (
        "import pathlib, sys, time\nfrom pyenergyplus.api import EnergyPlusAPI\n"
        "api = EnergyPlusAPI()\nstate = api.state_manager.new_state()\n"
        "api.runtime.set_console_output_status(state, False)\n"
        "start, wall = time.process_time(), time.perf_counter()\n"
        "code = api.runtime.run_energyplus(state, sys.argv[1:])\n"
        "took = f'{time.perf_counter() - wall} {time.process_time() - start}'\n"
        f"pathlib.Path(sys.argv[4], {TIME_FILE!r}).write_text(took)\nsys.exit(code)\n"
    )
    arguments = ["-w", str(epw), "-d", str(place), str(model)]
    command = [sys.executable, "-c", code, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    report = place / "eplusout.err"
    if done.returncode != 0:
        text = report.read_text() if report.exists() else done.stderr
        raise RuntimeError(f"EnergyPlus stopped: {text[-1500:]}")
    return place / "eplusout.csv"
