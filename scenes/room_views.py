"""The views of a room: given as a text or a file, or a grid of eyes; and whether they are in it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.sensors import horizontal_section, model_views, sensor_grid, view_point
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason
from mitsuba_cfs.images.view import View, fisheye, fitted, parse_view

MARGIN = 0.5  # of the grid of eyes from the walls [m]
FROM_WALLS = 0.01  # least distance of an eye from what bounds the room [m]


@dataclass(frozen=True, slots=True)
class NamedView:
    """A view and what it is called in files and tables."""

    name: str
    view: View


def parsed_views(text: str, size: int = 800) -> list[NamedView]:
    """Views of a Radiance view file, a line each, or of the text itself.

    Args: size: of their pictures [px].
    """
    if text.strip().startswith("-v"):
        lines, file, stem = [text], None, "view"
    else:
        file = Path(text)
        try:
            lines = file.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise DataError(f"cannot be read: {reason(error)}", file=file, field="--view") from None
        stem = file.stem
    result = []
    for number, line in enumerate(line for line in lines if "-v" in line):
        try:
            view = parse_view(line, size, size)
        except ValueError as error:
            raise DataError(str(error), file=file, field="--view") from None
        result.append(NamedView(f"{stem}_{number + 1}", view))
    if not result:
        raise DataError("holds no view (a line with -vta -vp ... -vd ...)", file=file)
    return result


def held_fisheyes(building: Building, space: Space, size: int) -> list[NamedView]:
    """The fisheye views of a room that the building's file holds, in which glare can be rated."""
    views = [held for held in model_views(building, space) if held.view.covers_hemisphere]
    return [NamedView(held.name, fitted(held.view, size)) for held in views]


def held_view(building: Building, space: Space) -> NamedView | None:
    """The first view of a room that the building's file holds and a picture can be of."""
    views = [held for held in model_views(building, space) if held.view.kind != "parallel"]
    return NamedView(views[0].name, views[0].view) if views else None


def eyes_of(space: Space, grid: float | None, directions: int, eye_height: float, size: int) -> list[NamedView]:
    """Fisheye views of eyes all over a room, or of one in its middle, in the directions of each.

    Args:
        grid: spacing of the eyes [m]; None: one.
        directions: the first is that to the biggest window, the others at equal angles from it.
        eye_height: above the floor [m]; size: of a side of their pictures [px].
    """
    middle, towards = view_point(space, eye_height)
    eyes = middle[None]
    if grid is not None:
        eyes, _ = sensor_grid(space, grid, eye_height, MARGIN)
    return [
        NamedView(f"eye{e + 1:03d}_{d + 1}", fisheye(eye, turned(towards, 2 * np.pi * d / directions), size))
        for e, eye in enumerate(eyes)
        for d in range(directions)
    ]


def turned(direction: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """A direction [3] turned about the vertical, counter-clockwise seen from above."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = direction
    return np.array([c * x - s * y, s * x + c * y, z])


def check_eye(each: NamedView, space: Space) -> None:
    """Refuse a view, of any projection, whose eye is not in the air of the room.

    Rays of an eye outside or within a wall meet the backs of the room's faces: a black picture.
    """
    x, y, z = each.view.position
    if _in_room(space, x, y, z):
        return
    raise DataError(
        f"{each.name}: its eye ({x:g}, {y:g}, {z:g}) is not in the room {space.label}, which spans "
        f"{', '.join(_spans(space))}",
        field="--view",
    )


def _in_room(space: Space, x: float, y: float, z: float) -> bool:
    low, high = space.shell[..., 2].min(), space.shell[..., 2].max()
    if not low + FROM_WALLS <= z <= high - FROM_WALLS:
        return False
    section = horizontal_section(space.shell, z)
    return section.buffer(-FROM_WALLS).contains(shapely.Point(x, y))


def _spans(space: Space) -> Iterator[str]:
    corners = space.shell.reshape(-1, 3)
    for axis, low, high in zip("xyz", corners.min(axis=0), corners.max(axis=0), strict=True):
        yield f"{axis} {low:.2f} to {high:.2f} m"
