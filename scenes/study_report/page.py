"""The page of a study: its template filled with figures and tables.

The verdict at its head names the question, the best and worst cases, and the limits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from bim.model import Building, Space
from mitsuba_cfs.files import write_text
from mitsuba_cfs.glare.classes import CLASSES
from scenes.explore.folder import moved_entry, write_joined
from scenes.figures.scale import ColourScale, Tick, axis_ticks, round_limits
from scenes.language.catalogue import N_, decimal, gettext, in_language, ngettext
from scenes.language.numbers import colon, listed, percent, rounded, share
from scenes.page_options import OWN_PAGE, PageOptions
from scenes.quick import NOTE
from scenes.report import page as run_page
from scenes.report import tables
from scenes.report.answer import Judged, judged, limits_counted, met_cell, rooms_answer, summary_answer, systems_answer
from scenes.report.headline import WARM_C, Card, cards, protection_card
from scenes.report.method import METHODS
from scenes.report.model3d import ColourLayer, Model3D, colour_bytes, model3d
from scenes.report.names import glossary, quantity, rooms_counted, systems_counted
from scenes.report.page_files import page_files
from scenes.report.tables import Column, Table
from scenes.report.verdict import MOST_ROOMS, Verdict, assumed_thermal, limits
from scenes.result_folder import EXPLORER
from scenes.results import RoomYear, RunResult
from scenes.study.explored import PHASED
from scenes.study.plan import Case
from scenes.study.store import CaseResult
from scenes.study.study import StudyResult
from scenes.study_report.case_page import case_label, case_page, place_parts, room_of
from scenes.study_report.comparison import (
    bars,
    clock_table,
    comparison_table,
    failures_table,
    finished,
    glare_share,
    pareto_front,
    scatter,
    system_looks,
    warm_share,
)

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
        climates=named([c.climate for c in cases], lambda n: ngettext("{count} climate", "{count} climates", n)),
        systems=named([c.system for c in cases], systems_counted),
    )
    result = (
        (gettext("Daylight"), _daylight),
        (gettext("Glare"), _glare_sentence),
        (gettext("Heat and energy"), _heat),
    )
    sentences = tuple((heading, sentence(study)) for heading, sentence in result)
    if assumed := assumed_thermal(study.head.assumed):
        sentences = (*sentences[:-1], (sentences[-1][0], f"{sentences[-1][1]} {assumed}"))
    limited = _limited(study)
    rows = [(case_label(study.plan, case), room, own) for case, room, own, _ in limited]
    return Verdict(
        question, _answers(study, limited), sentences, limits(rows, gettext("Case")), systems_by_room(study, limited)
    )


def _extremes(study: StudyResult, value: Callable[[CaseResult], float]) -> tuple[tuple[str, float], tuple[str, float]]:
    """Name and value of the case with least and of that with most."""
    values = [(case_label(study.plan, case), value(result)) for _, case, result in finished(study)]
    return min(values, key=lambda one: one[1]), max(values, key=lambda one: one[1])


def _daylight(study: StudyResult) -> str:
    least, most = _extremes(study, lambda result: float(result.figures["da300"]))
    text = gettext("Share of the occupied hours with 300 lx, mean over the work plane")
    return _highest_and_lowest(text, least, most)


def _highest_and_lowest(text: str, least: tuple[str, float], most: tuple[str, float]) -> str:
    """A quantity [%] with its highest and lowest case, as a sentence."""
    values = {"quantity": text, "case": most[0], "share": percent(most[1])}
    if least[0] == most[0]:
        return gettext("{quantity}: {share} % ({case}).", **values)
    if percent(least[1]) == percent(most[1]):
        return gettext("{quantity}: {share} % in all cases.", quantity=text, share=percent(most[1]))
    return gettext(
        "{quantity}: highest {share} % ({case}), lowest {lowest} % ({other}).",
        **values,
        other=least[0],
        lowest=percent(least[1]),
    )


def _glare_sentence(study: StudyResult) -> str:
    done = [result for _, _, result in finished(study)]
    rated = [f"glare_{CLASSES[0]}_h" in result.figures for result in done]
    if not any(rated):
        return gettext("Glare was not rated.")
    if not all(rated):
        return gettext("Glare was not rated in all cases.")
    least, most = _extremes(study, glare_share)
    text = gettext("Share of the occupied hours with a DGP above 0.40")
    return _highest_and_lowest(text, least, most)


def _heat(study: StudyResult) -> str:
    """Overheating, and the cases with the lowest and highest energy demand."""
    cool, warm = _extremes(study, warm_share)
    text = gettext("Share of the occupied hours above {limit} °C", limit=f"{WARM_C:.0f}")
    text = _highest_and_lowest(text, cool, warm)
    known = [set(ENERGIES) <= set(result.figures) for _, _, result in finished(study)]
    if any(known) and not all(known):
        return text + " " + gettext("Not all cases have heating and cooling.")
    if not any(known):
        return text + " " + gettext("Without heating and cooling.")
    least, most = _extremes(study, lambda result: sum(result.figures[e] for e in ENERGIES))
    if most[1] <= 0:
        return text + " " + gettext("Without heating and cooling.")
    values = {"case": least[0], "energy": rounded(least[1], 0), "parts": _parts(study, least[0])}
    energy = (
        gettext("Heating, cooling and lighting energy, unweighted: {energy} kWh a year ({case}; {parts}).", **values)
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
    figures = next(r.figures for _, c, r in finished(study) if case_label(study.plan, c) == label)
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
    """Which system meets the limits: for each room, climate, orientation and method; then which limits these are."""
    answers = _answers_by_place(study, limited)
    counted = limits_counted([judged(case.system, own) for case, _, own, _ in limited])
    if not answers or not counted:
        return answers
    *before, (name, text) = answers
    return (*before, (name, f"{text} {counted}"))


def _answers_by_place(study: StudyResult, limited: Sequence[Limited]) -> tuple[tuple[str, str], ...]:
    groups: dict[str, list[tuple[Judged, float | None]]] = {}
    for case, _, own, result in limited:
        figures = result.figures
        energy = sum(figures[e] for e in ENERGIES) if set(ENERGIES) <= set(figures) else None
        place = ", ".join(part for part in place_parts(study.plan, case) if part)
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
        place = ", ".join(part for part in place_parts(study.plan, case) if part)
        one = judged(case.system, own)
        cells.setdefault(place, {})[case.system] = met_cell(one)
    if len(systems) < 2 or len(cells) < 2:
        return None
    columns = (Column(gettext("Room"), numeric=False), *(Column(name, numeric=False) for name in systems))
    rows = tuple((place, *(own.get(s, "") for s in systems)) for place, own in cells.items())
    return Table(gettext("Limits met by room and system"), columns, rows)


def _protection(result: CaseResult) -> tuple[Card, ...]:
    """EN 17037's protection from glare as a headline figure."""
    level = result.figures.get("glare_protection")
    noise = result.figures.get("dgp_standard_error")
    known = None if noise is None else float(noise)
    return () if level is None else (protection_card(str(level), known),)


FILES = page_files("scenes.study_report")
SCRIPTS = ("study.js", "parallel.js")
MOST_BESIDE = 3  # cases that are shown at a time
MOST_CASES = 60  # that have a section of their own: some 200 kB each


def write_study_report(study: StudyResult, path: Path, page: PageOptions = OWN_PAGE) -> None:
    """Write the report of a study as one self-contained HTML file."""
    write_text(path, study_report_html(study, page))


def study_report_html(study: StudyResult, page: PageOptions = OWN_PAGE) -> str:
    """The report as text: no script, font or picture is fetched from anywhere."""
    done = finished(study)
    if not done:
        raise ValueError("a report needs at least one case with a result")
    with in_language(page.language):
        return _filled(study, page, done)


def _filled(study: StudyResult, page: PageOptions, done: Sequence[tuple[int, Case, CaseResult]]) -> str:
    rooms = {number: room_of(study, case, r) for number, case, r in done[:MOST_CASES]}
    every = tuple(rooms.values())
    pages = tuple(case_page(study, number, room, every) for number, room in rooms.items())
    errors = [r.figures["illuminance_error_mean"] for _, _, r in done]
    worst = max(r.figures["illuminance_error_max"] for _, _, r in done)
    styles = (run_page.FILES["style.css"], FILES["study.css"])
    scripts = [run_page.FILES[name] for name in (*run_page.SCRIPTS, run_page.SAVING)]
    scripts += [FILES[name] for name in SCRIPTS]
    return (
        run_page.environment(FILES)
        .get_template("study.html.j2")
        .render(
            study=study,
            page=page,
            title=page.title or study.title or gettext("Study of fenestration systems"),
            facts=facts(study) + page.facts,
            verdict=study_verdict(study),
            explored={number: explorer_link(study, number) for number in study.explored},
            beside=len(done) if len(done) <= MOST_BESIDE else 1,
            most_beside=min(len(pages), MOST_BESIDE),
            scatter=scatter(study),
            parallel=parallel(study),
            bars=bars(study),
            table=comparison_table(study),
            head=run_page.head_lines(study.head, study.notes),
            failures=failures_table(study),
            clock=clock_table(study),
            choices=tuple(dict.fromkeys(case.chosen for case in study.plan.cases if case.chosen)),
            pages=pages,
            left_out=len(done) - len(pages),
            model=study_model(study),
            has_outdoors=any(b.elements for b, _ in study.plan.rooms.values()),
            problems=tables.problems_table(study.issues),
            inputs=inputs_table(study),
            mean_error=share(sum(errors) / len(errors) / 100),
            worst_error=share(worst / 100),
            version=metadata.version("mitsuba-cfs"),
            glossary=glossary(),
            style=Markup("\n".join(styles)),
            scripts=Markup("\n".join(scripts)),
        )
    )


def facts(study: StudyResult) -> tuple[tuple[str, str], ...]:
    """The study in a few facts."""
    cases = study.plan.cases

    def named(values) -> str:
        values = list(dict.fromkeys(values))
        return ", ".join(values) if len(values) <= 4 else f"{len(values)}"

    return (
        *([(gettext("Run"), gettext(NOTE))] if study.quick else []),
        (gettext("Cases"), _cases(study)),
        (gettext("Rooms"), named(c.place for c in cases)),
        (gettext("Systems"), named(c.system for c in cases)),
        (gettext("Climates"), named(c.climate for c in cases)),
        (gettext("Rotation"), named(decimal(f"{c.orientation_deg:g}°") for c in cases)),
        (gettext("Methods"), named(gettext(METHODS[c.options.method]) for c in cases)),
        (gettext("Computing time"), _seconds(study)),
    )


def _cases(study: StudyResult) -> str:
    count = len(study.plan.cases)
    if not study.failed:
        return str(count)
    return gettext("{count}, of which {failed} failed", count=count, failed=study.failed)


def _seconds(study: StudyResult) -> str:
    seconds = rounded(study.seconds, 0)
    if not study.reused:
        return f"{seconds} s"
    return ngettext(
        "{seconds} s, {count} case from an earlier run",
        "{seconds} s, {count} cases from an earlier run",
        study.reused,
        seconds=seconds,
    )


def inputs_table(study: StudyResult) -> tables.Table:
    """The files of the study with their hashes."""
    files = dict.fromkeys(file for case in study.plan.cases for file in case.files)
    return run_page.files_table((f.name, f.path.name, f.sha256) for f in files)


SHOWN = ("da300", "udi_300_3000")
MOST_LAYERS = 60
APART = 3.0  # between buildings [m]


def study_model(study: StudyResult) -> Model3D:
    """All rooms that have a result, buildings side by side, before they are turned."""
    first: dict[str, tuple[Case, CaseResult]] = {}
    for case, result in zip(study.plan.cases, study.results, strict=True):
        if not result.error:
            first.setdefault(case.scene, (case, result))
    places = _places(study, list(first))
    rooms, elements = [], []
    seen: set[int] = set()
    for scene, (case, result) in first.items():
        building, _ = study.plan.rooms[scene]
        offset = places[scene]
        rooms.append(_moved_room(room_of(study, case, result), offset))
        if id(building) not in seen:
            seen.add(id(building))
            elements += [_moved(e, offset) for e in building.elements]
    name = next(iter(study.plan.rooms.values()))[0].name
    whole = Building(name, tuple(room.space for room in rooms), tuple(elements))
    times = rooms[0].heat.temperatures.index
    model = model3d(RunResult(whole, times, np.empty((0, 3)), tuple(rooms), (), {}))
    return replace(model, layers=_layers(study, list(first)))


def _places(study: StudyResult, scenes: list[str]) -> dict[str, np.ndarray]:
    """How far each room's building is moved along x so that none stands in another."""
    places, moved, edge = {}, {}, 0.0
    for scene in scenes:
        building, _ = study.plan.rooms[scene]
        if id(building) not in moved:
            points = np.concatenate([space.shell.reshape(-1, 3) for space in building.spaces])
            shift = edge - points[:, 0].min() if moved else 0.0
            edge = points[:, 0].max() + shift + APART
            moved[id(building)] = np.array([shift, 0.0, 0.0])
        places[scene] = moved[id(building)]
    return places


def _moved(part, offset: np.ndarray):
    """A face, window or element somewhere else."""
    return replace(part, triangles=part.triangles + offset)


def _moved_room(room: RoomYear, offset: np.ndarray) -> RoomYear:
    space: Space = room.space
    space = replace(
        space,
        faces=tuple(_moved(face, offset) for face in space.faces),
        windows=tuple(_moved(window, offset) for window in space.windows),
    )
    daylight = replace(room.daylight, points=room.daylight.points + offset)
    return replace(room, space=space, daylight=daylight)


def _layers(study: StudyResult, scenes: list[str]) -> tuple[ColourLayer, ...]:
    """A colouring for each case but its room, with the values of every room that has that case."""
    groups: dict[tuple[Any, ...], dict[str, tuple[Case, CaseResult]]] = {}
    for case, result in zip(study.plan.cases, study.results, strict=True):
        if not result.error:
            key = (case.system, case.climate, case.orientation_deg, case.options.method)
            groups.setdefault(key, {})[case.scene] = case, result
    layers = []
    for members in groups.values():
        if set(members) != set(scenes):
            continue
        label = case_label(study.plan, next(iter(members.values()))[0])
        for column in SHOWN:
            q = quantity(column)
            values = np.concatenate([members[s][1].arrays[f"sensor/{column}"] for s in scenes])
            scale = ColourScale(0.0, 100.0, f"{q.label}: {label}", "%")
            layers.append(ColourLayer(column, scale, colour_bytes(scale, values), 0))
    return tuple(layers[:MOST_LAYERS])


TICKS = 4


@dataclass(frozen=True, slots=True)
class ParallelAxis:
    """One upright axis; the better end is above."""

    name: str
    words: str  # the quantity, without its unit
    unit: str
    digits: int
    low: float  # at the lower end
    high: float  # at the upper end; below `low` where less is better
    x: float  # [%] of the width
    ticks: tuple[Tick, ...]

    def at(self, value: float) -> float:
        """Height of a value [%]."""
        return 100.0 * (value - self.low) / (self.high - self.low)


@dataclass(frozen=True, slots=True)
class CaseLine:
    """One case: its height on each axis [%], NaN where it has no value there."""

    number: int
    colour: str
    at: tuple[float, ...]
    words: str

    def path(self, axes: tuple[ParallelAxis, ...]) -> str:
        """SVG path on a square of 1000; broken where there is no value."""
        result, pen = [], "M"
        for axis, height in zip(axes, self.at, strict=True):
            if np.isnan(height):
                pen = "M"
                continue
            result.append(f"{pen}{10 * axis.x:.1f} {1000 - 10 * height:.1f}")
            pen = "L"
        return "".join(result)


@dataclass(frozen=True, slots=True)
class Parallel:
    """All cases with a result over the axes that at least one of them has."""

    axes: tuple[ParallelAxis, ...]
    lines: tuple[CaseLine, ...]


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A figure that may be an axis."""

    name: str
    words: str
    unit: str
    digits: int
    more_is_better: bool
    value: Callable[[CaseResult, Space], float]  # NaN where the case has none

    def axis(self, values: list[float], x: float) -> ParallelAxis:
        """The axis that holds the values, at a place [%] of the width."""
        whole = [0.0, 100.0] if self.unit == "%" and self.more_is_better else [0.0]
        low, high = round_limits([*values, *whole], TICKS)
        ticks = axis_ticks(low, high, TICKS)
        if not self.more_is_better:
            low, high = high, low
            ticks = tuple(replace(tick, at=100.0 - tick.at) for tick in ticks)
        name, words = gettext(self.name), gettext(self.words)
        return ParallelAxis(name, words, self.unit, self.digits, low, high, x, ticks)


def parallel(study: StudyResult) -> Parallel:
    """Every finished case of a study as a line."""
    cases = finished(study)
    spaces = [study.plan.rooms[case.scene][1] for _, case, _ in cases]
    columns = []
    for axis in CANDIDATES:
        values = [axis.value(r, space) for (_, _, r), space in zip(cases, spaces, strict=True)]
        if not np.isnan(values).all():
            columns.append((axis, values))
    axes = tuple(
        candidate.axis(values, 100.0 * (i + 0.5) / len(columns)) for i, (candidate, values) in enumerate(columns)
    )
    looks = system_looks(cases)
    lines = []
    for i, (number, case, _) in enumerate(cases):
        own = [(axis, values[i]) for axis, (_, values) in zip(axes, columns, strict=True)]
        figures = (
            f"{axis.name.lower()} {rounded(value, axis.digits)} {axis.unit}"
            for axis, value in own
            if not np.isnan(value)
        )
        words = colon(f"{number}, {case_label(study.plan, case)}", ", ".join(figures))
        at = tuple(axis.at(value) for axis, value in own)
        lines.append(CaseLine(number, looks[case.system][0], at, words))
    return Parallel(axes, tuple(lines))


def _figure(result: CaseResult, name: str) -> float:
    return float(result.figures.get(name, np.nan))


def _glare(result: CaseResult) -> float:
    rated = "glare_disturbing_h" in result.figures
    return glare_share(result) if rated else np.nan


def _comfort(result: CaseResult) -> float:
    """Occupied hours within the band that 80 % of people accept [%]."""
    used = max(int(result.arrays["comfort/occupied"].sum()), 1)
    return 100.0 * _figure(result, "comfortable_80_h") / used


def _energy(result: CaseResult, space: Space) -> float:
    return sum(_figure(result, name) for name in ENERGIES) / space.floor_area


CANDIDATES = (
    _Candidate(
        N_("Daylight"), N_("daylight autonomy 300 lx"), "%", 0, True, lambda result, _: _figure(result, "da300")
    ),
    _Candidate(N_("Glare"), N_("occupied hours with DGP above 0.40"), "%", 1, False, lambda result, _: _glare(result)),
    _Candidate(
        N_("Comfort"), N_("occupied hours within the 80 % limits"), "%", 0, True, lambda result, _: _comfort(result)
    ),
    _Candidate(N_("Energy"), N_("heating, cooling and light per floor area"), "kWh/m²", 0, False, _energy),
    _Candidate(
        N_("Melanopic light"),
        N_("occupied hours with 250 lx melanopic EDI"),
        "%",
        0,
        True,
        lambda result, _: _figure(result, "melanopic_250_percent"),
    ),
    _Candidate(
        N_("View"),
        N_("direct visible transmittance"),
        "%",
        0,
        True,
        lambda result, _: _figure(result, "straight_view_percent"),
    ),
)


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
        name = f"{number}: {case_label(study.plan, case)}"
        about = {"id": f"case-{number}", "turned": case.orientation_deg % 360.0}
        for entry in explored.shown["rooms"]:
            entries.append(moved_entry(entry, explored.key, name) | about)
    title = study.title or first["title"]
    with in_language(page.language):
        head = run_page.head_lines(study.head, study.notes)
        write_joined(first | {"title": title, "head": head, "rooms": entries}, folder)
