"""The straight view of sensors is traced once for all systems: these add the transmittance of their beam."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.matrices.cache import MatrixCache

from . import rooms
from .test_open_sun import POINTS, files, outdoors, same, systems

pytestmark = pytest.mark.usefixtures("variant")


def matrix(of_groups, cache: MatrixCache | None, **changed):
    """B of both groups [G, S, P]."""
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.kernels.path_options import PathOptions
    from mitsuba_cfs.trace.matrices.straight_view import straight_view_matrix

    room, groups, shade = rooms.l_shaped_room()
    up = np.tile([0.0, 0.0, 1.0], (len(POINTS), 1))
    options = {"samples": 256, "max_depth": 16, "stopping": Stopping(batches=4), "seed": 3, "cache": cache} | changed
    paths = PathOptions(**options)
    return straight_view_matrix(room, outdoors(shade), groups, of_groups, POINTS, up, paths=paths, subdivision=1)


def without_rays(monkeypatch) -> None:
    from mitsuba_cfs.trace.matrices import straight_view

    for name in ("straight_rays", "add_daylight_paths"):
        monkeypatch.setattr(straight_view, name, None)


@pytest.mark.parametrize("depth", [1, 16])
def test_other_systems_see_the_outdoors_as_traced_afresh_and_trace_nothing(tmp_path, monkeypatch, depth):
    cache, (_, first, *others) = MatrixCache(tmp_path), systems()
    fresh = [matrix(of_groups, None, max_depth=depth) for of_groups in others]
    assert all((one.values[1] > 0).mean() > 0.1 for one in fresh)
    matrix([first[0], first[0]], cache, max_depth=depth)
    assert files(tmp_path, "open-view") == 2  # one for each group
    without_rays(monkeypatch)
    for of_groups, expected in zip(others, fresh, strict=True):
        same(matrix(of_groups, cache, max_depth=depth), expected)


def test_equal_transmittance_at_all_angles_scales_the_view_of_open_windows():
    from mitsuba_cfs.trace.kernels.scattering import AngularScattering, OpenWindow

    grey = AngularScattering([0.25, 0.25], [0.0, 0.0])
    whole, part = (matrix([one, None], None).values for one in (OpenWindow(), grey))
    assert whole[0].sum() > 0 and not whole[1].any()
    np.testing.assert_allclose(part, 0.25 * whole, rtol=1e-6)


def test_each_ray_has_the_transmittance_of_its_own_angle():
    """Glass that passes light within 60 degrees of its normal: no sky beyond, and all of it well within."""
    from mitsuba_cfs.sky.patches import ReinhartSky
    from mitsuba_cfs.trace.kernels.path_options import PathOptions
    from mitsuba_cfs.trace.kernels.scattering import AngularScattering, OpenWindow
    from mitsuba_cfs.trace.matrices.straight_view import straight_view_matrix

    room, groups = rooms.test_room()
    narrow = AngularScattering((np.linspace(0, 1, 1001) > 0.5).astype(float), np.zeros(2))
    options = {"paths": PathOptions(512, 1), "subdivision": 1}
    sensors = [[1.8, 1.0, 0.8], [1.0, 0.3, 0.8]], [[0, 0, 1]] * 2
    whole, part = (
        straight_view_matrix(room, rooms.NOTHING, groups, [way], *sensors, **options).values[0]
        for way in (OpenWindow(), narrow)
    )
    cosine = -ReinhartSky(1).directions[:, 1]
    well_within, beyond = (chosen & (whole > 0) for chosen in (cosine > 0.65, cosine < 0.35))
    assert well_within.any() and beyond[:, 1:].any()
    np.testing.assert_allclose(part[well_within], whole[well_within], rtol=1e-6)
    assert not part[:, 1:][beyond[:, 1:]].any()


def test_paths_of_one_segment_show_part_of_what_longer_ones_do():
    direct, whole = (matrix([systems()[1][0]] * 2, None, max_depth=depth).values for depth in (1, 16))
    assert np.all(direct <= whole + 1e-12) and direct.sum() < 0.97 * whole.sum()


def test_without_a_place_in_the_cache_rays_are_traced_for_each_system(tmp_path, monkeypatch):
    from mitsuba_cfs.matrices import stored_parts
    from mitsuba_cfs.trace.matrices import straight_view

    system, other = systems()[1], systems()[2]
    fresh = [matrix(one, None) for one in (system, other)]
    reading = MatrixCache(tmp_path, stores=False)
    same(matrix(system, reading), fresh[0])
    assert not list(tmp_path.iterdir())
    cache = MatrixCache(tmp_path)
    for owner in (stored_parts, straight_view):
        monkeypatch.setattr(owner, "MOST_STORED", 64)  # of a batch's rays, which are then held alone
    same(matrix(system, cache), fresh[0])
    same(matrix(other, cache), fresh[1])
    assert (files(tmp_path, "open-view"), files(tmp_path, "straight-view")) == (0, 2)


def test_the_views_of_another_seed_or_depth_are_others(tmp_path):
    cache, system = MatrixCache(tmp_path), systems()[1]
    matrix(system, cache)
    for changed in ({"seed": 4}, {"max_depth": 1}, {"samples": 128}):
        same(matrix(system, cache, **changed), matrix(system, None, **changed))
    assert files(tmp_path, "open-view") == 8


@pytest.mark.parametrize(("normal", "wall", "lit"), [(-1.0, False, True), (1.0, False, False), (-1.0, True, False)])
def test_sensors_that_see_no_sky_and_no_sun_have_no_light(normal, wall, lit):
    """Their normals point away from the window, or a wall hides the sky: no ray is left for the system."""
    from mitsuba_cfs.trace.kernels.path_options import PathOptions
    from mitsuba_cfs.trace.kernels.scattering import OpenWindow
    from mitsuba_cfs.trace.matrices.straight_view import straight_view_matrix
    from mitsuba_cfs.trace.sun.direct import direct_sun_matrix

    room, groups = rooms.test_room()
    before = rooms.surfaces([(rooms.quad((-99, -1, -99), (99, -1, -99), (99, -1, 99), (-99, -1, 99)), 0.0)])
    scene = room, before if wall else rooms.NOTHING, groups, [OpenWindow()]
    sensor = [[1.8, 1.0, 1.6]], [[0.0, normal, 0.0]]
    view = straight_view_matrix(*scene, *sensor, paths=PathOptions(256, 1), subdivision=1)
    sun = direct_sun_matrix(*scene, *sensor, suns=[[0.0, -1.0, 0.3]], window_points=64)
    assert [bool(found.values.any()) for found in (view, sun)] == [lit, lit]
