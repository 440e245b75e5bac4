"""The Perez model at single directions, against Radiance's gendaylit and `perezlum.cal`."""

from __future__ import annotations

import re
import subprocess

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.sky import perez
from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.sky.weather import Weather

# direct normal and diffuse horizontal [W/m2], solar hour of 10 April at latitude 40: overcast to
# clear, one moment for each of the eight categories of clearness
MOMENTS = [
    (2.0, 150.0, 8.0),
    (60.0, 250.0, 14.0),
    (170.0, 250.0, 9.0),
    (180.0, 200.0, 11.0),
    (300.0, 210.0, 12.0),
    (500.0, 190.0, 13.0),
    (800.0, 110.0, 14.5),
    (900.0, 80.0, 10.5),
]
DAY = 100  # 10 April


def model_of(moment) -> perez.PerezSky:
    direct, diffuse, hour = moment
    ends = pd.DatetimeIndex(["2017-04-10"]) + pd.Timedelta(hours=hour + 0.5)
    site = Weather("x", 40.0, 0.0, 0.0, 0.0, 1.0, ends, np.zeros(1), np.zeros(1))
    towards = sun_directions(site, model="radiance")
    return perez.perez_sky(direct, diffuse, towards, day_of_year=DAY)


def test_moments_cover_every_category():
    clearness = np.concatenate([model_of(moment).clearness for moment in MOMENTS])
    category = np.searchsorted(perez.CLEARNESS_BINS, clearness, side="right")
    np.testing.assert_array_equal(category, np.arange(8))


@pytest.mark.peer
@pytest.mark.parametrize("moment", MOMENTS)
def test_distribution_is_that_of_gendaylit(moment, radiance):
    direct, diffuse, hour = moment
    command = [radiance / "gendaylit", "4", "10", str(hour), "-a", "40", "-o", "0", "-m", "0"]
    command += ["-W", str(direct), str(diffuse), "-O", "1"]
    text = subprocess.run(command, capture_output=True, check=True, text=True).stdout
    numbers = [
        float(word) for word in re.search(r"skybright perezlum.cal\n0\n10 (.*)", text)[1].split()
    ]
    ours = model_of(moment)
    np.testing.assert_allclose(ours.sun[0], numbers[7:10], atol=1e-6)  # six printed digits
    np.testing.assert_allclose(ours.coefficients[:, 0], numbers[2:7], atol=2e-5, rtol=1e-6)


def test_air_mass_and_eccentricity():
    assert perez.air_mass(0.0) == pytest.approx(1.0, abs=1e-3)
    assert perez.air_mass(np.radians(60)) == pytest.approx(2.0, rel=0.01)
    assert perez.air_mass(np.radians(90)) == pytest.approx(36.5, rel=0.02)  # Kasten's table
    assert perez.eccentricity(3) == pytest.approx(1.0351, abs=2e-4)  # (1/0.9833)^2 at perihelion
    assert perez.eccentricity(185) == pytest.approx(0.9671, abs=6e-4)  # (1/1.0167)^2


def test_clearness_and_brightness_have_limits():
    zenith = np.array([1.0])
    assert perez.sky_clearness(np.array([900.0]), np.array([0.0]), zenith) == 11.9
    assert perez.sky_clearness(np.array([0.0]), np.array([100.0]), zenith) == 1.0
    assert perez.sky_brightness(np.array([0.0]), zenith, np.array([1.0])) == 0.01
    assert perez.sky_brightness(np.array([900.0]), zenith, np.array([1.0])) == 0.6


def test_clear_sky_is_brightest_at_the_sun():
    model = model_of(MOMENTS[-1])
    away = model.sun[0] * [-1, -1, 1]
    at_sun, opposite = model.relative_luminance(np.stack([model.sun[0], away]))[:, 0]
    assert at_sun > 10 * opposite
    overcast = model_of(MOMENTS[0])
    zenith, horizon = overcast.relative_luminance([[0, 0, 1.0], [0, 1.0, 0.02]])[:, 0]
    assert 1.5 < zenith / horizon < 4  # CIE's overcast sky has 3, at less brightness


def test_efficacies_are_plausible():
    """Perez 1990, figures 5 and 6: diffuse 110 to 150 lm/W; direct up to 110."""
    diffuse = [model_of(moment).diffuse_efficacy[0] for moment in MOMENTS]
    direct = [model_of(moment).direct_efficacy[0] for moment in MOMENTS]
    assert 105 < min(diffuse) and max(diffuse) < 150
    assert 60 < min(direct) and max(direct) < 112
