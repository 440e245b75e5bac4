"""A building from a gbXML file: `read_gbxml`.

A surface belongs to the one or two spaces that it names; for the second one it is turned round.
Openings lie in the plane of their surface.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bim.defaults import FACADE_REFLECTANCE
from bim.drawn_building import DrawnModel, drawn_building
from bim.gbxml.constructions import Constructions
from bim.gbxml.document import Document, read_document
from bim.gbxml.use import UseReader
from bim.model import Building, Element
from bim.planes import newell_normal
from bim.polygon_rooms import DrawnFace, DrawnOpening, DrawnRoom, triangles_of_rings
from bim.report.issue import Issue

KINDS = {  # of a surface: kind of the face of its first room, and what lies beyond with one room
    "InteriorWall": ("wall", "adiabatic"),
    "ExteriorWall": ("wall", "outside"),
    "UndergroundWall": ("wall", "ground"),
    "Roof": ("", "outside"),
    "Ceiling": ("", "adiabatic"),
    "UndergroundCeiling": ("", "ground"),
    "InteriorFloor": ("", "adiabatic"),
    "RaisedFloor": ("floor", "outside"),
    "ExposedFloor": ("floor", "outside"),
    "SlabOnGrade": ("floor", "ground"),
    "UndergroundSlab": ("floor", "ground"),
    "Air": ("", "adiabatic"),
    "EmbeddedColumn": ("wall", "adiabatic"),
}
OUTDOORS = ("Shade", "FreestandingColumn")
LEVEL = 0.7  # a surface whose normal is so near to the vertical is no wall, whatever its type says
REVEAL = 1.0  # but for strips narrower than this [m]: sill and head of a window's recess
DOORS = ("NonSlidingDoor", "Air")
GLAZED = ("FixedWindow", "OperableWindow", "FixedSkylight", "OperableSkylight", "SlidingDoor")


def read_gbxml(
    path: str | PathLike[str], *, join: Sequence[str] = (), furniture: bool = False
) -> Building:
    """The building of a gbXML file, in metres, turned to true north.

    Read are spaces, surfaces, openings, shades, constructions with layers, window types, location;
    people, lamps, equipment, outdoor air and set points of spaces and zones, with their schedules.

    Args:
        join: rooms to make one, as "Hall + Living"; air between them goes.
        furniture: not in gbXML.

    Raises: `DataError` that names file, element and field; what the model lacks is in the
        building's `issues`.
    """
    path = Path(path)
    document = read_document(path)
    building = drawn_building(_Reader(document).drawn(), join=join, furniture=furniture)
    reader = UseReader(document)
    uses = {space.guid: reader.use(space) for space in building.spaces}
    known = {guid: use for guid, use in uses.items() if use is not None}
    return replace(building, uses=known, issues=(*building.issues, *reader.issues))


class _Reader:
    """A document with what its surfaces refer to."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.constructions = Constructions(document)
        self.issues: list[Issue] = []
        self.level: Counter[str] = Counter()  # surfaces that lie level, by the type of wall named
        self.turn = self._turn()

    def drawn(self) -> DrawnModel:
        """The document as polygons."""
        document, root = self.document, self.document.root
        spaces: dict[str, ElementTree.Element] = {}
        for space in document.all("Campus/Building/Space"):
            if spaces.setdefault(space.get("id", ""), space) is not space:
                raise document.fault("is the id of another space too", space, "id")
        faces: dict[str, list[DrawnFace]] = {guid: [] for guid in spaces}
        elements: list[Element] = []
        unplaced: Counter[str] = Counter()
        for surface in document.all("Campus/Surface"):
            ring = document.ring(surface)
            if ring is None:
                raise document.fault("has no polygon", surface, "PlanarGeometry/PolyLoop")
            beside = self._beside(surface, spaces)
            kind = surface.get("surfaceType", "")
            self._note_glass(surface, of_room=kind not in OUTDOORS and bool(beside))
            if kind in OUTDOORS or not beside:
                elements += self._shade(surface, ring @ self.turn.T)
            elif kind not in KINDS:
                unplaced[kind] += 1
            else:
                for number, guid in enumerate(beside):
                    faces[guid].append(self._face(surface, ring @ self.turn.T, beside, number))
        self.issues += [
            Issue("surfaces-of-unknown-type", document.file.name, {"count": n, "type": k[:40]})
            for k, n in unplaced.items()
        ]
        self.issues += [
            Issue("walls-level", document.file.name, {"count": n, "type": k})
            for k, n in self.level.items()
        ]
        path = "Campus/Building/BuildingStorey"
        storeys = {guid: _name(one) for guid, one in document.by_id((path,))[path].items()}
        rooms = tuple(
            self._room(one, faces[guid], storeys)
            for guid, one in spaces.items()
            if faces[guid] or not self._is_empty(one)
        )
        places = (("Latitude", 90.0), ("Longitude", 180.0), ("Elevation", 1e5))
        latitude, longitude, elevation = (self._location(*place) for place in places)
        campus = root.find("Campus")
        name = "" if campus is None else _name(campus)
        return DrawnModel(
            document.file, name or document.file.stem, rooms, tuple(elements),
            issues=(*self.issues, *self.constructions.issues),
            latitude_deg=latitude, longitude_deg=longitude,
            elevation=(elevation or 0.0) * document.length,
        )  # fmt: skip

    def _location(self, field: str, most: float) -> float | None:
        found = self.document.root.find(f"Campus/Location/{field}")
        if found is None or not (found.text or "").strip():
            return None
        return self.document.optional(
            lambda: self.document.number(found, least=-most, most=most), self.issues
        )

    def _turn(self) -> NDArray[np.float64]:
        """Rotation [3, 3] from the model's axes to the world's, by CADModelAzimuth."""
        azimuth = self._location("CADModelAzimuth", 360.0)
        if not azimuth:
            return np.eye(3)
        values = {"azimuth": azimuth}
        self.issues.append(Issue("model-turned", self.document.file.name, values))
        c, s = np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))
        return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])

    def _beside(
        self, surface: ElementTree.Element, spaces: dict[str, ElementTree.Element]
    ) -> list[str]:
        """The spaces that a surface names, each once."""
        named = [one.get("spaceIdRef", "") for one in surface.iterfind("AdjacentSpaceId")]
        for name in named:
            if name not in spaces:
                raise self.document.fault(f"no Space {name!r:.60}", surface, "AdjacentSpaceId")
        return list(dict.fromkeys(named))[:2]

    def _note_glass(self, surface: ElementTree.Element, *, of_room: bool) -> None:
        """Report a surface whose construction transmits light, and openings of shades."""
        materials = [surface.get("constructionIdRef", "")]
        materials = materials if self.constructions.transmittance(surface) else []
        if not of_room:
            materials += [_name(opening) for opening in surface.iterfind("Opening")]
        for material in materials:
            values = {"element": _name(surface), "material": material}
            self.issues.append(Issue("shade-taken-as-opaque", surface.get("id", ""), values))

    def _face(
        self,
        surface: ElementTree.Element,
        ring: NDArray[np.float64],
        beside: Sequence[str],
        number: int,
    ) -> DrawnFace:
        """The surface as the face of one of its rooms; number 1 sees its other side."""
        guid, kind = surface.get("id", ""), surface.get("surfaceType", "")
        face_kind, alone = KINDS[kind]
        between = len(beside) == 2
        finish = self.constructions.finish(surface.get("constructionIdRef"))
        if face_kind == "wall" and _is_slab(ring):  # OpenStudio's type of what is adiabatic
            face_kind = ""
            self.level[kind] += not number
        if number:
            ring, finish = ring[::-1], finish.turned()
            guid, face_kind = f"{guid}-2", face_kind if face_kind == "wall" else ""
        return DrawnFace(
            guid, _name(surface), face_kind, (ring,), "space" if between else alone,
            beside[1 - number] if between else None, finish,
            tuple(
                one
                for k, opening in enumerate(surface.iterfind("Opening"))
                if (one := self._opening(opening, f"{surface.get('id')}-opening-{k}", number))
            ),
            kind == "Air",
        )  # fmt: skip

    def _opening(
        self, opening: ElementTree.Element, without_id: str, number: int
    ) -> DrawnOpening | None:
        ring, guid = self.document.ring(opening), opening.get("id") or without_id
        kind = opening.get("openingType", "")
        if ring is None or kind == "Air":
            if not number:
                code = "opening-without-polygon" if ring is None else "opening-of-air"
                self.issues.append(Issue(code, guid, {"element": _name(opening)}))
            return None
        guid = f"{guid}-2" if number else guid
        ring = ring @ self.turn.T
        if kind not in (*GLAZED, *DOORS) and not number:
            reason = f"{kind[:40]!r}, expected of {', '.join((*GLAZED, *DOORS))}"
            values = {"field": "openingType", "reason": reason}
            self.issues.append(Issue("value-not-read", opening.get("id") or without_id, values))
        refers = kind not in DOORS and opening.get("windowTypeIdRef")
        if kind in GLAZED or refers or self.constructions.is_glass(opening):
            values, own = self.constructions.window(opening), opening.get("id") or without_id
            return DrawnOpening(guid, _name(opening), ring, glazing=values, both_sides=own)
        finish = self.constructions.finish(opening.get("constructionIdRef"))
        return DrawnOpening(guid, _name(opening), ring, finish.turned() if number else finish)

    def _shade(self, surface: ElementTree.Element, ring: NDArray[np.float64]) -> list[Element]:
        finish = self.constructions.finish(surface.get("constructionIdRef"))
        value = FACADE_REFLECTANCE if finish.outer is None else finish.outer
        triangles = triangles_of_rings((ring,))
        if not len(triangles):
            return []
        guid = surface.get("id", "")
        return [Element(guid, _name(surface), "IfcShadingDevice", triangles, value, value)]

    def _is_empty(self, space: ElementTree.Element) -> bool:
        """Whether a space that no surface bounds is none: OpenStudio writes groups of shades so."""
        if any(space.find(field) is not None for field in ("Area", "Volume", "ShellGeometry")):
            return False
        values = {"room": _name(space)}
        self.issues.append(Issue("space-without-surfaces", space.get("id", ""), values))
        return True

    def _room(
        self, space: ElementTree.Element, faces: Sequence[DrawnFace], storeys: dict[str, str]
    ) -> DrawnRoom:
        area, volume = (
            self.document.optional(partial(self.document.size, space, field), self.issues)
            for field in ("Area", "Volume")
        )
        return DrawnRoom(
            space.get("id", ""), _name(space), tuple(faces),
            storeys.get(space.get("buildingStoreyIdRef", ""), ""),
            stated_area=area or None, stated_volume=volume or None,
        )  # fmt: skip


def _is_slab(ring: NDArray[np.float64]) -> bool:
    """Whether a polygon [N, 3] is nearer to level than to upright, and no strip."""
    normal = newell_normal(ring)
    area = float(np.linalg.norm(normal))
    longest = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1).max()
    return bool(abs(normal[2]) > LEVEL * area) and area > REVEAL * longest


def _name(element: ElementTree.Element) -> str:
    return (element.findtext("Name") or "").strip() or element.get("id", "")
