"""The heat balance network of one or several zones, flattened to arrays for the compiled loop.

Faces (axis N) are the inside faces of all zones: per zone its opaque surfaces, its windows, its
window frames, in this order.

The arrays hold outdoor air, air between zones, emitters, and longwave exchange between the inside
faces of a room and from outside faces to the sky.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.conduction import WallGrid, WallModes, wall_grid
from thermal.convection import DOE2_LEEWARD, DOE2_WINDWARD, local_wind_factor
from thermal.elimination import Elimination, elimination
from thermal.errors import require
from thermal.ventilation import AirTransfer, SupplyAir, WindowAiring
from thermal.zone import ROUGHNESS, Layer, OpaqueSurface, WindowElement, Zone


def exchange_from_view_factors(area: ArrayLike, emissivity: ArrayLike, view_factors: ArrayLike) -> NDArray[np.float64]:
    """Exchange areas X [N, N] [m2] of grey surfaces: Q_ij = X_ij sigma (T_i^4 - T_j^4).

    Hottel's total exchange areas; X is symmetric, and A_i eps_i = sum_j X_ij with j = i included.
    The view factors are first made to obey reciprocity and to sum to one (a few Sinkhorn steps),
    so that traced ones with their noise conserve energy.

    Source: Hottel and Sarofim 1967, Radiative Transfer, ch. 3.
    """
    a, eps = np.asarray(area, dtype=float), np.asarray(emissivity, dtype=float)
    f = np.asarray(view_factors, dtype=float)
    n = len(a)
    require(f.shape == (n, n), "view factors", f"expected [{n}, {n}], got {f.shape}")
    require(bool(np.all(f >= -1e-9)), "view factors", "negative")
    sums = f.sum(axis=1)
    require(bool(np.all(np.abs(sums - 1.0) < 0.1)), "view factors", f"rows sum to {sums.round(3)}")
    direct = closed_exchange(a[:, None] * f, a)
    rho_over = (1.0 - eps) / a
    radiosity = np.linalg.inv(np.eye(n) - rho_over[:, None] * direct)
    return (eps[:, None] * direct) @ radiosity * eps[None, :]


def closed_exchange(direct: ArrayLike, area: ArrayLike) -> NDArray[np.float64]:
    """Direct exchange areas [N, N] made symmetric with rows that sum to the areas [N]."""
    s = np.asarray(direct, dtype=float)
    s = 0.5 * (s + s.T)
    a = np.asarray(area, dtype=float)
    for _ in range(200):
        scale = np.sqrt(a / np.maximum(s.sum(axis=1), 1e-12))
        s = s * scale[:, None] * scale[None, :]
        if np.max(np.abs(s.sum(axis=1) - a)) < 1e-10 * a.max():
            break
    return s


def exchange_star(area: ArrayLike, emissivity: ArrayLike) -> NDArray[np.float64]:
    """Exchange areas X [N, N] [m2] of a mean radiant star, for rooms without view factors.

    Each surface sees a common radiant node through A/(1/F + (1 - eps)/eps); the F close the
    enclosure.  The node is eliminated: X_ij = g_i g_j / sum g.

    Source: Carroll 1980, A comparison of methods for modelling radiant heat exchange, ASHRAE
    Transactions 86; EnergyPlus Engineering Reference ("CarrollMRT").
    """
    a, eps = np.asarray(area, dtype=float), np.asarray(emissivity, dtype=float)
    f = np.ones_like(a)
    for _ in range(500):
        fresh = 1.0 / np.maximum(1.0 - a * f / np.sum(a * f), 1e-3)
        if np.max(np.abs(fresh - f)) < 1e-12:
            break
        f = 0.5 * (f + fresh)
    g = a / (1.0 / f + (1.0 - eps) / np.maximum(eps, 1e-6))
    return g[:, None] * g[None, :] / g.sum()


def outside_factors(normal_z: float, sky_seen: float = 1.0) -> tuple[float, float, float]:
    """Shares (sky, air, ground) of the longwave exchange of an outside face.

    The sky half of a tilted face splits into sky and air by beta = sqrt((1 + cos tilt)/2)
    (Walton 1983; EnergyPlus).  What hides the sky counts with the ground, at the temperature of
    the air: F_sky = sky_seen (1 + cos tilt)/2 (EnergyPlus; ISO 52016-1 6.5.13.3 likewise takes the
    sky's share with obstacles off).

    Args: normal_z: z component of the exterior normal; sky_seen: share of the sky that is not
        hidden by obstructions.
    """
    half = 0.5 * (1.0 + normal_z)
    beta, seen = np.sqrt(half), half * sky_seen
    return float(seen * beta), float(seen * (1.0 - beta)), float(1.0 - seen)


SITE_HEIGHT = 10.0  # [m] of the wind that EN 16798-7 takes for open windows
_SHUT = WindowAiring(0.0, 0.0, share=0.0)


class AirPaths(NamedTuple):
    """Air flows into the zones Z."""

    leak: NDArray[np.float64]  # [Z, 8] a, b, c, d, s, m, w, n of `Leakage`
    wind: NDArray[np.float64]  # [Z] of the weather's, at the zone's height
    airing: NDArray[np.float64]  # [Z, 4] w, s, 1 where both are added, constant flow
    # [Z, 8] opened above, closed below [degC], least difference [K], greatest wind, least outdoor;
    # 1 where the zone may be heated while they are open, for limits of the operative temperature,
    # for hybrid ventilation
    opens: NDArray[np.float64]
    site: float  # wind on the site, of the weather's
    fan: NDArray[np.float64]  # [Z, 3] recovery, bypass above, least temperature
    bridges: NDArray[np.float64]  # [Z] [W/K]
    transfer: NDArray[np.int64]  # [Q, 2] zone that gives air, zone that takes it
    beside: NDArray[np.int64]  # [D] zone of each opening to a neighbour of known temperature
    buoyant: NDArray[np.float64]  # [D] its flow each way at |dT| = T [m3/s]


class Emitters(NamedTuple):
    """Heating and cooling of the zones Z."""

    radiant: NDArray[np.float64]  # [Z, 2] share of heating and cooling
    acts_at: NDArray[np.int64]  # [Z, 2] face that takes these shares, -1: all
    slab: NDArray[np.int64]  # [Z] face, -1 without
    power: NDArray[np.float64]  # [Z, 3] of the slab: heating, cooling [W], band [K]


def air_paths(zones: Sequence[Zone], transfers: Sequence[AirTransfer], terrain: str) -> AirPaths:
    """The air of the zones."""
    leaks, index = [zone.leakage for zone in zones], {zone.name: z for z, zone in enumerate(zones)}
    airings = [zone.airing or _SHUT for zone in zones]
    fans = [zone.supply or SupplyAir(0.0) for zone in zones]
    for one in transfers:
        for name in (one.source, one.target):
            require(name in index, "air between zones", f"no zone {name!r} is simulated")
    pairs = [(index[one.source], index[one.target]) for one in transfers]
    openings = [(z, one) for z, zone in enumerate(zones) for one in zone.beside]
    return AirPaths(
        leak=np.array([(*x.factors, x.stack, x.stack_exponent, x.wind, x.wind_exponent) for x in leaks]),
        wind=np.array([local_wind_factor(mean_height(zone), terrain) for zone in zones]),
        airing=np.array([(x.wind, x.stack, float(x.both), x.flow) for x in airings]),
        opens=np.array(
            [
                (
                    x.open_above_c,
                    x.close_below_c,
                    x.least_difference,
                    x.greatest_wind,
                    x.least_outdoor_c,
                    x.heating_while_open,
                    x.operative,
                    x.hybrid,
                )
                for x in airings
            ],
            dtype=np.float64,
        ),
        site=local_wind_factor(SITE_HEIGHT, terrain),
        fan=np.array([(x.recovery, x.bypass_above_c, x.least_c) for x in fans]),
        bridges=np.array([zone.bridges for zone in zones]),
        transfer=np.array(pairs, dtype=np.int64).reshape(-1, 2),
        beside=np.array([z for z, _ in openings], dtype=np.int64),
        buoyant=np.array([one.buoyant for _, one in openings], dtype=np.float64),
    )


def named_faces(zones: Sequence[Zone], names: Sequence[str]) -> list[int]:
    """A surface of each zone by its name among the faces of all zones; "": -1."""
    face, found = 0, []
    for zone, name in zip(zones, names, strict=True):
        found.append(face + zone.index_of(name) if name else -1)
        frames = sum(window.frame_area > 0 for window in zone.windows)
        face += len(zone.surfaces) + len(zone.windows) + frames
    return found


def emitters(zones: Sequence[Zone], slabs: Sequence[int], mode_count: NDArray[np.uint64]) -> Emitters:
    """The emitters of the zones; slabs: their faces; mode_count: [N] of the faces' own walls."""
    power = []
    for zone, face in zip(zones, slabs, strict=True):
        here = zone.slab
        if here is None:
            power.append((0.0, 0.0, 1.0))
            continue
        item = f"heated slab {here.surface}"
        require(mode_count[face] > 0, item, "its layers belong to the zone at its other side")
        power.append((here.heating_limit, here.cooling_limit, here.band))
    loads = [zone.loads for zone in zones]
    return Emitters(
        radiant=np.array([(x.heating_radiant, x.cooling_radiant) for x in loads]),
        acts_at=np.stack(
            [named_faces(zones, [getattr(x, key) for x in loads]) for key in ("heating_surface", "cooling_surface")],
            axis=1,
        ),
        slab=np.array(slabs, dtype=np.int64),
        power=np.array(power),
    )


def mean_height(zone: Zone) -> float:
    """Mean height [m] of what faces outdoors, weighted by area."""
    out = [s for s in zone.surfaces if s.outside == "outdoor"] + list(zone.windows)
    if not out:
        return 1.5
    return float(np.average([e.height for e in out], weights=[e.area for e in out]))


OUTDOOR, KNOWN, ADIABATIC, TWIN, PARTITION, PARTNER, WINDOW = range(7)
_CODES = {"outdoor": OUTDOOR, "ground": KNOWN, "known": KNOWN, "adiabatic": ADIABATIC}
_CODES |= {"twin": TWIN}
_RESISTANCE_KINDS = {"constant": 0, "linear U": 1, "surface": 2, "table": 3}


class Faces(NamedTuple):
    """One entry per inside face N; capacities are over the time step [W/(m2 K)]."""

    area: NDArray[np.float64]  # [N] [m2]
    zone: NDArray[np.int64]  # [N] index of the zone
    kind: NDArray[np.int64]  # [N] OUTDOOR ... WINDOW
    partner: NDArray[np.int64]  # [N] face at the other side, or -1
    window: NDArray[np.int64]  # [N] index of the window, or -1
    beyond: NDArray[np.int64]  # [N] column of `Drive.beyond`; 0: the ground
    normal: NDArray[np.float64]  # [N, 3] out of the room
    height: NDArray[np.float64]  # [N] glazing height for the inside film [m]
    emissivity_out: NDArray[np.float64]  # [N] of opaque ones; of windows: `Glass`
    hemisphere: NDArray[np.float64]  # [N, 3] shares of sky, air, ground
    roughness: NDArray[np.float64]  # [N] DOE-2 multiplier
    wind: NDArray[np.float64]  # [N, 2] a (local wind factor)^b, windward and leeward
    first_mode: NDArray[np.uint64]  # [N] of the wall's inner nodes
    mode_count: NDArray[np.uint64]  # [N]; 0: the wall's layers are not its own
    port: NDArray[np.float64]  # [N, 8] C_out, C_in, G_out, G_in, u_o, v_o, u_i, v_i


class Modes(NamedTuple):
    """Modes (axis M) of the inner nodes of all walls, for the fixed step; see `WallModes`."""

    decay: NDArray[np.float64]  # [M]
    at_out: NDArray[np.float64]  # [M]
    at_in: NDArray[np.float64]  # [M]
    from_out: NDArray[np.float64]  # [M]
    from_in: NDArray[np.float64]  # [M]
    heat: NDArray[np.float64]  # [M] [W/(m2 K)]
    even: NDArray[np.float64]  # [M]
    from_pipes: NDArray[np.float64]  # [M] amplitude of heat at a heated slab's pipes [K per W/m2]


class Glass(NamedTuple):
    """Windows (axis W) in their shading states (axis J)."""

    kind: NDArray[np.int64]  # [W, J] of the layer resistance
    coefficient: NDArray[np.float64]  # [W, J, C] of it, as `LayerResistance` has them
    extra: NDArray[np.float64]  # [W, J, 2] conductances [W/(m2 K)] to outdoor and room air
    # [W, J, 7] shades that are nodes: gap's width (0: none), height, tilt, impedance; longwave to
    # the pane; weight of the pane in what the shade's side sees; 1: outside
    shade: NDArray[np.float64]
    emissivity_out: NDArray[np.float64]  # [W, J]


class WindowMix(NamedTuple):
    """Inside emissivities of a zone's windows that occur together in the year."""

    emissivity: NDArray[np.float64]  # [V, W]
    of_hour: NDArray[np.int64]  # [H] which of the V


class Couplings(NamedTuple):
    """Pairs of unknowns that exchange heat, and their entries in the system's columns."""

    faces: NDArray[np.int64]  # [P, 2] that exchange longwave radiation
    at_exchange: NDArray[np.int64]  # [P]
    at_film: NDArray[np.int64]  # [N] face and its zone's air
    at_partner: NDArray[np.int64]  # [N] face and the one at the wall's other side, -1 without
    link: NDArray[np.float64]  # [Q] air exchanged between zones [m3/s]
    zones: NDArray[np.int64]  # [Q, 2] that exchange it
    at_link: NDArray[np.int64]  # [Q]


class Radiation(NamedTuple):
    """Longwave exchange and shares of radiant gains in each zone, for each of its window mixes.

    A zone's V mixes follow each other, each with all its pairs or faces.
    """

    first_pair: NDArray[np.int64]  # [Z + 1]
    first_face: NDArray[np.int64]  # [Z + 1]
    exchange: NDArray[np.float64]  # [sum of V P] exchange area [m2]
    at_exchange: NDArray[np.int64]  # [Z] start of the zone's
    share: NDArray[np.float64]  # [sum of V N] of the zone's radiant gains
    at_share: NDArray[np.int64]  # [Z]

    def shares(self, z: int) -> NDArray[np.float64]:
        """Shares [V, N] of zone z."""
        last = self.at_share[z + 1] if z + 1 < len(self.at_share) else None
        faces = self.first_face[z + 1] - self.first_face[z]
        return self.share[self.at_share[z] : last].reshape(-1, faces)


class Network(NamedTuple):
    """All that the compiled loop needs of the building."""

    faces: Faces
    modes: Modes
    glass: Glass
    radiation: Radiation
    couplings: Couplings
    system: Elimination
    air_capacity: NDArray[np.float64]  # [Z] volume times capacity factor [m3]
    paths: AirPaths
    emitters: Emitters


def frame_surface(window: WindowElement) -> OpaqueSurface:
    """The frame of a window as a massless opaque surface."""
    resistance = 1.0 / window.frame_u - 0.17
    return OpaqueSurface(
        name=f"{window.name} frame",
        area=window.frame_area,
        layers=(Layer(0.05, 0.05 / resistance, 0.0, 0.0),),
        normal=window.normal,
        absorptance_out=window.frame_absorptance,
        roughness="very smooth",
        height=window.height,
        sky_seen=window.sky_seen,
    )


def framed(zone: Zone) -> list[WindowElement]:
    """The windows of a zone that have a frame, in order."""
    return [window for window in zone.windows if window.frame_area > 0]


def window_mix(zone: Zone, state: NDArray[np.int64] | None, hours: int) -> WindowMix:
    """The emissivities that a zone's windows have together; state: [H, W] shading states."""
    windows = zone.windows
    if state is None:
        state = np.zeros((hours, len(windows)), dtype=np.int64)
    item = f"shading state of zone {zone.name}"
    require(state.shape == (hours, len(windows)), item, f"expected {(hours, len(windows))}")
    count = np.array([len(w.states) for w in windows])
    require(bool(np.all((state >= 0) & (state < count))), item, "a state that no window has")
    columns = [np.array([s.emissivity_in for s in w.states])[state[:, i]] for i, w in enumerate(windows)]
    table = np.array(columns).reshape(len(windows), hours).T
    if not len(windows) or bool(np.all(table == table[0])):
        return WindowMix(table[:1], np.zeros(hours, dtype=np.int64))
    mixes, of_hour = np.unique(table, axis=0, return_inverse=True)
    return WindowMix(mixes, of_hour.reshape(-1).astype(np.int64))


def network(
    zones: Sequence[Zone],
    mixes: Sequence[WindowMix],
    *,
    step_s: float,
    terrain: str,
    cell: float,
    link: NDArray[np.float64],
    transfers: Sequence[AirTransfer] = (),
) -> Network:
    """The network of coupled zones; link: [Z, Z] air exchange [m3/s], symmetric."""
    elements = [(z, e) for z, zone in enumerate(zones) for e in _elements(zone)]
    partners = _partners(zones, elements)
    slabs = named_faces(zones, [zone.slab.surface if zone.slab else "" for zone in zones])
    pipes = {face: zones[z].slab.depth for z, face in enumerate(slabs) if face >= 0}
    ports, modes = _walls([e for _, e in elements], partners, step_s, cell, pipes)
    faces = _faces(zones, elements, partners, ports, terrain)
    radiation, seen = _radiation(zones, mixes, faces)
    couplings, system = _couplings(faces, seen, link)
    capacity = np.array([zone.volume * zone.air_capacity_factor for zone in zones])
    paths = air_paths(zones, transfers, terrain)
    heated = emitters(zones, slabs, faces.mode_count)
    glass = _glass(elements)
    return Network(faces, modes, glass, radiation, couplings, system, capacity, paths, heated)


def _radiation(zones: Sequence[Zone], mixes: Sequence[WindowMix], faces: Faces) -> tuple[Radiation, NDArray[np.int64]]:
    """The exchange in every zone, and the pairs of faces [P, 2] between which there is any."""
    pairs, exchange, share = [np.empty((0, 2), dtype=np.int64)], [np.empty(0)], []
    first_face = np.searchsorted(faces.zone, np.arange(len(zones) + 1))
    for z, (zone, mix) in enumerate(zip(zones, mixes, strict=True)):
        here = slice(first_face[z], first_face[z + 1])
        area = faces.area[here]
        emissivity = [_emissivities(zone, windows) for windows in mix.emissivity]
        areas = np.stack([_zone_exchange(zone, area, eps) for eps in emissivity])
        i, j = np.nonzero(np.tril(areas.max(axis=0), -1) > 0.0)
        pairs.append(first_face[z] + np.stack([i, j], axis=1))
        exchange.append(areas[:, i, j].ravel())
        # all black to longwave: share by area
        weight = np.maximum(area * emissivity, 1e-12 * area)
        share.append((weight / weight.sum(axis=1, keepdims=True)).ravel())
    starts = [np.cumsum([0, *map(len, parts)]) for parts in (pairs[1:], exchange[1:], share)]
    radiation = Radiation(
        first_pair=starts[0],
        first_face=first_face,
        exchange=np.concatenate(exchange),
        at_exchange=starts[1][:-1],
        share=np.concatenate(share),
        at_share=starts[2][:-1],
    )
    return radiation, np.concatenate(pairs)


def _couplings(faces: Faces, seen: NDArray[np.int64], link: NDArray[np.float64]) -> tuple[Couplings, Elimination]:
    """What is coupled, and the system's columns; seen: [P, 2] faces that see each other."""
    n = faces.area.size
    films = np.stack([np.arange(n), n + faces.zone], axis=1)
    walls = np.flatnonzero(faces.partner >= 0)
    sides = np.stack([walls, faces.partner[walls]], axis=1)
    zones = np.argwhere(np.tril(link, -1) > 0.0)
    pairs = np.concatenate([seen, films, sides, n + zones])
    system = elimination(n + len(link), pairs.tolist())
    at_partner = np.full(n, -1, dtype=np.int64)
    at_partner[walls] = system.entries(sides)
    couplings = Couplings(
        faces=np.ascontiguousarray(seen),
        at_exchange=system.entries(seen),
        at_film=system.entries(films),
        at_partner=at_partner,
        link=link[zones[:, 0], zones[:, 1]],
        zones=zones,
        at_link=system.entries(n + zones),
    )
    return couplings, system


def _elements(zone: Zone) -> list[OpaqueSurface | WindowElement]:
    return [*zone.surfaces, *zone.windows, *(frame_surface(w) for w in framed(zone))]


def _emissivities(zone: Zone, windows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inside emissivities [N] of a zone's faces with those of its windows [W]."""
    frames = [frame_surface(w).emissivity_in for w in framed(zone)]
    return np.array([*(s.emissivity_in for s in zone.surfaces), *windows, *frames])


def _zone_exchange(zone: Zone, area: NDArray[np.float64], eps: NDArray[np.float64]) -> NDArray[np.float64]:
    if len(area) == 1:
        return np.zeros((1, 1))
    if zone.view_factors is None:
        return exchange_star(area, eps)
    require(
        np.shape(zone.view_factors) == (len(area), len(area)),
        f"zone {zone.name}: view factors",
        f"expected [{len(area)}, {len(area)}] (surfaces, windows, frames)",
    )
    return exchange_from_view_factors(area, eps, zone.view_factors)


def _partners(zones: Sequence[Zone], elements: list[tuple[int, OpaqueSurface | WindowElement]]) -> list[int]:
    names = {zone.name: z for z, zone in enumerate(zones)}
    where = {(z, e.name): i for i, (z, e) in enumerate(elements)}
    partners = [-1] * len(elements)
    for i, (z, e) in enumerate(elements):
        if not isinstance(e, OpaqueSurface) or e.outside in _CODES:
            continue
        item = f"surface {e.name}"
        require(e.outside in names, item, f"no zone {e.outside!r} is simulated with it")
        j = where.get((names[e.outside], e.partner), -1)
        require(j >= 0, item, f"zone {e.outside} has no surface {e.partner!r}")
        other = elements[j][1]
        mutual = isinstance(other, OpaqueSurface) and other.outside == zones[z].name and other.partner == e.name
        require(mutual, item, f"its partner {other.name} does not name it back")
        same = abs(other.area - e.area) <= 0.01 * e.area
        require(same, item, f"its partner has {other.area:g} m2 instead of {e.area:g} m2")
        partners[i] = j
    return partners


def _walls(
    elements: list[OpaqueSurface | WindowElement],
    partners: list[int],
    step_s: float,
    cell: float,
    pipes: dict[int, float],
) -> tuple[list[tuple[int, int, NDArray[np.float64]]], Modes]:
    """What the walls show to their faces, and their modes; pipes: depth of those in a face's."""
    ports, rows = [], []
    count = 0
    for i, e in enumerate(elements):
        if isinstance(e, WindowElement) or 0 <= partners[i] < i:
            ports.append((0, 0, np.zeros(8)))
            continue
        grid = wall_grid(e.layers, cell=cell)
        modes = grid.modes(step_s)
        at_pipes = np.zeros_like(modes.decay)
        if i in pipes:
            at_pipes = modes.from_nodes[grid.node_at(pipes[i], f"heated slab {e.name}")]
        ports.append((count, len(modes.decay), _two_port(grid, modes, step_s)))
        rows.append(
            (modes.decay, modes.at_out, modes.at_in, modes.from_out, modes.from_in, modes.heat, modes.even, at_pipes)
        )
        count += len(modes.decay)
    if not rows:
        return ports, Modes(*np.zeros((len(Modes._fields), 0)))
    return ports, Modes(*(np.concatenate(parts) for parts in zip(*rows, strict=True)))


def _two_port(grid: WallGrid, modes: WallModes, step_s: float) -> NDArray[np.float64]:
    g, capacity = grid.conductance, grid.capacity / step_s
    faces = (modes.from_out, modes.from_in)
    ends = [end @ face for end in (modes.at_out, modes.at_in) for face in faces]
    return np.array([capacity[0], capacity[-1], g[0], g[-1], *ends])


def _faces(
    zones: Sequence[Zone],
    elements: list[tuple[int, OpaqueSurface | WindowElement]],
    partners: list[int],
    ports: list[tuple[int, int, NDArray[np.float64]]],
    terrain: str,
) -> Faces:
    kinds, windows = [], []
    for i, (_, e) in enumerate(elements):
        windows.append(sum(w >= 0 for w in windows) if isinstance(e, WindowElement) else -1)
        if isinstance(e, WindowElement):
            kinds.append(WINDOW)
        elif partners[i] >= 0:
            kinds.append(PARTITION if partners[i] > i else PARTNER)
        else:
            kinds.append(_CODES[e.outside])
    solid = [e for _, e in elements]
    area = np.array([e.area for e in solid])
    zone = np.array([z for z, _ in elements])
    factor = [local_wind_factor(e.height, terrain) for e in solid]
    forms = (DOE2_WINDWARD, DOE2_LEEWARD)
    return Faces(
        area=area,
        zone=zone,
        kind=np.array(kinds),
        partner=np.array(partners),
        window=np.array(windows),
        beyond=_beyond([e for _, e in elements]),
        normal=np.array([e.normal for e in solid]),
        height=np.array([getattr(e, "glazing_height", 1.5) for e in solid]),
        emissivity_out=np.array([getattr(e, "emissivity_out", np.nan) for e in solid]),
        hemisphere=np.array([outside_factors(e.normal[2], e.sky_seen) for e in solid]),
        roughness=np.array([ROUGHNESS[getattr(e, "roughness", "very smooth")] for e in solid]),
        wind=np.array([[a * f**b for a, b in forms] for f in factor]),
        first_mode=np.array([p[0] for p in ports], dtype=np.uint64),
        mode_count=np.array([p[1] for p in ports], dtype=np.uint64),
        port=np.array([p[2] for p in ports]),
    )


def known_surfaces(elements: Sequence[OpaqueSurface | WindowElement]) -> list[OpaqueSurface]:
    """The surfaces whose outer face has a known temperature of its own, in order."""
    return [e for e in elements if isinstance(e, OpaqueSurface) and e.outside == "known"]


def _beyond(elements: Sequence[OpaqueSurface | WindowElement]) -> NDArray[np.int64]:
    column, found = 0, []
    for e in elements:
        known = isinstance(e, OpaqueSurface) and e.outside == "known"
        column += known
        found.append(column if known else 0)
    return np.array(found, dtype=np.int64)


def _glass(elements: list[tuple[int, OpaqueSurface | WindowElement]]) -> Glass:
    windows = [e for _, e in elements if isinstance(e, WindowElement)]
    states = max((len(w.states) for w in windows), default=1)
    kind = np.zeros((len(windows), states), dtype=np.int64)
    most = max((len(state.layer_resistance.coefficients) for w in windows for state in w.states), default=0)
    coefficient = np.zeros((len(windows), states, max(most, 6)))
    extra = np.zeros((len(windows), states, 2))
    shade = np.zeros((len(windows), states, 7))
    emissivity = np.zeros((len(windows), states))
    for w, window in enumerate(windows):
        for j in range(states):
            state = window.states[min(j, len(window.states) - 1)]
            r = state.layer_resistance
            kind[w, j] = _RESISTANCE_KINDS[r.kind]
            coefficient[w, j, : len(r.coefficients)] = r.coefficients
            extra[w, j] = state.extra_outer, state.extra_inner
            emissivity[w, j] = state.emissivity_out
            if (one := state.shade) is not None:
                shade[w, j] = (
                    one.width,
                    one.height,
                    one.tilt,
                    one.impedance,
                    one.exchange,
                    one.pane_weight,
                    one.exterior,
                )
    return Glass(kind, coefficient, extra, shade, emissivity)
