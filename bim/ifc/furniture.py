"""Furniture of an IFC file: which room each piece stands in, and which pieces are curtains.

It is left out unless it is asked for: a model that is furnished in one room only would compare
rooms that are not alike.  Asked for, it reflects and shades in light and views; in the heat balance
it is not.  A curtain or a blind that hangs at a window (`bim.drawn_shades`) is none of it: as a
body that lets no light through it would darken the room, and what fills the window is the place
for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bim.defaults import FURNITURE_REFLECTANCE
from bim.drawn_shades import hangs_at, is_named_shade
from bim.ifc.shapes import Shape, read_shapes
from bim.ifc.source import Source, painted
from bim.model import Element, Space
from bim.outdoors import simplified
from bim.rays import RayMesh, ray_mesh
from bim.report.issue import Issue
from mitsuba_cfs.surfaces import area_vectors

FURNITURE = "IfcFurnishingElement"  # IfcFurniture and IfcSystemFurnitureElement are kinds of it
ASKED = 64  # corners of a piece that are asked for their room
MOST = 0.5  # share of them in a room from which the piece stands in it


def furnished(source: Source, spaces: Sequence[Space], *, wanted: bool) -> tuple[list[Space], list[Issue]]:
    """The rooms with their furniture where it is wanted, and what became of each piece."""
    pieces = [one for one in source.model.by_type(FURNITURE) if one.Representation is not None]
    gone = source.corrections.removed(source.model)
    pieces = [one for one in pieces if one.id() not in gone]
    if not pieces or not spaces:
        return list(spaces), []
    if not wanted:
        return list(spaces), [Issue("furniture-left-out", FURNITURE, {"count": len(pieces)})]
    everything = {one.id() for one in source.model.by_type("IfcProduct")}
    ids = {one.id() for one in pieces}
    shapes, issues = read_shapes(source.model, without=everything - ids, skipped=())
    for step_id, (visible, solar) in source.corrections.painted(source.model).items():
        if step_id in shapes:
            shapes[step_id] = painted(shapes[step_id], visible, solar)
    meshes = [ray_mesh(space.shell) for space in spaces]
    pieces_of: dict[int, list[Element]] = {}
    for shape in shapes.values():
        shape = replace(shape, triangles=source.placed.to_world(shape.triangles))
        place, issue = _placed(shape, spaces, meshes)
        issues += [] if issue is None else [issue]
        if place is not None:
            pieces, more = simplified(_elements(shape))
            pieces_of.setdefault(place, []).extend(pieces)
            issues += more
    result = _with(spaces, pieces_of)
    count = sum(len({e.guid for e in space.furniture}) for space in result)
    issues.append(Issue("furniture-included", FURNITURE, {"count": count}))
    return result, issues


def _with(spaces: Sequence[Space], pieces_of: Mapping[int, list[Element]]) -> list[Space]:
    return [replace(space, furniture=tuple(pieces_of.get(index, ()))) for index, space in enumerate(spaces)]


def _placed(shape: Shape, spaces: Sequence[Space], meshes: Sequence[RayMesh]) -> tuple[int | None, Issue | None]:
    """Index of the room that a piece stands in, or what there is to say of it."""
    label = f"{shape.ifc_class} {shape.name}"
    if is_named_shade(shape.name):
        for space in spaces:
            for window in space.windows:
                if hangs_at(shape.triangles, window):
                    values = {"element": label, "window": window.name or window.guid, "window_guid": window.guid}
                    return None, Issue("curtain-at-window", shape.guid, values)
    corners = shape.triangles.reshape(-1, 3)
    corners = corners[np.linspace(0, len(corners) - 1, min(ASKED, len(corners))).astype(int)]
    inside = corners + 0.01 * (corners.mean(axis=0) - corners)  # off the floor and the wall
    shares = [_share_inside(inside, mesh) for mesh in meshes]
    best = int(np.argmax(shares))
    if shares[best] < MOST:
        return None, Issue("furniture-in-no-room", shape.guid, {"element": label})
    return best, None


def _share_inside(points: NDArray[np.float64], shell: RayMesh) -> float:
    """Share of points [N, 3] in a closed surface: those whose ray up meets it from inside."""
    corners = shell.triangles.reshape(-1, 3)
    if np.any(points.min(axis=0) > corners.max(axis=0)) or np.any(points.max(axis=0) < corners.min(axis=0)):
        return 0.0
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    _, hit = shell.first_hits(points, up)
    return float(np.mean((hit >= 0) & (area_vectors(shell.triangles)[hit, 2] > 0)))


def _elements(shape: Shape) -> list[Element]:
    """A piece as an `Element` for each of its styles, without what one sees through."""
    base = Element(
        shape.guid,
        shape.name or shape.ifc_class,
        shape.ifc_class,
        shape.triangles,
        FURNITURE_REFLECTANCE,
        FURNITURE_REFLECTANCE,
    )
    parts = []
    for index in np.unique(shape.style_index[~shape.transparent]):
        piece = replace(base, triangles=shape.triangles[shape.style_index == index])
        if index >= 0:
            style = shape.styles[index]
            visible, solar = style.reflectances
            piece = replace(piece, reflectance_visible=visible, reflectance_solar=solar, hue=style.hue)
        parts.append(piece)
    return parts
