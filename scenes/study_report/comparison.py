"""All cases at one look: daylight against glare, classes of glare side by side, one table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mitsuba_cfs.glare.classes import CLASSES
from scenes.figures.scale import Tick, axis_ticks, round_limits
from scenes.language.catalogue import gettext
from scenes.language.numbers import cell, percent, rounded
from scenes.report import tables
from scenes.report.headline import LEVEL_WORDS
from scenes.report.method import METHODS
from scenes.report.names import quantity
from scenes.report.tables import CLASS_WORDS
from scenes.study.plan import Case
from scenes.study.store import CaseResult
from scenes.study.study import StudyResult
from scenes.study_report.case_page import case_label, label_of

# colours and outlines that stay apart for all colour visions; the shape goes on where they end
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8a8f98")
SHAPES = ("round", "square", "diamond", "ring")
COLUMNS = (
    "sda300_50",
    "ase1000_250",
    "da300",
    "udi_300_3000",
    "daylight_factor",
    "dgp_max",
    "glare_perceptible_h",
    "glare_disturbing_h",
    "glare_intolerable_h",
    "glare_protection",
    "straight_view_percent",
    "comfortable_80_h",
    "warm_h",
    "operative_max_c",
    "heating_kwh",
    "cooling_kwh",
    "lighting_kwh",
    "illuminance_error_mean",
    "seconds",
)


@dataclass(frozen=True, slots=True)
class Dot:
    """One case in the scatter."""

    x: float  # [%] of the axis
    y: float
    colour: str
    shape: str
    number: int
    words: str


@dataclass(frozen=True, slots=True)
class Scatter:
    """Daylight against glare, or against comfort where no glare was rated."""

    title: str
    explanation: str
    x_label: str
    y_label: str
    x_ticks: tuple[Tick, ...]
    y_ticks: tuple[Tick, ...]
    dots: tuple[Dot, ...]
    systems: tuple[tuple[str, str, str], ...]  # colour, shape, name
    front: tuple[tuple[float, float], ...]  # [%] of the axes: what no other case beats in both


@dataclass(frozen=True, slots=True)
class Bar:
    """The occupied hours of one case by class of glare, and its daylight."""

    number: int
    label: str
    shares: tuple[tuple[str, float], ...]  # class and its share [%]
    daylight: float  # mean daylight autonomy [%]
    words: str


def finished(study: StudyResult) -> list[tuple[int, Case, CaseResult]]:
    """Number from 1, case and result of the cases that have one."""
    pairs = zip(study.plan.cases, study.results, strict=True)
    return [(i, case, r) for i, (case, r) in enumerate(pairs, 1) if not r.error]


def scatter(study: StudyResult) -> Scatter:
    """Every case as a dot: better lies to the right and further down."""
    cases = finished(study)
    rated = all("glare_disturbing_h" in result.figures for _, _, result in cases)
    looks = system_looks(cases)
    x = [result.figures["da300"] for _, _, result in cases]
    y = [glare_share(result) if rated else warm_share(result) for _, _, result in cases]
    (x0, x1), (y0, y1) = round_limits([*x, 0.0, 100.0]), round_limits([*y, 0.0, 1.0])

    def words(case: Case, light: float, share: float) -> str:
        values = {"case": case_label(study.plan, case), "light": percent(light), "share": percent(share)}
        if rated:
            return gettext("{case}: daylight {light} %, disturbing glare {share} %", **values)
        return gettext("{case}: daylight {light} %, overheating {share} %", **values)

    dots = tuple(
        Dot(100 * (a - x0) / (x1 - x0), 100 * (b - y0) / (y1 - y0), *looks[case.system], number, words(case, a, b))
        for (number, case, _), a, b in zip(cases, x, y, strict=True)
    )
    return Scatter(
        gettext("Daylight and glare") if rated else gettext("Daylight and overheating"),
        gettext(
            "Each case is a mark in the colour of its system; more daylight to the right, less "
            "glare downwards. The line joins the cases that no other case surpasses in both "
            "(Pareto front). Click a mark to show its case."
        )
        if rated
        else gettext(
            "Each case is a mark in the colour of its system; more daylight to the right, less "
            "overheating downwards. The line joins the cases that no other case surpasses in both "
            "(Pareto front). Click a mark to show its case."
        ),
        gettext("Daylight autonomy (300 lx), mean over the work plane [%]"),
        gettext("Occupied hours with DGP above 0.40 [%]") if rated else gettext("Occupied hours above 26 °C [%]"),
        axis_ticks(x0, x1),
        axis_ticks(y0, y1),
        dots,
        tuple((*look, name) for name, look in looks.items()),
        pareto_front([(dot.x, dot.y) for dot in dots]),
    )


def system_looks(cases: Sequence[tuple[int, Case, CaseResult]]) -> dict[str, tuple[str, str]]:
    """Colour and shape of each system, by its name."""
    names = dict.fromkeys(case.system for _, case, _ in cases)
    return {name: (COLOURS[i % len(COLOURS)], SHAPES[i // len(COLOURS) % len(SHAPES)]) for i, name in enumerate(names)}


def pareto_front(points: Sequence[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Those of the points (x, y) that no other is right of and below, from right to left."""
    front: list[tuple[float, float]] = []
    for x, y in sorted(set(points), key=lambda one: (-one[0], one[1])):
        if not front or y < front[-1][1]:
            front.append((x, y))
    return tuple(front)


def bars(study: StudyResult) -> tuple[Bar, ...]:
    """Classes of glare of the cases that were rated."""
    found = []
    for number, case, result in finished(study):
        hours = [result.figures.get(f"glare_{name}_h") for name in CLASSES]
        if None in hours:
            continue
        shares = tuple((n, 100 * h / sum(hours)) for n, h in zip(CLASSES, hours, strict=True))
        words = ", ".join(f"{gettext(CLASS_WORDS[name])} {percent(share)} %" for name, share in shares)
        label = case_label(study.plan, case)
        found.append(Bar(number, label, shares, result.figures["da300"], words))
    return tuple(found)


def glare_share(result: CaseResult) -> float:
    """Occupied hours with a DGP above 0.40 [%]."""
    hours = [result.figures[f"glare_{name}_h"] for name in CLASSES]
    return 100.0 * sum(hours[2:]) / sum(hours)


def warm_share(result: CaseResult) -> float:
    """Occupied hours above 26 degC [%]."""
    used = result.arrays["comfort/occupied"].sum()
    return 100.0 * result.figures["warm_h"] / max(used, 1)


def comparison_table(study: StudyResult) -> tables.Table:
    """One row per case with its main figures."""
    present = {name for result in study.results for name in result.figures}
    columns = [c for c in COLUMNS if c in present]
    headings = (
        tables.Column(gettext("Case"), meaning=gettext("Number of the case; select it below.")),
        tables.Column(gettext("Description"), numeric=False, short=True),
        tables.Column(gettext("Method"), numeric=False, short=True),
        *(label_of(c) for c in columns),
    )
    rows = []
    for number, case, result in finished(study):
        values = [_shown(c, result.figures.get(c)) for c in columns]
        method = gettext(METHODS[case.options.method]) + ("" if case.glare == "none" else f", {case.glare}")
        rows.append((str(number), case_label(study.plan, case), method, *values))
    return tables.Table(gettext("All cases"), headings, tuple(rows))


def _shown(column: str, value: float | str | None) -> str:
    if isinstance(value, str):
        return gettext(LEVEL_WORDS[value])
    return cell(value, 1 if column == "daylight_factor" else quantity(column).digits)


def failures_table(study: StudyResult) -> tables.Table:
    """The cases without a result, and why."""
    pairs = enumerate(zip(study.plan.cases, study.results, strict=True), 1)
    columns = (
        tables.Column(gettext("Case")),
        tables.Column(gettext("Description"), numeric=False),
        tables.Column(gettext("Error"), numeric=False),
    )
    rows = [(str(i), case_label(study.plan, c), r.error) for i, (c, r) in pairs if r.error]
    return tables.Table(gettext("Cases without a result"), columns, tuple(rows))


def clock_table(study: StudyResult) -> tables.Table:
    """Time taken by the cases together, stage by stage."""
    stages = ("daylight_s", "glare_s", "thermal_s", "seconds")
    names = (gettext("Daylight"), gettext("Glare"), gettext("Heat"), gettext("Total, with reading of files"))
    rows = []
    for stage, name in zip(stages, names, strict=True):
        values = [float(r.figures.get(stage, 0.0)) for r in study.results if not r.error]
        if values:
            mean, most = sum(values) / len(values), max(values)
            rows.append((name, rounded(sum(values), 1), rounded(mean, 1), rounded(most, 1)))
    columns = (
        tables.Column(gettext("Stage"), numeric=False),
        tables.Column(gettext("All cases"), "s"),
        tables.Column(gettext("Mean per case"), "s"),
        tables.Column(gettext("Longest"), "s"),
    )
    return tables.Table(gettext("Time taken"), columns, tuple(rows))
