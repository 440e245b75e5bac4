"""`--surroundings`: read by every command of a room, named in a run's manifest."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from mitsuba_cfs.errors import DataError
from scenes import cli
from scenes.commands.room_options import with_flags
from scenes.demo import WEATHER
from scenes.heat import study_file as heat_file
from scenes.heat.study import study_inputs
from scenes.inputs import read_inputs
from scenes.run.files import read_files
from scenes.run.options import JobOptions
from scenes.run.run import _manifest
from scenes.study import one_case
from scenes.study import study_file as grid_file
from scenes.study.plan import plan_of
from scenes.year_of_glare.options import YearOptions
from scenes.year_of_glare.year import read_year
from tests.conftest import REPOSITORY

TUTORIALS = REPOSITORY / "docs" / "tutorials"
QUARTER = TUTORIALS / "quarter.city.json"


@pytest.fixture
def options():
    return JobOptions(
        TUTORIALS / "two_rooms.hbjson",
        WEATHER,
        spaces=("Office",),
        surroundings=(QUARTER,),
        surroundings_offset=(-456000.0, -5430000.0, -110.0),
    )


def test_the_quarter_stands_around_the_room(options):
    inputs = read_inputs(options, read_files(options))
    names = {element.name for element in inputs.building.elements}
    assert {"north block", "street block", "tower", "Overhang"} <= names


def test_the_manifest_names_the_files(options):
    inputs = read_inputs(options, read_files(options))
    manifest = json.loads(json.dumps(_manifest(options, "llvm", inputs, [])))
    assert manifest["inputs"]["surroundings_0"]["path"] == str(QUARTER)
    assert manifest["options"]["surroundings"] == [str(QUARTER)]


@pytest.mark.parametrize("command", ["run", "comply", "dgp", "picture"])
def test_every_command_of_a_room_reads_them(command, tmp_path, capfd):
    """A file that cannot be used is named, so it was read."""
    broken = tmp_path / "broken.city.json"
    broken.write_text("{")
    words = [
        command,
        TUTORIALS / "two_rooms.hbjson",
        "--weather",
        WEATHER,
        "--surroundings",
        broken,
        "--out",
        tmp_path / ("out.png" if command == "picture" else "out"),
    ]
    more = {"comply": ["--standard", "en17037"], "picture": ["--at", "06-21 12:00", "--size", "16", "--samples", "1"]}
    assert cli.run([str(word) for word in [*words, *more.get(command, [])]]) == 1
    said = capfd.readouterr().err.strip().splitlines()
    assert "broken.city.json" in said[-1]


def test_ratings_of_a_year_are_not_found_again_for_other_surroundings(tmp_path, variant):
    wall = tmp_path / "wall.obj"
    wall.write_text("v -9 -3 0\nv 9 -3 0\nv 9 -3 6\nv -9 -3 6\nf 1 2 3 4\n")
    options = YearOptions(TUTORIALS / "two_rooms.hbjson", WEATHER, spaces=("Office",), surroundings=(wall,))
    moved = replace(options, surroundings_offset=(0.0, -1.0, 0.0))
    digests = [read_year(one).digest for one in (options, moved)]
    wall.write_text(wall.read_text().replace("6", "7"))
    digests.append(read_year(options).digest)
    assert len(set(digests)) == 3


def study_of(folder, kind: str, more: str = ""):
    """A study of the room of the tutorials with a wall before its window."""
    wall = folder / "wall.obj"
    wall.write_text("v -9 -3 0\nv 9 -3 0\nv 9 -3 6\nv -9 -3 6\nf 1 2 3 4\n")
    building = (TUTORIALS / "two_rooms.hbjson").as_posix()
    around = f'surroundings = ["wall.obj"]\nsurroundings_offset = [0, -1, 0]\n{more}'
    text = {
        "thermal": f'{around}building = "{building}"\nspaces = ["Office"]\nweather = "{WEATHER.as_posix()}"\n',
        "study": f'{around}[[room]]\nbuilding = "{building}"\nspaces = ["Office"]\n'
        f'[[climate]]\nweather = "{WEATHER.as_posix()}"\n',
    }
    path = folder / f"{kind}.toml"
    path.write_text(text[kind])
    return path


def test_study_files_name_them(tmp_path):
    """Of `cfs thermal` and `cfs study`; `--surroundings` adds to them; the offset moves all."""
    heat = heat_file.read_study(study_of(tmp_path, "thermal"))
    heat = with_flags(heat, (QUARTER,), (-456000.0, -5430000.0, -110.0))
    building = study_inputs(heat).building
    assert {"north block", "tower"} <= {element.name for element in building.elements}
    assert [file.name for file in heat.surroundings] == ["wall.obj", QUARTER.name]
    grid = grid_file.read_study(study_of(tmp_path, "study"))
    plan = plan_of(grid)
    building = one_case._building(plan.cases[0])
    (wall,) = (element for element in building.elements if element.guid == "wall-0")
    assert wall.triangles[..., 1] == pytest.approx(-4.0)
    around = [file.path for file in plan.cases[0].files if file.name.startswith("surroundings")]
    assert around == list(grid.surroundings) == list(plan.cases[0].inputs.surroundings)


def test_cases_are_not_found_again_for_other_surroundings(tmp_path):
    file = study_of(tmp_path, "study")
    grid = grid_file.read_study(file)
    moved = with_flags(grid, (), (0.0, -2.0, 0.0))
    keys = [plan_of(one).cases[0].key for one in (grid, moved)]
    wall = tmp_path / "wall.obj"
    wall.write_text(wall.read_text().replace("6", "7"))
    keys.append(plan_of(grid).cases[0].key)
    assert len(set(keys)) == 3


def test_a_study_does_not_turn_them(tmp_path):
    file = study_of(tmp_path, "study", "orientations_deg = [0, 90]\n")
    with pytest.raises(DataError, match="orientations_deg: surroundings stand still"):
        plan_of(grid_file.read_study(file))


@pytest.mark.parametrize("command", ["thermal", "study"])
def test_commands_of_study_files_read_them(command, tmp_path, capfd):
    broken = tmp_path / "broken.city.json"
    broken.write_text("{")
    words = [command, study_of(tmp_path, command), "--surroundings", broken, "--out", "out"]
    assert cli.run([str(word) for word in words]) == 1
    assert "broken.city.json" in capfd.readouterr().err.strip().splitlines()[-1]
