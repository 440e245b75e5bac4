"""The TOML file of corrections beside a model."""

from __future__ import annotations

from dataclasses import replace

import ifcopenshell
import ifcopenshell.api.material
import ifcopenshell.api.pset
import ifcopenshell.api.root
import ifcopenshell.api.spatial
import ifcopenshell.api.type
import pytest
from click.testing import CliRunner

from bim.building_file import named_spaces
from bim.ifc.building import read_ifc
from bim.ifc.correct import correct
from bim.ifc.corrections import Corrections, Paint, read_corrections
from bim.ifc.corrections_draft import corrections_draft
from bim.ifc.targets import query
from bim.shell import open_edges
from mitsuba_cfs.errors import DataError
from scenes.commands.ifc import command
from tests.bim.small_ifc import DEPTH, HEIGHT, WALLS, WIDTH, add_material, box_model, box_room
from tests.issues import of_code


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "model.ifc"
    box_room(doubled_wall=True).write(str(path))
    return path


def names(building) -> set[str]:
    return {element.name for element in building.elements}


def test_file_beside_the_model_is_used(path):
    path.with_name("model.corrections.toml").write_text(
        """
leave_out = ['IfcWall, Name="south again"']
surroundings = 0.25
[[reflectance]]
select = 'IfcSlab'
visible = 0.11
solar = 0.22
[[reflectance]]
select = 'IfcWall, Name="north"'
visible = 0.66
"""
    )
    building = read_ifc(path)
    assert "south again" not in names(building) and "south" in names(building)
    assert {e.reflectance_visible for e in building.elements} == {0.25}
    faces = building.spaces[0].faces
    floor = next(face for face in faces if face.kind == "floor")
    assert (floor.reflectance_visible, floor.reflectance_solar) == (0.11, 0.22)
    values = {round(face.reflectance_visible, 2) for face in faces if face.kind == "wall"}
    assert values == {0.66, 0.5}
    assert of_code(building, "corrections-used")
    assert "south again" in names(read_ifc(path, corrections=Corrections()))


def test_only_keeps_nothing_else(path):
    corrections = Corrections(only=("IfcSpace", "IfcWindow", "IfcSlab", 'IfcWall, Name="south"'))
    building = read_ifc(path, corrections=corrections)
    assert names(building) == {"south", "W1", "floor", "roof"}
    assert len(building.windows) == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("leave_out = 3", "leave_out"),
        ("leaves = []", "leaves: no such key; did you mean leave_out"),
        ("nothing_like_it = 1", "there are leave_out, only"),
        ("[[reflectance]]\nselect = 'IfcWall'\nvisibel = 0.5", "reflectance.visibel: .* visible"),
        ("reflectance = 3", "reflectance"),
        ("opaque = 'IfcWindow'", "opaque"),
        ("surroundings = 1.2", "surroundings"),
        ("[[reflectance]]\nvisible = 0.5", "select"),
        ("[[reflectance]]\nselect = 'IfcWall'", "visible"),
        ("leave_out = [", "TOML"),
    ],
)
def test_wrong_entries_are_named(tmp_path, text, message):
    path = tmp_path / "x.toml"
    path.write_text(text)
    with pytest.raises(DataError, match=message):
        read_corrections(path)


def test_selector_that_cannot_be_parsed_is_named(path):
    with pytest.raises(DataError, match="IfcWall,,,"):
        read_ifc(path, corrections=Corrections(leave_out=("IfcWall,,,=",)))


@pytest.mark.parametrize("selector", ['IfcWindow, Name="W1"', 'IfcWall, Name="south"'])
def test_glass_that_the_corrections_make_opaque_is_a_wall(tmp_path, selector):
    small, walls = box_model(window="Window" in selector)
    if "Wall" in selector:  # the wall itself is drawn transparent, and painting it leaves it so
        small.show(walls["south"], [(*WALLS["south"], small.style("Glass", 0.5, 0.9))])
    path = tmp_path / "model.ifc"
    small.model.write(str(path))
    plain = read_ifc(path, corrections=Corrections(paints=(Paint(selector, 0.4, 0.4),)))
    assert plain.windows and plain.account.glass_out > 1.0
    building = read_ifc(path, corrections=Corrections(opaque=(selector,)))
    (room,) = building.spaces
    assert room.windows == () and building.account.glass_out == 0.0
    assert open_edges(room.shell) == 0
    assert room.volume == pytest.approx(WIDTH * DEPTH * HEIGHT, rel=1e-6)


def test_query_lists_what_a_selector_chooses(path):
    say = CliRunner().invoke(command, ["query", str(path), "IfcWall, Name=/south.*/"])
    assert say.exit_code == 0, say.output
    assert "south again" in say.output and "north" not in say.output
    assert say.output.splitlines()[-1] == "elements: 2"
    wall = next(w for w in ifcopenshell.open(str(path)).by_type("IfcWall") if w.Name == "east")
    assert [one.name for one in query(path, wall.GlobalId)] == ["east"]
    wrong = CliRunner().invoke(command, ["query", str(path), "IfcWall,,,="])
    assert wrong.exit_code != 0 and isinstance(wrong.exception, DataError)


@pytest.mark.parametrize(
    "select",
    [
        "{guid}",
        'IfcWall, Name="east"',
        'IfcWall, type="Type E"',
        'IfcWall, material="Brick"',
        'IfcWall, location="Attic"',
        'layer="A-EAST"',
        "IfcWall, layer=A-EAST",
        'layer="A-EAST" + layer="none"',
        'IfcWall, Pset_WallCommon.Reference="E1"',
    ],
)
@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4"])
def test_every_kind_of_selector_leaves_out_the_one_wall(tmp_path, schema, select):
    model = box_room(schema)
    wall = next(one for one in model.by_type("IfcWall") if one.Name == "east")
    kind = ifcopenshell.api.root.create_entity(model, ifc_class="IfcWallType", name="Type E")
    ifcopenshell.api.type.assign_type(model, related_objects=[wall], relating_type=kind)
    brick = ifcopenshell.api.material.add_material(model, name="Brick")
    ifcopenshell.api.material.assign_material(model, products=[wall], material=brick)
    attic = ifcopenshell.api.root.create_entity(model, ifc_class="IfcBuildingStorey", name="Attic")
    ifcopenshell.api.spatial.assign_container(model, products=[wall], relating_structure=attic)
    model.create_entity(
        "IfcPresentationLayerAssignment", Name="A-EAST", AssignedItems=[wall.Representation.Representations[0]]
    )
    pset = ifcopenshell.api.pset.add_pset(model, product=wall, name="Pset_WallCommon")
    ifcopenshell.api.pset.edit_pset(model, pset=pset, properties={"Reference": "E1"})
    removed = Corrections(leave_out=(select.format(guid=wall.GlobalId),)).removed(model)
    assert removed == {wall.id()}


def test_the_draft_has_every_doubt_and_reads_back_as_no_correction(tmp_path) -> None:
    """Uncommented, its lines are the corrections that they say."""
    small, walls = box_model(space_height=HEIGHT + 1.0, true_north=None)
    add_material(small.model, walls["south"], 'Zeug "7"')
    path = tmp_path / "m.ifc"
    small.model.write(str(path))
    building = read_ifc(path)
    draft = tmp_path / "m.corrections.toml"
    draft.write_text(corrections_draft(building), encoding="utf-8")
    assert replace(read_corrections(draft), file="") == Corrections()
    again = read_ifc(path)
    assert [s.volume for s in again.spaces] == [s.volume for s in building.spaces]
    lines = []
    for line in draft.read_text("utf-8").splitlines():
        bare = line.strip().removeprefix("# ")
        starts = (
            "north =",
            "[[material]]",
            "name =",
            "conductivity =",
            "density =",
            "[[room]]",
            "select =",
            "long_name =",
            "[[glass]]",
            "area =",
        )
        is_entry = line.startswith("    # ") and '"' in bare
        lines.append(bare if bare.startswith(starts) or is_entry else line)
    draft.write_text("\n".join(lines).replace(f'"{building.spaces[0].guid}",  # R1', "# R1"), "utf-8")
    chosen = read_corrections(draft)
    assert chosen.north_deg == 0.0 and chosen.as_drawn == (building.spaces[0].guid,)
    assert [one.name for one in chosen.materials if "Zeug" in one.name] == ['Zeug "7"']
    (space,) = read_ifc(path).spaces
    assert space.room_volume == pytest.approx(space.drawn_volume) and space.cut == 0.0


@pytest.mark.parametrize(
    ("entry", "code"), [("leave_out", "space-removed"), ("only", "space-removed"), ("outdoors", "space-outdoors")]
)
def test_a_space_that_the_user_leaves_out_is_not_said_to_lack_geometry(tmp_path, entry, code):
    small, _ = box_model()
    small.box("IfcSpace", "R2", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    path = tmp_path / "m.ifc"
    small.model.write(str(path))
    chosen = "['IfcWall', 'IfcSlab', 'IfcWindow', 'IfcSpace, Name=\"R2\"']"
    chosen = chosen if entry == "only" else "['IfcSpace, Name=\"R1\"']"
    path.with_name("m.corrections.toml").write_text(f"{entry} = {chosen}", "utf-8")
    building = read_ifc(path)
    assert [space.name for space in building.spaces] == ["R2"]
    (issue,) = [one for one in building.issues if one.effect.lost == "room"]
    assert (issue.code, issue.values["room"]) == (code, "R1 Room")
    missing = building.account.missing
    assert missing == (("R1 Room",) if entry == "outdoors" else ())
    with pytest.raises(DataError, match=r"'R1' was left out: .* corrections file"):
        named_spaces(building, ["R1"], path)


NAMES = """
[[room]]
select = 'IfcSpace, Name="R1"'
name = "1.03"
long_name = "Kitchen"
"""


def test_names_and_areas_of_glass_are_corrected(tmp_path):
    small, walls = box_model()
    small.opening(walls["south"], (3.6, 0.9, 0.4, 1.0), "hatch")
    path = tmp_path / "m.ifc"
    small.model.write(str(path))
    glass = "\n[[glass]]\nselect = 'IfcWindow'\narea = 2.5\n"
    glass += "[[glass]]\nselect = 'IfcOpeningElement, Name=\"hatch\"'\narea = 0.3\n"
    path.with_name("m.corrections.toml").write_text(NAMES + glass, "utf-8")
    building = read_ifc(path)
    (space,) = building.spaces
    assert (space.name, space.long_name) == ("1.03", "Kitchen")
    assert [one.name for one in read_ifc(path, rooms=["1.03"]).spaces] == ["1.03"]
    areas = sorted(window.area for window in building.windows)
    assert areas == [pytest.approx(0.3, rel=1e-3), pytest.approx(2.5, rel=1e-3)]
    assert building.account.glass_assumed == 0.0
    path.with_name("m.corrections.toml").write_text(glass.replace("2.5", "0"), "utf-8")
    assert [w.area for w in read_ifc(path).windows] == [pytest.approx(0.3, rel=1e-3)]


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("[[glass]]\nselect = 'IfcWindow'\narea = 9", "9 m2 is more than the opening of 4.5 m2"),
        ("[[glass]]\nselect = 'IfcWindow'\narea = -1", "square metres from 0 to 10000"),
        ("[[glass]]\nselect = 'IfcWindow'\nares = 1", "no such key; did you mean area"),
        ("[[glass]]\narea = 1", "expected select"),
        ("[[room]]\nselect = 'IfcSpace'", "expected name = "),
        ("[[room]]\nselect = 'IfcSpace'\nname = 3", "expected name = "),
    ],
)
def test_wrong_names_and_areas_are_refused_by_name(tmp_path, entry, message):
    path = tmp_path / "m.ifc"
    box_room().write(str(path))
    path.with_name("m.corrections.toml").write_text(entry, "utf-8")
    with pytest.raises(DataError, match=message):
        read_ifc(path)


def test_names_are_written_into_the_model(tmp_path):
    path, out = tmp_path / "m.ifc", tmp_path / "out.ifc"
    box_room().write(str(path))
    path.with_name("m.corrections.toml").write_text(NAMES, "utf-8")
    assert correct(path, out).left == ()
    (space,) = read_ifc(out).spaces
    assert space.label == "1.03 Kitchen"
    # another entry chooses the space by the name that it has in the file
    path.with_name("m.corrections.toml").write_text("as_drawn = ['IfcSpace, Name=\"R1\"']\n" + NAMES, "utf-8")
    assert set(correct(path, tmp_path / "other.ifc").left) == {"as_drawn", "room"}
    (space,) = read_ifc(tmp_path / "other.ifc").spaces
    assert space.label == "1.03 Kitchen"
