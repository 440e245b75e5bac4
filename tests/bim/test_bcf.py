"""BCF topics of a model's doubts."""

from __future__ import annotations

import re
import zipfile
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from click.testing import CliRunner

from bim.bcf import NEAREST, write_bcf
from bim.ifc.building import read_ifc
from bim.report.ranking import ranked
from scenes.commands.ifc import command
from tests.bim.small_ifc import WALL, WIDTH, box_model, box_room
from tests.issues import of_code

UUID = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")


def _topics(path) -> dict[str, tuple[ElementTree.Element, ElementTree.Element]]:
    """Markup and viewpoint of each topic, by its label."""
    with zipfile.ZipFile(path) as archive:
        assert ElementTree.fromstring(archive.read("bcf.version")).get("VersionId") == "2.1"
        folders = {name.split("/")[0] for name in archive.namelist() if "/" in name}
        parts = [
            tuple(ElementTree.fromstring(archive.read(f"{folder}/{name}")) for name in ("markup.bcf", "viewpoint.bcfv"))
            for folder in folders
        ]
        assert all(UUID.fullmatch(folder) for folder in folders)
    return {markup.findtext("Topic/Labels"): (markup, view) for markup, view in parts}


def test_a_doubt_is_a_topic_that_selects_its_elements_and_looks_at_them(tmp_path):
    path, out = tmp_path / "m.ifc", tmp_path / "m.bcfzip"
    model = box_room(doubled_wall=True, true_north=(1.0, 1.0))
    model.write(str(path))
    building = read_ifc(path)
    count = write_bcf(building, out)
    topics = _topics(out)
    assert len(topics) == count > 1
    markup, view = topics["element-drawn-twice"]
    again = next(wall for wall in model.by_type("IfcWall") if wall.Name == "south again")
    south = next(wall for wall in model.by_type("IfcWall") if wall.Name == "south")
    selected = [one.get("IfcGuid") for one in view.iter("Component")]
    assert set(selected) <= {again.GlobalId, south.GlobalId} and selected
    assert "south" in markup.findtext("Topic/Description")
    assert markup.find("Viewpoints").get("Guid") == view.get("Guid")
    # in the axes of the model, turned by 45 degrees from ours: the wall is before the camera
    vectors = {
        name: np.array([float(view.findtext(f"PerspectiveCamera/{name}/{axis}")) for axis in "XYZ"])
        for name in ("CameraViewPoint", "CameraDirection", "CameraUpVector")
    }
    along = np.array([WIDTH / 2, -0.15, 1.5]) - vectors["CameraViewPoint"]
    along /= np.linalg.norm(along)
    assert along == pytest.approx(vectors["CameraDirection"], abs=1e-3)
    assert vectors["CameraDirection"] @ vectors["CameraUpVector"] == pytest.approx(0, abs=1e-5)
    again_out = tmp_path / "again.bcfzip"
    write_bcf(building, again_out)
    assert zipfile.ZipFile(again_out).namelist() == zipfile.ZipFile(out).namelist()


def test_a_material_selects_the_elements_that_have_it(tmp_path):
    path, out = tmp_path / "m.ifc", tmp_path / "m.bcfzip"
    small, walls = box_model()
    material = small.model.create_entity("IfcMaterial", Name="Zorblax")
    small.model.create_entity(
        "IfcRelAssociatesMaterial", "2gRXFgjRn2HPE$YoDLX3FV", None, None, None, [walls["north"]], material
    )
    small.model.write(str(path))
    write_bcf(read_ifc(path), out)
    _, view = _topics(out)["material-unknown"]
    assert {one.get("IfcGuid") for one in view.iter("Component")} == {walls["north"].GlobalId}


def test_a_leak_is_before_the_camera(tmp_path):
    path, out = tmp_path / "m.ifc", tmp_path / "m.bcfzip"
    box_model(space=False, gap=0.4, true_north=(1.0, 0.0))[0].model.write(str(path))
    building = read_ifc(path)
    leaks = of_code(building, "room-leaks")
    assert len([one for one in ranked(building.issues) if one.first.code == "room-leaks"]) == len(leaks)
    leak = leaks[0]
    building = replace(building, issues=(leak,))
    write_bcf(building, out)
    _, view = _topics(out)["room-leaks"]
    eye, along = (
        np.array([float(view.findtext(f"PerspectiveCamera/{name}/{axis}")) for axis in "XYZ"])
        for name in ("CameraViewPoint", "CameraDirection")
    )
    place = np.linalg.solve(building.from_model, [*(leak.values[k] for k in "xyz"), 1.0])[:3]
    assert eye + NEAREST * along == pytest.approx(place, abs=1e-4)
    # the slit from floor to roof between the south and the east wall
    assert place[:2] == pytest.approx([WIDTH + WALL / 2, 0.2], abs=0.5)


def test_the_command_writes_topics(tmp_path):
    path, out = tmp_path / "m.ifc", tmp_path / "m.bcfzip"
    box_room(doubled_wall=True).write(str(path))
    result = CliRunner().invoke(command, ["check", str(path), "--bcf", str(out)], catch_exceptions=False)
    assert f"topics: {len(_topics(out))}" in result.output
