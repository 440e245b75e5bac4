"""The verdict: each sentence says what the results hold, in the words of the standards."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.notes import Note
from scenes.head import NO_HEAD
from scenes.language.numbers import percent
from scenes.report.headline import cards
from scenes.report.page import report_html
from scenes.report.verdict import verdict
from tests.report.building_page import building
from tests.report.synthetic import run_result
from thermal.gvalue import thermal_data


@pytest.fixture(scope="module")
def result():
    return run_result(picture_size=64, pictures=2)


def said(result, heading: str) -> str:
    return dict(verdict(result, [cards(result, r) for r in result.spaces]).sentences)[heading]


def _with_glare(result, **changed: float):
    """The run with one picture in its first room, of this glare."""
    room = result.spaces[0]
    picture = room.glare.pictures[0]
    glare = {"dgp": 0.3, "ev": 1000.0, "sources": 2} | changed
    one = replace(room, glare=replace(room.glare, pictures=(replace(picture, glare=glare),)))
    return replace(result, spaces=(one,))


def test_glare_names_its_hour_its_sun_and_its_cause(result) -> None:
    # 5.87e-5 of 5,000 lx are 0.29; the sources add 0.05
    text = said(_with_glare(result, dgp=0.50, ev=5000.0, dgp_standard_error=0.0012), "Glare")
    assert "The picture shows intolerable glare: DGP 0.50 ± 0.001" in text and "solar altitude" in text
    assert "Causes: 5\u202f000 lx at the eye (86 %), 2 bright sources in view (14 %)." in text
    text = said(_with_glare(result, dgp=0.42, ev=1000.0, sources=3), "Glare")
    assert "disturbing" in text and "Causes: 3 bright sources in view (" in text
    text = said(_with_glare(result, dgp=0.30), "Glare")
    assert text.startswith("Glare is imperceptible in all pictures; the highest DGP is 0.30")


def test_a_dgp_at_the_end_of_its_scale_has_no_error_and_a_small_error_no_digits(result) -> None:
    limited = _with_glare(result, dgp=1.0, ev=15000.0, dgp_standard_error=0.0001)
    assert "DGP 1.00 (" in said(limited, "Glare")
    shown = verdict(limited, [cards(limited, room) for room in limited.spaces]).limits.shown
    (row,) = [row for row in shown.rows if row[1] == "Highest glare"]
    assert row[4] == "none: DGP ends at 1"
    small = _with_glare(result, dgp=0.5, ev=5000.0, dgp_standard_error=0.0001)
    assert "DGP 0.50 ± less than 0.001 (" in said(small, "Glare")


def test_warmth_counts_the_hours_of_the_warmest_room(result) -> None:
    text = said(result, "Overheating")
    counts = []
    for room in result.spaces:
        used = room.heat.comfort["occupied"].to_numpy()
        counts.append(int(((room.heat.operative_c.to_numpy() > 26) & used).sum()))
    worst = result.spaces[int(np.argmax(counts))]
    number = f"{max(counts):,}".replace(",", "\u202f")
    words = f"{worst.space.label}: the operative temperature exceeds 26 °C in {number} of "
    assert text.startswith(words)
    room = result.spaces[0]
    cold = room.heat.temperatures.assign(operative_c=20.0)
    one = replace(room, heat=replace(room.heat, temperatures=cold))
    assert said(replace(result, spaces=(one,)), "Overheating").startswith("No occupied hour exceeds 26")


def test_assumed_thermal_values_stand_beside_the_temperatures(result) -> None:
    """The notes are those of the thermal model itself, as a run's head has them."""
    named = []
    for known in ({}, {"u_value": 1.1}, {"u_value": 1.1, "g_normal": 0.6}):
        data = thermal_data([0.47], [0.2], item="Blind", **known)
        head = replace(NO_HEAD, assumed=tuple(Note(one.template, **one.values) for one in data.assumptions))
        named.append("assumed U- or g-values: Blind." in said(replace(result, head=head), "Overheating"))
    assert named == [True, True, False]


def test_of_rooms_warm_in_every_hour_the_hottest_is_named(result) -> None:
    rooms = []
    for room, peak in zip(result.spaces[:2], (33.0, 34.2), strict=True):
        hot = room.heat.temperatures.assign(operative_c=peak)
        rooms.append(replace(room, heat=replace(room.heat, temperatures=hot)))
    text = said(replace(result, spaces=tuple(rooms)), "Overheating")
    assert text.startswith(rooms[1].space.label) and "34.2 °C" in text


def test_shading_says_how_often_and_at_what_cost(result) -> None:
    from tests.explore.synthetic import explored_run

    assert "does not move" in said(replace(result, spaces=result.spaces[:1]), "Shading")
    text = said(result, "Shading")
    assert "the shading is in use in" in text and "--explore" in text
    whole = explored_run(step=400, size=32)
    moved = replace(whole.spaces[0], operation=result.spaces[1].operation)
    text = said(replace(whole, spaces=(moved,)), "Shading")
    first, second = (float(t.split()[-1]) for t in text.split(" %")[1].split(" to ")[0:2])
    assert first > second, "a blind does not bring light"


def test_figures_stand_against_limits_with_their_errors(result) -> None:
    limits = verdict(result, [cards(result, r) for r in result.spaces]).limits
    found = limits.shown
    assert limits.folded is None
    by_figure = {row[1]: row for row in found.rows}
    assert "LM-83" in by_figure["Annual sunlight exposure (LM-83)"][3]
    assert "% of each illuminance" in by_figure["Spatial daylight autonomy (LM-83)"][4]
    assert {row[0] for row in found.rows} == {room.space.label for room in result.spaces}


def test_many_rooms_stay_on_one_page_with_the_worst_of_each_figure() -> None:
    """82 rooms: a row a figure, every room counted once, and the worst room by its own value."""
    run = building(82, picture_size=32, pictures=1)
    every = [cards(run, room) for room in run.spaces]
    found = verdict(run, every)
    shown, folded = found.limits.shown, found.limits.folded
    judged = [(room, card) for room, own in zip(run.spaces, every, strict=True) for card in own if card.verdict]
    assert len(folded.rows) == len(judged) > 250
    labels = list(dict.fromkeys((card.label, card.standard) for _, card in judged))
    assert [row[0] for row in shown.rows] == [f"{label} ({of})" if of else label for label, of in labels]
    for (label, _), (_, meets, worst, _) in zip(labels, shown.rows, strict=True):
        own = [(room, card) for room, card in judged if card.label == label]
        assert sum(int(part.split(":")[0]) for part in meets.split("; ")) == len(own)
        assert worst.count(";") == 1
    sunlight = next(row for row in shown.rows if row[0] == "Annual sunlight exposure (LM-83)")
    most = max(room.daylight.room_metrics["ase1000_250"] for room in run.spaces)
    assert f": {percent(most)} %" in sunlight[2].split(";")[0]
    text = dict(found.sentences)["Shading"]
    assert text.startswith("41 rooms: the shading is in use in ") and len(text) < 400
    page = report_html(run)
    head = page[page.index('<section id="verdict">') : page.index("<details>")]
    assert head.count("<tr>") == 1 + len(labels) and 'href="#rooms"' in head
