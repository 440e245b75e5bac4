"""Rooms and the building against rules: values, levels that are met, and what was not looked at."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from bim.model import Space
from mitsuba_cfs.sky.weather import Weather
from scenes.comply.findings import Findings
from scenes.comply.needs import Need
from scenes.comply.openings import openings_of
from scenes.comply.rules import NOT_MET, CriterionTable, LevelTable, RuleTable
from scenes.comply.uses import RoomUse
from scenes.language.catalogue import N_

NOT_FOR_IT, NOT_COMPUTED = N_("not applicable"), N_("not computed")
NO_VERDICT = N_("no verdict: weather")  # values in other weather than the rule asks for


@dataclass(frozen=True, slots=True)
class RoomVerdict:
    """A room against one criterion."""

    rule: str  # its name
    criterion: CriterionTable
    applies: bool
    values: tuple[tuple[float | None, ...], ...] = ()  # by level, by need
    asked: bool = True  # of this very room; else another one may have it, or none need have it
    judged: bool = True  # else the weather is not the one that the rule asks for

    def level_met(self, number: int) -> bool | None:
        """Whether enough needs of a level are met; None where one was not computed."""
        if not self.judged:
            return None
        level = self.criterion.level[number]
        met = [need.met(v) for need, v in zip(level.needs, self.values[number], strict=True)]
        least = len(met) if level.count is None else level.count
        return None if None in met else sum(map(bool, met)) >= least

    @property
    def reached(self) -> str:
        """Name of the highest level that is met."""
        if not self.applies:
            return NOT_FOR_IT
        if not self.judged and any(value is not None for values in self.values for value in values):
            return NO_VERDICT
        return highest(self.criterion, [self.level_met(i) for i in range(len(self.values))])


@dataclass(frozen=True, slots=True)
class BuildingVerdict:
    """All rooms of a criterion together."""

    rule: str
    criterion: CriterionTable
    rooms: int  # that it is for
    values: tuple[float | None, ...]  # by level: what is compared, see `level_value`
    met: tuple[bool | None, ...]  # by level
    judged: bool = True  # else some room has values, but the weather is not the one that the rule asks for

    @property
    def reached(self) -> str:
        """Name of the highest level that is met."""
        if not self.judged:
            return NO_VERDICT
        return highest(self.criterion, self.met) if self.rooms else NOT_FOR_IT


def highest(criterion: CriterionTable, met: Sequence[bool | None]) -> str:
    """The highest level met; a level does not need the lower ones."""
    if met and all(one is None for one in met):
        return NOT_COMPUTED
    names = [level.name for level, one in zip(criterion.level, met, strict=True) if one]
    return names[-1] if names else NOT_MET


def values_of(rule: RuleTable, findings: Findings, parts: frozenset[str]) -> dict[Need, float | None]:
    """The values of a rule's needs that look at some parts of the findings."""
    needs = (need for criterion in rule.criterion for need in criterion.needs)
    return {need: need.value(findings) for need in needs if need.parts & parts}


def assess_room(
    rules: Mapping[str, RuleTable],
    values: Mapping[str, Mapping[Need, float | None]],
    space: Space,
    use: RoomUse,
    weather: Weather | None = None,
) -> Iterator[RoomVerdict]:
    """A room against every criterion.

    Args:
        values: of every need by rule, see `values_of`.
        weather: that a rule must ask for to give a verdict; None: any.
    """
    for name, rule in rules.items():
        for criterion in rule.criterion:
            if not applies(criterion, space, use):
                yield RoomVerdict(name, criterion, False)
                continue
            found = (tuple(values[name][n] for n in level.needs) for level in criterion.level)
            judged = weather is None or rule.judges(weather)
            yield RoomVerdict(name, criterion, True, tuple(found), judged=judged)


def applies(criterion: CriterionTable, space: Space, use: RoomUse) -> bool:
    """Whether a criterion is for a room: by its use, its occupation and its openings."""
    if criterion.occupied and not use.occupied:
        return False
    if criterion.uses and use.key not in criterion.uses:
        return False
    if use.key in criterion.other_than:
        return False
    if criterion.openings == "any":
        return True
    roof = bool(space.windows) and all(one.is_horizontal for one in openings_of(space))
    return roof == (criterion.openings == "roof")


def asked_of(rules: Mapping[str, RuleTable], space: Space, use: RoomUse) -> frozenset[str]:
    """The parts of `Findings` that the criteria which are for a room need."""
    return frozenset(
        part
        for rule in rules.values()
        for criterion in rule.criterion
        if applies(criterion, space, use)
        for need in criterion.needs
        for part in need.parts
    )


def assess_building(
    verdicts: Sequence[Sequence[RoomVerdict]], areas: Sequence[float], dwellings: Sequence[str] | None = None
) -> list[BuildingVerdict]:
    """All rooms together, criterion by criterion.

    Args:
        verdicts: of each room, in the same order of criteria.
        areas: floor area of each [m2].
        dwellings: name of each room's dwelling, "" where it is in none; None: in none.
    """
    rooms = []
    for rows in zip(*verdicts, strict=True):
        used = [(v, area) for v, area in zip(rows, areas, strict=True) if v.applies]
        homes = dwellings or [""] * len(rows)
        named = [home for v, home in zip(rows, homes, strict=True) if v.applies]
        values, met = [], []
        for number, level in enumerate(rows[0].criterion.level):
            value = level_value(level, number, used, named)
            values.append(value)
            met.append(_level_met(level, value))
        judged = all(verdict.reached != NO_VERDICT for verdict, _ in used)
        rooms.append(BuildingVerdict(rows[0].rule, rows[0].criterion, len(used), tuple(values), tuple(met), judged))
    return rooms


def level_value(
    level: LevelTable, number: int, rooms: Sequence[tuple[RoomVerdict, float]], dwellings: Sequence[str]
) -> float | None:
    """Quantity of the rooms, with their areas, that a level limits; None if not computed.

    "area mean": the mean of its one need over the floor area; "room of each dwelling": the share
    of the dwellings of which a room meets the level, a room in none being one by itself; else the
    share of the floor area whose rooms meet the level.
    """
    if not rooms or level.over == "no building":
        return None
    total = sum(area for _, area in rooms)
    if level.over == "area mean":
        values = [(verdict.values[number][0], area) for verdict, area in rooms]
        known = [(value, area) for value, area in values if value is not None]
        if len(known) < len(values):
            return None
        return sum(value * area for value, area in known) / total
    met = [(verdict.level_met(number), area) for verdict, area in rooms]
    if any(one is None for one, _ in met):
        return None
    if level.over == "room of each dwelling":
        homes = [name or str(i) for i, name in enumerate(dwellings)]
        having = {home for home, (one, _) in zip(homes, met, strict=True) if one}
        return len(having) / len(set(homes))
    return sum(area for one, area in met if one) / total


def _level_met(level: LevelTable, value: float | None) -> bool | None:
    """Whether the building keeps a level with that value."""
    if value is None:
        return None
    if level.over == "area mean":
        return level.needs[0].met(value)
    return value >= (1.0 if level.share is None else level.share) - 1e-9
