"""Luminaires of a room's tables by their photometry: power, and light on the work plane."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bim.electric_light import Luminaire, lamp_light
from bim.model import Building, Space
from bim.sensors import in_room, sensor_grid
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.metrics.photometry import Photometry, read_photometry
from scenes.room.operation_tables import GainsTable, LuminaireTable, OperationTables
from scenes.room.options import SensorGrid


def with_luminaires(
    tables: OperationTables, building: Building, space: Space, grid: SensorGrid, *, seed: int = 0
) -> OperationTables:
    """The tables with the lamps' power and light in place of the luminaires of the room.

    Power is that of the files, light the mean of the work plane's sensors by all luminaires, or with
    zones that at the sensor of each.

    Raises: `DataError` for a luminaire outside the room, without power, or a file that is none.
    """
    if tables.gains.luminaires:
        tables = tables.model_copy(update={"gains": _of_model(tables.gains, building, space)})
    stated = tables.gains.luminaire
    if not stated:
        return tables
    known: dict[object, Photometry] = {}
    lamps, watts, zones = [], [], []
    for number, one in enumerate(stated):
        field = f"gains.luminaire.{number}"
        if one.file not in known:
            known[one.file] = read_photometry(one.file)
        photometry = known[one.file]
        power = photometry.watts if one.watts is None else one.watts
        if power <= 0:
            raise DataError("states no power: state `watts`", file=one.file, field=field)
        for k in range(one.number):
            place = np.array(one.position) + k * np.array(one.step)
            if not in_room(space, place[None])[0]:
                raise DataError("is outside the room", element=space.label, field=f"{field}.position")
            lamps.append(Luminaire(photometry, tuple(place.tolist()), one.turned_deg))
            watts.append(power)
            zones.append(one.zone)
    points = sensor_grid(space, spacing=grid.spacing, height=grid.height, margin=grid.margin)[0]
    light = lamp_light(space, lamps, points, seed=seed)
    at_sensors, parts = light.direct + light.reflected, []
    for zone in tables.gains.lighting_zone:
        power = sum(w for w, name in zip(watts, zones, strict=True) if name == zone.name)
        full = light.mean
        if zone.at is not None:
            full = float(at_sensors[np.linalg.norm(points[:, :2] - np.array(zone.at), axis=1).argmin()])
        parts.append(zone.model_copy(update={"share": power / sum(watts), "lighting_full_lx": full}))
    changed = {
        "lighting_w_m2": sum(watts) / space.floor_area,
        "lighting_full_lx": light.mean,
        "luminaire": (),
        "lighting_zone": tuple(parts),
    }
    return tables.model_copy(update={"gains": tables.gains.model_copy(update=changed)})


def _of_model(gains: GainsTable, building: Building, space: Space) -> GainsTable:
    """The gains with the luminaires that the building's file has in a room; files are beside it.

    Where one has no photometry, the power of all is that of the room's lamps, and their light just the target.

    Raises: `DataError` for a room without luminaires, or one that states neither photometry nor power.
    """
    chosen = [one for one in building.luminaires if in_room(space, np.array([one.position]))[0]]
    if not chosen:
        message = f"the model has {len(building.luminaires)} luminaires, none in this room"
        raise DataError(message, file=building.file, element=space.label, field="gains.luminaires")
    folder = Path() if building.file is None else building.file.parent
    watts = [gains.luminaire_w if one.watts is None else one.watts for one in chosen]
    files = [folder / one.photometry.replace("\\", "/") if one.photometry else None for one in chosen]
    for one, power, file in zip(chosen, watts, files, strict=True):
        if file is None and power is None:
            message = f"luminaire {one.name} states neither photometry nor power: state `luminaire_w`"
            raise DataError(message, file=building.file, element=space.label, field="gains.luminaire_w")
        if file is not None and not file.is_file():
            message = f"luminaire {one.name} names {one.photometry}: no such file beside the model"
            raise DataError(message, file=building.file, element=space.label, field="gains.luminaires")
    if None in files:
        powers = [power for power in watts if power is not None]
        if len(powers) < len(watts):
            message = "some luminaires state photometry alone, others power alone: state `luminaire_w`"
            raise DataError(message, file=building.file, element=space.label, field="gains.luminaire_w")
        return gains.model_copy(update={"lighting_w_m2": sum(powers) / space.floor_area, "luminaires": ""})
    tables = [
        LuminaireTable(
            file=file, position=one.position, turned_deg=one.turned_deg, watts=one.watts or gains.luminaire_w
        )
        for one, file in zip(chosen, files, strict=True)
        if file is not None
    ]
    return gains.model_copy(update={"luminaire": tuple(tables), "luminaires": ""})
