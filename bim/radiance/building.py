"""A Radiance scene as a `Building` of one room.

Indoor surfaces are found by random walks.  A walk that starts on a surface goes in all directions
until it meets the inner side of a window (it began in the room), its outer side, or nothing (it
began outdoors).  The share of walks that end at windows distinguishes indoors from outdoors, even
if the drawing has slits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from bim.defaults import default_construction
from bim.model import Building, Element, Face, Space, Window
from bim.names import numbered
from bim.radiance.daylight import opaque_objects, plain_glass
from bim.radiance.layers import front_reflectance, layered_window
from bim.radiance.panes import PanedWindow, is_pane, panes_of
from bim.radiance.scene import RadianceObject, RadianceScene, read_radiance
from bim.rays import ray_mesh
from bim.report.issue import Issue
from bim.shell import enclosed_volume, open_edges, welded
from mitsuba_cfs.errors import DataError, RoomError

WALKS = 64  # from each side of a triangle
STEPS = 300  # surfaces that a walk meets at the most
ENDS = 1e-3  # of walks end at each surface, for those in closed cavities
INDOORS = 0.1  # share of walks that end at a window, from where light of the room gets to a side
CAVITY = 0.5  # half of the rays from a side are shorter than this in a cavity [m]
THICK = 1.0  # behind what is thinner the room goes on: a piece of furniture [m]
ABOVE_SURFACE = 1e-4  # distance from a surface at which its walks start [m]


@dataclass(frozen=True, slots=True)
class Indoors:
    """Which opaque triangles of a scene are in the room, axis T over all of its opaque objects."""

    triangles: NDArray[np.float64]  # [T, 3, 3] [m]
    owner: NDArray[np.int64]  # [T] object
    body: NDArray[np.int64]  # of each object: those that touch are one
    lit: NDArray[np.bool_]  # [2, T] light of the room gets to the front, to the back
    bounds: NDArray[np.bool_]  # [2, T] and it bounds the room's air: no cavity is before it
    furniture: NDArray[np.bool_]  # [T] of bodies in the room, or lit in a cavity

    @property
    def stands(self) -> NDArray[np.bool_]:
        """Furniture [T] of bodies that do not only line a cavity."""
        body = self.body[self.owner]
        standing = np.unique(body[self.furniture & self.bounds.any(axis=0)])
        return self.furniture & np.isin(body, standing)

    def outward(self, chosen: NDArray[np.bool_]) -> NDArray[np.float64]:
        """The chosen triangles [T', 3, 3], counter-clockwise seen from beyond the room."""
        front = np.where(self.bounds.any(axis=0), self.bounds[0], self.lit[0])
        return np.where(front[:, None, None], self.triangles[:, ::-1], self.triangles)[chosen]


def indoors_of(objects: Sequence[RadianceObject], windows: Sequence[Window]) -> Indoors:
    """Which surfaces of a scene light of its windows gets to, and which of them bound the room."""
    triangles = np.concatenate([np.empty((0, 3, 3)), *(thing.triangles for thing in objects)])
    owner = np.repeat(np.arange(len(objects)), [len(thing.triangles) for thing in objects])
    count = len(triangles)
    glass = np.concatenate([window.triangles for window in windows])
    walls = np.concatenate([triangles, glass])
    normals = np.cross(walls[:, 1] - walls[:, 0], walls[:, 2] - walls[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    mesh = ray_mesh(walls)
    rng = np.random.default_rng(0)
    share = np.zeros((2, count))
    rows, columns, free = [], [], []
    for side in (0, 1):  # front, back
        up = normals[:count] * (1 - 2 * side)
        starts = np.repeat(np.arange(count), WALKS)
        directions = _cosine(up[starts], rng)
        points = _points(triangles[starts], rng) + ABOVE_SURFACE * up[starts]
        distance, hit = mesh.first_hits(points, directions)
        free.append(np.median(distance.reshape(count, WALKS), axis=1))
        facing = np.einsum("ij,ij->i", directions, normals[hit]) < 0  # meets the front
        on_solid = (hit >= 0) & (hit < count)
        np.add.at(share[side], starts[(hit >= count) & ~facing], 1 / WALKS)
        rows.append(side * count + starts[on_solid])
        columns.append((hit + count * ~facing)[on_solid])
    row, column = np.concatenate(rows), np.concatenate(columns)
    weights = np.full(len(row), 1 / WALKS)
    step = csr_array((weights, (row, column)), shape=(2 * count, 2 * count))
    lit = (_reaching(share.ravel(), step) > INDOORS).reshape(2, count)
    bounds = lit & (np.stack(free) > CAVITY)
    bodies = _bodies(triangles, owner)
    return _with_furniture(Indoors(triangles, owner, bodies, lit, bounds, lit[0]), normals[:count])


def _reaching(share: NDArray[np.float64], step: csr_array) -> NDArray[np.float64]:
    """Share [N] of walks that reach a window from inside, from each side of the surfaces.

    Args: share: that reaches one at once; step: [N, N] to where the others go.
    """
    result = share.copy()
    for _ in range(STEPS):
        result = share + (1 - ENDS) * (step @ result)
    return result


def _with_furniture(indoors: Indoors, normals: NDArray[np.float64]) -> Indoors:
    """The same with the triangles marked behind which the room goes on, by majority of bodies."""
    triangles, (front, back) = indoors.triangles, indoors.lit
    outward = np.where(indoors.bounds[0][:, None], -normals, normals)
    middles = triangles.mean(axis=1) + ABOVE_SURFACE * outward
    hit = ray_mesh(triangles).first_hits(middles, outward, THICK)[1]
    from_front = np.einsum("ij,ij->i", outward, normals[hit]) < 0
    goes_on = (hit >= 0) & np.where(from_front, back[hit], front[hit])
    used = indoors.bounds.any(axis=0)
    behind = used & (indoors.bounds.all(axis=0) | goes_on)
    areas = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    body = indoors.body[indoors.owner]
    total, part = (np.bincount(body, areas * chosen) for chosen in (used, behind))
    stands = (part > 0.5 * total)[body]
    return replace(indoors, furniture=stands | (indoors.lit.any(axis=0) & ~used))


def _bodies(triangles: NDArray[np.float64], owner: NDArray[np.int64]) -> NDArray[np.int64]:
    """Number of the body that each object belongs to: objects that share corners are one."""
    corners = triangles.reshape(-1, 3)
    vertices = welded(corners)
    index = cKDTree(vertices).query(corners)[1]
    count = int(owner.max()) + 1
    size = count + len(vertices)
    links = csr_array((np.ones(len(index)), (np.repeat(owner, 3), count + index)), shape=(size, size))
    return connected_components(links, directed=False)[1][:count]


def _points(triangles: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """A point [N, 3] anywhere on each triangle [N, 3, 3]."""
    a, b = rng.random((2, len(triangles), 1))
    root = np.sqrt(a)
    first, second, third = triangles.transpose(1, 0, 2)
    return (1 - root) * first + root * (1 - b) * second + root * b * third


def _cosine(normals: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """A direction [N, 3] by the cosine round each normal: a point of the unit sphere set on it."""
    ball = rng.normal(size=normals.shape)
    directions = normals + ball / np.linalg.norm(ball, axis=1)[:, None]
    return directions / np.linalg.norm(directions, axis=1)[:, None]


NEAR = 0.3  # of the floor's level, for its other parts [m]
FLAT = 0.5  # cosine from which a surface is floor or ceiling
BEFORE = 5e-4  # distance of a layer's outdoor side from the layer [m]
LIKELY = (0.5, 2.0)  # enclosed volume over that of floor and height, where the shell is sound


def read_radiance_building(path: Path, apertures: Sequence[str] = (), facades: Sequence[str] = ()) -> Building:
    """The room of a Radiance scene file.

    Args:
        apertures: materials or modifiers of its windows; by default all of glass or with a BSDF
            that are no facades.
        facades: materials or modifiers of panes before dark rooms: they mirror.

    Raises: `DataError` for what is no scene, has no such material, or shows no room.
    """
    scene = read_radiance(path)
    panes = panes_of(scene, apertures or _clear(scene, path, facades), facades, named=bool(apertures))
    if not panes.windows:
        message = "no pane has a room behind it: name the windows' material"
        raise DataError(message, file=path, field="aperture")
    names = numbered([window.surface.name for window in panes.windows])
    layer_issues: dict[Issue, None] = {}
    windows = tuple(_window(name, window, layer_issues) for name, window in zip(names, panes.windows, strict=True))
    used = [pane for window in panes.windows for pane in window.panes]
    objects = opaque_objects(scene, scene.of_modifiers(facades), used)
    if not objects:
        raise DataError("has no opaque surface", file=path)
    indoors = indoors_of(objects, windows)
    if not indoors.bounds.any():
        message = f"no surface is indoors: is the room closed?{_not_read(scene)}"
        raise DataError(message, file=path, field="aperture")
    pieces = (*_furniture(objects, indoors), *_gap_sides(panes.windows))
    space, issues = _space(path.stem, objects, indoors, windows, pieces, _not_read(scene))
    elements = tuple(
        _element(f"{path.stem}-{i}", thing, thing.triangles)
        for i, thing in enumerate(objects)
        if not indoors.stands[indoors.owner == i].any()
    )
    issues += [*layer_issues, *_material_issues(objects)]
    every_issue = (*scene.issues, *panes.issues, *issues)
    return Building(path.stem, (space,), elements, every_issue, file=path)


def read_radiance_elements(path: Path, facades: Sequence[str] = ()) -> tuple[tuple[Element, ...], tuple[Issue, ...]]:
    """Every opaque surface of a Radiance scene file, by its name in the file.

    Args: facades: as of `read_radiance_building`.
    """
    scene = read_radiance(path)
    objects = opaque_objects(scene, scene.of_modifiers(facades))
    names = numbered([thing.name for thing in objects])
    elements = tuple(_element(name, thing, thing.triangles) for name, thing in zip(names, objects, strict=True))
    return elements, scene.issues


def _window(name: str, window: PanedWindow, issues: dict[Issue, None]) -> Window:
    """A window with its glazing; `issues` takes those of its layers."""
    triangles, glass = window.surface.triangles, plain_glass(window.panes, window.beside)
    states, up = (), None
    if glass is None:
        layered = layered_window(window.panes, window.outwards, window.beside, window.facing)
        states, up = (layered.state,), layered.up
        issues |= dict.fromkeys(layered.issues)
    return Window(
        name,
        name,
        triangles,
        opening_area=_area(triangles),
        visible_transmittance=None if glass is None else glass.transmittance,
        type_name=window.panes[-1].material.name,
        states=states,
        glass=glass,
        up=up,
        covered_area=window.covered * _area(triangles),
    )


def _clear(scene: RadianceScene, path: Path, facades: Sequence[str]) -> list[str]:
    dark = {id(thing) for thing in scene.of_modifiers(facades)} if facades else set()
    names = {thing.material.name for thing in scene.objects if is_pane(thing) and id(thing) not in dark}
    if not names:
        there = ", ".join(sorted({thing.material.name for thing in scene.objects})[:12])
        message = "has no glass, fabric or BSDF"
        message += f": name the windows' material, there are {there}" if there else " and no wall"
        raise DataError(message, file=path, field="aperture")
    return sorted(names)


def _material_issues(objects: Sequence[RadianceObject]) -> list[Issue]:
    """Materials that pass or emit light and are simulated as opaque and dark ones."""
    codes = dict.fromkeys(("light", "glow", "illum", "spotlight"), "light-source-dark")
    issues = {}
    for thing in objects:
        material = thing.material
        code = "trans-as-opaque" if material.is_translucent else codes.get(material.kind)
        if code is not None:
            where = f"{thing.primitive.file}:{thing.primitive.line}"
            values = {"material": material.name, "type": material.kind}
            issues[material.name] = Issue(code, where, values)
    return list(issues.values())


def _not_read(scene: RadianceScene) -> str:
    """Surfaces that are left out, for the error of a room that is not closed without them."""
    left_out = [issue for issue in scene.issues if issue.code == "surfaces-not-read"]
    types = [f"{one.values['count']} of type {one.values['type']} ({one.where})" for one in left_out]
    return f"; surfaces that are not read: {', '.join(types)}" if types else ""


def _space(
    name: str,
    objects: Sequence[RadianceObject],
    indoors: Indoors,
    windows: tuple[Window, ...],
    furniture: tuple[Element, ...],
    not_read: str,
) -> tuple[Space, list[Issue]]:
    seen = indoors.bounds.any(axis=0) & ~indoors.furniture
    faces = _faces(objects, indoors.outward(seen), indoors.owner[seen], windows)
    floor = sum(face.area for face in faces if face.kind == "floor")
    if not floor:
        raise RoomError(f"space {name}: has no floor{not_read}")
    shell = np.concatenate([part.triangles for part in (*faces, *windows)])
    volume = enclosed_volume(shell)
    drawn = floor * float(np.ptp(shell[..., 2]))
    issues = [Issue("constructions-unstated", name)]
    if not LIKELY[0] * drawn < volume < LIKELY[1] * drawn:
        values = {"room": name, "enclosed": volume, "drawn": drawn}
        issues.append(Issue("volume-from-floor-and-height", name, values))
        volume = drawn
    leaks = open_edges(shell)
    if leaks:
        issues.append(Issue("room-with-open-edges", name, {"room": name, "count": leaks}))
    return Space(f"{name}-room", name, "", volume, floor, faces, windows, volume, furniture=furniture), issues


def _faces(
    objects: Sequence[RadianceObject],
    triangles: NDArray[np.float64],
    owner: NDArray[np.int64],
    windows: Sequence[Window],
) -> tuple[Face, ...]:
    """Triangles of one material in one plane as a face each."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = 0.5 * np.linalg.norm(normals, axis=1)
    normals /= 2 * areas[:, None]
    offsets = np.einsum("ij,ij->i", normals, triangles[:, 0])
    level = _floor_level(triangles, normals, areas)
    planes: dict[tuple, list[int]] = {}
    for i, (normal, offset) in enumerate(zip(normals, offsets, strict=True)):
        plane = (*np.round(normal, 3) + 0.0, round(float(offset), 3))
        planes.setdefault((objects[owner[i]].material.name, *plane), []).append(i)
    faces = []
    for chosen in planes.values():
        thing = objects[owner[chosen[0]]]
        own = triangles[chosen]
        normal, z = normals[chosen[0]], own[..., 2].mean()
        kind = "ceiling" if normal[2] > FLAT else "wall"
        if normal[2] < -FLAT and abs(z - level) < NEAR:
            kind = "floor"
        outside = any(_beside(own, normal, window) for window in windows)
        beyond = "outside" if outside else "adiabatic"
        shine = thing.material
        faces.append(
            Face(
                thing.name,
                kind,
                own,
                beyond,
                default_construction(kind, beyond),
                shine.diffuse,
                shine.diffuse,
                gloss=shine.gloss,
                element=thing.name,
            )
        )
    return tuple(faces)


def _furniture(objects: Sequence[RadianceObject], indoors: Indoors) -> tuple[Element, ...]:
    """Furniture of the room, with a GUID for each body, and what is lit in cavities around it."""
    pieces = []
    for i in np.unique(indoors.owner[indoors.furniture]):
        own = indoors.furniture & (indoors.owner == i)
        stands = indoors.stands[own].any()
        guid = f"furniture-{indoors.body[i]}" if stands else f"cavity-{i}"
        # their normals leave the room: those of a body are turned to leave the body
        triangles = indoors.outward(own)[:, ::-1]
        pieces.append(_element(guid, objects[i], triangles))
    return tuple(pieces)


def _gap_sides(windows: Sequence[PanedWindow]) -> Iterator[Element]:
    """The outdoor sides of layers, where light in the gap before them gets past their rims."""
    free = {id(window.panes[-1]) for window in windows if window.covered}
    for window in windows:
        *outer, layer = window.panes
        if any(id(pane) in free for pane in outer):
            rho = front_reflectance(layer, window.outwards[-1])
            triangles = window.surface.triangles + BEFORE * window.surface.normal
            yield Element(
                f"cavity-{layer.name}",
                layer.name,
                layer.material.kind,
                triangles,
                rho,
                rho,
                material=layer.material.name,
            )


def _floor_level(triangles: NDArray[np.float64], normals: NDArray[np.float64], areas: NDArray[np.float64]) -> float:
    """Height of most of what lies below the room [m]."""
    low = normals[:, 2] < -FLAT
    heights = np.round(triangles[low][..., 2].mean(axis=1), 2)
    if not len(heights):
        return float(triangles[..., 2].min())
    levels, index = np.unique(heights, return_inverse=True)
    return float(levels[np.argmax(np.bincount(index, areas[low]))])


def _beside(triangles: NDArray[np.float64], normal: NDArray[np.float64], window: Window) -> bool:
    """Whether a face lies in the wall of a window."""
    apart = (triangles.mean(axis=(0, 1)) - window.centre) @ window.normal
    return bool(normal @ window.normal > 0.99 and abs(apart) < THICK)


def _element(guid: str, thing: RadianceObject, triangles: NDArray[np.float64]) -> Element:
    shine = thing.material
    return Element(
        guid, thing.name, shine.kind, triangles, shine.diffuse, shine.diffuse, material=shine.name, gloss=shine.gloss
    )


def _area(triangles: NDArray[np.float64]) -> float:
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return float(0.5 * np.linalg.norm(cross, axis=1).sum())
