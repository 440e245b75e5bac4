"""Every command takes every format and begins with the same head."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from html import unescape
from pathlib import Path

import pytest

from bim.building_file import read_building_file
from bim.gbxml.write import write_gbxml
from bim.report.issue import Effect, Issue, catalogue, issue_text
from mitsuba_cfs.errors import DataError
from scenes import cli
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.explore.folder import copy_explorer, write_explorer
from scenes.head import Head, head_of, issues_of, joined
from scenes.input_files import read_files
from scenes.input_options import InputOptions
from scenes.inputs import read_inputs
from scenes.language.catalogue import in_language
from scenes.page_options import PageOptions
from scenes.report.page import head_lines, report_html
from scenes.report.typography import prose
from scenes.study_report.page import study_report_html
from tests.bim.honeybee_models import two_rooms, write
from tests.bim.small_ifc import box_model
from tests.conftest import REPOSITORY
from tests.explore.synthetic import explored_run
from tests.report.test_study_report import study as study_result

# types of modifiers that are not read: more than a head lists of other kinds of issues
UNREAD = (
    "prism1",
    "prism2",
    "mist",
    "transfunc",
    "transdata",
    "plasfunc",
    "plasdata",
    "metfunc",
    "metdata",
    "ashik2",
    "antimatter",
    "WGMDfunc",
)
STOP = "stopped before anything is traced"
RAD = REPOSITORY / "docs/tutorials/office.rad"
STUDY = f"""
[[room]]
building = "{{0}}"
[[system]]
bsdf = "{VENETIAN_BLIND}"
[[climate]]
weather = "{WEATHER}"
"""
HEAT = f"""
weather = "{WEATHER}"
building = "{{0}}"
[[system]]
bsdf = "{VENETIAN_BLIND}"
"""
PV = """
[module]
select = "{0}"
short_circuit_current = 9.5
open_circuit_voltage = 40
current = 9
voltage = 32
cells = 60
"""


def ifc(folder: Path) -> Path:
    """A room, and above it a storey with a window and no room."""
    path = folder / "house.ifc"
    box_model(upper=True)[0].model.write(str(path))
    return path


def hbjson(folder: Path) -> Path:
    """Two rooms, and one of a single wall: no room."""
    model = two_rooms()
    wall = dict(model["rooms"][0]["faces"][2], identifier="Lost_wall")
    lost = {"type": "Room", "identifier": "Lost", "properties": {}, "faces": [wall]}
    model["rooms"].append(lost | {"properties": {"energy": {}, "radiance": {}}})
    return write(model, folder)


def gbxml(folder: Path) -> Path:
    """Two rooms, and a space that states an area and has no surface."""
    empty = '<Space id="Lost"><Name>Lost</Name><Area>9</Area></Space>'
    path = folder / "house.gbxml"
    write_gbxml(read_building_file(write(two_rooms(), folder)), path)
    path.write_text(path.read_text().replace("<Space ", f"{empty}<Space ", 1))
    return path


def rad(folder: Path) -> Path:
    """A room, and an instance of an octree, which is not read."""
    path = folder / "house.rad"
    path.write_text(RAD.read_text() + "\nvoid instance lost\n1 lost.oct\n0\n0\n")
    return path


FORMATS: dict[str, Callable[[Path], Path]] = {"ifc": ifc, "hbjson": hbjson, "gbxml": gbxml, "rad": rad}
MODULES = {"ifc": "IfcSlab", "hbjson": "Overhang", "gbxml": "name=Overhang", "rad": "name=/ground.*/"}


def _from(folder: Path, text: str, *values: object) -> Path:
    path = folder / f"{len(list(folder.glob('*.toml')))}.toml"
    path.write_text(text.format(*values))
    return path


def words(command: str, path: Path, folder: Path) -> list[object]:
    """The call of a command for a building."""
    weather, out = ["--weather", WEATHER], ["--out", folder / "out"]
    system = ["--cfs", VENETIAN_BLIND]
    return {
        "run": ["run", path, *weather, *system, *out],
        "dgp": ["dgp", path, *weather, *system, *out],
        "picture": ["picture", path, *weather, *system, "--at", "06-21 12", "--out", folder / "a.png"],
        "comply": ["comply", path, *weather, *system, "--standard", "en17037", *out],
        "thermal": ["thermal", _from(folder, HEAT, path), *out],
        "study": ["study", _from(folder, STUDY, path), *out],
        "pv": ["pv", path, *weather, *out, "--study", _from(folder, PV, MODULES[path.suffix[1:]])],
        "check": ["check", path],
        "export": ["export", path, "--gltf", folder / "a.glb"],
    }[command]


@pytest.fixture
def stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    """The commands end where they would begin to trace."""

    def stop(*_: object, **__: object) -> None:
        raise DataError(STOP)

    for name in (
        "scenes.run.run.run_inputs",
        "scenes.year_of_glare.year.viewed_room",
        "scenes.view_picture.viewed_room",
        "scenes.comply.comply.view_out",
        "scenes.heat.study.skies_for",
        "scenes.study.study.computed",
        "scenes.photovoltaics.study.cell_irradiance",
    ):
        monkeypatch.setattr(name, stop)


COMMANDS = ("run", "dgp", "picture", "comply", "thermal", "study", "pv", "check", "export")


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("kind", FORMATS)
def test_every_command_shows_the_loss_of_every_format(
    command: str, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], stopped: None
) -> None:
    path = FORMATS[kind](tmp_path)
    code = cli.run([str(word) for word in words(command, path, tmp_path)])
    output, errors = capsys.readouterr()
    assert code == 0 or STOP in errors, errors
    building = read_building_file(path)
    losses = [issue for issue in building.issues if issue.severity == "loss"]
    assert losses
    if (command, kind) != ("pv", "ifc"):  # which reads no rooms
        assert all(issue_text(issue, "command").what in output for issue in losses)
    if command != "pv":
        assert head_of(building).model[0] in output
    if command not in ("pv", "check", "export"):
        assert "assumed: " in output and VENETIAN_BLIND.name in output


@pytest.mark.parametrize("command", ["run", "dgp", "picture", "comply"])
def test_a_window_that_nothing_fills_ends_every_command(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    call = [word for word in words(command, ifc(tmp_path), tmp_path) if word != "--cfs"]
    call.remove(VENETIAN_BLIND)
    assert cli.run([str(word) for word in call]) == 1
    assert "window W1: has no BSDF attached" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["check", "export"])
def test_the_earlier_names_lead_to_the_commands(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    call = [str(word) for word in words(name, ifc(tmp_path), tmp_path)]
    assert cli.run(call) == 0
    now = capsys.readouterr()
    assert cli.run(["ifc", *call]) == 0
    before = capsys.readouterr()
    note = f"note: `cfs ifc {name}` is now `cfs {name}`\n"
    assert before.out == now.out
    assert note in before.err and note not in now.err


def test_a_head_is_data(tmp_path: Path) -> None:
    """Issues by kind with their glass, and what was assumed of the systems."""
    options = InputOptions(ifc(tmp_path), WEATHER, VENETIAN_BLIND)
    head = read_inputs(options, read_files(options)).head
    record = json.loads(json.dumps(head.record))
    (lost,) = (one for one in record["issues"] if one["severity"] == "loss")
    assert lost["code"] == "window-without-room" and lost["glass_m2"] > 1
    assert any("window model" in text for text in record["assumed"])
    assert joined([head, head]) == head
    assert "cfs" not in " ".join(Head((), head.issues).text("python"))


def test_panes_before_dark_rooms_mirror(tmp_path: Path) -> None:
    """They are no windows of the room, and no light passes them."""
    path = tmp_path / "house.rad"
    pane = "0 0 12  -2 -8 0  6 -8 0  6 -8 6  -2 -8 6"
    path.write_text(RAD.read_text() + f"\nvoid glass across\n0\n0\n3 .8 .8 .8\nacross polygon p\n{pane}\n")
    code = "clear-surface-left-out"
    assert [issue for issue in read_building_file(path).issues if issue.code == code]
    options = InputOptions(path, None, facade_panes=("across",))
    building = read_building_file(path, options.read)
    assert len(building.windows) == 1
    (pane,) = (one for one in building.elements if one.material == "across")
    assert pane.gloss is not None and pane.reflectance_visible == 0
    assert not [issue for issue in building.issues if issue.code == code]


def test_the_explorer_shows_the_head_of_its_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    results = tmp_path / "results"
    write_explorer(explored_run(), results / "explore")
    head = head_of(read_building_file(ifc(tmp_path)))
    (results / "run.json").write_text(json.dumps({"head": head.record}))
    assert cli.run(["explore", str(results), "--out", str(tmp_path / "page")]) == 0
    output = capsys.readouterr().out
    assert all(line in output for line in head.model)
    assert "left out: IfcWindow W above has no room behind it" in output


@pytest.mark.parametrize("language", ["en", "de", "fr"])
def test_the_pages_show_the_head_in_their_language(tmp_path: Path, language: str) -> None:
    head = head_of(read_building_file(ifc(tmp_path)), notes=("a <note>",))
    page, run = PageOptions(language=language), replace(explored_run(), head=head)
    write_explorer(run, tmp_path / "run", page)
    study = replace(study_result(), head=head)
    pages = [
        report_html(run, page),
        study_report_html(study, page),
        (tmp_path / "run/index.html").read_text(encoding="utf-8"),
    ]
    copy_explorer(tmp_path / "run", tmp_path / "copy")
    pages.append((tmp_path / "copy/index.html").read_text(encoding="utf-8"))
    with in_language(language):
        lines = [prose(line) for line in head_lines(head)]
    assert len(lines) > 3 and (language == "en") == (lines[0] == prose(head.lines[0]))
    for text in pages:
        aside = unescape(text.partition('<aside class="notes"')[2].partition("</aside>")[0])
        assert [line for line in lines if f"<li>{line}</li>" not in aside] == []


def test_a_head_names_all_that_is_left_out(tmp_path):
    things = [
        f"void {kind} odd_{kind} 0 0 0\nodd_{kind} polygon chip_{kind} 0 0 9 1 3 1 1.01 3 1 1 3 1.01" for kind in UNREAD
    ]
    panes = [
        f"void dielectric clear_{n} 0 0 5 1 1 1 1.5 0\nclear_{n} polygon gem_{n} 0 0 9 2 3 1 2.01 3 1 2 3 1.01"
        for n in range(2)
    ]
    scene = tmp_path / "chips.rad"
    scene.write_text("\n".join([RAD.read_text(), *things, *panes]))
    lines = head_of(read_building_file(scene)).lines
    for kind in UNREAD:
        (line,) = (line for line in lines if f"of type {kind}:" in line)
        assert line.startswith(f"left out: 1 surface, less than 0.1 m2, has a modifier of type {kind}")
    assert [any(f"gem_{n}" in line for line in lines) for n in range(2)] == [True, True]
    assert not [line for line in lines if " 0.0 m2" in line or "problem" in line]


def test_a_head_counts_further_problems_with_their_glass():
    kinds = [code for code, one in catalogue().items() if one.severity == "warning"][:10]
    values = {name: 1.0 for code in kinds for name in catalogue()[code].fields}
    issues = [Issue(code, "w", values, Effect(glass=n + 1.0)) for n, code in enumerate(kinds)]
    *_, last = Head((), tuple(issues)).lines
    assert last == "warning: 2 more problems: cfs check lists all (3.00 m2 of glass)"
    lines = Head((), (issues[0],)).lines
    assert not [line for line in lines if "more problem" in line]


def test_a_head_names_no_problem_of_a_room_that_is_not_computed():
    read = read_building_file(OFFICE)
    south, east = read.spaces[:2]
    code = next(code for code, one in catalogue().items() if one.severity == "warning")
    values = {name: 1.0 for name in catalogue()[code].fields}
    shared = {f.element for f in south.faces} & {f.element for f in east.faces} - {None}
    wheres = [south.guid, south.windows[0].guid, east.guid, east.windows[0].guid, "the file", *sorted(shared)]
    building = replace(read, issues=tuple(Issue(code, where, values) for where in wheres))
    kept = {issue.where for issue in issues_of(building, [south])}
    assert shared
    assert kept == {*wheres} - {east.guid, east.windows[0].guid}
    pair = Issue("rooms-joined-by-size", "opening", {"rooms": (east.label,), "area": 4.0, "limit": 3.0})
    assert issues_of(replace(building, issues=(pair,)), [south]) == ()
    assert issues_of(replace(building, issues=(pair,)), [east]) == (pair,)
    lines = head_of(building, [south]).lines
    assert "2 problems of rooms that are not computed are not listed: cfs check lists them" in lines
    assert {issue.where for issue in head_of(building).issues} == {*wheres}
