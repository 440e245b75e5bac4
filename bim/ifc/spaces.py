"""IfcSpace as closed solids, with names, storeys and stated quantities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import ifcopenshell
import numpy as np
from numpy.typing import NDArray

from bim.ifc.damage import Damage, type_of
from bim.ifc.project import psets_of, storey_of
from bim.ifc.quantities import QuantityScales, checked_volume, stated_quantities
from bim.ifc.shapes import Shape
from bim.isolated_solids import spaces_of
from bim.names import label_of
from bim.neighbours import sample_points
from bim.planes import Facet
from bim.rays import RayMesh
from bim.report.issue import Effect, Issue, Phrase
from bim.rooms import RoomSolid, room_solid
from mitsuba_cfs.processes import ProcessEnded

SMALLEST_SPACE = 0.2  # smaller spaces are beams or ducts of the wrong class [m3]
UNCOVERED = 0.7  # share of the ceiling under the open sky from which a space has no roof
WALLLESS = 0.5  # share of its sides without anything near from which it has no walls
SIDE_REACH = 1.0  # how far from a side its wall may be [m]
OVERLAPPING = "spaces-overlap"  # code of the issue
INSIDE = 0.3  # rays start this far inside: rooms drawn into their walls and roof [m]


@dataclass(frozen=True, slots=True)
class SpaceRecord:
    """A space of the file with its solid."""

    solid: RoomSolid
    name: str
    long_name: str
    storey: str
    volume: float  # of the solid as drawn [m3]
    stated_area: float | None
    stated_volume: float | None
    type_name: str = ""
    raised: float = 0.0  # of the volume: above the space as drawn, up to what covers it [m3]

    @property
    def guid(self) -> str:
        """GUID of the space."""
        return self.solid.guid

    @property
    def label(self) -> str:
        """Number and name of the space as people use them."""
        return label_of(self.name, self.long_name, self.guid)


def read_spaces(
    model: ifcopenshell.file,
    shapes: dict[int, Shape],
    scales: QuantityScales,
    damage: Damage | None = None,
) -> tuple[list[SpaceRecord], list[Issue]]:
    """Every space that is indoors and has a body; the others are issues."""
    records: list[SpaceRecord] = []
    issues: list[Issue] = []
    seen: set[str] = set()
    spaces = model.by_type("IfcSpace")
    drawn = {space.id(): shapes[space.id()] for space in spaces if space.id() in shapes}
    bodies = spaces_of([shape.triangles for shape in drawn.values()])
    solids = dict(zip(drawn, bodies, strict=True))
    for space in spaces:
        label = label_of(space.Name or "", space.LongName or "", space.GlobalId)
        guid = space.GlobalId
        if guid in seen:
            guid = f"{guid}-{space.id()}"
            values = {"room": label, "guid": guid}
            issues.append(Issue("space-guid-repeated", space.GlobalId, values))
        seen.add(guid)
        psets = psets_of(space, damage)
        if is_outdoors(space, psets):
            issues.append(Issue("space-external", guid, {"room": label}, Effect("room")))
            continue
        if space.id() not in solids:
            issues.append(Issue("space-without-geometry", guid, {"room": label}, Effect("room")))
            continue
        solid = solids[space.id()]
        if solid is None:
            issues.append(Issue("space-encloses-nothing", guid, {"room": label}, Effect("room")))
            continue
        if isinstance(solid, ProcessEnded):
            values = {"room": label, "reason": str(solid)}
            issues.append(Issue("space-not-computed", guid, values, Effect("room")))
            continue
        if solid.volume < SMALLEST_SPACE:
            values = {"room": label, "volume": solid.volume}
            issues.append(Issue("space-too-small", guid, values, Effect("room")))
            continue
        if solid.repair:
            values = {"room": label, "repair": Phrase(solid.repair)}
            issues.append(Issue("space-repaired", guid, values))
        area, volume = stated_quantities(psets, scales)
        volume, slip = checked_volume(volume, solid.volume, psets, scales.length)
        if slip is not None:
            code, values = slip
            issues.append(Issue(code, guid, {"room": label, **values}))
        records.append(
            SpaceRecord(
                room_solid(guid, label, solid.manifold),
                space.Name or space.LongName or space.GlobalId,
                space.LongName or "",
                storey_of(space),
                solid.volume,
                area,
                volume,
                _type_name(space, damage),
            )
        )
    return records, issues


def _type_name(space: ifcopenshell.entity_instance, damage: Damage | None) -> str:
    """What kind of room it is: the name of its IfcSpaceType, else its ObjectType."""
    kind = type_of(space, damage)
    return (kind.Name if kind is not None else space.ObjectType) or ""


def is_outdoors(space: ifcopenshell.entity_instance, psets: dict[str, dict]) -> bool:
    """Whether the file says that a space is external."""
    common = psets.get("Pset_SpaceCommon", {})
    kinds = (
        getattr(space, "InteriorOrExteriorSpace", None),
        getattr(space, "PredefinedType", None),
    )
    return common.get("IsExternal") is True or "EXTERNAL" in kinds


def enclosed_spaces(
    records: Sequence[SpaceRecord], building: RayMesh
) -> tuple[list[SpaceRecord], list[Issue]]:
    """The spaces that building elements enclose; those under the open sky are issues.

    Rays from just below its ceiling go up, rays from its sides go out: a space is outdoors where
    most of both meet nothing.  A room whose roof is only missing in the file is kept.
    """
    kept, issues = [], []
    for record in records:
        facets = record.solid.facets
        upper = [facet for facet in facets if facet.plane.normal[2] > 0.3]
        sides = [facet for facet in facets if abs(facet.plane.normal[2]) <= 0.3]
        roofless = _open_share(upper, np.array([0.0, 0.0, 1.0]), np.inf, building) > UNCOVERED
        if roofless and _open_share(sides, None, SIDE_REACH, building) > WALLLESS:
            values = {"room": record.solid.name}
            issues.append(Issue("space-outdoors", record.solid.guid, values, Effect("room")))
        else:
            kept.append(record)
    return kept, issues


def _open_share(
    facets: Sequence[Facet], direction: NDArray[np.float64] | None, reach: float, building: RayMesh
) -> float:
    """Share of the facets' area with nothing beyond; along their normals without a direction."""
    if not facets or not len(building.triangles):
        return 0.0
    weights = np.array([facet.polygon.area for facet in facets])
    points = [sample_points(facet)[0] for facet in facets]
    index = np.repeat(np.arange(len(facets)), [len(p) for p in points])
    normals = np.array([facet.plane.normal for facet in facets])[index]
    directions = normals if direction is None else np.tile(direction, (len(index), 1))
    start = np.concatenate(points) - INSIDE * directions
    _, hit = building.first_hits(start, directions, reach + INSIDE)
    shares = np.bincount(index, hit < 0) / np.bincount(index)
    return float(np.average(shares, weights=weights))
