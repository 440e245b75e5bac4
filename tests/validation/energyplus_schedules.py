"""An office with weekend set-back, holidays and night air over midnight, against EnergyPlus.

    python -m tests.validation energyplus_schedules

Table 15's room with clear double glazing, to the south and to the north, in Chicago.  Ours takes
its hours from the tables of an operation file; EnergyPlus' are its own `Schedule:Compact`.
"""

from __future__ import annotations

import sys
import tomllib
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.weather import Weather
from scenes.room.operation_hours import OperationHours
from scenes.room.operation_tables import OperationTables
from tests.benchmarks.thermal_year import EPW, energyplus_room, glazing
from tests.validation import reference_room
from tests.validation.energyplus_cases import STEPS
from tests.validation.energyplus_ideal_loads import ideal_loads
from tests.validation.energyplus_model import Model, hourly_outputs, run_energyplus
from tests.validation.facade_sun import facade_sun, sun_steps
from thermal.balance import ZoneResult, simulate
from thermal.gains import split_gains

FLOOR_AREA = 20.0  # [m2]
OFFICE = """
[gains]
persons = "people"
equipment_w_m2 = "computers"
[air]
infiltration_ach = 0.3
night_ach = "night air"
[loads]
heating_c = "heating"
cooling_c = "cooling"
[calendar]
holidays = ["01-16", "07-04"]
[schedules.people]
peak = 2.0
weekday = [{ hours = [8, 12], value = 1.0 }, { hours = [12, 13], value = 0.4 },
           { hours = [13, 18], value = 1.0 }]
weekend = 0.0
[schedules.computers]
peak = 8.0
otherwise = 0.1
weekday = [{ hours = [8, 18], value = 1.0 }]
weekend = 0.1
[schedules."night air"]
weekday = 0.0
season = [{ dates = ["05-01", "09-30"], weekday = [{ hours = [22, 6], value = 3.0 }] }]
[schedules.heating]
otherwise = 16.0
weekday = [{ hours = [6, 18], value = 21.0 }]
weekend = 16.0
[schedules.cooling]
otherwise = 32.0
weekday = [{ hours = [7, 19], value = 25.0 }]
weekend = 32.0
"""
OUTPUTS = {
    "ROOM:Zone Mean Air Temperature": "air",
    "ROOM:Zone Air System Sensible Heating Rate": "heating",
    "ROOM:Zone Air System Sensible Cooling Rate": "cooling",
}
WEEKS = {  # Monday to Sunday
    "January week with a holiday": ("01-16", "01-22"),
    "April week": ("04-10", "04-16"),
    "July week with a holiday": ("07-03", "07-09"),
}


def our_year(orientation: str) -> tuple[Weather, ZoneResult]:
    """The year by `thermal`, its hours by the tables of the office."""
    weather, system = read_epw(EPW), glazing()
    hours = OperationHours(OperationTables.model_validate(tomllib.loads(OFFICE)), weather)
    zone = replace(
        reference_room.zone(orientation, system.fenestration),
        **hours.outdoor_air(),
        gains=split_gains(hours.heat(FLOOR_AREA), 0.5),
        loads=hours.loads(),
    )
    sun = facade_sun(sun_steps(weather, STEPS), reference_room.facade_normal(orientation))
    solar = reference_room.solar(sun, system, reference_room.RoomLight())
    outdoors = reference_room.climate(weather)
    return weather, simulate(zone, outdoors, solar, step_s=3600.0 / STEPS)


def energyplus_model(orientation: str) -> Model:
    """The same room in EnergyPlus, with schedules and ideal loads."""
    model = energyplus_room(orientation) | hourly_outputs(OUTPUTS)
    work, free = "For: Weekdays", "For: AllOtherDays"
    people = ["Until: 8:00", 0, "Until: 12:00", 1, "Until: 13:00", 0.4, "Until: 18:00", 1]
    computers = ["Until: 8:00", 0.1, "Until: 18:00", 1, "Until: 24:00", 0.1]
    heating = ["Until: 6:00", 16, "Until: 18:00", 21, "Until: 24:00", 16]
    cooling = ["Until: 7:00", 32, "Until: 19:00", 25, "Until: 24:00", 32]
    night = ["Until: 6:00", 3, "Until: 22:00", 0, "Until: 24:00", 3]
    year, until = "Through: 12/31", "Until: 24:00"
    model["Schedule:Compact"] |= {
        "PEOPLE": _compact(year, work, *people, until, 0, free, until, 0),
        "COMPUTERS": _compact(year, work, *computers, free, until, 0.1),
        "HEATING": _compact(year, work, *heating, free, until, 16),
        "COOLING": _compact(year, work, *cooling, free, until, 32),
        "NIGHT": _compact(
            "Through: 4/30", "For: AllDays", until, 0, "Through: 9/30", "For: AllDays", *night,
            year, "For: AllDays", until, 0,
        ),
        "DUAL": _compact(year, "For: AllDays", until, 4),
    }  # fmt: skip
    model["RunPeriod"]["year"] |= {
        "day_of_week_for_start_day": "Sunday",
        "apply_weekend_holiday_rule": "No",
    }
    model["RunPeriodControl:SpecialDays"] = {
        f"FREE {day}": {"start_date": day, "duration": 1, "special_day_type": "Holiday"}
        for day in ("1/16", "7/4")
    }
    air = model["ZoneInfiltration:DesignFlowRate"]
    air["NIGHT AIR"] = air["AIR"] | {"schedule_name": "NIGHT", "air_changes_per_hour": 1.0}
    air["AIR"] |= {"air_changes_per_hour": 0.3}
    model["ElectricEquipment"]["COMPUTERS"] |= {"schedule_name": "COMPUTERS"}
    model["People"]["PERSON"] |= {
        "number_of_people_schedule_name": "PEOPLE", "number_of_people": 2.0,
    }  # fmt: skip
    return model | ideal_loads("HEATING", "COOLING", "DUAL")


def _compact(*values: str | float) -> dict[str, Any]:
    return {"data": [{"field": value} for value in values]}


def compare(orientation: str) -> pd.DataFrame:
    """Air RMSE and bias [K], heating and cooling of both [kWh], by week and for the year."""
    theirs = run_energyplus(energyplus_model(orientation), EPW, outputs=OUTPUTS)
    weather, ours = our_year(orientation)
    date = weather.midpoints.strftime("%m-%d").to_numpy(dtype=str)
    rows = []
    for name, (start, end) in (WEEKS | {"year": ("01-01", "12-31")}).items():
        chosen = (date >= start) & (date <= end)
        gap = (ours.air_c - theirs["air"].to_numpy())[chosen]
        row = {
            "facing": orientation,
            "period": name,
            "air rmse K": np.sqrt(np.mean(gap**2)),
            "air bias K": gap.mean(),
        }
        for load in ("heating", "cooling"):
            row[f"{load} kWh"] = getattr(ours, load)[chosen].sum() / 1e3
            row[f"EnergyPlus {load} kWh"] = theirs[load].to_numpy()[chosen].sum() / 1e3
        rows.append(row)
    return pd.DataFrame(rows)


if __name__ == "__main__":
    table = pd.concat(map(compare, ("S", "N")))
    sys.stdout.write(table.round(2).to_string(index=False) + "\n")
