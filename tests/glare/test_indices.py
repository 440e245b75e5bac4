"""Glare indices: closed forms, limits, and the order that a fraction of disturbed people has."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mitsuba_cfs.glare import classes, indices
from mitsuba_cfs.glare.position_index import guth_index, iwata_index, kim_index, position_index
from mitsuba_cfs.images.view import fisheye

ONE = (np.array([1e4]), np.array([0.01]), np.array([2.0]))  # L, omega, P
CONTRAST = 1e8 * 0.01 / 4


def test_one_source_by_hand():
    assert indices.contrast_term(*ONE) == pytest.approx(CONTRAST)
    assert indices.unified_glare_rating(CONTRAST, 100) == pytest.approx(8 * math.log10(625))
    cgi = 8 * math.log10(2 * (1 + 250 / 500) / 1000 * CONTRAST)
    assert indices.cie_glare_index(CONTRAST, 1000, 250) == pytest.approx(cgi)
    term = 0.478 * 1e4**1.6 * 0.0025**0.8 / (100 + 0.07 * 0.1 * 1e4)
    assert indices.daylight_glare_index(*ONE, 100) == pytest.approx(10 * math.log10(term))
    dgp = 5.87e-5 * 1000 + 0.092 * math.log10(1 + CONTRAST / 1000**1.87) + 0.159
    assert indices.daylight_glare_probability(1000, CONTRAST) == pytest.approx(dgp)
    assert indices.unified_glare_probability(CONTRAST, 100) == pytest.approx(0.26 * math.log10(625))


def test_two_equal_sources_add_as_the_index_says():
    two = tuple(np.repeat(a, 2) for a in ONE)
    ugr = indices.unified_glare_rating(indices.contrast_term(*two), 100)
    assert ugr - indices.unified_glare_rating(CONTRAST, 100) == pytest.approx(8 * math.log10(2))
    single = indices.discomfort_glare_rating(*ONE, 100)
    assert indices.discomfort_glare_rating(*two, 100) == pytest.approx((2 * single) ** 2**-0.0914)


def test_nothing_to_glare():
    none = (np.zeros(0),) * 3
    assert indices.contrast_term(*none) == 0
    assert indices.unified_glare_rating(0, 100) == 0 and indices.cie_glare_index(0, 100, 0) == 0
    assert indices.daylight_glare_index(*none, 10) == 0
    assert indices.daylight_glare_probability(0, 0) == 0.159
    assert indices.visual_comfort_probability(indices.discomfort_glare_rating(*none, 1)) == 100


def test_dgp_ends_at_one_and_vcp_at_its_limits():
    assert indices.daylight_glare_probability(1e5, 1e12) == 1
    assert indices.simplified_dgp(1e5) == 1 and indices.simplified_dgp(0) == 0.184
    assert indices.visual_comfort_probability(800) == 0
    half = math.exp(6.374 / 1.3227)
    assert indices.visual_comfort_probability(half) == pytest.approx(50, abs=1e-9)


def test_corrections():
    assert indices.low_light_factor(4 / 0.024) == pytest.approx(0.5)
    assert indices.low_light_factor(1000) == 1 and indices.low_light_factor(0) < 0.02
    assert indices.age_factor(20) == 1 and indices.age_factor(70) > 1.3
    with pytest.raises(ValueError, match="age"):
        indices.age_factor(-3)


def test_position_index_at_the_line_of_sight_and_above():
    assert guth_index(0.0, 1.0) == 1 and iwata_index(0.0, 1.0) == 1
    # straight above (tau = 0), 10 degrees: ln P = 33.98e-3 * 10 + 21e-5 * 100
    assert guth_index(np.radians(10), 0.0) == pytest.approx(np.exp(0.3398 + 0.021))
    # straight below: tan beta = tan sigma sqrt(1.3225) = 1.15 tan sigma
    beta = np.degrees(np.arctan(1.15 * np.tan(np.radians(30))))
    expected = np.exp(0.00649 * beta + 0.00021 * beta**2)
    assert iwata_index(np.radians(30), np.pi) == pytest.approx(expected)
    assert kim_index(np.radians(21.633), 0.0) == pytest.approx(1.0)


def test_position_index_is_symmetric_left_to_right_and_limited():
    view = fisheye((0, 0, 0), (0, 1, 0), 100)
    random = np.random.default_rng(2).normal(size=(200, 3))
    random[:, 1] = np.abs(random[:, 1])
    directions = random / np.linalg.norm(random, axis=1, keepdims=True)
    mirrored = directions * [-1, 1, 1]
    P = position_index(directions, view)
    assert np.allclose(P, position_index(mirrored, view)) and P.max() <= 16 and P.min() >= 1
    higher, lower = position_index([[0, 1, 0.5], [0, 1, -0.5]] / np.sqrt(1.25), view)
    assert higher > lower  # what is above disturbs less than what is as far below
    with pytest.raises(ValueError, match="expected 'guth' or 'kim'"):
        position_index(directions, view, model="other")


def test_classes_and_the_rule_of_en_17037():
    named = [classes.glare_class(dgp) for dgp in (0.2, 0.35, 0.36, 0.41, 0.46)]
    assert named == ["imperceptible", "imperceptible", "perceptible", "disturbing", "intolerable"]
    year = np.full(1000, 0.3)
    assert classes.protection_level(year) == "high"
    year[:50] = 0.5  # exactly 5 %: still allowed
    assert classes.protection_level(year) == "high"
    year[:51] = 0.38
    assert classes.protection_level(year) == "medium"
    year[:51] = 0.44
    assert classes.protection_level(year) == "minimum"
    year[:51] = 0.46
    assert classes.protection_level(year) == "none"
    assert classes.hour_not_exceeded(year) == 0.46 and classes.exceeded_share(year, 0.45) == 0.051
    assert list(classes.class_hours(year)) == [949, 0, 0, 51]
    with pytest.raises(ValueError, match="finite"):
        classes.protection_level([0.3, np.nan])


def test_veiling_luminance_by_hand():
    """At 30 and 60 degrees: 5 L omega cos(sigma)/sigma."""
    sigma = np.radians([30.0, 60.0])
    by_hand = 5 * (1e4 * 0.01 * math.sqrt(3) / 2 / 30 + 2e4 * 0.02 * 0.5 / 60)
    assert indices.veiling_luminance([1e4, 2e4], [0.01, 0.02], sigma) == pytest.approx(by_hand)
