"""One implicit time step of the heat balance, compiled.

Backward Euler: the inside faces of all zones and their air are solved together, with the walls
eliminated to two-ports and the outer window layers to conductances.  Film coefficients, longwave
coefficients and layer resistances are those of the last iterate.  What the plants do is guessed and
changed until temperatures and loads agree with it.  The equations that are solved are
linear, so their energy balance closes to rounding whatever the number of iterations.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal.air_flow import OPEN, set_air_flows, set_slab, start_air_flows
from thermal.climate import SIGMA
from thermal.convection import (
    constant_inside,
    doe2_outside,
    iso15099_inside,
    mowitt_outside,
    tarp_inside,
)
from thermal.elimination import eliminate
from thermal.network import (
    ADIABATIC,
    KNOWN,
    OUTDOOR,
    PARTITION,
    PARTNER,
    TWIN,
    WINDOW,
    Faces,
    Modes,
    Network,
)
from thermal.plant import (
    FREE,
    PASSES,
    VENTS,
    close_air,
    is_held,
    plants_agree,
    radiant_load,
    set_point,
)
from thermal.records import (
    AIR_HEAT,
    Drive,
    Method,
    OutdoorConditions,
    State,
    Workspace,
    inlined,
    summed,
)

UPRIGHT = 0.7071  # of the normal's z: faces within 45 degrees of upright
MOST_CHANGES = 50  # of the plants in an iterate; each changes a few times at the most


@inlined
def _go_on(now: NDArray[np.float64], before: NDArray[np.float64]) -> None:
    """Let temperatures change as in the step before, as the first iterate; `before`: the last."""
    for i in range(now.size):
        last = now[i]
        now[i] = last + (last - before[i])
        before[i] = last


@inlined
def _cube(a_c: float, b_c: float) -> float:
    a, b = a_c + 273.15, b_c + 273.15
    return (a * a + b * b) * (a + b)


@inlined
def _layer_conductance(kind: int, c: NDArray[np.float64], inner: float, outer: float) -> float:
    x, d = 0.5 * (inner + outer) - 10.0, abs(inner - outer)
    if kind == 0:
        return 1.0 / c[0]
    if kind == 1:
        u = min(max(c[0] + c[1] * x, 0.05), 0.95 / c[2])
        return 1.0 / (1.0 / u - c[2])
    return max(c[0] + c[1] * x + c[2] * d + c[3] * d * d + c[4] * x * d + c[5] * x * x, 0.02)


@inlined
def _inside_film(faces: Faces, i: int, surface: float, air: float, method: Method) -> float:
    nz = faces.normal[i, 2]
    if method.inside == 1:
        return constant_inside(surface, air, nz)
    if method.inside == 2:
        if abs(nz) < UPRIGHT:
            return method.inside_films[0]
        return method.inside_films[1 if (surface - air) * nz < 0.0 else 2]
    if faces.kind[i] == WINDOW and abs(nz) < 0.1:
        return iso15099_inside(surface, air, faces.height[i])
    return tarp_inside(surface, air, nz)


@inlined
def _outside_exchange(
    faces: Faces, i: int, surface: float, emissivity: float,
    weather: OutdoorConditions, t: int, method: Method,
) -> tuple[float, float]:  # fmt: skip
    """Sum of the outside coefficients [W/(m2 K)], and of them times their temperatures."""
    out, sky = weather.outdoor[t], weather.sky[t]
    nx, ny, nz = faces.normal[i]
    faces_wind = abs(nz) > 0.98 or nx * weather.origin[t, 0] + ny * weather.origin[t, 1] >= -1e-9
    if faces_wind:
        forced = faces.wind[i, 0] * weather.windward[t]
    else:
        forced = faces.wind[i, 1] * weather.leeward[t]
    if method.outside == 0:
        h = doe2_outside(surface, out, nz, forced, faces.roughness[i])
    elif method.outside == 1:
        h = mowitt_outside(surface, out, forced)
    else:
        h = method.outside_film
    radiant = SIGMA * emissivity
    h_sky = radiant * faces.hemisphere[i, 0] * _cube(surface, sky)
    share = faces.hemisphere[i, 1] + faces.hemisphere[i, 2]
    h_out = h + radiant * share * _cube(surface, out)
    return h_sky + h_out, h_sky * sky + h_out * out


@summed
def _still_modes(faces: Faces, modes: Modes, state: State, work: Workspace) -> None:
    """Modes with both faces at zero, the part that comes from the step before, and their ends."""
    for i in range(faces.area.size):
        _still_wall(faces, modes, state, work, i)


@summed
def _still_wall(faces: Faces, modes: Modes, state: State, work: Workspace, i: int) -> None:
    first, source, at_out, at_in = faces.first_mode[i], work.source[i], 0.0, 0.0
    for m in range(first, first + faces.mode_count[i]):
        still = modes.decay[m] * state.mode[m] + modes.from_pipes[m] * source
        at_out += modes.at_out[m] * still
        at_in += modes.at_in[m] * still
        work.still[m] = still
    work.ends[i, 0], work.ends[i, 1] = at_out, at_in


@inlined
def _wall_row(
    net: Network,
    i: int,
    state: State,
    work: Workspace,
    weather: OutdoorConditions,
    t: int,
    outer_sun: float,
    beyond: float,
    method: Method,
) -> tuple[float, float]:
    """Diagonal and right side [per m2] of an opaque face, its outer face eliminated."""
    faces = net.faces
    c_o, c_i, g_o, g_i, u_o, v_o, u_i, v_i = faces.port[i]
    kind = faces.kind[i]
    y_o, y_i = work.ends[i]
    diagonal = c_i + g_i * (1.0 - v_i)
    right = c_i * work.old_inner[i] + g_i * y_i
    if kind == KNOWN:
        return diagonal, right + g_i * u_i * beyond
    if kind == TWIN:
        return diagonal - g_i * u_i, right
    if kind == PARTITION:
        return diagonal, right
    h, h_t = 0.0, 0.0
    if kind == OUTDOOR:
        emissivity = faces.emissivity_out[i]
        h, h_t = _outside_exchange(faces, i, state.outer[i], emissivity, weather, t, method)
    outer_diagonal = c_o + g_o * (1.0 - u_o) + h
    outer_right = c_o * work.old_outer[i] + g_o * y_o + h_t
    if kind == OUTDOOR:
        outer_right += outer_sun
    row = work.outdoor[i]
    row[0], row[1], row[2], row[3], row[4] = outer_diagonal, outer_right, g_o * v_o, h, h_t
    through = g_i * u_i / outer_diagonal
    return diagonal - through * g_o * v_o, right + through * outer_right


@inlined
def _window_row(
    net: Network,
    i: int,
    state: State,
    work: Workspace,
    weather: OutdoorConditions,
    t: int,
    shading: int,
    outer_sun: float,
    method: Method,
) -> tuple[float, float]:
    """Diagonal and right side [per m2] of an inner window layer, its outer layer eliminated.

    Without what goes to the room air.
    """
    w = net.faces.window[i]
    emissivity = net.glass.emissivity_out[w, shading]
    h, h_t = _outside_exchange(net.faces, i, state.outer[i], emissivity, weather, t, method)
    extra, _, to_room = net.glass.extra[w, shading]
    c = _layer_conductance(
        net.glass.kind[w, shading],
        net.glass.coefficient[w, shading],
        state.inner[i],
        state.outer[i],
    )
    outer_diagonal = h + extra + c + to_room
    h_t += extra * weather.outdoor[t]
    outer_right = h_t + outer_sun
    row = work.outdoor[i]
    row[0], row[1], row[2], row[3], row[4] = outer_diagonal, outer_right, c, h + extra, h_t
    row[5] = to_room
    passed = c / outer_diagonal
    return c - (c + to_room) * passed, outer_right * passed


@inlined
def _share(net: Network, drive: Drive, hour: int, z: int, i: int) -> float:
    """Share of the zone's radiant gains that face i takes."""
    first, last = net.radiation.first_face[z], net.radiation.first_face[z + 1]
    return net.radiation.share[
        net.radiation.at_share[z] + drive.mix[hour, z] * (last - first) + i - first
    ]


@inlined
def _assemble(
    net: Network,
    state: State,
    work: Workspace,
    weather: OutdoorConditions,
    drive: Drive,
    t: int,
    method: Method,
) -> None:
    """The linear system of a step, in the order of elimination."""
    faces, pairs, place = net.faces, net.couplings, net.system.place
    d, e, b = work.diagonal, work.below, work.right
    n = faces.area.size
    hour, sun = t // method.steps, t // method.solar_every
    e[:] = 0.0
    _assemble_air(net, state, work, weather, drive, t, method)
    for i in range(n):
        z, kind, area, k = faces.zone[i], faces.kind[i], faces.area[i], place[i]
        film = _inside_film(faces, i, state.inner[i], state.air[z], method)
        if kind == WINDOW:
            shading = drive.state[hour, faces.window[i]]
            film += net.glass.extra[faces.window[i], shading, 1]
            own, r = _window_row(
                net, i, state, work, weather, t, shading, drive.outer[sun, i], method
            )
            row = work.outdoor[i]
            share = row[5] / row[0]  # of what reaches the outer layer from the room's air
            film += row[2] * share  # by way of the outer layer
            work.air[z, 0] += area * row[3] * share  # and to outdoors
            work.air[z, 1] += area * row[1] * share
        elif kind == PARTNER:
            p = faces.partner[i]
            c_o, _, g_o, _, u_o, v_o, _, _ = faces.port[p]
            own = c_o + g_o * (1.0 - u_o)
            r = c_o * work.old_inner[i] + g_o * work.ends[p, 0]
            e[pairs.at_partner[i]] -= area * g_o * v_o
        else:
            beyond = drive.beyond[t, faces.beyond[i]]
            outer = drive.outer[sun, i]
            own, r = _wall_row(net, i, state, work, weather, t, outer, beyond, method)
        work.film[i] = film
        d[k] = area * (own + film)
        radiant = drive.radiant[hour, z] + radiant_load(net, work, drive, z)
        b[k] = area * r + drive.inner[sun, i] + radiant * _share(net, drive, hour, z, i)
        work.air[z, 0] += area * film
        if is_held(work.plant[z]):
            b[k] += area * film * set_point(work, drive, t, z)
        else:
            e[pairs.at_film[i]] = -area * film
    for z in range(work.plant.size):
        first, last = net.radiation.first_pair[z], net.radiation.first_pair[z + 1]
        at = net.radiation.at_exchange[z] + drive.mix[hour, z] * (last - first) - first
        for q in range(first, last):
            i, j = pairs.faces[q]
            area = net.radiation.exchange[at + q]
            h = method.inside_radiation * area
            if h == 0.0:
                h = SIGMA * area * _cube(state.inner[i], state.inner[j])
            e[pairs.at_exchange[q]] -= h
            d[place[i]] += h
            d[place[j]] += h
    close_air(net, work, weather, drive, t)


@inlined
def _choose_supply(work: Workspace, z: int) -> None:
    """The supply air by what the bypass does; partly open, its heat follows from the solution."""
    row, shut, passed = work.supply[z], work.recovered[z], work.bypassed[z]
    row[0], row[1], row[2] = shut[0], shut[1], shut[2]
    if work.plant[z] == PASSES:
        row[0], row[1] = passed[0], 0.0
    elif work.bypass[z] & OPEN and passed[0] > 0.0:
        row[0], row[1] = passed[0], passed[1]


@inlined
def _assemble_air(
    net: Network,
    state: State,
    work: Workspace,
    weather: OutdoorConditions,
    drive: Drive,
    t: int,
    method: Method,
) -> None:
    """Conductance of each zone's air and what flows into it, but for its faces; its neighbours."""
    hour, pairs = t // method.steps, net.couplings
    heat = weather.density[t] * AIR_HEAT
    for z in range(work.plant.size):
        _choose_supply(work, z)
        through = work.windows[z] & OPEN and work.plant[z] != VENTS
        work.aired[z] = work.airing[z, 2] if through else 0.0
        outdoor = heat * (work.flow[z] + work.aired[z]) + net.paths.bridges[z]
        store = heat * net.air_capacity[z] / method.step_s
        work.air[z, 0] = store + outdoor + work.supply[z, 0]
        work.air[z, 1] = store * work.old_air[z] + outdoor * weather.outdoor[t]
        work.air[z, 1] += work.supply[z, 1] + drive.convective[hour, z]
        work.air[z, 1] += drive.air[t // method.solar_every, z]
        work.carried[z], work.passed[z] = 0.0, 0.0
    for q in range(net.paths.beside.size):
        z, beyond = net.paths.beside[q], drive.beside_c[t, q]
        mean = 0.5 * (state.air[z] + beyond) + 273.15
        apart = abs(state.air[z] - beyond) / mean
        driven = drive.beside[hour, q, 1] * net.paths.buoyant[q] * np.sqrt(apart)
        thinner = (weather.outdoor[t] + 273.15) / mean  # than outdoor air
        exchanged = heat * thinner * (drive.beside[hour, q, 0] + driven)
        work.air[z, 0] += exchanged
        work.air[z, 1] += exchanged * beyond
        work.carried[z] += exchanged * beyond
        work.passed[z] += exchanged
    for q in range(net.paths.transfer.shape[0]):
        y, z = net.paths.transfer[q]
        carried = heat * drive.transfer[hour, q]
        work.air[z, 0] += carried
        work.air[z, 1] += carried * state.air[y]
        work.carried[z] += carried * state.air[y]
    for q in range(pairs.link.size):
        z, y = pairs.zones[q]
        exchanged = heat * pairs.link[q]
        work.air[z, 0] += exchanged
        work.air[y, 0] += exchanged
        if not (is_held(work.plant[z]) or is_held(work.plant[y])):
            work.below[pairs.at_link[q]] = -exchanged


@inlined
def _outer_from_inner(net: Network, state: State, work: Workspace, drive: Drive, t: int) -> None:
    faces = net.faces
    for i in range(faces.area.size):
        kind = faces.kind[i]
        if kind == OUTDOOR or kind == WINDOW or kind == ADIABATIC:
            row = work.outdoor[i]
            reached = row[1] + row[2] * state.inner[i] + row[5] * state.air[faces.zone[i]]
            state.outer[i] = reached / row[0]
        elif kind == KNOWN:
            state.outer[i] = drive.beyond[t, faces.beyond[i]]
        elif kind == TWIN:
            state.outer[i] = state.inner[i]
        else:
            state.outer[i] = state.inner[faces.partner[i]]


@inlined
def step(
    net: Network,
    state: State,
    work: Workspace,
    weather: OutdoorConditions,
    drive: Drive,
    t: int,
    method: Method,
) -> None:
    """One time step: iterate the coefficients."""
    n, hour = net.faces.area.size, t // method.steps
    start_air_flows(net, state, work, weather, drive, t, hour)
    for z in range(work.plant.size):
        if work.plant[z] >= VENTS:
            work.plant[z] = FREE
    _go_on(state.inner, work.old_inner)
    _go_on(state.outer, work.old_outer)
    _go_on(state.air, work.old_air)
    _still_modes(net.faces, net.modes, state, work)
    for _ in range(method.iterations):
        set_air_flows(net, state, work, weather, drive, t, hour)
        for z in range(work.plant.size):
            face = net.emitters.slab[z]
            if face >= 0:
                set_slab(net, state, work, drive, t, z)
                _still_wall(net.faces, net.modes, state, work, face)
        for _ in range(MOST_CHANGES):
            _assemble(net, state, work, weather, drive, t, method)
            eliminate(net.system, work.diagonal, work.below, work.right)
            for u in range(work.unknown.size):
                work.unknown[u] = work.right[net.system.place[u]]
            if plants_agree(net, work, state, weather, drive, t):
                break
        change = 0.0
        for i in range(n):
            change = max(change, abs(work.unknown[i] - state.inner[i]))
            state.inner[i] = work.unknown[i]
        for z in range(work.old_air.size):
            change = max(change, abs(work.unknown[n + z] - state.air[z]))
            state.air[z] = work.unknown[n + z]
        _outer_from_inner(net, state, work, drive, t)
        if change < method.tolerance:
            break
    for z in range(work.plant.size):
        state.opened[z] = work.aired[z] > 0.0
