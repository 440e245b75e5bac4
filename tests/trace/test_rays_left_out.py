"""Rays that cannot matter are not sent: the results are those of all rays, digit by digit."""

from __future__ import annotations

import drjit as dr
import numpy as np
import pytest

from mitsuba_cfs.gloss import mirror

from . import rooms

pytestmark = pytest.mark.usefixtures("variant")


def directions(count: int) -> np.ndarray:
    """Suns [n, 3] over the half space before the test room's window, none of them level."""
    z, turn = (np.arange(count) + 0.5) / count, 2.399963 * np.arange(count)
    side = np.sqrt(1 - z**2)
    return np.stack([side * np.cos(turn), -np.abs(side * np.sin(turn)), z], axis=1)


def test_discs_that_no_window_can_show_are_those_of_all_pairs(monkeypatch):
    """Among them suns whose disc alone reaches the window, from sensors near and far."""
    from mitsuba_cfs.bsdf.klems import KLEMS_FULL
    from mitsuba_cfs.trace.kernels.scattering import KlemsScattering
    from mitsuba_cfs.trace.sun import sun_discs
    from mitsuba_cfs.trace.sun.direct import direct_sun_matrix

    room, groups = rooms.test_room()
    sensors = np.array([[1.8, 0.05, 0.8], [1.8, 1.0, 0.8], [1.0, 4.0, 0.8], [1.8, 4.0, 1.7]])
    normals = np.array([[0.0, 0, 1], [0, 0, 1], [0, 0, 1], [0, -1, 0]])
    corner = np.array([rooms.X1, 0.0, rooms.Z1]) - sensors[3]  # discs across the window's corner
    near = corner / np.linalg.norm(corner) + 0.003 * directions(64)
    suns = np.concatenate([directions(512), near])
    way = KlemsScattering(KLEMS_FULL, np.zeros((145, 145)), np.full(145, 0.8))

    def matrix():
        found = direct_sun_matrix(room, rooms.NOTHING, groups, [way], sensors, normals, suns=suns, window_points=1)
        return found.values

    some = matrix()
    pairs = len(sensors) * len(suns)
    monkeypatch.setattr(sun_discs, "_before_windows", lambda around: np.ones(pairs, dtype=bool))
    np.testing.assert_array_equal(some, matrix())
    assert 0.02 < np.mean(some > 0) < 0.3


def test_rays_that_come_close_to_a_mirror_are_all_that_meet_it(monkeypatch):
    from mitsuba_cfs.surfaces import Surfaces
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun.lit_points import SurfacePoints, sunlight
    from mitsuba_cfs.trace.sun.mirror_map import MirrorMaps

    pane = rooms.quad((0, -10, 0), (4, -11, 0), (4, -11, 3), (0, -10, 3))
    there = Surfaces(pane, np.zeros(2), np.zeros(2, dtype=int), (), (mirror(0.8),))
    outside = TracedScene(there, rooms.test_room()[1])
    rng = np.random.default_rng(3)
    point = rng.uniform((-2, -9, 0), (6, -1, 4), (400, 3)).astype(np.float32)
    places = SurfacePoints((point - outside.centre).astype(np.float32), np.tile([0, -1, 0.0], (400, 1)))
    suns = directions(64) * [1, -1, 1]
    some = sunlight(outside, places, suns)
    monkeypatch.setattr(MirrorMaps, "may_meet", lambda self, start, way, plane, active, slack: active)
    np.testing.assert_array_equal(some, sunlight(outside, places, suns))
    assert 0.02 < np.mean(some > 0) < 0.5


def test_cells_hold_the_places_that_their_rays_start_from_and_others_do_not_matter(monkeypatch):
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun import sunlit_sensors

    room, groups = rooms.test_room()
    inside = TracedScene(room, groups)
    narrow, wide = sunlit_sensors.room_cells(inside)
    starts, whole = wide.starts, dr.full(type(dr.llvm.Bool(True)), True, wide.starts.size)
    holder = np.repeat(np.arange(wide.cells.size), sunlit_sensors.CELL_RAYS)
    # at a cube's side the kernel's single precision decides for the next one
    same = wide.cells.of(starts.points(), starts.normals(), whole).numpy() == holder
    assert np.mean(~same) < 2e-5
    own = narrow.of(starts.points(), starts.normals(), whole).numpy()
    assert np.mean(own < 0) < 2e-5
    assert np.mean((wide.of[own] != holder) & (own >= 0)) < 2e-5
    assert len(np.unique(own)) > 0.99 * narrow.size  # from all over the wider ones

    sensors = np.array([[1.8, 1.0, 0.8], [1.0, 3.0, 0.8]]), np.tile([0.0, 0.0, 1.0], (2, 1))
    share = sunlit_sensors.shares_and_derivatives((narrow, wide), inside, sensors, samples=256)[0]
    between, sent = sunlit_sensors._between, []

    def of_all(cells, scene, met, *options):
        sent.append(len(met))
        return between(cells, scene, np.arange(cells.cells.size), *options)

    monkeypatch.setattr(sunlit_sensors, "_between", of_all)
    all_rows = sunlit_sensors.shares_and_derivatives((narrow, wide), inside, sensors, samples=256)[0]
    np.testing.assert_allclose(share, all_rows, rtol=1e-12)
    assert sent[0] < 0.6 * wide.cells.size  # the backs of walls are as many
