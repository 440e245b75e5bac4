"""Daylight metrics on illuminances whose answer is known beforehand."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.metrics import autonomy, en17037, lm83, schedules
from mitsuba_cfs.metrics.room import daylight_factor, room_metrics
from mitsuba_cfs.sky.weather import Weather

ALL = np.ones(10, dtype=bool)


def year(step_h: float = 1.0, start: str = "2017-01-01") -> Weather:
    """Fifty degrees north; diffuse light that grows with the sun's height."""
    count = round(8760 / step_h)
    ends = pd.date_range(start, periods=count + 1, freq=f"{round(3600 * step_h)}s")[1:]
    t = ends - pd.Timedelta(hours=step_h / 2)
    hour, day = t.hour + t.minute / 60, t.day_of_year
    height = np.cos((hour - 12) * np.pi / 12) + 0.5 * np.sin((day - 81) * 2 * np.pi / 365)
    diffuse = np.maximum(300 * np.asarray(height), 0.0)
    none = np.zeros(count)
    return Weather("x", 50.0, 0.0, 0.0, 0.0, step_h, ends, none, diffuse)


# --- schedules --------------------------------------------------------------------------------


@pytest.mark.parametrize("step_h", [1.0, 0.25])
def test_lm83_counts_ten_hours_a_day(step_h):
    weather = year(step_h)
    mask = schedules.lm83_hours(weather)
    assert mask.sum() * step_h == 3650
    hours = weather.midpoints[mask].hour
    assert hours.min() == 8 and hours.max() == 17  # the interval from 17 to 18 o'clock is in
    assert mask[: round(24 / step_h)].sum() == round(10 / step_h)


def test_daylight_saving_moves_the_clock():
    weather = year()
    summer = np.where((weather.midpoints.month > 3) & (weather.midpoints.month < 11), 1.0, 0.0)
    mask = schedules.lm83_hours(weather, clock_ahead_h=summer)
    assert mask.sum() == 3650
    assert weather.midpoints[mask & (summer > 0)].hour.min() == 7
    assert weather.midpoints[mask & (summer == 0)].hour.min() == 8


def test_hours_over_midnight_are_the_evening_and_the_morning():
    night, day = (schedules.working_hours(year(), *hours) for hours in ((22, 6), (6, 22)))
    assert not np.any(night & day) and np.all(night | day)
    assert sorted(set(year().midpoints[night].hour)) == [0, 1, 2, 3, 4, 5, 22, 23]
    late = schedules.working_hours(year(), 22, 0)
    np.testing.assert_array_equal(late, schedules.working_hours(year(), 22, 24))


def test_weekdays():
    mask = schedules.working_hours(year(), weekdays_only=True)
    assert mask.sum() == 10 * 260  # 2017 starts and ends on a Sunday


@pytest.mark.parametrize("ranked_by", schedules.RANKED_BY)
@pytest.mark.parametrize("step_h", [1.0, 0.5])
def test_daylight_hours_are_the_brighter_half(step_h, ranked_by):
    weather = year(step_h)
    mask = schedules.daylight_hours(weather, ranked_by=ranked_by)
    assert mask.sum() * step_h == 4380
    light = weather.diffuse_horizontal
    assert light[mask].min() >= light[~mask].max()


def test_daylight_hours_of_a_dark_year_follow_the_sun():
    weather = year()
    dark = np.zeros_like(weather.diffuse_horizontal)
    night = Weather("x", 50.0, 0.0, 0.0, 0.0, 1.0, weather.times, dark, dark)
    mask = schedules.daylight_hours(night)
    noon = weather.midpoints.hour == 12
    assert mask.sum() == 4380 and mask[noon].all() and not mask[weather.midpoints.hour == 0].any()


# --- shares of time ---------------------------------------------------------------------------


def test_autonomy_of_a_ramp():
    """0, 100, ... 900 lx: 7 of 10 reach 300; continuous adds 0, 1/3 and 2/3."""
    ramp = np.arange(0.0, 1000.0, 100.0)[:, None] * [1.0, 0.5]
    np.testing.assert_allclose(autonomy.daylight_autonomy(ramp, ALL), [0.7, 0.4])
    continuous = autonomy.continuous_daylight_autonomy(ramp, ALL)
    np.testing.assert_allclose(continuous, [0.8, (0 + 1 + 2 + 3 + 4 + 5 + 4 * 6) / 60])
    assert np.all(continuous >= autonomy.daylight_autonomy(ramp, ALL))


def test_only_scheduled_hours_count():
    ramp = np.arange(0.0, 1000.0, 100.0)[:, None]
    mask = np.arange(10) >= 8  # the two brightest
    assert autonomy.daylight_autonomy(ramp, mask) == 1.0
    assert autonomy.daylight_autonomy(ramp, ~mask) == 5 / 8


def test_useful_daylight_bins_and_their_edges():
    values = np.array([0, 99.9, 100, 299, 300, 2000, 2001, 3000, 3001, 9999.0])[:, None]
    np.testing.assert_allclose(autonomy.useful_daylight_illuminance(values, ALL)[:, 0], [0.2, 0.2, 0.4, 0.2])
    old = autonomy.useful_daylight_illuminance(values, ALL, autonomy.UDI_LIMITS_2005)[:, 0]
    np.testing.assert_allclose(old, [0.2, 0.2, 0.2, 0.4])
    rng = np.random.default_rng(1)
    bins = autonomy.useful_daylight_illuminance(rng.gamma(1, 1500, size=(10, 40)), ALL)
    np.testing.assert_allclose(bins.sum(axis=0), 1.0)
    assert np.all(bins >= 0)


# --- LM-83 ------------------------------------------------------------------------------------


def test_spatial_daylight_autonomy_and_its_areas():
    """Sensors lit in 4, 5, 6 and 10 of 10 hours: the one with half the time is in."""
    values = np.stack([np.where(np.arange(10) < n, 300.0, 299.9) for n in (4, 5, 6, 10)], axis=1)
    assert lm83.spatial_daylight_autonomy(values, ALL) == 0.75
    assert lm83.spatial_daylight_autonomy(values, ALL, areas=[3, 1, 1, 1]) == 0.5
    assert lm83.spatial_daylight_autonomy(values, ALL, time=0.6) == 0.5


def test_annual_sunlight_exposure_needs_more_than_250_hours():
    mask = np.ones(3650, dtype=bool)
    hours = np.arange(3650)[:, None]
    direct = np.where(hours < [249, 250, 251, 3650], 1001.0, 0.0)
    np.testing.assert_array_equal(lm83.sunlit_hours(direct, mask), [249, 250, 251, 3650])
    assert lm83.annual_sunlight_exposure(direct, mask) == 0.5
    assert lm83.annual_sunlight_exposure(direct, mask, areas=[1, 1, 1, 7]) == pytest.approx(0.8)
    # half-hour steps: half the hours
    assert lm83.annual_sunlight_exposure(direct, mask, step_h=0.5) == 0.25
    assert lm83.annual_sunlight_exposure(np.full((3650, 1), 1000.0), mask) == 0.0


def test_blinds_close_on_more_than_two_percent():
    direct = np.zeros((1, 3, 100))
    direct[0, 1, :2], direct[0, 2, :3] = 1000.0, 1000.0
    np.testing.assert_array_equal(lm83.blinds_operated(direct), [[False, False, True]])
    weights = np.ones(100)
    weights[0] = 3.0
    found = lm83.blinds_operated(direct, areas=weights)
    np.testing.assert_array_equal(found, [[False, True, True]])


def test_blinds_close_no_further_than_two_percent_ask():
    """What counts is the sun of all open groups; the combination with most of it left is taken."""
    direct = np.zeros((3, 6, 100))
    direct[0, 0, :2], direct[1, 0, 2:4] = 1000.0, 1000.0  # 2 and 2: one of them closes, the last
    direct[0, 1, :1], direct[1, 1, 2:4] = 1000.0, 1000.0  # 1 and 2: the first closes, 2 are left
    direct[0, 2, :5], direct[1, 2, 5:7] = 1000.0, 1000.0  # 5 and 2: the second may stay open
    direct[0, 3, :5], direct[1, 3, 5:9] = 1000.0, 1000.0  # 5 and 4: neither may
    direct[:, 4, :3] = 400.0  # three groups make 1200 lx together: any two make none
    direct[2, 5, :1] = 5000.0  # 1 %
    wanted = [
        [False, True, True, True, False, False],
        [True, False, False, True, False, False],
        [False, False, False, False, True, False],
    ]
    np.testing.assert_array_equal(lm83.blinds_operated(direct), wanted)


def test_each_group_has_its_own_blinds():
    direct = np.zeros((2, 3, 4))
    direct[0, 1], direct[1, 2] = 5000.0, 5000.0
    closed = lm83.blinds_operated(direct)
    np.testing.assert_array_equal(closed, [[False, True, False], [False, False, True]])


# --- EN 17037 ---------------------------------------------------------------------------------


@pytest.mark.parametrize("rule", en17037.RULES)
def test_illuminances_that_decide_the_level(rule):
    """Half of twenty sensors bright, nine dim and one dark, in half of the hours."""
    plane = np.array([700.0] * 10 + [120.0] * 9 + [0.0])
    values = np.where(np.arange(10)[:, None] < 5, plane, 0.0)
    found = en17037.daylight_provision(values, ALL, rule=rule)
    assert found == en17037.DaylightProvision(700.0, 120.0)
    nothing = en17037.DaylightProvision(0.0, 0.0)
    short = np.where(np.arange(10)[:, None] < 4, plane, 0.0)  # two hours of five too few
    assert en17037.daylight_provision(short, ALL, rule=rule) == nothing
    dark = np.append(plane[:-2], [0.0, 0.0])[None, :].repeat(10, axis=0)  # 90 % of the area
    assert en17037.daylight_provision(dark, ALL, rule=rule).minimum_illuminance == 0.0


def test_rooflights_have_their_target_on_95_percent():
    values = np.tile(np.array([500.0] * 19 + [0.0]), (10, 1))
    found = en17037.daylight_provision(values, ALL, horizontal_openings=True)
    assert found.target_illuminance == 500.0
    less = np.tile(np.array([500.0] * 18 + [0.0] * 2), (10, 1))
    found = en17037.daylight_provision(less, ALL, horizontal_openings=True)
    assert found.target_illuminance == 0.0


def test_the_two_rules_differ_when_light_wanders():
    """Each half of the room is lit in its own half of the day, never both."""
    morning = np.arange(10) < 5
    values = np.stack([np.where(morning, 400.0, 50.0), np.where(morning, 50.0, 400.0)], axis=1)
    hourly = en17037.daylight_provision(values, ALL)
    sensor = en17037.daylight_provision(values, ALL, rule="sensor")
    assert (hourly.target_illuminance, sensor.target_illuminance) == (400, 400)
    assert (hourly.minimum_illuminance, sensor.minimum_illuminance) == (50, 400)


def test_reached_on_area_and_in_time():
    weights = autonomy.sensor_weights([1, 1, 2], 3)
    values = [[10.0, 20.0, 30.0]]
    for area, expected in ((0.5, 30), (0.51, 20), (0.75, 20), (0.76, 10), (1.0, 10)):
        assert en17037.reached_on_area(values, weights, area) == expected
    column = np.array([5.0, 1, 3, 2])
    for time, expected in ((0.5, 3), (0.51, 2), (1.0, 1), (0.0, 5)):
        assert en17037.exceeded(column, time) == expected
    assert en17037.median_diffuse(np.array([1.0, 2, 9, 50]), np.array([True, True, True, False])) == 2


# --- rooms ------------------------------------------------------------------------------------


def test_room_metrics_use_each_standards_schedule():
    """500 lx from 8 to 18, otherwise nothing: all of LM-83's time, 83 % of EN 17037's."""
    weather = year()
    ten = schedules.lm83_hours(weather)
    light = np.where(ten[:, None], [500.0, 500.0, 5.0], 0.0)
    direct = np.where(ten[:, None], [2000.0, 0.0, 0.0], 0.0)
    found = room_metrics(light, weather, direct_illuminance=direct)
    np.testing.assert_array_equal(found.daylight_autonomy, [100, 100, 0])
    assert found.spatial_daylight_autonomy == pytest.approx(200 / 3)
    assert found.annual_sunlight_exposure == pytest.approx(100 / 3)
    assert found.sunlit_hours[0] == 3650
    half = schedules.daylight_hours(weather)
    assert found.mean_illuminance[0] == pytest.approx(500 * (ten & half).sum() / 4380)
    assert found.daylight_provision.target_illuminance == 500
    table, room = found.by_sensor(), found.of_room()
    assert list(table["daylight_autonomy"]) == [100, 100, 0] and table.index.name == "sensor"
    assert room["en17037_target_lx"] == 500 and room["udi_300_3000"] == pytest.approx(200 / 3)
    assert room_metrics(light, weather).annual_sunlight_exposure is None
    # 2005's limits: 100 and 2000 lx are useful, 2500 is not, though it is by those of 2012
    bounds = np.where(ten[:, None], [100.0, 2000.0, 2500.0, 99.0], 0.0)
    other = room_metrics(bounds, weather)
    np.testing.assert_array_equal(other.useful_daylight_2005, [100, 100, 0, 0])
    assert other.of_room()["udi_100_2000"] == 50 and other.of_room()["udi_300_3000"] == 50


def test_room_level_counts_the_daylight_hours():
    """Light in 2,000 hours from 8 to 18: half of LM-83's time, less than half of EN 17037's."""
    weather = year()
    lit = np.zeros(8760, dtype=bool)
    lit[np.flatnonzero(schedules.lm83_hours(weather))[::2]] = True
    lit[np.flatnonzero(schedules.lm83_hours(weather) & ~lit)[:175]] = True
    found = room_metrics(np.where(lit[:, None], 800.0, 0.0), weather)
    assert lit.sum() == 2000 and found.spatial_daylight_autonomy == 100
    assert found.daylight_provision == en17037.DaylightProvision(0.0, 0.0)


@pytest.mark.parametrize(
    ("values", "mask", "words"),
    [
        (np.full((3, 1), np.nan), np.ones(3, dtype=bool), "finite"),
        (np.full((3, 1), -1.0), np.ones(3, dtype=bool), "not negative"),
        (np.ones((3, 1)), np.zeros(3, dtype=bool), "no time step"),
        (np.ones((3, 1)), np.ones(2, dtype=bool), "mask"),
        (np.ones((3, 1)), np.ones(3), "mask"),
        (np.ones(3), np.ones(3, dtype=bool), "H, S"),
    ],
)
def test_wrong_calls(values, mask, words):
    with pytest.raises(ValueError, match=words):
        autonomy.daylight_autonomy(values, mask)


def test_wrong_areas_limits_and_rules():
    with pytest.raises(ValueError, match="areas"):
        autonomy.area_share([True, False], [1.0, -1.0])
    with pytest.raises(ValueError, match="limits"):
        autonomy.useful_daylight_illuminance(np.ones((10, 1)), ALL, (300.0, 100.0))
    with pytest.raises(ValueError, match="rule"):
        en17037.daylight_provision(np.ones((10, 1)), ALL, rule="mine")
    with pytest.raises(ValueError, match="ranked_by"):
        schedules.daylight_hours(year(), ranked_by="colour")
    with pytest.raises(ValueError, match="start"):
        schedules.working_hours(year(), 8, 8)
    with pytest.raises(ValueError, match="outdoor_horizontal"):
        daylight_factor([1.0], 0.0)


def test_figures_of_a_room_by_hand():
    """Two sensors of 1 and 3 m2 with 150 and 5,000 lx at all times, the second one in the sun."""
    weather = year()
    lux = np.tile([150.0, 5000.0], (8760, 1))
    room = room_metrics(lux, weather, direct_illuminance=lux - 500.0 * (lux > 200), areas=[1, 3])
    table = room.by_sensor()
    assert list(table["daylight_autonomy"]) == [0.0, 100.0]
    assert list(table["continuous_daylight_autonomy"]) == [50.0, 100.0]
    for name, values in (
        ("udi_below_100", [0, 0]),
        ("udi_100_300", [100, 0]),
        ("udi_300_3000", [0, 0]),
        ("udi_above_3000", [0, 100]),
        ("udi_100_2000", [100, 0]),
        ("sunlit_hours", [0, 3650]),
        ("mean_illuminance_lx", [150, 5000]),
    ):
        assert list(table[name]) == pytest.approx(values), name
    figures = room.of_room()
    for name, value in (
        ("daylight_autonomy", 75.0),
        ("continuous_daylight_autonomy", 87.5),
        ("udi_100_300", 25.0),
        ("udi_above_3000", 75.0),
        ("udi_below_100", 0.0),
        ("udi_300_3000", 0.0),
        ("udi_100_2000", 25.0),
        ("mean_illuminance_lx", 3787.5),
        ("spatial_daylight_autonomy", 75.0),
        ("annual_sunlight_exposure", 75.0),
    ):
        assert figures[name] == pytest.approx(value), name
    dark = room_metrics(lux, weather)
    assert dark.annual_sunlight_exposure is None and dark.sunlit_hours is None


def test_the_daylight_factor_is_a_share_of_the_light_outdoors():
    np.testing.assert_allclose(daylight_factor([0.0, 250.0, 1e4], 1e4), [0.0, 0.025, 1.0])
    for wrong in (-1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="illuminance: expected finite values"):
            daylight_factor([100.0, wrong], 1e4)


def test_a_factor_is_of_any_light_outdoors():
    np.testing.assert_allclose(daylight_factor([0.1], 0.5), [0.2])
