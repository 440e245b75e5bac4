"""Luminaires of a room's tables by their photometry: power, and light on the work plane."""

from __future__ import annotations

import numpy as np

from bim.electric_light import Luminaire, lamp_light
from bim.model import Space
from bim.sensors import in_room, sensor_grid
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.metrics.photometry import Photometry, read_photometry
from scenes.room.operation_tables import OperationTables
from scenes.room.options import SensorGrid


def with_luminaires(tables: OperationTables, space: Space, grid: SensorGrid, *, seed: int = 0) -> OperationTables:
    """The tables with the lamps' power and light in place of the luminaires of the room.

    Power is that of the files, light the mean of the work plane's sensors by all luminaires.

    Raises: `DataError` for a luminaire outside the room, without power, or a file that is none.
    """
    stated = tables.gains.luminaire
    if not stated:
        return tables
    known: dict[object, Photometry] = {}
    lamps, watts = [], 0.0
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
            watts += power
    points = sensor_grid(space, spacing=grid.spacing, height=grid.height, margin=grid.margin)[0]
    light = lamp_light(space, lamps, points, seed=seed)
    gains = tables.gains.model_copy(
        update={"lighting_w_m2": watts / space.floor_area, "lighting_full_lx": light.mean, "luminaire": ()}
    )
    return tables.model_copy(update={"gains": gains})
