"""The building as a small mesh for the page: rooms, windows, what shades them, sensors."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.outdoors import beyond
from bim.to_tracer import element_surfaces
from scenes.figures.plan import sensor_cells
from scenes.figures.scale import ColourScale
from scenes.language.catalogue import N_, gettext
from scenes.report.daylight_figures import top_of_scale, useful_column
from scenes.report.headline import sensor_column
from scenes.report.names import quantity
from scenes.report.storeys import storey_name
from scenes.results import RunResult

MOST_TRIANGLES = 24_000  # of the surroundings; beyond, the smallest are left out
KINDS = ("floor", "ceiling", "wall", "door", "frame", "glass", "furniture", "outdoors")
KIND_OF_FACE = {
    "floor": "floor",
    "ceiling": "ceiling",
    "roof": "ceiling",
    "wall": "wall",
    "door": "door",
    "window frame": "frame",
    "reveal": "wall",
}
ON_TOP = 0.1  # surroundings that begin at most so far below a storey's top are on it [m]
TERRAIN = ("IfcSite", "IfcGeographic")
BESIDE = 1.0  # elements this near belong to the building [m]
STOREYS_ABOVE = 3  # without rooms, the roof with them
SHOWN = 300.0  # of the surroundings at the least, from the rooms [m]
SHOWN_SIZES = 5  # or so many times the rooms' size
MARK = 0.3  # least size of the mark of a leak [m]
NORTH_DOUBTS = {  # code of an issue: what the arrow then is
    "true-north-missing": N_("This is an assumption: the file states no north."),
    "true-north-invalid": N_("This is an assumption: the north of the file is not usable."),
    "north-contradicts-map": N_("The file states two different directions of north."),
}
NORTH = 0.2  # length of the arrow by the longer side of the building
STEPS = 32000  # of the 16-bit coordinates over the model's half size


@dataclass(frozen=True, slots=True)
class ColourLayer:
    """A colouring of the sensors."""

    key: str
    scale: ColourScale
    colours: str  # base64 of RGB bytes [S, 3], the sensors of all rooms in order
    digits: int


@dataclass(frozen=True, slots=True)
class Model3D:
    """What the page's viewer needs; positions are 16-bit integers, base64."""

    centre: tuple[float, float, float]  # [m]
    whole: tuple[tuple[float, ...], ...]  # lowest and highest corner of the building from there [m]
    unit: float  # metres per integer step
    batches: tuple[dict[str, Any], ...]  # room index (-1 outdoors), storey, kind, triangles, edges
    sensors: dict[str, Any]  # room and storey of each, corners
    layers: tuple[ColourLayer, ...]
    rooms: tuple[str, ...]
    storeys: tuple[str, ...]  # names, the lowest first
    left_out: int
    extra: tuple[str, ...] = ()  # kinds of what belongs to no room: "mark", "before", "north"
    north: str = ""  # what is doubtful of the arrow

    def json(self) -> dict[str, Any]:
        """The parts that go into the page as JSON."""
        return {
            "unit": self.unit,
            "whole": self.whole,
            "batches": self.batches,
            "sensors": self.sensors,
            "rooms": self.rooms,
            "storeys": self.storeys,
            "layers": [{"key": layer.key, "colours": layer.colours} for layer in self.layers],
        }


def model3d(result: RunResult) -> Model3D:
    """The mesh of the run's rooms, all elements outdoors, and the sensors in their colours."""
    spaces = tuple(room.space for room in result.spaces)
    points = [room.daylight.points for room in result.spaces]
    return _model(result.building, spaces, points=points, layers=layers(result))


def checked_model(building: Building, before: Building | None = None) -> Model3D:
    """The mesh of a building that is not computed, with a mark at each leak.

    Args: before: the same file without its corrections, whose rooms are shown beside.
    """
    spaces, extra = building.spaces, []
    for issue in building.issues:
        if issue.code == "room-leaks":
            place = np.array([float(str(issue.values[axis])) for axis in "xyz"])
            half = max(MARK, float(str(issue.values["width"]))) / 2.0
            extra.append(("mark", _cube(place, half)))
    if before is not None:
        extra += [("before", space.shell) for space in before.spaces]
    return _model(building, spaces, extra=extra)


def _cube(middle: NDArray[np.float64], half: float) -> NDArray[np.float64]:
    """Triangles [12, 3, 3] of a cube, normals out."""
    corners = middle + half * np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    return corners[[k for a, b, c, d in quads for k in (a, b, c, a, c, d)]].reshape(-1, 3, 3)


def _arrow(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """Triangles [2, 3, 3] of an arrow on the ground that points north, south of a box."""
    length = NORTH * float((high - low)[:2].max())
    tip = np.array([(low[0] + high[0]) / 2, low[1] - length / 4, low[2]])
    left, right, notch = tip + length * np.array([(-0.25, -1, 0), (0.25, -1, 0), (0, -0.75, 0)])
    return np.array([[tip, notch, left], [tip, right, notch]])  # faces towards the eye are not drawn


def _model(
    building: Building,
    spaces: Sequence[Space],
    *,
    points: Sequence[NDArray[np.float64]] = (),
    layers: tuple[ColourLayer, ...] = (),
    extra: Sequence[tuple[str, NDArray[np.float64]]] = (),
) -> Model3D:
    """The mesh of rooms and surroundings.

    Args:
        points: sensors [S, 3] of each room; extra: kinds and triangles of what belongs to no room.
    """
    around = element_surfaces(building.elements).triangles
    shells = [space.shell.reshape(-1, 3) for space in spaces]
    shells += [triangles.reshape(-1, 3) for _, triangles in extra]
    if not spaces:
        shells += [around.reshape(-1, 3), *([] if shells or len(around) else [np.zeros((1, 3))])]
    corners = np.concatenate(shells)
    low, high = corners.min(axis=0), corners.max(axis=0)
    centre = (low + high) / 2
    shown = max(float((high - low).max()) * SHOWN_SIZES, SHOWN)
    outdoors, left_out = largest_triangles(cut_to(around, low - shown, high + shown))
    box = building_box(building) if building.spaces else np.array([low, high])
    extra = [*extra, ("north", _arrow(*box))]
    packed_corners = [corners, outdoors.reshape(-1, 3), extra[-1][1].reshape(-1, 3)]
    reach = np.abs(np.concatenate(packed_corners) - centre).max()
    unit = float(reach) / STEPS
    names, levels, tops = storey_levels(spaces)

    def packed(points: NDArray[np.float64]) -> str:
        return _base64(np.round((points - centre) / unit).astype("<i2"))

    batches = []
    for index, space in enumerate(spaces):
        for kind, triangles, edges in room_batches(space):
            batches.append(
                {"room": index, "storey": levels[index], "kind": kind, "t": packed(triangles), "e": packed(edges)}
            )
    above = (outdoors[:, :, 2].min(axis=1)[:, None] + ON_TOP >= tops).sum(axis=1)
    for level in np.unique(above):
        part = outdoors[above == level]
        edges = outline_edges(part)
        batches.append({"room": -1, "storey": int(level), "kind": "outdoors", "t": packed(part), "e": packed(edges)})
    for kind, triangles in extra:
        batches.append(
            {"room": -1, "storey": 0, "kind": kind, "t": packed(triangles), "e": packed(outline_edges(triangles))}
        )
    cells, owners = [np.empty((0, 4, 3))], []
    for index, places in enumerate(points):
        flat = sensor_cells(places)
        middle = flat.mean(axis=1, keepdims=True)
        flat = middle + 0.9 * (flat - middle)
        z = np.broadcast_to(places[:, None, 2:3], (*flat.shape[:2], 1))
        cells.append(np.concatenate([flat, z], axis=-1))
        owners += [index] * len(flat)
    sensors = {"room": owners, "storey": [levels[owner] for owner in owners], "corners": packed(np.concatenate(cells))}
    labels = tuple(space.label for space in spaces)
    whole = tuple(map(tuple, (box - centre).round(3).tolist()))
    return Model3D(
        tuple(centre),
        whole,
        unit,
        tuple(batches),
        sensors,
        layers,
        labels,
        names,
        left_out,
        tuple(dict.fromkeys(kind for kind, _ in extra)),
        next((gettext(NORTH_DOUBTS[one.code]) for one in building.issues if one.code in NORTH_DOUBTS), ""),
    )


def cut_to(triangles: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """The part of the triangles [T, 3, 3] within an upright box."""
    for axis, sign, corner in [(a, s, c) for a in range(3) for s, c in ((1.0, low), (-1.0, high))]:
        if (sign * (triangles[..., axis] - corner[axis]) < 0).any():
            triangles = beyond(triangles, sign * np.eye(3)[axis], corner)
    return triangles


def building_box(building: Building) -> NDArray[np.float64]:
    """Corners [2, 3] of the box round all rooms of a building and what touches them, its roof [m].

    Terrain and elements more than a metre away are left out.
    """
    shells = [space.shell for space in building.spaces]
    parts = [e.triangles for e in building.elements if not e.ifc_class.startswith(TERRAIN)]
    boxes = np.array([[t.min(axis=(0, 1)), t.max(axis=(0, 1))] for t in parts if len(t)])
    boxes = boxes.reshape(-1, 2, 3)
    corners = np.concatenate(shells).reshape(-1, 3)
    box = np.array([corners.min(axis=0), corners.max(axis=0)])
    for _ in range(STOREYS_ABOVE):
        touch = np.all((boxes[:, 0] < box[1] + BESIDE) & (boxes[:, 1] > box[0] - BESIDE), axis=1)
        near = boxes[touch]
        box[0] = np.minimum(box[0], near[:, 0].min(axis=0, initial=np.inf))
        box[1] = np.maximum(box[1], near[:, 1].max(axis=0, initial=-np.inf))
    return box


def storey_levels(spaces: Sequence[Space]) -> tuple[tuple[str, ...], list[int], NDArray[np.float64]]:
    """Storeys, the lowest first: their names, that of each room, and where each ends above [m]."""
    floors: dict[str, float] = {}
    tops: dict[str, float] = {}
    for space in spaces:
        name = storey_name(space)
        floors[name] = min(floors.get(name, np.inf), space.floor_level)
        tops[name] = max(tops.get(name, -np.inf), float(space.shell[..., 2].max()))
    names = tuple(sorted(floors, key=lambda name: floors[name]))
    order = {name: i for i, name in enumerate(names)}
    levels = [order[storey_name(space)] for space in spaces]
    return names, levels, np.array([tops[name] for name in names])


def room_batches(space: Space):
    """Kind, triangles and outlines of a room's surfaces, grouped by kind."""
    groups: dict[str, list[Any]] = {}
    for face in space.faces:
        groups.setdefault(KIND_OF_FACE[face.kind], []).append(face.triangles)
    for window in space.windows:
        groups.setdefault("glass", []).append(window.triangles)
    for piece in space.furniture:
        groups.setdefault("furniture", []).append(piece.triangles)
    for kind, parts in groups.items():
        edges = np.concatenate([outline_edges(part) for part in parts])
        yield kind, np.concatenate(parts), edges


def largest_triangles(triangles: NDArray[np.float64]) -> tuple[NDArray[np.float64], int]:
    """The triangles [T, 3, 3], the smallest left out beyond the limit; how many."""
    if len(triangles) <= MOST_TRIANGLES:
        return triangles, 0
    sides = triangles[:, 1:] - triangles[:, :1]
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    keep = np.sort(np.argpartition(-area, MOST_TRIANGLES)[:MOST_TRIANGLES])
    return triangles[keep], len(triangles) - MOST_TRIANGLES


def outline_edges(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Edges [E, 2, 3] where the surface ends or bends by more than 20 degrees."""
    points, index = np.unique(np.round(triangles.reshape(-1, 3), 4), axis=0, return_inverse=True)
    corners = index.reshape(-1, 3)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    sides = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    owner = np.tile(np.arange(len(corners)), 3)
    keys, inverse, count = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    first, last = np.full(len(keys), -1), np.full(len(keys), -1)
    last[inverse.ravel()] = owner
    first[inverse.ravel()[::-1]] = owner[::-1]
    smooth = np.einsum("ij,ij->i", normals[first], normals[last]) > np.cos(np.radians(20))
    return points[keys[(count == 1) | ~smooth]]


def layers(result: RunResult) -> tuple[ColourLayer, ...]:
    """The colourings that every room has: daylight autonomy, useful illuminance and so on."""
    wanted = [
        sensor_column(result.spaces[0], "da300", "da_300", "da"),
        useful_column(result.spaces[0], ("udi_100_3000", "udi_300_3000", "udi_useful")),
        sensor_column(result.spaces[0], "daylight_factor", "df"),
    ]
    found = []
    for column in wanted:
        if column and all(column in room.daylight.sensor_metrics for room in result.spaces):
            values = [room.daylight.sensor_metrics[column].to_numpy() for room in result.spaces]
            found.append(_layer(column, np.concatenate(values)))
    mean = [room.daylight.illuminance.mean(axis=0) for room in result.spaces]
    return (*found, _layer("annual_mean", np.concatenate(mean)))


def _layer(key: str, values: NDArray[Any]) -> ColourLayer:
    q = quantity(key)
    whole = q.unit == "%" and q.digits == 0
    high = 100.0 if whole else top_of_scale(values)
    scale = ColourScale(0.0, high, q.label, q.unit)
    return ColourLayer(key, scale, colour_bytes(scale, values), q.digits)


def colour_bytes(scale: ColourScale, values: NDArray[Any]) -> str:
    """The colours of values [S] as the viewer takes them."""
    return _base64(scale.rgba(values)[:, :3])


def _base64(array: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")
