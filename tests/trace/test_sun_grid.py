"""The sun on many places outdoors by a grid of its directions, beside rays of all pairs."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.gloss import mirror
from mitsuba_cfs.surfaces import Surfaces

from . import rooms

pytestmark = pytest.mark.usefixtures("variant")


def suns_of_a_year() -> np.ndarray:
    """Directions [h, 3] as the hours of a year at 50 degrees north have them, z upwards."""
    day, hour = np.meshgrid(np.arange(365), np.arange(5, 20), indexing="ij")
    tilt = np.radians(23.45) * np.sin(2 * np.pi * (day - 80) / 365)
    turn, north = np.radians(15 * (hour - 12) + 4 * np.sin(4 * np.pi * day / 365)), np.radians(50)
    up = np.sin(north) * np.sin(tilt) + np.cos(north) * np.cos(tilt) * np.cos(turn)
    south = np.sin(north) * np.cos(tilt) * np.cos(turn) - np.cos(north) * np.sin(tilt)
    all_suns = np.stack([-np.cos(tilt) * np.sin(turn), -south, up], axis=-1).reshape(-1, 3)
    return all_suns[all_suns[:, 2] > 0]


def outdoors(surfaces: Surfaces):
    from mitsuba_cfs.trace.kernels.scene import TracedScene

    return TracedScene(surfaces, rooms.test_room()[1])


def floor_places(outside, count: int, seed: int = 0):
    """Points on the ground before the test room, looking up."""
    from mitsuba_cfs.trace.sun.lit_points import SurfacePoints

    point = np.random.default_rng(seed).uniform((-3, -9, 0), (6, -2, 0), (count, 3))
    up = np.tile(np.float32([0, 0, 1]), (count, 1))
    return SurfacePoints((point - outside.centre).astype(np.float32), up)


def both(surfaces: Surfaces, count: int, suns: np.ndarray):
    """By the grid and by a ray of each pair [m, h]."""
    from mitsuba_cfs.trace.sun.lit_points import sunlight, sunlight_of_many

    outside = outdoors(surfaces)
    places = floor_places(outside, count)
    return sunlight_of_many(outside, places, suns), sunlight(outside, places, suns)


def wall(x0: float, x1: float, y: float, top: float) -> np.ndarray:
    return rooms.quad((x0, y, -1), (x1, y, -1), (x1, y, top), (x0, y, top))


def fence() -> Surfaces:
    """Posts 4 cm wide, 12 apart: from the ground some 1 degree wide, far below the grid's step."""
    posts = [(wall(x, x + 0.04, -10, 12.0), 0.3) for x in np.arange(-40, 40, 0.12)]
    return rooms.surfaces(posts)


def test_directions_lie_between_the_nodes_about_them():
    from mitsuba_cfs.trace.sun.lit_points import STEP, SunGrid

    suns = suns_of_a_year()
    grid = SunGrid.about(suns)
    assert len(grid.nodes) < 0.25 * len(suns)
    assert grid.weight.min() >= 0 and grid.weight.sum(axis=1) == pytest.approx(1)
    about = grid.nodes[grid.corner]
    between = (grid.weight[..., None] * about).sum(axis=1)
    between /= np.linalg.norm(between, axis=1)[:, None]
    # at the horizon a triangle's long side is sqrt(2) sqrt(2) steps, whose arc stands L^2 / 8 off
    assert np.linalg.norm(about - suns[:, None], axis=2).max() < 2.05 * STEP
    assert np.linalg.norm(between - suns, axis=1).max() < 0.5 * STEP**2


def test_edges_of_wide_shadows_are_those_of_rays_to_each_sun():
    suns = suns_of_a_year()
    tower = rooms.surfaces([(wall(-6, -1, -12, 14), 0.3), (wall(3, 30, -11, 6), 0.3)])
    grid, rays = both(tower, 200, suns)
    assert 0.1 < np.mean(rays == 0) < 0.9
    assert np.mean(np.abs(grid - rays) > 1e-5) < 2e-3
    np.testing.assert_allclose(grid.mean(axis=0), rays.mean(axis=0), atol=0.04)
    assert grid.mean() == pytest.approx(rays.mean(), rel=2e-4)


def test_what_is_thinner_than_the_grid_has_its_right_mean():
    """Of nodes that agree alone it would have 9 % more than it has."""
    suns = suns_of_a_year()
    suns = suns[suns[:, 1] < -0.3][::3]  # behind the fence
    grid, rays = both(fence(), 1024, suns)
    hidden = 1 - rays.sum() / (1024 * suns[:, 2].sum())
    assert 0.3 < hidden < 0.6
    blocks = (grid - rays).reshape(16, 64, -1).sum(axis=(1, 2)) / rays.sum() * 16
    error = blocks.std(ddof=1) / 4
    assert error < 0.005
    assert abs(blocks.mean()) < 4 * error


def test_an_hour_has_the_same_light_whatever_others_are_computed_with_it():
    from mitsuba_cfs.trace.sun.lit_points import sunlight_of_many

    suns = suns_of_a_year()
    outside = outdoors(fence())
    places = floor_places(outside, 64)
    whole = sunlight_of_many(outside, places, suns)
    for some in ([17], np.arange(0, len(suns), 7)):
        np.testing.assert_array_equal(whole[:, some], sunlight_of_many(outside, places, suns[some]))


def test_mirrors_send_on_as_much_sun_as_by_rays_to_each():
    from mitsuba_cfs.trace.sun.lit_points import sunlight, sunlight_of_many

    pane = rooms.quad((0, -10, 0), (4, -11, 0), (4, -11, 3), (0, -10, 3))
    there = Surfaces(pane, np.zeros(2), np.zeros(2, dtype=int), (), (mirror(0.8),))
    outside, suns = outdoors(there), suns_of_a_year() * [1, -1, 1]
    places = floor_places(outside, 512)
    grid, rays = (f(outside, places, suns) for f in (sunlight_of_many, sunlight))
    mirrored = rays - np.maximum(suns[:, 2], 0)
    assert mirrored.sum() > 0.005 * rays.sum()
    off = (grid - rays).reshape(16, 32, -1).sum(axis=(1, 2)) / mirrored.sum() * 16
    error = off.std(ddof=1) / 4
    assert abs(off.mean()) < 4 * error < 0.03


@pytest.mark.parametrize("each", [8, 32])
def test_pairs_whose_nodes_are_alike_have_rays_where_they_are_checked_or_level(each: int):
    from mitsuba_cfs.trace.sun.lit_points import SunGrid, SurfacePoints, _GridLight
    from mitsuba_cfs.trace.sun.specular_paths import SPREAD, SpecularPath

    random = np.random.default_rng(2)
    suns = suns_of_a_year()
    level = np.array([suns[100, 1], -suns[100, 0], 0.0])
    normals = random.choice([[0.0, 0, 1], [0, -1, 0], [0.6, 0.8, 0], level / np.linalg.norm(level)], 60)
    places = SurfacePoints(np.zeros((60, 3), dtype=np.float32), normals.astype(np.float32))
    grid, number = SunGrid.about(suns), random.integers(0, 90, 60)
    rows = np.sort(random.choice(60, 40, replace=False))
    outside = outdoors(rooms.NOTHING)
    light = _GridLight(outside, [SpecularPath(outside)] * 2, grid, places, number)
    light._each[1] = each
    found = light._pairs_with_rays(1, rows) - 60 * len(suns)
    cosine = places.normal.astype(float) @ suns.T
    checked = (number[:, None] + grid.first) % each == 0
    own = (np.abs(cosine) <= SPREAD) | ((cosine > 0) & checked)
    own[np.setdiff1d(np.arange(60), rows)] = False
    assert own[:, 100].any() and len(np.unique(found)) == len(found)
    assert not np.setdiff1d(np.flatnonzero(own), found).size
    assert len(found) < 1.01 * np.count_nonzero(own)
