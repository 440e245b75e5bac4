"""Glass that is before a room becomes that room's windows, or a problem says that it does not."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from bim.apertures import Aperture, Filling
from bim.ifc import building as reading
from bim.ifc.building import read_ifc
from bim.ifc.defects import DRAWN_TWICE
from bim.outdoors import SHUT_IN
from bim.planes import plane_through
from bim.rays import hemisphere, ray_mesh
from bim.report.issue import Phrase
from bim.rooms import Attachment, room_pieces, room_solid
from bim.solids import prism
from tests.bim.small_ifc import DEPTH, FRAME, GLASS_AREA, HEIGHT, OPENING, WIDTH, box_model
from tests.issues import of_code

RECESS = 0.15  # from the room's faces to the glass [m]
LOW_WINDOW = (1.0, 1.8, 1.2, 0.4)  # x, sill, width, height [m]
LEFT, SILL, RIGHT, TOP = 1.0, 0.75, 3.0, 2.25


def attached(guid: str, y: float, north: float, apart: float) -> Attachment:
    """Glass before a wall, its region in two halves [m] apart, as the faces of a bent wall give."""
    plane = plane_through(np.array([0.0, y, 0.0]), np.array([0.0, north, 0.0]))
    corners = [(LEFT, SILL), (RIGHT, SILL), (RIGHT, TOP), (LEFT, TOP)]
    low, near, high, far = plane.to_plane(np.array([(x, y, z) for x, z in corners]))[:, :2]
    up = np.array([0.0, apart])
    halves = shapely.polygons([[low, near, high]]), shapely.polygons([[low + up, high + up, far]])
    outline = shapely.Polygon([low, near, high, far])
    region = shapely.union_all(np.concatenate(halves)) if apart else outline
    filling = Filling(guid, guid, "IfcWindow", np.empty((0, 3, 3)), np.empty(0, dtype=bool))
    return Attachment(Aperture(filling, plane, outline, outline), "room", region, -RECESS, -RECESS)


def box(width: float, depth: float, height: float):
    """A room with its low corner in the origin."""
    floor = plane_through(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    outline = shapely.transform(
        shapely.box(0, 0, width, depth), lambda p: floor.to_plane(np.column_stack([p, np.zeros(len(p))]))[:, :2]
    )
    return room_solid("room", "room", prism(outline, floor, 0.0, height))


@pytest.mark.parametrize("apart", [0.0, 1e-16, 3e-16, 1e-12, 1e-8, 6e-7, 2e-6])
def test_glass_before_a_wall_that_is_bent_along_a_diagonal_is_all_there(apart):
    own = [attached("bent", -RECESS, -1.0, apart), attached("whole", DEPTH + RECESS, 1.0, 0.0)]
    pieces, _, _ = room_pieces(box(WIDTH, DEPTH, HEIGHT), own)
    for one in own:
        guid = one.aperture.filling.guid
        glass = [
            p.facet.polygon.area for p in pieces if p.role == "glass" and p.attachment.aperture.filling.guid == guid
        ]
        assert sum(glass) == pytest.approx((RIGHT - LEFT) * (TOP - SILL), rel=1e-4)


def test_glass_that_is_lost_in_the_cutting_is_said(tmp_path, monkeypatch):
    path = tmp_path / "model.ifc"
    box_model()[0].model.write(str(path))
    assert lost(path) == []
    finished = reading.faces_and_windows

    def without_windows(*given):
        faces, _, assumed = finished(*given)
        return faces, [], assumed

    monkeypatch.setattr(reading, "faces_and_windows", without_windows)
    (issue,) = lost(path)
    assert issue.effect.glass == pytest.approx(GLASS_AREA, rel=1e-6)
    assert (issue.values["element"], issue.values["room"]) == ("IfcWindow W1", "R1 Room")


def test_a_window_that_is_drawn_twice_has_lost_nothing(tmp_path):
    small, walls = box_model()
    small.window(walls["south"], name="W1 again")
    path = tmp_path / "model.ifc"
    small.model.write(str(path))
    building = read_ifc(path)
    assert sum(window.area for window in building.spaces[0].windows) == pytest.approx(GLASS_AREA)
    assert of_code(building, DRAWN_TWICE) and not of_code(building, "glass-lost")


def test_a_window_that_is_drawn_twice_sees_what_it_sees_alone(tmp_path):
    """The copy's pane lies in the very faces of the window's own: the room was dark."""
    seen = []
    for twice in (False, True):
        small, walls = box_model()
        if twice:
            small.window(walls["south"], name="W1 again")
        path = tmp_path / f"{twice}.ifc"
        small.model.write(str(path))
        building = read_ifc(path)
        (window,) = building.spaces[0].windows
        outdoors = [e.triangles for e in building.elements if e.guid != window.guid]
        directions = hemisphere(window.normal, 64)
        origins = np.tile(window.centre + 1e-4 * window.normal, (len(directions), 1))
        _, hit = ray_mesh(np.concatenate(outdoors)).first_hits(origins, directions, 100.0)
        seen.append(np.mean(hit < 0))
    assert seen[0] == seen[1] > 0.3


def test_a_wall_beyond_every_horizon_is_left_out(tmp_path):
    """A stray of the file: with it the building is a point in pictures and octrees."""
    small, _ = box_model()
    small.box("IfcWall", "stray", (1.7e6, 3e5, 0.0), (0.3, 3.0, 2.5))
    small.box("IfcWall", "beside", (4e3, 0.0, 0.0), (0.3, 3.0, 2.5))
    path = tmp_path / "model.ifc"
    small.model.write(str(path))
    building = read_ifc(path)
    names = {element.name for element in building.elements}
    assert "beside" in names and "stray" not in names
    (said,) = of_code(building, "element-far-away")
    assert said.values["element"] == "IfcWall stray"
    assert said.values["distance_km"] == pytest.approx(1726, abs=0.5)


@pytest.mark.parametrize("closed", [True, False])
def test_a_window_to_a_closed_porch_is_said(tmp_path, closed):
    """It looks out, and is used; what it gives is hardly daylight."""
    small, _ = box_model()
    for name, origin, size in (
        ("front", (-0.5, -3.0, 0.0), (WIDTH + 1.0, 0.2, HEIGHT)),
        ("left", (-0.5, -3.0, 0.0), (0.2, 3.0, HEIGHT)),
        ("right", (WIDTH + 0.3, -3.0, 0.0), (0.2, 3.0, HEIGHT)),
        ("floor", (-0.5, -3.0, -0.2), (WIDTH + 1.0, 3.0, 0.2)),
        ("roof", (-0.5, -3.0, HEIGHT), (WIDTH + 1.0, 3.0, 0.2)),
    )[: 5 if closed else 4]:
        small.box("IfcWall" if size[2] == HEIGHT else "IfcSlab", name, origin, size)
    path = tmp_path / "model.ifc"
    small.model.write(str(path))
    building = read_ifc(path)
    said = of_code(building, SHUT_IN)
    assert len(building.spaces[0].windows) == 1
    assert [issue.effect.glass for issue in said] == pytest.approx([GLASS_AREA] if closed else [])
    assert building.account.shut_in == pytest.approx(GLASS_AREA if closed else 0.0)


def test_glass_above_a_room_and_behind_a_screen_is_said(tmp_path):
    """Neither side of the part above the room lies in the open air."""
    low = 1.5  # the space ends here, under a ceiling
    small, _ = box_model(space_height=low)
    small.box("IfcCovering", "ceiling", (0.0, 0.0, low), (WIDTH, DEPTH, 0.05))
    small.box("IfcWall", "screen", (-3.0, -0.95, 0.5), (WIDTH + 6.0, 0.2, HEIGHT))
    path = tmp_path / "model.ifc"
    small.model.write(str(path))
    building = read_ifc(path)
    left = GLASS_AREA - sum(w.area for space in building.spaces for w in space.windows)
    assert left > 0.4 * GLASS_AREA
    assert building.account.glass_out == pytest.approx(GLASS_AREA, rel=1e-3)
    (issue,) = [p for p in building.issues if p.effect.glass > 0]
    assert issue.effect.glass == pytest.approx(left, rel=1e-3)
    assert issue.code in ("glass-above-room", "window-partly-without-room")


@pytest.mark.parametrize("clear", [False, True], ids=["nothing clear", "all clear"])
def test_a_low_window_with_a_deep_sill_looks_out_of_its_wall(clear, tmp_path):
    """Its sill shows more area than itself, and lies flat; Renga draws windows like this."""
    x, sill, width, height = LOW_WINDOW
    small, walls = box_model(window=False)
    window = small.window(walls["south"], glazed=False, place=LOW_WINDOW)
    look = small.style("look", 0.9, 0.8) if clear else small.style("plain", 0.7)
    boxes = [((x, -0.18, sill), (width, 0.06, height)), ((x, -0.5, sill), (width, 0.7, 0.02))]
    small.show(window, [(*box, look) for box in boxes])
    path = tmp_path / "model.ifc"
    small.model.write(str(path))
    building = read_ifc(path)
    (found,) = building.spaces[0].windows
    assert found.area == pytest.approx(width * height * (1.0 if clear else 0.7), rel=0.02)
    assert found.normal == pytest.approx([0.0, -1.0, 0.0], abs=1e-6)
    assert building.account.glass_out == pytest.approx(found.area, rel=1e-4)


@pytest.mark.parametrize("hosted", [True, False])
def test_a_drawn_frame_without_a_pane_leaves_its_glass_free(hosted, tmp_path):
    x, sill, width, height = OPENING
    small, walls = box_model(window=False)
    window = small.window(walls["south"], hosted=hosted)
    if not hosted:
        small.opening(walls["south"], OPENING)
    inner, look = width - 2 * FRAME, small.style("plain", 0.7)
    sides = [((left, -0.18, sill), (FRAME, 0.06, height)) for left in (x, x + width - FRAME)]
    ends = [((x + FRAME, -0.18, low), (inner, 0.06, FRAME)) for low in (sill, sill + height - FRAME)]
    small.show(window, [(*box, look) for box in (*sides, *ends)])
    path = tmp_path / "model.ifc"
    small.model.write(str(path))
    building = read_ifc(path)
    assert sum(w.area for w in building.spaces[0].windows) == pytest.approx(GLASS_AREA, rel=1e-3)
    (said,) = of_code(building, "window-without-glass")
    assert said.values["source"] == Phrase("free-of-frame")


@pytest.mark.parametrize("frame_first", [True, False])
@pytest.mark.parametrize("glazed", [True, False])
def test_a_frame_drawn_for_itself_around_a_window_is_no_second_one(frame_first, glazed, tmp_path):
    """As a school by DDS has them: the frame one IfcWindow, what stands in it another."""
    small, walls = box_model(window=False)
    if not frame_first:
        small.window(walls["south"], glazed=glazed)
    frame = small.window(walls["south"], hosted=False, name="frame")
    if frame_first:
        small.window(walls["south"], glazed=glazed)
    x, sill, width, height = OPENING
    look, thin = small.style("plain", 0.7), 0.02
    outer = [((left, -0.2, sill), (thin, 0.1, height)) for left in (x, x + width - thin)]
    outer += [((x, -0.2, low), (width, 0.1, thin)) for low in (sill, sill + height - thin)]
    small.show(frame, [(*box, look) for box in outer])
    path = tmp_path / "model.ifc"
    small.model.write(str(path))
    building = read_ifc(path)
    expected = GLASS_AREA if glazed else 0.7 * width * height
    assert sum(w.area for w in building.spaces[0].windows) == pytest.approx(expected, rel=2e-3)
    assert building.account.glass_out == pytest.approx(expected, rel=2e-3)
    assert len(of_code(building, "frame-of-window")) == 1


def lost(path) -> list:
    """What is said of glass that became no window."""
    return of_code(read_ifc(path), "glass-lost")
