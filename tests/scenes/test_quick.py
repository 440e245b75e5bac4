"""`--quick`: what it chooses, what the user chose holds, and that the results say so."""

from __future__ import annotations

from dataclasses import fields, replace
from inspect import signature
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.errors import DataError
from scenes import quick
from scenes.cli import run
from scenes.commands import run as run_command
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.heat import study_file as heat_file
from scenes.room import series as rooms_of_a_run
from scenes.room.glare import default_hours
from scenes.room.options import RoomOptions
from scenes.run import run as rooms
from scenes.run.options import JobOptions
from scenes.study.study_file import read_study
from scenes.year_of_glare.options import YearOptions
from tests.scenes.study_files import study_file

RUN = ["run", str(OFFICE), "--weather", str(WEATHER), "--cfs", str(VENETIAN_BLIND), "--out", "o"]
BOX = f"""
weather = "{WEATHER}"
[box]
width = 3.0
depth = 4.0
height = 3.0
window = [{{ x = 0.5, sill = 1.0, width = 2.0, height = 1.5 }}]
[[system]]
bsdf = "{VENETIAN_BLIND}"
"""


def test_every_choice_is_an_option_and_none_costs_more() -> None:
    from scenes.photovoltaics.study import run_pv

    defaults = RoomOptions().named() | {f.name: f.default for f in fields(YearOptions)}
    defaults |= {"samples": YearOptions.__dataclass_fields__["samples"].default}
    for name, value in (quick.ROOM | quick.VIEWS).items():
        coarser = name in ("sensor_spacing", "heat_step_s")
        assert value > defaults[name] if coarser else value < defaults[name], name
    trace = heat_file.TraceTable()
    for name, value in quick.HEAT.items():
        full = getattr(trace, name)
        assert value > full if name == "sensor_spacing" else value < full, name
    assert quick.PV["samples"] < signature(run_pv).parameters["samples"].default


@pytest.fixture
def chosen(monkeypatch: pytest.MonkeyPatch) -> list:
    """The options that commands would have run with."""
    seen: list = []

    def keep(options, *_rest, **_more):
        seen.append(options)
        raise DataError("stop here")

    monkeypatch.setattr(run_command, "run_to_folder", keep)
    monkeypatch.setattr("scenes.year_of_glare.year.read_year", keep)
    return seen


def test_a_choice_by_its_name_holds_in_runs_and_checks(chosen: list, monkeypatch) -> None:
    """`--set` has every name of study files, also beside `--quick`; words need no quotes."""
    keep = run_command.run_to_folder
    monkeypatch.setattr("scenes.comply.files.read_files", keep)
    settings = ["sensor_samples=300", "occupied=[7, 17]", "glare_sources=pixels"]
    words = [word for one in settings for word in ("--set", one)]
    run([*RUN, "--quick", *words])
    run(["comply", *RUN[1:], "--standard", "en17037", "--quick", *words])
    assert len(chosen) == 2
    for options in chosen:
        named = options.room.named()
        assert (named["sensor_samples"], named["occupied"]) == (300, (7, 17))
        assert named["glare_sources"] == "pixels"
        assert named["patch_samples"] == quick.ROOM["patch_samples"]


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("sensor_sampels=4", "--set: sensor_sampels: no such key; did you mean sensor_samples?"),
        ("sensor_samples=many", "sensor_samples: expected a whole number, got 'many'"),
        ("sensor_samples", "--set 'sensor_samples': expected NAME=VALUE"),
        ("sensor_spacing=1", "--set 'sensor_spacing=1': means nothing to this command"),
    ],
)
def test_a_wrong_choice_by_name_is_one_line(capsys, setting: str, said: str) -> None:
    """A check's grids are its rules': a spacing is none of its choices."""
    assert run(["comply", *RUN[1:], "--standard", "en17037", "--set", setting]) != 0
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("size", ["800", "600"])  # the second is the default of a full run
def test_what_the_user_gives_holds_against_quick(chosen: list, size: str) -> None:
    run([*RUN, "--quick", "--size", size, "--spacing", "0.25"])
    (options,) = chosen
    named = options.room.named()
    assert (named["picture_size"], named["sensor_spacing"]) == (int(size), 0.25)
    rest = {n: v for n, v in quick.ROOM.items() if n not in ("picture_size", "sensor_spacing")}
    assert {name: named[name] for name in rest} == rest
    assert options.quick


def test_without_quick_nothing_is_chosen(chosen: list) -> None:
    run(RUN)
    assert chosen == [JobOptions(OFFICE, WEATHER, VENETIAN_BLIND)]


@pytest.mark.parametrize(("words", "colour"), [([], True), (["--no-colour"], False), (["--quick"], False)])
def test_a_quick_run_has_no_picture_in_colour(chosen: list, words: list[str], colour: bool) -> None:
    run([*RUN, *words])
    assert [options.colour for options in chosen] == [colour]


def test_what_the_user_gives_holds_in_a_year_of_glare(chosen: list, tmp_path) -> None:
    out = ["--out", str(tmp_path / "dgp")]
    run(["dgp", *out, "--quick"])
    run(["dgp", *out, "--quick", "--size", "800"])
    run(["dgp", *out])
    sizes = [(o.size, o.samples, o.quick) for o in chosen]
    few, many = quick.VIEWS["samples"], YearOptions.__dataclass_fields__["samples"].default
    assert sizes == [(quick.VIEWS["size"], few, True), (800, few, True), (800, many, False)]


def test_what_a_study_says_holds_against_quick(tmp_path) -> None:
    path = study_file(tmp_path)  # it says how large its pictures are
    study = read_study(path, quick=True)
    assert study.quick and study.options.picture_size == 96
    assert study.options.sun_points == quick.ROOM["sun_points"]
    assert read_study(path).options.sun_points == RoomOptions().sampling.sun_points


def test_what_a_thermal_study_says_holds_against_quick(tmp_path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(BOX + "[trace]\nsensor_samples = 9999\n", encoding="utf-8")
    trace = heat_file.read_study(path, quick=True).trace
    assert (trace.sensor_samples, trace.patch_samples) == (9999, quick.HEAT["patch_samples"])
    assert heat_file.read_study(path).trace.patch_samples == 8192


def test_one_picture_is_the_brightest_hours() -> None:
    times = pd.date_range("2005-01-01 00:30", periods=8760, freq="h")
    lit = np.arange(6, 8760)
    eye = np.zeros(len(lit), dtype=np.float32)
    eye[4000] = 1e4
    every = default_hours(times, lit, eye, 10)
    assert len(every) == 10 and every[-1] == lit[4000]
    assert default_hours(times, lit, eye, 0) == []
    assert default_hours(times, lit, eye, 1) == [lit[4000]]
    assert default_hours(times, lit, eye, 3) == [*every[:2], lit[4000]]
    eye[np.flatnonzero(lit == every[4])] = 2e4
    assert default_hours(times, lit, eye, 10) == every[:-1]
    assert default_hours(times, lit, eye, 1) == [every[4]]


@pytest.fixture
def three_rooms(monkeypatch: pytest.MonkeyPatch, no_pictures: None) -> SimpleNamespace:
    """Rooms of which the third equals the first, each computed by a stub."""
    spaces = [SimpleNamespace(guid=g, label=g.upper(), template="", windows=()) for g in ("a", "b", "c")]
    a, b, c = spaces
    monkeypatch.setattr(rooms, "template_rooms", lambda spaces: [(a, c), (b,)])
    monkeypatch.setattr(rooms_of_a_run, "same_systems", lambda *_: False)
    return SimpleNamespace(spaces=spaces, building=None, systems={}, weather=None, operation=None)


def test_each_room_is_told_when_it_is_computed_in_their_order(three_rooms, monkeypatch) -> None:
    said: list[str] = []
    monkeypatch.setattr(
        rooms, "compute_room", lambda building, space, *_, **__: said.append(f"computed {space.guid}") or space
    )
    told = lambda room: said.append(f"told {room.guid}")  # noqa: E731
    options = replace(JobOptions(OFFICE, WEATHER), cache=False, coupled_heat=False)
    results, _, _ = rooms.computed_rooms(three_rooms, None, options, lambda *_: None, on_room=told)
    assert said == [f"{what} {room}" for room in "abc" for what in ("computed", "told")]
    assert [room.guid for room in results] == ["a", "b", "c"]


def test_progress_counts_the_rooms(three_rooms, monkeypatch) -> None:
    seen = []
    monkeypatch.setattr(
        rooms, "compute_room", lambda building, space, *_, progress, **__: progress("light", 0.5) or space
    )
    options = replace(JobOptions(OFFICE, WEATHER), cache=False, coupled_heat=False)
    progress = lambda stage, _: seen.append((stage.number, stage.total, stage))  # noqa: E731
    rooms.computed_rooms(three_rooms, None, options, progress, on_room=lambda room: None)
    assert seen == [(1, 3, "A: light"), (2, 3, "B: light"), (3, 3, "C: light")]


def test_a_room_is_said_though_the_run_fails_later(monkeypatch, tmp_path, capsys) -> None:
    def half(options, progress, files, *, on_room, on_light, on_head, on_plan, workers):
        on_light(first)
        on_room(first)
        on_room(SimpleNamespace(space=SimpleNamespace(guid="b", label="B"), daylight=light))
        raise DataError("the second failed")

    monkeypatch.setattr("scenes.run.run.run_job", half)
    light = SimpleNamespace(grids=())
    first = SimpleNamespace(space=SimpleNamespace(guid="a", label="A"), daylight=light)
    monkeypatch.setattr(run_command, "_light_figures", lambda room: "DGP 0.30")
    monkeypatch.setattr(run_command, "_heat_figures", lambda room: "20 C")
    assert run([*RUN[:-1], str(tmp_path / "o"), "--quick"]) == 1
    said = capsys.readouterr()
    assert said.out.splitlines() == [quick.NOTE, "A: DGP 0.30", "A: 20 C", "B: DGP 0.30, 20 C"]
