"""The time loop of the heat balance: compiled hours, their account of heat flows, warm-up."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.compiled import compiled
from thermal import records as on
from thermal.network import KNOWN, OUTDOOR, PARTITION, PARTNER, TWIN, WINDOW, Network
from thermal.records import (
    AIR_HEAT,
    ENTRY,
    TERMS,
    Drive,
    Means,
    Method,
    OutdoorConditions,
    State,
    Workspace,
    inlined,
    summed,
)
from thermal.step import mean_radiant, step


@inlined
def _account(
    net: Network,
    state: State,
    work: Workspace,
    weather: OutdoorConditions,
    drive: Drive,
    t: int,
    method: Method,
    terms: NDArray[np.float64],
) -> None:
    """Add the step's heat flows to terms [Z, 14] [W] (order of TERMS); move the walls' modes."""
    faces = net.faces
    hour, sun = t // method.steps, t // method.solar_every
    heat = weather.density[t] * AIR_HEAT
    for z in range(work.old_air.size):
        warmer = weather.outdoor[t] - state.air[z]
        terms[z, on.GAINS] += drive.convective[hour, z] + drive.radiant[hour, z]
        terms[z, on.AIR] += heat * (work.flow[z] + work.aired[z]) * warmer + work.carried[z]
        terms[z, on.AIR] -= work.passed[z] * state.air[z]
        terms[z, on.LOADS] += state.load[z]
        terms[z, on.SUPPLY] += work.supply[z, 1] - work.supply[z, 0] * state.air[z]
        terms[z, on.BRIDGES] += net.paths.bridges[z] * warmer
        store = heat * net.air_capacity[z] / method.step_s
        terms[z, on.STORAGE] += store * (state.air[z] - work.old_air[z])
    for q in range(net.couplings.link.size):
        z, y = net.couplings.zones[q]
        flow = heat * net.couplings.link[q] * (state.air[y] - state.air[z])
        terms[z, on.AIR] += flow
        terms[y, on.AIR] -= flow
    for q in range(net.paths.transfer.shape[0]):
        z = net.paths.transfer[q, 1]
        terms[z, on.AIR] -= heat * drive.transfer[hour, q] * state.air[z]
    for i in range(faces.area.size):
        z, kind, area = faces.zone[i], faces.kind[i], faces.area[i]
        t_o = state.outer[i]
        terms[z, on.SUN] += drive.inner[sun, i]
        if kind == WINDOW:
            terms[z, on.GLASS_SUN] += area * (drive.outer[sun, i] + drive.middle[sun, i])
            row, pane = work.outdoor[i], state.glass[i, 1]
            terms[z, on.WINDOWS] += area * (row[4] - row[3] * t_o - row[5] * pane)
            continue
        stored = _move_modes(net, i, state, work)
        if kind == OUTDOOR:
            terms[z, on.FACADE_SUN] += area * drive.outer[sun, i]
            terms[z, on.FACADE] += area * (work.outdoor[i, 4] - work.outdoor[i, 3] * t_o)
        elif kind == KNOWN:
            first = _end_node(net, i, 0, state, work)
            terms[z, on.KNOWN_FACES] += area * faces.port[i, 2] * (t_o - first)
        terms[z, on.STORAGE] += area * stored
    for i in range(faces.area.size):
        kind = faces.kind[i]
        if kind == TWIN or kind == PARTITION or kind == PARTNER:
            own = faces.partner[i] if kind == PARTNER else i
            side = 0 if kind == PARTNER else 1
            near = _end_node(net, own, side, state, work)
            inward = faces.port[own, 2 + side] * (near - state.inner[i])
            stored = faces.port[own, side] * (state.inner[i] - work.old_inner[i])
            terms[faces.zone[i], on.PARTITIONS] += faces.area[i] * inward
            terms[faces.zone[i], on.STORAGE] += faces.area[i] * stored
    for z in range(work.old_air.size):
        face = net.emitters.slab[z]
        if face >= 0:
            terms[z, on.SLAB] += work.slab[z]
            if faces.kind[face] == TWIN or faces.kind[face] == PARTITION:
                terms[z, on.PARTITIONS] -= work.slab[z]  # it came with the heat of that wall


@summed
def _move_modes(net: Network, i: int, state: State, work: Workspace) -> float:
    """Move the modes of face i's wall; returns what the wall stored [W/m2]."""
    faces, modes = net.faces, net.modes
    first, kind, stored = faces.first_mode[i], faces.kind[i], 0.0
    outer, inner = state.outer[i], state.inner[i]
    for m in range(first, first + faces.mode_count[i]):
        fresh = work.still[m] + modes.from_out[m] * outer + modes.from_in[m] * inner
        stored += modes.heat[m] * (fresh - state.mode[m])
        state.mode[m] = fresh
    if kind == TWIN or kind == PARTITION or kind == PARTNER:
        return 0.0
    stored += faces.port[i, 1] * (inner - work.old_inner[i])
    if kind != KNOWN:
        stored += faces.port[i, 0] * (outer - work.old_outer[i])
    return stored


@inlined
def _end_node(net: Network, i: int, side: int, state: State, work: Workspace) -> float:
    """Temperature of the outermost (0) or innermost (1) inner node of face i's wall."""
    port = net.faces.port[i]
    from_faces = port[4 + 2 * side] * state.outer[i] + port[5 + 2 * side] * state.inner[i]
    return work.ends[i, side] + from_faces


@inlined
def _take_alternative(
    net: Network, state: State, drive: Drive, method: Method, hour: int, taken: NDArray[np.int64]
) -> None:
    """Write the alternative of every zone into the drive of an hour, by the temperatures now."""
    some, per_hour = drive.alternatives, method.steps // method.solar_every
    for z in range(some.limits.shape[0]):
        before, now = 0, 0
        for k in range(some.limits.shape[1]):
            before += some.waits[z, k, 3] * state.met[z, k]
        for k in range(some.limits.shape[1]):
            stays, holds, levels, stride, rule = some.waits[z, k]
            since, asked, wanted = state.since[z, k], 0, 0
            if rule < 0:
                above, below, quantity = some.limits[z, k]
                felt = state.air[z]
                if quantity == 1.0:
                    felt = 0.5 * (felt + mean_radiant(net, state, some.mix[before, hour, z], z))
                elif quantity == 2.0:
                    felt = max(-state.load[z], 0.0)
                elif quantity == 3.0:
                    felt = max(state.load[z], 0.0)
                state.warm[z, k] = felt > above or (state.warm[z, k] and felt >= below)
                asked = 1 if state.warm[z, k] else 0
            else:
                row = 0
                for j in range(k):
                    row += some.reads[z, k, j] * state.met[z, j]
                asked = some.asked[rule, row, hour]
            for level in range(1, levels):
                since[level] = 0 if asked >= level else since[level] + 1
                if since[level] <= stays:
                    wanted = level
            since[0] += 1
            if wanted != state.met[z, k] and since[0] >= holds:
                state.met[z, k], since[0] = wanted, 0
            now += stride * state.met[z, k]
        taken[z] = now
        drive.mix[hour, z] = some.mix[now, hour, z]
        drive.convective[hour, z] = some.convective[now, hour, z]
        drive.radiant[hour, z] = some.radiant[now, hour, z]
        for i in range(net.radiation.first_face[z], net.radiation.first_face[z + 1]):
            if net.faces.kind[i] == WINDOW:
                w = net.faces.window[i]
                drive.state[hour, w] = some.state[now, hour, w]
            for sun in range(hour * per_hour, (hour + 1) * per_hour):
                drive.inner[sun, i] = some.inner[now, sun, i]
                drive.outer[sun, i] = some.outer[now, sun, i]
                drive.middle[sun, i] = some.middle[now, sun, i]


@compiled(**ENTRY)
def advance(
    net: Network,
    state: State,
    work: Workspace,
    weather: OutdoorConditions,
    drive: Drive,
    method: Method,
    hours: int,
    means: Means,
) -> None:
    """Run the first `hours` hours from the given state; add their means to `means`."""
    share = 1.0 / method.steps
    for t in range(hours * method.steps):
        if t % method.steps == 0 and drive.alternatives.limits.shape[1] > 0:
            hour = t // method.steps
            _take_alternative(net, state, drive, method, hour, means.alternative[hour])
        step(net, state, work, weather, drive, t, method)
        hour = t // method.steps
        _account(net, state, work, weather, drive, t, method, means.terms[hour])
        for i in range(state.inner.size):
            means.inner[hour, i] += share * state.inner[i]
            means.outer[hour, i] += share * state.outer[i]
        for z in range(state.air.size):
            means.air[hour, z] += share * state.air[z]
            fan = drive.supply[hour, z] if work.fan_runs[z] else 0.0
            means.air_flow[hour, z, 0] += share * (work.flow[z] + work.aired[z] + fan)
            means.air_flow[hour, z, 1] += share * fan
            means.power[hour, z, 0] += share * work.supply[z, 2]
            means.power[hour, z, 1] += share * work.slab[z]


def warm_up(
    net: Network,
    state: State,
    work: Workspace,
    weather: OutdoorConditions,
    drive: Drive,
    method: Method,
    *,
    rows: int = 24,
) -> int:
    """Repeat the first day, of so many rows, until it ends as it began; how many days that took."""
    for day in range(method.warm_days):
        before = np.concatenate([state.mode, state.inner])
        unused = hourly_means(rows, state)
        advance(net, state, work, weather, drive, method, rows, unused)
        change = np.abs(np.concatenate([state.mode, state.inner]) - before).max()
        if change < method.warm_tolerance:
            return day + 1
    return method.warm_days


def hourly_means(hours: int, state: State) -> Means:
    """Zeros to add to."""
    n, zones = state.inner.size, state.air.size
    faces, terms = (hours, n), (hours, zones, len(TERMS))
    return Means(
        inner=np.zeros(faces),
        outer=np.zeros(faces),
        air=np.zeros((hours, zones)),
        terms=np.zeros(terms),
        air_flow=np.zeros((hours, zones, 2)),
        power=np.zeros((hours, zones, 2)),
        alternative=np.zeros((hours, zones), dtype=np.int64),
    )
