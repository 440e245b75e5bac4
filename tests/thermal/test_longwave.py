"""Longwave and films: closed forms, symmetry, limits."""

from __future__ import annotations

import numpy as np
import pytest

from thermal.convection import doe2_outside, iso15099_inside, local_wind_factor, tarp_inside
from thermal.longwave import (
    area_view_factors,
    exchange_from_view_factors,
    exchange_star,
    outside_factors,
)
from thermal.shortwave import absorbed_after_reflections, spread_evenly


def test_parallel_plates_exchange_by_the_closed_form():
    x = exchange_from_view_factors([2.0, 2.0], [0.9, 0.3], [[0.0, 1.0], [1.0, 0.0]])
    assert x[0, 1] == pytest.approx(2.0 / (1 / 0.9 + 1 / 0.3 - 1))
    assert x[0, 1] == pytest.approx(x[1, 0])


def test_exchange_is_symmetric_and_sums_to_area_times_emissivity():
    rng = np.random.default_rng(1)
    area, eps = rng.uniform(1, 20, 7), rng.uniform(0.1, 1.0, 7)
    f = rng.uniform(0.5, 1.5, (7, 7)) * area
    f /= f.sum(axis=1, keepdims=True)
    x = exchange_from_view_factors(area, eps, f)
    np.testing.assert_allclose(x, x.T, atol=1e-9)
    np.testing.assert_allclose(x.sum(axis=1), area * eps, rtol=1e-6)


def test_star_agrees_with_view_factors_in_a_cube():
    normals = np.concatenate([np.eye(3), -np.eye(3)])
    area, eps = np.full(6, 9.0), np.full(6, 0.9)
    star = exchange_star(area, eps)
    exact = exchange_from_view_factors(area, eps, area_view_factors(area, normals))
    off = ~np.eye(6, dtype=bool)
    # the star lets a face "see" itself, so its other exchanges carry the same total in a cube
    np.testing.assert_allclose(star[off].sum(), exact[off].sum(), rtol=0.02)


def test_hemisphere_shares_sum_to_one():
    for z in (-1.0, 0.0, 0.5, 1.0):
        assert sum(outside_factors(z)) == pytest.approx(1.0)
    sky, air, ground = outside_factors(0.0)
    assert (sky, air, ground) == pytest.approx((0.5**1.5, 0.5 - 0.5**1.5, 0.5))


def test_what_hides_the_sky_counts_with_the_ground():
    sky, air, below = outside_factors(0.0, 0.6)
    assert (sky, air) == pytest.approx((0.6 * 0.5**1.5, 0.6 * (0.5 - 0.5**1.5)))
    assert sky + air + below == pytest.approx(1.0)
    assert outside_factors(1.0, 0.25) == pytest.approx((0.25, 0.0, 0.75))
    assert outside_factors(-1.0, 0.25) == pytest.approx((0.0, 0.0, 1.0))


def test_films_know_up_and_down():
    # EQUATIONS.md 5.1: 1.520 unstable, 0.760 stable, 1.31 vertical
    assert tarp_inside(21.0, 20.0, -1.0) == pytest.approx(1.520, abs=1e-3)
    assert tarp_inside(19.0, 20.0, -1.0) == pytest.approx(0.760, abs=1e-3)
    assert tarp_inside(19.0, 20.0, 1.0) == pytest.approx(1.520, abs=1e-3)
    assert tarp_inside(28.0, 20.0, 0.0) == pytest.approx(2.62)
    assert tarp_inside(20.0, 20.0, 0.0) == 0.1


def test_outside_film_is_natural_in_still_air_and_rough_walls_cool_more():
    still = doe2_outside(30.0, 22.0, 0.0, 0.0, 1.52)
    assert still == pytest.approx(2.62)
    smooth, rough = (doe2_outside(30.0, 22.0, 0.0, 8.0, r) for r in (1.0, 2.17))
    assert smooth == pytest.approx(np.hypot(2.62, 8.0))
    assert rough > smooth


def test_wind_profile():
    # EQUATIONS.md section 4: V_met (270/10)^.14 (z/370)^.22 in suburbs
    assert local_wind_factor(10.0, "suburbs") == pytest.approx(27**0.14 * (10 / 370) ** 0.22)
    assert local_wind_factor(10.0, "country") == pytest.approx(1.0)
    with pytest.raises(ValueError, match="terrain"):
        local_wind_factor(10.0, "sea")


def test_glass_film_near_the_plane_wall():
    # by hand at 290.65 K: Ra = 9.81 * 10 * 1.5^3 / (290.65 * 1.49e-5 * 2.10e-5) = 3.64e9, laminar,
    # Nu = 0.56 Ra^(1/4) = 137.6, h = 137.6 * 0.0254 / 1.5; property tables agree to 2 %
    assert iso15099_inside(10.0, 20.0, 1.5) == pytest.approx(2.33, rel=0.02)


def test_room_light_is_conserved():
    rng = np.random.default_rng(5)
    area = rng.uniform(2, 20, 6)
    rho = rng.uniform(0.1, 0.8, 6)
    hit = rng.uniform(0, 100, (4, 6))
    exchange = np.tile(area / area.sum(), (6, 1))
    kept = absorbed_after_reflections(hit, rho, exchange)
    np.testing.assert_allclose(kept.sum(axis=1), hit.sum(axis=1))
    # with view factors by area the series is EnergyPlus' uniform spread exactly
    np.testing.assert_allclose(kept, spread_evenly(hit, rho, area), rtol=1e-9)
