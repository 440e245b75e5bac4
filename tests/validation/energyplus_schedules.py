"""An office with weekend set-back, holidays and night air over midnight, against EnergyPlus.

    python -m tests.validation energyplus_schedules

Table 15's room with clear double glazing, to the south and to the north, in Chicago.  mitsuba-cfs takes
its hours from the tables of an operation file; EnergyPlus' are its own `Schedule:Compact`.
"""

from __future__ import annotations

import tomllib

import pandas as pd

from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import WEATHER
from scenes.room.operation import OperationHours
from scenes.room.operation_tables import OperationTables
from tests.validation.differences import rmse_and_bias
from tests.validation.energyplus_cases import clear_double_year
from tests.validation.energyplus_program import room_model, run_energyplus
from thermal.zone import split_gains

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


def compare(orientation: str) -> pd.DataFrame:
    """Air RMSE and bias [K], heating and cooling of both [kWh], by week and for the year."""
    model = room_model(orientation, "clear_double", "office_hours", outputs=OUTPUTS)
    theirs = run_energyplus(model, WEATHER, outputs=OUTPUTS)
    weather = read_epw(WEATHER)
    hours = OperationHours(OperationTables.model_validate(tomllib.loads(OFFICE)), weather)
    ours = clear_double_year(
        weather, orientation, **hours.outdoor_air(), gains=split_gains(hours.heat(FLOOR_AREA), 0.5), loads=hours.loads()
    )
    date = weather.midpoints.strftime("%m-%d").to_numpy(dtype=str)
    rows = []
    for name, (start, end) in (WEEKS | {"year": ("01-01", "12-31")}).items():
        chosen = (date >= start) & (date <= end)
        rmse, bias = rmse_and_bias(ours.air_c[chosen], theirs["air"][chosen])
        row = {"facing": orientation, "period": name, "air rmse K": rmse, "air bias K": bias}
        for load in ("heating", "cooling"):
            row[f"{load} kWh"] = getattr(ours, load)[chosen].sum() / 1e3
            row[f"EnergyPlus {load} kWh"] = theirs[load].to_numpy()[chosen].sum() / 1e3
        rows.append(row)
    return pd.DataFrame(rows)


def main() -> pd.DataFrame:
    """South and north."""
    return pd.concat(map(compare, ("S", "N")))
