"""Weather of a CSV file: steps, whole days, the sun from global and diffuse, faults in one line."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.sun import sun_directions
from mitsuba_cfs.sky.weather import Weather
from scenes.cli import run as main
from scenes.demo import VENETIAN_BLIND
from scenes.heat.energyplus import check_twin
from scenes.heat.files import read_files
from scenes.heat.measured_weather import MeasuredTable, read_measured
from scenes.heat.study_file import StudyFile

COLUMNS = {
    "dry_bulb_c": "T",
    "diffuse_horizontal": "D",
    "global_horizontal": "G",
    "horizontal_infrared": "L",
    "relative_humidity": "RH",
    "wind_speed": "v",
}
PLACE = {"latitude_deg": 47.874, "longitude_deg": 11.728, "timezone_h": 1.0, "elevation_m": 680.0}


def table_of(**changes) -> MeasuredTable:
    return MeasuredTable.model_validate(PLACE | {"columns": COLUMNS} | changes)


def frame(minutes: int = 10, days: float = 2.5, start: str = "2014-04-09T18:00") -> pd.DataFrame:
    """Clear weather: direct normal 700 and diffuse 90 W/m2 while the sun is up."""
    count = round(days * 24 * 60 / minutes)
    step = pd.Timedelta(minutes=minutes)
    times = pd.date_range(pd.Timestamp(start) + step, periods=count, freq=step)
    place = Weather("x", 47.874, 11.728, 1.0, 680.0, minutes / 60.0, times, np.zeros(count), np.zeros(count))
    up = np.clip(sun_directions(place)[:, 2], 0.0, None)
    return pd.DataFrame(
        {
            "time": times.strftime("%Y-%m-%dT%H:%M"),
            "T": 10.0 + np.arange(count) / 100.0,
            "D": 90.0 * (up > 0),
            "G": 700.0 * up + 90.0 * (up > 0),
            "L": 300.0,
            "RH": 60.0,
            "v": 2.0,
        }
    )


def written(folder: Path, data: pd.DataFrame) -> Path:
    path = folder / "site.csv"
    data.to_csv(path, index=False)
    return path


@pytest.mark.parametrize("minutes", [1, 10, 60])
def test_whole_days_and_the_sun_of_each_interval(tmp_path, minutes) -> None:
    weather = read_measured(written(tmp_path, frame(minutes)), table_of())
    rows = 24 * 60 // minutes
    assert len(weather.times) == 2 * rows and weather.step_h == pytest.approx(minutes / 60)
    assert weather.midpoints[0].normalize() == pd.Timestamp("2014-04-10")
    assert weather.midpoints[-1].normalize() == pd.Timestamp("2014-04-11")
    sine = sun_directions(weather)[:, 2]
    high = sine > 0.2  # the air bends a low sun by its temperature, which the frame leaves out
    np.testing.assert_allclose(weather.direct_normal[high], 700.0, rtol=1e-3)
    assert (weather.direct_normal[sine < 0] == 0).all()
    assert weather.relative_humidity[0] == pytest.approx(0.6)
    assert weather.dry_bulb_c[0] == pytest.approx(10.0 + 6 * 60 / minutes / 100.0)
    assert weather.pressure_pa[0] == pytest.approx(93400.0, rel=0.01)
    assert any("no pressure" in note for note in weather.notes)


def test_measured_direct_normal_is_taken_as_it_is(tmp_path) -> None:
    data = frame(60)
    data["B"] = 123.0
    columns = {k: v for k, v in COLUMNS.items() if k != "global_horizontal"}
    weather = read_measured(written(tmp_path, data), table_of(columns=columns | {"direct_normal": "B"}))
    assert set(weather.direct_normal) == {123.0}


def drop_row(data: pd.DataFrame) -> pd.DataFrame:
    return data.drop(index=7)


def hole(data: pd.DataFrame) -> pd.DataFrame:
    return data.assign(T=data["T"].where(data.index != 5))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (drop_row, "line 9.*expected rows at one step"),
        (hole, "line 7.*T: expected a number"),
        (lambda data: data.rename(columns={"G": "H"}), "no column 'G'; there are time, T, D, H"),
        (lambda data: data.assign(time="noon"), "expected times as 2013-08-21T00:10"),
        (lambda data: data[:100], "holds no whole day"),
        (lambda data: data[::13], "expected steps of 1 to 60 minutes that fill an hour"),
    ],
)
def test_faults_name_line_and_column(tmp_path, change, words) -> None:
    with pytest.raises(DataError, match=words) as fault:
        read_measured(written(tmp_path, change(frame())), table_of())
    assert "site.csv" in str(fault.value)


def test_study_of_two_days_by_half_hours(tmp_path, variant) -> None:
    """Energy, hours of comfort and months count the length of an interval."""
    path = written(tmp_path, frame(30))
    place = "\n".join(f"{key} = {value}" for key, value in PLACE.items())
    columns = "\n".join(f'{key} = "{value}"' for key, value in COLUMNS.items())
    (tmp_path / "study.toml").write_text(
        f"""
weather = "{path.name}"
step_minutes = 10
[measured]
{place}
[measured.columns]
{columns}
[box]
width = 4
depth = 5
height = 3
[[box.window]]
x = 0.5
sill = 1.0
width = 3.0
height = 1.5
[[system]]
bsdf = "{VENETIAN_BLIND}"
[loads]
heating_c = 28
[gains]
occupied = [8, 18]
[trace]
patch_samples = 256
sensor_samples = 256
view_factors = false
"""
    )
    assert main(["thermal", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out")]) == 0
    hours = pd.read_csv(tmp_path / "out" / "hours.csv")
    summary = pd.read_csv(tmp_path / "out" / "summary.csv").iloc[0]
    assert len(hours) == 96 and hours["heating_w"].max() > 0
    assert summary["heating_kwh"] == pytest.approx(hours["heating_w"].sum() * 0.5 / 1e3, abs=1e-3)
    months = pd.read_csv(tmp_path / "out" / "energy_by_month.csv")
    assert months["heat [kWh]"].sum() == pytest.approx(summary["heating_kwh"], abs=1e-3)
    assert list(months.loc[months["heat [kWh]"] > 0, "month"]) == [4]
    assert summary["pmv_IV_h"] <= 20.0  # two days of ten hours
    assert hours["outdoor_c"].iloc[0] == pytest.approx(10.0 + 12 / 100.0)


def test_energyplus_is_not_given_measured_weather(tmp_path) -> None:
    measured = table_of()
    study = SimpleNamespace(measured=measured, weather=tmp_path / "site.csv")
    with pytest.raises(DataError, match="EnergyPlus needs an EPW file") as found:
        check_twin(study)
    assert found.value.file == study.weather and found.value.field == "measured"
    check_twin(SimpleNamespace(measured=None, heat_island=None, air_nodes=(), weather=tmp_path / "city.epw"))


def test_a_few_days_say_nothing_of_the_ground(tmp_path) -> None:
    path = written(tmp_path, frame(60))
    table = {
        "weather": path,
        "measured": PLACE | {"columns": COLUMNS},
        "box": {"width": 4, "depth": 5, "height": 3, "window": []},
        "system": [{"bsdf": VENETIAN_BLIND}],
        "envelope": {"ground": {"perimeter": 9}},
    }
    with pytest.raises(DataError, match="the ground follows a year of weather, got 2 days"):
        read_files(StudyFile.model_validate(table), tmp_path / "study.toml")
