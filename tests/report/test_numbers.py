"""Headline figures, tables and the digits they show."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from scenes.language.catalogue import in_language, ngettext
from scenes.language.numbers import cell, day_and_month, percent, rounded, significant
from scenes.report import tables
from scenes.report.headline import WARM_C, named_like
from scenes.report.names import glossary, quantity
from scenes.report.thermal_figures import duration_curve, extreme_weeks, gains_chart
from tests.report.synthetic import run_result


@pytest.fixture(scope="module")
def room():
    return run_result(picture_size=32, pictures=2).spaces[0]


def test_one_of_a_thing_is_not_several() -> None:
    counted = [ngettext("{count} hour", "{count} hours", number) for number in (1, 0, 8760)]
    assert counted == ["1 hour", "0 hours", "8\u202f760 hours"]


def test_digits() -> None:
    assert rounded(-0.04, 1) == "0.0"
    assert rounded(-3.25, 1) in ("−3.2", "−3.3")
    assert rounded(12345.6, 0) == "12\u202f346"
    assert significant(1234.5, 2) == "1\u202f200"
    assert significant(0.0123456, 2) == "0.012"
    assert significant(0.0) == "0"
    assert percent(99.96) == "99.9", "100 % only when nothing is missing"
    assert percent(100.0) == "100"
    assert percent(3.14) == "3.1"
    assert percent(float("nan")) == "–"
    assert cell(12345.6, 1) == "12345.6", "cells are copied into spreadsheets"
    assert cell(float("nan"), 1) == ""


@pytest.mark.parametrize(
    ("language", "dates"),
    [
        ("en", ("3 March", "29 February", "3 Mar")),
        ("de", ("3. März", "29. Februar", "3. März")),
        ("fr", ("3 mars", "29 février", "3 mars")),
    ],
)
def test_dates_are_those_of_the_language_the_day_and_the_length(language, dates) -> None:
    with in_language(language):
        times = pd.to_datetime(["2021-03-03 00:30", "2020-02-29 23:30", "2021-03-03 12:30"])
        named = tuple(day_and_month(time, short=i == 2) for i, time in enumerate(times))
    assert named == dates


@pytest.mark.parametrize(
    ("dgp", "word"),
    [
        (0.2, "imperceptible"),
        (0.35, "imperceptible"),
        (0.351, "perceptible"),
        (0.44, "disturbing"),
        (0.46, "intolerable"),
    ],
)
def test_classes_of_glare(dgp, word) -> None:
    assert tables.glare_class(dgp) == word


def test_names_are_found_whole() -> None:
    keys = ["daylight_factor", "da300", "udi_300_3000"]
    assert named_like(keys, "da") == "da300", "daylight_factor is no daylight autonomy"
    assert named_like(keys, "ase") is None


def test_unknown_names_become_labels_with_units() -> None:
    assert quantity("surface_of_wall_c").unit == "°C"
    assert quantity("udi_100_3000").label == "UDI 100–3000 lx"
    assert "above 3000 lx" in quantity("udi_above_3000").meaning
    assert quantity("within_80").label == "Within the 80 % limits"
    terms = [term for term, _ in glossary()]
    assert {"DGP", "sDA", "UDI", "g-value", "lx"} <= set(terms)


def test_months_add_up_to_the_year_at_any_step(room) -> None:
    gains = room.heat.gains
    monthly = tables.monthly_gains(gains)
    np.testing.assert_allclose(monthly.sum(), gains.sum() / 1000, rtol=1e-12)
    quarters = gains.iloc[:480].resample("15min").ffill()
    step = tables.monthly_gains(quarters)
    np.testing.assert_allclose(step.sum(), quarters.sum() / 4000, rtol=1e-12)
    shown = tables.gains_table(monthly).rows
    assert shown[-1][0] == "Sum" and len(shown) == 13


def test_stack_of_gains_leaves_out_what_is_counted_already(room) -> None:
    chart = gains_chart(tables.monthly_gains(room.heat.gains))
    labels = [mark.label for mark in chart.marks]
    assert labels == ["Incident on the glass", "Transmitted", "Absorbed, outer layer", "Absorbed, inner layer"]


def test_duration_curve_crosses_at_the_counted_hours(room) -> None:
    operative = room.heat.temperatures["operative_c"]
    chart = duration_curve(room)
    series = dict(chart.readout.series)["Operative temperature"]
    shown = np.array([float(text.removesuffix(" °C").replace("−", "-")) for text in series])
    assert np.all(np.diff(shown) <= 0)
    hours = 8760 * np.searchsorted(-shown, -WARM_C) / (len(shown) - 1)
    # the curve has a point every 36.5 hours
    assert hours == pytest.approx((operative > WARM_C).sum(), abs=40)


def test_warmest_and_coldest_week_hold_the_planted_extremes(room) -> None:
    temperatures = room.heat.temperatures
    temperatures.loc["2023-05-08":"2023-05-14", "operative_c"] += 30
    temperatures.loc["2023-10-02":"2023-10-08", "operative_c"] -= 40
    warm, cold = extreme_weeks(room)
    assert warm.title == "Warmest week: 8 May to 14 May"
    assert cold.title == "Coldest week: 2 October to 8 October"
    assert len(warm.readout.x) == 168


def test_glare_table_is_in_order_and_names_the_class() -> None:
    result = run_result(picture_size=32, pictures=3)
    table = tables.glare_table(result.times, result.spaces[0].glare.pictures)
    labels = [column.label for column in table.columns]
    assert labels[:4] == ["Hour", "DGP", "Class", "Ev"]
    hours = [row[0] for row in table.rows]
    assert hours == sorted(hours)
    for row in table.rows:
        assert row[2] == tables.glare_class(float(row[1]))


def test_values_that_are_classes_are_named() -> None:
    table = tables.values_table("x", {"en17037_level": 2.0, "sda300_50": 61.7, "odd": None})
    assert [row[1] for row in table.rows] == ["medium", "62", ""]


def test_nested_manifest_becomes_rows() -> None:
    table = tables.nested_table("x", {"a": {"b_c": 1.5, "d": [1, 2]}, "e": None})
    assert table.rows == (("a › b c", "1.5"), ("a › d", "1, 2"), ("e", "–"))


def test_step_is_the_shortest_one() -> None:
    times = pd.DatetimeIndex(["2023-01-01 00:30", "2023-01-01 01:00", "2023-01-01 02:00"])
    assert tables.step_hours(times) == 0.5
