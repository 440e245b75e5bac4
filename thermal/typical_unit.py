"""Layers of a window of which only U, g, its BSDF and the position of its shade are known.

The panes follow from U: triple, double or single glazing, with the emissivity of the coating (of
uncoated double glazing the width of the air gap) that gives this U by ISO 15099.  The shade is a
grey, opaque sheet, open at its edges, where `position` has it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

from thermal.errors import require
from thermal.glazing import Gap
from thermal.glazing_unit import AIR, GasGap, GlazingLayer, GlazingUnit
from thermal.iso15099 import U_STATE_C, iso15099_u_value, prescribed
from thermal.shade_layers import sheet_layer

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
BISECTIONS = 20


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
        shade = sheet_layer(
            0.0, thickness=0.0005, conductivity=0.15, edges=(wide,) * 4, emissivity=faces
        )
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
        return by_coating(
            bisected(lambda e: u_of(by_coating(e)) - u_value, LEAST_EMISSIVITY, UNCOATED)
        )

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
    inner = replace(
        CLEAR, emissivity=(emissivity, UNCOATED), solar=COATED if coated else CLEAR.solar
    )
    return (CLEAR, *[inner] * (count - 1))


def _with_shade(
    position: str,
    panes: tuple[GlazingLayer, ...],
    gap: GasGap,
    shade: GlazingLayer | None,
    distance: float,
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
    """Where a rising function passes zero between two arguments."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if excess(middle) > 0 else (middle, high)
    return 0.5 * (low + high)
