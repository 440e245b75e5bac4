"""DGP without pictures: the formula, the visible sun, and the DGP of pictures of the same views."""

from __future__ import annotations

import numpy as np
import pytest

from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.bsdf.glazing import Glazing, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.glare.indices import daylight_glare_probability
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.glare_map import glare_of_eyes, probability
from mitsuba_cfs.methods.light import with_view
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.sun import SUN_RADIUS
from mitsuba_cfs.trace.sun.sun_discs import visible_suns
from scenes.demo import WEATHER
from scenes.fenestration.systems import FenestrationSystem
from scenes.room.inputs import room_inputs, skies_for
from scenes.room.light import RoomLight, room_light
from scenes.room.options import RoomOptions

HOURS = 16
EYES = np.array([[1.5, 1.2, 1.2], [2.2, 3.0, 1.2]])
DIRECTIONS = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def test_the_formula_is_that_of_one_picture():
    illuminance, contrast = np.array([0.0, 300.0, 2500.0, 9000.0]), np.array([0.0, 1e4, 3e7, 1e9])
    expected = [daylight_glare_probability(*pair) for pair in zip(illuminance, contrast, strict=True)]
    np.testing.assert_allclose(probability(illuminance, contrast), expected, rtol=1e-12)


@pytest.fixture(scope="module")
def clear_room(variant) -> RoomLight:
    return room_behind(0.7)


def room_behind(transmittance: float) -> RoomLight:
    """The light of a room behind a pane to the south, in bright hours of a year."""
    weather = read_epw(WEATHER)
    building = shoebox(3.0, 4.0, windows=[WindowRectangle(0.5, 0.8, 2.0, 1.8)])
    space = building.spaces[0]
    klems = specular_klems(Glazing("pane", transmittance, 0.1, 0.1, 2), KLEMS_FULL)
    systems = {w.guid: (FenestrationSystem("pane", klems, klems, source="made"),) for w in space.windows}
    options = RoomOptions.of(
        sky_subdivision=1, sensor_samples=1024, patch_samples=1024, sun_points=32, picture_size=120, sensor_spacing=1.5
    )
    skies = skies_for(weather, options.sampling)
    sunny = np.flatnonzero((skies.illuminance > 2e4) & (skies.direction[:, 1] < -0.2))
    skies = skies.part(sunny[:: len(sunny) // HOURS])
    return room_light(room_inputs(building, space, systems, weather, options, skies=skies))


def test_the_map_has_the_dgp_of_pictures(clear_room):
    """Towards the window with an RMS of 0.03: a sky of few patches is blurred by those of the window.

    A sunlit wall before the eye is left out and makes the map lower.
    """
    light = clear_room.light
    dgp = glare_of_eyes(light, EYES, DIRECTIONS)
    assert dgp.shape == (2, 3, len(light.sky.lit))
    to_window = hourly_glare(with_view(light, fisheye(EYES[1], DIRECTIONS[0], 120))).dgp
    assert np.sqrt(np.mean((dgp[1, 0] - to_window) ** 2)) < 0.03
    off = dgp[1, 1] - hourly_glare(with_view(light, fisheye(EYES[1], DIRECTIONS[1], 120))).dgp
    assert off.max() < 0.02 and np.median(np.abs(off)) < 0.01
    assert (dgp[:, 2] < dgp[:, 0]).all()  # the back to the window


def test_the_visible_sun_is_a_glare_source(variant):
    """Behind dark glass, where E_v alone makes no glare: the DGP of pictures, which have the disc too."""
    light = room_behind(0.02).light
    scene, sky = light.scene, light.sky
    (way,) = visible_suns(scene.interior, scene.exterior, scene.groups, EYES[:1], sky.direction)
    np.testing.assert_allclose(way.directions, sky.direction, atol=1e-6)
    x, y, z = sky.direction.T
    t = EYES[0, 1] / -y  # to the plane of the window
    across, up = EYES[0, 0] + t * x, EYES[0, 2] + t * z
    margin = 0.3 + 2 * SUN_RADIUS * t  # of a reveal
    inside = (across > 0.5 + margin) & (across < 2.5 - margin) & (up > 0.8 + margin) & (up < 2.6 - margin)
    outside = (across < 0.4) | (across > 2.6) | (up > 2.7)
    assert inside.any() and outside.any()
    np.testing.assert_allclose(way.share[0, 0, inside], 1.0, atol=0.01)
    assert not way.share[0, 0, outside].any()
    dgp = glare_of_eyes(light, EYES[:1], DIRECTIONS[:1])[0, 0]
    pictures = hourly_glare(with_view(light, fisheye(EYES[0], DIRECTIONS[0], 120))).dgp
    np.testing.assert_allclose(dgp[inside], pictures[inside], atol=0.01)
    assert dgp[inside].min() > 0.35 > dgp[outside].max()
