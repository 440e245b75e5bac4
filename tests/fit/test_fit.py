"""`cfs fit`: planted values come back, what the readings do not tell is named, wrong files are refused."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.errors import DataError
from scenes.cli import run
from scenes.fit.estimate import Prior, Readings, estimate
from scenes.fit.fit import run_fit, with_readings
from scenes.fit.fit_file import by_step, read_fit
from scenes.fit.model import FittedModel
from scenes.fit.page import answer
from scenes.heat.study_file import read_study
from tests.validation.fit import planted_fit, planted_readings


class Line:
    """y = a + b t, read by one instrument."""

    def __init__(self, times):
        self.slopes = np.stack([np.ones_like(times), times], axis=1)

    def values(self, theta):
        return self.slopes @ theta

    def derivatives(self, theta):
        return self.slopes


def line_prior(deviation):
    infinite = np.full(2, np.inf)
    return Prior(np.zeros(2), np.full(2, deviation), -infinite, infinite, np.zeros(2, dtype=bool))


def correlated(count, phi, rng):
    errors = rng.standard_normal(count)
    for number in range(1, count):
        errors[number] = phi * errors[number - 1] + np.sqrt(1 - phi**2) * errors[number]
    return errors


def test_a_line_without_a_prior_is_ordinary_least_squares():
    times = np.arange(200.0)
    y = 3.0 + 0.02 * times + 0.1 * np.random.default_rng(1).standard_normal(200)
    found = estimate(Line(times), [Readings("a", times, y, "a", False)], line_prior(1e4))
    (slope, start), covariance = np.polyfit(times, y, 1, cov=True)
    np.testing.assert_allclose(found.value, [start, slope], rtol=2e-3)
    # the correlation that is estimated too may be a little above 0
    np.testing.assert_allclose(found.standard_error, np.sqrt(np.diag(covariance))[::-1], rtol=0.12)


def test_correlated_errors_widen_the_interval():
    """The mean of n readings of an AR(1) has sqrt((1 + phi) / (1 - phi)) times the error of independent ones."""
    times, rng, phi = np.arange(600.0), np.random.default_rng(2), 0.8
    y = 3.0 + correlated(600, phi, rng)
    found = estimate(Line(times), [Readings("a", times, y, "a", False)], line_prior(1e4))
    independent = np.sqrt(np.diag(np.linalg.inv(Line(times).slopes.T @ Line(times).slopes)))
    noise = found.noise["a"]
    # its own estimates of deviation and correlation are good to about 15 %
    np.testing.assert_allclose(found.standard_error / independent, np.sqrt((1 + phi) / (1 - phi)), rtol=0.35)
    assert noise.effective == pytest.approx(600 * (1 - phi) / (1 + phi), rel=0.4)


@pytest.mark.slow
def test_intervals_of_a_line_cover_95_of_100():
    times, hits = np.arange(120.0), np.zeros(2)
    for seed in range(200):
        rng = np.random.default_rng([7, seed])
        truth = rng.standard_normal(2)
        y = Line(times).values(truth) + correlated(120, 0.6, rng)
        found = estimate(Line(times), [Readings("a", times, y, "a", False)], line_prior(1.0))
        hits += (found.low <= truth) & (truth <= found.high)
    # 200 seeds of 95 %: standard deviation 3.1
    assert (hits >= 190 - 3 * 3.1).all()
    assert (hits <= 190 + 3 * 3.1).all()


def test_few_readings_do_not_tell_slow_errors_from_fast_ones():
    """Six means of six hours, errors that follow each other for 12 h: the intervals know by the usual time."""
    times, phi, hits = 6.0 * np.arange(6), np.exp(-6.0 / 12.0), {12.0: 0, None: 0}
    wide = Prior(np.zeros(1), np.full(1, 10.0), np.full(1, -np.inf), np.full(1, np.inf), np.ones(1, dtype=bool))
    mean = Line(times)
    mean.slopes = mean.slopes[:, :1]
    for seed in range(100):
        y = 3.0 + correlated(6, phi, np.random.default_rng([8, seed]))
        for usual in hits:
            found = estimate(mean, [Readings("a", times, y, "a", False, usual)], wide)
            hits[usual] += bool(found.low[0] <= 3.0 <= found.high[0])
    assert hits[12.0] >= 92 > hits[None]


@pytest.fixture(scope="module")
def heat(tmp_path_factory):
    """A fit of temperatures, its model, and planted values."""
    fit = planted_fit(tmp_path_factory.mktemp("fit") / "heat", "heat")
    model = FittedModel(fit)
    truth = np.array([0.62, 0.585, 6.1])
    return with_readings(fit, planted_readings(fit, model, truth, "heat", np.random.default_rng(3))), model, truth


def test_planted_values_of_heat_are_within_their_intervals(heat):
    fit, model, truth = heat
    result = run_fit(fit, model=model)
    table = result.parameters
    # 3.3 sigma, so that one fit of three parameters fails in 1 of 300
    assert (np.abs(table["value"] - truth) < 3.3 * table["standard_error"]).all()
    assert table["determined"].all()
    assert (table["standard_error"] < 0.5 * table["prior_deviation"]).all()
    # two days before the period of the fit are predicted
    assert set(result.comparison["fitted"]) == {True, False}
    assert 0.7 < result.coverage["predicted"] <= 1.0
    assert result.estimate.noise["temperature"].effective < 0.5 * 288


@pytest.mark.slow
def test_a_parameter_that_readings_do_not_tell_keeps_its_prior(tmp_path):
    """The visible reflectance of the floor has no part in the heat."""
    fit = planted_fit(tmp_path, "heat")
    text = fit.file.read_text()
    more = '[[parameter]]\nname = "floor"\nkey = "box.reflectance.floor"\n'
    fit.file.write_text(text + more)
    fit = read_fit(fit.file)
    model = FittedModel(fit)
    readings = planted_readings(fit, model, fit.mean, "heat", np.random.default_rng(5))
    result = run_fit(with_readings(fit, readings), model=model)
    row = result.parameters.set_index("parameter").loc["floor"]
    assert not row["determined"]
    assert row["high_95"] - row["low_95"] == pytest.approx(2 * 1.96 * row["prior_deviation"], rel=0.05)
    assert any("floor" in line and "do not determine" in line for line in answer(result))


def test_the_command_writes_a_study_that_runs(heat, tmp_path, capsys):
    fit, _, _ = heat
    fit.readings.rename_axis("time").to_csv(fit.file.parent / "measured.csv")
    assert run(["fit", str(fit.file), "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert re.search(r"air change: 0\.\d+, 95 % interval", said)
    table = pd.read_csv(tmp_path / "out" / "parameters.csv").set_index("parameter")
    study = read_study(tmp_path / "out" / "fitted.toml")
    assert study.air.infiltration_ach == pytest.approx(table.loc["air change", "value"], rel=1e-6)
    assert study.system[0].g_value == pytest.approx(table.loc["g", "value"], rel=1e-6)
    html = (tmp_path / "out" / "report.html").read_text()
    assert "95 % interval" in html.replace("\N{NO-BREAK SPACE}", " ")
    assert "data:image/svg+xml" in html


@pytest.mark.slow
def test_light_comes_back_from_its_own_tracing(tmp_path):
    """Without errors of the readings the planted reflectances are found again: same rays, exact model."""
    fit = planted_fit(tmp_path, "light", paths=2048)
    model = FittedModel(fit)
    truth = fit.mean + 0.5 * fit.deviation * np.array([1, -1, 1, -1])
    rng = np.random.default_rng(1)
    result = run_fit(with_readings(fit, planted_readings(fit, model, truth, "light", rng)), model=model)
    table = result.parameters
    assert (np.abs(table["value"] - truth) < 3.5 * table["standard_error"]).all()
    assert (table["standard_error"] < table["prior_deviation"]).all()
    # illuminance grows with each reflectance
    assert (model.whole_derivatives(fit.mean) > 0).mean() > 0.98


@pytest.mark.slow
def test_the_noise_of_a_light_meter_is_small_unless_its_paths_are_stated(tmp_path):
    """With a study's 16,384 paths the noise was as large as what 55 readings with errors of 5 % tell."""
    models = [FittedModel(planted_fit(tmp_path / str(paths), "light", paths=paths)) for paths in (None, 2048)]
    for model in models:
        model.whole_derivatives(model.fit.mean)
    few, many = (np.array(list(model.tracing_error.values())) for model in reversed(models))
    told = 0.05 / np.sqrt(55)  # what 55 readings with errors of 5 % tell of their mean
    assert many.max() < told < 0.5 * few.max()


def test_luminance_of_a_wall_is_its_reflectance_times_illuminance(tmp_path):
    fit = planted_fit(tmp_path, "light", paths=2048)
    text = fit.file.read_text()
    more = """
[[measurement]]
column = "wall"
quantity = "luminance"
point = [2.0, 5.0, 1.5]
direction = [0, -1, 0]
[[measurement]]
column = "on the wall"
quantity = "illuminance"
point = [2.0, 4.998, 1.5]
direction = [0, -1, 0]
"""
    fit.file.write_text(text.replace("[[parameter]]", more + "[[parameter]]", 1))
    data = pd.read_csv(tmp_path / "measured.csv").assign(**{"wall": 0.0, "on the wall": 0.0})
    data.to_csv(tmp_path / "measured.csv", index=False)
    model = FittedModel(read_fit(fit.file))
    parts = np.split(model.whole(model.fit.mean), len(model.columns))
    # other rays: each has a noise of about 0.8 %
    np.testing.assert_allclose(parts[4], 0.5 / np.pi * parts[5], rtol=0.03)


def test_readings_are_averaged_over_the_weathers_steps(tmp_path):
    fit = planted_fit(tmp_path, "heat")
    times = pd.to_datetime(["2017-05-01T00:30", "2017-05-01T01:00", "2017-05-01T01:01", "2017-06-30T01:00"])
    weather = FittedModel(fit).weather
    found = by_step(pd.DataFrame({"air": [1.0, 3.0, 7.0, 99.0]}, index=times), weather)["air"]
    assert found.dropna().tolist() == [2.0, 7.0]


WRONG = {
    "no column": ('column = "air"', 'column = "lounge"', "no column 'lounge'; there are time, air"),
    "no key": ('key = "system.g_value"', 'key = "system.g_valu"', "expected a number of the study at 'system.g_valu'"),
    "too deep": ('key = "system.g_value"', f'key = "{500 * "a."}b"', "parameter.1.key: expected a text of at most 200"),
    "under a number": (
        'key = "system.g_value"',
        'key = "air.infiltration_ach.x"\nmean = 0.6',
        "parameter g: there is no table to set 'x' in, but 0.",
    ),
    "no deviation": ("deviation = 1.5\n", "", "parameter.2.deviation: is missing"),
    "mean outside": ("low = 0.54", "low = 0.62", "expected a mean from 0.62 to 0.75, got 0.6"),
    "point of air": (
        'quantity = "air temperature"',
        'quantity = "air temperature"\npoint = [1, 1, 1]',
        "point: belongs",
    ),
    "no study": ('study = "room.toml"', 'study = "rom.toml"', "study: no such file: rom.toml"),
    "no readings": ("begin = 2017-05-03", "begin = 2018-05-03", "no reading is in the period"),
    "twice": ('name = "gains"', 'name = "g"', "'g' is there twice"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_file_is_refused_in_one_line(tmp_path, capsys, case):
    old, new, message = WRONG[case]
    fit = planted_fit(tmp_path / "fit", "heat")
    text = fit.file.read_text()
    assert old in text
    fit.file.write_text(text.replace(old, new))
    assert run(["fit", str(fit.file), "--out", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().err.strip().splitlines()
    assert message in said[-1], said
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "cell, message",
    [("warm", "line 3: air: expected a number or nothing"), ("inf", "line 3: air: expected a number or nothing")],
)
def test_a_wrong_reading_is_refused_with_its_line(tmp_path, cell, message):
    fit = planted_fit(tmp_path, "heat")
    lines = (tmp_path / "measured.csv").read_text().splitlines()
    lines[2] = lines[2].partition(",")[0] + f",{cell}"
    (tmp_path / "measured.csv").write_text("\n".join(lines))
    with pytest.raises(DataError) as error:
        read_fit(fit.file)
    assert message in str(error.value)
