"""U and g of a window by direction from what is known of it, as the Blackbox takes them.

Typical layers, where only U, g, the BSDF and the position of the shade are known: the panes follow
from U: triple, double or single glazing, with the emissivity of the coating (of uncoated double
glazing the width of the air gap) that gives this U by ISO 15099. The shade is a grey, opaque sheet,
open at its edges, where `position` has it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.blackbox import Fenestration, LayerAbsorptances, layer_absorptances, node_absorptances
from thermal.closure import Closure
from thermal.errors import require
from thermal.glazing import Gap
from thermal.glazing_unit import AIR, GasGap, GlazingLayer, GlazingUnit, sheet_layer
from thermal.gvalue import ThermalData, inward_share, position_of_share, thermal_data
from thermal.iso15099 import (
    STATED_G,
    U_STATE_C,
    iso15099_data,
    iso15099_g_values,
    iso15099_u_value,
    prescribed,
    yearly_g_values,
)
from thermal.notes import ThermalNote

ARGON = GasGap(0.016, (("argon", 0.9), ("air", 0.1)))
AIR_GAP = GasGap(0.016, AIR)
NARROW = 0.003  # [m] least gap of uncoated double glazing
TRIPLE_BELOW = 0.85  # of the least U of double glazing; above, a measured U is that of a better gap
# Panes of 6 mm: thickness, conductivity, solar transmittance and reflectances front and back
CLEAR = GlazingLayer(0.006, 1.0, solar=(0.775, 0.071, 0.071))
COATED = (0.600, 0.220, 0.170)  # solar, of a pane whose front is coated
LEAST_EMISSIVITY, UNCOATED = 0.02, 0.84
SHADE_DISTANCE = {"external": 0.10, "internal": 0.05, "integrated": 0.013}  # [m] to the glass
SHADE_EDGES = {"external": 0.10, "internal": 0.05, "integrated": 0.01}  # [m] open
SHADE_EMISSIVITY = 0.9


def typical_unit(
    position: str,
    u_value: float,
    gap: Gap | None = None,
    *,
    distance: float | None = None,
    edges: float | None = None,
    emissivity: float = SHADE_EMISSIVITY,
) -> GlazingUnit | None:
    """Typical layers of a system with this U [W/(m2 K)]; None where single glazing has a lower U.

    Args:
        position: of the shade, a key of `gvalue.TYPICAL_SYSTEMS`.
        gap: the gas gap between the panes, if it is known; triple glazing has two of them.
        distance: from the shade to the glass [m]; edges: width of the shade's openings [m];
            emissivity: of the shade.  Defaults: of the position.
    """
    known = position in ("none", *SHADE_DISTANCE)
    require(known, "shading position", f"{position!r} is not known")
    shade = None
    if position != "none":
        wide = SHADE_EDGES[position] if edges is None else edges
        faces = (emissivity, emissivity)
        shade = sheet_layer(0.0, thickness=0.0005, conductivity=0.15, edges=(wide,) * 4, emissivity=faces)
    width = SHADE_DISTANCE.get(position, 0.0) if distance is None else distance
    return _unit_of_u(position, u_value, gap, shade, width)


def likely_units(position: str, u_value: float, gap: Gap | None = None) -> list[GlazingUnit]:
    """Other layers with this U that are as likely as the typical ones."""
    more: list[dict[str, float]] = [{}]
    if position != "none":
        near, far = 0.4 * SHADE_DISTANCE[position], 2.0 * SHADE_DISTANCE[position]
        more += [{"distance": near}, {"distance": far}, {"edges": 0.003}, {"emissivity": 0.6}]
    found = [typical_unit(position, u_value, gap, **one) for one in more]
    units = [unit for unit in found if unit is not None]
    return units[1:] + [moved for unit in units[:1] for moved in _coated_outside(unit)]


def absorbing(unit: GlazingUnit, factor: float) -> GlazingUnit:
    """The unit with the solar absorptance of its panes times a factor, at their transmittance."""
    layers = []
    for layer in unit.layers:
        if layer.solar is not None:
            tau, front, back = layer.solar
            change = (factor - 1.0) * (1.0 - tau - max(front, back))
            layer = replace(layer, solar=(max(tau - change, 0.0), front, back))
        layers.append(layer)
    return replace(unit, layers=tuple(layers))


def _coated_outside(unit: GlazingUnit) -> list[GlazingUnit]:
    """The unit with its low-e coating on the back of the outer pane; none without a coating."""
    panes = [i for i, layer in enumerate(unit.layers) if layer.solar is not None]
    coated = [i for i in panes if unit.layers[i].emissivity[0] < 0.5]
    if not coated or panes[-1] - panes[0] != 1:
        return []
    layers = list(unit.layers)
    tau, front, back = COATED
    faces = unit.layers[coated[0]].emissivity[::-1]
    layers[panes[0]] = replace(CLEAR, emissivity=faces, solar=(tau, back, front))
    layers[panes[1]] = CLEAR
    return [replace(unit, layers=tuple(layers))]


@lru_cache(maxsize=256)
def _unit_of_u(
    position: str, u_value: float, gap: Gap | None, shade: GlazingLayer | None, distance: float
) -> GlazingUnit | None:
    def whole(panes: int, emissivity: float, space: GasGap) -> GlazingUnit:
        return _with_shade(position, _panes(panes, emissivity), space, shade, distance)

    def u_of(unit: GlazingUnit) -> float:
        return iso15099_u_value(unit, prescribed(*U_STATE_C))

    if gap is not None:
        space = GasGap(gap.width, gap.gas)
        low = min(gap.emissivity)
        double, triple = (whole(panes, low, space) for panes in (2, 3))
        nearer = abs(u_of(triple) - u_value) < abs(u_of(double) - u_value)
        return triple if nearer else double
    if u_value < TRIPLE_BELOW * u_of(whole(2, LEAST_EMISSIVITY, ARGON)):
        panes = 3
    else:
        panes = 2

    def by_coating(emissivity: float) -> GlazingUnit:
        return whole(panes, emissivity, ARGON)

    if u_value <= u_of(by_coating(LEAST_EMISSIVITY)):
        return by_coating(LEAST_EMISSIVITY)  # the rest of the resistance is added to it
    if u_value <= u_of(by_coating(UNCOATED)):
        return by_coating(bisected(lambda e: u_of(by_coating(e)) - u_value, LEAST_EMISSIVITY, UNCOATED))

    def by_width(width: float) -> GlazingUnit:
        return whole(2, UNCOATED, GasGap(width, AIR))

    if u_value <= u_of(by_width(NARROW)):
        if u_value <= u_of(by_width(AIR_GAP.width)):
            return by_width(AIR_GAP.width)
        return by_width(bisected(lambda w: u_value - u_of(by_width(w)), NARROW, AIR_GAP.width))
    single = _with_shade(position, (CLEAR,), AIR_GAP, shade, distance)
    return single if u_value < u_of(single) else None


def _panes(count: int, emissivity: float) -> tuple[GlazingLayer, ...]:
    """Panes from outside to inside, all but the outermost coated on their outer face."""
    coated = emissivity < 0.5 * UNCOATED
    inner = replace(CLEAR, emissivity=(emissivity, UNCOATED), solar=COATED if coated else CLEAR.solar)
    return (CLEAR, *[inner] * (count - 1))


def _with_shade(
    position: str, panes: tuple[GlazingLayer, ...], gap: GasGap, shade: GlazingLayer | None, distance: float
) -> GlazingUnit:
    gaps = (gap,) * (len(panes) - 1)
    if shade is None:
        return GlazingUnit(panes, gaps)
    beside = GasGap(distance)
    if position == "external":
        return GlazingUnit((shade, *panes), (beside, *gaps))
    if position == "internal" or len(panes) == 1:
        return GlazingUnit((*panes, shade), (*gaps, beside))
    return GlazingUnit((panes[0], shade, *panes[1:]), (beside, beside, *gaps[1:]))


def bisected(excess: Callable[[float], float], low: float, high: float) -> float:
    """Where a rising function passes zero between two arguments; the nearer one where it does not."""
    from scipy.optimize import brentq

    if excess(low) >= 0:
        return low
    return high if excess(high) <= 0 else float(brentq(excess, low, high, xtol=1e-6 * (high - low)))


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

    def absorptances(
        self,
        transmittance: ArrayLike,
        reflectance: ArrayLike,
        g_value: ArrayLike,
        closed: Fenestration,
        *,
        item: str = "fenestration",
    ) -> LayerAbsorptances:
        """Absorptances [K] of the nodes of the system that this closure gives.

        With an interior shade those of the layers, so moved between them that g is the stated one;
        else Kuhn's, from U and g.

        Args: transmittance, reflectance, g_value: [K] of the system, the year's g.
        """
        unit = self.closure.unit
        if closed.shade is None or unit is None or self.absorbed is None:
            return layer_absorptances(
                transmittance,
                reflectance,
                g_value,
                closed.u_value,
                r_outer=closed.r_outer,
                r_inner=closed.r_inner,
                item=item,
            )
        of_layers = yearly_g_values(unit, transmittance, self.absorbed)
        return node_absorptances(self.absorbed, closed.shade, np.asarray(g_value) - of_layers)


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
        data = layered_thermal_data(closure.unit, tau, rho, by_layer, u_value=u_value, g_normal=g_normal, item=item)
        return WindowModel(data, closure, place, guessed, absorbed=by_layer)
    data = thermal_data(tau, rho, shading_position=place, u_value=u_value, g_normal=g_normal, item=item)
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
    layered = layered_thermal_data(unit, tau, rho, by_layer, u_value=data.u_value, g_normal=first, item=item)
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
