"""What a candidate is judged by: measures of its cases, and limits that standards set."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from bim.model import Space
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.glare.classes import CLASSES, LIMITS
from scenes.comply.needs import DgpExceeded, Need, ReachedLux, SpatialAutonomy, SunlightExposure
from scenes.comply.rules import LevelTable, read_rule
from scenes.language.catalogue import N_
from scenes.study.store import CaseResult

GOALS = {"least": 1.0, "most": -1.0}  # what makes the least the best
ENERGIES = ("heating_kwh", "cooling_kwh", "lighting_kwh")
OF_AREA = {0.5: "en17037_target_lx", 0.95: "en17037_minimum_lx"}  # column of a case, by share of the area
WHOLE_TIME = 0.5  # of these columns: half of the daylight hours
ROUNDING = 1e-9  # of a value beside its limit
Value = Callable[[CaseResult, Space, Any], float]  # of a case, its room and its `DesignSystem`


@dataclass(frozen=True, slots=True)
class Measure:
    """A figure of a case that may be sought or limited."""

    label: str
    unit: str
    digits: int
    goal: str
    value: Value


def figure(result: CaseResult, column: str) -> float:
    """A figure of a case.

    Raises: `DataError` where it has none of that name, or a text.
    """
    value = result.figures.get(column)
    if value is None or isinstance(value, str):
        numbers = sorted(name for name, one in result.figures.items() if not isinstance(one, str))
        raise DataError(f"no number {column!r} in the results of a case; they have {', '.join(numbers)}")
    return float(value)


def _energy(result: CaseResult, space: Space, _: object) -> float:
    """Heating, cooling and lighting per floor area [kWh/m2]."""
    return sum(figure(result, name) for name in ENERGIES) / space.floor_area


def glare_hours(result: CaseResult, limit: float = 0.40) -> float:
    """Occupied hours with a DGP above a limit of `glare.classes` [h]."""
    return sum(figure(result, f"glare_{name}_h") for name in CLASSES[LIMITS.index(limit) + 1 :])


def glare_share(result: CaseResult, limit: float) -> float:
    """Share of the occupied hours with a DGP above a limit."""
    every = sum(figure(result, f"glare_{name}_h") for name in CLASSES)
    return glare_hours(result, limit) / every if every else 0.0


def _melanopic_hours(result: CaseResult, _space: Space, _system: object) -> float:
    """Occupied hours with 250 lx of melanopic EDI at the eye [h]."""
    occupied = int(np.count_nonzero(result.arrays["comfort/occupied"]))
    return figure(result, "melanopic_250_percent") / 100 * occupied


def _column(name: str) -> Value:
    return lambda result, _space, _system: figure(result, name)


def _of_windows(name: str) -> Value:
    """A number of the user's per m2 of window, for all windows of the room."""

    def value(_: CaseResult, space: Space, system: Any) -> float:
        per_m2 = getattr(system, name)
        if per_m2 is None:
            raise ValueError(f"{name} of a system that states none")
        return per_m2 * sum(window.area for window in space.windows)

    return value


MEASURES = {  # by the names of a design file
    "energy": Measure(N_("energy demand"), "kWh/m²", 1, "least", _energy),
    "sDA": Measure(N_("spatial daylight autonomy"), "%", 1, "most", _column("sda300_50")),
    "daylight autonomy": Measure(N_("daylight autonomy"), "%", 1, "most", _column("da300")),
    "glare hours": Measure(N_("hours of glare"), "h", 0, "least", lambda result, *_: glare_hours(result)),
    "melanopic hours": Measure(N_("hours of melanopic light"), "h", 0, "most", _melanopic_hours),
    "comfort hours": Measure(N_("comfortable hours"), "h", 0, "most", _column("comfortable_80_h")),
    "warm hours": Measure(N_("hours above 26 °C"), "h", 0, "least", _column("warm_h")),
    "view": Measure(N_("view out"), "%", 1, "most", _column("straight_view_percent")),
    "cost": Measure(N_("cost"), "", 0, "least", _of_windows("cost")),
    "carbon": Measure(N_("embodied carbon"), "kg CO2e", 0, "least", _of_windows("carbon")),
}


def column_measure(column: str) -> Measure:
    """A column of a study's results as a measure."""
    return Measure(column, "", 2, "least", _column(column))


def rule_level(rule: str, level: str | None) -> LevelTable:
    """The level of a criterion, named as "en17037 glare"; the least without a name.

    Raises: `ValueError` that names what there is.
    """
    standard, _, key = rule.partition(" ")
    try:
        criteria = read_rule(standard).criterion
    except DataError as error:
        raise ValueError(f"rule: {error.message}") from None
    named = [one for one in criteria if one.key == key]
    if not named:
        raise ValueError(f"rule: {standard} has no {key!r}; it has {', '.join(one.key for one in criteria)}")
    levels = named[0].level
    if level is None:
        return levels[0]
    if level not in (one.name for one in levels):
        raise ValueError(f"level: {rule} has no {level!r}; it has {', '.join(one.name for one in levels)}")
    return next(one for one in levels if one.name == level)


@dataclass(frozen=True, slots=True)
class Limit:
    """A limit of a measure of a case."""

    label: str
    unit: str
    digits: int
    value: Value
    at_most: float | None
    at_least: float | None

    def excess(self, value: float) -> float:
        """By how much a value misses the limit; 0 or less where it is met."""
        return value - self.at_most if self.at_most is not None else (self.at_least or 0.0) - value

    def met(self, value: float) -> bool:
        """Whether a value keeps the limit."""
        return self.excess(value) <= ROUNDING * max(abs(value), 1.0)


def need_limit(need: Need, label: str) -> Limit:
    """A rule's need as the limit of a case, in the unit in which it is shown.

    Raises: `ValueError` for a need that the results of a case do not decide.
    """
    if isinstance(need, SpatialAutonomy):
        return _percent(need, label, _column(f"sda{need.lux:g}_{100 * need.time:g}"))
    if isinstance(need, SunlightExposure):
        return _percent(need, label, _column(f"ase{need.lux:g}_{need.hours:g}"))
    if isinstance(need, ReachedLux) and need.time == WHOLE_TIME and need.area in OF_AREA:
        return Limit(label, "lx", 0, _column(OF_AREA[need.area]), need.at_most, need.at_least)
    if isinstance(need, DgpExceeded) and need.limit in LIMITS:
        limit = need.limit
        return _percent(need, label, lambda result, *_: 100 * glare_share(result, limit))
    raise ValueError(f"{label} needs what the results of a case do not have ({need.what}); `cfs comply` checks it")


def _percent(need: Need, label: str, value: Value) -> Limit:
    most, least = (None if one is None else 100 * one for one in (need.at_most, need.at_least))
    return Limit(label, "%", 1, value, most, least)
