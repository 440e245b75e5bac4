"""U and g of a system from its layers by ISO 15099, as the Blackbox takes them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from thermal.glazing_unit import GlazingUnit
from thermal.gvalue import ThermalData, inward_share
from thermal.iso15099 import (
    STATED_G,
    iso15099_data,
    iso15099_g_values,
    prescribed,
    yearly_g_values,
)
from thermal.notes import ThermalNote


def layered_thermal_data(
    unit: GlazingUnit,
    transmittance: ArrayLike,
    reflectance: ArrayLike,
    absorbed: ArrayLike,
    *,
    u_value: float | None = None,
    g_normal: float | None = None,
    item: str = "fenestration",
) -> ThermalData:
    """U and g [K] of a system by ISO 15099 from its layers; see `gvalue.thermal_data`.

    Args:
        transmittance, reflectance: [K] of the whole system, direction to hemisphere, solar.
        absorbed: [K, N] solar absorptance of every layer.

    A g that is stated at normal incidence (the first direction) scales the secondary heat gain in
    all directions.  With a shade, whose air flow depends on the state, it is that of `STATED_G`,
    and that of the year differs; panes alone keep it.
    """
    tau = np.asarray(transmittance, dtype=float)
    notes = []
    if u_value is None:
        u_value = iso15099_data(unit).u_value
        notes.append(
            ThermalNote(
                "{system}: U-value {u_value:.3g} W/(m2 K) from its layers (ISO 15099).",
                {"system": item, "u_value": u_value},
            )
        )
    g = yearly_g_values(unit, tau, np.asarray(absorbed, dtype=float))
    if g_normal is None:
        notes.append(
            ThermalNote(
                "{system}: g-value {g:.3g} at normal incidence from its layers (ISO 15099).",
                {"system": item, "g": float(g[0])},
            )
        )
        return ThermalData(u_value, g, tuple(notes))
    rho, alpha = np.asarray(reflectance, dtype=float), np.asarray(absorbed, dtype=float)
    share = inward_share(float(tau[0]), float(rho[0]), g_normal, item=item)
    total = np.maximum(1.0 - tau - rho, 0.0)
    stated_state = g[:1]
    if unit.shade_place != "none":
        stated_state = iso15099_g_values(unit, prescribed(*STATED_G), tau[:1], alpha[:1])
    ratio = share * total[0] / max(float(stated_state[0] - tau[0]), 1e-9)
    return ThermalData(u_value, tau + np.minimum((g - tau) * ratio, total), tuple(notes))
