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
    numbers = [float(word) for word in re.search(r"skybright perezlum.cal\n0\n10 (.*)", text)[1].split()]
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


def test_tables_are_those_compared_with_radiance():
    """Check sums of the tables with which the tests against gendaymtx passed: none is edited."""
    for table, total, by_row in (
        (
            perez.LUMINANCE_COEFFICIENTS.reshape(8, 20),
            [
                -5.1834,
                -2.6211,
                1.2101,
                3.9695,
                -0.0146,
                -0.9411,
                -20.8714,
                8.1859,
                152.8983,
                -55.8689,
                -165.867,
                156.0597,
                -26.3376,
                1.8118,
                18.3288,
                0.7327,
                3.2311,
                -0.7705,
                -0.8177,
                1.3916,
            ],
            [
                -31.0785,
                -8.8258,
                4.6497,
                23.0045,
                1.0439,
                -3.6357,
                -83.1421,
                33.8121,
                794.7713,
                -292.3158,
                -858.9755,
                824.7576,
                -154.0358,
                6.1765,
                123.8427,
                11.3221,
                21.3176,
                -5.8293,
                -0.929,
                9.5512,
            ],
        ),
        (perez.DIFFUSE_EFFICACY, [913.06, 21.26, -164.3, -110.11], [4389.22, 101.86, -1124.7, -552.45]),
        (perez.DIRECT_EFFICACY, [796.84, -21.62, -13.51, 40.51], [3750.66, -58.85, -53.92, -401.37]),
    ):
        assert table.sum(axis=0) == pytest.approx(total, abs=1e-9)
        assert np.arange(1, 9) @ table == pytest.approx(by_row, abs=1e-9)
    bins = [1.065, 1.230, 1.500, 1.950, 2.800, 4.500, 6.200]  # table 1's upper bounds
    assert list(perez.CLEARNESS_BINS) == bins
    assert perez.CLEARNESS_LIMITS == (1.0, 11.9) and perez.BRIGHTNESS_LIMITS == (0.01, 0.6)


def test_efficacies_and_sky_of_one_moment_by_hand():
    """Clear sky at 40 degrees: epsilon 5.27 (category 7), each figure by the printed equations."""
    zenith, day, dew = np.radians(50.0), 100.0, 5.0
    direct, diffuse = 700.0, 100.0
    sun = [[0.0, np.sin(zenith), np.cos(zenith)]]
    sky = perez.perez_sky([direct], [diffuse], sun, day_of_year=[day], dew_point_c=[dew])
    cube = 1.041 * zenith**3
    epsilon = (1 + direct / diffuse + cube) / (1 + cube)
    assert sky.clearness == pytest.approx([epsilon]) and 4.5 < epsilon < 6.2
    mass = 1 / (np.cos(zenith) + 0.15 * (93.885 - 50.0) ** -1.253)
    t = 2 * np.pi * (day - 1) / 365
    near = 1.00011 + 0.034221 * np.cos(t) + 0.00128 * np.sin(t)
    near += 0.000719 * np.cos(2 * t) + 0.000077 * np.sin(2 * t)
    delta = diffuse * mass / (1367 * near)
    assert sky.brightness == pytest.approx([delta])
    water = np.exp(0.07 * dew - 0.075)
    lit = 141.88 + 1.90 * water - 53.24 * np.cos(zenith) - 14.03 * np.log(delta)
    assert sky.diffuse_efficacy == pytest.approx([lit])
    beam = 105.75 + 0.77 * water - 1.26 * np.exp(5.73 * zenith - 5) - 34.44 * delta
    assert sky.direct_efficacy == pytest.approx([beam])
    row = (
        "-1.0000 0.0211 0.5025 -0.5119 -0.3000 0.1922 0.7023 -1.6317 19.0000 -5.0000 1.2438 "
        "-1.9094 -4.0000 0.0250 0.3844 0.2656 1.0468 -0.3788 -2.4517 1.4656"
    )
    x = np.array(row.split(), float).reshape(5, 4)
    a, b, c, d, e = x @ [1.0, zenith, delta, delta * zenith]
    assert sky.coefficients[:, 0] == pytest.approx([a, b, c, d, e])
    towards = np.array([[0.6, 0.0, 0.8]])
    gamma = np.arccos(towards[0] @ sun[0])
    by_hand = 1 + a * np.exp(b / 0.8)
    by_hand *= 1 + c * np.exp(d * gamma) + e * np.cos(gamma) ** 2
    assert sky.relative_luminance(towards) == pytest.approx(np.array([[by_hand]]))


def test_overcast_moment_by_its_own_equations():
    """Perez 1993, (7) and (8), for c and d of the first category; no direct light: efficacy 0."""
    zenith = np.radians(60.0)
    sun = [[0.0, np.sin(zenith), np.cos(zenith)]]
    sky = perez.perez_sky([0.0], [150.0], sun, day_of_year=[1.0])
    assert sky.clearness == pytest.approx([1.0])
    delta = sky.brightness[0]
    c = np.exp((delta * (2.8 + 0.6004 * zenith)) ** 1.2375) - 1.0
    d = -np.exp(delta * (1.8734 + 0.6297 * zenith)) + 0.9738 + delta * 0.2809
    assert sky.coefficients[2:4, 0] == pytest.approx([c, d])
    water = np.exp(0.07 * 11.0 - 0.075)
    lit = 97.24 - 0.46 * water + 12.0 * np.cos(zenith) - 8.91 * np.log(delta)
    assert sky.diffuse_efficacy == pytest.approx([lit])
    # between 1.065 and 2.8 the brightness counts as 0.2 at least
    dim = perez.perez_sky([50.0], [60.0], sun, day_of_year=[1.0])
    assert 1.23 < dim.clearness[0] < 1.5 and dim.brightness[0] < 0.2
    first = -1.1 - 0.2515 * zenith + 0.2 * (0.8952 + 0.0156 * zenith)
    assert dim.coefficients[0, 0] == pytest.approx(first)


def test_limits_of_the_model():
    """No diffuse light: 11.9; the zenith angle between 3 and 90 degrees; brightness 0.01 to 0.6."""
    up = perez.perez_sky([900.0], [0.0], [[0.0, 0.0, 1.0]], day_of_year=[1.0])
    assert (up.clearness[0], up.brightness[0]) == (11.9, 0.01)
    assert up.sun[0, 2] == pytest.approx(np.cos(np.radians(3.0)))
    low = perez.perez_sky([0.0], [900.0], [[1.0, 0.0, -0.2]], day_of_year=[1.0])
    assert low.brightness[0] == 0.6
    np.testing.assert_allclose(low.sun, [[1.0, 0.0, 0.0]], atol=1e-12)
    assert low.direct_efficacy[0] == 0.0


@pytest.mark.parametrize(
    ("clearness", "brightness", "counts"),
    [(1.06, 0.05, 0.05), (1.07, 0.05, 0.2), (1.1, 0.3, 0.3), (2.79, 0.05, 0.2), (2.81, 0.05, 0.05)],
)
def test_brightness_counts_as_a_fifth_at_least_between_two_clearnesses(clearness, brightness, counts):
    """1.065 to 2.8, as gendaylit has it: b of category 3 or 5 by its printed row."""
    category = 2
    zenith, x = 1.0, perez.LUMINANCE_COEFFICIENTS[category, 1]
    found = perez.luminance_coefficients(
        np.array([category]), np.array([clearness]), np.array([brightness]), np.array([zenith])
    )
    by_hand = x[0] + x[1] * zenith + counts * (x[2] + x[3] * zenith)
    assert found[1, 0] == pytest.approx(by_hand)


def test_gradation_of_the_horizon_and_the_floor_of_zero():
    """[1 + a exp(b/cos Z)][1 + c exp(d gamma) + e cos^2 gamma] by hand, never below zero."""
    coefficients = np.array([[-0.6], [-0.1], [2.0], [-1.5], [0.3]])
    found = perez.relative_luminance(coefficients, np.array([0.0, 0.5]), np.cos([[0.7], [1.2]]))[:, 0]
    around = [1 + 2.0 * np.exp(-1.5 * g) + 0.3 * np.cos(g) ** 2 for g in (0.7, 1.2)]
    assert found[0] == pytest.approx(around[0], rel=1e-9)
    assert found[1] == pytest.approx((1 - 0.6 * np.exp(-0.2)) * around[1])
    negative = coefficients.copy()
    negative[0] = -5.0
    assert perez.relative_luminance(negative, np.array([1.0]), np.array([[0.5]])) == 0.0


def test_a_sun_in_the_zenith_is_one_though_its_vector_is_rounded():
    """A height of 1 plus a rounding has no arc cosine; the sun is then as high as the model takes it."""
    over, exact = (perez.perez_sky(700.0, 100.0, [[0.0, 0.0, z]], day_of_year=DAY) for z in (1.0 + 2.3e-16, 1.0))
    for name in ("coefficients", "sun", "clearness", "brightness", "diffuse_efficacy", "direct_efficacy"):
        np.testing.assert_array_equal(getattr(over, name), getattr(exact, name))
        assert np.isfinite(getattr(over, name)).all()
