"""Outdoor spaces, heights, north and missing GlobalIds, as authoring programs draw them."""

from __future__ import annotations

from types import SimpleNamespace

import ifcopenshell
import ifcopenshell.api.pset
import ifcopenshell.guid
import numpy as np
import pytest

from bim.ifc import cut_rooms
from bim.ifc.building import read_ifc
from bim.ifc.north import north_rotation
from bim.ifc.project import site_location
from bim.names import natural_key
from bim.report.issue import issue_text
from mitsuba_cfs.processes import ProcessEnded
from tests.bim.small_ifc import DEPTH, HEIGHT, WALL, WIDTH, box_model, empty_project
from tests.issues import codes, of_code

OUT = 1.7  # depth of a balcony [m]


def _read(small, tmp_path, corrections: str = ""):
    path = tmp_path / "m.ifc"
    small.model.write(str(path))
    path.with_name("m.corrections.toml").write_text(corrections)
    return read_ifc(path)


def _balcony(name: str, *, roof: bool, front: float = 1.0):
    """The box with a space outside of its window: two side walls and a front of so much height."""
    small, _ = box_model()
    low = -WALL - OUT
    for x in (-WALL, WIDTH):
        small.box("IfcWall", "side", (x, low, 0.0), (WALL, OUT, HEIGHT))
    small.box("IfcWall", "front", (-WALL, low - 0.1, 0.0), (WIDTH + 2 * WALL, 0.1, front))
    small.box("IfcSlab", "floor out", (-WALL, low, -0.2), (WIDTH + 2 * WALL, OUT, 0.2))
    if roof:
        small.box("IfcSlab", "roof out", (-WALL, low, HEIGHT), (WIDTH + 2 * WALL, OUT, 0.2))
    small.box("IfcSpace", "2", (0.0, low, 0.0), (WIDTH, OUT, HEIGHT), LongName=name)
    return small


@pytest.mark.parametrize(
    ("name", "roof", "front"),
    [
        ("Loggia", True, 1.0),
        ("Balkon", True, 1.0),
        ("Space 7", True, 1.0),
        ("Terrasse", False, 1.0),
        ("Innenhof", False, HEIGHT),
        ("Space 7", False, HEIGHT),
    ],
)
def test_spaces_open_to_the_air_are_outdoors_and_windows_look_out(tmp_path, name, roof, front):
    building = _read(_balcony(name, roof=roof, front=front), tmp_path)
    assert [space.name for space in building.spaces] == ["R1"]
    assert len(building.spaces[0].windows) == 1
    assert len(of_code(building, "space-outdoors")) == 1


def test_an_enclosed_space_is_a_room_whatever_its_name(tmp_path):
    building = _read(_balcony("Loggia", roof=True, front=HEIGHT), tmp_path)
    assert len(building.spaces) == 2
    # the window between them is inner glass then, and the verdict says so
    assert building.account.inner_only == ("R1 Room", "2 Loggia")
    assert any("inner glass" in reason for reason in building.account.reasons)


@pytest.mark.parametrize(("stated", "resistance"), [(None, 0.006), (1.1, 1.0 / 1.1 - 0.17)])
def test_heat_passes_inner_glass_by_its_stated_u_or_as_one_pane(tmp_path, stated, resistance):
    small = _balcony("Loggia", roof=True, front=HEIGHT)
    if stated is not None:
        (window,) = small.model.by_type("IfcWindow")
        pset = ifcopenshell.api.pset.add_pset(small.model, window, "Pset_WindowCommon")
        values = {"ThermalTransmittance": stated}
        ifcopenshell.api.pset.edit_pset(small.model, pset, properties=values)
    faces = [face for space in _read(small, tmp_path).spaces for face in space.faces]
    panes = [face for face in faces if face.pane is not None]
    assert len(panes) == 2
    for face in panes:
        assert face.construction.resistance == pytest.approx(resistance)


def test_corrections_say_what_is_outdoors(tmp_path):
    loggia = _balcony("Loggia", roof=True)
    kept = _read(loggia, tmp_path, "indoors = ['IfcSpace, LongName=\"Loggia\"']")
    assert len(kept.spaces) == 2
    left = _read(loggia, tmp_path, "outdoors = ['IfcSpace, Name=\"R1\"']")
    assert "R1" not in [space.name for space in left.spaces]


def test_a_room_whose_roof_the_file_lacks_is_kept(tmp_path):
    building = _read(box_model(roof=False)[0], tmp_path)
    assert len(building.spaces) == 1


def test_a_space_through_its_roof_is_cut_there(tmp_path):
    building = _read(box_model(space_height=HEIGHT + 1.0)[0], tmp_path)
    (space,) = building.spaces
    assert space.room_volume == pytest.approx(WIDTH * DEPTH * HEIGHT, abs=0.01)
    assert space.drawn_volume == pytest.approx(WIDTH * DEPTH * (HEIGHT + 1), abs=0.01)
    (issue,) = of_code(building, "room-cut")
    assert issue.values["before"] == pytest.approx(WIDTH * DEPTH * (HEIGHT + 1), abs=0.01)
    assert "extends 1.00 m above the slab, roof or ceiling that covers it" in issue_text(issue, "command").what
    assert any(face.kind == "roof" and face.element is not None for face in space.faces)


def test_a_space_whose_cut_ends_its_process_is_named(tmp_path, monkeypatch):
    ended = ProcessEnded("killed by signal 9", "")
    monkeypatch.setattr(cut_rooms, "parted", lambda items: [ended for _ in items])
    building = _read(box_model(space_height=HEIGHT + 1.0)[0], tmp_path)
    (issue,) = of_code(building, "room-not-cut")
    assert issue.values["reason"] == str(ended)
    assert "room-cut" not in codes(building)


def test_a_gallery_cuts_nothing(tmp_path):
    small, _ = box_model()
    small.box("IfcSlab", "gallery", (0.0, 0.0, 1.5), (WIDTH, DEPTH - 1.5, 0.2))
    assert "room-cut" not in codes(_read(small, tmp_path))


def test_elements_without_a_guid_are_told_apart(tmp_path):
    small, _ = box_model(places=((0.5, 1.0, 1.0, 1.2), (2.2, 1.0, 1.2, 1.2)))
    for window in small.model.by_type("IfcWindow"):
        window.GlobalId = ""
    building = _read(small, tmp_path)
    windows = building.spaces[0].windows
    assert len({window.guid for window in windows}) == 2
    assert of_code(building, "guid-missing")[0].values["count"] == 2


def _north(x: float, y: float, *more: float, axis=None, origin=(4e5, 58e5, 30.0)):
    model = empty_project(true_north=None).model
    context = model.by_type("IfcGeometricRepresentationContext", include_subtypes=False)[0]
    context.TrueNorth = model.create_entity("IfcDirection", (float(x), float(y), *more))
    if axis is not None:
        crs = model.create_entity("IfcProjectedCRS", Name="EPSG:25833")
        model.create_entity("IfcMapConversion", context, crs, *origin, *axis, 1.0)
    return model


def _angle(model, corrected: float | None = None) -> tuple[float, list[str]]:
    """Direction of +y from north to east [deg]."""
    rotation, issues = north_rotation(model, corrected)
    return float(np.degrees(np.arctan2(rotation[0, 1], rotation[1, 1]))), [i.code for i in issues]


def test_a_third_component_of_true_north_changes_nothing():
    assert _angle(_north(1.0, 1.0, 0.0)) == _angle(_north(1.0, 1.0)) == (pytest.approx(-45.0), [])
    assert _angle(_north(0.0, 0.0, 1.0))[1] == ["true-north-invalid"]


@pytest.mark.parametrize(
    ("true", "turn", "origin", "angle", "codes_"),
    [
        ((0.0, 1.0), 45.0, (4e5, 58e5, 30.0), -45.0, ["north-contradicts-map"]),
        ((1.0, 1.0), 0.0, (4e5, 58e5, 30.0), 0.0, ["north-contradicts-map"]),
        ((1.0, 1.0), 43.0, (4e5, 58e5, 30.0), -45.0, []),  # convergence
        ((1.0, 1.0), 0.0, (0.0, 0.0, 0.0), -45.0, []),  # what a program without a map writes
    ],
)
def test_the_map_conversion_has_precedence(true, turn, origin, angle, codes_):
    turned = np.radians(turn)
    model = _north(*true, axis=(float(np.cos(turned)), float(np.sin(turned))), origin=origin)
    assert _angle(model) == (pytest.approx(angle, abs=1e-6), codes_)


def test_north_is_corrected(tmp_path):
    assert _angle(_north(0.0, 1.0), 30.0) == (pytest.approx(30.0), ["north-corrected"])
    building = _read(box_model()[0], tmp_path, "north = 90")
    np.testing.assert_allclose(building.windows[0].normal, (-1, 0, 0), atol=1e-9)


LIST = ("Brick, Common", "Fiberglass Batt", "Plaster")  # outermost first


def _with_list(tmp_path, name: str, kind: str, fractions=(None,) * 3):
    """The layers of the south wall, whose materials are a list or constituents."""
    small, walls = box_model()
    create = small.model.create_entity
    materials = [create("IfcMaterial", one) for one in LIST]
    if kind == "list":
        some = create("IfcMaterialList", materials)
    else:
        parts = [
            create("IfcMaterialConstituent", one.Name, None, one, fraction)
            for one, fraction in zip(materials, fractions, strict=True)
        ]
        some = create("IfcMaterialConstituentSet", None, None, parts)
    walls["south"].Name = name
    create("IfcRelAssociatesMaterial", ifcopenshell.guid.new(), None, None, None, [walls["south"]], some)
    (space,) = _read(small, tmp_path).spaces
    face = next(f for f in space.faces if f.kind == "wall" and f.element == walls["south"].GlobalId)
    return [(one.name, round(one.thickness, 4)) for one in face.construction.layers]


@pytest.mark.parametrize(
    ("name", "kind", "fractions", "expected"),
    [
        ("Wall 102Bwk-183Ins-15P:285330", "list", (None,) * 3, (0.102, 0.183, 0.015)),
        ("Outer wall", "list", (None,) * 3, (0.1, 0.1, 0.1)),
        ("Outer wall 300", "set", (0.5, 0.4, 0.1), (0.15, 0.12, 0.03)),
    ],
)
def test_listed_materials_with_insulation_are_layers(tmp_path, name, kind, fractions, expected):
    layers = _with_list(tmp_path, name, kind, fractions)
    assert [one for one, _ in layers] == list(LIST)
    assert [d for _, d in layers] == pytest.approx(expected, abs=2e-4)


def test_a_beam_that_is_a_space_is_no_wrong_unit(tmp_path):
    """A space 0.1 m tall in a house of usual height: the file's unit is right."""
    small, _ = box_model(space=False)
    small.box("IfcSpace", "SHS beam", (0.0, 0.0, 2.5), (WIDTH, 0.1, 0.1))
    building = _read(small, tmp_path)
    assert not of_code(building, "length-unit-wrong")


@pytest.mark.parametrize(
    "latitude, longitude, said",
    [
        ((24, 28, 0), (54, 25, 0), ["Archicad"]),
        ((42, 21, 31), (-71, -3, -24), ["Revit"]),
        ((49, 6, 1), (8, 26, 11), []),
    ],
)
def test_the_default_site_of_an_exporter_is_named(latitude, longitude, said):
    site = SimpleNamespace(GlobalId="s", RefLatitude=latitude, RefLongitude=longitude, RefElevation=0.0)
    *_, issues = site_location(SimpleNamespace(by_type=lambda _: [site]))
    assert [issue.values["program"] for issue in issues] == said


def test_rooms_are_sorted_by_their_numbers():
    assert sorted(["10 Bad", "2 Flur", "1b", "1 Bad", "Flur"], key=natural_key) == [
        "1 Bad",
        "1b",
        "2 Flur",
        "10 Bad",
        "Flur",
    ]
