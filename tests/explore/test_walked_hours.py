"""The hours of an explorer walked in Chromium: their time, and their DGP against the program's."""

from __future__ import annotations

import numpy as np
import pytest

from scenes.explore.folder import write_explorer
from tests.devtools import Page, chromium
from tests.explore.synthetic import SIZE, explored_run
from tests.validation.explorer import main, sizes, walked

pytestmark = pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")


@pytest.fixture(scope="module")
def run():
    return explored_run()


@pytest.fixture(scope="module")
def folder(run, tmp_path_factory):
    place = tmp_path_factory.mktemp("explorer")
    write_explorer(run, place)
    return place


def test_every_state_is_walked_and_agrees(run, folder, tmp_path) -> None:
    with Page(tmp_path) as page:
        found = walked(page, folder)
    years = run.spaces[0].explored.pictures
    assert len(found) == len(years) == 2
    for state, year in zip(found, years, strict=True):
        assert state.dgp == pytest.approx(year.check.compressed_dgp, abs=1e-6)
        assert np.abs(state.dgp - state.own).max() < 0.002
        assert np.all(state.milliseconds >= state.picture + state.glare)
        assert f"{len(year.check.hours)} hours" in str(state)
    assert np.ptp(found[0].dgp) > 0.02


def test_sizes_are_those_on_disk_and_the_command_prints_both(run, folder, capsys) -> None:
    total = sum(file.stat().st_size for file in (folder / "data").iterdir()) / 1e6
    assert sizes(folder) == [f"{run.spaces[0].space.label}: {SIZE} x {SIZE} pixels, 2 states, {total:.1f} MB on disk"]
    main(folder)
    lines = capsys.readouterr().out.splitlines()
    assert sum("a full hour: median" in line for line in lines) == 2
