"""A room that was left out of the model: every command says why where it fails."""

from __future__ import annotations

import csv
import io

import ifcopenshell.api.pset
import pytest

from scenes import cli
from scenes.demo import VENETIAN_BLIND, WEATHER
from tests.bim.small_ifc import box_room, empty_project

WHY = "Space R1 Room is marked as external ("


@pytest.fixture
def outdoors(tmp_path):
    """A model whose only space says of itself that it is outdoors, and whose walls enclose none."""
    small = empty_project()
    space = small.box("IfcSpace", "R1", (0, 0, 0), (4, 6, 3), LongName="Room")
    small.box("IfcWall", "alone", (0, -0.3, 0), (4, 0.3, 3))
    pset = ifcopenshell.api.pset.add_pset(small.model, product=space, name="Pset_SpaceCommon")
    ifcopenshell.api.pset.edit_pset(small.model, pset=pset, properties={"IsExternal": True})
    path = tmp_path / "outdoors.ifc"
    small.model.write(str(path))
    return path


def commands(path, folder):
    system, weather = ["--cfs", VENETIAN_BLIND], ["--weather", WEATHER]
    thermal, study = folder / "thermal.toml", folder / "study.toml"
    thermal.write_text(f'weather = "{WEATHER}"\nbuilding = "{path}"\n[[system]]\nbsdf = "{VENETIAN_BLIND}"\n')
    study.write_text(
        f'[[room]]\nname = "r"\nbuilding = "{path}"\n[[system]]\nbsdf = "{VENETIAN_BLIND}"\n'
        f'[[climate]]\nweather = "{WEATHER}"\n'
    )
    coupled = folder / "coupled.toml"
    coupled.write_text(f"couple = true\n{thermal.read_text()}")
    out = ["--out", folder / "out"]
    yield ["run", path, *weather, *system, *out]
    yield ["dgp", path, *weather, *system, *out]
    yield ["picture", path, *weather, *system, "--at", "06-21 12:00", "--out", folder / "a.hdr"]
    yield ["thermal", thermal, *out]
    yield ["thermal", coupled, *out]
    yield ["study", study, *out]
    yield ["export", path, "--gltf", folder / "a.glb"]


@pytest.mark.parametrize("number", range(7))
def test_why_the_only_room_is_not_there(outdoors, number, tmp_path, capsys):
    command = list(commands(outdoors, tmp_path))[number]
    assert cli.run([str(word) for word in command]) == 1
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert said.startswith("error: ") and WHY in said


def test_a_room_asked_for_by_name_that_was_left_out(tmp_path, capsys):
    """The other rooms are there: the message is about the one asked for."""
    small = empty_project()
    small.box("IfcSpace", "1", (0, 0, 0), (4, 4, 3), LongName="Hall")
    small.box("IfcSpace", "7", (9, 0, 0), (0.1, 0.1, 3), LongName="Shaft")
    small.model.write(str(tmp_path / "m.ifc"))
    call = ["export", str(tmp_path / "m.ifc"), "--gltf", str(tmp_path / "a.glb")]
    assert cli.run([*call, "--space", "shaft"]) == 1
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert "space 'shaft' was left out: Space 7 Shaft has a volume of only 0.030 m3" in said
    assert cli.run([*call, "--space", "Hal"]) == 1
    assert "no space 'Hal'; there are: 1 Hall" in capsys.readouterr().err
    assert cli.run([*call, "--space", "1 hall"]) == 0


def test_the_tables_of_check_are_whole_when_piped(tmp_path, capsys):
    """Long names and texts: a program that reads on gets every character of them."""
    model = box_room()
    (space,) = model.by_type("IfcSpace")
    space.LongName = "A room with a very long name " * 12 + "END"
    for wall in model.by_type("IfcWall"):
        wall.Name = f"{wall.Name} {'of a long name ' * 20}END"
    model.by_type("IfcBuildingStorey")[0].Name = "storey " * 20 + "END"
    path, table = tmp_path / "m.ifc", tmp_path / "p.csv"
    model.write(str(path))
    assert cli.run(["check", str(path), "--csv", str(table)]) == 0
    said = capsys.readouterr().out
    assert "…" not in said and space.LongName in said
    first = {}  # of a repeated issue the list has one example
    for row in list(csv.reader(io.StringIO(table.read_text())))[1:]:
        first.setdefault(row[3], row)
    for row in first.values():
        assert all(cell in said for cell in row[:3])  # not code and severity


@pytest.mark.parametrize("command", [["run"], ["comply", "--standard", "en17037"], ["dgp"]], ids=lambda words: words[0])
def test_a_model_without_windows_whose_file_is_cut_off(command, tmp_path, capsys):
    """What is missing may stand in the part that is lost: that is said, not that there is none."""
    small = empty_project()
    small.box("IfcSpace", "1", (0, 0, 0), (4, 4, 3), LongName="Hall")
    path = tmp_path / "cut.ifc"
    small.model.write(str(path))
    text = path.read_text(encoding="utf-8")
    path.write_text(text[: text.index("ENDSEC;", text.index("DATA;"))], encoding="utf-8")
    call = [*command, path, "--weather", WEATHER, "--cfs", VENETIAN_BLIND, "--out", tmp_path / "o"]
    assert cli.run([str(word) for word in call]) == 1
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert said.startswith(f"error: {path}: ") and "cut off" in said
