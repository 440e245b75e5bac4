"""The answer at the head of a dossier: one sentence for each criterion, the rooms that miss it."""

from __future__ import annotations

from scenes.comply.assess import NOT_COMPUTED, NOT_FOR_IT, BuildingVerdict
from scenes.comply.results import Compliance
from scenes.comply.rules import NOT_MET
from scenes.language.catalogue import gettext, ngettext
from scenes.language.numbers import listed

NAMED = 4  # rooms that a sentence names; of more the rest is counted


def answers(result: Compliance) -> tuple[tuple[str, str], ...]:
    """Title and sentence of each criterion that is for a room: level, rooms below the least one.

    Levels and titles are in the page's language.
    """
    found = [
        (verdict, _sentence(result, verdict))
        for verdict in result.verdicts
        if verdict.rooms and verdict.criterion.over != "no building"
    ]
    return tuple(
        (f"{result.rules[one.rule].edition}, {gettext(one.criterion.title)}", text)
        for one, text in found
    )


def _sentence(result: Compliance, verdict: BuildingVerdict) -> str:
    """Such as "medium. 9 of 12 rooms reach at least minimum; below: A, B and C."."""
    of_rooms = [
        (room.space.label, one.reached)
        for room in result.rooms
        for one in room.verdicts
        if one.rule == verdict.rule and one.criterion.key == verdict.criterion.key and one.asked
    ]
    asked = [(name, level) for name, level in of_rooms if level != NOT_FOR_IT]
    unknown = [name for name, level in asked if level == NOT_COMPUTED]
    missed = [name for name, level in asked if level == NOT_MET]
    met = len(asked) - len(unknown) - len(missed)
    parts = [f"{_capital(gettext(verdict.reached))}."]
    if asked and missed:
        parts.append(
            ngettext(
                "{met} of {count} room meets it; not: {rooms}.",
                "{met} of {count} rooms meet it; not: {rooms}.",
                len(asked), met=met, rooms=_names(missed),
            )
        )  # fmt: skip
    elif asked and not unknown:
        parts.append(ngettext("The one room meets it.", "All {count} rooms meet it.", len(asked)))
    if unknown and len(unknown) < len(asked):  # else the level says so
        parts.append(gettext("Not computed: {rooms}.", rooms=_names(unknown)))
    return " ".join(parts)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _names(rooms: list[str]) -> str:
    """The first rooms by name, the rest counted."""
    if len(rooms) <= NAMED:
        return listed(rooms)
    rest = len(rooms) - NAMED
    return gettext("{names} and {count} more", names=", ".join(rooms[:NAMED]), count=rest)
