"""Point-in-time paths against the phase methods, which they must agree with in simple cases."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.sky.patches import ReinhartSky

from . import rooms

pytestmark = pytest.mark.usefixtures("variant")

K = KLEMS_FULL.size
POINTS = np.array([[1.8, 1.0, 0.8], [1.8, 0.3, 0.8], [1.0, 3.0, 0.8]])
UP = np.tile([0.0, 0.0, 1.0], (3, 1))
SKY = np.where(np.arange(146) == 0, 200.0, 1000.0)
SUN = np.array([0.3, -1.0, 0.8]) / np.linalg.norm([0.3, -1.0, 0.8])
SUN_LUMINANCE = 1e9
NO_SUN = [0, 0, -1]


def traced(systems, sky, *, scene=None, **options):
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.paths.point_in_time import point_in_time
    from mitsuba_cfs.trace.paths.scene import PathTracingScene

    interior, groups, exterior = scene or (*rooms.test_room(), rooms.NOTHING)
    room = PathTracingScene(interior, exterior, groups, systems)
    stopping = Stopping(batches=8)
    return point_in_time(room, sky, POINTS, UP, samples=32768, stopping=stopping, **options)


def klems(front: float, reflection_back: float = 0.0) -> KlemsBsdf:
    """A diffuser: Lambertian transmission `front`, reflection to the room `reflection_back`."""
    full = np.ones((K, K)) / np.pi
    return KlemsBsdf(KLEMS_FULL, KLEMS_FULL, front * full, front * full, 0 * full, reflection_back * full)


def diffuser(*values):
    import mitsuba as mi

    from mitsuba_cfs.bsdf.plugin import klems_plugin
    from mitsuba_cfs.trace.paths.scene import PathOptics

    return PathOptics(mi.load_dict(klems_plugin(klems(*values))))


def glass(tau: float = 1.0):
    from mitsuba_cfs.trace.kernels.scattering import AngularBeam
    from mitsuba_cfs.trace.paths.scene import PathOptics

    return PathOptics(None, AngularBeam(np.full(16, tau)))


def agree(found, expected, error=0.0):
    """Within 4 sigma of both."""
    sigma = np.hypot(found.standard_error, error)
    assert np.all(np.abs(found.values - expected) < 4 * sigma), (found.values / expected, sigma)


def test_a_clear_hole_is_the_two_phase_matrix():
    from mitsuba_cfs.trace.matrices.daylight import sky_irradiance_matrix
    from mitsuba_cfs.trace.paths.scene import Sky

    found = traced([glass()], Sky(SKY, NO_SUN, 0))
    room, _ = rooms.test_room()
    two = sky_irradiance_matrix(room, POINTS, UP, subdivision=1, samples=65536, max_depth=32)
    agree(found, two.values @ SKY, np.sqrt(two.standard_error**2 @ SKY**2))


def test_a_diffuser_under_sky_and_sun_is_the_three_phase_method():
    from mitsuba_cfs import phases
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix
    from mitsuba_cfs.trace.matrices.view import view_matrix
    from mitsuba_cfs.trace.paths.scene import Sky
    from mitsuba_cfs.trace.sun.direct import SUN_SOLID_ANGLE

    tau = 0.5
    found = traced([diffuser(tau)], Sky(SKY, SUN, SUN_LUMINANCE))
    room, groups = rooms.test_room()
    view = view_matrix(room, groups, POINTS, UP, samples=16384)
    daylight = daylight_matrix(rooms.NOTHING, groups, subdivision=1, samples=2048)
    transmission = klems(tau).transmission_matrix()
    sky = phases.three_phase(view.values, [transmission], daylight.values, SKY[:, None])[:, 0]
    irradiance = SUN_LUMINANCE * SUN_SOLID_ANGLE * -SUN[1]
    sun = view.values.sum(axis=(1, 2)) * tau / np.pi * irradiance
    error = np.sqrt((view.standard_error**2).sum(axis=(1, 2))) * tau / np.pi * irradiance
    agree(found, sky + sun, error)


@pytest.mark.parametrize("up", [[0, 0, 1], [1, 0, 0], [-1, 0, 0]])
def test_a_system_scatters_by_the_up_vector_of_its_window(up):
    """Louvres on their side scattered as upright ones in paths: 15 % off beside rtrace."""
    from mitsuba_cfs import phases
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix
    from mitsuba_cfs.trace.matrices.view import view_matrix
    from mitsuba_cfs.trace.paths.scene import Sky, path_optics

    room, [group] = rooms.test_room()
    windows = tuple(replace(one, up=np.array(up, dtype=float)) for one in group.windows)
    groups = [replace(group, windows=windows)]
    from_above = KLEMS_FULL.incident_directions()[:, 1] > 0.3  # in the window's frame
    to_below = KLEMS_FULL.outgoing_directions()[:, 1] < -0.3
    front = np.outer(to_below, from_above) * 1.0
    system = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, front)
    sky = np.where(np.arange(146) == 0, 200.0, np.linspace(500.0, 5000.0, 146))
    found = traced([path_optics(system)], Sky(sky, NO_SUN, 0), scene=(room, groups, rooms.NOTHING))
    view = view_matrix(room, groups, POINTS, UP, samples=16384)
    daylight = daylight_matrix(rooms.NOTHING, groups, subdivision=1, samples=2048)
    matrices = [system.transmission_matrix()]
    expected = phases.three_phase(view.values, matrices, daylight.values, sky[:, None])[:, 0]
    agree(found, expected, 0.02 * expected)  # patches of the sky across those of the window


def test_the_sun_through_glass_is_the_direct_matrix_and_its_reflections():
    from mitsuba_cfs.trace.kernels.scattering import KlemsScattering
    from mitsuba_cfs.trace.paths.scene import Sky
    from mitsuba_cfs.trace.sun.direct import direct_sun_matrix

    dark = np.zeros(146)
    black = (rooms.test_room(scale=0.0)[0], rooms.test_room()[1], rooms.NOTHING)
    found = traced([glass(0.8)], Sky(dark, SUN, SUN_LUMINANCE), scene=black)
    _, groups = rooms.test_room()
    beam = KlemsScattering(KLEMS_FULL, np.zeros((K, K)), np.full(K, 0.8))
    direct = direct_sun_matrix(black[0], rooms.NOTHING, groups, [beam], POINTS, UP, suns=SUN[None])
    expected = direct.values[:, 0] * SUN_LUMINANCE
    agree(found, expected, direct.standard_error[:, 0] * SUN_LUMINANCE + 1e-3 * expected + 1e-6)
    bright = traced([glass(0.8)], Sky(dark, SUN, SUN_LUMINANCE))
    assert np.all(bright.values > expected)


def test_a_white_back_returns_light_to_the_room():
    """Closed form: a room seen as an integrating sphere gains where the window reflects."""
    from mitsuba_cfs.trace.paths.scene import Sky

    black, white = (traced([diffuser(0.3, back)], Sky(SKY, NO_SUN, 0)).values for back in (0.0, 0.7))
    assert np.all(white > black * 1.05)


def test_an_obstacle_before_one_of_two_windows_does_not_bias_the_paths():
    """In an L-shaped room paths that aim at a hidden window are given up, not counted twice."""
    from mitsuba_cfs.trace.matrices.daylight import sky_irradiance_matrix
    from mitsuba_cfs.trace.paths.scene import Sky

    interior, groups, _ = rooms.l_shaped_room()
    scene = (interior, groups, rooms.NOTHING)
    found = traced([glass(), glass()], Sky(SKY, NO_SUN, 0), scene=scene)
    two = sky_irradiance_matrix(interior, POINTS, UP, subdivision=1, samples=65536, max_depth=32)
    agree(found, two.values @ SKY, np.sqrt(two.standard_error**2 @ SKY**2))


def test_picture_shows_sky_ground_and_the_suns_disc():
    from mitsuba_cfs.images.view import fisheye, pixel_directions, pixel_solid_angles
    from mitsuba_cfs.trace.paths.scene import PathTracingScene, Sky
    from mitsuba_cfs.trace.pictures.point_in_time import point_in_time_picture

    interior, groups = rooms.test_room()
    room = PathTracingScene(interior, rooms.NOTHING, groups, [glass(0.5)])
    view = fisheye((1.8, 2.5, 1.2), (0, -1, 0), 128)
    sun = np.array([0.0, -1.0, 0.3]) / np.hypot(1, 0.3)
    picture = point_in_time_picture(room, Sky(SKY, sun, SUN_LUMINANCE), view, samples=256)
    directions, _ = pixel_directions(view)

    def at(x, y, z):
        return picture.ravel()[np.argmax(directions.reshape(-1, 3) @ [x, y, z])]

    assert at(0.3, -1, 0.2) == pytest.approx(500, rel=1e-4)
    assert at(0.3, -1, -0.08) == pytest.approx(100, rel=1e-4)
    near = np.arccos(np.clip(directions @ sun, -1, 1)) < np.radians(3)
    flux = (picture * pixel_solid_angles(view))[near].sum()
    disc = 2 * np.pi * (1 - np.cos(np.radians(0.2665)))
    # 256 places in pixels of 1.4 degrees: the disc covers 3 % of a pixel, some 8 of its places
    assert flux == pytest.approx(0.5 * SUN_LUMINANCE * disc, rel=0.25)


def test_sky_must_be_a_reinhart_sky():
    from mitsuba_cfs.trace.paths.scene import Sky

    assert ReinhartSky(1).size == 146
    with pytest.raises(ValueError, match="Reinhart"):
        Sky(np.ones(100), SUN, 1.0)


def test_daylight_coefficients_of_a_diffuser_are_the_three_phase_matrix():
    """V T D and paths through the BSDF, patch by patch, and the sky's light by their sum."""
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix
    from mitsuba_cfs.trace.matrices.view import view_matrix
    from mitsuba_cfs.trace.paths.point_in_time import daylight_coefficients
    from mitsuba_cfs.trace.paths.scene import PathTracingScene, Sky

    interior, groups = rooms.test_room()
    exterior = rooms.NOTHING  # something near lights parts of the window: V T D knows their mean
    system = diffuser(0.5)
    room = PathTracingScene(interior, exterior, groups, [system])
    found = daylight_coefficients(room, POINTS, UP, subdivision=1, samples=32768, stopping=Stopping(batches=8))
    view = view_matrix(interior, groups, POINTS, UP)
    daylight = daylight_matrix(exterior, groups, subdivision=1)
    T = klems(0.5).transmission_matrix()
    expected = view.values[:, 0] @ T @ daylight.values[0]
    # errors of V T D are far below those of the paths; 438 entries
    score = (found.values - expected) / np.maximum(found.standard_error, 1e-12)
    seen = expected > 1e-3 * expected.max()
    assert abs(score[seen].mean()) < 0.4 and score[seen].std() < 1.6
    total, error = found.values.sum(axis=1), found.error_of(np.ones(146))
    assert np.all(np.abs(total - expected.sum(axis=1)) < 5 * error + 2e-3 * total)
    lit = traced([system], Sky(SKY, NO_SUN, 0), scene=(interior, groups, exterior))
    assert np.all(np.abs(found.values @ SKY - lit.values) < 5 * np.hypot(found.error_of(SKY), lit.standard_error))
    with pytest.raises(ValueError, match="needs a `key`"):
        daylight_coefficients(room, POINTS, UP, cache=True)
