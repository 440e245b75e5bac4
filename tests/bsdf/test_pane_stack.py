"""Panes behind each other: Fresnel's formulas, conservation of energy, a geometric series."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.glazing import Pane, hemispherical_mean, pane_optics, stack

ANGLES = np.radians(np.arange(0.0, 90.0, 10.0))


def glass(theta, tau, rho):
    return pane_optics(Pane("glass", tau, rho, rho), np.asarray(theta))


def low_e(theta, *values):
    return pane_optics(Pane("low-e", *values, coated=True), np.asarray(theta))


def test_pane_returns_its_normal_values_and_glass_its_index():
    pane = glass([0.0], 0.834, 0.075)
    assert pane.tau[0] == pytest.approx(0.834, abs=1e-12)
    assert pane.rho_front[0] == pytest.approx(0.075, abs=1e-12)
    # lossless glass of index 1.5: rho = 2 r/(1 + r), r = 0.04
    clear = glass([0.0, np.radians(56.31)], 1 - 0.08 / 1.04, 0.08 / 1.04)
    assert clear.tau[0] == pytest.approx(1 - 0.08 / 1.04)
    # at Brewster's angle one polarisation passes wholly: rho = half that of the other
    s = ((1.5**2 - 1) / (1.5**2 + 1)) ** 2
    assert clear.rho_front[1] == pytest.approx(s / (1 + s), abs=1e-5)


def test_stack_conserves_energy_and_is_reciprocal():
    a, b, c = (glass(ANGLES, *v) for v in ((0.8, 0.07), (0.5, 0.2), (0.7, 0.08)))
    forward, backward = stack([a, b, c]), stack([c, b, a])
    total = forward.tau + forward.rho_front + forward.absorptance.sum(axis=-1)
    np.testing.assert_allclose(total, 1.0, atol=1e-12)
    np.testing.assert_allclose(forward.tau, backward.tau, atol=1e-12)
    np.testing.assert_allclose(forward.rho_back, backward.rho_front, atol=1e-12)


def test_two_panes_by_the_geometric_series():
    pane = glass([0.0], 0.834, 0.075)
    both = stack([pane, pane])
    assert both.tau[0] == pytest.approx(0.834**2 / (1 - 0.075**2))
    assert both.rho_front[0] == pytest.approx(0.075 + 0.834**2 * 0.075 / (1 - 0.075**2))


def test_hemispherical_mean_of_a_cosine():
    theta = np.radians(np.linspace(0, 90, 91))
    assert hemispherical_mean(np.ones(91), theta) == pytest.approx(1.0)
    assert hemispherical_mean(np.cos(theta), theta) == pytest.approx(2 / 3, abs=1e-3)


def test_coated_pane_keeps_its_normal_values_and_energy():
    angles = np.radians(np.linspace(0.0, 90.0, 91))
    pane = low_e(angles, 0.452, 0.359, 0.397)
    for got, normal in ((pane.tau, 0.452), (pane.rho_front, 0.359), (pane.rho_back, 0.397)):
        assert got[0] == pytest.approx(normal, abs=1e-12)
        assert got[1] == pytest.approx(normal, rel=0.02)  # the polynomials' own error there
    for rho in (pane.rho_front, pane.rho_back):
        assert np.all(pane.tau + rho <= 1.0 + 1e-12)
        assert rho[-1] == pytest.approx(1.0, abs=0.01)
    assert pane.tau[-1] == pytest.approx(0.0, abs=1e-9)
    assert np.all(np.diff(pane.tau[20:]) <= 0.0)
    # the shape is that of bronze glass of 3 mm by Fresnel; the polynomials fit it to 80 degrees
    bronze = glass(angles, 0.645, 0.062)
    same = low_e(angles, 0.645, 0.062, 0.062)
    np.testing.assert_allclose(same.tau[:80], bronze.tau[:80], atol=0.02)
    np.testing.assert_allclose(same.rho_front[:80], bronze.rho_front[:80], atol=0.02)
    assert pane.turned().rho_front is pane.rho_back
    with pytest.raises(ValueError, match="shares of 1"):
        low_e(angles, 0.7, 0.2, 0.4)
