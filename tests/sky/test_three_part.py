"""Perez's sky of three parts on patches, against pvlib's irradiance of tilted planes."""

from __future__ import annotations

import numpy as np
import pytest
from pvlib import irradiance

from mitsuba_cfs.sky.annual import given_sky
from mitsuba_cfs.sky.matrix import series_for_suns
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.perez import SOLAR_CONSTANT, air_mass, eccentricity
from mitsuba_cfs.sky.three_part import three_part

HEIGHT, TURN = np.radians([50.0, 20.0, 35.0, 60.0]), np.radians([180.0, 120.0, 225.0, 200.0])
SUN = np.stack([np.cos(HEIGHT) * np.sin(TURN), np.cos(HEIGHT) * np.cos(TURN), np.sin(HEIGHT)], axis=1)
DIRECT = np.array([800.0, 500.0, 150.0, 0.0])  # clear to overcast
DIFFUSE = np.array([90.0, 110.0, 220.0, 160.0])
DAY = 100
PLANES = {"north": 0.0, "east": 90.0, "south": 180.0, "west": 270.0}


def _sky(subdivision: int) -> tuple[ReinhartSky, np.ndarray]:
    sky = ReinhartSky(subdivision)
    series = three_part(series_for_suns(SUN, DIRECT, DIFFUSE, "solar", day_of_year=DAY))
    return sky, series.patches(sky, np.arange(len(SUN)))


def _pvlib(tilt: float, azimuth: float) -> np.ndarray:
    zenith = np.pi / 2 - HEIGHT
    return irradiance.perez(
        tilt,
        azimuth,
        DIFFUSE,
        DIRECT,
        SOLAR_CONSTANT * eccentricity(DAY),
        np.degrees(zenith),
        np.degrees(TURN),
        air_mass(zenith),
        model="allsitescomposite1990",
    )


@pytest.mark.parametrize("subdivision", [1, 4, 6])
@pytest.mark.parametrize("plane", PLANES)
def test_planes_have_pvlibs_irradiance(subdivision: int, plane: str) -> None:
    """Within 2 % of the diffuse irradiance, at MF 1 4 %: the patches about the sun."""
    sky, radiance = _sky(subdivision)
    azimuth = np.radians(PLANES[plane])
    cosine = np.maximum(sky.directions[1:] @ [np.sin(azimuth), np.cos(azimuth), 0.0], 0.0)
    ours = (sky.solid_angles[1:] * cosine) @ radiance
    allowed = (0.04 if subdivision == 1 else 0.02) * DIFFUSE
    assert np.all(np.abs(ours - _pvlib(90.0, PLANES[plane])) < allowed)


def test_level_ground_has_the_diffuse_irradiance() -> None:
    """The sun's four patches lie as high as the sun to a percent."""
    sky, radiance = _sky(4)
    np.testing.assert_allclose(sky.horizontal_weights[1:] @ radiance, DIFFUSE, rtol=0.01)


def test_no_patch_is_darker_than_black() -> None:
    """A dark overcast sky asks for less than nothing at the horizon; level ground keeps 2 %."""
    sky = ReinhartSky(4)
    dark = series_for_suns(SUN[1:2], [0.0], [30.0], "solar", day_of_year=DAY)
    radiance = three_part(dark).patches(sky, np.arange(1))
    assert radiance.min() == 0.0
    np.testing.assert_allclose(sky.horizontal_weights[1:] @ radiance, 30.0, rtol=0.02)


def test_heat_has_it_and_light_has_not() -> None:
    """The annual sky's radiance is of three parts, its luminance the all-weather sky's."""
    sky = given_sky(SUN, DIRECT, DIFFUSE, 1, day_of_year=DAY, solar=True)
    dome = np.flatnonzero(ReinhartSky(1).directions[:, 2] > 0.9)
    away = dome[(ReinhartSky(1).directions[dome] @ SUN[0]) < 0.8]
    assert np.ptp(sky.solar[away, 0]) < 1e-4 * sky.solar[away, 0].mean()
    assert np.ptp(sky.whole[away, 0]) > 0.05 * sky.whole[away, 0].mean()
