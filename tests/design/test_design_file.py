"""The file of `cfs design`: what it refuses by name, and the studies that its candidates are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mitsuba_cfs.errors import DataError
from scenes.cli import run
from scenes.demo import OFFICE
from scenes.design.candidates import candidate, mattering, same_candidate
from scenes.design.design import SEARCH as SEARCH_STAGE
from scenes.design.design import Evaluations, space_of
from scenes.design.design_file import read_design
from scenes.design.search import Outcome, surrogate
from scenes.fenestration.systems import read_system
from scenes.room.operation import read_operation
from scenes.study.store import Store
from scenes.toml_file import read_table
from tests.design.designs import BLIND, COOLING, ENERGY, PLAIN, RULE, TILT, WIDTH, by_formula, design_file

pytestmark = pytest.mark.early

BOX_KEY = '[[variable]]\nkey = "room.box.window.{}"\nvalues = [1.0, 2.0]\n'
WRONG = {
    "no variable": (PLAIN + ENERGY, "variable: is missing"),
    "no objective": (PLAIN + WIDTH, "objective: is missing"),
    "no such objective": (PLAIN + WIDTH + '[[objective]]\nname = "energie"\n', "did you mean 'energy'?"),
    "column without a goal": (PLAIN + WIDTH + '[[objective]]\ncolumn = "warm_h"\n', 'goal: a column needs "least"'),
    "no such rule": (PLAIN + WIDTH + ENERGY + '[[constraint]]\nrule = "en17037 glair"\n', "en17037 has no 'glair'"),
    "no such standard": (PLAIN + WIDTH + ENERGY + '[[constraint]]\nrule = "standard9 glare"\n', "no rule 'standard9'"),
    "no such level": (
        PLAIN + WIDTH + ENERGY + '[[constraint]]\nrule = "en17037 glare"\nlevel = "best"\n',
        "has no 'best'; it has minimum, medium, high",
    ),
    "rule of another command": (
        PLAIN + WIDTH + ENERGY + '[[constraint]]\nrule = "en17037 view_out"\n',
        "`cfs comply` checks it",
    ),
    "limit without a bound": (PLAIN + WIDTH + ENERGY + '[[constraint]]\nname = "glare hours"\n', "`at_most` or"),
    "range and values": (PLAIN + WIDTH + "values = [1]\n" + ENERGY, "give one of `low` and `high`"),
    "range upside down": (PLAIN + WIDTH.replace("0.4", "4.0") + ENERGY, "expected `low` below `high`"),
    "blind without panes": (
        '[[system]]\nname = "a"\nbsdf = "x.xml"\n[system.blind]\n' + WIDTH + ENERGY,
        "blind: needs the panes",
    ),
    "cost of no system": (PLAIN + WIDTH + '[[objective]]\nname = "cost"\n', "cost: is missing of system Glazing"),
    "no such system": (
        PLAIN + '[[variable]]\nkey = "system"\nvalues = ["Blend"]\n' + ENERGY,
        "there is no [[system]] 'Blend'",
    ),
}


@pytest.mark.parametrize(
    "body, words", [one for one in WRONG.values() if one[1]], ids=[k for k in WRONG if WRONG[k][1]]
)
def test_a_wrong_file_is_one_line_that_names_the_key(tmp_path, capsys, body, words):
    path = design_file(tmp_path, body)
    assert run(["design", str(path), "--out", str(tmp_path / "out")]) == 1
    line = capsys.readouterr().err
    assert line.startswith("error: ") and line.count("\n") == 1
    assert words in line
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "variable, words",
    [
        (BOX_KEY.format("widht"), "room.0.box.window.0.widht: no such key; did you mean width?"),
        (
            '[[variable]]\nkey = "rooms.box.width"\nvalues = [1, 2]\n',
            "variable width, rooms.box.width: no such key; did you mean room?",
        ),
        ('[[variable]]\nkey = "operation.loads.cooling"\nvalues = [1, 2]\n', "loads.cooling: no such key"),
        ('[[variable]]\nkey = "system.blind.tilt_deg"\nvalues = [1, 2]\n', "no system has 'system.blind.tilt_deg'"),
        ('[[variable]]\nkey = "system.blind.slat"\nvalues = [1, 2]\n', "no system has 'system.blind.slat'"),
        ('[[variable]]\nkey = "options.rays"\nvalues = [1, 2]\n', "options.rays: no such key"),
    ],
)
def test_a_key_that_there_is_not_is_named_before_the_search(tmp_path, variable, words):
    design = read_design(design_file(tmp_path, PLAIN, variable, ENERGY))
    with pytest.raises(DataError) as caught:
        mattering(design, tmp_path)
    assert words in str(caught.value)


def test_a_building_has_no_box_to_shape(tmp_path):
    room = f'[[room]]\nname = "office"\nbuilding = "{OFFICE}"\n'
    design = read_design(design_file(tmp_path, PLAIN, WIDTH, ENERGY, room=room))
    with pytest.raises(DataError, match=r"room\.box\.window\.width"):
        mattering(design, tmp_path)


def test_values_are_those_of_the_study(tmp_path):
    design = read_design(design_file(tmp_path, PLAIN, WIDTH, COOLING, ENERGY))
    one = candidate(design, (3, 2), tmp_path)
    assert one.study.room[0].box.window[0].width == 0.7
    operation = read_operation(one.study.system[0].operation)
    assert operation.tables.loads.cooling_c == 25.0
    assert operation.tables.loads.heating_c == 20.0  # of the study's own file
    assert one.label == "width 0.7 m, set point 25"
    assert candidate(design, (3, 2), tmp_path, seed=5).study.options.seed == 5


def test_heads_overhangs_and_fins_shape_a_window(tmp_path):
    keys = [
        BOX_KEY.format(name).replace("1.0, 2.0", values)
        for name, values in (("head", "2.2, 2.4"), ("overhang", "0, 0.8"), ("fins", "0, 0.3"))
    ]
    design = read_design(design_file(tmp_path, PLAIN, *keys, ENERGY))
    bare = candidate(design, (0, 0, 0), tmp_path).study.room[0].box
    assert bare.window[0].height == pytest.approx(1.2) and not bare.plate  # sill 1.0
    box = candidate(design, (1, 1, 1), tmp_path).study.room[0].box
    assert box.window[0].height == pytest.approx(1.4)
    assert [(p.start, p.end, p.depth) for p in box.plate] == [
        ((0.5, 2.4), (2.5, 2.4), 0.8),
        ((0.5, 1.0), (0.5, 2.4), 0.3),
        ((2.5, 1.0), (2.5, 2.4), 0.3),
    ]


def test_states_of_a_blind_are_its_panes_and_its_tilts(tmp_path):
    design = read_design(design_file(tmp_path, PLAIN, BLIND, TILT, RULE, ENERGY))
    assert [one.name for one in design.variable] == ["system", "tilt", "rule"]
    one = candidate(design, (1, 0, 1), tmp_path)
    assert one.label == "Blind, tilt 15°, cut-off"
    operation = read_operation(one.study.system[0].operation)
    assert [system.tilt_deg for system in operation.systems] == [None, 15, 30, 75]
    assert operation.tables.control.rule == "cut-off"
    assert operation.tables.control.slat_width == 0.08
    passed = [float(s.visible.direct_hemispherical(s.visible.transmission_front)[0]) for s in operation.systems]
    assert all(np.diff(passed) < 0)
    # a flat slat at 15 degrees, 72 mm apart and 80 mm deep, lets the horizontal beam pass between
    # tilted slats: 1 - 80 sin(15) / 72 of it, times the panes'
    assert passed[1] >= (1 - 80 * np.sin(np.radians(15)) / 72) * passed[0] - 0.01
    lowered = read_operation(candidate(design, (1, 1, 0), tmp_path).study.system[0].operation)
    assert [system.tilt_deg for system in lowered.systems] == [None, 45]
    assert lowered.tables.control.state == 1


def test_what_does_not_matter_to_a_system_makes_no_other_case(tmp_path):
    design = read_design(design_file(tmp_path, PLAIN, BLIND, TILT, RULE, ENERGY))
    every = [candidate(design, (0, tilt, rule), tmp_path) for tilt in (0, 1) for rule in (0, 1)]
    assert {one.label for one in every} == {"Glazing"}
    assert len({one.study.model_dump_json() for one in every}) == 1


def test_a_blind_is_traced_once_and_indoors_it_is_behind_the_panes(tmp_path):
    system = BLIND.replace("paths = 256", 'paths = 256\nposition = "indoors"')
    design = read_design(design_file(tmp_path, system, TILT, ENERGY))
    candidate(design, (0,), tmp_path)
    (file,) = tmp_path.glob("blind-*.xml")
    before = file.stat().st_mtime_ns
    one = candidate(design, (0,), tmp_path)
    assert file.stat().st_mtime_ns == before
    state = read_table(one.study.system[0].operation)["system"][1]
    assert [("slats" in layer) for layer in state["layers"]] == [False, False, True]
    outdoors = read_design(design_file(tmp_path, BLIND, TILT, ENERGY))
    candidate(outdoors, (0,), tmp_path)
    other = next(one for one in tmp_path.glob("blind-*.xml") if one != file)
    glancing = 0.0  # the sun at 60 to 80 degrees meets glass first, or slats first
    for path, sign in ((file, 1), (other, -1)):
        visible = read_system(path).visible
        glancing += sign * visible.direct_hemispherical(visible.reflection_front)[117:133].mean()
    assert glancing > 0.05


def test_points_that_are_one_candidate_are_searched_once(tmp_path):
    design = read_design(design_file(tmp_path, PLAIN, BLIND, TILT, RULE, ENERGY))
    matter = mattering(design, tmp_path)
    assert matter == ({"system"}, {"system", "tilt", "rule"})
    every = {same_candidate(design, matter, (system, t, r)) for system in (0, 1) for t in (0, 1) for r in (0, 1)}
    assert every == {(0, 0, 0), (1, 0, 0), (1, 0, 1), (1, 1, 0), (1, 1, 1)}
    found = []
    surrogate(
        space_of(design),
        lambda points: found.extend(points) or [Outcome((float(sum(p)),)) for p in points],
        20,
        1,
        1,
        lambda point: same_candidate(design, matter, point),
    )
    assert sorted(found) == sorted(every)


def test_systems_of_a_folder_by_a_relative_path_are_found(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    design = read_design(design_file(tmp_path, BLIND, TILT, ENERGY))
    every = Evaluations(design, Store(Path("out"), command="design"), compute=by_formula)
    (one,) = every.assessments(SEARCH_STAGE, [(0,)], quick=True)
    assert not one.error
