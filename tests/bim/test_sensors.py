"""Work plane grids and view points against rooms whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from bim.sensors import horizontal_section, sensor_grid, view_point, winding_number
from bim.shoebox import WindowRectangle, shoebox


def test_grid_keeps_its_margin_and_its_middle():
    points, directions = sensor_grid(shoebox(4, 6, 3).spaces[0], spacing=0.5, margin=0.5)
    assert len(points) == 6 * 10
    np.testing.assert_allclose(points.min(axis=0), [0.75, 0.75, 0.8])
    np.testing.assert_allclose(points.max(axis=0), [3.25, 5.25, 0.8])
    np.testing.assert_allclose(directions, np.tile([0, 0, 1], (60, 1)))


def test_grid_follows_a_turned_room():
    straight, _ = sensor_grid(shoebox(4, 6, 3).spaces[0])
    turned, _ = sensor_grid(shoebox(4, 6, 3, facing_deg=217.0).spaces[0])
    assert len(turned) == len(straight)
    a = np.linalg.norm(straight[:, None] - straight.mean(axis=0), axis=-1)
    b = np.linalg.norm(turned[:, None] - turned.mean(axis=0), axis=-1)
    np.testing.assert_allclose(np.sort(a.ravel()), np.sort(b.ravel()), atol=1e-6)


def test_section_at_the_height_of_a_sill_includes_the_recess_above_it():
    windows = (WindowRectangle(1, 0.8, 2, 1),)
    space = shoebox(4, 6, 3, windows=windows, recess=0.3).spaces[0]
    # 1e-6 m2: the section's coordinates are rounded to 1e-7 m
    assert horizontal_section(space.shell, 0.8).area == pytest.approx(24 + 0.6, abs=1e-6)
    assert horizontal_section(space.shell, 0.7).area == pytest.approx(24, abs=1e-6)
    assert horizontal_section(space.shell, 3.5).is_empty


def test_narrow_room_still_gets_sensors():
    points, _ = sensor_grid(shoebox(0.9, 3, 2.5, windows=()).spaces[0], margin=0.5)
    assert len(points) and np.all((points[:, 0] > 0) & (points[:, 0] < 0.9))


def test_winding_number_of_a_ring_with_a_hole_and_of_a_doubled_ring():
    outer = np.array([[0, 0], [4, 0], [4, 4], [0, 4]], dtype=float)
    hole = outer[::-1] / 2 + 1

    def edges(ring):
        return np.stack([ring, np.roll(ring, -1, axis=0)], axis=1)

    both = np.concatenate([edges(outer), edges(hole)])
    assert winding_number(np.array([0.5, 0.5]), both) == pytest.approx(1)
    assert winding_number(np.array([2.0, 2.0]), both) == pytest.approx(0)
    assert winding_number(np.array([5.0, 2.0]), both) == pytest.approx(0)
    doubled = np.concatenate([edges(outer), edges(outer)])
    assert winding_number(np.array([2.0, 2.0]), doubled) == pytest.approx(2)


def test_view_looks_at_the_biggest_window():
    windows = (WindowRectangle(1, 1, 1, 1), WindowRectangle(1, 1, 4, 1, "right"))
    space = shoebox(4, 6, 3, windows=windows).spaces[0]
    position, direction = view_point(space)
    np.testing.assert_allclose(position, [2, 3, 1.2], atol=1e-6)
    np.testing.assert_allclose(direction, [1, 0, 0], atol=1e-6)
    assert horizontal_section(space.shell, 1.2).contains(shapely.Point(position[:2]))
