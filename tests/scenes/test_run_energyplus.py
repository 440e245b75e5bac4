"""`cfs run --energyplus`: the model that EnergyPlus reads follows the shading states of every hour."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from scenes.cli import run
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER

BLINDS = f"""
[[system]]
bsdf = "{Path(VENETIAN_BLIND).with_name("glazing.xml")}"
[[system]]
bsdf = "{VENETIAN_BLIND}"
[control]
rule = "irradiance"
close_above = 200
across = "building"
groups = "room"
[loads]
heating_c = 20
"""


@pytest.fixture(scope="module")
def office(tmp_path_factory) -> Path:
    """An operation file that moves the windows of all rooms together."""
    file = tmp_path_factory.mktemp("run") / "office.toml"
    file.write_text(BLINDS)
    return file


def arguments(operation: Path, out: Path, *more: str) -> list[str]:
    files = [str(OFFICE), "--weather", str(WEATHER), "--operation", str(operation), "--out", str(out)]
    return ["run", *files, "--quick", "--energyplus", *more]


@pytest.mark.slow
def test_the_written_model_has_the_states_of_the_hours(office, tmp_path) -> None:
    out = tmp_path / "out"
    assert run(arguments(office, out)) == 0
    schedules = pd.read_csv(out / "schedules.csv")
    states = [pd.read_csv(file)["shading_state"] for file in sorted(out.glob("*/operation.csv"))]
    written = [schedules[name] for name in schedules if name.endswith("state")]
    assert len(states) == 2 and len(written) == 1, "one group across the building has one schedule"
    for ours in states:
        assert (ours.to_numpy() == written[0].to_numpy()).all() and ours.sum() > 100
    model = json.loads((out / "model.epJSON").read_text())
    moved = [one["actuated_component_control_type"] for one in model["EnergyManagementSystem:Actuator"].values()]
    assert moved == ["Construction State"] * 2


def test_rooms_without_heat_between_them_are_not_written(office, tmp_path, capsys) -> None:
    assert run(arguments(office, tmp_path / "out", "--no-coupled-heat")) == 1
    assert "leave out --no-coupled-heat" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
