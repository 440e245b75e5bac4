"""A window with a shade outside or inside in the room balance: shade and panes as three nodes.

    T_e --film-- [outer] --panes-- [middle] --x-- [shade] --film-- T_i
                                      |F/2          |F/2
                                     T_i           T_i

The air between shade and pane comes from the room and returns to it (ISO 15099:2003, 7.4.1).  At a
speed v its heat is linear in the temperatures of both faces, so that it is eliminated:

    F = rho c v (b/H) (1 - exp(-H/H0))      x = h - F/4 + h_r

with h half of the film at each face of the gap and h_r of the longwave between both.  Longwave of
the room meets the shade and, through its openings, the pane behind it: it sees the temperature
X = (1 - b) T_shade + b T_middle, and what it gives is divided in the same proportion.

An exterior shade is the outer node, and its gap has outdoor air.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal.films import inside_film, layer_conductance, outside_exchange
from thermal.layer_balance import SIGMA, air_in_gap, gap_convection, speed_by_air
from thermal.network import Network
from thermal.records import Drive, Method, OutdoorConditions, State, Workspace, inlined

FloatArray = NDArray[np.float64]
KELVIN = 273.15
ROOM_AIR = np.array([[1.0, 0.0, 0.0, 0.0]])  # fractions of gases [1, 4]


@inlined
def gap_exchange(
    width: float, height: float, tilt: float, impedance: float, pane_c: float, shade_c: float, air_c: float
) -> tuple[float, float]:
    """Convective h and F [W/(m2 K)] of the gap beside a shade.

    F times the mean of both faces less the air that enters is the heat that this air takes.

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
    net: Network,
    i: int,
    state: State,
    work: Workspace,
    weather: OutdoorConditions,
    drive: Drive,
    t: int,
    method: Method,
) -> tuple[float, float, float]:
    """Diagonal, conductance to the air and right side [per m2] of what the room sees of a window.

    Its nodes are eliminated; what passes between air and outdoors by them is added to the row of
    the air.
    """
    faces, glass = net.faces, net.glass
    w, z, sun, out = faces.window[i], faces.zone[i], t // method.solar_every, weather.outdoor[t]
    shading = drive.state[t // method.steps, w]
    shade, kind, c = (glass.shade[w, shading], glass.kind[w, shading], glass.coefficient[w, shading])
    emissivity, row, sources = glass.emissivity_out[w, shading], work.outdoor[i], work.nodes[i, 0]
    outer, middle, inner = state.glass[i]
    exterior = shade[6] > 0.0
    across, half = _beside(shade, state.glass[i], out if exterior else state.air[z])
    film = inside_film(faces, i, inner, state.air[z], method) + glass.extra[w, shading, 1]
    sources[1], sources[2] = drive.middle[sun, i], drive.inner[sun, i] / faces.area[i]
    if exterior:
        through = shade[5] * emissivity  # longwave of the pane by the shade's openings
        h, h_t = outside_exchange(faces, i, outer, emissivity - through, weather, t, method)
        row[5], beyond = half, half * out
        if through > 0.0:
            both, both_t = outside_exchange(faces, i, middle, through, weather, t, method)
            bare, bare_t = outside_exchange(faces, i, middle, 0.0, weather, t, method)
            row[5] += both - bare
            beyond += both_t - bare_t
        row[3], row[4] = h + half, h_t + half * out
        sources[0], sources[1] = row[4] + drive.outer[sun, i], sources[1] + beyond
        row[4] += beyond
        panes = layer_conductance(kind, c, inner, middle)
        return _eliminated(work, z, i, faces.area[i], (across, panes), (0.0, film), 0.0)
    row[3], row[4] = outside_exchange(faces, i, outer, emissivity, weather, t, method)
    row[5] = 0.0
    sources[0] = row[4] + drive.outer[sun, i]
    panes = layer_conductance(kind, c, middle, outer)
    to_air = half, half + film
    return _eliminated(work, z, i, faces.area[i], (panes, across), to_air, shade[5])


@inlined
def _beside(shade: FloatArray, glass: FloatArray, inlet_c: float) -> tuple[float, float]:
    """Conductances between a shade and its pane, and from each to where the gap's air is from."""
    width, height, tilt, impedance, exchange, _, exterior = shade
    pane_c, shade_c = glass[1], glass[0 if exterior > 0.0 else 2]
    h, passed = gap_exchange(width, height, tilt, impedance, pane_c, shade_c, inlet_c)
    a, b = pane_c + KELVIN, shade_c + KELVIN
    return h - 0.25 * passed + exchange * SIGMA * (a * a + b * b) * (a + b), 0.5 * passed


@inlined
def _eliminated(
    work: Workspace,
    zone: int,
    i: int,
    area: float,
    links: tuple[float, float],
    to_air: tuple[float, float],
    weight: float,
) -> tuple[float, float, float]:
    """As `shaded_row`.  `work.nodes` [0] has the sources of the nodes, and their temperatures then.

    Args:
        links: conductances between the nodes, outermost first; to_air: of the last two to the air.
        weight: of the middle node in what the room sees.
    """
    by_sun, by_air, by_room = work.nodes[i]
    by_air[0], by_air[1], by_air[2] = 0.0, to_air[0], to_air[1]
    by_room[0], by_room[1], by_room[2] = 0.0, weight, 1.0 - weight
    row = work.outdoor[i]
    outer, middle = row[3] + links[0], links[0] + links[1] + row[5] + to_air[0]
    for right in (by_sun, by_air, by_room):
        _solve(outer, links[0], middle, links[1], links[1] + to_air[1], right)
    reply, share, still = seen(by_room, weight), seen(by_air, weight), seen(by_sun, weight)
    film = share / reply
    from_nodes = to_air[0] * by_sun[1] + to_air[1] * by_sun[2]
    back = to_air[0] * by_air[1] + to_air[1] * by_air[2]
    work.air[zone, 0] += area * (to_air[0] + to_air[1] - back - (1.0 - share) * film)
    work.air[zone, 1] += area * (from_nodes - share * still / reply)
    return 1.0 / reply - film, film, still / reply


@inlined
def take_nodes(net: Network, state: State, work: Workspace, shading: int, i: int) -> None:
    """Temperatures of a window's nodes from what the room sees; of others the two layers'."""
    glass, nodes = state.glass[i], work.nodes[i]
    shade = net.glass.shade[net.faces.window[i], shading]
    if shade[0] == 0.0:
        glass[0] = state.outer[i]
        glass[1] = glass[2] = state.inner[i]
        return
    weight, air = 0.0 if shade[6] > 0.0 else shade[5], state.air[net.faces.zone[i]]
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
def _solve(outer: float, first: float, middle: float, second: float, inner: float, right: FloatArray) -> None:
    """Solve the chain of three nodes in place; right: [3].

    Args: diagonals of the three, and the conductances between them.
    """
    up = first / outer
    pivot = middle - first * up
    on = second / pivot
    right[1] += up * right[0]
    right[2] += on * right[1]
    right[2] /= inner - second * on
    right[1] = (right[1] + second * right[2]) / pivot
    right[0] = (right[0] + first * right[1]) / outer
