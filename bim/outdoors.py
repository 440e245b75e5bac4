"""Surroundings outside the windows, and the check that nothing covers the glass.

`simplified_mesh` reduces elements that are far finer than daylight needs, with a stated error:
vertices are merged on ever wider grids until few enough triangles remain; the error is the largest
displacement of a vertex.  Only outdoor elements and furniture are simplified, never the boundary of
a room.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from trimesh.intersections import slice_faces_plane

from bim.defaults import CLEAR_GLAZING, GLASS_REFLECTANCE
from bim.isolated_solids import Outline, opened
from bim.model import Element, Space, Window
from bim.planes import merged_polygons, plane_through
from bim.rays import hemisphere, ray_mesh
from bim.report.issue import Effect, Issue
from mitsuba_cfs.processes import ProcessEnded
from mitsuba_cfs.surfaces import area_vectors

COVERED = 0.9  # share of rays stopped at once that makes a window blind
AT_ONCE = 0.35  # an obstruction this near to the glass is on the window [m]
CUT_DEPTH = 0.6  # how far from the glass a wall is cut open [m]
SITE_CLASSES = ("IfcSite", "IfcGeographicElement")
RAYS = 36
FACE = 0.99  # cosine to the biggest part of a pane from which another is of its faces
BEFORE_GLASS = 0.5  # what is nearer to a window's plane is of its own facade [m]
FARTHEST = 50e3  # from the rooms, of what counts as their surroundings [m]
SHUT_IN = "window-shut-in"  # code of the issue
LEAST_OPEN = 0.02  # share of the half space before glass, by cosine: less is as good as nothing
WINDOWS_AT_ONCE = 256  # whose panes are compared with a face at once
NOTHING = np.empty((0, 3, 3))
GRAZING = 0.3  # cosine: flatter rays meet the reveals of every window
NEAR = AT_ONCE / GRAZING  # the longest of rays that end at once [m]


@dataclass(frozen=True, slots=True)
class Outdoors:
    """Elements that no window is blinded by, and what had to be cut or left out for that."""

    elements: tuple[Element, ...]
    issues: tuple[Issue, ...]


def unblinded(elements: Sequence[Element], spaces: Sequence[Space]) -> Outdoors:
    """Elements with holes cut, or left out, where they lie on the glass of a window."""
    elements, issues = _within_reach(elements, spaces)
    used = {window.guid for space in spaces for window in space.windows}
    for _ in range(3 if elements else 0):  # a second element may lie behind the first
        near = _Near(elements, used)
        covers: dict[int, list[Window]] = {}
        for space in spaces:
            own = {window.guid for window in space.windows}
            for window in space.windows:
                for index in near.covering(window, own):
                    covers.setdefault(index, []).append(window)
        if not covers:
            break
        bodies = _opened([(elements[index], covers[index]) for index in covers])
        cut = dict(zip(covers, bodies, strict=True))
        for index in sorted(covers, reverse=True):
            element, body = elements[index], cut[index]
            values = {"element": f"{element.ifc_class} {element.name}", "count": len(covers[index])}
            if isinstance(body, np.ndarray):
                elements[index] = replace(element, triangles=body)
                issues.append(Issue("element-cut-open", element.guid, values))
                continue
            del elements[index]
            if body is None:
                issues.append(Issue("element-covers-window", element.guid, values))
            else:
                values["reason"] = str(body)
                issues.append(Issue("element-not-cut-open", element.guid, values))
    issues += _shut_in(elements, spaces)
    return Outdoors(tuple(elements), tuple(issues))


def _within_reach(elements: Sequence[Element], spaces: Sequence[Space]) -> tuple[list[Element], list[Issue]]:
    """The elements without those that stand beyond every horizon, as strays of a file do."""
    if not spaces:
        return list(elements), []
    corners = np.concatenate([space.shell.reshape(-1, 3) for space in spaces])
    low, high = corners.min(axis=0), corners.max(axis=0)
    kept, issues = [], []
    for element in elements:
        points = element.triangles.reshape(-1, 3)
        gap = np.maximum(points.min(axis=0, initial=np.inf) - high, 0.0)
        gap = np.maximum(gap, low - points.max(axis=0, initial=-np.inf))
        away = float(np.linalg.norm(gap))
        if away <= FARTHEST:
            kept.append(element)
            continue
        label = f"{element.ifc_class} {element.name}"
        values = {"element": label, "distance_km": away / 1000}
        issues.append(Issue("element-far-away", element.guid, values))
    return kept, issues


def shut_in_area(issues: Iterable[Issue]) -> float:
    """Area of the windows that issues say have nothing open before them [m2]."""
    parts = {(i.where, round(i.effect.glass, 6)) for i in issues if i.code == SHUT_IN}
    return sum(area for _, area in parts)  # a window may be before two rooms


def _shut_in(elements: Sequence[Element], spaces: Sequence[Space]) -> list[Issue]:
    """Windows before which hardly anything is open, such as those to a porch that is no space."""
    if not elements:
        return []
    near, issues = _Near(elements, {w.guid for space in spaces for w in space.windows}), []
    for space in spaces:
        own = {window.guid for window in space.windows}
        for window in space.windows:
            free = near.open_share(window, own)
            if free < LEAST_OPEN:
                values = {"window": window.name, "room": space.label, "area": window.area, "open_percent": 100 * free}
                issues.append(Issue(SHUT_IN, window.guid, values, Effect(glass=window.area)))
    return issues


def before_windows(elements: Sequence[Element], windows: Sequence[Window]) -> NDArray[np.float64]:
    """Triangles [T, 3, 3] of the surroundings, without those behind every window's plane.

    A ray from a window to the sun meets these alone; stairs and slabs that reach into the room,
    which the elements hold too, are behind.
    """
    planes = {tuple(np.round([*w.normal, w.normal @ w.centre], 3)): w for w in windows}
    rest = np.concatenate([NOTHING, *(element.triangles for element in elements)])
    obstructions = [NOTHING]
    for window in planes.values():
        obstructions.append(beyond(rest, window.normal, window.centre))
        rest = beyond(rest, -window.normal, window.centre)
    return np.concatenate(obstructions)


def beyond(
    triangles: NDArray[np.float64], normal: NDArray[np.float64], origin: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The parts of triangles on the side of a plane that its normal points to."""
    if not len(triangles):
        return NOTHING
    faces = np.arange(3 * len(triangles)).reshape(-1, 3)
    vertices, faces, _ = slice_faces_plane(triangles.reshape(-1, 3), faces, normal, origin)
    return np.asarray(vertices)[faces] if len(faces) else NOTHING


def mirrors_in_view(elements: Sequence[Element], windows: Sequence[Window]) -> tuple[list[Element], list[Issue]]:
    """Elements of which the default's panes mirror where a window may see them, and what that is.

    The rest, such as edges of panes and panes beside the window in its own facade, reflect as much
    diffusely: no window sees them, and every plane that mirrors costs rays.
    """
    result: list[Element] = []
    seen: list[Element] = []
    centres = np.array([window.centre for window in windows]).reshape(-1, 3)
    facing = np.array([window.normal for window in windows]).reshape(-1, 3)
    for element in elements:
        if element.gloss is not CLEAR_GLAZING:
            result.append(element)
            continue
        mirrors = _faces_in_view(element.triangles, centres, facing)
        if mirrors.any():
            seen.append(replace(element, triangles=element.triangles[mirrors]))
            result.append(seen[-1])
        if not mirrors.all():
            plain = {"reflectance_visible": GLASS_REFLECTANCE, "reflectance_solar": GLASS_REFLECTANCE}
            rest = element.triangles[~mirrors]
            result.append(replace(element, triangles=rest, gloss=None, **plain))
    if not seen:
        return result, []
    values = {"count": len(seen), "element": seen[0].name}
    return result, [Issue("panes-assumed-mirroring", seen[0].guid, values)]


def _faces_in_view(
    triangles: NDArray[np.float64], centres: NDArray[np.float64], facing: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Triangles [T] of a pane's two faces that one of the windows [W, 3] may see."""
    vectors = area_vectors(triangles)
    areas = np.linalg.norm(vectors, axis=1)
    normals = vectors / np.maximum(areas, 1e-300)[:, None]
    along = np.abs(normals @ normals[np.argmax(areas)]) > FACE
    plane, own = (centres * facing).sum(axis=1), (triangles.mean(axis=1) * normals).sum(axis=1)
    in_view = np.zeros(len(triangles), dtype=bool)
    for start in range(0, len(centres), WINDOWS_AT_ONCE):
        some = slice(start, start + WINDOWS_AT_ONCE)
        before = (triangles @ facing[some].T).max(axis=1) - plane[some] > BEFORE_GLASS
        towards = normals @ centres[some].T > own[:, None]
        in_view |= along & (before & towards).any(axis=1)
    return in_view


class _Near:
    """What rays from windows meet at once: windows of rooms, and what is none.

    The two apart: a room's own panes and frames do not count, yet what lies in their very faces,
    such as a window that the file draws again, does.
    """

    def __init__(self, elements: Sequence[Element], used: set[str]) -> None:
        """Args: used: GUIDs of the rooms' windows."""
        self._guids = np.array([element.guid for element in elements])
        window = np.isin(self._guids, list(used))
        self._parts = []
        for chosen in (np.flatnonzero(~window), np.flatnonzero(window)):
            triangles = [NOTHING, *(elements[index].triangles for index in chosen)]
            owner = np.repeat(chosen, [len(elements[index].triangles) for index in chosen])
            if len(owner):
                self._parts.append((ray_mesh(np.concatenate(triangles)), owner))

    def covering(self, window: Window, own: set[str]) -> set[int]:
        """Elements that stop nearly every ray just outside the glass; none if it is free.

        Args: own: GUIDs of the windows of its room.
        """
        origins, directions = _rays(window, GRAZING)
        is_own = np.isin(self._guids, list(own))
        cover, nearest = np.full(len(origins), -1), np.full(len(origins), np.inf)
        for part in self._parts:
            distance, index = _first_of_others(*part, is_own, origins, directions, NEAR)
            met = (distance * (directions @ window.normal) < AT_ONCE) & (distance < nearest)
            cover[met], nearest[met] = index[met], distance[met]
        if np.mean(cover >= 0) < COVERED:
            return set()
        covering, counts = np.unique(cover[cover >= 0], return_counts=True)
        return {int(i) for i, n in zip(covering, counts, strict=True) if n > 0.2 * len(cover)}

    def open_share(self, window: Window, own: set[str]) -> float:
        """Cosine-weighted share of the half space outside a window that is free."""
        origins, directions = _rays(window, 0.0)
        is_own, free = np.isin(self._guids, list(own)), np.ones(len(origins), dtype=bool)
        for part in self._parts:
            distance, _ = _first_of_others(*part, is_own, origins, directions, np.inf)
            free &= np.isinf(distance)
        return float(np.average(free, weights=directions @ window.normal))


def _rays(window: Window, flattest: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Origins and directions [R, 3] of rays out of a window that have a cosine of so much."""
    areas = np.linalg.norm(area_vectors(window.triangles), axis=1)
    points = window.triangles[np.argsort(-areas)[:3]].mean(axis=1) + 1e-4 * window.normal
    directions = hemisphere(window.normal, RAYS)
    directions = directions[directions @ window.normal > flattest]
    return np.repeat(points, len(directions), axis=0), np.tile(directions, (len(points), 1))


def _first_of_others(
    mesh,
    owner: NDArray[np.int64],
    is_own: NDArray[np.bool_],
    origins: NDArray[np.float64],
    directions: NDArray[np.float64],
    reach: float,
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Distance to, and number of, what each ray meets first that is not mine; else inf and -1."""
    nearest, index = np.full(len(origins), np.inf), np.full(len(origins), -1)
    travelled, rays = np.zeros(len(origins)), np.arange(len(origins))
    for _ in range(8):  # through the window's own panes and frame
        start = origins[rays] + travelled[rays, None] * directions[rays]
        distance, hit = mesh.first_hits(start, directions[rays], reach)
        rays, distance, hit = rays[hit >= 0], distance[hit >= 0], owner[hit[hit >= 0]]
        travelled[rays] += distance + 1e-5
        others = ~is_own[hit]
        nearest[rays[others]], index[rays[others]] = travelled[rays[others]], hit[others]
        rays = rays[~others & (travelled[rays] < reach)]
        if not len(rays):
            break
    return nearest, index


def _opened(covering: Sequence[tuple[Element, Sequence[Window]]]) -> list[NDArray[np.float64] | ProcessEnded | None]:
    """Each body with a hole at its windows; None for thin or open ones, which are left out."""
    walls = ("IfcWall", "IfcRoof", "IfcSlab", "IfcCovering", *SITE_CLASSES)
    return opened(
        [
            (element.triangles if element.ifc_class.startswith(walls) else NOTHING, _holes(windows))
            for element, windows in covering
        ]
    )


def _holes(windows: Sequence[Window]) -> list[Outline]:
    """What is cut out before windows."""
    holes = []
    for window in windows:
        plane = plane_through(window.triangles[0, 0], window.normal)
        panes = merged_polygons(plane.to_plane(window.triangles)[..., :2])
        holes += [(pane, plane, -CUT_DEPTH, CUT_DEPTH) for pane in panes]
    return holes


def lifted_sites(elements: Sequence[Element], windows: Sequence[Window]) -> tuple[list[Element], list[Issue]]:
    """Elements without the terrain that buries the middle of a window; such terrain is reported."""
    kept, issues = [], []
    points = np.array([window.centre + 0.05 * window.normal for window in windows]).reshape(-1, 3)
    upwards = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    for element in elements:
        buried = 0
        if element.ifc_class.startswith(SITE_CLASSES):
            distance, _ = ray_mesh(element.triangles).first_hits(points, upwards, 100.0)
            buried = int(np.isfinite(distance).sum())
        if not buried:
            kept.append(element)
            continue
        values = {"element": element.name, "count": buried}
        issues.append(Issue("terrain-above-window", element.guid, values))
    return kept, issues


FINE = 5_000  # triangles of one element, above which it is made coarser
STEPS = (0.002, 0.005, 0.01, 0.02)  # of the grids [m]
KEPT_AREA = 0.9  # share of the surface that has to be left: slats and bars must not vanish


def simplified(elements: list[Element]) -> tuple[list[Element], list[Issue]]:
    """The elements, those of many triangles simplified, and an issue for each of these."""
    result, issues = [], []
    for element in elements:
        triangles, error = simplified_mesh(element.triangles)
        if len(triangles) < len(element.triangles):
            values = {
                "element": f"{element.ifc_class} {element.name}",
                "before": len(element.triangles),
                "after": len(triangles),
                "moved_mm": 1000 * error,
            }
            issues.append(Issue("mesh-simplified", element.guid, values))
            element = replace(element, triangles=triangles)
        result.append(element)
    return result, issues


def simplified_mesh(
    triangles: NDArray[np.float64], most: int = FINE, steps: Sequence[float] = STEPS
) -> tuple[NDArray[np.float64], float]:
    """Triangles [M, 3, 3], at most `most` where that can be, and how far a vertex moved [m].

    Args: steps: rising sizes of the grids' cells [m], tried in turn.
    """
    best, error = triangles, 0.0
    area = _area(triangles)
    for step in steps:
        if len(best) <= most:
            break
        merged, moved = _merged(triangles, step)
        if _area(merged) < KEPT_AREA * area:
            break
        best, error = merged, moved
    return best, error


def _merged(triangles: NDArray[np.float64], step: float) -> tuple[NDArray[np.float64], float]:
    """Vertices of one cell of a grid put to their mean; collapsed and repeated faces left out."""
    corners = triangles.reshape(-1, 3)
    cells = np.floor(corners / step).astype(np.int64)
    _, index = np.unique(cells, axis=0, return_inverse=True)
    index = index.ravel()
    counts = np.bincount(index)
    means = np.stack([np.bincount(index, corners[:, k]) / counts for k in range(3)], axis=1)
    moved = float(np.linalg.norm(means[index] - corners, axis=1).max())
    faces = index.reshape(-1, 3)
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return means[faces[np.sort(first)]], moved


def _area(triangles: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(area_vectors(triangles), axis=1).sum())
