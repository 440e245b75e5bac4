"""Panes and glazings: Fresnel's formulas, conservation of energy, WINDOW's engine."""

from __future__ import annotations

import numpy as np
import pytest

from thermal.panes import hemispherical, stack, uncoated_pane

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
