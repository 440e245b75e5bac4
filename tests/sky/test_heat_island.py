"""The heat island of a street: the published equation, its day, and what stays as it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.weather import Weather, dew_point, in_city, maximum_heat_island
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.heat.energyplus import check_twin
from scenes.heat.files import read_files
from scenes.heat.study_file import StudyFile

DAYS = 3
NIGHT = [1.0] * 6 + [0.0] * 13 + [0.5] * 5  # shares of the maximum from midnight on


def _weather(**changes) -> Weather:
    """Three days whose air changes by 10 K a day, more in the morning after the second."""
    hours = np.arange(24 * DAYS)
    clock = hours % 24
    dry = 15.0 - 5.0 * np.cos(2 * np.pi * (clock - 3) / 24)
    dry[52] -= 4.0
    sun = np.where((clock > 6) & (clock < 19), 500.0, 0.0)
    made = Weather(
        site="Here",
        latitude_deg=52.0,
        longitude_deg=5.0,
        timezone_h=1.0,
        elevation_m=0.0,
        step_h=1.0,
        times=pd.date_range("2001-06-01 01:00", periods=24 * DAYS, freq="h"),
        direct_normal=sun,
        diffuse_horizontal=0 * sun,
        global_horizontal=sun,
        dry_bulb_c=dry,
        dew_point_c=np.full(len(hours), 8.0),
        wind_speed=np.full(len(hours), 3.0),
        pressure_pa=np.full(len(hours), 101325.0),
    )
    return replace(made, **changes)


def test_the_maximum_by_hand() -> None:
    """Weather that R's `ediblecity::UHI` has by default: 6.11 W/m2, 1.14 kg/m3, 1007 J/(kg K), 10.8
    K, 2.77 m/s; by a pocket calculator (2 - 0.5 - 0.2) 1.2473 K."""
    found = maximum_heat_island(0.5, 0.2, 6.11 / (1.14 * 1007), 10.8, 2.77)
    assert found == pytest.approx(1.3 * 1.2473, rel=1e-4)


def test_its_exponents() -> None:
    """Sixteen times the sun and twice the wind's inverse, as the equation has them."""
    one = maximum_heat_island(0.5, 0.2, 0.2, 10.0, 3.0)
    assert maximum_heat_island(0.5, 0.2, 3.2, 10.0, 3.0) == pytest.approx(2 * one)
    assert maximum_heat_island(0.5, 0.2, 0.2, 160.0, 3.0) == pytest.approx(8 * one)
    assert maximum_heat_island(0.5, 0.2, 0.2, 10.0, 48.0) == pytest.approx(one / 2)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ((0.1, 0.2, 0.2, 10.0, 3.0), "sky_view: expected 0.2 to 0.9"),
        ((0.5, 0.6, 0.2, 10.0, 3.0), "vegetation: expected 0 to 0.4"),
        ((0.5, 0.2, 0.2, 10.0, 0.0), "without any"),
    ],
)
def test_out_of_its_range_it_is_refused(values: tuple[float, ...], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        maximum_heat_island(*values)


def test_each_day_has_its_own_maximum_from_eight_to_eight() -> None:
    weather = _weather()
    excess = in_city(weather, 0.5, 0.2, NIGHT).dry_bulb_c - weather.dry_bulb_c
    density = 101325.0 / (287.058 * (weather.dry_bulb_c + 273.15))
    heating = (weather.global_horizontal / (density * 1007.0)).reshape(-1, 24).mean(axis=1)
    ranges = [np.ptp(weather.dry_bulb_c[8 + 24 * d : 32 + 24 * d]) for d in range(2)]
    first, second = maximum_heat_island(0.5, 0.2, heating[:2], ranges, 3.0)
    assert second > first + 0.5
    assert excess[20] == pytest.approx(0.5 * first)  # 8 to 9 in the evening
    assert excess[26] == pytest.approx(first)  # after midnight it is still the first day's
    assert excess[12] == pytest.approx(0.0)
    assert excess[44] == pytest.approx(0.5 * second)
    assert excess[50] == pytest.approx(second)
    always = in_city(weather, 0.5, 0.2, [1.0] * 24).dry_bulb_c - weather.dry_bulb_c
    np.testing.assert_allclose(always[8:32], first)
    np.testing.assert_allclose(always[32:56], second)


def test_the_water_in_the_air_stays_and_the_head_says_it() -> None:
    found = in_city(_weather(), 0.5, 0.2, NIGHT)
    np.testing.assert_allclose(dew_point(found.dry_bulb_c, found.relative_humidity), 8.0, atol=1e-6)
    assert "Theeuwes et al. 2017" in found.notes[0]
    assert len(found.notes) == 1
    far = in_city(_weather(latitude_deg=1.3, longitude_deg=103.8), 0.5, 0.2, NIGHT)
    assert "this site is elsewhere" in far.notes[1]


def test_a_calm_day_counts_with_half_a_metre_a_second() -> None:
    calm, slow = (
        in_city(_weather(wind_speed=np.full(24 * DAYS, wind)), 0.5, 0.2, NIGHT).dry_bulb_c for wind in (0.0, 0.5)
    )
    np.testing.assert_array_equal(calm, slow)
    faster = in_city(_weather(wind_speed=np.full(72, 0.55)), 0.5, 0.2, NIGHT).dry_bulb_c
    dry = _weather().dry_bulb_c
    np.testing.assert_allclose((calm - dry)[:5] / (faster - dry)[:5], 1.1**0.25)


def test_without_global_irradiance_it_is_refused() -> None:
    with pytest.raises(ValueError, match="expected global irradiance"):
        in_city(_weather(global_horizontal=None), 0.5, 0.2, NIGHT)


def _study(**island) -> StudyFile:
    table = {
        "weather": WEATHER,
        "system": [{"bsdf": VENETIAN_BLIND}],
        "box": {"width": 4, "depth": 5, "height": 3, "window": []},
        "heat_island": {"sky_view": 0.5, "vegetation": 0.1, "hourly_shares": NIGHT} | island,
    }
    return StudyFile.model_validate(table)


def test_a_study_has_the_air_of_a_street() -> None:
    weather = read_files(_study()).weather
    plain = read_files(_study().model_copy(update={"heat_island": None})).weather
    excess = (weather.dry_bulb_c - plain.dry_bulb_c).reshape(-1, 24)
    assert 1.0 < excess[:, 2].mean() < 6.0
    np.testing.assert_allclose(excess[:, 12], 0.0, atol=1e-9)
    assert "air of an urban street" in " ".join(weather.notes)


def test_a_study_out_of_range_is_one_line() -> None:
    with pytest.raises(DataError, match="sky_view: expected") as found:
        read_files(_study(sky_view=0.05))
    assert found.value.field == "heat_island"


def test_energyplus_is_not_given_a_street() -> None:
    with pytest.raises(DataError, match="without a heat island"):
        check_twin(_study())


def test_limits_and_numbers_of_the_source() -> None:
    """0.2 to 0.9, 0 to 0.4, cities of north-western Europe; a knot is 0.514 m/s."""
    for sky, green in ((0.2, 0.0), (0.9, 0.4)):
        found = maximum_heat_island(sky, green, 1.0, 1.0, 1.0)
        assert found == pytest.approx(2 - sky - green)
    for sky, green, word in (
        (0.19, 0.2, "sky_view"),
        (0.91, 0.2, "sky_view"),
        (0.5, -0.01, "vegetation"),
        (0.5, 0.41, "vegetation"),
    ):
        with pytest.raises(ValueError, match=f"{word}: expected"):
            maximum_heat_island(sky, green, 1.0, 1.0, 1.0)
    for wind in (0.0, [1.0, 0.0]):
        with pytest.raises(ValueError, match="without any"):
            maximum_heat_island(0.5, 0.2, 1.0, 1.0, wind)


def test_a_calm_day_counts_with_half_a_metre_per_second() -> None:
    calm, slow = (in_city(_weather(wind_speed=np.full(72, wind)), 0.5, 0.2, NIGHT).dry_bulb_c for wind in (0.1, 0.5))
    np.testing.assert_array_equal(calm, slow)


def test_density_by_the_gas_law() -> None:
    """287.058 and 1007 J/(kg K): at 20 degC and 101,325 Pa 1.2041 kg/m3."""
    still = _weather(dry_bulb_c=np.full(72, 20.0) + 10.0 * (np.arange(72) % 24 == 12))
    density = 101325 / (287.058 * np.where(np.arange(24) == 12, 303.15, 293.15))
    heating = (still.global_horizontal[24:48] / (density * 1007)).mean()
    warmer = in_city(still, 0.5, 0.2, [1.0] * 24).dry_bulb_c[34] - 20.0
    assert warmer == pytest.approx(1.3 * (heating * 1000 / 3) ** 0.25, rel=1e-6)


@pytest.mark.parametrize(
    ("north", "east", "noted"),
    [
        (45.0, -11.0, False),
        (61.0, 16.0, False),
        (44.9, 5.0, True),
        (61.1, 5.0, True),
        (52.0, -11.1, True),
        (52.0, 16.1, True),
        (30.0, 50.0, True),
    ],
)
def test_places_elsewhere_are_noted_once(north, east, noted) -> None:
    notes = in_city(_weather(latitude_deg=north, longitude_deg=east), 0.5, 0.2, NIGHT).notes
    assert sum("is elsewhere" in str(note) for note in notes) == noted


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"step_h": 0.5}, "whole days"),
        ({"times": pd.date_range("2001-06-01 02:00", periods=72, freq="h")}, "whole days"),
        ({"global_horizontal": None}, "global irradiance"),
        ({"dry_bulb_c": None}, "temperature"),
        ({"dew_point_c": None}, "dew point"),
        ({"wind_speed": None}, "wind"),
    ],
)
def test_weather_that_the_equation_cannot_take(changes, words) -> None:
    with pytest.raises(ValueError, match=words):
        in_city(_weather(**changes), 0.5, 0.2, NIGHT)
    with pytest.raises(ValueError, match="expected 24"):
        in_city(_weather(), 0.5, 0.2, NIGHT[1:])
