"""The two-layer window: worked numbers, round trip of U and g, and what it refuses."""

from __future__ import annotations

import json
import logging

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.conftest import WINDOW_GLAZING
from thermal.blackbox import (
    Fenestration,
    LayerResistance,
    fit_conductance_surface,
    layer_absorptances,
    linear_u,
    with_realised_films,
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
    assert closed.inward_shares() == pytest.approx(
        (closed.u_value * 0.03, 1 - closed.u_value * 0.073)
    )


def test_fenestration_refuses_what_cannot_be():
    with pytest.raises(ThermalInputError, match=r"fenestration x: U"):
        Fenestration("x", 0.05)
    with pytest.raises(ThermalInputError, match=r"no resistance"):
        Fenestration("x", 6.5)
    with pytest.raises(ThermalInputError, match=r"coefficients"):
        LayerResistance("surface", (1.0,))


def test_an_interior_shade_shares_heat_by_its_three_paths():
    """The resistance that gives U, sought numerically; heat of each layer by the nodes' balance."""
    u, across = 1.4, 0.8
    window = Fenestration("shade", u, extra_inner=1.5, room_to_outer=across)
    outer, inner = 1 / window.r_outer, 1 / window.r_inner + window.extra_inner

    def to_room(through, room, heat):  # [W/m2] and temperatures, outdoors at 0
        network = [[outer + across + through, -through], [-through, inner + through]]
        nodes = np.linalg.solve(network, np.add(heat, [across * room, inner * room]))
        return across * (nodes[0] - room) + inner * (nodes[1] - room)

    through = brentq(lambda one: -to_room(one, 1.0, [0.0, 0.0]) - u, 1e-6, 1e3, xtol=1e-14)
    shares = [to_room(through, 0.0, heat) for heat in ([1.0, 0.0], [0.0, 1.0])]
    np.testing.assert_allclose(window.inward_shares(), shares, rtol=1e-9)


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
