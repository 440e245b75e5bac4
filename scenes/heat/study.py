"""`cfs thermal`: the year of every room of a study, from its file to tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.names import listed
from bim.report.issue import issue_note
from bim.sensors import view_point
from bim.to_thermal import ThermalRoom, shared_constructions
from mitsuba_cfs import variants
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import MatrixCache, cached_or_computed
from mitsuba_cfs.notes import Note
from mitsuba_cfs.progress import Progress, item, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.estimate import cache_entry
from mitsuba_cfs.trace.matrices.view_factors import person_view_factors, view_factors
from scenes.fenestration.systems import States
from scenes.fenestration.thermal_system import with_likely_layers
from scenes.head import Head
from scenes.heat.air_nodes import with_air_nodes
from scenes.heat.box import building_or_box
from scenes.heat.design_days import design_loads
from scenes.heat.files import HeatFiles, read_files
from scenes.heat.study_file import StudyFile
from scenes.inputs import Inputs, every_state, inputs_of, unused_rules
from scenes.results import ShadingYear
from scenes.room.ground import ground_note
from scenes.room.heat import felt_by, room_humidity, step_issues
from scenes.room.inputs import room_inputs, skies_for
from scenes.room.leaks import leak_issues
from scenes.room.light import visible_scene
from scenes.room.operation import (
    Operation,
    OperationHours,
    check_schedules,
    stated_note,
    unstated_note,
    weekday_note,
    with_stated_uses,
)
from scenes.room.operation_tables import PlantTable
from scenes.room.room import operated_zone
from scenes.room.shared_states import with_shared_states
from scenes.room.zone import RoomZone, balances, coupled, inner_sun_note
from thermal.balance import ZoneResult
from thermal.comfort import (
    ADAPTIVE_BANDS,
    comfort_by_outdoors,
    degree_hours,
    mean_radiant_temperature,
    operative_temperature,
    room_centre_mrt,
    summarise,
)
from thermal.moisture import Humidity
from thermal.performance import performance
from thermal.ventilation import AirTransfer
from thermal.zone import Zone

MOST_LOST = 0.05  # of the rays of a surface that may leave a room that is not quite closed


@dataclass(frozen=True, slots=True)
class RadiantRoom:
    """View factors of a room, N: the zone's surfaces, then its windows."""

    among: FloatArray  # [N, N] between the inside faces
    person: FloatArray  # [N] from somebody seated in the middle, facing the biggest window


def radiant_room(
    space: Space, room: ThermalRoom, *, samples: int = 16384, seed: int = 0, cache: MatrixCache | None = None
) -> RadiantRoom | None:
    """Traced view factors of a room, or None where its surfaces do not close it.

    Args: cache: of traced view factors.
    """
    among, person = _view_factors(enclosure(space, room), *view_point(space), samples, seed, cache)
    if min(among.sum(axis=1).min(), person.sum()) < 1.0 - MOST_LOST:
        return None
    return RadiantRoom(among / among.sum(axis=1, keepdims=True), person / person.sum())


def _view_factors(
    parts: Surfaces, place: FloatArray, facing: FloatArray, samples: int, seed: int, cache: MatrixCache | None
) -> tuple[FloatArray, FloatArray]:
    """View factors [N, N] among the parts and [N] from a person, traced or kept as one matrix."""
    inputs = (parts, place, facing, samples, seed)
    label, by = "view factors", view_factors.__module__
    entry = cache_entry(cache, label, *inputs, by=by, stopping=None)

    def traced() -> FloatArray:
        among = view_factors(parts, samples=samples, seed=seed)
        person = person_view_factors(parts, place, facing, samples=samples, seed=seed)
        return np.vstack([among, person])

    rows = cached_or_computed(entry, traced)
    return rows[:-1], rows[-1]


def enclosure(space: Space, room: ThermalRoom) -> Surfaces:
    """The triangles round a room's air, numbered by the zone's surfaces and then its windows."""
    parts = [*space.faces, *space.windows]
    windows = len(room.zone.surfaces) + np.arange(len(space.windows))
    number = np.concatenate([room.surface_of_face, windows])
    counts = [len(part.triangles) for part in parts]
    triangles = np.concatenate([part.triangles for part in parts])
    return Surfaces(triangles, np.zeros(len(triangles)), np.repeat(number, counts))


def felt(result: ZoneResult, radiant: RadiantRoom | None, rule: str, floor: int, air_speed: float) -> ZoneResult:
    """The result with the mean radiant and operative temperatures of a rule.

    Args:
        rule: "view factors" (ISO 7726), "room centre" (the dissertation's mean of all surfaces and
            the floor) or "area" (weighted by area and emissivity).
        floor: the surface that is the floor.
        air_speed: [m/s] sets the weight of the air.
    """
    faces = np.concatenate([result.surface_in_c, result.window_inner_c], axis=1)
    if rule == "room centre":
        mrt = room_centre_mrt(faces, result.surface_in_c[:, floor])
    elif rule == "view factors" and radiant is not None:
        mrt = mean_radiant_temperature(faces, radiant.person)
    else:
        mrt = result.mrt_c
    operative = operative_temperature(result.air_c, mrt, air_speed)
    return replace(result, mrt_c=mrt, operative_c=operative)


DEMAND = (
    "heating",
    "cooling",
    "supply air heating",
    "slab heating",
    "slab cooling",
    "humidification",
    "dehumidification",
)
MONTHS = pd.RangeIndex(1, 13, name="month")


def room_powers(
    room: RoomZone, result: ZoneResult, humidity: Humidity, weather: Weather, plant: PlantTable
) -> pd.DataFrame:
    """Demand, final and primary power of every hour [H] [W].

    "heat" and "cold" are what the plant gives: to the air and surfaces, by the slab, to the supply
    air, and for moisture.
    """
    outdoor = weather.dry_bulb_c
    demand = dict(
        zip(
            DEMAND,
            (
                result.heating,
                result.cooling,
                result.coil,
                np.maximum(result.slab, 0.0),
                np.maximum(-result.slab, 0.0),
                humidity.humidify,
                humidity.dehumidify,
            ),
            strict=True,
        )
    )
    heat = sum(demand[k] for k in ("heating", "supply air heating", "slab heating", "humidification"))
    cold = sum(demand[k] for k in ("cooling", "slab cooling", "dehumidification"))
    heating_final = heat / performance(plant.heating_cop, outdoor)
    electricity = {
        "electricity cooling": cold / performance(plant.cooling_cop, outdoor),
        "electricity fans": room.services.fan_w_m3_s * result.fan_air,
        "electricity lamps": room.lamps,
        "electricity equipment": room.services.equipment,
    }
    primary = plant.heating_factor * heating_final
    primary = primary + plant.electricity_factor * sum(electricity.values())
    columns = demand | {"heat": heat, "cold": cold, "final heating": heating_final}
    columns |= electricity | {"primary": primary}
    return pd.DataFrame(columns, index=weather.midpoints).rename_axis("time")


def energy_by_month(powers: pd.DataFrame, floor_area: float) -> pd.DataFrame:
    """Energy by month [kWh], and of the floor [kWh/m2]."""
    hours = _step_h(powers)
    table = powers.groupby(powers.index.month).sum().mul(hours / 1e3).reindex(MONTHS, fill_value=0)
    table.index.name = "month"
    per_area = (table / floor_area).add_suffix(" [kWh/m2]")
    return table.add_suffix(" [kWh]").join(per_area)


def energy_summary(powers: pd.DataFrame, floor_area: float) -> dict[str, float | str]:
    """Sums of the year, and the peaks with their hour."""
    hours = _step_h(powers)
    summary: dict[str, float | str] = {}
    for name in ("heat", "cold", "final heating", "primary"):
        key = name.replace(" ", "_")
        summary[f"{key}_kwh"] = float(powers[name].sum() * hours / 1e3)
        summary[f"{key}_kwh_m2"] = summary[f"{key}_kwh"] / floor_area
    electricity = [name for name in powers if name.startswith("electricity")]
    summary["electricity_kwh"] = float(powers[electricity].to_numpy().sum() * hours / 1e3)
    summary["electricity_kwh_m2"] = summary["electricity_kwh"] / floor_area
    for name in ("heat", "cold"):
        peak = powers[name].idxmax()
        summary[f"peak_{name}_w"] = float(powers[name].max())
        summary[f"peak_{name}_at"] = peak.strftime("%m-%d %H:%M") if powers[name].max() > 0 else ""
    return summary


def _step_h(powers: pd.DataFrame) -> float:
    """Length of the table's steps [h]."""
    return float((powers.index[1] - powers.index[0]) / pd.Timedelta(hours=1))


FloatArray = NDArray[np.float64]
PMV_CATEGORIES = {"I": 0.2, "II": 0.5, "III": 0.7, "IV": 1.0}  # EN 16798-1:2019, table B.1
WARM = 26.0  # [degC] operative, above which overheating is counted, ISO 17772, DIN 4108-2


def hourly_table(
    result: ZoneResult, shading: ShadingYear, daylight: FloatArray | None, weather: Weather, felt: dict[str, FloatArray]
) -> pd.DataFrame:
    """Temperatures, votes, loads, shading states and heat flows by hour; felt: `felt_by`."""
    table = {
        "outdoor_c": weather.dry_bulb_c,
        "air_c": result.air_c,
        "mrt_c": result.mrt_c,
        "operative_c": result.operative_c,
        **felt,
        "heating_w": result.heating,
        "cooling_w": result.cooling,
        **shading.columns,
    }
    if daylight is not None:
        table["daylight_lx"] = daylight
    for i in range(result.window_inner_c.shape[1]):
        table[f"window_{i + 1}_inside_c"] = result.window_inner_c[:, i]
        table[f"window_{i + 1}_outside_c"] = result.window_outer_c[:, i]
    for name, flow in result.heat_flow.items():
        table[f"{name.replace(' ', '_')}_w"] = flow
    return pd.DataFrame(table, index=weather.midpoints).rename_axis("time")


def _in_hours(counts: NDArray[np.int64], weather: Weather) -> NDArray[Any]:
    """Counts of time steps as hours; whole ones stay whole."""
    return counts if weather.step_h == 1.0 else counts * weather.step_h


def comfort_summary(
    result: ZoneResult, pmv: FloatArray, weather: Weather, occupied: NDArray[np.bool_]
) -> dict[str, float]:
    """Occupied hours by categories of EN 16798-1, and warmth above 26 degC.

    The adaptive categories I to III are `year_summary`'s bands; IV holds what is beyond them where
    the running mean lies in the standard's range. A category of the votes holds the hours of those
    before it.
    """
    operative_c, step_h = result.operative_c, weather.step_h
    band = comfort_by_outdoors(operative_c, weather.dry_bulb_c, "EN 16798-1 III", per_day=weather.per_day)
    beyond = band.applicable & ~band.comfortable
    steps = {"adaptive_IV_h": np.count_nonzero(beyond & occupied)}
    for name, limit in PMV_CATEGORIES.items():
        steps[f"pmv_{name}_h"] = np.count_nonzero((np.abs(pmv) < limit) & occupied)
    steps["above_26_h"] = np.count_nonzero((operative_c > WARM) & occupied)
    return {key: float(count) * step_h for key, count in steps.items()} | {
        "above_26_kh": degree_hours(operative_c[occupied], WARM, step_h=step_h),
        "above_26_kh_all_hours": degree_hours(operative_c, WARM, step_h=step_h),
        "pmv_mean": float(pmv[occupied].mean() if occupied.any() else pmv.mean()),
    }


def year_summary(
    result: ZoneResult, weather: Weather, occupied: NDArray[np.bool_]
) -> tuple[dict[str, float], pd.DataFrame]:
    """Energy, peaks and comfort of the occupied hours [H], and their discomfort by month."""
    month = weather.midpoints.month.to_numpy()
    summary = {
        "heating_kwh": result.heating.sum() * weather.step_h / 1e3,
        "cooling_kwh": result.cooling.sum() * weather.step_h / 1e3,
        "peak_heating_w": result.heating.max(),
        "peak_cooling_w": result.cooling.max(),
        "operative_min_c": result.operative_c.min(),
        "operative_max_c": result.operative_c.max(),
        "occupied_h": np.count_nonzero(occupied) * weather.step_h,
    }
    months = {}
    for band in ADAPTIVE_BANDS:
        comfort = comfort_by_outdoors(result.operative_c, weather.dry_bulb_c, band, per_day=weather.per_day)
        counted = summarise(comfort, occupied, month)
        summary[f"comfortable_h {band}"] = counted.comfortable * weather.step_h
        months[f"{band} [h]"] = _in_hours(counted.discomfort_by_month, weather)
        summary[f"degree_hours_warm {band}"] = counted.degree_hours_warm * weather.step_h
        summary[f"degree_hours_cold {band}"] = counted.degree_hours_cold * weather.step_h
    table = pd.DataFrame(months, index=pd.RangeIndex(1, 13, name="month"))
    return {key: float(value) for key, value in summary.items()}, table


@dataclass(frozen=True, slots=True)
class ThermalYear:
    """One room's year of heat and comfort."""

    name: str
    floor_area: float  # [m2]
    hours: pd.DataFrame  # temperatures, loads, state, heat flows by hour
    summary: dict[str, float | str]
    months: pd.DataFrame  # discomfort in the occupied hours, by band and month
    powers: pd.DataFrame  # heat, cold, electricity by hour [W]
    energy: pd.DataFrame  # by month [kWh] and [kWh/m2]
    design: pd.DataFrame | None = None  # loads of design days


@dataclass(frozen=True, slots=True)
class BalancedRooms:
    """The rooms of a study as they were balanced."""

    building: Building
    rooms: Sequence[RoomZone]
    weather: Weather
    in_windows: Mapping[str, States]  # by window GUID
    results: list[ZoneResult]
    humidity: list[Humidity]
    notes: tuple[str, ...]  # what had to be assumed
    design: pd.DataFrame | None
    air_links: NDArray[np.float64] | None = None  # [Z, Z] between the rooms, each way [m3/s]
    transfers: Sequence[AirTransfer] = ()


def run_study(
    study: StudyFile,
    progress: Progress,
    files: HeatFiles | None = None,
    *,
    balanced: Callable[[BalancedRooms], object] | None = None,
    on_head: Callable[[Head], None] = lambda head: None,
) -> tuple[list[ThermalYear], tuple[str, ...]]:
    """The rooms of a study, and what was assumed.

    Args:
        files: of `read_files`; read now by default.
        balanced: called with the rooms as they were balanced.
        on_head: called with what was left out and assumed, before anything is traced.
    """
    files = files or read_files(study)
    inputs = study_inputs(study, files, progress)
    head, weather, in_windows = inputs.head, inputs.weather, inputs.systems
    building = inputs.building
    if building.uses:
        study = with_stated_uses(study, building)
        check_schedules(study, weather, study.building)
    _check_states(study, in_windows)
    on_head(head)
    notes = dict.fromkeys(head.notes)
    variants.activate()
    cache = MatrixCache.of_user()
    skies = skies_for(weather, study.options.sampling, cache, **study.options.sky)

    def balance(systems: Mapping[str, States]) -> tuple[BalancedRooms, TracedRooms]:
        return balanced_rooms(study, replace(inputs, systems=systems), skies, cache, progress)

    found, traced = balance(in_windows)
    notes |= dict.fromkeys(traced.leaks)
    if balanced is not None:
        balanced(found)
    notes |= dict.fromkeys(found.notes)
    if study.likely_layers:
        likely = [
            balance(
                {
                    guid: tuple(with_likely_layers(system, number) for system in states)
                    for guid, states in in_windows.items()
                }
            )[0]
            for number in (0, 1)
        ]
        notes |= dict.fromkeys(_likely_notes(found, likely))
    years = []
    for room, result, humidity in zip(found.rooms, found.results, found.humidity, strict=True):
        radiant = traced.radiants.get(room.space.guid)  # none of an air node
        if room.zone.view_factors is None and study.trace.view_factors:
            notes[f"{result.name}: is not closed, its longwave goes through a mean star."] = None
        felt_result = felt_in(study, room.zone, result, radiant)
        year = _year(study, room, felt_result, humidity, weather)
        if found.design is not None:
            own = found.design[found.design["room"] == room.zone.name]
            year = replace(year, design=own.reset_index(drop=True))
        years.append(year)
    return years, tuple(notes)


def balanced_rooms(
    study: StudyFile, inputs: Inputs, skies: AnnualSky, cache: MatrixCache | None = None, progress: Progress = silent
) -> tuple[BalancedRooms, TracedRooms]:
    """The rooms of a study with their heat balanced, and as they were before.

    Args: inputs: of `study_inputs`; skies: of `skies_for`.
    """
    traced = _traced_rooms(study, inputs, inputs.systems, skies, cache, progress)
    rooms = _balanced(study, inputs.building, traced.rooms, inputs.weather, progress, in_windows=inputs.systems)
    return rooms, traced


class TracedRooms(NamedTuple):
    """The rooms of a study before their balance."""

    rooms: list[RoomZone]
    radiants: dict[str, RadiantRoom | None]  # by GUID of the room: its view factors, if traced
    leaks: list[str]  # notes


def _traced_rooms(
    study: StudyFile,
    inputs: Inputs,
    in_windows: Mapping[str, States],
    skies: AnnualSky,
    cache: MatrixCache | None,
    progress: Progress,
) -> TracedRooms:
    """The rooms with these systems."""
    traced, building = TracedRooms([], {}, []), inputs.building
    operation = with_shared_states(
        Operation(study.building or Path(building.name), study, ()),
        building,
        inputs.spaces,
        in_windows,
        inputs.weather,
        study.options,
        skies=skies,
        cache=cache,
        progress=progress,
    )
    for i, space in enumerate(inputs.spaces):
        steps = item(progress, "room", i + 1, len(inputs.spaces), space.label)
        room = room_inputs(
            inputs.building,
            space,
            in_windows,
            inputs.weather,
            study.options,
            operation=study,
            skies=skies,
            cache=cache,
            together=[one.guid for one in inputs.spaces] if study.couple else (),
            shared=None if operation is None else operation.shared,
        )
        if space.windows:
            scene, seed = visible_scene(room), study.options.sampling.seed
            leaks = leak_issues(space, scene, seed=seed, cache=cache)
            traced.leaks.extend(map(issue_note, leaks))
        zone, radiant, trace = operated_zone(room, progress=steps), None, study.trace
        if trace.view_factors:
            radiant = radiant_room(space, zone.room, samples=trace.patch_samples, seed=trace.seed, cache=cache)
        traced.rooms.append(zone if radiant is None else zone.with_view_factors(radiant.among))
        traced.radiants[space.guid] = radiant
        steps("heat", 1.0)
    return traced


def _likely_notes(assumed: BalancedRooms, likely: Sequence[BalancedRooms]) -> Iterator[Note]:
    """For each room with windows what other likely layers of these change [K], [kWh]."""
    for z, result in enumerate(assumed.results):
        others = [rooms.results[z] for rooms in likely]
        if not result.window_inner_c.size:
            continue
        apart = [other.operative_c - result.operative_c for other in others]
        glass = [other.window_inner_c - result.window_inner_c for other in others]
        kwh = assumed.weather.step_h / 1000.0
        heat, cold = ([getattr(one, key).sum() * kwh for one in (result, *others)] for key in ("heating", "cooling"))
        yield Note(
            "{room}: with other likely layers of its windows (RMS) the operative temperature "
            "differs by {operative:.2f} K, the inner face of the windows by {glass:.2f} K; heating "
            "{heat_low:.0f} to {heat_high:.0f} kWh, cooling {cold_low:.0f} to {cold_high:.0f} kWh.",
            room=result.name,
            operative=max(_rms(values) for values in apart),
            glass=max(_rms(values) for values in glass),
            heat_low=min(heat),
            heat_high=max(heat),
            cold_low=min(cold),
            cold_high=max(cold),
        )


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _check_states(study: StudyFile, in_windows: Mapping[str, States]) -> None:
    """Raise `DataError` where the control names states that no window of the model has."""
    most = max(map(len, in_windows.values()), default=0)
    for fault in (one.control_fault(most) for one in study.variants if most):
        if fault is None:
            continue
        field, message = fault
        raise DataError(message, file=study.building, field=field)


def _balanced(
    study: StudyFile,
    building: Building,
    rooms: Sequence[RoomZone],
    weather: Weather,
    progress: Progress,
    *,
    in_windows: Mapping[str, States],
) -> BalancedRooms:
    """The rooms' years: together where the study couples them, else one by one."""
    step_s = study.options.heat_step_s
    notes: tuple[str, ...] = ()
    progress("heat balance", 0.0)
    groups: list[tuple[Sequence[RoomZone], dict[str, Any]]] = [([room], {}) for room in rooms]
    if study.couple:
        rooms, links, notes = coupled(rooms, study.air.door_m3_s)
        notes += inner_sun_note(rooms, weather.step_h)
        nodes = _air_nodes(study, building, rooms)
        rooms, links, zone_of = with_air_nodes(rooms, links, nodes)
        transfers = _transfers(study, building, zone_of, weather)
        groups = [(rooms, {"air_links": links, "transfers": transfers})]
    results, moist, design, moved = [], [], [], []
    for number, (together, air) in enumerate(groups):
        place = {"terrain": study.terrain}
        years = balances(together, weather, step_s, progress=progress, **air, **place)
        results += years
        for issues in step_issues(together, years, weather, step_s, **air, **place):
            notes += tuple(map(issue_note, issues))
        moved += [room.in_alternatives(result.alternative) for room, result in zip(together, years, strict=True)]
        moist += room_humidity(together, years, weather, **air)
        if study.design is not None:
            cold = study.design.outdoor_c
            design.append(design_loads(together, weather, outdoor_c=cold, step_s=step_s, **air, **place))
        progress("heat balance", (number + 1) / len(groups))
    table = pd.concat(design, ignore_index=True) if design else None
    return BalancedRooms(
        building, moved, weather, in_windows, results, moist, notes, table, **(groups[0][1] if study.couple else {})
    )


def _air_nodes(study: StudyFile, building: Building, rooms: Sequence[RoomZone]) -> dict[str, str]:
    """Name of the air node of rooms, by GUID.

    Raises: `DataError` for a zone that is not there, and for a room in two.
    """
    node_of: dict[str, str] = {}
    for name in study.air_nodes:
        place = {"file": study.building, "field": "air_nodes"}
        guids = {space.guid for space in building.zone(name)}
        guids &= {room.space.guid for room in rooms}
        if not guids:
            zones = listed(name, [zone.name for zone in building.zones]) or "none"
            raise DataError(f"no zone {name!r} of the study's rooms; zones: {zones}", **place)
        twice = [room.space.label for room in rooms if room.space.guid in guids & set(node_of)]
        if twice:
            raise DataError(f"{twice[0]} is in two of the zones", **place)
        node_of |= dict.fromkeys(guids, name)
    return node_of


def _transfers(study: StudyFile, building: Building, names: Mapping[str, str], weather: Weather) -> list[AirTransfer]:
    """The air that flows one way between rooms.

    Args: names: of the zone of each room, by its GUID.

    Raises: `DataError` for a room that is not there, or not simulated.
    """
    hours, transfers = OperationHours(study, weather), []
    for number, table in enumerate(study.transfer):
        place = f"transfer.{number}"
        ends = []
        for key in ("source", "target"):
            guid = building.room(getattr(table, key)).space.guid
            if guid not in names:
                message = f"{getattr(table, key)!r} is not among the study's rooms"
                raise DataError(message, file=study.building, field=f"{place}.{key}")
            ends.append(names[guid])
        if ends[0] == ends[1]:
            message = "source and target are rooms of one air node"
            raise DataError(message, file=study.building, field=place)
        transfers.append(AirTransfer(*ends, hours.value(table, "m3_h", place) / 3600.0))
    return transfers


def felt_in(study: StudyFile, zone: Zone, result: ZoneResult, radiant: RadiantRoom | None) -> ZoneResult:
    """The result with the mean radiant and operative temperatures of the study's person."""
    person = study.comfort
    return felt(result, radiant, person.mean_radiant, _floor(zone), person.air_speed)


def _year(study: StudyFile, room: RoomZone, result: ZoneResult, humidity: Humidity, weather: Weather) -> ThermalYear:
    felt_by_person = felt_by(study.comfort, result, humidity)
    powers = room_powers(room, result, humidity, weather, study.plant)
    area = room.space.floor_area
    summary, months = year_summary(result, weather, room.occupied)
    return ThermalYear(
        result.name,
        area,
        hourly_table(result, room.shading, room.daylight, weather, felt_by_person),
        summary | comfort_summary(result, felt_by_person["pmv"], weather, room.occupied) | energy_summary(powers, area),
        months,
        powers,
        energy_by_month(powers, area),
    )


def _floor(zone: Zone) -> int:
    """The biggest of the surfaces that face up."""
    return int(np.argmax([-s.normal[2] * s.area for s in zone.surfaces]))


def study_inputs(study: StudyFile, files: HeatFiles | None = None, progress: Progress = silent) -> Inputs:
    """The inputs of a study: its rooms with all states of their windows."""
    files, options = files or read_files(study), study.inputs
    building = building_or_box(study.box, options, progress)
    rooms = "all" if study.couple or study.box is not None else "glazed"
    inputs = inputs_of(building, options, files.inputs, rooms=rooms, states=every_state, tables=study)
    notes = *stated_note(building, "the study"), *unstated_note(study, building, "the study")
    stated = () if inputs.operation is None else (inputs.operation.tables,)
    notes += (*ground_note(study, building), *weekday_note((study, *stated), inputs.weather))
    inputs = replace(inputs, notes=(*notes, *unused_rules(study, inputs.filled)))
    return replace(inputs, spaces=shared_constructions(inputs.spaces)) if study.couple else inputs
