"""The examples in docs/ and README.md: Python is run, study files are read."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from tests.conftest import REPOSITORY

pytestmark = pytest.mark.early

PAGES = [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").rglob("*.md"))]
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILES = {  # the names that the pages use
    "blind.xml": VENETIAN_BLIND,
    "blind.toml": VENETIAN_BLIND.with_suffix(".toml"),
    "shade.xml": VENETIAN_BLIND,
    "CITY.epw": WEATHER,
    "city.epw": WEATHER,
    "Lyon.epw": WEATHER,
    "house.ifc": OFFICE,
    "office.ifc": OFFICE,
    "model.hbjson": REPOSITORY / "docs" / "tutorials" / "two_rooms.hbjson",
    "quarter.city.json": REPOSITORY / "docs" / "tutorials" / "quarter.city.json",
    "horizon.csv": REPOSITORY / "docs" / "tutorials" / "horizon.csv",
    "office.rad": REPOSITORY / "docs" / "tutorials" / "office.rad",
}


def examples(page: Path, language: str) -> list[str]:
    """The page's examples in a language."""
    return [code for kind, code in FENCE.findall(page.read_text("utf-8")) if kind == language]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with the files that the pages name, as the working directory."""
    from mitsuba_cfs.images.hdr import write_hdr
    from mitsuba_cfs.images.view import fisheye

    for name, source in FILES.items():
        shutil.copy(source, tmp_path / name)
    view = fisheye((0, 0, 0), (0, 1, 0), 64)
    write_hdr(tmp_path / "desk.hdr", np.full((64, 64), 100.0, np.float32), view)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def two_facades() -> dict:
    """A room with two window groups, two sensors and an eye, and a sampling for a few seconds."""
    from mitsuba_cfs.images.view import fisheye
    from mitsuba_cfs.methods.scene import DaylightScene, Sampling
    from tests.trace import rooms

    interior, groups, exterior = rooms.l_shaped_room()
    points, up = np.array([[2.0, 1.0, 0.8], [1.0, 4.5, 0.8]]), np.tile([0.0, 0.0, 1.0], (2, 1))
    view = fisheye((2.0, 2.0, 1.2), (0, -1, 0), 48)
    sampling = Sampling(
        sensor_samples=256,
        patch_samples=64,
        sun_points=16,
        view_samples=1,
        outdoor_samples=1,
        subdivision=1,
        window_parts=1,
    )
    scene = DaylightScene(interior, exterior, groups, points, up, view)
    return {"scene": scene, "sampling": sampling}


def given(page: str) -> dict:
    """What a page's examples take for granted."""
    if page == "daylight.md":
        return two_facades()
    if page != "glare.md":
        return {}
    from mitsuba_cfs.bsdf.klems import KLEMS_FULL
    from mitsuba_cfs.bsdf.xml import read_bsdf_xml
    from mitsuba_cfs.images.view import fisheye
    from mitsuba_cfs.sky.patches import ReinhartSky
    from mitsuba_cfs.trace.kernels.scattering import sun_scattering
    from scenes.cost import room

    P, K, H = ReinhartSky(4).size, KLEMS_FULL.size, 4
    sky = np.full((P, H), 1000.0, dtype=np.float32)
    return {
        "pictures_of_the_year": [np.full((64, 64), 100.0, dtype=np.float32)],
        "interior": room.room(),
        "exterior": room.NOTHING,
        "groups": room.window_groups(),
        "view": fisheye((1.8, 2.0, 1.2), (0, -1, 0), 48),
        "scattering": [sun_scattering(read_bsdf_xml(VENETIAN_BLIND).band("Visible"))],
        "T_D_s": np.full((1, K, H), 200.0),
        "T_Dd_sd": np.zeros((1, K, H)),
        "D": np.full((1, K, P), 1.0 / P),
        "D_d": np.zeros((1, K, P)),
        "sky": sky,
        "s_d": 0 * sky,
        "sun_directions": np.tile([0.0, -0.8, 0.6], (H, 1)),
        "direct_normal": np.full(H, 5e4),
    }


@pytest.mark.parametrize("page", [page for page in PAGES if examples(page, "python")], ids=lambda page: page.name)
def test_python_examples_run(page, folder, variant):
    """Those of a page one after the other, with one another's names."""
    names = given(page.name)
    for number, code in enumerate(examples(page, "python"), 1):
        exec(compile(code, f"{page.name}, example {number}", "exec"), names)


def test_a_tool_starts_a_job_and_reads_it_as_the_docs_say(folder, monkeypatch):
    import os
    import sys

    page = (REPOSITORY / "docs" / "formats.md").read_text("utf-8").partition("### For tools that start")[2]
    page = page.partition("### Results in xarray")[0]
    (code,) = [code for kind, code in FENCE.findall(page) if kind == "py"]
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    names: dict = {}
    exec(compile(code, "formats.md", "exec"), names)
    assert names["progress"] and names["checked"]["rooms"]
    for keys in (*names["progress"], names["checked"]):
        assert {key for key in keys if f"`{key}`" not in page} == set()
    for row, entry in (("rooms", "guid label use floor_m2 windows"), ("issues", "code severity where what")):
        assert set(entry.split()) <= set(names["checked"][row][0])
    Path("model.hbjson").write_text("{")
    with pytest.raises(SystemExit, match=r"^error: model.hbjson"):
        exec(compile(code, "formats.md", "exec"), names)


def test_study_files_in_the_docs_are_read(folder):
    from scenes.study.study_file import read_study

    found = examples(REPOSITORY / "docs" / "studies.md", "toml")
    for code in found:
        path = folder / "study.toml"
        path.write_text(code)
        read_study(path)
    assert found


def test_the_design_file_in_the_docs_is_read(folder):
    from scenes.design.candidates import mattering
    from scenes.design.design_file import read_design

    (code,) = examples(REPOSITORY / "docs" / "design.md", "toml")
    shutil.copy(WEATHER.with_name("loads.toml"), folder)
    (folder / "design.toml").write_text(code)
    mattering(read_design(folder / "design.toml"), folder)


def test_the_system_and_operation_files_of_the_quick_start_are_read(folder):
    from scenes.fenestration.thermal_file import ThermalFile
    from scenes.room.operation_tables import OperationTables
    from scenes.toml_file import read_table, validated

    system, operation, _page = examples(REPOSITORY / "docs" / "quickstart.md", "toml")
    path = folder / "system.toml"
    path.write_text(system)
    values = ThermalFile.read(path)
    assert (values.u_value, values.g_value, values.shading_position) == (1.1, 0.25, "external")
    path = folder / "office.toml"
    path.write_text(operation)
    assert validated(OperationTables, read_table(path), path).control.rule == "irradiance"


def test_the_page_of_the_quick_start_is_read(folder):
    from scenes.page_options import (
        DesignSection,
        DossierSection,
        FitSection,
        GlareSection,
        RunSection,
        StudySection,
        read_page,
    )

    text = (REPOSITORY / "docs" / "quickstart.md").read_text("utf-8")
    (code,) = [c for c in examples(REPOSITORY / "docs" / "quickstart.md", "toml") if "logo" in c]
    (folder / "page.toml").write_text(code)
    (folder / "logo.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"/>')
    assert read_page(folder / "page.toml", RunSection).left_out == ("glossary", "model")
    for command, sections in (
        ("run", RunSection),
        ("study", StudySection),
        ("design", DesignSection),
        ("fit", FitSection),
        ("comply", DossierSection),
        ("dgp", GlareSection),
    ):
        row = text.partition(f"| `cfs {command}` | ")[2].partition(" |")[0]
        assert set(row.replace("; of each room", ",").split(", ")) == set(get_args(sections))


def test_tables_of_the_heat_page_have_no_unknown_keys(folder):
    from scenes.heat.study_file import StudyFile
    from scenes.room.operation_tables import OperationTables
    from scenes.toml_file import read_table, validated

    study, rules, across, schedules, *parts = examples(REPOSITORY / "docs" / "thermal.md", "toml")
    whole = 'weather = "a.epw"\nbuilding = "a.ifc"\ncouple = true\n'
    models = [(StudyFile, study), *((OperationTables, one) for one in (rules, across, schedules))]
    box = '[[system]]\nbsdf = "a.xml"\n[box]\nwidth = 3\ndepth = 4\nheight = 3\nwindow = []\n'
    models += [(StudyFile, part + box if "weather =" in part else whole + part) for part in parts]
    assert len(parts) == 5
    for model, code in models:
        path = folder / "heat.toml"
        path.write_text(code)
        validated(model, read_table(path), path)


MEASURED = "twin_house_*.toml"  # their files are written from measured data, test_twin_house
TUTORIALS = sorted(path for path in (REPOSITORY / "docs" / "tutorials").glob("*.toml") if not path.match(MEASURED))


@pytest.mark.parametrize("path", TUTORIALS, ids=lambda path: path.name)
def test_tutorial_files_are_whole_studies_of_heat(path):
    """Everything that a run reads of them before it traces."""
    from scenes.heat.files import read_files
    from scenes.heat.study_file import read_study

    read_files(read_study(path), path)


def test_commands_in_the_docs_exist():
    """Every `cfs NAME` at the start of a line of an example, with options that it has."""
    import click

    from scenes import cli

    context = click.Context(cli.cfs)
    for page in PAGES:
        blocks = re.findall(r"^```\w*\n(.*?)^```$", page.read_text("utf-8"), re.M | re.S)
        for line in re.findall(r"^cfs .*$", "\n".join(blocks).replace("\\\n", " "), re.M):
            words = line.partition("#")[0].split()
            command, depth = cli.cfs, 1
            while isinstance(command, click.Group) and len(words) > depth:
                name = words[depth]
                if name.startswith("-"):
                    break
                found = command.get_command(context, name)
                assert found is not None, f"{page.name}: {line}"
                command, depth = found, depth + 1
            known = {o for p in command.params for o in (*p.opts, *p.secondary_opts)}
            wrong = [w for w in words[depth:] if w.startswith("--") and w not in known]
            assert not (wrong and not passes_on(command)), f"{page.name}: {line}: {wrong}"


def passes_on(command) -> bool:
    """Commands that take another program's options as they are."""
    return command.context_settings.get("ignore_unknown_options", False)
