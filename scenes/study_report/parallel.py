"""Parallel coordinates: each case a line over daylight, glare, comfort, energy and view."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bim.model import Space
from scenes.figures.scale import Tick, axis_ticks, round_limits
from scenes.language.catalogue import N_, gettext
from scenes.language.numbers import colon, rounded
from scenes.study.store import CaseResult
from scenes.study.study import StudyResult
from scenes.study_report.case_page import case_label
from scenes.study_report.comparison import finished, glare_share, system_looks
from scenes.study_report.verdict import ENERGIES

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
        found, pen = [], "M"
        for axis, height in zip(axes, self.at, strict=True):
            if np.isnan(height):
                pen = "M"
                continue
            found.append(f"{pen}{10 * axis.x:.1f} {1000 - 10 * height:.1f}")
            pen = "L"
        return "".join(found)


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
        candidate.axis(values, 100.0 * (i + 0.5) / len(columns))
        for i, (candidate, values) in enumerate(columns)
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
        words = colon(f"{number}, {case_label(study, case)}", ", ".join(figures))
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
    _Candidate(N_("Daylight"), N_("daylight autonomy 300 lx"), "%", 0, True,
           lambda result, _: _figure(result, "da300")),
    _Candidate(N_("Glare"), N_("occupied hours with DGP above 0.40"), "%", 1, False,
           lambda result, _: _glare(result)),
    _Candidate(N_("Comfort"), N_("occupied hours within the 80 % limits"), "%", 0, True,
           lambda result, _: _comfort(result)),
    _Candidate(N_("Energy"), N_("heating, cooling and light per floor area"), "kWh/m²", 0, False,
           _energy),
    _Candidate(N_("View"), N_("direct visible transmittance"), "%", 0, True,
           lambda result, _: _figure(result, "straight_view_percent")),
)  # fmt: skip
