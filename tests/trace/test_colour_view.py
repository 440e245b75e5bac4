"""Colours of an hour's daylight, and pictures in them."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.images.hdr import luminance
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.methods.colour_view import (
    coloured_picture,
    daylight_colour,
    daylight_rgb,
    sky_temperature,
    smoothed_colour,
    sun_colour,
    with_luminance,
)
from mitsuba_cfs.methods.optics import MatrixOptics
from mitsuba_cfs.methods.point_in_time import PathLight, path_picture
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.sky.annual import given_sky
from mitsuba_cfs.sky.patches import ReinhartSky
from tests.trace import rooms

SOUTH_40 = (0.0, -np.cos(np.radians(40)), np.sin(np.radians(40)))


def sky_of(beam: float, diffuse: float):
    """A sky of one hour by its irradiances [W/m2]."""
    return given_sky([SOUTH_40], [beam], [diffuse], 1, day_of_year=172)


def test_temperatures_are_chains_and_those_of_daylight() -> None:
    assert sky_temperature([3.0, 5000.0], 0.0) == pytest.approx(6514.0)
    # 1e6 / (-132.1 + 59.77 log10 L)
    assert sky_temperature([10_000.0, 5_000.0], 1.0) == pytest.approx([9347.5, 11237.5], rel=1e-4)
    assert daylight_rgb(6504.0) == pytest.approx(np.ones(3), abs=5e-3), "D65 is sRGB's white"
    blue, yellow = daylight_rgb(15_000.0), daylight_rgb(4_500.0)
    assert blue[2] > 1.3 > blue[0] > 0 and yellow[0] > 1.1 > yellow[2]


def test_a_low_sun_is_redder() -> None:
    high, low = sun_colour(0.9), sun_colour(0.1)
    assert low[0] > 1.5 > high[0] > 1.0 > high[2] > low[2]
    # 5,360 K at an air mass of 1.15: between CIE's D50 and D55
    d50, d55 = daylight_rgb([5003.0, 5503.0])
    assert d55[0] < sun_colour(np.cos(np.radians(30)))[0] < d50[0]


@pytest.mark.parametrize(("beam", "diffuse"), [(800.0, 100.0), (0.0, 120.0), (300.0, 250.0)])
def test_grey_is_grey_under_the_whole_daylight(beam, diffuse) -> None:
    sky = sky_of(beam, diffuse)
    found = daylight_colour(sky, 0)
    weights = ReinhartSky(1).horizontal_weights
    whole = (sky.without_sun(0) * weights) @ found.patches
    whole = whole + sky.illuminance[0] * SOUTH_40[2] * found.sun
    assert whole / whole.mean() == pytest.approx(np.ones(3), rel=1e-5)
    assert found.patches[0] == pytest.approx(np.ones(3)), "the ground is grey under both"
    if beam > 500:
        assert found.sun[0] > found.sun[2] and found.patches[100:, 2].mean() > 1.2


def test_a_picture_keeps_its_luminance() -> None:
    bands, grey = np.array([[[2.0, 1.0, 0.5], [0.0, 0.0, 0.0]]]), np.array([[300.0, 40.0]])
    found = with_luminance(bands, grey)
    assert luminance(found) == pytest.approx(grey, rel=1e-6)
    assert found[0, 0] / found[0, 0, 1] == pytest.approx([2.0, 1.0, 0.5])
    assert np.ptp(found[0, 1]) == 0.0


def test_blotches_are_smoothed_and_edges_of_the_picture_stay() -> None:
    """Noise of colour on two walls of other luminance: each gets its mean, none the other's."""
    luminance = np.full((60, 80), 100.0)
    luminance[:, 40:] = 200.0
    wall = np.where((luminance > 150)[..., None], (2.0, 0.8, 0.5), (0.5, 1.1, 1.5))
    noisy = wall * np.random.default_rng(0).gamma(4.0, 0.25, wall.shape)
    found = smoothed_colour(noisy, luminance)
    inner = found[10:-10, 10:-10] / wall[10:-10, 10:-10]
    assert inner.mean() == pytest.approx(1.0, abs=0.02)
    assert inner.std() < 0.1 * (noisy / wall).std()
    edge = found[10:-10, 38:42] / wall[10:-10, 38:42]
    assert edge.mean(axis=(0, 1)) == pytest.approx(np.ones(3), abs=0.1)


@pytest.mark.usefixtures("variant")
def test_walls_colour_a_room_under_a_grey_sky() -> None:
    """Grey surfaces stay grey; red ones redden what they light."""
    from tests.trace.test_pictures import EYE, glass

    view = fisheye(EYE, (0.0, 1.0, 0.0), 40)  # away from the window
    sky, sampling = sky_of(0.0, 150.0), Sampling(picture_samples=8)

    def pictured(red: float, other: float):
        found = []
        for scale in (red, other, other):
            interior, groups = rooms.test_room(scale)
            scene = DaylightScene(interior, rooms.NOTHING, groups, view=view)
            found.append(scene)
        systems = [[MatrixOptics(paths=glass(0.7))]]
        lit = path_picture(PathLight(found[1], systems, sky, sampling), 0)
        return lit, coloured_picture(lit, found, [systems] * 3, sky, 0, sampling=sampling)

    lit, grey = pictured(1.0, 1.0)
    assert luminance(grey) == pytest.approx(lit, rel=1e-4)
    shown = lit > 0
    assert grey[shown] / grey[shown].mean(axis=1, keepdims=True) == pytest.approx(1.0, abs=1e-3)
    _, red = pictured(1.0, 0.5)
    ratio = red[shown][:, 0] / red[shown][:, 1]
    assert np.median(ratio) > 2.0, "light that comes back once more is redder than the surface"
