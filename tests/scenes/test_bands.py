"""Bands of a room's results: distributions, linear light, verdicts, what decides."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from bim.shoebox import shoebox
from scenes import read_operation, simulate
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.report.sensitivity import bands_sentence
from scenes.room.bands import (
    SAMPLES,
    LightSamples,
    Margin,
    deciding,
    deviations,
    draws,
    lit_samples,
    provision_margin,
    room_bands,
)
from scenes.room.sensitivities import sensitivity_table
from scenes.uncertain_inputs import INPUTS
from tests.scenes.test_sensitivities import FEW

USUAL = deviations(None)


def test_inputs_are_normal_and_independent():
    drawn = draws(USUAL, seed=3)
    table = np.stack([drawn[key] / USUAL[key] for key in INPUTS])
    assert np.allclose(table.mean(axis=1), 0, atol=0.02) and np.allclose(table.std(axis=1), 1, atol=0.03)
    assert np.abs(np.corrcoef(table) - np.eye(len(INPUTS))).max() < 0.15
    assert not np.array_equal(draws(USUAL, seed=4)["g_value"], drawn["g_value"])


def test_a_linear_figure_has_the_band_of_its_normal_distribution():
    drawn = draws(USUAL, seed=0)
    table = pd.concat(
        [
            sensitivity_table("g_value", 0.3, [("mean_air_c", 22.0, 40.0, 0.0)]),
            sensitivity_table("u_value", 1.1, [("mean_air_c", 22.0, -2.0, 0.0)]),
        ]
    )
    row = room_bands(LightSamples({}), table, drawn).figures.set_index("figure").loc["mean_air_c"]
    spread = np.hypot(40.0 * USUAL["g_value"], 2.0 * USUAL["u_value"])
    assert np.isclose(row["p95"] - row["p5"], 2 * 1.645 * spread, rtol=0.05)
    assert row["decided_by"] == "g_value"
    share = 100 * (40.0 * USUAL["g_value"]) ** 2 / spread**2
    assert abs(row["decided_percent"] - share) < 3


def test_light_is_linear_in_the_inputs_and_never_negative():
    values, slope = np.full((2, 3), 100.0), np.arange(6.0).reshape(2, 3) * 1000
    drawn = draws(USUAL, seed=0)
    blocks = np.concatenate(list(lit_samples(values, {"reflectance_walls": slope}, drawn)))
    assert blocks.shape == (SAMPLES, 2, 3)
    expected = np.maximum(values + slope * drawn["reflectance_walls"][:, None, None], 0)
    rounding = 100 * np.finfo(np.float32).eps  # where 100 lx less 99.4 lx are left, in single precision
    np.testing.assert_allclose(blocks, expected, rtol=1e-5, atol=rounding)


def test_provision_needs_both_areas():
    half = np.array([True, True, False])
    bright, dim = [350.0, 350.0, 0.0], [120.0, 120.0, 500.0]
    lit = np.array([[bright, dim], [dim, dim], [bright, [50.0, 50.0, 500.0]]])
    assert (provision_margin(lit, half, 2) >= 0).tolist() == [True, False, False]


def test_a_sure_verdict_is_decided_by_nothing():
    drawn = draws(USUAL, seed=0)
    sure, open_ = Margin(np.full(SAMPLES, 3.0), 3.0), Margin(drawn["reflectance_ground"] + 0.05, 0.05)
    table = sensitivity_table("g_value", 0.3, [("mean_air_c", 22.0, 40.0, 0.0)])
    verdicts = room_bands(LightSamples({}, {"lm83_accepted": sure, "en17037_minimum": open_}), table, drawn).verdicts
    one, other = (row for _, row in verdicts.iterrows())
    assert (one["met_percent"], one["decided_by"]) == (100.0, "")
    assert 80 < other["met_percent"] < 88 and other["decided_by"] == "reflectance_ground"  # Phi(1) is 84 %
    assert other["decided_percent"] > 99
    assert deciding(np.ones(SAMPLES), drawn) == ("", 0.0)


@pytest.fixture(scope="module")
def year(variant, tmp_path_factory):
    path = tmp_path_factory.mktemp("operation") / "office.toml"
    path.write_text("[loads]\nheating_c = 20.0\n[bands]\nreflectance_ground = 0.0\nu_value = 1.0\n", "utf-8")
    building = shoebox()
    room = building.room(building.spaces[0].label)
    return simulate(room, VENETIAN_BLIND, WEATHER, operation=read_operation(path), bands=True, **FEW)


def test_a_year_has_bands_about_its_values(year, tmp_path):
    figures = year.bands.figures.set_index("figure")
    assert np.isclose(figures.loc["da300", "value"], year.daylight.da, rtol=1e-4)
    assert np.isclose(figures.loc["sda300_50", "value"], year.daylight.sda, rtol=1e-4)
    assert (figures["p5"] <= figures["median"]).all() and (figures["median"] <= figures["p95"]).all()
    assert figures.loc["da300", "p5"] < year.daylight.da < figures.loc["da300", "p95"]
    # the operation's deviations: the ground is known, U is not
    assert figures.loc["mean_illuminance_lx", "decided_by"] != "reflectance_ground"
    assert figures.loc["heating_kwh", "decided_by"] == "u_value"
    year.write(tmp_path / "out")
    assert len(pd.read_csv(tmp_path / "out" / "bands.csv")) == len(figures)
    verdicts = pd.read_csv(tmp_path / "out" / "bands_verdicts.csv")
    assert verdicts["rule"].tolist() == ["lm83_accepted", "en17037_minimum"]
    assert verdicts.loc[0, "met"] == (year.daylight.sda >= 55)


def test_the_report_says_how_sure(year):
    sentence = bands_sentence(year._whole_run())
    assert sentence.startswith("room: daylight autonomy ")
    assert "90 % band" in sentence and "of 100 cases" in sentence


def test_a_wrong_deviation_is_refused(tmp_path):
    from mitsuba_cfs.errors import DataError

    path = tmp_path / "office.toml"
    path.write_text("[bands]\ng_value = -0.1\n", "utf-8")
    with pytest.raises(DataError, match=r"bands\.g_value"):
        read_operation(path)


def test_a_study_has_columns_of_bands(year):
    from scenes.study.one_case import room_figures

    figures, _ = room_figures(year)
    assert figures["da300_p5"] <= figures["da300_median"] <= figures["da300_p95"]
    assert 0 <= figures["lm83_accepted_met_percent"] <= 100
