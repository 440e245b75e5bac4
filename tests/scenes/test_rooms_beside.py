"""Rooms of one run computed beside each other: the same results, in the rooms' order."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from threadpoolctl import threadpool_info

from bim.model import Building, Space
from bim.shoebox import WindowRectangle, shoebox
from bim.templates import template_rooms
from mitsuba_cfs.errors import DataError, RoomError
from mitsuba_cfs.progress import silent
from mitsuba_cfs.variants import BLAS_THREADS
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.inputs import Inputs, read_inputs
from scenes.room import series
from scenes.room.options import RoomOptions
from scenes.room.series import RoomSeries
from scenes.run import outputs
from scenes.run import run as rooms
from scenes.run.options import JobOptions
from scenes.run.run import Workers, run_inputs, run_job
from scenes.workers import Tasks, processes_for
from tests.conftest import REPOSITORY
from tests.scenes.small_box import BOX, ROOM, SMALL
from tests.scenes.test_equal_rooms import moved


def box(name: str, depth: float) -> Space:
    window = WindowRectangle(0.5, 0.9, 1.5, 1.5)
    return shoebox(2.5, depth, 2.8, windows=(window,), name=name).spaces[0]


def named(spaces: list[Space], fails: str = "", alike: bool = True) -> tuple[RoomSeries, list]:
    """Rooms whose result is their name, computed last room first, and which were asked for."""
    asked: list[list[str]] = []

    def parallel(rooms):
        asked.append([room.name for room in rooms])
        for room in reversed(rooms):
            yield room, RoomError("no floor") if room.name == fails else room.name

    def here(space, steps):
        asked.append([space.name])
        return f"here {space.name}"

    return RoomSeries(
        replace(BOX, spaces=tuple(spaces)),
        spaces,
        template_rooms(spaces),
        {},
        SMALL.sampling,
        None,
        here,
        lambda result, space: f"{space.name} like {result}",
        alike=lambda one, other: alike,
        parallel=parallel,
    ), asked


@pytest.fixture(autouse=True)
def seen_alike(monkeypatch):
    """Equal rooms see the same; nothing is traced."""
    monkeypatch.setattr(series, "same_systems", lambda *rooms: True)
    monkeypatch.setattr(series.OutdoorLight, "same", lambda one, other: True)


def test_results_come_in_the_rooms_order_and_equal_rooms_are_computed_once():
    twin, heard = moved(BOX, (10.0, 0.0, 3.0), "twin"), []
    rooms, asked = named([ROOM, box("deep", 6.0), twin])
    found, issues, notes = replace(rooms, on_room=heard.append).results()
    assert found == heard == ["room", "deep", "twin like room"]
    assert asked == [["room", "deep"]] and not issues and len(notes) == 1
    rooms, asked = named([ROOM, twin], alike=False)
    assert rooms.results()[0] == ["room", "twin"] and asked == [["room", "twin"]]


def test_a_room_that_fails_leaves_the_others_and_is_no_template():
    twin = moved(BOX, (10.0, 0.0, 3.0), "twin")
    rooms, asked = named([ROOM, box("deep", 6.0), twin], fails="room")
    found, issues, _ = rooms.results()
    assert found == ["deep", "here twin"] and asked == [["room", "deep"], ["twin"]]
    assert [issue.values["reason"] for issue in issues] == ["no floor"]


def test_what_is_no_fault_of_a_room_ends_the_run():
    rooms, _ = named([ROOM, box("deep", 6.0)])
    ended = []

    def parallel(some):
        try:
            yield some[0], DataError("file is gone")
            raise AssertionError("asked for another")
        finally:
            ended.append("the processes")

    with pytest.raises(DataError, match="file is gone"):
        replace(rooms, parallel=parallel).results()
    assert ended


def test_a_folder_that_cannot_be_written_ends_the_processes(tmp_path):
    """At once: not when the exception that somebody holds is let go."""
    spaces = [box(f"{number}", 4.0) for number in range(2 * outputs.TASKS_A_PROCESS)]
    years = [SimpleNamespace(space=space) for space in spaces]
    result = SimpleNamespace(spaces=years, times=None)
    with pytest.raises(OSError, match="no-folder") as held:
        outputs._write_rooms(result, [tmp_path / "no-folder" / "room"] * 16, 2, silent)
    end = time.monotonic() + 10.0
    while multiprocessing.active_children() and time.monotonic() < end:
        time.sleep(0.05)
    assert not multiprocessing.active_children(), held.value


@pytest.mark.usefixtures("variant")
def test_a_worker_with_other_files_than_the_command_has_computes_nothing(tmp_path, monkeypatch):
    """Nor does one that read them before they were changed."""
    building = tmp_path / "rooms.hbjson"
    text = (REPOSITORY / "docs" / "tutorials" / "two_rooms.hbjson").read_text()
    building.write_text(text)
    options = JobOptions(building, WEATHER, VENETIAN_BLIND, cache=False, room=SMALL)
    monkeypatch.setattr(rooms, "compute_room", lambda *_, **__: text)

    def command() -> rooms._FromFiles:
        run = rooms._identity(options, read_inputs(options))
        return rooms._FromFiles(True, options, run, {})

    before = command()
    (name,) = {space.guid for space in read_inputs(options).spaces if "Hall" in space.label}
    assert before(name) == (name, text)
    building.write_text(text + "\n")
    assert command()(name) == (name, text)
    with pytest.raises(DataError, match="--scheduler: a worker has other input files"):
        before(name)


@pytest.mark.slow
def test_two_processes_give_what_one_gives(variant, weather, glass, monkeypatch):
    """Bit by bit: the same random numbers, one after the other or beside each other.

    Given products by as many threads as here: by fewer, the library adds up in another order.
    """
    monkeypatch.setenv(BLAS_THREADS, os.environ.get(BLAS_THREADS, str(os.cpu_count())))
    spaces = [ROOM, box("deep", 6.0), box("shallow", 3.0)]
    building: Building = replace(BOX, spaces=tuple(spaces))
    systems = {w.guid: (glass,) for s in spaces for w in s.windows}
    room = RoomOptions.of(
        sky_subdivision=1,
        sensor_spacing=1.0,
        sensor_samples=512,
        patch_samples=256,
        picture_size=64,
        picture_count=1,
        picture_samples=1,
    )
    inputs = Inputs(building, spaces, weather, systems, None)
    options = JobOptions(Path(__file__), Path(__file__), cache=False, room=room)
    told: list[SimpleNamespace] = []
    one = run_inputs(inputs, options)
    two = run_inputs(inputs, options, workers=Workers(2), on_light=told.append)
    assert [r.space.name for r in two.spaces] == [r.space.name for r in told] == ["room", "deep", "shallow"]
    for mine, theirs in zip(one.spaces, two.spaces, strict=True):
        np.testing.assert_array_equal(mine.daylight.illuminance, theirs.daylight.illuminance)
        np.testing.assert_array_equal(mine.heat.air_c, theirs.heat.air_c)
        (picture,), (same,) = mine.glare.pictures, theirs.glare.pictures
        np.testing.assert_array_equal(picture.luminance, same.luminance)
        assert mine.glare.colour is not None and theirs.glare.colour is not None
        np.testing.assert_array_equal(mine.glare.colour.radiance, theirs.glare.colour.radiance)


@pytest.mark.slow
def test_workers_of_a_cluster_give_what_one_process_gives(variant, tmp_path_factory):
    """They read the files for themselves; a scheduler that is asked twice gives the same."""
    pytest.importorskip("distributed")
    from tests.scenes.test_study_cluster import Cluster

    room = RoomOptions.of(
        sky_subdivision=1,
        sensor_spacing=1.0,
        sensor_samples=512,
        patch_samples=256,
        picture_size=64,
        picture_count=1,
        picture_samples=1,
    )
    building = REPOSITORY / "docs" / "tutorials" / "two_rooms.hbjson"
    options = JobOptions(building, WEATHER, VENETIAN_BLIND, cache=False, room=room)
    cluster = Cluster(tmp_path_factory.mktemp("dask"), 2)
    try:
        runs = [run_job(options), run_job(options, workers=Workers(1, cluster.address))]
        reseeded = replace(options, room=room.changed(seed=1))
        other = run_job(reseeded, workers=Workers(1, cluster.address))
    finally:
        cluster.stop()
    one, two = runs
    assert len(one.spaces) == len(two.spaces) == 2
    for mine, theirs, seeded in zip(one.spaces, two.spaces, other.spaces, strict=True):
        np.testing.assert_array_equal(mine.daylight.illuminance, theirs.daylight.illuminance)
        np.testing.assert_array_equal(mine.heat.air_c, theirs.heat.air_c)
        assert not np.array_equal(seeded.daylight.illuminance, mine.daylight.illuminance)


def threads(item: int) -> int:
    import drjit as dr

    return dr.thread_count()


def fault(item: int, error: BaseException) -> BaseException:
    return error


def test_processes_beside_each_other_share_the_cores():
    tasks = Tasks([0], threads, fault, key=str, scene=str)
    expected = max((os.cpu_count() or 1) // 3, 1)
    assert list(tasks.results(processes=3)) == [expected]


def blas_threads(_: int) -> tuple[int, str | None, set[int]]:
    """A process, the number of BLAS threads that it asks for, and that of each library loaded."""
    loaded = threadpool_info()
    threads = {one["num_threads"] for one in loaded if one["user_api"] == "blas"}
    return os.getpid(), os.environ.get(BLAS_THREADS), threads


@pytest.mark.parametrize(("user", "expected"), [(None, 1), ("2", 2)])
def test_processes_multiply_with_their_share_of_the_cores(monkeypatch, user, expected):
    """Unless the user has set their number; this process keeps its own."""
    monkeypatch.delenv(BLAS_THREADS, raising=False)
    if user:
        monkeypatch.setenv(BLAS_THREADS, user)
    before = blas_threads(0)
    tasks = Tasks([1], blas_threads, fault, key=str, scene=str)
    [(process, asked, threads)] = list(tasks.results(processes=os.cpu_count()))
    assert process != os.getpid() and asked == str(expected)
    assert max(threads) <= expected  # fewer where the process has fewer cores
    assert blas_threads(0) == before


def ends_its_process(item: str) -> str:
    """By a signal: always, or until a file tells that it did so before."""
    kind, _, told = item.partition(":")
    if kind == "always" or (kind == "once" and not Path(told).exists()):
        if kind == "once":
            Path(told).touch()
        os.kill(os.getpid(), signal.SIGABRT if kind == "always" else signal.SIGKILL)
    if kind == "slow":
        time.sleep(0.3)
    return item


def said_of(item: str, error: BaseException) -> str:
    return f"{item.partition(':')[0]} failed: {error}"


def test_a_process_that_ends_takes_no_other_task_with_it(tmp_path):
    """One killed for memory is done again; one that aborts alone too has failed; others go on."""
    items = ["slow:1", f"once:{tmp_path / 'told'}", "slow:2", "always:", *(f"n:{i}" for i in range(9))]
    tasks = Tasks(items, ends_its_process, said_of, key=str, scene=str)
    results = list(tasks.results(processes=2))
    failed = [one for one in results if "failed" in one]
    assert len(failed) == 1
    assert failed[0].startswith("always failed: ") and "signal SIGABRT" in failed[0]
    assert sorted(set(results) - set(failed)) == sorted(set(items) - {"always:"})
    assert len(results) == len(items)


class Trap:
    """Kills the process that unpickles it, until a file tells that it did so before."""

    def __init__(self, told: Path) -> None:
        self.told = told

    def __setstate__(self, state: dict) -> None:
        told = state["told"]
        if multiprocessing.current_process().name != "MainProcess" and not told.exists():
            told.touch()
            os.kill(os.getpid(), signal.SIGKILL)


@dataclass(frozen=True)
class Large:
    """Work that holds more than a pipe does, behind a trap."""

    trap: Trap
    building: bytes = bytes(1_000_000)

    def __call__(self, item: int) -> int:
        return item


def test_a_process_that_is_killed_while_it_starts_is_started_again(tmp_path):
    tasks = Tasks([1, 2, 3], Large(Trap(tmp_path / "told")), fault, key=str, scene=str)
    assert sorted(tasks.results(processes=2)) == [1, 2, 3]


def test_processes_that_all_end_are_given_up_with_one_line():
    tasks = Tasks([f"always:{i}" for i in range(40)], ends_its_process, said_of, key=str, scene=str)
    with pytest.raises(DataError, match="signal SIGABRT"):
        list(tasks.results(processes=2))


def test_followers_of_a_task_that_ends_its_process_are_done():
    items = ["always:", "n:1", "n:2"]
    tasks = Tasks(items, ends_its_process, said_of, key=str, scene=lambda _: "one")
    results = list(tasks.results(processes=2))
    assert sorted(one.partition(" ")[0] for one in results) == ["always", "n:1", "n:2"]


@pytest.mark.parametrize(
    ("tasks", "cores", "memory", "expected"),
    [
        (73, 2, 24, 2),
        (73, 16, 128, 9),
        (73, 16, 16, 4),
        (73, 16, 2, 1),
        (15, 16, 128, 1),
        (16, 16, 128, 2),
        (0, 4, 24, 1),
    ],
)
def test_processes_by_cores_memory_and_tasks(monkeypatch, tasks, cores, memory, expected):
    monkeypatch.setattr(os, "cpu_count", lambda: cores)
    pages = {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": memory * 2**30 // 4096}
    monkeypatch.setattr(os, "sysconf", pages.__getitem__)
    assert processes_for(tasks, None) == expected
    assert processes_for(tasks, 3) == 3


def test_a_run_of_few_rooms_begins_no_process():
    assert Workers(None).for_rooms(15) is None
    assert Workers(3).for_rooms(15) == Workers(3)
    assert Workers(None, "tcp://host:8786").for_rooms(15).scheduler == "tcp://host:8786"
