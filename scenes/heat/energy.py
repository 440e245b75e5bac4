"""What a room's heat, cold, air, lamps and equipment take: powers by hour, energy by month."""

from __future__ import annotations

import numpy as np
import pandas as pd

from mitsuba_cfs.sky.weather import Weather
from scenes.room.operation_tables import PlantTable
from scenes.room.zone import RoomZone
from thermal.balance import ZoneResult
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
    heat = sum(demand[k] for k in ("heating", "supply air heating", "slab heating",
                                   "humidification"))  # fmt: skip
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
