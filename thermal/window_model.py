"""U and g of a window by direction from what is known of it, as the Blackbox takes them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.closure import Closure
from thermal.errors import require
from thermal.glazing_unit import GlazingUnit
from thermal.gvalue import ThermalData, inward_share, position_of_share, thermal_data
from thermal.iso15099 import (
    STATED_G,
    iso15099_data,
    iso15099_g_values,
    prescribed,
    yearly_g_values,
)
from thermal.notes import ThermalNote
from thermal.typical_unit import absorbing, bisected, likely_units, typical_unit

FloatArray = NDArray[np.float64]
# solar absorptance of every layer [K, N] of a unit, from tau, rho and incidence [K] of the system
Absorbed = Callable[[GlazingUnit, ArrayLike, ArrayLike, ArrayLike], FloatArray]
PANE_ABSORPTION = (0.2, 2.5)  # bounds of the panes' absorptance over that of typical ones


@dataclass(frozen=True, slots=True)
class WindowModel:
    """U and g by direction, and the closure that goes with them."""

    data: ThermalData
    closure: Closure
    position: str  # of the shade
    guessed: bool = False  # the position follows from U and g
    typical: GlazingUnit | None = None  # layers that were assumed
    likely: tuple[GlazingUnit, ...] = ()  # others that are as likely
    absorbed: FloatArray | None = None  # [K, N] by the layers, stated or typical

    def to_air(self) -> FloatArray | float:
        """Absorbed sun [K] that goes to the room's air behind an interior shade."""
        films = self.closure.states_films
        layered = None if films else self.closure.layers(self.data.u_value)
        if layered is None or layered.behind is None or self.absorbed is None:
            return 0.0
        return self.absorbed @ np.array(layered.behind.to_air)


def window_model(
    tau: FloatArray,
    rho: FloatArray,
    incidence: FloatArray,
    position: str | None,
    closure: Closure,
    *,
    absorbed: Absorbed,
    u_value: float | None,
    g_normal: float | None,
    item: str,
    scatters: bool = False,
) -> WindowModel:
    """U, g by direction and closure from the data that are known, the first direction normal.

    Without stated layers they are `typical_unit`'s: shares of the absorbed radiation by direction,
    films, and the resistance unless the closure states it.

    Args:
        tau, rho: [K] solar, direction to hemisphere; incidence: [K] [rad].
        position: of the shade, where it is stated; else that of the layers, else by U and g
            where the system `scatters` like a shade.
    """
    of_layers = None if closure.unit is None else closure.unit.shade_place
    fits = None in (of_layers, position) or of_layers == position
    message = f"{position!r}, but the layers have their shade {of_layers!r}"
    require(fits, f"{item}: shading_position", message)
    guess = None
    unknown = position is None and closure.unit is None
    if unknown and scatters and u_value is not None and g_normal is not None:
        share = inward_share(float(tau[0]), float(rho[0]), g_normal, item=item)
        guess = position_of_share(share)
    place = guess or position or of_layers or "none"
    guessed = guess is not None
    if closure.unit is not None:
        by_layer = absorbed(closure.unit, tau, rho, incidence)
        data = layered_thermal_data(
            closure.unit, tau, rho, by_layer, u_value=u_value, g_normal=g_normal, item=item
        )
        return WindowModel(data, closure, place, guessed, absorbed=by_layer)
    data = thermal_data(
        tau, rho, shading_position=place, u_value=u_value, g_normal=g_normal, item=item
    )
    unit = typical_unit(place, data.u_value, closure.gap)
    closed = closure.with_typical(unit, data.u_value)
    if unit is None:
        return WindowModel(data, closed, place, guessed)
    g, by_layer = g_of_unit(unit, data, (tau, rho, incidence), absorbed, item)
    likely = tuple(likely_units(place, data.u_value, closure.gap))
    data = replace(data, g_value=g)
    return WindowModel(data, closed, place, guessed, unit, likely, by_layer)


def g_of_unit(
    unit: GlazingUnit,
    data: ThermalData,
    optics: tuple[FloatArray, FloatArray, FloatArray],
    absorbed: Absorbed,
    item: str,
) -> tuple[FloatArray, FloatArray]:
    """g [K] by the shares of a unit's layers, from that of `data` at normal incidence.

    With a shade, the panes absorb what makes the unit's g that of `data`; within
    `PANE_ABSORPTION`, else the gain is scaled.  Also what each layer absorbs [K, N].

    Args: optics: tau, rho, incidence [K] of the system.
    """
    tau, rho, incidence = optics
    first, normal = float(data.g_value[0]), (tau[:1], rho[:1], incidence[:1])

    def excess(factor: float) -> float:
        changed = absorbing(unit, factor)
        by_layer = absorbed(changed, *normal)
        g = iso15099_g_values(changed, prescribed(*STATED_G), tau[:1], by_layer)
        return float(g[0]) - first

    if unit.shade_place != "none":
        low, high = PANE_ABSORPTION
        falls = -1.0 if excess(low) > excess(high) else 1.0
        unit = absorbing(unit, bisected(lambda factor: falls * excess(factor), low, high))
    by_layer = absorbed(unit, tau, rho, incidence)
    layered = layered_thermal_data(
        unit, tau, rho, by_layer, u_value=data.u_value, g_normal=first, item=item
    )
    return layered.g_value, by_layer


def likely_diffuse_g(
    window: WindowModel,
    optics: tuple[FloatArray, FloatArray, FloatArray],
    weight: FloatArray,
    absorbed: Absorbed,
    item: str,
) -> list[float]:
    """g for diffuse light with each of the likely layers.

    Args: optics: as of `g_of_unit`; weight: [K] of the directions.
    """
    # the range needs few directions: one of each ring of the basis
    tau, rho, incidence = optics
    angles, rings = np.unique(incidence.round(6), return_inverse=True)
    share = np.bincount(rings, weight)
    mean_tau, mean_rho = (np.bincount(rings, weight * v) / share for v in (tau, rho))
    mean_tau[0], mean_rho[0] = tau[0], rho[0]
    normal = replace(window.data, g_value=window.data.g_value[:1])
    means = (mean_tau, mean_rho, angles)
    units = window.likely
    return [float(share @ g_of_unit(unit, normal, means, absorbed, item)[0]) for unit in units]


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
