"""Panes behind each other: Fresnel's formulas, conservation of energy, a geometric series.

The simple window model: pinned to its polynomials' values, energy kept, g given back.
"""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.glazing import (
    Pane,
    _diffuse,
    absorbed_by_layers,
    hemispherical_mean,
    pane_optics,
    pane_values,
    solar_reflectance,
    solar_transmittance,
    specular_klems,
    stack,
    visible_reflectances,
)
from mitsuba_cfs.bsdf.klems import KLEMS_FULL

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


@pytest.mark.parametrize(
    ("u", "g", "expected"),
    [
        (1.0, 0.1, 0.04104),
        (1.2, 0.5, 0.418463),
        (5.8, 0.5, 0.33666),
        (5.8, 0.82, 0.764253),
        (3.95, 0.5, (0.418463 + 0.33666) / 2),
    ],
)
def test_solar_transmittance_is_that_of_the_polynomials(u, g, expected) -> None:
    assert solar_transmittance(u, g) == pytest.approx(expected, abs=2e-6)


def test_shares_of_one_in_the_whole_range() -> None:
    for u in np.linspace(0.3, 5.8, 12):
        for g in np.linspace(0.02, 0.95, 20):
            tau = solar_transmittance(u, g)
            rho = solar_reflectance(u, g, tau)
            assert 0 < tau <= g and 0 <= rho < 1 - tau
            # what is absorbed suffices for what of it goes inwards
            assert g - tau <= 1 - tau - rho + 1e-9
    for tau in np.linspace(0.01, 1, 30):
        assert all(0 <= rho <= 1 - tau for rho in visible_reflectances(tau))


def test_reflectance_by_the_polynomials_of_the_source() -> None:
    """Arasteh, Kohler, Griffith 2009, steps 2, 5 and 6, for insulating and single glazing."""
    for u, g, tau in ((1.2, 0.5, 0.4), (5.8, 0.7, 0.6), (6.2, 0.7, 0.6), (2.0, 0.3, 0.25)):
        x = g - tau
        if u < 4:
            inner = 199.8208128 * x**3 - 90.639733 * x**2 + 19.737055 * x + 6.766575
            outer = 5.763355 * x + 20.541528
        else:
            inner = 29.436546 * x**3 - 21.943415 * x**2 + 9.945872 * x + 7.426151
            outer = 2.225824 * x + 20.57708
        winter = 1.788041 * u - 2.886625 if u >= 5.85 else 0.359073 * np.log(u) + 6.949915
        layer = max(1 / u - 1 / winter - 1 / (0.025342 * u + 29.163853), 0.0)
        inwards = (1 / outer + layer / 2) / (1 / outer + layer + 1 / inner)
        assert solar_reflectance(u, g, tau) == pytest.approx(1 - tau - x / inwards)
    assert solar_reflectance(5.8, 0.99, 0.99) == pytest.approx(0.01, abs=2e-9)
    assert solar_reflectance(5.8, 0.99, 0.99) < 1 - 0.99  # something is absorbed
    assert solar_reflectance(1.2, 0.9, 0.2) == 0.0


def test_visible_reflectances_by_the_polynomials_of_the_source() -> None:
    t = 0.6
    front, back = visible_reflectances(t)
    assert front == pytest.approx(-0.0622 * t**3 + 0.4277 * t**2 - 0.4169 * t + 0.2399)
    assert back == pytest.approx(-0.7409 * t**3 + 1.6531 * t**2 - 1.2299 * t + 0.4547)


def test_transmittance_at_the_ends_of_its_ranges() -> None:
    for u, g, by_hand in (
        (5.8, 0.72, 0.939998 * 0.72**2 + 0.20332 * 0.72),
        (5.8, 0.73, 1.30415 * 0.73 - 0.30515),
        (1.2, 0.15, 0.4104 * 0.15),
        (1.2, 0.16, 0.085775 * 0.16**2 + 0.963954 * 0.16 - 0.084958),
    ):
        assert solar_transmittance(u, g) == pytest.approx(by_hand)
    assert solar_transmittance(5.8, 1.0) <= 1.0


def test_a_dark_pane_returns_its_normal_values():
    """Of the transmittance 0.01 to 0.1, whose inner transmittance is a small number."""
    for tau in (0.01, 0.05, 0.1):
        pane = glass([0.0], tau, 0.045)
        assert (pane.tau[0], pane.rho_front[0]) == pytest.approx((tau, 0.045), rel=1e-6)


def test_a_ring_has_the_pane_at_the_middle_of_its_projected_area():
    """With one angle a ring: sin2 half way between its bounds."""
    pane = Pane("clear", 0.8, 0.08, 0.08)
    found = specular_klems(pane, KLEMS_FULL, subdivision=1)
    sine2 = np.sin(KLEMS_FULL.theta_bounds) ** 2
    theta = np.arcsin(np.sqrt((sine2[1:] + sine2[:-1]) / 2))
    rings = np.repeat(pane_values(pane, theta)[0], KLEMS_FULL.phi_counts)
    through = np.diag(found.transmission_front) * KLEMS_FULL.projected_solid_angles()
    np.testing.assert_allclose(through, rings, rtol=1e-9)


def test_panes_and_a_shade_absorb_what_neither_passes_nor_returns():
    """Two panes share it as in the stack of both; one shade may be among them, not two."""
    outer, inner = Pane("outer", 0.6, 0.2, 0.2), Pane("inner", 0.8, 0.1, 0.1)
    tau, rho = stack([pane_optics(one, ANGLES) for one in (outer, inner)]).tau, np.full(len(ANGLES), 0.1)
    absorbed = absorbed_by_layers([outer, inner], tau, rho, ANGLES)
    np.testing.assert_allclose(absorbed.sum(axis=1), 1 - tau - rho)
    # at normal incidence by the geometric series of light between them
    first, second = 0.2 + 0.6 * 0.1 * 0.2 / (1 - 0.2 * 0.1), 0.6 * 0.1 / (1 - 0.2 * 0.1)
    assert absorbed[0, 0] / absorbed[0, 1] == pytest.approx(first / second)
    shaded = absorbed_by_layers([outer, None, inner], 0.2 * tau, rho, ANGLES)
    np.testing.assert_allclose(shaded.sum(axis=1), 1 - 0.2 * tau - rho)
    with pytest.raises(ValueError, match="at most one shade"):
        absorbed_by_layers([None, outer, None], tau, rho, ANGLES)


def test_diffuse_light_passes_a_pane_as_its_mean_over_the_hemisphere():
    """Against Gauss's rule over the projected area."""
    pane = Pane("clear", 0.834, 0.075, 0.075)
    nodes, weights = np.polynomial.legendre.leggauss(200)
    share = 0.5 * (nodes + 1)  # sine squared: its density is that of projected area
    tau, rho, _ = pane_values(pane, np.arcsin(np.sqrt(share)))
    passed, absorbed = _diffuse([pane])
    assert passed == pytest.approx(0.5 * weights @ tau, abs=2e-3)
    assert absorbed == pytest.approx([0.5 * weights @ (1 - tau - rho)], abs=2e-3)
