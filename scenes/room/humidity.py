"""Humidity of the rooms' air: by the weather, the air flows of their balance and their vapour."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.weather import Weather
from scenes.room.operation_tables import ComfortTable
from scenes.room.zone import RoomZone
from thermal.balance import ZoneResult
from thermal.comfort import pmv_ppd, standard_effective_temperature
from thermal.moisture import Humidity, MoistZone, humidity_ratio, zone_humidity
from thermal.ventilation import AirTransfer

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
        for one in transfers:
            between[:, index[one.target], index[one.source]] += one.flow
    return zone_humidity(
        zones, outdoor_humidity(weather), weather.dry_bulb_c, weather.pressure_pa, between,
        row_s=3600.0 * weather.step_h,
    )  # fmt: skip


def felt_by(person: ComfortTable, result: ZoneResult, humidity: Humidity) -> dict[str, FloatArray]:
    """Relative humidity of the air [%], the person's PMV, PPD [%] and SET [degC], each [H].

    The person is in the humidity stated, else in the air's.
    """
    air = 100.0 * np.clip(humidity.relative, 0.0, 1.0)
    about = person.model_dump(exclude={"mean_radiant"})
    if person.humidity is None:
        about["humidity"] = air
    pmv, ppd = pmv_ppd(result.air_c, result.mrt_c, **about)
    felt = standard_effective_temperature(result.air_c, result.mrt_c, **about)
    return {"relative_humidity_percent": air, "pmv": pmv, "ppd": ppd, "set_c": felt}
