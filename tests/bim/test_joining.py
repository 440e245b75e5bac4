"""Rooms open to each other: reported, and one room where the corrections say so."""

from __future__ import annotations

import ifcopenshell.api.feature
import pytest

from bim.ifc.building import read_ifc
from bim.ifc.corrections import Corrections
from bim.report.issue import issue_text
from bim.shell import open_edges
from mitsuba_cfs.errors import DataError
from scenes import cli
from scenes.demo import WEATHER
from tests.bim.small_ifc import DEPTH, HEIGHT, WALL, WALLS, WIDTH, empty_project
from tests.issues import of_code, texts

THICK = 0.2  # of the partition [m]
PASSAGE = (1.0, 2.1)  # width, height of the opening in it [m]


def two_rooms(tmp_path, *, depth: float = THICK, cut: bool = True):
    """Rooms South and North, 2.9 m deep each; the partition's opening goes `depth` into it."""
    small = empty_project()
    for name, (low, size) in WALLS.items():
        small.box("IfcWall", name, low, size)
    for name, z in (("floor", -0.2), ("roof", HEIGHT)):
        small.box("IfcSlab", name, (-WALL, -WALL, z), (WIDTH + 2 * WALL, DEPTH + 2 * WALL, 0.2))
    half = (DEPTH - THICK) / 2
    wall = small.box("IfcWall", "partition", (0, half, 0), (WIDTH, THICK, HEIGHT))
    if cut:
        size = (PASSAGE[0], depth, PASSAGE[1])
        opening = small.box("IfcOpeningElement", "passage", (1.5, half, 0), size)
        ifcopenshell.api.feature.add_feature(small.model, feature=opening, element=wall)
    for name, y in (("South", 0.0), ("North", half + THICK)):
        small.box("IfcSpace", name, (0, y, 0), (WIDTH, half, HEIGHT))
    path = tmp_path / "two.ifc"
    small.model.write(str(path))
    return path


def reported(building, text: str) -> bool:
    return text in texts(building)


def test_open_rooms_are_reported_and_kept_apart(tmp_path):
    building = read_ifc(two_rooms(tmp_path))
    assert len(building.spaces) == 2
    (issue,) = of_code(building, "rooms-open-to-each-other")
    assert issue.values["rooms"] == ("North", "South")
    assert issue.values["area"] == pytest.approx(2.1, abs=0.05)
    fix = issue_text(issue, "command").fix
    assert "--join 'North + South'" in fix
    assert 'join = [["North", "South"]] in two.corrections.toml' in fix
    assert "join=('North + South',)" in issue_text(issue).fix


def test_niche_is_no_passage(tmp_path):
    assert not reported(read_ifc(two_rooms(tmp_path, depth=0.1)), "open to each other")


def test_joined_rooms_are_one_closed_room(tmp_path):
    path = two_rooms(tmp_path)
    path.with_name("two.corrections.toml").write_text('join = [["South", "North"]]')
    building = read_ifc(path)
    (space,) = building.spaces
    assert space.name == "South + North"
    volume = WIDTH * (DEPTH - THICK) * HEIGHT + PASSAGE[0] * PASSAGE[1] * THICK
    # 1e-5: outlines of openings are rounded to a micrometre
    assert space.volume == pytest.approx(volume, rel=1e-5)
    assert open_edges(space.shell) == 0
    assert not reported(building, "open to each other")


def test_rooms_without_a_passage_are_not_joined(tmp_path):
    path = two_rooms(tmp_path, cut=False)
    building = read_ifc(path, corrections=Corrections(join=(("South", "North"),)))
    assert len(building.spaces) == 2 and reported(building, "nothing opens between them")


def test_rooms_are_joined_by_argument_as_by_the_file(tmp_path):
    path = two_rooms(tmp_path)
    (space,) = read_ifc(path, join=["south+NORTH"]).spaces
    path.with_name("two.corrections.toml").write_text('join = [["South", "North"]]')
    (other,) = read_ifc(path).spaces
    assert space.name == other.name and space.volume == other.volume


@pytest.mark.parametrize(
    ("join", "message"), [("South", "with a plus between them"), ("South + Nord", "no room 'Nord'; there are: North,")]
)
def test_a_join_that_names_no_rooms_is_an_error(tmp_path, join, message):
    with pytest.raises(DataError, match=message):
        read_ifc(two_rooms(tmp_path), join=[join])


def test_what_check_says_is_what_the_commands_take(tmp_path, capsys):
    path = two_rooms(tmp_path)
    assert cli.run(["check", str(path)]) == 0
    said = capsys.readouterr().out
    text = said.partition("--join '")[2].partition("'")[0]
    assert cli.run(["check", str(path), "--join", text]) == 0
    assert "rooms: 1 " in capsys.readouterr().out
    out = str(tmp_path / "a.glb")
    assert cli.run(["export", str(path), "--join", text, "--space", text, "--gltf", out]) == 0
    for command in (
        ["run", str(path), "--weather", __file__, "--out", out],
        ["dgp", str(path), "--out", out],
        ["picture", str(path), "--at", "06-21 12:00", "--out", out],
    ):
        assert cli.run([*command, "--join", "South", "--help"]) == 0
        assert "--join" in capsys.readouterr().out


def test_a_picture_of_joined_rooms(tmp_path, capsys):
    """The reading commands hand the option on: the joined room is there under its name."""
    path = two_rooms(tmp_path)
    weather = ["--weather", str(WEATHER)]
    call = ["picture", str(path), *weather, "--at", "06-21 12:00", "--out", str(tmp_path / "a.hdr")]
    year = ["dgp", str(path), *weather, "--out", str(tmp_path / "out")]
    for command in (call, year):
        assert cli.run([*command, "--join", "North + South", "--space", "North + South"]) == 1
        assert "space North + South: has no window" in capsys.readouterr().err
