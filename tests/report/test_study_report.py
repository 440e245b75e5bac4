"""The report of a study: self-contained, complete, and used in headless Chromium."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bim.report.issue import Issue
from scenes.input_options import InputOptions
from scenes.language.numbers import percent
from scenes.report.daylight_figures import plans
from scenes.study.one_case import glare_figures, room_figures
from scenes.study.plan import Case, InputFile, StudyPlan
from scenes.study.store import CaseResult
from scenes.study.study import StudyResult
from scenes.study_report.comparison import finished, glare_share, pareto_front
from scenes.study_report.page import study_report_html, study_verdict
from tests.report.browser import chromium, inspect
from tests.report.synthetic import run_result

USE = """
    const shown = () => [...document.querySelectorAll("section.case")]
      .filter((s) => !s.hidden).map((s) => s.dataset.case);
    report.shown = [shown()];
    document.querySelector("button.dot[data-case='3']").click();
    report.shown.push(shown());
    choose("case-choice", "2");
    report.shown.push(shown());
    click("case-next");
    report.shown.push(shown());
    const beside = document.querySelector("select.beside");
    beside.value = "1";
    beside.dispatchEvent(new Event("change"));
    report.shown.push(shown());
    const tops = [...document.querySelectorAll("section.case:not([hidden])")].map((s) => box(s));
    report.sideways = tops[0].right <= tops[1].left;
    click("case-back");
    click("case-next");
    report.pressed = [...document.querySelectorAll("button.dot[aria-pressed='true']")]
      .map((d) => d.dataset.case);
    const pictures = [await later(() => {})];
    pictures.push(await later(() => choose("viewer-layer", "3")));
    pictures.push(await later(() => choose("viewer-room", "1")));
    pictures.push(await later(() => click("viewer-top")));
    report.scenes = new Set(pictures).size;
    report.scalesShown = [...document.querySelectorAll("#viewer-scales > div")]
      .findIndex((e) => !e.hidden);
    const table = document.querySelector("[data-table='All cases'] table");
    const headings = [...table.tHead.rows[0].cells];
    const column = headings.findIndex((c) => c.textContent.includes("DA 300"));
    headings[column].click();
    report.column = [...table.tBodies[0].rows].map((r) => Number(r.cells[column].textContent));
"""


class AnyWeather:
    """Eight thousand hours, as far as the figures of glare ask."""

    times, step_h = range(8760), 1.0
    midpoints = pd.date_range("2023-01-01 00:30", periods=8760, freq="h")


NOWHERE = InputOptions(Path("nowhere"), Path("nowhere"), Path("nowhere"))


def study(systems: int = 2, failed: bool = True) -> StudyResult:
    """Two rooms with some systems, from the made-up run; one case without a result."""
    run = run_result(picture_size=48, pictures=1)
    cases, results, rooms = [], [], {}
    for room in run.spaces:
        for number in range(systems):
            case = Case(
                room="house.ifc",
                space_name=room.space.name,
                system=f"system <{number}>",
                climate="Lyon",
                inputs=replace(NOWHERE, spaces=(room.space.guid,)),
                box=None,
                files=(InputFile("building", NOWHERE.building, "0"),),
                specular=False,
                orientation_deg=0.0,
                options=OPTIONS,
                program="",
                glare="DGP",
            )
            heat = room.heat
            dim = replace(room.daylight, room_metrics=room.daylight.room_metrics | {"da300": 70.0 - 9 * number})
            figures, arrays = room_figures(replace(room, heat=heat, daylight=dim))
            used = arrays["comfort/occupied"]
            dgp = 0.3 + 0.2 * np.random.default_rng(number).random(int(used.sum()))
            figures |= glare_figures(dgp, AnyWeather(), (8, 18)) | {"seconds": 1.0 + number}
            arrays["dgp"] = np.where(used, 0.0, np.nan).astype(np.float32)
            arrays["dgp"][used] = dgp
            rooms[case.scene] = run.building, room.space
            cases.append(case)
            results.append(CaseResult(case.key, figures, arrays))
    if failed:
        cases.append(replace(cases[-1], system="broken"))
        results.append(CaseResult(cases[-1].key, error="broken.xml: has <no> band"))
    return StudyResult("Blinds & shades", StudyPlan(tuple(cases), rooms), tuple(results), 1, 12.0)


def options():
    """The options of a room, without which no case is."""
    from scenes.room.options import RoomOptions

    return RoomOptions(method="five-phase")


OPTIONS = options()


@pytest.fixture(scope="module")
def page() -> str:
    return study_report_html(study())


def test_nothing_is_fetched_and_all_is_escaped(page):
    assert not re.findall(r"""(?:src|href)=["'](?!data:|#)""", page)
    visible = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    assert "system &lt;0&gt;" in visible and "system <0>" not in visible
    assert "Blinds &amp; shades" in page


def test_all_that_a_reader_asks_for_is_there(page):
    for words in (
        "Daylight and glare",
        "Glare classes of the occupied hours",
        "Glare through the year",
        "Adaptive comfort",
        "Temperature duration",
        "Relative standard error",
        "five-phase, DGP",
        "broken.xml: has &lt;no&gt; band",
        "2 faces have no construction",
        "UDI 300",
    ):
        assert words in page, words
    assert page.count('<section class="case"') == 4 and len(page) < 5e6


def test_issues_of_the_building_are_those_of_its_file():
    found = study()
    assert Issue in {type(p) for p in found.issues}
    assert len(found.issues) == len(set(found.issues))


def test_few_cases_stand_side_by_side_at_once():
    assert 'class="beside" data-first="2"' in study_report_html(study(systems=1, failed=False))
    assert 'class="beside" data-first=""' in study_report_html(study())


def test_cases_share_their_scales():
    """A room with ten times the light of its twin: both plans reach to the brighter one's light."""
    dim = run_result(picture_size=48, pictures=1).spaces[0]
    light = dim.daylight
    metrics = light.sensor_metrics.assign(daylight_factor=10 * light.sensor_metrics.daylight_factor)
    light = replace(light, illuminance=10 * light.illuminance, sensor_metrics=metrics)
    bright = replace(dim, daylight=light)
    alone, shared, other = plans(dim), plans(dim, (dim, bright)), plans(bright, (dim, bright))
    for title in ("Daylight factor", "Annual mean illuminance"):
        first, second, third = (next(p.scale.high for p in some if p.title == title) for some in (alone, shared, other))
        assert first < second == third, title


def test_the_front_is_what_no_other_case_beats():
    points = [tuple(p) for p in np.random.default_rng(3).integers(0, 12, (40, 2)).astype(float)]

    def beaten(p):
        return any(q[0] >= p[0] and q[1] <= p[1] and q != p for q in points)

    assert set(pareto_front(points)) == {p for p in points if not beaten(p)}


def test_the_verdict_names_best_and_worst():
    found = study()
    said = dict(study_verdict(found).sentences)
    glare = {c.system: glare_share(r) for _, c, r in finished(found)}
    assert max(glare.values()) > min(glare.values())
    assert f"above 0.40: {percent(max(glare.values()))} % in all cases." in said["Glare"]  # to the percent
    assert "highest 70 % (house.ifc 101, system <0>)" in said["Daylight"]
    assert "lowest 61 % (house.ifc 101, system <1>)" in said["Daylight"]
    assert "Not all cases have heating and cooling." in said["Heat and energy"]


def test_the_verdict_of_equal_cases_names_none():
    found = study(failed=False)
    done = [result for _, _, result in finished(found)]
    for i, result in enumerate(done):
        result.figures.update(da300=70.0 + 0.001 * i)
        for name in [one for one in result.figures if one.startswith("glare_") or one.endswith("_kwh")]:
            del result.figures[name]
    said = dict(study_verdict(found).sentences)
    assert said["Daylight"].endswith("70 % in all cases.")
    assert said["Glare"] == "Glare was not rated."
    assert said["Heat and energy"].endswith("Without heating and cooling.")


@pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")
@pytest.mark.parametrize("width", [1400, 375], ids=["wide", "phone"])
def test_page_works_in_a_browser(page, tmp_path, width):
    found = inspect(page, tmp_path, width=width, use=USE)
    assert found["faults"] == []
    assert found["scroll"] <= found["width"], "the page scrolls sideways"
    assert found["overlaps"] == [] and found["clipped"] == []
    sizes = {name: size for name, *size in found["figures"] if size and size[0][0]}
    for name in ("Daylight and glare", "DA 300", "Glare through the year", "3D model"):
        assert all(w >= 100 and h >= 90 for w, h in sizes[name]), (name, sizes.get(name))
    assert found["shown"] == [["1"], ["3"], ["2"], ["3"], ["1", "3"]] and found["pressed"] == ["3"]
    assert found["sideways"] == (width > 1000), "cases stand beside each other where there is room"
    assert found["scenes"] == 4, "a control of the 3D view changed nothing"
    assert found["scalesShown"] == 3
    assert found["column"] == sorted(found["column"]) and len(found["column"]) == 4
