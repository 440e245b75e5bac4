"""Rooms that a file draws several times: gross and net areas, areas by rent.  One of each is kept.

Two spaces are the same room where they share more than half of the smaller one.  What tells the
schemes apart is sought in PredefinedType, ObjectType and the groups (zones, area schemes) of the
spaces, in this order; the scheme with most of these rooms is kept, of several the one of least
volume, since net areas end at the walls' own faces, where light and heat meet them.  Where nothing
tells them apart, the smaller spaces are kept, and those that they fill to 80 % are left out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

import ifcopenshell

from bim.boxes import Boxes
from bim.ifc.spaces import OVERLAPPING, SpaceRecord
from bim.isolated_solids import shared_volumes
from bim.report.issue import Issue, Phrase
from bim.solids import packed
from mitsuba_cfs.processes import ProcessEnded

SAME_ROOM = 0.5  # share of the smaller of two spaces from which they are one room
FILLED = 0.8  # share of a space from which others stand in its place
APART = 0.95  # share of the pairs that differ in what tells schemes apart
TOUCHING = 0.02  # share of the smaller space up to which an overlap is drawing noise
Shared = dict[tuple[int, int], float]  # volume [m3] that two records share, by their numbers
Key = Callable[[ifcopenshell.entity_instance], str]


def one_of_each(
    model: ifcopenshell.file, records: Sequence[SpaceRecord]
) -> tuple[list[SpaceRecord], list[SpaceRecord], list[Issue]]:
    """The spaces with each room once, those left out for that, and what overlaps still."""
    shared, issues = shared_by_pair(records)
    left = set(range(len(records)))
    for name, key in (("PredefinedType", _predefined), ("ObjectType", _object), ("group", _group)):
        gone, chosen = _by_scheme(model, records, _same(records, shared, left), key)
        if gone:
            left -= gone
            values = {
                "attribute": name,
                "schemes": _schemes(gone, records, model, key),
                "count": len(gone),
                "chosen": chosen or Phrase("no-scheme"),
            }
            issues.append(Issue("rooms-of-several-schemes", "IfcSpace", values))
    gone = _filled(records, _same(records, shared, left), shared)
    if gone:
        left -= gone
        values = {"count": len(gone), "rooms": tuple(records[i].label for i in gone)}
        issues.append(Issue("rooms-drawn-again", "IfcSpace", values))
    for (i, j), volume in shared.items():
        a, b = records[i], records[j]
        if {i, j} <= left and volume > TOUCHING * min(a.volume, b.volume):
            overlap = {"room": a.solid.name, "other": b.solid.name, "volume": volume}
            issues.append(Issue(OVERLAPPING, a.guid, overlap))
    kept = [record for i, record in enumerate(records) if i in left]
    return kept, [record for i, record in enumerate(records) if i not in left], issues


def shared_by_pair(records: Sequence[SpaceRecord]) -> tuple[Shared, list[Issue]]:
    """Volume [m3] that each pair of spaces shares, if any, and what could not be computed."""
    near: dict[int, list[int]] = {i: [] for i in range(len(records))}
    for i, j in Boxes.of([record.solid for record in records]).pairs():
        near[i].append(j)
    bodies = {i: packed(records[i].solid.manifold) for i in near}
    items = [(bodies[i], [bodies[j] for j in others]) for i, others in near.items() if others]
    volumes = iter(shared_volumes(items))
    by_pair, issues = {}, []
    for i, others in near.items():
        shared = next(volumes) if others else []
        if isinstance(shared, ProcessEnded):
            values = {"room": records[i].solid.name, "reason": str(shared)}
            issues.append(Issue("overlap-not-computed", records[i].guid, values))
            continue
        by_pair |= {(i, j): volume for j, volume in zip(others, shared, strict=True) if volume > 0}
    return by_pair, issues


def _same(records: Sequence[SpaceRecord], shared: Shared, left: set[int]) -> list[tuple[int, int]]:
    return [
        pair
        for pair, volume in shared.items()
        if set(pair) <= left and volume > SAME_ROOM * min(records[i].volume for i in pair)
    ]


def _by_scheme(
    model: ifcopenshell.file,
    records: Sequence[SpaceRecord],
    same: Sequence[tuple[int, int]],
    key: Key,
) -> tuple[set[int], str]:
    """Spaces whose room another scheme draws too, and that scheme; none where `key` is alike."""
    involved = {i for pair in same for i in pair}
    scheme = {i: key(_entity(model, records[i])) for i in involved}
    differing = sum(scheme[i] != scheme[j] for i, j in same)
    if not same or differing < APART * len(same):
        return set(), ""
    count = Counter(scheme.values())
    volume = {name: sum(records[i].volume for i in involved if scheme[i] == name) for name in count}
    chosen = min(count, key=lambda name: (-count[name], volume[name], name))
    gone = {
        i
        for pair in same
        for i, other in (pair, pair[::-1])
        if scheme[i] != chosen and scheme[other] == chosen
    }
    return gone, chosen


def _filled(
    records: Sequence[SpaceRecord], same: Sequence[tuple[int, int]], shared: Shared
) -> set[int]:
    """Spaces that smaller ones, or earlier ones of their size, fill."""
    gone: set[int] = set()
    involved = sorted({i for pair in same for i in pair}, key=lambda i: (records[i].volume, i))
    for place, i in enumerate(involved):
        before = [j for j in involved[:place] if j not in gone]
        covered = sum(shared.get((min(i, j), max(i, j)), 0.0) for j in before)
        if covered > FILLED * records[i].volume:
            gone.add(i)
    return gone


def _schemes(
    gone: set[int], records: Sequence[SpaceRecord], model: ifcopenshell.file, key: Key
) -> tuple[Phrase, ...]:
    count = Counter(key(_entity(model, records[i])) for i in gone)
    return tuple(
        Phrase("scheme", {"name": name or Phrase("no-scheme"), "count": number})
        for name, number in sorted(count.items())
    )


def _entity(model: ifcopenshell.file, record: SpaceRecord) -> ifcopenshell.entity_instance:
    guid, _, step_id = record.guid.partition("-")
    return model.by_id(int(step_id)) if step_id else model.by_guid(guid)


def _predefined(space: ifcopenshell.entity_instance) -> str:
    return getattr(space, "PredefinedType", None) or ""


def _object(space: ifcopenshell.entity_instance) -> str:
    return space.ObjectType or ""


def _group(space: ifcopenshell.entity_instance) -> str:
    """Names of the zones and other groups that a space is assigned to."""
    groups = [
        relation.RelatingGroup.Name or ""
        for relation in getattr(space, "HasAssignments", None) or ()
        if relation.is_a("IfcRelAssignsToGroup")
    ]
    return ", ".join(sorted(groups))
