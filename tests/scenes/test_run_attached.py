"""`cfs run` on fenestration data in the IFC file, and its options for operation and cache."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import ifcopenshell
import numpy as np
import pandas as pd
import pytest

from bim.fenestration import AngularGValue
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.matrices.cache import digest
from scenes.cli import run
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.fenestration.resolver import g_by_patch
from scenes.fenestration.systems import read_system
from scenes.fenestration.thermal_system import thermal_system
from scenes.inputs import read_inputs
from scenes.run.options import JobOptions

pytestmark = pytest.mark.early

QUICK = [
    "--quick",
    "--size",
    "64",
    "--picture",
    "06-21 12",
    "--spacing",
    "2",
    "--space",
    "A",
    "--method",
    "three-phase",
]
TABLES = ("daylight_metrics.csv", "room_metrics.csv", "dgp.csv", "temperatures.csv", "comfort.csv")


@pytest.fixture
def blind(tmp_path) -> Path:
    """The demo's blind without the thermal values beside it."""
    path = tmp_path / "blind.xml"
    path.write_bytes(VENETIAN_BLIND.read_bytes())
    return path


def job(building: Path, out: Path, *options) -> int:
    """Exit code of `cfs run`."""
    return run(["run", *map(str, [building, "--weather", WEATHER, "--out", out, *QUICK, *options])])


def attach(building: Path, out: Path, *options) -> None:
    assert run(["ifc", "attach", *map(str, [building, "-o", out, *options])]) == 0


def without_stated_values(out: Path) -> None:
    """The demo's office whose windows state nothing of their glazing."""
    model = ifcopenshell.open(str(OFFICE))
    for one in model.by_type("IfcPropertySet"):
        if one.Name == "Pset_DoorWindowGlazingType":
            one.Name = "Pset_Other"
            one.HasProperties = [p for p in one.HasProperties if p.Name == "FillGas"]
    model.write(str(out))


def assert_same(one: Path, other: Path) -> None:
    for name in TABLES:
        a, b = (pd.read_csv(folder / name) for folder in (one, other))
        numbers = a.select_dtypes("number").columns
        # the order of float sums may turn a sixth digit
        np.testing.assert_allclose(a[numbers], b[numbers], rtol=2e-5, atol=1e-9, err_msg=name)


@pytest.mark.slow  # quick: with the `.toml` in place of --u, below
def test_attached_data_give_the_numbers_of_the_file(tmp_path, blind) -> None:
    with_data = tmp_path / "with_data.ifc"
    attach(OFFICE, with_data, "--all", "--bsdf", blind, "--u", "1.4")
    assert job(OFFICE, tmp_path / "file", "--cfs", blind, "--u", "1.4") == 0
    assert job(with_data, tmp_path / "attached") == 0
    assert_same(tmp_path / "file", tmp_path / "attached")
    manifest = json.loads((tmp_path / "attached" / "run.json").read_text())
    assert "system" not in manifest["inputs"]


def test_a_file_named_by_the_model_is_read_with_u_beside_it(tmp_path, blind) -> None:
    with_data = tmp_path / "with_data.ifc"
    attach(OFFICE, with_data, "--all", "--bsdf", blind, "--u", "1.4", "--reference")
    read = read_inputs(JobOptions(with_data, WEATHER, spaces=("A",)))
    systems = read.used_systems
    assert len(systems) == 1 and systems[0].u_value == 1.4
    expected = read_system(blind).solar
    for name, block in systems[0].solar.blocks().items():
        np.testing.assert_array_equal(block, getattr(expected, name))


def test_windows_without_data_are_named(tmp_path, blind, capsys) -> None:
    bare = tmp_path / "bare.ifc"
    without_stated_values(bare)
    assert job(bare, tmp_path / "out") == 1
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert error.startswith("error") and "window" in error and "--cfs" in error
    assert run(["ifc", "attach", str(bare), "-o", str(tmp_path / "u.ifc"), "--all", "--u", "1"]) == 0
    assert job(tmp_path / "u.ifc", tmp_path / "out") == 1
    assert "has no BSDF" in capsys.readouterr().err
    assert job(bare, tmp_path / "out", "--u", "1.1") == 1
    assert "--cfs" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_operation_through_the_command(tmp_path, blind, capsys) -> None:
    """States of the IFC's windows, closed by the clock; heated, cooled and lit."""
    with_data = tmp_path / "states.ifc"
    attach(OFFICE, tmp_path / "one.ifc", "--all", "--bsdf", blind, "--u", "1.4", "--state", "up")
    attach(tmp_path / "one.ifc", with_data, "--all", "--bsdf", blind, "--u", "0.9", "--state", "down")
    operation = tmp_path / "operation.toml"
    closed = ", ".join("1" if 10 <= hour < 16 else "0" for hour in range(24))
    operation.write_text(
        f'[control]\nrule = "schedule"\nschedule = [{closed}]\n'
        "[loads]\nheating_c = 20\ncooling_c = 26\n[gains]\nlighting_w_m2 = 8\n"
    )
    assert job(with_data, tmp_path / "out", "--operation", operation) == 0
    hours = pd.read_csv(tmp_path / "out" / "operation.csv", index_col="time", parse_dates=True)
    assert hours["shading_state"].groupby(hours.index.hour).first().tolist() == [
        int(10 <= hour < 16) for hour in range(24)
    ]
    loads = pd.read_csv(tmp_path / "out" / "loads.csv").iloc[0]
    said = capsys.readouterr().out
    for name in ("heating", "cooling", "lighting"):
        assert loads[f"{name}_kwh"] == pytest.approx(hours[f"{name}_w"].sum() / 1e3, rel=1e-4)
        assert f"{name} {loads[f'{name}_kwh']:.0f} kWh" in said
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Shading state" in page and "Three-phase method" in page and "ive-phase" not in page


def test_a_run_keeps_its_matrices_unless_told_not_to(tmp_path, blind, monkeypatch) -> None:
    monkeypatch.setenv("CFS_CACHE", str(tmp_path / "kept"))
    assert job(OFFICE, tmp_path / "one", "--cfs", blind, "--no-cache") == 0
    assert not (tmp_path / "kept").exists()
    assert job(OFFICE, tmp_path / "two", "--cfs", blind) == 0
    kept = sorted(path.name.rsplit("-", 1)[0] for path in (tmp_path / "kept").iterdir())
    # V of the sensors and of the windows, by which these reflect the room's light
    # D of the visible band serves the solar one where the reflectances are the same; D_d is for the
    # error of the sunny hours
    assert kept.count("view-matrix") == 2 and kept.count("daylight-matrix") in (2, 3)
    assert_same(tmp_path / "one", tmp_path / "two")


def test_g_of_a_table_is_linear_between_its_angles() -> None:
    polar = np.radians([0.0, 30.0, 90.0])
    theta, phi = KLEMS_FULL.centres()
    plain = AngularGValue(polar, np.zeros(1), np.array([[0.6], [0.3], [0.0]]))
    expected = np.interp(np.degrees(theta), [0, 30, 90], [0.6, 0.3, 0.0])
    np.testing.assert_allclose(g_by_patch(plain), expected)
    azimuth = np.radians([0.0, 90.0, 180.0, 270.0])
    turned = AngularGValue(polar, azimuth, np.array([[0.4] * 4, [0.4, 0.2, 0.4, 0.6], [0.0] * 4]))
    found = g_by_patch(turned)
    low, high = (np.argmin(np.hypot(theta - np.radians(30), phi - p)) for p in (azimuth[1:4:2]))
    assert found[low] < 0.3 < 0.5 < found[high]


def test_the_module_runs_as_a_program() -> None:
    """`python -m scenes.cli` is the command."""
    import subprocess
    import sys

    done = subprocess.run(
        [sys.executable, "-m", "scenes.cli", "--version"],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(str(files("scenes"))).parent,
    )
    assert done.returncode == 0 and done.stdout.startswith("cfs ")


FULL = """
u_model = "gap"
realised_inner_resistance = 0.125
realised_outer_resistance = 0.033
[gap]
width = 0.016
gas = { argon = 0.9, air = 0.1 }
emissivity = [0.837, 0.03]
"""


def both(blind: Path, tmp_path: Path, *options):
    """The systems of a run on the file with its `.toml`, and on the model it is attached to."""
    with_data = tmp_path / "with_data.ifc"
    attach(OFFICE, with_data, "--all", "--bsdf", blind, *options)
    for building, system in ((OFFICE, blind), (with_data, None)):
        inputs = read_inputs(JobOptions(building=building, weather=WEATHER, system=system, spaces=("A",)))
        (found,) = inputs.used_systems
        yield thermal_system(found)


@pytest.mark.parametrize("reference", [False, True])
@pytest.mark.parametrize(
    "toml",
    [
        VENETIAN_BLIND.with_suffix(".toml").read_text() + FULL,
        "u_value = 1.37\ng_value = 0.31\nu_model = 'linear'\n",
        "shading_position = 'integrated'\n",
    ],
    ids=["all", "scalars", "position"],
)
def test_the_toml_beside_the_bsdf_is_attached_bit_for_bit(tmp_path, blind, toml, reference) -> None:
    blind.with_suffix(".toml").write_text(toml)
    options = ["--reference"] if reference else []
    file, attached = both(blind, tmp_path, *options)
    # dataclasses of arrays and numbers: the digest is of every bit; the names are the windows'
    bare = [replace(one, fenestration=replace(one.fenestration, name=""), notes=()) for one in (file, attached)]
    assert digest(bare[0]) == digest(bare[1])


def test_a_model_that_names_a_bsdf_has_the_toml_beside_that(tmp_path, blind) -> None:
    """The reference was made before there was a `.toml`, or by another program."""
    with_data = tmp_path / "with_data.ifc"
    attach(OFFICE, with_data, "--all", "--bsdf", blind, "--reference")
    blind.with_suffix(".toml").write_text("u_value = 0.77\ng_value = 0.25\n")
    (system,) = read_inputs(JobOptions(with_data, WEATHER, spaces=("A",))).used_systems
    assert (system.u_value, system.g_value) == (0.77, 0.25)


def test_the_same_room_has_the_same_temperatures_from_file_and_model(tmp_path, blind) -> None:
    toml = VENETIAN_BLIND.with_suffix(".toml").read_text()
    blind.with_suffix(".toml").write_text(toml + FULL)
    with_data = tmp_path / "with_data.ifc"
    attach(OFFICE, with_data, "--all", "--bsdf", blind)
    assert job(OFFICE, tmp_path / "file", "--cfs", blind) == 0
    assert job(with_data, tmp_path / "model") == 0
    for name in TABLES:
        one, other = ((tmp_path / folder / name).read_bytes() for folder in ("file", "model"))
        assert one == other, name
    manifest = json.loads((tmp_path / "model" / "run.json").read_text())
    assert "system" not in manifest["inputs"]


def test_what_is_given_goes_before_the_toml_and_is_said(tmp_path, blind, capsys) -> None:
    blind.with_suffix(".toml").write_text("u_value = 1.2\ng_value = 0.31\n")
    out = tmp_path / "out.ifc"
    attach(OFFICE, out, "--all", "--bsdf", blind, "--u", "0.9", "--g", "0.28")
    said = capsys.readouterr().out
    assert "U 0.9 W/(m2 K) from --u (1.2 in blind.toml is not used)" in said
    assert "g from --g 0.28 (g in blind.toml is not used)" in said
    assert "BSDF (Visible, Solar) copied from blind.xml" in said
    (system,) = read_inputs(JobOptions(out, WEATHER, spaces=("A",))).used_systems
    assert (system.u_value, system.g_value, system.g_by_patch) == (0.9, 0.28, None)
    attach(OFFICE, out, "--all", "--bsdf", blind)
    assert "g 0.31 at normal incidence from blind.toml" in capsys.readouterr().out
    assert run(["ifc", "attach", str(OFFICE), "--all", "--g", "1.4", "-o", str(out)]) == 1
    assert run(["ifc", "attach", str(OFFICE), "--all", "--g", "no.csv", "-o", str(out)]) == 1
    said = capsys.readouterr().err
    assert "--g: expected 0 to 1" in said and "expected a number or a CSV file" in said
