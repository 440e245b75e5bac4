"""The explorer of a study: which cases have one, and a click in the report that opens it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from scenes.cli import cfs
from scenes.explore.case_files import CASE, read_data
from scenes.explore.folder import write_rooms
from scenes.study.explored import ExploredCase
from scenes.study.study import StudyResult
from scenes.study_report.page import MOST_EXPLORED, explorable, study_report_html, write_study_explorer
from tests.devtools import Page, chromium
from tests.explore.synthetic import explored_run
from tests.report.test_study_report import study
from tests.scenes.study_files import study_file

TURNED = 90.0
needs_chromium = pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")


def with_explored(*numbers: int) -> StudyResult:
    """The made-up study, as if these cases had been computed for the explorer."""
    made = study(failed=False)
    return replace(made, explored={n: ExploredCase(f"key{n}") for n in numbers})


def test_links_lead_to_the_explorers_that_there_are() -> None:
    page = study_report_html(with_explored(2, 3))
    for number, target in ((1, "#case-1"), (2, "explore/index.html#case-2"), (4, "#case-4")):
        assert f'class="line" href="{target}" data-case="{number}"' in page
    assert page.count('data-explorer="explore/index.html#case-') == 2
    assert page.count("Open this case in the explorer") == 2
    assert "explore/index.html" not in study_report_html(study(failed=False))


def test_the_best_cases_come_first_up_to_the_limit() -> None:
    made = study(systems=MOST_EXPLORED)
    chosen = explorable(made)
    assert len(chosen) == MOST_EXPLORED and list(chosen) == sorted(chosen)
    most = max(made.results, key=lambda r: r.figures.get("da300", 0.0))
    assert made.results.index(most) + 1 in chosen
    options = made.plan.cases[0].options.changed(method="point-in-time")
    paths = replace(made.plan.cases[0], options=options)
    other = replace(made, plan=replace(made.plan, cases=(paths, *made.plan.cases[1:])))
    assert 1 in chosen and 1 not in explorable(other)


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A report of four cases, the last turned, with explorers of the first and the last."""
    folder = tmp_path_factory.mktemp("study")
    made, run = with_explored(), explored_run()
    cases = (*made.plan.cases[:-1], replace(made.plan.cases[-1], orientation_deg=TURNED))
    made = replace(made, plan=replace(made.plan, cases=cases))
    explored = {}
    for number in (1, 4):
        write_rooms(run, folder / "explore" / f"key{number}")
        shown = read_data(folder / "explore" / f"key{number}" / CASE)
        explored[number] = ExploredCase(f"key{number}", {}, shown)
    made = replace(made, explored=explored)
    write_study_explorer(made, folder / "explore")
    (folder / "report.html").write_text(study_report_html(made), encoding="utf-8")
    return folder


@pytest.fixture
def page(folder, tmp_path):
    with Page(tmp_path) as browser:
        browser.open((folder / "report.html").as_uri(), ready="document.readyState === 'complete'")
        yield browser
        assert browser.faults == []
        assert all(r.startswith(("file:", "data:", "about:")) for r in browser.requests)


def _explored(page: Page) -> str:
    """The case that the explorer shows once it is there."""
    page.until("location.pathname.endsWith('/explore/index.html')")
    page.until("document.body?.dataset.ready === 'yes'")
    return page.value("cfs.explorer.panels[0].variant.entry.id")


def _back(page: Page) -> None:
    """To the report again; once the browser has answered, for it leaves the page that it asks."""
    page.value("setTimeout(() => history.back()); 0")
    page.until("location.pathname.endsWith('/report.html') && document.readyState === 'complete'")


@needs_chromium
@pytest.mark.early
def test_a_click_opens_the_case_in_the_explorer(page) -> None:
    """By mouse on a mark of the front, by keys on a line; Back returns; the rest stay sections."""
    page.click("button.dot[data-case='4']")
    assert _explored(page) == "case-4"
    assert page.value("document.querySelector('#one .state').textContent").startswith("4: ")
    sun = page.value("document.getElementById('sun').textContent")
    assert "90°" in page.value("document.querySelector('#one .up').textContent")
    _back(page)
    page.value("document.querySelector('a.line[data-case=\"1\"]').focus()")
    page.press("Enter")
    assert _explored(page) == "case-1"
    assert page.value("document.querySelector('#one .up').textContent") == "north up"
    assert page.value("document.getElementById('sun').textContent") != sun, "the model is turned"
    page.click("#compare")
    page.until("cfs.explorer.found.length === 2")
    _back(page)
    page.value("document.querySelector('button.dot[data-case=\"2\"]').click()")
    assert page.value("location.pathname").endswith("/report.html")
    assert page.value("document.getElementById('case-choice').value") == "2"


@pytest.mark.slow
def test_a_finished_study_gets_its_explorers_and_keeps_them(tmp_path) -> None:
    study, out = study_file(tmp_path, 'methods = ["three-phase"]\n'), tmp_path / "out"

    def ran(*options: str) -> str:
        done = CliRunner().invoke(cfs, ["study", str(study), "--out", str(out), *options])
        assert not done.exit_code, done.output
        return done.output

    ran()
    assert "explore/index.html" not in (out / "report.html").read_text(encoding="utf-8")
    assert "index.html, 1 case" in ran("--explore")
    assert "explore/index.html#case-1" in (out / "report.html").read_text(encoding="utf-8")
    shown = read_data(out / "explore" / CASE)
    assert [entry["id"] for entry in shown["rooms"]] == ["case-1"]
    (room,) = shown["rooms"]
    data = (out / "explore" / room["file"]).parent
    before = {file: file.stat().st_mtime_ns for file in data.iterdir()}
    ran("--explore")
    assert before and {file: file.stat().st_mtime_ns for file in before} == before
