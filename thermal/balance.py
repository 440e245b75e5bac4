"""The transient heat balance of zones: arrays in, hourly temperatures and loads out.

`drive_of` checks the inputs of each hour or step and arranges them for the compiled loop.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal import kernel, records
from thermal.climate import Climate, Solar, to_steps
from thermal.conduction import CELL
from thermal.control import ROOM_QUANTITIES, TemperatureControl, WaitingRule, strides
from thermal.convection import TERRAIN
from thermal.emitters import HeatedSlab
from thermal.errors import require, require_range
from thermal.network import Network, WindowMix, framed, known_surfaces, network, window_mix
from thermal.ventilation import AirTransfer, SupplyAir
from thermal.zone import Gains, Zone

FloatArray = NDArray[np.float64]
T = TypeVar("T", bound=np.generic)


@dataclass(frozen=True, slots=True)
class Stretch:
    """Some of the rows H of a climate: what acts on zones is laid out for one after the other."""

    first: int
    last: int  # after which row it ends
    hours: int  # of the whole climate
    steps: int  # of a row

    @property
    def size(self) -> int:
        """Number of its rows."""
        return self.last - self.first

    def of(self, values: NDArray[T]) -> NDArray[T]:
        """Its part of values of all rows or of all steps; anything else as it is."""
        for size in (1, self.steps):
            if values.ndim and len(values) == self.hours * size:
                return values[self.first * size : self.last * size]
        return values


def stretches(hours: int, steps: int, most: int) -> list[Stretch]:
    """The stretches of no more than so many rows that follow each other."""
    return [Stretch(first, min(first + most, hours), hours, steps) for first in range(0, hours, most)]


def drive_of(
    zones: Sequence[Zone],
    climate: Climate,
    solar: Sequence[Solar],
    stretch: Stretch,
    mixes: Sequence[WindowMix],
    *,
    transfers: Sequence[AirTransfer] = (),
    controls: Sequence[TemperatureControl | None] = (),
) -> tuple[records.Drive, int]:
    """The drive of zones in a stretch, and the steps for which one row of sun holds.

    Args: mixes: of each zone, in each of its alternatives where it has `controls`.
    """
    controls = controls or [None] * len(zones)
    rows, hours, steps = len(solar[0].inside), climate.hours, stretch.steps
    fits = rows in (hours, hours * steps)
    require(fits, "solar", f"expected {hours} or {hours * steps} rows, got {rows}")
    of_hour = [m.of_hour.reshape(-1, hours) for m in mixes]
    count = max((len(c.suns) for c in controls if c), default=1)
    every = [
        _driven(
            zones,
            [c.suns[a % len(c.suns)] if c else sun for c, sun in zip(controls, solar, strict=True)],
            [c.gains[a % len(c.gains)] if c else zone.gains for c, zone in zip(controls, zones, strict=True)],
            stretch,
            np.stack([stretch.of(mix[a % len(mix)]) for mix in of_hour], axis=1),
        )
        for a in range(count)
    ]
    first = every[0]
    some = (
        {k: np.stack([one[k] for one in every]) for k in first}
        if count > 1
        else {k: values[None, :0] for k, values in first.items()}
    )
    fans = [zone.supply or SupplyAir(0.0) for zone in zones]
    slabs = [zone.slab or HeatedSlab("", 1.0) for zone in zones]
    beside = [one for zone in zones for one in zone.beside]
    drive = records.Drive(
        **first,
        alternatives=records.Alternatives(**_conditions(controls, stretch), **some),
        beyond=_beyond(zones, climate, stretch),
        leaks=_flows([z.infiltration_ach for z in zones], zones, stretch, "infiltration"),
        airflow=_flows([z.other_air_ach for z in zones], zones, stretch, "outdoor air"),
        supply=_flows([f.ach for f in fans], zones, stretch, "supply air"),
        supply_c=_set_points([_supplied(f) for f in fans], stretch, missing=True),
        airing=_hourly([z.airing.share if z.airing else 0.0 for z in zones], stretch, "windows"),
        transfer=_hourly([one.flow for one in transfers], stretch, "air between zones"),
        beside=np.stack(
            [_hourly([getattr(one, key) for one in beside], stretch, "air beside") for key in ("flow", "share")], axis=2
        ),
        beside_c=_set_points([one.beside_c for one in beside], stretch),
        heating_c=_set_points([z.loads.heating_c for z in zones], stretch),
        cooling_c=_set_points([z.loads.cooling_c for z in zones], stretch),
        limit=np.array([[z.loads.heating_limit, z.loads.cooling_limit] for z in zones]),
        slab_c=np.stack(
            [_set_points([getattr(slab, key) for slab in slabs], stretch) for key in ("heating_c", "cooling_c")], axis=2
        ),
    )
    return drive, steps if rows == hours else 1


def _driven(
    zones: Sequence[Zone], solar: Sequence[Solar], gains: Sequence[Gains], stretch: Stretch, mix: NDArray[np.int64]
) -> dict[str, Any]:
    """The arrays that `Drive` and `Alternatives` have in common."""
    rows, pairs = len(solar[0].inside), list(zip(zones, solar, strict=True))
    suns = [_zone_sun(zone, sun, rows, stretch) for zone, sun in pairs]
    return {
        "inner": np.concatenate([part for inner, _ in suns for part in inner], axis=1),
        "outer": np.concatenate([part for _, outer in suns for part in outer], axis=1),
        "middle": np.concatenate([_middle_sun(*pair, stretch) for pair in pairs], axis=1),
        "state": np.concatenate([_states(*pair, stretch) for pair in pairs], axis=1),
        "mix": mix,
        "convective": _hourly([g.convective for g in gains], stretch, "convective gains"),
        "radiant": _hourly([g.radiant for g in gains], stretch, "radiant gains"),
    }


def _shape(controls: Sequence[TemperatureControl | None]) -> tuple[int, int, int]:
    """Number of zones, of the conditions of one at most, and of the levels of one of these."""
    every = [c.conditions for c in controls if c is not None]
    levels = [one.levels for conditions in every for one in conditions]
    return len(controls), max(map(len, every), default=0), max(levels, default=0)


def _conditions(controls: Sequence[TemperatureControl | None], stretch: Stretch) -> dict[str, NDArray[Any]]:
    """The conditions of all zones, as `Alternatives` has them; those that a zone lacks stay 0."""
    zones, most, _ = _shape(controls)
    limits = np.full((zones, most, 3), np.inf)
    waits = np.zeros((zones, most, 5), dtype=np.int64)
    waits[..., 4] = -1
    reads = np.zeros((zones, most, most), dtype=np.int64)
    asked: list[NDArray[np.int64]] = []
    for z, control in enumerate(controls):
        conditions = control.conditions if control else ()
        steps = strides(control.chosen_by) if control else ()
        adds = dict(zip(control.chosen_by if control else (), steps, strict=True))
        for k, one in enumerate(conditions):
            waits[z, k, :4] = one.open_delay_rows, one.hold_rows, one.levels, adds.get(one, 0)
            if isinstance(one, WaitingRule):
                waits[z, k, 4] = len(asked)
                asked.append(stretch.of(one.asked.T).T)
                places = [conditions.index(other) for other in one.reads]
                reads[z, k, places] = strides(one.reads)
            else:
                limits[z, k] = one.above, one.below, ROOM_QUANTITIES.index(one.quantity)
    rows = max((len(one) for one in asked), default=0)
    table = np.zeros((len(asked), rows, stretch.size), dtype=np.int64)
    for number, levels in enumerate(asked):
        table[number, : len(levels)] = levels
    return {"limits": limits, "waits": waits, "reads": reads, "asked": table}


def _zone_sun(zone: Zone, sun: Solar, rows: int, stretch: Stretch) -> tuple[list[FloatArray], list[FloatArray]]:
    """Sun at the inside [W] and the outside [W/m2] of walls, windows and frames, each [R, ...].

    Args: rows: of the whole sun.
    """
    walls, windows = len(zone.surfaces), len(zone.windows)
    item = f"solar of zone {zone.name}"
    for name, width in (("inside", walls), ("facade", walls), ("absorbed_outer", windows), ("absorbed_inner", windows)):
        got = getattr(sun, name).shape
        require(got == (rows, width), item, f"{name}: expected {(rows, width)}, got {got}")
    area = np.array([w.area for w in zone.windows])
    glass_inside = stretch.of(sun.absorbed_inner)
    if sun.window_inside is not None:
        glass_inside = glass_inside + stretch.of(np.asarray(sun.window_inside, dtype=float))
    absorptance = np.array([s.absorptance_out for s in zone.surfaces])
    outdoor = np.array([s.outside == "outdoor" for s in zone.surfaces])
    frames = framed(zone)
    at_frames = np.zeros((len(glass_inside), len(frames)))
    if frames and sun.window_facade is not None:
        columns = [zone.windows.index(w) for w in frames]
        at_frames = stretch.of(np.asarray(sun.window_facade))[:, columns]
        at_frames = at_frames * np.array([w.frame_absorptance for w in frames])
    inner = [stretch.of(sun.inside), glass_inside * area, np.zeros_like(at_frames)]
    facade = stretch.of(sun.facade) * (absorptance * outdoor)
    outer = [facade, stretch.of(sun.absorbed_outer), at_frames]
    return inner, outer


def _middle_sun(zone: Zone, sun: Solar, stretch: Stretch) -> FloatArray:
    """Sun [R, N] [W/m2] that panes behind interior shades absorb."""
    glass = np.zeros_like(sun.absorbed_inner) if sun.absorbed_middle is None else sun.absorbed_middle
    part = stretch.of(np.asarray(glass))
    walls, frames = (np.zeros((len(part), n)) for n in (len(zone.surfaces), len(framed(zone))))
    return np.concatenate([walls, part, frames], axis=1)


def _states(zone: Zone, sun: Solar, stretch: Stretch) -> NDArray[np.int64]:
    if sun.state is None:
        return np.zeros((stretch.size, len(zone.windows)), dtype=np.int64)
    return stretch.of(sun.state)


def _flows(values: Sequence[ArrayLike], zones: Sequence[Zone], stretch: Stretch, item: str) -> FloatArray:
    """Flows [H, Z] [m3/s] from air changes."""
    volume = np.array([zone.volume for zone in zones])
    return np.ascontiguousarray(_hourly(values, stretch, item) * volume / 3600.0)


def _supplied(fan: SupplyAir) -> ArrayLike:
    return np.nan if fan.temperature_c is None else fan.temperature_c


def _beyond(zones: Sequence[Zone], climate: Climate, stretch: Stretch) -> FloatArray:
    """Temperatures [T, B] of the ground and of the known outer faces at the steps' ends."""
    steps, size = stretch.steps, stretch.size * stretch.steps
    columns = [stretch.of(to_steps(climate.ground_c, steps))]
    for surface in known_surfaces([e for zone in zones for e in zone.surfaces]):
        value = np.asarray(surface.beyond_c, dtype=float)
        fits = value.shape in ((), (climate.hours,), (climate.hours * steps,))
        item = f"temperature beyond surface {surface.name}"
        require(fits, item, f"expected one value, {climate.hours}, or one for every step")
        require(bool(np.all(np.isfinite(value))), item, "missing values")
        if value.shape == (climate.hours,) and steps > 1:
            value = to_steps(value, steps)
        columns.append(np.broadcast_to(stretch.of(value), (size,)))
    return np.ascontiguousarray(np.stack(columns, axis=1))


def _hourly(values: Sequence[ArrayLike], stretch: Stretch, item: str) -> NDArray[np.float64]:
    """A table [H, n] of numbers and of values of every hour."""
    arrays = [np.asarray(value, dtype=float) for value in values]
    for array in arrays:
        fits = array.shape in ((), (stretch.hours,))
        require(fits, item, f"expected one value or {stretch.hours}")
    return _table([stretch.of(array) for array in arrays], stretch.size, item)


def _table(arrays: Sequence[FloatArray], rows: int, item: str, *, missing: bool = False) -> FloatArray:
    """The arrays, of so many rows or of none, as columns."""
    for array in arrays:
        require(missing or not bool(np.any(np.isnan(array))), item, "missing values")
    table = np.empty((rows, len(arrays)))
    table[:] = [array if array.ndim == 0 else 0.0 for array in arrays]  # most are
    for column, array in enumerate(arrays):
        if array.ndim:
            table[:, column] = array
    return table


def _set_points(values: Sequence[ArrayLike], stretch: Stretch, *, missing: bool = False) -> NDArray[np.float64]:
    """Set points of every step [T, Z], from one value, hourly values, or values of every step."""
    columns, whole = [], stretch.hours * stretch.steps
    for value in values:
        array = np.asarray(value, dtype=float)
        fits = array.shape in ((), (stretch.hours,), (whole,))
        require(fits, "set point", f"expected one value or {whole}")
        part = stretch.of(array)
        hourly = array.shape == (stretch.hours,)
        columns.append(np.repeat(part, stretch.steps) if hourly else part)
    return _table(columns, stretch.size * stretch.steps, "set point", missing=missing)


HOUR = 3600.0  # [s]
AIR_GAS_CONSTANT = 287.055  # [J/(kg K)]
LONG_AGO = 1 << 40  # rows: before the first
STRETCH = 744  # rows, a month of hours: the part of all zones in memory at a time


@dataclass(frozen=True, slots=True)
class BalanceOptions:
    """Choices of the model; the defaults are EnergyPlus' own."""

    inside_convection: str = "tarp"  # or "constant", "stated"
    inside_films: tuple[float, float, float] | None = None  # [W/(m2 K)] for "stated": upright faces
    # (up to 45 degrees from it), others with heat that rises, with heat that sinks
    inside_radiation: float | None = None  # [W/(m2 K)] between black faces; None: sigma T^4
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
        require_range(self.cell, 1e-5, 1.0, "cell", "m")
        _choice("terrain", self.terrain, tuple(TERRAIN))
        stated = self.inside_convection == "stated"
        message = "belong to inside_convection = 'stated', and that to them"
        require(stated == (self.inside_films is not None), "inside_films", message)
        for film in (*(self.inside_films or ()), self.inside_radiation):
            if film is not None:
                require_range(film, 0.01, 1000.0, "inside_films, inside_radiation", "W/(m2 K)")
        require_range(self.outside_film, 0.1, 1000.0, "outside_film", "W/(m2 K)")
        require_range(self.start_c, -90.0, 90.0, "start_c", "C")
        for name in ("tolerance", "warm_tolerance"):
            require_range(getattr(self, name), 1e-12, 100.0, name, "K")
        require_range(self.warm_days, 0, 100_000, "warm_days")


_INSIDE = ("tarp", "constant", "stated")
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
    outdoor_air: NDArray[np.float64]  # [H] all of it [m3/s]
    fan_air: NDArray[np.float64]  # [H] of it by fans [m3/s]
    coil: NDArray[np.float64]  # [H] heat that brings supply air to its least temperature [W]
    slab: NDArray[np.float64]  # [H] power of the heated (or cooled: negative) slab [W]
    # [H] alternative of a zone's `TemperatureControl`, 0 without one
    alternative: NDArray[np.int64]
    warm_up_days: int


Storage = Callable[[ZoneResult], ZoneResult]


class ZoneYears(Sequence[ZoneResult]):
    """The results of zones, each put together from those of its stretches when it is looked at."""

    def __init__(self, stretches: Sequence[Sequence[ZoneResult]]) -> None:
        """From the results of all zones in each stretch of the year."""
        self._stretches = stretches

    def __len__(self) -> int:
        return len(self._stretches[0])

    @overload
    def __getitem__(self, z: int) -> ZoneResult: ...
    @overload
    def __getitem__(self, z: slice) -> list[ZoneResult]: ...
    def __getitem__(self, z: int | slice) -> ZoneResult | list[ZoneResult]:
        if isinstance(z, slice):
            return [self[one] for one in range(*z.indices(len(self)))]
        return _joined([zones[z] for zones in self._stretches])


def _joined(parts: Sequence[ZoneResult]) -> ZoneResult:
    """The result of hours that follow each other."""
    first = parts[0]
    if len(parts) == 1:
        return first
    found = {}
    for field in fields(ZoneResult):
        value = getattr(first, field.name)
        if isinstance(value, np.ndarray):
            value = np.concatenate([getattr(part, field.name) for part in parts])
        elif isinstance(value, dict):
            value = {key: np.concatenate([p.heat_flow[key] for p in parts]) for key in value}
        found[field.name] = value
    return ZoneResult(**found)


def simulate(
    zone: Zone,
    climate: Climate,
    solar: Solar,
    *,
    step_s: float = 600.0,
    row_s: float = HOUR,
    options: BalanceOptions | None = None,
    control: TemperatureControl | None = None,
) -> ZoneResult:
    """The year of one zone; see `simulate_zones`."""
    (result,) = simulate_zones(
        [zone], climate, [solar], step_s=step_s, row_s=row_s, options=options, controls=[control]
    )
    return result


def simulate_zones(
    zones: Sequence[Zone],
    climate: Climate,
    solar: Sequence[Solar],
    *,
    step_s: float = 600.0,
    row_s: float = HOUR,
    options: BalanceOptions | None = None,
    air_links: ArrayLike | None = None,
    transfers: Sequence[AirTransfer] = (),
    controls: Sequence[TemperatureControl | None] = (),
    progress: Callable[[float], None] | None = None,
    storage: Storage | None = None,
) -> Sequence[ZoneResult]:
    """Annual results of zones that exchange heat through partitions and openings.

    Args:
        zones, solar: one entry per zone, windows and surfaces in the zone's order.
        step_s: a whole fraction of a row [s]; backward Euler: any length is stable.
        row_s: length [s] of the climate's rows, which other docstrings call hours.
        air_links: [Z, Z] air exchanged between zones through openings [m3/s], symmetric.
        transfers: one-way air flows between zones.
        controls: of zones whose windows follow their temperature; `solar` and gains of these are
            not used.
        progress: called with shares of the year, from 0 to 1.
        storage: maps the result of a zone in each stretch to a stored copy, for example on disk;
        the
            year of a zone is then assembled at each access, otherwise before returning.

    Returns: one result per zone.

    Raises: `ThermalInputError` for data that do not fit together.
    """
    options = BalanceOptions() if options is None else options
    require(len(zones) == len(solar) > 0, "solar", f"expected one entry for each of {len(zones)}")
    steps, told = _steps_per_row(step_s, row_s), progress or (lambda share: None)
    told(0.0)
    link = _links(air_links, len(zones))
    controls = controls or [None] * len(zones)
    mixes = [
        _mixes(zone, control.suns if control else [sun], climate.hours)
        for zone, sun, control in zip(zones, solar, controls, strict=True)
    ]
    net = network(
        zones, mixes, step_s=step_s, terrain=options.terrain, cell=options.cell, link=link, transfers=transfers
    )
    method = _method(options, steps, step_s, float(climate.pressure.mean()))
    outdoors = _weather(climate, steps)
    state = _start(net, _shape(controls), options.start_c)
    work, years, days = _work(net, state), [], 0
    first_day = min(round(24 * HOUR / row_s), climate.hours)
    for stretch in stretches(climate.hours, steps, max(STRETCH, first_day)):
        drive, every = drive_of(zones, climate, solar, stretch, mixes, transfers=transfers, controls=controls)
        method = method._replace(solar_every=every)
        weather = records.OutdoorConditions(*map(stretch.of, outdoors))
        if not stretch.first:
            days = kernel.warm_up(net, state, work, weather, drive, method, rows=first_day)
        means = kernel.hourly_means(stretch.size, state)
        kernel.advance(net, state, work, weather, drive, method, stretch.size, means)
        np.divide(means.terms, steps, out=means.terms)
        results = (_result(zone, net, z, means, days=days, drive=drive) for z, zone in enumerate(zones))
        years.append([*map(storage or (lambda result: result), results)])
        told(stretch.last / climate.hours)
    if storage is not None:
        return ZoneYears(years)
    whole = [_joined([zones.pop() for zones in years]) for _ in zones]  # each goes as it is joined
    return tuple(reversed(whole))


class SteppedZone:
    """The balance of one zone row by row, its windows in states that are chosen as it goes."""

    def __init__(
        self,
        zone: Zone,
        climate: Climate,
        states: NDArray[np.int64],
        *,
        step_s: float = 600.0,
        row_s: float = HOUR,
        options: BalanceOptions | None = None,
    ) -> None:
        """A zone before its first row.

        Args:
            states: [M, W] the combinations of its windows' states.
            step_s, row_s, options: as of `simulate_zones`.
        """
        self._options = BalanceOptions() if options is None else options
        self._zone, self._climate = zone, climate
        self._steps, self._row_s = _steps_per_row(step_s, row_s), row_s
        self._mix, no_conditions = window_mix(zone, states, len(states)), (1, 0, 0)
        self._net = network(
            [zone],
            [self._mix],
            step_s=step_s,
            terrain=self._options.terrain,
            cell=self._options.cell,
            link=_links(None, 1),
        )
        self._method = _method(self._options, self._steps, step_s, float(climate.pressure.mean()))
        self._weather = _weather(climate, self._steps)
        self._state = _start(self._net, no_conditions, self._options.start_c)
        self._work = _work(self._net, self._state)
        self._row, self._number = 0, 0

    def warm_up(self, number: int, solar: Solar, gains: Gains) -> None:
        """Repeat the first day until it ends as it began.

        Args: as of `advance`.
        """
        rows = min(round(24 * HOUR / self._row_s), self._climate.hours)
        drive, weather = self._drive(number, solar, gains, rows)
        kernel.warm_up(self._net, self._state, self._work, weather, drive, self._method, rows=rows)

    def advance(self, number: int, solar: Solar, gains: Gains) -> None:
        """Balance the next row.

        Args: number: of the combination that holds; solar, gains: of the year in that combination.
        """
        drive, weather = self._drive(number, solar, gains, 1)
        means = kernel.hourly_means(1, self._state)
        kernel.advance(self._net, self._state, self._work, weather, drive, self._method, 1, means)
        self._row += 1

    @property
    def air_c(self) -> float:
        """Temperature of the air at the end of the last row [degC]."""
        return float(self._state.air[0])

    @property
    def operative_c(self) -> float:
        """Mean of that and the mean radiant temperature [degC]."""
        shares = self._net.radiation.shares(0)[self._mix.of_hour[self._number]]
        return 0.5 * (self.air_c + float(shares @ self._state.inner[: len(shares)]))

    @property
    def load_w(self) -> float:
        """Ideal load of the last step [W], heating positive."""
        return float(self._state.load[0])

    def _drive(
        self, number: int, solar: Solar, gains: Gains, rows: int
    ) -> tuple[records.Drive, records.OutdoorConditions]:
        """What acts on the zone in the next rows."""
        hours = self._climate.hours
        stretch = Stretch(self._row, self._row + rows, hours, self._steps)
        self._number = number
        mix = self._mix._replace(of_hour=np.full(hours, self._mix.of_hour[number]))
        zone = replace(self._zone, gains=gains)
        drive, every = drive_of([zone], self._climate, [solar], stretch, [mix])
        self._method = self._method._replace(solar_every=every)
        return drive, records.OutdoorConditions(*map(stretch.of, self._weather))


def _mixes(zone: Zone, suns: Sequence[Solar], hours: int) -> WindowMix:
    """The emissivities of a zone's windows in all its alternatives, one after the other."""
    if len(suns) == 1:
        return window_mix(zone, suns[0].state, hours)
    states = [np.zeros((hours, len(zone.windows)), np.int64) if s.state is None else s.state for s in suns]
    return window_mix(zone, np.concatenate(states), hours * len(suns))


def _method(options: BalanceOptions, steps: int, step_s: float, pressure: float) -> records.Method:
    return records.Method(
        steps=steps,
        step_s=float(step_s),
        solar_every=steps,
        inside=_INSIDE.index(options.inside_convection),
        inside_films=options.inside_films or (0.0, 0.0, 0.0),
        inside_radiation=options.inside_radiation or 0.0,
        outside=_OUTSIDE.index(options.outside_convection),
        outside_film=float(options.outside_film),
        pressure=pressure,
        iterations=options.iterations,
        tolerance=options.tolerance,
        warm_tolerance=options.warm_tolerance,
        warm_days=options.warm_days,
    )


def _choice(item: str, value: str, known: Sequence[str]) -> None:
    require(value in known, item, f"{value!r} is not of {', '.join(known)}")


def _steps_per_row(step_s: float, row_s: float) -> int:
    steps = round(row_s / step_s) if step_s > 0 else 0
    fits = steps >= 1 and abs(steps * step_s - row_s) < 1e-6
    whole = "an hour" if row_s == HOUR else f"{row_s:g} s"
    require(fits, "time step", f"{step_s} s is not a whole fraction of {whole}")
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
        speed=speed,
        windward=speed**0.89,
        leeward=speed**0.617,
        origin=np.stack([np.sin(direction), np.cos(direction)], axis=1),
        density=pressure / (AIR_GAS_CONSTANT * (outdoor + 273.15)),
    )


def _start(net: Network, conditions: tuple[int, int, int], start_c: float) -> records.State:
    n, zones = net.faces.area.size, conditions[0]
    return records.State(
        inner=np.full(n, start_c),
        outer=np.full(n, start_c),
        glass=np.full((n, 3), start_c),
        mode=net.modes.even * start_c,
        air=np.full(zones, start_c),
        load=np.zeros(zones),
        opened=np.zeros(zones, dtype=np.bool_),
        met=np.zeros(conditions[:2], dtype=np.int64),
        warm=np.zeros(conditions[:2], dtype=np.bool_),
        since=np.full(conditions, LONG_AGO),
    )


def _work(net: Network, state: records.State) -> records.Workspace:
    n, m, zones = state.inner.size, state.mode.size, state.air.size
    return records.Workspace(
        diagonal=np.zeros(n + zones),
        below=np.zeros(net.system.rows.size),
        right=np.zeros(n + zones),
        unknown=np.zeros(n + zones),
        air=np.zeros((zones, 2)),
        plant=np.zeros(zones, dtype=np.int64),
        windows=np.zeros(zones, dtype=np.int64),
        airing=np.zeros((zones, 3)),
        shut=np.zeros(zones, dtype=np.bool_),
        radiant=np.zeros(zones),
        radiant_seen=np.tile([0.0, 0.0, 0.3], (zones, 1)),
        flow=np.zeros(zones),
        fan_runs=np.ones(zones, dtype=np.bool_),
        aired=np.zeros(zones),
        supply=np.zeros((zones, 3)),
        bypass=np.zeros(zones, dtype=np.int64),
        bypass_c=np.zeros(zones),
        recovered=np.zeros((zones, 3)),
        bypassed=np.zeros((zones, 2)),
        carried=np.zeros(zones),
        passed=np.zeros(zones),
        slab=np.zeros(zones),
        source=np.zeros(n),
        still=np.zeros(m),
        ends=np.zeros((n, 2)),
        film=np.zeros(n),
        outdoor=np.zeros((n, 6)),
        nodes=np.zeros((n, 3, 3)),
        old_inner=state.inner.copy(),
        old_outer=state.outer.copy(),
        old_air=state.air.copy(),
    )


def _result(zone: Zone, net: Network, z: int, means: records.Means, *, days: int, drive: records.Drive) -> ZoneResult:
    air, terms = means.air[:, z], means.terms[:, z]
    mine = np.flatnonzero(net.faces.zone == z)
    inner, outer, windows = means.inner[:, mine], means.outer[:, mine], net.faces.window[mine]
    glass, solid = np.flatnonzero(windows >= 0), np.flatnonzero(windows < 0)
    weight = net.radiation.shares(z)[drive.mix[:, z]]
    room = 0.5 * (air + (inner * weight).sum(axis=1))
    seen = inner.copy()
    for column, window in zip(glass, zone.windows, strict=True):
        report = np.array([s.inner_report for s in window.states])
        share = report[drive.state[:, windows[column]]]
        seen[:, column] = room + share * (inner[:, column] - room)
    mrt = (seen * weight).sum(axis=1)
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
        outdoor_air=means.air_flow[:, z, 0],
        fan_air=means.air_flow[:, z, 1],
        coil=means.power[:, z, 0],
        slab=means.power[:, z, 1],
        alternative=means.alternative[:, z],
        warm_up_days=days,
    )
