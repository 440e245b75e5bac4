"""The year of a room as tables: every hour, powers, energy by month, sums and comfort."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.sky.weather import Weather
from scenes.results import ShadingYear
from scenes.room.operation_tables import PlantTable
from scenes.room.zone import RoomZone
from thermal.balance import ZoneResult
from thermal.comfort import ADAPTIVE_BANDS, comfort_by_outdoors, degree_hours, summarise
from thermal.moisture import Humidity
from thermal.performance import performance

DEMAND = ("heating", "cooling", "supply air heating", "slab heating", "slab cooling",
          "humidification", "dehumidification")  # fmt: skip
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
    heat = sum(
        demand[k] for k in ("heating", "supply air heating", "slab heating", "humidification")
    )
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
    found: dict[str, float | str] = {}
    for name in ("heat", "cold", "final heating", "primary"):
        key = name.replace(" ", "_")
        found[f"{key}_kwh"] = float(powers[name].sum() * hours / 1e3)
        found[f"{key}_kwh_m2"] = found[f"{key}_kwh"] / floor_area
    electricity = [name for name in powers if name.startswith("electricity")]
    found["electricity_kwh"] = float(powers[electricity].to_numpy().sum() * hours / 1e3)
    found["electricity_kwh_m2"] = found["electricity_kwh"] / floor_area
    for name in ("heat", "cold"):
        peak = powers[name].idxmax()
        found[f"peak_{name}_w"] = float(powers[name].max())
        found[f"peak_{name}_at"] = peak.strftime("%m-%d %H:%M") if powers[name].max() > 0 else ""
    return found


def _step_h(powers: pd.DataFrame) -> float:
    """Length of the table's steps [h]."""
    return float((powers.index[1] - powers.index[0]) / pd.Timedelta(hours=1))


FloatArray = NDArray[np.float64]
PMV_CATEGORIES = {"I": 0.2, "II": 0.5, "III": 0.7, "IV": 1.0}  # EN 16798-1:2019, table B.1
WARM = 26.0  # [degC] operative, above which overheating is counted, ISO 17772, DIN 4108-2


def hourly_table(
    result: ZoneResult,
    shading: ShadingYear,
    daylight: FloatArray | None,
    weather: Weather,
    felt: dict[str, FloatArray],
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
    band = comfort_by_outdoors(
        operative_c, weather.dry_bulb_c, "EN 16798-1 III", per_day=weather.per_day
    )
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
    found = {
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
        comfort = comfort_by_outdoors(
            result.operative_c, weather.dry_bulb_c, band, per_day=weather.per_day
        )
        counted = summarise(comfort, occupied, month)
        found[f"comfortable_h {band}"] = counted.comfortable * weather.step_h
        months[f"{band} [h]"] = _in_hours(counted.discomfort_by_month, weather)
        found[f"degree_hours_warm {band}"] = counted.degree_hours_warm * weather.step_h
        found[f"degree_hours_cold {band}"] = counted.degree_hours_cold * weather.step_h
    table = pd.DataFrame(months, index=pd.RangeIndex(1, 13, name="month"))
    return {key: float(value) for key, value in found.items()}, table
