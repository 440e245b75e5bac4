"""`--surroundings`: read by every command of a room, named in a run's manifest."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from mitsuba_cfs.progress import silent
from scenes import cli
from scenes.demo import WEATHER
from scenes.run.files import read_files
from scenes.run.job import read_inputs
from scenes.run.options import JobOptions
from scenes.run.run import _manifest
from scenes.year_of_glare.options import YearOptions
from scenes.year_of_glare.year import read_year
from tests.conftest import REPOSITORY

TUTORIALS = REPOSITORY / "docs" / "tutorials"
QUARTER = TUTORIALS / "quarter.city.json"


@pytest.fixture
def options():
    return JobOptions(
        TUTORIALS / "two_rooms.hbjson", WEATHER, spaces=("Office",), surroundings=(QUARTER,),
        surroundings_offset=(-456000.0, -5430000.0, -110.0),
    )  # fmt: skip


def test_the_quarter_stands_around_the_room(options):
    inputs = read_inputs(options, silent, read_files(options))
    names = {element.name for element in inputs.building.elements}
    assert {"north block", "street block", "tower", "Overhang"} <= names


def test_the_manifest_names_the_files(options):
    inputs = read_inputs(options, silent, read_files(options))
    manifest = json.loads(json.dumps(_manifest(options, "llvm", inputs, [], [])))
    assert manifest["inputs"]["surroundings_0"]["path"] == str(QUARTER)
    assert manifest["options"]["surroundings"] == [str(QUARTER)]


@pytest.mark.parametrize("command", ["run", "comply", "dgp", "picture"])
def test_every_command_of_a_room_reads_them(command, tmp_path, capfd):
    """A file that cannot be used is named, so it was read."""
    broken = tmp_path / "broken.city.json"
    broken.write_text("{")
    words = [
        command, TUTORIALS / "two_rooms.hbjson", "--weather", WEATHER, "--surroundings", broken,
        "--out", tmp_path / ("out.png" if command == "picture" else "out"),
    ]  # fmt: skip
    more = {
        "comply": ["--standard", "en17037"],
        "picture": ["--at", "06-21 12:00", "--size", "16", "--samples", "1"],
    }
    assert cli.run([str(word) for word in [*words, *more.get(command, [])]]) == 1
    said = capfd.readouterr().err.strip().splitlines()
    assert "broken.city.json" in said[-1]


def test_ratings_of_a_year_are_not_found_again_for_other_surroundings(tmp_path, variant):
    wall = tmp_path / "wall.obj"
    wall.write_text("v -9 -3 0\nv 9 -3 0\nv 9 -3 6\nv -9 -3 6\nf 1 2 3 4\n")
    options = YearOptions(
        TUTORIALS / "two_rooms.hbjson", WEATHER, space="Office", surroundings=(wall,)
    )
    moved = replace(options, surroundings_offset=(0.0, -1.0, 0.0))
    digests = [read_year(one).digest for one in (options, moved)]
    wall.write_text(wall.read_text().replace("6", "7"))
    digests.append(read_year(options).digest)
    assert len(set(digests)) == 3
