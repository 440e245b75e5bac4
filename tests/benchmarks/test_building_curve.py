"""The curve of a building: errors, ratios at equal error, results folders, what `rcontrib` took, the figure."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.benchmarks import building_curve as curve


def table() -> pd.DataFrame:
    rows = [
        ("cfs run", "coarse", 10.0, 1.0, 8.0),
        ("cfs run", "fine", 40.0, 4.0, 2.0),
        ("recipe", "coarse", 20.0, 2.0, 9.0),
        ("recipe", "middle", 60.0, 30.0, 4.0),
        ("recipe", "fine", 90.0, 70.0, 1.0),
    ]
    return pd.DataFrame(rows, columns=["program", "settings", "processor s", "tracing s", "error %"])


def test_errors_of_hours_and_of_yearly_means():
    reference = np.full((2, 4), 100.0)
    light = reference + np.array([[10, -10, 10, -10], [20, 20, 20, 20]])
    assert curve.relative_error(light, reference) == pytest.approx(np.sqrt((10**2 + 20**2) / 2) / 100)
    assert curve.yearly_error(light, reference) == pytest.approx(0.2 / np.sqrt(2))


def test_ratio_is_to_the_cheapest_run_whose_error_is_no_larger():
    ratios = curve.ratios(table()).set_index("settings")
    assert ratios.loc["coarse", ["processor s", "tracing s"]].tolist() == [2, 2]
    assert ratios.loc["middle", ["processor s", "tracing s"]].tolist() == [1.5, 7.5]
    assert ratios.loc["middle", "cfs run by tracing s"] == "fine"
    assert ratios.loc["fine", ["processor s", "tracing s"]].isna().all()


@pytest.mark.parametrize("half", [0, 0.5])  # cfs states the beginning of the hour, the recipes its middle
def test_hours_of_a_results_folder_of_ladybug_tools(tmp_path, half):
    folder = tmp_path / "states" / "total"
    folder.mkdir(parents=True)
    np.save(folder / "hall.npy", np.array([[1.0, 2.0], [3.0, 4.0]]))
    (tmp_path / "grids_info.json").write_text(json.dumps([{"full_id": "hall", "count": 2}]))
    (tmp_path / "sun-up-hours.txt").write_text(f"{9 + half}\n{8759 + half}\n")
    light = curve._ladybug(tmp_path)["hall"]
    assert light[:, [9, 8759]].tolist() == [[1, 2], [3, 4]]
    assert light.sum() == 10


def test_seconds_of_rcontrib_are_written_and_its_streams_pass(tmp_path, monkeypatch):
    real = tmp_path / "real"
    (real / "bin").mkdir(parents=True)
    (real / "lib").mkdir()
    program = real / "bin" / "rcontrib"
    program.write_text(
        "#!/bin/bash\necho error >&2\nread line; echo $1 $line\nfor ((i = 0; i < 200000; i++)); do :; done\n"
    )
    program.chmod(0o755)
    monkeypatch.setattr(curve.radiance, "environment", lambda: {"PATH": str(real / "bin")})
    environment, times = curve._radiance(tmp_path / "run")
    done = subprocess.run(["rcontrib", "a b"], env=environment, input="c\n", capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("a b c\n", "error\n")
    assert 0.05 < curve._traced(times) < 60


def test_a_run_that_was_kept_is_not_repeated(tmp_path):
    rooms = tmp_path / "rooms" / "hall"
    rooms.mkdir(parents=True)
    (rooms / "sensors.pts").write_text("0 0 0 0 0 1\n")
    building = curve.Building(tmp_path / "m", rooms.parent, tmp_path / "w", tmp_path / "r", tmp_path)
    calls = []

    def work(place: Path):
        calls.append(place)
        return {"hall": np.full((1, 8760), 5.0)}, 3.0

    first, light = curve.measured(building, "recipe", "-ab 2 / 3", work)
    again, kept = curve.measured(building, "recipe", "-ab 2 / 3", work)
    assert len(calls) == 1 and first == again and first.tracing == 3
    np.testing.assert_array_equal(light, kept)


def test_figure_is_written(tmp_path):
    curve.draw(table(), tmp_path / "of" / "curve.png")
    assert (tmp_path / "of" / "curve.png").stat().st_size > 10_000
