"""EPW and WEA files: what is read, what is derived, and one clear line for each kind of fault."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from weather_files import epw_rows, write_epw

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.epw import read_epw, read_wea, spikes, write_wea
from mitsuba_cfs.sky.weather import relative_humidity
from mitsuba_cfs.sky.weather_table import EpwColumns, epw_ground, epw_location, year_of

FEBRUARY_3_14H = 24 * (31 + 2) + 13  # row of the hour that ends at 14:00
DNI, DRY, DEW, HUMIDITY, PRESSURE, INFRARED, COVER, WIND = 14, 6, 7, 8, 9, 12, 23, 21


def test_reads_site_and_series(tmp_path, year):
    year[FEBRUARY_3_14H][DNI] = "123"
    weather = read_epw(write_epw(tmp_path / "a.epw", year))
    assert weather.site == "Testville, XYZ"
    assert (weather.latitude_deg, weather.longitude_deg) == (48.0, 8.0)
    assert (weather.timezone_h, weather.elevation_m, weather.step_h) == (1.0, 250.0, 1.0)
    assert weather.direct_normal[FEBRUARY_3_14H] == 123
    assert weather.times[FEBRUARY_3_14H].strftime("%m-%d %H:%M") == "02-03 14:00"
    assert weather.midpoints[FEBRUARY_3_14H].strftime("%m-%d %H:%M") == "02-03 13:30"
    assert weather.times[-1].strftime("%m-%d %H:%M") == "01-01 00:00"
    assert weather.ground_depth_m == [0.5]
    assert weather.ground_temperature_c[0, 11] == 12
    assert weather.direct_normal_illuminance is None  # the file marks it missing


@pytest.mark.peer
def test_columns_agree_with_pvlib(chicago):
    from pvlib import iotools

    ours, (theirs, site) = read_epw(chicago), iotools.read_epw(chicago)
    assert (site["latitude"], site["longitude"]) == (ours.latitude_deg, ours.longitude_deg)
    assert (site["TZ"], site["altitude"]) == (ours.timezone_h, ours.elevation_m)
    pairs = {
        "ghi": ours.global_horizontal,
        "dni": ours.direct_normal,
        "dhi": ours.diffuse_horizontal,
        "global_hor_illum": ours.global_horizontal_illuminance,
        "direct_normal_illum": ours.direct_normal_illuminance,
        "diffuse_horizontal_illum": ours.diffuse_horizontal_illuminance,
        "temp_air": ours.dry_bulb_c,
        "temp_dew": ours.dew_point_c,
        "atmospheric_pressure": ours.pressure_pa,
        "wind_speed": ours.wind_speed,
        "wind_direction": ours.wind_direction_deg,
        "ghi_infrared": ours.horizontal_infrared,
    }
    for name, values in pairs.items():
        np.testing.assert_array_equal(values, theirs[name].to_numpy(dtype=float), err_msg=name)
    np.testing.assert_allclose(ours.relative_humidity * 100, theirs["relative_humidity"])


@pytest.mark.parametrize(("steps", "leap"), [(1, True), (2, False), (4, True)])
def test_leap_years_and_parts_of_hours(tmp_path, steps, leap):
    weather = read_epw(write_epw(tmp_path / "a.epw", epw_rows(steps, leap), steps))
    assert len(weather.times) == 24 * steps * (366 if leap else 365)
    assert weather.step_h == 1 / steps
    assert weather.times[0].minute == (60 // steps) % 60
    assert weather.times[24 * steps * 59].strftime("%m-%d") == ("02-29" if leap else "03-01")


def test_missing_fields_that_can_be_derived(tmp_path, year):
    for row in year:
        row[PRESSURE], row[DEW], row[INFRARED] = "999999", "99.9", "9999"
    weather = read_epw(write_epw(tmp_path / "a.epw", year))
    # standard atmosphere at 250 m (ASHRAE table: 98.36 kPa); dew point of 10 degC and 71 %: 4.97
    np.testing.assert_allclose(weather.pressure_pa, 98358, atol=20)
    np.testing.assert_allclose(weather.dew_point_c, 4.97, atol=0.02)
    back = relative_humidity(weather.dry_bulb_c, weather.dew_point_c)
    np.testing.assert_allclose(back, 0.71, rtol=1e-12)  # the formula and its inverse
    # EnergyPlus's formula worked by hand: eps = (.787 + .764 ln(278.12/273)) 1.0595, T = 283.15
    emissivity = (0.787 + 0.764 * np.log(278.12 / 273)) * (1 + 0.112 - 0.0875 + 0.035)
    np.testing.assert_allclose(weather.horizontal_infrared, emissivity * 5.6704e-8 * 283.15**4, rtol=2e-4)


def test_blank_fields_are_missing_and_a_byte_order_mark_is_not_text(tmp_path, year):
    year[3][DEW], year[4][PRESSURE], year[5][20] = "", " ", ""
    path = write_epw(tmp_path / "a.epw", year)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n") + b"\r\n")
    weather = read_epw(path)
    assert weather.dew_point_c[3] == pytest.approx(4.97, abs=0.02)
    assert weather.pressure_pa[4] == pytest.approx(98358, abs=20)
    assert weather.wind_direction_deg is None
    for row in year[6:13]:
        row[DNI] = ""
    with pytest.raises(DataError, match="line 15: direct normal irradiance: missing"):
        read_epw(write_epw(path, year))


def spoil(row, column, text):
    def change(rows):
        rows[row][column] = text
        return rows

    return change


def gap(row, column, text, hours=7):
    def change(rows):
        for at in range(row, row + hours):
            rows[at][column] = text
        return rows

    return change


FAULTS = {
    "missing DNI": (gap(FEBRUARY_3_14H, DNI, "9999"), ("line 814", "direct normal", "hour 14")),
    "no number": (spoil(9, DNI, "abc"), ("line 18", "direct normal irradiance", "'abc'")),
    "not finite": (spoil(9, DRY, "nan"), ("line 18", "dry bulb temperature", "'nan'")),
    "negative": (spoil(9, DNI, "-5"), ("line 18", "0 to 1500", "-5")),
    "missing temperature": (spoil(0, DRY, "99.9"), ("line 9", "dry bulb temperature", "missing")),
    "dew and humidity": (
        lambda rows: gap(3, DEW, "99.9")(gap(3, HUMIDITY, "999")(rows)),
        ("line 12", "relative humidity", "7 hours"),
    ),
    "hour left out": (lambda rows: rows[:100] + rows[101:], ("line 109", "expected month 1, day 5")),
    "hour twice": (lambda rows: rows[:100] + rows[99:], ("line 109", "expected month 1, day 5")),
    "rows swapped": (lambda rows: [*rows[:50], rows[51], rows[50], *rows[52:]], ("line 59", "out of order")),
    "half a year": (lambda rows: rows[:4380], ("8760 or 8784", "4380 rows")),
    "one hour short": (lambda rows: rows[:-1], ("8760 or 8784", "8759 rows")),
    "no rows": (lambda rows: [], ("8760 or 8784", "0 rows")),
    "short row": (lambda rows: [*rows[:-1], rows[-1][:10]], ("line 8768", "24 fields")),
}


def test_gaps_of_six_hours_are_interpolated_and_noted(tmp_path, year):
    year[99][DRY], year[106][DRY] = "3.0", "10.0"
    for change in (gap(100, DRY, "99.9", 6), gap(40, DEW, "99.9", 2), gap(40, HUMIDITY, "999", 2)):
        change(year)
    weather = read_epw(write_epw(tmp_path / "a.epw", year))
    np.testing.assert_allclose(weather.dry_bulb_c[99:107], np.arange(3.0, 11.0))
    np.testing.assert_allclose(weather.relative_humidity[39:43], 0.71)
    notes = " ".join(weather.notes)
    assert "dry bulb temperature: 6 missing values, the first in line 109, are interp" in notes
    assert "relative humidity: 2 missing values, the first in line 49, are interp" in notes


@pytest.mark.parametrize(
    ("column", "text", "words"),
    [
        (DRY, "70", "dry bulb temperature: 1 implausible value, in line 109: 70"),
        (DRY, "40", "dry bulb temperature: 1 implausible value, in line 109: 40"),
        (DRY, "-20", "dry bulb temperature: 1 implausible value, in line 109: -20"),
        (DEW, "30", "dew point temperature: 1 implausible value, in line 109: 30"),
        (HUMIDITY, "0", "relative humidity: 1 implausible value, in line 109: 0"),
        (WIND, "75", "wind speed: 1 implausible value, in line 109: 75"),
    ],
)
def test_values_that_no_weather_has_are_named(tmp_path, year, column, text, words):
    path = write_epw(tmp_path / "plain.epw", year)
    year[100][column] = text
    weather = read_epw(write_epw(tmp_path / "a.epw", year))
    assert any(words in note for note in weather.notes)
    assert not any("implausible" in note for note in read_epw(path).notes)


@pytest.mark.parametrize(("column", "text"), [(DEW, "10.0"), (HUMIDITY, "1"), (DRY, "24"), (WIND, "55"), (DEW, "-9")])
def test_fog_a_desert_and_a_storm_are_weather(tmp_path, year, column, text):
    """Dew point at the temperature, 1 % humidity, 14 K in an hour, a storm of 55 m/s."""
    year[100][column] = text
    notes = read_epw(write_epw(tmp_path / "a.epw", year)).notes
    assert not any("implausible" in note for note in notes)


@pytest.mark.parametrize(
    ("column", "text", "named"),
    [
        (DRY, "-67.9", False),
        (DRY, "-68.1", True),
        (DRY, "56.9", False),
        (DRY, "57.1", True),
        (WIND, "59.9", False),
        (WIND, "60.1", True),
    ],
)
def test_records_of_the_earth_bound_what_is_named(tmp_path, year, column, text, named):
    """-67.8 degC outside Antarctica, 56.7 degC, 60 m/s, all year so that nothing jumps."""
    for row in year:
        row[column] = text
    notes = read_epw(write_epw(tmp_path / "a.epw", year)).notes
    field = {DRY: "dry bulb", WIND: "wind speed"}[column]
    assert named == any(field in note and "implausible" in note for note in notes)


def test_a_spike_is_one_value_far_from_both_of_its_neighbours():
    assert spikes(np.array([10.0, 10, 40, 10, 10])).tolist() == [False, False, True, False, False]
    assert spikes(np.array([10.0, 10, -20, 10, 10])).tolist() == [False, False, True, False, False]
    assert spikes(np.array([10.0, 10, 25.5, 10, 10])).tolist() == [False, False, True, False, False]
    for sound in ([10.0, 10, 40, 40, 10, 10], [10.0, 24, 10, 10], [10.0, 24.9, 10, 10], [-20.0, -6, 8, 22, 22, 8, -6]):
        assert not spikes(np.array(sound)).any()


def test_an_impossible_pressure_is_the_standard_atmospheres(tmp_path, year):
    """At 250 m 98.36 kPa (ASHRAE's table); what else is missing is derived without a note."""
    year[100][PRESSURE], year[200][PRESSURE] = "0", "999999"
    weather = read_epw(write_epw(tmp_path / "a.epw", year))
    np.testing.assert_allclose(weather.pressure_pa[[100, 200]], 98358, atol=20)
    assert weather.pressure_pa[99] == 98000
    notes = [note for note in weather.notes if "pressure" in note]
    assert len(notes) == 1 and "1 impossible pressure, in line 109; 98358 Pa" in notes[0]


# Column, mark of a missing value (EnergyPlus' data dictionary), values that are read and refused
FIELDS = {
    "dry bulb temperature": (6, "99.9", ("-90", "70"), ("-90.1", "70.1")),
    "dew point temperature": (7, "99.9", ("-90", "70"), ("-90.1", "70.1")),
    "relative humidity": (8, "999", ("0", "110"), ("-1", "111")),
    "pressure": (9, "999999", ("31000", "120000"), ("30999", "120001")),
    "horizontal infrared irradiance": (12, "9999", ("0", "1000"), ("-1", "1001")),
    "global horizontal irradiance": (13, "9999", ("0", "1800"), ("-1", "1801")),
    "direct normal irradiance": (14, "9999", ("0", "1500"), ("-1", "1501")),
    "diffuse horizontal irradiance": (15, "9999", ("0", "1500"), ("-1", "1501")),
    "global horizontal illuminance": (16, "999999", ("0", "250000"), ("-1", "250001")),
    "direct normal illuminance": (17, "999999", ("0", "250000"), ("-1", "250001")),
    "diffuse horizontal illuminance": (18, "999900", ("0", "250000"), ("-1", "250001")),
    "wind direction": (20, "999", ("0", "360"), ("-1", "361")),
    "wind speed": (21, "999", ("0", "80"), ("-1", "81")),
    "total sky cover": (22, "99", ("0", "10"), ("-1", "11")),
    "opaque sky cover": (23, "99", ("0", "10"), ("-1", "11")),
    "snow depth": (30, "999", ("0", "998"), ("-1", "998.5")),
    "albedo": (32, "999", ("0.01", "1"), ("0", "1.01")),
}


@pytest.mark.parametrize("field", FIELDS)
def test_every_field_has_its_column_its_mark_of_missing_and_its_bounds(field):
    column, missing, good, bad = FIELDS[field]

    def columns(text: str) -> EpwColumns:
        rows = [[good[0]] * 35, ["0"] * 35]
        rows[1][0:4], rows[1][column] = ["1999", "1", "2", "3"], text
        return EpwColumns("a.epw", 8, [",".join(row) for row in rows])

    for text in good:
        assert columns(text)._values(field)[1] == float(text)
        assert columns(text).plausible(field)[0][1] == float(text)
    assert np.isnan(columns(missing).optional(field)[1])
    assert np.isnan(columns(" ").optional(field)[1])
    for text in bad:
        value, wrong = columns(text).plausible(field)
        assert np.isnan(value[1]) and wrong[1] and np.isnan(columns(text).unchecked(field)[1])
        with pytest.raises(DataError, match=rf"a\.epw: line 10: {field}: expected .* got {text}"):
            columns(text).optional(field)
    with pytest.raises(DataError, match=rf"{field}: .* got 'x' \(month 1, day 2, hour 3\)"):
        columns("x").optional(field)


@pytest.mark.parametrize("steps", [1, 2])
def test_a_gap_of_more_than_six_hours_and_one_at_either_end_is_refused(steps):
    """By steps of an hour or half an hour; the values between are on a line."""

    def columns(missing: slice) -> EpwColumns:
        rows = [["0"] * 35 for _ in range(24 * 365 * steps)]
        for row, fields in enumerate(rows):
            fields[21] = str(row % 60)
        for fields in rows[missing]:
            fields[21] = "999"
        return EpwColumns("a.epw", 8, [",".join(row) for row in rows])

    filled = columns(slice(10, 10 + 6 * steps)).required("wind speed")
    assert filled[:40] == pytest.approx(np.arange(40))
    for start, hours in ((10, 6), (0, 1), (24 * 365 * steps - 1, 1)):
        stop = start + hours * steps + (start == 10)
        with pytest.raises(DataError, match=f"line {start + 9}: wind speed: missing"):
            columns(slice(start, stop)).required("wind speed")


def test_a_year_is_the_files_own_where_its_days_fit():
    assert year_of(np.array([1999]), leap=False) == 1999
    assert year_of(np.array([2000]), leap=True) == 2000
    for years, leap, stands_for in (
        ([1999], True, 2012),
        ([2000], False, 2017),
        ([1899], False, 2017),
        ([2101], False, 2017),
        ([1998, 1999], False, 2017),
    ):
        assert year_of(np.array(years), leap=leap) == stands_for
    assert year_of(np.array([1901]), leap=False) == 1901
    assert year_of(np.array([2099]), leap=False) == 2099


@pytest.mark.parametrize(
    ("number", "name", "most"),
    [(6, "latitude", 90), (7, "longitude", 180), (8, "time zone", 14), (9, "elevation", 9000)],
)
def test_a_place_is_on_earth(number, name, most):
    def site(value):
        parts = ["LOCATION", "City", "-", "XYZ", "", "0", "1", "2", "3", "4"]
        parts[number] = str(value)
        return epw_location([",".join(parts)], "a.epw")

    for value in (-most, most):
        assert getattr(site(value), f"{name.replace(' ', '')}_{UNITS[name]}") == value
    for value in (-most - 0.1, most + 0.1):
        with pytest.raises(DataError, match=f"a.epw: {name}: expected -{most} to {most}, got"):
            site(value)
    assert site(0).name == "City, XYZ"


def test_ground_temperatures_are_those_of_each_depth():
    blocks = [["0.5", "", "", "", *map(str, range(1, 13))], ["2", "", "", "", *map(str, range(13, 25))]]

    def ground(*fields: str):
        return epw_ground(["", "", "", ",".join(["GROUND TEMPERATURES", *fields])], "a.epw")

    depth, months = ground("2", *blocks[0], *blocks[1])
    assert depth.tolist() == [0.5, 2.0]
    np.testing.assert_array_equal(months, np.arange(1.0, 25.0).reshape(2, 12))
    assert ground("0") == ground("") == (None, None)
    for fields, words in (
        (("2", *blocks[0]), "expected 32 fields for 2 depths, got 16"),
        (("x", *blocks[0]), "expected a number, got 'x'"),
        (("1", "deep", *blocks[0][1:]), "ground depth: expected a number, got 'deep'"),
        (("1", *blocks[0][:-1], "cold"), "ground temperature: expected a number, got 'cold'"),
    ):
        with pytest.raises(DataError, match=f"a.epw: line 4: .*{words}"):
            ground(*fields)


UNITS = {"latitude": "deg", "longitude": "deg", "time zone": "h", "elevation": "m"}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_name_line_and_field(tmp_path, year, fault):
    change, words = FAULTS[fault]
    path = write_epw(tmp_path / "bad.epw", change(year))
    with pytest.raises(DataError) as caught:
        read_epw(path)
    for word in (*words, "bad.epw"):
        assert word in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("LOCATION", "LOCATON", ("not an EPW",)),
        (",48.0,", ",98.0,", ("latitude", "98")),
        (",8.0,1.0", ",east,1.0", ("longitude", "'east'")),
        ("DATA PERIODS", "DATA", ("line 8", "DATA PERIODS")),
        ("TURES,1,.5", "TURES,2,.5", ("line 4", "GROUND TEMPERATURES")),
    ],
)
def test_header_faults(tmp_path, year, old, new, words):
    path = write_epw(tmp_path / "bad.epw", year[:24])
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(DataError) as caught:
        read_epw(path)
    for word in words:
        assert word in str(caught.value)


def test_missing_file(tmp_path):
    with pytest.raises(DataError, match=r"nowhere\.epw: cannot be read"):
        read_epw(tmp_path / "nowhere.epw")


@pytest.mark.parametrize("steps", [1, 4])
def test_wea_round_trip(tmp_path, steps):
    weather = read_epw(write_epw(tmp_path / "a.epw", epw_rows(steps), steps))
    write_wea(weather, tmp_path / "a.wea")
    back = read_wea(tmp_path / "a.wea")
    assert (back.latitude_deg, back.longitude_deg, back.timezone_h) == (48.0, 8.0, 1.0)
    assert back.step_h == weather.step_h
    np.testing.assert_array_equal(back.direct_normal, weather.direct_normal)
    np.testing.assert_array_equal(back.diffuse_horizontal, weather.diffuse_horizontal)
    assert list(back.times.strftime("%j %H:%M")) == list(weather.times.strftime("%j %H:%M"))


@pytest.mark.peer
def test_wea_is_what_epw2wea_writes(tmp_path, chicago, radiance):
    import subprocess

    theirs = tmp_path / "theirs.wea"
    subprocess.run([radiance / "epw2wea", chicago, theirs], check=True)
    ours, back = read_epw(chicago), read_wea(theirs)
    assert (back.longitude_deg, back.timezone_h) == (ours.longitude_deg, ours.timezone_h)
    np.testing.assert_array_equal(back.direct_normal, ours.direct_normal)
    assert list(back.times.strftime("%j %H:%M")) == list(ours.times.strftime("%j %H:%M"))


WEA = """place A_B
latitude 48
longitude -8
time_zone -15
site_elevation 250
weather_data_file_units {unit}
"""


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("1 1 0.5 0 0\n1 1 1.5 0\n", ("line 8", "month day hour")),
        ("1 1 0.5 0 0\n1 1 1.5 x 0\n", ("line 8", "direct irradiance")),
        ("1 1 0.5 0 0\n1 1 1.5 0 0\n1 1 3.5 0 0\n", ("line 9", "missing")),
        ("1 1 1.5 0 0\n1 1 0.5 0 0\n", ("line 8", "out of order")),
        ("1 1 0.5 0 0\n1 1 1.5 0 0\n", ("8760 or 8784", "2 rows")),
        ("2 30 0.5 0 0\n", ("line 7", "not a date")),
        ("1 1 24.5 0 0\n", ("line 7", "not a date")),
    ],
)
def test_wea_faults(tmp_path, rows, words):
    path = tmp_path / "bad.wea"
    path.write_text(WEA.format(unit=1) + rows)
    with pytest.raises(DataError) as caught:
        read_wea(path)
    for word in words:
        assert word in str(caught.value)


def test_wea_of_some_hours_and_of_horizontal_direct(tmp_path):
    path = tmp_path / "a.wea"
    path.write_text(WEA.format(unit=2) + "3 21 12.5 300 100\n6 21 12.5 700 90\n6 21 23.5 0 0\n")
    weather = read_wea(path, whole_year=False)
    assert list(weather.global_horizontal) == [400, 790, 0]
    # near solar noon the altitude is 42 degrees plus the declination (0.0 and 23.4 degrees);
    # the time is within half an hour of noon, which costs 0.5 degrees or 1 %
    noon = np.radians([42.0, 65.4])
    np.testing.assert_allclose(weather.direct_normal[:2], [300, 700] / np.sin(noon), rtol=0.015)
    assert weather.direct_normal[2] == 0


def test_rain_is_the_epws_liquid_precipitation(tmp_path, year):
    """N33 of the data dictionary [mm]; N34 beside it is the hours that it fell in."""
    for number, row in enumerate(year):
        row[33:35] = ["7.5" if number < 10 else "0", "1"]
    weather = read_epw(write_epw(tmp_path / "a.epw", year))
    np.testing.assert_allclose(weather.rain_mm[:11], [7.5] * 10 + [0.0])


def test_steps_of_a_day_go_by_their_length(tmp_path, year):
    """24 of an hour, 48 of half an hour, 1,440 of a minute."""
    weather = read_epw(write_epw(tmp_path / "a.epw", year))
    assert [replace(weather, step_h=step).per_day for step in (1.0, 0.5, 1 / 60)] == [24, 48, 1440]


def test_a_missing_infrared_is_estimated_in_its_hour_alone(tmp_path, year):
    """From the cover of the sky; without that, the hour is named."""
    year[FEBRUARY_3_14H][INFRARED] = "9999"
    weather = read_epw(write_epw(tmp_path / "a.epw", year))
    stated = np.array([float(row[INFRARED]) for row in year])
    others = np.arange(8760) != FEBRUARY_3_14H
    np.testing.assert_array_equal(weather.horizontal_infrared[others], stated[others])
    assert 200 < weather.horizontal_infrared[FEBRUARY_3_14H] < 400
    year[FEBRUARY_3_14H][COVER] = year[FEBRUARY_3_14H][COVER - 1] = "99"
    with pytest.raises(DataError, match="missing, and so is the sky cover") as caught:
        read_epw(write_epw(tmp_path / "a.epw", year))
    assert caught.value.field == "horizontal infrared irradiance"


@pytest.mark.parametrize("line", range(6))
def test_each_line_of_the_head_of_a_wea_is_asked_for(tmp_path, year, line):
    path = tmp_path / "a.wea"
    write_wea(read_epw(write_epw(tmp_path / "a.epw", year)), path)
    head = path.read_text().splitlines()[:6]
    for lines in (head[:line] or ["another"], [*head[:line], "another 1", *head[line + 1 :]]):
        path.write_text("\n".join(lines) + "\n")
        with pytest.raises(DataError, match="expected the header") as caught:
            read_wea(path)
        assert caught.value.element == f"line {line + 1}"


@pytest.mark.parametrize(
    ("latitude", "longitude", "good"),
    [(90, 180, True), (-90, -180, True), (90.5, 0, False), (-90.5, 0, False), (0, 180.5, False), (0, -180.5, False)],
)
def test_a_weather_is_of_a_place_on_earth(chicago, latitude, longitude, good):
    changes = {"latitude_deg": latitude, "longitude_deg": longitude}
    if good:
        assert replace(read_epw(chicago), **changes).latitude_deg == latitude
    else:
        with pytest.raises(ValueError, match="expected latitude"):
            replace(read_epw(chicago), **changes)


def test_days_of_the_week_count_from_the_files_first(chicago):
    """January 1 of the file's own weekday; January 8 is the same."""
    for first in range(7):
        weekday = replace(read_epw(chicago), first_weekday=first).weekday
        assert weekday[:24].tolist() == [first] * 24
        assert weekday[24] == (first + 1) % 7 and weekday[7 * 24] == first
