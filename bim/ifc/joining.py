"""Rooms that are open to each other: found, reported, and joined where the user asks for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bim.apertures import Aperture
from bim.ifc.corrections import corrections_file
from bim.ifc.passages import LARGEST_DOOR, Passage, passages
from bim.ifc.source import Source
from bim.ifc.spaces import SpaceRecord
from bim.isolated_solids import united
from bim.names import JOINT, AmbiguousName, UnknownName, item_named
from bim.report.issue import Issue, Phrase
from bim.rooms import room_solid
from bim.solids import packed, unpacked
from mitsuba_cfs.errors import DataError, RoomError


def joined_rooms(
    source: Source,
    records: Sequence[SpaceRecord],
    apertures: Sequence[Aperture],
    bodies: NDArray[np.float64],
) -> tuple[list[SpaceRecord], list[Passage], list[Issue]]:
    """Rooms with those of the corrections' `join` made one, and the passages left between rooms.

    Args: apertures, bodies: see `bim.ifc.passages`.
    """
    openings = passages(apertures, records, bodies)
    records, issues = list(records), []
    for names in source.corrections.join:
        parts = list({r.guid: r for r in (_named(records, n, source) for n in names)}.values())
        one, why = _one_room(parts, openings)
        if one is None:
            values = {"rooms": tuple(names), "reason": why}
            issues.append(Issue("rooms-not-joined", source.corrections.file or "join", values))
            continue
        records = [r for r in records if r not in parts] + [one]
        openings = passages(apertures, records, bodies)
        issues.append(Issue("rooms-joined", one.solid.guid, {"rooms": tuple(names)}))
    if source.corrections.join_open:
        records, more = _joined_by_size(records, openings)
        issues += more
        openings = passages(apertures, records, bodies)
    return records, openings, [*issues, *_open_pairs(records, openings, source)]


def _open_pairs(
    records: Sequence[SpaceRecord], openings: Sequence[Passage], source: Source
) -> list[Issue]:
    """What there is to say of each pair of rooms that stay open to each other, once."""
    by_pair: dict[frozenset[str], list[Passage]] = {}
    for passage in openings:
        by_pair.setdefault(passage.rooms, []).append(passage)
    named = {record.guid: record for record in records}
    issues = []
    for rooms, of_pair in by_pair.items():
        pair = sorted((named[guid] for guid in rooms), key=lambda room: room.label)
        names = _names_to_join(pair, records)
        values = {
            "rooms": tuple(room.label for room in pair),
            "area": sum(passage.area for passage in of_pair),
            "count": len(of_pair),
            "names": " + ".join(names),
            "quoted": ", ".join(f'"{name}"' for name in names),
            "file": corrections_file(source.path).name,
            "limit": LARGEST_DOOR,
        }
        issues.append(Issue("rooms-open-to-each-other", of_pair[0].opening, values))
    return issues


def _joined_by_size(
    records: list[SpaceRecord], openings: Sequence[Passage]
) -> tuple[list[SpaceRecord], list[Issue]]:
    """Rooms with those made one that openings larger than a door lead between."""
    large = [passage for passage in openings if passage.is_large]
    number = {record.guid: i for i, record in enumerate(records)}
    rows, columns = (
        np.array([[number[r] for r in passage.rooms] for passage in large]).reshape(-1, 2).T
    )
    links = coo_array((np.ones(len(large)), (rows, columns)), shape=(len(records),) * 2)
    _, group = connected_components(links, directed=False)
    rooms, issues = [], []
    for members in (np.flatnonzero(group == i) for i in np.unique(group)):
        parts = [records[i] for i in members]
        if len(parts) == 1:
            rooms += parts
            continue
        one, why = _one_room(parts, large)
        names = tuple(part.label for part in parts)
        widest = max(
            passage.area for passage in large if passage.rooms <= {part.guid for part in parts}
        )
        values = {"rooms": names, "area": widest, "limit": LARGEST_DOOR, "reason": why}
        if one is None:
            issues.append(Issue("rooms-not-joined-by-size", parts[0].guid, values))
            rooms += parts
            continue
        rooms.append(one)
        issues.append(Issue("rooms-joined-by-size", one.guid, values))
    return rooms, issues


def _one_room(
    parts: list[SpaceRecord], openings: Sequence[Passage]
) -> tuple[SpaceRecord | None, Phrase | str]:
    """One room of several, or why there is none."""
    try:
        one = _joined(parts, openings) if len(parts) > 1 else None
    except RoomError as error:
        return None, str(error)
    return one, "" if one is not None else Phrase("no-opening-between")


def _named(records: Sequence[SpaceRecord], name: str, source: Source) -> SpaceRecord:
    """The room of that name; `DataError` lists the nearest where there is none or several."""
    try:
        return item_named(records, name, "room")
    except (UnknownName, AmbiguousName) as error:
        file = source.corrections.file or source.path
        raise DataError(str(error.args[0]), file=file, field="join") from None


def _names_to_join(pair: Sequence[SpaceRecord], records: Sequence[SpaceRecord]) -> list[str]:
    """The shortest name of each room that is unique and has no plus, which divides names."""
    names = []
    for room in pair:
        stated_names = [room.name, room.label]
        good = (n for n in stated_names if "+" not in n and _is_unique(records, n))
        names.append(next(good, room.guid))
    return names


def _is_unique(records: Sequence[SpaceRecord], name: str) -> bool:
    try:
        return item_named(records, name, "room") is not None
    except (UnknownName, AmbiguousName):
        return False


def _joined(parts: list[SpaceRecord], openings: Sequence[Passage]) -> SpaceRecord | None:
    """One room of several; None where they stay apart."""
    guids = {part.solid.guid for part in parts}
    solids = [packed(part.solid.manifold) for part in parts]
    union = united(solids, [passage.outline for passage in openings if passage.rooms <= guids])
    if union is None:
        return None
    body = unpacked(union)
    first = parts[0]
    name = JOINT.join(part.name for part in parts)
    areas, volumes = ([getattr(p, key) for p in parts] for key in ("stated_area", "stated_volume"))
    return SpaceRecord(
        room_solid(first.solid.guid, name, body),
        name,
        JOINT.join(part.long_name for part in parts if part.long_name),
        first.storey,
        body.volume(),
        None if None in areas else sum(areas),
        None if None in volumes else sum(volumes),
        first.type_name if len({part.type_name for part in parts}) == 1 else "",
    )
