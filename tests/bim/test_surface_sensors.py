"""Sensors on polygons: the dissertation's grid, with holes, self-intersections and slopes."""

from __future__ import annotations

import numpy as np
import pytest

from bim.sensors import polygon_sensors, surface_sensors
from bim.shoebox import WindowRectangle, shoebox

WALL = np.array([[0, 0, 0], [7, 0, 0], [7, 0, 3], [0, 0, 3]], dtype=float)


def test_figure_20_upright_wall():
    points, normal = polygon_sensors(WALL, (0.2, 0.2, 0.1))
    assert len(points) == 35 * 30
    np.testing.assert_allclose(normal, [0, -1, 0], atol=1e-12)
    np.testing.assert_allclose(points.min(axis=0), [0.1, 0, 0.05], atol=1e-9)
    np.testing.assert_allclose(points.max(axis=0), [6.9, 0, 2.95], atol=1e-9)


def test_spacing_is_taken_to_the_polygon_s_own_axes():
    c, s = np.cos(0.6), np.sin(0.6)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    points, _ = polygon_sensors(WALL @ turn.T, (0.3, 0.5, 0.1))
    along = np.unique(np.round(points @ turn @ [1, 0, 0], 6))
    assert np.diff(along)[0] == pytest.approx(np.hypot(c * 0.3, s * 0.5), abs=1e-5)


@pytest.mark.parametrize("turned", [False, True])
def test_holes_are_left_out_whichever_way_they_turn(turned):
    hole = np.array([[2, 0, 1], [5, 0, 1], [5, 0, 2], [2, 0, 2]], dtype=float)
    points, _ = polygon_sensors(WALL, (0.1, 0.1, 0.1), [hole[::-1] if turned else hole])
    assert len(points) == 70 * 30 - 30 * 10
    inside = (points[:, 0] > 2) & (points[:, 0] < 5) & (points[:, 2] > 1) & (points[:, 2] < 2)
    assert not inside.any()


def test_self_intersecting_star_counts_by_the_winding_number():
    # a pentagram: its middle is wound twice and counts, as its tips do
    angle = np.pi / 2 + np.arange(5) * 4 * np.pi / 5
    star = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(5)])
    points, _ = polygon_sensors(star, (0.02, 0.02, 0.02))
    assert np.any(np.linalg.norm(points, axis=1) < 0.1)
    # area of the pentagram {5/2} of circumradius 1, middle included: 1.12257
    assert len(points) * 0.02**2 == pytest.approx(1.12257, rel=0.02)  # one row of cells


def test_faces_look_into_the_room_and_out_of_it():
    window = WindowRectangle(1, 1, 2, 1)
    space = shoebox(4, 6, 3, windows=(window,)).spaces[0]
    front = next(face for face in space.faces if face.name == "front")
    points, directions = surface_sensors(front, (0.5, 0.5, 0.5))
    assert len(points) == 8 * 6 - 4 * 2
    np.testing.assert_allclose(points[:, 1], 0.01)
    np.testing.assert_allclose(directions, np.tile([0, 1, 0], (len(points), 1)), atol=1e-12)
    outside, directions = surface_sensors(front, (0.5, 0.5, 0.5), outdoors=True)
    np.testing.assert_allclose(outside[:, 1], -0.01 - front.construction.thickness)
    np.testing.assert_allclose(directions[0], [0, -1, 0], atol=1e-12)
    assert len(surface_sensors(space.windows[0], (0.5, 0.5, 0.5))[0]) == 4 * 2
