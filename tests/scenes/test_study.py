"""`cfs study`: its file, its grid, what is shared, what is kept, and what is written."""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.errors import DataError, RoomError
from scenes.cli import run
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.study.plan import plan_of
from scenes.study.store import CaseResult, Store, computed
from scenes.study.study import run_study
from scenes.study.study_file import read_study
from tests.conftest import REPOSITORY, default_signals
from tests.scenes.study_files import BOX, CLIMATE, FEW_RAYS, SYSTEM, study_file
from tests.scenes.study_noted import noted

pytestmark = pytest.mark.early

SECOND = f"""
[[system]]
name = "brighter"
bsdf = "{VENETIAN_BLIND}"
g_value = 0.35
"""
WRONG = {
    "no system": ("", BOX + CLIMATE, "system: is missing"),
    "unknown key": ("colour = 1\n", BOX + SYSTEM + CLIMATE, "colour: no such key; there are "),
    "unknown method": ('methods = ["six-phase"]\n', BOX + SYSTEM + CLIMATE, "methods.0: expected 'three-phase', "),
    "no number": ('orientations_deg = ["south"]\n', BOX + SYSTEM + CLIMATE, "orientations_deg.0: expected a"),
    "one orientation twice": ("orientations_deg = [0, 360]\n", BOX + SYSTEM + CLIMATE, "orientations_deg: 0.0 comes"),
    "one name twice": ("", BOX + SYSTEM + SYSTEM + CLIMATE, "system: 'blind' comes twice"),
    "box and building": (
        "",
        BOX.replace("[room.box]", f'building = "{OFFICE}"\n[room.box]') + SYSTEM + CLIMATE,
        "room.0: give either `building` or `box`",
    ),
    "system of nothing": ("", BOX + '[[system]]\nname = "none"\n' + CLIMATE, "system.0: give `bsdf`, or `operation`"),
    "U of no file": (
        "",
        BOX + '[[system]]\noperation = "a.toml"\nu_value = 1.1\n' + CLIMATE,
        "system.0: `u_value` and `g_value` belong to a `bsdf`",
    ),
    "no such operation": ("", BOX + '[[system]]\noperation = "a.toml"\n' + CLIMATE, "system.0.operation: no such"),
    "no such file": ("", BOX + SYSTEM.replace(".xml", ".xlm") + CLIMATE, "system.0.bsdf: no such"),
    "no such peak": (
        "",
        BOX + SYSTEM + 'see_through = ["blind.xml=sharp"]\n' + CLIMATE,
        "system.0.see_through.0: --see-through: expected FILE=specular",
    ),
    "negative option": ("", BOX + SYSTEM + CLIMATE + "[options]\nsensor_spacing = -1\n", "options.sensor_spacing:"),
    "by wavelength with paths": (
        'methods = ["point-in-time"]\n',
        BOX + SYSTEM + CLIMATE + "[options]\nspectral = true\n",
        "options.spectral: needs methods of three-phase, five-phase",
    ),
    "bands with paths": (
        'methods = ["point-in-time"]\n',
        BOX + SYSTEM + CLIMATE + "[options]\nbands = true\n",
        "options.bands: needs methods of three-phase, five-phase",
    ),
    "no time": (
        "",
        BOX + SYSTEM + CLIMATE + '[auto]\ntime_budget = "soon"\n',
        "auto.time_budget: expected a time such as",
    ),
    "not TOML": ("", BOX + SYSTEM + CLIMATE + "[[", "is not TOML"),
}


@pytest.mark.parametrize("head, body, words", WRONG.values(), ids=WRONG.keys())
def test_a_wrong_file_is_one_line_that_names_the_key(tmp_path, capsys, head, body, words):
    path = tmp_path / "study.toml"
    path.write_text(head + body)
    assert run(["study", str(path), "--out", str(tmp_path / "out")]) == 1
    line = capsys.readouterr().err
    assert len(line.splitlines()) == 1 and words in line and str(path) in line
    assert not (tmp_path / "out").exists()


def grid(folder: Path):
    """2 systems x 3 orientations x 1 climate x 2 methods in a box."""
    head = 'orientations_deg = [0, 90, 180]\nmethods = ["three-phase", "five-phase"]\n'
    return plan_of(read_study(study_file(folder, head, system=SYSTEM + SECOND)))


def test_the_grid_holds_every_combination_once(tmp_path):
    cases = grid(tmp_path).cases
    seen = {(c.system, c.orientation_deg, c.climate, c.options.method) for c in cases}
    assert len(cases) == len(seen) == len({c.key for c in cases}) == 12
    assert len({c.scene for c in cases}) == 1


def test_a_study_says_which_peaks_are_lobes(tmp_path):
    from scenes.study.one_case import case_inputs

    lobe = f'see_through = ["{VENETIAN_BLIND.name}=lobe"]\n'
    twin = SYSTEM.replace('name = "blind"', 'name = "lobe"') + lobe
    shares = {}
    for case in plan_of(read_study(study_file(tmp_path, "", system=SYSTEM + twin))).cases:
        ((state,), *_) = case_inputs(case).systems.values()
        shares[case.system] = state.visible.see_through
    assert shares == {"blind": 1.0, "lobe": 0.0}


def test_a_case_is_known_by_what_its_numbers_depend_on(tmp_path):
    case = grid(tmp_path).cases[0]
    twin = replace(case, room="other name", system="x", climate="y", chosen="why")
    assert twin.key == case.key
    others = [
        {"orientation_deg": 1.0},
        {"options": case.options.changed(seed=1)},
        {"glare": "sDGP"},
        {"program": "newer"},
        *(
            {"inputs": replace(case.inputs, **one)}
            for one in ({"u_value": 2.0}, {"spaces": ("b",)}, {"see_through": ("a.xml=lobe",)})
        ),
    ]
    for number, file in enumerate(case.files):
        changed = (*case.files[:number], replace(file, sha256="0"), *case.files[number + 1 :])
        others.append({"files": changed})
        moved = (*case.files[:number], replace(file, path=Path("b")), *case.files[number + 1 :])
        assert replace(case, files=moved).key == case.key
    assert {"weather", "system"} <= {file.name for file in case.files}
    for other in others:
        assert replace(case, **other).key != case.key, other


def test_corrections_beside_a_building_make_it_another_case(tmp_path):
    office = tmp_path / "office.ifc"
    office.write_bytes(OFFICE.read_bytes())
    path = tmp_path / "study.toml"
    path.write_text('[[room]]\nbuilding = "office.ifc"\n' + SYSTEM + CLIMATE)
    before, _ = plan_of(read_study(path)).cases
    (tmp_path / "office.corrections.toml").write_text("surroundings = 0.3\n")
    after, _ = plan_of(read_study(path)).cases
    assert before.key != after.key and before.scene != after.scene


@pytest.fixture(scope="module", autouse=True)
def own_cache(tmp_path_factory):
    """A cache of matrices of these tests alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("CFS_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A study of two orientations and two systems that are computed, as the command does it."""
    folder = tmp_path_factory.mktemp("study")
    (folder / "set points.toml").write_text("[loads]\nheating_c = 20\ncooling_c = 26\n")
    head = 'operation = "set points.toml"\n'
    head += 'title = "Blinds"\norientations_deg = [0, 90]\nmethods = ["three-phase"]\n'
    path = study_file(folder, head + 'glare = "sDGP"\n', system=SYSTEM + SECOND)
    assert run(["study", str(path), "--out", str(folder / "out")]) == 0
    return path, folder / "out"


def test_one_row_a_case_with_all_its_figures(done):
    table = pd.read_parquet(done[1] / "results.parquet")
    assert list(table["status"]) == ["done"] * 4
    assert list(table["facing"]) == ["south", "south", "west", "west"]
    assert not table.drop(columns=["why", "error"]).isna().any().any()
    assert table.shape == pd.read_csv(done[1] / "results.csv").shape
    for column in ("da300", "sda300_50", "udi_300_3000", "operative_max_c", "comfortable_80_h"):
        assert np.isfinite(table[column]).all()
    hours = [f"glare_{c}_h" for c in ("imperceptible", "perceptible", "disturbing", "intolerable")]
    assert (table[hours].sum(axis=1) == 3650).all()
    # the second system differs in heat alone
    by_system = table.groupby("system")
    assert by_system["da300"].apply(list)["blind"] == by_system["da300"].apply(list)["brighter"]
    cooled, heated = (by_system[f"{what}ing_kwh"].mean() for what in ("cool", "heat"))
    assert cooled["brighter"] > 1.2 * cooled["blind"] and heated["brighter"] < heated["blind"]
    assert not list(done[1].rglob(".*")), "temporary files are gone"


def test_a_turned_model_is_a_room_that_faces_elsewhere(done, tmp_path):
    """By 90 degrees: as a box whose front looks west, traced for itself."""
    west = BOX.replace("width = 3.0", "facing_deg = 270\nwidth = 3.0", 1)
    path = tmp_path / "west.toml"
    (tmp_path / "set points.toml").write_text("[loads]\nheating_c = 20\ncooling_c = 26\n")
    head = 'operation = "set points.toml"\nmethods = ["three-phase"]\nglare = "sDGP"\n'
    path.write_text(head + west + SYSTEM + CLIMATE + FEW_RAYS)
    found = run_study(read_study(path), Store(tmp_path / "out")).results[0].figures
    turned = pd.read_parquet(done[1] / "results.parquet").iloc[2]
    # the same numbers but for noise: V and D have other random numbers; five standard errors
    noise = 5 * np.hypot(turned["illuminance_error_mean"], found["illuminance_error_mean"]) / 100
    assert found["mean_illuminance_lx"] == pytest.approx(turned["mean_illuminance_lx"], rel=noise)
    assert found["operative_mean_c"] == pytest.approx(turned["operative_mean_c"], abs=0.3)
    assert found["cooling_kwh"] == pytest.approx(turned["cooling_kwh"], rel=noise)


def test_finished_cases_are_not_computed_again(done, capsys):
    path, out = done
    before = {f: f.stat().st_mtime_ns for f in (out / "cases").iterdir()}
    assert run(["study", str(path), "--out", str(out)]) == 0
    assert "4 from an earlier run, 0 failed" in capsys.readouterr().out
    assert {f: f.stat().st_mtime_ns for f in (out / "cases").iterdir()} == before


def test_a_damaged_case_file_is_computed_again(done, tmp_path):
    path, out = done
    shutil.copytree(out, tmp_path / "out")
    store = Store(tmp_path / "out")
    study = read_study(path)
    victim = plan_of(study).cases[1]
    place = tmp_path / "out" / "cases" / f"{victim.key}.npz"
    place.write_bytes(place.read_bytes()[:2000])
    asked = []

    def compute(case, *, progress):
        asked.append(case.key)
        return CaseResult(case.key, {"da300": 1.0})

    run_study(study, store, compute=compute)
    assert asked == [victim.key]


def test_shared_matrices_are_traced_once(tmp_path, monkeypatch):
    """Two systems, two orientations: V and D of the room are in the cache once."""
    monkeypatch.setenv("CFS_CACHE", str(tmp_path / "cache"))
    head = 'orientations_deg = [0, 135]\nmethods = ["three-phase"]\nglare = "none"\n'
    study = read_study(study_file(tmp_path, head, system=SYSTEM + SECOND))
    run_study(study, Store(tmp_path / "out"))
    found = [f.name.rpartition("-")[0] for f in (tmp_path / "cache").glob("*.npz")]
    assert found.count("view-matrix") == 2, found  # V, and V_d for the error of the blurred sun
    assert found.count("daylight-matrix") == 1, found


@pytest.mark.parametrize(("processes", "told"), [(1, True), (2, False)])
def test_a_case_computed_here_tells_its_stages(tmp_path, processes, told):
    """A study's one case may take minutes: a bar that stands still says nothing of them."""
    study = read_study(study_file(tmp_path, "orientations_deg = [0, 20]\n"))
    room = study.room[0].model_copy(update={"name": str(tmp_path / "log")})
    study = study.model_copy(update={"room": (room,)})
    stages = []
    run_study(
        study,
        Store(tmp_path / "out"),
        compute=noted,
        processes=processes,
        progress=lambda stage, fraction: stages.append((str(stage), stage.number, fraction)),
    )
    for number in (1, 2):
        assert (("daylight", number, 0.5) in stages) == told
        assert ("", number, 0.0) in stages


def test_one_failed_case_leaves_the_others(tmp_path):
    study = read_study(study_file(tmp_path, "orientations_deg = [0, 13, 20]\n"))
    room = study.room[0].model_copy(update={"name": str(tmp_path / "log")})
    study = study.model_copy(update={"room": (room,)})
    store = Store(tmp_path / "out")
    table = pd.DataFrame(run_study(study, store, compute=noted).rows())
    assert list(table["status"]) == ["done", "failed", "done"]
    assert table["error"][1] == "this one fails" and np.isnan(table["angle"][1])
    assert len(list((tmp_path / "out" / "cases").iterdir())) == 2  # a failure is tried again


def test_table_manifest_and_report_of_a_study_are_replaced_together(tmp_path):
    """An interrupted write leaves all of the earlier ones; without a report there is no old one."""

    def interrupted(path):
        path.write_text("new")
        raise KeyboardInterrupt

    def contents():
        names = [one for one in out.iterdir() if one.name != "cfs-results.json" and one.is_file()]
        return {one.name: one.read_bytes() for one in names}

    out = tmp_path / "out"
    store = Store(out)
    store.write([{"case": 1}], {"cases": 1}, lambda path: path.write_text("old"))
    before = contents()
    assert {"results.csv", "results.parquet", "study.json", "report.html"} == set(before)
    with pytest.raises(KeyboardInterrupt):
        Store(out).write([{"case": 2}], {"cases": 2}, interrupted)
    assert contents() == before
    Store(out).write([{"case": 2}], {"cases": 2})
    after = contents()
    assert set(after) == set(before) - {"report.html"}
    assert all(after[name] != before[name] for name in after)


def _failing(case, *, progress=None):
    """A case of which one orientation cannot be computed."""
    from thermal.errors import ThermalInputError

    if case.orientation_deg == 13:
        raise ThermalInputError("shade: g", "0.1 is below tau")
    return noted(case)


def test_failed_cases_end_with_exit_1_and_their_number(tmp_path, capsys, monkeypatch):
    from scenes.study import study as module

    monkeypatch.chdir(tmp_path)  # where `noted` leaves its log, under the room's name
    monkeypatch.setattr("scenes.study_report.write_study_report", lambda _, path, _page: path.touch())
    options = dict(module.run_study.__kwdefaults__) | {"compute": _failing}
    monkeypatch.setattr(module.run_study, "__kwdefaults__", options)
    path = study_file(tmp_path, "orientations_deg = [0, 13, 20]\n")
    assert run(["study", str(path), "--out", "out"]) == 1
    said = capsys.readouterr()
    last = said.err.splitlines()[-1]
    assert last.startswith("error: 1 of 3 cases failed, the first: shade: g: 0.1 is below tau")
    assert "Error" not in said.err + said.out  # no class is named
    assert (tmp_path / "out" / "report.html").exists()
    table = pd.read_csv(tmp_path / "out" / "results.csv")
    assert list(table["status"]) == ["done", "failed", "done"]


def test_a_page_of_the_cases_stands_in_the_place_of_the_report(tmp_path, capsys, monkeypatch):
    """It has each case as it comes, stays where the study is stopped, and gives way to the report."""
    from scenes.study import study as module

    seen, stopped = [], []
    page = tmp_path / "out" / "report.html"

    def watched(case, *, progress=None):
        seen.append(page.read_text() if page.exists() else "")
        if case.orientation_deg == 20 and not stopped:
            stopped.append(case)
            raise KeyboardInterrupt
        return _failing(case, progress=progress)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("scenes.report.under_way.REFRESH_S", 0)
    monkeypatch.setattr("scenes.study_report.write_study_report", lambda _, path, _page: path.write_text("report"))
    options = dict(module.run_study.__kwdefaults__) | {"compute": watched}
    monkeypatch.setattr(module.run_study, "__kwdefaults__", options)
    command = ["study", str(study_file(tmp_path, "orientations_deg = [0, 13, 20]\n")), "--out", "out"]
    assert run(command) == 130
    texts = [re.findall(r"Computed: (\d) of 3 cases", text) for text in seen]
    assert texts == [[], ["1"], ["2"]]
    assert page.read_text() == seen[2] and "0.1 is below tau" in seen[2] and seen[2].count("http-equiv") == 1
    seen.clear()
    assert run(command) == 1  # the failed case is tried again, the finished one is on the page
    assert "Computed: 2 of 3 cases" in seen[1]
    assert page.read_text() == "report"


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (DataError("is short", file="a.epw"), "a.epw: is short"),
        (RoomError("no closed room"), "no closed room"),
        (OSError(28, "No space left on device", "x.npz"), "x.npz: the disk is full"),
        (MemoryError(), "out of memory"),
    ],
)
def test_a_case_that_fails_says_why_without_a_class(error, words):
    from scenes.study.store import failure_line

    assert failure_line(error) == words


def test_a_fault_of_the_program_is_called_so():
    from scenes.study.store import failure_line

    assert failure_line(KeyError("D")).startswith("fault of the program: KeyError('D')")


def test_a_file_that_changed_since_the_plan_is_said(tmp_path):
    weather = tmp_path / "w.epw"
    shutil.copy(WEATHER, weather)
    climate = CLIMATE.replace(str(WEATHER), str(weather))
    path = tmp_path / "study.toml"
    path.write_text(BOX + SYSTEM + climate + FEW_RAYS)
    plan = plan_of(read_study(path))
    weather.write_text(weather.read_text() + "\n")
    from scenes.study.one_case import compute_case

    (result,) = computed(plan.cases, compute_case)
    assert "is not the file that it was" in result.error and "w.epw" in result.error


def test_a_folder_with_other_things_is_left_alone(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(DataError, match="--out: holds other files"):
        Store(tmp_path)
    assert [f.name for f in tmp_path.iterdir()] == ["notes.txt"]


def test_processes_beside_each_other_give_every_case(tmp_path):
    study = read_study(study_file(tmp_path, "orientations_deg = [0, 13, 20, 30]\n"))
    room = study.room[0].model_copy(update={"name": str(tmp_path / "log")})
    cases = plan_of(study.model_copy(update={"room": (room,)})).cases
    found = {r.key: r for r in computed(cases, noted, processes=2)}
    assert [found[c.key].error for c in cases] == ["", "this one fails", "", ""]
    assert [found[c.key].figures.get("angle") for c in cases] == [0, None, 20, 30]


def test_an_interrupted_study_goes_on(tmp_path):
    """Ctrl-C midway: exit code 130, finished cases kept; the same command does the rest."""
    angles = list(range(0, 40, 2))
    path = study_file(tmp_path, f"orientations_deg = {angles}\n")
    code = (
        "import sys\n"
        "from scenes.study import one_case\n"
        "from tests.scenes.study_noted import noted\n"
        "one_case.compute_case = noted\n"
        "from scenes.cli import main\n"
        "main(['study', *sys.argv[1:]])\n"
    )
    text = path.read_text().replace('name = "box"', f'name = "{tmp_path / "log"}"')
    path.write_text(text)
    command = [sys.executable, "-c", code, str(path), "--out", str(tmp_path / "out")]
    process = subprocess.Popen(
        command, cwd=REPOSITORY, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=default_signals
    )
    cases = tmp_path / "out" / "cases"

    def finished() -> list[Path]:  # a case being written has another name
        return [path for path in cases.glob("*.npz") if not path.name.startswith(".")]

    end = time.monotonic() + 120
    while time.monotonic() < end and len(finished()) < 3:
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130 and errors.splitlines()[-1] == "interrupted"
    kept = len(finished())
    assert 3 <= kept < len(angles)
    log = (tmp_path / "log").read_text()
    study = read_study(path)
    again = run_study(study, Store(tmp_path / "out"), compute=noted)
    assert again.reused == kept and not again.failed
    more = (tmp_path / "log").read_text()[len(log) :]
    assert more.count("end") == len(angles) - kept


def test_results_go_back_into_the_ifc(tmp_path, capsys):
    """A property set for each case on the space and its windows; the table has the same numbers."""
    import ifcopenshell
    from ifcopenshell.util.element import get_psets

    room = f'[[room]]\nbuilding = "{OFFICE}"\nspaces = ["A"]\n'
    head = 'orientations_deg = [0, 90]\nmethods = ["three-phase"]\nglare = "none"\n'
    path = tmp_path / "study.toml"
    path.write_text(head + room + SYSTEM + CLIMATE + FEW_RAYS)
    target = tmp_path / "with results.ifc"
    arguments = ["study", str(path), "--out", str(tmp_path / "out"), "--write-ifc", str(target)]
    assert run(arguments) == 0
    table = pd.read_parquet(tmp_path / "out" / "results.parquet")
    case = plan_of(read_study(path)).cases[0]
    model = ifcopenshell.open(target)
    sets = get_psets(model.by_guid(case.inputs.spaces[0]))
    for _, row in table.iterrows():
        name = f"CFS results: blind, Chicago, {row['orientation_deg']:g} deg, three-phase"
        assert sets[name]["da300"] == pytest.approx(row["da300"])
        assert sets[name]["system"] == "blind"
    windows = [w for w in model.by_type("IfcWindow") if name in get_psets(w)]
    assert windows and get_psets(windows[0])[name]["u_value"] == pytest.approx(row["u_value"])
    assert (tmp_path / "out" / "report.html").is_file()

    path.write_text(head + BOX + SYSTEM + CLIMATE + FEW_RAYS)
    assert run(arguments) == 1
    assert "--write-ifc: needs a study of one building file" in capsys.readouterr().err
