"""Inputs and outputs of the compiled time loop: records of arrays, one entry per axis letter.

N inside faces, M modes of walls, Z zones, W windows, H hours, T time steps; U = N + Z
unknowns of a step's linear system, E entries below its diagonal.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

AIR_HEAT = 1006.0  # [J/(kg K)]
TERMS = ("inside sun", "glass sun", "facade sun", "gains", "air exchange", "ideal loads")
TERMS += ("facade", "windows", "partitions", "ground and neighbours", "supply air")
TERMS += ("thermal bridges", "heated slab", "storage")  # [W] into the zone; storage: increase
SUN, GLASS_SUN, FACADE_SUN, GAINS, AIR, LOADS, FACADE, WINDOWS, PARTITIONS = range(9)
KNOWN_FACES, SUPPLY, BRIDGES, SLAB, STORAGE = range(9, 14)


# The records below only lend their arrays: without `_nrt=False` every access would count
# references, and functions called from one cache file to another are not inlined by LLVM; together
# that is nine tenths of a run.  So nothing that is compiled allocates, and all but the entry point
# in `kernel` is inlined: by LLVM, which takes half as long as numba's `inline="always"`, where a
# function is typed anew wherever it is called; and without what Python would call it by.  Products
# and sums are one instruction where the processor has it (a tenth of a run).
ENTRY = {"error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True, "fastmath": {"contract"}}
INLINED = ENTRY | {"forceinline": True, "no_cpython_wrapper": True}
inlined = njit(**INLINED)
summed = njit(**INLINED | {"fastmath": {"contract", "reassoc"}})  # sums in any order: by vectors


class OutdoorConditions(NamedTuple):
    """Values at the end of each step T."""

    outdoor: NDArray[np.float64]  # [T] [degC]
    sky: NDArray[np.float64]  # [T] [degC]
    speed: NDArray[np.float64]  # [T] [m/s]
    windward: NDArray[np.float64]  # [T] V^0.89
    leeward: NDArray[np.float64]  # [T] V^0.617
    origin: NDArray[np.float64]  # [T, 2] unit vector to where the wind comes from
    density: NDArray[np.float64]  # [T] of outdoor air [kg/m3]


class Alternatives(NamedTuple):
    """What `Drive` has of zones in each of A alternatives, from which every hour takes one.

    A condition K has a level: 1 where the zone's temperature meets it, or that which a rule of
    conditions before it asks for.
    """

    # [Z, K, 3] met above, until below [degC, W]; number of the quantity in
    # `control.ROOM_QUANTITIES`
    limits: NDArray[np.float64]
    # [Z, K, 5] rows that a level stays after another was asked for, rows between two changes;
    # number of levels; what a level adds to an alternative's number; rule that asks, -1: limits
    waits: NDArray[np.int64]
    reads: NDArray[np.int64]  # [Z, K, K] what a level of a condition adds to the rows of `asked`
    asked: NDArray[np.int64]  # [Q, B, H] levels by rule
    inner: NDArray[np.float64]  # [A, R, N]
    outer: NDArray[np.float64]  # [A, R, N]
    middle: NDArray[np.float64]  # [A, R, N]
    state: NDArray[np.int64]  # [A, H, W]
    mix: NDArray[np.int64]  # [A, H, Z]
    convective: NDArray[np.float64]  # [A, H, Z]
    radiant: NDArray[np.float64]  # [A, H, Z]


class Drive(NamedTuple):
    """Inputs of the zones; R is the solar time axis (hours or steps)."""

    inner: NDArray[np.float64]  # [R, N] absorbed at the inside faces [W]
    outer: NDArray[np.float64]  # [R, N] absorbed at the outside faces or outer layers [W/m2]
    middle: NDArray[np.float64]  # [R, N] absorbed by panes behind interior shades [W/m2]
    state: NDArray[np.int64]  # [H, W] shading state
    mix: NDArray[np.int64]  # [H, Z] emissivities of the zone's windows: `WindowMix`
    convective: NDArray[np.float64]  # [H, Z] gains [W]
    radiant: NDArray[np.float64]  # [H, Z] gains [W]
    beyond: NDArray[np.float64]  # [T, B] of outer faces: the ground, then the known ones [degC]
    leaks: NDArray[np.float64]  # [H, Z] infiltration that wind and temperatures change [m3/s]
    airflow: NDArray[np.float64]  # [H, Z] other outdoor air [m3/s]
    supply: NDArray[np.float64]  # [H, Z] air of a fan [m3/s]
    supply_c: NDArray[np.float64]  # [T, Z] its temperature; NaN: outdoor air
    airing: NDArray[np.float64]  # [H, Z] share of the windows that may be opened
    transfer: NDArray[np.float64]  # [H, Q] air from zone to zone [m3/s]
    beside: NDArray[np.float64]  # [H, D, 2] air to neighbours [m3/s], open share of the opening
    beside_c: NDArray[np.float64]  # [T, D] the neighbours' air
    heating_c: NDArray[np.float64]  # [T, Z] set point
    cooling_c: NDArray[np.float64]  # [T, Z]
    limit: NDArray[np.float64]  # [Z, 2] heating and cooling power [W]
    slab_c: NDArray[np.float64]  # [T, Z, 2] heating and cooling set point of the slab
    alternatives: Alternatives  # written into the arrays above at the start of every hour


class State(NamedTuple):
    """Temperatures [degC], modified in place."""

    inner: NDArray[np.float64]  # [N] inside faces
    outer: NDArray[np.float64]  # [N] outside faces
    glass: NDArray[np.float64]  # [N, 3] nodes of windows, of those without a shade two
    mode: NDArray[np.float64]  # [M] amplitudes of the modes of the walls' inner nodes [K]
    air: NDArray[np.float64]  # [Z]
    load: NDArray[np.float64]  # [Z] ideal load of the step [W], heating positive
    opened: NDArray[np.bool_]  # [Z] whether the windows are open
    met: NDArray[np.int64]  # [Z, K] levels of the conditions of `Alternatives`
    warm: NDArray[np.bool_]  # [Z, K] whether the temperature meets them, without waiting
    since: NDArray[np.int64]  # [Z, K, L] rows since a change, then since level 1, 2 ... was asked


class Workspace(NamedTuple):
    """Scratch of a step."""

    diagonal: NDArray[np.float64]  # [U] in the order of elimination, as the next two
    below: NDArray[np.float64]  # [E] entries of the columns
    right: NDArray[np.float64]  # [U]
    unknown: NDArray[np.float64]  # [U] inside faces, then air
    air: NDArray[np.float64]  # [Z, 2] conductance to all around [W/K], what flows in from it [W]
    plant: NDArray[np.int64]  # [Z] what the plant does: FREE ... PASSES
    windows: NDArray[np.int64]  # [Z] SHUT, OPEN; with what was tried in the step
    # [Z, 3] air in which windows close or are partly open, in which they open [degC]; flow [m3/s]
    airing: NDArray[np.float64]
    shut: NDArray[np.bool_]  # [Z] whether hybrid windows stay shut in the step
    radiant: NDArray[np.float64]  # [Z] radiant part of its load [W]
    # [Z, 3] of that part: its load's other part, itself, both when last solved; less by its watt
    radiant_seen: NDArray[np.float64]
    flow: NDArray[np.float64]  # [Z] outdoor air but that of fans and opened windows [m3/s]
    fan_runs: NDArray[np.bool_]  # [Z] not where opened windows replace it
    aired: NDArray[np.float64]  # [Z] air through opened windows [m3/s]
    supply: NDArray[np.float64]  # [Z, 3] fans: conductance [W/K], it times temperature, coil [W]
    bypass: NDArray[np.int64]  # [Z] of the heat recovery, as `windows`
    bypass_c: NDArray[np.float64]  # [Z] air in which it opens, or that it holds [degC]
    recovered: NDArray[np.float64]  # [Z, 3] fans with the bypass shut, as `supply`
    bypassed: NDArray[np.float64]  # [Z, 2] and with it open; 0: it is not used
    carried: NDArray[np.float64]  # [Z] heat of the air from other zones and neighbours [W]
    passed: NDArray[np.float64]  # [Z] conductance of the air to the neighbours [W/K]
    slab: NDArray[np.float64]  # [Z] power of the slab [W]
    source: NDArray[np.float64]  # [N] heat set free at the pipes in the face's wall [W/m2]
    still: NDArray[np.float64]  # [M] amplitudes that the step before alone would give
    ends: NDArray[np.float64]  # [N, 2] what these give the outermost and innermost inner node
    film: NDArray[np.float64]  # [N] conductance between inside face and room air [W/(m2 K)]
    # [N, 6] outer face: diagonal, right side, coupling to inside, film sum, sum of film times T
    # (with that of the next), film of the pane beside an exterior shade
    outdoor: NDArray[np.float64]
    # [N, 3, 3] nodes of windows with interior shades: by outdoors and sun alone, with the room's
    # air 1 K warmer, with 1 W/m2 of the room's longwave
    nodes: NDArray[np.float64]
    old_inner: NDArray[np.float64]  # [N]
    old_outer: NDArray[np.float64]  # [N]
    old_air: NDArray[np.float64]  # [Z]


class Means(NamedTuple):
    """Outputs of the loop."""

    inner: NDArray[np.float64]  # [H, N] inside faces [degC]
    outer: NDArray[np.float64]  # [H, N] outside faces [degC]
    air: NDArray[np.float64]  # [H, Z] [degC]
    terms: NDArray[np.float64]  # [H, Z, 14] sums over the steps of the heat flows [W]
    air_flow: NDArray[np.float64]  # [H, Z, 2] outdoor air, of it by fans [m3/s]
    power: NDArray[np.float64]  # [H, Z, 2] of the supply air's coil, of the slab [W]
    alternative: NDArray[np.int64]  # [H, Z] of `Alternatives`


class Method(NamedTuple):
    """Choices of the run."""

    steps: int  # per hour
    step_s: float
    solar_every: int  # steps for which one solar row holds
    inside: int  # 0 TARP and ISO 15099, 1 constant, 2 inside_films
    inside_films: tuple[float, float, float]  # [W/(m2 K)] walls, heat that rises, that sinks
    inside_radiation: float  # [W/(m2 K)] between black faces; 0: by their temperatures
    outside: int  # 0 DOE-2, 1 MoWiTT, 2 constant
    outside_film: float  # [W/(m2 K)] for 2
    pressure: float  # of the air, mean of the climate [Pa]
    iterations: int
    tolerance: float  # [K] between iterates
    warm_tolerance: float  # [K] between warm-up days
    warm_days: int
