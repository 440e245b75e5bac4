"""Spaces of an IFC file that are open to the air: balconies, loggias, terraces, courtyards.

A space is outdoors where most of its top is under the open sky.  A roof that is merely missing in
the file makes no terrace: it counts as open only where the file draws what covers other spaces as
high, at least as many, or where the sides are open too.  Under a roof it is outdoors where much of
its sides is open to the air: rays from a little inside of them meet neither an element nor another
space within a wall's depth, behind is open air, and some level line across the side is open, as
over a parapet (holes in a wall are windows that the file lost).  As a facade may be missing in a
file, a window between the space and another one must confirm that, or the name of the space
(`OUTDOOR_NAMES`), for which less of the boundary has to be open.  Corrections come before all that.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
import shapely.affinity
from numpy.typing import NDArray

from bim.boxes import Boxes
from bim.ifc.spaces import OUTDOORS, SpaceRecord
from bim.names import plain_text
from bim.neighbours import is_open
from bim.planes import Facet
from bim.rays import RayMesh, ray_mesh
from bim.report.issue import Effect, Issue, Phrase
from bim.solids import triangles_of

UNCOVERED = 0.7  # share of the top under the open sky from which a space has no roof
COVERED = 0.3  # and up to which it has one
WALLLESS = 0.5  # share of open sides from which a missing roof is no slip of the file
OPEN_SIDES = 0.2  # share of open sides from which a space is outdoors under a roof
ACROSS = 0.8  # share of a level line across a side that is open from which the side is
HINTED = 0.1  # the same for a space that has the name of one
HINTED_TOP = 0.4  # share of the top under the open sky, likewise
SIDE_REACH = 1.0  # how far from a side its wall may be [m]
INSIDE = 0.3  # rays start this far inside: rooms drawn into their walls and roof [m]
WALL = 0.6  # a window this far from a space may be in its wall [m]
SAME_TOP = 1.0  # spaces that end so much lower than another one are below it [m]
STEPS = 7  # rays along either side of a facet
SMALLEST = 0.3  # facets without such an area are not asked [m2]
OUTDOOR_NAMES = re.compile(
    r"\b(balcon|balkon|balkong|loggia|logia|terras|terraz|terrac|taras|terass|patio|porch|veranda"
    r"|courtyard|court yard|innenhof|lichthof|hof\b|cour\b|cour interieure|cortil|binnenplaats"
    r"|dziedzin|dvor|dvur|nadvori|gard\b|innergard|atriumgard|dachgarten|roof garden|deck\b"
    r"|outdoor|exterior|aussen|exterieur|esterno|externo|buiten|carport|freisitz|laubengang"
    r"|coursive|azotea|varanda|sacada|quintal|erkely|udvar|parveke|terassi|piha|avlu|teras"
    r"|балкон|лоджи|террас|веранд|двор)|ベランダ|バルコニー|テラス|中庭|阳台|陽台|露台|庭院|天井院"
)


@dataclass(frozen=True, slots=True)
class Openness:
    """Shares of a space's boundary that are open, by area."""

    top: float  # under the open sky
    sides: float  # to the air


def open_spaces(
    records: Sequence[SpaceRecord],
    building: RayMesh,
    indoors: Collection[str],
    windows: Sequence[NDArray[np.float64]] = (),
) -> tuple[list[SpaceRecord], list[Issue]]:
    """The spaces that are rooms; those that are outdoors are issues.

    Args:
        indoors: GUIDs of spaces that are rooms by the corrections.
        windows: triangles [N, 3, 3] of each window of the file.
    """
    solids = [record.solid for record in records]
    boxes, glass = Boxes.of(solids), Boxes.of_triangles(windows)
    shares = {record.guid: _openness(record, records, boxes, building) for record in records}
    rooms, issues = [], []
    for record in records:
        reason = _reason(record, records, shares, boxes, glass)
        if reason is None or record.guid in indoors:
            rooms.append(record)
            continue
        values = {"room": record.solid.name, "volume": record.volume, "reason": reason}
        issues.append(Issue(OUTDOORS, record.guid, values, Effect("room")))
    return rooms, issues


def _reason(
    record: SpaceRecord, records: Sequence[SpaceRecord], shares: Mapping[str, Openness], boxes: Boxes, windows: Boxes
) -> Phrase | None:
    """Why a space is outdoors; None for a room.

    Args: boxes: of the spaces.
    """
    share, named = shares[record.guid], _has_outdoor_name(record)
    values = {"top": 100 * share.top, "sides": 100 * share.sides}
    if share.top > UNCOVERED:
        high = [r for r in records if r.solid.high[2] > record.solid.high[2] - SAME_TOP]
        tops = np.array([shares[r.guid].top for r in high])
        drawn = np.sum(tops < COVERED) >= np.sum(tops > UNCOVERED)
        # nothing is outdoors in a file that draws no building
        built = any(s.top <= UNCOVERED or s.sides <= WALLLESS for s in shares.values())
        if drawn or named or (share.sides > WALLLESS and built):
            return Phrase("open-above", values)
    if named and (share.top > HINTED_TOP or share.sides > HINTED):
        return Phrase("open-and-named", values)
    if share.sides > OPEN_SIDES and _has_inner_window(record, boxes, windows):
        return Phrase("open-sides", values)
    return None


def _has_inner_window(record: SpaceRecord, boxes: Boxes, windows: Boxes) -> bool:
    """Whether a window is between a space and another one.

    Args: boxes: of all spaces.
    """
    for one in windows.near(record.solid.low, record.solid.high, WALL):
        low, high = windows.low[one], windows.high[one]
        around = np.all((low > boxes.low - WALL) & (high < boxes.high + WALL), axis=1)
        beside = np.all((low > record.solid.low - WALL) & (high < record.solid.high + WALL))
        if beside and around.sum() > 1:
            return True
    return False


def _has_outdoor_name(record: SpaceRecord) -> bool:
    """Whether the name of a space says that it is outdoors."""
    return OUTDOOR_NAMES.search(plain_text(f"{record.name} {record.long_name}")) is not None


def _openness(record: SpaceRecord, records: Sequence[SpaceRecord], boxes: Boxes, building: RayMesh) -> Openness:
    facets = [f for f in record.solid.facets if f.polygon.area > SMALLEST]
    upper = [facet for facet in facets if facet.plane.normal[2] > 0.3]
    sides = [facet for facet in facets if abs(facet.plane.normal[2]) <= 0.3]
    around = boxes.near(record.solid.low, record.solid.high, SIDE_REACH)
    beside = (records[index] for index in around if records[index].guid != record.guid)
    near = [triangles_of(other.solid.manifold)[0] for other in beside]
    others = ray_mesh(np.concatenate([np.empty((0, 3, 3)), *near]))
    above = [(_under_sky(f, float(record.solid.low[2]), building), f.polygon.area) for f in upper]
    free_sides = [(_free(f, building, others), f) for f in sides]
    return Openness(
        _share(above), _share([(_open_across(free, f, building), f.polygon.area) for free, f in free_sides])
    )


def _share(parts: Sequence[tuple[float, float]]) -> float:
    area = sum(weight for _, weight in parts)
    return sum(share * weight for share, weight in parts) / area if area > 0 else 0.0


def _under_sky(facet: Facet, floor: float, building: RayMesh) -> float:
    """Share of a top facet over which nothing is, from halfway up: it may be above its roof."""
    start, _ = facet_grid(facet)
    start[:, 2] = np.minimum(start[:, 2] - INSIDE, 0.5 * (start[:, 2] + floor))
    _, hit = building.first_hits(start, np.tile([0.0, 0.0, 1.0], (len(start), 1)))
    return float(np.mean(hit < 0))


def _free(facet: Facet, building: RayMesh, others: RayMesh) -> NDArray[np.bool_]:
    """Whether a ray from each point [N] of a side meets neither an element nor another space."""
    points, _ = facet_grid(facet)
    directions = np.tile(facet.plane.normal, (len(points), 1))
    start = points - INSIDE * directions
    _, hit = building.first_hits(start, directions, SIDE_REACH + INSIDE)
    _, other = others.first_hits(start, directions, SIDE_REACH + INSIDE)
    return (hit < 0) & (other < 0)


def _open_across(free: NDArray[np.bool_], facet: Facet, building: RayMesh) -> float:
    """Share of a side that is open to the air; 0 for one with holes, as a wall without windows.

    Args: free: of its points [N], whether nothing is beyond.
    """
    points, rows = facet_grid(facet)
    levels = np.unique(rows)
    if max((float(np.mean(free[rows == row])) for row in levels), default=0.0) < ACROSS:
        return 0.0
    outside = points[free][np.argmax(points[free][:, 2])] + SIDE_REACH * facet.plane.normal
    return float(np.mean(free)) if is_open(outside, facet.plane.normal, building) else 0.0


def facet_grid(facet: Facet) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points [N, 3] spread over a facet, and the row [N] of each, level where it is upright."""
    up = facet.plane.to_plane(facet.plane.origin + np.array([[0.0, 0.0, 1.0]]))[0, :2]
    angle = np.arctan2(*up) if np.linalg.norm(up) > 1e-6 else 0.0
    turned = shapely.affinity.rotate(facet.polygon, angle, (0.0, 0.0), use_radians=True)
    low_x, low_y, high_x, high_y = turned.bounds
    steps = (np.arange(STEPS) + 0.5) / STEPS
    x, y = np.meshgrid(low_x + steps * (high_x - low_x), low_y + steps * (high_y - low_y))
    inside = shapely.contains_xy(turned, x.ravel(), y.ravel())
    flat = np.column_stack([x.ravel(), y.ravel()])[inside]
    rows = np.repeat(np.arange(STEPS), STEPS)[inside]
    if not len(flat):
        flat, rows = shapely.get_coordinates(shapely.point_on_surface(turned)), np.zeros(1, int)
    c, s = np.cos(angle), np.sin(angle)
    return facet.plane.to_world(flat @ np.array([[c, -s], [s, c]])), rows
