"""`cfs check` and `export` as a user meets them."""

from __future__ import annotations

import json
import math

import ifcopenshell
import ifcopenshell.api.group
import ifcopenshell.api.root
import numpy as np
import pytest
from click.testing import CliRunner

from bim.ifc.north import true_north
from bim.ifc.project import site_location
from mitsuba_cfs.errors import DataError
from scenes.commands.ifc import command
from scenes.demo import OFFICE
from tests.bim.small_ifc import DEPTH, HEIGHT, WALL, WIDTH, box_model, box_room


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "model.ifc"
    box_room(doubled_wall=True).write(str(path))
    return path


def test_check_shows_rooms_and_issues(path, tmp_path):
    table = tmp_path / "problems.csv"
    result = CliRunner().invoke(command, ["check", str(path), "--csv", str(table)], catch_exceptions=False)
    assert result.exit_code == 0
    assert "R1 Room" in result.output and "24.00" in result.output and "72.00" in result.output
    assert "is drawn where" in result.output
    assert "rooms: 1 (with windows: 1), windows: 1 (3.6 m2 of glass)" in result.output
    lines = table.read_text().splitlines()
    assert lines[0] == "where,what,consequence,code,severity"
    assert any("is drawn where" in line for line in lines)


def test_check_lists_the_rooms_of_a_zone(tmp_path):
    small, _ = box_model()
    low = (0.0, DEPTH + WALL, 0.0)
    small.box("IfcWall", "back", (0.0, DEPTH + WALL + 2, 0.0), (WIDTH, WALL, HEIGHT))
    small.box("IfcSpace", "R2", low, (WIDTH, 2.0, HEIGHT), LongName="Bath")
    zone = ifcopenshell.api.root.create_entity(small.model, ifc_class="IfcZone", name="Home 2")
    bath = [one for one in small.model.by_type("IfcSpace") if one.Name == "R2"]
    ifcopenshell.api.group.assign_group(small.model, products=bath, group=zone)
    path = tmp_path / "m.ifc"
    small.model.write(str(path))
    path.with_name("m.corrections.toml").write_text('indoors = ["IfcSpace"]')
    result = CliRunner().invoke(command, ["check", str(path), "--space", "home 2"], catch_exceptions=False)
    table = [line for line in result.output.splitlines() if line.startswith("│")]
    assert ["R2 Bath" in line for line in table] == [True]
    assert "rooms: 1 (with windows: 0), windows: 0" in result.output


def test_export_writes_what_is_asked_for(path, tmp_path):
    rad, zone, view = tmp_path / "rad", tmp_path / "room.epJSON", tmp_path / "room.glb"
    mitsuba = tmp_path / "mitsuba"
    result = CliRunner().invoke(
        command,
        [
            "export",
            str(path),
            "--radiance",
            str(rad),
            "--mitsuba",
            str(mitsuba),
            "--epjson",
            str(zone),
            "--gltf",
            str(view),
        ],
        catch_exceptions=False,
    )
    assert result.exit_code == 0
    assert (rad / "R1_Room" / "windows_S.rad").is_file()
    assert (mitsuba / "R1_Room" / "scene.xml").is_file()
    assert zone.is_file() and view.is_file()


def test_the_radiance_folder_is_of_the_grid_the_sky_and_the_band_asked_for(path, tmp_path):
    asked = ["--spacing", "1.5", "--height", "1", "--subdivision", "4", "--band", "solar"]
    call = ["export", str(path), "--radiance", str(tmp_path / "rad"), *asked]
    assert CliRunner().invoke(command, call, catch_exceptions=False).exit_code == 0
    folder = tmp_path / "rad" / "R1_Room"
    sensors = np.loadtxt(folder / "sensors.pts")
    assert np.all(sensors[:, 2] == 1.0)
    assert np.diff(np.unique(sensors[:, 0])) == pytest.approx(1.5)
    assert "h=r4" in (folder / "sky.rad").read_text()
    walls = np.loadtxt(folder / "surfaces.pts")
    assert len(np.unique(walls[:, 3:], axis=0)) >= 6  # on all sides


def test_export_of_an_unknown_room_and_of_nothing(path, tmp_path):
    arguments = ["export", str(path), "--space", "attic", "--gltf", str(tmp_path / "x.glb")]
    result = CliRunner().invoke(command, arguments)
    assert isinstance(result.exception, DataError) and "R1" in str(result.exception)
    result = CliRunner().invoke(command, ["export", str(path)])
    assert result.exit_code == 2 and "nothing to write" in result.output


def test_not_an_ifc(tmp_path):
    path = tmp_path / "text.ifc"
    path.write_text("hello")
    result = CliRunner().invoke(command, ["check", str(path)])
    assert isinstance(result.exception, DataError) and "text.ifc" in str(result.exception)


def test_survey_has_a_line_for_each_file(path, tmp_path):
    other, table = tmp_path / "text.ifc", tmp_path / "table.md"
    other.write_text("hello")
    result = CliRunner().invoke(
        command, ["survey", str(path), str(other), "--markdown", str(table)], catch_exceptions=False
    )
    assert result.exit_code == 0
    head, _, room, refused, _, sums = table.read_text().splitlines()
    cells = dict(zip(head.split("|"), room.split("|"), strict=True))
    cells = {key.strip(): value.strip() for key, value in cells.items()}
    assert (cells["file"], cells["schema"], cells["rooms"]) == ("model.ifc", "IFC4", "1")
    assert (cells["windows"], cells["glass m2"], cells["open"]) == ("1", "3.6", "0")
    assert float(cells["memory MB"]) > 50 and "refused: not an IFC file" in refused
    assert "2 files, 1 refused; 1 rooms" in sums


def test_info_states_what_the_file_states_of_itself(tmp_path):
    path = tmp_path / "turned.ifc"
    model = ifcopenshell.open(str(OFFICE))
    (context, *_) = model.by_type("IfcGeometricRepresentationContext", include_subtypes=False)
    context.TrueNorth = model.createIfcDirection((math.sin(math.radians(30)), math.cos(math.radians(30))))
    model.write(str(path))
    words = ["info", str(path), "--json", str(tmp_path / "info.json")]
    result = CliRunner().invoke(command, words, catch_exceptions=False)
    assert "north: +y points 30.0 degrees west of north" in result.output
    (found,) = json.loads((tmp_path / "info.json").read_text())
    assert found["counts"]["spaces"] == len(model.by_type("IfcSpace")) == sum(found["storeys"].values())
    assert found["counts"]["windows"] == len(model.by_type("IfcWindow"))
    assert found["latitude_deg"] == pytest.approx(site_location(model)[0])
    assert true_north(model)[0] == pytest.approx((0.5, math.sqrt(0.75)))
