"""Plan pictures: the room's outline and windows from above, and each sensor in its colour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from bim.model import Space, Window
from bim.sensors import horizontal_section
from scenes.figures.scale import ColourScale
from scenes.language.catalogue import decimal, gettext

UNIT = 100.0  # SVG units per metre
MARGIN = 0.45  # white space round the room [m]
MOST_CUTS = 6  # heights of windows at which the outline is cut
MOST_NUMBERS = 150  # more sensors than this carry no number in the picture


@dataclass(frozen=True, slots=True)
class FloorPlan:
    """A plan as SVG, with its colour scale."""

    title: str
    explanation: str
    view_box: str  # min x, min y, width, height
    ratio: float  # width over height
    body: str  # SVG inside
    scale: ColourScale


@dataclass(frozen=True, slots=True)
class PlanFrame:
    """What all plans of a room share: outline, windows, sensor cells, eye."""

    outline: shapely.Geometry  # [m]
    windows: tuple[NDArray[np.float64], ...]  # each [2, 2] from end to end, or [N, 2] a skylight
    cells: NDArray[np.float64]  # [S, 4, 2] corners [m]
    points: NDArray[np.float64]  # [S, 3]
    eye: tuple[NDArray[np.float64], NDArray[np.float64]] | None  # position, direction


def plan_frame(space: Space, points: NDArray[np.float64], eye=None) -> PlanFrame:
    """Outline, windows and sensor cells.

    The outline joins the cuts at the sensors' height and at the windows', so that their recesses
    show; where both are empty it is the floor.
    """
    level = float(np.median(points[:, 2])) if len(points) else space.floor_level + 0.8
    heights = {round(float(w.centre[2]), 2) for w in space.windows if abs(w.normal[2]) <= 0.5}
    sections = [horizontal_section(space.shell, z) for z in [level, *sorted(heights)[:MOST_CUTS]]]
    outline = shapely.union_all([section for section in sections if not section.is_empty])
    if outline.is_empty:
        floors = [f.triangles[..., :2] for f in space.faces if f.kind == "floor"]
        outline = shapely.union_all(shapely.polygons(np.concatenate(floors)))
    windows = tuple(window_from_above(window) for window in space.windows)
    return PlanFrame(outline, windows, sensor_cells(points), points, eye)


def window_from_above(window: Window) -> NDArray[np.float64]:
    """The two ends [2, 2] of an upright window, or the hull [N, 2] of one in the roof [m]."""
    flat = window.triangles.reshape(-1, 3)[:, :2]
    if abs(window.normal[2]) > 0.5:
        return shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(flat)))
    along = np.array([-window.normal[1], window.normal[0]])
    along /= np.linalg.norm(along)
    place = flat @ along
    return flat[[place.argmin(), place.argmax()]]


def sensor_cells(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Squares [S, 4, 2] [m] round the sensors, as wide as the grid and turned like it."""
    flat = points[:, :2]
    if len(flat) < 2:
        spacing, along = 0.5, np.array([1.0, 0.0])
    else:
        distance, nearest = cKDTree(flat).query(flat, k=2)
        spacing = float(np.median(distance[:, 1]))
        first = int(np.argmin(np.abs(distance[:, 1] - spacing)))
        along = (flat[nearest[first, 1]] - flat[first]) / max(distance[first, 1], 1e-9)
    spacing = spacing or 0.5
    across = np.array([-along[1], along[0]])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * spacing / 2
    return flat[:, None, :] + corners @ np.stack([along, across])


def plan(
    frame: PlanFrame, values: ArrayLike, scale: ColourScale, *, title: str, explanation: str, digits: int = 0
) -> FloorPlan:
    """The plan with a value for each sensor [S]."""
    values = np.asarray(values, dtype=float)
    if values.shape != (len(frame.points),):
        raise ValueError(f"{title}: {values.shape} values for {len(frame.points)} sensors")
    box, body = drawn(frame, _cells(frame, values, scale, digits))
    return FloorPlan(title, explanation, *box, body, scale)


def drawn(frame: PlanFrame, inside: list[str]) -> tuple[tuple[str, float], str]:
    """View box and width over height of a plan, and its SVG with what is `inside` the room."""
    west, south, east, north = frame.outline.bounds
    x0, y0 = west - MARGIN, -(north + MARGIN)
    width, height = east - west + 2 * MARGIN, north - south + 2 * MARGIN
    parts = [f'<path class="floor" d="{rings(frame.outline)}"/>', *inside]
    parts.append(f'<path class="wall" d="{rings(frame.outline)}"/>')
    for ends in frame.windows:
        name = "skylight" if len(ends) > 2 else "window"
        parts.append(f'<path class="{name}" d="{_path(ends, closed=len(ends) > 2)}"/>')
    if frame.eye is not None:
        parts.append(_eye(*frame.eye))
    view_box = " ".join(f"{UNIT * v:.0f}" for v in (x0, y0, width, height))
    return (view_box, width / height), "".join(parts)


def _cells(frame: PlanFrame, values, scale: ColourScale, digits: int) -> list[str]:
    """Sensor squares with their number and what the pointer shows."""
    parts = []
    numbered = len(values) <= MOST_NUMBERS
    inside = shapely.intersection(shapely.polygons(frame.cells), frame.outline)
    for point, cell, corners, value in zip(frame.points, inside, frame.cells, values, strict=True):
        number = decimal(f"{value:.{digits}f}")
        text = gettext("no value") if np.isnan(value) else f"{number} {scale.unit}"
        where = decimal(f"x {point[0]:.2f} m, y {point[1]:.2f} m").replace(", y", "; y")
        parts.append(
            f'<path class="cell" fill="{scale.hex(value)}" d="{rings(cell)}"><title>{text}: {where}</title></path>'
        )
        if numbered and not np.isnan(value):
            label = number
            side = np.linalg.norm(corners[1] - corners[0]) * UNIT
            size = min(0.42 * side, 1.45 * side / max(len(label), 2))
            parts.append(
                f'<text x="{UNIT * point[0]:.0f}" y="{-UNIT * point[1]:.0f}" '
                f'font-size="{size:.1f}" fill="{scale.ink(value)}">{label}</text>'
            )
    return parts


def _eye(position: NDArray[np.float64], direction: NDArray[np.float64]) -> str:
    """A small arrow head at the eye, in the direction of sight."""
    heading = np.asarray(direction[:2], dtype=float)
    length = np.linalg.norm(heading)
    if length < 1e-6:
        return ""
    heading = heading / length
    aside = np.array([-heading[1], heading[0]])
    tip, back = position[:2] + 0.22 * heading, position[:2] - 0.14 * heading
    shape = np.stack([tip, back + 0.16 * aside, back + 0.06 * heading, back - 0.16 * aside])
    path, title = _path(shape, closed=True), gettext("view point")
    return f'<path class="eye" d="{path}"><title>{title}</title></path>'


def rings(geometry: shapely.Geometry) -> str:
    """SVG path of polygons with their holes."""
    result = []
    for part in shapely.get_parts(geometry):
        if part.geom_type == "Polygon":
            result += [part.exterior, *part.interiors]
    return "".join(_path(shapely.get_coordinates(ring)[:-1], closed=True) for ring in result)


def _path(points: NDArray[np.float64], *, closed: bool) -> str:
    pairs = [f"{UNIT * x:.0f} {-UNIT * y:.0f}" for x, y in points]
    return "M" + "L".join(pairs) + ("Z" if closed else "")
