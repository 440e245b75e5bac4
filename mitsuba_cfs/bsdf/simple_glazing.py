"""Transmittance and reflectance of a glazing from U and g: the simple window model.

Source: Arasteh, Kohler, Griffith 2009, "Modeling windows in EnergyPlus with simple performance
indices", LBNL-2804E; as EnergyPlus' WindowMaterial:SimpleGlazingSystem (Engineering Reference,
"Simple Window Model").  Between U of 3.4 and 4.5 W/(m2 K) values are linear in U.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

LOW_U, HIGH_U = 3.4, 4.5  # [W/(m2 K)] below: insulating glazing, above: single panes
ROUNDING = 1e-9  # that transmittance and reflectance together stay below 1
STEEP_U = 5.85  # above it the inner film in winter follows another line


def solar_transmittance(u_value: float, g_value: float) -> float:
    """Solar transmittance at normal incidence of a glazing of that U [W/(m2 K)] and g."""

    def high() -> float:
        if g_value < 0.7206:
            return 0.939998 * g_value**2 + 0.20332 * g_value
        return 1.30415 * g_value - 0.30515

    def low() -> float:
        if g_value <= 0.15:
            return 0.41040 * g_value
        return 0.085775 * g_value**2 + 0.963954 * g_value - 0.084958

    return min(_between(u_value, low, high), g_value)


def solar_reflectance(u_value: float, g_value: float, transmittance: float) -> float:
    """Solar reflectance at normal incidence: rho = 1 - tau - (g - tau)/N, not below 0.

    N is the inward share of the absorption in one layer in the middle, with summer film
    coefficients.
    """
    gain = g_value - transmittance
    inner = 1 / _between(
        u_value,
        lambda: 199.8208128 * gain**3 - 90.639733 * gain**2 + 19.737055 * gain + 6.766575,
        lambda: 29.436546 * gain**3 - 21.943415 * gain**2 + 9.945872 * gain + 7.426151,
    )
    outer = 1 / _between(
        u_value, lambda: 5.763355 * gain + 20.541528, lambda: 2.225824 * gain + 20.57708
    )
    layer = max(_layer_resistance(u_value), 0.0)
    inwards = (outer + 0.5 * layer) / (outer + layer + inner)
    return float(np.clip(1 - transmittance - gain / inwards, 0.0, 1.0 - transmittance - ROUNDING))


def visible_reflectances(transmittance: float) -> tuple[float, float]:
    """Front and back visible reflectance at normal incidence for a visible transmittance."""
    powers = transmittance ** np.arange(4)
    front = float(powers @ (0.2399, -0.4169, 0.4277, -0.0622))
    back = float(powers @ (0.4547, -1.2299, 1.6531, -0.7409))
    most = max(1.0 - transmittance - ROUNDING, 0.0)
    return min(front, most), min(back, most)


def _layer_resistance(u_value: float) -> float:
    """1/U without the films of winter [m2 K/W]."""
    inner = 0.359073 * np.log(u_value) + 6.949915
    if u_value >= STEEP_U:
        inner = 1.788041 * u_value - 2.886625
    return float(1 / u_value - 1 / inner - 1 / (0.025342 * u_value + 29.163853))


def _between(u_value: float, low: Callable[[], float], high: Callable[[], float]) -> float:
    """The value for insulating glazing, for single panes, or between them."""
    return float(np.interp(u_value, [LOW_U, HIGH_U], [low(), high()]))
