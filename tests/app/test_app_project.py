"""The project folder of `cfs app`: files that the command line reads, commands that it takes."""

from __future__ import annotations

import os
import shutil
import time
import tomllib
from pathlib import Path

import click
import pytest

from bim.ifc.corrections import read_corrections
from mitsuba_cfs.errors import DataError
from scenes.app import actions
from scenes.app.project import MadeSystem, Project, plain_name, slug, toml_text
from scenes.cli import cfs
from scenes.comply.uses import read_uses
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.fenestration.generic_glazing import GENERIC_GLAZINGS
from scenes.fenestration.library import library, sheets, write_library_system
from scenes.page_options import DossierSection, RunSection, read_page
from scenes.result_folder import ResultFolder
from scenes.room.operation import read_operation
from scenes.study.files import check_files
from scenes.study.study_file import read_study
from tests.conftest import REPOSITORY

GLAZING = VENETIAN_BLIND.with_name("glazing.xml")
TWO_ROOMS = REPOSITORY / "docs" / "tutorials" / "two_rooms.hbjson"


def take(project: Project, file: Path) -> str:
    part = project.folder / "inputs" / ".upload"
    shutil.copyfile(file, part)
    return project.take(part, file.name).path


@pytest.fixture
def project(tmp_path) -> Project:
    one = Project(tmp_path / "project")
    for file in (OFFICE, WEATHER, GLAZING, VENETIAN_BLIND):
        take(one, Path(file))
    return one


def test_toml_comes_back_as_it_was() -> None:
    table = {
        "title": 'A "B" \\ ü\x7f\n',
        "n": 3,
        "x": 0.1,
        "yes": True,
        "list": [1.0, 2.0],
        "none": [],
        "options": {"a b": 1, "seed": 0},
        "room": [{"name": "r", "spaces": ["1", "2"]}, {"name": "s"}],
        "control": {"rule": "glare", "zone": [{"x": [[0, 1]]}]},
        "rooms": {"\U0001f600\x7f": "office"},
        "radius": float("inf"),
    }
    assert tomllib.loads(toml_text(table)) == table


STUDY = """\
# Two systems for the south side
title = "A"  # as the client calls it

[[room]]
name = "office"
building = "a.ifc"  # as built

# before the client changed his mind
[[system]]
name = "first"
bsdf = "a.xml"

# by the maker
[[system]]
name = "second"
bsdf = "b.xml"  # WINDOW 7.8

[options]  # of all runs
seed = 3  # the third
"""


def test_comments_of_a_study_file_stay() -> None:
    table = tomllib.loads(STUDY)
    assert toml_text(table, STUDY) == STUDY
    table |= {"title": "B", "quick": True}
    table["room"][0]["furniture"] = True
    table["system"] = [*table["system"][1:], {"name": "third", "bsdf": "c.xml"}]
    table["options"]["sensor_spacing"] = 0.5
    text = toml_text(table, STUDY)
    assert tomllib.loads(text) == table
    for comment in ("# Two systems", "# as the client", "# as built", "# WINDOW 7.8", "# of all runs", "# the third"):
        assert comment in text
    assert text.index("furniture") < text.index("# before the client")


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("a.ifc", "a.ifc"),
        ("../../a.ifc", "a.ifc"),
        ("C:\\x\\a.ifc", "a.ifc"),
        ("..", ""),
        ("a:b?.epw", "a_b_.epw"),
        (" ü (1).xml ", "ü (1).xml"),
        (".hidden", "hidden"),
    ],
)
def test_names_of_files(text, name) -> None:
    assert plain_name(text) == name


def test_the_study_file_is_one_of_cfs_study(project) -> None:
    project.change({"title": "Two systems", "spaces": ["A South office"], "quick": True})
    study = read_study(project.folder / "study.toml")
    check_files(study)
    assert study.title == "Two systems" and study.quick
    assert study.room[0].building == project.folder / "inputs" / "office.ifc"
    assert study.room[0].spaces == ("A South office",)
    assert [one.name for one in study.system] == ["glazing", "venetian_blind"]


def test_several_ifc_files_are_one_building(project) -> None:
    shutil.copyfile(OFFICE, project.folder / "facade.ifc")
    take(project, project.folder / "facade.ifc")
    assert project.building() == ["inputs/office.ifc", "inputs/facade.ifc"]
    study = read_study(project.folder / "study.toml")
    assert study.inputs(study.room[0]).building_files == (
        project.folder / "inputs" / "office.ifc",
        project.folder / "inputs" / "facade.ifc",
    )
    assert study.room[0].linked[0] in study.files
    project.remove("inputs/office.ifc")
    assert project.building() == ["inputs/facade.ifc"]


def test_what_the_page_does_not_know_stays(project) -> None:
    path = project.folder / "study.toml"
    text = path.read_text().replace("[[room]]", "[[room]]\nfurniture = true", 1)
    path.write_text("glare = 'eDGP'\n" + text + "\n[options]\nsensor_spacing = 0.7\n")
    project.change({"title": "New"})
    study = read_study(path)
    assert study.glare == "eDGP" and study.options.sensor_spacing == 0.7 and study.title == "New"
    assert study.room[0].furniture
    (command,) = [one.command for one in actions.computations(project, {"report": True})][:1]
    assert "--furniture" in command and "sensor_spacing=0.7" in command


def test_tables_of_the_user_and_further_climates_stay(project) -> None:
    project.use_made(MadeSystem("moving", ("inputs/glazing.xml", "inputs/venetian_blind.xml")))
    moving = project.folder / "inputs" / "controlled venetian_blind.toml"
    moving.write_text(moving.read_text() + "\n[ventilation]\nopen_above_c = 24\n")
    away = project.folder.parent / "controlled away.toml"
    away.write_text(moving.read_text())
    study = project.study()
    study["system"].append({"name": "away", "operation": "../controlled away.toml"})
    study["climate"].append({"name": "second", "weather": "second.epw"})
    project.write_study(study)
    project.change({"loads": {"heating_c": 18}})
    assert "open_above_c = 24" in moving.read_text() and "heating_c = 18" in moving.read_text()
    assert "heating_c = 18" not in away.read_text()
    take(project, WEATHER)
    assert [one["name"] for one in project.study()["climate"]][1:] == ["second"]


def test_set_points_and_gains_are_an_operation_file(project) -> None:
    loads = {"heating_c": 20, "cooling_c": 26, "equipment_w_m2": 8}
    made = MadeSystem("moving", ("inputs/glazing.xml", "inputs/venetian_blind.xml"))
    project.use_made(made)
    project.change({"loads": loads})
    moving = project.folder / "inputs" / "controlled venetian_blind.toml"
    for file in (project.folder / "operation.toml", moving):
        table = read_operation(file).tables
        assert (table.loads.heating_c, table.loads.cooling_c) == (20, 26)
        assert table.gains.equipment_w_m2 == 8
    assert project.states("inputs/controlled venetian_blind.toml") == list(made.files)
    assert len(read_operation(moving).systems) == 2
    check_files(read_study(project.folder / "study.toml"))
    project.change({"loads": {}})
    assert not (project.folder / "operation.toml").exists()
    assert "operation" not in project.study()
    assert read_operation(moving).systems


def test_rooms_of_a_new_project_are_heated_and_cooled_until_the_user_says_otherwise(project, tmp_path) -> None:
    assert project.operation() == {"loads": {"heating_c": 20.0, "cooling_c": 26.0}}
    for computed in actions.computations(project, {"report": True}):
        assert computed.command[computed.command.index("--operation") + 1] == "operation.toml"
    project.change({"loads": {}})
    take(project, WEATHER)
    take(project, OFFICE)
    assert project.operation() == {}
    assert "--operation" not in actions.computations(project, {"report": True})[0].command
    own = Project(tmp_path / "own")  # HBJSON has set points of its own, gbXML too
    for file in (WEATHER, TWO_ROOMS):
        take(own, file)
    assert own.operation() == {}
    kept = Project(tmp_path / "kept")
    (kept.folder / "operation.toml").write_text("[loads]\nheating_c = 18\n")
    take(kept, OFFICE)
    assert kept.operation() == {"loads": {"heating_c": 18}}


def test_uses_and_corrections_are_files_of_the_command_line(project) -> None:
    project.change({"uses": {"guid-1": "office", "guid-2": "bedroom"}})
    project.change({"uses": {"guid-2": ""}})
    assert dict(read_uses(project.folder / "uses.toml").rooms) == {"guid-1": "office"}
    project.change({"corrections": {"north": 30, "outdoors": ["guid-2"]}})
    path = project.folder / "inputs" / "office.corrections.toml"
    corrections = read_corrections(path)
    assert corrections.north_deg == 30 and corrections.outdoors == ("guid-2",)
    with pytest.raises(DataError, match="north"):
        project.change({"corrections": {"north": 4000}})
    assert read_corrections(path).north_deg == 30
    project.change({"corrections": {"north": None, "outdoors": []}})
    assert not path.exists()


@pytest.mark.parametrize(
    "wanted",
    [
        {"title": ""},
        {"title": 3},
        {"nothing": 1},
        {"spaces": "all"},
        {"join": ["A"]},
        {"join": ["--csv + B"]},
        {"loads": {"heating_c": "x"}},
        {"systems": [{"name": "x", "bsdf": "../../etc/passwd"}]},
        {"systems": [3]},
        {"uses": []},
        {"corrections": {"leave_out": ["x"]}},
    ],
    ids=str,
)
def test_a_wrong_change_is_refused_and_changes_nothing(project, wanted) -> None:
    before = (project.folder / "study.toml").read_text()
    with pytest.raises(DataError):
        project.change(wanted)
    assert (project.folder / "study.toml").read_text() == before


def _accepted(command: tuple[str, ...]) -> None:
    """Let the command line read a command as far as its options; `click` raises on a wrong one."""
    group: click.Command = cfs
    words = list(command)
    context = None
    while isinstance(group, click.Group):
        found = group.get_command(click.Context(group), words.pop(0))
        assert found is not None, command
        group = found
    context = group.make_context("cfs", words)
    assert context.params


def test_every_command_of_the_page_is_one_of_the_command_line(project, monkeypatch) -> None:
    project.use_made(MadeSystem("moving", ("inputs/glazing.xml", "inputs/venetian_blind.xml")))
    project.change({"loads": {"heating_c": 21}, "uses": {"x": "office"}, "quick": True})
    study = project.study()
    study["system"][0] |= {"u_value": 1.2, "g_value": 0.6}
    project.write_study(study)
    monkeypatch.chdir(project.folder)
    every = {
        "report": True,
        "annual_glare": True,
        "explore": True,
        "compare": True,
        "language": "de",
        "standards": ["en17037", "leed-v4.1"],
    }
    found = actions.computations(project, every)
    assert [one.kind for one in found] == ["run", "comply"] * 3 + ["study"]
    found += [actions.check(project), *(actions.export(project, form) for form in actions.EXPORTS)]
    found += [actions.library("double clear", "screen 5 %, grey")]
    for one in found:
        _accepted(one.command)
        assert one.text.startswith("cfs ")
    moving = next(one for one in found if one.kind == "comply" and one.title == "moving")
    operation = moving.command[moving.command.index("--operation") + 1]
    assert project.states(operation) == ["inputs/glazing.xml", "inputs/venetian_blind.xml"]
    assert "--cfs" not in moving.command and "--closed" not in moving.command


def test_rooms_are_joined_and_separated(project, monkeypatch) -> None:
    """The study, the check and every computation read the rooms as one, until they are separated."""
    monkeypatch.chdir(project.folder)
    project.change({"join": ["A + B"]})
    assert project.study()["room"][0]["join"] == ["A + B"]
    found = [actions.check(project), *actions.computations(project, {"report": True, "standards": ["en17037"]})]
    for one in (*found, actions.export(project, "gltf")):
        assert one.command[one.command.index("--join") + 1] == "A + B"
        _accepted(one.command)
    project.change({"join": []})
    assert "join" not in project.study()["room"][0] and "--join" not in actions.check(project).command


def test_the_title_is_that_of_report_and_dossier(project, monkeypatch) -> None:
    monkeypatch.chdir(project.folder)
    (project.folder / "page.toml").write_text('author = "A. Engineer"\n')
    project.change({"title": "Villa"})
    found = actions.computations(project, {"report": True, "standards": ["en17037"], "language": "de"})
    assert len(found) == 4
    for one in found:
        sections = RunSection if one.kind == "run" else DossierSection
        page = read_page(Path(one.command[one.command.index("--page") + 1]), sections, "de")
        assert (page.title, page.author, page.language) == ("Villa", "A. Engineer", "de")
        _accepted(one.command)


def test_what_is_missing_is_named(tmp_path) -> None:
    project = Project(tmp_path / "new")
    with pytest.raises(DataError, match="drop an IFC"):
        actions.computations(project, {"report": True})
    take(project, Path(OFFICE))
    with pytest.raises(DataError, match="weather file"):
        actions.computations(project, {"report": True})


def test_slugs_are_names_of_folders() -> None:
    assert slug("Blind / 45°, é") == "blind-45-é"
    assert slug("../..") == "as-is"


def test_variants_with_names_alike_have_folders_of_their_own(project) -> None:
    bsdf = "inputs/glazing.xml"
    names = ["Blind 45", "Blind 45°", "blind-45", "Blind 45 2"]
    project.change({"systems": [{"name": name, "bsdf": bsdf} for name in names]})
    found = actions.computations(project, {"report": True, "standards": ["en17037"]})
    assert len({one.out for one in found}) == 8
    titles = actions.result_titles(project.study())
    assert [titles[Path(one.out).name] for one in found] == [one.title for one in found]


def test_removed_results_leave_the_files_of_others(project) -> None:
    folder = project.folder / "results" / "report-a"
    with ResultFolder(folder, "run").replaced() as part:
        (part / "report.html").write_text("x")
        (part / "room").mkdir()
        (part / "room" / "daylight.csv").write_text("x")
    project.clear("report-a")
    assert not folder.exists()
    with ResultFolder(folder, "run").replaced() as part:
        (part / "report.html").write_text("x")
    (folder / "my notes.txt").write_text("keep")
    project.clear("report-a")
    assert {one.name for one in folder.iterdir()} == {"my notes.txt", "cfs-results.json"}
    assert not project.results()
    with ResultFolder(folder, "run").replaced() as part:  # the command may write there again
        (part / "report.html").write_text("x")
    with pytest.raises(DataError, match="no folder of results"):
        project.clear("..")


def test_the_library_has_the_glazings_of_the_options_and_a_sheet_for_each_pair() -> None:
    assert {one.name for one in library().glazing} == set(GENERIC_GLAZINGS)
    names = {"", *(one.name for one in library().shade)}
    assert set(sheets()) == {(g, s) for g in GENERIC_GLAZINGS for s in names}
    assert len(names) >= 11


@pytest.mark.parametrize("glazing", GENERIC_GLAZINGS)
def test_glazings_are_near_the_reference_values(glazing) -> None:
    """g and visible transmittance of `generic_glazing`, which a product differs from by 0.1."""
    sheet, known = sheets()[glazing, ""], GENERIC_GLAZINGS[glazing]
    assert sheet.g_value == pytest.approx(known.g_value, abs=0.06)
    assert sheet.tau_v == pytest.approx(known.visible, abs=0.03)


@pytest.mark.parametrize("shade", ["", "screen 5 %, grey", "roller blind 3 %, metallised"])
def test_a_system_of_the_library_has_the_figures_of_its_sheet(shade, tmp_path) -> None:
    sheet = write_library_system("triple low-e", shade, tmp_path / "system.xml")
    shipped = sheets()["triple low-e", shade]
    for name in ("tau_v", "tau_v_hemispherical", "tau_e", "u_value", "g_value"):
        assert getattr(sheet, name) == pytest.approx(getattr(shipped, name), abs=6e-4), name
    assert sheet.tau_e <= sheet.g_value <= 1


def test_shades_keep_sun_and_heat_in_their_place() -> None:
    """Open slats hold warm air before a pane that absorbs: 0.01 of g at most."""
    found = sheets()
    for one in library().shade:
        for glazing in GENERIC_GLAZINGS:
            sheet, bare = found[glazing, one.name], found[glazing, ""]
            assert sheet.g_value < bare.g_value + 0.01 and sheet.u_value < bare.u_value
            assert sheet.tau_v <= bare.tau_v and sheet.tau_e <= sheet.g_value


def test_results_say_what_changed_since(project) -> None:
    (run, *_) = actions.computations(project, {"report": True, "annual_glare": True, "language": "de"})
    name = Path(run.out).name
    assert actions.outdated(project, name, project.journal()) == ()
    at = time.time() + 10
    project.record({"command": ["cfs", *run.command], "kind": "run", "started": round(at), "state": "done"})
    assert actions.outdated(project, name, project.journal()) == ()
    os.utime(project.folder / "inputs" / "office.ifc", (at + 5, at + 5))
    assert actions.outdated(project, name, project.journal()) == ("office.ifc",)
    project.change({"spaces": ["A South office"]})
    assert actions.outdated(project, name, project.journal()) == ("office.ifc", "choices")


def test_a_comparison_and_a_moving_system_know_their_files(project) -> None:
    project.use_made(MadeSystem("moving", ("inputs/glazing.xml", "inputs/venetian_blind.xml")))
    wanted = {"report": True, "compare": True}
    at = time.time() + 10
    for one in actions.computations(project, wanted):
        project.record({"command": ["cfs", *one.command], "kind": one.kind, "started": round(at), "state": "done"})
    os.utime(project.folder / "inputs" / "venetian_blind.xml", (at + 5, at + 5))
    for name in ("report-moving", "report-venetian_blind", "comparison"):
        assert actions.outdated(project, name, project.journal()) == ("venetian_blind.xml",), name
    assert actions.outdated(project, "report-glazing", project.journal()) == ()
    corrections = project.folder / "inputs" / "office.corrections.toml"
    project.change({"corrections": {"north": 10}})
    os.utime(corrections, (at + 5, at + 5))
    assert "office.corrections.toml" in actions.outdated(project, "report-glazing", project.journal())


def test_a_building_is_no_option_of_a_command(project) -> None:
    """A stranger's study file names `--html=FILE` as its building, which `cfs check` would write."""
    study = project.folder / "study.toml"
    study.write_text('[[room]]\nname = "a"\nbuilding = "--html=../../page.html"\n')
    with pytest.raises(DataError, match=r"room\.building: expected a file of a building"):
        actions.check(project)


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("study.toml", "room = 3\n"),
        ("study.toml", '[[system]]\nname = ["a"]\n'),
        ("study.toml", 'climate = ["w.epw"]\n'),
        ("operation.toml", "loads = [20, 26]\n"),
        ("uses.toml", 'rooms = ["office"]\n'),
    ],
)
def test_a_value_of_another_kind_is_one_line(project, file, text) -> None:
    (project.folder / file).write_text(text)
    with pytest.raises(DataError, match=f"{file}: .*: expected "):
        project.study(), project.operation(), project.uses()


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("uses.toml", {"uses": {"guid": "office"}}),
        ("inputs/office.corrections.toml", {"corrections": {"outdoors": ["guid"]}}),
        ("inputs/controlled blind.toml", {"loads": {"heating_c": 21}}),
    ],
)
def test_a_change_to_a_file_with_a_number_that_is_not_finite_is_refused(project, name, change) -> None:
    """The page could not be answered with it."""
    (project.folder / name).write_text("north = nan\n", encoding="utf-8")
    if "controlled" in name:
        project.write_study(project.study() | {"system": [{"name": "blind", "operation": name}]})
    with pytest.raises(DataError, match="expected a finite number"):
        project.change(change)
    assert (project.folder / name).read_text("utf-8") == "north = nan\n"
