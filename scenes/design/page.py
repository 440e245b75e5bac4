"""The page of a design: it begins with the recommended candidate, and says how sure that is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from mitsuba_cfs.files import write_text
from scenes.design.assessment import Assessment, LimitValue
from scenes.design.candidates import value_of
from scenes.design.design import FRONT, DesignResult
from scenes.design.design_file import Design, ObjectiveTable, VariableTable
from scenes.design.measures import Limit
from scenes.figures.scale import Tick, axis_ticks, round_limits
from scenes.language.catalogue import decimal, gettext, in_language, ngettext
from scenes.language.numbers import cell, colon, inside, listed, rounded, semicolons, significant
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.report import page as run_page
from scenes.report.page_files import page_files
from scenes.report.tables import Column, Table
from scenes.study_report.page import FILES as STUDY_FILES
from scenes.study_report.page import inputs_table, write_study_report

FILES = page_files("scenes.design")
SURE = 2.0  # standard errors of a difference from which on it is no noise
MOST_OTHERS = 4  # systems that are named beside the best


def write_design_report(result: DesignResult, path: Path, page: PageOptions = OWN_PAGE) -> None:
    """Write the page of a design as one self-contained HTML file."""
    write_text(path, design_report_html(result, page))


def write_front_report(result: DesignResult, path: Path, page: PageOptions = OWN_PAGE) -> None:
    """Write the page of the cases that were computed in full, as of a study."""
    write_study_report(result.study, path, page)


def design_report_html(result: DesignResult, page: PageOptions = OWN_PAGE) -> str:
    """The page as text: no script, font or picture is fetched from anywhere."""
    design = result.design
    with in_language(page.language):
        return (
            run_page.environment(FILES)
            .get_template("design.html.j2")
            .render(
                **frame(design, [result], page),
                answer=answer(result),
                certainty=certainty(result),
                charts=trade_offs(result),
                front=front_table(result),
                variables=_variables(result),
                searched=_searched(result),
                head=run_page.head_lines(result.of_best.head, result.of_best.notes),
                inputs=inputs_table(result.of_best),
                cases=FRONT,
            )
        )


def frame(design: Design, results: Sequence[DesignResult], page: PageOptions) -> dict[str, Any]:
    """What a template has of every page of designs: title, facts, style and scripts."""
    styles = run_page.FILES["style.css"], STUDY_FILES["study.css"], FILES["design.css"]
    return {
        "page": page,
        "title": page.title or design.title or gettext("Design of a fenestration system"),
        "facts": _facts(design, results) + page.facts,
        "version": metadata.version("mitsuba-cfs"),
        "style": Markup("\n".join(styles)),
        "scripts": Markup("\n".join(run_page.FILES[name] for name in run_page.SCRIPTS)),
    }


def answer(result: DesignResult) -> tuple[str, ...]:
    """The recommendation in sentences: the best, what the others fail, the runner-up."""
    best, design = result.best, result.design
    first = {"name": best.candidate.label, "values": _objectives(design, best)}
    if best.feasible:
        text = (
            gettext("{name} meets every limit: {values}.", **first)
            if best.limits
            else gettext("{name} is best: {values}.", **first)
        )
    else:
        text = gettext(
            "No candidate meets every limit. {name} comes nearest ({values}) and fails {failed}.",
            **first,
            failed=failures(best),
        )
    sentences = [text]
    others = _best_of_others(result)
    parts = [
        gettext("{name} fails {failed}", name=one.candidate.label, failed=failures(one)) for one in others if one.failed
    ]
    if parts:
        sentences.append(semicolons(parts) + ".")
    return tuple(sentences)


def _best_of_others(result: DesignResult) -> list[Assessment]:
    """The best candidate of each of the other systems."""
    first: dict[str, Assessment] = {}
    for one in result.ranked:
        if one.candidate.system is not None:
            first.setdefault(one.candidate.system.name, one)
    return [one for one in first.values() if one is not result.best][:MOST_OTHERS]


def certainty(result: DesignResult) -> tuple[str, ...]:
    """The runner-up, and how its differences from the best compare with the errors."""
    if len(result.ranked) < 2:
        return (gettext("There is no second candidate."),)
    best, second, design = *result.ranked[:2], result.design
    lines = [gettext("Second is {name}: {values}.", name=second.candidate.label, values=_objectives(design, second))]
    if second.failed:
        lines.append(gettext("{name} fails {failed}", name=second.candidate.label, failed=failures(second)) + ".")
    if not all(result.errors[:2]):
        lines.append(gettext("The errors of the two are unknown: they were computed once."))
        return tuple(lines)
    apart = differences(result)
    for one in apart:
        words = {
            "measure": inside(gettext(one.objective.measure.label)),
            "difference": f"{significant(abs(one.difference), 2)} {one.objective.measure.unit}".strip(),
            "error": f"{significant(one.error, 2)} {one.objective.measure.unit}".strip(),
        }
        if one.none:
            lines.append(gettext("Both have the same {measure}.", measure=words["measure"]))
            continue
        text = (
            gettext("In {measure} they differ by {difference}, more than twice its standard error ({error}).", **words)
            if one.sure
            else gettext(
                "In {measure} they differ by {difference}, which is within twice its standard error ({error}).", **words
            )
        )
        lines.append(text)
    if equal_within_errors(apart):
        lines.append(gettext("The two are equal within these errors: more rays, or another reason, must decide."))
    count = result.design.search.repeats + 1
    lines.append(
        gettext(
            "Standard errors are those of ray tracing (the two were computed {times} times, with different seeds); "
            "those of the inputs are not in them.",
            times=count,
        )
    )
    close = [one for one in best.limits if one.met and _room(one) < 0.05]
    if close:
        names = listed([one.limit.label for one in close])
        lines.append(gettext("The best meets these limits by less than 5 %: {names}.", names=names))
    return tuple(lines)


@dataclass(frozen=True, slots=True)
class Difference:
    """An objective of the runner-up less that of the best."""

    objective: ObjectiveTable
    difference: float
    error: float  # standard error

    @property
    def none(self) -> bool:
        """Whether both are the same without any noise."""
        return self.difference == 0 and self.error == 0

    @property
    def sure(self) -> bool:
        """Whether the difference is more than noise."""
        return abs(self.difference) > SURE * self.error


def differences(result: DesignResult) -> tuple[Difference, ...]:
    """The runner-up less the best by objective; none where there is one candidate, or their errors are unknown."""
    if len(result.ranked) < 2 or not all(result.errors[:2]):
        return ()
    values = zip(*(one.objectives for one in result.ranked[:2]), *result.errors[:2], strict=True)
    return tuple(
        Difference(objective, second - best, float(np.hypot(*errors)))
        for objective, (best, second, *errors) in zip(result.design.objective, values, strict=True)
    )


def equal_within_errors(every: Sequence[Difference]) -> bool:
    """Whether two candidates differ in no objective by more than noise."""
    known = [one for one in every if not one.none]
    return bool(known) and not any(one.sure for one in known)


@dataclass(frozen=True, slots=True)
class Mark:
    """A candidate in a chart."""

    x: float  # [%] of the axis
    y: float
    kind: str  # best, met, missed; or searched, without a case
    words: str
    case: int  # from 1; 0: none


@dataclass(frozen=True, slots=True)
class TradeOff:
    """Two measures of all candidates; the better end is to the left and below."""

    title: str
    x_label: str
    y_label: str
    x_ticks: tuple[Tick, ...]
    y_ticks: tuple[Tick, ...]
    marks: tuple[Mark, ...]


def trade_offs(result: DesignResult) -> tuple[TradeOff, ...]:
    """Charts of the first objective with each other one, or with the limits where it is alone."""
    others = len(result.design.objective) - 1
    count = others or len(result.best.limits)
    return tuple(_chart(result, number, limit=not others) for number in range(1, count + 1))


def _chart(result: DesignResult, number: int, *, limit: bool = False) -> TradeOff:
    design = result.design
    x_name = _axis_of(design.objective[0])

    def at(one: Assessment) -> tuple[float, float]:
        return one.objectives[0], one.limits[number - 1].value if limit else one.objectives[number]

    if limit:
        of = result.best.limits[number - 1].limit
        y_name = _axis_words(gettext(of.label), of.unit)
    else:
        y_name = _axis_of(design.objective[number])
    done = [one for one in result.searched if not one.error]
    every = [at(one) for one in (*done, *result.ranked)]
    (x0, x1), (y0, y1) = (round_limits(list(values)) for values in zip(*every, strict=True))
    marks = []
    full = {one.candidate.point for one in result.ranked}
    for one in [*(one for one in done if one.candidate.point not in full), *reversed(result.ranked)]:
        x, y = at(one)
        case = _case_number(result, one)
        kind = "searched" if not case else "best" if one is result.best else "met" if one.feasible else "missed"
        words = colon(one.candidate.label, _objectives(design, one))
        if one.failed:
            words += ". " + gettext("Fails {failed}", failed=failures(one))
        marks.append(Mark(100 * (x - x0) / (x1 - x0), 100 * (y - y0) / (y1 - y0), kind, words, case))
    title = f"{gettext(design.objective[0].measure.label)} / {y_name.partition(' [')[0]}"
    return TradeOff(title, x_name, y_name, axis_ticks(x0, x1), axis_ticks(y0, y1), tuple(marks))


def front_table(result: DesignResult) -> Table:
    """The candidates that were computed in full, best first."""
    design = result.design
    limits = result.best.limits
    columns = (
        Column(gettext("Rank")),
        Column(gettext("Candidate"), numeric=False),
        Column(gettext("On the front"), numeric=False, short=True),
        *(Column(_axis_words(gettext(o.measure.label), ""), o.measure.unit) for o in design.objective),
        *(Column(_axis_words(f"{gettext(one.limit.label)}, {_bound(one.limit)}", "")) for one in limits),
        Column(gettext("Limits"), numeric=False, short=True),
        Column(gettext("Case")),
    )
    rows = []
    for rank, one in enumerate(result.ranked, 1):
        values = (cell(v, o.measure.digits) for v, o in zip(one.objectives, design.objective, strict=True))
        limited = (cell(lv.value, lv.limit.digits) for lv in one.limits)
        met = len(one.limits) - len(one.failed)
        count = gettext("{met} of {limits}", met=met, limits=len(one.limits)) if one.limits else "–"
        front = gettext("yes") if one in result.front else gettext("no")
        case = str(_case_number(result, one))
        rows.append((str(rank), one.candidate.label, front, *values, *limited, count, case))
    return Table(gettext("Candidates computed in full"), columns, tuple(rows))


def _variables(result: DesignResult) -> Table:
    """What varied, and the value of the best."""
    columns = (
        Column(gettext("Variable"), numeric=False),
        Column(gettext("Values"), numeric=False),
        Column(gettext("Recommended"), numeric=False),
    )
    best = dict(result.best.candidate.values)
    rows = [(one.name, _range(one), best.get(one.name, "–")) for one in result.design.variable]
    return Table(gettext("Variables"), columns, tuple(rows))


def _range(variable: VariableTable) -> str:
    if variable.step is not None or not variable.options:
        text = gettext("{low} to {high}", low=f"{variable.low:g}", high=f"{variable.high:g}")
        return (
            text
            if variable.step is None
            else gettext("{range} in steps of {step}", range=text, step=f"{variable.step:g}")
        )
    names = (str(value_of(variable, number)) for number in range(len(variable.options)))
    return ", ".join(Path(name).stem if Path(name).is_absolute() else name for name in names)


def _searched(result: DesignResult) -> tuple[str, ...]:
    """How the candidates were found, in sentences."""
    asked = result.design.search
    methods = {
        "surrogate": gettext("expected improvement of a Gaussian process, limits by their probability"),
        "NSGA-II": "NSGA-II",
        "random": gettext("random points"),
        "all": gettext("every point"),
    }
    failed = sum(bool(one.error) for one in result.searched)
    lines = [
        gettext(
            "Candidates computed in the search: {count} ({method}; seed {seed}).",
            count=len(result.searched),
            method=methods[asked.method],
            seed=asked.seed,
        ),
        gettext("The search used the study's own method.")
        if not asked.quick
        else gettext(
            "The search used the three-phase method with few rays and sDGP; the {number} best, and the best of each "
            "system, were computed again by the study's own method. All figures in the answer are of the latter.",
            number=asked.front,
        ),
        gettext(
            "Best is, of the candidates that meet every limit and that no other surpasses in every objective, the one "
            "with the least weighted sum of the shares by which objectives are worse than the best of the front."
        ),
    ]
    if failed:
        lines.append(
            ngettext(
                "{count} candidate could not be computed: {error}",
                "{count} candidates could not be computed, the first: {error}",
                failed,
                error=result.first_error,
            )
        )
    return tuple(lines)


def _facts(design: Design, results: Sequence[DesignResult]) -> tuple[tuple[str, str], ...]:
    names = [gettext(one.measure.label) for one in design.objective]
    searched, full = sum(len(one.searched) for one in results), sum(len(one.ranked) for one in results)
    return (
        (gettext("Variables"), str(len(design.variable))),
        (gettext("Objectives"), ", ".join(inside(name) for name in names)),
        (gettext("Candidates"), gettext("{searched}, of which {full} in full", searched=searched, full=full)),
        (gettext("Cases"), str(sum(one.cases for one in results))),
        (gettext("Computing time"), f"{rounded(sum(one.seconds for one in results), 0)} s"),
    )


def _case_number(result: DesignResult, one: Assessment) -> int:
    """The first case of a candidate in the page of cases, from 1; 0 where it was not computed in full."""
    keys = [case.key for case in result.study.plan.cases]
    return 1 + keys.index(one.keys[0]) if one.keys and one.keys[0] in keys else 0


def _objectives(design: Design, one: Assessment) -> str:
    pairs = zip(design.objective, one.objectives, strict=True)
    return ", ".join(f"{inside(gettext(o.measure.label))} {_with_unit(value, o)}" for o, value in pairs)


def _with_unit(value: float, objective: ObjectiveTable) -> str:
    measure = objective.measure
    return f"{rounded(value, measure.digits)} {measure.unit}".strip()


def failures(one: Assessment) -> str:
    """The limits that a candidate does not meet, in words."""
    return ", ".join(_failure(limited) for limited in one.failed)


def _failure(limited: LimitValue) -> str:
    """A limit that is missed, with the value; where it is worst, if there are several cases."""
    limit = limited.limit
    values = {
        "name": inside(gettext(limit.label)),
        "value": f"{rounded(limited.value, limit.digits)} {limit.unit}".strip(),
        "bound": _bound(limit),
        "place": limited.place,
    }
    if limited.place:
        return gettext("{name} ({value} in {place}, {bound})", **values)
    return gettext("{name} ({value}, {bound})", **values)


def _bound(limit: Limit) -> str:
    """The bound of a limit in words."""
    bound = limit.at_least if limit.at_most is None else limit.at_most
    text = f"{decimal(f'{bound:g}')} {limit.unit}".strip()
    return gettext("at least {bound}", bound=text) if limit.at_most is None else gettext("at most {bound}", bound=text)


def _axis_of(objective: ObjectiveTable) -> str:
    name = _axis_words(gettext(objective.measure.label), objective.measure.unit)
    better = gettext("less is better") if objective.sign > 0 else gettext("more is better")
    return f"{name}, {better}"


def _axis_words(name: str, unit: str) -> str:
    name = name[:1].upper() + name[1:]
    return f"{name} [{unit}]" if unit else name


def _room(one: LimitValue) -> float:
    """What is left up to a limit, as a share of it."""
    bound = one.limit.at_least if one.limit.at_most is None else one.limit.at_most
    return abs(one.limit.excess(one.value)) / max(abs(bound or 0.0), 1e-9)
