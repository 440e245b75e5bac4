"""A building from an IFC file: closed rooms, windows to the outdoors, issues of the model."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from bim.bodies import Bodies
from bim.boundaries import ElementRecord, Finishes, faces_and_windows, floor_area
from bim.boxes import Boxes
from bim.defaults import CLEAR_GLAZING
from bim.fenestration import ShadingState
from bim.ifc.accounting import account_of
from bim.ifc.corrections import Corrections, corrections_beside
from bim.ifc.cut_rooms import cut_rooms, room_lids
from bim.ifc.defects import DRAWN_TWICE, model_defects
from bim.ifc.elements import bounding_elements, outdoor_elements
from bim.ifc.fenestration_read import read_fenestration
from bim.ifc.furniture import furnished
from bim.ifc.glass_of_rooms import apertures_in, glass_of_rooms, lost_glass
from bim.ifc.joining import joined_rooms
from bim.ifc.materials import SURFACES
from bim.ifc.open_spaces import open_spaces
from bim.ifc.passages import Passage, open_apertures
from bim.ifc.placing import map_georeference
from bim.ifc.raised_rooms import raised_rooms
from bim.ifc.rooms_from_geometry import rooms_from_geometry
from bim.ifc.schemes import one_of_each
from bim.ifc.shapes import Shape, mesh_of
from bim.ifc.source import Progress, Source, read_source
from bim.ifc.space_boundaries import boundary_issues
from bim.ifc.spaces import SpaceRecord, read_spaces, read_zones
from bim.isolated_solids import RoomBoundary, room_boundaries
from bim.model import Building, Element, Space
from bim.neighbours import Beyond, Surroundings, cut_by_neighbours, what_lies_beyond
from bim.outdoors import lifted_sites, mirrors_in_view, simplified, unblinded
from bim.rays import RayMesh, ray_mesh
from bim.report.issue import Effect, Issue
from bim.solids import triangles_of
from bim.soundness import agree, soundness_issues
from bim.wall_middles import area_to_wall_middles
from mitsuba_cfs.errors import RoomError

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
        source.model,
        source.walls,
        source.placed.rotation,
        source.damage,
        materials=source.corrections.materials,
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
        of_boundary, more = _space(
            index, boundary, records, around, boxes=boxes, elements=elements, finishes=finishes
        )
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
        source.name, tuple(spaces), outside, tuple(dict.fromkeys(issues)),
        source.latitude_deg, source.longitude_deg, source.elevation, Path(path),
        account_of(
            source, drawn.read, spaces, glass, issues, repeated=[r.guid for r in drawn.repeated]
        ),
        map_georeference(
            source.model, source.placed,
            north_is_corrected=source.corrections.north_deg is not None,
        ),
        source.placed.matrix(),
        zones=read_zones(source.model, source.damage),
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Rooms:
    read: list[SpaceRecord]  # the spaces that are rooms, before any are joined
    records: list[SpaceRecord]  # the rooms
    repeated: list[SpaceRecord]  # spaces that draw a room again
    passages: list[Passage]  # openings between rooms that nothing fills
    covers: list[Shape]  # slabs, roofs and ceilings that end rooms


def _rooms(
    source: Source, mesh: RayMesh, tell: Callable[[float], None]
) -> tuple[_Rooms, list[Issue]]:
    """The spaces that are rooms; found from geometry where the file has none."""
    stated = source.corrections.stated_outdoors(source.model)
    records, issues = read_spaces(
        source.model, source.shapes, source.quantity_scales(), source.damage, stated=stated,
        removed=source.corrections.removed(source.model),
        names=source.corrections.named(source.model),
    )  # fmt: skip
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


def with_states(
    spaces: Sequence[Space], held: Sequence[Mapping[str, tuple[ShadingState, ...]]]
) -> list[Space]:
    """The rooms with what linked files hold for their windows, of the first that has any."""
    states: dict[str, tuple[ShadingState, ...]] = {}
    for one in held:
        states = {**one, **states}
    return [
        replace(
            space,
            windows=tuple(replace(w, states=states.get(w.guid, w.states)) for w in space.windows),
        )
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
        Issue("outer-wall-guessed", name, {
            "wall": name, "area": area,
            "u": 1 / (sum(layer.resistance for layer in layers) + SURFACES),
            "layers": tuple(
                f"{1000 * layer.thickness:.0f} mm {layer.name} ({layer.conductivity:.3g} W/mK)"
                for layer in layers
            ),
        })
        for (name, layers), area in areas.most_common()
    ]  # fmt: skip


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
        Beyond((), "outside") if piece.role == "glass" else what_lies_beyond(piece, around, index)
        for piece in pieces
    ]
    faces, windows, assumed = faces_and_windows(pieces, beyond, elements, finishes)
    area = floor_area(faces)
    middles = None
    if record.stated_area is not None and not agree(area, record.stated_area):
        body = triangles_of(record.solid.manifold)[0]
        middles = area_to_wall_middles(body, pieces, beyond, elements)
        middles = middles if agree(middles, record.stated_area) else None
    space = Space(
        record.guid, record.name, record.storey, boundary.volume, area, tuple(faces),
        tuple(windows),
        record.volume, record.stated_area, record.stated_volume, record.long_name, middles,
        record.type_name, record.raised, record.cut,
    )  # fmt: skip
    return space, boundary.issues + _assumptions(record, assumed) + soundness_issues(space)


def _assumptions(record: SpaceRecord, assumed: Counter[str]) -> list[Issue]:
    guid, name = record.solid.guid, record.solid.name
    return [
        Issue(f"{key}-assumed", guid, {"room": name, "count": count})
        for key, count in sorted(assumed.items())
        if count
    ]
