"""`cfs run --surroundings`: taken by a run, named in its manifest."""

from __future__ import annotations

import json

import pytest

from mitsuba_cfs.progress import silent
from scenes.demo import WEATHER
from scenes.run.files import read_files
from scenes.run.options import JobOptions
from scenes.run.run import _manifest, read_inputs
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
