"""Sensor points and view points of a room; sensors on walls, windows and other polygons."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
import shapely.ops
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from bim.held_sensors import ModelGrid, ModelView
from bim.model import Building, Face, Space, Window
from bim.planes import SMALLEST_AREA, Plane, merged_polygons, newell_normal, plane_through
from bim.shell import welded
from mitsuba_cfs.errors import RoomError

OFF_THE_SURFACE = 0.01  # from a surface to its sensors, on the side that they face [m]
OFF_THE_VERTEX = 1.3e-5  # the cut is made this much higher, off sills at a round height [m]
GRID = 1e-7  # shorter edges of a cut are left out [m]
SAME = 1e-6  # ends of a cut's edges this near are one point [m]


def horizontal_section(triangles: NDArray[np.float64], z: float) -> shapely.Geometry:
    """Area inside the closed surface [N, 3, 3] at height `z`, as (multi)polygon in x, y [m].

    A point counts as inside where the winding number of the cut's directed edges is not zero.
    """
    edges = _cut_edges(triangles, z + OFF_THE_VERTEX)
    if not len(edges):
        return shapely.Polygon()
    edges = _closed(edges)
    cells = shapely.get_parts(shapely.polygonize([shapely.union_all(shapely.linestrings(edges))]))
    inside = [
        cell for cell in cells if cell.area > SMALLEST_AREA and abs(winding_number(_inner_point(cell), edges)) > 0.5
    ]
    return shapely.union_all(inside) if inside else shapely.Polygon()


def _closed(edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """Directed edges [E, 2, 2] whose ends meet exactly, and edges over the gaps of the outline.

    From each end that no edge goes on from, one leads to a start that none arrives at, all of them
    together as short as can be: rooms whose drawing leaves slits have an outline too.
    """
    points = welded(edges.reshape(-1, 2), SAME)
    ends = cKDTree(points).query(edges.reshape(-1, 2))[1].reshape(-1, 2)
    ends = ends[ends[:, 0] != ends[:, 1]]
    balance = np.bincount(ends[:, 1], minlength=len(points))
    balance -= np.bincount(ends[:, 0], minlength=len(points))
    last, first = (np.repeat(np.arange(len(points)), np.maximum(s * balance, 0)) for s in (1, -1))
    if not len(last):
        return points[ends]
    apart = np.linalg.norm(points[last][:, None] - points[first], axis=-1)
    from scipy.optimize import linear_sum_assignment  # half a second

    chosen, to = linear_sum_assignment(apart)
    gaps = np.column_stack([last[chosen], first[to]])
    return points[np.concatenate([ends, gaps])]


def winding_number(point: NDArray[np.float64], edges: NDArray[np.float64]) -> float:
    """Times that closed directed edges [E, 2, 2] turn round a point [2]: sum of angles / 2 pi."""
    a, b = (edges - point).transpose(1, 0, 2)
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return float(np.arctan2(cross, np.einsum("ij,ij->i", a, b)).sum() / (2 * np.pi))


def _inner_point(polygon: shapely.Polygon) -> NDArray[np.float64]:
    return shapely.get_coordinates(shapely.point_on_surface(polygon))[0]


def _cut_edges(triangles: NDArray[np.float64], z: float) -> NDArray[np.float64]:
    """Directed edges [E, 2, 2] where triangles cross the plane, inside to their left."""
    above = triangles[..., 2] > z
    crossing = triangles[above.any(axis=1) & ~above.all(axis=1)]
    above = crossing[..., 2] > z
    lone_is_above = above.sum(axis=1) == 1
    lone = np.argmax(np.where(lone_is_above[:, None], above, ~above), axis=1)
    rows = np.arange(len(crossing))
    tip = crossing[rows, lone]
    points = []
    for k in (1, 2):
        other = crossing[rows, (lone + k) % 3]
        t = (z - tip[:, 2]) / (other[:, 2] - tip[:, 2])
        points.append(tip[:, :2] + t[:, None] * (other - tip)[:, :2])
    edges = np.stack(points, axis=1)
    # with the tip above, tip -> first edge -> second is counter-clockwise seen from outside
    edges[~lone_is_above] = edges[~lone_is_above][:, ::-1]
    return edges[np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1) > GRID]


def sensor_grid(
    space: Space, spacing: float = 0.5, height: float = 0.8, margin: float = 0.5
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points [S, 3] [m] on the room's work plane and their directions [S, 3], straight up.

    A square grid of `spacing`, `height` above the floor, at least `margin` from what bounds the
    room there (EN 17037:2018: 0.85 m and 0.5 m; LM-83: 0.76 m); its rows follow the longest wall
    and its middle is the room's.  Where the margin leaves nothing it is halved until it does.
    Points within a piece of furniture are left out.

    Raises: `RoomError` for a room that is lower than its work plane.
    """
    if spacing <= 0 or margin < 0:
        raise ValueError("the spacing must be positive and the margin not negative")
    section = _section(space, height)
    z = space.floor_level + height
    work_plane = section.buffer(-margin, join_style="mitre")
    while work_plane.area < SMALLEST_AREA and margin > 0.01:
        margin *= 0.5
        work_plane = section.buffer(-margin, join_style="mitre")
    flat = _grid_inside(work_plane, spacing)
    flat = _free_of_furniture(flat, space, z)
    points = np.column_stack([flat, np.full(len(flat), z)])
    return points, np.tile([0.0, 0.0, 1.0], (len(points), 1))


def plane_sides(space: Space, height: float, margin: float) -> tuple[float, float]:
    """Sides [m] of the rectangle round the work plane, along its longest edge and across.

    Raises: `RoomError` for a room that is lower than its work plane.
    """
    plane = _section(space, height)
    inner = plane.buffer(-margin, join_style="mitre")
    plane = inner if inner.area >= SMALLEST_AREA else plane
    x0, y0, x1, y1 = _along_longest_edge(plane)[0].bounds
    return float(x1 - x0), float(y1 - y0)


def _free_of_furniture(flat: NDArray[np.float64], space: Space, z: float) -> NDArray[np.float64]:
    """Points [S, 2] of a height that lie in no piece of furniture; all of them if none does."""
    taken = _furniture_at(space, z)
    free = flat[~shapely.contains_xy(taken, flat)] if not taken.is_empty else flat
    return free if len(free) else flat


def _furniture_at(space: Space, z: float) -> shapely.Geometry:
    """Outline in x, y of the furniture at a height."""
    bodies: dict[str, list[NDArray[np.float64]]] = {}
    for part in space.furniture:
        bodies.setdefault(part.guid, []).append(part.triangles)
    cuts = [horizontal_section(np.concatenate(body), z) for body in bodies.values()]
    return shapely.union_all(cuts)


def _section(space: Space, height: float) -> shapely.Geometry:
    """The room's outline at a height above its floor [m]."""
    if not space.faces:
        raise RoomError(f"space {space.label}: has no faces")
    section = horizontal_section(space.shell, space.floor_level + height)
    if section.is_empty:
        raise RoomError(f"space {space.label}: no room at {height} m above the floor")
    return section


def _grid_inside(area: shapely.Geometry, spacing: float) -> NDArray[np.float64]:
    """Grid points [S, 2] inside the area; its middle if the grid misses it altogether."""
    turned, back = _along_longest_edge(area)
    x0, y0, x1, y1 = turned.bounds
    # whole cells, centred; the small number keeps 4.0 / 0.5 at eight cells
    nx, ny = (max(1, int(np.floor(d / spacing + 1e-6))) for d in (x1 - x0, y1 - y0))
    x = (x0 + x1) / 2 + (np.arange(nx) - (nx - 1) / 2) * spacing
    y = (y0 + y1) / 2 + (np.arange(ny) - (ny - 1) / 2) * spacing
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = grid[shapely.contains_xy(turned, grid)]
    if not len(inside):
        inside = shapely.get_coordinates(shapely.point_on_surface(turned))
    return inside @ back.T


def _along_longest_edge(area: shapely.Geometry) -> tuple[shapely.Geometry, NDArray[np.float64]]:
    """The area turned so that its longest edge is along x, and the rotation [2, 2] back."""
    biggest = max(shapely.get_parts(area), key=lambda part: part.area)
    ring = np.asarray(biggest.exterior.coords)
    steps = np.diff(ring, axis=0)
    along = steps[np.argmax(np.round(np.linalg.norm(steps, axis=1), 4))]
    c, s = along / np.linalg.norm(along)
    if c < -1e-9 or (abs(c) <= 1e-9 and s < 0):  # rows run eastwards whichever way the ring turns
        c, s = -c, -s
    back = np.array([[c, -s], [s, c]])
    return shapely.transform(area, lambda points: points @ back), back


def view_point(space: Space, eye_height: float = 1.2) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Position [3] [m] in the middle of the room or nearest to it, horizontal direction [3].

    It is that to the biggest window, without one along the room's longest edge; 1.2 m is a
    seated eye (EN 17037).

    Raises: `RoomError` for a room that is lower.
    """
    section = _section(space, eye_height)
    z = space.floor_level + eye_height
    free = section.difference(_furniture_at(space, z).buffer(0.05))
    section = section if free.is_empty else free
    middle = section.centroid
    if not section.buffer(-0.05).contains(middle):
        inner = section.buffer(-0.06)
        middle = shapely.ops.nearest_points(section if inner.is_empty else inner, middle)[0]
    position = np.array([middle.x, middle.y, z])
    direction = np.array([0.0, 0.0, 0.0])
    if space.windows:
        # of equal windows in several orientations, one that does not depend on the file's order
        biggest = min(space.windows, key=_size_and_normal)
        direction = (biggest.centre - position) * [1, 1, 0]
        if np.linalg.norm(direction) < 0.1:  # below a skylight
            direction = biggest.normal * [1, 1, 0]
    if np.linalg.norm(direction) < 1e-6:
        direction = np.append(_along_longest_edge(section)[1][:, 0], 0.0)
    return position, direction / np.linalg.norm(direction)


def _size_and_normal(window: Window) -> tuple[float, ...]:
    return -window.area, *np.round(window.normal, 3).tolist()


def in_room(space: Space, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which of points [S, 3] lie in the air of a room [S]."""
    inside = np.zeros(len(points), dtype=bool)
    heights = np.round(points[:, 2], 3)
    for z in np.unique(heights):
        own = heights == z
        section = horizontal_section(space.shell, float(z))
        inside[own] = shapely.contains_xy(section, points[own, 0], points[own, 1])
    return inside


def model_grids(building: Building, space: Space) -> list[ModelGrid]:
    """The sensors of the building's file that lie in a room, by grid."""
    grids = []
    for grid in building.grids:
        own = in_room(space, grid.points)
        if own.any():
            grids.append(ModelGrid(grid.name, grid.points[own], grid.directions[own]))
    return grids


def model_views(building: Building, space: Space) -> list[ModelView]:
    """The views of the building's file whose eye is in a room."""
    if not building.views:
        return []
    eyes = np.array([held.view.position for held in building.views])
    return [held for held, own in zip(building.views, in_room(space, eyes), strict=True) if own]


def polygon_sensors(
    ring: NDArray[np.float64], spacing: Sequence[float], holes: Sequence[NDArray[np.float64]] = ()
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points [S, 3] on a polygon [N, 3] and its unit normal [3].

    The spacing along X, Y and Z of the world is taken to the polygon's own axes u and v:
    d_u = sqrt((u_x d_X)^2 + (u_y d_Y)^2 + (u_z d_Z)^2), d_v likewise; the first point lies half a
    spacing from the corner of the polygon's box in those axes.  A point counts where the winding
    number of ring and holes is not zero, so holes and self-intersections are allowed.

    Source: the dissertation, section 2.5, with d_Y and d_Z in their places (printed: d_X three
    times); winding number: Sunday 2001.
    """
    steps = np.asarray(spacing, dtype=float)
    if steps.shape != (3,) or steps.min() <= 0:
        raise ValueError("spacing: expected three positive lengths, along X, Y and Z")
    vector = newell_normal(ring)
    if not np.linalg.norm(vector) > 0:
        raise ValueError("the polygon has no area")
    plane = plane_through(ring[0], vector)
    holes = [hole if newell_normal(hole) @ vector < 0 else hole[::-1] for hole in holes]
    flat = [plane.to_plane(one)[:, :2] for one in (ring, *holes)]
    edges = np.concatenate([np.stack([one, np.roll(one, -1, axis=0)], axis=1) for one in flat])
    low, high = flat[0].min(axis=0), flat[0].max(axis=0)
    du, dv = (np.linalg.norm(axis * steps) for axis in plane.axes[:2])
    u = np.arange(low[0] + du / 2, high[0], du)
    v = np.arange(low[1] + dv / 2, high[1], dv)
    grid = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
    inside = [abs(winding_number(point, edges)) > 0.5 for point in grid]
    return plane.to_world(grid[np.array(inside, dtype=bool)]), plane.normal


def surface_sensors(
    surface: Face | Window, spacing: Sequence[float], *, outdoors: bool = False
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points [S, 3] just before a face or window and their directions [S, 3].

    They look into the room, or outdoors: then they stand before the outer side of the wall.
    """
    depth = 0.0
    if outdoors and isinstance(surface, Face):
        depth = surface.construction.thickness
    plane: Plane = plane_through(surface.triangles[0, 0], surface.normal)
    grids = []
    for polygon in merged_polygons(plane.to_plane(surface.triangles)[..., :2]):
        oriented = shapely.orient_polygons(polygon)
        rings = [plane.to_world(np.asarray(ring.coords)[:-1]) for ring in (oriented.exterior, *oriented.interiors)]
        grids.append(polygon_sensors(rings[0], spacing, rings[1:])[0])
    points = np.concatenate(grids)
    direction = surface.normal if outdoors else -surface.normal
    points = points + (OFF_THE_SURFACE + depth) * direction
    return points, np.tile(direction, (len(points), 1))
