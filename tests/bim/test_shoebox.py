"""The parametric room: closed, wound outwards, glass where it was asked for."""

from __future__ import annotations

import numpy as np
import pytest

from bim.shell import enclosed_volume, open_edges
from bim.shoebox import WindowRectangle, shoebox
from bim.to_tracer import exterior_surfaces, interior_surfaces, window_groups

MANY = (
    WindowRectangle(0.5, 0.9, 1.0, 1.5, frame=0.06),
    WindowRectangle(2.0, 0.9, 1.0, 1.5, frame=0.06),
    WindowRectangle(1.0, 1.0, 1.2, 1.0, "left"),
    WindowRectangle(1.0, 1.0, 1.0, 2.0, "ceiling"),
    WindowRectangle(1.0, 0.0, 1.0, 2.0, "back"),  # down to the floor: its sill meets the floor
)


@pytest.mark.parametrize("recess", [0.0, 0.25])
def test_shell_is_closed_and_holds_the_volume(recess):
    space = shoebox(4, 6, 3, windows=MANY, recess=recess, facing_deg=33.0).spaces[0]
    openings = 2 * 1.5 + 1.2 + 2.0 + 2.0
    assert open_edges(space.shell) == 0
    # closed form; the tolerance is double precision on a sum of some hundred triangles
    assert enclosed_volume(space.shell) == pytest.approx(72 + recess * openings, rel=1e-9)
    assert space.volume == pytest.approx(enclosed_volume(space.shell), rel=1e-9)


def test_a_shell_without_one_face_is_seen_as_open():
    space = shoebox(windows=MANY, recess=0.1).spaces[0]
    faces = [face.triangles for face in space.faces[1:]] + [w.triangles for w in space.windows]
    assert open_edges(np.concatenate(faces)) > 0


@pytest.mark.parametrize(
    ("facing_deg", "normal"), [(180, (0, -1, 0)), (90, (1, 0, 0)), (0, (0, 1, 0)), (225, (-(0.5**0.5), -(0.5**0.5), 0))]
)
def test_front_window_faces_the_azimuth(facing_deg, normal):
    window = shoebox(facing_deg=facing_deg).windows[0]
    np.testing.assert_allclose(window.normal, normal, atol=1e-12)


def test_x_runs_to_the_right_seen_from_outdoors():
    left = WindowRectangle(0.2, 1, 0.5, 1)
    window = shoebox(4, 6, 3, windows=(left,), facing_deg=180).windows[0]
    np.testing.assert_allclose(window.centre, [0.45, 0.0, 1.5], atol=1e-12)


def test_windows_are_named_or_numbered():
    named, other = WindowRectangle(0.2, 1, 0.5, 1, name="S"), WindowRectangle(2.0, 1, 0.5, 1)
    assert [window.name for window in shoebox(windows=(named, other)).windows] == ["S", "window 2"]


def test_areas_of_glass_frame_and_wall():
    space = shoebox(4, 6, 3, windows=MANY, recess=0.2).spaces[0]
    glass = 0.88 * 1.38
    assert space.windows[0].area == pytest.approx(glass)
    assert space.windows[0].frame_area == pytest.approx(1.5 - glass)
    front = next(face for face in space.faces if face.name == "front")
    assert front.area == pytest.approx(12 - 3)
    groups = window_groups(space)
    assert [group.name for group in groups] == ["S", "roof", "N", "W"]
    assert sum(group.area for group in groups) == pytest.approx(2 * glass + 1.2 + 2 + 2)


def test_surfaces_for_the_tracer_keep_the_order_of_faces():
    space = shoebox(reflectance={"floor": 0.3, "front": 0.1}, reflectance_solar={"wall": 0.4})
    space, building = space.spaces[0], space
    visible, solar = interior_surfaces(space), interior_surfaces(space, "solar")
    assert visible.names == tuple(face.name for face in space.faces)
    areas = np.bincount(visible.surface, visible.areas)
    np.testing.assert_allclose(areas, [face.area for face in space.faces])
    by_name = dict(zip(np.array(visible.names)[visible.surface], visible.reflectance, strict=True))
    assert by_name["floor"] == 0.3 and by_name["front"] == 0.1 and by_name["ceiling"] == 0.7
    by_name = dict(zip(np.array(solar.names)[solar.surface], solar.reflectance, strict=True))
    assert by_name["left"] == 0.4 and by_name["floor"] == 0.3
    assert len(exterior_surfaces(building, space).triangles) == 0


@pytest.mark.parametrize(
    "window",
    [WindowRectangle(3.5, 1, 1, 1), WindowRectangle(0.5, 1, 1, 1, "floor"), WindowRectangle(0.5, 1, 1, 1, frame=0.5)],
)
def test_impossible_windows_are_refused(window):
    with pytest.raises(ValueError, match="window"):
        shoebox(4, 6, 3, windows=(window,))


def test_overlapping_windows_are_refused():
    with pytest.raises(ValueError, match="overlaps"):
        shoebox(windows=(WindowRectangle(0.5, 1, 1, 1), WindowRectangle(1, 1, 1, 1)))
