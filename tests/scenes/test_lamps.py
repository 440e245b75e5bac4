"""Lamps of a room's tables: dimming curve, sensor, standby, and LENI."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.sky.epw import read_epw
from scenes.demo import WEATHER
from scenes.room.operation_tables import OperationTables
from scenes.room.zone import operated
from tests.thermal.rooms import box

GAINS = {
    "lighting_w_m2": 10.0,
    "lighting_target_lx": 500.0,
    "lighting_least_light": 0.2,
    "lighting_least_power": 0.3,
    "lighting_sensor_factor": 0.8,
    "lighting_standby_w_m2": 0.5,
    "equipment_w_m2": 0.0,
    "persons": 0.0,
    "occupied": [8, 18],
}


@pytest.mark.parametrize(("off", "bright"), [(False, 0.3), (True, 0.0)])
def test_the_power_of_lamps_follows_their_curve(off, bright) -> None:
    weather, area = read_epw(WEATHER), 20.0
    gains = GAINS | {"lighting_off": off}
    tables = OperationTables.model_validate({"gains": gains})
    hours = np.arange(8760) % 24
    daylight = np.select([hours < 10, hours < 14], [0.0, 250.0], 900.0)
    zone, lamps = operated(box(), tables, area, weather, daylight)
    used = (hours >= 8) & (hours < 18)
    dimmed = 0.3 + 0.7 * (1 - 0.8 * 250 / 500 - 0.2) / 0.8
    shares = np.select([hours < 10, hours < 14], [1.0, dimmed], bright)
    assert lamps == pytest.approx(area * (10.0 * shares * used + 0.5))
    assert zone.gains.convective + zone.gains.radiant == pytest.approx(lamps)
    leni = lamps.sum() / 1e3 / area
    of_a_day = 2 * 1.0 + 4 * dimmed + 4 * bright
    assert leni == pytest.approx(365 * (10.0 * of_a_day + 24 * 0.5) / 1e3)


def test_undimmed_lamps_ignore_the_daylight() -> None:
    tables = OperationTables.model_validate({"gains": GAINS | {"lighting_dimmed": False}})
    assert tables.gains.dimming is None
    assert OperationTables().gains.dimming is None  # no lamps
    assert OperationTables.model_validate({"gains": GAINS}).gains.dimming is not None
