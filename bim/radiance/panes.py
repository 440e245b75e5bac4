"""Panes of a Radiance scene: windows of the room, layers of their glazing, and the rest."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bim.radiance.daylight import LAYERS, pane_sides
from bim.radiance.materials import SYSTEMS
from bim.radiance.patterns import TURNS
from bim.radiance.scene import RadianceObject, RadianceScene
from bim.rays import hemisphere, ray_mesh
from bim.report.issue import Effect, Issue, area_words
from mitsuba_cfs.bsdf.angular import ANGLES
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.surfaces import WindowSurface, even_numbers, points_on_triangles, triangle_areas

PARALLEL = 0.999  # cosine of 2.6 degrees
REACH = 3.0  # greatest distance of a pane in front of a window [m]
OVERLAP = 0.02  # share of a window from which a pane before it is reported
COVER = 0.98  # share of a window from which a pane covers it
MOSTLY = 0.5  # share from which it is refused
MOST_LAYERS = 8
POINTS = 256  # on a pane, from which rays start
EYES = 16  # points on a window, from which what is in its room is seen
OPEN = 0.5  # share of the rays from the inner side of a pane without a room that meet nothing
ESCAPING = 0.2  # share of the walks from the inner side of a fabric without a room that end
BOUNCES = 6  # of these walks
RAYS = 128  # from each triangle, or each point, of a pane
PAST = 3e-4  # share of a pane's light that misses the layers behind it, from which it is a window
NARROW = 0.1  # translucent strips narrower than this are no panes [m]
RIM_STEP = 3.0  # between angles at which light past the rims of panes is counted [deg]
BEFORE = 1e-3  # distance from a pane at which its rays start [m]


@dataclass(frozen=True, slots=True)
class PanedWindow:
    """A window with the panes before it that are layers of its glazing."""

    surface: WindowSurface  # its innermost pane, seen from outdoors
    panes: tuple[RadianceObject, ...]  # the outer one first
    covered: float = 0.0  # share of the pane that layers of another window cover
    beside: NDArray[np.float64] | None = None  # [N] share of light at `ANGLES` that meets this pane
    # alone, past the rims of those in front of it
    facing: NDArray[np.float64] | None = None  # [N] share of the light that it reflects outwards at
    # `ANGLES` that meets the panes before it; None without walls between them

    @property
    def outwards(self) -> list[bool]:
        """Whether the front of each pane is outdoors."""
        return [bool(pane.normal @ self.surface.normal > 0) for pane in self.panes]


@dataclass(frozen=True, slots=True)
class Panes:
    """The panes of a scene by what they are to its room."""

    windows: tuple[PanedWindow, ...]
    issues: tuple[Issue, ...]


def is_pane(thing: RadianceObject) -> bool:
    """Whether a surface can be a layer of a window."""
    material = thing.material
    return material.kind in ("glass", "BRTDfunc", *SYSTEMS) or material.is_translucent


def panes_of(scene: RadianceScene, apertures: Sequence[str], facades: Sequence[str], *, named: bool) -> Panes:
    """Windows of a scene's room, and its glass that is not simulated.

    Panes of glass, fabrics, translucent panels and BSDF in front of a window, at most half a
    metre away and parallel to it, are layers of its glazing. A pane past whose layers light
    reaches the room, beside a fabric, is a window too. Panes farther in front are refused where
    they cover most of a window, and else reported; panes with no room behind them are left out
    and reported.

    Args:
        apertures: materials or modifiers of windows.
        facades: those of facades, which are simulated as mirrors.
        named: whether the user named the apertures: then all of them are windows, and panes far
            in front of them are left out and reported.

    Raises: `DataError` for a named aperture that sees about as much sky on either side, and for a
        pane far in front of a window.
    """
    dark = {id(thing) for thing in scene.of_modifiers(facades)} if facades else set()
    panes = [o for o in scene.objects if is_pane(o) and id(o) not in dark]
    edges = _edges(panes)
    dark |= {id(thing) for thing in edges}
    panes = [o for o in panes if id(o) not in dark]
    sides, space = pane_sides(scene, panes), _Space(scene, {id(pane) for pane in panes})
    chosen: list[tuple[RadianceObject, WindowSurface]] = []
    for thing in scene.of_modifiers(apertures):
        if id(thing) in dark or not (named or _is_wide(thing)):
            continue
        try:
            surface = sides(thing)
        except DataError:
            if named:
                raise
            continue  # the sky on either side: no room
        if named or space.has_room(thing, surface):
            chosen.append((thing, surface))
    fronts = [space.before(thing, surface, refuse=not named) for thing, surface in chosen]
    layers: dict[int, list[WindowSurface]] = {}  # the windows behind each
    for one, (_, surface) in zip(fronts, chosen, strict=True):
        for pane in one.hidden:
            layers.setdefault(pane, []).append(surface)
    far = {id(pane) for one in fronts for pane in one.others}
    windows, issues = [], []
    for front, (thing, surface) in zip(fronts, chosen, strict=True):
        covered = 0.0
        if id(thing) in far:
            if space.free_share(surface, REACH) <= OVERLAP:
                continue
        elif id(thing) in layers:
            if space.past_share(surface, layers[id(thing)]) <= PAST:
                continue
            covered = 1.0 - space.free_share(surface, LAYERS)
        beside, facing = space.shares(surface, front) if front.layers else (None, None)
        facing = facing if front.walled > OVERLAP else None
        if beside is not None:
            values = {"window": thing.name, "share": 100 * diffuse_mean(beside)}
            where = f"{thing.primitive.file}:{thing.primitive.line}"
            issues.append(Issue("glass-beside-panes", where, values))
        windows.append(PanedWindow(surface, (*front.layers, thing), covered, beside, facing))
        issues += front.issues
    used = {id(pane) for window in windows for pane in window.panes} | set(layers) | far | dark
    if edges:
        values = {"count": len(edges), "first": edges[0].name}
        first = edges[0].primitive
        issues.append(Issue("edges-of-panes", f"{first.file}:{first.line}", values))
    rest = [o for o in scene.objects if not o.material.is_opaque and id(o) not in used]
    return Panes(tuple(windows), (*issues, *map(_left_out, rest)))


@dataclass(frozen=True, slots=True)
class _Front:
    """Layers and other panes in front of a window."""

    layers: tuple[RadianceObject, ...]  # of its glazing, the outer one first
    hidden: set[int]  # identities of all that are near
    others: tuple[RadianceObject, ...]  # panes that are left out
    issues: tuple[Issue, ...]
    numbers: tuple[int, ...]  # of all that are near, in the scene
    walled: float  # share of the window that is behind a wall, not the layers


class _Space:
    """A scene, and which of its surfaces are panes, for rays along the normals of panes."""

    def __init__(self, scene: RadianceScene, panes: set[int]) -> None:
        self._objects = scene.objects
        triangles = [o.triangles for o in scene.objects]
        self._mesh = ray_mesh(np.concatenate([np.empty((0, 3, 3)), *triangles]))
        self._owner = np.repeat(np.arange(len(triangles)), list(map(len, triangles)))
        self._is_pane = np.array([id(o) in panes for o in scene.objects], dtype=bool)

    def before(self, thing: RadianceObject, surface: WindowSurface, *, refuse: bool) -> _Front:
        """The layers in front of a window, by rays along its normal.

        Raises: `DataError` for a pane far in front of most of it, with `refuse`.
        """
        stacks: Counter[tuple[object, ...]] = Counter()
        examples: dict[tuple[object, ...], tuple[int, ...]] = {}
        seen: set[int] = set()
        others: dict[int, list[float]] = {}
        for met, end in self._along(surface, surface.normal, REACH):
            near = [n for n, away in met if away <= LAYERS and self._is_parallel(n, surface)]
            for n, away in met:
                if n not in near:
                    others.setdefault(n, []).append(away)
            seen.update(near)
            if end > LAYERS:  # else a frame or wall is there
                names = tuple(_optics(self._objects[n]) for n in near)
                stacks[names] += 1
                examples.setdefault(names, tuple(near))
        usual = stacks.most_common(1)[0][0] if stacks else ()
        if stacks[usual] < COVER * stacks.total():
            usual = ()
        layers = examples.get(usual, ())
        for names, count in stacks.items():
            for n in set(examples[names]) - set(layers) if names != usual else ():
                others.setdefault(n, []).extend(count * [self._distance(n, surface)])
        issues, left_out = [], []
        for n, distances in others.items():
            share = len(distances) / POINTS
            if share <= OVERLAP or n in layers:
                continue
            other, distance = self._objects[n], float(np.mean(distances))
            if refuse and share >= MOSTLY and distance > LAYERS:
                raise other.primitive.fault(
                    f"is {distance:.2f} m in front of {share:.0%} of window {thing.name}: only "
                    f"parallel panes within {LAYERS:g} m are computed; name the material "
                    f"{thing.material.name} as the aperture to leave this pane out"
                )
            left_out.append(other)
            values = {"pane": other.name, "window": thing.name, "distance": distance, "share": 100 * share}
            where = f"{other.primitive.file}:{other.primitive.line}"
            issues.append(Issue("pane-before-window", where, values, Effect(glass=surface.area)))
        walled = 1.0 - stacks.total() / POINTS
        if layers and walled > OVERLAP:
            apart = max(self._distance(n, surface) for n in layers)
            where = f"{thing.primitive.file}:{thing.primitive.line}"
            values = {"window": thing.name, "share": 100 * walled, "distance": apart}
            issues.append(Issue("panes-before-wall", where, values, Effect(glass=surface.area)))
        panes = tuple(self._objects[n] for n in reversed(layers))
        hidden = {id(self._objects[n]) for n in seen}
        return _Front(panes, hidden, tuple(left_out), tuple(issues), tuple(sorted(seen)), walled)

    def free_share(self, surface: WindowSurface, reach: float) -> float:
        """Share of a pane with neither another pane nor a wall on its room side."""
        rays = self._along(surface, -surface.normal, reach)
        return sum(not met and end > reach for met, end in rays) / POINTS

    def past_share(self, surface: WindowSurface, behind: Sequence[WindowSurface]) -> float:
        """Share of diffuse light from a pane that reaches the room past the windows behind it.

        Rays that meet nothing up to the farthest of these windows' planes, and then something
        that one of them sees.
        """
        inwards = -surface.normal
        points = _points_off_edges(surface)
        starts = np.repeat(points + BEFORE * inwards, RAYS, axis=0)
        rays = np.tile(hemisphere(inwards, RAYS), (POINTS, 1))
        cosine = rays @ inwards
        depth = max(float((one.triangles[0, 0] - surface.triangles[0, 0]) @ inwards) for one in behind)
        distance, hit = self._mesh.first_hits(starts, rays)
        past = np.flatnonzero((hit >= 0) & (distance * cosine > depth + BEFORE))
        ends = starts[past] + (distance[past, None] - BEFORE) * rays[past]
        seen = np.zeros(len(past), dtype=bool)
        for one in behind:
            for point in points_on_triangles(one.triangles, even_numbers(EYES))[0]:
                ways = ends[~seen] - (point - BEFORE * one.normal)
                meets = self._mesh.first_hits(ends[~seen] - ways, ways, 1.0)[1] >= 0
                seen[~seen] = ~meets & (ways @ one.normal < 0)
        return float(cosine[past[seen]].sum() / cosine.sum())

    def shares(self, surface: WindowSurface, front: _Front) -> tuple[NDArray[np.float64] | None, NDArray[np.float64]]:
        """Shares [N] of light at `ANGLES` by what is in front of a pane.

        Means over azimuths.  First of the light from outdoors, what meets the pane past the rims
        of those in front of it: the mean over the pane, of the rays that no wall between the panes
        stops; None where it is below `PAST` of diffuse light.  Then of the light that the pane
        reflects outwards, what meets those panes and no wall: the mean over where it is lit, by
        the share of each point's hemisphere that they cover.
        """
        polar = np.radians(np.arange(0.0, 90.0, RIM_STEP))
        points = _points_off_edges(surface)
        depth = max(self._distance(n, surface) for n in front.numbers)
        rays = cone(surface.normal, polar, TURNS)
        starts = np.repeat(points + BEFORE * surface.normal, rays[..., 0].size, axis=0)
        directions = np.tile(rays.reshape(-1, 3), (len(points), 1))
        distance, hit = self._mesh.first_hits(starts, directions)
        far = (hit < 0) | (distance * (directions @ surface.normal) > depth)
        covered = (hit >= 0) & np.isin(self._owner[hit], front.numbers)
        past, facing = (
            values.reshape(len(points), len(polar), TURNS).mean(axis=2) for values in (far & ~covered, covered)
        )
        free = past.sum(axis=0)
        beside = np.interp(ANGLES, polar, free / np.maximum(free + facing.sum(axis=0), 1 / TURNS))
        lit = facing @ np.sin(2 * polar)
        met = np.interp(ANGLES, polar, lit @ facing / lit.sum())
        return (beside if diffuse_mean(beside) > PAST else None), met

    def has_room(self, thing: RadianceObject, surface: WindowSurface) -> bool:
        """Whether there is a room on the inner side of a pane.

        From panes of glass most rays meet something; walks from fabrics and translucent panels,
        which may also be awnings and lamps, stay inside.
        """
        triangles = surface.triangles
        rays = np.tile(hemisphere(-surface.normal, RAYS), (len(triangles), 1))
        starts = np.repeat(triangles.mean(axis=1) - BEFORE * surface.normal, RAYS, axis=0)
        distance, hit = self._mesh.first_hits(starts, rays)
        if thing.material.kind in ("glass", *SYSTEMS):
            return bool(np.mean(hit < 0) <= OPEN)
        rng, escaped = np.random.default_rng(0), np.mean(hit < 0)
        for _ in range(BOUNCES):
            inside = (hit >= 0) & ~self._is_pane[self._owner[hit]]
            starts, rays, distance, hit = (v[inside] for v in (starts, rays, distance, hit))
            if not len(hit):
                break
            corners = self._mesh.triangles[hit]
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            normals /= np.linalg.norm(normals, axis=1)[:, None]
            normals *= -np.sign(np.einsum("ij,ij->i", normals, rays))[:, None]
            starts = starts + distance[:, None] * rays + BEFORE * normals
            ball = rng.normal(size=normals.shape)
            rays = normals + ball / np.linalg.norm(ball, axis=1)[:, None]
            rays /= np.linalg.norm(rays, axis=1)[:, None]
            distance, hit = self._mesh.first_hits(starts, rays)
            escaped += np.sum(hit < 0) / (RAYS * len(triangles))
        return bool(escaped <= ESCAPING)

    def _along(
        self, surface: WindowSurface, direction: NDArray[np.float64], reach: float
    ) -> list[tuple[list[tuple[int, float]], float]]:
        """Panes and their distances on rays from a pane, and where the first wall is [m]."""
        starts = points_on_triangles(surface.triangles, even_numbers(POINTS))[0]
        met: list[list[tuple[int, float]]] = [[] for _ in starts]
        ends, travelled = np.full(len(starts), np.inf), np.full(len(starts), BEFORE)
        active = np.arange(len(starts))
        for _ in range(MOST_LAYERS):
            origins = starts[active] + travelled[active, None] * direction
            ways = np.broadcast_to(direction, origins.shape)
            distance, hit = self._mesh.first_hits(origins, ways, reach)
            travelled[active] += distance
            is_hit = (hit >= 0) & (travelled[active] <= reach)
            owners = self._owner[hit]
            is_pane = is_hit & self._is_pane[owners]
            walls = active[is_hit & ~is_pane]
            ends[walls] = travelled[walls]
            for i, n in zip(active[is_pane], owners[is_pane], strict=True):
                met[i].append((int(n), float(travelled[i])))
            active = active[is_pane]
            travelled[active] += BEFORE
        return list(zip(met, ends.tolist(), strict=True))

    def _is_parallel(self, number: int, surface: WindowSurface) -> bool:
        return bool(abs(self._objects[number].normal @ surface.normal) >= PARALLEL)

    def _distance(self, number: int, surface: WindowSurface) -> float:
        apart = self._objects[number].triangles[0, 0] - surface.triangles[0, 0]
        return float(apart @ surface.normal)


def _points_off_edges(surface: WindowSurface) -> NDArray[np.float64]:
    """Points [POINTS, 3] on a pane; on its edges, rays would pass between pane and wall."""
    points = points_on_triangles(surface.triangles, even_numbers(POINTS))[0]
    return points + BEFORE * (surface.triangles.mean(axis=(0, 1)) - points)


def cone(normal: NDArray[np.float64], polar: NDArray[np.float64], turns: int) -> NDArray[np.float64]:
    """Directions [N, turns, 3] at polar angles [N] from a normal."""
    phi = 2 * np.pi * (np.arange(turns) + 0.5) / turns
    x = np.cross(normal, [0.0, 0.0, 1.0] if abs(normal[2]) < 0.9 else [1.0, 0.0, 0.0])
    x /= np.linalg.norm(x)
    around = np.cos(phi)[:, None] * x + np.sin(phi)[:, None] * np.cross(normal, x)
    return np.cos(polar)[:, None, None] * normal + np.sin(polar)[:, None, None] * around


def diffuse_mean(shares: NDArray[np.float64]) -> float:
    """Mean of shares [N] at `ANGLES` over uniform light."""
    return float(np.trapezoid(shares * np.sin(2 * ANGLES), ANGLES))


def _optics(thing: RadianceObject) -> object:
    """A key that layers of equal optics share."""
    definitions = thing.definitions if thing.parts else thing.definitions[:-1]
    return replace(thing.material, name=""), tuple(map(id, definitions))


def _edges(panes: Sequence[RadianceObject]) -> list[RadianceObject]:
    """The narrow sides of panes that are drawn as boxes: their corners are those of the panes."""
    normals: dict[tuple[float, ...], list[NDArray[np.float64]]] = {}
    narrow = []
    for pane in panes:
        if _width(pane) < NARROW:
            narrow.append(pane)
            continue
        for corner in _corners(pane):
            normals.setdefault(corner, []).append(pane.normal)
    return [
        one
        for one in narrow
        if all(
            any(abs(normal @ one.normal) < 1 - PARALLEL for normal in normals.get(corner, ()))
            for corner in _corners(one)
        )
    ]


def _corners(thing: RadianceObject) -> set[tuple[float, ...]]:
    """Vertices of a surface, to 0.1 mm."""
    return set(map(tuple, np.round(thing.triangles.reshape(-1, 3), 4) + 0.0))


def _width(thing: RadianceObject) -> float:
    """The smaller extent of a surface in its plane [m]."""
    corners = thing.triangles.reshape(-1, 3)
    sizes = np.linalg.svd(corners - corners.mean(axis=0))[2] @ corners.T
    return float(np.sort(np.ptp(sizes, axis=1))[1])


def _is_wide(thing: RadianceObject) -> bool:
    """Whether a surface is no strip, such as a slat."""
    return not thing.material.is_translucent or _width(thing) >= NARROW


def _left_out(thing: RadianceObject) -> Issue:
    material, area = thing.material, area_words(float(triangle_areas(thing.triangles).sum()))
    values = {"surface": thing.name, "material": material.name, "type": material.kind, "area": area}
    return Issue("clear-surface-left-out", f"{thing.primitive.file}:{thing.primitive.line}", values)
