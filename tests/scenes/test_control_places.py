"""Shading control south of the equator and in a leap year, by closed forms and by the calendar."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.sun import is_up, sun_directions
from scenes.room.inputs import RoomInputs, room_inputs
from scenes.room.operation_tables import OperationTables
from scenes.room.room import asked_year
from scenes.room.windows import in_all_windows
from tests.scenes.small_box import FEW, TWO
from tests.sky.weather_files import epw_rows, write_epw
from thermal.predictive import Forecast, noisy_forecast

TILTS = (0.0, 30.0, 60.0)
CUT_OFF = {"rule": "cut-off", "slat_tilts_deg": TILTS, "slat_width": 0.08, "slat_spacing": 0.08}


@pytest.fixture(scope="module")
def adelaide(tmp_path_factory):
    weather = read_epw(write_epw(tmp_path_factory.mktemp("south") / "south.epw", epw_rows()))
    return replace(weather, latitude_deg=-34.93, longitude_deg=138.60, timezone_h=9.5)


@pytest.fixture(scope="module")
def leap_year(tmp_path_factory):
    weather = read_epw(write_epw(tmp_path_factory.mktemp("leap") / "leap.epw", epw_rows(leap=True)))
    assert len(weather.times) == 8784
    return weather


@pytest.fixture
def of(variant, glass, milk, blind):
    """A room with windows to the south and the north under a control."""

    def inputs(weather, control: dict, **tables) -> RoomInputs:
        operation = OperationTables.model_validate({"control": control, **tables})
        systems = in_all_windows(TWO.spaces[0], glass, milk, blind)
        return room_inputs(TWO, TWO.spaces[0], systems, weather, FEW, operation=operation, cache=MatrixCache.of_user())

    return inputs


def by_group(room: RoomInputs) -> dict[str, np.ndarray]:
    return dict(zip(room.control.names, asked_year(room).states.T, strict=True))


def cut_off(weather, towards: float) -> np.ndarray:
    """The shadow of a slat on the glass, (sin tilt + cos tilt tan profile) width >= spacing.

    Args: towards: 1: a window to the north, -1: to the south.
    """
    sun = sun_directions(weather)
    facing = towards * sun[:, 1]
    shines = (facing > 0) & (weather.direct_normal > 0) & is_up(sun)
    tangent = sun[:, 2] / np.where(shines, facing, 1.0)
    expected = np.full(len(sun), len(TILTS) - 1)
    for j in reversed(range(len(TILTS))):
        tilt = np.radians(TILTS[j])
        expected[np.sin(tilt) + np.cos(tilt) * tangent >= 1.0] = j
    return np.where(shines, expected, 0)


@pytest.mark.parametrize("place", ["adelaide", "leap_year"])
def test_slats_follow_the_sun_of_the_place(of, request, place) -> None:
    weather = request.getfixturevalue(place)
    found = by_group(of(weather, CUT_OFF))
    for name, towards in (("S", -1.0), ("N", 1.0)):
        assert np.array_equal(found[name], cut_off(weather, towards)), name
    sunny, other = ("N", "S") if place == "adelaide" else ("S", "N")
    assert found[sunny].astype(bool).sum() > 2 * found[other].astype(bool).sum()


def test_the_winter_sun_of_the_south_reaches_deep_through_northern_windows(of, adelaide) -> None:
    """June: tan of the altitude at noon is 0.62, so that the sun through the glass's head reaches 3.9 m deep."""
    found = by_group(of(adelaide, {"rule": "sun depth", "deepest_m": 3.0}))
    month = adelaide.midpoints.month.to_numpy()
    noon = adelaide.midpoints.hour.to_numpy() == 12
    assert found["N"][noon & (month == 6)].all() and not found["N"][noon & (month == 12)].any()
    assert not found["S"][noon].any()


def test_irradiance_of_the_south_closes_the_northern_windows(of, adelaide) -> None:
    found = by_group(of(adelaide, {"rule": "irradiance", "close_above": 300.0}))
    month = adelaide.midpoints.month.to_numpy()
    june = month == 6
    assert found["N"][june].astype(bool).sum() > 100 and not found["S"][june].any()


def test_seasons_pass_the_new_year_where_summer_does(of, adelaide) -> None:
    summer = {"summer": {"season": [{"dates": ["10-01", "03-31"], "weekday": 1, "weekend": 1}], "weekday": 0}}
    states = by_group(of(adelaide, {"rule": "schedule", "schedule": "summer"}, schedules=summer))["N"]
    assert np.array_equal(states == 1, np.isin(adelaide.midpoints.month, (10, 11, 12, 1, 2, 3)))


def test_a_leap_day_is_a_day(of, leap_year) -> None:
    """29 February has its own moves, its own schedule, and the weekdays after it are one later."""
    days = np.arange(8784) // 24
    most = by_group(of(leap_year, {"rule": "irradiance", "close_above": 150.0, "most_moves": 1}))["S"]
    moves = np.concatenate([[0], np.diff(most) != 0])
    assert np.bincount(days, moves).max() == 1 and np.bincount(days, moves)[59] == 1
    held = by_group(of(leap_year, {"rule": "irradiance", "close_above": 150.0, "until": "midnight"}))["S"]
    assert (np.diff(held)[np.diff(held) < 0] < 0).all()
    assert set(np.flatnonzero(np.diff(held) < 0) % 24) == {23}
    use = {"use": {"weekday": 1, "weekend": 0, "holidays": ["02-29"], "holiday": 2}}
    control = {"rule": "schedule", "schedule": "use"}
    states = by_group(of(leap_year, control, schedules=use, calendar={"starts_on": "monday"}))["S"]
    by_day = states.reshape(366, 24)
    assert (by_day == by_day[:, :1]).all()
    expected = (np.arange(366) % 7 < 5).astype(int)
    expected[59] = 2
    assert np.array_equal(by_day[:, 0], expected)


def test_a_forecast_of_a_leap_year_is_one_plan() -> None:
    forecast = noisy_forecast(8784, 8784, sun_error=0.2, temperature_error_k=1.0)
    assert isinstance(forecast, Forecast) and forecast.sun.shape == (1, 8784)
