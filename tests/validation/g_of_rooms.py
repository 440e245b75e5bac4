"""What an error of 0.03 in g does to the air of a room, by the heat that the room loses.

    python -m tests.validation g_of_rooms

The shoebox of `bim.shoebox` (4 x 6 x 3 m, 5.4 m2 of glass to the south, one outer wall) in Chicago with the
repository's glazing: `simulate(..., sensitivities=True)` for several air change rates, and with heating to
20 and cooling to 26 degC.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

from bim.shoebox import shoebox
from scenes import read_system, read_weather, simulate
from scenes.demo import VENETIAN_BLIND, WEATHER

GLAZING = VENETIAN_BLIND.with_name("glazing.xml")
G_ERROR, U_ERROR = 0.03, 0.3
AIR_CHANGES = (0.1, 0.5, 2.0, 5.0, 10.0)
AIR = 0.33  # heat capacity of air [Wh/(m3 K)]
VOLUME = 72.0  # [m3]
SET_POINTS = "[loads]\nheating_c = 20.0\ncooling_c = 26.0\n"


def lines() -> Iterator[str]:
    """The table's lines."""
    building, weather, system = shoebox(), read_weather(WEATHER), read_system(GLAZING)
    room = building.room(building.spaces[0].label)
    with tempfile.TemporaryDirectory() as folder:
        operation = Path(folder) / "loads.toml"
        operation.write_text(SET_POINTS, "utf-8")
        for ach in (*AIR_CHANGES, None):
            case = {"infiltration_ach": ach} if ach is not None else {"operation": operation}
            year = simulate(room, system, weather, quick=True, sensitivities=True, **case)
            assert year.sensitivities is not None
            slopes = year.sensitivities.set_index(["input", "figure"])["derivative"]
            by = [
                slopes["g_value", "mean_air_c"] * G_ERROR,
                slopes["g_value", "highest_operative_c"] * G_ERROR,
                slopes["u_value", "mean_air_c"] * U_ERROR,
            ]
            name = "20 to 26 degC" if ach is None else f"free, {ach:g}"
            loss = "" if ach is None else f"{AIR * VOLUME * ach:.0f}"
            yield f"| {name} | {loss} | {by[0]:+.2f} | {by[1]:+.2f} | {by[2]:+.2f} |"


def main() -> None:
    """Print the table."""
    print("| room, air changes [1/h] | loss by air [W/K] | mean air by g | highest operative by g | mean air by U |")
    print("|---|---|---|---|---|")
    for line in lines():
        print(line, flush=True)
