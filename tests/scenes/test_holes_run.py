"""A run of a room with a hole says so in its console, its table of problems and its report."""

from __future__ import annotations

import pytest

from mitsuba_cfs.surfaces import Surfaces
from scenes.cli import run as main
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.room import leaks, light

pytestmark = pytest.mark.usefixtures("variant")
FEW_RAYS = ["--quick", "--size", "64", "--method", "three-phase"]


@pytest.fixture
def holed(monkeypatch) -> list[str]:
    """The biggest triangle of every room is left out of what is traced; the demo's files."""
    whole = light.furnished_surfaces

    def without(space, band="visible"):
        found = whole(space, band)
        keep = found.areas < found.areas.max() - 1e-9
        parts = (part[keep] for part in (found.triangles, found.reflectance, found.surface))
        return Surfaces(*parts, found.names)

    for module in (light, leaks):
        monkeypatch.setattr(module, "furnished_surfaces", without)
    return [str(OFFICE), "--weather", str(WEATHER), "--cfs", str(VENETIAN_BLIND), "--space", "A"]


def test_a_run_says_that_a_room_is_open(tmp_path, holed, capsys):
    out = tmp_path / "out"
    assert main(["run", *holed, *FEW_RAYS, "--spacing", "2", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "is open: up to" in said
    for file in ("problems.csv", "report.html"):
        text = (out / file).read_text()
        assert "is open: up to" in text and "this light is lost" in text


@pytest.mark.parametrize(
    "command", [["picture", "--at", "06-21 12:00", "--size", "32"], ["dgp", *FEW_RAYS]], ids=lambda words: words[0]
)
def test_other_commands_that_trace_say_so_too(tmp_path, holed, capsys, command):
    out = tmp_path / ("out.png" if command[0] == "picture" else "out")
    assert main([command[0], *holed, *command[1:], "--out", str(out)]) == 0
    assert "Room A South office is open: up to" in capsys.readouterr().out
