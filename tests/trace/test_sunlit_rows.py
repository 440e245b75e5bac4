"""What the room reflects of the sun to a view and to its windows, against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

import mitsuba_cfs as cfs
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.images.view import pixel_directions
from mitsuba_cfs.surfaces import Surfaces, WindowGroup, WindowSurface
from mitsuba_cfs.trace.kernels.pixel_rows import MOST_TIMES, PictureRows, tile_size
from mitsuba_cfs.trace.kernels.scattering import KlemsScattering
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.even_points import EvenPoints
from mitsuba_cfs.trace.sun.lit_points import SurfacePoints
from mitsuba_cfs.trace.sun.picture_sun import PictureSun
from mitsuba_cfs.trace.sun.sorting import joint_keys, order_of
from mitsuba_cfs.trace.sun.sunlit_cells import RoomCells, surface_cells
from mitsuba_cfs.trace.sun.sunlit_rows import (
    FACE_STEPS,
    EdgePoints,
    _beside,
    _Hits,
    _pieces,
    picture_sunlit_shares,
    window_sunlit_shares,
)
from scenes.cost import room as box
from tests.trace.pixel_pictures import picture_matrix_blocks

from . import rooms

pytestmark = pytest.mark.usefixtures("variant")

STRIP = 0.1  # [m] of sun at the foot of a wall, how high
EYE = np.array([0.4, 3.0, 0.6])


def strip_on_cells(cells: RoomCells, tracer: TracedScene) -> np.ndarray:
    """Irradiance of the cells where the strip of sun has 1 [lx]."""
    y, z = np.meshgrid(np.linspace(0, box.DEPTH, 4001)[1:], STRIP * (np.arange(40) + 0.5) / 40)
    at = np.stack([np.zeros(y.size), y.ravel(), z.ravel()], axis=1) - tracer.centre
    at[:, 0] += tracer.epsilon[0]
    points = SurfacePoints(at.astype(np.float32), np.tile(np.float32([1, 0, 0]), (len(at), 1)))
    cell = cells.numbers(points)
    assert (cell >= 0).all()
    return np.bincount(cell, minlength=cells.size) * (box.DEPTH * STRIP / y.size) / cells.area


def test_a_strip_of_sun_at_a_walls_foot_lights_the_floor_beside_it_evenly() -> None:
    """Tile by tile as a strip of infinite length does: (1 - cos of its height as an angle) / 2."""
    view = cfs.fisheye(tuple(EYE), (0.0, 0.05, -1.0), 100)
    interior = box.room()
    tracer = TracedScene(interior, box.window_groups())
    rows = PictureRows.of_view(tracer, view, tile_size(view))
    times = np.ones(len(rows.pixels), dtype=np.int64)
    sunlit, _ = picture_sunlit_shares(tracer, view, rows, times)
    point = sunlit.places.point + tracer.centre
    lit = (point[:, 0] < 0.01) & (point[:, 2] < STRIP) & (sunlit.places.normal[:, 0] > 0.9)
    on_cells = strip_on_cells(sunlit.cells, tracer)
    mean, _ = rows.of_halves(np.ones(len(rows.pixels), dtype=np.float32), 0.01)
    found = mean @ sunlit.rows(on_cells[:, None], lit.astype(np.float32)[:, None])[:, 0]
    way = pixel_directions(view)[0].reshape(-1, 3)[rows.pixels]
    place = EYE - EYE[2] / np.minimum(way[:, 2:], -0.1) * way
    near = (place[:, 0] > 0.05) & (place[:, 0] < 0.15) & (np.abs(place[:, 1] - EYE[1]) < 0.5)
    exact = box.WALLS * box.FLOOR / np.pi * (1 - np.cos(np.arctan2(STRIP, place[:, 0]))) / 2
    chosen = np.unique(rows.row[near])
    count = np.bincount(rows.row, minlength=len(rows.keys))
    whole = chosen[count[chosen] == rows.tiles.size**2]
    expected = np.bincount(rows.row, exact, len(rows.keys)) / np.maximum(count, 1)
    off = found[whole] / expected[whole] - 1
    assert len(whole) > 50
    assert abs(off.mean()) < 0.1
    # 0.086; 0.17 with 64 rays to what is near in place of 1,024
    assert np.sqrt(np.mean(off**2)) < 0.13


def test_a_window_low_above_a_wide_floor_sees_the_sun_on_it_in_half_of_its_view() -> None:
    floor = rooms.quad((-500, 0, 0), (500, 0, 0), (500, 500, 0), (-500, 500, 0))
    interior = rooms.surfaces([(floor, 0.4)])
    pane = rooms.quad((-0.1, 0, 0.1), (0.1, 0, 0.1), (0.1, 0, 0.3), (-0.1, 0, 0.3))
    groups = [WindowGroup("low", (WindowSurface("low", pane),))]
    found = window_sunlit_shares(TracedScene(interior, groups), samples=64)
    luminance = found.far_rows(np.ones((found.cells.size, 1), dtype=np.float32))[:, 0]
    # E = rho / pi * pi * the floor's half of the view
    lux = KLEMS_FULL.projected_solid_angles() @ luminance
    assert lux == pytest.approx(0.4 / 2, rel=0.02)
    # a back's incident patch lies before the window as the front's does, mirrored in its plane
    up = KLEMS_FULL.incident_directions()[:, 1]
    assert luminance[up > 0.3].max() < 1e-6
    assert luminance[up < -0.3].min() > 0.99 * 0.4 / np.pi


def test_rows_of_few_pixels_have_more_paths() -> None:
    view = cfs.fisheye((1.8, 1.0, 1.5), (0.0, -1.0, 0.0), 120)
    tracer = TracedScene(box.room(), box.window_groups())
    rows = PictureRows.of_view(tracer, view, tile_size(view))
    count = np.bincount(rows.row)[rows.row]
    alone, smoothed = rows.times(smoothed=False), rows.times(smoothed=True)
    assert (alone * count >= rows.tiles.size**2).all()
    assert (alone[count == rows.tiles.size**2] == 1).all()
    weights = rows.smoothing(np.ones(len(count), dtype=np.float32), 1.0)
    traced = np.bincount(rows.row, smoothed)
    before, after = (1 / (weights.power(2) @ (1 / n)) for n in (np.bincount(rows.row), traced))
    assert before.min() < 16 < 0.5 * np.median(before)
    assert after.min() > 30
    assert smoothed.max() <= MOST_TIMES
    assert np.median(smoothed) == 1


def test_a_pixel_that_comes_again_has_the_paths_that_more_samples_would_have() -> None:
    """Their first reflection is stratified together."""
    view = cfs.fisheye((1.8, 1.0, 1.5), (0.0, -1.0, 0.0), 20)
    around, pixel = (box.room(), box.window_groups(), view), np.array([5 * 20 + 2, 15 * 20 + 9])
    options = {"max_depth": 1, "seed": 3}
    ((_, twice),) = picture_matrix_blocks(*around, samples=4, pixels=np.repeat(pixel, 2), **options)
    ((_, once),) = picture_matrix_blocks(*around, samples=8, pixels=pixel, **options)
    assert not np.allclose(twice[0], twice[1])
    np.testing.assert_allclose(twice.reshape(2, 2, -1).mean(axis=1), once.reshape(2, -1), atol=1e-6)


def test_sun_near_by_is_what_all_places_of_each_element_say(monkeypatch) -> None:
    """Though only those sunlit are asked at all places that the edge of a spot crosses."""
    view = cfs.fisheye((1.8, 1.0, 1.5), (0.0, -1.0, 0.0), 60)
    interior, groups = box.room(), box.window_groups()
    tracer = TracedScene(interior, groups)
    rows = PictureRows.of_view(tracer, view, 4)
    times = np.ones(len(rows.pixels), dtype=np.int64)
    sunlit, _ = picture_sunlit_shares(tracer, view, rows, times)
    sunlit = replace(sunlit, share=sparse.csr_array(sunlit.share.shape, dtype=np.float32))
    clear = KlemsScattering(KLEMS_FULL, np.zeros((145, 145)), np.ones(145))
    sun = PictureSun(interior, box.NOTHING, groups, [clear], view)
    height, turn = np.radians(np.meshgrid([15, 30, 45, 60], [-75, 0, 45]))
    suns = [np.cos(height) * np.sin(turn), -np.cos(height) * np.cos(turn), np.sin(height)]
    hours = np.stack(suns, axis=-1).reshape(-1, 3), np.full(height.size, 1e5)
    found = sun.sunlit_luminance(sunlit, *hours)
    monkeypatch.setattr(EdgePoints, "crossed", lambda _, light: np.nonzero(light > -1))
    every = sun.sunlit_luminance(sunlit, *hours)
    assert found.mean() == pytest.approx(every.mean(), rel=0.005)
    # 0.006; by the first place of each element alone 0.20
    assert np.sqrt(np.mean((found - every) ** 2)) < 0.02 * every.mean()


def test_elements_are_asked_again_where_one_beside_or_around_is_lit_unlike() -> None:
    cubes = np.zeros((6, 7), dtype=np.int64)
    # four in a row, the one that holds the first two, and one on another side of the surface
    cubes[:, 0], cubes[:, 6], cubes[:, 3] = [0, 1, 2, 3, 0, 1], [1, 1, 1, 1, 0, 1], [1] * 5 + [2]
    order = np.lexsort(cubes.T[::-1])
    name = np.argsort(order)
    edges = EdgePoints(SurfacePoints.joined([]), _beside(cubes[order]))
    for lit, expected in (([0], [0, 1, 4]), ([2], [1, 2, 3]), ([4], [0, 1, 4]), ([5], [])):
        light = np.zeros((6, 1), dtype=np.float32)
        light[name[lit]] = 1
        element, hour = edges.crossed(light)
        assert sorted(order[element].tolist()) == expected
        assert not hour.any()


def test_places_that_stand_for_an_element_are_its_own_and_evenly_drawn() -> None:
    from mitsuba_cfs.trace.sun.sunlit_rows import _chosen

    element = np.repeat([0, 1, 2], [1, 7, 40])
    drawn = np.stack([_chosen(element, 3, 4, seed).reshape(3, 4) for seed in range(400)])
    assert (element[drawn] == np.arange(3)[:, None]).all()
    assert all(len(set(places)) == 4 for places in drawn[:, 2])
    often = np.bincount(drawn[:, 2].ravel(), minlength=48)[8:]
    assert np.abs(often - often.mean()).max() < 5 * np.sqrt(often.mean())


def test_elements_are_numbered_in_the_order_of_their_cubes() -> None:
    """Against NumPy's unique columns; places of one element in their own order."""
    random = np.random.default_rng(11)
    n, edge = 4000, 0.3
    points = random.uniform(-1.0, 2.0, (n, 3)).astype(np.float32)
    sides = np.eye(3, dtype=np.float32)[random.integers(0, 3, n)]
    sides *= random.choice([-1, 1], (n, 1)).astype(np.float32)
    halvings = random.integers(0, 3, n).astype(np.int8)
    some = _Hits(np.zeros(n, dtype=np.int64), np.ones(n), SurfacePoints(points, sides), halvings)
    element, order, cubes = _pieces(some, edge)
    table = np.vstack(
        [np.floor(points.T * (0.5 ** -halvings.astype(float) / edge)), np.round(sides.T * FACE_STEPS), halvings]
    ).astype(np.int64)
    expected, numbers = np.unique(table, axis=1, return_inverse=True)
    assert len(cubes) > 1000
    np.testing.assert_array_equal(cubes, expected.T)
    np.testing.assert_array_equal(element, numbers.ravel())
    np.testing.assert_array_equal(order, np.argsort(numbers.ravel(), kind="stable"))


def test_order_of_numbers_and_of_columns() -> None:
    random = np.random.default_rng(3)
    columns = random.integers([[-4], [0], [70_000]], [[5], [3], [70_009]], (3, 900))
    keys = joint_keys(columns)
    order = order_of(keys)
    np.testing.assert_array_equal(order, np.lexsort(columns[::-1]))
    np.testing.assert_array_equal(np.diff(keys[order]) > 0, np.diff(columns[:, order]).any(axis=0))
    wide = np.array([2**62, 3, 2**62, 0])  # no room for the places beside the numbers
    np.testing.assert_array_equal(order_of(wide), [3, 1, 0, 2])
    assert not len(order_of(joint_keys(columns[:, :0])))


def test_points_lie_evenly_on_both_sides_of_the_surfaces() -> None:
    """Against areas; a triangle without area has no point."""
    random = np.random.default_rng(5)
    triangles = random.uniform(-2.0, 3.0, (7, 3, 3))
    triangles[3, 2] = triangles[3, 1]
    surfaces = Surfaces(triangles, np.full(7, 0.5), np.arange(7))
    centre, off, count = np.array([1.0, 2.0, 3.0]), 0.01, 5000
    points = EvenPoints(surfaces, centre, off, count)
    every = points.some(np.arange(2 * count))
    for axis in range(3):
        np.testing.assert_array_equal(np.concatenate(points.along(axis)), every.point[:, axis])
    np.testing.assert_array_equal(every.normal[:count], -every.normal[count:])
    np.testing.assert_allclose(np.linalg.norm(every.normal, axis=1), 1, rtol=1e-6)
    first, second = every.point[:count], every.point[count:]
    np.testing.assert_allclose(first - second, 2 * off * every.normal[:count], atol=1e-5)
    number = points.repeated(np.arange(7))
    np.testing.assert_allclose(np.bincount(number, minlength=7), surfaces.areas / surfaces.areas.sum() * count, atol=1)
    middle = 0.5 * (first + second).astype(float)
    for t in (0, 1, 2, 4, 5, 6):
        corner, *sides = triangles[t] - centre
        shares = (middle[number == t] - corner) @ np.linalg.pinv(np.array(sides) - corner)
        assert shares.min() > -1e-4 and shares.sum(axis=1).max() < 1 + 1e-4
        np.testing.assert_allclose(shares.mean(axis=0), 1 / 3, atol=0.03)


def test_grazing_sun_lights_a_picture_by_its_flux() -> None:
    """The mean over all rows has the flux's noise, not that of a few points in a narrow spot."""
    view = cfs.fisheye((1.8, 2.0, 1.5), (0.0, -1.0, 0.0), 60)
    interior, groups = box.room(), box.window_groups()
    tracer = TracedScene(interior, groups)
    rows = PictureRows.of_view(tracer, view, tile_size(view))
    clear = KlemsScattering(KLEMS_FULL, np.zeros((145, 145)), np.ones(145))
    sun = PictureSun(interior, box.NOTHING, groups, [clear], view)
    height = np.radians([8.0, 20.0, 35.0, 50.0])
    east = np.cos(height) * np.sin(np.radians(-80))
    south = -np.cos(height) * np.cos(np.radians(-80))
    hours = np.stack([east, south, np.sin(height)], axis=-1), np.full(len(height), 1e5)
    mean, _ = rows.of_halves(np.ones(len(rows.pixels), dtype=np.float32), 0.01)
    found = []
    for seed in range(4):
        shares, _ = picture_sunlit_shares(tracer, view, rows, rows.times(smoothed=True), seed=seed)
        luminance = mean @ sun.sunlit_luminance(shares, *hours)
        found.append(np.average(luminance, axis=0, weights=np.bincount(rows.row)))
    noise = np.std(found, axis=0, ddof=1) / np.mean(found, axis=0)
    # 0.01 in each hour; four shadow rays to each of 1,024 parts of the surfaces gave 0.04 to 0.13
    assert noise.max() < 0.03


def test_the_sun_on_cells_is_followed_once_for_the_same_hours(monkeypatch) -> None:
    """A picture, its noise and the windows have the cells of one scene and equal hours."""
    from mitsuba_cfs.trace.sun.sunlit_cells import Beam

    interior, groups = box.room(), box.window_groups()
    view = cfs.fisheye((1.8, 2.0, 1.5), (0.0, -1.0, 0.0), 40)
    tracer = TracedScene(interior, groups)
    rows = PictureRows.of_view(tracer, view, tile_size(view))
    of_rows, _ = picture_sunlit_shares(tracer, view, rows, rows.times(smoothed=True))
    of_windows = window_sunlit_shares(tracer, samples=4)
    clear = KlemsScattering(KLEMS_FULL, np.zeros((145, 145)), np.ones(145))
    sun, followed, flux = PictureSun(interior, box.NOTHING, groups, [clear], view), [], Beam.flux

    def counted(self, cells, suns):
        followed.append(suns)
        return flux(self, cells, suns)

    monkeypatch.setattr(Beam, "flux", counted)
    towards = np.array([[0.0, -0.6, 0.8], [0.6, -0.64, 0.48]])
    first = sun.sunlit_luminance(of_rows, towards[:1].copy(), np.full(1, 1e5))
    sun.sunlit_luminance(of_windows, towards[:1].copy(), np.full(1, 1e5))
    assert len(followed) == 1
    other = sun.sunlit_luminance(of_rows, towards[1:], np.full(1, 1e5))
    dimmed = sun.sunlit_luminance(of_rows, towards[:1], np.full(1, 5e4))
    assert len(followed) == 3
    assert first.sum() > 0 and not np.allclose(first, other)
    np.testing.assert_allclose(dimmed, first / 2, rtol=1e-5)


@pytest.mark.parametrize("turn_deg", [0.0, 30.0, 45.0])
@pytest.mark.parametrize("gap", [0.03, 0.1])
def test_a_skin_behind_a_wall_takes_no_area_from_its_cells(gap: float, turn_deg: float) -> None:
    """The scene of the Geneva office has such skins; they took 5 % of the light at the eye."""
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    turned = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])  # rows times this
    wall = rooms.quad((0, 0, 0), (4, 0, 0), (4, 0, 3), (0, 0, 3))
    skin = wall - np.array([0.0, gap, 0.0])
    far = wall + np.array([0.0, 6.0, 0.0])
    interior = rooms.surfaces([(one @ turned, 0.5) for one in (wall, skin, far)])
    cells = surface_cells(TracedScene(interior, box.window_groups())).cells
    for chosen in (cells, cells.joined()[0]):
        inside = TracedScene(interior, box.window_groups())
        x, z = np.meshgrid(np.linspace(1e-3, 3.999, 801), np.linspace(1e-3, 2.999, 601))
        for y in (0.0, -gap):
            at = np.stack([x.ravel(), np.full(x.size, y), z.ravel()], axis=1) @ turned
            at -= inside.centre
            normal = np.tile((np.array([0, 1, 0]) @ turned).astype(np.float32), (len(at), 1))
            cell = chosen.numbers(SurfacePoints(at.astype(np.float32) + 1e-4 * normal, normal))
            of_plane = np.unique(cell)
            assert (of_plane >= 0).all()
            # points that count the areas are even to a few per cent of a cell
            assert chosen.area[of_plane].sum() == pytest.approx(12.0, rel=0.01)
