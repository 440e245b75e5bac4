"""A run of a room with a hole says so in its console, its table of problems and its report."""

from __future__ import annotations

import pytest

from mitsuba_cfs.surfaces import Surfaces
from scenes.cli import run as main
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.job import daylight

pytestmark = pytest.mark.usefixtures("variant")


def test_a_run_says_that_a_room_is_open(tmp_path, monkeypatch, capsys):
    """The biggest triangle of the room is left out of what is traced."""
    whole = daylight.interior_surfaces

    def holed(space, band="visible"):
        found = whole(space, band)
        keep = found.areas < found.areas.max() - 1e-9
        parts = (part[keep] for part in (found.triangles, found.reflectance, found.surface))
        return Surfaces(*parts, found.names)

    monkeypatch.setattr(daylight, "interior_surfaces", holed)
    monkeypatch.setenv("CFS_CACHE", str(tmp_path / "cache"))
    out = tmp_path / "out"
    files = [str(OFFICE), "--weather", str(WEATHER), "--cfs", str(VENETIAN_BLIND)]
    assert main(["run", *files, "--space", "A", "--quick", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "room A is open: up to" in said
    for file in ("problems.csv", "report.html"):
        text = (out / file).read_text()
        assert "room A is open: up to" in text and "this light is lost" in text
