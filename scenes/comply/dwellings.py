"""Rooms of a building together: what is asked of each, where one of a dwelling may be enough."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from mitsuba_cfs.notes import Note
from scenes.comply.assess import NOT_COMPUTED, BuildingVerdict, RoomVerdict, assess_building
from scenes.comply.results import CheckedRoom
from scenes.comply.rules import NOT_MET

OF_DWELLING = "room of each dwelling"


def judged(rooms: Sequence[CheckedRoom]) -> tuple[list[CheckedRoom], list[BuildingVerdict]]:
    """The rooms with what is asked of each, and the building's verdicts."""
    homes = [room.use.dwelling for room in rooms]
    asked = asked_of_each([room.verdicts for room in rooms], homes)
    found = [replace(room, verdicts=rows) for room, rows in zip(rooms, asked, strict=True)]
    return found, assess_building(asked, [room.space.floor_area for room in rooms], homes)


def asked_of_each(
    verdicts: Sequence[tuple[RoomVerdict, ...]], dwellings: Sequence[str]
) -> list[tuple[RoomVerdict, ...]]:
    """The verdicts of the rooms, each saying whether it is `asked` of that very room.

    Where a room of each dwelling is enough, none of a dwelling that has one is asked; a room in no
    dwelling ("") is one by itself.
    """
    having = {
        (number, dwelling)
        for rows, dwelling in zip(verdicts, dwellings, strict=True)
        for number, verdict in enumerate(rows)
        if dwelling and verdict.applies and verdict.reached not in (NOT_MET, NOT_COMPUTED)
    }

    def asked(number: int, verdict: RoomVerdict, dwelling: str) -> bool:
        over = verdict.criterion.over
        if over == OF_DWELLING:
            return (number, dwelling) not in having
        return over != "no building"

    return [
        tuple(replace(v, asked=asked(number, v, dwelling)) for number, v in enumerate(rows))
        for rows, dwelling in zip(verdicts, dwellings, strict=True)
    ]


def dwelling_words(rooms: Sequence[CheckedRoom]) -> Iterator[str]:
    """Which rooms a criterion looks at of which one of each dwelling is enough, in sentences."""
    titles: dict[str, list[CheckedRoom]] = {}
    for room in rooms:
        for verdict in room.verdicts:
            if verdict.applies and verdict.criterion.over == OF_DWELLING:
                titles.setdefault(verdict.criterion.title, []).append(room)
    for title, used in titles.items():
        homes: dict[str, list[str]] = {}
        for room in used:
            homes.setdefault(room.use.dwelling, []).append(room.space.label)
        alone = homes.pop("", [])
        parts = "; ".join(f"{name} ({', '.join(labels)})" for name, labels in homes.items())
        if parts:
            yield Note(
                "{criterion}: dwellings are {dwellings}; a mapping file (--uses) names dwellings.",
                criterion=Note(title),
                dwellings=parts,
            )
        if alone:
            yield Note(
                "{criterion}: rooms without a named dwelling are assessed individually: {rooms}; a "
                "mapping file (--uses) names dwellings.",
                criterion=Note(title),
                rooms=", ".join(alone),
            )
