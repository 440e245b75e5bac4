"""Rooms that are open to each other: found, reported, and joined where the user asks for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bim.apertures import Filling, aperture_of
from bim.guarded import Outline, united
from bim.ifc.corrections import corrections_file
from bim.ifc.source import Source
from bim.ifc.spaces import SpaceRecord
from bim.model import Problem
from bim.names import found_by_name
from bim.rooms import OVERLAP, Attachment, attachments_of, room_solid
from bim.solids import packed, unpacked
from mitsuba_cfs.errors import DataError, RoomError

THROUGH = 0.02  # an opening that stops this near a room's face goes through the wall [m]


@dataclass(frozen=True, slots=True)
class Passage:
    """An opening without door or window between two rooms."""

    opening: str  # GUID
    rooms: frozenset[str]  # GUIDs of the two
    outline: Outline  # of what fills the opening from one room into the other


def passages(source: Source, records: Sequence[SpaceRecord]) -> list[Passage]:
    """The openings that nothing fills and that lead from room to room."""
    solids = [record.solid for record in records]
    found = []
    for opening in source.model.by_type("IfcOpeningElement"):
        shape = source.shapes.get(opening.id())
        if shape is None or getattr(opening, "HasFillings", None):
            continue
        body = shape.triangles
        filling = Filling(
            shape.guid, shape.name, "IfcOpeningElement", body, shape.look < -1, opening=body
        )
        aperture, _ = aperture_of(filling)
        if aperture is None:
            continue
        sides = attachments_of(aperture, solids)
        for one in sides:
            others = [a for a in sides if a.room == one.neighbour and a.neighbour == one.room]
            passage = _passage(one, others)
            if passage is not None and passage.rooms not in {p.rooms for p in found}:
                found.append(passage)
    return found


def _passage(one: Attachment, others: list[Attachment]) -> Passage | None:
    """The passage between a room and its neighbour if the opening goes through to both."""
    if one.neighbour is None or not others:
        return None
    other, plane = others[0], one.aperture.plane
    heights = plane.to_plane(one.aperture.filling.triangles)[..., 2]
    # this room lies below the plane, the other one above
    if heights.min() > one.nearest + THROUGH or heights.max() < -other.nearest - THROUGH:
        return None
    outline = one.region, plane, one.deepest - OVERLAP, -other.deepest + OVERLAP
    return Passage(one.aperture.filling.guid, frozenset((one.room, other.room)), outline)


def joined_rooms(
    source: Source, records: Sequence[SpaceRecord]
) -> tuple[list[SpaceRecord], list[Problem]]:
    """Rooms with those of the corrections' `join` made one; the other open passages reported."""
    ways = passages(source, records)
    records, problems = list(records), []
    for names in source.corrections.join:
        parts = list({r.guid: r for r in (_named(records, n, source) for n in names)}.values())
        why = "nothing opens between them"
        try:
            one = _joined(parts, ways) if len(parts) > 1 else None
        except RoomError as error:
            one, why = None, str(error)
        if one is None:
            what = f"rooms {', '.join(names)}: {why}"
            problems.append(Problem(source.corrections.file or "join", what, "not joined"))
            continue
        records = [r for r in records if r not in parts] + [one]
        problems.append(Problem(one.solid.guid, f"rooms {', '.join(names)}", "joined as asked for"))
    named = {record.guid: record for record in records}
    for way in ways:
        if all(guid in named for guid in way.rooms):
            pair = sorted((named[guid] for guid in way.rooms), key=lambda room: room.label)
            what = f"rooms {' and '.join(room.label for room in pair)} are open to each other"
            how = _how_to_join(pair, records, source)
            problems.append(Problem(way.opening, what, how, kind="open to each other"))
    return records, problems


def _named(records: Sequence[SpaceRecord], name: str, source: Source) -> SpaceRecord:
    """The room of that name; `DataError` lists the nearest where there is none or several."""
    try:
        return found_by_name(records, name, "room")
    except (KeyError, ValueError) as error:
        file = source.corrections.file or source.path
        raise DataError(str(error.args[0]), file=file, field="join") from None


def _how_to_join(
    pair: Sequence[SpaceRecord], records: Sequence[SpaceRecord], source: Source
) -> str:
    """What becomes of the passage between two rooms, and what makes one room of them."""
    # the shortest that means one room and holds no plus, at which --join divides
    names = []
    for room in pair:
        own = [room.name, room.label]
        good = (n for n in own if "+" not in n and _is_unique(records, n))
        names.append(next(good, room.guid))
    listed = ", ".join(f'"{name}"' for name in names)
    return (
        f"closed by a wall face; one room with --join '{' + '.join(names)}', "
        f"or join = [[{listed}]] in {corrections_file(source.path).name}"
    )


def _is_unique(records: Sequence[SpaceRecord], name: str) -> bool:
    try:
        return found_by_name(records, name, "room") is not None
    except (KeyError, ValueError):
        return False


def _joined(parts: list[SpaceRecord], ways: list[Passage]) -> SpaceRecord | None:
    """One room of several; None where they stay apart."""
    guids = {part.solid.guid for part in parts}
    solids = [packed(part.solid.manifold) for part in parts]
    found = united(solids, [way.outline for way in ways if way.rooms <= guids])
    if found is None:
        return None
    body = unpacked(found)
    first = parts[0]
    name = " + ".join(part.name for part in parts)
    areas, volumes = ([getattr(p, key) for p in parts] for key in ("stated_area", "stated_volume"))
    return SpaceRecord(
        room_solid(first.solid.guid, name, body), name,
        " + ".join(part.long_name for part in parts if part.long_name), first.storey,
        body.volume(), None if None in areas else sum(areas),
        None if None in volumes else sum(volumes),
        first.type_name if len({part.type_name for part in parts}) == 1 else "",
    )  # fmt: skip
