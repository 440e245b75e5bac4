"""The living room of a measured house by a study file: its files, and the phase (slow)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenes.heat.files import read_files
from scenes.heat.study_file import read_study
from scenes.room.operation import OperationHours
from tests.validation import twin_house


@pytest.fixture(scope="module")
def written(reference_data, tmp_path_factory) -> tuple[Path, Path]:
    """The folder of measured data and one with the study and its files."""
    source = reference_data / "twinhouse"
    if not source.is_dir():
        pytest.skip("the measured house (../shared/reference/twinhouse) is not here")
    folder = tmp_path_factory.mktemp("twin house")
    experiment = twin_house.EXPERIMENTS[2]
    twin_house.write_inputs(twin_house.measured(source, experiment), folder, experiment.study)
    return source, folder


def test_study_reads_what_was_measured(written) -> None:
    """Weather and neighbours by interval; sun of the measured vertical south within its error."""
    source, folder = written
    experiment = twin_house.EXPERIMENTS[2]
    study = read_study(folder / experiment.study.name)
    files = read_files(study)
    weather = files.weather
    assert weather.step_h == pytest.approx(1 / 6) and len(weather.times) == 40 * 144
    data = twin_house.measured(source, experiment)
    np.testing.assert_allclose(weather.dry_bulb_c, data["T"], atol=1e-4)
    hours = OperationHours(study, weather)
    cellar = hours.value(study.envelope.neighbour[0], "temperature_c", "x")
    np.testing.assert_allclose(cellar, data["cellar"], atol=1e-4)
    assert weather.midpoints[0].strftime("%m-%d %H:%M") == "04-10 00:05"


@pytest.mark.slow
@pytest.mark.xfail(strict=True, reason="1.02 K: heat to the north, and of the heater to surfaces; docs/fit.md")
def test_living_room_follows_the_measured_air(written) -> None:
    """RMS 1 K; the seven rooms coupled by the Python API reached 0.24 to 0.87 K."""
    source, folder = written
    experiment = twin_house.EXPERIMENTS[2]
    both = twin_house.compare(folder / experiment.study.name, twin_house.measured(source, experiment)).loc[
        experiment.phases["random heat"]
    ]
    gap = both["mitsuba-cfs"] - both["measured"]
    assert len(both) > 2000
    assert np.sqrt((gap**2).mean()) < 1.0


@pytest.mark.slow
def test_living_room_behind_shutters_follows_in_every_phase(written, tmp_path) -> None:
    """Experiment 1: 0.5 K of air, 6 % of the heat that holds 30 and 25 degC."""
    source, _ = written
    experiment = twin_house.EXPERIMENTS[1]
    data = twin_house.measured(source, experiment)
    study = twin_house.write_inputs(data, tmp_path, experiment.study)
    held = twin_house.heat_to_hold(study, data)
    found = twin_house.by_phase(experiment, study, data, held).set_index("phase")
    assert list(found.index) == list(experiment.phases)
    assert (found["RMSE [K]"] < 0.5).all()
    needed = found.loc[["30 degC held", "25 degC held"]]
    np.testing.assert_allclose(needed["heat to hold [W]"], needed["heater [W]"], rtol=0.06)
