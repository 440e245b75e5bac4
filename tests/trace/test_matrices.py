"""View, daylight and absorption matrices against closed forms and identities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces, WindowGroup, WindowSurface
from mitsuba_cfs.window_parts import cut_group, even_regions

from . import rooms

pytestmark = [pytest.mark.early, pytest.mark.usefixtures("variant")]

UP = [0.0, 0.0, 1.0]


def configuration_factor(a: float, b: float, c: float) -> float:
    """Share of a small plane's view on a rectangle a x b at right angles to it.

    The rectangle stands at distance c, its lower edge a at the level of the plane, one corner
    opposite to it.  Siegel and Howell, configuration factor C-12.
    """
    root = np.hypot(b, c)
    return (np.arctan(a / c) - c / root * np.arctan(a / root)) / (2 * np.pi)


def window_factor(x: float, y: float, z: float) -> float:
    """Configuration factor of the test room's window from an upward sensor at (x, y, z)."""
    total = 0.0
    for height, sign_z in ((rooms.Z1 - z, 1), (rooms.Z0 - z, -1)):
        if height <= 0:
            continue
        for width, sign_x in ((rooms.X1 - x, 1), (rooms.X0 - x, -1)):
            total += sign_z * sign_x * configuration_factor(width, height, y)
    return total


def test_view_matrix_row_sum_in_a_black_room_is_pi_times_the_configuration_factor():
    from mitsuba_cfs.trace.matrices.view import view_matrix

    room, groups = rooms.test_room(scale=0.0)
    points = np.array([[1.0, 0.5, 0.8], [1.8, 2.0, 0.8], [3.0, 4.4, 0.8], [1.8, 1.0, 2.0]])
    result = view_matrix(room, groups, points, np.tile(UP, (4, 1)), samples=16384)
    expected = [np.pi * window_factor(*p) for p in points]
    total = result.values.sum(axis=(1, 2))
    # entries of a row are nearly independent; 4 sigma of the sum, at least the float32 ray offsets
    error = np.sqrt((result.standard_error**2).sum(axis=(1, 2)))
    assert np.all(np.abs(total - expected) < 4 * error + 1e-4 * total), (total, expected)


def test_uniform_sky_gives_pi_on_a_horizontal_sensor_and_one_on_a_window():
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix, sky_irradiance_matrix

    sky = sky_irradiance_matrix(rooms.NOTHING, [[0, 0, 0]], [UP], subdivision=1, samples=65536)
    assert sky.values[0, 0] == pytest.approx(0, abs=1e-5)  # no ground above the horizon
    assert sky.values[0].sum() == pytest.approx(np.pi, rel=1e-6)  # every path ends in the sky
    patches = ReinhartSky(1)
    edges = np.append(patches.row_height * np.arange(8), np.pi / 2)
    ring = np.pi * np.diff(np.sin(edges) ** 2) / patches.row_counts
    error = 5 * sky.standard_error[0, 1:] + 1e-6
    assert np.all(np.abs(sky.values[0, 1:] - np.repeat(ring, patches.row_counts)) < error)

    _, groups = rooms.test_room()
    daylight = daylight_matrix(rooms.NOTHING, groups, subdivision=1, samples=1024)
    assert daylight.values.sum(axis=2) == pytest.approx(np.ones((1, 145)), rel=1e-6)


def test_daylight_matrix_sends_each_klems_patch_to_the_sky_it_faces():
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix

    _, groups = rooms.test_room()
    daylight = daylight_matrix(rooms.NOTHING, groups, subdivision=4, samples=4096).values[0]
    sky = ReinhartSky(4)
    mean = daylight @ sky.directions
    expected = KLEMS_FULL.incident_directions() @ window_frame([0, -1, 0])
    above = expected[:, 2] > 0.3  # patches that see no ground
    cosine = np.einsum("kj,kj->k", mean, expected) / np.linalg.norm(mean, axis=1)
    # the mean direction lies within the patch: less than 8 degrees from its centre
    assert np.all(cosine[above] > np.cos(np.radians(8)))


def test_a_wall_of_reflectance_r_before_the_window_reflects_r_times_what_it_receives():
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix

    r = 0.6
    wall = rooms.surfaces([(rooms.quad((-90, -8, -90), (90, -8, -90), (90, -8, 90), (-90, -8, 90)), r)])
    _, groups = rooms.test_room()
    values = daylight_matrix(wall, groups, subdivision=1, samples=2048).values[0]
    # straight ahead the window sees only the wall, which sees half a sky, half a ground, and of
    # the window, which is black from outside, about its area over pi d2
    black = groups[0].area / (np.pi * 8**2)
    assert values[0].sum() == pytest.approx(r * (1 - black), abs=0.005)


def test_clear_opening_three_phase_is_the_two_phase_matrix():
    """V T D with T = 1 against sky coefficients traced straight through the open hole."""
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix, sky_irradiance_matrix
    from mitsuba_cfs.trace.matrices.view import view_matrix

    room, groups = rooms.test_room()
    points, directions = [[1.2, 1.5, 0.85], [2.0, 3.5, 0.85]], [UP, UP]
    view = view_matrix(room, groups, points, directions, samples=32768).values[:, 0]
    daylight = daylight_matrix(rooms.NOTHING, groups, subdivision=1, samples=8192).values[0]
    direct = sky_irradiance_matrix(room, points, directions, subdivision=1, samples=131072, max_depth=40)
    three_phase = view @ daylight
    total = direct.values.sum(axis=1)
    assert three_phase.sum(axis=1) == pytest.approx(total, rel=0.004)
    # the horizon runs through Klems patches, whose light spreads evenly above and below it
    assert np.abs(three_phase[:, 0] - direct.values[:, 0]).max() < 0.02 * total.max()


def test_absorbed_shares_sum_to_one_and_follow_the_reflectances():
    from mitsuba_cfs.trace.matrices.adjacent import absorption_matrix

    room, groups = rooms.test_room()
    values = absorption_matrix(room, groups, samples=2048).values[0]
    # what is missing has left through the rounded seams of the float32 mesh
    assert values.sum(axis=1) == pytest.approx(np.ones(145), abs=3e-3)
    black = absorption_matrix(rooms.test_room(scale=0.0)[0], groups, samples=2048).values[0]
    assert black[:, -1] == pytest.approx(np.zeros(145), abs=1e-6)  # nothing comes back
    mirror = absorption_matrix(room, groups, window_reflectance=[1.0], samples=2048).values[0]
    assert mirror[:, -1] == pytest.approx(np.zeros(145), abs=1e-6)  # nothing stays in a white window
    assert mirror.sum(axis=1) == pytest.approx(np.ones(145), abs=3e-3)
    down = KLEMS_FULL.index(np.radians(50), np.radians(270))  # light from the sun goes down
    assert black[down, 0] > 0.9  # ... to the floor


def test_picture_does_not_depend_on_the_block_and_its_illuminance_is_the_view_matrix(monkeypatch):
    from mitsuba_cfs.images.view import fisheye, pixel_directions, pixel_solid_angles
    from mitsuba_cfs.trace.matrices import pixel_view
    from mitsuba_cfs.trace.matrices.view import view_matrix
    from tests.trace.pixel_pictures import luminance_pictures

    room, groups = rooms.test_room()
    view = fisheye((1.8, 2.5, 1.2), (0, -1, 0), 64)
    luminance = np.linspace(500, 5000, 145)[None, :, None]
    whole = luminance_pictures(room, groups, view, luminance, samples=16)
    monkeypatch.setattr(pixel_view, "BLOCK_BYTES", 8 * 145 * 1000)
    blocks = luminance_pictures(room, groups, view, luminance, samples=16)
    np.testing.assert_allclose(whole, blocks, rtol=1e-5)

    directions, counts = pixel_directions(view)
    weight = pixel_solid_angles(view) * counts * np.maximum(directions @ [0, -1, 0], 0)
    at_eye = view_matrix(room, groups, [view.position], [view.direction], samples=16384)
    expected = at_eye.values[0, 0] @ luminance[0, :, 0]
    # pixels of 2.8 degrees at the window's edges: 1 %
    assert (weight * whole[0]).sum() == pytest.approx(expected, rel=0.01)


def test_seed_and_batches_key_the_result():
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.matrices.view import view_matrix

    room, groups = rooms.test_room()
    options = {"samples": 256, "stopping": Stopping(batches=2)}
    one, same, other = (view_matrix(room, groups, [[1, 1, 1]], [UP], seed=seed, **options).values for seed in (1, 1, 2))
    np.testing.assert_allclose(one, same, rtol=1e-12)  # order of the float64 sums
    assert np.abs(one - other).max() > 1e-4


def test_stated_error_is_the_spread_between_seeds():
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.matrices.view import view_matrix

    room, groups = rooms.test_room()
    runs = [
        view_matrix(room, groups, [[1.5, 2.0, 0.8]], [UP], samples=512, seed=s, stopping=Stopping(batches=8))
        for s in range(24)
    ]
    values = np.stack([r.values for r in runs])
    stated = np.mean([r.standard_error**2 for r in runs])
    # mean variance over 145 entries from 24 runs: a few per cent; batches of 8 as much again
    assert values.var(axis=0, ddof=1).mean() == pytest.approx(stated, rel=0.2)


def test_stated_error_of_sums_is_the_spread_between_seeds():
    """Entries of a row go together: they share the points that the sensors' rays hit."""
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.matrices.view import view_matrix

    room, groups = rooms.test_room()
    points = [[0.5 + 0.4 * i, 0.5 + 0.5 * j, 0.8] for i in range(8) for j in range(8)]
    runs = [
        view_matrix(room, groups, points, np.tile(UP, (64, 1)), samples=512, seed=s, stopping=Stopping(batches=8))
        for s in range(10)
    ]
    for weights in (np.ones(145), np.linspace(1, 3, 145)):
        sums = np.stack([r.values @ weights for r in runs])
        stated = np.mean([r.error_of(weights) ** 2 for r in runs])
        # 10 runs whose sensors go together: the variance is known to about 30 %; entries taken
        # as independent would give less than half of it
        assert sums.var(axis=0, ddof=1).mean() == pytest.approx(stated, rel=0.5)


def test_sensors_do_not_change_each_other():
    """A row is the same, but for noise, whoever else is asked for."""
    from mitsuba_cfs.trace.matrices.view import view_matrix

    room, groups = rooms.test_room()
    first = np.array([1.0, 4.55, 0.8])  # 5 cm from the back wall
    others = [[2.0, y, 1.2] for y in np.linspace(0.3, 4.3, 31)]
    alone = view_matrix(room, groups, [first], [UP], samples=16384)
    crowd = view_matrix(room, groups, [first, *others], np.tile(UP, (32, 1)), samples=4096)
    error = np.hypot(alone.sum_error[0], crowd.sum_error[0])
    assert error < 0.02 * alone.values.sum()
    difference = alone.values[0].sum() - crowd.values[0].sum()
    assert abs(difference) < 4 * error


def test_rays_that_leave_through_a_gap_bring_nothing():
    from mitsuba_cfs.trace.matrices.view import view_matrix

    room, groups = rooms.test_room()
    keep = room.surface != 2  # without its back wall
    gap = replace(room, triangles=room.triangles[keep], reflectance=room.reflectance[keep], surface=room.surface[keep])
    points = [[1.0, 2.0, 0.8], [2.0, 4.0, 0.8]]
    whole, less = (view_matrix(r, groups, points, [UP, UP]).values.sum() for r in (room, gap))
    assert 0.5 * whole < less < 0.98 * whole


def test_windows_of_one_group_must_share_their_orientation():
    _, groups, _ = rooms.l_shaped_room()
    with pytest.raises(ValueError, match="turned"):
        WindowGroup("both", (groups[0].windows[0], groups[1].windows[0]))


def panes_before_a_screen(gap: float = 0.002) -> tuple[WindowGroup, list[WindowGroup]]:
    """The test room's window as a screen, alone and a gap [m] behind panes."""
    _, groups = rooms.test_room()
    (screen, *_) = groups[0].windows
    pane = WindowSurface("pane", screen.triangles + gap * np.asarray(screen.normal))
    alone = WindowGroup("screen", (screen,))
    return alone, [alone, WindowGroup("panes", (pane,))]


def test_panes_before_a_screen_do_not_take_its_light():
    """Nor do they let through what comes back from outdoors, 3 % here."""
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix

    alone, both = panes_before_a_screen()
    expected, found = (
        daylight_matrix(rooms.obstruction(), groups, subdivision=1, samples=512).part(0) for groups in ([alone], both)
    )
    total = expected.values.sum()
    error = np.sqrt((expected.sum_error**2).sum() + (found.sum_error**2).sum())
    assert error < 0.002 * total
    assert abs(found.values.sum() - total) < 4 * error


def test_cells_of_a_screen_have_its_light():
    from mitsuba_cfs.trace.kernels.path_options import PathOptions
    from mitsuba_cfs.trace.kernels.rooms import TracedRoom
    from mitsuba_cfs.trace.matrices.daylight import cells_of_rooms
    from mitsuba_cfs.window_parts import window_cells

    alone, both = panes_before_a_screen()
    expected, found = (
        cells_of_rooms(
            [TracedRoom(rooms.obstruction(), groups)], None, [[window_cells(g) for g in groups]], [PathOptions(4, 1)]
        )[0][0]
        for groups in ([alone], both)
    )
    # the same rays straight to the sky
    assert np.abs(found - expected).mean() < 0.001 * expected.mean()


def test_the_cells_of_batches_are_averaged():
    from mitsuba_cfs.trace.matrices.daylight import _mean

    sums = [np.random.default_rng(seed).uniform(size=(5000, 7)) for seed in range(3)]
    share = np.linspace(0.1, 0.9, 5000)
    mean = _mean(sums, share)
    assert mean.dtype == np.float32
    np.testing.assert_allclose(mean, np.mean(sums, axis=0) * share[:, None], rtol=1e-6)


def test_a_sensor_sees_the_outdoors_through_a_screen():
    from mitsuba_cfs.trace.kernels.path_options import PathOptions
    from mitsuba_cfs.trace.kernels.scattering import KlemsScattering
    from mitsuba_cfs.trace.matrices.straight_view import straight_view_matrix

    room, _ = rooms.test_room()
    alone, both = panes_before_a_screen()
    outside, eye = rooms.obstruction(), [[1.8, 2.0, 0.8]]
    clear = KlemsScattering(KLEMS_FULL, np.zeros((145, 145)), np.full(145, 0.5))
    expected, found = (
        straight_view_matrix(
            room, outside, groups, systems, eye, [UP], paths=PathOptions(1024, 1), subdivision=1
        ).values[0]
        for groups, systems in (([alone], [clear]), (both, [clear, None]))
    )
    # the same rays straight to the sky
    assert np.abs(found - expected).sum() < 0.001 * expected.sum()


@pytest.mark.parametrize("direction", [(0, -1, 0), UP])
def test_a_sensor_at_the_glass_sees_the_outdoors_as_by_its_solid_angle(direction):
    """Points of the window's area alone were 80 % off at 1 cm."""
    from mitsuba_cfs.trace.kernels.path_options import PathOptions
    from mitsuba_cfs.trace.kernels.scattering import AngularScattering
    from mitsuba_cfs.trace.matrices.straight_view import straight_view_matrix
    from mitsuba_cfs.trace.matrices.view import view_matrix

    room, groups = rooms.test_room()
    middle = groups[0].windows[0].triangles.mean(axis=(0, 1))
    apart = np.array([0.005, 0.02, 0.1, 0.4, 1.0])
    points = middle - apart[:, None] * groups[0].windows[0].normal
    clear = AngularScattering([0.5, 0.5], [0.0, 0.0])
    systems = [clear] + [None] * (len(groups) - 1)
    found = straight_view_matrix(
        room, Surfaces.none(), groups, systems, points, [direction] * 5, paths=PathOptions(2048, 1), subdivision=1
    ).values[0]
    view = view_matrix(room, groups, points, [direction] * 5, samples=256, max_depth=1)
    np.testing.assert_allclose(found.sum(axis=1), 0.5 * view.values[:, 0].sum(axis=1), rtol=0.03)


def test_the_reveal_between_panes_and_a_screen_lights_the_screen():
    """Light comes in through the panes, falls on the reveal and from there on the screen."""
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix

    x0, x1, z0, z1, d = rooms.X0, rooms.X1, rooms.Z0, rooms.Z1, -0.8
    reveal = rooms.surfaces(
        [
            (rooms.quad((x0, d, z0), (x0, 0, z0), (x1, 0, z0), (x1, d, z0)), 0.9),
            (rooms.quad((x0, d, z1), (x1, d, z1), (x1, 0, z1), (x0, 0, z1)), 0.9),
            (rooms.quad((x0, d, z0), (x0, d, z1), (x0, 0, z1), (x0, 0, z0)), 0.9),
            (rooms.quad((x1, d, z0), (x1, 0, z0), (x1, 0, z1), (x1, d, z1)), 0.9),
        ]
    )
    alone, (screen, panes) = panes_before_a_screen(0.8)
    expected, found = (
        daylight_matrix(reveal, groups, subdivision=1, samples=512).part(0) for groups in ([alone], [screen, panes])
    )
    error = np.sqrt((expected.sum_error**2).sum() + (found.sum_error**2).sum())
    total = expected.values.sum()
    assert error < 0.003 * total  # the reveal gives a quarter
    assert abs(found.values.sum() - total) < 4 * error


def test_a_sensor_of_several_places_is_their_mean(variant):
    from mitsuba_cfs.trace.matrices.daylight import sky_irradiance_matrix

    corners = np.array([(-50, -2, 1), (50, -2, 1), (50, 50, 1), (-50, 50, 1)], dtype=float)
    roof = Surfaces(corners[[[0, 1, 2], [0, 2, 3]]], np.zeros(2), np.zeros(2, dtype=int))
    places = np.array([[[0, -4, 0], [0, -1, 0]], [[0, -2, 0], [9, -3, 0]]], dtype=float)
    together, apart = (
        sky_irradiance_matrix(roof, p, np.full((len(p), 3), UP), subdivision=1, samples=65536)
        for p in (places, places.reshape(4, 3))
    )
    mean = apart.values.reshape(2, 2, -1).mean(axis=1)
    assert together.values.sum(axis=1) == pytest.approx(mean.sum(axis=1), rel=0.003)
    np.testing.assert_allclose(together.values, mean, atol=0.002)


def test_batches_of_few_paths_go_on_to_the_next_places(variant):
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.matrices.daylight import sky_irradiance_matrix

    corners = np.array([(-1e4, 0, 1), (1e4, 0, 1), (1e4, 1e4, 1), (-1e4, 1e4, 1)], dtype=float)
    roof = Surfaces(corners[[[0, 1, 2], [0, 2, 3]]], np.zeros(2), np.zeros(2, dtype=int))
    places = np.array([[[0, -5e3, 0], [0, 5e3, 0]]], dtype=float)  # free, and below the roof
    found = sky_irradiance_matrix(roof, places, [UP], subdivision=1, samples=1, stopping=Stopping(batches=32))
    assert found.values.sum() == pytest.approx(np.pi / 2, rel=0.01)


def test_groups_and_batches_traced_together_equal_those_traced_apart(monkeypatch):
    """The random numbers of a group in a batch are its own; one launch has as many as fit."""
    import drjit as dr

    from mitsuba_cfs.trace.kernels import window_paths
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix

    whole = rooms.test_room()[1][0]
    groups = cut_group(whole, even_regions(whole, 0.8))

    def traced() -> tuple[np.ndarray, int]:
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            values = daylight_matrix(
                rooms.obstruction(), groups, subdivision=1, samples=16, stopping=Stopping(3), seed=5
            ).values
            return values, len(dr.kernel_history([dr.KernelType.JIT]))

    together, launches = traced()
    monkeypatch.setattr(window_paths, "LANES", 1)
    apart, more = traced()
    assert len(groups) > 3
    assert np.array_equal(together, apart)
    assert more - launches >= 3 * len(groups) - 3  # all of them in 3 launches at most
