"""The living room of a measured house by a study file: its files, and the phase (slow)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenes.evidence.validation import twin_house
from scenes.heat.files import read_files
from scenes.heat.study_file import read_study
from scenes.room.operation_hours import OperationHours


@pytest.fixture(scope="module")
def written(reference_data, tmp_path_factory) -> tuple[Path, Path]:
    """The folder of measured data and one with the study and its files."""
    source = reference_data / "twinhouse"
    if not source.is_dir():
        pytest.skip("the measured house (../shared/reference/twinhouse) is not here")
    folder = tmp_path_factory.mktemp("twin house")
    twin_house.write_inputs(twin_house.measured(source), folder)
    return source, folder


def test_study_reads_what_was_measured(written) -> None:
    """Weather and neighbours by interval; sun of the measured vertical south within its error."""
    source, folder = written
    study = read_study(folder / twin_house.STUDY.name)
    files = read_files(study)
    weather = files.weather
    assert weather.step_h == pytest.approx(1 / 6) and len(weather.times) == 23 * 144
    data = twin_house.measured(source)
    np.testing.assert_allclose(weather.dry_bulb_c, data["T"], atol=1e-4)
    hours = OperationHours(study, weather)
    cellar = hours.value(study.envelope.neighbour[0], "temperature_c", "x")
    np.testing.assert_allclose(cellar, data["cellar"], atol=1e-4)
    assert weather.midpoints[0].strftime("%m-%d %H:%M") == "04-21 00:05"


@pytest.mark.slow
@pytest.mark.xfail(
    strict=True,
    reason="1.3 K: shut doors and walls of the L are not in the box; docs/validation.md",
)
def test_living_room_follows_the_measured_air(written) -> None:
    """RMS 1 K; the seven rooms coupled by the Python API reached 0.24 to 0.87 K."""
    source, folder = written
    both = twin_house.compare(folder, twin_house.measured(source))
    gap = both["ours"] - both["measured"]
    assert len(both) > 2000
    assert np.sqrt((gap**2).mean()) < 1.0
