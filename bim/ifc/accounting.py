"""The account of an IFC file: rooms by storey, glass to the outdoors with a room, open edges."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from bim.account import Account, StoreyAccount
from bim.ifc.defects import DRAWN_TWICE
from bim.ifc.glass_of_rooms import GlassAccount, GlassOfRooms
from bim.ifc.project import storey_of, storeys_in
from bim.ifc.source import Source
from bim.ifc.spaces import OVERLAPPING, REMOVED, SpaceRecord
from bim.ifc.transparent import NO_GLASS
from bim.model import Space
from bim.names import label_of
from bim.outdoors import shut_in_area
from bim.report.issue import Issue
from bim.shell import open_edges


def account_of(
    source: Source,
    read: Sequence[SpaceRecord],
    built: Sequence[Space],
    glass: GlassOfRooms,
    issues: Sequence[Issue],
    *,
    repeated: Sequence[str] = (),
) -> Account:
    """How much of a file was imported.

    Args:
        read: the spaces that are rooms, before any were joined, or those found from geometry.
        built: the finished rooms.
        repeated: GUIDs of spaces that draw a room again: not counted, nor are such windows.
    """
    absent = {*repeated, *(p.where for p in issues if p.code == REMOVED)}
    drawn = [s for s in source.model.by_type("IfcSpace") if s.GlobalId not in absent]
    failed = {p.where for p in issues if p.effect.lost == "room"}
    kept = [record for record in read if record.guid not in failed]
    guids = {record.guid.split("-")[0] for record in kept}
    from_geometry = not any(space.GlobalId in guids for space in drawn) and bool(kept)
    missing = [s for s in drawn if s.GlobalId not in guids] if not from_geometry else []
    used: Counter[str] = Counter()
    for window in (window for space in built for window in space.windows):
        used[window.guid] += window.area
    again = {p.where for p in issues if p.code == DRAWN_TWICE}
    panes = [
        one for one in glass.glass if one.out > 0 and (used[one.guid] or one.guid not in again)
    ]
    lost = {one.guid: one.out - one.used for one in panes if one.out - one.used > 0.01}
    low = {one.guid for one in panes if one.low is not None}
    return Account(
        _storeys(
            source, kept, panes, used, Counter(map(storey_of, drawn)) if not from_geometry else None
        ),
        len(panes),
        sum(used[one.guid] > 0 for one in panes),
        sum(min(used[one.guid], one.out) for one in panes if one.assumed),
        sum(area for guid, area in lost.items() if guid in low),
        sum(area for guid, area in lost.items() if guid not in low),
        sum(p.effect.glass for p in issues if p.code in NO_GLASS),
        glass.closed,
        tuple(
            f"{p.values['room']} + {p.values['other']} ({p.values['volume']:.2f} m3)"
            for p in issues
            if p.code == OVERLAPPING
        ),
        tuple(sorted({one.low.label for one in panes if one.low is not None})),
        tuple(label_of(s.Name or "", s.LongName or "", s.GlobalId) for s in missing),
        tuple(space.label for space in built if open_edges(space.shell)),
        from_geometry,
        any(p.code == "file-cut-off" for p in issues),
        tuple(space.label for space in built if space.raised),
        shut_in_area(issues),
        tuple(space.label for space in built if _has_inner_glass_only(space)),
    )


def _has_inner_glass_only(space: Space) -> bool:
    panes = (face.pane for face in space.faces if face.pane is not None)
    return not space.windows and any(not pane.is_open for pane in panes)


def _storeys(
    source: Source,
    rooms: Sequence[SpaceRecord],
    panes: Sequence[GlassAccount],
    used: Mapping[str, float],
    drawn: Counter[str] | None,
) -> tuple[StoreyAccount, ...]:
    """Storeys that hold rooms, spaces or glass, in the file's order.

    Args:
        used: glass before a room [m2] by GUID.
        drawn: spaces of the file by storey; None where the rooms were found from geometry.
    """
    count = Counter(record.storey for record in rooms)
    spaces = count if drawn is None else drawn
    out: Counter[str] = Counter()
    lit: Counter[str] = Counter()
    for one in panes:
        out[one.storey] += one.out
        lit[one.storey] += min(used[one.guid], one.out)
    names = [storey.Name or "" for storey in storeys_in(source.model)]
    held = [*dict.fromkeys([*names, *spaces, *out])]
    return tuple(
        StoreyAccount(name, count[name], spaces[name], float(out[name]), float(lit[name]))
        for name in held
        if spaces[name] or out[name] > 0.01
    )
