"""One implicit time step of the heat balance, compiled.

Backward Euler: the inside faces of all zones and their air are solved together, with the walls
eliminated to two-ports and the outer window layers to conductances.  Film coefficients, longwave
coefficients and layer resistances are those of the last iterate.  The equations that are solved are
linear, so their energy balance closes to rounding whatever the number of iterations.

Plants and opened windows: a plant is free, holds a set point, or is at its limit; windows are shut,
fully open, or partly open to hold a temperature. Their modes are guessed, and changed until
temperatures and loads agree with it: the system is an M-matrix with bounds, for which that ends.
Source: Hintermueller, Ito and Kunisch 2002, doi:10.1137/S1052623401383558 (primal-dual active
sets).

Outdoor air and the slab: leaks, the flow through opened windows and the slab follow the air of the
last iterate. Windows open where the air of the step would rise above their upper limit, and close
where shut it would not exceed the lower one. Where fully open it would fall below the lower limit,
they are open in part and hold it. The bypass of a heat recovery likewise holds its temperature (or
the one above which the room would be cooled); it is shut while the room is heated. Hybrid windows
replace the fan while they are open; they are shut in a step in which the room would need cooling
besides. So no on and off is left that the time step would have to resolve.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal.climate import SIGMA
from thermal.elimination import eliminate
from thermal.films import cube, inside_film, layer_conductance, outside_exchange
from thermal.network import ADIABATIC, KNOWN, OUTDOOR, PARTITION, PARTNER, TWIN, WINDOW, Faces, Modes, Network
from thermal.records import AIR_HEAT, Drive, Method, OutdoorConditions, State, Workspace, inlined, summed
from thermal.shaded_window import shaded_row, take_nodes
from thermal.ventilation import REFERENCE_DENSITY

SHUT, OPEN = 0, 1  # windows of a zone in an iterate
TOO_WARM_SHUT, TOO_COLD_OPEN = 2, 4  # what was tried in the step, added to these


@inlined
def start_air_flows(
    net: Network, state: State, work: Workspace, weather: OutdoorConditions, drive: Drive, t: int, hour: int
) -> None:
    """Set windows and bypass of every zone to their states of the step before."""
    for z in range(work.flow.size):
        work.shut[z] = False
        work.windows[z] = OPEN if state.opened[z] else SHUT
        above = max(min(net.paths.fan[z, 1], drive.cooling_c[t, z]), drive.heating_c[t, z])
        work.bypass_c[z] = above
        work.bypass[z] = OPEN if state.air[z] > above else SHUT


@inlined
def set_air_flows(
    net: Network, state: State, work: Workspace, weather: OutdoorConditions, drive: Drive, t: int, hour: int
) -> None:
    """Set the air of every zone from outdoors, through its windows when open, and from its fan."""
    for z in range(work.flow.size):
        _set_supply(net, state, work, weather, drive, t, hour, z)
        work.flow[z] = drive.airflow[hour, z] + _leaks(net, state, weather, drive, t, hour, z)
        work.airing[z, 2] = 0.0
        _set_limits(net, state, work, weather, drive, t, hour, z)
        if drive.airing[hour, z] > 0.0:
            work.airing[z, 2] = _airing(net, state, work, weather, drive, t, hour, z)


@inlined
def _leaks(net: Network, state: State, weather: OutdoorConditions, drive: Drive, t: int, hour: int, z: int) -> float:
    a, b, c, d, s, m, w, n = net.paths.leak[z]
    gap, v = abs(state.air[z] - weather.outdoor[t]), weather.speed[t] * net.paths.wind[z]
    flow = drive.leaks[hour, z] * (a + b * gap + c * v + d * v * v)
    if s > 0.0 or w > 0.0:
        stack, wind = s * gap**m, w * v**n
        flow += np.sqrt(stack * stack + wind * wind)
    return flow


@inlined
def _set_limits(
    net: Network, state: State, work: Workspace, weather: OutdoorConditions, drive: Drive, t: int, hour: int, z: int
) -> None:
    """Air temperatures at which the windows close and open."""
    above, below, difference = net.paths.opens[z, 0], net.paths.opens[z, 1], net.paths.opens[z, 2]
    if net.paths.opens[z, 6] > 0.0:  # limits of the operative temperature
        radiant = mean_radiant(net, state, drive.mix[hour, z], z)
        above, below = 2.0 * above - radiant, 2.0 * below - radiant
    lower = max(below, weather.outdoor[t] + difference)
    if net.paths.opens[z, 5] == 0.0:
        lower = max(lower, drive.heating_c[t, z])
    upper = max(above, lower)
    work.airing[z, 0], work.airing[z, 1] = lower, upper


@inlined
def _airing(
    net: Network, state: State, work: Workspace, weather: OutdoorConditions, drive: Drive, t: int, hour: int, z: int
) -> float:
    """Air through the windows when open [m3/s]; 0 where they must stay shut."""
    greatest, least_out = net.paths.opens[z, 3], net.paths.opens[z, 4]
    v, out = weather.speed[t] * net.paths.site, weather.outdoor[t]
    if v > greatest or out < least_out or work.airing[z, 0] > drive.cooling_c[t, z] or work.shut[z]:
        return 0.0
    w, s, both, flow = net.paths.airing[z]
    wind, stack = w * v * v, s * abs(state.air[z] - out)
    squared = wind + stack if both > 0.0 else max(wind, stack)
    flow += REFERENCE_DENSITY / weather.density[t] * np.sqrt(squared)
    return drive.airing[hour, z] * flow


@inlined
def mean_radiant(net: Network, state: State, mix: int, z: int) -> float:
    """Mean radiant temperature of a zone [degC], weighted as its radiant gains are shared."""
    first, last = net.radiation.first_face[z], net.radiation.first_face[z + 1]
    at, mean = net.radiation.at_share[z] + mix * (last - first) - first, 0.0
    for i in range(first, last):
        mean += net.radiation.share[at + i] * state.inner[i]
    return mean


@inlined
def _set_supply(
    net: Network, state: State, work: Workspace, weather: OutdoorConditions, drive: Drive, t: int, hour: int, z: int
) -> None:
    """Set the air of a fan with all heat recovered, and with what its least lets it bypass."""
    full = weather.density[t] * AIR_HEAT * drive.supply[hour, z]
    given, inside, out = drive.supply_c[t, z], state.air[z], weather.outdoor[t]
    recovery, bypass, least = net.paths.fan[z]
    shut, passed = work.recovered[z], work.bypassed[z]
    passed[0], passed[1] = 0.0, 0.0
    if not np.isnan(given):
        shut[0], shut[1], shut[2] = full, full * given, 0.0
        return
    reached = out + recovery * (inside - out)
    if reached < least:
        shut[0], shut[1], shut[2] = full, full * least, full * (least - reached)
        return
    shut[0] = full * (1.0 - recovery)
    shut[1], shut[2] = shut[0] * out, 0.0
    if recovery > 0.0 and out < inside and np.isfinite(bypass):
        passed[0], passed[1] = full, full * max(out, least)


@inlined
def set_slab(net: Network, state: State, work: Workspace, drive: Drive, t: int, z: int) -> None:
    """Set the power of a zone's slab, by the air of the last iterate."""
    face = net.emitters.slab[z]
    full_heat, full_cold, band = net.emitters.power[z]
    lacks = (drive.slab_c[t, z, 0] - state.air[z]) / band + 0.5
    exceeds = (state.air[z] - drive.slab_c[t, z, 1]) / band + 0.5
    power = full_heat * min(max(lacks, 0.0), 1.0) - full_cold * min(max(exceeds, 0.0), 1.0)
    work.slab[z] = power
    work.source[face] = power / net.faces.area[face]


FREE, HEATS, HEATS_FULLY, COOLS, COOLS_FULLY = range(5)  # what the plant of a zone does
VENTS = 5  # windows, partly open, hold the air at their lower limit
PASSES = 6  # the bypass of the heat recovery, partly open, holds the air at its temperature
ROUNDING = 1e-10  # of temperatures [K]
RADIANT_PART = 1e-4  # that the shares of a load may be off, of it
LEAST_REPLY = 0.01  # of the load's other part, less by each watt that is radiant


@inlined
def is_held(plant: int) -> bool:
    """Whether plant, windows or bypass hold the air of their zone at a temperature."""
    return plant == HEATS or plant == COOLS or plant >= VENTS


@inlined
def set_point(work: Workspace, drive: Drive, t: int, z: int) -> float:
    """The air temperature that plant, windows or bypass hold [degC]."""
    plant = work.plant[z]
    if plant == VENTS:
        return work.airing[z, 0]
    if plant == PASSES:
        return work.bypass_c[z]
    return drive.heating_c[t, z] if plant == HEATS else drive.cooling_c[t, z]


@inlined
def radiant_load(net: Network, work: Workspace, drive: Drive, z: int) -> float:
    """What a plant radiates [W], as guessed where it holds a set point."""
    plant, share = work.plant[z], net.emitters.radiant[z]
    if plant == HEATS_FULLY:
        return share[0] * drive.limit[z, 0]
    if plant == COOLS_FULLY:
        return -share[1] * drive.limit[z, 1]
    return work.radiant[z] if plant == HEATS or plant == COOLS else 0.0


@inlined
def _radiated(net: Network, work: Workspace, drive: Drive, z: int, i: int, share: float) -> float:
    """What face i takes of the plant's radiant load [W]; share: of one that acts at all faces."""
    load = radiant_load(net, work, drive, z)
    face = net.emitters.acts_at[z, 0 if load > 0.0 else 1]
    if face < 0:
        return load * share
    return load if face == i else 0.0


@inlined
def close_air(net: Network, work: Workspace, weather: OutdoorConditions, drive: Drive, t: int) -> None:
    """Rows of the air: the plant holds the set point, or gives a known load."""
    n, place, pairs = net.faces.area.size, net.system.place, net.couplings
    d, b = work.diagonal, work.right
    for z in range(work.plant.size):
        k, plant = place[n + z], work.plant[z]
        if is_held(plant):
            d[k], b[k] = 1.0, set_point(work, drive, t, z)
            continue
        d[k], b[k] = work.air[z, 0], work.air[z, 1]
        if plant == HEATS_FULLY:
            b[k] += (1.0 - net.emitters.radiant[z, 0]) * drive.limit[z, 0]
        elif plant == COOLS_FULLY:
            b[k] -= (1.0 - net.emitters.radiant[z, 1]) * drive.limit[z, 1]
    heat = weather.density[t] * AIR_HEAT
    for q in range(pairs.link.size):
        z, y = pairs.zones[q]
        if is_held(work.plant[z]) and not is_held(work.plant[y]):
            b[place[n + y]] += heat * pairs.link[q] * b[place[n + z]]
        elif is_held(work.plant[y]) and not is_held(work.plant[z]):
            b[place[n + z]] += heat * pairs.link[q] * b[place[n + y]]


@inlined
def plants_agree(net: Network, work: Workspace, state: State, weather: OutdoorConditions, drive: Drive, t: int) -> bool:
    """Set the loads; whether each plant does what its zone's temperature asks, else it changes."""
    faces, pairs, x = net.faces, net.couplings, work.unknown
    n, heat = faces.area.size, weather.density[t] * AIR_HEAT
    for i in range(n):
        work.air[faces.zone[i], 1] += faces.area[i] * work.film[i] * x[i]
    for q in range(pairs.link.size):
        z, y = pairs.zones[q]
        work.air[z, 1] += heat * pairs.link[q] * x[n + y]
        work.air[y, 1] += heat * pairs.link[q] * x[n + z]
    agree = True
    for z in range(work.plant.size):
        air, stiffness, plant = x[n + z], work.air[z, 0], work.plant[z]
        state.load[z] = asked = 0.0
        if plant == VENTS:
            asked = stiffness * air - work.air[z, 1]
            work.aired[z] = asked / (heat * (weather.outdoor[t] - air))
        elif plant == PASSES:
            work.supply[z, 1] = stiffness * air - work.air[z, 1]
        elif is_held(plant):
            convective = stiffness * air - work.air[z, 1]
            state.load[z] = convective + work.radiant[z]
            asked = _whole_load(net, work, z, convective)
            agree &= abs(state.load[z] - asked) <= RADIANT_PART * (1.0 + abs(asked))
        elif plant == HEATS_FULLY:
            state.load[z] = drive.limit[z, 0]
        elif plant == COOLS_FULLY:
            state.load[z] = -drive.limit[z, 1]
        if plant < VENTS:
            work.plant[z] = _plant(plant, air, asked, stiffness * ROUNDING, drive, t, z)
        agree &= work.plant[z] == plant
        cools = work.plant[z] == COOLS or work.plant[z] == COOLS_FULLY
        if cools and net.paths.opens[z, 7] > 0.0 and work.windows[z] & OPEN:
            work.shut[z], work.airing[z, 2] = True, 0.0  # outdoor air does not cool enough
        agree &= _windows_agree(work, z, air)
        agree &= _bypass_agrees(work, z, air)
        if work.plant[z] != HEATS and work.plant[z] != COOLS:
            work.radiant[z] = 0.0
    return agree


@inlined
def _windows_agree(work: Workspace, z: int, air: float) -> bool:
    """Whether the windows do what this air temperature asks, else they change."""
    lower, upper, full = work.airing[z]
    if work.plant[z] == VENTS:
        if 0.0 <= work.aired[z] <= full:
            return True
        work.plant[z], work.windows[z] = FREE, OPEN if work.aired[z] > full else SHUT
        return False
    work.windows[z], agree, holds = _opening(work.windows[z], air, lower, upper, full > 0.0)
    if holds:
        work.plant[z] = VENTS
    return agree


@inlined
def _bypass_agrees(work: Workspace, z: int, air: float) -> bool:
    """Whether the bypass does what this air temperature asks, else it changes."""
    limit, full = work.bypass_c[z], work.bypassed[z, 0] if work.fan_runs[z] else 0.0
    if work.plant[z] == PASSES:
        coldest = work.bypassed[z, 1]
        warmest = work.recovered[z, 1] + (full - work.recovered[z, 0]) * air
        if full > 0.0 and coldest <= work.supply[z, 1] <= warmest:
            return True
        work.plant[z] = FREE
        work.bypass[z] = OPEN if full > 0.0 and work.supply[z, 1] < coldest else SHUT
        return False
    if work.plant[z] == COOLS or work.plant[z] == COOLS_FULLY:
        air = np.inf  # too warm, though it is held
    work.bypass[z], agree, holds = _opening(work.bypass[z], air, limit, limit, full > 0.0)
    if holds:
        work.plant[z] = PASSES
    return agree


@inlined
def _opening(opening: int, air: float, lower: float, upper: float, possible: bool) -> tuple[int, bool, bool]:
    """What it does next, whether that is what it does, and whether it is partly open and holds.

    It opens above the upper temperature and closes below the lower one [degC].
    """
    if opening & OPEN:
        if possible and air >= lower - ROUNDING:
            return opening, True, False
        if opening & TOO_WARM_SHUT and possible:
            return opening, False, True
        return SHUT | TOO_COLD_OPEN, False, False
    limit = lower if opening & TOO_COLD_OPEN else upper
    if not possible or air <= limit + ROUNDING:
        return opening, True, False
    if opening & TOO_COLD_OPEN:
        return opening, False, True
    return OPEN | TOO_WARM_SHUT, False, False


@inlined
def _whole_load(net: Network, work: Workspace, z: int, convective: float) -> float:
    """The load [W] whose parts have the plant's shares; its radiant part is the next guess.

    The convective part falls linearly with the radiant one: by the slope between the last two.
    """
    plant, radiant, seen = work.plant[z], work.radiant[z], work.radiant_seen[z]
    share = net.emitters.radiant[z, 0 if plant == HEATS else 1]
    if share == 0.0:
        work.radiant[z] = 0.0
        return convective + radiant
    if abs(radiant - seen[1]) > 1e-3:
        seen[2] = min(max((seen[0] - convective) / (radiant - seen[1]), LEAST_REPLY), 1.0)
    seen[0], seen[1] = convective, radiant
    whole = (convective + seen[2] * radiant) / (1.0 - share + share * seen[2])
    work.radiant[z] = share * whole
    return whole


@inlined
def _plant(plant: int, air: float, load: float, rounding: float, drive: Drive, t: int, z: int) -> int:
    """What the plant must do where, doing `plant`, it gives this air temperature and load."""
    if plant == HEATS:
        if load > drive.limit[z, 0]:
            return HEATS_FULLY
        return HEATS if load >= -rounding else FREE
    if plant == COOLS:
        if -load > drive.limit[z, 1]:
            return COOLS_FULLY
        return COOLS if load <= rounding else FREE
    if plant == HEATS_FULLY:
        return HEATS if air > drive.heating_c[t, z] + ROUNDING else plant
    if plant == COOLS_FULLY:
        return COOLS if air < drive.cooling_c[t, z] - ROUNDING else plant
    if air < drive.heating_c[t, z] - ROUNDING:
        return HEATS
    return COOLS if air > drive.cooling_c[t, z] + ROUNDING else FREE


MOST_CHANGES = 50  # of the plants in an iterate; each changes a few times at the most


@inlined
def _go_on(now: NDArray[np.float64], before: NDArray[np.float64]) -> None:
    """Let temperatures change as in the step before, as the first iterate; `before`: the last."""
    for i in range(now.size):
        last = now[i]
        now[i] = last + (last - before[i])
        before[i] = last


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
        h, h_t = outside_exchange(faces, i, state.outer[i], emissivity, weather, t, method)
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
    """Diagonal and right side [per m2] of an inner window layer, its outer layer eliminated."""
    w = net.faces.window[i]
    emissivity = net.glass.emissivity_out[w, shading]
    h, h_t = outside_exchange(net.faces, i, state.outer[i], emissivity, weather, t, method)
    extra = net.glass.extra[w, shading, 0]
    c = layer_conductance(net.glass.kind[w, shading], net.glass.coefficient[w, shading], state.inner[i], state.outer[i])
    outer_diagonal = h + extra + c
    h_t += extra * weather.outdoor[t]
    outer_right = h_t + outer_sun
    row = work.outdoor[i]
    row[0], row[1], row[2], row[3], row[4] = outer_diagonal, outer_right, c, h + extra, h_t
    row[5] = 0.0
    passed = c / outer_diagonal
    return c - c * passed, outer_right * passed


@inlined
def _share(net: Network, drive: Drive, hour: int, z: int, i: int) -> float:
    """Share of the zone's radiant gains that face i takes."""
    first, last = net.radiation.first_face[z], net.radiation.first_face[z + 1]
    return net.radiation.share[net.radiation.at_share[z] + drive.mix[hour, z] * (last - first) + i - first]


@inlined
def _assemble(
    net: Network, state: State, work: Workspace, weather: OutdoorConditions, drive: Drive, t: int, method: Method
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
        film = inside_film(faces, i, state.inner[i], state.air[z], method)
        inner_sun = drive.inner[sun, i]
        if kind == WINDOW:
            shading = drive.state[hour, faces.window[i]]
            film += net.glass.extra[faces.window[i], shading, 1]
            if net.glass.shade[faces.window[i], shading, 0] > 0.0:
                own, film, r = shaded_row(net, i, state, work, weather, drive, t, method)
                inner_sun = 0.0  # it is in the row
            else:
                own, r = _window_row(net, i, state, work, weather, t, shading, drive.outer[sun, i], method)
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
        share = _share(net, drive, hour, z, i)
        b[k] = area * r + inner_sun + drive.radiant[hour, z] * share
        b[k] += _radiated(net, work, drive, z, i, share)
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
                h = SIGMA * area * cube(state.inner[i], state.inner[j])
            e[pairs.at_exchange[q]] -= h
            d[place[i]] += h
            d[place[j]] += h
    close_air(net, work, weather, drive, t)


@inlined
def _choose_supply(work: Workspace, z: int) -> None:
    """The supply air by what the bypass does; partly open, its heat follows from the solution."""
    row, shut, passed = work.supply[z], work.recovered[z], work.bypassed[z]
    row[0], row[1], row[2] = shut[0], shut[1], shut[2]
    if not work.fan_runs[z]:
        row[0], row[1], row[2] = 0.0, 0.0, 0.0
    elif work.plant[z] == PASSES:
        row[0], row[1] = passed[0], 0.0
    elif work.bypass[z] & OPEN and passed[0] > 0.0:
        row[0], row[1] = passed[0], passed[1]


@inlined
def _assemble_air(
    net: Network, state: State, work: Workspace, weather: OutdoorConditions, drive: Drive, t: int, method: Method
) -> None:
    """Conductance of each zone's air and what flows into it, but for its faces; its neighbours."""
    hour, pairs = t // method.steps, net.couplings
    heat = weather.density[t] * AIR_HEAT
    for z in range(work.plant.size):
        through = work.windows[z] & OPEN and work.plant[z] != VENTS
        replaced = net.paths.opens[z, 7] > 0.0 and (through or work.plant[z] == VENTS)
        work.fan_runs[z] = not replaced
        _choose_supply(work, z)
        work.aired[z] = work.airing[z, 2] if through else 0.0
        outdoor = heat * (work.flow[z] + work.aired[z]) + net.paths.bridges[z]
        store = heat * net.air_capacity[z] / method.step_s
        work.air[z, 0] = store + outdoor + work.supply[z, 0]
        work.air[z, 1] = store * work.old_air[z] + outdoor * weather.outdoor[t]
        work.air[z, 1] += work.supply[z, 1] + drive.convective[hour, z]
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
def _outer_from_inner(net: Network, state: State, work: Workspace, drive: Drive, t: int, hour: int) -> None:
    faces = net.faces
    for i in range(faces.area.size):
        kind = faces.kind[i]
        if kind == OUTDOOR or kind == WINDOW or kind == ADIABATIC:
            row = work.outdoor[i]
            state.outer[i] = (row[1] + row[2] * state.inner[i]) / row[0]
            if kind == WINDOW:
                take_nodes(net, state, work, drive.state[hour, faces.window[i]], i)
        elif kind == KNOWN:
            state.outer[i] = drive.beyond[t, faces.beyond[i]]
        elif kind == TWIN:
            state.outer[i] = state.inner[i]
        else:
            state.outer[i] = state.inner[faces.partner[i]]


@inlined
def step(
    net: Network, state: State, work: Workspace, weather: OutdoorConditions, drive: Drive, t: int, method: Method
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
        _outer_from_inner(net, state, work, drive, t, hour)
        if change < method.tolerance:
            break
    for z in range(work.plant.size):
        state.opened[z] = work.aired[z] > 0.0
