"""The two-layer window: worked numbers, round trip of U and g, and what it refuses."""

from __future__ import annotations

import json
import logging

import numpy as np
import pytest

from tests.conftest import WINDOW_GLAZING
from thermal.blackbox import (
    Fenestration,
    LayerAbsorptances,
    LayerResistance,
    ShadeNode,
    absorbed_at_u,
    conductance_table,
    fit_conductance_surface,
    layer_absorptances,
    linear_u,
    node_absorptances,
    with_realised_films,
    with_u_value,
)
from thermal.errors import ThermalInputError

DIGITS = 1e-12  # closed forms: rounding only


def test_layer_absorptances_of_the_worked_example():
    layers = layer_absorptances(0.47, 0.21, 0.60, 1.2)
    # EQUATIONS.md section 1 prints five digits
    assert layers.inner == pytest.approx(0.14402, abs=6e-6)
    assert layers.outer == pytest.approx(0.17598, abs=6e-6)
    assert layers.clipped == 0.0


def test_u_and_g_come_back_at_the_measuring_condition():
    rng = np.random.default_rng(7)
    for _ in range(50):
        u, r_o, r_i = rng.uniform(0.5, 3.0), rng.uniform(0.02, 0.08), rng.uniform(0.07, 0.17)
        tau, rho = rng.uniform(0.05, 0.5), rng.uniform(0.05, 0.4)
        alpha = 1 - tau - rho
        q_i = alpha * u * rng.uniform(r_o, 1 / u - r_i)
        layers = layer_absorptances(tau, rho, tau + q_i, u, r_outer=r_o, r_inner=r_i)
        # heat to the room of the two layers in the steady state, both sides at one temperature
        inward = u * (r_o * layers.outer + (1 / u - r_i) * layers.inner)
        assert inward == pytest.approx(q_i, abs=DIGITS)
        assert layers.outer + layers.inner == pytest.approx(alpha, abs=DIGITS)


def test_layer_absorptances_are_clipped_with_a_warning(caplog):
    caplog.set_level(logging.WARNING)
    # a dark interior shade with the film of a plane pane: more inward heat than R_i allows
    layers = layer_absorptances(0.05, 0.30, 0.62, 1.2, item="dark shade")
    assert layers.clipped > 0.0
    assert layers.outer == 0.0 and layers.inner == pytest.approx(0.65)
    assert "dark shade" in caplog.text and f"{layers.clipped:.3f}" in caplog.text


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ((0.5, 0.2, 0.3, 1.2), "g"),
        ((0.5, 0.2, 0.6, 9.0), "U"),
        ((0.5, 0.7, 0.6, 1.2), "tau + rho"),
        ((0.5, 0.2, 0.6, 6.5), "R_s"),
        ((-0.1, 0.2, 0.6, 1.2), "transmittance"),
        ((0.1, 0.1, 0.99, 1.2), "absorptance"),
    ],
)
def test_unphysical_data_name_the_item(arguments, word):
    with pytest.raises(ThermalInputError, match=r"blind 3.*") as caught:
        layer_absorptances(*arguments, item="blind 3")
    assert word in str(caught.value)


def test_linear_u_is_fener_s_line():
    r = linear_u(1.2)
    # EQUATIONS.md section 2: factor 1.0920 at 297.15 K, with T_m from 283.15 K
    assert r.at(24.0, 3.0) == pytest.approx(1 / (1.2 * (1 + 0.0065 * 14)) - 0.17, abs=DIGITS)


def test_conductance_surface_fits_the_reference_double_glazing():
    states = json.loads((WINDOW_GLAZING / "blackbox_R.json").read_text())
    points = states["dgu"]
    mean = np.array([(p["Tso"] + p["Tsi"]) / 2 for p in points])
    d = np.array([p["Tsi"] - p["Tso"] for p in points])
    r = np.array([p["R"] for p in points])
    fit = fit_conductance_surface(mean, d, r)
    error = fit.at(mean, d) / r - 1
    assert np.sqrt(np.mean(error**2)) < 0.015  # EQUATIONS.md: 1.2 to 1.4 % rms for a quadratic
    np.testing.assert_allclose(fit.coefficients, states["dgu_fit"], rtol=2e-2, atol=2e-6)


def test_realised_films_keep_the_sum_of_conductances():
    plain = Fenestration("shade", 1.1)
    closed = with_realised_films(plain, r_inner_realised=0.073, r_outer_realised=0.03)
    assert closed.extra_inner == pytest.approx(1 / 0.073 - 1 / 0.13)
    assert closed.extra_outer == pytest.approx(1 / 0.03 - 1 / 0.04)
    assert closed.r_inner == 0.073 and closed.r_outer == 0.03
    resistance = closed.layer_resistance.at(10.0, 10.0)
    assert 1 / closed.u_value == pytest.approx(0.03 + resistance + 0.073)
    # the extra conductances are in the realised films, not beside them
    assert closed.inward_shares() == pytest.approx((closed.u_value * 0.03, 0.0, 1 - closed.u_value * 0.073))


def test_fenestration_refuses_what_cannot_be():
    with pytest.raises(ThermalInputError, match=r"fenestration x: U"):
        Fenestration("x", 0.05)
    with pytest.raises(ThermalInputError, match=r"no resistance"):
        Fenestration("x", 6.5)
    with pytest.raises(ThermalInputError, match=r"coefficients"):
        LayerResistance("surface", (1.0,))


SHADE = ShadeNode(
    exterior=False,
    width=0.05,
    height=1.5,
    tilt=np.pi / 2,
    impedance=3.0,
    exchange=0.8,
    pane_weight=0.0,
    emissivity=0.9,
    panes=LayerResistance("constant", (0.2,)),
    sun=(0.1, 0.6, 1.0),
    inward=(0.1, 0.5, 0.8),
    two_layers=LayerResistance("constant", (0.4,)),
    film=0.08,
)


@pytest.mark.parametrize("more", [-0.3, -0.05, 0.0, 0.05, 0.15])
def test_a_stated_g_moves_sun_between_panes_and_shade(more):
    """Of g so much more goes indoors, of the same sun; beyond what can be moved it is clipped."""
    sun = np.array([[0.1, 0.05, 0.2, 0.3]])
    plain, moved = (node_absorptances(sun, SHADE, one) for one in (0.0, more))
    nodes = [np.stack([one.outer, one.middle, one.inner]) for one in (plain, moved)]
    np.testing.assert_allclose(nodes[0][:, 0], [0.09 + 0.02, 0.01 + 0.03 + 0.2, 0.3])
    assert nodes[1].sum() == pytest.approx(0.65) and nodes[1].min() >= 0.0
    gained = SHADE.inward @ (nodes[1] - nodes[0])[:, 0]
    assert gained == pytest.approx(np.clip(more, -0.306, 0.149))
    assert moved.clipped == pytest.approx(abs(more - gained), abs=1e-12)


def test_two_layers_take_as_much_indoors_as_panes_and_shade():
    system = Fenestration("shade", 1.3, shade=SHADE)
    nodes = LayerAbsorptances(np.array([0.2]), np.array([0.3]), 0.0, np.array([0.1]))
    two = nodes.two_layers(system)
    low, high = 1.3 * system.r_outer, 1.0 - 1.3 * system.r_inner
    taken = low * two.outer + high * two.inner
    assert taken == pytest.approx(0.1 * 0.2 + 0.5 * 0.1 + 0.8 * 0.3)
    assert two.outer + two.inner == pytest.approx(0.6)
    series = system.in_series()
    assert series.shade is None and series.r_inner == 0.08


@pytest.mark.parametrize(
    ("changes", "allowed"),
    [
        ({"u_value": 7.0}, True),
        ({"u_value": 7.05}, False),
        ({"extra_inner": 200.0}, True),
        ({"extra_inner": 201.0}, False),
        ({"emissivity_in": 0.0, "emissivity_out": 0.0}, True),
        ({"emissivity_in": 1.0, "emissivity_out": 1.0}, True),
        ({"emissivity_in": 1.01}, False),
    ],
)
def test_bounds_of_a_fenestration(changes, allowed):
    values = {"name": "x", "u_value": 1.2, "r_outer": 0.04, "r_inner": 0.1} | changes
    if allowed:
        Fenestration(**values)
    else:
        with pytest.raises(ThermalInputError, match="fenestration x"):
            Fenestration(**values)


def test_a_table_is_linear_along_both_axes():
    """A bilinear function comes back between the points, with steps other than 1; beyond them that of the edge."""
    means, apart = np.array([-5.0, 5.0, 15.0]), np.array([2.0, 6.0, 10.0, 14.0])

    def conductance(mean, difference):
        return 1.0 + 0.02 * mean + 0.03 * difference + 0.001 * mean * difference

    resistance = conductance_table(means, apart, conductance(means[:, None], apart))
    for mean, difference in ((-5.0, 2.0), (-1.0, 3.0), (7.5, 9.0), (14.0, 13.0), (15.0, 14.0)):
        assert 1 / resistance.at(mean, difference) == pytest.approx(conductance(mean, difference))
    assert 1 / resistance.at(40.0, 50.0) == pytest.approx(conductance(15.0, 14.0))
    assert 1 / resistance.at(-40.0, 0.0) == pytest.approx(conductance(-5.0, 2.0))


SURFACE = LayerResistance("surface", (1.2, 0.01, 0.02, 0.0005, 0.0, 0.0))


@pytest.mark.parametrize("resistance", [None, LayerResistance("constant", (0.7,)), linear_u(1.3), SURFACE])
@pytest.mark.parametrize("u_value", [0.9, 1.6])
def test_another_u_adds_its_resistance_at_the_measuring_condition(resistance, u_value):
    """1/U' - 1/U is all between the layers, at 10 degC and the difference between them of 15 K of air."""
    one = Fenestration("pane", 1.3, resistance=resistance)
    moved = with_u_value(one, u_value)
    between = 15.0 * (1 - 1.3 * (one.r_outer + one.r_inner))
    more = moved.layer_resistance.at(10.0, between) - one.layer_resistance.at(10.0, between)
    assert more == pytest.approx(1 / u_value - 1 / 1.3)


def test_sun_in_the_layers_of_another_u_keeps_its_heat_indoors_where_it_can():
    """g stays where both layers can share the sun; a warmer outer layer alone cannot give away more."""
    one, better, worse = (Fenestration("pane", u) for u in (1.3, 0.9, 2.6))
    outer, inner = np.array([0.2, 0.1]), np.array([0.0, 0.1])
    for moved in (better, worse):
        to_outer, to_inner = absorbed_at_u(one, moved, outer, inner)
        np.testing.assert_allclose(to_outer + to_inner, outer + inner)
        assert to_inner.min() >= 0
    (of_outer, _, of_inner), (now_outer, _, now_inner) = one.inward_shares(), better.inward_shares()
    to_outer, to_inner = absorbed_at_u(one, better, outer, inner)
    np.testing.assert_allclose(now_outer * to_outer + now_inner * to_inner, of_outer * outer + of_inner * inner)
    assert absorbed_at_u(one, worse, outer, inner)[1][0] == 0.0


def test_g_is_compared_with_the_transmittance_of_its_own_direction():
    """The direction in which g is farthest below, not that of most light."""
    tau, g = np.array([0.5, 0.3]), np.array([0.6, 0.2])
    with pytest.raises(ThermalInputError, match=r"0\.2 is below the solar transmittance 0\.300"):
        layer_absorptances(tau, np.array([0.1, 0.1]), g, 1.2)


@pytest.mark.parametrize("more", [0.01, 0.05])
def test_what_a_stated_g_has_more_moves_from_the_outer_node_first(more):
    """By its share indoors, which is 0.1 outside and 0.8 inside; the middle one stays."""
    sun = np.array([[0.1, 0.05, 0.2, 0.3]])
    plain, moved = (node_absorptances(sun, SHADE, one) for one in (0.0, more))
    assert plain.outer - moved.outer == pytest.approx(more / (0.8 - 0.1))
    assert moved.inner - plain.inner == pytest.approx(more / (0.8 - 0.1))
    assert moved.middle == pytest.approx(plain.middle)


@pytest.mark.parametrize("less", [0.01, 0.05])
def test_what_a_stated_g_has_less_moves_from_the_inner_node_first(less):
    sun = np.array([[0.1, 0.05, 0.2, 0.3]])
    plain, moved = (node_absorptances(sun, SHADE, one) for one in (0.0, -less))
    assert moved.outer - plain.outer == pytest.approx(less / (0.8 - 0.1))
    assert plain.inner - moved.inner == pytest.approx(less / (0.8 - 0.1))
    assert moved.middle == pytest.approx(plain.middle)
