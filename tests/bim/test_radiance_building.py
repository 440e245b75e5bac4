"""A Radiance scene as the building of a command: its room, windows, furniture and errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bim.building_file import ReadOptions, check_building_file, held_states, read_building_file
from bim.fenestration import PlainGlass
from bim.sensors import sensor_grid, view_point
from bim.shell import enclosed_volume
from mitsuba_cfs.bsdf.angular import glass_table
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.errors import DataError, RoomError
from mitsuba_cfs.trace.paths.scene import without_peaks
from scenes.demo import VENETIAN_BLIND
from scenes.fenestration.resolver import glazing_system, stated_values
from scenes.fenestration.systems import WindowOverrides

OFFICE = Path(__file__).parents[2] / "docs/tutorials/office.rad"
DESK = "\n!genbox plaster desk 1.6 0.8 0.04 | xform -t 1.2 2.6 0.78\n"
CUPBOARD = "!genbox plaster cupboard 1 0.5 2 | xform -t 0.2 5.4 0.01\n"
# a wall behind the west wall with 10 cm between them, open to the room by a slit of 1 cm
LINING = (
    "carpet polygon lining\n0\n0\n12  0.1 0.01 0  0.1 6 0  0.1 6 3  0.1 0.01 3\nvoid glass screen\n0\n0\n3 .9 .9 .9\n"
)


def read(folder: Path, text: str, *apertures: str):
    path = folder / "scene.rad"
    path.write_text(OFFICE.read_text() + text)
    return read_building_file(path, ReadOptions(apertures=apertures))


def names(parts) -> set[str]:
    return {part.name.partition(".")[0] for part in parts}


@pytest.fixture(scope="module")
def office(tmp_path_factory):
    return read(tmp_path_factory.mktemp("furnished"), DESK + CUPBOARD)


def test_the_room_is_what_the_windows_light(office):
    (room,) = office.spaces
    assert room.floor_area == pytest.approx(24) and room.floor_level == 0
    assert room.volume == pytest.approx(72)
    assert names(room.faces) == {"floor", "ceiling", "north", "south", "west", "east"}
    assert {face.kind for face in room.faces} == {"floor", "ceiling", "wall"}
    for face in room.faces:
        assert face.normal @ (face.triangles.mean(axis=(0, 1)) - [2, 3, 1.5]) > 0, face.name
    assert [face.name for face in room.faces if face.adjacency == "outside"] == ["south"]
    assert [window.normal.round(6).tolist() for window in room.windows] == [[0, -1, 0]]


def test_furniture_stands_in_the_room_and_the_street_outside(office):
    (room,) = office.spaces
    assert names(room.furniture) == {"desk", "cupboard"}
    assert {"house", "trunk", "ground", "south"} <= names(office.elements)
    assert not {"desk", "cupboard"} & names(office.elements)
    desk = np.concatenate([e.triangles for e in room.furniture if e.name.startswith("desk")])
    assert enclosed_volume(desk) == pytest.approx(1.6 * 0.8 * 0.04)  # normals out of the body
    points, _ = sensor_grid(room, 0.25, 0.8)
    on_desk = np.all((points[:, :2] > [1.2, 2.6]) & (points[:, :2] < [2.8, 3.4]), axis=1)
    in_cupboard = np.all((points[:, :2] > [0.2, 5.4]) & (points[:, :2] < [1.2, 5.9]), axis=1)
    assert len(points) > 150 and not on_desk.any() and not in_cupboard.any()
    eye, direction = view_point(room)
    assert eye == pytest.approx([2, 3, 1.2], abs=0.1) and direction[1] < -0.99  # a taller cupboard


def test_what_lies_in_a_cavity_does_not_bound_the_room(tmp_path):
    """Light gets there by a slit, so it stays in the light; the plan is that of the lining."""
    (room,) = read(tmp_path, LINING).spaces
    assert "west" not in names(room.faces) and "lining" in names(room.faces)
    assert "west" in names(room.furniture)
    points, _ = sensor_grid(room, 0.1, 0.8, 0.05)
    assert points[:, 0].min() > 0.1


LIGHT = WindowOverrides((), light_only=True)


def test_a_pane_passes_what_radiance_says(office):
    import bim

    table, name = office.windows[0].glass.table, office.windows[0].guid
    assert not held_states(office.windows, office.file).get(name)
    klems = glazing_system(stated_values({}, office.windows[0], OFFICE, LIGHT), "x.rad").visible
    scene = bim.read_radiance(OFFICE)
    passed, mirrored = bim.glass_shares(scene.of_modifiers(["glazing"])[0].material)
    angles = np.arccos(np.linspace(0, 1, len(passed)))
    assert table.transmitted(angles) == pytest.approx(passed, abs=1e-3)
    assert table.reflected("back", angles) == pytest.approx(mirrored, abs=1e-3)
    assert klems.direct_hemispherical(klems.transmission_front)[0] == pytest.approx(passed[-1], rel=0.01)


def test_windows_are_of_the_named_material(tmp_path):
    paper = "void plastic paper\n0\n0\n5 .8 .8 .8 0 0\n"
    with pytest.raises(DataError, match="no surface has it; there are carpet"):
        read(tmp_path, "", "pane")
    pane = "paper polygon sheet\n0\n0\n12  0.6 6 0.9  0.6 6 2.5  3.4 6 2.5  3.4 6 0.9\n"
    building = read(tmp_path, "\n" + paper + pane, "glazing")
    assert len(building.windows) == 1 and "sheet" in names(building.elements)
    without = OFFICE.read_text().replace("void glass glazing", "void plastic glazing")
    path = tmp_path / "solid.rad"
    path.write_text(without.replace("3 .87 .87 .87", "5 .87 .87 .87 0 0"))
    with pytest.raises(DataError, match="has no glass, fabric or BSDF: name the windows' material"):
        read_building_file(path)


def test_options_of_other_formats_are_refused(tmp_path):
    with pytest.raises(DataError, match="not for Radiance files"):
        read_building_file(OFFICE, ReadOptions(join=("A + B",)))
    with pytest.raises(DataError, match="not for IFC files"):
        read_building_file("house.ifc", ReadOptions(apertures=("glass",)))
    with pytest.raises(DataError, match="no such file"):
        check_building_file(tmp_path / "missing.rad")


def test_a_room_without_its_floor_names_the_surfaces_that_are_not_read(tmp_path):
    mixed = "\nvoid mixpict mixed\n7 plaster carpet grey a.hdr b.cal u v\n0\n0\n\nmixed polygon floor"
    path = tmp_path / "scene.rad"
    path.write_text(OFFICE.read_text().replace("\ncarpet polygon floor", mixed))
    with pytest.raises(RoomError, match=r"has no floor; .* 1 of type mixpict \(.*scene\.rad:\d+\)"):
        read_building_file(path)


TINTED = "\nvoid glass tinted\n0\n0\n3 .4 .4 .4\n"


def pane(name: str, y: float, x=(0.5, 3.5), z=(0.8, 2.6), material: str = "tinted") -> str:
    """A vertical pane parallel to the window of the office, which lies at y = 0."""
    corners = [(x[0], z[0]), (x[1], z[0]), (x[1], z[1]), (x[0], z[1])]
    numbers = "  ".join(f"{a} {y} {b}" for a, b in corners)
    return f"{material} polygon {name}\n0\n0\n12  {numbers}\n"


def issue_of(building, code: str):
    return [issue for issue in building.issues if issue.code == code]


@pytest.mark.parametrize(("end", "count"), [(2.4, 0), (2.3, 4)])
def test_panes_side_by_side_close_their_hole(tmp_path, end, count):
    """Corners of panes lie on the edges of the hole; a slot of 10 cm between them is reported."""
    whole = "12  0.6 0 0.9   3.4 0 0.9   3.4 0 2.5   0.6 0 2.5\n"
    scene = OFFICE.read_text()
    assert whole in scene
    steps = ((0.6, 1.5), (1.5, end), (2.4, 3.4))
    first, *others = (pane("p", 0.0, x, (0.9, 2.5), "glazing") for x in steps)
    path = tmp_path / "scene.rad"
    path.write_text(scene.replace(whole, first.splitlines()[-1] + "\n") + "".join(others))
    issues = issue_of(read_building_file(path), "room-with-open-edges")
    assert [issue.values["count"] for issue in issues] == [count] * (count > 0)


def test_panes_behind_each_other_are_one_glazing(tmp_path):
    """Closed form of two panes at normal incidence: t1 t2 / (1 - r1 r2)."""
    from mitsuba_cfs.gloss import pane_shares

    building = read(tmp_path, TINTED + pane("outer", -0.05))
    (window,) = building.windows
    (t1, r1), (t2, r2) = (map(float, pane_shares(1.0, 1.52, t)) for t in (0.4, 0.87))
    assert window.visible_transmittance == pytest.approx(t1 * t2 / (1 - r1 * r2), rel=1e-6)
    passed = [t for t, _ in window.glass.panes]
    assert passed == pytest.approx([0.4, 0.87])  # the outer one first
    assert not issue_of(building, "pane-before-window")


@pytest.mark.parametrize(
    ("text", "distance", "share"),
    [
        (pane("outer", -0.8, x=(0.5, 1.8)), 0.8, 43),  # too far for one glazing
        (pane("outer", -0.05, x=(0.5, 2.0)), 0.05, 50),  # in front of half of it
    ],
)
def test_a_pane_that_is_no_layer_of_the_window_is_reported(tmp_path, text, distance, share):
    building = read(tmp_path, TINTED + text)
    (window,) = building.windows
    assert len(window.glass.panes) == 1
    (issue,) = issue_of(building, "pane-before-window")
    assert issue.severity == "loss" and issue.effect.glass == pytest.approx(window.area)
    assert issue.values["distance"] == pytest.approx(distance)
    assert issue.values["share"] == pytest.approx(share, abs=2)
    assert issue.where.startswith(str(building.file)) and issue.where.rpartition(":")[2].isdigit()


def test_a_pane_without_a_room_behind_it_is_reported(tmp_path):
    """It was a window of the room; as a facade, which the user names, it mirrors."""
    text = TINTED + pane("opposite", -12.0, x=(-6.0, 10.0), z=(0.0, 9.0))
    building = read(tmp_path, text)
    assert len(building.windows) == 1
    (issue,) = issue_of(building, "clear-surface-left-out")
    assert issue.severity == "loss" and issue.values["area"].values["area"] == pytest.approx(144)
    options = ReadOptions(facade_panes=("tinted",))
    facade = read_building_file(building.file, options)
    (element,) = [one for one in facade.elements if one.name.startswith("opposite")]
    assert element.gloss is not None and not issue_of(facade, "clear-surface-left-out")


@pytest.mark.parametrize(
    ("material", "code"),
    [
        ("void BRTDfunc cloth\n10 0 0 0 .3 .3 .3 0 0 0 .\n0\n9 .1 .1 .1 .2 .2 .2 .3 .3 .3\n", "clear-surface-left-out"),
        ("void trans cloth\n0\n0\n7 .8 .8 .8 0 0 .6 .2\n", "trans-as-opaque"),
        ("void light cloth\n0\n0\n3 9 9 9\n", "light-source-dark"),
    ],
)
def test_materials_that_are_not_simulated_as_they_are_have_an_issue(tmp_path, material, code):
    sheet = pane("sheet", 3.0, material="cloth")
    (issue,) = issue_of(read(tmp_path, "\n" + material + sheet), code)
    assert issue.values["material"] == "cloth"
    assert issue.severity == ("unused" if code == "light-source-dark" else "loss")


FRIT = "void brightfunc frit\n2 if(mod(Pz*20,1)-.5,1,.1) .\n0\n0\n\n"


def test_a_pattern_on_glass_counts_by_its_mean(tmp_path):
    text = OFFICE.read_text().replace("void glass glazing", "frit glass glazing")
    path = tmp_path / "frit.rad"
    path.write_text(FRIT + text)
    building = read_building_file(path)
    (issue,) = issue_of(building, "glass-pattern-averaged")
    assert (issue.values["least"], issue.values["greatest"]) == (0.1, 1.0)
    (state,) = building.windows[0].states
    # half of the pane has a tenth of the transmittance and all of the reflectance (`rtrace`); 8,192
    # points
    bare = glass_table([(0.87, 1.52)])
    angular = state.angular
    assert angular.transmittance == pytest.approx(0.55 * bare.transmittance, rel=1e-3, abs=1e-6)
    assert angular.reflectance_front == pytest.approx(bare.reflectance_front, abs=1e-6)


def test_a_pattern_that_is_the_same_everywhere_is_computed_and_no_assumption(tmp_path):
    even = "void colorfunc even\n4 .5 .5 .5 .\n0\n0\n\n"
    text = OFFICE.read_text().replace("void glass glazing", "even glass glazing")
    path = tmp_path / "even.rad"
    path.write_text(even + text.replace("void plastic carpet", "even plastic carpet"))
    building = read_building_file(path)
    assert not [issue for issue in building.issues if "averaged" in issue.code]
    (state,) = building.windows[0].states
    bare = glass_table([(0.87, 1.52)])
    assert state.angular.transmittance == pytest.approx(0.5 * bare.transmittance, abs=1e-6)
    (room,) = building.spaces
    assert any(face.reflectance_visible == pytest.approx(0.5 * 0.25) for face in room.faces)


def test_a_pattern_on_glass_that_is_not_computed_is_refused(tmp_path):
    text = OFFICE.read_text().replace("void glass glazing", "frit glass glazing")
    path = tmp_path / "frit.rad"
    path.write_text(FRIT.replace("mod(Pz*20,1)", "noise3(Px,Py,Pz)") + text)
    with pytest.raises(DataError, match=r"frit\.rad:1: brightfunc frit: function noise3 is not"):
        read_building_file(path)


def test_a_pane_far_in_front_of_a_window_is_refused_unless_the_apertures_are_named(tmp_path):
    with pytest.raises(DataError, match=r"outer: is 0\.80 m in front of 100% of window window"):
        read(tmp_path, TINTED + pane("outer", -0.8))
    building = read(tmp_path, TINTED + pane("outer", -0.8), "glazing")
    (issue,) = issue_of(building, "pane-before-window")
    assert issue.severity == "loss"


def test_light_past_the_rim_of_an_outer_pane_meets_the_inner_one_alone(tmp_path):
    gap, rim, width, height = 0.1, 0.05, 2.8, 1.6
    outer = pane("outer", -gap, (0.6 - rim, 3.4 + rim), (0.9 - rim, 2.5 + rim))
    building = read(tmp_path, TINTED + outer)
    (window,) = building.windows
    (issue,) = issue_of(building, "glass-beside-panes")
    assert 1 < issue.values["share"] < 10
    phi = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    inner, both = (PlainGlass(panes).table for panes in (window.glass.panes[-1:], window.glass.panes))
    for polar in np.radians([0.0, 45.0, 60.0, 75.0]):
        over = [
            np.clip(gap * np.tan(polar) * np.abs(turn(phi)) - rim, 0, size) / size
            for turn, size in ((np.cos, width), (np.sin, height))
        ]
        past = np.mean(1 - (1 - over[0]) * (1 - over[1]))
        expected = past * inner.transmitted(polar) + (1 - past) * both.transmitted(polar)
        assert window.glass.table.transmitted(polar) == pytest.approx(expected, rel=0.02)


def test_light_past_a_pane_meets_the_fabric_behind_it_alone(tmp_path):
    scene = OFFICE.read_text().replace("void glass glazing", "void glass outer")
    scene = scene.replace("glazing polygon", "outer polygon")
    cloth = CLOTH.format(tau=".1", file=".") + pane("blind", 0.0, (0.6, 3.4), (0.9, 2.5), "cloth")
    covered = scene.replace("0 0.9", "-0.2 0.9").replace("0 2.5", "-0.2 2.5")
    path = tmp_path / "scene.rad"
    path.write_text(covered + cloth)
    (window,) = read_building_file(path).windows
    assert [len(window.states), window.glass] == [1, None]
    (state,) = window.states
    glass = glass_table([(0.87, 1.52)])
    for polar in np.radians([45.0, 75.0]):
        straight = state.angular.transmitted(polar)
        assert 0.1 * glass.transmitted(polar) * 1.01 < straight < 0.1


CLOTH = "void BRTDfunc cloth\n10 0 0 0 {tau} {tau} {tau} 0 0 0 {file}\n0\n9 .4 .4 .4 .1 .1 .1 .02 .02 .02\n"


def test_a_fabric_behind_a_pane_is_a_layer_of_the_window(tmp_path):
    (tmp_path / "weave.cal").write_text("{ a cosine } tau(t) = t*abs(Rdot); t0 : .5;\n")
    cloth = CLOTH.format(tau="tau(.2*t0)", file="./elsewhere/weave.cal")
    building = read(tmp_path, "\n" + cloth + pane("blind", 0.1, (0, 4), (0, 3), "cloth"))
    (wide,) = issue_of(building, "panes-before-wall")  # 4.48 m2 of panes before 12 m2 of fabric
    assert wide.values["share"] == pytest.approx(100 * (1 - 4.48 / 12), abs=2)
    assert wide.values["distance"] == pytest.approx(0.1)
    (window,) = building.windows
    assert window.name == "blind" and window.glass is None
    (state,) = window.states
    glass = glass_table([(0.87, 1.52)])
    theta = np.radians([0.0, 30.0, 60.0])
    straight = glass.transmitted(theta) * 0.1 * np.cos(theta)
    np.testing.assert_allclose(state.angular.transmitted(theta), straight, rtol=2e-3)
    omega = KLEMS_FULL.projected_solid_angles()
    scattered = without_peaks(state.bands["Visible"], "transmission").transmission_front
    # 0.02, and what comes back: 0.4 of the fabric, 0.15 of the pane, 0.087 of the fabric
    share = float(omega @ scattered[:, 0]) / float(glass.transmittance[0])
    assert 0.023 < share < 0.025
    (issue,) = issue_of(building, "function-file-elsewhere")
    assert issue.severity == "assumption"


def test_a_wide_fabric_exchanges_light_with_the_pane_that_it_faces(tmp_path):
    """The pane covers 2.8 x 1.6 m of 4 x 3 m of fabric, whose front of 0.4 is outdoors."""
    gap = 0.2
    cloth = CLOTH.format(tau="0", file=".") + pane("blind", gap, (0, 4), (0, 3), "cloth")
    (window,) = read(tmp_path, "\n" + cloth).windows
    bsdf = window.states[0].bands["Visible"].filled()
    x, z = ((np.arange(n) + 0.5) / 20 for n in (80, 60))
    polar, phi = np.radians(np.arange(0.5, 90)), 2 * np.pi * (np.arange(90) + 0.5) / 90
    met = []  # [polar, place]
    for angle in polar:
        covers = [
            (low < at[:, None] + gap * np.tan(angle) * turn(phi))
            & (at[:, None] + gap * np.tan(angle) * turn(phi) < high)
            for at, turn, low, high in ((x, np.cos, 0.6, 3.4), (z, np.sin, 0.9, 2.5))
        ]
        met.append(np.einsum("xp,zp->xz", *(c.astype(float) for c in covers)).ravel() / 90)
    lit = np.sin(2 * polar) @ met
    facing = np.array(met) @ lit / lit.sum()
    glass = glass_table([(0.87, 1.52)])
    mirrored = np.interp(polar, glass.theta, glass.reflectance_front)
    weight = np.sin(2 * polar) / np.sin(2 * polar).sum()
    passed = bsdf.direct_hemispherical(bsdf.transmission_front)[0]
    again = 1 / (1 - 0.4 * weight @ (mirrored * facing))
    assert passed == pytest.approx(glass.transmittance[0] * 0.02 * again, rel=2e-3)
    # the wall beside the window sees the fabric alone, no mirror image in the pane
    np.testing.assert_allclose(bsdf.reflection_front, 0.4 / np.pi, rtol=1e-9)
    assert not window.states[0].angular.reflectance_front.any()


def test_a_pane_drawn_as_a_box_is_two_panes(tmp_path):
    whole = OFFICE.read_text()
    start, end = whole.index("glazing polygon window"), whole.index("street polygon ground")
    path = tmp_path / "scene.rad"
    box = "!genbox glazing pane 2.8 0.006 1.6 | xform -t 0.6 0 0.9\n"
    path.write_text(whole[:start] + box + whole[end:])
    for apertures in ((), ("glazing",)):
        building = read_building_file(path, ReadOptions(apertures=apertures))
        (window,) = building.windows
        two = glass_table([(0.87, 1.52)] * 2).transmittance
        np.testing.assert_allclose(window.glass.table.transmittance, two, atol=1e-3)
        (issue,) = issue_of(building, "edges-of-panes")
        assert issue.values["count"] == 4


@pytest.mark.parametrize("turned", [False, True])
def test_shares_that_a_bsdf_adds_to_its_file(tmp_path, turned):
    """Radiance adds .3 where light meets the side that the normal leaves, .2 behind, .1 through."""
    corners = "0.6 0 0.9   3.4 0 0.9   3.4 0 2.5   0.6 0 2.5"
    back = "   ".join(corners.split("   ")[::-1])
    blocks = []
    for numbers in ("0", "9 .3 .3 .3 .2 .2 .2 .1 .1 .1"):
        text = OFFICE.read_text().replace(
            "void glass glazing\n0\n0\n3 .87 .87 .87", f"void BSDF glazing\n6 0 {VENETIAN_BLIND} 0 0 1 .\n0\n{numbers}"
        )
        path = tmp_path / "scene.rad"
        path.write_text(text.replace(f"12  {corners}", f"12  {back}") if turned else text)
        (window,) = read_building_file(path).windows
        blocks.append(window.states[0].bands["Visible"].filled())
    added = {
        name: np.pi * (getattr(blocks[1], name) - getattr(blocks[0], name))
        for name in ("reflection_front", "reflection_back", "transmission_front")
    }
    outdoors, indoors = (0.2, 0.3) if turned else (0.3, 0.2)
    for name, share in zip(added, (outdoors, indoors, 0.1), strict=True):
        np.testing.assert_allclose(added[name], share, atol=1e-9)


def test_the_thickness_of_a_bsdf_is_reported(tmp_path):
    for thickness in (0, 0.1):
        path = tmp_path / "scene.rad"
        path.write_text(
            OFFICE.read_text().replace(
                "void glass glazing\n0\n0\n3 .87 .87 .87",
                f"void BSDF glazing\n6 {thickness} {VENETIAN_BLIND} 0 0 1 .\n0\n0",
            )
        )
        issues = issue_of(read_building_file(path), "bsdf-thickness")
        assert [issue.values["thickness"] for issue in issues] == ([0.1] if thickness else [])


@pytest.mark.parametrize(
    ("strings", "told"),
    [
        ("10 0 0 0 0 0 0 .1 .1 .1 .", "functions of two directions"),
        ("10 0 0 0 Dx*Dx Dx*Dx Dx*Dx 0 0 0 .", "depends on the azimuth"),
        ("10 0 0 0 t t t 0 0 0 none.cal", "its function file none.cal is not there"),
        ("10 0 0 0 2 2 2 0 0 0 .", "a function is 2: expected 1"),
    ],
)
def test_a_fabric_that_is_not_computed_is_refused_with_its_line(tmp_path, strings, told):
    cloth = f"\nvoid BRTDfunc cloth\n{strings}\n0\n9 .1 .1 .1 .1 .1 .1 .02 .02 .02\n"
    with pytest.raises(DataError, match=f"scene.rad:.*BRTDfunc cloth: .*{told}"):
        read(tmp_path, cloth + pane("blind", 0.1, material="cloth"))


def test_a_translucent_panel_is_a_window(tmp_path):
    trans = "glazing\n0\n0\n7 .8 .8 .8 0 0 .6 .2\n"
    path = tmp_path / "panel.rad"
    glass = "void glass glazing\n0\n0\n3 .87 .87 .87\n"
    text = OFFICE.read_text().replace(glass, f"void trans {trans}")
    assert trans in text
    path.write_text(text)
    building = read_building_file(path)
    (window,) = building.windows
    (state,) = window.states
    assert state.angular.transmittance[0] == pytest.approx(0.8 * 0.6 * 0.2)
    block = state.bands["Visible"].transmission_front
    assert block[0, 100] == pytest.approx(0.8 * 0.6 * 0.8 / np.pi, rel=1e-6)
    assert not issue_of(building, "trans-as-opaque")


def test_a_rough_translucent_panel_scatters_its_beam_in_a_lobe(tmp_path):
    glass = "void glass glazing\n0\n0\n3 .87 .87 .87\n"
    path = tmp_path / "panel.rad"
    text = OFFICE.read_text()
    path.write_text(text.replace(glass, "void trans glazing\n0\n0\n7 .8 .8 .8 0 .1 .6 .2\n"))
    (window,) = read_building_file(path).windows
    bsdf = window.states[0].bands["Visible"]
    shares = bsdf.direct_hemispherical(bsdf.transmission_front)
    assert bsdf.see_through == 0 and shares[-1] == pytest.approx(0.8 * 0.6, rel=1e-3)
    lobe = 0.8 * 0.6 * 0.2 / (np.pi * 0.1**2)
    assert bsdf.transmission_front.values.max() > 0.9 * lobe
    path.write_text(text.replace(glass, "void trans glazing\n0\n0\n7 .8 .8 .8 0 .01 .6 .2\n"))
    with pytest.raises(DataError, match=r"panel.rad:\d+: .*lobe of roughness 0.01"):
        read_building_file(path)


def test_a_fabric_before_panes_in_a_frame_has_both_as_layers(tmp_path):
    bar = "\nplaster polygon bar\n0\n0\n12  1.8 0.02 0.9  2.2 0.02 0.9  2.2 0.02 2.5  1.8 0.02 2.5\n"
    coat = "\nvoid glass coat\n0\n0\n4 1 1 1 1.05\n"
    cloth = "\n" + CLOTH.format(tau="0.1", file=".")
    layers = "".join(pane(name, y, (0, 4), (0, 3), name) for name, y in (("coat", 0.08), ("cloth", 0.1)))
    building = read(tmp_path, bar + coat + cloth + layers)
    (window,) = building.windows
    straight = glass_table([(0.87, 1.52), (1.0, 1.05)]).transmittance[0] * 0.1
    assert window.states[0].angular.transmittance[0] == pytest.approx(straight, rel=2e-3)
    assert not issue_of(building, "pane-before-window")


@pytest.mark.parametrize(("left", "panes"), [(0.6, 1), (0.575, 2)])
def test_a_pane_beside_whose_fabric_light_passes_is_a_window_too(tmp_path, left, panes):
    """In a niche 9 cm deep: the 2.5 cm beside the fabric were left out."""
    niche = "!genbox plaster {} 0.1 0.09 1.6 | xform -t {} 0 0.9\n"
    sides = niche.format("left", left - 0.1) + niche.format("right", 3.4)
    sides += "!genbox plaster sill 2.9 0.09 0.1 | xform -t 0.5 0 0.8\n"
    sides += "!genbox plaster head 2.9 0.09 0.1 | xform -t 0.5 0 2.5\n"
    cloth = "\n" + CLOTH.format(tau="0.05", file=".")
    blind = pane("blind", 0.08, (0.6, 3.4), (0.9, 2.5), material="cloth")
    wide = OFFICE.read_text().replace("    0.6 0 0.9", f"    {left} 0 0.9")
    path = tmp_path / "scene.rad"
    path.write_text(wide.replace("12  0.6 0 0.9", f"12  {left} 0 0.9") + cloth + sides + blind)
    building = read_building_file(path)
    assert len(building.windows) == panes
    assert sum(window.area for window in building.windows) == pytest.approx(2.8 * 1.6 + (0.6 - left) * 1.6, abs=0.04)
    fronts = [part for part in building.spaces[0].furniture if part.name == "blind"]
    assert len(fronts) == panes - 1
    for front in fronts:  # the cloth's outdoor side, lit by the panes
        assert front.reflectance_visible == pytest.approx(0.4, abs=1e-3)
        assert 0 < 0.08 - front.triangles[..., 1].max() < 0.001


def test_a_coordinate_that_is_too_small_is_zero_and_its_hole_reported(tmp_path):
    """1e-320 m, which has three digits left, and 0 m give the same room."""
    west = "12  0 0 0   0 6 0   0 6 3   0 0 3"
    text, path = OFFICE.read_text(), tmp_path / "scene.rad"
    assert text.count(west) == 1
    rooms = []
    for number in ("1e-320", "0"):
        path.write_text(text.replace(west, f"12  0 0 0   0 {number} 0   0 6 3   0 0 3"))
        building = read_building_file(path, ReadOptions())
        assert issue_of(building, "room-with-open-edges")
        rooms.append(np.concatenate([face.triangles for face in building.spaces[0].faces]))
    np.testing.assert_array_equal(*rooms)
