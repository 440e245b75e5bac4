"""The study files of docs/tutorials read; and (slow) what they say beside other programs."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import write_text
from scenes.cli import run as main
from scenes.fenestration.library import write_library_system
from scenes.fenestration.systems import read_system, system_of_panes
from scenes.fenestration.thermal_file import GlazingLayerTable
from scenes.fenestration.thermal_system import thermal_system
from scenes.heat.study_file import StudyFile, read_study
from scenes.room.operation import read_operation, read_state
from tests.validation import ashrae140_studies, energyplus_study
from tests.validation.ashrae140 import RANGES
from tests.validation.ashrae140_sun import ANGLES, glass

REPOSITORY = Path(__file__).parents[2]
TUTORIALS = REPOSITORY / "docs" / "tutorials"
WHOLE = ("energyplus_room", "office_heated_slab", "office_schedules")  # all their files are here
CLEAR = {"thickness": 0.003048, "solar": (0.834, 0.075, 0.075)}
PANES = (CLEAR | {"gap": {"width": 0.012}}, CLEAR)


@pytest.mark.parametrize("file", sorted(ashrae140_studies.STUDIES.glob("*.toml")), ids=lambda f: f.stem)
def test_case_of_the_standard_reads(file: Path, tmp_path: Path) -> None:
    (tmp_path / ashrae140_studies.WEATHER).write_text("")
    study = read_study(Path(shutil.copy(file, tmp_path)))
    unheated, uncooled = (file.stem[1:].startswith("50"), file.stem.endswith("FF"))
    assert (study.loads.heating_c is None) == (unheated or uncooled)
    assert (study.loads.cooling_c is None) == uncooled and study.terrain == "country"
    assert study.system[0].bsdf is None


def test_panes_alone_are_a_system() -> None:
    """At the normal by the formula of two panes; oblique near that without polarisation."""
    layers = [GlazingLayerTable.model_validate(pane) for pane in PANES]
    found = system_of_panes(layers)
    tau, rho = 0.834, 0.075
    direct = found.solar.direct_hemispherical(found.solar.transmission_front)
    assert direct[0] == pytest.approx(tau**2 / (1 - rho**2), abs=2e-4)
    theirs = np.interp(np.radians(50), ANGLES, glass("double").tau)
    assert found.angular.transmitted(np.radians(50)) == pytest.approx(theirs, abs=0.015)
    assert any("no visible values" in note for note in found.notes)
    seen = system_of_panes([GlazingLayerTable.model_validate(pane | {"visible": (0.9, 0.08, 0.08)}) for pane in PANES])
    assert not seen.notes
    visible = seen.visible.direct_hemispherical(seen.visible.transmission_front)
    assert visible[0] == pytest.approx(0.9**2 / (1 - 0.08**2), abs=2e-4)


def test_layers_of_a_study_go_before_u_and_g_of_the_file_beside() -> None:
    study = read_study(TUTORIALS / "energyplus_room.toml")
    (table,) = study.system
    heat = thermal_system(read_state(table, table.bsdf))
    assert heat.fenestration.u_value == pytest.approx(0.985, abs=0.002)  # beside: 0.884
    assert heat.g_value[0] == pytest.approx(0.201, abs=0.001)  # beside: 0.2093


def test_a_state_has_the_layers_beside_its_bsdf_unless_its_table_states_its_own(tmp_path) -> None:
    """In an operation file as in a study; the same U as that of `--cfs`."""
    write_library_system("double low-e", "", tmp_path / "glass.xml")
    text = '[[system]]\nbsdf = "glass.xml"\n'
    write_text(tmp_path / "moved.toml", text + '[[system]]\nbsdf = "glass.xml"\nu_model = "typical"\n')
    beside, typical = read_operation(tmp_path / "moved.toml").systems
    expected = thermal_system(read_system(tmp_path / "glass.xml"))
    assert thermal_system(beside).fenestration.u_value == expected.fenestration.u_value
    assert not any("layers assumed" in note for note in thermal_system(beside).notes)
    assert typical.closure.unit is None
    write_text(tmp_path / "x.epw", "")
    box = "[box]\nwidth = 4\ndepth = 5\nheight = 3\n[[box.window]]\nx = 1\nsill = 1\nwidth = 2\nheight = 1\n"
    write_text(tmp_path / "room.toml", f'weather = "x.epw"\n{box}{text}')
    (table,) = read_study(tmp_path / "room.toml").system
    assert read_state(table, table.bsdf).closure.unit is not None


@pytest.mark.parametrize(
    ("system", "said"),
    [
        ({}, "bsdf"),
        ({"layers": [{"openness": 0.03}]}, "layers.0"),
        ({"layers": [{"thickness": 0.004}]}, "layers.0.solar"),
    ],
)
def test_what_a_system_lacks_is_named(system: dict, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        StudyFile.model_validate({"weather": "x.epw", "building": "x.ifc", "system": [system]})


def test_terrain_and_outside_faces_are_checked(tmp_path: Path) -> None:
    text = (TUTORIALS / "energyplus_room.toml").read_text()
    path = tmp_path / "study.toml"
    for old, new, field in (
        ('"suburbs"', '"forest"', "terrain"),
        ("outside_absorptance = 0.5", "outside_absorptance = 50", "outside_absorptance"),
    ):
        path.write_text(text.replace(old, new))
        with pytest.raises(DataError, match=field):
            read_study(path)


@pytest.mark.slow
def test_blind_by_its_layers_meets_the_bars() -> None:
    """The bars of the external blind: air 0.5 K, window 0.7 K; from the file alone."""
    found = energyplus_study.differences(energyplus_study.study_hours(), "blind")
    assert (found["RMSE [K]"] < [0.5, 0.7]).all()


@pytest.mark.slow
def test_cases_of_the_standard_lie_in_the_range_of_its_programs(reference_data, tmp_path) -> None:
    reference = reference_data / "ashrae140"
    if not (reference / RANGES).is_file():
        pytest.skip("ASHRAE 140's figures (../shared/reference/ashrae140) are not here")
    found = ashrae140_studies.compare(reference, tmp_path)
    assert len(found) == 60
    assert found["inside"].all(), found[~found["inside"]]


@pytest.mark.slow
@pytest.mark.parametrize("name", WHOLE)
def test_tutorial_runs_as_a_user_runs_it(name: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main(["thermal", str(TUTORIALS / f"{name}.toml"), "--out", str(out)]) == 0
    record = json.loads((out / "run.json").read_text())
    hours = pd.read_csv(sorted(out.rglob("hours*.csv"))[0], index_col=0, parse_dates=True)
    assert record["notes"] and len(hours) == 8760
    if name == "office_heated_slab":
        assert hours["heated_slab_w"].max() > 100 and (out / "design_days.csv").is_file()
    if name.startswith("office"):
        assert_night_air_passes_midnight(hours)
    if name == "office_schedules":
        assert_week_is_kept(hours)


def assert_night_air_passes_midnight(hours: pd.DataFrame) -> None:
    """Four air changes from 22 to 6 h in summer: by far the most of the air's heat then."""
    july = hours[hours.index.month == 7]
    lost = -july["air_exchange_w"].groupby(july.index.hour).mean()
    assert lost[[23, 0, 5]].min() > 30 > lost[[7, 12, 20]].max()


def assert_week_is_kept(hours: pd.DataFrame) -> None:
    """January at noon: 21 degC on weekdays, 16 degC and no more than the sun's at weekends."""
    january = hours[(hours.index.month == 1) & (hours.index.hour == 12)]["air_c"]
    working = january.iloc[1:].to_numpy().reshape(-1, 5)[:1]  # Monday 2 to Friday 6
    weekend = january.iloc[[6, 7, 13, 14]]  # the file's year begins with a Sunday
    assert working == pytest.approx(21.0, abs=0.2)
    assert weekend.max() < 17.0
