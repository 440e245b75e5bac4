"""Five phases with many states of many window groups, and with windows that reflect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs import phases
from mitsuba_cfs.bsdf.evaluate import held_beams
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.methods.coefficients import GroupCoefficients, direct_transmittance, group_coefficients
from mitsuba_cfs.methods.light import daylight_coefficients, illuminance, illuminance_with_error
from mitsuba_cfs.methods.phase_light import SensorLight, over_hours, phase_light
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.methods.point_in_time import PathLight
from mitsuba_cfs.methods.reflected_sun import reflected_sun, reflected_to_sensors
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from tests.trace.phase_rooms import OMEGA, POINTS, K, diffuser, glass, glass_transmittance, lit, sun_series, traced

from . import rooms

pytestmark = pytest.mark.usefixtures("variant")


@pytest.fixture(scope="module")
def corner():
    """Two window groups below a shade, three sensors, three suns before one or both of them."""
    room, groups, shade = rooms.l_shaped_room()
    points = np.array([[2.0, 1.0, 0.8], [1.0, 4.5, 0.8], [5.0, 4.5, 0.8]])
    matrices = traced(room, shade, groups, points, subdivision=1, window_parts=1)
    sky = ReinhartSky(1)
    facing = np.stack([sky.directions @ group.frame[2] for group in groups])
    facing[:, np.abs(sky.directions[:, 2] - 0.4) > 0.2] = -1
    suns = [facing[0].argmax(), facing[1].argmax(), facing.min(axis=0).argmax()]
    return matrices, sun_series(sky, suns, 3000.0)


def test_each_group_has_a_state_of_its_own_in_each_hour(corner):
    """Every hour of a schedule is the room with these systems and no others."""
    matrices, sky = corner
    systems = [[glass(), diffuser(0.4)], [diffuser(0.2), glass()]]
    schedule = np.array([[0, 1, 1], [1, 1, 0]])
    found = lit(matrices, systems, sky, schedule)
    for h in range(3):
        now = [[systems[g][schedule[g, h]]] for g in range(2)]
        # C_ds' streams are keyed by the number of the sun: all three are traced in both
        assert found[:, h] == pytest.approx(lit(matrices, now, sky)[:, h], rel=1e-9)
    together = lit(matrices, systems, sky, np.array([1, 1, 1]))
    assert np.array_equal(together, lit(matrices, systems, sky, np.ones((2, 3), dtype=int)))
    with pytest.raises(ValueError, match=r"expected \[2, 3\]"):
        lit(matrices, systems, sky, np.zeros((3, 3), dtype=int))


def test_a_group_with_fewer_states_ends_with_its_last(corner):
    matrices, sky = corner
    systems = [[glass(), diffuser(0.4)], [diffuser(0.2)]]
    one, other = (lit(matrices, systems, sky, np.full(3, j)) for j in (0, 1))
    alone = lit(matrices, [[glass()], [diffuser(0.2)]], sky)
    assert one == pytest.approx(alone, rel=1e-9)
    assert not np.allclose(one, other, rtol=0.01)


def test_the_sum_of_the_groups_is_the_five_phase_sum(corner):
    """V T D s - V_d T D_d s_d - the reflected beam by patches + itself, straight views, C_ds s."""
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.kernels.scattering import patch_beams, through_beams
    from mitsuba_cfs.trace.sun.direct import direct_sun_matrix

    matrices, sky = corner
    scene, chosen = matrices.scene, [glass(), diffuser(0.4)]
    found = lit(matrices, [[one] for one in chosen], sky)
    t, ways = [c.transmission for c in chosen], [c.scattering for c in chosen]
    exact = direct_sun_matrix(
        scene.interior,
        scene.exterior,
        scene.groups,
        ways,
        scene.points,
        scene.normals,
        suns=sky.direction,
        window_points=256,
        stopping=Stopping(batches=4),
    )
    view, direct_view = matrices.sensors.values, matrices.direct_sensors
    expected = phases.three_phase(view, t, matrices.daylight.values, sky.whole)
    expected -= phases.three_phase(direct_view, t, matrices.direct_daylight, sky.sun)
    beams = patch_beams(ways, KLEMS_FULL)
    held = [held_beams(one, beam, KLEMS_FULL) for one, beam in zip(t, beams, strict=True)]
    assert np.array_equal(held[0], t[0])  # glass is a beam and nothing else
    at_sun = through_beams(scene.groups, ways, sky.direction)
    by_patch, _ = phases.sun_beams(held, at_sun, matrices.direct_daylight, sky.sun)
    groups = [one for (one,) in group_coefficients(matrices, [[one] for one in chosen])]
    sun = reflected_sun(matrices, sky)
    expected -= np.einsum("sgk,gkh->sh", view - direct_view, by_patch)
    for added, _, _ in reflected_to_sensors(matrices, sun, list(enumerate(groups))):
        expected += added
    whole, direct = groups[0].straight.values.values, groups[0].straight.direct
    lost = direct_view[:, 0] * groups[0].beam
    expected += (whole - lost @ matrices.daylight.values[0]) @ sky.whole
    expected -= (direct - lost @ matrices.direct_daylight[0]) @ sky.sun
    assert groups[1].straight is None
    expected += exact.values * sky.illuminance / SUN_SOLID_ANGLE
    assert found == pytest.approx(expected, rel=1e-5)  # window luminances in single precision


def test_a_beam_that_lies_beside_the_diagonal_too_is_not_counted_twice(corner):
    """As a tensor tree's, whose cells lie across patches: eyes behind one had 14 % too much."""
    from mitsuba_cfs.methods.optics import MatrixOptics

    matrices, clear = corner[0], glass()
    spread = 0.8 * clear.transmission + 0.2 * np.roll(clear.transmission, 1, axis=0)
    beside = MatrixOptics(spread, clear.scattering)
    assert direct_transmittance(matrices, clear, 0).any()
    assert not direct_transmittance(matrices, beside, 0).any()


def test_what_t_has_of_a_beam_beside_the_diagonal_is_taken_with_it():
    clear = glass_transmittance(KLEMS_FULL.incident_directions()[:, 2])
    scattered = np.full((K, K), 0.05 / np.pi) * OMEGA
    near = KLEMS_FULL.outgoing_directions() @ KLEMS_FULL.outgoing_directions().T
    beside = np.argsort(-near, axis=0)[1]  # the patch next to each
    T, beam = scattered.copy(), 0.9 * clear
    T[np.arange(K), np.arange(K)] += 0.7 * beam
    T[beside, np.arange(K)] += 0.3 * beam * OMEGA / OMEGA[beside]
    held = held_beams(T, beam, KLEMS_FULL)
    assert OMEGA @ held / OMEGA == pytest.approx(beam, rel=1e-9)  # all of its light
    assert np.all(held <= T + 1e-12) and np.all(held >= 0)
    assert held[near < np.cos(np.radians(40))].max() == 0
    diagonal = held_beams(scattered + np.diag(beam), beam, KLEMS_FULL)
    assert diagonal == pytest.approx(np.diag(beam), abs=1e-12)


def test_the_room_has_a_beam_once_wherever_t_has_it(corner):
    """T of a tensor tree has a part of its beam beside the diagonal: the room reflects it once."""
    from mitsuba_cfs.methods.optics import MatrixOptics

    clear, sky = glass(), replace(corner[1], whole=corner[1].sun)
    room, groups = rooms.test_room()
    scene = traced(room, rooms.NOTHING, groups, POINTS, subdivision=1)
    ways = KLEMS_FULL.outgoing_directions()
    beside = np.argsort(-(ways @ ways.T), axis=0)[1]
    spread = 0.6 * clear.transmission
    spread[beside, np.arange(K)] += 0.4 * np.diag(clear.transmission) * OMEGA / OMEGA[beside]
    tree = MatrixOptics(spread, clear.scattering)
    found, expected = (lit(scene, [[one]], sky) for one in (tree, clear))
    assert expected[:, [0, 2]].min() > 500  # the second sun is behind the facade
    assert found == pytest.approx(expected, rel=1e-3)


def test_the_suns_light_by_group_adds_up_to_that_of_the_room(corner):
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.sun.direct import direct_sun_matrix

    matrices, sky = corner
    scene, ways = matrices.scene, [diffuser(0.2).scattering, diffuser(0.4).scattering]
    around = scene.interior, scene.exterior, scene.groups, ways, scene.points, scene.normals
    both, each = (
        direct_sun_matrix(*around, suns=sky.direction, stopping=Stopping(batches=4), by_group=by)
        for by in (False, True)
    )
    assert each.values.shape == (2, 3, 3) and np.all(each.values.max(axis=(1, 2)) > 0)
    assert each.values.sum(axis=0) == pytest.approx(both.values, rel=1e-5)
    alone = direct_sun_matrix(
        scene.interior,
        scene.exterior,
        scene.groups,
        [ways[0], None],
        scene.points,
        scene.normals,
        suns=sky.direction,
        stopping=Stopping(batches=4),
    )
    assert each.values[0] == pytest.approx(alone.values, rel=1e-6)


def mirror_glass(back: float):
    """Glass of 0.7 whose room side is a mirror, by phases and by paths."""
    from mitsuba_cfs.bsdf.klems import KlemsBsdf
    from mitsuba_cfs.methods.optics import BsdfOptics

    through, mirror = np.diag(0.7 / OMEGA), np.diag(back / OMEGA)
    return BsdfOptics(KlemsBsdf(KLEMS_FULL, KLEMS_FULL, through, through, np.zeros((K, K)), mirror))


def angular_glass(back: float):
    """A transmittance of 0.55 by AngularOptics; half of its reflection is a mirror's."""
    from mitsuba_cfs.methods.optics import AngularOptics

    half = np.full(64, back / 2)
    return AngularOptics(np.full(64, 0.55), mirrored=half, reflected=half)


@pytest.mark.parametrize("kind", [mirror_glass, angular_glass])
def test_windows_reflect_the_light_of_the_room_as_paths_have_it(kind):
    """A bright room with a front of glass that reflects 0.4 to it: a tenth of the back's light."""
    from mitsuba_cfs.methods.scene import DaylightScene, Sampling
    from mitsuba_cfs.surfaces import WindowGroup, WindowSurface

    w, d, h = 4.0, 5.0, 3.0
    quads = [
        rooms.quad((0, 0, 0), (w, 0, 0), (w, d, 0), (0, d, 0)),
        rooms.quad((0, 0, h), (0, d, h), (w, d, h), (w, 0, h)),
        rooms.quad((0, d, 0), (w, d, 0), (w, d, h), (0, d, h)),
        rooms.quad((0, 0, 0), (0, d, 0), (0, d, h), (0, 0, h)),
        rooms.quad((w, 0, 0), (w, 0, h), (w, d, h), (w, d, 0)),
    ]
    front = rooms.quad((0, 0, 0), (w, 0, 0), (w, 0, h), (0, 0, h))
    groups = [WindowGroup("south", (WindowSurface("front", front),))]
    points = np.array([[2.0, 1.0, 0.8], [2.0, 4.5, 0.8], [2.0, 4.9, 1.5]])
    normals = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    interior = rooms.surfaces([(q, 0.7) for q in quads])
    scene = DaylightScene(interior, rooms.NOTHING, groups, points, normals)
    sky = ReinhartSky(1)
    whole = np.full((sky.size, 1), 3000.0)
    whole[0] = 600.0
    hours = AnnualSky(whole, np.array([[0, -0.8, 0.6]]), np.zeros(1), np.arange(1), 1, np.zeros_like(whole))
    few = Sampling(sensor_samples=65_536, patch_samples=8_192, hour_samples=262_144, subdivision=1)
    found = {}
    for back in (0.0, 0.4):
        system = [[kind(back)]]
        paths = illuminance(PathLight(scene, system, hours, few))
        for five in (False, True):
            light = phase_light(phase_matrices(scene, few, five_phase=five), system, hours)
            lit_by_phases = illuminance(light)
            print(back, five, (lit_by_phases / paths).ravel(), illuminance_with_error(light)[1])
            # three errors of both, and a tenth of the gain: W is a mean over the whole front
            np.testing.assert_allclose(lit_by_phases, paths, rtol=0.022 if back else 0.015)
            factor = daylight_coefficients(light) @ whole
            np.testing.assert_allclose(factor, lit_by_phases, rtol=1e-5)
        found[back] = lit_by_phases
    gain = found[0.4] / found[0.0] - 1
    print("gain by reflection", gain.ravel())
    assert gain[1] > 0.1  # far above the tolerance: black windows would not pass


@pytest.mark.parametrize("lit", [1.0, 0.02])
def test_product_with_the_sun_alone_is_that_with_any_sky(lit):
    random = np.random.default_rng(1)
    matrix = random.random((2, 7, 40)).astype(np.float32)
    sky = (random.random((40, 50)) * (random.random((40, 50)) < lit)).astype(np.float32)
    sky[3, 10] = 1.0
    found = phases.times_sky(matrix, sky)
    assert found.dtype == np.float32 and found.flags.c_contiguous
    np.testing.assert_allclose(found, np.matmul(matrix, sky), rtol=1e-5, atol=1e-6)
    whole = AnnualSky(sky, np.zeros((50, 3)), np.zeros(50), np.arange(50), 50, sun=sky)
    assert isinstance(whole.lit_sun, np.ndarray) == (lit == 1.0)
    assert whole.lit_sun is whole.lit_sun
    np.testing.assert_array_equal(phases.times_sky(matrix, whole.lit_sun), found)
    dark = whole.part(np.arange(10))  # has its own, not that of all hours
    few = phases.times_sky(matrix, dark.lit_sun)
    np.testing.assert_allclose(few, found[..., :10], rtol=1e-5)


@pytest.mark.parametrize("five", [False, True])
def test_a_groups_light_over_the_hours_is_the_sum_of_each(five):
    """Which the share of light by glass between rooms is of."""
    random = np.random.default_rng(2)
    sky = random.random((40, 9))
    sun = sky * (random.random(sky.shape) < 0.1) if five else None
    hours = AnnualSky(sky, np.zeros((9, 3)), np.zeros(9), np.arange(9), 9, sun=sun)
    whole, by_sun = random.random((2, 3, 40))
    added, straight = random.random((2, 3, 9))
    expected = whole @ sky
    light = SensorLight(GroupCoefficients(glass(), np.zeros(K), None, whole, None))
    if sun is not None:
        expected += added + straight - by_sun @ sun
        coefficients = replace(light.coefficients, by_sun=by_sun)
        light = SensorLight(coefficients, added, straight)
    np.testing.assert_allclose(over_hours(light, hours), expected.sum(axis=1), rtol=1e-12)
