"""Tables of a dossier: verdicts of the building and of a room, every number with its clause."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np
import pandas as pd

from bim.bcf import in_model
from bim.model import Building
from bim.names import natural_key
from scenes.comply.assess import NOT_FOR_IT, RoomVerdict
from scenes.comply.needs import Need
from scenes.comply.results import CheckedRoom, Compliance
from scenes.comply.rules import NOT_MET, CriterionTable, LevelTable, RuleTable
from scenes.comply.uses import RoomUse
from scenes.language.catalogue import N_, decimal, gettext
from scenes.language.numbers import MISSING, cell, colon, rounded, semicolons
from scenes.report.tables import Column, Table

USE_WORDS = {  # of the uses that come with the program
    "sanitary": N_("sanitary room"),
    "circulation": N_("circulation"),
    "technical": N_("technical room"),
    "storage": N_("storage"),
    "roof": N_("roof or balcony"),
    "laboratory": N_("laboratory"),
    "classroom": N_("classroom"),
    "nursery": N_("nursery"),
    "meeting": N_("meeting room"),
    "consulting": N_("consulting room"),
    "ward": N_("patient room"),
    "retail": N_("retail"),
    "kitchen": N_("kitchen"),
    "bedroom": N_("bedroom"),
    "living": N_("living room"),
    "office": N_("office"),
    "unknown": N_("use unknown"),
}
UP = np.array([0.0, 0.0, 1.0])
MOST_DIGITS = 5  # behind the decimal point of a value beside its limit
COLUMNS = (
    "room",
    "guid",
    "use",
    "floor_area_m2",
    "rule",
    "edition",
    "clause",
    "criterion",
    "level",
    "quantity",
    "value",
    "limit",
    "unit",
    "met",
    "asked",
)


def shown(need: Need, value: float | None) -> str:
    """A value with its unit."""
    if value is None:
        return MISSING
    factor = 100 if need.unit == "%" else 1
    number = beside_limit(factor * value, need.digits, lambda v: need.met(v / factor))
    return f"{number} {need.unit}".strip()


def beside_limit(value: float, digits: int, met: Callable[[float], bool | None]) -> str:
    """A value with so many digits that it keeps or misses its limit as printed too."""
    while digits < MOST_DIGITS and met(round(value, digits)) != met(value):
        digits += 1
    return rounded(value, digits)


def limit_of(need: Need) -> str:
    """The limit of a need with its unit."""
    word, value = ("≥", need.at_least) if need.at_least is not None else ("≤", need.at_most)
    factor = 100 if need.unit == "%" else 1
    return f"{word} {decimal(f'{factor * (value or 0):g}')} {need.unit}".strip()


def yes_or_no(met: bool | None) -> str:
    """Whether something is met, in a word of `values.csv`."""
    return MISSING if met is None else ("yes" if met else "no")


def use_words(use: RoomUse) -> str:
    """The use of a room, in the page's language."""
    return gettext(USE_WORDS.get(use.key, use.key))


def building_table(result: Compliance, rule: str) -> Table:
    """The building against the criteria of a rule."""
    columns = [_text(gettext("Criterion")), _text(gettext("Level reached")), _text(gettext("Value by level (limit)"))]
    columns += [_text(gettext("Quantity")), _text(gettext("Clause")), Column(gettext("Rooms"))]
    rows = []
    for verdict in result.verdicts:
        if verdict.rule != rule or not verdict.rooms or verdict.criterion.over == "no building":
            continue
        one = verdict.criterion
        compared = [_compared(level, value) for level, value in zip(one.level, verdict.values, strict=True)]
        names = (gettext(level.name) for level in one.level)
        levels = [colon(n, text) for n, (_, text) in zip(names, compared, strict=True)]
        words = ", ".join(dict.fromkeys(what for what, _ in compared))
        rows.append(
            (
                gettext(one.title),
                gettext(one.words_of(verdict.reached)),
                semicolons(levels),
                words,
                clause(one),
                str(verdict.rooms),
            )
        )
    return Table(gettext("Building"), tuple(columns), tuple(rows))


def clause(criterion: CriterionTable) -> str:
    """The clause of a criterion."""
    return gettext(criterion.clause)


def _compared(level: LevelTable, value: float | None) -> tuple[str, str]:
    """What a level compares over the rooms; its value and its limit."""
    if level.over == "area mean":
        need = level.needs[0]
        words = gettext("{quantity}; mean over the floor area", quantity=need.words)
        return words, f"{shown(need, value)} ({limit_of(need)})"
    limit = 100.0 if level.share is None else 100 * level.share
    number = MISSING
    if value is not None:
        number = f"{beside_limit(100 * value, 0, lambda v: v >= limit - 1e-7)} %"
    words = (
        gettext("share of the dwellings with at least one room that meets the level")
        if level.over == "room of each dwelling"
        else gettext("share of the floor area in rooms that meet the level")
    )
    return words, f"{number} (≥ {decimal(f'{limit:g}')} %)"


def without_rooms(result: Compliance, rule: str) -> tuple[str, ...]:
    """Titles of the criteria of a rule that apply to no room."""
    verdicts = (v for v in result.verdicts if v.rule == rule and not v.rooms)
    return tuple(gettext(verdict.criterion.title) for verdict in verdicts)


def rooms_table(result: Compliance, rule: str) -> Table:
    """Every room with the level that it reaches of each criterion that is for some room."""
    numbers = [i for i, v in enumerate(result.verdicts) if v.rule == rule and v.rooms]
    columns = [_text(gettext("Room")), _text(gettext("Use")), Column(gettext("Area"), "m²")]
    columns += [_text(gettext(result.verdicts[i].criterion.title)) for i in numbers]
    rows = [
        (
            room.space.label,
            use_words(room.use) if room.use.occupied else gettext("{use} (not occupied)", use=use_words(room.use)),
            rounded(room.space.floor_area, 1),
            *(_short(room.verdicts[i]) for i in numbers),
        )
        for room in sorted(result.rooms, key=lambda room: natural_key(room.space.label))
    ]
    return Table(gettext("Levels reached by room"), tuple(columns), tuple(rows))


def room_table(result: Compliance, room: CheckedRoom, rule: str) -> Table:
    """A room against the criteria of a rule: every quantity with its limits and its clause."""
    columns = [_text(gettext("Criterion")), _text(gettext("Clause")), _text(gettext("Quantity"))]
    columns += [Column(gettext("Value")), _text(gettext("Limits by level"))]
    columns.append(_text(gettext("Level reached")))
    rows = []
    for verdict in room.verdicts:
        if verdict.rule != rule or not verdict.applies:
            continue
        first = True
        for words, (value, limits) in _quantities(verdict).items():
            one = verdict.criterion
            head = (gettext(one.title), clause(one)) if first else ("", "")
            last = gettext(one.words_of(verdict.reached)) if first else ""
            rows.append((*head, words, value, semicolons(limits), last))
            first = False
    return Table(gettext(result.rules[rule].title), tuple(columns), tuple(rows))


def _quantities(verdict: RoomVerdict) -> dict[str, tuple[str, list[str]]]:
    """The quantities of a criterion in words: value, and limit by level."""
    quantities: dict[str, tuple[str, list[str]]] = {}
    for level, values in zip(verdict.criterion.level, verdict.values, strict=True):
        for need, value in zip(level.needs, values, strict=True):
            _, limits = quantities.setdefault(need.words, (shown(need, value), []))
            limits.append(f"{gettext(level.name)} {limit_of(need)}")
    return quantities


def missed(rules: Mapping[str, RuleTable], room: CheckedRoom) -> Iterator[str]:
    """A sentence for each criterion that is asked of the room and of which it reaches no level."""
    for verdict in room.verdicts:
        if not (verdict.applies and verdict.asked) or verdict.reached != NOT_MET:
            continue
        one, values = verdict.criterion, verdict.values[0]
        numbers = [
            gettext(
                "{quantity}: {value}, required {limit} for {level}",
                quantity=need.words,
                value=shown(need, value),
                limit=limit_of(need),
                level=gettext(one.level[0].name),
            )
            for need, value in zip(one.level[0].needs, values, strict=True)
            if not need.met(value)
        ]
        if one.missed != NOT_MET:
            numbers.append(gettext(one.missed))
        head = f"{rules[verdict.rule].edition}, {gettext(one.title)} ({clause(one)})"
        yield colon(head, semicolons(numbers))


def openings_table(room: CheckedRoom, building: Building) -> Table | None:
    """The sunlight of each opening of a room, its reference point in the axes of the model's file."""
    if room.sun is None:
        return None
    columns = [_text(gettext("Opening")), *(Column(axis, "m") for axis in "xyz")]
    columns += [Column(gettext("Sunlight"), "h"), _text(gettext("Times (local standard time)"))]
    rows = [
        (
            one.name if one.name == one.guid else f"{one.name} ({one.guid})",
            *(cell(v, 2) for v in in_model(building, one.point, UP)[0]),
            cell(one.hours, 2),
            spans(one.times),
        )
        for one in room.sun.openings
    ]
    title = gettext("Sunlight at the reference points of the openings, in the coordinates of the model file")
    return Table(title, tuple(columns), tuple(rows))


def spans(times: tuple[tuple[float, float], ...]) -> str:
    """Intervals in minutes of the day as clock times."""
    return ", ".join(f"{_clock(start)}–{_clock(end)}" for start, end in times) or gettext("none")


def values_frame(result: Compliance) -> pd.DataFrame:
    """Every need of every room that it is for, one a row."""
    return pd.DataFrame(list(_rows(result)), columns=list(COLUMNS))


def _rows(result: Compliance) -> Iterator[tuple[object, ...]]:
    for room in result.rooms:
        for verdict in room.verdicts:
            if not verdict.applies:
                continue
            rule, one = result.rules[verdict.rule], verdict.criterion
            for level, values in zip(one.level, verdict.values, strict=True):
                for need, value in zip(level.needs, values, strict=True):
                    factor = 100 if need.unit == "%" else 1
                    limit = need.at_least if need.at_least is not None else need.at_most
                    yield (
                        room.space.label,
                        room.space.guid,
                        room.use.key,
                        room.space.floor_area,
                        verdict.rule,
                        rule.edition,
                        one.clause,
                        one.key,
                        level.name,
                        need.words,
                        None if value is None else factor * value,
                        factor * (limit or 0.0),
                        need.unit,
                        yes_or_no(need.met(value) if verdict.judged else None),
                        yes_or_no(verdict.asked),
                    )


def _clock(minutes: float) -> str:
    whole = int(minutes + 0.5)
    return f"{whole // 60:02d}:{whole % 60:02d}"


def _short(verdict: RoomVerdict) -> str:
    reached = verdict.criterion.words_of(verdict.reached)
    return MISSING if reached == NOT_FOR_IT else gettext(reached)


def _text(label: str) -> Column:
    return Column(label, numeric=False)
