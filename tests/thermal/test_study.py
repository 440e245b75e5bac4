"""`cfs thermal`: a study from its file to tables, and one clear line for every fault."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from scenes.cli import run as main
from scenes.heat.study_file import read_study
from thermal.errors import ThermalInputError
from thermal.zone import Dimming, dimmed_share, split_gains

DEMO = Path(__file__).parents[2] / "scenes" / "demo"
WEATHER = DEMO / "USA_IL_Chicago-OHare.Intl.AP.725300_TMY3.epw"
BLIND = DEMO / "venetian_blind.xml"
BOX = """
[box]
width = 4.0
depth = 5.0
height = 3.0
[[box.window]]
x = 0.5
sill = 1.0
width = 3.0
height = 1.5
"""
TRACE = "[trace]\npatch_samples = 256\nsensor_samples = 256\n"


def study_file(folder: Path, text: str, *, weather: Path = WEATHER, bsdf: Path = BLIND) -> Path:
    """A study of the box with one system, and more text."""
    path = folder / "study.toml"
    systems = f'[[system]]\nbsdf = "{bsdf}"\n'
    path.write_text(f'weather = "{weather}"\n{BOX}{systems}{text}', encoding="utf-8")
    return path


def test_a_cellar_without_windows_needs_no_system(tmp_path, variant, capsys):
    path, under = tmp_path / "study.toml", 'left = "ground"\nfloor = "ground"\n'
    box = f"[box]\nwidth = 4\ndepth = 5\nheight = 2.4\n[box.adjacency]\n{under}"
    ground = '[envelope.ground]\nkind = "basement"\ndepth = 2.4\nperimeter = 5\n'
    text = f'weather = "{WEATHER}"\n{box}{ground}[loads]\nheating_c = 18\n'
    path.write_text(text, encoding="utf-8")
    assert main(["thermal", str(path), "--out", str(tmp_path / "out")]) == 0
    assert (
        "assumed: Not stated in the study: equipment 8 W/m2 (gains.equipment_w_m2), one person"
        in capsys.readouterr().out
    )
    hours = pd.read_csv(tmp_path / "out" / "hours.csv")
    assert hours["air_c"].min() > 18.0 - 1e-3 and hours["heating_w"].max() > 0.0


def test_study_of_a_box_with_two_states(tmp_path, variant, capsys):
    second = f'[[system]]\nbsdf = "{BLIND}"\nu_value = 0.9\n'
    text = (
        second
        + TRACE
        + """
[control]
rule = "irradiance"
close_above = 150.0
[gains]
lighting_w_m2 = 5.0
[loads]
heating_c = 20.0
cooling_c = 26.0
"""
    )
    assert main(["thermal", str(study_file(tmp_path, text)), "--out", str(tmp_path / "out")]) == 0
    hours = pd.read_csv(tmp_path / "out" / "hours.csv")
    summary = pd.read_csv(tmp_path / "out" / "summary.csv")
    assert len(hours) == 8760
    assert hours["air_c"].between(20.0 - 1e-3, 26.0 + 1e-3).all()
    assert set(hours["shading_state"]) == {0, 1}
    assert summary["heating_kwh"][0] == pytest.approx(hours["heating_w"].sum() / 1e3, abs=0.01)
    flows = [c for c in hours if c.endswith("_w") and c not in ("heating_w", "cooling_w")]
    total = hours[flows].drop(columns="storage_w").sum(axis=1) - hours["storage_w"]
    assert np.abs(total).max() < 1e-2  # written with four decimals
    assert hours["ppd"].between(5.0, 100.0).all()
    assert hours["set_c"].between(10.0, 40.0).all()
    months = pd.read_csv(tmp_path / "out" / "discomfort_by_month.csv")
    comfortable = summary["comfortable_h ASHRAE 55 80 %"][0]
    assert months["ASHRAE 55 80 % [h]"].sum() == 3650 - comfortable
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    assert record["study"]["control"]["rule"] == "irradiance"
    assert "comfortable" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[control]\nrule = 'schedule'\nschedule = [0, 1]\n", "expected 24 states, got 2"),
        ("[control]\nstate = 3\n", "a state outside 0 to 0"),
        ("[control]\nrule = 'sunny'\n", "control.rule"),
        ("[gains]\nequipment = 3\n", "gains.equipment"),
        ('u_model = "gap"\n' + TRACE, "belong together"),
        (
            'u_model = "gap"\nu_value = 3.0\n[system.gap]\nwidth = 0.016\n' + TRACE,
            "U = 3 is more than the layers let through",
        ),
        ("[loads]\nheating_limit_w = -5\n", "loads.heating_limit_w"),
        ("building = 3\n[[", "is not TOML"),
        ("[loads]\nheating_c = 26.0\ncooling_c = 20.0\n" + TRACE, "set points"),
    ],
)
def test_faults_are_one_line(tmp_path, variant, capsys, text, words):
    path = study_file(tmp_path, text)
    assert main(["thermal", str(path), "--out", str(tmp_path / "out")]) != 0
    lines = capsys.readouterr().err.strip().splitlines()
    assert len([line for line in lines if line.startswith("error:")]) == 1
    assert words in lines[-1]
    assert not (tmp_path / "out").exists()


def test_band_of_assumed_layers_is_in_kelvin(tmp_path, variant, capsys):
    text = f"u_value = 1.0\ng_value = 0.25\n{TRACE}view_factors = false\n"
    path = study_file(tmp_path, text)
    path.write_text(f"likely_layers = true\nstep_minutes = 60\n{path.read_text()}")
    assert main(["thermal", str(path), "--out", str(tmp_path / "out")]) == 0
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    (note,) = (note for note in record["notes"] if "other likely layers of its windows" in note)
    operative, glass = (float(value) for value in re.findall(r"(\d\.\d\d) K", note))
    assert 0.02 < operative < 1.0 and 0.02 < glass < 2.0
    assert note in " ".join(capsys.readouterr().out.split())


def test_missing_file_is_named(tmp_path, capsys):
    path = study_file(tmp_path, "", bsdf=tmp_path / "none.xml")
    assert main(["thermal", str(path), "--out", str(tmp_path / "out")]) != 0
    assert "none.xml" in capsys.readouterr().err


def test_study_needs_one_room(tmp_path):
    path = tmp_path / "s.toml"
    path.write_text(f'weather = "{WEATHER}"\n[[system]]\nbsdf = "{BLIND}"\n')
    with pytest.raises(ValueError, match="either `building` or"):
        read_study(path)


def test_lamps_dim_to_what_is_missing():
    daylight = [0.0, 250.0, 450.0, 500.0, 900.0]
    np.testing.assert_allclose(dimmed_share(daylight, Dimming(500.0)), [1.0, 0.5, 0.1, 0.0, 0.0])
    # EnergyPlus' Continuous: (f_L + (1 - f_L) least power - least light)/(1 - least light)
    curve = Dimming(500.0, least_light=0.2, least_power=0.3)
    half = (0.5 + 0.5 * 0.3 - 0.2) / 0.8
    np.testing.assert_allclose(dimmed_share(daylight, curve), [1.0, half, 0.3, 0.3, 0.3])
    off = replace(curve, off=True)
    np.testing.assert_allclose(dimmed_share(daylight, off), [1.0, half, 0.0, 0.0, 0.0])
    low = replace(curve, sensor_factor=0.8)  # it reads 200 of 250 lx
    assert dimmed_share(250.0, low) == pytest.approx(0.3 + 0.7 * (0.6 - 0.2) / 0.8)
    gains = split_gains(np.array([100.0]), 0.5, (np.array([40.0]), 0.25))
    assert gains.convective[0] == pytest.approx(80.0) and gains.radiant[0] == pytest.approx(60.0)
    with pytest.raises(ThermalInputError, match="target"):
        Dimming(0.0)
    with pytest.raises(ThermalInputError, match="least light"):
        Dimming(500.0, least_light=1.0)


def test_coupled_rooms_of_an_ifc(tmp_path, variant, capsys):
    path = tmp_path / "study.toml"
    path.write_text(
        f'weather = "{WEATHER}"\nbuilding = "{DEMO / "office.ifc"}"\ncouple = true\n'
        f'[[system]]\nbsdf = "{BLIND}"\n[air]\ndoor_m3_s = 0.05\n{TRACE}'
    )
    assert main(["thermal", str(path), "--out", str(tmp_path / "out")]) == 0
    years = [pd.read_csv(tmp_path / "out" / f"hours_{k}.csv") for k in (1, 2)]
    through = [hours["partitions_w"] for hours in years]
    assert np.abs(through[0]).mean() > 1.0
    assert abs(through[0].sum() + through[1].sum()) < 0.02 * np.abs(through[0]).sum()
    for hours in years:
        flows = [c for c in hours if c.endswith("_w") and c not in ("heating_w", "cooling_w")]
        total = hours[flows].drop(columns="storage_w").sum(axis=1) - hours["storage_w"]
        assert np.abs(total).max() < 1e-2  # written with four decimals
    # the person by the window feels it: not the mean of all surfaces
    assert "operative" in capsys.readouterr().out


def test_window_larger_than_its_wall_is_one_line(tmp_path, variant, capsys):
    path = study_file(tmp_path, TRACE)
    path.write_text(path.read_text().replace("width = 3.0", "width = 5.0"))
    assert main(["thermal", str(path), "--out", str(tmp_path / "out")]) != 0
    assert "window 0: does not lie inside the front side" in capsys.readouterr().err


def test_fault_of_a_system_names_it(tmp_path, variant, capsys):
    path = study_file(tmp_path, "g_value = 0.05\n" + TRACE)
    assert main(["thermal", str(path), "--out", str(tmp_path / "out")]) != 0
    error = capsys.readouterr().err
    assert "venetian blind" in error and "0.05 is below the solar transmittance 0.154" in error
