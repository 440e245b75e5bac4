"""The explorer of a study: which cases it holds, and its page beside the report."""

from __future__ import annotations

from pathlib import Path

from scenes.explore.folder import moved_entry, write_joined
from scenes.language.catalogue import in_language
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.result_folder import EXPLORER
from scenes.study.case import Case
from scenes.study.explored import PHASED
from scenes.study.study import StudyResult
from scenes.study_report.case_page import case_label
from scenes.study_report.comparison import finished, pareto_front, scatter

MOST_EXPLORED = 12  # cases in an explorer: some 5 to 15 MB each


def explorable(study: StudyResult) -> dict[int, Case]:
    """The cases that get an explorer, by number from 1: those of the front, then the first others.

    Cases by paths have none; all have a year of as many hours.
    """
    dots = scatter(study).dots
    front = set(pareto_front([(dot.x, dot.y) for dot in dots]))
    best = {dot.number for dot in dots if (dot.x, dot.y) in front}
    phased = [(n, c, r) for n, c, r in finished(study) if c.options.method in PHASED]
    ordered = sorted(phased, key=lambda one: one[0] not in best)
    hours = {len(result.arrays["times"]) for _, _, result in ordered[:1]}
    alike = [(n, case) for n, case, r in ordered if len(r.arrays["times"]) in hours]
    return dict(sorted(alike[:MOST_EXPLORED]))


def explorer_link(study: StudyResult, number: int) -> str:
    """The address of a case's explorer from the report; empty where it has none."""
    return f"{EXPLORER}/index.html#case-{number}" if number in study.explored else ""


def write_study_explorer(study: StudyResult, folder: Path, page: PageOptions = OWN_PAGE) -> None:
    """Write the page of the explored cases, whose data lie in folders of it."""
    folder.mkdir(parents=True, exist_ok=True)
    entries, first = [], next(iter(study.explored.values())).shown
    for number, explored in study.explored.items():
        case = study.plan.cases[number - 1]
        name = f"{number}: {case_label(study, case)}"
        about = {"id": f"case-{number}", "turned": case.orientation_deg % 360.0}
        for entry in explored.shown["rooms"]:
            entries.append(moved_entry(entry, explored.key, name) | about)
    title = study.title or first["title"]
    with in_language(page.language):
        write_joined(first | {"title": title, "rooms": entries}, folder)
