"""Schedules of an operation file: the day of the week, seasons, files, rooms, and their faults."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import ifcopenshell
import numpy as np
import pytest

from bim.building_file import chosen_spaces
from bim.ifc.building import read_ifc
from bim.shoebox import shoebox
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.weather import Weather
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.heat.study import study_inputs
from scenes.heat.study_file import StudyFile
from scenes.room.operation import OperationHours, check_schedules, read_operation, weekday_note
from scenes.room.operation_tables import OperationTables
from scenes.run.files import read_files
from scenes.run.options import JobOptions


@pytest.fixture(scope="module")
def weather() -> Weather:
    return read_epw(WEATHER)


def hours_of(schedule: dict, weather: Weather, **more) -> np.ndarray:
    """The year [H] of infiltration by a schedule."""
    tables = OperationTables.model_validate({"air": {"infiltration_ach": "x"}, "schedules": {"x": schedule}} | more)
    return OperationHours(tables, weather).outdoor_air()["infiltration_ach"]


WORK = [{"hours": [8, 18], "value": 1.0}]


def test_a_week_begins_on_the_weather_files_own_day(weather) -> None:
    """Chicago's EPW begins on a Sunday: its second day is the first with work."""
    year = hours_of({"weekday": WORK, "weekend": 0.25, "otherwise": 0.1}, weather)
    assert year[:24].tolist() == [0.25] * 24
    assert year[24:48].tolist() == [0.1] * 8 + [1.0] * 10 + [0.1] * 6
    assert np.count_nonzero(year == 0.25) == 24 * (53 + 52)
    friday = hours_of({"weekday": WORK, "weekend": 0.25}, replace(weather, first_weekday=4))
    assert friday[8] == 1.0 and friday[24:72].tolist() == [0.25] * 48
    stated = hours_of({"weekday": WORK, "weekend": 0.25}, weather, calendar={"starts_on": "friday"})
    np.testing.assert_array_equal(stated, friday)


def test_the_weekday_of_the_first_day_is_named_where_schedules_depend_on_it(weather) -> None:
    """Chicago's header says Sunday; without one it is that of the year, 2017 for a typical one."""

    def said(schedule: dict, weather: Weather, **more) -> list[str]:
        tables = OperationTables.model_validate({"schedules": {"x": schedule}} | more)
        return [str(note) for note in weekday_note([tables], weather)]

    week = {"weekday": WORK, "weekend": 0.25}
    (stated,) = said(week, weather)
    assert stated == "Schedules by weekday: 1 January is a Sunday, by the weather file's header."
    (tuesday,) = said(week, replace(weather, first_weekday=1))
    assert "1 January is a Tuesday" in tuesday
    silent = replace(weather, first_weekday=None)
    (assumed,) = said(
        {"weekday": WORK, "season": [{"dates": ["06-01", "08-31"], "weekday": 0.0, "sunday": 1.0}]}, silent
    )
    year = weather.midpoints[0].year
    assert assumed.endswith(f"as in {year}, because the weather file's header states none.")
    assert silent.weekday[0] == weather.midpoints[0].day_of_week
    # the same every day, or the first day in the calendar of the file itself: nothing is taken from the weather
    assert said({"weekday": WORK}, silent) == said(week, silent, calendar={"starts_on": "friday"}) == []
    assert said({"weekday": WORK, "holiday": 0.0}, silent) == []


def test_the_inputs_of_a_study_name_the_weekday(weather) -> None:
    table = {"weather": str(WEATHER), "box": {"width": 4.0, "depth": 5.0, "height": 3.0}}
    study = StudyFile.model_validate(table | {"schedules": {"x": {"weekday": WORK, "weekend": 0.25}}})
    assert any("1 January is a Sunday" in str(note) for note in study_inputs(study).notes)


def test_days_go_before_their_likes_and_24_values_are_hours(weather) -> None:
    day = [h / 100 for h in range(24)]
    table = {"weekday": day, "saturday": 2.0, "weekend": 3.0, "holiday": 4.0, "peak": 2.0}
    year = hours_of(table | {"holidays": ["01-03", "12-25"]}, weather).reshape(365, 24)
    np.testing.assert_allclose(year[1], 2 * np.array(day))
    assert set(year[0]) == {6.0} and set(year[6]) == {4.0} and set(year[2]) == {8.0}
    assert set(year[358]) == {8.0}
    shared = hours_of(table, weather, calendar={"holidays": ["01-03"]}).reshape(365, 24)
    assert set(shared[2]) == {8.0} and not set(shared[358]) == {8.0}


def test_seasons_may_pass_new_year_and_nights_midnight(weather) -> None:
    night = [{"hours": [22, 6], "value": 5.0}]
    winter = {"dates": ["10-01", "03-31"], "weekday": 0.5}
    year = hours_of({"weekday": night, "season": [winter]}, weather)
    month = weather.midpoints.month
    assert set(year[(month <= 3) | (month >= 10)]) == {0.5}
    july = year[month == 7].reshape(31, 24)
    assert np.all(july[:, [22, 23, 0, 1, 2, 3, 4, 5]] == 5.0) and july.sum() == 31 * 8 * 5.0


def test_a_column_of_a_file_is_a_schedule(tmp_path, weather) -> None:
    values = np.arange(8760) / 8760
    rows = "\n".join(f"{hour},{value}" for hour, value in enumerate(values))
    (tmp_path / "use.csv").write_text(f"hour,share\n{rows}\n")
    path = tmp_path / "o.toml"
    path.write_text('[gains]\noccupied = "used"\npersons = 3\n[schedules.used]\ncsv = "use.csv"\ncolumn = "share"\n')
    operation = read_operation(path)
    assert operation.files == (tmp_path / "use.csv",)
    hours = OperationHours(operation.tables, weather)
    np.testing.assert_allclose(hours.heat(20.0), values * (3 * 75.0 + 8.0 * 20.0))
    path.write_text(path.read_text().replace('"share"', '"shares"'))
    with pytest.raises(DataError, match=r"use.csv: no column 'shares'; there are hour, share"):
        check_schedules(read_operation(path).tables, weather, path)
    (tmp_path / "use.csv").write_text("hour,shares\n1,2\n")
    with pytest.raises(DataError, match="expected 8760 rows as the weather has, got 1"):
        check_schedules(read_operation(path).tables, weather, path)


def test_states_beside_a_file_of_hours_are_checked_each_with_its_own_data(tmp_path) -> None:
    """A table of hours is among the files that an operation names, but is no state's."""
    (tmp_path / "use.csv").write_text("share\n" + "0.5\n" * 8760)
    path = tmp_path / "o.toml"
    states = f'[[system]]\nbsdf = "{VENETIAN_BLIND}"\n' * 2
    hours = '[gains]\noccupied = "used"\n[schedules.used]\ncsv = "use.csv"\ncolumn = "share"\n'
    path.write_text(states + hours)
    options = JobOptions(OFFICE, WEATHER, operation=path)
    assert len(read_files(options).operation.systems) == 2
    path.write_text(states + "g_value = 0.01\n" + hours)
    with pytest.raises(DataError, match=r"venetian_blind\.xml: .*g: 0\.01 is below the solar"):
        read_files(options)


def test_constant_numbers_are_as_ever_to_the_last_bit(weather) -> None:
    tables = OperationTables.model_validate(
        {"gains": {"lighting_w_m2": 7.3, "persons": 2.0}, "air": {"night_ach": 1.7}}
    )
    hours, clock = OperationHours(tables, weather), np.arange(8760) % 24
    present = ((clock >= 8) & (clock < 18)).astype(float)
    np.testing.assert_array_equal(hours.heat(19.7), (8.0 * 19.7 + 2.0 * 75.0) * present)
    np.testing.assert_array_equal(hours.lamps(19.7), 7.3 * 19.7 * present)
    air = hours.outdoor_air()
    assert air["infiltration_ach"] == 0.5
    np.testing.assert_array_equal(air["other_air_ach"], 1.7 * (clock < 7))


def test_rooms_and_types_are_operated_otherwise(weather) -> None:
    building = shoebox()
    space = replace(building.spaces[0], type_name="office")
    hall = replace(space, guid="hall", name="hall", type_name="hall")
    building = replace(building, spaces=(space, hall))
    tables = OperationTables.model_validate(
        {"loads": {"heating_c": 20.0, "cooling_c": 26.0}, "rooms": [{"types": ["hall"], "loads": {"heating_c": 16.0}}]}
    )
    found = [tables.of_room(building, one).loads for one in (space, hall)]
    assert [(one.heating_c, one.cooling_c) for one in found] == [(20.0, 26.0), (16.0, 26.0)]
    lost = OperationTables.model_validate({"rooms": [{"types": ["hal"]}]})
    with pytest.raises(DataError, match=r"rooms.0.types: no space is of type 'hal'; there are"):
        lost.of_room(building, space)
    lost = OperationTables.model_validate({"rooms": [{"spaces": ["hell"]}]})
    with pytest.raises(DataError, match="no space 'hell'; there are: hall"):
        lost.of_room(building, space)


def test_states_follow_a_schedule_and_must_be_there(weather) -> None:
    tables = OperationTables.model_validate(
        {"control": {"rule": "schedule", "schedule": "blind"}, "schedules": {"blind": {"weekday": WORK, "weekend": 2}}}
    )
    states = OperationHours(tables, weather).states(tables.control, "control", 3).reshape(365, 24)
    assert set(states[0]) == {2} and np.flatnonzero(states[1]).tolist() == list(range(8, 18))
    assert tables.control_fault(3) is None
    assert tables.control_fault(2) == ("control.schedule", "'blind' has state 2: the windows have 2, from 0")
    with pytest.raises(DataError, match=r"control.schedule: schedule 'blind': a state outside 0"):
        OperationHours(tables, weather).states(tables.control, "control", 2)
    half = tables.model_copy(
        update={"schedules": {"blind": tables.schedules["blind"].model_copy(update={"peak": 0.5})}}
    )
    assert half.control_fault(3)[1].startswith("'blind' has state 0.5")


FAULTS = {
    "loads.heating_c: schedule 'x': expected -30 to 60 C": ('[loads]\nheating_c = "x"\n[schedules.x]\nweekday = 293\n'),
    "loads: the heating set point lies above": (
        '[loads]\nheating_c = "x"\ncooling_c = 24\n[schedules.x]\nweekday = 20\nweekend = 25\n'
    ),
    "loads.heating_c: no schedule 'offise'; did you mean 'office'?": (
        '[loads]\nheating_c = "offise"\n[schedules.office]\nweekday = 20\n'
    ),
    "rooms.0.air.night_ach: no schedule 'y'": ('[[rooms]]\nspaces = ["a"]\n[rooms.air]\nnight_ach = "y"\n'),
    "schedules.x.weekday: expected 24 values, one an hour, got 23": (f"[schedules.x]\nweekday = {[1] * 23}\n"),
    "schedules.x.weekday.0.hours: expected two different hours": (
        "[schedules.x]\nweekday = [{ hours = [8, 8], value = 1 }]\n"
    ),
    "schedules.x.holidays.0: expected a day as MM-DD, got '25.12.'": (
        '[schedules.x]\nweekday = 1\nholidays = ["25.12."]\n'
    ),
    "schedules.x.holidays.0: expected a day as MM-DD, got '5'": ('[schedules.x]\nweekday = 1\nholidays = ["5"]\n'),
    "schedules.x.wekday: no such key; did you mean weekday?": "[schedules.x]\nwekday = 1\n",
    "schedules.x: give either `weekday` or `csv`": "[schedules.x]\nweekend = 1\n",
    "schedules.x.csv: no such file: none.csv": ('[schedules.x]\ncsv = "none.csv"\ncolumn = "a"\n'),
}


@pytest.mark.parametrize("words", FAULTS)
def test_a_fault_names_file_table_and_key(tmp_path: Path, weather, words) -> None:
    path = tmp_path / "o.toml"
    path.write_text(FAULTS[words])
    with pytest.raises(DataError) as error:
        check_schedules(read_operation(path).tables, weather, path)
    assert str(error.value).startswith(f"{path}: {words}")


def test_an_office_with_set_back_and_night_air_is_as_in_energyplus() -> None:
    """Air and loads of weeks with weekend and holiday; the bars are those of two coupled rooms."""
    pytest.importorskip("pyenergyplus")
    from tests.validation.energyplus_schedules import compare

    north = compare("N").set_index("period")
    assert north["air rmse K"].max() < 0.1
    week = north.loc["January week with a holiday"]
    assert week["heating kWh"] > 20
    assert week["heating kWh"] == pytest.approx(week["EnergyPlus heating kWh"], rel=0.04)
    year = north.loc["year"]
    assert year["cooling kWh"] == pytest.approx(year["EnergyPlus cooling kWh"], rel=0.034)


def test_an_ifc_says_what_type_a_room_is_and_its_long_name_chooses_it(tmp_path) -> None:
    model = ifcopenshell.open(str(OFFICE))
    one = model.by_type("IfcSpace")[0]
    one.ObjectType = "meeting"
    model.write(str(tmp_path / "o.ifc"))
    building = read_ifc(tmp_path / "o.ifc")
    found = {space.guid: space.type_name for space in building.spaces}
    assert found.pop(one.GlobalId) == "meeting" and set(found.values()) == {""}
    for space in building.spaces:
        for name in (space.label, space.long_name, space.long_name.upper(), space.name):
            assert chosen_spaces(building, [name], tmp_path / "o.ifc") == [space]
            assert building.room(name).space is space
