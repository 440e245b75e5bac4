"""Panes of a Radiance scene: windows of the room, layers of their glazing, and the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from bim.planes import merged_polygons, plane_through
from bim.radiance.daylight import LAYERS, pane_sides
from bim.radiance.scene import RadianceObject, RadianceScene
from bim.rays import RayMesh, hemisphere, ray_mesh
from bim.report.issue import Effect, Issue
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.surfaces import WindowSurface, triangle_areas

PARALLEL = 0.999  # cosine of 2.6 degrees
REACH = 3.0  # parallel panes this near stand before a window [m]
TOUCHING = 1e-3  # panes nearer than this lie in one plane [m]
OVERLAP, COVER = 0.02, 0.98  # shares of a window from which a pane is before it, and covers it
OPEN = 0.5  # share of the rays from the inner side of a pane without a room that meet nothing
RAYS = 128  # from each triangle of a pane
BEFORE = 1e-3  # distance from a pane at which its rays start [m]


@dataclass(frozen=True, slots=True)
class PanedWindow:
    """A window with the panes before it that are layers of its glazing."""

    surface: WindowSurface  # its innermost pane, seen from outdoors
    panes: tuple[RadianceObject, ...]  # the outer one first


@dataclass(frozen=True, slots=True)
class Panes:
    """The panes of a scene by what they are to its room."""

    windows: tuple[PanedWindow, ...]
    issues: tuple[Issue, ...]


def panes_of(
    scene: RadianceScene, apertures: Sequence[str], facades: Sequence[str], *, named: bool
) -> Panes:
    """Windows of a scene's room, and its glass that is not simulated.

    A pane of glass parallel to a window and in front of all of it, at most half a metre away, is a
    layer of its glazing. Other panes in front of a window, and panes with no room behind them, are
    left out and reported.

    Args:
        apertures: materials or modifiers of windows.
        facades: those of facades, which are simulated as mirrors.
        named: whether the user named the apertures: then all of them are windows.

    Raises: `DataError` for a named aperture that sees about as much sky on either side.
    """
    dark = {id(thing) for thing in scene.of_modifiers(facades)} if facades else set()
    things = [thing for thing in scene.of_modifiers(apertures) if id(thing) not in dark]
    sides = pane_sides(scene)
    whole = ray_mesh(np.concatenate([np.empty((0, 3, 3)), *(o.triangles for o in scene.objects)]))
    chosen: list[tuple[RadianceObject, WindowSurface]] = []
    for thing in things:
        try:
            surface = sides(thing)
        except DataError:
            if named:
                raise
            continue  # the sky on either side: no room
        if named or not _is_free_standing(whole, surface):
            chosen.append((thing, surface))
    layers, beyond, issues = _in_front(chosen)
    windows = [
        PanedWindow(surface, (*(chosen[j][0] for j in layers[i]), thing))
        for i, (thing, surface) in enumerate(chosen)
        if i not in beyond
    ]
    used = {id(thing) for thing, _ in chosen} | dark
    rest = [o for o in scene.objects if not o.material.is_opaque and id(o) not in used]
    return Panes(tuple(windows), (*issues, *map(_left_out, rest)))


def _in_front(
    panes: Sequence[tuple[RadianceObject, WindowSurface]],
) -> tuple[list[list[int]], set[int], list[Issue]]:
    """Layers of each pane, the outer one first; panes that are before others; what is left out."""
    layers: list[list[int]] = []
    beyond: set[int] = set()
    issues: list[Issue] = []
    for thing, surface in panes:
        before: list[tuple[float, int]] = []
        triangles = surface.triangles
        plane = plane_through(triangles[0, 0], _normal(triangles))
        own = shapely.union_all(merged_polygons(plane.to_plane(triangles)[..., :2]))
        for j, (other, outer) in enumerate(panes):
            if other is thing or _normal(outer.triangles) @ plane.normal < PARALLEL:
                continue
            flat = plane.to_plane(outer.triangles)
            distance = float(flat[..., 2].mean())
            if not TOUCHING < distance <= REACH:
                continue
            cover = shapely.union_all(merged_polygons(flat[..., :2])).intersection(own).area
            share = cover / own.area
            if share <= OVERLAP:
                continue
            beyond.add(j)
            both_glass = thing.material.kind == other.material.kind == "glass"
            if both_glass and share >= COVER and distance <= LAYERS:
                before.append((distance, j))
                continue
            values = {"pane": other.name, "window": thing.name, "distance": distance,
                      "share": 100 * share}  # fmt: skip
            where = f"{other.primitive.file}:{other.primitive.line}"
            effect = Effect(glass=float(triangle_areas(triangles).sum()))
            issues.append(Issue("pane-before-window", where, values, effect))
        layers.append([j for _, j in sorted(before, reverse=True)])
    return layers, beyond, issues


def _is_free_standing(scene: RayMesh, surface: WindowSurface) -> bool:
    """Whether most rays from the inner side of a pane meet nothing: it has no room behind it."""
    triangles, inwards = surface.triangles, -_normal(surface.triangles)
    rays = np.tile(hemisphere(inwards, RAYS), (len(triangles), 1))
    starts = np.repeat(triangles.mean(axis=1) + BEFORE * inwards, RAYS, axis=0)
    return bool(np.mean(scene.first_hits(starts, rays)[1] < 0) > OPEN)


def _left_out(thing: RadianceObject) -> Issue:
    material, area = thing.material, float(triangle_areas(thing.triangles).sum())
    values = {"surface": thing.name, "material": material.name, "type": material.kind, "area": area}
    return Issue("clear-surface-left-out", f"{thing.primitive.file}:{thing.primitive.line}", values)


def _normal(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    normal = np.cross(*np.diff(triangles[0], axis=0))
    return normal / np.linalg.norm(normal)
