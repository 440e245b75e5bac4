"""A glazing unit's temperatures, U, g and Blackbox data by ISO 15099, layer by layer.

U and g come with surroundings of their own: `NFRC`, `ISO_52022_3`, or prescribed convection, whose
films belong to the measuring condition and not to a climate.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.blackbox import LayerResistance, ShadeNode, conductance_table, fit_conductance_surface
from thermal.errors import ThermalInputError, require
from thermal.glazing_unit import Environment, GlazingUnit
from thermal.layer_balance import INDOORS, OUTDOORS, UnitArrays, UnitState, settle

FloatArray = NDArray[np.float64]
CONVECTION_OUTSIDE, CONVECTION_INSIDE = 20.0, 2.7  # [W/(m2 K)]; with radiation about 25 and 7.7
U_STATE_C = (0.0, 20.0)  # outdoors and indoors
# Outdoors and indoors [degC], sun [W/m2]: the reference and the summer state of ISO 52022-3.  The
# g of a shade depends on the state through its air flow: a year uses the mean of both
G_STATES = ((5.0, 20.0, 300.0), (25.0, 25.0, 500.0))
STATED_G = G_STATES[1]  # the state of a g that is stated: sunny and warm, as where g is measured
OUTDOOR_C = (-25.0, -15.0, -5.0, 5.0, 15.0, 25.0, 35.0, 45.0)  # grid of R(T_m, dT)
INDOOR_C = (5.0, 15.0, 25.0, 35.0, 45.0)
MEAN_C = np.arange(-30.0, 90.1, 10.0)  # grid of R(T_m, dT) of panes without a shade
APART_K = np.arange(1.0, 49.1, 2.0)
FACE_HELD = 1e4  # [W/(m2 K)]: a face is within 0.05 K of the temperature beyond
UNSETTLED = 1e-3  # [K] change of the last round beyond which a state has no meaning


@dataclass(frozen=True, slots=True)
class Conditions:
    """Surroundings and sun at which U or g of a glazing is stated."""

    outdoor: Environment
    indoor: Environment
    sun: float = 0.0  # [W/m2]


def prescribed(outdoor_c: float, indoor_c: float, sun: float = 0.0) -> Conditions:
    """Conditions with the films of a measurement: convection 20 and 2.7 W/(m2 K)."""
    return Conditions(Environment(outdoor_c, CONVECTION_OUTSIDE), Environment(indoor_c, CONVECTION_INSIDE), sun)


# By standard: the state of U, and that of g.  NFRC 100 and 200: wind 5.5 and 2.75 m/s, 4 + 4 v
NFRC = (
    Conditions(Environment(-18.0, 26.0), Environment(21.0, None)),
    Conditions(Environment(32.0, 15.0), Environment(24.0, None), 783.0),
)
# ISO 52022-3:2017 (before: EN 13363-2), reference and summer conditions
ISO_52022_3 = (
    Conditions(Environment(5.0, 18.0), Environment(20.0, 3.6), 300.0),
    Conditions(Environment(25.0, 8.0), Environment(25.0, 2.5), 500.0),
)


@dataclass(frozen=True, slots=True)
class UnitBalance:
    """A glazing unit in the steady state."""

    faces_c: FloatArray  # [2 N] front and back of each layer, outside to inside
    heat_in: float  # to the room, without transmitted sun; ventilated air included [W/m2]
    air_in: float  # of it by the air behind an interior shade [W/m2]
    films: FloatArray  # [2] convection outdoors and indoors [W/(m2 K)]
    gap_speed: FloatArray  # [G] [m/s]
    gap_outlet_c: FloatArray  # [G]


def unit_balance(unit: GlazingUnit, conditions: Conditions, absorbed: ArrayLike = 0.0) -> UnitBalance:
    """The steady state of a unit; absorbed: sun in each layer [N] [W/m2].

    Raises: `ThermalInputError` where no state settles.
    """
    arrays = unit.arrays(conditions.outdoor, conditions.indoor)
    return _balance(unit, arrays, _start(unit, conditions), absorbed)


def _start(unit: GlazingUnit, conditions: Conditions) -> UnitState:
    n = len(unit.layers)
    ends = [e.air_c + 273.15 for e in (conditions.outdoor, conditions.indoor)]
    faces = np.linspace(ends[0], ends[1], 2 * n + 2)[1:-1].copy()
    return UnitState(faces, np.zeros(2 * n), np.zeros((n - 1, 6)), np.zeros(2), np.zeros((4 * n, 4 * n + 1)))


def _balance(unit: GlazingUnit, arrays: UnitArrays, state: UnitState, absorbed: ArrayLike) -> UnitBalance:
    """The balance from where the state is."""
    sun = np.broadcast_to(np.asarray(absorbed, dtype=float), (len(unit.layers),)).copy()
    change = settle(arrays, sun, state)
    require(change < UNSETTLED, "glazing", f"no steady state ({change:.1g} K)")
    room = arrays.films[1, 0]
    heat = state.film[1] * (state.faces[-1] - room) + state.radiosity[-1] - arrays.place[3]
    inside = len(unit.gaps) and arrays.air[-1] == INDOORS
    air_in = -state.gap[-1, 1] if inside else 0.0  # what the faces lose to the air, warmer then
    return UnitBalance(
        state.faces - 273.15,
        float(heat + air_in),
        float(air_in),
        state.film.copy(),
        state.gap[:, 2].copy(),
        state.gap[:, 4] - 273.15,
    )


def iso15099_u_value(unit: GlazingUnit, conditions: Conditions) -> float:
    """U [W/(m2 K)]: heat through the dark unit by the difference of the air temperatures."""
    dark = unit_balance(unit, conditions)
    return -dark.heat_in / (conditions.indoor.air_c - conditions.outdoor.air_c)


def iso15099_g_values(
    unit: GlazingUnit, conditions: Conditions, transmittance: ArrayLike, absorptance: ArrayLike
) -> FloatArray:
    """g [...] = tau + (heat with sun - heat without)/sun.

    Args: transmittance: [...] solar; absorptance: of each layer [..., N].
    """
    tau, alpha = np.asarray(transmittance, dtype=float), np.asarray(absorptance, dtype=float)
    layers = len(unit.layers)
    fits = alpha.shape == (*tau.shape, layers)
    require(fits, "absorptance", f"expected {(*tau.shape, layers)} values, got {alpha.shape}")
    arrays = unit.arrays(conditions.outdoor, conditions.indoor)
    state = _start(unit, conditions)
    dark = _balance(unit, arrays, state, 0.0).heat_in
    sun, rows = conditions.sun, alpha.reshape(-1, layers)
    secondary = [(_balance(unit, arrays, state, sun * row).heat_in - dark) / sun for row in rows]
    # absorbed sun warms: less than nothing is the tolerance of the balance
    return tau + np.maximum(np.array(secondary), 0.0).reshape(tau.shape)


def yearly_g_values(unit: GlazingUnit, transmittance: ArrayLike, absorptance: ArrayLike) -> FloatArray:
    """g [...] as the Blackbox takes it for a year: the mean of `G_STATES`, films prescribed."""
    tau, alpha = (np.ascontiguousarray(v, dtype=float) for v in (transmittance, absorptance))
    return np.frombuffer(_yearly_g(unit, tau.tobytes(), alpha.tobytes())).reshape(tau.shape).copy()


@lru_cache(maxsize=64)  # half a second for 145 directions, and a study asks for them several times
def _yearly_g(unit: GlazingUnit, tau: bytes, absorbed: bytes) -> bytes:
    through = np.frombuffer(tau)
    alpha = np.frombuffer(absorbed).reshape(len(through), -1)
    found = [iso15099_g_values(unit, prescribed(*s), through, alpha) for s in G_STATES]
    return np.mean(found, axis=0).tobytes()


@dataclass(frozen=True, slots=True)
class Iso15099Data:
    """Data of a system for the Blackbox model."""

    u_value: float  # [W/(m2 K)] at U_STATE_C
    r_outer: float  # [m2 K/W] realised in that state: face to environment
    r_inner: float
    resistance: LayerResistance  # between the two faces, with the realised films
    shade: ShadeNode | None  # None: no shade with air of the room or of outdoors behind it


@lru_cache(maxsize=64)
def iso15099_data(unit: GlazingUnit, u_value: float | None = None) -> Iso15099Data:
    """U, realised films and R(T_m, dT) of a unit, films prescribed.

    Args: u_value: measured [W/(m2 K)]; R is shifted by the difference to the computed one.
    """
    found, r_outer, _, r_inner, _ = _dark_state(unit, *U_STATE_C)
    mean, difference, resistance = (
        np.array(column) for column in zip(*(_middle(state) for state in _dark_states(unit)), strict=True)
    )
    computed = found
    if u_value is not None:
        resistance = resistance + 1.0 / u_value - 1.0 / found
        message = f"U = {u_value:g} is more than the layers let through: {found:.3g} W/(m2 K)"
        require(bool(resistance.min() > 1e-4), "glazing", message)
        found = u_value
    if unit.shade_place == "none" and all(gap.blown is None for gap in unit.gaps):
        fit = _panes_table(unit, 1.0 / found - 1.0 / computed)
    else:
        fit = fit_conductance_surface(mean, difference, resistance)
    shade = _shade_node(unit, 1.0 / found - 1.0 / computed, fit, (r_outer, r_inner))
    return Iso15099Data(found, r_outer, r_inner, fit, shade)


def _panes_table(unit: GlazingUnit, shift: float) -> LayerResistance:
    """R(T_m, dT) of panes, whose faces a prescribed strong film holds at any two temperatures.

    Args: shift: of the resistance [m2 K/W].
    """
    conductance = np.empty((len(MEAN_C), len(APART_K)))
    for i, mean in enumerate(MEAN_C):
        for j, apart in enumerate(APART_K):
            outdoor, indoor = (Environment(mean + side * apart, FACE_HELD) for side in (-0.5, 0.5))
            balance = unit_balance(unit, Conditions(outdoor, indoor))
            resistance = float(balance.faces_c[-1] - balance.faces_c[0]) / -balance.heat_in + shift
            message = f"U is {-shift:.3g} m2 K/W too high for the resistance of the panes"
            require(resistance > 1e-4, "glazing", message)
            conductance[i, j] = 1.0 / resistance
    return conductance_table(MEAN_C, APART_K, conductance)


def _shade_node(
    unit: GlazingUnit, shift: float, two_layers: LayerResistance, films: tuple[float, float]
) -> ShadeNode | None:
    """The shade of a unit whose gap has air of the room or of outdoors; None without one.

    Args: shift: of the panes' resistance [m2 K/W], from a stated U; two_layers, films: of the
        dark unit, from face to face, and realised ones outdoors and indoors.
    """
    arrays = unit.arrays(*(Environment(t, CONVECTION_INSIDE) for t in U_STATE_C))
    exterior = unit.shade_place == "external"
    at = 0 if exterior else -1  # of the shade, and of its gap
    if unit.shade_place not in ("internal", "external") or arrays.air[at] not in (INDOORS, OUTDOORS):
        return None
    shade, pane = (unit.layers[k] for k in ((0, 1) if exterior else (-1, -2)))
    kept, gaps = (slice(1, None), slice(1, None)) if exterior else (slice(-1), slice(-1))
    bare = replace(unit, layers=unit.layers[kept], gaps=unit.gaps[gaps])
    # longwave between pane and shade, and from both to the shade's side, by the pane and the
    # openings too.  With the room it is one flow, divided by weights: what that gives the shade of
    # the pane's own is between both
    side, turned = (0, 1) if exterior else (1, 0)  # of the shade's faces: away, towards the pane
    reflects = 1.0 - pane.emissivity[side]
    passes = shade.infrared_transmittance
    away, towards = shade.emissivity[side], shade.emissivity[turned]
    bounces = 1.0 - reflects * (1.0 - towards - passes)
    of_pane = pane.emissivity[side] * passes / bounces
    whole = of_pane + away + towards * reflects * passes / bounces
    between = 0.0 if exterior else of_pane * (1.0 - of_pane / whole)
    return ShadeNode(
        exterior=exterior,
        width=unit.gaps[at].width,
        height=unit.height,
        tilt=float(np.radians(unit.tilt_deg)),
        impedance=float(arrays.impedance[at]),
        exchange=pane.emissivity[side] * towards / bounces + between,
        pane_weight=of_pane / whole,
        emissivity=whole,
        panes=_panes_table(bare, shift),
        **_dark_shares(unit, shift, exterior),
        two_layers=two_layers,
        film=films[0 if exterior else 1],
    )


def _dark_shares(unit: GlazingUnit, shift: float, exterior: bool) -> dict[str, Any]:
    """`ShadeNode.sun` and `inward` by the temperatures of the dark unit: by reciprocity.

    Args: shift: of the panes' resistance [m2 K/W].
    """
    dark = unit_balance(unit, prescribed(*U_STATE_C))
    faces, heat = (dark.faces_c - U_STATE_C[0]), -dark.heat_in
    warm = U_STATE_C[1] - U_STATE_C[0]
    of_panes = faces[2:] if exterior else faces[:-2]
    shares = (of_panes - of_panes[0]) / (of_panes[-1] - of_panes[0])
    u_value = 1.0 / (shift + warm / heat)
    outer = u_value * of_panes[0] / heat  # of the resistance, from outdoors
    inner = 1.0 - u_value * (warm - of_panes[-1]) / heat
    if exterior:
        nodes = outer * faces[0] / of_panes[0], outer, inner
    else:
        nodes = outer, inner, 1.0 - (1.0 - inner) * (warm - faces[-1]) / (warm - of_panes[-1])
    return {"sun": tuple(shares.reshape(-1, 2).mean(axis=1).tolist()), "inward": tuple(float(node) for node in nodes)}


DarkState = tuple[float, float, float, float, tuple[float, float]]


def _dark_state(unit: GlazingUnit, outdoor: float, indoor: float) -> DarkState:
    """U, R_e, R, R_i and the temperatures of the outermost and innermost face [degC]."""
    balance = unit_balance(unit, prescribed(outdoor, indoor))
    heat = -balance.heat_in
    outer, inner = float(balance.faces_c[0]), float(balance.faces_c[-1])
    resistances = ((outer - outdoor) / heat, (inner - outer) / heat, (indoor - inner) / heat)
    return heat / (indoor - outdoor), *resistances, (outer, inner)


def _dark_states(unit: GlazingUnit) -> list[DarkState]:
    """The states of a grid of temperatures outdoors and indoors."""
    apart = [(e, i) for e in OUTDOOR_C for i in INDOOR_C if abs(i - e) > 5.0]
    states = [state for at in apart if (state := _settled_state(unit, *at)) is not None]
    require(2 * len(states) > len(apart), "glazing", "most dark states have no balance")
    return states


def _settled_state(unit: GlazingUnit, outdoor: float, indoor: float) -> DarkState | None:
    """`_dark_state`; None where a step of a gap's correlation leaves no steady state."""
    try:
        return _dark_state(unit, outdoor, indoor)
    except ThermalInputError:
        return None


def _middle(state: DarkState) -> tuple[float, float, float]:
    """Mean temperature, difference and resistance of a state."""
    *_, resistance, _, (outer, inner) = state
    return 0.5 * (outer + inner), inner - outer, resistance
