"""The results of a run as one xarray data set and netCDF file, with units by the CF conventions.

Dimensions: `time`, the middle of each interval; `sensor`, those of all rooms one after the other;
`surface`, walls and windows of all rooms; `picture`; `view`, the eyes of all glare maps in each
direction; `room`.  Names are those of the CSV files; what sums a year up begins with `sensor_`,
`view_` or `room_`.

Source: CF Metadata Conventions 1.11; units as UDUNITS knows them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from importlib import metadata
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from bim.names import folder_names
from mitsuba_cfs.files import temporary_folder
from scenes.run.files import check_netcdf

if TYPE_CHECKING:
    from xarray import Dataset

    from scenes.results import RoomYear, RunResult

    Variables = dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, str]]]

NAME = "results.nc"
UNITS = {"": "1", "°C": "degC", "%": "percent"}  # of UDUNITS, where they differ
LABELS = {  # units and names of what no page shows
    "pmv": ("1", "predicted mean vote, ISO 7730"),
    "ppd": ("percent", "predicted percentage of dissatisfied, ISO 7730"),
    "set_c": ("degC", "standard effective temperature, ASHRAE 55"),
}
STANDARD = {  # names of the CF standard name table
    "air_c": "air_temperature",
    "outdoor_c": "air_temperature",
    "relative_humidity_percent": "relative_humidity",
}
PLACES = {axis: {"units": "m", "long_name": f"{axis} of the sensor"} for axis in "xyz"}
VIEWS = {axis: {"units": "m", "long_name": f"{axis} of the eye"} for axis in "xyz"} | {
    "direction_deg": {"units": "degree", "long_name": "azimuth of the line of sight, from north by east"},
    "hours_of_use": {"units": "h", "long_name": "hours of use"},
    "dgp_exceeded_in_5_percent": {"units": "1", "long_name": "DGP exceeded in 5 % of the hours of use"},
}


def year_dataset(result: RunResult) -> Dataset:
    """All numbers of a run with their units, long names and rooms.

    Raises: `DataError` where xarray is not installed.
    """
    check_netcdf()
    import xarray as xr

    rooms = result.spaces
    names = folder_names([room.space for room in rooms])
    variables = _hours(rooms) | _sensors(rooms, names) | _surfaces(rooms, names)
    variables |= _pictures(result, names) | glare_map_variables(rooms, names) | _years(rooms)
    coordinates = {
        "time": ("time", result.times, {"long_name": "middle of the hour, local standard time"}),
        "room": ("room", names, {"long_name": "folder of the room"}),
        "room_label": ("room", [room.space.label for room in rooms], {"long_name": "room"}),
        "room_guid": ("room", [room.space.guid for room in rooms], {"long_name": "GUID"}),
    }
    manifest = result.manifest
    version = metadata.version("mitsuba-cfs")
    about = {
        "Conventions": "CF-1.11",
        "title": f"{manifest['building']}: daylight, glare, temperatures of {_counted(len(rooms))}",
        "source": f"mitsuba-cfs {version}, {result.method}, {manifest['system']}",
        "site": str(manifest["site"]),
    }
    owners = ("sensor_room", "surface_name", "surface_room", "picture_time", "picture_room", "view_room")
    views = [f"view_{name}" for name in (*PLACES, "direction_deg")]
    places = [name for name in (*PLACES, *owners, *views) if name in variables]
    return xr.Dataset(variables, coordinates, about).set_coords(places)


def _counted(rooms: int) -> str:
    return "1 room" if rooms == 1 else f"{rooms} rooms"


def write_netcdf(result: RunResult, path: str | PathLike[str]) -> None:
    """Write `year_dataset` as a netCDF-4 file, compressed."""
    data = year_dataset(result)
    packed = {
        name: {"zlib": True, "shuffle": True, "complevel": 4}
        for name, values in data.data_vars.items()
        if values.dtype.kind in "fib" and values.ndim > 1
    }
    path = Path(path)
    with temporary_folder(path.parent) as place:  # not `replacing`: HDF5 locks the file itself
        data.to_netcdf(place / path.name, engine="h5netcdf", encoding=packed)
        (place / path.name).replace(path)


def attributes(key: str) -> dict[str, str]:
    """CF attributes of a quantity of the results: units, long_name, what it means."""
    from scenes.report.names import quantity  # whose package draws

    known = quantity(key)
    unit, label = UNITS.get(known.unit, known.unit).replace("²", "2"), known.label
    unit, label = LABELS.get(key, (unit, label))
    result = {"units": unit, "long_name": label}
    if known.meaning:
        result["comment"] = known.meaning
    if key in STANDARD:
        result["standard_name"] = STANDARD[key]
    if known.values:
        result["flag_meanings"] = ", ".join(known.values)
    return result


def _hours(rooms: Iterable[RoomYear]) -> Variables:
    """Every column of the hours, by time and room; NaN for a room that has none of it."""
    tables = [room.hours.drop(columns=_surface_names(room)) for room in rooms]
    columns = dict.fromkeys(name for table in tables for name in table.columns)
    result = {}
    for name in columns:
        values = [table[name] if name in table else np.nan for table in tables]
        kinds = {getattr(value, "dtype", np.dtype(float)).kind for value in values}
        kind = bool if kinds == {"b"} else np.float32
        length = len(tables[0])
        stack = [np.broadcast_to(np.asarray(one, dtype=kind), length) for one in values]
        message = attributes(name) | ({"units": "1"} if kind is bool else {})
        result[name] = (("time", "room"), np.stack(stack, axis=1), message)
    return result


def _sensors(rooms: Sequence[RoomYear], names: Iterable[str]) -> Variables:
    """Illuminance by time and sensor, and the sensors' metrics of the year."""
    tables, light, owners = [], [], []
    for room, name in zip(rooms, names, strict=True):
        daylight = room.daylight
        metrics = daylight.sensor_metrics.copy()
        metrics["relative_standard_error"] = daylight.relative_error
        if room.spectral is not None:
            metrics = metrics.join(room.spectral.sensor_metrics)
        tables.append(metrics)
        light.append(np.asarray(daylight.illuminance, dtype=np.float32))
        owners += [name] * len(metrics)
    whole = pd.concat(tables, ignore_index=True)
    lux = {"units": "lx", "long_name": "illuminance"}
    variables: Variables = {
        "illuminance": (("time", "sensor"), np.concatenate(light, axis=1), lux),
        "sensor_room": (("sensor",), np.array(owners), {"long_name": "room of the sensor"}),
    }
    melanopic = [room.spectral.melanopic for room in rooms if room.spectral is not None]
    if melanopic:
        edi = attributes("melanopic_edi_lx") | {"comment": "of the work plane's sensors"}
        variables["melanopic_edi"] = (("time", "sensor"), np.concatenate(melanopic, axis=1), edi)
    for name in whole:
        own = name if name in PLACES else f"sensor_{name}"
        what = PLACES.get(name) or attributes(name)
        variables[own] = (("sensor",), whole[name].to_numpy(dtype=float), what)
    return variables


def _surfaces(rooms: Iterable[RoomYear], names: Iterable[str]) -> Variables:
    """Temperatures by time and surface, with the surfaces' names and rooms."""
    values, surfaces, owners = [], [], []
    for room, name in zip(rooms, names, strict=True):
        columns = _surface_names(room)
        values.append(room.heat.temperatures[columns].to_numpy(dtype=np.float32))
        surfaces += [column.removesuffix("_c") for column in columns]
        owners += [name] * len(columns)
    whole = {"units": "degC", "long_name": "surface temperature"}
    return {
        "surface_temperature_c": (("time", "surface"), np.concatenate(values, axis=1), whole),
        "surface_name": (("surface",), np.array(surfaces), {"long_name": "surface"}),
        "surface_room": (("surface",), np.array(owners), {"long_name": "room of the surface"}),
    }


def _surface_names(room: RoomYear) -> list[str]:
    """Columns of a room's temperatures that belong to its surfaces, which other rooms have not."""
    return [name for name in room.heat.temperatures.columns if " " in name]


def _pictures(result: RunResult, names: Iterable[str]) -> Variables:
    """Glare of the pictures, with their times and rooms."""
    from scenes.results import glare_table  # loads numba

    tables = [
        glare_table(room.glare, result.times).reset_index().assign(room=name)
        for room, name in zip(result.spaces, names, strict=True)
        if room.glare.pictures
    ]
    if not tables:
        return {}
    whole = pd.concat(tables, ignore_index=True)
    variables: Variables = {
        "picture_time": (("picture",), whole.pop("time").to_numpy(), {"long_name": "hour shown"}),
        "picture_room": (("picture",), whole.pop("room").to_numpy(str), {"long_name": "room"}),
    }
    for name in whole:
        values = whole[name].to_numpy(dtype=float)
        variables[f"picture_{name}"] = (("picture",), values, attributes(name))
    return variables


def glare_map_variables(rooms: Iterable[RoomYear], names: Iterable[str]) -> Variables:
    """Glare of a year at each eye and in each direction of the rooms' glare maps."""
    tables = [
        room.glare_map.table().drop(columns="eye").assign(room=name)
        for room, name in zip(rooms, names, strict=True)
        if room.glare_map is not None
    ]
    if not tables:
        return {}
    whole = pd.concat(tables, ignore_index=True)
    variables: Variables = {
        "view_room": (("view",), whole.pop("room").to_numpy(str), {"long_name": "room of the view"})
    }
    for name in whole:
        about = VIEWS.get(name) or {"units": "h", "long_name": f"hours of use with DGP above {name[-4:]}"}
        variables[f"view_{name}"] = (("view",), whole[name].to_numpy(dtype=float), about)
    return variables


def _years(rooms: Iterable[RoomYear]) -> Variables:
    """Figures of the whole year by room: daylight, comfort and loads."""
    tables: list[Mapping[str, float]] = []
    for room in rooms:
        loads = {} if room.operation is None else room.operation.summary
        spectral = {} if room.spectral is None else room.spectral.summary
        tables.append({**room.daylight.room_metrics, **room.heat.comfort_summary, **loads, **spectral})
    keys = dict.fromkeys(key for table in tables for key in table)
    return {
        f"room_{key}": (("room",), np.array([table.get(key, np.nan) for table in tables], dtype=float), attributes(key))
        for key in keys
    }
