"""The explorer's folder: complete, within itself, joined from several, served to this machine."""

from __future__ import annotations

import errno
import re
import shutil
import threading
import urllib.error
import urllib.request
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from bim.model import Element
from mitsuba_cfs.errors import DataError
from scenes.cli import cfs
from scenes.explore.case_files import read_data
from scenes.explore.folder import copy_explorer, explorer_of, join_explorers, packed, server, write_data, write_explorer
from scenes.report.page import write_report
from scenes.result_folder import ResultFolder
from scenes.run.outputs import write_results
from tests.explore.synthetic import explored_run


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> Path:
    """A folder of results with an explorer of 400 hours."""
    folder = tmp_path_factory.mktemp("results")
    write_explorer(explored_run(), folder / "explore")
    return folder


def test_the_page_names_no_address_outside(results) -> None:
    files = [f for f in (results / "explore").rglob("*") if f.suffix in (".html", ".js", ".css")]
    assert len(files) > 12
    for file in files:
        assert not re.findall(r"(?:https?:)?//[a-z][\w.-]+\.[a-z]{2,}", file.read_text()), file.name


def test_every_file_that_the_case_names_is_there(results) -> None:
    folder = results / "explore"
    (entry,) = read_data(folder / "case.js")["rooms"]
    assert entry["states"] == ["clear glass", "blind <down>"]
    for name in (entry["file"], *entry["models"], *entry["lux"]):
        assert (folder / f"{name}.js").is_file()
    for name in entry["models"]:
        for number, file in enumerate(read_data(folder / f"{name}.js")["facts"]["codes"]):
            assert (folder / f"{name}_{number}.js").is_file()
            assert file["sizes"]


def test_a_markup_in_a_name_ends_no_script(results) -> None:
    """Names go into the page as text; in the data files nothing can end the script."""
    assert "innerHTML" not in "".join(f.read_text() for f in (results / "explore").glob("*.js"))


def test_packed_arrays_are_planes_of_bytes() -> None:
    import base64
    import zlib

    data = packed([1, 258, -2], "i2")
    raw = zlib.decompress(base64.b64decode(data["data"]), -15)
    assert list(raw) == [1, 2, 254, 0, 1, 255] and data["length"] == 3


def test_a_window_drawn_in_the_building_casts_no_shadow_on_its_own_room(tmp_path) -> None:
    """Its frame and panes are among what stands outdoors: of a model read from IFC they are."""
    run, count = explored_run(step=400, size=32), []
    (window, *_) = run.spaces[0].space.windows
    for guid in ("another", window.guid):
        drawn = Element(guid, "pane", "IfcWindow", window.triangles, 0.5, 0.5)
        building = replace(run.building, elements=(*run.building.elements, drawn))
        write_explorer(replace(run, building=building), tmp_path / guid)
        (file,) = (tmp_path / guid / "data").glob("room0.js")
        count.append(read_data(file)["arrays"]["blockers"]["length"])
    assert count[0] - count[1] == window.triangles.size


@pytest.mark.parametrize("lost", ["report.html", "explore"])
def test_a_fault_in_one_page_leaves_all_else(lost, tmp_path) -> None:
    """It is raised all the same, when the results are in their folder."""

    def failing(_result, page: Path) -> None:
        if page.suffix != ".html":
            page.mkdir()
        half = page if page.suffix == ".html" else page / "half.js"
        half.write_text("half")
        raise ZeroDivisionError("a fault of the program")

    folder = ResultFolder(tmp_path / "out", "run")
    pages = {"report.html": write_report, "explore": write_explorer} | {lost: failing}
    with pytest.raises(ZeroDivisionError) as fault:
        write_results(explored_run(step=400, size=32), folder, *pages.values())
    assert fault.value.__notes__ == [f"{lost} was left out; the other results are whole"]
    found = {one.name for one in (tmp_path / "out").iterdir()}
    assert {"run.json", "problems.csv", "report.html", "explore"} - found == {lost}


def test_a_page_refused_by_the_disk_keeps_the_earlier_results(tmp_path) -> None:
    def refused(_result, page: Path) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(page))

    with pytest.raises(DataError, match="the disk is full"):
        write_results(explored_run(step=400, size=32), ResultFolder(tmp_path / "out", "run"), refused)
    assert not (tmp_path / "out").exists()


def test_several_are_joined(results, tmp_path) -> None:
    other = tmp_path / "other"
    write_explorer(explored_run(step=40, size=32), other / "explore")
    target = tmp_path / "both"
    target.mkdir()
    join_explorers([results, other], target)
    first, second = read_data(target / "case.js")["rooms"]
    assert second["name"].startswith("other: ") and second["models"][1].startswith("1/data/")
    for entry in (first, second):
        for name in (entry["file"], *entry["models"], *entry["lux"]):
            assert (target / f"{name}.js").is_file()


def test_results_without_an_explorer_say_so(tmp_path) -> None:
    with pytest.raises(DataError, match="holds no explorer: compute it again with --expl"):
        explorer_of(tmp_path)
    done = CliRunner().invoke(cfs, ["explore", str(tmp_path)])
    assert done.exit_code and isinstance(done.exception, DataError)


def test_the_command_writes_one_folder(results, tmp_path) -> None:
    done = CliRunner().invoke(cfs, ["explore", str(results), "--out", str(tmp_path / "one")])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "one" / "index.html").is_file()
    assert (tmp_path / "one" / "0" / "data" / "room0.js").is_file()
    assert (tmp_path / "one" / "cfs-results.json").is_file()


def test_the_server_answers_this_machine_alone(results) -> None:
    running = server(results / "explore")
    thread = threading.Thread(target=running.serve_forever, daemon=True)
    thread.start()
    try:
        assert running.server_address[0] == "127.0.0.1"
        address = f"http://127.0.0.1:{running.server_port}/index.html"
        assert b"Explorer" in urllib.request.urlopen(address).read()
        foreign = urllib.request.Request(address, headers={"Host": "evil.example"})
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(foreign)
    finally:
        running.shutdown()
        running.server_close()
        thread.join()


def test_point_in_time_has_no_explorer(tmp_path) -> None:
    from scenes.demo import OFFICE, WEATHER

    command = ["run", str(OFFICE), "--weather", str(WEATHER), "--out", str(tmp_path / "x")]
    done = CliRunner().invoke(cfs, [*command, "--method", "point-in-time", "--explore"])
    assert done.exit_code == 2 and "--explore needs --method" in done.output


FILES = {"file": "../../../victim/room0", "models": ["data/../../x"], "lux": ["/etc/lux"]}


@pytest.mark.parametrize("key", FILES)
def test_files_outside_the_data_of_a_strangers_results_are_refused(key, results, tmp_path) -> None:
    """A case that names the user's own folder would have it copied and served."""
    folder = shutil.copytree(results, tmp_path / "stranger")
    case = read_data(folder / "explore" / "case.js")
    case["rooms"][0][key] = FILES[key]
    write_data(folder / "explore" / "case.js", case)
    victim = tmp_path / "victim"
    victim.mkdir()
    (victim / "room0.js").write_text("the user's own")
    done = CliRunner().invoke(cfs, ["explore", str(folder), "--out", str(tmp_path / "one")])
    assert isinstance(done.exception, DataError)
    assert f"room 0: {key}" in str(done.exception) and "no plain name" in str(done.exception)
    assert not (tmp_path / "one").exists()


def _emptied(file: Path) -> None:
    file.write_text("")


def _script(file: Path) -> None:
    file.write_text(file.read_text() + "alert(1);\n")


def _link(file: Path) -> None:
    outside = file.parents[3] / "outside.js"
    file.rename(outside)
    file.symlink_to(outside)


DAMAGES = {Path.unlink: "No such file", _emptied: "is empty", _script: "is no data of an explorer", _link: "link"}


@pytest.mark.parametrize(("damage", "words"), DAMAGES.items())
@pytest.mark.parametrize("name", ["room0", "room0_state1", "room0_state0_0", "room0_lux0"])
def test_missing_empty_and_foreign_data_are_refused(name, damage, words, results, tmp_path) -> None:
    folder = shutil.copytree(results, tmp_path / "damaged")
    damage(folder / "explore" / "data" / f"{name}.js")
    done = CliRunner().invoke(cfs, ["explore", str(folder), "--out", str(tmp_path / "one")])
    assert isinstance(done.exception, DataError), done.output
    assert f"{name}.js" in str(done.exception) and words in str(done.exception)
    assert not (tmp_path / "one").exists()


def test_the_page_that_is_served_is_the_programs(results, tmp_path) -> None:
    """The script of a stranger's page would run at the address of this machine."""
    folder = shutil.copytree(results, tmp_path / "stranger") / "explore"
    (folder / "index.html").write_text("<script>fetch('/')</script>")
    (folder / "extra.js").write_text("alert(1)")
    copy_explorer(folder, tmp_path / "served")
    assert "Explorer" in (tmp_path / "served" / "index.html").read_text()
    assert not (tmp_path / "served" / "extra.js").exists()


@pytest.mark.parametrize("text", ["[", "[1]", '{"head": 3}', '{"head": {"model": [1]}}'])
def test_a_record_of_a_run_that_is_none_is_one_line(text, results, tmp_path) -> None:
    folder = shutil.copytree(results, tmp_path / "damaged")
    (folder / "run.json").write_text(text)
    done = CliRunner().invoke(cfs, ["explore", str(folder), "--out", str(tmp_path / "one")])
    assert isinstance(done.exception, DataError) and "run.json" in str(done.exception)
