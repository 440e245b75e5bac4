"""Spaces that go through the slab, roof or ceiling over them, cut there.

Revit draws rooms to an upper limit, 4 m by default, through whatever is drawn lower.  Where slabs,
roofs and ceilings part the solid of a space, its largest part is the room.  A gallery, or a slab
with an opening for a stair or a shaft, parts nothing; the openings of roofs and ceilings are for
windows and do not count.

A room under a pitched roof may be drawn as a box that reaches through the roof with a part of its
top.  It is cut there if all that the roof parts from it is under the open sky; a dormer is not.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bim.boxes import Boxes
from bim.ifc.open_spaces import facet_grid
from bim.ifc.shapes import Shape, read_shapes
from bim.ifc.source import Source
from bim.ifc.spaces import SpaceRecord
from bim.isolated_solids import parted
from bim.rays import RayMesh, ray_mesh
from bim.report.issue import Issue, Phrase
from bim.rooms import RoomSolid, room_solid
from bim.solids import packed, unpacked
from mitsuba_cfs.processes import ProcessEnded
from mitsuba_cfs.surfaces import area_vectors

THROUGH = 0.1  # a space that ends less far beyond a slab is drawn into it [m]
TOUCHING = 1e-9  # a lid beside a space that overlaps it by less does not cover it [m]
MOSTLY = 0.7  # share of the top of a space that has to lie beyond what cuts it
PARTLY = 0.05  # and from which the room may be one under a pitched roof
OPEN = 0.7  # share of the top of a part under the open sky from which it is outdoors
LEAST_SHOWN = 0.005  # a height that is less is 0.00 m in words [m]
LEVEL = 0.99  # z of the normal of a level face
LEAST_CUT = 0.02  # share of the volume: less is the drawing's
DOWN = np.array([0.0, 0.0, -1.0])


def cut_rooms(
    records: Sequence[SpaceRecord], lids: Sequence[Shape], building: RayMesh, fixed: Collection[int] = ()
) -> tuple[list[SpaceRecord], list[Issue]]:
    """The rooms, those cut that go through what covers them, each with an issue.

    Args:
        lids: of `room_lids`; building: all that may cover a space.
        fixed: STEP ids of spaces whose drawn height holds.
    """
    boxes = Boxes.of_triangles([lid.triangles for lid in lids])
    wholly = {
        index: goes_through(record, lids, boxes) for index, record in enumerate(records) if record.step_id not in fixed
    }
    through = [i for i, all_of_it in wholly.items() if all_of_it or _leaves(records[i], building)]
    if not through:
        return list(records), []
    items = [(packed(records[i].solid.manifold), _near(records[i], lids, boxes)) for i in through]
    result, issues = list(records), []
    for index, parts in zip(through, parted(items), strict=True):
        record = records[index]
        if isinstance(parts, ProcessEnded):
            values = {"room": record.label, "reason": str(parts)}
            issues.append(Issue("room-not-cut", record.guid, values))
            continue
        solids = [room_solid(record.guid, record.solid.name, unpacked(part)) for part in parts]
        if not solids or not (wholly[index] or all(_outdoors(s, building) for s in solids[1:])):
            continue
        solid = solids[0]
        after = solid.manifold.volume()
        if after > (1 - LEAST_CUT) * record.volume:
            continue
        values = {"room": record.label, "before": record.volume, "after": after, "beyond": _beyond(record.solid, solid)}
        issues.append(Issue("room-cut", record.guid, values))
        result[index] = replace(record, solid=solid, volume=after, cut=record.volume - after)
    return result, issues


def _beyond(drawn: RoomSolid, cut: RoomSolid) -> Phrase:
    """Where a space goes beyond what ends the room, in words."""
    top, bottom = float(drawn.high[2] - cut.high[2]), float(cut.low[2] - drawn.low[2])
    over, under = top >= LEAST_SHOWN, bottom >= LEAST_SHOWN
    if over or under:
        key = "beyond-both" if over and under else "beyond-cover" if over else "beyond-floor"
        return Phrase(key, {"top": top, "bottom": bottom})
    sloping = any(LEAST_SHOWN < facet.plane.normal[2] < LEVEL for facet in cut.facets)
    return Phrase("beyond-slope" if sloping else "beyond-part")


def goes_through(record: SpaceRecord, lids: Sequence[Shape], boxes: Boxes) -> bool:
    """Whether most of the top of a space, or of its bottom, is beyond a slab, roof or ceiling.

    Args: boxes: of the lids.
    """
    near = _near(record, lids, boxes)
    if not near:
        return False
    mesh = ray_mesh(np.concatenate(near))
    height = float(record.solid.high[2] - record.solid.low[2])
    for sign in (1.0, -1.0):
        facets = [f for f in record.solid.facets if sign * f.plane.normal[2] > 0.5]
        points = [f.plane.to_world(np.array(f.polygon.representative_point().coords)) for f in facets]
        weights = np.array([f.polygon.area for f in facets])
        if not len(weights):
            continue
        start = np.concatenate(points)
        directions = np.tile(sign * DOWN, (len(start), 1))
        distance, hit = mesh.first_hits(start + THROUGH * directions, directions, height - 0.5)
        if np.average((hit >= 0) & np.isfinite(distance), weights=weights) > MOSTLY:
            return True
    return False


def _leaves(record: SpaceRecord, building: RayMesh) -> bool:
    """Whether a part of the top of a space is under the open sky and has a cover beneath it."""
    height = float(record.solid.high[2] - record.solid.low[2])
    return _open_share(record.solid, building, covered_within=height - 2 * THROUGH) > PARTLY


def _outdoors(solid: RoomSolid, building: RayMesh) -> bool:
    """Whether most of the top of a solid is under the open sky."""
    return _open_share(solid, building) > OPEN


def _open_share(solid: RoomSolid, building: RayMesh, covered_within: float | None = None) -> float:
    """Share of the area of a solid's top that is under the open sky; 0 without a top.

    Args: covered_within: count only what has a cover beneath it within this distance [m].
    """
    area = free = 0.0
    for facet in solid.facets:
        if facet.plane.normal[2] <= 0.5:
            continue
        points, _ = facet_grid(facet)
        counts = _open_above(points, building)
        if covered_within is not None:
            down = np.tile([[0.0, 0.0, -1.0]], (len(points), 1))
            _, below = building.first_hits(points + THROUGH * down, down, covered_within)
            counts &= below >= 0
        area += facet.polygon.area
        free += facet.polygon.area * float(np.mean(counts))
    return free / area if area > 0 else 0.0


def _open_above(points: NDArray[np.float64], building: RayMesh) -> NDArray[np.bool_]:
    """Whether nothing is above each of the points [N, 3]."""
    _, hit = building.first_hits(points, np.tile([[0.0, 0.0, 1.0]], (len(points), 1)))
    return hit < 0


def _near(record: SpaceRecord, lids: Sequence[Shape], boxes: Boxes) -> list[np.ndarray]:
    """Bodies of what may cut a space: inside of its height, over or under it."""
    inside = np.array([TOUCHING, TOUCHING, THROUGH])
    near = boxes.near(record.solid.low + inside, record.solid.high - inside)
    return [lids[index].triangles for index in near]


def room_lids(source: Source) -> list[Shape]:
    """Slabs with their openings, roofs and ceilings without, in the world."""
    roofs = set()
    for one in source.model.by_type("IfcProduct"):
        kind = getattr(one, "PredefinedType", None)
        is_roof = one.is_a("IfcRoof") or (one.is_a("IfcSlab") and kind == "ROOF")
        if is_roof or (one.is_a("IfcCovering") and kind in ("CEILING", "ROOFING")):
            roofs.add(one.id())
    roofs &= set(source.shapes)
    slabs = [s for s in source.elements if s.ifc_class.startswith("IfcSlab")]
    level = [s for s in slabs if s.step_id not in roofs and _is_level(s)]
    everything = {one.id() for one in source.model.by_type("IfcProduct")}
    whole, _ = read_shapes(source.model, without=everything - roofs, cut_openings=False)
    to_world = source.placed.to_world
    return level + [replace(s, triangles=to_world(s.triangles)) for s in whole.values()]


def _is_level(shape: Shape) -> bool:
    vectors = area_vectors(shape.triangles)
    size = np.ptp(shape.triangles.reshape(-1, 3), axis=0)
    total = max(float(np.linalg.norm(vectors, axis=1).sum()), 1e-12)
    return bool(np.abs(vectors[:, 2]).sum() > 0.5 * total and min(size[:2]) > 0.5)
