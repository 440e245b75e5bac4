"""Standard errors of DA and sDA from the noise of the illuminance."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_cfs.metrics.autonomy import (
    UDI_LIMITS_2005,
    area_share,
    continuous_daylight_autonomy,
    daylight_autonomy,
    daylight_autonomy_noise,
    sensor_weights,
    useful_daylight_illuminance,
)
from mitsuba_cfs.metrics.lm83 import (
    annual_sunlight_exposure,
    blinds_operated,
    spatial_daylight_autonomy,
    spatial_daylight_autonomy_error,
    sunlit_hours,
)
from mitsuba_cfs.metrics.noise import Noise


def test_the_error_of_da_is_its_spread() -> None:
    """Illuminance even between 0 and 1,000 lx, scaled by noise of 2 %: DA = 0.7 -+ 0.3 x 0.02."""
    lux, hours = np.arange(0.05, 1000, 0.1)[:, None], np.ones(10_000, dtype=bool)
    random = np.random.default_rng(1)
    spread = np.std([daylight_autonomy(lux * f, hours)[0] for f in random.normal(1, 0.02, 400)])
    noise = daylight_autonomy_noise(
        lux, hours, lambda weights: shared((0.02 * (weights * lux).sum(axis=0)) ** 2), relative_error=np.array([0.02])
    )
    assert noise.standard_error()[0] == pytest.approx(0.3 * 0.02, rel=0.02)
    assert noise.own[0] < 1e-3 * noise.shared[0]  # what the hours have alone
    assert spread == pytest.approx(0.3 * 0.02, rel=0.15)  # 400 trials: 3.5 %


def test_the_noise_of_each_hour_alone_moves_da_too() -> None:
    """Of 10,000 hours even up to 1,000 lx, each with 5 % of noise of its own."""
    lux, hours = np.arange(0.05, 1000, 0.1)[:, None], np.ones(10_000, dtype=bool)
    random = np.random.default_rng(1)
    trials = [lux * random.normal(1, 0.05, lux.shape) for _ in range(400)]
    spread = np.std([daylight_autonomy(trial, hours)[0] for trial in trials])
    noise = daylight_autonomy_noise(
        lux,
        hours,
        lambda weights: own((0.05**2 * (weights * lux) ** 2).sum(axis=0)),
        relative_error=np.array([0.05 / np.sqrt(7500)]),
    )
    assert noise.standard_error()[0] == pytest.approx(spread, rel=0.15)


def test_few_batches_raise_the_error_by_students_factor() -> None:
    """97.7 % of Student's t: 2.87 with four degrees of freedom; two such parts have eight."""
    nine = np.array([9.0])
    one = Noise.of(nine, nine**2 / 4)
    assert one.standard_error()[0] == pytest.approx(3.0 * 2.869 / 2, rel=1e-3)
    both = one + Noise.of(nine, nine**2 / 4, shared=True)
    assert both.standard_error()[0] == pytest.approx(3.0 * np.sqrt(2) * 2.366 / 2, rel=1e-3)
    assert Noise.of(nine, np.zeros(1)).standard_error()[0] == pytest.approx(3.0)
    scaled = both.scaled(np.array([0.5]))
    assert scaled.standard_error()[0] == pytest.approx(both.standard_error()[0] / 2)


def test_sensors_near_the_limit_make_the_error_of_sda() -> None:
    """At the limit a sensor is counted wrongly in half of all trials."""
    autonomy, variance = [0.5, 0.9, 0.1, 0.5], np.array([0.01, 0.01, 0.01, 0.0]) ** 2
    found = spatial_daylight_autonomy_error(autonomy, own(variance))
    assert found == pytest.approx(0.25 * np.sqrt(0.5))
    far = np.array([0.01]) ** 2
    assert spatial_daylight_autonomy_error([0.9], own(far)) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_what_sensors_share_makes_them_cross_the_limit_together(share: float) -> None:
    """Forty sensors a standard error from the limit, against trials of truths about them."""
    count, random = 40, np.random.default_rng(1)
    variance = np.full(count, 0.02**2)
    noise = Noise(variance * (1 - share), variance * share, np.zeros(count))
    found = spatial_daylight_autonomy_error(np.full(count, 0.52), noise)
    together = random.normal(size=(20_000, 1)) * np.sqrt(share)
    alone = random.normal(size=(20_000, count)) * np.sqrt(1 - share)
    wrong = 0.52 + 0.02 * (together + alone) < 0.5
    about = wrong.mean(axis=1)
    expected = np.sqrt(np.mean(about**2) if share else np.mean(about) / count)
    assert found == pytest.approx(expected, rel=0.03)


def own(variance: NDArray[np.float64]) -> Noise:
    """Noise of many batches that the sensors have alone."""
    return Noise(variance, np.zeros_like(variance), np.zeros_like(variance))


def shared(variance: NDArray[np.float64]) -> Noise:
    """Noise of many batches that the sensors have in common."""
    return Noise(np.zeros_like(variance), variance, np.zeros_like(variance))


def test_the_last_group_closes_of_equals_and_two_percent_may_stay_lit() -> None:
    """Fifty points of equal weight: one lit is 2 %; groups of one point each, of 600 and 400 lx."""
    direct = np.zeros((2, 4, 50))
    direct[0, 0, 0] = 1500.0  # one point: 2 %, all stay open
    direct[0, 1, :2] = 1500.0  # two: the only group with sun closes
    direct[:, 2, 0], direct[:, 2, 1] = (600.0, 400.0), 1500.0  # both have the second point
    direct[0, 3, 0] = direct[1, 3, 1] = direct[1, 3, 2] = 1500.0  # the first alone leaves its one point
    closed = blinds_operated(direct)
    np.testing.assert_array_equal(closed[:, 0], [False, False])
    np.testing.assert_array_equal(closed[:, 1], [True, False])
    assert closed[:, 2].any()
    np.testing.assert_array_equal(closed[:, 3], [False, True])
    both = np.zeros((2, 1, 50))
    both[0, 0, :2], both[1, 0, :2] = 600.0, 400.0  # together 1,000 lx on two points
    np.testing.assert_array_equal(blinds_operated(both)[:, 0], [False, True])
    both[:, 0, 2:] = 1e-3  # weak sun elsewhere does not count
    np.testing.assert_array_equal(blinds_operated(both)[:, 0], [False, True])
    with pytest.raises(ValueError, match=r"expected \[G\]\[H, S\]"):
        blinds_operated(direct[0])


def test_the_sums_rounding_closes_no_blinds() -> None:
    """Three of 150 points are exactly 2 %, whatever the sum of their weights is rounded to."""
    direct = np.zeros((1, 2, 150))
    direct[0, 0, :3] = direct[0, 1, :4] = 1e3
    np.testing.assert_array_equal(blinds_operated(direct), [[False, True]])
    # of areas 1 and 49.5: 1.98 %, and 1.01 of 50: 2.02 %
    two = np.array([[[1e3, 0.0]]])
    assert not blinds_operated(two, areas=[1.98, 98.02]).any()
    assert blinds_operated(two, areas=[2.02, 97.98]).all()


def test_limits_hold_as_the_standard_says() -> None:
    """300 lx suffice for half the time; 1,000 lx are no sunlight, 250 hours are not too many."""
    lux = np.array([[300.0, 299.9], [300.0, 300.0], [0.0, 0.0], [0.0, 0.0]])
    every = np.ones(4, dtype=bool)
    assert spatial_daylight_autonomy(lux, every) == 0.5
    assert list(daylight_autonomy(lux, every)) == [0.5, 0.25]
    sun = np.array([[1000.0, 1000.1], [1000.0, 1000.1]])
    assert list(sunlit_hours(sun, np.ones(2, dtype=bool))) == [0.0, 2.0]
    assert list(sunlit_hours(sun, np.ones(2, dtype=bool), step_h=0.25)) == [0.0, 0.5]
    year = np.zeros((251, 3))
    year[:250, 0], year[:, 1], year[:, 2] = 2e3, 2e3, 900.0
    exposed = annual_sunlight_exposure(year, np.ones(251, dtype=bool), areas=[1.0, 2.0, 5.0])
    assert exposed == 0.25
    bins = useful_daylight_illuminance([[99.0], [100.0], [300.0], [3000.0], [3001.0]], np.ones(5, dtype=bool))
    np.testing.assert_allclose(bins[:, 0], [0.2, 0.2, 0.4, 0.2])
    older = useful_daylight_illuminance([[500.0], [2000.0], [2001.0]], np.ones(3, dtype=bool), UDI_LIMITS_2005)
    np.testing.assert_allclose(older[:, 0] * 3, [0.0, 0.0, 2.0, 1.0])
    part = continuous_daylight_autonomy([[150.0], [600.0]], np.ones(2, dtype=bool))
    assert part == pytest.approx(0.75)


def test_weights_and_limits_that_cannot_be() -> None:
    np.testing.assert_allclose(sensor_weights([1.0, 3.0], 2), [0.25, 0.75])
    np.testing.assert_allclose(sensor_weights([0.0, 3.0], 2), [0.0, 1.0])
    assert area_share([True, False, True], [1.0, 2.0, 1.0]) == 0.5
    for areas in ([1.0], [3.0, -1.0], [0.0, 0.0], [[1.0, 1.0]], [2.0, np.nan]):
        with pytest.raises(ValueError, match="areas: expected 2"):
            sensor_weights(areas, 2)
    with pytest.raises(ValueError, match="at least one sensor"):
        sensor_weights(None, 0)
    one = np.ones((1, 1)), np.ones(1, dtype=bool)
    for limits in ((), (0.0, 100.0), (300.0, 100.0), (100.0, 100.0)):
        with pytest.raises(ValueError, match="rising positive"):
            useful_daylight_illuminance(*one, limits)
    for lux, hours, words in (
        ([1.0], [True], "expected illuminance"),
        ([[1.0]], [True, True], "expected illuminance"),
        ([[1.0]], [1.0], "expected illuminance"),
        ([[1.0]], [False], "no time step"),
        ([[-1.0]], [True], "not negative"),
        ([[500.0, -1.0]], [True], "not negative"),
        ([[np.inf]], [True], "finite"),
        ([[np.nan]], [True], "finite"),
    ):
        with pytest.raises(ValueError, match=words):
            daylight_autonomy(np.array(lux), np.array(hours))
    assert daylight_autonomy(np.array([[300]]), one[1]) == 1.0  # whole numbers


@pytest.mark.parametrize("count", [2, 3])
def test_the_noise_of_few_hours_alone_is_that_of_each(count) -> None:
    """By the formula, without anything in common: n / (2 a H^2) sqrt(v / pi) of n = H."""
    lux, hours = np.full((count, 1), 285.0), np.ones(count, dtype=bool)
    noise = daylight_autonomy_noise(
        lux, hours, lambda weights: own((0.02**2 * (weights * lux) ** 2).sum(axis=0)), relative_error=np.zeros(1)
    )
    v = (0.02 * 285.0 / 300) ** 2
    assert noise.own[0] == pytest.approx(1 / (2 * 0.05 * count) * np.sqrt(v / np.pi))
    assert noise.shared[0] == 0
