"""The building from above within the sun's paths, north up: a wrong north is seen at once.

The ring is the sky from the horizon (outside) to the zenith (inside), in equal steps of altitude.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from bim.model import Building
from scenes.figures.plan import plan_frame, window_from_above
from scenes.language.catalogue import N_, gettext
from scenes.language.numbers import day_and_month, rounded
from scenes.results import RunResult

INNER, OUTER, EDGE = 620.0, 1000.0, 1130.0  # radii of the ring and the picture [SVG units]
DAYS = ((6, 21), (3, 21), (12, 21))  # month and day of the paths
STEPS = 6  # of a path between two hours
COMPASS = (N_("N"), N_("E"), N_("S"), N_("W"))
SOURCES = {  # code of an issue: where north comes from
    "north-corrected": N_("by the corrections file"),
    "north-contradicts-map": N_("by IfcMapConversion; TrueNorth differs"),
    "true-north-from-map": N_("by IfcMapConversion"),
    "true-north-missing": N_("assumed: the file states no north"),
    "true-north-invalid": N_("assumed: TrueNorth is not a direction in the plane"),
}


@dataclass(frozen=True, slots=True)
class Orientation:
    """The picture, and in words where north is."""

    words: str
    view_box: str
    body: str  # SVG inside


def orientation(result: RunResult) -> Orientation:
    """Outlines and windows of all rooms in the ring of the sun's paths."""
    spaces = result.building.spaces
    outlines = [plan_frame(space, np.empty((0, 3))).outline for space in spaces]
    west, south, east, north = shapely.union_all(outlines).bounds
    middle = np.array([(west + east) / 2, (south + north) / 2])
    scale = 0.93 * INNER / max(float(np.hypot(east - west, north - south)) / 2, 0.1)

    def placed(points: NDArray[np.float64]) -> NDArray[np.float64]:
        return (points[..., :2] - middle) * [scale, -scale]

    parts = [
        _circle("ring", OUTER),
        _circle("ground", INNER),
        *(_circle("altitude", _radius(altitude)) for altitude in (30.0, 60.0)),
    ]
    for k, name in enumerate(COMPASS):
        x, y = np.sin(np.pi / 2 * k), -np.cos(np.pi / 2 * k)
        parts.append(_drawn("altitude", [(INNER * x, INNER * y), (OUTER * x, OUTER * y)]))
        at = (OUTER + EDGE) / 2
        parts.append(_text("compass", at * x, at * y, gettext(name)))
    for month, day in DAYS:
        parts += _path(result, month, day)
    for space, outline in zip(spaces, outlines, strict=True):
        for part in shapely.get_parts(outline):
            ring = placed(shapely.get_coordinates(part.exterior))
            parts.append(_drawn("floor", ring, closed=True))
        for window in space.windows:
            ends = placed(window_from_above(window))
            parts.append(_drawn("window", ends, closed=len(ends) > 2))
    angle = model_axis_deg(result.building)
    if angle is not None:
        x, y = np.sin(np.radians(angle)), -np.cos(np.radians(angle))
        tip = np.array([x, y]) * INNER
        parts.append(_drawn("axis", [0.8 * tip, tip]))
        parts.append(_text("axis-name", 0.72 * tip[0], 0.72 * tip[1], "+y"))
    box = " ".join(f"{v:.0f}" for v in (-EDGE, -EDGE, 2 * EDGE, 2 * EDGE))
    return Orientation(_words(result.building, angle), box, "".join(parts))


def model_axis_deg(building: Building) -> float | None:
    """Direction of the +y axis of the building's file, from north to east [deg]."""
    if building.from_model is None:
        return None
    east, north = building.from_model[:2, 1]
    return float(np.degrees(np.arctan2(east, north)))


def _words(building: Building, angle: float | None) -> str:
    north = gettext("North is up in all plans.")
    if angle is None:
        return north
    codes = {issue.code for issue in building.issues}
    source = next((text for code, text in SOURCES.items() if code in codes), N_("by TrueNorth"))
    side = gettext("{angle}° east of north") if angle > -0.05 else gettext("{angle}° west of north")
    axis = gettext(
        "The model's +y axis points {direction} ({source}). If the building does not lie so, set "
        "north in the corrections file.",
        direction=side.format(angle=rounded(abs(angle), 1)),
        source=gettext(source),
    )
    return f"{north} {axis}"


def _path(result: RunResult, month: int, day: int) -> list[str]:
    """The path of the sun on a day that the run has, from rise to set."""
    on = np.flatnonzero((result.times.month == month) & (result.times.day == day))
    if len(on) < 2:
        return []
    steps = np.arange(0, len(on) - 1, 1 / STEPS)
    sun = np.stack(
        [np.interp(steps, np.arange(len(on)), axis) for axis in result.sun[on].T], axis=1
    )
    sun /= np.linalg.norm(sun, axis=1, keepdims=True)
    points = [_on_ring(one) for one in sun[sun[:, 2] > 0]]
    if not points:
        return []
    name = day_and_month(result.times[on[0]], short=True)
    x, y = points[len(points) // 2]
    return [_drawn("sun", points), _text("day", x, y - 38, name)]


def _on_ring(sun: NDArray[np.float64]) -> tuple[float, float]:
    east, north = sun[:2] / np.hypot(sun[0], sun[1])
    radius = _radius(float(np.degrees(np.arcsin(sun[2]))))
    return radius * float(east), -radius * float(north)


def _radius(altitude: float) -> float:
    return OUTER - (OUTER - INNER) * altitude / 90.0


def _drawn(style: str, points: Iterable[ArrayLike], *, closed: bool = False) -> str:
    path = "L".join(f"{x:.1f} {y:.1f}" for x, y in map(np.asarray, points))
    return f'<path class="{style}" d="M{path}{"Z" if closed else ""}"/>'


def _circle(style: str, radius: float) -> str:
    return f'<circle class="{style}" r="{radius:.0f}"/>'


def _text(style: str, x: float, y: float, text: str) -> str:
    return f'<text class="{style}" x="{x:.0f}" y="{y:.0f}">{text}</text>'
