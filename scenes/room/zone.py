"""A room as a zone of the heat balance: surfaces, gains, air, set points, sun, view of the sky."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bim.model import Space
from bim.outer_faces import OuterFaces
from bim.to_thermal import (
    ThermalRoom,
    coupled_rooms,
    door_links,
    surface_neighbours,
    thermal_room,
)
from mitsuba_cfs.compiled import must_compile
from mitsuba_cfs.errors import RoomError
from mitsuba_cfs.matrices.cache import MatrixCache, kept_or_found
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.stored_arrays import StoredArrays
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.estimate import cache_entry
from mitsuba_cfs.trace.matrices.view_factors import sky_shares
from scenes.fenestration.thermal_system import ThermalSystem
from scenes.room.operation_hours import OperationHours
from scenes.room.operation_tables import OperationTables
from scenes.room.options import Occupancy
from thermal.balance import BalanceOptions, ZoneResult, simulate_zones
from thermal.climate import Climate, Solar, sky_temperature, undisturbed_ground
from thermal.errors import ThermalInputError
from thermal.gains import dimmed_share, split_gains
from thermal.kernel import advance
from thermal.ventilation import AirTransfer
from thermal.zone import Gains, Zone

SAMPLES = 4096  # rays from each surface and window


def under_the_sky(
    room: ThermalRoom,
    outer: OuterFaces,
    exteriors: Sequence[tuple[Surfaces, float]],
    *,
    seed: int = 0,
    cache: MatrixCache | None = None,
) -> ThermalRoom:
    """The room, its outer faces and windows with the share of the sky that they see.

    Args:
        exteriors: what stands outdoors, and the share of the year in which it does.
        cache: where the shares are found and kept.
    """
    points = np.concatenate([outer.points, outer.windows])
    normals = np.concatenate([outer.normals, outer.window_normals])
    if not len(points) or not any(len(exterior.triangles) for exterior, _ in exteriors):
        return room

    def seen(exterior: Surfaces) -> NDArray[np.float64]:
        inputs, by = (exterior.triangles, points, normals, SAMPLES, seed), sky_shares.__module__
        entry = cache_entry(cache, "sky shares", *inputs, by=by, stopping=None)
        return kept_or_found(
            entry,
            lambda: sky_shares(exterior, points, normals, samples=SAMPLES, seed=seed)[:, None],
        )[:, 0]

    shares = sum(share * seen(exterior) for exterior, share in exteriors).tolist()
    zone, surfaces = room.zone, list(room.zone.surfaces)
    for number, share in zip(outer.surfaces, shares, strict=False):  # the windows' follow
        surfaces[number] = replace(surfaces[number], sky_seen=share)
    windows = tuple(
        replace(window, sky_seen=share)
        for window, share in zip(zone.windows, shares[len(outer.surfaces) :], strict=True)
    )
    return replace(room, zone=replace(zone, surfaces=tuple(surfaces), windows=windows))


FloatArray = NDArray[np.float64]
COMPILING = "compiling the heat balance, once: about 10 s"
RADIANT_SHARE = 0.5  # of the heat of people and equipment
PERSON_VAPOUR = 50.0 / 3.6e6  # of somebody at a desk [kg/s]


@dataclass(frozen=True, slots=True)
class RoomServices:
    """What a room uses and holds besides temperatures: electricity, vapour, humidity."""

    equipment: FloatArray  # [H] power [W]
    vapour: FloatArray  # [H] [kg/s]
    fan_w_m3_s: float = 0.0  # power of the fan per air
    humidify_to: float = 0.0  # relative humidity, 0 to 1
    dehumidify_to: float = 1.0


@dataclass(frozen=True, slots=True)
class RoomZone:
    """A room traced and controlled: all that its heat balance needs, and what it comes from."""

    space: Space
    room: ThermalRoom  # its zone with the windows' states, gains, air and set points
    solar: Solar
    gains: dict[str, FloatArray]  # [H] sums of the sun by name [W]
    state: NDArray[np.int64]  # [H] shading state
    lamps: FloatArray  # [H] power [W]
    occupied: NDArray[np.bool_]  # [H]
    daylight: FloatArray | None  # [H] mean on the work plane [lx]; None: nothing asked for it
    services: RoomServices

    @property
    def zone(self) -> Zone:
        """The zone of the room."""
        return self.room.zone

    def moved_to(self, space: Space) -> RoomZone:
        """The zone of an equal room (`bim.to_thermal.same_surfaces`), among its own neighbours."""
        zone = replace(self.zone, name=space.label)
        room = replace(self.room, zone=zone, neighbours=surface_neighbours(space))
        return replace(self, space=space, room=room)

    def with_view_factors(self, among: FloatArray) -> RoomZone:
        """The room with view factors [N, N] between its surfaces, then its windows."""
        return replace(self, room=replace(self.room, zone=replace(self.zone, view_factors=among)))


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

    Args: store: where they lie, and what they come from; None: in memory.
    """
    if must_compile(advance):
        progress(COMPILING, 0.0)
    passed = iter if store is None else store.each
    zones, suns = [r.zone for r in rooms], [per_window(r.solar, r.zone) for r in passed(rooms)]
    row_s = 3600.0 * weather.step_h
    return simulate_zones(
        zones, climate(weather), suns, step_s=min(step_s, row_s), row_s=row_s,
        air_links=air_links, transfers=transfers, options=BalanceOptions(terrain=terrain),
        kept=None if store is None else store.kept,
    )  # fmt: skip


def coupled(
    rooms: Sequence[RoomZone], door_m3_s: float
) -> tuple[list[RoomZone], FloatArray, tuple[str, ...]]:
    """The rooms with heat flowing through the walls between them; see `coupled_rooms`.

    Args: door_m3_s: air each way through every open door between two of them [m3/s].

    Returns: the rooms, the air between them [Z, Z], and a sentence for every wall that has no
        other face.
    """
    spaces = [room.space for room in rooms]
    joined, notes = coupled_rooms(spaces, [room.room for room in rooms])
    found = [replace(room, room=own) for room, own in zip(rooms, joined, strict=True)]
    return found, door_links(spaces, door_m3_s), notes


def zone_surfaces(
    space: Space, systems: Sequence[Sequence[ThermalSystem]], gains: Gains, air: float
) -> ThermalRoom:
    """A room's surfaces, and its windows W with their fenestration in every state, as a zone.

    Args: air: that leaks in [1/h].

    Raises: `RoomError` where its faces are no zone.
    """
    first = systems[0][0].fenestration if systems else None
    try:
        room = thermal_room(space, first, infiltration_ach=air, gains=gains)
    except ThermalInputError as error:
        raise RoomError(f"space {space.label}: {error}") from error
    return replace(room, zone=_with_states(room.zone, systems))


def _with_states(zone: Zone, thermals: Sequence[Sequence[ThermalSystem]]) -> Zone:
    windows = tuple(
        replace(window, states=tuple(t.fenestration for t in states))
        for window, states in zip(zone.windows, thermals, strict=True)
    )
    return replace(zone, windows=windows)


def per_window(solar: Solar, zone: Zone) -> Solar:
    """The sun with the state of each window: one with fewer states ends with its last."""
    most = np.array([len(window.states) - 1 for window in zone.windows], dtype=np.int64)
    return replace(solar, state=np.minimum(solar.state, most))


def internal_gains(space: Space, present: NDArray[np.bool_], occupancy: Occupancy) -> Gains:
    """Heat of people and equipment during the occupied hours [H]."""
    power = space.floor_area * (
        occupancy.equipment_w_m2 + occupancy.person_w / occupancy.floor_per_person
    )
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


def operated(
    zone: Zone,
    tables: OperationTables,
    floor_area: float,
    weather: Weather,
    daylight: FloatArray | None,
) -> tuple[Zone, FloatArray]:
    """The zone with the gains, air and set points of the tables, and the lamps' power [H] [W].

    Args: daylight: [H] mean illuminance of the work plane, which dims the lamps [lx]; None: nothing
        dims them.
    """
    hours, gains = OperationHours(tables, weather), tables.gains
    lamps = hours.lamps(floor_area)
    if daylight is not None and gains.lighting_dimmed:
        lamps = lamps * dimmed_share(daylight, gains.lighting_target_lx)
    found = replace(
        zone,
        **hours.outdoor_air(),
        airing=hours.airing(zone.windows),
        gains=split_gains(
            hours.heat(floor_area), gains.radiant_share, (lamps, gains.radiant_share)
        ),
        loads=hours.loads(),
    )
    return found, lamps


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
