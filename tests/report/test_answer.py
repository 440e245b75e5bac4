"""The first sentence of a report: what is met, by which room or system, and what fails."""

from __future__ import annotations

from dataclasses import replace

import pytest

from scenes.language.catalogue import in_language
from scenes.report.answer import judged, limits_counted, met_cell, rooms_answer, summary_answer, systems_answer
from scenes.report.headline import GLARE_OF_PICTURES, GLARE_OF_YEAR, GOOD, POOR, Card, cards
from scenes.report.page import report_html
from scenes.report.verdict import verdict
from scenes.study_report.page import study_verdict
from tests.report.building_page import building
from tests.report.synthetic import run_result
from tests.report.test_study_report import study


def limited(label: str, value: str, unit: str = "", *, met: bool = True) -> Card:
    """A figure with a limit."""
    return Card(label, value, unit, "", "a limit", GOOD if met else POOR)


SDA = limited("Spatial daylight autonomy", "80", "%")
ASE = limited("Annual sunlight exposure", "30", "%", met=False)
GLARE = limited("Protection from glare", "None", met=False)
FREE = Card("Peak temperature", "31", "degC", "")  # no limit: no part of the answer


def test_the_system_that_meets_most_limits_comes_first_with_its_energy() -> None:
    up, controlled = judged("Blind up", [SDA, ASE, GLARE]), judged("Controlled", [SDA, ASE, FREE])
    text = systems_answer([up, controlled], [1845.0, 2259.0])
    assert text == (
        "No system meets all limits. Controlled meets the most, 1 of 2, and fails annual sunlight "
        "exposure (30 %). Blind up fails annual sunlight exposure (30 %) and protection from glare "
        "(none). Controlled needs 2\u202f259 kWh of heating, cooling and lighting a year; the "
        "least is 1\u202f845 kWh (Blind up)."
    )


def test_equal_systems_are_named_together_and_unknown_energy_is_left_out() -> None:
    pair = [judged("A", [SDA]), judged("B", [SDA]), judged("C", [ASE])]
    text = systems_answer(pair, [1.0, None, 3.0])
    assert text.startswith("A and B meet every limit. C fails") and "kWh" not in text


def test_rooms_that_fail_are_named_or_counted() -> None:
    good, bad = judged("R1", [SDA]), judged("R2", [SDA, ASE])
    assert rooms_answer([good, judged("R3", [SDA])]) == ("Every room meets every limit.")
    assert rooms_answer([good, bad]) == ("1 of 2 rooms meet every limit. R2 fails annual sunlight exposure.")
    many = [good, *(judged(f"R{i}", [ASE, *[GLARE] * (i == 4)]) for i in range(5))]
    assert rooms_answer(many).endswith("Not met: Annual sunlight exposure in 5 rooms; Protection from glare in 1 room.")
    assert rooms_answer([judged("R", [FREE])]) == ""
    assert rooms_answer([bad, bad]).startswith("No room meets every limit. R2 fails")


def test_a_picture_counts_in_no_answer() -> None:
    """No standard limits the glare of one picture, whether the year's glare is rated or not."""
    picture = Card("A", "0.70", "DGP", "", "intolerable", POOR, code=GLARE_OF_PICTURES)
    rated = replace(limited("B", "High"), code=GLARE_OF_YEAR)
    assert judged("R", [picture, rated]).failed == ()
    assert judged("R", [picture]).cards == ()


def test_limits_are_named_with_their_standards() -> None:
    ase, rated = replace(ASE, standard="LM-83"), replace(GLARE, standard="EN 17037")
    case = judged("R", [SDA, ase, rated])
    assert "fails annual sunlight exposure (LM-83: 30 %) and protection from glare (EN 17037: none)" in rooms_answer(
        [case]
    )
    assert "R fails annual sunlight exposure (LM-83) and" in rooms_answer([case, judged("S", [SDA])])
    assert limits_counted([case, case]) == (
        "Limits counted: LM-83: annual sunlight exposure; EN 17037: protection from glare."
    )
    assert limits_counted([judged("R", [FREE])]) == ""
    run = run_result(picture_size=32)
    table = verdict(run, [cards(run, room) for room in run.spaces]).limits.shown
    assert {"Annual sunlight exposure (LM-83)", "Protection from glare (EN 17037)"} <= {row[1] for row in table.rows}


def test_many_rooms_count_the_systems_that_meet_everything() -> None:
    groups = [[judged("A", [SDA]), judged("B", [ASE if i else SDA])] for i in range(8)]
    assert summary_answer(groups) == "Every limit is met by A in 8 of 8 rooms; B in 1 of 8 rooms."
    assert met_cell(groups[1][1]) == "0 of 1; fails annual sunlight exposure"


def test_the_page_of_a_run_begins_with_the_answer() -> None:
    run = run_result(picture_size=32, pictures=1)
    found = verdict(run, [cards(run, room) for room in run.spaces])
    (name, text), *rest = found.answers
    assert name == "" and not rest and "meets every limit" in text
    page = report_html(run)
    assert page.index('class="answer"') < page.index(
        "Comparison of" if "Comparison of" in page else "Daylight, glare and temperatures in"
    )


@pytest.mark.parametrize("language", ["de", "fr"])
def test_the_answer_is_translated(language: str) -> None:
    with in_language(language):
        text = systems_answer([judged("A", [ASE]), judged("B", [ASE, GLARE])], [1.0, 2.0])
    assert "No system" not in text and "fails" not in text and "the least" not in text


def test_a_study_answers_for_each_room_and_tables_rooms_by_systems() -> None:
    """Two rooms, two systems: a sentence for each room, never one that mixes them."""
    found = study_verdict(study(failed=False))
    rooms = [name for name, _ in found.answers]
    assert len(rooms) == 2 and all(rooms)
    for _, text in found.answers:
        assert "system <0>" in text or "system <1>" in text
        assert not any(name in text for name in rooms)
    table = found.by_room
    assert table is not None and [row[0] for row in table.rows] == rooms
    assert [column.label for column in table.columns[1:]] == ["system <0>", "system <1>"]


def test_many_rooms_of_a_run_stay_one_sentence() -> None:
    run = building(82, picture_size=32, pictures=1)
    (_, text), *rest = verdict(run, [cards(run, room) for room in run.spaces]).answers
    assert not rest and "every limit" in text and len(text) < 400
