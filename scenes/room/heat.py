"""The heat balance of rooms, alone or coupled: temperatures, humidity, comfort, loads."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Space
from bim.report.issue import Issue
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.glare.annual import AnnualGlare
from mitsuba_cfs.notes import Note
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.stored_arrays import StoredArrays
from scenes.results import (
    Bands,
    DaylightResult,
    ExploredRoom,
    GlareMap,
    GlareResults,
    OperationResult,
    RoomYear,
    SpectralYear,
    ThermalResult,
)
from scenes.room.bands import LightSamples, deviations, draws, room_bands
from scenes.room.operation_tables import ComfortTable, OperationTables
from scenes.room.sensitivities import heat_sensitivities, rooms_at_ends
from scenes.room.zone import RoomZone, balances, coupled, inner_sun_note
from thermal.balance import ZoneResult
from thermal.comfort import comfort_by_outdoors, degree_hours, pmv_ppd, standard_effective_temperature, summarise
from thermal.moisture import Humidity, MoistZone, humidity_ratio, zone_humidity
from thermal.ventilation import AirTransfer
from thermal.zone import Zone

FloatArray = NDArray[np.float64]


def outdoor_humidity(weather: Weather) -> FloatArray:
    """Humidity ratio outdoors [H] [kg/kg].

    Raises: `DataError` for weather that says neither relative humidity nor dew point.
    """
    if weather.relative_humidity is not None:
        relative, at = weather.relative_humidity, weather.dry_bulb_c
    elif weather.dew_point_c is not None:
        relative, at = 1.0, weather.dew_point_c
    else:
        raise DataError("says neither relative humidity nor dew point", file=weather.file)
    return humidity_ratio(relative, at, weather.pressure_pa)


def room_humidity(
    rooms: Sequence[RoomZone],
    results: Iterable[ZoneResult],
    weather: Weather,
    *,
    air_links: FloatArray | None = None,
    transfers: Sequence[AirTransfer] = (),
) -> tuple[Humidity, ...]:
    """The humidity of rooms whose air was balanced together."""
    zones = [
        MoistZone(
            room.zone.volume,
            result.air_c,
            result.outdoor_air,
            room.services.vapour,
            room.services.humidify_to,
            room.services.dehumidify_to,
        )
        for room, result in zip(rooms, results, strict=True)
    ]
    count = len(zones)
    between = np.zeros((count, count)) if air_links is None else np.array(air_links, dtype=float)
    if transfers:
        between = np.repeat(between[None], len(weather.times), axis=0)
        index = {room.zone.name: z for z, room in enumerate(rooms)}
        for transfer in transfers:
            between[:, index[transfer.target], index[transfer.source]] += transfer.flow
    outdoors = outdoor_humidity(weather)
    return zone_humidity(
        zones, outdoors, weather.dry_bulb_c, weather.pressure_pa, between, row_s=3600.0 * weather.step_h
    )


def felt_by(person: ComfortTable, result: ZoneResult, humidity: Humidity) -> dict[str, FloatArray]:
    """Relative humidity of the air [%], PMV, PPD [%] and SET [degC] of a person, each [H].

    Comfort is computed with the humidity of the table, else with that of the air.
    """
    air = 100.0 * np.clip(humidity.relative, 0.0, 1.0)
    about = person.model_dump(exclude={"mean_radiant"})
    if person.humidity is None:
        about["humidity"] = air
    pmv, ppd = pmv_ppd(result.air_c, result.mrt_c, **about)
    felt = standard_effective_temperature(result.air_c, result.mrt_c, **about)
    return {"relative_humidity_percent": air, "pmv": pmv, "ppd": ppd, "set_c": felt}


BANDS = {"within_90": "ASHRAE 55 90 %", "within_80": "ASHRAE 55 80 %"}


def operated_year(room: RoomZone, result: ZoneResult, weather: Weather) -> OperationResult:
    """Shading states and power of heating, cooling and lamps by hour, with their sums."""
    hours = pd.DataFrame(
        {**room.shading.columns, "heating_w": result.heating, "cooling_w": result.cooling, "lighting_w": room.lamps},
        index=weather.midpoints,
    ).rename_axis("time")
    if room.lamp_lx is not None:
        hours["lamps_lx"] = room.lamp_lx
        if room.daylight is not None:
            hours["task_lx"] = room.lamp_lx + room.daylight
    summary = {
        "heating_kwh": result.heating.sum() * weather.step_h / 1e3,
        "cooling_kwh": result.cooling.sum() * weather.step_h / 1e3,
        "lighting_kwh": room.lamps.sum() * weather.step_h / 1e3,
        **_leni(room, weather),
        "peak_heating_w": result.heating.max(),
        "peak_cooling_w": result.cooling.max(),
    }
    summary = {key: float(value) for key, value in summary.items()}
    return OperationResult(room.states, hours, summary, room.shading)


def _leni(room: RoomZone, weather: Weather) -> dict[str, float]:
    """LENI of EN 15193-1 by a name; empty for weather that is no whole year."""
    hours = len(room.lamps) * weather.step_h
    if round(hours) not in (8760, 8784):
        return {}
    energy = room.lamps.sum() * weather.step_h / 1e3
    return {"leni_kwh_m2": float(energy / room.space.floor_area)}


def thermal_result(
    room: RoomZone, result: ZoneResult, weather: Weather, felt: dict[str, NDArray[np.float64]]
) -> ThermalResult:
    """Tables of a room's temperatures, solar gains and comfort.

    Args: felt: `felt_by`.
    """
    temperatures = _temperatures(result, room.zone, weather).assign(**felt)
    comfort, summary = _comfort(result, weather, room.occupied)
    return ThermalResult(
        temperatures,
        pd.DataFrame(room.gains, index=weather.midpoints).rename_axis("time"),
        comfort,
        summary,
        room.fenestration,
    )


def _temperatures(result: ZoneResult, zone: Zone, weather: Weather) -> pd.DataFrame:
    """Table of the year's temperatures [degC]."""
    columns = {
        "outdoor_c": weather.dry_bulb_c,
        "air_c": result.air_c,
        "mrt_c": result.mrt_c,
        "operative_c": result.operative_c,
    }
    for i, surface in enumerate(zone.surfaces):
        columns[f"{surface.name} ({surface.outside})_c"] = result.surface_in_c[:, i]
    for i, window in enumerate(zone.windows):
        columns[f"window {window.name} inside_c"] = result.window_inner_c[:, i]
        columns[f"window {window.name} outside_c"] = result.window_outer_c[:, i]
    return pd.DataFrame(columns, index=weather.midpoints).rename_axis("time")


def _comfort(
    result: ZoneResult, weather: Weather, occupied: NDArray[np.bool_]
) -> tuple[pd.DataFrame, dict[str, float]]:
    """Adaptive comfort (ASHRAE 55) of every hour, and its shares of the occupied ones."""
    table = {"occupied": occupied}
    summary: dict[str, float] = {}
    for name, band in BANDS.items():
        comfort = comfort_by_outdoors(result.operative_c, weather.dry_bulb_c, band, per_day=weather.per_day)
        table.setdefault("running_mean_c", comfort.outdoor_mean_c)
        table.setdefault("comfort_c", (comfort.low_c + comfort.high_c) / 2)
        table.setdefault("applicable", comfort.applicable)
        table[name] = comfort.comfortable
        counted = summarise(comfort, occupied, weather.midpoints.month.to_numpy())
        summary[name] = 100.0 * counted.comfortable / counted.hours
    summary["too_warm_hours"] = counted.too_warm * weather.step_h
    summary["too_cold_hours"] = counted.too_cold * weather.step_h
    summary["outside_the_model_hours"] = counted.not_applicable * weather.step_h
    frame = pd.DataFrame(table, index=weather.midpoints).rename_axis("time")
    return frame, summary


Heat = tuple[ThermalResult, OperationResult | None]
# called with rooms as they were balanced, and the air between them [Z, Z] [m3/s]
OnZones = Callable[[Sequence[RoomZone], NDArray[np.float64]], None]


@dataclass(frozen=True, slots=True)
class DaylitRoom:
    """A room with its year of light, and the zone from which its heat is computed."""

    space: Space
    daylight: DaylightResult
    glare: GlareResults
    zone: RoomZone
    seconds: dict[str, float]  # by stage
    annual_glare: pd.DataFrame | None = None
    spectral: SpectralYear | None = None
    sensitivities: pd.DataFrame | None = None  # of its light; None: not asked for
    samples: LightSamples | None = None  # of its light, for bands
    bands: Bands | None = None
    dgp: AnnualGlare | None = None
    dgp_sunny_hour_error: float = 0.0
    as_lobe: dict[str, float] = field(default_factory=dict)
    issues: tuple[Issue, ...] = ()
    explored: ExploredRoom | None = None
    glare_map: GlareMap | None = None
    template: str = ""
    borrowed: str = ""

    def with_sensitivities(self, of_heat: pd.DataFrame, seed: int) -> DaylitRoom:
        """The room with the derivatives of its heat besides, and the bands that follow from all.

        Args: seed: of the samples.
        """
        table, bands = pd.concat([self.sensitivities, of_heat], ignore_index=True), None
        if self.samples is not None:
            bands = room_bands(self.samples, table, draws(deviations(self.zone.operation), seed))
        return replace(self, sensitivities=table, samples=None, bands=bands)

    def with_heat(self, heat: Heat) -> RoomYear:
        """The room's year, with temperatures and operation."""
        thermal, operation = heat
        names = (one.name for one in fields(self) if one.name not in {"zone", "issues", "samples"})
        return RoomYear(
            heat=thermal,
            operation=operation,
            issues=self.issues + thermal.issues,
            **{name: getattr(self, name) for name in names},
        )


STEP_TOLERANCE = 0.02  # of a figure, when the time step is halved
# figures that are compared, and the difference of each that never matters
STEP_FIGURES = {"heating": 2.0, "cooling": 2.0, "heating_w": 20.0, "cooling_w": 20.0, "warm": 20.0}


def step_issues(
    rooms: Sequence[RoomZone], results: Iterable[ZoneResult], weather: Weather, step_s: float, **options: Any
) -> tuple[tuple[Issue, ...], ...]:
    """For each room an issue where half the time step changes its results by more than 2 %.

    Checked where a control depends on the room's temperatures: opened windows, the bypass of a heat
    recovery, a heated slab, shading.

    Args: results: of `balances` with the same options.
    """
    if not any(room.alternatives or _is_controlled(room.zone) for room in rooms):
        return ((),) * len(rooms)
    halved = balances(rooms, weather, min(step_s, 3600.0 * weather.step_h) / 2.0, **options)
    issues: list[tuple[Issue, ...]] = []
    for room, whole, half in zip(rooms, results, halved, strict=True):
        a, b = _step_figures(whole, weather), _step_figures(half, weather)
        apart = [
            abs(a[key] - b[key]) > max(STEP_TOLERANCE * max(a[key], b[key]), least)
            for key, least in STEP_FIGURES.items()
        ]
        values = a | {f"{key}_half": value for key, value in b.items()}
        issue = Issue("time-step-too-long", room.space.guid, values | {"room": room.zone.name})
        issues.append((issue,) if any(apart) else ())
    return tuple(issues)


def _is_controlled(zone: Zone) -> bool:
    """Whether a control of the zone depends on its temperatures, besides ideal heating."""
    fan = zone.supply
    bypass = fan is not None and fan.recovery > 0 and np.isfinite(fan.bypass_above_c)
    return zone.airing is not None or bypass or zone.slab is not None


def _step_figures(result: ZoneResult, weather: Weather) -> dict[str, float]:
    """The figures of `STEP_FIGURES`, those of a slab included."""
    heat = result.heating + np.maximum(result.slab, 0.0)
    cold = result.cooling + np.maximum(-result.slab, 0.0)
    kwh = weather.step_h / 1000.0
    figures = {
        "heating": heat.sum() * kwh,
        "cooling": cold.sum() * kwh,
        "heating_w": heat.max(),
        "cooling_w": cold.max(),
        "warm": degree_hours(result.operative_c, 26.0, step_h=weather.step_h),
    }
    return {key: float(value) for key, value in figures.items()}


def heat_of(
    rooms: Sequence[RoomZone],
    weather: Weather,
    step_s: float,
    *,
    terrain: str = "suburbs",
    air_links: NDArray[np.float64] | None = None,
    progress: Progress = silent,
    store: StoredArrays | None = None,
    on_zone: Callable[[RoomZone], None] | None = None,
) -> list[Heat]:
    """Temperatures, comfort and loads of rooms that are balanced together.

    Args:
        step_s: of the balance [s].
        air_links: air between the rooms [Z, Z] [m3/s]; None: none.
        store: of balances and results on disk; None: in memory.
        on_zone: called with each room as it was balanced.
    """
    results = balances(rooms, weather, step_s, air_links=air_links, terrain=terrain, progress=progress, store=store)
    passed = iter if store is None else store.each
    issues = step_issues(rooms, passed(results), weather, step_s, air_links=air_links, terrain=terrain, store=store)
    humidities = room_humidity(rooms, passed(results), weather, air_links=air_links)
    heats: list[Heat] = []
    for room, balance, humidity, found in zip(rooms, passed(results), humidities, issues, strict=True):
        moved = room.in_alternatives(balance.alternative)
        apart = (moved.shading.states != room.shading.states).any(axis=1)
        if apart.any():
            values = {"hours": int(apart.sum()) * weather.step_h, "room": room.zone.name}
            found += (Issue("shading-by-coupled-temperature", room.space.guid, values),)
        room = moved
        if on_zone is not None:
            on_zone(room)
        comfort = (room.operation or OperationTables()).comfort
        felt = felt_by(comfort, balance, humidity)
        thermal = replace(thermal_result(room, balance, weather, felt), issues=found)
        operation = None if room.operation is None else operated_year(room, balance, weather)
        heat = thermal, operation
        heats.append(heat if store is None else store.stored(heat))
    return heats


def heat_alone(room: RoomZone, weather: Weather, step_s: float, progress: Progress = silent) -> Heat:
    """The heat of a room whose neighbours have its own temperature."""
    terrain = (room.operation or OperationTables()).terrain
    (heat,) = heat_of([room], weather, step_s, terrain=terrain, progress=progress)
    progress("heat", 1.0)
    return heat


def coupled_years(
    rooms: Sequence[DaylitRoom],
    weather: Weather,
    step_s: float,
    tables: OperationTables,
    progress: Progress = silent,
    *,
    store: StoredArrays | None = None,
    seed: int = 0,
    on_zones: OnZones | None = None,
) -> tuple[list[RoomYear], tuple[str, ...]]:
    """The years of rooms that exchange heat through the parts between them, and notes on that.

    Args:
        tables: of all rooms; terrain of the site, air through open doors.
        store: of the rooms' heat on disk; None: in memory.
        seed: of the samples for bands.
        on_zones: called with the rooms as they were balanced.
    """
    progress("heat balance", 0.0)
    zones, links, _ = coupled([room.zone for room in rooms], tables.air.door_m3_s)
    balanced: list[RoomZone] = []
    on_zone = None if on_zones is None else balanced.append
    heats = heat_of(
        zones, weather, step_s, terrain=tables.terrain, air_links=links, progress=progress, store=store, on_zone=on_zone
    )
    if on_zones is not None:
        on_zones(balanced, links)
    progress("heat balance", 1.0)
    if any(room.sensitivities is not None for room in rooms):
        ends = (
            (coupled(low, tables.air.door_m3_s)[0], coupled(high, tables.air.door_m3_s)[0])
            for low, high in rooms_at_ends([room.zone for room in rooms])
        )
        derived = heat_sensitivities(zones, weather, step_s, terrain=tables.terrain, air_links=links, moved=list(ends))
        rooms = [room.with_sensitivities(of_heat, seed) for room, of_heat in zip(rooms, derived, strict=True)]
    years = [room.with_heat(heat) for room, heat in zip(rooms, heats, strict=True)]
    return years, (_coupling_note(zones), *inner_sun_note(zones, weather.step_h))


def _coupling_note(rooms: Sequence[RoomZone]) -> str:
    """Areas through which the rooms exchange heat, and areas without a computed neighbour."""
    through = among = other = 0.0
    guids = {room.space.guid for room in rooms}
    for room in rooms:
        for surface, guid in zip(room.zone.surfaces, room.room.neighbours, strict=True):
            if surface.partner:
                through += surface.area / 2.0
            elif guid in guids:
                among += surface.area
            elif guid is not None and surface.outside == "twin":
                other += surface.area
    values = {"count": len(rooms), "area": through}
    if max(among, other) < 0.05:
        return Note(
            "The heat of the {count} rooms is balanced together: it flows through {area:.1f} m2 of "
            "walls, floors and doors between them.",
            **values,
        )
    return Note(
        "The heat of the {count} rooms is balanced together: it flows through {area:.1f} m2 of "
        "walls, floors and doors between them. Surfaces without a computed neighbour ({among:.1f} "
        "m2 between these rooms, {other:.1f} m2 towards other rooms) are taken as adjacent to a "
        "room of the same temperature.",
        among=among,
        other=other,
        **values,
    )
