"""The same command twice, each time a process of its own, traces nothing the second time."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.demo.make_facade import facade
from tests.scenes.study_files import study_file
from tests.thermal.test_study import TRACE
from tests.thermal.test_study import study_file as thermal_file

pytestmark = pytest.mark.early

REPOSITORY = Path(__file__).parents[2]
PV = """
[module]
select = 'IfcElement, material="PV laminate", Name="PV 09 row 1 column 1"'
short_circuit_current = 8.6
open_circuit_voltage = 37.4
current = 8.05
voltage = 29.8
cells = 60
"""


def run_arguments(folder: Path) -> list[str]:
    files = [str(OFFICE), "--weather", str(WEATHER), "--cfs", str(VENETIAN_BLIND)]
    return ["run", *files, "--space", "A", "--quick", "--size", "64", "--spacing", "2"]


def thermal_arguments(folder: Path) -> list[str]:
    return ["thermal", str(thermal_file(folder, TRACE))]


def pv_arguments(folder: Path) -> list[str]:
    model, study = folder / "facade.ifc", folder / "pv.toml"
    facade().write(str(model))
    study.write_text(PV)
    return ["pv", str(model), "--weather", str(WEATHER), "--study", str(study)]


def study_arguments(folder: Path) -> list[str]:
    return ["study", str(study_file(folder))]


OF_A_RUN = {
    "absorption-matrix",
    "cell-daylight",
    "daylight-matrix",
    "direct-sun",
    "escape",
    "sky-irradiance",
    "straight-view",
    "view-matrix",
    "view-pictures",
    "view-sunlit",
    "window-exchange",
}
COMMANDS = {
    "run": (run_arguments, OF_A_RUN),
    "thermal": (thermal_arguments, {"absorption-matrix", "daylight-matrix", "sky-irradiance"}),
    "pv": (pv_arguments, {"sky-irradiance"}),
    "study": (study_arguments, {"view-matrix", "daylight-matrix", "escape"}),
}


# quick: a run keeps what the others do, and they find by the same cache
@pytest.mark.parametrize("name", [pytest.param(n, marks=() if n == "run" else pytest.mark.slow) for n in COMMANDS])
def test_the_second_time_everything_is_found(tmp_path, name):
    """In another folder of results, with other hash seeds; a kept file that is written anew would
    be another file (inode), for it is replaced as a whole."""
    arguments, expected = COMMANDS[name]
    command, cache = arguments(tmp_path), tmp_path / "cache"
    kept = []
    for seed in ("1", "2"):
        environment = os.environ | {"CFS_CACHE": str(cache), "PYTHONHASHSEED": seed}
        done = subprocess.run(
            [sys.executable, "-m", "scenes.cli", *command, "--out", str(tmp_path / f"out{seed}")],
            cwd=REPOSITORY,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        kept.append({path.name: path.stat().st_ino for path in cache.glob("*.npz")})
    labels = {file.rpartition("-")[0] for file in kept[0]}
    assert expected <= labels, labels
    assert kept[0] == kept[1]
