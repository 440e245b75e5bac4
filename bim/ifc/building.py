"""A building from an IFC file: closed rooms, windows to the outdoors, issues of the model.

Of rooms that a file draws several times (gross and net areas, areas by rent) one is kept.  Two
spaces are the same room where they share more than half of the smaller one.  What tells the schemes
apart is sought in PredefinedType, ObjectType and the groups (zones, area schemes) of the spaces, in
this order; the scheme with most of these rooms is kept, of several the one of least volume, since
net areas end at the walls' own faces, where light and heat meet them.  Where nothing tells them
apart, the smaller spaces are kept, and those that they fill to 80 % are left out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

import ifcopenshell
import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bim.account import Account, StoreyAccount
from bim.apertures import Aperture
from bim.bodies import Bodies
from bim.boundaries import ElementRecord, Finishes, faces_and_windows, floor_area
from bim.boxes import Boxes
from bim.defaults import CLEAR_GLAZING
from bim.fenestration import ShadingState
from bim.ifc.corrections import Corrections, corrections_beside, corrections_file
from bim.ifc.cut_rooms import cut_rooms, room_lids
from bim.ifc.defects import DRAWN_TWICE, model_defects
from bim.ifc.elements import bounding_elements, outdoor_elements
from bim.ifc.fenestration_read import read_fenestration
from bim.ifc.furniture import furnished
from bim.ifc.glass_of_rooms import GlassAccount, GlassOfRooms, apertures_in, glass_of_rooms, lost_glass
from bim.ifc.luminaires import read_luminaires
from bim.ifc.materials import SURFACES
from bim.ifc.open_spaces import open_spaces
from bim.ifc.passages import LARGEST_DOOR, Passage, open_apertures, passages
from bim.ifc.placing import map_georeference
from bim.ifc.project import storey_of, storeys_in
from bim.ifc.raised_rooms import raised_rooms
from bim.ifc.rooms_from_geometry import rooms_from_geometry
from bim.ifc.shapes import Shape, mesh_of
from bim.ifc.source import Progress, Source, read_source
from bim.ifc.space_boundaries import boundary_issues
from bim.ifc.spaces import OVERLAPPING, REMOVED, SpaceRecord, read_spaces, read_zones
from bim.ifc.transparent import NO_GLASS
from bim.isolated_solids import RoomBoundary, room_boundaries, shared_volumes, united
from bim.model import Building, Element, Space
from bim.names import JOINT, AmbiguousName, UnknownName, item_named, label_of
from bim.neighbours import Beyond, Surroundings, cut_by_neighbours, what_lies_beyond
from bim.outdoors import lifted_sites, mirrors_in_view, shut_in_area, simplified, unblinded
from bim.rays import RayMesh, ray_mesh
from bim.report.issue import Effect, Issue, Phrase
from bim.rooms import room_solid
from bim.shell import open_edges
from bim.solids import packed, triangles_of, unpacked
from bim.soundness import agree, soundness_issues
from bim.wall_middles import area_to_wall_middles
from mitsuba_cfs.errors import DataError, RoomError
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
    model: ifcopenshell.file, records: Sequence[SpaceRecord], same: Sequence[tuple[int, int]], key: Key
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
    gone = {i for pair in same for i, other in (pair, pair[::-1]) if scheme[i] != chosen and scheme[other] == chosen}
    return gone, chosen


def _filled(records: Sequence[SpaceRecord], same: Sequence[tuple[int, int]], shared: Shared) -> set[int]:
    """Spaces that smaller ones, or earlier ones of their size, fill."""
    gone: set[int] = set()
    involved = sorted({i for pair in same for i in pair}, key=lambda i: (records[i].volume, i))
    for place, i in enumerate(involved):
        before = [j for j in involved[:place] if j not in gone]
        covered = sum(shared.get((min(i, j), max(i, j)), 0.0) for j in before)
        if covered > FILLED * records[i].volume:
            gone.add(i)
    return gone


def _schemes(gone: set[int], records: Sequence[SpaceRecord], model: ifcopenshell.file, key: Key) -> tuple[Phrase, ...]:
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


def joined_rooms(
    source: Source, records: Sequence[SpaceRecord], apertures: Sequence[Aperture], bodies: NDArray[np.float64]
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


def _open_pairs(records: Sequence[SpaceRecord], openings: Sequence[Passage], source: Source) -> list[Issue]:
    """What there is to say of each pair of rooms that stay open to each other, once."""
    by_pair: dict[frozenset[str], list[Passage]] = {}
    for passage in openings:
        by_pair.setdefault(passage.rooms, []).append(passage)
    named = {record.guid: record for record in records}
    issues = []
    for rooms, of_pair in by_pair.items():
        pair = sorted((named[guid] for guid in rooms), key=lambda room: (room.label, room.guid))
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


def _joined_by_size(records: list[SpaceRecord], openings: Sequence[Passage]) -> tuple[list[SpaceRecord], list[Issue]]:
    """Rooms with those made one that openings larger than a door lead between."""
    large = [passage for passage in openings if passage.is_large]
    number = {record.guid: i for i, record in enumerate(records)}
    rows, columns = np.array([[number[r] for r in passage.rooms] for passage in large]).reshape(-1, 2).T
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
        widest = max(passage.area for passage in large if passage.rooms <= {part.guid for part in parts})
        values = {"rooms": names, "area": widest, "limit": LARGEST_DOOR, "reason": why}
        if one is None:
            issues.append(Issue("rooms-not-joined-by-size", parts[0].guid, values))
            rooms += parts
            continue
        rooms.append(one)
        issues.append(Issue("rooms-joined-by-size", one.guid, values))
    return rooms, issues


def _one_room(parts: list[SpaceRecord], openings: Sequence[Passage]) -> tuple[SpaceRecord | None, Phrase | str]:
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
    panes = [one for one in glass.glass if one.out > 0 and (used[one.guid] or one.guid not in again)]
    lost = {one.guid: one.out - one.used for one in panes if one.out - one.used > 0.01}
    low = {one.guid for one in panes if one.low is not None}
    return Account(
        _storeys(source, kept, panes, used, Counter(map(storey_of, drawn)) if not from_geometry else None),
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


SEARCH = 0.3  # share of the stage "rooms" in which they are found, where the file has no spaces


def read_ifc(
    path: str | PathLike[str],
    *,
    linked: Sequence[str | PathLike[str]] = (),
    corrections: Corrections | None = None,
    join: Sequence[str] = (),
    furniture: bool = False,
    rooms: Sequence[str] = (),
    storeys: Sequence[str] = (),
    progress: Progress | None = None,
) -> Building:
    """The building in an IFC2X3, IFC4 or IFC4X3 file (.ifc, .ifczip).

    Args:
        linked: further files of the same building, see `bim.ifc.linked`; an .ifczip may hold all.
        corrections: elements to omit and to repaint; default: the file
            `<model>.corrections.toml` beside the model, if there is one.
        join: further rooms to merge, as "Hall + Living", without `corrections`;
            "open": those connected by an opening larger than a door.
        furniture: whether furniture is part of the light and views of its room.
        rooms: names that are asked for: where no name in the file is like one of them, it is
            refused before any geometry is read.
        storeys: names of those that are read, with the next above and below; none: all.
        progress: called with the stage's name and the fraction of it that is done.

    Raises: `DataError` where the file is missing or is no readable IFC; faults inside the model are
        the building's `issues`.
    """
    tell = progress or (lambda stage, fraction: None)
    corrections = corrections_beside(path, join) if corrections is None else corrections
    source = read_source(path, corrections, tell, linked, rooms=rooms, storeys=storeys)
    tell("rooms", 0.0)
    mesh = mesh_of(source.walls)
    drawn, issues = _rooms(source, mesh, lambda part: tell("rooms", SEARCH * part))
    records = drawn.records
    issues = [*source.issues, *model_defects(source.model, source.elements), *issues]
    apertures, more = apertures_in(source)
    issues += more
    glass = glass_of_rooms(source, apertures, records, mesh)
    records, more = raised_rooms(source, records, glass, drawn.covers)
    issues += more
    if any(record.raised for record in records):
        glass = glass_of_rooms(source, apertures, records, mesh)
    elements, finishes, faults = bounding_elements(
        source.model, source.walls, source.placed.rotation, source.damage, materials=source.corrections.materials
    )
    issues += [*glass.issues, *faults]
    around = _surroundings(mesh, source.walls, records, source.ground)
    attached = [*glass.attachments, *(side for passage in drawn.passages for side in passage.sides)]
    by_room = [[a for a in attached if a.room == r.guid] for r in records]
    boundaries = room_boundaries([(r.solid, a) for r, a in zip(records, by_room, strict=True)])
    spaces: list[Space] = []
    boxes = Boxes.of([record.solid for record in records])
    for index, boundary in enumerate(boundaries):
        tell("rooms", SEARCH + (1 - SEARCH) * index / len(records))
        of_boundary, more = _space(index, boundary, records, around, boxes=boxes, elements=elements, finishes=finishes)
        spaces += of_boundary
        issues += more
    again = {issue.where for issue in issues if issue.code == DRAWN_TWICE}
    issues += lost_glass(attached, spaces, again)
    issues += boundary_issues(source, spaces)
    issues += guessed_walls(spaces)
    spaces, more = furnished(source, spaces, wanted=furniture)
    issues += more
    if linked:
        spaces = with_states(spaces, [read_fenestration(one) for one in linked])
    tell("surroundings", 0.0)
    outside, more = _outdoors(source, spaces)
    tell("surroundings", 1.0)
    issues += [*more, *source.damage.issues]
    return Building(
        source.name,
        tuple(spaces),
        outside,
        tuple(dict.fromkeys(issues)),
        source.latitude_deg,
        source.longitude_deg,
        source.elevation,
        Path(path),
        account_of(source, drawn.read, spaces, glass, issues, repeated=[r.guid for r in drawn.repeated]),
        map_georeference(source.model, source.placed, north_is_corrected=source.corrections.north_deg is not None),
        source.placed.matrix(),
        zones=read_zones(source.model, source.damage),
        luminaires=read_luminaires(source),
    )


@dataclass(frozen=True, slots=True)
class _Rooms:
    read: list[SpaceRecord]  # the spaces that are rooms, before any are joined
    records: list[SpaceRecord]  # the rooms
    repeated: list[SpaceRecord]  # spaces that draw a room again
    passages: list[Passage]  # openings between rooms that nothing fills
    covers: list[Shape]  # slabs, roofs and ceilings that end rooms


def _rooms(source: Source, mesh: RayMesh, tell: Callable[[float], None]) -> tuple[_Rooms, list[Issue]]:
    """The spaces that are rooms; found from geometry where the file has none."""
    stated = source.corrections.stated_outdoors(source.model)
    records, issues = read_spaces(
        source.model,
        source.shapes,
        source.quantity_scales(),
        source.damage,
        stated=stated,
        removed=source.corrections.removed(source.model),
        names=source.corrections.named(source.model),
    )
    records, repeated, more = one_of_each(source.model, records)
    issues += more
    indoors = [record.guid for record in records if record.step_id in stated]
    windows = [s.triangles for s in source.elements if s.ifc_class.startswith("IfcWindow")]
    read, more = open_spaces(records, mesh, indoors, windows)
    issues += more
    covers = room_lids(source)
    fixed = source.corrections.heights_as_drawn(source.model)
    read, more = cut_rooms(read, covers, mesh, fixed)
    issues += more
    apertures = open_apertures(source, read, mesh.triangles)
    records, passages, more = joined_rooms(source, read, apertures, mesh.triangles)
    issues += more
    if not records:
        read, more = rooms_from_geometry(source, tell)
        records = read
        issues += more
    return _Rooms(read, records, repeated, passages, covers), issues


def with_states(spaces: Sequence[Space], held: Sequence[Mapping[str, tuple[ShadingState, ...]]]) -> list[Space]:
    """The rooms with what linked files hold for their windows, of the first that has any."""
    states: dict[str, tuple[ShadingState, ...]] = {}
    for one in held:
        states = {**one, **states}
    return [
        replace(space, windows=tuple(replace(w, states=states.get(w.guid, w.states)) for w in space.windows))
        for space in spaces
    ]


def guessed_walls(spaces: Sequence[Space]) -> list[Issue]:
    """Outer walls of which the file does not state all layers: their layers and U, by area."""
    areas: Counter[tuple[str, tuple[Any, ...]]] = Counter()
    for face in (face for space in spaces for face in space.faces):
        known = face.construction.source == "IFC"
        if face.kind == "wall" and face.adjacency == "outside" and not known:
            areas[face.construction.name, face.construction.layers] += face.area
    return [
        Issue(
            "outer-wall-guessed",
            name,
            {
                "wall": name,
                "area": area,
                "u": 1 / (sum(layer.resistance for layer in layers) + SURFACES),
                "layers": tuple(
                    Phrase(
                        "layer",
                        {"mm": 1000 * layer.thickness, "name": layer.name, "conductivity": float(layer.conductivity)},
                    )
                    for layer in layers
                ),
            },
        )
        for (name, layers), area in areas.most_common()
    ]


def _outdoors(source: Source, spaces: Sequence[Space]) -> tuple[tuple[Element, ...], list[Issue]]:
    """The surroundings, without elements that would cover a window."""
    windows = [window for space in spaces for window in space.windows]
    issues = []
    if not windows:
        issues.append(Issue("no-window", source.path.name))
    elements = outdoor_elements(
        source.model,
        source.elements,
        reflectance=source.corrections.surroundings,
        drawn_shades=source.corrections.drawn_shades(source.model),
        panes=CLEAR_GLAZING,
    )
    elements, issues_of_panes = mirrors_in_view(elements, windows)
    elements, more = lifted_sites(elements, windows)
    outdoors = unblinded(elements, spaces)
    traced, fine = simplified(list(outdoors.elements))
    return tuple(traced), [*issues, *issues_of_panes, *more, *outdoors.issues, *fine]


def _surroundings(
    mesh: RayMesh, shapes: Sequence[Shape], records: Sequence[SpaceRecord], ground: float
) -> Surroundings:
    empty = [np.empty((0, 3, 3))]
    rooms = [triangles_of(record.solid.manifold)[0] for record in records]
    counts = [len(shape.triangles) for shape in shapes]
    return Surroundings(
        Bodies(
            mesh,
            np.repeat(np.arange(len(shapes)), counts),
            np.concatenate([np.empty(0, dtype=np.int64), *(shape.item for shape in shapes)]),
        ),
        ray_mesh(np.concatenate(rooms or empty)),
        np.repeat(np.arange(len(rooms)), [len(room) for room in rooms]),
        tuple(record.solid.guid for record in records),
        ground,
    )


def _space(
    index: int,
    boundary: RoomBoundary | RoomError,
    records: Sequence[SpaceRecord],
    around: Surroundings,
    **bounding: Any,
) -> tuple[list[Space], list[Issue]]:
    """The room of a record, none where its boundary cannot be built; as `_closed_space`."""
    try:
        if isinstance(boundary, RoomError):
            raise boundary
        space, issues = _closed_space(index, boundary, records, around, **bounding)
    except RoomError as error:
        solid = records[index].solid
        values = {"room": solid.name, "reason": str(error)}
        return [], [Issue("room-not-closed", solid.guid, values, Effect("room"))]
    return [space], issues


def _closed_space(
    index: int,
    boundary: RoomBoundary,
    records: Sequence[SpaceRecord],
    around: Surroundings,
    *,
    boxes: Boxes,
    elements: Sequence[ElementRecord],
    finishes: Finishes,
) -> tuple[Space, list[Issue]]:
    """The room of a record with its faces and windows, checked to be closed."""
    record = records[index]
    others = [other.solid for other in records]
    try:
        pieces = cut_by_neighbours(record.solid, boundary.pieces, others, boxes)
    except shapely.errors.ShapelyError as error:
        raise RoomError(f"its neighbours cannot be cut out: {error}") from error
    beyond = [
        Beyond((), "outside") if piece.role == "glass" else what_lies_beyond(piece, around, index) for piece in pieces
    ]
    faces, windows, assumed = faces_and_windows(pieces, beyond, elements, finishes)
    area = floor_area(faces)
    middles = None
    if record.stated_area is not None and not agree(area, record.stated_area):
        body = triangles_of(record.solid.manifold)[0]
        middles = area_to_wall_middles(body, pieces, beyond, elements)
        middles = middles if agree(middles, record.stated_area) else None
    space = Space(
        record.guid,
        record.name,
        record.storey,
        boundary.volume,
        area,
        tuple(faces),
        tuple(windows),
        record.volume,
        record.stated_area,
        record.stated_volume,
        record.long_name,
        middles,
        record.type_name,
        record.raised,
        record.cut,
    )
    return space, boundary.issues + _assumptions(record, assumed) + soundness_issues(space)


def _assumptions(record: SpaceRecord, assumed: Counter[str]) -> list[Issue]:
    guid, name = record.solid.guid, record.solid.name
    return [
        Issue(f"{key}-assumed", guid, {"room": name, "count": count}) for key, count in sorted(assumed.items()) if count
    ]
