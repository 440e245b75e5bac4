"""Generic glazings, for windows whose building file holds no glazing data.

U, g and solar transmittance of the double glazings are those of EN 14501:2021, annex A (reference
glazings B to D). Visible transmittances, and all values of the triple glazing, are usual values of
makers' data sheets, without a standard behind them. A product differs by up to 0.1 in g and
visible transmittance.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class GenericGlazing:
    """Values of a glazing at normal incidence."""

    u_value: float  # [W/(m2 K)]
    g_value: float
    visible: float
    solar: float | None  # None: from U and g
    panes: int


GENERIC_GLAZINGS = {
    "double clear": GenericGlazing(2.9, 0.76, 0.82, 0.69, 2),
    "double low-e": GenericGlazing(1.2, 0.59, 0.80, 0.49, 2),
    "double solar control": GenericGlazing(1.1, 0.32, 0.60, 0.27, 2),
    "triple low-e": GenericGlazing(0.7, 0.50, 0.72, None, 3),
}
# honeybee-radiance "generic_exterior_window_vis_0.64"; U, SHGC and solar transmittance of
# honeybee-energy's "Generic Double Pane" as honeybee-energy 1.126 computes them
HONEYBEE_DEFAULT = GenericGlazing(1.69, 0.42, 0.64, 0.36, 2)
