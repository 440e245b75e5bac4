"""The glass of a window or door: its plane, its outline and the outline of its opening."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.boxes import Boxes
from bim.colours import GREY, Colour
from bim.defaults import FRAME_FRACTION
from bim.planes import Plane, plane_through, polygons_of, without_slits
from bim.rays import RayMesh, ray_mesh
from bim.report.issue import Effect, Issue, Phrase
from mitsuba_cfs.surfaces import area_vectors

FLAT = 0.95  # cosine: panes within 18 degrees of the main direction are in its plane
SMALLEST_PANE = 0.01  # less glass than this is a spy hole, not a window [m2]
OUTLINE = 0.004  # round openings become polygons this near [m]
OUT_OF_WALL = 0.05  # glass this far outside its opening's depth is reported [m]
ASTRAY = 0.3  # and from here on moved into the opening's middle [m]
LEAST_WITHIN = 0.3  # of the opening: less that a drawn frame leaves free is no glass
LEAST_FACING = 0.05  # of a body's area: less that faces a direction is a bevel or a handle
BESIDE = 0.05  # parts of a wall this near to an opening are beside it [m]
ONE_WINDOW = 0.3  # glass no farther apart, one before the other, is one window's [m]
MOSTLY = 0.7  # of a glass that is not drawn: where another window has so much of it, it is that's
PANE_JOINT = 0.002  # gaps between drawn panes up to this are no frame [m]


@dataclass(frozen=True, slots=True)
class Filling:
    """A window, door or glazed panel as the file draws it; lengths in metres, world axes."""

    guid: str
    name: str
    ifc_class: str
    triangles: NDArray[np.float64]  # [N, 3, 3]
    transparent: NDArray[np.bool_]  # [N]
    opening: NDArray[np.float64] | None = None  # [M, 3, 3] body of its opening
    host: str | None = None  # GUID of the wall or roof
    frame_width: float | None = None  # lining and sash together, where stated [m]
    glazed_fraction: float | None = None  # of the opening, where stated
    u_value: float | None = None
    g_value: float | None = None
    visible_transmittance: float | None = None
    type_name: str = ""
    frame_reflectance: float | None = None
    solar_transmittance: float | None = None
    panes: int | None = None
    is_open: bool = False  # nothing fills it: a doorway between two rooms
    frame_hue: Colour = GREY
    beside: NDArray[np.float64] | None = None  # [K, 3, 3] of its host, near the opening
    glass_area: float | None = None  # by the corrections, whatever is drawn [m2]

    @property
    def is_door(self) -> bool:
        """Whether it is a door, which may have no glass at all."""
        return self.ifc_class.startswith("IfcDoor")


@dataclass(frozen=True, slots=True)
class Aperture:
    """A filling flattened into one plane; the plane's normal may still point either way."""

    filling: Filling
    plane: Plane
    opening: shapely.Geometry  # outline of the whole opening in the plane [m]
    glass: shapely.Geometry  # outline of the glass, inside the opening; empty for opaque doors

    @property
    def turned(self) -> Aperture:
        """The same with the plane's normal (and u axis) the other way round."""
        mirror = np.array([-1.0, 1.0])
        return replace(
            self,
            plane=Plane(self.plane.origin, self.plane.axes * [[-1], [1], [-1]]),
            opening=shapely.transform(self.opening, lambda p: p * mirror),
            glass=shapely.transform(self.glass, lambda p: p * mirror),
        )


def aperture_of(filling: Filling) -> tuple[Aperture | None, list[Issue]]:
    """The filling in its plane (None if it has no extent), and what had to be assumed."""
    issues: list[Issue] = []
    clear = filling.triangles[filling.transparent]
    source = clear if len(clear) else filling.triangles
    if filling.opening is not None and not len(clear) and not len(source):
        source = filling.opening
    direction = _looking(filling, source)
    if direction is None:
        values = {"element": filling.name}
        return None, [Issue("window-without-extent", filling.guid, values, Effect("window"))]
    facing = _facing(source, direction)
    areas = np.linalg.norm(area_vectors(source), axis=1)
    depth = source.mean(axis=1) @ direction
    middle = np.average(depth[facing], weights=areas[facing])
    plane = plane_through(source[0, 0] + (middle - source[0, 0] @ direction) * direction, direction)
    if filling.opening is not None:
        plane, more = _in_its_opening(filling, plane)
        issues += more
    opening = _filled(shadow(filling.triangles if filling.opening is None else filling.opening, plane))
    if opening.area < SMALLEST_PANE:
        values = {"element": filling.name}
        return None, [Issue("opening-without-area", filling.guid, values, Effect("window"))]
    if filling.opening is None and filling.ifc_class.startswith("IfcWindow"):
        issues.append(Issue("window-without-opening", filling.guid, {"element": filling.name}))
    if filling.glass_area is not None:
        glass = _of_area(opening, filling.glass_area)
    elif len(clear):
        glass, more = _drawn_glass(filling, clear, facing, plane, opening)
        issues += more
    elif filling.is_door:
        glass = shapely.Polygon()
    else:
        glass, more = _assumed_glass(filling, plane, opening)
        issues += more
    return Aperture(filling, plane, opening, glass), issues


def framed_by(apertures: Sequence[Aperture]) -> list[Aperture | None]:
    """The window that each one without a drawn pane lies around, or None; as its frame."""
    ends = [_box(aperture.filling.triangles) for aperture in apertures]
    boxes = Boxes(*np.array(ends).reshape(-1, 2, 3).swapaxes(0, 1))
    return [_framed_by(number, apertures, boxes) for number in range(len(apertures))]


def _box(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Low and high corner [2, 3] of triangles [N, 3, 3]; of none a box that meets no other."""
    low = triangles.min(axis=(0, 1), initial=np.inf)
    return np.stack([low, triangles.max(axis=(0, 1), initial=-np.inf)])


def _framed_by(number: int, apertures: Sequence[Aperture], boxes: Boxes) -> Aperture | None:
    """The window that one without a drawn pane lies around, or None; of two the lesser is kept.

    Args: boxes: of what each of the apertures is drawn as.
    """
    one = apertures[number]
    if one.filling.transparent.any() or one.glass.is_empty or one.filling.glass_area is not None:
        return None
    for place in boxes.near(boxes.low[number], boxes.high[number]):
        other = apertures[place]
        if place == number or other.glass.is_empty or not _lies_around(one, other):
            continue
        lesser = (round(other.glass.area, 3), place) < (round(one.glass.area, 3), number)
        if lesser or other.filling.transparent.any() or not _lies_around(other, one):
            return other
    return None


def _lies_around(one: Aperture, other: Aperture) -> bool:
    """Whether the glass that one is taken to have is mostly the glass of another one."""
    if abs(one.plane.normal @ other.plane.normal) < FLAT:
        return False
    if abs(one.plane.to_plane(other.plane.origin)[2]) > ONE_WINDOW:
        return False
    outline = shapely.transform(other.glass, lambda p: one.plane.to_plane(other.plane.to_world(p))[:, :2])
    return outline.intersection(one.glass).area > MOSTLY * one.glass.area


def _looking(filling: Filling, source: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Direction [3] of either sign that a filling looks in; None without any extent.

    It looks across its panes, or across most of its faces; one without panes that no opening holds
    looks where it is broadest.  None looks into the wall that holds it: where it would (a low
    window whose sill shows more area than itself, a body that cuts deeper than it is wide), it is
    the opening's one direction that its wall leaves open.
    """
    direction, body = main_direction(source), filling.opening
    if body is None and not filling.transparent.any():
        return max(_ways(source), key=lambda way: _breadth(source, way), default=direction)
    if direction is None or body is None or filling.beside is None:
        return direction
    wall = ray_mesh(filling.beside)
    if _walls_met(direction, body, wall) < 2:
        return direction
    ways = list(_ways(body))
    met = [_walls_met(way, body, wall) for way in ways]
    if met.count(0) != 1:  # not cut, or open in more than one direction
        return direction
    facing = _facing(source, ways[met.index(0)])
    return main_direction(source[facing]) if facing.any() else direction


def _facing(triangles: NDArray[np.float64], way: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which triangles [N] face a direction or the other way."""
    return np.abs(_unit(area_vectors(triangles)) @ way) > FLAT


def _walls_met(way: NDArray[np.float64], opening: NDArray[np.float64], wall: RayMesh) -> int:
    """On how many sides of the middle of an opening, 0 to 2, its wall is met along a direction."""
    middle = 0.5 * (opening.min(axis=(0, 1)) + opening.max(axis=(0, 1)))
    reach = float(np.abs((opening - middle) @ way).max()) + BESIDE
    _, hit = wall.first_hits(np.stack([middle, middle]), np.stack([way, -way]), reach)
    return int(np.count_nonzero(hit >= 0))


def _ways(triangles: NDArray[np.float64]) -> Iterator[NDArray[np.float64]]:
    """Directions [3] that triangles face with a share of their area, of either sign."""
    vectors = area_vectors(triangles)
    normals, areas = _unit(vectors), np.linalg.norm(vectors, axis=1)
    least = LEAST_FACING * areas.sum()
    while (way := main_direction(triangles)) is not None:
        left = np.abs(normals @ way) <= FLAT
        if areas[~left].sum() < least:
            return
        yield way
        triangles, normals, areas = triangles[left], normals[left], areas[left]


def _breadth(triangles: NDArray[np.float64], way: NDArray[np.float64]) -> float:
    """Area [m2] of the convex outline of triangles, seen along a direction."""
    flat = plane_through(np.zeros(3), way).to_plane(triangles.reshape(-1, 3))[:, :2]
    return shapely.convex_hull(shapely.multipoints(flat)).area


def _in_its_opening(filling: Filling, plane: Plane) -> tuple[Plane, list[Issue]]:
    """The glazing plane, moved to the middle of the opening where it was far off."""
    heights = plane.to_plane(filling.opening)[..., 2]
    off = max(heights.min(), -heights.max(), 0.0)
    if off < OUT_OF_WALL:
        return plane, []
    values = {"element": filling.name, "offset_mm": float(1000 * off)}
    if off < ASTRAY:
        return plane, [Issue("glass-out-of-opening", filling.guid, values)]
    middle = 0.5 * (heights.min() + heights.max())
    moved = Plane(plane.origin + middle * plane.normal, plane.axes)
    return moved, [Issue("glass-moved-into-opening", filling.guid, values)]


def _drawn_glass(
    filling: Filling, clear: NDArray[np.float64], facing: NDArray[np.bool_], plane: Plane, opening: shapely.Geometry
) -> tuple[shapely.Geometry, list[Issue]]:
    """Outline of the transparent panes, clipped to the opening."""
    issues = []
    total = np.linalg.norm(area_vectors(clear), axis=1)
    if total[~facing].sum() > 0.3 * total[facing].sum():
        issues.append(Issue("glass-in-several-planes", filling.guid, {"element": filling.name}))
    drawn = shadow(clear[facing], plane)
    glass = drawn.intersection(opening)
    if glass.area < 0.95 * drawn.area:
        values = {"element": filling.name, "area": drawn.area - glass.area}
        issues.append(Issue("glass-clipped", filling.guid, values))
    glass = _polygonal(glass)
    return (glass if glass.area >= SMALLEST_PANE else shapely.Polygon()), issues


def _assumed_glass(filling: Filling, plane: Plane, opening: shapely.Geometry) -> tuple[shapely.Geometry, list[Issue]]:
    """The opening less a frame of the stated, the drawn or the default size."""
    if filling.glazed_fraction is not None and 0 < filling.glazed_fraction <= 1:
        glass = inset_to_fraction(opening, filling.glazed_fraction)
        source = Phrase("glazing-area-fraction", {"fraction": filling.glazed_fraction})
    elif (free := _left_free(filling, plane, opening)).area > LEAST_WITHIN * opening.area:
        glass, source = free, Phrase("free-of-frame")
    elif filling.frame_width is not None and opening.buffer(-filling.frame_width).area > 0:
        glass = opening.buffer(-filling.frame_width, join_style="mitre")
        source = Phrase("stated-frame", {"width_mm": 1000 * filling.frame_width})
    else:
        glass = inset_to_fraction(opening, 1 - FRAME_FRACTION)
        source = Phrase("default-frame", {"fraction": FRAME_FRACTION})
    values = {"element": filling.name, "source": source}
    return _polygonal(glass), [Issue("window-without-glass", filling.guid, values)]


def _of_area(opening: shapely.Geometry, area: float) -> shapely.Geometry:
    """The opening less a frame of one width all round; all of it where that is not the area."""
    if area < SMALLEST_PANE:
        return shapely.Polygon()
    return _polygonal(inset_to_fraction(opening, area / opening.area))


def _left_free(filling: Filling, plane: Plane, opening: shapely.Geometry) -> shapely.Geometry:
    """What the drawn frame leaves free of the opening within itself."""
    frame = shadow(filling.triangles, plane)
    return _polygonal(_filled(frame).difference(frame).intersection(opening))


def inset_to_fraction(outline: shapely.Geometry, fraction: float) -> shapely.Geometry:
    """The outline moved inwards all round until `fraction` of its area is left."""
    if fraction >= 1:
        return outline
    low, high = 0.0, float(np.sqrt(outline.area))
    for _ in range(50):
        middle = 0.5 * (low + high)
        left = outline.buffer(-middle, join_style="mitre").area
        low, high = (middle, high) if left > fraction * outline.area else (low, middle)
    return outline.buffer(-low, join_style="mitre")


def shadow(triangles: NDArray[np.float64], plane: Plane) -> shapely.Geometry:
    """Outline [m] in the plane of what the triangles [N, 3, 3] cover, seen along its normal."""
    flat = plane.to_plane(triangles)[..., :2]
    vectors = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    covering = np.abs(vectors[0][:, 0] * vectors[1][:, 1] - vectors[0][:, 1] * vectors[1][:, 0])
    polygons = shapely.polygons(flat[covering > 1e-9])
    merged = shapely.union_all(shapely.set_precision(polygons, 1e-6))
    return _polygonal(without_slits(merged, PANE_JOINT).simplify(OUTLINE))


def _filled(outline: shapely.Geometry) -> shapely.Geometry:
    """The outline, its holes filled."""
    return shapely.union_all([shapely.Polygon(p.exterior) for p in polygons_of(outline)])


def _polygonal(geometry: shapely.Geometry) -> shapely.Geometry:
    """Only the polygons of a geometry, more than dust."""
    return shapely.union_all(polygons_of(shapely.make_valid(geometry)))


def main_direction(triangles: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Direction [3], of either sign, along which the triangles show most area; None without any."""
    vectors = area_vectors(triangles)
    areas = np.linalg.norm(vectors, axis=1)
    if not len(areas) or areas.sum() < 1e-8:
        return None
    normals = _unit(vectors)
    keys = np.round(normals, 2)
    keys[keys[:, 2] < 0] *= -1
    flat = np.abs(keys[:, 2]) < 1e-9
    turn = flat & ((keys[:, 0] < 0) | ((np.abs(keys[:, 0]) < 1e-9) & (keys[:, 1] < 0)))
    keys[turn] *= -1
    _, inverse = np.unique(keys + 0.0, axis=0, return_inverse=True)
    seed = normals[np.flatnonzero(inverse == np.bincount(inverse.ravel(), areas).argmax())[0]]
    alike = np.abs(normals @ seed) > FLAT
    signs = np.sign(normals[alike] @ seed)
    mean = (vectors[alike] * signs[:, None]).sum(axis=0)
    mean[np.abs(mean) < 1e-6 * np.abs(mean).max()] = 0.0
    return mean / np.linalg.norm(mean)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)
