"""Rooms that are open to each other: found, reported, and joined where the user asks for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bim.apertures import Aperture
from bim.guarded import united
from bim.ifc.corrections import corrections_file
from bim.ifc.passages import LARGEST_DOOR, Passage, passages
from bim.ifc.source import Source
from bim.ifc.spaces import SpaceRecord
from bim.model import JOINED, SHUT_ADVICE, Problem
from bim.names import JOINT, found_by_name
from bim.rooms import room_solid
from bim.solids import packed, unpacked
from mitsuba_cfs.errors import DataError, RoomError


def joined_rooms(
    source: Source,
    records: Sequence[SpaceRecord],
    apertures: Sequence[Aperture],
    bodies: NDArray[np.float64],
) -> tuple[list[SpaceRecord], list[Passage], list[Problem]]:
    """Rooms with those of the corrections' `join` made one, and the passages left between rooms.

    Args: apertures, bodies: see `bim.ifc.passages`.
    """
    ways = passages(apertures, records, bodies)
    records, problems = list(records), []
    for names in source.corrections.join:
        parts = list({r.guid: r for r in (_named(records, n, source) for n in names)}.values())
        one, why = _one_room(parts, ways)
        if one is None:
            what = f"rooms {', '.join(names)}: {why}"
            problems.append(Problem(source.corrections.file or "join", what, "not joined"))
            continue
        records = [r for r in records if r not in parts] + [one]
        ways = passages(apertures, records, bodies)
        problems.append(Problem(one.solid.guid, f"rooms {', '.join(names)}", "joined as asked for"))
    if source.corrections.join_open:
        records, more = _joined_by_size(records, ways)
        problems += more
        ways = passages(apertures, records, bodies)
    return records, ways, [*problems, *_open_pairs(records, ways, source)]


def _open_pairs(
    records: Sequence[SpaceRecord], ways: Sequence[Passage], source: Source
) -> list[Problem]:
    """What there is to say of each pair of rooms that stay open to each other, once."""
    by_pair: dict[frozenset[str], list[Passage]] = {}
    for way in ways:
        by_pair.setdefault(way.rooms, []).append(way)
    named = {record.guid: record for record in records}
    problems = []
    for rooms, own in by_pair.items():
        pair = sorted((named[guid] for guid in rooms), key=lambda room: room.label)
        labels = " and ".join(room.label for room in pair)
        what = f"rooms {labels} are open to each other by {sum(way.area for way in own):.1f} m2"
        what += f" in {len(own)} openings" if len(own) > 1 else ""
        how = _how_to_join(pair, records, source)
        if any(way.is_large for way in own):
            how += f"; --join open joins all that open by more than a door ({LARGEST_DOOR:g} m2)"
        problems.append(Problem(own[0].opening, what, how, kind="open to each other"))
    return problems


def _joined_by_size(
    records: list[SpaceRecord], ways: Sequence[Passage]
) -> tuple[list[SpaceRecord], list[Problem]]:
    """Rooms with those made one that openings larger than a door lead between."""
    large = [way for way in ways if way.is_large]
    number = {record.guid: i for i, record in enumerate(records)}
    rows, columns = np.array([[number[r] for r in way.rooms] for way in large]).reshape(-1, 2).T
    links = coo_array((np.ones(len(large)), (rows, columns)), shape=(len(records),) * 2)
    _, group = connected_components(links, directed=False)
    rooms, problems = [], []
    for members in (np.flatnonzero(group == i) for i in np.unique(group)):
        parts = [records[i] for i in members]
        if len(parts) == 1:
            rooms += parts
            continue
        one, why = _one_room(parts, large)
        names = ", ".join(part.label for part in parts)
        widest = max(way.area for way in large if way.rooms <= {part.guid for part in parts})
        what = f"Rooms {names}: open to each other by up to {widest:.1f} m2"
        if one is None:
            problems.append(Problem(parts[0].guid, what, f"not joined: {why}"))
            rooms += parts
            continue
        rooms.append(one)
        done = f"joined as one room: larger than a door ({LARGEST_DOOR:g} m2)"
        problems.append(Problem(one.guid, what, done, kind=JOINED))
    return rooms, problems


def _one_room(parts: list[SpaceRecord], ways: Sequence[Passage]) -> tuple[SpaceRecord | None, str]:
    """One room of several, or why there is none."""
    try:
        one = _joined(parts, ways) if len(parts) > 1 else None
    except RoomError as error:
        return None, str(error)
    return one, "" if one is not None else "nothing opens between them"


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
    file = corrections_file(source.path).name
    return (
        f"closed by a wall face; {SHUT_ADVICE}; one room with "
        f"--join '{' + '.join(names)}', or join = [[{listed}]] in {file}"
    )


def _is_unique(records: Sequence[SpaceRecord], name: str) -> bool:
    try:
        return found_by_name(records, name, "room") is not None
    except (KeyError, ValueError):
        return False


def _joined(parts: list[SpaceRecord], ways: Sequence[Passage]) -> SpaceRecord | None:
    """One room of several; None where they stay apart."""
    guids = {part.solid.guid for part in parts}
    solids = [packed(part.solid.manifold) for part in parts]
    found = united(solids, [way.outline for way in ways if way.rooms <= guids])
    if found is None:
        return None
    body = unpacked(found)
    first = parts[0]
    name = JOINT.join(part.name for part in parts)
    areas, volumes = ([getattr(p, key) for p in parts] for key in ("stated_area", "stated_volume"))
    return SpaceRecord(
        room_solid(first.solid.guid, name, body), name,
        JOINT.join(part.long_name for part in parts if part.long_name), first.storey,
        body.volume(), None if None in areas else sum(areas),
        None if None in volumes else sum(volumes),
        first.type_name if len({part.type_name for part in parts}) == 1 else "",
    )  # fmt: skip
