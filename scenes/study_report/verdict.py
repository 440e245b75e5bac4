"""The verdict at the head of a study's report: what was asked, what is best and worst, limits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mitsuba_cfs.glare.classes import CLASSES
from scenes.language.catalogue import said
from scenes.report.headline import WARM_C, Card, cards, protection_card
from scenes.report.limits import LimitTables, limits
from scenes.report.numbers import counted, percent, rounded
from scenes.report.verdict import Verdict
from scenes.results import RunResult
from scenes.study.store import CaseResult
from scenes.study.study import StudyResult
from scenes.study_report.case_page import case_label, room_of
from scenes.study_report.comparison import finished, glare_share, warm_share

ENERGIES = ("heating_kwh", "cooling_kwh", "lighting_kwh")


def study_verdict(study: StudyResult) -> Verdict:
    """The verdict of a study with at least one result."""
    cases = study.plan.cases

    def named(values: list[str], what: str) -> str:
        values = list(dict.fromkeys(values))
        return _and(values) if len(values) <= 3 else counted(len(values), what)

    asked = said(
        "Daylight, glare and temperatures of {rooms} in a year of {climates}, compared for "
        "{systems}: {cases}.",
        rooms=named([c.place for c in cases], "room"),
        climates=named([c.climate for c in cases], "climate"),
        systems=named([c.system for c in cases], "system"),
        cases=counted(len(cases), "case"),
    )
    found = (
        (said("Daylight"), _daylight),
        (said("Glare"), _glare),
        (said("Heat and energy"), _heat),
    )
    sentences = tuple((heading, sentence(study)) for heading, sentence in found)
    return Verdict(asked, sentences, _limits(study))


def _and(names: list[str]) -> str:
    if len(names) == 1:
        return names[0]
    return said("{names} and {last}", names=", ".join(names[:-1]), last=names[-1])


def _extremes(
    study: StudyResult, value: Callable[[CaseResult], float]
) -> tuple[tuple[str, float], tuple[str, float]]:
    """Name and value of the case with least and of that with most."""
    found = [(case_label(study, case), value(result)) for _, case, result in finished(study)]
    return min(found, key=lambda one: one[1]), max(found, key=lambda one: one[1])


def _daylight(study: StudyResult) -> str:
    least, most = _extremes(study, lambda result: float(result.figures["da300"]))
    text = said(
        "{case} has 300 lx of daylight in {share} % of the occupied hours, as a mean over the work "
        "plane",
        case=most[0],
        share=percent(most[1]),
    )
    return text + _and_least(least, most)


def _and_least(least: tuple[str, float], most: tuple[str, float]) -> str:
    """The end of a sentence on the case with most: that with least."""
    if least[0] == most[0]:
        return "."
    return said("; {case} in {share} %.", case=least[0], share=percent(least[1]))


def _glare(study: StudyResult) -> str:
    done = [result for _, _, result in finished(study)]
    if any(f"glare_{CLASSES[0]}_h" not in result.figures for result in done):
        return said("Glare was not rated in every case.")
    least, most = _extremes(study, glare_share)
    text = said(
        "{case} has a DGP above 0.40 in {share} % of the occupied hours",
        case=most[0],
        share=percent(most[1]),
    )
    return text + _and_least(least, most)


def _heat(study: StudyResult) -> str:
    """Which case takes least for heat, cold and lamps; how warm the warmest gets."""
    cool, warm = _extremes(study, warm_share)
    text = said(
        "{case} is above {limit} °C in {share} % of the occupied hours",
        case=warm[0],
        limit=f"{WARM_C:.0f}",
        share=percent(warm[1]),
    )
    text += _and_least(cool, warm)
    if any(not set(ENERGIES) <= set(result.figures) for _, _, result in finished(study)):
        return f"{text} {said('Without heating and cooling in every case.')}"
    least, most = _extremes(study, lambda result: sum(result.figures[e] for e in ENERGIES))
    if most[1] <= 0:
        return f"{text} {said('Without heating and cooling.')}"
    text += " " + said(
        "Least heating, cooling and light together: {case} with {energy} kWh a year ({parts})",
        case=least[0],
        energy=rounded(least[1], 0),
        parts=_parts(study, least[0]),
    )
    if least[0] != most[0]:
        text += said(
            "; most: {case} with {energy} kWh ({parts})",
            case=most[0],
            energy=rounded(most[1], 0),
            parts=_parts(study, most[0]),
        )
    added = said("That is heat and cold of the room and power of the lamps, added as they are.")
    return f"{text}. {added}"


def _parts(study: StudyResult, label: str) -> str:
    figures = next(r.figures for _, c, r in finished(study) if case_label(study, c) == label)
    return " + ".join(rounded(float(figures[name]), 0) for name in ENERGIES)


def _limits(study: StudyResult) -> LimitTables:
    """The figures of the cases that a rule limits."""
    rows = []
    for _, case, result in finished(study):
        building, _ = study.plan.rooms[case.scene]
        room = room_of(study, case, result)
        times = room.heat.temperatures.index
        run = RunResult(building, times, np.empty((0, 3)), (room,), (), {})
        own = (*cards(run, room), *_protection(result))
        rows.append((case_label(study, case), room, own))
    return limits(rows, said("Case"))


def _protection(result: CaseResult) -> tuple[Card, ...]:
    """EN 17037's protection from glare as a headline figure."""
    level = result.figures.get("glare_protection")
    return () if level is None else (protection_card(str(level)),)
