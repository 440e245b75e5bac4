"""Outdoor air, supplied air and the slab's power at the start of a time step, compiled.

They follow from the room's air at the end of the step before and hold for the step; heat recovery
goes with the air of the step itself.
"""

from __future__ import annotations

import numpy as np

from thermal.network import Network
from thermal.records import AIR_HEAT, Drive, OutdoorConditions, State, Workspace, inlined
from thermal.ventilation import REFERENCE_DENSITY


@inlined
def set_air_flows(
    net: Network, state: State, work: Workspace, weather: OutdoorConditions, drive: Drive,
    t: int, hour: int,
) -> None:  # fmt: skip
    """Set flow, supply and slab power of every zone for the step."""
    for z in range(work.flow.size):
        work.flow[z] = drive.airflow[hour, z] + _leaks(net, state, weather, drive, t, hour, z)
        work.flow[z] += _airing(net, state, weather, drive, t, hour, z)
        _set_supply(net, state, work, weather, drive, t, hour, z)
        face = net.emitters.slab[z]
        if face >= 0:
            full_heat, full_cold, band = net.emitters.power[z]
            lacks = (drive.slab_c[t, z, 0] - state.air[z]) / band + 0.5
            exceeds = (state.air[z] - drive.slab_c[t, z, 1]) / band + 0.5
            power = full_heat * min(max(lacks, 0.0), 1.0) - full_cold * min(max(exceeds, 0.0), 1.0)
            work.slab[z] = power
            work.source[face] = power / net.faces.area[face]


@inlined
def _leaks(
    net: Network, state: State, weather: OutdoorConditions, drive: Drive, t: int, hour: int, z: int
) -> float:
    a, b, c, d, s, m, w, n = net.paths.leak[z]
    gap, v = abs(state.air[z] - weather.outdoor[t]), weather.speed[t] * net.paths.wind[z]
    flow = drive.leaks[hour, z] * (a + b * gap + c * v + d * v * v)
    if s > 0.0 or w > 0.0:
        stack, wind = s * gap**m, w * v**n
        flow += np.sqrt(stack * stack + wind * wind)
    return flow


@inlined
def _airing(
    net: Network, state: State, weather: OutdoorConditions, drive: Drive, t: int, hour: int, z: int
) -> float:
    share = drive.airing[hour, z]
    inside, out = state.air[z], weather.outdoor[t]
    above, below, difference, greatest, least_out = net.paths.opens[z]
    v = weather.speed[t] * net.paths.site
    useful = share > 0.0 and inside - out >= difference and v <= greatest and out >= least_out
    limit = below if state.opened[z] else above
    state.opened[z] = useful and inside > limit
    if not state.opened[z]:
        return 0.0
    w, s, both = net.paths.airing[z]
    wind, stack = w * v * v, s * abs(inside - out)
    squared = wind + stack if both > 0.0 else max(wind, stack)
    return share * REFERENCE_DENSITY / weather.density[t] * np.sqrt(squared)


@inlined
def _set_supply(
    net: Network, state: State, work: Workspace, weather: OutdoorConditions, drive: Drive,
    t: int, hour: int, z: int,
) -> None:  # fmt: skip
    full = weather.density[t] * AIR_HEAT * drive.supply[hour, z]
    given, inside, out = drive.supply_c[t, z], state.air[z], weather.outdoor[t]
    recovery, bypass, least = net.paths.fan[z]
    row = work.supply[z]
    if not np.isnan(given):
        row[0], row[1], row[2] = full, full * given, 0.0
        return
    if inside > bypass and out < inside:
        recovery = 0.0
    reached = out + recovery * (inside - out)
    if reached < least:
        row[0], row[1], row[2] = full, full * least, full * (least - reached)
    else:
        row[0] = full * (1.0 - recovery)
        row[1], row[2] = row[0] * out, 0.0
