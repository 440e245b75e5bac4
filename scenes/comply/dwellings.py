"""Rooms of a building together: what is asked of each, where one of a dwelling may be enough."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from bim.building_file import is_ifc
from bim.model import Building, Space
from bim.names import plain_text
from mitsuba_cfs.notes import Note
from scenes.comply.assess import NO_VERDICT, NOT_COMPUTED, BuildingVerdict, RoomVerdict, assess_building
from scenes.comply.results import CheckedRoom
from scenes.comply.rules import NOT_MET
from scenes.comply.uses import UNKNOWN, RoomUse, RoomUses

HOME = re.compile(  # words for a dwelling, without accents
    r"dwelling|\bflats?\b|apartment|residential unit|wohnung|\bwhg\b|wohneinheit|logement"
    r"|appartement|vivienda|\bpisos?\b|apartamento|appartament|alloggio|unita abitativa|fracao"
    r"|woning|appartemang|lagenhet|leilighet|\bbolig|lejlighed|huoneisto|asunto|mieszkan|\bbyt\b"
    r"|lakas|квартир|住戸|住宅|户型"
)
TECHNICAL = re.compile(
    r"hvac|therm|heat|heiz|kuhl|cool|chauff|luft|vent|air|klima|clima|fire|brand|incend|feu\b|smoke"
    r"|light|licht|acoust|akust|security|access|rent|miet|floor|storey|geschoss|etage|planta|piano"
)
OF_DWELLING = "room of each dwelling"


def uses_of_rooms(
    building: Building, spaces: Sequence[Space], known: RoomUses, linked: Sequence[Path] = ()
) -> dict[str, RoomUse]:
    """The use of each room by GUID; rooms without a window and without a use count as none.

    Args: linked: further files of the building.
    """
    texts = {}
    if building.file is not None and is_ifc(building.file):
        from bim.ifc.room_uses import read_room_uses  # reads IFC: only where there is a file

        texts = read_room_uses(building.file, *linked)
    uses = {}
    homes = dwellings_of(building)
    for space in spaces:
        use = known.of(space, texts.get(space.guid, ()))
        if not use.dwelling and not known.dwellings:
            use = replace(use, dwelling=homes.get(space.guid, ""))
        if use.key == UNKNOWN and use.dwelling and space.windows:
            source = Note("in {dwelling}, no information on its use, taken as a habitable room", dwelling=use.dwelling)
            use = replace(use, key="living", source=source, assumed=True)
        if use.key == UNKNOWN and not space.windows:
            use = replace(use, occupied=False, source=Note("no window and no use, not occupied"))
        uses[space.guid] = use
    return uses


def dwellings_of(building: Building) -> dict[str, str]:
    """Name of the dwelling of each room that is in one, by GUID, from the building's zones.

    Zones are dwellings whose name or kind says so; where none does, all whose texts name no
    technical purpose.  A room of several is in that with the fewest rooms.
    """
    texts = {zone: plain_text(f"{zone.name} {zone.kind}") for zone in building.zones}
    homes = [zone for zone, text in texts.items() if HOME.search(text)]
    homes = homes or [zone for zone, text in texts.items() if not TECHNICAL.search(text)]
    homes.sort(key=lambda zone: -len(zone.rooms))
    return {guid: zone.name for zone in homes for guid in zone.rooms}


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
        if dwelling and verdict.applies and verdict.reached not in (NOT_MET, NOT_COMPUTED, NO_VERDICT)
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
