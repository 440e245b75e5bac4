"""Illuminance of the demo's room over a year, against Radiance's own three-phase method.

Quick: against the year that tests/reference/radiance_year holds.  Slow: Radiance runs anew.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from tests.scenes.radiance_year import SPACING, STORED_ROOM, Year, mean_year

pytestmark = pytest.mark.usefixtures("variant")


def our_year(name: str) -> Year:
    """The year of the demo's room by this project's three-phase method."""
    from bim.ifc.building import read_ifc
    from scenes.fenestration.systems import read_system
    from scenes.input_files import read_weather
    from scenes.room.options import RoomOptions
    from scenes.room.room import compute_room
    from scenes.room.windows import in_all_windows

    building = read_ifc(OFFICE)
    space = building.space(name)
    # one D for a whole window, as Radiance has it
    options = RoomOptions.of(method="three-phase", sensor_spacing=SPACING, window_parts=1)
    system = read_system(VENETIAN_BLIND)
    # windows are black on both sides in Radiance's chain: with their reflection ours is 2 % above
    none = np.zeros((145, 145))
    black = replace(system.visible, reflection_back=none, reflection_front=none)
    systems = in_all_windows(space, replace(system, visible=black))
    found = compute_room(building, space, systems, read_weather(WEATHER), options, pictures=False)
    return Year.of(found.daylight.illuminance)


def agree(ours: Year, theirs: Year, name: str) -> None:
    """The mean of the daylit hours, and the annual mean of each sensor."""
    assert ours.hours.shape == theirs.hours.shape and ours.sensors.shape == theirs.sensors.shape
    lit = theirs.hours > 1.0  # daylit
    assert lit.sum() > 4000
    mean = ours.hours[lit].mean() / theirs.hours[lit].mean()
    sensor = ours.sensors / theirs.sensors
    print(f"room {name}: mean {mean:.4f}, sensors {sensor.min():.4f} to {sensor.max():.4f}")
    assert mean == pytest.approx(1, abs=0.02), mean
    assert sensor == pytest.approx(np.ones_like(sensor), abs=0.05), sensor


def test_year_of_illuminance() -> None:
    agree(our_year(STORED_ROOM), Year.read(STORED_ROOM), STORED_ROOM)


@pytest.mark.peer
@pytest.mark.slow
@pytest.mark.parametrize("name", ["A", "B"])
def test_year_of_illuminance_with_radiance_anew(name) -> None:
    pytest.importorskip("pyradiance")
    theirs = mean_year(name)
    agree(our_year(name), theirs, name)
    if name == STORED_ROOM:
        stored = Year.read(name)
        # the stored year has three digits; its sensors had the same number of rays
        np.testing.assert_allclose(stored.sensors, theirs.sensors, rtol=0.02)
        assert stored.hours.mean() == pytest.approx(theirs.hours.mean(), rel=0.005)
