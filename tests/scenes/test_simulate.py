"""The ten-line script: a room's year from Python, the same numbers as the command line's."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import scenes as cfs
from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.errors import DataError
from scenes.cli import run
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER

pytestmark = pytest.mark.early

OPTIONS = {"picture_hours": ("06-21 12",), "picture_size": 96}
HOURS = 8760


@pytest.fixture(scope="module")
def year(variant) -> cfs.SimulatedYear:
    """The script."""
    room = cfs.read_building(str(OFFICE)).room("South office")
    system, weather = cfs.read_system(str(VENETIAN_BLIND)), cfs.read_weather(str(WEATHER))
    return cfs.simulate(room, system, weather, quick=True, **OPTIONS)


@pytest.fixture(scope="module")
def ran(year, tmp_path_factory) -> Path:
    """The files of `cfs run` on the same."""
    out = tmp_path_factory.mktemp("run") / "out"
    words = [
        "run",
        OFFICE,
        "--weather",
        WEATHER,
        "--cfs",
        VENETIAN_BLIND,
        "--out",
        out,
        "--quick",
        "--space",
        "A",
        "--picture",
        "06-21 12",
        "--size",
        "96",
    ]
    assert run([str(word) for word in words]) == 0
    return out


def test_the_script_gives_the_numbers_of_cfs_run_bit_for_bit(year, ran, tmp_path) -> None:
    year.write(str(tmp_path / "out"))
    ours, theirs = (sorted(p.name for p in f.iterdir()) for f in (tmp_path / "out", ran))
    assert ours == theirs
    for name in theirs:
        one, other = tmp_path / "out" / name, ran / name
        if name.endswith((".csv", ".parquet", ".hdr", ".png")):
            assert one.read_bytes() == other.read_bytes(), name
    table = pd.read_parquet(ran / "illuminance.parquet").to_numpy()
    assert np.array_equal(table, year.daylight.illuminance)
    ours, theirs = (json.loads((f / "run.json").read_text()) for f in (tmp_path / "out", ran))
    for key in ("inputs", "building", "site", "system", "seed", "variant", "versions", "quick"):
        assert ours[key] == theirs[key]
    named = ours["options"] | {"spaces": theirs["options"]["spaces"]}  # by GUID, and by name
    assert named == theirs["options"]


def test_the_script_gives_the_numbers_of_a_study_of_one_case(year, tmp_path) -> None:
    (tmp_path / "study.toml").write_text(
        f'quick = true\nglare = "none"\n[[room]]\nbuilding = "{OFFICE}"\nspaces = ["A"]\n'
        f'[[system]]\nbsdf = "{VENETIAN_BLIND}"\n[[climate]]\nweather = "{WEATHER}"\n'
    )
    study = cfs.run_study(cfs.read_study(str(tmp_path / "study.toml")), str(tmp_path / "out"))
    (case,) = study.results
    assert not case.error
    for name, value in year.daylight.room_metrics.items():
        assert case.figures[name] == value, name
    for name, column in year.daylight.sensor_metrics.items():
        assert np.array_equal(case.arrays[f"sensor/{name}"], column), name
    assert case.figures["operative_max_c"] == year.heat.operative_c[occupied(year)].max()
    assert list(study.table["da300"]) == [year.daylight.da]
    assert "da300" in study._repr_html_()


def occupied(year: cfs.RoomYear) -> np.ndarray:
    """The hours whose temperatures count."""
    return year.heat.comfort["occupied"].to_numpy()


def test_short_names_are_those_of_the_tables(year) -> None:
    metrics = year.daylight.room_metrics
    figures = (year.daylight.sda, year.daylight.da, year.daylight.ase)
    assert figures == (metrics["sda300_50"], metrics["da300"], metrics["ase1000_250"])
    assert year.glare.worst == max(picture.glare["dgp"] for picture in year.glare.pictures)
    assert year.heat.comfortable == year.heat.comfort_summary["within_80"]
    air, mean = (year.heat.temperatures[name] for name in ("air_c", "mrt_c"))
    assert year.heat.operative_c.to_numpy() == pytest.approx((air + mean).to_numpy() / 2, abs=1e-9)


def test_the_hours_are_one_frame(year) -> None:
    hours = year.hours
    assert len(hours) == HOURS and hours.columns.is_unique and hours.index.name == "time"
    assert hours["illuminance_lx"].to_numpy() == pytest.approx(year.daylight.illuminance.mean(axis=1, dtype=float))
    assert {"operative_c", "transmitted_w", "within_80"} <= set(hours)
    units = hours.attrs["units"]
    assert set(units) == set(hours)
    assert (units["illuminance_lx"], units["operative_c"], units["transmitted_w"]) == ("lx", "degC", "W")


def test_a_prompt_shows_one_line(year) -> None:
    """A year, its run, building and space hold thousands of triangles that no prompt needs."""
    for shown in (year, year.run, year.run.building, year.space):
        text = repr(shown)
        assert len(text) < 150, text[:300]
        assert type(shown).__name__ in text
    assert f"DA {year.daylight.da:.0f} %, worst DGP {year.glare.worst:.2f}" in repr(year)


def test_a_notebook_shows_the_headline_figures(year) -> None:
    text = year._repr_html_()
    assert "South office" in text and f"{year.daylight.sda:.0f} %" in text


@pytest.mark.parametrize("plot", ["plot_illuminance", "plot_glare", "plot_temperatures"])
def test_figures_are_axes_of_matplotlib(year, plot: str) -> None:
    from matplotlib import pyplot
    from matplotlib.axes import Axes

    with pyplot.rc_context({"backend": "agg"}):
        axes = getattr(year, plot)()
        assert isinstance(axes, Axes) and year.space.label in axes.get_title()
        own = pyplot.figure().subplots()
        assert getattr(year, plot)(own) is own
        axes.figure.canvas.draw()
        pyplot.close("all")


def test_the_carpet_shows_the_brightest_hour_at_its_place(year) -> None:
    from matplotlib import pyplot

    axes = year.plot_illuminance()
    (image,) = axes.get_images()
    grid, mean = np.asarray(image.get_array()), year.hours["illuminance_lx"]
    row, day = np.unravel_index(np.argmax(grid), grid.shape)
    when = mean.idxmax()
    assert (23 - row, day + 1) == (when.hour, when.day_of_year)
    pyplot.close("all")


def test_results_of_others_are_not_written_over(year, tmp_path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(DataError, match="holds other files"):
        year.write(tmp_path)


def test_a_room_that_is_no_file_has_a_year_too(variant, tmp_path) -> None:
    building = shoebox(3, 4, 3, windows=(WindowRectangle(0.5, 1.0, 2.0, 1.5),), name="cell")
    system, weather = cfs.read_system(VENETIAN_BLIND), cfs.read_weather(WEATHER)
    year = cfs.simulate(building.room("cell"), system, weather, quick=True, method="three-phase", **OPTIONS)
    assert year.daylight.ase is None and year.daylight.da > 0
    year.write(tmp_path / "out", report=False)
    assert "building" not in json.loads((tmp_path / "out" / "run.json").read_text())["inputs"]
    with pytest.raises(DataError, match="needs a system"):
        cfs.simulate(building.room("cell"), None, weather)


@pytest.mark.parametrize("read", [cfs.read_building, cfs.read_system, cfs.read_weather])
def test_a_file_that_is_not_there_is_one_line(read, tmp_path) -> None:
    with pytest.raises(DataError, match=r"nothing\.here") as caught:
        read(tmp_path / "nothing.here")
    assert len(str(caught.value).splitlines()) == 1


def test_a_room_that_is_not_there_is_one_line() -> None:
    with pytest.raises(DataError, match=r"office\.ifc: space: no space 'C'; there are: B East"):
        cfs.read_building(OFFICE).room("C")


def test_a_wrong_choice_is_said() -> None:
    room = cfs.read_building(OFFICE).room("A")
    system, weather = cfs.read_system(VENETIAN_BLIND), cfs.read_weather(WEATHER)
    with pytest.raises(ValueError, match="method: expected one of"):
        cfs.simulate(room, system, weather, method="two-phase")
    with pytest.raises(TypeError, match="sensor_space"):
        cfs.simulate(room, system, weather, sensor_space=1.0)
    low = cfs.read_system(VENETIAN_BLIND, g_value=0.01)
    with pytest.raises(DataError, match="below the solar transmittance"):
        cfs.simulate(room, low, weather)
