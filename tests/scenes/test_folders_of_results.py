"""Folders and files of results of each command: whose they are, and what is never touched."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from scenes import cli
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.result_folder import MARK
from tests.scenes.writing_jobs import FILES, FOLDERS, JOBS, OWN, PV_STUDY, Place, heavy_ones_slow, refused, to_folder

pytestmark = [pytest.mark.early, pytest.mark.usefixtures("own_cache")]


@pytest.mark.parametrize("name", heavy_ones_slow([*OWN, "export --radiance"]))
def test_a_folder_is_ours_by_its_mark_alone(name, place, capsys):
    """A `run.json` of somebody else's, and a mark that another program wrote."""
    here = place(name)
    here.out.mkdir()
    (here.out / "thesis.docx").write_text("mine")
    (here.out / "run.json").write_text('{"inputs": {}, "options": {}}')
    before = here.content()
    option = "--radiance" if name == "export --radiance" else "--out"
    refused(here, capsys, option, "holds other files")
    assert here.content() == before
    for wrong in ("{", "[]", '{"program": "other"}', '{"program": "mitsuba-cfs", "format": 99}'):
        (here.out / MARK).write_text(wrong)
        refused(here, capsys, option, "holds other files")
    assert (here.out / "thesis.docx").read_text() == "mine"


@pytest.mark.parametrize("name", heavy_ones_slow(FOLDERS))
def test_files_of_others_in_a_folder_of_ours_stay(name, place, capsys):
    here = place(name)
    assert cli.run(here.words) == 0
    ours = json.loads((here.out / MARK).read_text())["files"]
    assert ours and all((here.out / one).is_file() for one in ours)
    before = set(here.content())
    (here.out / "notes").mkdir()
    (here.out / "notes" / "thesis.docx").write_text("mine")
    assert cli.run(here.words) == 0
    assert set(here.content()) == before | {"out/notes/thesis.docx"}
    # a file of another's with the name of a result, known by the mark
    taken = sorted(ours)[0]
    record = json.loads((here.out / MARK).read_text())
    record["files"].remove(taken)
    (here.out / MARK).write_text(json.dumps(record))
    (here.out / taken).write_text("mine")
    refused(here, capsys, taken, "no earlier run wrote", "results-1")
    assert (here.out / taken).read_text() == "mine"
    assert (here.out / "results-1" / taken).is_file()


@pytest.mark.parametrize("name", heavy_ones_slow(OWN))
def test_the_current_folder_and_that_of_an_input_are_refused(name, place, capsys, monkeypatch):
    here = place(name)
    monkeypatch.chdir(here.out.parent)
    for out in (Path("."), here.out.parent.parent, here.out.parent):
        refused(Place(here.job, here.inputs, out), capsys, "the current folder")
    if name in ("study", "thermal"):
        refused(Place(here.job, here.inputs, here.inputs), capsys, "is or contains the input")
    assert not list(here.out.parent.iterdir())


def test_the_folder_of_an_input_is_refused(place, capsys, tmp_path):
    building = tmp_path / "model" / "office.ifc"
    building.parent.mkdir()
    shutil.copy(OFFICE, building)
    for name, *more in (["run"], ["dgp"], ["pv", "--study", PV_STUDY]):
        here = place("run")
        here.job = to_folder(name, building, "--weather", WEATHER, *more)
        for out in (building.parent, tmp_path / "model" / ".." / "model"):
            refused(Place(here.job, here.inputs, out), capsys, "--out", str(building))
    assert building.read_bytes() == OFFICE.read_bytes()


@pytest.mark.parametrize("name", heavy_ones_slow(OWN))
def test_another_commands_results_are_refused(name, place, capsys):
    here = place(name)
    here.out.mkdir()
    record = {"program": "mitsuba-cfs", "format": 1, "command": "other", "files": []}
    (here.out / MARK).write_text(json.dumps(record | {"removed": []}))
    refused(here, capsys, "holds results of `cfs other`")


@pytest.mark.parametrize("name", heavy_ones_slow(FOLDERS))
def test_a_link_to_a_folder_is_followed(name, place, tmp_path):
    here = place(name)
    (tmp_path / "elsewhere").mkdir()
    here.out.symlink_to(tmp_path / "elsewhere")
    for _ in range(2):
        assert cli.run(here.words) == 0
    assert here.out.is_symlink() and (tmp_path / "elsewhere" / MARK).is_file()


@pytest.mark.parametrize("name", heavy_ones_slow(FILES))
def test_a_link_to_a_file_is_followed(name, place, tmp_path):
    here = place(name)
    real = tmp_path / f"real{here.out.suffix}"
    here.out.symlink_to(real)
    assert cli.run(here.words) == 0
    assert here.out.is_symlink() and real.stat().st_size > 0


@pytest.mark.parametrize("name", [name for name in JOBS if name != "glare -c"])
def test_a_file_for_a_folder_and_a_folder_for_a_file_are_refused(name, place, capsys):
    here = place(name)
    if here.job.folder:
        here.out.write_text("mine")
    else:
        here.out.mkdir()
    try:
        refused(here, capsys, "is a f")  # file, folder
    except AssertionError:  # click's own way to say it
        refused(here, capsys, "is a", str(here.out), code=cli.USAGE)
    assert here.out.is_dir() or here.out.read_text() == "mine"


@pytest.mark.parametrize(
    "words",
    [
        ["check", "office.ifc", "--csv", "office.ifc"],
        ["export", "office.ifc", "--epjson", "office.ifc"],
        ["export", "office.ifc", "--gltf", "office.ifc"],
        ["ifc", "survey", "office.ifc", "--markdown", "office.ifc"],
        ["sky", "wea", "weather.epw", "weather.epw"],
        ["sky", "matrix", "weather.epw", "weather.epw"],
        ["sky", "positions", "weather.epw", "weather.epw"],
        ["bsdf", "combine", "blind.xml", "blind.xml", "--out", "blind.xml"],
    ],
)
def test_an_input_is_no_output(words, tmp_path, monkeypatch, capsys):
    for source, name in ((OFFICE, "office.ifc"), (WEATHER, "weather.epw"), (VENETIAN_BLIND, "blind.xml")):
        shutil.copy(source, tmp_path / name)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    monkeypatch.chdir(tmp_path)
    assert cli.run(words) == 1
    assert "is an input of this command" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_second_year_of_glare_leaves_no_picture_of_the_first(place):
    here = place("dgp")
    assert cli.run(here.words) == 0
    first = set(here.content())
    assert cli.run([*here.words, "--seed", "1"]) == 0
    second = set(here.content())
    assert len([name for name in second if name.endswith("_sources.png")]) == 1
    assert first != second and len(first) == len(second)
    assert list((here.out / "ratings").iterdir()), "what lets a run go on stays"
