"""The direct sun through a window against closed forms, and the five-phase sum."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.evaluate import neighbours, through_peak
from mitsuba_cfs.bsdf.klems import KLEMS_FULL

from . import rooms

pytestmark = pytest.mark.usefixtures("variant")

K = KLEMS_FULL.size
UP = [0.0, 0.0, 1.0]
POINTS = np.array([[1.8, 1.0, 0.8], [1.8, 0.3, 0.8], [1.0, 3.0, 0.8]])
NORMALS = np.tile(UP, (3, 1))
SUNS = np.array([[0, -1, 0.5], [0.5, -1, 0.8], [0, 1, 1.0], [0, -0.3, 1]])
SUNS = SUNS / np.linalg.norm(SUNS, axis=1)[:, None]


def matrix(scattering, exterior=rooms.NOTHING, suns=SUNS, points=POINTS, **options):
    from mitsuba_cfs.trace.sun.direct import direct_sun_matrix

    room, groups = rooms.test_room()
    normals = np.tile(UP, (len(points), 1))
    return direct_sun_matrix(room, exterior, groups, [scattering], points, normals, suns=suns, **options)


def diffuser(tau: float):
    from mitsuba_cfs.trace.kernels.scattering import KlemsScattering

    return KlemsScattering(KLEMS_FULL, np.full((K, K), tau / np.pi), np.zeros(K))


def glass(tau: float):
    from mitsuba_cfs.trace.kernels.scattering import KlemsScattering

    return KlemsScattering(KLEMS_FULL, np.zeros((K, K)), np.full(K, tau))


def test_a_diffuser_in_the_sun_is_a_window_of_even_luminance():
    from mitsuba_cfs.trace.matrices.view import view_matrix
    from mitsuba_cfs.trace.sun.direct import SUN_SOLID_ANGLE

    room, groups = rooms.test_room()
    found = matrix(diffuser(0.5))
    direct = view_matrix(room, groups, POINTS, NORMALS, max_depth=1).values.sum(axis=(1, 2))
    cosine = np.maximum(SUNS @ [0, -1, 0], 0)
    expected = direct[:, None] * (0.5 / np.pi) * cosine * SUN_SOLID_ANGLE
    # 16 batches of 256 points: 4 sigma, and 0.3 % for the 4096 paths behind `direct`
    assert np.all(np.abs(found.values - expected) <= 4 * found.standard_error + 0.003 * expected)
    assert np.all(found.values[:, 2] == 0)  # the sun behind the facade


def test_an_even_window_has_the_closed_form_of_its_view_factor():
    from mitsuba_cfs.trace.sun.direct import SUN_SOLID_ANGLE

    from .test_matrices import window_factor

    found = matrix(diffuser(np.pi), suns=SUNS[:1], window_points=2048)
    expected = np.array([np.pi * window_factor(*point) for point in POINTS]) * -SUNS[0, 1]
    ratio = found.values[:, 0] / SUN_SOLID_ANGLE / expected
    error = found.standard_error[:, 0] / found.values[:, 0]
    assert np.all(np.abs(ratio - 1) < 4 * error + 2e-5)
    assert error.max() < 2e-3


def test_sun_through_glass_lights_the_sensors_in_its_beam():
    from mitsuba_cfs.trace.sun.direct import SUN_SOLID_ANGLE

    found = matrix(glass(0.8)).values / SUN_SOLID_ANGLE
    foot = POINTS[:, None] - SUNS[None] * (POINTS[:, 1, None] / np.minimum(SUNS[:, 1], -1e-9))[..., None]
    across = (foot[..., 0] > rooms.X0) & (foot[..., 0] < rooms.X1)
    within = across & (foot[..., 2] > rooms.Z0) & (foot[..., 2] < rooms.Z1) & (SUNS[:, 1] < 0)
    assert within.any() and not within.all()
    expected = np.where(within, 0.8 * SUNS[:, 2], 0)
    # the mean cosine of a disc of 0.27 degrees is that of its centre to 1e-4 at these heights
    assert found == pytest.approx(expected, abs=3e-4)


@pytest.mark.parametrize("share", [0.5, 0.25])
def test_a_half_hidden_disc_gives_its_visible_part(share):
    """An edge outdoors covers the left of the disc seen from the sensor."""
    from mitsuba_cfs.sky.sun import SUN_RADIUS, SUN_SOLID_ANGLE
    from mitsuba_cfs.trace.kernels.estimate import Stopping

    sun = np.array([0.0, -1.0, 0.5]) / np.sqrt(1.25)
    x, far = 1.8, 100.0
    # chord that leaves `share` of the disc: t - sin t cos t = pi share
    t = np.linspace(0, np.pi, 20001)
    chord = np.cos(np.interp(np.pi * share, t - np.sin(t) * np.cos(t), t))
    edge = x + chord * SUN_RADIUS * far * np.sqrt(1.25)
    cover = rooms.surfaces([(rooms.quad((-90, -far, 0), (edge, -far, 0), (edge, -far, 200), (-90, -far, 200)), 0.0)])
    point = np.array([[x, 1e-3, 1.8]])
    found = matrix(glass(1.0), cover, sun[None], point, stopping=Stopping(batches=64))
    value = found.values[0, 0] / SUN_SOLID_ANGLE / sun[2]
    error = found.standard_error[0, 0] / SUN_SOLID_ANGLE / sun[2]
    assert error < 0.02
    assert value == pytest.approx(share, abs=4 * error + 0.005)


def half_hidden(x: float = 1.8, far: float = 100.0):
    """What covers the left half of the disc of a sun, and a sensor that sees the other."""
    sun = np.array([[0.0, -1.0, 0.5]]) / np.sqrt(1.25)
    cover = rooms.quad((-90, -far, 0), (x, -far, 0), (x, -far, 200), (-90, -far, 200))
    return rooms.surfaces([(cover, 0.0)]), sun, np.array([[x, 1e-3, 1.8]])


def test_a_shadows_edge_is_known_to_a_hundredth_and_the_rest_exactly():
    """As five phases ask for it: with 64 directions on the disc a sensor at an edge was 9 % off."""
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.sun.direct import SUN_SOLID_ANGLE

    cover, sun, point = half_hidden()
    points = point + np.array([[0, 0, 0], [0.6, 0, 0], [-0.6, 0, 0]])
    four = Stopping(batches=4)
    found = [matrix(glass(1.0), cover, sun, points, stopping=four, seed=s) for s in range(6)]
    share = np.stack([f.values[:, 0] for f in found]) / SUN_SOLID_ANGLE / sun[0, 2]
    assert share[:, 0] == pytest.approx(np.full(6, 0.5), abs=0.006)  # three of its spread
    assert share[:, 1] == pytest.approx(np.ones(6), abs=1e-3)  # 16 directions
    assert np.all(share[:, 2] == 0)
    error = np.stack([f.standard_error[:, 0] for f in found]) / SUN_SOLID_ANGLE / sun[0, 2]
    spread = share[:, 0].std(ddof=1)
    # five degrees of freedom: the spread is known to a factor of 2.5
    assert spread / 2.5 < np.sqrt((error[:, 0] ** 2).mean()) < 2.5 * spread
    assert np.all(error[:, 1:] == 0)


def test_a_suns_light_does_not_hang_on_the_suns_computed_with_it():
    cover, sun, point = half_hidden()
    both = np.concatenate([np.array([[0.5, -1.0, 0.8]]) / np.sqrt(1.89), sun])
    alone, last = matrix(glass(1.0), cover, sun, point), matrix(glass(1.0), cover, both, point)
    assert np.array_equal(alone.values[:, 0], last.values[:, 1])


def test_patches_next_to_each_other():
    around = neighbours(KLEMS_FULL)
    assert around[0].tolist() == list(range(1, 9))
    for k, near in enumerate(around):
        assert k not in near
        assert all(k in around[other] for other in near)  # both ways
    cosine = [
        (KLEMS_FULL.incident_directions()[near] @ KLEMS_FULL.incident_directions()[k]).min()
        for k, near in enumerate(around)
    ]
    assert min(cosine) > np.cos(np.radians(40))


def test_through_peak_takes_the_beam_and_leaves_the_rest():
    omega = KLEMS_FULL.projected_solid_angles()
    block = np.full((K, K), 0.1 / np.pi) + np.diag(0.7 / omega)
    peak = through_peak(block, KLEMS_FULL)
    assert peak.transmittance == pytest.approx(np.full(K, 0.7), rel=1e-9)
    assert peak.scattered == pytest.approx(np.full((K, K), 0.1 / np.pi), rel=1e-9)
    assert through_peak(peak.scattered, KLEMS_FULL).transmittance.max() == 0


def test_five_phase_of_clear_glass_is_never_negative_and_has_the_exact_sun():
    from mitsuba_cfs import phases
    from mitsuba_cfs.sky.patches import ReinhartSky
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix
    from mitsuba_cfs.trace.matrices.view import view_matrix
    from mitsuba_cfs.trace.sun.direct import SUN_SOLID_ANGLE

    room, groups = rooms.test_room()
    sky = ReinhartSky(1)
    sun_patch = np.zeros((sky.size, len(SUNS)))
    for h, sun in enumerate(SUNS):
        sun_patch[sky.index(sun), h] = 1.0 / sky.solid_angles[sky.index(sun)]  # 1 lx at normal
    diffuse = np.full((sky.size, len(SUNS)), 0.05)
    matrices = {}
    for depth in (32, 1):
        view = view_matrix(room, groups, POINTS, NORMALS, samples=1024, max_depth=depth, seed=3)
        daylight = daylight_matrix(rooms.NOTHING, groups, subdivision=1, samples=256, max_depth=depth, seed=3)
        matrices[depth] = (view.values, daylight.values)
    view, view_direct = matrices[32][0], matrices[1][0]
    assert np.all(view - view_direct >= -1e-9 * view)  # the direct part is a part, entry by entry
    clear = [np.eye(K)]
    whole = phases.three_phase(view, clear, matrices[32][1], sun_patch + diffuse)
    direct = phases.three_phase(view_direct, clear, matrices[1][1], sun_patch)
    exact = matrix(glass(1.0)).values
    without_sun = whole - direct
    assert np.all(without_sun >= 0)
    total = without_sun + exact / SUN_SOLID_ANGLE
    assert np.all(total > 0)
    in_beam = exact > 0
    assert np.all((total - without_sun)[in_beam] > 0.3)


def test_batches_in_one_launch_are_those_of_each_alone(monkeypatch):
    """The random numbers of a batch do not depend on what is traced with it."""
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.sun import direct

    cover, sun, point = half_hidden()
    suns = np.concatenate([sun, SUNS])
    for system in (diffuser(0.3), glass(0.7)):
        found = []
        for lanes in (direct.LANES, 2 * 64 * len(suns), 1):  # four, two and one in a launch
            with monkeypatch.context() as patch:
                patch.setattr(direct, "LANES", lanes)
                options = {"stopping": Stopping(batches=4), "window_points": 64}
                found.append(matrix(system, cover, suns, point, **options))
        assert (found[0].standard_error > 0).any()
        for one in found[1:]:
            np.testing.assert_array_equal(one.values, found[0].values)
            np.testing.assert_array_equal(one.standard_error, found[0].standard_error)
