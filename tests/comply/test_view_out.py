"""View out against closed forms: sight angle to 0.1 degree, distance to 1 cm, layers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bim.shoebox import WindowRectangle, shoebox
from scenes.comply.outdoors import outdoors_of
from scenes.comply.view_out import _united_angle, view_out
from tests.comply.obstructions import facing_wall, wall

WINDOW = WindowRectangle(0.5, 0.9, 3.0, 1.8)


def seen(building, **more):
    return view_out(building.spaces[0], outdoors_of(building), **more)


def angle(points, left, right, y=0.0):
    """Degrees in plan between the edges of an opening in a facade at y, from points [S]."""
    a, b = (np.arctan2(x - points[:, 0], points[:, 1] - y) for x in (left, right))
    return np.degrees(b - a)


def test_sight_angle_of_flush_glass():
    view = seen(shoebox(windows=[WINDOW]))
    assert len(view.points) == 60
    np.testing.assert_allclose(view.sight_angle_deg, angle(view.points, 0.5, 3.5), atol=0.1)


def test_sight_angle_behind_a_wall():
    """From aside the nearer corner of the reveals, at the inner surface, hides glass behind it."""
    view = seen(shoebox(windows=[WindowRectangle(1.5, 0.9, 1.0, 1.8)], recess=0.4))
    x, y = view.points[:, 0], view.points[:, 1]
    # each edge: the reveal's inner or outer corner, whichever hides more
    right = np.minimum(np.arctan2(2.5 - x, y), np.arctan2(2.5 - x, y + 0.4))
    left = np.maximum(np.arctan2(1.5 - x, y), np.arctan2(1.5 - x, y + 0.4))
    wanted = np.degrees(np.maximum(right - left, 0.0))
    assert wanted.min() < 10 < wanted.max()
    np.testing.assert_allclose(view.sight_angle_deg, wanted, atol=0.1)


def test_sight_angles_of_openings_add_where_they_are_apart():
    """Two side by side add; one above the other is the same width in plan."""
    two = [WindowRectangle(0.25, 1, 1.5, 1), WindowRectangle(2.25, 1, 1.5, 1)]
    view = seen(shoebox(windows=two))
    wanted = angle(view.points, 0.25, 1.75) + angle(view.points, 2.25, 3.75)
    np.testing.assert_allclose(view.sight_angle_deg, wanted, atol=0.1)
    stacked = [WindowRectangle(0.5, 0.5, 3, 0.5), WindowRectangle(0.5, 1.5, 3, 1.0)]
    view = seen(shoebox(windows=stacked))
    np.testing.assert_allclose(view.sight_angle_deg, angle(view.points, 0.5, 3.5), atol=0.1)


def test_sight_angle_in_a_corner_room_across_north():
    """Openings in two facades: a union over the azimuths, also over the end of the circle."""
    sides = [WINDOW, WindowRectangle(1.0, 0.9, 2.0, 1.8, side="right")]
    views = [seen(shoebox(windows=sides, facing_deg=f)) for f in (180, 90, 3)]
    whole = [np.sort(view.sight_angle_deg) for view in views]  # the rows run otherwise
    np.testing.assert_allclose(whole[1], whole[0], atol=0.05)
    np.testing.assert_allclose(whole[2], whole[0], atol=0.05)


def test_angle_of_overlapping_intervals():
    parts = np.array([[6.0, 6.5, 1.0], [0.1, 0.3, 1.0], [-0.2, 0.0, 1.0]])
    low, high = 6.0, 2 * np.pi + 0.3
    assert _united_angle(parts) == pytest.approx(high - low, abs=1e-12)


@pytest.mark.parametrize("recess", [0.0, 0.35])
def test_distance_is_that_along_the_normal_from_the_inner_wall(recess):
    """A wall 17.43 m before the inner surface, for every eye and whatever the azimuth."""
    view = seen(shoebox(windows=[WINDOW], recess=recess, elements=[facing_wall(17.43, 30.0)]))
    np.testing.assert_allclose(view.distance, 17.43, atol=0.01)


def test_distance_over_a_low_wall_is_open():
    """Seated one looks against a wall of 1.5 m, standing over it."""
    building = shoebox(windows=[WINDOW], elements=[facing_wall(9.0, 1.5)])
    np.testing.assert_allclose(seen(building).distance, 9.0, atol=0.01)
    assert np.isinf(seen(building, eye_height=1.7).distance).all()


def test_median_of_the_distance():
    """What hides less than half of the sight angle does not count; more than half does."""
    narrow = shoebox(2.0, 6.0, windows=[WindowRectangle(0.5, 0.9, 1.0, 1.8)])
    for share, wanted in ((0.2, np.inf), (0.8, 10.0)):
        # from the middle line, far back, the wall's edge hides about that share
        edge = 1.0 + (share - 0.5) * 2.5
        half = wall((-90, -10, -9), (edge, -10, -9), (edge, -10, 9), (-90, -10, 9))
        view = seen(replace(narrow, elements=(half,)), spacing=1.0)
        eye = np.argmax(view.points[:, 1])
        assert view.points[eye, 0] == pytest.approx(1.0)
        assert view.distance[eye] == pytest.approx(wanted, abs=0.01)


def test_layers_of_an_open_site():
    """Floor to ceiling: all three; a high window: sky alone, so none counts."""
    tall = seen(shoebox(windows=[WindowRectangle(0.5, 0.0, 3.0, 2.9)]))
    assert (tall.layer_count == 3).all()
    high = seen(shoebox(windows=[WindowRectangle(0.5, 2.2, 3.0, 0.7)]))
    assert high.layers[:, 1].all() and not high.layers[:, [0, 2]].any()
    assert (high.layer_count == 0).all()


def test_ground_is_seen_where_the_sill_lets_the_view_fall():
    """Below the horizon by over 5 degrees: (1.2 - sill)/y > tan 5 deg."""
    view = seen(shoebox(4.0, 9.0, windows=[WindowRectangle(0.0, 0.8, 4.0, 1.5)]))
    y = view.points[:, 1]
    # the nearest point of the sill is straight ahead of every eye, or nearly
    steep = np.degrees(np.arctan2(0.4, y))
    sure = np.abs(steep - 5.0) > 0.3
    assert sure.sum() > 0.8 * len(y) and {True, False} == set((steep > 5.0)[sure].tolist())
    np.testing.assert_array_equal(view.layers[sure, 2], (steep > 5.0)[sure])


def test_a_high_wall_opposite_takes_the_sky():
    """The wall itself is landscape from 6 m on; nearer it is an obstruction."""
    for distance, wanted in ((20.0, [True, False, True]), (4.0, [False, False, False])):
        opposite = facing_wall(distance, 400.0)
        building = shoebox(windows=[WindowRectangle(0.5, 0.0, 3.0, 2.9)], elements=[opposite])
        view = seen(building)
        assert view.layers[:, [0, 1]].tolist() == [wanted[:2]] * len(view.points)


def test_own_window_elements_are_looked_through_and_others_are_not():
    """An element of the window's own GUID is no obstruction, one of another's is."""
    building = shoebox(windows=[WINDOW])
    guid = building.spaces[0].windows[0].guid
    corners = [(-9, -8.0, -9), (9, -8.0, -9), (9, -8.0, 9), (-9, -8.0, 9)]
    for name, wanted in ((guid, np.inf), ("another", 8.0)):
        view = seen(replace(building, elements=(wall(*corners, guid=name, kind="IfcWindow"),)))
        assert view.distance[0] == pytest.approx(wanted, abs=0.01)


def test_shares_and_quantiles():
    """What 75 % of the eyes have, each quantity by itself; the share that has all three."""
    view = seen(shoebox(windows=[WINDOW], elements=[facing_wall(30.0, 1.5)]))
    found = view.at_least(0.75)
    assert found["view_distance_m"] == pytest.approx(30.0, abs=0.01)
    values = np.sort(view.sight_angle_deg)
    assert np.mean(values >= found["sight_angle_deg"]) >= 0.75
    assert np.mean(values > found["sight_angle_deg"]) < 0.75
    assert view.share(28.0, 20.0, 1) == pytest.approx(np.mean(values >= 28.0))
    assert view.share(28.0, 50.0, 1) == 0.0
