"""The views of a room that a user gives: read from a text or a file, and checked to be in it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import shapely

from bim.model import Space
from bim.sensors import horizontal_section
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.images.view import View, parse_view

FROM_WALLS = 0.01  # least distance of an eye from what bounds the room [m]


@dataclass(frozen=True, slots=True)
class NamedView:
    """A view and what it is called in files and tables."""

    name: str
    view: View


def given_views(text: str, size: int = 800) -> list[NamedView]:
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
            raise DataError(f"cannot be read: {error}", file=file, field="--view") from None
        stem = file.stem
    found = []
    for number, line in enumerate(line for line in lines if "-v" in line):
        try:
            view = parse_view(line, size, size)
        except ValueError as error:
            raise DataError(str(error), file=file, field="--view") from None
        found.append(NamedView(f"{stem}_{number + 1}", view))
    if not found:
        raise DataError("holds no view (a line with -vta -vp ... -vd ...)", file=file)
    return found


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
