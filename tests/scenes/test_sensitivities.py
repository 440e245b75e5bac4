"""Sensitivities of a room's year: what the table has, and that it agrees with changed inputs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from bim.shoebox import shoebox
from mitsuba_cfs.glare.indices import daylight_glare_probability
from mitsuba_cfs.sky.weather import Weather
from scenes import read_operation, read_system, read_weather, simulate
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.fenestration.slats import SLAT_INPUTS
from scenes.report.sensitivity import sensitivity_sentence
from scenes.room.sensitivities import dgp_and_slope
from scenes.uncertain_inputs import INPUTS
from thermal.blackbox import Fenestration, conductance_table, linear_u, with_u_value

FEW = {
    "quick": True,
    "sensor_spacing": 1.5,
    "sensor_samples": 256,
    "patch_samples": 64,
    "picture_size": 16,
    "picture_count": 1,
    "sun_points": 16,
}
OPERATION = """
[gains]
lighting_w_m2 = 8.0
[loads]
heating_c = 20.0
cooling_c = 26.0
"""


@pytest.fixture(scope="module")
def weather() -> Weather:
    return read_weather(WEATHER)


@pytest.fixture(scope="module")
def year(variant, weather, tmp_path_factory):
    path = tmp_path_factory.mktemp("operation") / "office.toml"
    path.write_text(OPERATION, "utf-8")
    building = shoebox()
    room = building.room(building.spaces[0].label)
    return simulate(room, VENETIAN_BLIND, weather, operation=read_operation(path), sensitivities=True, **FEW)


def of(table: pd.DataFrame, name: str, figure: str) -> pd.Series:
    return table.set_index(["input", "figure"]).loc[(name, figure)]


def test_every_input_of_the_room_has_its_figures(year):
    table = year.sensitivities
    assert set(table["input"]) == set(INPUTS) - {
        "reflectance_furniture",
        "tracing",
        *SLAT_INPUTS,
    }  # its layers are not known
    assert np.isfinite(table.select_dtypes(float)).all(axis=None)
    light = table[table["figure"] == "mean_illuminance_lx"]
    assert (light["derivative"] > 0).all() and (light["standard_error"] > 0).all()
    assert np.allclose(table["effect"], table["derivative"] * table["deviation"])


def test_light_is_proportional_to_the_transmittance(year):
    row = of(year.sensitivities, "transmittance_percent", "mean_illuminance_lx")
    mean = year.daylight.illuminance.mean()
    assert np.isclose(row["figure_value"], mean, rtol=1e-3)
    assert np.isclose(row["derivative"], mean / 100, rtol=1e-3)


def test_the_smoothed_autonomy_is_near_that_of_whole_hours(year):
    row = of(year.sensitivities, "reflectance_walls", "da300")
    assert abs(row["figure_value"] - year.daylight.da) < 2.0  # [%]
    assert row["smoothing"] == 30.0


def test_heat_goes_the_right_way(year):
    table = year.sensitivities
    assert of(table, "heating_set_c", "heating_kwh")["derivative"] > 0
    assert of(table, "cooling_set_c", "cooling_kwh")["derivative"] < 0
    assert of(table, "u_value", "heating_kwh")["derivative"] > 0
    assert of(table, "g_value", "cooling_kwh")["derivative"] > 0
    assert of(table, "reflectance_walls", "lighting_kwh")["derivative"] < 0
    base = of(table, "g_value", "heating_kwh")["figure_value"]
    assert np.isclose(base, year.operation.summary["heating_kwh"], rtol=1e-6)


def test_u_is_that_of_the_system(variant, weather, year, tmp_path):
    path = tmp_path / "office.toml"
    path.write_text(OPERATION, "utf-8")
    building, step = shoebox(), 0.1
    room, system = building.room(building.spaces[0].label), read_system(VENETIAN_BLIND)
    ends = []
    for sign in (1, -1):
        moved = replace(system, u_value=system.u_value + sign * step)
        one = simulate(room, moved, weather, operation=read_operation(path), **FEW)
        ends.append(one.operation.summary["heating_kwh"])
    row = of(year.sensitivities, "u_value", "heating_kwh")
    # another U in the system moves its closure too: films, slope of the resistance
    assert np.isclose(row["derivative"], (ends[0] - ends[1]) / (2 * step), rtol=0.2)


def test_the_report_names_three_inputs(year):
    sentence = sensitivity_sentence(year._whole_run())
    assert sentence.startswith("Daylight autonomy (")
    assert sentence.count("±") == 12  # three inputs of two figures, each with its deviation and effect
    plain = replace(year._whole_run(), spaces=(replace(year, sensitivities=None),))
    assert sensitivity_sentence(plain) == ""


def test_files_have_the_table(year, tmp_path):
    year.write(tmp_path / "out")
    table = pd.read_csv(tmp_path / "out" / "sensitivities.csv")
    assert len(table) == len(year.sensitivities)
    assert "Inputs that matter most" in (tmp_path / "out" / "report.html").read_text("utf-8")


def test_slope_of_dgp_without_and_with_contrast():
    eye, step = np.array([1000.0, 1000.0]), 1.0
    sources = np.array([0.0, 5e6])  # sum of L^2 omega / P^2

    def dgp(at: np.ndarray) -> np.ndarray:
        return np.array([daylight_glare_probability(*one) for one in zip(at, sources, strict=True)])

    value, slope = dgp_and_slope(dgp(eye), eye)
    np.testing.assert_allclose(value, dgp(eye))
    np.testing.assert_allclose(slope, (dgp(eye + step) - dgp(eye - step)) / (2 * step), rtol=1e-4)


@pytest.mark.parametrize("resistance", [None, linear_u(1.3)], ids=["constant", "linear"])
def test_a_window_of_another_u(resistance):
    one = Fenestration("pane", 1.3, resistance=resistance)
    moved = with_u_value(one, 1.6)
    films = one.r_outer + one.r_inner
    assert moved.u_value == 1.6
    assert np.isclose(1 / (float(moved.layer_resistance.at(10.0, 5.0)) + films), 1.6, rtol=1e-6)


def test_a_table_of_resistances_has_as_much_more_everywhere():
    grid = np.array([0.0, 10.0, 20.0]), np.array([1.0, 11.0]), np.array([[1.5, 1.6], [1.6, 1.7], [1.7, 1.8]])
    one = Fenestration("pane", 1.3, resistance=conductance_table(*grid))
    moved = with_u_value(one, 1.6)
    for mean, difference in ((0.0, 1.0), (10.0, 11.0), (20.0, 1.0)):
        more = moved.layer_resistance.at(mean, difference) - one.layer_resistance.at(mean, difference)
        assert np.isclose(more, 1 / 1.6 - 1 / 1.3)


def test_path_tracing_has_no_sensitivities():
    from scenes.room.options import RoomOptions

    with pytest.raises(ValueError, match="sensitivities and bands need"):
        RoomOptions.of(sensitivities=True, method="point-in-time")
