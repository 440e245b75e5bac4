"""Rooms of an IFC file that has no spaces: the voids that its walls, slabs and roofs enclose."""

from __future__ import annotations

import time
import uuid
from collections.abc import Callable

import ifcopenshell
import ifcopenshell.guid
import manifold3d
import numpy as np
from numpy.typing import NDArray

from bim.enclosure import GAP, LIMIT_S, Enclosed, first_rooms_enclosed
from bim.ifc.damage import placement_of
from bim.ifc.project import length_scale, storeys_in
from bim.ifc.shapes import Shape, read_shapes
from bim.ifc.source import Source
from bim.ifc.spaces import SpaceRecord
from bim.isolated_solids import solids_of
from bim.leaks import leaks
from bim.report.issue import Effect, Issue, Phrase
from bim.rooms import room_solid
from bim.solids import Solid
from mitsuba_cfs.processes import ProcessEnded, answer_apart

BOUNDING = (
    "IfcWall",
    "IfcSlab",
    "IfcRoof",
    "IfcCovering",
    "IfcCurtainWall",
    "IfcPlate",
    "IfcMember",
    "IfcColumn",
    "IfcBeam",
    "IfcFooting",
    "IfcWindow",
    "IfcDoor",
)
WIDER = 0.1  # gaps closed in a second attempt [m]
CAP = 0.2  # thickness of a floor or roof that is put in where the file has none [m]
MOST_LEFT_OUT = 5  # elements that end the search, one after the other, before it is given up
Body = NDArray[np.float64]
Tell = Callable[[float], None]


def rooms_from_geometry(source: Source, tell: Tell) -> tuple[list[SpaceRecord], list[Issue]]:
    """Rooms between the building elements, and what had to be closed to find them.

    Args: tell: called with the fraction done.
    """
    bodies = _uncut_bodies(source)
    where, lacks = source.path.name, _lack_of_spaces(source)
    if not bodies:
        values = {"lack": lacks}
        return [], [Issue("no-walls-for-rooms", where, values, Effect("room"))]
    search = _Search([(shape.guid, label, body) for shape, label, body in bodies], tell)
    upright = [b for shape, _, b in bodies if shape.ifc_class.startswith(("IfcWall", "IfcCurtain"))]
    meshes = [body for *_, body in bodies]
    low, high = _box(meshes)
    wall_low, wall_high = _box(upright or meshes)
    floor = _slab(low, high, wall_low[2] - CAP)
    roof = _slab(low, high, wall_high[2])
    wider = source.corrections.close_gaps or WIDER
    closed = Phrase("gaps-closed", {"gap_mm": 1000 * wider})
    attempts = [([], GAP, Phrase("joined-by-openings")), ([], wider, closed)]
    if upright:  # a roof alone is no building that lacks its floor
        attempts += [([floor], GAP, Phrase("floor-added")), ([floor, roof], GAP, Phrase("floor-and-roof-added"))]
    if upright and source.corrections.close_gaps:
        attempts.append(([floor, roof], wider, closed))
    number, rooms = search.rooms([(more, gap) for more, gap, _ in attempts])
    repair = attempts[number][2]
    if not rooms and not upright:
        issue = Issue("no-walls-for-rooms", where, {"lack": lacks}, Effect("room"))
        return [], [*search.issues, issue]
    if not rooms:
        values = {"lack": lacks, "gap": wider}
        issue = Issue("walls-enclose-nothing", where, values, Effect("room"))
        ends = [_slab(low, high, z, beyond=0.0) for z in (wall_low[2] - CAP, wall_high[2])]
        open_to_air = _leaks([(label, body) for _, label, body in bodies], ends)
        return [], [*search.issues, issue, *open_to_air]
    levels = _storeys(source)
    records = [_record(source, number, room, levels) for number, room in enumerate(rooms, 1)]
    values = {"lack": lacks, "count": len(rooms), "repair": repair}
    return records, [*search.issues, Issue("rooms-from-geometry", where, values)]


def _leaks(bodies: list[tuple[str, Body]], slabs: list[Body]) -> list[Issue]:
    """Where would-be rooms are open to the outside, though floor and roof are added."""
    escapes, size = leaks([*(body for _, body in bodies), *slabs])
    boxes = np.array([(body.min((0, 1)), body.max((0, 1))) for _, body in bodies])
    issues = []
    for leak in escapes:
        apart = np.maximum(boxes[:, 0] - leak.position, leak.position - boxes[:, 1])
        nearest = np.linalg.norm(np.maximum(apart, 0.0), axis=1).argsort(kind="stable")[:2]
        values = {
            "width": max(leak.width, size),
            "size": size,
            "elements": tuple(bodies[i][0].strip() for i in nearest),
            **dict(zip("xyz", map(float, leak.position), strict=True)),
        }
        issues.append(Issue("room-leaks", " ".join(f"{v:.2f}" for v in leak.position), values))
    return issues


class _Search:
    """Asks for the enclosed rooms in a process apart; what ends that process is left out."""

    def __init__(self, bodies: list[tuple[str, str, Body]], tell: Tell) -> None:
        self.issues: list[Issue] = []
        self._bodies, self._tell = bodies, tell
        self._until = time.monotonic() + LIMIT_S

    def rooms(self, attempts: list[tuple[list[Body], float]]) -> tuple[int, list[manifold3d.Manifold]]:
        """Number of the first attempt (bodies besides, gap) that finds rooms, and their solids."""
        for _ in range(MOST_LEFT_OUT + 1):
            left = max(self._until - time.monotonic(), 0.0)  # 0 raises the time limit
            meshes = [body for *_, body in self._bodies]
            try:
                number, enclosed = answer_apart(
                    first_rooms_enclosed, meshes, attempts, limit_s=left, told=self._on_line
                )
            except ProcessEnded as error:
                if not self._leave_out(error):
                    break
                continue
            self._report_limits(enclosed)
            solids = solids_of(enclosed.rooms)
            return number, [solid.manifold for solid in solids if isinstance(solid, Solid)]
        return -1, []

    def _on_line(self, line: str) -> None:
        done, total = map(int, line.split())
        self._tell(done / max(total, 1))

    def _leave_out(self, error: ProcessEnded) -> bool:
        """Name what was in work, and take it out; False where that was no single element."""
        index = int(error.last.split()[0]) if error.last else len(self._bodies)
        if index >= len(self._bodies) or time.monotonic() >= self._until:
            values = {"reason": str(error)}
            issue = Issue("room-search-failed", "IfcSpace", values, Effect("room"))
            self.issues.append(issue)
            return False
        guid, label, _ = self._bodies.pop(index)
        values = {"element": label, "reason": str(error)}
        self.issues.append(Issue("element-not-in-room-search", guid, values))
        return True

    def _report_limits(self, enclosed: Enclosed) -> None:
        for count, code in (
            (enclosed.not_widened, "small-elements-not-widened"),
            (enclosed.hulls, "flat-elements-as-hulls"),
            (enclosed.not_extended, "found-rooms-not-widened"),
        ):
            if count and enclosed.rooms:
                self.issues.append(Issue(code, "IfcSpace", {"count": count}))


def _lack_of_spaces(source: Source) -> Phrase:
    drawn = len(source.model.by_type("IfcSpace"))
    return Phrase("no-space-is-room", {"count": drawn}) if drawn else Phrase("no-spaces")


def _uncut_bodies(source: Source) -> list[tuple[Shape, str, Body]]:
    """The bounding elements, their labels and triangles in the world, openings not cut."""
    filling = {
        relation.RelatedBuildingElement.id() for relation in source.model.by_type("IfcRelFillsElement")
    }  # the walls that host them are closed without them
    wanted = {key for key, shape in source.shapes.items() if shape.ifc_class.startswith(BOUNDING)} - filling
    everything = {one.id() for one in source.model.by_type("IfcProduct")}
    shapes, _ = read_shapes(source.model, without=everything - wanted, cut_openings=False)
    return [(s, f"{s.ifc_class} {s.name}", source.placed.to_world(s.triangles)) for s in shapes.values()]


def _box(bodies: list[Body]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    corners = np.concatenate([body.reshape(-1, 3) for body in bodies])
    return corners.min(axis=0), corners.max(axis=0)


def _slab(low: NDArray[np.float64], high: NDArray[np.float64], bottom: float, *, beyond: float = 1.0) -> Body:
    """A slab over the whole building and so far beyond it [m], `CAP` thick."""
    (x0, y0), (x1, y1) = low[:2] - beyond, high[:2] + beyond
    c = np.array([[x, y, z] for z in (bottom, bottom + CAP) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))])
    quads = [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    return c[[corner for a, b, d, e in quads for corner in ((a, b, d), (a, d, e))]]


def _storeys(source: Source) -> list[tuple[float, str]]:
    """Height in the world and name of each storey, rising."""
    unit = length_scale(source.model)
    levels = []
    for storey in storeys_in(source.model):
        matrix = placement_of(storey, source.damage)
        if matrix is None:
            continue
        z = source.placed.to_world(matrix[:3, 3] * unit)[2]
        levels.append((float(z), storey.Name or ""))
    return sorted(levels)


def _record(source: Source, number: int, room, levels: list[tuple[float, str]]) -> SpaceRecord:
    """A found room as if it had been drawn; its GUID depends on where it lies only."""
    box = np.round(room.bounding_box(), 3)
    name = f"Room {number}"
    seed = f"{source.path.name} {box.tolist()}"
    guid = ifcopenshell.guid.compress(uuid.uuid5(uuid.NAMESPACE_URL, seed).hex)
    below = [label for z, label in levels if z <= box[2] + 0.5]
    storey = below[-1] if below else (levels[0][1] if levels else "")
    solid = room_solid(guid, name, room.as_original())
    return SpaceRecord(solid, name, "", storey, room.volume(), None, None)
