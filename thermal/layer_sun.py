"""What each layer of a glazing absorbs of the sun, from the whole system's BSDF and its panes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import require
from thermal.glazing_unit import GlazingLayer, GlazingUnit
from thermal.gvalue import ThermalData, inward_share
from thermal.iso15099 import iso15099_data, yearly_g_values
from thermal.panes import (
    GlazingOptics,
    PaneOptics,
    coated_pane,
    hemispherical,
    stack,
    turned,
    uncoated_pane,
)

FloatArray = NDArray[np.float64]
HEMISPHERE = np.radians(np.linspace(0.0, 89.0, 60))  # angles of diffuse light
LEAST_PASSED = 1e-3  # transmittance below which nothing follows from what passed


def sun_in_layers(
    unit: GlazingUnit, transmittance: ArrayLike, reflectance: ArrayLike, incidence: ArrayLike
) -> FloatArray:
    """Solar absorptance of every layer [K, N]; its sum is 1 - tau - rho of the system.

    The panes before the shade absorb of the beam, and of what the shade throws back, which is
    known from what leaves the system: (rho - rho_o)/tau_o,dif.  The panes behind it absorb in
    proportion to what passes them: tau a_i/tau_i,dif.  The shade has the rest.

    Args:
        transmittance, reflectance: [K] of the whole system, direction to hemisphere, solar.
        incidence: [K] [rad].

    Raises: `ThermalInputError` where a pane's solar values are missing or two layers are shades.
    """
    tau, rho, theta = (np.asarray(v, dtype=float) for v in (transmittance, reflectance, incidence))
    total = np.maximum(1.0 - tau - rho, 0.0)
    shades = [i for i, layer in enumerate(unit.layers) if layer.openings is not None]
    require(len(shades) <= 1, "layers", "expected at most one shade")
    for number, layer in enumerate(unit.layers, start=1):
        known = layer.openings is not None or layer.solar is not None
        require(
            known, f"layers: layer {number}", "its solar transmittance and reflectances are missing"
        )
    if not shades:
        absorbed = _stacked(unit.layers, theta).absorptance
        return absorbed * (total / np.maximum(absorbed.sum(axis=1), 1e-12))[:, None]
    at = shades[0]
    outer = _before(unit.layers[:at], rho, theta)
    inner = _behind(unit.layers[at + 1 :], tau)
    others = np.concatenate([outer, inner], axis=1)
    # measured optics and the panes' may not quite agree: the shade never gets less than nothing
    scale = np.minimum(1.0, total / np.maximum(others.sum(axis=1), 1e-12))
    outer, inner = outer * scale[:, None], inner * scale[:, None]
    shade = total - outer.sum(axis=1) - inner.sum(axis=1)
    return np.concatenate([outer, np.maximum(shade, 0.0)[:, None], inner], axis=1)


def _before(panes: Sequence[GlazingLayer], rho: FloatArray, theta: FloatArray) -> FloatArray:
    """Absorptances [K, n] of panes outside the shade."""
    if not panes:
        return np.zeros((len(theta), 0))
    beam = _stacked(panes, theta)
    passed, absorbed = _diffuse(tuple(reversed(panes)), from_room=True)
    back = np.maximum(rho - beam.rho, 0.0) / max(passed, LEAST_PASSED)
    return beam.absorptance + np.minimum(back, 1.0)[:, None] * absorbed[::-1]


def _behind(panes: Sequence[GlazingLayer], tau: FloatArray) -> FloatArray:
    """Absorptances [K, n] of panes inside the shade, which light meets diffuse."""
    if not panes:
        return np.zeros((len(tau), 0))
    passed, absorbed = _diffuse(panes)
    return tau[:, None] * absorbed / max(passed, LEAST_PASSED)


def _diffuse(panes: Sequence[GlazingLayer], *, from_room: bool = False) -> tuple[float, FloatArray]:
    """Transmittance and absorptances [n] for diffuse light, as it meets the panes in turn."""
    found = _stacked(panes, HEMISPHERE, from_room=from_room)
    return float(hemispherical(found.tau, HEMISPHERE)), hemispherical(found.absorptance, HEMISPHERE)


def _stacked(
    panes: Sequence[GlazingLayer], theta: FloatArray, *, from_room: bool = False
) -> GlazingOptics:
    optics = [_optics(pane, theta) for pane in panes]
    return stack([turned(one) for one in optics] if from_room else optics)


def _optics(pane: GlazingLayer, theta: FloatArray) -> PaneOptics:
    """Of a pane by angle: coated where its sides differ."""
    tau, front, back = pane.solar or (0.0, 0.0, 0.0)  # that there are some is checked before
    if front == back:
        return uncoated_pane(theta, tau, front)
    return coated_pane(theta, tau, front, back)


def layered_thermal_data(
    unit: GlazingUnit,
    transmittance: ArrayLike,
    reflectance: ArrayLike,
    incidence: ArrayLike,
    *,
    u_value: float | None = None,
    g_normal: float | None = None,
    item: str = "fenestration",
) -> ThermalData:
    """U and g [K] of a system by ISO 15099 from its layers; see `gvalue.thermal_data`.

    A g that is given at normal incidence (the first direction) scales what goes inwards.
    """
    tau = np.asarray(transmittance, dtype=float)
    notes = []
    if u_value is None:
        u_value = iso15099_data(unit).u_value
        notes.append(f"{item}: U {u_value:.3g} W/(m2 K) by ISO 15099 from its layers.")
    absorbed = sun_in_layers(unit, tau, reflectance, incidence)
    g = yearly_g_values(unit, tau, absorbed)
    if g_normal is None:
        notes.append(f"{item}: g {g[0]:.3g} at normal incidence by ISO 15099 from its layers.")
        return ThermalData(u_value, g, tuple(notes))
    rho = np.asarray(reflectance, dtype=float)
    share = inward_share(float(tau[0]), float(rho[0]), g_normal, item=item)
    total = np.maximum(1.0 - tau - rho, 0.0)
    computed = (g[0] - tau[0]) / max(float(total[0]), 1e-9)
    scaled = np.minimum((g - tau) * share / max(computed, 1e-9), total)
    return ThermalData(u_value, tau + scaled, tuple(notes))
