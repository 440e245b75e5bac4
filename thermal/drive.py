"""Inputs of zones in every hour or step, checked and arranged for the compiled loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal import records
from thermal.climate import Climate, Solar, to_steps
from thermal.emitters import HeatedSlab
from thermal.errors import require
from thermal.network import WindowMix, framed, known_surfaces
from thermal.ventilation import AirTransfer, SupplyAir
from thermal.zone import Zone

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
    return [
        Stretch(first, min(first + most, hours), hours, steps) for first in range(0, hours, most)
    ]


def drive_of(
    zones: Sequence[Zone],
    climate: Climate,
    solar: Sequence[Solar],
    stretch: Stretch,
    mixes: Sequence[WindowMix],
    transfers: Sequence[AirTransfer] = (),
) -> tuple[records.Drive, int]:
    """The drive of zones in a stretch, and the steps for which one row of sun holds."""
    rows, hours, steps = len(solar[0].inside), climate.hours, stretch.steps
    fits = rows in (hours, hours * steps)
    require(fits, "solar", f"expected {hours} or {hours * steps} rows, got {rows}")
    suns = [_zone_sun(zone, sun, rows, stretch) for zone, sun in zip(zones, solar, strict=True)]
    states = [_states(zone, sun, stretch) for zone, sun in zip(zones, solar, strict=True)]
    fans = [zone.supply or SupplyAir(0.0) for zone in zones]
    slabs = [zone.slab or HeatedSlab("", 1.0) for zone in zones]
    beside = [one for zone in zones for one in zone.beside]
    drive = records.Drive(
        inner=np.concatenate([part for inner, _ in suns for part in inner], axis=1),
        outer=np.concatenate([part for _, outer in suns for part in outer], axis=1),
        air=np.stack([_air_sun(*pair, stretch) for pair in zip(zones, solar, strict=True)], axis=1),
        state=np.ascontiguousarray(np.concatenate(states, axis=1)),
        mix=np.stack([stretch.of(mix.of_hour) for mix in mixes], axis=1),
        convective=_hourly([z.gains.convective for z in zones], stretch, "convective gains"),
        radiant=_hourly([z.gains.radiant for z in zones], stretch, "radiant gains"),
        beyond=_beyond(zones, climate, stretch),
        leaks=_flows([z.infiltration_ach for z in zones], zones, stretch, "infiltration"),
        airflow=_flows([z.other_air_ach for z in zones], zones, stretch, "outdoor air"),
        supply=_flows([f.ach for f in fans], zones, stretch, "supply air"),
        supply_c=_set_points([_supplied(f) for f in fans], stretch, missing=True),
        airing=_hourly([z.airing.share if z.airing else 0.0 for z in zones], stretch, "windows"),
        transfer=_hourly([one.flow for one in transfers], stretch, "air between zones"),
        beside=np.stack(
            [
                _hourly([getattr(one, key) for one in beside], stretch, "air beside")
                for key in ("flow", "share")
            ],
            axis=2,
        ),
        beside_c=_set_points([one.beside_c for one in beside], stretch),
        heating_c=_set_points([z.loads.heating_c for z in zones], stretch),
        cooling_c=_set_points([z.loads.cooling_c for z in zones], stretch),
        limit=np.array([[z.loads.heating_limit, z.loads.cooling_limit] for z in zones]),
        slab_c=np.stack(
            [
                _set_points([getattr(slab, key) for slab in slabs], stretch)
                for key in ("heating_c", "cooling_c")
            ],
            axis=2,
        ),
    )
    return drive, steps if rows == hours else 1


def _zone_sun(
    zone: Zone, sun: Solar, rows: int, stretch: Stretch
) -> tuple[list[FloatArray], list[FloatArray]]:
    """Sun at the inside [W] and the outside [W/m2] of walls, windows and frames, each [R, ...].

    Args: rows: of the whole sun.
    """
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


def _air_sun(zone: Zone, sun: Solar, stretch: Stretch) -> FloatArray:
    """Sun [R] [W] that warms a zone's air behind interior shades."""
    values = np.zeros_like(sun.absorbed_inner) if sun.absorbed_air is None else sun.absorbed_air
    return stretch.of(np.asarray(values)) @ np.array([w.area for w in zone.windows])


def _states(zone: Zone, sun: Solar, stretch: Stretch) -> NDArray[np.int64]:
    if sun.state is None:
        return np.zeros((stretch.size, len(zone.windows)), dtype=np.int64)
    return stretch.of(sun.state)


def _flows(
    values: Sequence[ArrayLike], zones: Sequence[Zone], stretch: Stretch, item: str
) -> FloatArray:
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


def _table(
    arrays: Sequence[FloatArray], rows: int, item: str, *, missing: bool = False
) -> FloatArray:
    """The arrays, of so many rows or of none, as columns."""
    for array in arrays:
        require(missing or not bool(np.any(np.isnan(array))), item, "missing values")
    table = np.empty((rows, len(arrays)))
    table[:] = [array if array.ndim == 0 else 0.0 for array in arrays]  # most are
    for column, array in enumerate(arrays):
        if array.ndim:
            table[:, column] = array
    return table


def _set_points(
    values: Sequence[ArrayLike], stretch: Stretch, *, missing: bool = False
) -> NDArray[np.float64]:
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
