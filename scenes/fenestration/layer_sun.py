"""What each layer of a glazing unit absorbs of the sun, from the whole system's BSDF."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.glazing import Pane
from mitsuba_cfs.bsdf.pane_stack import absorbed_by_layers
from thermal.errors import require
from thermal.glazing_unit import GlazingUnit


def sun_in_layers(
    unit: GlazingUnit, transmittance: ArrayLike, reflectance: ArrayLike, incidence: ArrayLike
) -> NDArray[np.float64]:
    """Solar absorptance of every layer [K, N], see `pane_stack.absorbed_by_layers`.

    A pane is coated where its sides differ.

    Args:
        transmittance, reflectance: [K] of the whole system, direction to hemisphere, solar.
        incidence: [K] [rad].

    Raises: `ThermalInputError` where a pane's solar values are missing or two layers are shades.
    """
    shades = sum(layer.openings is not None for layer in unit.layers)
    require(shades <= 1, "layers", "expected at most one shade")
    panes: list[Pane | None] = []
    for number, layer in enumerate(unit.layers, start=1):
        item = f"layers: layer {number}"
        if layer.openings is not None:
            panes.append(None)
            continue
        message = "its solar transmittance and reflectances are missing"
        require(layer.solar is not None, item, message)
        tau, front, back = layer.solar
        panes.append(Pane(item, tau, front, back, coated=front != back))
    return absorbed_by_layers(panes, transmittance, reflectance, incidence)
