"""A room as a zone of the heat balance: surfaces, gains, air, set points, sun, view of the sky."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bim.defaults import FILMS
from bim.model import Building, Face, Space, Window
from bim.outer_faces import OuterFaces, outer_faces
from bim.to_thermal import ThermalRoom, coupled_rooms, door_links, surface_neighbours, thermal_room
from mitsuba_cfs.compiled import alone_in_compiling, must_compile
from mitsuba_cfs.errors import DataError, RoomError
from mitsuba_cfs.matrices.cache import MatrixCache, cached_or_computed
from mitsuba_cfs.notes import Note
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.stored_arrays import StoredArrays
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.estimate import cache_entry
from mitsuba_cfs.trace.kernels.scene import SceneCache
from mitsuba_cfs.trace.matrices.view_factors import sky_shares
from scenes.fenestration.thermal_system import ThermalSystem, thermal_system
from scenes.results import DaylightResult, ShadingYear
from scenes.room.ground import grounded
from scenes.room.inputs import RoomInputs
from scenes.room.operation import OperationHours
from scenes.room.operation_tables import GainsTable, NeighbourTable, OperationTables
from scenes.room.options import Occupancy
from scenes.room.shading import RuledYear
from scenes.room.shading_rules import JOINT_RULES
from scenes.room.solar import SeasonalOutdoors, SunBeyond, solar_gains, sun_by_hour
from scenes.room.windows import RoomWindows
from thermal.balance import BalanceOptions, ZoneResult, simulate_zones
from thermal.climate import Climate, Solar, sky_temperature, undisturbed_ground
from thermal.control import Condition, TemperatureControl
from thermal.errors import ThermalInputError
from thermal.kernel import advance
from thermal.ventilation import AirTransfer
from thermal.zone import Dimming, Gains, Layer, OpaqueSurface, Zone, dimmed_light, dimmed_share, split_gains


def enveloped(
    room: ThermalRoom, building: Building, space: Space, tables: OperationTables, weather: Weather
) -> ThermalRoom:
    """The room with ground, neighbours, bridges, frames and slab of its tables.

    Raises: `DataError` that names the room and the table.
    """
    envelope = tables.envelope
    faces = [
        [face for face, at in zip(space.faces, room.surface_of_face, strict=True) if at == number]
        for number in range(len(room.zone.surfaces))
    ]
    surfaces = [
        one
        if one.outside != "outdoor" or own[0].kind == "window frame"
        else replace(one, absorptance_out=envelope.outside_absorptance, roughness=envelope.outside_roughness)
        for one, own in zip(room.zone.surfaces, faces, strict=True)
    ]
    try:
        if envelope.frame_u is not None:
            layer = Layer(1.0, 1.0 / (1.0 / envelope.frame_u - FILMS), 0.0, 0.0)
            surfaces = [
                replace(surface, layers=(layer,)) if own[0].kind == "window frame" else surface
                for surface, own in zip(surfaces, faces, strict=True)
            ]
        hours = OperationHours(tables, weather)
        places = [f"envelope.neighbour.{number}" for number in range(len(envelope.neighbour))]
        behind = [_named(table, faces, building, at) for table, at in zip(envelope.neighbour, places, strict=True)]
        stated = {i for named in behind for i in named}
        surfaces = grounded(surfaces, envelope.ground, building, space, weather, stated)
        for table, place, named in zip(envelope.neighbour, places, behind, strict=True):
            beyond = hours.value(table, "temperature_c", place)
            for i in named:
                surfaces[i] = _next_to(surfaces[i], table, beyond)
    except ThermalInputError as error:
        raise DataError(error.message, file=building.file, element=space.label, field="envelope") from None
    edges = sum(glass_edge(window) for window in space.windows)
    bridges = sum(one.conductance for one in envelope.bridge) + envelope.frame_psi * edges
    if bridges < 0:
        raise DataError("the bridges' sum is negative", element=space.label, field="envelope")
    zone = replace(room.zone, surfaces=tuple(surfaces), bridges=bridges)
    return replace(room, zone=_heated(zone, faces, hours, space))


def glass_edge(window: Window) -> float:
    """Length of the edges of a window's glass [m]: triangle sides that only one triangle has."""
    sides: Counter[tuple[tuple[float, ...], ...]] = Counter()
    for triangle in np.round(window.triangles, 6):
        for start, end in zip(triangle, np.roll(triangle, -1, axis=0), strict=True):
            sides[tuple(sorted((tuple(start), tuple(end))))] += 1
    edges = [np.subtract(*pair) for pair, count in sides.items() if count == 1]
    return float(sum(np.linalg.norm(side) for side in edges))


def _named(table: NeighbourTable, faces: Sequence[Sequence[Face]], building: Building, place: str) -> list[int]:
    """The surfaces that a neighbour's table names."""
    guids = {building.room(name).space.guid for name in table.spaces}
    named = [
        number
        for number, own in enumerate(faces)
        if any(
            face.neighbour in guids or face.name in table.faces or face.kind in table.faces
            for face in own
            if face.kind not in ("window frame", "reveal")
        )
    ]
    known = {name for own in faces for face in own for name in (face.name, face.kind)}
    unknown = sorted(set(table.faces) - known)
    if unknown:
        there = ", ".join(sorted(known))
        raise DataError(f"no face {unknown[0]!r}; there are {there}", file=building.file, field=f"{place}.faces")
    return named


def _next_to(one: OpaqueSurface, table: NeighbourTable, beyond) -> OpaqueSurface:
    """The surface with the neighbour's film and temperature on its far side."""
    layers = one.layers
    if table.film > 0:
        layers = (Layer(1.0, 1.0 / table.film, 0.0, 0.0), *layers)
    return replace(one, layers=layers, outside="known", beyond_c=beyond)


def _heated(zone: Zone, faces: Sequence[Sequence[Face]], hours: OperationHours, space: Space) -> Zone:
    """The zone with the surfaces of its heated slab and of what radiates its loads."""
    loads, names = hours.tables.loads, {}

    def surface(named: Sequence[str], field: str) -> OpaqueSurface:
        """The largest surface of some faces."""
        known = [
            one
            for one, own in zip(zone.surfaces, faces, strict=True)
            if any(face.name in named or face.kind in named for face in own)
        ]
        if not known:
            message = f"has no face {' or '.join(named)}"
            raise DataError(message, element=space.label, field=f"loads.{field}")
        return max(known, key=lambda one: one.area)

    for key in ("heating", "cooling"):
        named = getattr(loads, f"{key}_faces")
        if named:
            names[f"{key}_surface"] = surface(named, f"{key}_faces").name
    zone = replace(zone, loads=replace(zone.loads, **names))
    if loads.slab is None:
        return zone
    slab = surface(loads.slab.faces, "slab.faces")
    return replace(zone, slab=hours.slab(slab.name, slab.area))


FloatArray = NDArray[np.float64]
SKY_SAMPLES = 4096  # rays from each surface and window to the sky
COMPILING = "compiling the heat balance, once: about half a minute"
RADIANT_SHARE = 0.5  # of the heat of people and equipment
PERSON_VAPOUR = 50.0 / 3.6e6  # of a person at a desk [kg/s]


@dataclass(frozen=True, slots=True)
class RoomServices:
    """Electricity, vapour and humidity control of a room."""

    equipment: FloatArray  # [H] power [W]
    vapour: FloatArray  # [H] [kg/s]
    fan_w_m3_s: float = 0.0  # power of the fan per air
    humidify_to: float = 0.0  # relative humidity, 0 to 1
    dehumidify_to: float = 1.0


@dataclass(frozen=True, slots=True)
class RoomZone:
    """A room as a zone of the heat balance, with its solar gains, control and services."""

    space: Space
    room: ThermalRoom  # its zone with the windows' states, gains, air and set points
    solar: Solar
    gains: dict[str, FloatArray]  # [H] sums of solar radiation by name [W]
    shading: ShadingYear
    lamps: FloatArray  # [H] power [W]
    occupied: NDArray[np.bool_]  # [H]
    daylight: FloatArray | None  # [H] mean on the work plane [lx]; None: no control reads it
    services: RoomServices
    fenestration: tuple[dict[str, float | str], ...] = ()  # `fenestration_table` of its windows
    states: tuple[str, ...] = ()  # names of the shading states
    operation: OperationTables | None = None
    sun_beyond: SunBeyond = field(default_factory=dict)  # of its windows, in rooms beyond glass
    alternatives: RoomAlternatives | None = None  # of shading by the room's temperature
    # [H] light of the lamps on the work plane [lx]; None where it is not known
    lamp_lx: FloatArray | None = None
    moved: tuple[MovedZone, ...] = ()  # with other slats, for sensitivities

    @property
    def control(self) -> TemperatureControl | None:
        """The alternatives from which the heat balance chooses."""
        if self.alternatives is None:
            return None
        rooms = self.alternatives.rooms
        suns = tuple(per_window(room.solar, room.zone) for room in rooms)
        gains = tuple(room.zone.gains for room in rooms)
        choices = self.alternatives
        return TemperatureControl(choices.conditions, suns, gains, choices.read)

    def in_alternatives(self, number: NDArray[np.int64]) -> RoomZone:
        """The room with that alternative of every hour [H] which the heat balance chose."""
        if self.alternatives is None:
            return self
        rooms, hours = self.alternatives.rooms, np.arange(len(number))

        def chosen(values: Sequence[ArrayLike]) -> NDArray[Any]:
            every = [np.asarray(value) for value in values]
            whole = [np.broadcast_to(v, number.shape) if v.ndim == 0 else v for v in every]
            result: NDArray[Any] = np.stack(whole)[number, hours]
            return result

        lit = [room.lamp_lx for room in rooms if room.lamp_lx is not None]
        planes = [room.daylight for room in rooms if room.daylight is not None]
        gains = Gains(
            chosen([room.zone.gains.convective for room in rooms]), chosen([room.zone.gains.radiant for room in rooms])
        )
        states = chosen([room.shading.states for room in rooms])
        reasons = (*rooms[0].shading.reasons, BY_ROOM)
        moved_by = _moved_by([room.shading for room in rooms], number, states)
        return replace(
            self,
            room=replace(self.room, zone=replace(self.zone, gains=gains)),
            solar=sun_by_hour([room.solar for room in rooms], number),
            gains={key: chosen([room.gains[key] for room in rooms]) for key in self.gains},
            shading=replace(self.shading, states=states, moved_by=moved_by, reasons=reasons),
            lamps=chosen([room.lamps for room in rooms]),
            lamp_lx=chosen(lit) if lit else None,
            daylight=chosen(planes) if planes else None,
            sun_beyond={place: chosen([room.sun_beyond[place] for room in rooms]) for place in self.sun_beyond},
            alternatives=None,
        )

    @property
    def zone(self) -> Zone:
        """The zone of the room."""
        return self.room.zone

    def moved_to(self, space: Space) -> RoomZone:
        """The zone of an equal room (`bim.to_thermal.same_surfaces`), among its own neighbours."""
        zone = replace(self.zone, name=space.label)
        room = replace(self.room, zone=zone, neighbours=surface_neighbours(space))
        moved = tuple(one.each(lambda end: end.moved_to(space)) for one in self.moved)
        return replace(self, space=space, room=room, moved=moved)

    def with_view_factors(self, among: FloatArray) -> RoomZone:
        """The room with view factors [N, N] between its surfaces, then its windows."""
        return replace(self, room=replace(self.room, zone=replace(self.zone, view_factors=among)))


@dataclass(frozen=True, slots=True)
class MovedZone:
    """A zone with an input of its slats a step lower and higher, in the same shading states."""

    key: str  # of `scenes.uncertain_inputs`
    value: float  # of the input
    step: float
    low: RoomZone
    high: RoomZone

    def each(self, change: Callable[[RoomZone], RoomZone]) -> MovedZone:
        """The same with both zones changed."""
        return replace(self, low=change(self.low), high=change(self.high))


BY_ROOM = "the room's temperature or load"  # the reason of a move that the balance decides


def _moved_by(years: Sequence[ShadingYear], number: NDArray[np.int64], states: NDArray[np.int64]) -> NDArray[np.int64]:
    """The number of the reason of each move [H, N] where the balance chose among years.

    Args: number: [H] of the chosen one; states: [H, N] as chosen.
    """
    every = [np.full_like(states, -1) if y.moved_by is None else y.moved_by for y in years]
    chosen: NDArray[np.int64] = np.stack(every)[number, np.arange(len(number))]
    same = np.concatenate([[True], number[1:] == number[:-1]])[:, None]
    chosen = np.where(same & (chosen >= 0), chosen, len(years[0].reasons))
    moved = np.concatenate([np.zeros_like(states[:1]), np.diff(states, axis=0)]) != 0
    return np.where(moved, chosen, -1)


@dataclass(frozen=True, slots=True)
class RoomAlternatives:
    """A room by the levels of conditions of its temperature: see `thermal.control`."""

    conditions: tuple[Condition, ...]
    read: tuple[Condition, ...]  # whose levels number the rooms
    rooms: tuple[RoomZone, ...]


def balances(
    rooms: Sequence[RoomZone],
    weather: Weather,
    step_s: float,
    *,
    air_links: FloatArray | None = None,
    transfers: Sequence[AirTransfer] = (),
    terrain: str = "suburbs",
    progress: Progress = silent,
    store: StoredArrays | None = None,
) -> Sequence[ZoneResult]:
    """The years of rooms that exchange heat through their partitions and doors.

    Args: store: of the rooms and the results on disk; None: in memory.
    """
    if must_compile(advance):
        progress(COMPILING, 0.0)
        with alone_in_compiling(advance):  # by a process that began earlier: `compiled_beside`
            pass
    passed = iter if store is None else store.each
    zones, suns = [r.zone for r in rooms], [per_window(r.solar, r.zone) for r in passed(rooms)]
    row_s, outdoors = 3600.0 * weather.step_h, climate(weather)
    return simulate_zones(
        zones,
        outdoors,
        suns,
        step_s=min(step_s, row_s),
        row_s=row_s,
        air_links=air_links,
        transfers=transfers,
        options=BalanceOptions(terrain=terrain),
        controls=[r.control for r in rooms],
        storage=None if store is None else store.stored,
    )


def coupled(rooms: Sequence[RoomZone], door_m3_s: float) -> tuple[list[RoomZone], FloatArray, tuple[str, ...]]:
    """The rooms with heat flow through the walls between them; see `coupled_rooms`.

    Args: door_m3_s: air each way through every open door between two rooms [m3/s].

    Returns: the rooms, the air between them [Z, Z] [m3/s], and a sentence for every wall without
        another face.
    """
    rooms = with_sun_of_others(rooms)
    spaces = [room.space for room in rooms]
    joined, notes = coupled_rooms(spaces, [room.room for room in rooms])
    zones = [replace(room, room=one) for room, one in zip(rooms, joined, strict=True)]
    return zones, door_links(spaces, door_m3_s), notes


def with_sun_of_others(rooms: Sequence[RoomZone]) -> list[RoomZone]:
    """The rooms with the sun that reaches them through the windows of others and inner glass.

    Where the room's temperature chooses the shading, other rooms get the sun of its first state.
    """
    return [_with_sun_of(room, rooms) if _has_inner_sun(room, rooms) else room for room in rooms]


def _has_inner_sun(room: RoomZone, rooms: Sequence[RoomZone]) -> bool:
    guid = room.space.guid
    return any(place == guid for one in rooms for place, _ in one.sun_beyond)


def _with_sun_of(room: RoomZone, rooms: Sequence[RoomZone]) -> RoomZone:
    """The room, and each of its alternatives, with what its faces absorb of the rooms' sun."""
    inside = room.solar.inside.copy()
    for one in rooms:
        source = room if one.space.guid == room.space.guid else one
        for (guid, face), absorbed in source.sun_beyond.items():
            if guid == room.space.guid:
                inside[:, room.room.surface_of_face[face]] += absorbed
    choices = room.alternatives
    if choices is not None:
        choices = replace(choices, rooms=tuple(_with_sun_of(one, rooms) for one in choices.rooms))
    return replace(room, solar=replace(room.solar, inside=inside), alternatives=choices)


def inner_sun_note(rooms: Sequence[RoomZone], step_h: float) -> tuple[str, ...]:
    """Sentences on the sun that enters by one room and is absorbed in another; none without."""
    passed = {
        room.space.label: sum(
            float(absorbed.sum()) * step_h / 1000.0
            for (guid, _), absorbed in room.sun_beyond.items()
            if guid != room.space.guid
        )
        for room in rooms
    }
    by_temperature = [r.space.label for r in rooms if r.alternatives and passed[r.space.label]]
    notes = []
    if any(passed.values()):
        note = Note(
            "Sun through glass and open doorways between rooms: {energy:.0f} kWh in the year enter "
            "by the windows of one room and are absorbed in another.",
            energy=sum(passed.values()),
        )
        notes.append(note)
    if by_temperature:
        note = Note(
            "{energy:.0f} kWh of it are those of the first shading state, whatever the shading "
            "does: the temperature of {rooms} moves it.",
            energy=sum(passed[label] for label in by_temperature),
            rooms=", ".join(by_temperature),
        )
        notes.append(note)
    return tuple(notes)


@dataclass(frozen=True, slots=True)
class ZoneSurfaces:
    """A room's surfaces and windows as a zone, before its sun and its operation."""

    room: ThermalRoom
    thermals: list[list[ThermalSystem]]  # [G][J] of the window groups in each state
    outer: OuterFaces


def zone_surfaces(room: RoomInputs) -> ZoneSurfaces:
    """The surfaces of a room, and its windows W with their fenestration in every state.

    Raises: `RoomError` where its faces do not form a zone.
    """
    space, thermals = room.space, thermal_systems(room.windows)
    systems = [thermals[g] for g in room.windows.group]
    gains = internal_gains(space, room.occupied, room.options.occupancy)
    first = systems[0][0].fenestration if systems else None
    try:
        bare = thermal_room(space, first, infiltration_ach=room.options.infiltration_ach, gains=gains)
    except ThermalInputError as error:
        raise RoomError(f"space {space.label}: {error}") from error
    thermal = replace(bare, zone=_with_states(bare.zone, systems))
    return ZoneSurfaces(thermal, thermals, outer_faces(room.building, space, thermal))


def thermal_systems(windows: RoomWindows) -> list[list[ThermalSystem]]:
    """Thermal data of the window groups in each state [G][J]."""
    return [[thermal_system(system) for system in states] for states in windows.systems]


def work_plane(room: RoomInputs, daylight: DaylightResult | None) -> FloatArray | None:
    """Mean illuminance of the work plane [H] [lx]; None where neither lamps nor control read it."""
    if daylight is None or not reads_work_plane(room):
        return None
    return daylight.illuminance.mean(axis=1, dtype=float)


def reads_work_plane(room: RoomInputs) -> bool:
    """Whether lamps are dimmed or the shading is moved by daylight in the room."""
    tables = room.operation
    if tables is None or not room.space.windows:
        return False
    dimmed = tables.gains.dims
    leaves = (leaf for rule in room.control.rules for leaf in rule.leaves)
    by_light = any(leaf.rule in (*JOINT_RULES, "manual") for leaf in leaves)
    return by_light or dimmed


def room_zone(
    room: RoomInputs,
    surfaces: ZoneSurfaces,
    outdoors: SeasonalOutdoors,
    state: NDArray[np.int64],
    daylight: DaylightResult | None = None,
    *,
    ruled: RuledYear | None = None,
    progress: Progress = silent,
) -> RoomZone:
    """The zone of a room in the shading states of every hour [H, G].

    Args:
        daylight: dims the lamps; needed where `reads_work_plane`.
        ruled: the rules' year, where the states are by rules: says what moved the windows.
    """
    progress("heat", 0.0)
    zone, lamps, lit = surfaces.room, np.zeros(room.skies.hours), None
    plane = work_plane(room, daylight)
    if room.operation is not None:
        at_lamps = None
        if daylight is not None and plane is not None:
            at_lamps = lamp_daylight(room.operation, daylight.points, daylight.illuminance)
        lit = lamp_lux(room.operation, room.weather, at_lamps)
        area = room.space.floor_area
        operated_zone, lamps = operated(zone.zone, room.operation, area, room.weather, at_lamps)
        zone = replace(zone, zone=operated_zone)
        services = services_of(room.operation, area, room.weather)
    else:
        services = plain_services(room.space, room.occupied, room.options.occupancy)
    zone = enveloped(zone, room.building, room.space, room.operation or OperationTables(), room.weather)
    shares = [len(season.months) / 12 for season in room.seasons]
    exteriors = [scene.scene.exterior for scene in outdoors.scenes]
    zone = with_sky_view(
        zone,
        surfaces.outer,
        list(zip(exteriors, shares, strict=True)),
        seed=room.options.sampling.seed,
        cache=room.cache,
        scenes=outdoors.first.scenes,
    )
    shading = room.shading(state)
    if ruled is not None:
        shading = room.shading(state, ruled.moved_by, ruled.reasons)
    solar, gains, beyond = solar_gains(
        room, outdoors, surfaces.room, surfaces.outer, state, thermals=surfaces.thermals, progress=progress
    )
    return RoomZone(
        room.space,
        zone,
        solar,
        gains,
        shading,
        lamps,
        room.occupied,
        plane,
        services,
        lamp_lx=lit,
        fenestration=tuple(fenestration_table(room.windows, surfaces.thermals)),
        states=tuple(system.name for system in max(room.windows.systems, key=len, default=())),
        operation=room.operation,
        sun_beyond=beyond,
    )


def with_sky_view(
    room: ThermalRoom,
    outer: OuterFaces,
    exteriors: Sequence[tuple[Surfaces, float]],
    *,
    seed: int = 0,
    cache: MatrixCache | None = None,
    scenes: SceneCache | None = None,
) -> ThermalRoom:
    """The room with the view factors to the sky of its outer faces and windows.

    Args:
        exteriors: surfaces outdoors, and the share of the year in which they are there.
        scenes: as of `sky_shares`.
    """
    points = np.concatenate([outer.points, outer.windows])
    normals = np.concatenate([outer.normals, outer.window_normals])
    if not len(points) or not any(len(exterior.triangles) for exterior, _ in exteriors):
        return room

    def sky_view(exterior: Surfaces) -> NDArray[np.float64]:
        inputs, by = (exterior.triangles, points, normals, SKY_SAMPLES, seed), sky_shares.__module__
        entry = cache_entry(cache, "sky shares", *inputs, by=by, stopping=None)

        def traced() -> NDArray[np.float64]:
            return sky_shares(exterior, points, normals, samples=SKY_SAMPLES, seed=seed, scenes=scenes)[:, None]

        return cached_or_computed(entry, traced)[:, 0]

    shares = sum(share * sky_view(exterior) for exterior, share in exteriors).tolist()
    zone, surfaces = room.zone, list(room.zone.surfaces)
    for number, share in zip(outer.surfaces, shares, strict=False):  # then those of the windows
        surfaces[number] = replace(surfaces[number], sky_seen=share)
    windows = tuple(
        replace(window, sky_seen=share)
        for window, share in zip(zone.windows, shares[len(outer.surfaces) :], strict=True)
    )
    return replace(room, zone=replace(zone, surfaces=tuple(surfaces), windows=windows))


def fenestration_table(
    windows: RoomWindows, thermals: Sequence[Sequence[ThermalSystem]]
) -> Iterator[dict[str, float | str]]:
    """Properties of the windows at normal incidence, by group and state; each system once."""
    seen = set()
    for states, heats in zip(windows.systems, thermals, strict=True):
        for system, heat in zip(states, heats, strict=True):
            if id(system) in seen:
                continue
            seen.add(id(system))
            visible = system.visible
            yield {
                "system": system.name,
                "source": system.source,
                "u_value": heat.fenestration.u_value,
                "g_value": float(heat.g_value[0]),
                "solar_transmittance": float(heat.transmittance[0]),
                "solar_reflectance": float(heat.reflectance[0]),
                "visible_transmittance": float(visible.direct_hemispherical(visible.transmission_front)[0]),
            }


def _with_states(zone: Zone, thermals: Sequence[Sequence[ThermalSystem]]) -> Zone:
    windows = tuple(
        replace(window, states=tuple(t.fenestration for t in states))
        for window, states in zip(zone.windows, thermals, strict=True)
    )
    return replace(zone, windows=windows)


def per_window(solar: Solar, zone: Zone) -> Solar:
    """The solar gains with the state of each window; one with fewer states is in its last."""
    most = np.array([len(window.states) - 1 for window in zone.windows], dtype=np.int64)
    return replace(solar, state=np.minimum(solar.state, most))


def internal_gains(space: Space, present: NDArray[np.bool_], occupancy: Occupancy) -> Gains:
    """Heat of people and equipment during the occupied hours [H]."""
    power = space.floor_area * (occupancy.equipment_w_m2 + occupancy.person_w / occupancy.floor_per_person)
    return Gains((1 - RADIANT_SHARE) * power * present, RADIANT_SHARE * power * present)


def plain_services(space: Space, present: NDArray[np.bool_], occupancy: Occupancy) -> RoomServices:
    """The services of a room without tables, as `internal_gains`."""
    persons = space.floor_area / occupancy.floor_per_person * present
    equipment = space.floor_area * occupancy.equipment_w_m2 * present
    return RoomServices(equipment, persons * PERSON_VAPOUR)


def services_of(tables: OperationTables, floor_area: float, weather: Weather) -> RoomServices:
    """The services of a room by its tables."""
    hours, loads = OperationHours(tables, weather), tables.loads
    low, high = loads.humidify_to, loads.dehumidify_to
    return RoomServices(
        hours.equipment(floor_area),
        hours.vapour(),
        tables.air.fan_w_m3_s,
        0.0 if low is None else low / 100.0,
        1.0 if high is None else high / 100.0,
    )


def lamp_lux(tables: OperationTables, weather: Weather, daylight: FloatArray | None) -> FloatArray | None:
    """Light of the lamps on the work plane [H] [lx]; None where nothing says how much it is."""
    gains = tables.gains
    if gains.lighting_full_lx is None:
        return None
    used = OperationHours(tables, weather).lamps(1.0) > 0
    return used * gains.lighting_full_lx * _of_lamps(gains, daylight, dimmed_light)


def lamp_daylight(tables: OperationTables, points: FloatArray, illuminance: NDArray[np.floating]) -> FloatArray:
    """Daylight at the sensors of the lamps' zones [Z, H] [lx]: the mean of the work plane, or at a place.

    Args: points: [S, 3] of the work plane [m]; illuminance: [H, S] [lx].
    """
    found = []
    for _, _, at in tables.gains.zones:
        if at is None:
            found.append(illuminance.mean(axis=1, dtype=float))
        else:
            nearest = np.linalg.norm(points[:, :2] - np.array(at), axis=1).argmin()
            found.append(illuminance[:, nearest].astype(float))
    return np.stack(found)


def _of_lamps(
    gains: GainsTable, daylight: FloatArray | None, share_of: Callable[[FloatArray, Dimming], FloatArray]
) -> FloatArray:
    """Share of all lamps [H] or [1], of the shares of the zones by their daylight [Z, H]."""
    total = np.zeros(1)
    for number, (share, tables, _) in enumerate(gains.zones):
        dimming = tables.dimming
        undimmed = daylight is None or dimming is None
        total = total + share * (np.ones(1) if undimmed else share_of(np.atleast_2d(daylight)[number], dimming))
    return total


def lamp_power(tables: OperationTables, floor_area: float, weather: Weather, daylight: FloatArray | None) -> FloatArray:
    """Power of the lamps [H] [W]; arguments as of `operated`."""
    gains = tables.gains
    used = OperationHours(tables, weather).lamps(floor_area) * _of_lamps(gains, daylight, dimmed_share)
    return used + gains.lighting_standby_w_m2 * floor_area


def operated(
    zone: Zone, tables: OperationTables, floor_area: float, weather: Weather, daylight: FloatArray | None
) -> tuple[Zone, FloatArray]:
    """The zone with the gains, air and set points of the tables, and the lamps' power [H] [W].

    Args: daylight: [Z, H] at the sensors of the lamps' zones [lx] (`lamp_daylight`), by which they are
        dimmed; None: they are not dimmed.
    """
    hours, gains = OperationHours(tables, weather), tables.gains
    lamps = lamp_power(tables, floor_area, weather, daylight)
    result = replace(
        zone,
        **hours.outdoor_air(),
        airing=hours.airing(zone.windows, zone.volume),
        gains=split_gains(hours.heat(floor_area), gains.radiant_share, (lamps, gains.radiant_share)),
        loads=hours.loads(),
    )
    return result, lamps


def climate(weather: Weather) -> Climate:
    """Outdoor conditions of the heat balance."""
    return Climate(
        outdoor_c=weather.dry_bulb_c,
        sky_c=sky_temperature(weather.horizontal_infrared),
        wind_speed=weather.wind_speed,
        wind_direction_deg=np.mod(weather.wind_direction_deg, 360.0),
        ground_c=undisturbed_ground(weather.dry_bulb_c),
        pressure=weather.pressure_pa,
    )
