"""A study's cases on a page while they are computed."""

from __future__ import annotations

from collections.abc import Mapping

from scenes.language.catalogue import gettext
from scenes.language.numbers import MISSING, rounded
from scenes.report.names import quantity
from scenes.report.under_way import page_under_way
from scenes.study.plan import StudyPlan
from scenes.study.store import CaseResult
from scenes.study_report.case_page import case_label

SHOWN = {"sda300_50": 0, "da300": 0, "glare_intolerable_h": 0, "operative_max_c": 1}  # digits after the point


def cases_page(plan: StudyPlan, ready: Mapping[str, CaseResult]) -> str:
    """The figures of the cases that are ready, by key; of the others dashes."""
    note = gettext(
        "The figures of each case as soon as it is computed. This page loads itself again every few "
        "seconds and shows the report as soon as the study is complete; if the study is stopped, the "
        "page stays as it is, and the same command continues."
    )
    count = sum(case.key in ready for case in plan.cases)
    done = gettext("Computed: {count} of {all} cases.", count=count, all=len(plan.cases))
    heads = [gettext("Case"), *(quantity(name).with_unit for name in SHOWN)]
    rows = [[case_label(plan, case), *_cells(ready.get(case.key))] for case in plan.cases]
    return page_under_way(gettext("Study under way"), (note, done), heads, rows)


def _cells(result: CaseResult | None) -> list[str]:
    if result is not None and result.error:
        return [result.error] + [""] * (len(SHOWN) - 1)
    figures = {} if result is None else result.figures
    return [rounded(float(figures[name]), n) if name in figures else MISSING for name, n in SHOWN.items()]
