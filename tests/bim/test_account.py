"""What of a model came through: the verdict's rules, phantom glass, lost openings and storeys."""

from __future__ import annotations

import zipfile

import ifcopenshell.api.feature
import ifcopenshell.api.root
import ifcopenshell.util.schema
import pytest
from click.testing import CliRunner

from bim.account import CARE, NOT_USABLE, USABLE, Account, StoreyAccount
from bim.defaults import FRAME_FRACTION
from bim.ifc.building import read_ifc
from bim.report.issue import Effect, Issue, Phrase
from bim.report.ranking import ranked
from scenes.commands.ifc import command
from tests.bim.small_ifc import DEPTH, GLASS_AREA, HEIGHT, OPENING, WALL, WIDTH, add_material, box_model, box_room
from tests.issues import of_code


def read(tmp_path, small_or_model):
    path = tmp_path / "model.ifc"
    getattr(small_or_model, "model", small_or_model).write(str(path))
    return read_ifc(path)


def account(**changed) -> Account:
    """An account without fault, but for what is changed."""
    storey = StoreyAccount("E0", 4, 4, 20.0, changed.pop("used", 20.0))
    sound = {
        "windows_out": 9,
        "windows_used": 9,
        "glass_assumed": 0.0,
        "glass_low": 0.0,
        "glass_missing": 0.0,
        "phantom": 0.0,
        "closed": 0.0,
    }
    return Account((storey,), **(sound | changed))


@pytest.mark.parametrize(
    ("changed", "verdict", "words"),
    [
        ({}, USABLE, ""),
        ({"used": 19.6}, USABLE, ""),
        ({"used": 19.5}, CARE, "98 % of the exterior glass is used"),
        ({"used": 9.9}, NOT_USABLE, "only 50 % of the exterior glass is used"),
        ({"glass_assumed": 2.1}, CARE, "2.1 m2 of glass assumed"),
        ({"phantom": 0.3}, CARE, "0.3 m2 transparent but no glass"),
        ({"closed": 0.3}, CARE, "0.3 m2 of openings without a window closed"),
        ({"shut_in": 0.3}, CARE, "0.3 m2 of glass without sky or ground in view"),
        ({"overlapping": ("A and B",)}, CARE, "pairs of overlapping spaces: 1"),
        ({"leaking": ("A",)}, CARE, "rooms with open edges: 1"),
        ({"from_geometry": True}, CARE, "rooms found from geometry"),
        ({"cut_off": True}, NOT_USABLE, "THE FILE IS CUT OFF"),
    ],
)
def test_verdict_follows_its_rules(changed, verdict, words):
    found = account(**changed)
    assert found.verdict == verdict
    assert words in " ".join(found.reasons) and words in found.lines[0]


def test_sound_room_is_usable_and_all_its_glass_used(tmp_path):
    found = read(tmp_path, box_room()).account
    assert (found.verdict, found.rooms, found.spaces) == (USABLE, 1, 1)
    used_and_out = (found.glass_used, found.glass_out)
    assert used_and_out == pytest.approx((GLASS_AREA, GLASS_AREA), rel=1e-4)
    assert "1 of 1 window)" in found.lines[2]


def test_a_file_without_rooms_claims_no_share_of_glass():
    account = Account((), 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert account.lines[1].startswith("Rooms read: none: the file has no spaces")
    assert account.lines[2] == "Glass: no exterior glass in a room"


# phantom glass -------------------------------------------------------------------------------


def roof_over(material: str, style: str, thickness: float = 0.2):
    """The box room with a transparent slab for a roof."""
    small, _ = box_model(roof=False)
    low = (-WALL, -WALL, HEIGHT)
    size = (WIDTH + 2 * WALL, DEPTH + 2 * WALL, thickness)
    slab = small.box("IfcSlab", "roof", low, size, small.style(style, 0.2, 0.6))
    if material:
        add_material(small.model, slab, material)
    return small


@pytest.mark.parametrize(
    ("material", "style", "thickness", "panes"),
    [
        ("Feste Schraffur", "Farbe, rot-transparent", 0.2, 0),
        ("Béton armé", "display", 0.02, 0),
        ("", "display", 0.2, 0),
        ("", "display", 0.02, 1),
        ("Glaswolle", "display", 0.2, 0),
        ("Verre feuilleté", "display", 0.2, 1),
        ("合わせガラス", "display", 0.2, 1),
        ("", "Polycarbonate", 0.2, 1),
    ],
)
def test_transparent_roof_is_glass_by_its_names_or_as_thin_as_a_pane(tmp_path, material, style, thickness, panes):
    building = read(tmp_path, roof_over(material, style, thickness))
    up = [window for window in building.windows if window.normal[2] > 0.9]
    assert len(up) == panes
    assert (building.account.phantom > 0) == (panes == 0)
    named = of_code(building, "transparent-taken-as-opaque")
    assert [p.where for p in named] == ([] if panes else [named[0].where])


@pytest.mark.parametrize("on", ["wall", "pane", ""])
def test_a_clear_sheet_on_a_wall_or_a_pane_is_no_window(tmp_path, on):
    """A banner on the north wall, a film on the glass of the south window; a pane in an opening."""
    small, _ = box_model()
    clear = small.style("Transparent", 0.5, 0.5)
    glass = read(tmp_path, small).account.glass_used
    if on == "pane":  # the window's glass is 20 mm thick about the middle of the wall
        small.box("IfcBuildingElementProxy", "film", (1.3, -0.17, 1.0), (0.9, 0.023, 1.0), clear)
    elif on == "wall":
        small.box("IfcBuildingElementProxy", "banner", (1.0, DEPTH - 0.023, 1.0), (1.0, 0.023, 1.0), clear)
    else:
        opening = small.box("IfcOpeningElement", "hole", (1.0, DEPTH - 0.1, 1.0), (1.0, 0.5, 1.0))
        (wall,) = (w for w in small.model.by_type("IfcWall") if w.Name == "north")
        ifcopenshell.api.feature.add_feature(small.model, feature=opening, element=wall)
        small.box("IfcBuildingElementProxy", "pane", (1.0, DEPTH + 0.1, 1.0), (1.0, 0.023, 1.0), clear)
    building = read(tmp_path, small)
    assert building.account.glass_used == pytest.approx(glass + (not on) * 1.0, abs=0.01)
    said = [i for i in building.issues if i.values.get("reason") == Phrase("on-another-body")]
    assert len(said) == bool(on)
    assert (building.account.phantom > 0) == bool(on)


@pytest.mark.parametrize("width", [0.05, 0.5])
def test_a_clear_bar_of_a_frame_is_no_window(tmp_path, width):
    """Beside the panes in a hole of the north wall: one bar of the panes' own style."""
    small, _ = box_model()
    own = read(tmp_path, small).account.glass_used
    clear = small.style("Cristal", 0.9, 0.75)
    opening = small.box("IfcOpeningElement", "hole", (1.0, DEPTH - 0.1, 1.0), (1.0, 0.5, 1.0))
    (wall,) = (w for w in small.model.by_type("IfcWall") if w.Name == "north")
    ifcopenshell.api.feature.add_feature(small.model, feature=opening, element=wall)
    small.box("IfcMember", "mullion", (1.0, DEPTH + 0.1, 1.0), (width, 0.1, 1.0), clear)
    small.box("IfcPlate", "pane", (1.0 + width, DEPTH + 0.1, 1.0), (1.0 - width, 0.02, 1.0), clear)
    building = read(tmp_path, small)
    glass = own + 1.0 - (width < 0.2) * width
    assert building.account.glass_used == pytest.approx(glass, abs=0.01)
    assert any(i.values.get("reason") == Phrase("bar") for i in building.issues) == (width < 0.2)


def test_a_window_drawn_twice_is_counted_once(tmp_path):
    small, _ = box_model()
    once = read(tmp_path, small).account
    (window,) = small.model.by_type("IfcWindow")
    ifcopenshell.api.root.copy_class(small.model, product=window)
    copy = small.model.by_type("IfcWindow")[-1]
    assert copy != window
    copy.Representation, copy.ObjectPlacement = window.Representation, window.ObjectPlacement
    building = read(tmp_path, small)
    assert of_code(building, "element-drawn-twice")
    assert building.account.glass_out == pytest.approx(once.glass_out)
    assert building.account.share_used == pytest.approx(1.0)
    assert building.account.windows_out == 1


def two_rooms(name: str, material: str, *, floor: bool = False):
    """The room as two spaces with a transparent wall, or floor, between them or below."""
    small, _ = box_model(space=False)
    half = DEPTH / 2
    small.box("IfcSpace", "A", (0.0, 0.0, 0.0), (WIDTH, half, HEIGHT))
    small.box("IfcSpace", "B", (0.0, half + 0.1, 0.0), (WIDTH, half - 0.1, HEIGHT))
    low, size = (0.0, half, 0.0), (WIDTH, 0.1, HEIGHT)
    if floor:
        low, size = (0.0, 0.0, -0.05), (WIDTH, DEPTH, 0.05)
    wall = small.box("IfcSlab" if floor else "IfcWall", name, low, size, small.style("clear", 0.9, 0.9))
    add_material(small.model, wall, material)
    return small


@pytest.mark.parametrize(("name", "material"), [("W", "Surfaces d'air"), ("Contact direct", "x")])
def test_line_between_rooms_is_no_window_and_no_wall(tmp_path, name, material):
    building = read(tmp_path, two_rooms(name, material))
    assert len(building.windows) == 1
    assert not any(element.name == name for element in building.elements)
    assert any(i.values.get("reason") == Phrase("air") for i in building.issues)


def test_glass_floor_that_faces_down_is_never_a_window(tmp_path):
    building = read(tmp_path, two_rooms("floor", "Glass", floor=True))
    assert all(window.normal[2] > -0.5 for window in building.windows)


# lost openings, storeys, ends ------------------------------------------------------------------


def with_opening(place, name: str = "opening", **changed):
    """The box room whose south wall has an opening that nothing fills, and no window."""
    small, walls = box_model(window=False, **changed)
    small.opening(walls["south"], place, name)
    return small


@pytest.mark.parametrize(
    ("place", "name", "glazed"),
    [
        (OPENING, "opening", True),
        ((0.5, 0.0, 0.9, 2.1), "opening", False),
        ((0.5, 0.0, 2.5, 2.1), "opening", True),
        (OPENING, "Tür-020", False),
    ],
    ids=["window", "door", "wide", "named"],
)
def test_opening_that_nothing_fills_is_glazed_or_a_door(tmp_path, place, name, glazed):
    building = read(tmp_path, with_opening(place, name))
    area = (1 - FRAME_FRACTION) * place[2] * place[3]
    found = building.account
    expected = area if glazed else 0.0
    assert sum(w.area for w in building.windows) == pytest.approx(expected, rel=1e-3)
    assert found.glass_assumed == pytest.approx(expected, rel=1e-3)
    assert found.closed == pytest.approx(area - expected, rel=1e-3, abs=1e-6)
    (said,) = (i for i in building.issues if i.code in ("opening-closed", "opening-glazed"))
    assert said.effect.glass == pytest.approx(area, rel=1e-3) and found.verdict == CARE


def test_niche_and_filled_opening_are_no_windows(tmp_path):
    small, walls = box_model(hosted=False)
    small.opening(walls["south"], OPENING)  # that of W1, which no relation ties to it
    small.opening(walls["west"], (-WALL, 2.0, 1.0), size=(0.1, 1.0, 1.0), axes=True)
    building = read(tmp_path, small)
    assert [window.area for window in building.windows] == [pytest.approx(GLASS_AREA, rel=1e-4)]


def test_storey_without_spaces_and_window_above_a_low_room_are_named(tmp_path):
    low = read(tmp_path, box_model(space_height=2.0)[0])
    assert low.account.low == ("R1 Room",) and low.account.verdict == CARE
    assert low.account.glass_low + low.account.glass_used == pytest.approx(GLASS_AREA, rel=1e-3)
    assert of_code(low, "glass-above-room")

    small, _ = box_model(upper=True)
    building = read(tmp_path, small)
    assert building.account.share_used == pytest.approx(0.5, rel=1e-3)
    assert building.account.glass_missing == pytest.approx(GLASS_AREA, rel=1e-3)
    assert "3.6 m2 of the unused glass in storey attic, which has no rooms" in building.account.lines[2]


@pytest.mark.parametrize("suffix", ["ifc", "ifczip"])
def test_file_cut_at_its_end_is_not_usable_in_the_first_line(tmp_path, suffix):
    whole, path = tmp_path / "whole.ifc", tmp_path / f"model.{suffix}"
    box_room().write(str(whole))
    lines = whole.read_text().splitlines(keepends=True)
    cut = "".join(lines[:-3])
    if suffix == "ifc":
        path.write_text(cut)
    else:
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("model.ifc", cut)
    result = CliRunner().invoke(command, ["check", str(path)], catch_exceptions=False)
    head = result.stdout.splitlines()[0]
    assert head.startswith("Model: not usable: THE FILE IS CUT OFF")


# ranking -----------------------------------------------------------------------------------------


def test_issues_by_their_glass_and_alike_ones_once():
    small = [Issue("body-not-closed", str(i), {"element": f"wall {i}"}) for i in range(19)]
    big = Issue("window-without-room", "W", {"element": "IfcWindow W"}, Effect("window", 3.0))
    room = Issue("room-not-closed", "R", {"room": "R", "reason": "open"}, Effect("room"))
    first, second, third = ranked([*small, big, room])
    assert (first.first, first.count, first.glass) == (big, 1, 3.0)
    assert second.first is room
    assert third.count == 19 and third.text().what == "19 times: wall 0: its body is not a closed solid"


def roof_opening(beside: str):
    """The room with an opening in its roof, and what stands in it, above it or around it."""
    small, _ = box_model()
    roof = next(slab for slab in small.model.by_type("IfcSlab") if slab.Name == "roof")
    low, size = (1.0, 3.0, HEIGHT - 0.05), (1.2, 2.4, 0.3)
    name = "Schacht 2" if beside == "name" else "opening"
    small.opening(roof, low, name, size=size, axes=True)
    around = {
        "stair": [("IfcStairFlight", (1.0, 3.0, 0.0), (1.2, 0.8, HEIGHT))],
        "canopy": [("IfcSlab", (-1.0, -1.0, 2 * HEIGHT), (6.0, 8.0, 0.2))],
        "shaft": [
            ("IfcWall", (x, y, HEIGHT + 0.2), (2 * dx + 0.2, 2 * dy + 0.2, 2.5))
            for x, y, dx, dy in ((0.7, 2.8, 0, 1.3), (2.3, 2.8, 0, 1.3), (0.7, 2.7, 0.8, 0), (0.7, 5.5, 0.8, 0))
        ],
        "kerb": [("IfcWall", (0.8, 2.8, HEIGHT + 0.2), (0.2, 2.8, 0.4))],
    }
    for ifc_class, corner, extent in around.get(beside, ()):
        small.box(ifc_class, beside, corner, extent)
    return small


@pytest.mark.parametrize(
    ("beside", "reason"),
    [
        ("nothing", ""),
        ("kerb", ""),
        ("name", "called-shaft"),
        ("stair", "stair-in-opening"),
        ("canopy", "no-sky-above"),
        ("shaft", "shaft-above"),
    ],
)
def test_an_opening_in_a_slab_is_a_rooflight_only_below_the_open_sky(tmp_path, beside, reason):
    building = read(tmp_path, roof_opening(beside))
    (issue,) = (i for i in building.issues if i.code in ("opening-closed", "opening-glazed"))
    rooflights = [window for window in building.windows if window.normal[2] > 0.9]
    if reason:
        assert issue.values["reason"].key == reason and not rooflights
    else:
        assert issue.code == "opening-glazed" and len(rooflights) == 1
    assert building.account.closed == 0.0


def test_parts_of_other_facilities_are_storeys(tmp_path):
    """IFC4X3 has bridges, roads and marine works beside buildings."""
    small, _ = box_model("IFC4X3")
    storey = small.model.by_type("IfcBuildingStorey")[0]
    part = ifcopenshell.util.schema.reassign_class(small.model, storey, "IfcBridgePart")
    facility = small.model.by_type("IfcBuilding")[0]
    ifcopenshell.util.schema.reassign_class(small.model, facility, "IfcBridge")
    part.Name = "control room"
    building = read(tmp_path, small)
    assert [space.storey for space in building.spaces] == ["control room"]
    assert [storey.name for storey in building.account.storeys] == ["control room"]
