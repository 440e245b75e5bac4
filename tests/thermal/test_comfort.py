"""Comfort: closed forms, pythermalcomfort's adaptive model, and the summary's counts."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from pythermalcomfort.models import adaptive_ashrae, adaptive_en, set_tmp

from thermal.comfort import (
    adaptive_comfort,
    comfort_by_outdoors,
    degree_hours,
    mean_radiant_temperature,
    operative_temperature,
    pmv_ppd,
    rolling_mean,
    room_centre_mrt,
    running_mean,
    running_mean_en16798,
    standard_effective_temperature,
    summarise,
)
from thermal.errors import ThermalInputError
from thermal.zone import work_hours


def test_means_of_a_constant_year_are_that_constant():
    outdoor = np.full(8760, 17.0)
    for mean in (running_mean, running_mean_en16798):
        np.testing.assert_allclose(mean(outdoor), 17.0)


def test_running_mean_looks_back_only():
    outdoor = np.zeros(8760)
    outdoor[100 * 24 : 101 * 24] = 1.0
    mean = running_mean(outdoor)
    assert np.all(mean[: 101 * 24] == 0.0)
    assert mean[101 * 24] == pytest.approx(0.3 / (1 - 0.7**7))
    assert mean[103 * 24] == pytest.approx(0.49 * mean[101 * 24])


@pytest.mark.parametrize("share", ["80", "90"])
def test_ashrae_bands_agree_with_pythermalcomfort(share):
    operative, outdoor = np.meshgrid(np.linspace(15, 36, 211), np.linspace(11, 33, 23))
    ours = adaptive_comfort(operative.ravel(), outdoor.ravel(), f"ASHRAE 55 {share} %")
    theirs = adaptive_ashrae(tdb=operative.ravel(), tr=operative.ravel(), t_running_mean=outdoor.ravel(), v=0.1)
    expected = theirs.acceptability_80 if share == "80" else theirs.acceptability_90
    # pythermalcomfort rounds its limits to 0.1 K
    clear = np.abs(ours.excess) > 0.06
    inside = (operative.ravel() > ours.low_c + 0.06) & (operative.ravel() < ours.high_c - 0.06)
    assert np.all(ours.comfortable[inside]) and np.all(np.asarray(expected)[inside])
    assert not np.any(ours.comfortable[clear]) and not np.any(np.asarray(expected)[clear])


@pytest.mark.parametrize(("category", "field"), [("I", "cat_i"), ("II", "cat_ii"), ("III", "cat_iii")])
def test_en_bands_agree_with_pythermalcomfort(category, field):
    operative = np.linspace(15, 36, 211)
    outdoor = np.full(211, 20.0)
    ours = adaptive_comfort(operative, outdoor, f"EN 16798-1 {category}")
    theirs = adaptive_en(tdb=operative, tr=operative, t_running_mean=20.0, v=0.1)
    expected = np.asarray(getattr(theirs, f"acceptability_{field}"))
    away = np.minimum(np.abs(operative - ours.low_c), np.abs(operative - ours.high_c)) > 0.06
    np.testing.assert_array_equal(ours.comfortable[away], expected[away])


@pytest.mark.parametrize(
    ("band", "low", "high", "range_c"),
    [
        ("ASHRAE 55 90 %", 21.5, 26.5, (10.0, 33.5)),
        ("ASHRAE 55 80 %", 20.5, 27.5, (10.0, 33.5)),
        ("EN 16798-1 I", 22.4, 27.4, (10.0, 30.0)),
        ("EN 16798-1 II", 21.4, 28.4, (10.0, 30.0)),
        ("EN 16798-1 III", 20.4, 29.4, (10.0, 30.0)),
    ],
)
def test_bands_and_ranges_of_the_standards_by_hand(band, low, high, range_c):
    """At a mean of 20 degC outdoors: 0.31 t + 17.8 = 24.0, 0.33 t + 18.8 = 25.4 degC."""
    edges = np.array([low - 0.01, low + 0.01, high - 0.01, high + 0.01])
    comfort = adaptive_comfort(edges, np.full(4, 20.0), band)
    np.testing.assert_allclose(comfort.low_c, low)
    np.testing.assert_allclose(comfort.high_c, high)
    assert comfort.comfortable.tolist() == [False, True, True, False]
    np.testing.assert_allclose(comfort.excess, [-0.01, 0, 0, 0.01], atol=1e-9)
    least, most = range_c
    outdoor = np.array([least - 0.1, least, most, most + 0.1])
    assert adaptive_comfort(outdoor, outdoor, band).applicable.tolist() == [False, True, True, False]


def test_running_means_weigh_the_days_before_as_printed():
    """A degree on one day alone: 1, 0.8, 0.6, 0.5, 0.4, 0.3, 0.2 over 3.8; or alpha to the day."""
    outdoor = np.zeros(24 * 20)
    outdoor[24 * 5 : 24 * 6] = 1.0
    table = np.array([1.0, 0.8, 0.6, 0.5, 0.4, 0.3, 0.2])
    np.testing.assert_allclose(running_mean_en16798(outdoor)[24 * 6 : 24 * 13 : 24], table / 3.8)
    powers = 0.8 ** np.arange(7)
    found = running_mean(outdoor, alpha=0.8)
    np.testing.assert_allclose(found[24 * 6 : 24 * 13 : 24], powers / powers.sum())
    assert not found[24 * 13 :].any() and not found[: 24 * 6].any()
    for alpha in (-0.1, 0.0, 1.0, 1.05):
        with pytest.raises(ThermalInputError, match="alpha must lie between 0 and 1"):
            running_mean(outdoor, alpha=alpha)
    running_mean(outdoor, alpha=0.005)
    with pytest.raises(ThermalInputError, match="whole days of 24"):
        running_mean(outdoor[:-1])


def test_rolling_mean_of_steps_counts_the_present_one():
    np.testing.assert_allclose(rolling_mean([1.0, 2.0, 6.0, 3.0], 2), [2.0, 1.5, 4.0, 4.5])


def test_the_standard_chooses_its_running_mean():
    outdoor = 15.0 + 8.0 * np.sin(np.arange(24 * 30) / 50.0)
    operative = np.full(len(outdoor), 22.0)
    for band, mean in (("EN 16798-1 II", running_mean_en16798), ("ASHRAE 55 80 %", running_mean)):
        found = comfort_by_outdoors(operative, outdoor, band, per_day=24)
        np.testing.assert_array_equal(found.outdoor_mean_c, mean(outdoor))


def test_months_of_leap_years_and_common_years():
    """One uncomfortable hour in each month's last hour; other lengths need their months."""
    for hours, february in ((8760, 28), (8784, 29)):
        days = np.cumsum([31, february, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31])
        operative = np.full(hours, 24.0)
        operative[24 * days - 1] = 40.0
        comfort = adaptive_comfort(operative, np.full(hours, 20.0))
        summary = summarise(comfort, np.ones(hours))
        assert summary.discomfort_by_month.tolist() == [1] * 12
        assert summary.degree_hours_warm == pytest.approx(12 * 12.5)
    short = adaptive_comfort([24.0, 40.0], [20.0, 20.0])
    with pytest.raises(ThermalInputError, match="not a whole year"):
        summarise(short, [True, True])
    by_month = summarise(short, [True, True], months=[3, 12]).discomfort_by_month
    assert by_month.tolist() == [0] * 11 + [1]


def test_radiant_temperatures():
    assert mean_radiant_temperature([[20.0, 20.0]], [0.3, 0.7]) == pytest.approx(20.0)
    hot = mean_radiant_temperature([[0.0, 100.0]], [0.5, 0.5])[0]
    assert hot == pytest.approx((0.5 * 273.15**4 + 0.5 * 373.15**4) ** 0.25 - 273.15)
    assert room_centre_mrt([[20.0, 26.0]], [18.0]) == pytest.approx(20.5)
    assert room_centre_mrt([[20.0, 26.0]], [18.0], [2.0, 1.0]) == pytest.approx(20.0)
    assert mean_radiant_temperature([[20.0]], [1.0009]) == pytest.approx(20.07, abs=0.01)
    for sums in (1.0011, 0.9989):
        with pytest.raises(ThermalInputError, match="person"):
            mean_radiant_temperature([[20.0]], [sums])
    with pytest.raises(ThermalInputError, match="person"):
        mean_radiant_temperature([[0.0, 1.0]], [0.3, 0.3])


def test_operative_temperature_forms():
    assert operative_temperature(20.0, 24.0) == pytest.approx(22.0)
    assert operative_temperature(20.0, 24.0, 0.4) == pytest.approx((24 + 2 * 20) / 3)
    assert operative_temperature(20.0, 24.0, 0.199) == pytest.approx(22.0)
    weight = np.sqrt(2.0)  # from 0.2 m/s on
    assert operative_temperature(20.0, 24.0, 0.2) == pytest.approx((24 + weight * 20) / (1 + weight))
    assert operative_temperature(20.0, 24.0, 0.0) == pytest.approx(22.0)
    with pytest.raises(ThermalInputError, match="negative"):
        operative_temperature(20.0, 24.0, -0.1)


def test_summary_counts_add_up():
    rng = np.random.default_rng(3)
    operative, outdoor = rng.uniform(15, 35, 8760), rng.uniform(0, 35, 8760)
    comfort = adaptive_comfort(operative, outdoor)
    chosen = work_hours(8, 18) > 0
    summary = summarise(comfort, chosen)
    assert summary.hours == 3650
    parts = (summary.comfortable, summary.too_warm, summary.too_cold, summary.not_applicable)
    assert sum(parts) == summary.hours
    assert summary.discomfort_by_month.sum() == summary.hours - summary.comfortable
    assert summary.degree_hours_warm > 0 and summary.degree_hours_cold > 0


# rows of ISO 7730:2005, table D.1: air, radiant, speed, humidity, met, clo, PMV, PPD
ANNEX_D = (
    (22.0, 22.0, 0.10, 60, 1.2, 0.5, -0.75, 17),
    (27.0, 27.0, 0.10, 60, 1.2, 0.5, 0.77, 17),
    (27.0, 27.0, 0.30, 60, 1.2, 0.5, 0.44, 9),
    (23.5, 25.5, 0.10, 60, 1.2, 0.5, -0.01, 5),
    (23.5, 25.5, 0.30, 60, 1.2, 0.5, -0.55, 11),
    (19.0, 19.0, 0.10, 40, 1.2, 1.0, -0.60, 13),
    (23.5, 23.5, 0.30, 40, 1.2, 1.0, 0.12, 5),
    (23.0, 21.0, 0.10, 40, 1.2, 1.0, 0.05, 5),
    (23.0, 21.0, 0.30, 40, 1.2, 1.0, -0.16, 6),
    (22.0, 22.0, 0.10, 60, 1.6, 0.5, 0.05, 5),
    (27.0, 27.0, 0.10, 60, 1.6, 0.5, 1.17, 34),
    (27.0, 27.0, 0.30, 60, 1.6, 0.5, 0.95, 24),
)


@pytest.mark.parametrize("row", ANNEX_D)
def test_pmv_of_iso_7730_annex_d(row):
    """The printed digits; some rows of the table are rounded by 0.02.

    The first digit of each PMV is that of the open validation data of comfort models (MIT) too.
    """
    air, mrt, speed, humidity, met, clo, vote, dissatisfied = row
    pmv, ppd = pmv_ppd([air], [mrt], air_speed=speed, humidity=humidity, metabolic_rate=met, clothing=clo)
    assert pmv[0] == pytest.approx(vote, abs=0.025)
    assert ppd[0] == pytest.approx(dissatisfied, abs=1.0)


def test_set_at_its_reference_condition():
    # the SET environment: 50 %, 0.1 m/s, 1.0 met, 0.6 clo gives its own temperature back
    air = np.array([25.0])
    value = standard_effective_temperature(air, air, metabolic_rate=1.0, clothing=0.6)
    assert value[0] == pytest.approx(25.0, abs=0.4)


@pytest.mark.parametrize("person", [(1.2, 0.5), (0.8, 0.0), (3.0, 1.5)])
def test_set_of_many_hours_is_that_of_the_package(person):
    """Between freezing and 60 degC, dry and saturated, still and in a draught: to 1e-12 of the value (rounding)."""
    random, hours = np.random.default_rng(4), 400
    air, mrt = random.uniform(0.0, 60.0, hours), random.uniform(0.0, 60.0, hours)
    speed, humidity = random.choice([0.0, 0.1, 0.15, 1.5], hours), random.uniform(0.0, 100.0, hours)
    met, clo = person
    about = {"air_speed": speed, "humidity": humidity, "metabolic_rate": met, "clothing": clo}
    values = standard_effective_temperature(air, mrt, **about)
    of_package = set_tmp(air, mrt, speed, humidity, met, clo, limit_inputs=False, round_output=False).set
    np.testing.assert_allclose(values, of_package, rtol=1e-12)


def test_set_by_a_package_with_other_names_inside(monkeypatch):
    """Then the package's own function gives it, value by value."""
    import thermal.comfort as comfort

    by_loop = standard_effective_temperature([20.0, 30.0], 25.0)
    monkeypatch.setitem(sys.modules, "thermal.two_nodes", None)
    monkeypatch.setattr(comfort, "_set_of_hours", comfort._set_of_hours.__wrapped__)
    assert comfort._set_of_hours() is comfort._set_tmp
    np.testing.assert_allclose(standard_effective_temperature([20.0, 30.0], 25.0), by_loop, rtol=1e-12)


@pytest.mark.parametrize("index", [pmv_ppd, standard_effective_temperature])
def test_surroundings_are_broadcast_and_checked(index):
    def first(**changes):
        found = index([22.0, 26.0], 24.0, **changes)
        return found[0] if isinstance(found, tuple) else found

    still = first(air_speed=[0.1, 0.1], humidity=[40.0, 60.0])
    assert still.shape == (2,)
    np.testing.assert_allclose(still, [first(humidity=40.0)[0], first(humidity=60.0)[1]])
    for changes, words in (
        ({"air_speed": -0.1}, "air speed"),
        ({"humidity": 100.5}, "humidity"),
        ({"humidity": -0.5}, "humidity"),
        ({"humidity": [50.0, 50.0, 50.0]}, "comfort"),
    ):
        with pytest.raises(ThermalInputError, match=words):
            first(**changes)
    with pytest.raises(ThermalInputError, match="missing"):
        index([np.nan], 24.0)


def test_degree_hours_of_half_hours_by_hand():
    assert degree_hours([26.0, 27.0, 24.0], 25.0, step_h=0.5) == 1.5
    assert degree_hours([26.0, 27.0], [26.5, 25.0], step_h=2.0) == 4.0


@pytest.mark.parametrize("index", [pmv_ppd, standard_effective_temperature])
def test_stated_defaults_and_no_rounding(index):
    """0.1 m/s, 50 %, 1.2 met, 0.5 clo; the package would round to two digits."""
    found = np.asarray(index([31.7], 40.0))
    full = index([31.7], 40.0, air_speed=0.1, humidity=50.0, metabolic_rate=1.2, clothing=0.5)
    np.testing.assert_array_equal(found, np.asarray(full))
    assert np.any(np.abs(np.round(found, 2) - found) > 1e-6)
    hot = index([60.0], 60.0)  # outside the standard's limits: computed all the same
    assert np.all(np.isfinite(hot))
