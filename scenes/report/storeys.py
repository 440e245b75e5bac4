"""Floor plans by storey, each room in the colour of a chosen figure, and the rooms in its order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from bim.model import Space
from scenes.figures.plan import MARGIN, UNIT, plan_frame, rings
from scenes.figures.scale import ColourScale, round_limits
from scenes.language.catalogue import decimal, gettext
from scenes.report.headline import WARM_C, occupied, room_metric, sensor_column
from scenes.results import RoomYear, RunResult

LABEL_SHARE, MOST_LABEL = 0.28, 0.55  # height of a label: of the room's shorter side; at most [m]


@dataclass(frozen=True, slots=True)
class RoomMetric:
    """A figure that rooms are coloured and ranked by."""

    scale: ColourScale
    digits: int
    more_is_better: bool
    values: tuple[float, ...]  # of each room of the run; NaN where it has none

    def words(self, room: int) -> str:
        """The figure of a room."""
        value = self.values[room]
        return "–" if np.isnan(value) else decimal(f"{value:.{self.digits}f}")

    @property
    def ranked(self) -> tuple[int, ...]:
        """The rooms, the best first; those without the figure are left out."""
        sign = -1.0 if self.more_is_better else 1.0
        there = [i for i, value in enumerate(self.values) if not np.isnan(value)]
        return tuple(sorted(there, key=lambda i: sign * self.values[i]))


@dataclass(frozen=True, slots=True)
class StoreyRoom:
    """A room on the plan of its storey."""

    number: int | None  # of the run's rooms, from 0; None: not computed
    name: str
    path: str  # SVG
    x: float  # of the label, in SVG units
    y: float
    size: float


@dataclass(frozen=True, slots=True)
class StoreyPlan:
    """The rooms of one storey from above."""

    name: str
    view_box: str
    ratio: float  # width over height
    rooms: tuple[StoreyRoom, ...]


def room_metrics(result: RunResult) -> tuple[RoomMetric, ...]:
    """Every figure that at least one room has."""
    asked: tuple[tuple[ColourScale, int, bool, Callable[[RoomYear], float | None]], ...] = (
        (_share(gettext("Spatial daylight autonomy")), 0, True, lambda room: room_metric(room, "sda")),
        (_share(gettext("Daylight autonomy")), 0, True, _autonomy),
        (_share(gettext("Annual sunlight exposure")), 0, False, lambda room: room_metric(room, "ase")),
        (ColourScale(0.2, 0.5, gettext("Highest DGP"), "", colours="inferno"), 2, False, _glare),
        (_share(gettext("Occupied hours above {limit} °C", limit=f"{WARM_C:.0f}")), 0, False, _warm),
        (_temperatures(result), 1, False, _peak),
    )
    metrics = []
    for scale, digits, better, value in asked:
        values = [value(room) for room in result.spaces]
        if any(one is not None for one in values):
            known = tuple(float("nan") if one is None else float(one) for one in values)
            metrics.append(RoomMetric(scale, digits, better, known))
    return tuple(metrics)


def storey_plans(result: RunResult) -> tuple[StoreyPlan, ...]:
    """The storeys of the building, the lowest first; rooms that were not computed are on them."""
    numbers = {room.space.guid: i for i, room in enumerate(result.spaces)}
    computed = [room.space for room in result.spaces]
    others = [space for space in result.building.spaces if space.guid not in numbers]
    storeys: dict[str, list[Space]] = {}
    for space in (*computed, *others):
        storeys.setdefault(storey_name(space), []).append(space)
    order = sorted(storeys, key=lambda name: min(space.floor_level for space in storeys[name]))
    shown = [name for name in order if any(space.guid in numbers for space in storeys[name])]
    return tuple(_storey(name, storeys[name], numbers) for name in shown)


def storey_name(space: Space) -> str:
    """The storey of a room; by its floor's height where the model has none."""
    return space.storey or gettext("Floor at {level} m", level=decimal(f"{space.floor_level:.1f}"))


def _storey(name: str, spaces: Sequence[Space], numbers: dict[str, int]) -> StoreyPlan:
    outlines = [plan_frame(space, np.empty((0, 3))).outline for space in spaces]
    west, south, east, north = shapely.union_all(outlines).bounds
    width, height = east - west + 2 * MARGIN, north - south + 2 * MARGIN
    box = (west - MARGIN, -(north + MARGIN), width, height)
    rooms = [_room(space, outline, numbers.get(space.guid)) for space, outline in zip(spaces, outlines, strict=True)]
    view_box = " ".join(f"{UNIT * v:.0f}" for v in box)
    return StoreyPlan(name, view_box, width / height, tuple(rooms))


def _room(space: Space, outline: shapely.Geometry, number: int | None) -> StoreyRoom:
    at = shapely.point_on_surface(outline)
    west, south, east, north = outline.bounds
    size = min(LABEL_SHARE * min(east - west, north - south), MOST_LABEL)
    return StoreyRoom(number, space.label, rings(outline), UNIT * at.x, -UNIT * at.y, UNIT * size)


def _share(label: str) -> ColourScale:
    return ColourScale(0.0, 100.0, label, "%")


def _temperatures(result: RunResult) -> ColourScale:
    peaks = [peak for room in result.spaces if (peak := _peak(room)) is not None]
    low, high = round_limits(peaks or [0.0, 1.0])
    label = gettext("Highest operative temperature")
    return ColourScale(low, max(high, low + 1.0), label, "°C", colours="cividis")


def _autonomy(room: RoomYear) -> float | None:
    column = sensor_column(room, "da300", "da_300", "da")
    return None if column is None else float(room.daylight.sensor_metrics[column].mean())


def _glare(room: RoomYear) -> float | None:
    return max((picture.glare["dgp"] for picture in room.glare.pictures), default=None)


def _warm(room: RoomYear) -> float | None:
    used = occupied(room).to_numpy()
    if "operative_c" not in room.heat.temperatures or not used.any():
        return None
    return 100.0 * float((room.heat.operative_c.to_numpy()[used] > WARM_C).mean())


def _peak(room: RoomYear) -> float | None:
    if "operative_c" not in room.heat.temperatures:
        return None
    return float(room.heat.operative_c.max())
