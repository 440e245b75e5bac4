"""Luminaires of a room's tables by their photometry: power, light on the work plane, spectrum."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.electric_light import Luminaire, lamp_light
from bim.model import Building, Space
from bim.sensors import in_room, sensor_grid
from bim.xml_elements import xml_elements
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.metrics.photometry import read_photometry
from mitsuba_cfs.spectra.detectors import NANOMETRES, detected, illuminant, is_illuminant
from scenes.fenestration.thermal_file import csv_columns
from scenes.room.operation_tables import GainsTable, LuminaireTable, OperationTables
from scenes.room.options import SensorGrid

FloatArray = NDArray[np.float64]
SPDX_BYTES = 16 << 20
MOST_POWER = 1e12  # of a spectrum in any unit
LAMP_COLUMNS = ("wavelength_nm", "power")


def with_luminaires(
    tables: OperationTables, building: Building, space: Space, grid: SensorGrid, *, seed: int = 0
) -> OperationTables:
    """The tables with the lamps' power and light besides the luminaires of the room.

    Power is that of the files, light the mean of the work plane's sensors by all luminaires, or with
    zones that at the sensor of each.

    Raises: `DataError` for a luminaire outside the room, without power, or a file that is none.
    """
    if tables.gains.luminaires:
        tables = tables.model_copy(update={"gains": _of_model(tables.gains, building, space)})
    stated = tables.gains.luminaire
    if not stated:
        return tables
    lamps, watts, zones = [], [], []
    for number, one in enumerate(stated):
        lamps += _in_room(one, number, space)
        photometry = lamps[-1].photometry
        power = photometry.watts if one.watts is None else one.watts
        if power <= 0:
            field = f"gains.luminaire.{number}"
            raise DataError("states no power: state `watts`", file=one.file, field=field)
        watts += [power] * one.number
        zones += [one.zone] * one.number
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


def _in_room(table: LuminaireTable, number: int, space: Space) -> list[Luminaire]:
    """The luminaires of a table; `DataError` for one outside the room."""
    photometry, lamps = read_photometry(table.file), []
    for k in range(table.number):
        place = np.array(table.position) + k * np.array(table.step)
        if not in_room(space, place[None])[0]:
            raise DataError("is outside the room", element=space.label, field=f"gains.luminaire.{number}.position")
        lamps.append(Luminaire(photometry, tuple(place.tolist()), table.turned_deg))
    return lamps


def lamp_spectra(
    tables: OperationTables, space: Space, points: FloatArray, normals: FloatArray, *, seed: int = 0
) -> tuple[FloatArray, FloatArray] | None:
    """Light of the luminaires at full power at sensors [S, N] [W/(m2 nm)], and all of it [S] [lx].

    The room's surfaces reflect it as visible light.  Luminaires without a spectrum are left out of
    the first; None where no luminaire has one.
    """
    stated = tables.gains.luminaire
    if not any(one.spectrum for one in stated):
        return None
    power, whole = np.zeros((len(points), len(NANOMETRES))), np.zeros(len(points))
    for number, one in enumerate(stated):
        light = lamp_light(space, _in_room(one, number, space), points, normals, seed=seed)
        lux = light.direct + light.reflected
        whole += lux
        if one.spectrum:
            power += lux[:, None] * lamp_spectrum(one.spectrum)
    return power, whole


def placed_spectrum(text: str, folder: Path) -> str:
    """The name of a CIE illuminant, or the absolute path of a file in a folder.

    Raises: `DataError` for neither, or a file that is no spectrum.
    """
    if is_illuminant(text):
        return text
    file = (folder / text).absolute()
    if not file.is_file():
        raise DataError(f"no such file, nor an illuminant of CIE (LED-B3, FL11, A): {text}")
    lamp_spectrum(str(file))
    return str(file)


def lamp_spectrum(source: str) -> FloatArray:
    """Spectrum [N] of a lamp per lumen [W/(lm nm)]: of a CIE illuminant, a CSV or an SPDX file.

    Raises: `DataError` for a file that is no spectrum of visible light.

    Source: IES TM-27-20 (SPDX).
    """
    if is_illuminant(source):
        power = illuminant(source)
    else:
        path = Path(source)
        if path.suffix.casefold() == ".csv":
            nm, values = (csv_columns(path, LAMP_COLUMNS)[name] for name in LAMP_COLUMNS)
        else:
            nm, values = _spdx(path)
        if len(nm) < 2 or not (np.diff(nm) > 0).all() or not (nm[0] <= 400 and nm[-1] >= 700):
            raise DataError("expected rising wavelengths from 400 to 700 nm at least", file=path)
        if not ((values >= 0) & (values <= MOST_POWER)).all():
            raise DataError(f"expected powers from 0 to {MOST_POWER:g}", file=path)
        power = np.interp(NANOMETRES, nm, values, left=0.0, right=0.0)
    lumens = float(detected(power)[0])
    if lumens <= 0:
        raise DataError("has no visible light", file=source)
    return power / lumens


def _spdx(path: Path) -> tuple[FloatArray, FloatArray]:
    """Wavelengths [nm] and powers of a file of IES TM-27."""
    ((root, _),) = xml_elements(path, None, depth=1, most_bytes=SPDX_BYTES)
    words = [(item.get("wavelength", ""), item.text or "") for item in root.iter("SpectralData")]
    try:
        rows = [(float(wavelength), float(power)) for wavelength, power in words]
    except ValueError as error:
        raise DataError(f"is no spectrum of IES TM-27 (SPDX): {error}", file=path) from None
    if not rows:
        raise DataError("is no spectrum of IES TM-27 (SPDX): no SpectralData", file=path)
    nm, values = np.array(rows).T
    return nm, values
