"""Panes and glazings: Fresnel's formulas, conservation of energy, WINDOW's engine."""

from __future__ import annotations

import numpy as np
import pytest

from thermal.errors import ThermalInputError
from thermal.panes import coated_pane, hemispherical, stack, turned, uncoated_pane

ANGLES = np.radians(np.arange(0.0, 90.0, 10.0))


def test_pane_returns_its_normal_values_and_glass_its_index():
    pane = uncoated_pane([0.0], 0.834, 0.075)
    assert pane.tau[0] == pytest.approx(0.834, abs=1e-12)
    assert pane.rho_front[0] == pytest.approx(0.075, abs=1e-12)
    # lossless glass of index 1.5: rho = 2 r/(1 + r), r = 0.04
    clear = uncoated_pane([0.0, np.radians(56.31)], 1 - 0.08 / 1.04, 0.08 / 1.04)
    assert clear.tau[0] == pytest.approx(1 - 0.08 / 1.04)
    # at Brewster's angle one polarisation passes wholly: rho = half that of the other
    s = ((1.5**2 - 1) / (1.5**2 + 1)) ** 2
    assert clear.rho_front[1] == pytest.approx(s / (1 + s), abs=1e-5)


def test_stack_conserves_energy_and_is_reciprocal():
    a, b, c = (uncoated_pane(ANGLES, *v) for v in ((0.8, 0.07), (0.5, 0.2), (0.7, 0.08)))
    forward, backward = stack([a, b, c]), stack([c, b, a])
    total = forward.tau + forward.rho + forward.absorptance.sum(axis=-1)
    np.testing.assert_allclose(total, 1.0, atol=1e-12)
    np.testing.assert_allclose(forward.tau, backward.tau, atol=1e-12)
    np.testing.assert_allclose(forward.rho_back, backward.rho, atol=1e-12)


def test_two_panes_by_the_geometric_series():
    pane = uncoated_pane([0.0], 0.834, 0.075)
    both = stack([pane, pane])
    assert both.tau[0] == pytest.approx(0.834**2 / (1 - 0.075**2))
    assert both.rho[0] == pytest.approx(0.075 + 0.834**2 * 0.075 / (1 - 0.075**2))


def test_hemispherical_mean_of_a_cosine():
    theta = np.radians(np.linspace(0, 90, 91))
    assert hemispherical(np.ones(91), theta) == pytest.approx(1.0)
    assert hemispherical(np.cos(theta), theta) == pytest.approx(2 / 3, abs=1e-3)


def test_coated_pane_keeps_its_normal_values_and_energy():
    angles = np.radians(np.linspace(0.0, 90.0, 91))
    low_e = coated_pane(angles, 0.452, 0.359, 0.397)
    for got, normal in ((low_e.tau, 0.452), (low_e.rho_front, 0.359), (low_e.rho_back, 0.397)):
        assert got[0] == pytest.approx(normal, rel=0.02)  # the polynomials' own error at 0 degrees
    for rho in (low_e.rho_front, low_e.rho_back):
        assert np.all(low_e.tau + rho <= 1.0 + 1e-12)
        assert rho[-1] == pytest.approx(1.0, abs=0.01)
    assert low_e.tau[-1] == pytest.approx(0.0, abs=1e-9)
    assert np.all(np.diff(low_e.tau[20:]) <= 0.0)
    # the shape is that of bronze glass of 3 mm by Fresnel; the polynomials fit it to 80 degrees
    bronze = uncoated_pane(angles, 0.645, 0.062)
    same = coated_pane(angles, 0.645, 0.062, 0.062)
    np.testing.assert_allclose(same.tau[:80], bronze.tau[:80], atol=0.02)
    np.testing.assert_allclose(same.rho_front[:80], bronze.rho_front[:80], atol=0.02)
    assert turned(low_e).rho_front is low_e.rho_back
    with pytest.raises(ThermalInputError, match="exceeds 1"):
        coated_pane(angles, 0.7, 0.2, 0.4)
