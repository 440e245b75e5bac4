"""`cfs run` as a user calls it: its files, its repeatability, and what it says to bad input."""

from __future__ import annotations

import json
import re
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from scenes.cli import run
from scenes.quick import NOTE
from scenes.results import GlareMap
from scenes.run.netcdf import glare_map_variables
from tests.conftest import REPOSITORY

pytestmark = pytest.mark.early

FORMATS = REPOSITORY / "docs" / "formats.md"
DEMO = Path(str(files("scenes") / "demo"))
OFFICE = DEMO / "office.ifc"
WEATHER = DEMO / "USA_IL_Chicago-OHare.Intl.AP.725300_TMY3.epw"
SYSTEM = DEMO / "venetian_blind.xml"
QUICK = ["--quick", "--size", "96", "--picture", "06-21 12", "--space", "A"]
NETCDF = find_spec("xarray") is not None and find_spec("h5netcdf") is not None


def call(out, *options, building=OFFICE, weather=WEATHER, system=SYSTEM) -> int:
    """Exit code of `cfs run`."""
    return run(["run", *map(str, [building, "--weather", weather, "--cfs", system, "--out", out, *options])])


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> Path:
    """The files of one quick run."""
    out = tmp_path_factory.mktemp("run") / "out"
    assert call(out, *QUICK, "--ladybug", *["--netcdf"] * NETCDF) == 0
    return out


def test_files_of_a_run(results):
    assert {path.name for path in results.iterdir()} == {
        "report.html",
        "run.json",
        "cfs-results.json",
        "problems.csv",
        "illuminance.parquet",
        "daylight_metrics.csv",
        "room_metrics.csv",
        "dgp.csv",
        "temperatures.csv",
        "comfort.csv",
        "view_06-21_12h.hdr",
        "view_06-21_12h.png",
        "ladybug",
        *["results.nc"] * NETCDF,
    }
    illuminance = pd.read_parquet(results / "illuminance.parquet")
    metrics = pd.read_csv(results / "daylight_metrics.csv")
    assert illuminance.shape == (8760, len(metrics))
    assert illuminance.to_numpy().min() >= 0
    temperatures = pd.read_csv(results / "temperatures.csv")
    assert len(temperatures) == 8760 and not temperatures.isna().any().any()
    manifest = json.loads((results / "run.json").read_text())
    assert manifest["inputs"]["weather"]["sha256"] and manifest["seed"] == 0
    (row,) = [one for one in FORMATS.read_text("utf-8").splitlines() if one.startswith("| `run.json` of `cfs run`")]
    assert [key for key in manifest if f"`{key}`" not in row] == [], "docs/formats.md lists the keys for other programs"
    assert not list(results.parent.glob(".*")), "temporary folders are gone"


def test_a_quick_run_says_so_at_the_head_of_its_results(results):
    assert next(iter(json.loads((results / "run.json").read_text()).items())) == ("quick", True)
    report = (results / "report.html").read_text()
    words = re.sub(r"<[^>]*>", "", report[: report.index("<main")])  # options have a tag of their own
    assert NOTE in words


def test_numbers_hang_together(results):
    """What the tables say of each other, and physical bounds of the demo's room."""
    illuminance = pd.read_parquet(results / "illuminance.parquet").to_numpy()
    metrics = pd.read_csv(results / "daylight_metrics.csv")
    times = pd.read_parquet(results / "illuminance.parquet").index
    day = (times.hour >= 8) & (times.hour < 18)
    share = 100 * (illuminance[day] >= 300).mean(axis=0)
    assert metrics["da300"].to_numpy() == pytest.approx(share, abs=1e-3)  # six digits in the file
    heat = pd.read_csv(results / "temperatures.csv")
    absorbed = heat["absorbed_outer_w"] + heat["absorbed_inner_w"] + heat["transmitted_w"]
    assert np.all(absorbed <= heat["incident_w"] * (1 + 1e-5))
    assert np.all(heat["absorbed_room_w"] <= heat["transmitted_w"] * (1 + 1e-5))
    operative = ((heat["air_c"] + heat["mrt_c"]) / 2).to_numpy()
    assert heat["operative_c"].to_numpy() == pytest.approx(operative, abs=2e-4)
    assert heat["air_c"].mean() > heat["outdoor_c"].mean()  # sun and people warm the room


def test_netcdf_holds_the_numbers_of_the_tables_with_their_units(results):
    """Every column of every table, to the six digits that the tables have."""
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")

    def same(name: str, values: pd.Series, **of: object) -> None:
        found = data[name].isel(**of).to_numpy()
        np.testing.assert_allclose(found, values, rtol=6e-6, atol=1e-30, err_msg=name)

    with xarray.open_dataset(results / "results.nc") as data:
        light = pd.read_parquet(results / "illuminance.parquet")
        assert np.array_equal(data["time"].to_numpy(), light.index.to_numpy())
        assert np.array_equal(data["illuminance"].to_numpy(), light.to_numpy())
        hours = pd.read_csv(results / "temperatures.csv", index_col="time")
        surfaces = [name for name in hours if " " in name]
        for name in hours.columns.difference(surfaces):
            same(name, hours[name], room=0)
        names = [f"{name}_c" for name in data["surface_name"].to_numpy()]
        assert names == surfaces
        np.testing.assert_allclose(data["surface_temperature_c"], hours[surfaces], rtol=6e-6)
        sensors = pd.read_csv(results / "daylight_metrics.csv", index_col="sensor")
        for name in sensors:
            same(name if name in "xyz" else f"sensor_{name}", sensors[name])
        for file in ("room_metrics.csv", "comfort.csv"):
            for name, value in pd.read_csv(results / file).iloc[0].items():
                same(f"room_{name}", value, room=0)
        pictures = pd.read_csv(results / "dgp.csv")
        for name in pictures.columns.difference(["time"]):
            same(f"picture_{name}", pictures[name])
        times = pd.DatetimeIndex(data["picture_time"].to_numpy())
        assert list(times) == list(pd.to_datetime(pictures["time"]))
        units = {name: values.attrs.get("units") for name, values in data.variables.items()}
        assert units["air_c"] == "degC" and units["transmitted_w"] == "W" and units["x"] == "m"
        assert units["illuminance"] == "lx" and units["room_sda300_50"] == "percent"
        assert units["within_80"] == "1" and units["ppd"] == units["room_within_80"] == "percent"
        numbers = [v for v in data.data_vars.values() if v.dtype.kind in "fi"]
        assert all(values.attrs["units"] and values.attrs["long_name"] for values in numbers)
        assert data.attrs["Conventions"].startswith("CF-")
        assert list(data["room_label"].to_numpy()) == ["A South office"]


def test_netcdf_has_the_glare_maps_of_all_rooms():
    """The rows of the rooms' tables, one after the other; a room without a map has none."""
    eyes, ways = np.array([[1.0, 2.0, 1.2], [3.0, 2.0, 1.2]]), np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    dgp = np.random.default_rng(1).uniform(0.3, 0.5, (2, 2, 40)).astype(np.float32)
    maps = [
        GlareMap.of(eyes, ways, dgp, spacing=2.0, step_h=0.5),
        None,
        GlareMap.of(eyes[:1], ways, dgp[:1], spacing=2.0, step_h=0.5),
    ]
    variables = glare_map_variables([SimpleNamespace(glare_map=plan) for plan in maps], ["A", "B", "C"])
    tables = pd.concat([plan.table() for plan in maps if plan is not None])
    assert list(variables["view_room"][1]) == ["A"] * 4 + ["C"] * 2
    for name in tables.columns.drop("eye"):
        dimensions, values, about = variables[f"view_{name}"]
        assert dimensions == ("view",) and about["units"] and about["long_name"]
        assert np.array_equal(values, tables[name])
    assert variables["view_direction_deg"][2]["units"] == "degree"
    assert variables["view_hours_above_0.40"][2]["long_name"] == "hours of use with DGP above 0.40"


def test_the_folder_of_ladybug_tools_has_the_illuminances_of_the_run(results):
    """Read back as AnnualDaylight does: dark hours are zero."""
    folder = results / "ladybug"
    (grid,) = json.loads((folder / "grids_info.json").read_text("utf-8"))
    hours = [float(line) for line in (folder / "sun-up-hours.txt").read_text().split()]
    light = pd.read_parquet(results / "illuminance.parquet").to_numpy()
    file = folder / "__static_apertures__" / "default" / "total" / f"{grid['full_id']}.npy"
    found = np.zeros_like(light)
    found[[int(hour) for hour in hours]] = np.load(file).T
    assert grid["name"] == "A South office" and grid["count"] == light.shape[1]
    assert 4000 < len(hours) < 5000
    np.testing.assert_allclose(found, light, rtol=1e-6)


def test_netcdf_without_its_packages_is_one_line_at_once(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("scenes.run.files.NETCDF", ("xarray", "no_such_package"))
    assert call(tmp_path / "out", *QUICK, "--netcdf") == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "--netcdf" in line and "no_such_package" in line and "mitsuba-cfs[netcdf]" in line


def test_picture_gives_the_eye_the_light_of_the_table(results):
    """DGP's illuminance from the written picture, read back."""
    from mitsuba_cfs.glare.evaluation import evaluate
    from mitsuba_cfs.images.hdr import read_hdr

    picture = read_hdr(results / "view_06-21_12h.hdr")
    table = pd.read_csv(results / "dgp.csv")
    found = evaluate(picture.luminance, picture.view)
    assert found.Ev == pytest.approx(table["ev"][0], rel=0.005)  # 8 bits of RGBE: 0.4 %
    assert found.dgp == pytest.approx(table["dgp"][0], abs=0.002)


def test_same_inputs_and_seed_give_the_same_numbers(results, tmp_path):
    assert call(tmp_path / "again", *QUICK, "--no-cache") == 0  # traced again
    for name in ("daylight_metrics.csv", "dgp.csv", "temperatures.csv"):
        one, again = (pd.read_csv(f / name) for f in (results, tmp_path / "again"))
        numbers = one.select_dtypes("number").columns
        # the order of float sums may turn a sixth digit
        np.testing.assert_allclose(one[numbers], again[numbers], rtol=2e-5, atol=1e-9)


def test_an_earlier_result_is_replaced_and_a_foreign_folder_is_not(results, tmp_path, capsys):
    (tmp_path / "notes.txt").write_text("mine")
    assert call(tmp_path, *QUICK) == 1
    assert "--out" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def edited(source: Path, target: Path, edit) -> Path:
    target.write_text(edit(source.read_text(encoding="utf-8")), encoding="utf-8")
    return target


def with_field(text: str, line: int, field: int, value: str) -> str:
    lines = text.splitlines(keepends=True)
    words = lines[line].split(",")
    words[field] = value
    lines[line] = ",".join(words)
    return "".join(lines)


def without_line(text: str, number: int) -> str:
    lines = text.splitlines(keepends=True)
    return "".join(lines[:number] + lines[number + 1 :])


BAD = {
    "not an IFC": ("building", OFFICE, lambda text: "hello", ("bad", "IFC")),
    "IFC without spaces": (
        "building",
        OFFICE,
        lambda text: text.replace("IFCSPACE(", "IFCBUILDINGELEMENTPROXY("),
        ("bad",),
    ),
    "short EPW": ("weather", WEATHER, lambda text: text[: len(text) // 2], ("bad",)),
    "EPW with a missing hour": ("weather", WEATHER, lambda t: without_line(t, 4000), ("bad",)),
    "EPW with a word for a number": ("weather", WEATHER, lambda t: with_field(t, 4000, 14, "noon"), ("bad",)),
    "truncated BSDF": ("system", SYSTEM, lambda text: text[:20000], ("bad",)),
    "BSDF that makes light": (
        "system",
        SYSTEM,
        lambda t: t.replace("<ScatteringData>", "<ScatteringData>\n 9999, ", 1).replace(
            "</ScatteringData>", "</ScatteringData>", 1
        ),
        ("bad",),
    ),
    "BSDF of another basis": (
        "system",
        SYSTEM,
        lambda text: text.replace("LBNL/Klems Full", "LBNL/Klems Half"),
        ("bad",),
    ),
}


@pytest.mark.parametrize("fault", BAD)
def test_bad_files_give_one_line_that_names_them(fault, tmp_path, capsys):
    role, source, edit, words = BAD[fault]
    bad = edited(source, tmp_path / f"bad{source.suffix}", edit)
    if role == "weather" and bad.read_text() == source.read_text():
        pytest.fail("the edit did nothing")
    assert call(tmp_path / "out", *QUICK, **{role: bad}) == 1
    lines = capsys.readouterr().err.strip().splitlines()
    errors = [line for line in lines if line.startswith("error")]
    assert len(errors) == 1 and "Traceback" not in "".join(lines)
    assert all(word in errors[0] for word in words), errors
    assert not (tmp_path / "out").exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == [bad.name]


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["--space", "Nowhere"], "Nowhere"),
        (["--g", "0.01"], "g"),
        (["--picture", "noon"], "noon"),
        (["--height", "4.5"], "4.5"),
        (["--picture", "06-31 12"], "06-31"),
        (["--picture", "12-21 02"], "12-21 02"),
    ],
)
def test_bad_options_give_one_line(options, word, tmp_path, capsys):
    rest = QUICK[:3] + ([] if "--space" in options else QUICK[-2:])
    assert call(tmp_path / "out", *rest, *options) == 1
    errors = [s for s in capsys.readouterr().err.splitlines() if s.startswith("error")]
    assert len(errors) == 1 and word in errors[0], errors
    assert not (tmp_path / "out").exists()


def test_an_impossible_u_value_is_wrong_usage(tmp_path, capsys):
    assert call(tmp_path / "out", *QUICK, "--u", "9") == 2
    assert "'--u': 9.0 is not in the range" in capsys.readouterr().err


def test_a_folder_that_cannot_be_written_is_found_before_the_work(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert call(tmp_path / "file" / "out", *QUICK) == 1
    assert "out" in capsys.readouterr().err
    assert call(tmp_path / "file", *QUICK) == 1
    assert "is a file" in capsys.readouterr().err
