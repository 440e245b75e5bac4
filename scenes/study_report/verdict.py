"""The verdict at the head of a study's report: the question, best and worst cases, limits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mitsuba_cfs.glare.classes import CLASSES
from scenes.language.catalogue import gettext, ngettext
from scenes.language.numbers import listed, percent, rounded
from scenes.report.headline import WARM_C, Card, cards, protection_card
from scenes.report.names import rooms_counted, systems_counted
from scenes.report.verdict import LimitTables, Verdict, limits
from scenes.results import RunResult
from scenes.study.store import CaseResult
from scenes.study.study import StudyResult
from scenes.study_report.case_page import case_label, room_of
from scenes.study_report.comparison import finished, glare_share, warm_share

ENERGIES = ("heating_kwh", "cooling_kwh", "lighting_kwh")


def study_verdict(study: StudyResult) -> Verdict:
    """The verdict of a study with at least one result."""
    cases = study.plan.cases

    def named(values: list[str], counted: Callable[[int], str]) -> str:
        values = list(dict.fromkeys(values))
        return listed(values) if len(values) <= 3 else counted(len(values))

    question = ngettext(
        "Daylight, glare and temperatures of {count} case; rooms: {rooms}; weather: {climates}; "
        "fenestration: {systems}.",
        "Comparison of daylight, glare and temperatures of {count} cases; rooms: {rooms}; weather: "
        "{climates}; fenestration: {systems}.",
        len(cases),
        rooms=named([c.place for c in cases], rooms_counted),
        climates=named(
            [c.climate for c in cases], lambda n: ngettext("{count} climate", "{count} climates", n)
        ),
        systems=named([c.system for c in cases], systems_counted),
    )
    result = (
        (gettext("Daylight"), _daylight),
        (gettext("Glare"), _glare),
        (gettext("Heat and energy"), _heat),
    )
    sentences = tuple((heading, sentence(study)) for heading, sentence in result)
    return Verdict(question, sentences, _limits(study))


def _extremes(
    study: StudyResult, value: Callable[[CaseResult], float]
) -> tuple[tuple[str, float], tuple[str, float]]:
    """Name and value of the case with least and of that with most."""
    found = [(case_label(study, case), value(result)) for _, case, result in finished(study)]
    return min(found, key=lambda one: one[1]), max(found, key=lambda one: one[1])


def _daylight(study: StudyResult) -> str:
    least, most = _extremes(study, lambda result: float(result.figures["da300"]))
    text = gettext("Share of the occupied hours with 300 lx, mean over the work plane")
    return _highest_and_lowest(text, least, most)


def _highest_and_lowest(text: str, least: tuple[str, float], most: tuple[str, float]) -> str:
    """A quantity [%] with its highest and lowest case, as a sentence."""
    values = {"quantity": text, "case": most[0], "share": percent(most[1])}
    if least[0] == most[0]:
        return gettext("{quantity}: {share} % ({case}).", **values)
    return gettext(
        "{quantity}: highest {share} % ({case}), lowest {lowest} % ({other}).",
        **values,
        other=least[0],
        lowest=percent(least[1]),
    )


def _glare(study: StudyResult) -> str:
    done = [result for _, _, result in finished(study)]
    if any(f"glare_{CLASSES[0]}_h" not in result.figures for result in done):
        return gettext("Glare was not rated in all cases.")
    least, most = _extremes(study, glare_share)
    text = gettext("Share of the occupied hours with a DGP above 0.40")
    return _highest_and_lowest(text, least, most)


def _heat(study: StudyResult) -> str:
    """Overheating, and the cases with the lowest and highest energy demand."""
    cool, warm = _extremes(study, warm_share)
    text = gettext("Share of the occupied hours above {limit} °C", limit=f"{WARM_C:.0f}")
    text = _highest_and_lowest(text, cool, warm)
    if any(not set(ENERGIES) <= set(result.figures) for _, _, result in finished(study)):
        return text + " " + gettext("Not all cases have heating and cooling.")
    least, most = _extremes(study, lambda result: sum(result.figures[e] for e in ENERGIES))
    if most[1] <= 0:
        return text + " " + gettext("Without heating and cooling.")
    values = {"case": least[0], "energy": rounded(least[1], 0), "parts": _parts(study, least[0])}
    energy = (
        gettext(
            "Heating, cooling and lighting energy, unweighted: {energy} kWh a year ({case}; "
            "{parts}).",
            **values,
        )
        if least[0] == most[0]
        else gettext(
            "Heating, cooling and lighting energy, unweighted: lowest {energy} kWh a year ({case}; "
            "{parts}), highest {most} kWh ({other}; {most_parts}).",
            **values,
            other=most[0],
            most=rounded(most[1], 0),
            most_parts=_parts(study, most[0]),
        )
    )
    return f"{text} {energy}"


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
    return limits(rows, gettext("Case"))


def _protection(result: CaseResult) -> tuple[Card, ...]:
    """EN 17037's protection from glare as a headline figure."""
    level = result.figures.get("glare_protection")
    return () if level is None else (protection_card(str(level)),)
