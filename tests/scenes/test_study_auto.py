"""A study whose method is chosen from measured errors and costs."""

from __future__ import annotations

import pytest

from scenes.study.plan import plan_of
from scenes.study.study_file import read_study
from tests.scenes.study_files import BOX, study_file


def test_auto_chooses_for_the_study_and_says_why(tmp_path):
    """Made-up costs and errors: a year of steps leads to the phases, a mirror to paths."""
    from scenes.calibration.costs import HEAT, Calibration
    from scenes.calibration.errors import MeasuredCase, MeasuredErrors, Traits
    from scenes.cost.measure import Cost
    from scenes.study.automatic import settled

    costs = [Cost("three-phase", "DGP", 10.0, 0.0, 0.001), Cost(*HEAT, 1.0, 0.0, 1e-4)]
    costs += [Cost("five-phase", "DGP", 20.0, 30.0, 0.002), Cost("five-phase", "sDGP", 1, 1, 1e-4)]
    costs += [Cost("point-in-time", "DGP", 0.0, 0.0, 5.0)]
    machine = Calibration("m", "now", 96, tuple(costs))
    errors = {"three-phase DGP": 0.2, "five-phase DGP": 0.1, "five-phase sDGP": 0.15, "point-in-time DGP": 0.1}
    case = MeasuredCase("a room", "a blind", Traits(0.0, 1.0, 0.5, 0.0, 0.0, 0.0), errors)
    measured = MeasuredErrors("made up", "today", (case,))
    mirrored = BOX.replace('"box"', '"mirrored"').replace("[room.box]", "specular = true\n[room.box]")
    path = study_file(tmp_path, 'methods = ["auto"]\n' + mirrored)

    def chosen(**auto):
        study = read_study(path, **auto)
        plan = settled(study, plan_of(study), machine, measured)
        return plan, {c.room: (c.options.method, c.glare, c.chosen) for c in plan.cases}

    plan, found = chosen(time_budget="2h", dgp_error="12%")
    assert found["box"][:2] == ("five-phase", "DGP")
    assert found["mirrored"][:2] == ("point-in-time", "DGP") and "mirrors" in found["mirrored"][2]
    for word in ("predicted", "steps", "measured against paths on today", "a blind a room"):
        assert word in found["box"][2]
    steps = {"box": 50 + 0.002 * 3430, "mirrored": 5 * 3430}  # seconds, some 3430 hours
    heat = 2 * (1 + 1e-4 * 4450)
    assert plan.predicted == pytest.approx(sum(steps.values()) + heat, rel=0.02)
    assert chosen(time_budget="60s", dgp_error="20%")[1]["box"][:2] == ("five-phase", "sDGP")
