"""The page of a design with one answer for each orientation, room or climate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from mitsuba_cfs.files import write_text
from scenes.design.assessment import Assessment
from scenes.design.design import DesignResult
from scenes.design.design_file import Design
from scenes.design.each import folder_of
from scenes.design.page import FILES, differences, equal_within_errors, failures, frame
from scenes.language.catalogue import N_, gettext, in_language
from scenes.language.numbers import cell, inside, listed, significant
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.report import page as run_page
from scenes.report.tables import Column, Table
from scenes.result_folder import REPORT
from scenes.study.study import facing

PARTS = {"orientation": N_("Orientation"), "room": N_("Room"), "climate": N_("Climate")}


@dataclass(frozen=True, slots=True)
class PartLink:
    """The page of one part."""

    name: str
    page: str


def write_each_report(
    design: Design, results: Mapping[str, DesignResult], path: Path, page: PageOptions = OWN_PAGE
) -> None:
    """Write the page of all parts as one self-contained HTML file; each part has its own besides."""
    write_text(path, each_report_html(design, results, page))


def each_report_html(design: Design, results: Mapping[str, DesignResult], page: PageOptions = OWN_PAGE) -> str:
    """The page as text."""
    with in_language(page.language):
        names = _names(results)
        return (
            run_page.environment(FILES)
            .get_template("each.html.j2")
            .render(
                **frame(design, list(results.values()), page),
                answer=answers(results),
                table=each_table(design, results),
                links=[PartLink(name, f"{folder_of(design, number)}/{REPORT}") for number, name in enumerate(names, 1)],
            )
        )


def answers(results: Mapping[str, DesignResult]) -> tuple[str, ...]:
    """Which candidate is best where, in sentences; then where none meets every limit."""
    where: dict[str, list[str]] = {}
    for name, result in zip(_names(results), results.values(), strict=True):
        where.setdefault(result.best.candidate.label, []).append(name)
    if len(where) == 1:
        (label,) = where
        lines = [gettext("{name} is best for each: {places}.", name=label, places=listed(_names(results)))]
    else:
        ordered = sorted(where.items(), key=lambda one: -len(one[1]))
        lines = [gettext("{places}: {name}.", name=label, places=_capital(listed(names))) for label, names in ordered]
    missed = [name for name, result in zip(_names(results), results.values(), strict=True) if not result.best.feasible]
    if missed:
        lines.append(gettext("No candidate meets every limit for {places}.", places=listed(missed)))
    return tuple(lines)


def each_table(design: Design, results: Mapping[str, DesignResult]) -> Table:
    """One row for each part: the best, the runner-up, and how sure the difference is."""
    measures = [one.measure for one in design.objective]
    columns = [Column(gettext(PARTS[design.search.each or "orientation"]), numeric=False, short=True)]
    columns += [Column(gettext("Recommended"), numeric=False)]
    columns += [Column(_capital(gettext(one.label)), one.unit) for one in measures]
    columns += [Column(gettext("Limits"), numeric=False), Column(gettext("Runner-up"), numeric=False)]
    meaning = gettext("That of the runner-up less that of the recommended candidate, and its standard error.")
    columns += [Column(gettext("Difference"), "", meaning, numeric=False)]
    columns += [Column(gettext("Certainty"), numeric=False)]
    rows = []
    for name, result in zip(_names(results), results.values(), strict=True):
        best = result.best
        values = [cell(value, one.digits) for value, one in zip(best.objectives, measures, strict=True)]
        second = result.ranked[1].candidate.label if len(result.ranked) > 1 else "–"
        rows.append((name, best.candidate.label, *values, _limits(best), second, _apart(result), _sure(result)))
    return Table(gettext("The best and the runner-up"), tuple(columns), tuple(rows))


def _limits(one: Assessment) -> str:
    """Whether the limits are met, or which are not."""
    if not one.limits:
        return "–"
    return gettext("fails {failed}", failed=failures(one)) if one.failed else gettext("met")


def _apart(result: DesignResult) -> str:
    """By how much the runner-up is worse or better, of each objective."""
    texts = []
    for one in differences(result):
        sign = "−" if one.difference < 0 else "+"
        unit = f" {one.objective.measure.unit}".rstrip()
        text = f"{sign}{significant(abs(one.difference), 2)} ± {significant(one.error, 2)}{unit}"
        texts.append(f"{inside(gettext(one.objective.measure.label))} {text}")
    return ", ".join(texts) or "–"


def _sure(result: DesignResult) -> str:
    """How sure it is that the best is better than the runner-up."""
    if len(result.ranked) < 2:
        return gettext("no second candidate")
    best, second = result.ranked[:2]
    if best.feasible and second.failed:
        return gettext("the runner-up fails {failed}", failed=failures(second))
    apart = differences(result)
    if not apart:
        return gettext("unknown: computed once")
    if equal_within_errors(apart):
        return gettext("equal within the errors")
    return gettext("more than twice the standard error")


def _names(results: Mapping[str, DesignResult]) -> list[str]:
    """The names of the parts; an orientation with where its largest window faces."""
    return [_named(name, result) for name, result in results.items()]


def _named(name: str, result: DesignResult) -> str:
    plan = result.study.plan
    angles = {case.orientation_deg for case in plan.cases}
    if not name.endswith("°") or len(angles) > 1:
        return name
    sides = {gettext(facing(plan.rooms[case.scene][1], case.orientation_deg)) for case in plan.cases}
    return f"{', '.join(sorted(sides))} ({name})"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
