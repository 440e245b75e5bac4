"""The hours of an explorer walked in Chromium: their time, and their DGP against the program's."""

from __future__ import annotations

import numpy as np
import pytest

from scenes.evidence.devtools import chromium
from scenes.evidence.explored_hours import walked
from scenes.explore.folder import write_explorer
from tests.explore.synthetic import explored_run

pytestmark = pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")


def test_every_state_is_walked_and_agrees(tmp_path) -> None:
    run = explored_run()
    write_explorer(run, tmp_path)
    found = walked(tmp_path)
    years = run.spaces[0].explored.pictures
    assert len(found) == len(years) == 2
    for state, year in zip(found, years, strict=True):
        assert state.dgp == pytest.approx(year.check.kept, abs=1e-6)
        assert np.abs(state.dgp - state.own).max() < 0.002 and np.all(state.milliseconds > 0)
        assert f"{len(year.check.hours)} hours" in str(state)
    assert np.ptp(found[0].dgp) > 0.02
