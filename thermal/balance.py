"""The transient heat balance of zones: arrays in, hourly temperatures and loads out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal import kernel, records
from thermal.climate import Climate, Solar, to_steps
from thermal.conduction import CELL
from thermal.errors import require
from thermal.network import Network, framed, network
from thermal.zone import Zone

AIR_GAS_CONSTANT = 287.055  # [J/(kg K)]


@dataclass(frozen=True, slots=True)
class BalanceOptions:
    """Choices of the model; the defaults are EnergyPlus' own."""

    inside_convection: str = "tarp"  # or "constant"
    outside_convection: str = "doe2"  # or "mowitt", "constant"
    outside_film: float = 20.0  # [W/(m2 K)] for "constant"
    terrain: str = "suburbs"  # or "country", "city"
    cell: float = CELL  # [m] largest finite difference cell
    iterations: int = 4  # of the coefficients per step, at most
    tolerance: float = 0.02  # [K] between iterates
    warm_tolerance: float = 0.01  # [K] between warm-up days
    warm_days: int = 200  # at most; 0: start at start_c
    start_c: float = 20.0

    def __post_init__(self) -> None:
        _choice("inside convection", self.inside_convection, _INSIDE)
        _choice("outside convection", self.outside_convection, _OUTSIDE)
        require(self.iterations >= 1, "iterations", "expected at least 1")
        require(self.cell > 0, "cell", "expected a positive width [m]")


_INSIDE = ("tarp", "constant")
_OUTSIDE = ("doe2", "mowitt", "constant")


@dataclass(frozen=True, slots=True)
class ZoneResult:
    """Hourly means of one zone's year (temperatures [degC], heat flows [W])."""

    name: str
    air_c: NDArray[np.float64]  # [H]
    surface_in_c: NDArray[np.float64]  # [H, F] opaque surfaces, then frames
    surface_out_c: NDArray[np.float64]  # [H, F]
    window_inner_c: NDArray[np.float64]  # [H, W] visible inside face
    window_outer_c: NDArray[np.float64]  # [H, W]
    mrt_c: NDArray[np.float64]  # [H] weighted by area and emissivity
    operative_c: NDArray[np.float64]  # [H] mean of air and mean radiant
    heating: NDArray[np.float64]  # [H] ideal load [W]
    cooling: NDArray[np.float64]  # [H] ideal load [W], positive
    heat_flow: dict[str, NDArray[np.float64]]  # [H] into the zone, and "storage" (its increase)
    residual: NDArray[np.float64]  # [H] sum of the flows less the storage [W]
    warm_up_days: int


def simulate(
    zone: Zone,
    climate: Climate,
    solar: Solar,
    *,
    step_s: float = 600.0,
    options: BalanceOptions | None = None,
) -> ZoneResult:
    """The year of one zone; see `simulate_zones`."""
    return simulate_zones([zone], climate, [solar], step_s=step_s, options=options)[0]


def simulate_zones(
    zones: Sequence[Zone],
    climate: Climate,
    solar: Sequence[Solar],
    *,
    step_s: float = 600.0,
    options: BalanceOptions | None = None,
    air_links: ArrayLike | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[ZoneResult, ...]:
    """The years of zones that exchange heat through their partitions and openings.

    Args:
        zones, solar: one entry per zone, windows and surfaces in the zone's order.
        step_s: a whole fraction of an hour [s]; backward Euler, so any length is stable.
        air_links: [Z, Z] air exchanged between zones through openings [m3/s], symmetric.
        progress: called with 0 and 1.

    Returns: one result per zone.

    Raises: `ThermalInputError` for data that do not fit together.
    """
    options = BalanceOptions() if options is None else options
    require(len(zones) == len(solar) > 0, "solar", f"expected one entry for each of {len(zones)}")
    steps = _steps_per_hour(step_s)
    if progress:
        progress(0.0)
    link = _links(air_links, len(zones))
    net = network(zones, step_s=step_s, terrain=options.terrain, cell=options.cell, link=link)
    drive, every = _drive(zones, climate.hours, solar, steps)
    method = records.Method(
        steps=steps,
        step_s=float(step_s),
        solar_every=every,
        inside=_INSIDE.index(options.inside_convection),
        outside=_OUTSIDE.index(options.outside_convection),
        outside_film=float(options.outside_film),
        iterations=options.iterations,
        tolerance=options.tolerance,
        warm_tolerance=options.warm_tolerance,
        warm_days=options.warm_days,
    )
    weather = _weather(climate, steps)
    state = _start(net, len(zones), options.start_c)
    work = _work(net, len(zones))
    days = kernel.warm_up(net, state, work, weather, drive, method)
    means = kernel.hourly_means(climate.hours, state)
    kernel.advance(net, state, work, weather, drive, method, climate.hours, means)
    terms = means.terms / steps
    if progress:
        progress(1.0)
    return tuple(
        _result(zone, net, z, means, terms[:, z], days=days, state=drive.state)
        for z, zone in enumerate(zones)
    )


def _choice(item: str, value: str, known: Sequence[str]) -> None:
    require(value in known, item, f"{value!r} is not of {', '.join(known)}")


def _steps_per_hour(step_s: float) -> int:
    steps = round(3600.0 / step_s) if step_s > 0 else 0
    fits = steps >= 1 and abs(steps * step_s - 3600.0) < 1e-6
    require(fits, "time step", f"{step_s} s is not a whole fraction of an hour")
    return steps


def _links(air_links: ArrayLike | None, zones: int) -> NDArray[np.float64]:
    if air_links is None:
        return np.zeros((zones, zones))
    link = np.asarray(air_links, dtype=float)
    require(link.shape == (zones, zones), "air links", f"expected [{zones}, {zones}]")
    fault = not np.allclose(link, link.T) or bool(np.any(link < 0)) or bool(np.any(np.diag(link)))
    require(not fault, "air links", "expected a symmetric matrix, not negative, zero diagonal")
    return np.ascontiguousarray(link)


def _weather(climate: Climate, steps: int) -> records.OutdoorConditions:
    outdoor = to_steps(climate.outdoor_c, steps)
    speed = to_steps(climate.wind_speed, steps)
    direction = np.radians(np.repeat(climate.wind_direction_deg, steps))
    pressure = to_steps(climate.pressure, steps)
    return records.OutdoorConditions(
        outdoor=outdoor,
        sky=to_steps(climate.sky_c, steps),
        ground=to_steps(climate.ground_c, steps),
        speed=speed,
        windward=speed**0.89,
        leeward=speed**0.617,
        origin=np.stack([np.sin(direction), np.cos(direction)], axis=1),
        density=pressure / (AIR_GAS_CONSTANT * (outdoor + 273.15)),
    )


def _drive(
    zones: Sequence[Zone], hours: int, solar: Sequence[Solar], steps: int
) -> tuple[records.Drive, int]:
    rows = len(solar[0].inside)
    fits = rows in (hours, hours * steps)
    require(fits, "solar", f"expected {hours} or {hours * steps} rows, got {rows}")
    inner, outer, states = [], [], []
    for zone, sun in zip(zones, solar, strict=True):
        zone_inner, zone_outer = _zone_sun(zone, sun, rows)
        inner.append(zone_inner)
        outer.append(zone_outer)
        states.append(_states(zone, sun, hours))
    drive = records.Drive(
        inner=np.ascontiguousarray(np.concatenate(inner, axis=1)),
        outer=np.ascontiguousarray(np.concatenate(outer, axis=1)),
        state=np.ascontiguousarray(np.concatenate(states, axis=1)),
        convective=_hourly([z.gains.convective for z in zones], hours, "convective gains"),
        radiant=_hourly([z.gains.radiant for z in zones], hours, "radiant gains"),
        airflow=_hourly(
            [np.asarray(z.infiltration_ach) * z.volume / 3600.0 for z in zones],
            hours,
            "infiltration",
        ),
        heating_c=_set_points([z.loads.heating_c for z in zones], hours, steps),
        cooling_c=_set_points([z.loads.cooling_c for z in zones], hours, steps),
        limit=np.array([[z.loads.heating_limit, z.loads.cooling_limit] for z in zones]),
    )
    return drive, steps if rows == hours else 1


def _zone_sun(zone: Zone, sun: Solar, rows: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sun at the inside [W] and the outside [W/m2] of the zone's faces [R, N]."""
    walls, windows = len(zone.surfaces), len(zone.windows)
    item = f"solar of zone {zone.name}"
    for name, width in (
        ("inside", walls),
        ("facade", walls),
        ("absorbed_outer", windows),
        ("absorbed_inner", windows),
    ):
        got = getattr(sun, name).shape
        require(got == (rows, width), item, f"{name}: expected {(rows, width)}, got {got}")
    area = np.array([w.area for w in zone.windows])
    glass_inside = sun.absorbed_inner
    if sun.window_inside is not None:
        glass_inside = glass_inside + np.asarray(sun.window_inside, dtype=float)
    absorptance = np.array([s.absorptance_out for s in zone.surfaces])
    outdoor = np.array([s.outside == "outdoor" for s in zone.surfaces])
    frames = framed(zone)
    at_frames = np.zeros((rows, len(frames)))
    if frames and sun.window_facade is not None:
        columns = [zone.windows.index(w) for w in frames]
        at_frames = np.asarray(sun.window_facade)[:, columns]
        at_frames = at_frames * np.array([w.frame_absorptance for w in frames])
    inner = [sun.inside, glass_inside * area, np.zeros((rows, len(frames)))]
    outer = [sun.facade * (absorptance * outdoor), sun.absorbed_outer, at_frames]
    return np.concatenate(inner, axis=1), np.concatenate(outer, axis=1)


def _states(zone: Zone, sun: Solar, hours: int) -> NDArray[np.int64]:
    windows = len(zone.windows)
    if sun.state is None:
        return np.zeros((hours, windows), dtype=np.int64)
    state = np.asarray(sun.state, dtype=np.int64)
    item = f"shading state of zone {zone.name}"
    require(state.shape == (hours, windows), item, f"expected {(hours, windows)}")
    count = np.array([len(w.states) for w in zone.windows])
    require(bool(np.all((state >= 0) & (state < count))), item, "a state that no window has")
    return state


def _hourly(values: Sequence[ArrayLike], hours: int, item: str) -> NDArray[np.float64]:
    columns = []
    for value in values:
        array = np.asarray(value, dtype=float)
        require(array.shape in ((), (hours,)), item, f"expected one value or {hours}")
        require(not bool(np.any(np.isnan(array))), item, "missing values")
        columns.append(np.broadcast_to(array, (hours,)))
    return np.ascontiguousarray(np.stack(columns, axis=1))


def _set_points(values: Sequence[ArrayLike], hours: int, steps: int) -> NDArray[np.float64]:
    """Set points of every step [T, Z], from one value, hourly values, or values of every step."""
    columns = []
    for value in values:
        array = np.asarray(value, dtype=float)
        if array.shape == (hours,):
            array = np.repeat(array, steps)
        columns.append(array)
    return _hourly(columns, hours * steps, "set point")


def _start(net: Network, zones: int, start_c: float) -> records.State:
    n, m = net.faces.area.size, net.nodes.capacity.size
    return records.State(
        inner=np.full(n, start_c),
        outer=np.full(n, start_c),
        node=np.full(m, start_c),
        air=np.full(zones, start_c),
        load=np.zeros(zones),
    )


def _work(net: Network, zones: int) -> records.Workspace:
    n, m = net.faces.area.size, net.nodes.capacity.size
    return records.Workspace(
        diagonal=np.zeros(n + zones),
        below=np.zeros(net.system.rows.size),
        right=np.zeros(n + zones),
        column=np.zeros(n + zones),
        unknown=np.zeros(n + zones),
        air=np.zeros((zones, 2)),
        plant=np.zeros(zones, dtype=np.int64),
        still=np.zeros(m),
        film=np.zeros(n),
        outdoor=np.zeros((n, 5)),
        old_inner=np.zeros(n),
        old_outer=np.zeros(n),
        old_air=np.zeros(zones),
    )


def _result(
    zone: Zone,
    net: Network,
    z: int,
    means: records.Means,
    terms: NDArray[np.float64],
    *,
    days: int,
    state: NDArray[np.int64],
) -> ZoneResult:
    inner, outer, air = means.inner, means.outer, means.air[:, z]
    mine = np.flatnonzero(net.faces.zone == z)
    glass = mine[net.faces.window[mine] >= 0]
    solid = mine[net.faces.window[mine] < 0]
    weight = net.faces.radiant_share[mine]
    room = 0.5 * (air + inner[:, mine] @ weight)
    seen = inner.copy()
    for column, window in zip(glass, zone.windows, strict=True):
        report = np.array([s.inner_report for s in window.states])
        share = report[state[:, net.faces.window[column]]]
        seen[:, column] = room + share * (inner[:, column] - room)
    mrt = seen[:, mine] @ weight
    flows = {name: terms[:, i] for i, name in enumerate(records.TERMS)}
    load = flows["ideal loads"]
    return ZoneResult(
        name=zone.name,
        air_c=air,
        surface_in_c=inner[:, solid],
        surface_out_c=outer[:, solid],
        window_inner_c=seen[:, glass],
        window_outer_c=outer[:, glass],
        mrt_c=mrt,
        operative_c=0.5 * (air + mrt),
        heating=np.maximum(load, 0.0),
        cooling=np.maximum(-load, 0.0),
        heat_flow=flows,
        residual=terms[:, :-1].sum(axis=1) - terms[:, -1],
        warm_up_days=days,
    )
