"""`[heat_island]` of an operation file: all commands have it from one place."""

from __future__ import annotations

import numpy as np
import pytest

from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.weather import Weather, in_city
from scenes.cli import run
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.fenestration.systems import WindowOverrides
from scenes.heat.files import read_files as heat_files
from scenes.heat.study_file import StudyFile
from scenes.input_files import InputFiles
from scenes.input_options import NO_OPTIONS
from scenes.inputs import inputs_of
from scenes.room.operation import read_operation
from scenes.study.one_case import case_inputs
from scenes.study.plan import plan_of
from scenes.study.study_file import read_study

from .study_files import study_file

NIGHT = [1.0] * 6 + [0.0] * 13 + [0.5] * 5  # shares of the maximum from midnight on
ISLAND = f"[heat_island]\nsky_view = 0.5\nvegetation = 0.1\nhourly_shares = {NIGHT}\n"
STREET = "air of an urban street"


@pytest.fixture
def operation(tmp_path):
    """An operation file with a street and nothing else."""
    path = tmp_path / "street.toml"
    path.write_text(ISLAND)
    return path


@pytest.fixture(scope="module")
def street(weather) -> Weather:
    """What every command is to have."""
    return in_city(weather, 0.5, 0.1, NIGHT)


def test_rooms_of_a_run_stand_in_the_street(weather, street, blind, operation):
    box = shoebox(3.0, 4.0, windows=[WindowRectangle(0.5, 1.0, 2.0, 1.5)])
    files = InputFiles(weather, WindowOverrides((blind,)), read_operation(operation))
    found = inputs_of(box, NO_OPTIONS, files).weather
    np.testing.assert_array_equal(found.dry_bulb_c, street.dry_bulb_c)
    assert found.dry_bulb_c.mean() > weather.dry_bulb_c.mean() + 0.5
    assert sum(STREET in note for note in found.notes) == 1
    np.testing.assert_array_equal(found.direct_normal, weather.direct_normal)


def test_a_case_of_a_study_and_a_study_of_heat_have_the_same_air(street, operation, tmp_path):
    head = f'operation = "{operation.name}"\nmethods = ["three-phase"]\norientations_deg = [90]\n'
    (case,) = plan_of(read_study(study_file(tmp_path, head))).cases
    held = case_inputs(case).weather
    np.testing.assert_allclose(held.dry_bulb_c, street.dry_bulb_c)
    table = {
        "weather": WEATHER,
        "system": [{"bsdf": VENETIAN_BLIND}],
        "box": {"width": 4, "depth": 5, "height": 3, "window": []},
        "heat_island": {"sky_view": 0.5, "vegetation": 0.1, "hourly_shares": NIGHT},
    }
    heat = heat_files(StudyFile.model_validate(table)).weather
    np.testing.assert_array_equal(heat.dry_bulb_c, street.dry_bulb_c)


@pytest.mark.parametrize("command", ["run", "study"])
def test_a_street_out_of_range_is_one_line_before_the_building_is_read(command, tmp_path, capsys):
    (tmp_path / "street.toml").write_text(ISLAND.replace("0.5", "0.05", 1))
    words = ["study", study_file(tmp_path, 'operation = "street.toml"\n')]
    if command == "run":
        words = ["run", OFFICE, "--weather", WEATHER, "--cfs", VENETIAN_BLIND]
        words += ["--operation", tmp_path / "street.toml"]
    assert run([*map(str, words), "--out", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().err.strip()
    assert len(said.splitlines()) == 1 and "heat_island: sky_view: expected 0.2 to 0.9" in said


def test_a_table_without_its_hours_is_refused(tmp_path):
    path = tmp_path / "street.toml"
    path.write_text(ISLAND.split("hourly")[0])
    with pytest.raises(DataError, match="hourly_shares"):
        read_operation(path)
