"""Two rooms that share a wall, and a door, against EnergyPlus.

    python -m tests.validation energyplus_two_rooms

Table 15's room with clear double glazing to the south; behind its back wall a room of the same
size with an outside wall to the north, no window and no gains.  EnergyPlus runs here and now.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd

from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import WEATHER
from tests.validation import reference_room
from tests.validation.differences import rmse_and_bias
from tests.validation.energyplus_cases import STEPS
from tests.validation.energyplus_program import room_model, run_energyplus
from tests.validation.facade_sun import facade_sun, sun_steps
from tests.validation.reference_systems import clear_double
from tests.validation.room_exchange import area_view_factors
from thermal.balance import ZoneResult, simulate_zones
from thermal.climate import Solar
from thermal.zone import Zone

OUTPUTS = {
    "ROOM:Zone Mean Air Temperature": "front air",
    "REAR:Zone Mean Air Temperature": "rear air",
    "BACK:Surface Inside Face Temperature": "front wall",
    "FRONT:Surface Inside Face Temperature": "rear wall",
}
DOOR_M3_S = 0.03
SETTLED = 7 * 24  # hours left out at the start


def our_rooms(door: float) -> tuple[ZoneResult, ...]:
    """The same two rooms by `thermal`, from the weather file on."""
    weather, system = read_epw(WEATHER), clear_double()
    steps = sun_steps(weather, STEPS)
    front = reference_room.zone("S", system.fenestration)
    rear = _rear(front)
    front = replace(
        front,
        surfaces=tuple(replace(s, outside="rear", partner="front") if s.name == "back" else s for s in front.surfaces),
    )
    sunny = reference_room.solar(
        facade_sun(steps, reference_room.facade_normal("S")), system, reference_room.RoomLight()
    )
    rows = len(steps.direct_normal)
    facade = np.zeros((rows, len(rear.surfaces)))
    facade[:, rear.index_of("facade")] = facade_sun(steps, np.array([0.0, 1.0, 0.0])).total
    none = np.zeros((rows, 0))
    shady = Solar(none, none, np.zeros((rows, len(rear.surfaces))), facade)
    return simulate_zones(
        [front, rear],
        reference_room.climate(weather),
        [sunny, shady],
        step_s=3600.0 / STEPS,
        air_links=[[0.0, door], [door, 0.0]],
    )


def _rear(front: Zone) -> Zone:
    """The room behind: the front room turned round, its window closed."""
    by_name = {s.name: s for s in front.surfaces}
    turned = [replace(by_name[name]) for name in ("left", "right", "floor", "ceiling")]
    wall = replace(by_name["back"], name="front", outside="room", partner="back", normal=-by_name["back"].normal)
    facade = replace(by_name["facade"], area=12.0, normal=-by_name["facade"].normal)
    surfaces = (facade, *turned, wall)
    return Zone(
        "rear",
        60.0,
        surfaces,
        infiltration_ach=0.5,
        view_factors=area_view_factors([s.area for s in surfaces], [s.normal for s in surfaces]),
    )


def compare() -> pd.DataFrame:
    """RMS difference and bias [K] of both rooms' air and of both faces of the wall, hourly."""
    rows = []
    for label, door in (("wall", 0.0), ("wall and open door", DOOR_M3_S)):
        changes = ("clear_double", "second_room", *(("open_door",) if door else ()))
        theirs = run_energyplus(room_model("S", *changes, outputs=OUTPUTS), WEATHER, outputs=OUTPUTS)
        front, rear = our_rooms(door)
        ours = {
            "front air": front.air_c,
            "rear air": rear.air_c,
            "front wall": front.surface_in_c[:, 3],
            "rear wall": rear.surface_in_c[:, 5],
        }
        for name, values in ours.items():
            rmse, bias = rmse_and_bias(values[SETTLED:], theirs[name][SETTLED:])
            rows.append({"between": label, "quantity": name, "mean C": values.mean(), "rmse K": rmse, "bias K": bias})
    return pd.DataFrame(rows)


def main() -> pd.DataFrame:
    """Both cases."""
    return compare()
