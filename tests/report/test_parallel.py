"""Parallel coordinates of a study: heights by their figures; brushed by mouse and keys."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from scenes.fenestration.systems import FenestrationSystem
from scenes.study.one_case import straight_view
from scenes.study_report.page import parallel, study_report_html
from tests.devtools import Page, chromium
from tests.report.test_study_report import study

WITH_CHROMIUM = pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")


@pytest.fixture(scope="module")
def found():
    """Two rooms with two systems; the third case has no energy."""
    made = study()
    for i, result in enumerate(made.results[:4]):
        kwh = {"heating_kwh": 300.0 * i, "cooling_kwh": 60.0, "lighting_kwh": 30.0}
        result.figures.update(kwh, straight_view_percent=20.0 * i)
    del made.results[2].figures["heating_kwh"]
    return made


def test_better_is_above_on_every_axis(found) -> None:
    plot = parallel(found)
    axes = {axis.name: i for i, axis in enumerate(plot.axes)}
    assert list(axes) == ["Daylight", "Glare", "Comfort", "Energy", "View"]
    at = np.array([line.at for line in plot.lines])
    assert np.all((at >= 0) & (at <= 100) | np.isnan(at))
    assert at[:, axes["View"]] == pytest.approx([0, 20, 40, 60])
    daylight = [r.figures["da300"] for r in found.results[:4]]
    assert at[:, axes["Daylight"]] == pytest.approx(daylight)
    energy = at[:, axes["Energy"]]
    assert energy[0] > energy[1] > energy[3] and np.isnan(energy[2])
    area = found.plan.rooms[found.plan.cases[1].scene][1].floor_area
    axis = plot.axes[axes["Energy"]]
    assert axis.low + (axis.high - axis.low) * energy[1] / 100 == pytest.approx(390 / area)
    assert plot.lines[2].path(plot.axes).count("M") == 2, "broken where a value is missing"


def test_a_figure_that_no_case_has_is_no_axis(found) -> None:
    bare = [
        replace(r, figures={k: v for k, v in r.figures.items() if k != "straight_view_percent"}) for r in found.results
    ]
    names = [axis.name for axis in parallel(replace(found, results=tuple(bare))).axes]
    assert "View" not in names and "Comfort" in names


def test_the_view_is_what_passes_straight_on() -> None:
    """A pane of 0.6, a sheet that scatters all, by window area and by hours of each state."""
    omega = KLEMS_FULL.projected_solid_angles()

    def system(block) -> FenestrationSystem:
        klems = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, transmission_front=block)
        return FenestrationSystem("a system", klems, klems)

    clear = system(np.diag(0.6 / omega))
    sheet = system(np.full((145, 145), 0.5 / np.pi))
    wide, small = WindowRectangle(0.5, 1.0, 2.0, 1.5), WindowRectangle(3.0, 1.0, 1.0, 1.0)
    windows = shoebox(5.0, 4.0, 3.0, windows=(wide, small)).spaces[0].windows
    both = {windows[0].guid: (clear, sheet), windows[1].guid: (clear,)}
    state = np.array([[0, 0], [0, 0], [0, 0], [1, 1]])
    assert straight_view(windows, both, state) == pytest.approx(
        60 * (0.75 * windows[0].area + windows[1].area) / (windows[0].area + windows[1].area)
    )
    assert straight_view(windows, both, state[:0]) == 0.0


@pytest.fixture(scope="module")
def page(found, tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    file = folder / "report.html"
    file.write_text(study_report_html(found), encoding="utf-8")
    with Page(folder) as browser:
        browser.open(file.as_uri(), ready="document.readyState === 'complete'")
        browser.value("document.documentElement.style.scrollBehavior = 'auto'")
        yield browser
        assert browser.faults == []
        assert all(r.startswith(("file:", "data:", "about:")) for r in browser.requests)


def _inside(page: Page) -> list[str]:
    return page.value("[...document.querySelectorAll('a.line:not(.out)')].map((l) => l.dataset.case)")


def _shown(page: Page) -> list[str]:
    return page.value(
        "[...document.querySelectorAll('section.case')].filter((s) => !s.hidden).map((s) => s.dataset.case)"
    )


VIEW = ".axis[data-name=View]"


@WITH_CHROMIUM
def test_a_mouse_brushes_an_axis(page) -> None:
    x, bottom = page.place(VIEW, 0.5, 0.7)
    _, top = page.place(VIEW, 0.5, 0.5)
    page.mouse("mouseMoved", x, bottom)
    page.mouse("mousePressed", x, bottom)
    for share in (0.3, 0.7, 1.0):
        page.mouse("mouseMoved", x, bottom + share * (top - bottom), held=True)
    page.mouse("mouseReleased", x, top)
    assert _inside(page) == ["3"], "of 0, 20, 40 and 60 % one lies between 30 and 50"
    assert page.value("document.querySelector('.within').textContent").startswith("1 of 4 cases")
    assert page.value("document.querySelectorAll('.dot.out').length") == 3
    page.click(VIEW, down=0.2)
    assert _inside(page) == ["1", "2", "3", "4"]
    assert page.value("document.querySelector('.within').hidden")


@WITH_CHROMIUM
def test_keys_brush_an_axis_and_open_a_case(page) -> None:
    page.value(f"document.querySelectorAll('{VIEW} .handle')[1].focus()")
    page.press("PageDown", 5)
    page.press("ArrowDown", 15)
    upper = "document.activeElement.getAttribute('aria-valuetext')"
    assert page.value(upper) == "35 %"
    assert _inside(page) == ["1", "2"]
    page.press("Escape")
    assert page.value(upper) == "100 %" and len(_inside(page)) == 4
    assert page.value("document.querySelectorAll('a.line[tabindex=\"0\"]').length") == 1
    page.value("document.querySelector('a.line[tabindex=\"0\"]').focus()")
    page.press("ArrowDown", 2)
    page.press("Enter")
    assert _shown(page) == ["3"]
    assert page.value("document.activeElement.id") == "case-3"


@WITH_CHROMIUM
def test_a_click_on_a_line_or_on_the_front_opens_the_case(page) -> None:
    path = page.value("document.querySelector(\"a.line[data-case='2'] .seen\").getAttribute('d')")
    (x0, y0), (x1, y1) = (map(float, p) for p in re.findall(r"([\d.]+) ([\d.]+)", path)[-2:])
    page.click(".parallel .plot", (0.3 * x0 + 0.7 * x1) / 1000, (0.3 * y0 + 0.7 * y1) / 1000)
    assert _shown(page) == ["2"]
    page.click("button.dot[data-case='3']")  # its place is the first case's too
    assert _shown(page) == ["3"] and page.value("document.activeElement.id") == "case-3"
