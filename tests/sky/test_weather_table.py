"""Place and clock of a weather file against its own radiation: planted faults, sound files."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from weather_files import epw_rows, write_epw

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.epw import read_epw, read_wea, write_wea
from mitsuba_cfs.sky.measured import read_measured
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.sky.weather_table import noon_offset, whole_days

EPW = (
    Path(__file__).parents[2] / "scenes/demo/USA_IL_Chicago-OHare.Intl.AP.725300_TMY3.epw"
)  # 41.98 N, 87.92 W, zone -6
FIELDS = {"latitude": 6, "longitude": 7, "time zone": 8}


@pytest.fixture
def changed(tmp_path):
    """The demo's weather with fields of its first line changed, or its rows."""

    def make(rows=None, **fields):
        first, rest = EPW.read_text(encoding="latin-1").split("\n", 1)
        parts = first.split(",")
        for name, text in fields.items():
            parts[FIELDS[name.replace("_", " ")]] = text
        if rows is not None:
            lines = rest.split("\n")
            rest = "\n".join([*lines[:7], *(rows(line) for line in lines[7:])])
        path = tmp_path / "city.epw"
        path.write_text(",".join(parts) + "\n" + rest, encoding="latin-1")
        return path

    return make


def field(line: str, column: int, change) -> str:
    parts = line.split(",")
    if len(parts) > column:
        parts[column] = change(parts[column])
    return ",".join(parts)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"time_zone": "9"}, ("time zone", "9.0 h after", "time zone -6 would fit")),
        ({"time_zone": "-4"}, ("time zone", "2.0 h before", "time zone -6 would fit")),
        ({"longitude": "87.92"}, ("longitude: ", "longitude -87.92 would fit")),
        ({"latitude": "-41.98"}, ("latitude: ", "other hemisphere", "41.98 would fit")),
    ],
)
def test_a_sun_in_the_wrong_place_is_refused(changed, fields, words):
    with pytest.raises(DataError) as caught:
        read_epw(changed(**fields))
    for word in ("city.epw", *words):
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("zone", "when"), [("-5", "1.0 h before"), ("-7", "1.0 h after")])
def test_an_hour_is_noted(changed, zone, when):
    (note,) = read_epw(changed(time_zone=zone)).notes
    assert when in note and "values that fit: time zone -6" in note


def test_another_latitude_is_noted(changed):
    (note,) = read_epw(changed(latitude="16")).notes
    assert "3.1 times as much as at latitude 16" in note


def test_kilowatts_are_refused(changed):
    def thousandth(line: str) -> str:
        return field(line, 13, lambda text: f"{float(text) / 1000:.4f}")

    with pytest.raises(DataError, match=r"global horizontal irradiance: .* unit is W/m2"):
        read_epw(changed(thousandth))


def test_sound_files_are_left_alone(real_data):
    """Every file there but one: PVGIS says itself that its radiation is 0.82 h off."""
    files = sorted((real_data / "epw").glob("*.epw"))
    for path in files:
        notes = read_epw(path).notes
        assert bool(notes) == path.name.startswith("PVGIS"), (path.name, notes)
    assert len(files) > 10


def test_every_zone_shows_in_every_file(real_data):
    """An hour of the zone is an hour of the offset, with global radiation and without."""
    for path in sorted((real_data / "epw").glob("*.epw")):
        weather = read_epw(path)
        for radiation in (weather, without_global(weather)):
            days = whole_days(radiation)
            offset = noon_offset(weather.latitude_deg, *days)
            for error in (-9.0, -1.0, 1.0, 8.0):
                hour = (days[2] - error + 12) % 24 - 12
                found = noon_offset(weather.latitude_deg, days[0], days[1], hour)
                difference = (found - offset + error + 12) % 24 - 12
                assert abs(difference) < 0.05, (path.name, error)


def without_global(weather: Weather) -> Weather:
    from dataclasses import replace

    return replace(weather, global_horizontal=None)


def test_wea_files_too(tmp_path):
    path = tmp_path / "city.wea"
    write_wea(read_epw(EPW), path)
    assert read_wea(path).notes == ()
    path.write_text(path.read_text().replace("time_zone 90", "time_zone -30"))
    with pytest.raises(DataError, match=r"time zone: .* 8\.0 h before .*time zone -6 would fit"):
        read_wea(path)


def test_measured_radiation_too(tmp_path):
    path = roof(tmp_path / "roof.csv", 50)
    place = {"latitude_deg": 41.98, "longitude_deg": -87.92}
    assert read_measured(path, **place, timezone_h=-6).notes == ()
    (note,) = read_measured(path, **place, timezone_h=-5).notes  # summer time taken for the zone
    assert "1.1 h before" in note
    with pytest.raises(DataError, match=r"roof\.csv: time zone: .*time zone -6 would fit"):
        read_measured(path, **place, timezone_h=0)


def test_too_little_light_is_no_ground_for_a_judgement(tmp_path):
    rows = epw_rows()
    for row in rows:
        row[13] = row[14] = row[15] = "0"
    assert read_epw(write_epw(tmp_path / "dark.epw", rows)).notes == ()


def test_an_impossible_pressure_is_replaced_and_noted(changed):
    seen = []

    def last_hour(line: str) -> str:
        if line.split(",")[1:4] != ["12", "31", "24"]:
            return line
        seen.append(line)
        return field(line, 9, lambda text: "0")

    path = changed(last_hour)
    assert len(seen) == 1
    (note,) = weather_notes = read_epw(path).notes
    assert re.search(r"1 impossible pressure, in line 8768: 98\d\d\d Pa", note.replace("; ", ": "))
    assert len(weather_notes) == 1
    pressure = read_epw(path).pressure_pa
    assert pressure[-1] == pytest.approx(np.median(pressure), rel=0.03)


def test_a_file_of_pvgis_is_read(changed):
    path = changed()
    path.write_text(path.read_text(encoding="latin-1").replace("SAVINGS", "SAVING"))
    assert read_epw(path).site


def roof(path: Path, days: int, later_h: int = 0) -> Path:
    """A file of measured radiation: the demo's from 31 May on, with later times."""
    weather = read_epw(EPW)
    some = slice(24 * 150, 24 * (150 + days))
    rows = zip(
        weather.midpoints[some] + pd.Timedelta(hours=later_h),
        weather.global_horizontal[some],
        weather.diffuse_horizontal[some],
        strict=True,
    )
    lines = [f"{time.isoformat()},{g},{d}\n" for time, g, d in rows]
    path.write_text("time,global_horizontal,diffuse_horizontal\n" + "".join(lines))
    return path


def test_six_hours_are_refused_from_five_days_on_and_one_is_noted_from_thirty(tmp_path):
    place = {"latitude_deg": 41.98, "longitude_deg": -87.92}
    assert not read_measured(roof(tmp_path / "four.csv", 4), **place, timezone_h=0).notes
    with pytest.raises(DataError, match=r"centred 6\.2 h before"):
        read_measured(roof(tmp_path / "five.csv", 5), **place, timezone_h=0)
    assert not read_measured(roof(tmp_path / "29.csv", 29), **place, timezone_h=-5).notes
    assert read_measured(roof(tmp_path / "31.csv", 31), **place, timezone_h=-5).notes


@pytest.mark.parametrize(("later_h", "noted"), [(3, False), (4, True)])
def test_a_clock_far_from_its_longitude_is_noted_though_the_sun_agrees(tmp_path, later_h, noted):
    """15 degrees west for each hour later; O'Hare's clock is 0.14 h before its longitude."""
    place = {"latitude_deg": 41.98, "longitude_deg": -87.92 - 15.0 * later_h}
    path = roof(tmp_path / "west.csv", 40, later_h)
    notes = read_measured(path, **place, timezone_h=-6).notes
    expected = "time zone -6 differs by 3.9 h from longitude -147.92"
    assert len(notes) == noted and all(expected in note for note in notes)
