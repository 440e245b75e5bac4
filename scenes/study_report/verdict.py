"""The verdict at the head of a study's report: the question, best and worst cases, limits."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from mitsuba_cfs.glare.classes import CLASSES
from scenes.language.catalogue import gettext, ngettext
from scenes.language.numbers import listed, percent, rounded
from scenes.report.answer import (
    Judged,
    judged,
    met_cell,
    rooms_answer,
    summary_answer,
    systems_answer,
)
from scenes.report.headline import WARM_C, Card, cards, protection_card
from scenes.report.names import rooms_counted, systems_counted
from scenes.report.tables import Column, Table
from scenes.report.verdict import MOST_ROOMS, Verdict, limits
from scenes.results import RoomYear, RunResult
from scenes.study.plan import Case
from scenes.study.store import CaseResult
from scenes.study.study import StudyResult
from scenes.study_report.case_page import case_label, place_parts, room_of
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
    limited = _limited(study)
    rows = [(case_label(study, case), room, own) for case, room, own, _ in limited]
    return Verdict(
        question,
        _answers(study, limited),
        sentences,
        limits(rows, gettext("Case")),
        systems_by_room(study, limited),
    )


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


Limited = tuple[Case, RoomYear, tuple[Card, ...], CaseResult]


def _limited(study: StudyResult) -> list[Limited]:
    """The headline figures of each case."""
    rows: list[Limited] = []
    for _, case, result in finished(study):
        building, _ = study.plan.rooms[case.scene]
        room = room_of(study, case, result)
        times = room.heat.temperatures.index
        run = RunResult(building, times, np.empty((0, 3)), (room,), (), {})
        rows.append((case, room, (*cards(run, room), *_protection(result)), result))
    return rows


def _answers(study: StudyResult, limited: Sequence[Limited]) -> tuple[tuple[str, str], ...]:
    """Which system meets the limits: for each room, climate, orientation and method."""
    groups: dict[str, list[tuple[Judged, float | None]]] = {}
    for case, _, own, result in limited:
        figures = result.figures
        energy = sum(figures[e] for e in ENERGIES) if set(ENERGIES) <= set(figures) else None
        place = ", ".join(part for part in place_parts(study, case) if part)
        groups.setdefault(place, []).append((judged(case.system, own), energy))
    if all(len(members) == 1 for members in groups.values()):
        text = rooms_answer([replace(m[0][0], name=name) for name, m in groups.items() if name])
        text = text or next(systems_answer(*zip(*m, strict=True)) for m in groups.values())
        return (("", text),) if text else ()
    if len(groups) > MOST_ROOMS:
        text = summary_answer([[case for case, _ in members] for members in groups.values()])
        return (("", text),) if text else ()
    answers = ((name, systems_answer(*zip(*m, strict=True))) for name, m in groups.items())
    return tuple((name, text) for name, text in answers if text)


def systems_by_room(study: StudyResult, limited: Sequence[Limited]) -> Table | None:
    """How many limits each system meets in each room; None for a single room or system."""
    systems = list(dict.fromkeys(case.system for case, *_ in limited))
    cells: dict[str, dict[str, str]] = {}
    for case, _, own, _ in limited:
        place = ", ".join(part for part in place_parts(study, case) if part)
        one = judged(case.system, own)
        cells.setdefault(place, {})[case.system] = met_cell(one)
    if len(systems) < 2 or len(cells) < 2:
        return None
    columns = (Column(gettext("Room"), numeric=False),
               *(Column(name, numeric=False) for name in systems))  # fmt: skip
    rows = tuple((place, *(own.get(s, "") for s in systems)) for place, own in cells.items())
    return Table(gettext("Limits met by room and system"), columns, rows)


def _protection(result: CaseResult) -> tuple[Card, ...]:
    """EN 17037's protection from glare as a headline figure."""
    level = result.figures.get("glare_protection")
    noise = result.figures.get("dgp_standard_error")
    known = None if noise is None else float(noise)
    return () if level is None else (protection_card(str(level), known),)
