"""Ideal plants and opened windows in the linear system of a step; compiled.

A plant is free, holds a set point, or is at its limit; windows are shut, fully open, or partly open
to hold a temperature (`air_flow`).

What they do is guessed, and changed until temperatures and loads agree with it: the system
is an M-matrix with bounds, for which that ends.  Source: Hintermueller, Ito and Kunisch 2002,
doi:10.1137/S1052623401383558 (primal-dual active sets).
"""

from __future__ import annotations

import numpy as np

from thermal.air_flow import OPEN, SHUT, TOO_COLD_OPEN, TOO_WARM_SHUT
from thermal.network import Network
from thermal.records import AIR_HEAT, Drive, OutdoorConditions, State, Workspace, inlined

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
def close_air(
    net: Network, work: Workspace, weather: OutdoorConditions, drive: Drive, t: int
) -> None:
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
def plants_agree(
    net: Network, work: Workspace, state: State, weather: OutdoorConditions, drive: Drive, t: int
) -> bool:
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
    limit, full = work.bypass_c[z], work.bypassed[z, 0]
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
def _opening(
    opening: int, air: float, lower: float, upper: float, possible: bool
) -> tuple[int, bool, bool]:
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
def _plant(
    plant: int, air: float, load: float, rounding: float, drive: Drive, t: int, z: int
) -> int:
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
