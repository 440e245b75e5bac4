"""A window with an interior shade in the room balance: outer pane, innermost pane, shade.

    T_e --film-- [outer] --panes-- [middle] --x-- [shade] --film-- T_i
                                      |F/2          |F/2
                                     T_i           T_i

The air between shade and pane comes from the room and returns to it (ISO 15099:2003, 7.4.1).  At a
speed v its heat is linear in the temperatures of both faces, so that it is eliminated:

    F = rho c v (b/H) (1 - exp(-H/H0))      x = h - F/4 + h_r

with h half of the film at each face of the gap and h_r of the longwave between both.  Longwave of
the room meets the shade and, through its openings, the pane behind it: it sees the temperature
X = (1 - b) T_shade + b T_middle, and what it gives is divided in the same proportion.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal.layer_balance import SIGMA, air_in_gap, gap_convection, speed_by_air
from thermal.network import Network
from thermal.records import State, Workspace, inlined

FloatArray = NDArray[np.float64]
KELVIN = 273.15
ROOM_AIR = np.array([[1.0, 0.0, 0.0, 0.0]])  # fractions of gases [1, 4]


@inlined
def gap_exchange(
    width: float,
    height: float,
    tilt: float,
    impedance: float,
    pane_c: float,
    shade_c: float,
    air_c: float,
) -> tuple[float, float]:
    """Convective h and F [W/(m2 K)] of the gap behind an interior shade.

    F times the mean of both faces less the room's air is the heat that the gap gives to the room.

    Args: width, height [m]; tilt [rad] from horizontal; impedance: of the openings.
    """
    pane, shade, inlet = pane_c + KELVIN, shade_c + KELVIN, air_c + KELVIN
    mean = 0.5 * (pane + shade)
    at = 0.5 * (mean + inlet)  # of the air's properties
    closed = gap_convection(ROOM_AIR, 0, width, height, tilt, pane, shade, at)
    if abs(mean - inlet) < 1e-6:
        return closed, 0.0
    speed = speed_by_air(ROOM_AIR, 0, width, height, tilt, impedance, closed, mean, inlet, at)
    heat = air_in_gap(ROOM_AIR, 0, width, height, closed, speed, mean, inlet, at)[2]
    return closed + 2.0 * speed, -heat / (mean - inlet)


@inlined
def shaded_row(
    shade: FloatArray,
    temperatures: FloatArray,
    air_c: float,
    work: Workspace,
    zone: int,
    i: int,
    outside: float,
    panes: float,
    film: float,
    area: float,
) -> tuple[float, float, float]:
    """Diagonal, conductance to the air and right side [per m2] of X, which the room sees.

    The nodes are eliminated; what passes between air and outdoors by them is added to the air's
    row.  `work.nodes` [0] has the sources of the nodes, and has their temperatures then.

    Args:
        shade: [6] of `Glass`; temperatures: [3] of the last iterate.
        outside, panes, film: conductances [W/(m2 K)] outer pane to outdoors, through the panes, and
            shade to air.
    """
    width, height, tilt, impedance, exchange, weight = shade
    middle_c, shade_c = temperatures[1], temperatures[2]
    h, passed = gap_exchange(width, height, tilt, impedance, middle_c, shade_c, air_c)
    a, b = middle_c + KELVIN, shade_c + KELVIN
    across = h - 0.25 * passed + exchange * SIGMA * (a * a + b * b) * (a + b)
    of_middle, of_shade = 0.5 * passed, 0.5 * passed + film
    by_sun, by_air, by_room = work.nodes[i]
    by_air[0], by_air[1], by_air[2] = 0.0, of_middle, of_shade
    by_room[0], by_room[1], by_room[2] = 0.0, weight, 1.0 - weight
    diagonal = outside + panes, panes + across + of_middle, across + of_shade
    for right in (by_sun, by_air, by_room):
        _solve(diagonal[0], panes, diagonal[1], across, diagonal[2], right)
    reply, share = seen(by_room, weight), seen(by_air, weight)
    still = seen(by_sun, weight)
    to_air = share / reply
    from_nodes = of_middle * by_sun[1] + of_shade * by_sun[2]
    back = of_middle * by_air[1] + of_shade * by_air[2]
    work.air[zone, 0] += area * (of_middle + of_shade - back - (1.0 - share) * to_air)
    work.air[zone, 1] += area * (from_nodes - share * still / reply)
    return 1.0 / reply - to_air, to_air, still / reply


@inlined
def take_nodes(net: Network, state: State, work: Workspace, shading: int, i: int) -> None:
    """Temperatures of a window's nodes from what the room sees; of others the two layers'."""
    glass, nodes = state.glass[i], work.nodes[i]
    shade = net.glass.shade[net.faces.window[i], shading]
    if shade[0] == 0.0:
        glass[0] = state.outer[i]
        glass[1] = glass[2] = state.inner[i]
        return
    weight, air = shade[5], state.air[net.faces.zone[i]]
    still = seen(nodes[0], weight) + seen(nodes[1], weight) * air
    heat = (state.inner[i] - still) / seen(nodes[2], weight)
    for k in range(3):
        glass[k] = nodes[0, k] + nodes[1, k] * air + nodes[2, k] * heat
    state.outer[i] = glass[0]


@inlined
def seen(nodes: FloatArray, weight: float) -> float:
    """What the room's longwave sees of the nodes [3]; weight: of the middle one."""
    return (1.0 - weight) * nodes[2] + weight * nodes[1]


@inlined
def _solve(
    outer: float, panes: float, middle: float, across: float, shade: float, right: FloatArray
) -> None:
    """Solve the chain of outer pane, inner pane and shade in place; right: [3].

    Args: diagonals of the three, and the conductances `panes` and `across` between them.
    """
    up = panes / outer
    second = middle - panes * up
    on = across / second
    right[1] += up * right[0]
    right[2] += on * right[1]
    right[2] /= shade - across * on
    right[1] = (right[1] + across * right[2]) / second
    right[0] = (right[0] + panes * right[1]) / outer
