"""`[search] each`: one answer for each orientation, room or climate."""

from __future__ import annotations

import json

import pandas as pd
import pytest

from mitsuba_cfs.errors import DataError
from scenes.design.design import run_design
from scenes.design.design_file import read_design
from scenes.design.each import designs_of, run_each, write_each
from scenes.design.each_page import answers, each_report_html, each_table
from scenes.language.catalogue import in_language
from scenes.page_options import PageOptions
from scenes.study.store import CaseResult, Store
from tests.design.designs import COOLING, ENERGY, PLAIN, SEARCH, WIDTH, by_formula, design_file
from tests.scenes.study_files import BOX

pytestmark = pytest.mark.early

TURNED = "orientations_deg = [0, 90, 180]\n"
EACH = SEARCH + 'each = "{}"\nmethod = "all"\n'
SOME = WIDTH.replace("0.4", "1.0").replace("2.4", "1.6")


def by_sun(case, *, progress=None) -> CaseResult:
    """The formula, with more heat the wider the window is, where it faces the sun."""
    result = by_formula(case)
    result.figures["heating_kwh"] += 40 * case.box.window[0].width * (case.orientation_deg == 180)
    return result


@pytest.fixture
def turned(tmp_path):
    """A design of three orientations with the result of each."""
    design = read_design(design_file(tmp_path, PLAIN, SOME, COOLING, ENERGY, EACH.format("orientation"), head=TURNED))
    return design, run_each(design, tmp_path / "out", compute=by_sun)


def test_each_orientation_has_the_best_of_its_own_cases(turned):
    _, results = turned
    labels = {name: result.best.candidate.label for name, result in results.items()}
    # of 40 (w - 1.2)^2 + 40 w the least is at the narrowest
    assert labels == {"0°": "width 1.2 m, set point 25.5", "90°": "width 1.2 m, set point 25.5"} | {
        "180°": "width 1 m, set point 25.5"
    }
    assert all({case.orientation_deg for case in results[f"{a}°"].study.plan.cases} == {a} for a in (0, 90, 180))


def test_one_answer_for_all_is_another(turned, tmp_path):
    """The best of the mean of the three is the best of none of them by itself."""
    design = read_design(design_file(tmp_path, PLAIN, SOME, COOLING, ENERGY, SEARCH + 'method = "all"\n', head=TURNED))
    result = run_design(design, tmp_path / "mean", compute=by_sun)
    assert result.best.candidate.label == "width 1 m, set point 25.5"  # 40 (w - 1.2)^2 + 40 w / 3
    assert len(result.best.keys) == 3


def test_the_answers_name_where_each_candidate_is_best(turned):
    _, results = turned
    assert answers(results) == (
        "South (0°) and west (90°): width 1.2 m, set point 25.5.",
        "North (180°): width 1 m, set point 25.5.",
    )
    same = {name: results["0°"] for name in ("a", "b")}
    assert answers(same) == ("width 1.2 m, set point 25.5 is best for each: a and b.",)


def test_the_table_has_the_runner_up_and_how_sure(turned):
    design, results = turned
    rows = each_table(design, results).rows
    assert [row[0] for row in rows] == ["south (0°)", "west (90°)", "north (180°)"]
    _, best, energy, limits, second, difference, certainty = rows[0]
    assert (best, energy, limits) == ("width 1.2 m, set point 25.5", "8.3", "–")
    assert second in ("width 1.1 m, set point 25.5", "width 1.3 m, set point 25.5")
    assert difference.startswith("energy demand +0.033 ± ")  # 0.4 / 12 kWh/m2
    assert certainty == "more than twice the standard error"


def test_limits_decide_before_the_noise(tmp_path):
    limit = '[[constraint]]\nname = "warm hours"\nat_most = {}\n'
    parts = (PLAIN, SOME, COOLING, ENERGY, EACH.format("orientation"))
    few = read_design(design_file(tmp_path, *parts, limit.format(60), head=TURNED))
    results = run_each(few, tmp_path / "out", compute=by_sun)
    assert {row[3] for row in each_table(few, results).rows} == {"met"}
    none = read_design(design_file(tmp_path, *parts, limit.format(-1), head=TURNED))
    results = run_each(none, tmp_path / "out", compute=by_sun)
    assert answers(results)[-1] == "No candidate meets every limit for south (0°), west (90°) and north (180°)."
    assert all(row[3].startswith("fails hours above 26 °C (") for row in each_table(none, results).rows)


def test_rooms_and_climates_are_parts_too(tmp_path):
    two = BOX + BOX.replace('"box"', '"other"')
    design = read_design(design_file(tmp_path, PLAIN, SOME, COOLING, ENERGY, EACH.format("room"), room=two))
    assert [list(one.room) for one in designs_of(design).values()] == [[room] for room in design.room]
    assert list(designs_of(design)) == ["box", "other"]
    design = read_design(design_file(tmp_path, PLAIN, SOME, COOLING, ENERGY, EACH.format("climate")))
    assert list(designs_of(design)) == [design.climate[0].name]


def test_the_folder_has_one_table_and_a_page_for_each(turned, tmp_path):
    design, results = turned
    store = Store(tmp_path / "out", inputs=design.files, command="design")
    write_each(
        design,
        results,
        store,
        lambda path: path.write_text(each_report_html(design, results)),
        lambda result: {"report.html": lambda path: path.write_text(result.design.title)},
    )
    table = pd.read_parquet(tmp_path / "out" / "results.parquet")
    assert table.groupby("orientation").size().to_dict() == {name: len(r.rows()) for name, r in results.items()}
    assert set(pd.read_csv(tmp_path / "out" / "front.csv")["orientation_deg"]) == {0, 90, 180}
    page = (tmp_path / "out" / "report.html").read_text()
    for number, name in enumerate(results, 1):
        assert f'href="orientation_{number}/report.html"' in page
        assert (tmp_path / "out" / f"orientation_{number}" / "report.html").read_text().endswith(name)
    record = json.loads((tmp_path / "out" / "design.json").read_text())
    assert record["study"]["search"]["each"] == "orientation" and list(record["answers"]) == list(results)


def test_a_second_run_computes_nothing(turned, tmp_path):
    design, _ = turned

    def none(case, *, progress=None):
        raise AssertionError("computed again")

    again = run_each(design, tmp_path / "out", compute=none)
    assert all(result.reused == result.cases for result in again.values())


def test_the_part_that_cannot_be_computed_is_named(tmp_path):
    def turned_fails(case, *, progress=None):
        if case.orientation_deg == 90:
            raise DataError("cannot be")
        return by_formula(case)

    design = read_design(design_file(tmp_path, PLAIN, SOME, ENERGY, EACH.format("orientation"), head=TURNED))
    with pytest.raises(DataError, match="90°: no candidate can be computed; the first: cannot be"):
        run_each(design, tmp_path / "out", compute=turned_fails)


def test_the_page_is_translated(turned):
    design, results = turned
    with in_language("de"):
        assert answers(results)[0].startswith("Süden (0°) und Westen (90°)")
    assert "Orientierung" in each_report_html(design, results, PageOptions(language="de"))


@pytest.mark.parametrize(
    "part, words",
    [('each = "storey"', "search.each"), ('each = "orientation"', "search.each: orientations_deg is a variable")],
)
def test_a_wrong_each_is_refused(tmp_path, part, words):
    turn = '[[variable]]\nkey = "orientations_deg"\nvalues = [[0], [90]]\n'
    with pytest.raises(DataError, match=words):
        read_design(design_file(tmp_path, PLAIN, turn, ENERGY, SEARCH + part + "\n"))
