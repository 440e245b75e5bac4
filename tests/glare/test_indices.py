"""Glare indices: closed forms, limits, and the order that a fraction of disturbed people has."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mitsuba_cfs.glare import classes, indices
from mitsuba_cfs.glare.position_index import guth_index, iwata_index, kim_index, position_index, view_angles
from mitsuba_cfs.images.view import fisheye, frame

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


def test_each_index_by_hand():
    inf, nan = math.inf, math.nan
    # Q = 20.4 omega + 1.52 omega^0.2 - 0.075 of an omega of 0.01; of one source the power is 1
    Q = 0.204 + 1.52 * 0.01**0.2 - 0.075
    dgi = 10 * math.log10(0.478 * 1e4**1.6 * 0.0025**0.8 / (2**0.85 + 70))
    none = ([], [], [])
    for value, by_hand in (
        (indices.daylight_glare_probability(0.5, 0.0), 5.87e-5 * 0.5 + 0.159),
        # contrast 0.25 * 400 / 100 = 1: UGR 0, UGP 0
        (indices.unified_glare_rating(400.0, 100.0), 0.0),
        (indices.unified_glare_rating(1.0, 0.25), 0.0),
        (indices.unified_glare_rating(400.0, 0.0), -99.0),
        (indices.unified_glare_probability(400.0, 100.0), 0.0),
        (indices.unified_glare_probability(0.0, 100.0), 0.0),
        (indices.unified_glare_probability(0.4, 0.01), 0.26),
        # (1 + 2/7 32^-0.2)^-10 = (8/7)^-10
        (indices.logistic_ugp(3200.0, 100.0), (8 / 7) ** -10),
        (indices.logistic_ugp(0.32, 0.01), (8 / 7) ** -10),
        (indices.logistic_ugp(0.0, 100.0), 0.0),
        (indices.cie_glare_index(1000.0, 1000.0, 0.0), 8 * math.log10(2.0)),
        (indices.cie_glare_index(0.5, 1.0, 0.0), 0.0),
        (indices.simplified_dgp(1000.0), 0.2462),
        (indices.age_factor(70.0), 1 / 0.75),
        (indices.age_factor(0.0), 1 / 1.1),
        (indices.low_light_factor(1000.0 / 3), 1 / (1 + math.exp(-4.0))),
        (indices.discomfort_glare_rating(*ONE, 3.0), 0.5 * 1e4 * Q / (2 * 3**0.44)),
        (indices.discomfort_glare_rating(*none, 3.0), 0.0),
        (indices.modified_dgi(*ONE, 2 * math.pi), dgi),
        (
            indices.daylight_glare_index([1e4], [0.01], [3.0], 100),
            10 * math.log10(0.478 * 1e4**1.6 * (0.01 / 9) ** 0.8 / 170),
        ),
        # E_v = 10 pi: 8; sum L omega/P^2 = 1e4 * 0.01 / 4 = 25 over 0.25: 16
        (indices.experimental_ugr(*ONE, 0.25, 10 * math.pi), 24.0),
        (indices.experimental_ugr([1e4], [0.02], [3.0], 1.0, math.pi), 8 * math.log10(200 / 9)),
        (indices.experimental_ugr(*none, 2.5, 10 * math.pi), 0.0),
        (indices.visual_comfort_probability(19.9), 100.0),
        (indices.visual_comfort_probability(20.0), 50 * math.erf((6.374 - 1.3227 * math.log(20)) / math.sqrt(2)) + 50),
        (indices.visual_comfort_probability(750.5), 0.0),
        (indices.cie_veiling_luminance([2.7], np.radians([3.0]))[0], 3.0),
        (indices._ratio(0.5, 0.0), inf),
        (indices._ratio(0.0, 2.0), 0.0),
        (indices._ratio(0.0, 0.0), nan),
        (indices._log10(0.0), -inf),
        (indices._log10(0.1), -1.0),
        (indices._log10(-1.0), nan),
    ):
        assert value == pytest.approx(by_hand, rel=1e-9, abs=1e-12, nan_ok=True)
    with pytest.raises(ValueError, match="age"):
        indices.age_factor(150.0)


def test_position_indices_by_hand():
    """Guth's at 20 and 90 degrees, Kim's of four angles, by their polynomials in degrees."""
    for sigma, tau in ((20.0, 90.0), (35.0, 45.0)):
        linear = 35.2 - 0.31889 * tau - 1.22 * math.exp(-2 * tau / 9)
        square = 21 + 0.26667 * tau - 0.002963 * tau**2
        guth = math.exp(1e-3 * linear * sigma + 1e-5 * square * sigma**2)
        assert guth_index(*np.radians([sigma, tau])) == pytest.approx(guth)
        middle = -9e-6 * tau**3 + 1.4e-3 * tau**2 + 0.0866 * tau + 21.633
        width = -9e-6 * tau**3 + 1.3e-3 * tau**2 + 0.0853 * tau + 8.772
        kim = math.exp((sigma - middle) / width)
        assert kim_index(*np.radians([sigma, tau])) == pytest.approx(kim)
    # at 30 degrees straight to the side Iwata's beta is sigma
    assert iwata_index(math.pi / 6, math.pi / 2) == pytest.approx(math.exp(0.1947 + 0.189))
    view = fisheye((0, 0, 0), (0, 1, 0), 100)
    above = [0.0, math.cos(0.3), math.sin(0.3)]
    aside = [math.sin(0.3), math.cos(0.3), 0.0]
    sigma, tau, below = view_angles([above, aside, [0, 1, 0], [1, 0, 0], [0, 0, -1]], view)
    assert sigma == pytest.approx([0.3, 0.3, 0.0, math.pi / 2, math.pi / 2])
    assert tau[:2] == pytest.approx([0.0, math.pi / 2]) and tau[3:] == pytest.approx([math.pi / 2, math.pi])
    assert list(below) == [False, False, False, False, True]
    assert view_angles([[0, 1, 0.5]], view)[2] == [False]
    assert position_index([above], view, model="kim") == pytest.approx(kim_index(0.3, 0.0))
    assert position_index([above], view) == pytest.approx(guth_index(0.3, 0.0))


def test_tau_is_measured_from_the_vector_that_was_stated():
    """Looking 45 degrees down with the vertical as up: what is above the axis is 45 degrees off."""
    view = fisheye((0, 0, 0), (0, 1, -1), 100)
    forward, up = np.array([0, 1, -1]) / math.sqrt(2), np.array([0, 1, 1]) / math.sqrt(2)
    _, tau, below = view_angles([math.cos(0.2) * forward + math.sin(0.2) * up], view)
    assert tau == pytest.approx([math.pi / 4]) and not below[0]


def test_shares_and_quantiles_refuse_what_is_no_year():
    for wrong in ([], [[0.3]], [0.3, np.nan]):
        for function in (classes.hour_not_exceeded, lambda dgp: classes.exceeded_share(dgp, 0.4)):
            with pytest.raises(ValueError, match="all finite"):
                function(wrong)
    tenths = np.arange(10) / 10
    assert classes.hour_not_exceeded(tenths, 0.1) == 0.8
    assert classes.hour_not_exceeded(tenths, 0.099) == 0.9  # not one whole hour
    assert classes.hour_not_exceeded(tenths, 0.0) == 0.9
    assert classes.exceeded_share(tenths, 0.8) == pytest.approx(0.1)
    hours = classes.class_hours([0.35, 0.36, 0.40, 0.45, 0.46, 0.47])
    assert list(hours) == [1, 2, 1, 2] and len(classes.class_hours([0.1])) == 4


def test_the_error_of_a_year_is_the_root_mean_square_of_the_known_hours():
    assert classes.mean_error([3e-3, float("nan"), 4e-3]) == pytest.approx(3.5355e-3, rel=1e-4)
    assert classes.mean_error([float("nan")]) is None and classes.mean_error([]) is None


def test_the_line_of_sight_itself_and_its_opposite_have_angles():
    """Cosines of unit vectors round above one, whose arc cosine is no number."""
    random = np.random.default_rng(2).normal(size=(300, 3))
    sights = random / np.linalg.norm(random, axis=1, keepdims=True)
    beyond = 0
    for forward in sights:
        view = fisheye((0, 0, 0), forward, 1)
        beyond += forward @ frame(view)[2] > 1.0
        sigma, tau, _ = view_angles([forward, -forward, frame(view)[1]], view)
        np.testing.assert_allclose(sigma, [0.0, np.pi, np.pi / 2], atol=1e-7)
        assert np.isfinite(tau).all()
    assert beyond > 10


def test_a_source_too_small_for_the_discomfort_rating_is_no_glare():
    # Q of 1e-7 sr is 20.4e-7 + 1.52 (1e-7)^0.2 - 0.075 = -0.0145: its root would be no number
    rating = indices.discomfort_glare_rating([1e6, 1e6], [1e-7, 1e-7], [1.0, 1.0], 100.0)
    assert rating == 0.0
    assert indices.visual_comfort_probability(rating) == 100.0


def test_angles_of_unit_vectors_are_numbers():
    """A unit vector times itself is 1 plus or minus a rounding, whose arc cosine there is not."""
    random = np.random.default_rng(3)
    for along, up in random.normal(size=(300, 2, 3)):
        view = fisheye((0.0, 0.0, 0.0), along, 64, up=up / np.linalg.norm(up))
        _, across, forward = frame(view)
        assert view_angles([forward], view)[0] == pytest.approx(0.0, abs=1e-7)
        above = np.cos(0.3) * forward + np.sin(0.3) * across  # tau is 0 where the given up is across the view
        (sigma,), (tau,), (below,) = view_angles([above], fisheye((0.0, 0.0, 0.0), along, 64, up=across))
        assert sigma == pytest.approx(0.3) and tau == pytest.approx(0.0, abs=1e-6) and not below
