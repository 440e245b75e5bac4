"""The sun that surfaces reflect to windows and sensors, by shadow rays from shared places."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.surfaces import Surfaces

from . import rooms
from .test_subdivision import clear_glass, overhang

pytestmark = pytest.mark.usefixtures("variant")

K = KLEMS_FULL.size
LUX = 80_000.0


def towards(altitude_deg: float, azimuth_deg: float) -> np.ndarray:
    """The sun [3]; azimuth from south to east."""
    a, z = np.radians(altitude_deg), np.radians(azimuth_deg)
    return np.array([np.cos(a) * np.sin(z), -np.cos(a) * np.cos(z), np.sin(a)])


def sun_alone(direction: np.ndarray) -> AnnualSky:
    """One hour of a black sky with the sun."""
    sky = ReinhartSky(1)
    patches = np.zeros((sky.size, 1))
    nearest = 1 + int(np.argmax(sky.directions[1:] @ direction))
    patches[nearest] = LUX / sky.solid_angles[nearest]
    return AnnualSky(patches, direction[None], np.array([LUX]), np.arange(1), 1, patches)


def scene(exterior: Surfaces):
    from mitsuba_cfs.methods.scene import DaylightScene

    interior, groups = rooms.test_room()
    points = np.array([[1.8, y, 0.8] for y in (0.5, 1.5, 4.0)])
    return DaylightScene(interior, exterior, groups, points, np.tile([0.0, 0.0, 1.0], (3, 1)))


def both(exterior: Surfaces, sky: AnnualSky):
    """Five phases without the direct sun, the same by paths, and the error of these [S]."""
    from mitsuba_cfs.methods.optics import BsdfOptics
    from mitsuba_cfs.methods.path_light import PathSystems
    from mitsuba_cfs.methods.phase_light import PhaseSystems
    from mitsuba_cfs.methods.phase_scene import PhaseScene
    from mitsuba_cfs.methods.sampling import Sampling

    system = [[BsdfOptics(clear_glass())]]
    chosen = Sampling(sensor_samples=32_768, patch_samples=4096, subdivision=1, hour_samples=65_536)
    light = PhaseSystems(PhaseScene(scene(exterior), chosen), system).light(sky)
    paths, error = PathSystems(scene(exterior), system, chosen).light(sky).estimate()
    direct = light.direct_sun()[:, 0]
    return light.illuminance()[:, 0] - direct, paths[:, 0] - direct, error * paths[:, 0]


def agrees(found, expected, error) -> None:
    """Within three standard errors of the paths, and of five phases: 3 % and 3 lx of 80,000."""
    noise = np.sqrt(error**2 + (0.03 * expected) ** 2 + 3.0**2)
    assert np.all(np.abs(found - expected) < 3 * noise), found / expected


def test_a_wide_wall_in_the_sun_has_the_same_luminance_in_all_patches():
    from mitsuba_cfs.trace.reflected_sun import outdoor_light, window_shares
    from mitsuba_cfs.trace.scene import TracedScene

    far = rooms.quad((-1e3, -4, -1e3), (1e3, -4, -1e3), (1e3, -4, 1e3), (-1e3, -4, 1e3))
    outside = TracedScene(rooms.surfaces([(far, 0.4)]), rooms.test_room()[1])
    suns = np.array([towards(30, 180), towards(60, 150), towards(30, 0)])  # the last behind it
    found = outdoor_light(window_shares(outside, samples=64), outside, suns, np.full(3, LUX))
    expected = 0.4 / np.pi * LUX * np.maximum(suns[:, 1], 0)
    off = found.reshape(K, 3) - expected
    # the window hides the sun from as much of the wall as it is large itself
    steep = KLEMS_FULL.centres()[0] < np.radians(80)
    assert np.all(np.abs(np.median(off[steep], axis=0)) < 1e-4 * LUX)
    assert np.all(off[steep] < 1e-4 * LUX)
    assert np.all(off[steep].mean(axis=0) > -0.06 * expected.max())
    assert np.all(found.reshape(K, 3)[:, 2] == 0)


def test_each_place_stands_for_those_of_its_own_face():
    from mitsuba_cfs.trace.reflected_sun import outdoor_light, window_shares
    from mitsuba_cfs.trace.scene import TracedScene

    # a floor and a wall that meet: only the floor is in the sun, and only patches below see it
    wall = rooms.quad((-40, -4, 0), (40, -4, 0), (40, -4, 60), (-40, -4, 60))
    floor = rooms.quad((-40, -4, 0), (40, -4, 0), (40, 0, 0), (-40, 0, 0))
    surfaces = rooms.surfaces([(wall, 1e-3), (floor, 0.5)])
    outside = TracedScene(surfaces, rooms.test_room()[1])
    sun = np.array([[0.0, 0.0, 1.0]])
    shares = window_shares(outside, samples=256)
    found = outdoor_light(shares, outside, sun, np.array([LUX]))[:, 0]
    down = (KLEMS_FULL.incident_directions() @ rooms.test_room()[1][0].frame)[:, 2]
    sunlit, dark = found[down < -0.75], found[down > 0.3]
    assert sunlit == pytest.approx(0.5 / np.pi * LUX, rel=0.01)
    assert dark.max() < 1e-3 * sunlit.mean()  # the wall's own thousandth of it


@pytest.mark.slow
@pytest.mark.parametrize("sun", [towards(45, 10), towards(30, 50)], ids=["high", "aside"])
def test_the_sun_reflected_below_an_overhang_is_that_of_paths(sun):
    found, expected, error = both(overhang(2.0), sun_alone(sun))
    agrees(found, expected, error)


def test_the_beam_that_the_room_reflects_is_that_of_paths():
    found, expected, error = both(rooms.NOTHING, sun_alone(towards(30, 50)))
    agrees(found, expected, error)


@pytest.mark.slow
def test_a_sun_behind_the_facade_lights_what_stands_before_it():
    wall = rooms.quad((-30, -5, -4), (30, -5, -4), (30, -5, 9), (-30, -5, 9))
    found, expected, error = both(rooms.surfaces([(wall, 0.4)]), sun_alone(towards(40, 160)))
    assert expected.min() > 100
    agrees(found, expected, error)
