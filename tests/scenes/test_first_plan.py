"""First figures of all rooms from few rays: near those of the run, and written before them."""

from __future__ import annotations

import copy
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bim.model import Element
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import TEMPORARY
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.progress import silent
from scenes import cli
from scenes.commands.under_way import FirstPlanPage
from scenes.comply import comply
from scenes.comply.files import read_files
from scenes.comply.options import ComplyOptions
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.inputs import Inputs
from scenes.result_folder import FolderMark, ResultFolder
from scenes.room.options import RoomOptions
from scenes.run import run, together
from scenes.run.first_plan import COLUMNS, PlannedRoom, first_plan, options_for_error, plan_lines, plan_page, plan_table
from scenes.run.options import JobOptions
from scenes.run.run import run_inputs
from tests.scenes.small_box import BOX
from tests.scenes.test_equal_rooms import moved
from tests.scenes.test_rooms_beside import box
from tests.trace.rooms import quad

WALL = quad((-20, -9, 0), (30, -9, 0), (30, -9, 9), (-20, -9, 9))
FEW = RoomOptions.of(
    sky_subdivision=1,
    sensor_spacing=1.0,
    sensor_samples=512,
    patch_samples=256,
    sun_points=32,
    picture_size=64,
    picture_count=1,
    picture_samples=1,
    heat_step_s=3600.0,
)


@pytest.fixture
def two_rooms(variant, weather, glass):
    """Two rooms beside each other before a wall, and the options of a run."""
    spaces = (box("near", 3.0), moved(replace(BOX, spaces=(box("far", 5.0),)), (9.0, 0, 0), "far"))
    wall = Element("wall", "Wall", "IfcWall", WALL, 0.3, 0.3)
    building = replace(BOX, spaces=spaces, elements=(wall,))
    systems = {w.guid: (glass,) for s in spaces for w in s.windows}
    options = JobOptions(Path(__file__), Path(__file__), cache=False, colour=False, room=FEW)
    return Inputs(building, spaces, weather, systems, None), options


def planned(name: str, error: float) -> PlannedRoom:
    figures = dict.fromkeys(COLUMNS, 1.0)
    return PlannedRoom(box(name, 3.0), figures, figures, error)


@pytest.mark.slow
def test_the_first_plan_is_near_the_run(two_rooms, monkeypatch):
    inputs, options = two_rooms
    monkeypatch.setattr(run, "FROM", 2)
    heard: list[PlannedRoom] = []
    result = run_inputs(inputs, options, on_plan=heard.extend)
    assert [room.space.name for room in heard] == [room.space.name for room in result.spaces]
    for plan, room in zip(heard, result.spaces, strict=True):
        final = room.daylight.room_metrics
        assert plan.figures["daylight_factor"] == pytest.approx(final["daylight_factor"], rel=0.15)
        assert plan.figures["da300"] == pytest.approx(final["da300"], abs=8.0)
        assert 0 < plan.mean_error < 0.2 and plan.errors["daylight_factor"] > 0
        assert not plan.unshaded


def test_the_first_plan_has_each_room_with_its_errors(two_rooms):
    inputs, options = two_rooms
    near, far = first_plan(inputs, inputs.spaces, options)
    assert (near.space.name, far.space.name) == ("near", "far")
    assert near.figures["daylight_factor"] > far.figures["daylight_factor"] > 0
    for room in (near, far):
        assert 0 < room.mean_error < 0.2 and 0 < room.errors["da300"] < 10 and not room.unshaded
        assert 0 < room.errors["daylight_factor"] < 0.2 * room.figures["daylight_factor"]


def test_a_check_of_rules_says_the_first_plan_before_it_traces_the_rest(two_rooms, monkeypatch):
    class Heard(Exception):
        pass

    def heard(rooms):
        raise Heard([room.space.name for room in rooms])

    monkeypatch.setattr(comply, "FROM", 2)
    options = ComplyOptions(OFFICE, WEATHER, system=VENETIAN_BLIND, standards=("en17037",), room=FEW, cache=False)
    with pytest.raises(Heard, match=r"near.*far"):
        comply.check_rooms(two_rooms[0].building, options, read_files(options), on_plan=heard)


def test_a_window_of_two_rooms_lights_both_in_the_first_plan(two_rooms):
    inputs, options = two_rooms
    panes = [space.windows[0].triangles for space in inputs.spaces]
    before = np.concatenate([pane + np.array([0.0, -0.05, 0.0]) for pane in panes])
    shared = [replace(s, windows=(replace(s.windows[0], guid="both"),)) for s in inputs.spaces]
    element = Element("both", "Window", "IfcWindow", before, 0.3, 0.3)
    elements = (*inputs.building.elements, element)
    building = replace(inputs.building, spaces=tuple(shared), elements=elements)
    systems = {"both": inputs.systems[inputs.spaces[0].windows[0].guid]}
    inputs = replace(inputs, building=building, spaces=shared, systems=systems)
    for room in first_plan(inputs, shared, options):
        assert room.figures["daylight_factor"] > 0.5, room.space.name


def test_rooms_of_equal_shape_are_not_traced_ahead(two_rooms, tmp_path, monkeypatch):
    inputs, options = two_rooms
    near, far = inputs.spaces
    twin = moved(replace(BOX, spaces=(near,)), (20.0, 0.0, 0.0), "twin")
    traced: list[list[str]] = []
    monkeypatch.setattr(
        together, "trace_ahead", lambda inputs, spaces, *_, **__: traced.append([space.name for space in spaces])
    )
    rooms = together.RoomsTogether(inputs, [(near, twin), (far,)], None, options, tmp_path)
    assert rooms.cache_for(twin, silent) is None and not traced
    assert rooms.cache_for(near, silent) is not None and traced == [["near", "far"]]


def test_processes_trace_each_set_of_rooms_once(two_rooms, tmp_path, monkeypatch):
    inputs, options = two_rooms
    near, far = inputs.spaces
    traced: list[list[str]] = []
    monkeypatch.setattr(
        together, "trace_ahead", lambda inputs, spaces, *_, **__: traced.append([space.name for space in spaces])
    )
    rooms = together.RoomsTogether(inputs, [(near,), (far,)], None, options, tmp_path).for_processes()
    assert rooms.set_of(near.guid) == rooms.set_of(far.guid), "the second waits for the first"
    folders = []
    for room in (near, far):  # each in a process of its own
        cache = copy.copy(rooms).cache_for(room, silent)
        assert cache is not None
        folders.append(cache.folder)
    assert traced == [["near", "far"]] and folders[0] == folders[1]
    rooms.remove(rooms.set_of(near.guid))
    assert not any(tmp_path.iterdir())


def test_a_killed_run_leaves_no_matrices(two_rooms, tmp_path, monkeypatch):
    inputs, options = two_rooms
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    places: list[Path] = []

    def stopped(*arguments):
        places.append(arguments[-1])
        raise KeyboardInterrupt

    monkeypatch.setattr(run, "RoomsTogether", stopped)
    with pytest.raises(KeyboardInterrupt):
        run.computed_rooms(inputs, None, options, silent)
    (place,) = places
    assert TEMPORARY.fullmatch(place.name), "the next run removes what a killed one left"
    assert not place.exists()


def test_paths_follow_from_the_error_of_the_worst_room():
    options = RoomOptions.of(sensor_samples=4096, patch_samples=4096)
    rooms = [planned("a", 0.02), planned("b", 0.1)]
    coarse = options_for_error(options, rooms, 0.05).sampling
    assert (coarse.sensor_samples, coarse.patch_samples) == (2048, 1024)
    fine = options_for_error(options, rooms, 0.01).sampling
    assert (fine.sensor_samples, fine.patch_samples) == (4096, 4096)
    assert options_for_error(options, [], 0.05) == options


def test_files_of_the_first_plan_last_until_the_results(tmp_path):
    rooms = [planned("=1+1", 0.02), planned("b", 0.1)]
    folder = ResultFolder(tmp_path / "out", "run")
    folder.early({"first_plan.csv": plan_table(rooms), "report.html": plan_page(rooms)})
    early = (tmp_path / "out" / "report.html").read_text()
    assert "http-equiv" in early and "=1+1" in early
    assert "'=1+1" in (tmp_path / "out" / "first_plan.csv").read_text()
    assert len(plan_lines(rooms)) == 3
    with folder.replaced() as part:
        (part / "report.html").write_text("done")
    assert (tmp_path / "out" / "report.html").read_text() == "done"
    mark = FolderMark.read(tmp_path / "out")
    assert mark is not None and mark.files == ("report.html",)
    assert not (tmp_path / "out" / "first_plan.csv").exists()


def test_the_page_of_the_first_plan_takes_the_light_of_rooms_as_they_come(two_rooms, tmp_path, monkeypatch):
    """Through the command's own plan: each room's figures are those of the run, its hours of glare the plan's."""
    inputs, options = two_rooms
    monkeypatch.setattr(run, "FROM", 2)
    monkeypatch.setattr("scenes.report.under_way.REFRESH_S", 0)
    pages: list[str] = []

    class Kept(ResultFolder):
        def early(self, files) -> None:
            super().early(files)
            pages.append((tmp_path / "out" / "report.html").read_text())

    plan = FirstPlanPage(Kept(tmp_path / "out", "run"), "report.html", "en", refined=True)
    result = run_inputs(inputs, options, on_plan=plan, on_room=plan.light)
    assert [page.count("✓") for page in pages] == [0, 1, 2]
    assert "1 of 2 rooms" in pages[1]
    assert set(re.findall(r"<td>([\d.]+) ± ", pages[0])) != set(re.findall(r"<td>([\d.]+) ± ", pages[2]))
    for room in result.spaces:
        assert f"<td>{room.daylight.room_metrics['daylight_factor']:.2f} ± " in pages[2]
    assert plan.table == (tmp_path / "out" / "first_plan.csv").read_text(), "the table stays the first plan's"


def test_a_plan_that_is_not_refined_counts_no_rooms():
    rooms = [planned("a", 0.02)]
    assert "1 rooms" not in plan_page(rooms, refined=False) and "of 1 rooms" in plan_page(rooms)
    assert plan_page(rooms, refined=False).count("<th>") == plan_page(rooms).count("<th>") - 1


def test_results_of_an_earlier_run_stay_beside_a_first_plan(tmp_path):
    with ResultFolder(tmp_path / "out", "run").replaced() as part:
        (part / "report.html").write_text("earlier")
        (part / "run.json").write_text("{}")
    ResultFolder(tmp_path / "out", "run").early({"report.html": "plan"})
    assert (tmp_path / "out" / "report.html").read_text() == "earlier"


def test_a_first_plan_takes_no_file_of_others(tmp_path):
    folder = ResultFolder(tmp_path / "out", "run")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "report.html").write_text("mine")
    with pytest.raises(DataError, match="which no earlier run wrote"):
        folder.early({"report.html": "plan"})
    assert (tmp_path / "out" / "report.html").read_text() == "mine"


def test_an_error_needs_matrices(tmp_path, capsys):
    words = ["run", str(OFFICE), "--weather", str(WEATHER), "--out", str(tmp_path / "out")]
    assert cli.run([*words, "--method", "point-in-time", "--error", "5%"]) == 2
    assert "--error needs --method three-phase or five-phase" in capsys.readouterr().err


def test_matrices_of_rooms_that_are_all_there_are_not_read_again(two_rooms, tmp_path, monkeypatch):
    inputs, options = two_rooms
    traced: list[int] = []

    def counted(scenes, *arguments, **choices):
        traced.append(len(scenes))
        return matrices_together(scenes, *arguments, **choices)

    matrices_together = together.matrices_together
    monkeypatch.setattr(together, "matrices_together", counted)
    cache = MatrixCache(tmp_path)

    def ahead(inputs):
        together.trace_ahead(inputs, inputs.spaces, None, options, cache)

    ahead(inputs)
    ahead(inputs)
    assert traced == [2]
    elsewhere = replace(inputs.building.elements[0], triangles=WALL - np.array([0.0, 1.0, 0.0]))
    ahead(replace(inputs, building=replace(inputs.building, elements=(elsewhere,))))
    assert traced == [2, 2], "another building by the same files"
    next(tmp_path.glob("*daylight*.npz")).unlink()
    ahead(inputs)
    assert traced[2:] == [2], "one of the matrices was trimmed"
