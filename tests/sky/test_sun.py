"""Sun positions: published ones, gendaymtx's own, the axes, and DNI from global and diffuse."""

from __future__ import annotations

import subprocess

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.sky import sun
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.weather import Weather


def weather_at(times, latitude=0.0, longitude=0.0, zone=0.0, elevation=0.0, **series) -> Weather:
    """Weather whose interval middles are the given times."""
    middle = pd.DatetimeIndex(times)
    none = np.zeros(len(middle))
    ends = middle + pd.Timedelta(minutes=30)
    return Weather("x", latitude, longitude, zone, elevation, 1.0, ends, none, none, **series)


def test_spa_is_that_of_its_paper():
    """Reda and Andreas's worked example: 17 October 2003, 12:30:30 in Golden, Colorado."""
    weather = weather_at(
        ["2003-10-17 12:30:30"],
        39.742476,
        -105.1786,
        -7.0,
        1830.14,
        pressure_pa=np.array([82000.0]),
        dry_bulb_c=np.array([11.0]),
    )
    towards = sun.sun_directions(weather)
    # zenith 50.11162 and azimuth 194.34024 degrees, to the table's digits
    assert np.degrees(sun.altitude(towards))[0] == pytest.approx(90 - 50.11162, abs=1e-4)
    assert np.degrees(sun.azimuth(towards))[0] == pytest.approx(194.34024, abs=1e-4)


@pytest.mark.parametrize("model", sun.SUN_MODELS)
def test_the_sun_goes_where_it_should(model):
    hours = ["2017-06-21 06:00", "2017-06-21 12:00", "2017-06-21 18:00", "2017-06-21 00:00"]
    east, noon, west, night = sun.sun_directions(weather_at(hours, 48.0, 15.0, 1.0), model=model)
    assert east[0] > 0.9 and west[0] < -0.9  # x is east
    assert noon[1] < 0 and night[1] > 0  # noon sun in the south: y is north
    assert night[2] < 0 < noon[2]
    assert np.degrees(np.arcsin(noon[2])) == pytest.approx(90 - 48 + 23.44, abs=0.3)
    south = sun.sun_directions(weather_at(hours, -48.0, 15.0, 1.0), model=model)[1]
    assert south[1] > 0  # noon sun in the north


def test_energyplus_day_of_the_sun_is_late():
    """EnergyPlus 25.2's own output for Phoenix, mean of the six steps of the hour that ends at 13 h."""
    theirs = {"2017-01-15": 35.13, "2017-03-21": 56.27, "2017-06-15": 79.08, "2017-09-23": 56.35, "2017-11-15": 37.82}
    apart = {}
    for day, printed in theirs.items():
        steps = pd.date_range(f"{day} 12:10", periods=6, freq="10min")
        weather = weather_at(steps, 33.45, -111.98, -7.0, 337.0)
        mean = {m: np.degrees(sun.altitude(sun.sun_directions(weather, model=m))).mean() for m in ("spa", "energyplus")}
        assert mean["energyplus"] == pytest.approx(printed, abs=0.01)
        apart[day] = mean["energyplus"] - mean["spa"]
    # a day and a half late: 0.6 degrees at the equinoxes, almost none at the solstice
    assert apart["2017-03-21"] == pytest.approx(-0.59, abs=0.03)
    assert apart["2017-09-23"] == pytest.approx(0.58, abs=0.03)
    assert abs(apart["2017-06-15"]) < 0.08


def test_longitude_and_time_zone():
    """15 degrees further east, one hour earlier by the zone's clock."""
    first = weather_at(["2017-03-05 09:00"], 30.0, 15.0, 1.0)
    second = weather_at(["2017-03-05 08:00"], 30.0, 30.0, 1.0)
    third = weather_at(["2017-03-05 10:00"], 30.0, 30.0, 3.0)
    expected = sun.sun_directions(first, model="radiance")
    for other in (second, third):
        np.testing.assert_allclose(sun.sun_directions(other, model="radiance"), expected)


@pytest.mark.parametrize(
    ("latitude", "longitude", "zone"),
    [
        (78.22, 15.63, 1.0),
        (27.70, 85.32, 5.75),
        (-34.93, 138.60, 9.5),
        (47.56, -52.71, -3.5),
        (-54.80, -68.30, -3.0),
        (-70.67, -8.27, 0.0),
        (19.09, 72.85, 5.5),
        (0.0, 179.0, 12.0),
    ],
)
def test_noon_is_by_longitude_and_zone_on_every_side_of_the_equator(latitude, longitude, zone):
    """21 March 2023: 7.4 min late by the equation of time; the equinox was 20 March, 21:24 UTC."""
    minutes = pd.date_range("2023-03-21", periods=24 * 60, freq="min")
    towards = sun.sun_directions(weather_at(minutes, latitude, longitude, zone))
    highest = int(np.argmax(towards[:, 2]))
    assert highest / 60 == pytest.approx(12 + zone - longitude / 15 + 7.4 / 60, abs=0.02)
    declination = 0.395 * (highest / 60 - zone + 2.6) / 24  # degrees a day near the equinox
    height = 90 - abs(latitude - declination)
    assert np.degrees(np.arcsin(towards[highest, 2])) == pytest.approx(height, abs=0.1)
    if latitude:
        assert towards[highest, 1] * latitude < 0  # toward the equator


@pytest.mark.parametrize(("latitude", "year"), [(78.22, 2023), (-70.67, 2023), (67.0, 2024)])
def test_polar_night_and_midnight_sun_have_their_days(latitude, year):
    """The sun stays down where tan(latitude) tan(declination) is below -1 (declination: Spencer
    1971, 0.05 degrees), give or take refraction (0.6) and the change in half a day (0.2)."""
    hours = pd.date_range(f"{year}-01-01 00:30", f"{year}-12-31 23:30", freq="10min")
    up = sun.is_up(sun.sun_directions(weather_at(hours, latitude, 0.0, 0.0)))
    by_day = pd.Series(up).groupby(hours.day_of_year)
    g = 2 * np.pi * (np.arange(by_day.ngroups) + 0.5) / by_day.ngroups
    declination = (
        0.006918
        - 0.399912 * np.cos(g)
        + 0.070257 * np.sin(g)
        - 0.006758 * np.cos(2 * g)
        + 0.000907 * np.sin(2 * g)
        - 0.002697 * np.cos(3 * g)
        + 0.00148 * np.sin(3 * g)
    )
    lowest = np.degrees(np.abs(np.radians(latitude) + declination)) - 90
    highest = 90 - np.degrees(np.abs(np.radians(latitude) - declination))
    for days, bound in ((by_day.sum() == 0, -highest), (by_day.mean() == 1, lowest)):
        assert days.sum() >= np.count_nonzero(bound > 0.85)
        assert days.sum() <= np.count_nonzero(bound > -0.85)
    assert (latitude == 67.0) or (by_day.sum() == 0).sum() > 60


@pytest.mark.peer
def test_radiance_model_is_that_of_gendaymtx(tmp_path, chicago, radiance):
    path = tmp_path / "suns.rad"
    subprocess.run([radiance / "gendaymtx", "-D", path, "-n", chicago], check=True)
    lines = [line.split() for line in path.read_text().splitlines() if line.startswith("4 ")]
    theirs = np.array([line[1:4] for line in lines], dtype=float)
    ours = sun.sun_directions(read_epw(chicago), model="radiance")
    ours = ours[sun.is_up(ours)]
    np.testing.assert_allclose(ours, theirs, atol=1e-6)  # six printed digits


@pytest.mark.peer
def test_spa_explains_measured_global_better(chicago):
    """Global = diffuse + normal sin(altitude) in the file itself judges the position."""
    weather = read_epw(chicago)
    residual = {}
    for model in sun.SUN_MODELS:
        sine = np.maximum(sun.sun_directions(weather, model=model)[:, 2], 0.0)
        whole = weather.diffuse_horizontal + weather.direct_normal * sine
        residual[model] = np.sqrt(np.mean((whole - weather.global_horizontal) ** 2))
    assert residual["spa"] < 0.7 * residual["radiance"]


def test_rotation_is_counter_clockwise_from_above():
    np.testing.assert_allclose(sun.rotated([[1.0, 0, 0.5]], 90), [[0, 1, 0.5]], atol=1e-15)


def test_azimuth_and_altitude_are_inverse_to_direction():
    altitude, azimuth = np.array([-0.3, 0.1, 1.2]), np.array([0.2, 3.0, 6.0])
    towards = sun.direction(altitude, azimuth)
    np.testing.assert_allclose(sun.altitude(towards), altitude)
    np.testing.assert_allclose(sun.azimuth(towards), azimuth)
    np.testing.assert_allclose(sun.direction(0.0, np.pi / 2), [1, 0, 0], atol=1e-15)


def test_direct_normal_from_global():
    sine = np.sin(np.radians([30.0, 30.0, 2.9, 3.1, -5.0, 4.0]))
    whole = np.array([500.0, 90.0, 50.0, 50.0, 10.0, 500.0])
    diffuse = np.array([100.0, 100.0, 20.0, 20.0, 0.0, 0.0])
    found = sun.direct_normal_from_global(whole, diffuse, sine)
    assert found[0] == pytest.approx(800)
    assert found[1] == 0  # more diffuse than global: a measuring error
    assert found[2] == 0 and found[3] == pytest.approx(30 / sine[3])  # the guard
    assert found[4] == 0  # at night
    assert found[5] == pytest.approx(1408.6, abs=0.1)  # not above what arrives from space


def test_weather_turned_round_the_model():
    """Turning a south window's room by 50 degrees: it sees sun and wind as a window at 230 does."""
    hours = pd.date_range("2017-06-21 05:00", periods=14, freq="h")
    wind = np.linspace(0.0, 350.0, len(hours))
    weather = weather_at(hours, 48.0, 15.0, 1.0, wind_direction_deg=wind)
    turned = weather.turned(20.0).turned(30.0)
    south, facade = (sun.direction(0.0, np.radians(angle)) for angle in (180.0, 230.0))
    for model in sun.SUN_MODELS:
        seen = sun.sun_directions(turned, model=model) @ south
        assert seen == pytest.approx(sun.sun_directions(weather, model=model) @ facade, abs=1e-12)
    assert np.mod(turned.wind_direction_deg - 180.0, 360.0) == pytest.approx(np.mod(wind - 230.0, 360.0), abs=1e-9)


def test_figures_of_the_disc():
    """Radiance's disc of 0.533 degrees: pi r^2 = 6.7966e-5 sr."""
    assert pytest.approx(np.pi * np.radians(0.2665) ** 2, rel=1e-5) == sun.SUN_SOLID_ANGLE
    assert np.degrees(sun.SUN_RADIUS) == pytest.approx(0.2665)
    assert sun.SOLAR_CONSTANT == 1361.0  # Kopp and Lean 2011


def test_day_of_the_sun_is_of_minutes_and_those_of_the_weather():
    weather = weather_at(["2017-06-21 06:00", "2017-06-21 18:30"], 48.0, 15.0, 1.0)
    day = sun.day_of_sun(weather, pd.Timestamp("2017-06-21"))
    assert day.shape == (1441, 3)
    np.testing.assert_allclose(day[[360, 1110]], sun.sun_directions(weather), atol=1e-12)
    turned = sun.day_of_sun(weather.turned(30.0), pd.Timestamp("2017-06-21"))
    np.testing.assert_allclose(turned, sun.rotated(day, 30.0), atol=1e-12)


def test_air_of_the_weather_bends_the_light():
    """Refraction grows with pressure and falls with temperature; without either: standard air."""

    def height(elevation=0.0, **air):
        weather = weather_at(["2017-03-20 06:20"], 0.0, 0.0, 0.0, elevation, **air)
        return np.degrees(sun.altitude(sun.sun_directions(weather))[0])

    plain = height()
    same = height(pressure_pa=np.array([101325.0]), dry_bulb_c=np.array([12.0]))
    assert plain == pytest.approx(same, abs=2e-5)
    assert height(pressure_pa=np.array([70000.0])) < plain - 0.02
    assert height(elevation=3000.0) < plain - 0.02
    assert height(dry_bulb_c=np.array([-30.0])) > plain + 0.01


def test_radiances_formulas_by_hand():
    """sun.c: declination, and solar time at 12:30:36 of day 100, 17 degrees east in zone 1."""
    weather = weather_at(["2017-04-10 12:30:36"], 48.0, 17.0, 1.0)
    declination, hour = sun.declination_and_time(weather)
    assert declination == pytest.approx(0.4093 * np.sin(2 * np.pi / 365 * (100 - 81)))
    equation = 0.170 * np.sin(4 * np.pi / 373 * 20) - 0.129 * np.sin(2 * np.pi / 355 * 92)
    assert hour == pytest.approx(12.51 + equation + 17 / 15 - 1, rel=1e-12)
    d, t = declination[0], np.pi * (hour[0] - 12) / 12
    phi = np.radians(48.0)
    up = np.sin(phi) * np.sin(d) + np.cos(phi) * np.cos(d) * np.cos(t)
    found = sun.sun_directions(weather, model="radiance")[0]
    assert found[2] == pytest.approx(up)
    assert found[0] == pytest.approx(-np.cos(d) * np.sin(t))
    with pytest.raises(ValueError, match="sun model: expected one of"):
        sun.sun_directions(weather, model="other")


def test_a_rotation_keeps_the_height_and_the_horizontal_part():
    np.testing.assert_allclose(sun.rotated([[0.0, 0.0, 0.6]], 30.0), [[0.0, 0.0, 0.6]], atol=1e-15)
    np.testing.assert_allclose(sun.rotated([0.0, 0.8, 0.6], 90.0), [-0.8, 0.0, 0.6], atol=1e-15)


def test_energyplus_time_has_the_harmonics_of_the_earths_orbit():
    """Equation of time: ellipse and obliquity give its four harmonics, to 0.0025 h (9 s) each."""
    noon = pd.date_range("2017-01-01 12:00", periods=365)
    weather = weather_at(noon)
    series = [kind(weather)[1] - 12.0 for kind in (sun.declination_and_time, sun._energyplus_day)]
    orbit, energyplus = (np.fft.rfft(one)[1:5] / 182.5 for one in (_equation_of_time(noon), series[1]))
    np.testing.assert_allclose(energyplus.view(float), orbit.view(float), rtol=0, atol=2.5e-3)


def _equation_of_time(times: pd.DatetimeIndex) -> np.ndarray:
    """Mean less right ascension of the sun [h], by Kepler's orbit: e = 0.0167, 23.44 degrees, 3 January."""
    day = np.arange(len(times)) + 0.5
    mean = 2 * np.pi * (day - 3.5) / 365.25  # anomaly
    eccentric = mean
    for _ in range(20):
        eccentric = mean + 0.0167 * np.sin(eccentric)
    true = 2 * np.arctan2(np.sqrt(1.0167) * np.sin(eccentric / 2), np.sqrt(1 - 0.0167) * np.cos(eccentric / 2))
    perihelion = np.radians(283.1)  # its longitude
    ascension = np.arctan2(np.cos(np.radians(23.44)) * np.sin(true + perihelion), np.cos(true + perihelion))
    apart = (mean + perihelion - ascension + np.pi) % (2 * np.pi) - np.pi
    return 12 / np.pi * apart
