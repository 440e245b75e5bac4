"""The time loop of the heat balance: compiled hours, their account of heat flows, warm-up."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.compiled import compiled
from thermal.network import GROUND, OUTDOOR, PARTITION, PARTNER, TWIN, WINDOW, Network
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
)
from thermal.step import step


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
    """Add the step's heat flows to terms [Z, 10] [W] (order of TERMS); move the walls' nodes."""
    faces = net.faces
    hour, sun = t // method.steps, t // method.solar_every
    heat = weather.density[t] * AIR_HEAT
    for z in range(work.old_air.size):
        terms[z, 3] += drive.convective[hour, z] + drive.radiant[hour, z]
        terms[z, 4] += heat * drive.airflow[hour, z] * (weather.outdoor[t] - state.air[z])
        terms[z, 5] += state.load[z]
        store = heat * net.air_capacity[z] / method.step_s
        terms[z, 9] += store * (state.air[z] - work.old_air[z])
    for q in range(net.couplings.link.size):
        z, y = net.couplings.zones[q]
        flow = heat * net.couplings.link[q] * (state.air[y] - state.air[z])
        terms[z, 4] += flow
        terms[y, 4] -= flow
    for i in range(faces.area.size):
        z, kind, area = faces.zone[i], faces.kind[i], faces.area[i]
        t_o = state.outer[i]
        terms[z, 0] += drive.inner[sun, i]
        if kind == WINDOW:
            terms[z, 1] += area * drive.outer[sun, i]
            terms[z, 7] += area * (work.outdoor[i, 4] - work.outdoor[i, 3] * t_o)
            continue
        stored = _move_nodes(net, i, state, work)
        if kind == OUTDOOR:
            terms[z, 2] += area * drive.outer[sun, i]
            terms[z, 6] += area * (work.outdoor[i, 4] - work.outdoor[i, 3] * t_o)
        elif kind == GROUND:
            first = state.node[faces.first_node[i]]
            terms[z, 6] += area * faces.port[i, 2] * (t_o - first)
        terms[z, 9] += area * stored
    for i in range(faces.area.size):
        kind = faces.kind[i]
        if kind == TWIN or kind == PARTITION or kind == PARTNER:
            own = faces.partner[i] if kind == PARTNER else i
            side = 0 if kind == PARTNER else 1
            m = faces.first_node[own] + (0 if kind == PARTNER else faces.node_count[own] - 1)
            inward = faces.port[own, 2 + side] * (state.node[m] - state.inner[i])
            stored = faces.port[own, side] * (state.inner[i] - work.old_inner[i])
            terms[faces.zone[i], 8] += faces.area[i] * inward
            terms[faces.zone[i], 9] += faces.area[i] * stored


@inlined
def _move_nodes(net: Network, i: int, state: State, work: Workspace) -> float:
    """Move the inner nodes of face i's wall; returns what the wall stored [W/m2]."""
    faces, nodes = net.faces, net.nodes
    first, count, kind = faces.first_node[i], faces.node_count[i], faces.kind[i]
    stored = 0.0
    for m in range(first, first + count):
        fresh = (
            work.still[m] + nodes.from_out[m] * state.outer[i] + nodes.from_in[m] * state.inner[i]
        )
        stored += nodes.capacity[m] * (fresh - state.node[m])
        state.node[m] = fresh
    if kind == TWIN or kind == PARTITION or kind == PARTNER:
        return 0.0
    stored += faces.port[i, 1] * (state.inner[i] - work.old_inner[i])
    if kind != GROUND:
        stored += faces.port[i, 0] * (state.outer[i] - work.old_outer[i])
    return stored


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
        step(net, state, work, weather, drive, t, method)
        hour = t // method.steps
        _account(net, state, work, weather, drive, t, method, means.terms[hour])
        for i in range(state.inner.size):
            means.inner[hour, i] += share * state.inner[i]
            means.outer[hour, i] += share * state.outer[i]
        for z in range(state.air.size):
            means.air[hour, z] += share * state.air[z]


def warm_up(
    net: Network,
    state: State,
    work: Workspace,
    weather: OutdoorConditions,
    drive: Drive,
    method: Method,
) -> int:
    """Repeat the first day until it ends as it began; returns the number of days."""
    for day in range(method.warm_days):
        before = np.concatenate([state.node, state.inner])
        unused = hourly_means(24, state)
        advance(net, state, work, weather, drive, method, 24, unused)
        change = np.abs(np.concatenate([state.node, state.inner]) - before).max()
        if change < method.warm_tolerance:
            return day + 1
    return method.warm_days


def hourly_means(hours: int, state: State) -> Means:
    """Zeros to add to."""
    n, zones = state.inner.size, state.air.size
    faces, terms = (hours, n), (hours, zones, len(TERMS))
    return Means(np.zeros(faces), np.zeros(faces), np.zeros((hours, zones)), np.zeros(terms))
