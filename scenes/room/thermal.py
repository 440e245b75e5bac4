"""Heat of a room as a run tells it: temperatures and gains of a year, adaptive comfort."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.thermal_system import ThermalSystem
from scenes.results import OperationResult, ThermalResult
from scenes.room.windows import RoomWindows
from scenes.room.zone import RoomZone
from thermal.balance import ZoneResult
from thermal.comfort import comfort_by_outdoors, summarise
from thermal.zone import Zone

BANDS = {"within_90": "ASHRAE 55 90 %", "within_80": "ASHRAE 55 80 %"}


def operated_year(
    room: RoomZone, result: ZoneResult, weather: Weather, states: tuple[str, ...], rule: str
) -> OperationResult:
    """What control, heating, cooling and lamps of a room did.

    Args: states: names of the shading states; rule: of their control.
    """
    hours = pd.DataFrame(
        {
            "shading_state": room.state,
            "heating_w": result.heating,
            "cooling_w": result.cooling,
            "lighting_w": room.lamps,
        },
        index=weather.midpoints,
    ).rename_axis("time")
    summary = {
        "heating_kwh": result.heating.sum() / 1e3,
        "cooling_kwh": result.cooling.sum() / 1e3,
        "lighting_kwh": room.lamps.sum() / 1e3,
        "peak_heating_w": result.heating.max(),
        "peak_cooling_w": result.cooling.max(),
    }
    summary = {key: float(value) for key, value in summary.items()}
    return OperationResult(states, hours, summary, rule)


def thermal_result(
    room: RoomZone,
    result: ZoneResult,
    weather: Weather,
    felt: dict[str, NDArray[np.float64]],
    fenestration: Iterator[dict[str, float | str]],
) -> ThermalResult:
    """The tables of a room's year.

    Args: felt: `felt_by`; fenestration: `fenestration_table` of its windows.
    """
    comfort, summary = _comfort(result, weather, room.occupied)
    return ThermalResult(
        _temperatures(result, room.zone, weather).assign(**felt),
        pd.DataFrame(room.gains, index=weather.midpoints).rename_axis("time"),
        comfort,
        summary,
        tuple(fenestration),
    )


def fenestration_table(
    windows: RoomWindows, thermals: Sequence[Sequence[ThermalSystem]]
) -> Iterator[dict[str, float | str]]:
    """What the windows are, group by group and state by state, at normal incidence."""
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
                "visible_transmittance": float(
                    visible.direct_hemispherical(visible.transmission_front)[0]
                ),
            }


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
        comfort = comfort_by_outdoors(
            result.operative_c, weather.dry_bulb_c, band, per_day=weather.per_day
        )
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
