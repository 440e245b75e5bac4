"""Outdoor air, opened windows, supplied air and the slab's power in a time step, compiled.

Leaks, the flow through opened windows and the slab follow the air of the last iterate.  Windows
open where the air of the step would rise above their upper limit, and close where shut it would not
exceed the lower one.  Where fully open it would fall below the lower limit, they are open in part
and hold it.  The bypass of a heat recovery likewise holds its temperature (or the one above which
the room would be cooled); it is shut while the room is heated.  So no on and off is left that the
time step would have to resolve.
"""

from __future__ import annotations

import numpy as np

from thermal.network import Network
from thermal.records import AIR_HEAT, Drive, OutdoorConditions, State, Workspace, inlined
from thermal.ventilation import REFERENCE_DENSITY

SHUT, OPEN = 0, 1  # windows of a zone in an iterate
TOO_WARM_SHUT, TOO_COLD_OPEN = 2, 4  # what was tried in the step, added to these


@inlined
def start_air_flows(
    net: Network, state: State, work: Workspace, weather: OutdoorConditions, drive: Drive,
    t: int, hour: int,
) -> None:  # fmt: skip
    """Set the limits of windows and bypass of every zone for the step."""
    for z in range(work.flow.size):
        _set_limits(net, state, work, weather, drive, t, z)
        above = max(min(net.paths.fan[z, 1], drive.cooling_c[t, z]), drive.heating_c[t, z])
        work.bypass_c[z] = above
        work.bypass[z] = OPEN if state.air[z] > above else SHUT


@inlined
def set_air_flows(
    net: Network, state: State, work: Workspace, weather: OutdoorConditions, drive: Drive,
    t: int, hour: int,
) -> None:  # fmt: skip
    """Set the air of every zone from outdoors, through its windows when open, and from its fan."""
    for z in range(work.flow.size):
        _set_supply(net, state, work, weather, drive, t, hour, z)
        work.flow[z] = drive.airflow[hour, z] + _leaks(net, state, weather, drive, t, hour, z)
        work.airing[z, 2] = 0.0
        if drive.airing[hour, z] > 0.0:
            work.airing[z, 2] = _airing(net, state, work, weather, drive, t, hour, z)


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
def _set_limits(
    net: Network, state: State, work: Workspace, weather: OutdoorConditions, drive: Drive,
    t: int, z: int,
) -> None:  # fmt: skip
    """Air temperatures at which the windows close and open."""
    above, below, difference = net.paths.opens[z, 0], net.paths.opens[z, 1], net.paths.opens[z, 2]
    lower = max(below, weather.outdoor[t] + difference)
    if net.paths.opens[z, 5] == 0.0:
        lower = max(lower, drive.heating_c[t, z])
    upper = max(above, lower)
    work.airing[z, 0], work.airing[z, 1] = lower, upper
    work.windows[z] = OPEN if state.opened[z] else SHUT


@inlined
def _airing(
    net: Network, state: State, work: Workspace, weather: OutdoorConditions, drive: Drive,
    t: int, hour: int, z: int,
) -> float:  # fmt: skip
    """Air through the windows when open [m3/s]; 0 where they must stay shut."""
    greatest, least_out = net.paths.opens[z, 3], net.paths.opens[z, 4]
    v, out = weather.speed[t] * net.paths.site, weather.outdoor[t]
    if v > greatest or out < least_out or work.airing[z, 0] > drive.cooling_c[t, z]:
        return 0.0
    w, s, both, flow = net.paths.airing[z]
    wind, stack = w * v * v, s * abs(state.air[z] - out)
    squared = wind + stack if both > 0.0 else max(wind, stack)
    flow += REFERENCE_DENSITY / weather.density[t] * np.sqrt(squared)
    return drive.airing[hour, z] * flow


@inlined
def _set_supply(
    net: Network, state: State, work: Workspace, weather: OutdoorConditions, drive: Drive,
    t: int, hour: int, z: int,
) -> None:  # fmt: skip
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
