"""View out of EN 17037: sight angle, outside distance and layers from the eyes of a room."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bim.model import Space
from bim.sensors import sensor_grid
from scenes.comply.openings import openings_of
from scenes.comply.outdoors import OutdoorMesh, opaque_room
from scenes.comply.sight import LAYERS, Sight

FloatArray = NDArray[np.float64]

SEATED = 1.2  # height of the eye above the floor [m]
SPACING = 0.5  # of the eyes [m]


@dataclass(frozen=True, slots=True)
class ViewOut:
    """The view from each eye of a room."""

    points: FloatArray  # [S, 3] eyes [m]
    sight_angle_deg: FloatArray  # [S] horizontal, all openings together
    distance: FloatArray  # [S] [m], inf where nothing stands before the openings
    layers: NDArray[np.bool_]  # [S, 3] of LAYERS, through the opening that shows most

    @property
    def layer_count(self) -> NDArray[np.int64]:
        """How many layers each eye sees [S]; 0 where the landscape is not among them."""
        return _count(self.layers)

    def at_least(self, share: float) -> dict[str, float]:
        """What at least a share of the eyes have: sight angle [deg], distance [m], layers."""
        rank = int(np.floor((1 - share) * len(self.points) + 1e-9))
        values = (self.sight_angle_deg, self.distance, self.layer_count)
        found = (float(np.sort(value)[rank]) for value in values)
        return dict(zip(("sight_angle_deg", "view_distance_m", "view_layers"), found, strict=True))

    def share(self, angle_deg: float, distance: float, layers: float) -> float:
        """Share of the eyes (0 to 1) that have all three at once."""
        met = (self.sight_angle_deg >= angle_deg) & (self.distance >= distance)
        return float(np.mean(met & (self.layer_count >= layers)))


def view_out(
    space: Space,
    outdoors: OutdoorMesh,
    *,
    spacing: float = SPACING,
    eye_height: float = SEATED,
    margin: float = 0.5,
    hidden: Collection[str] = (),
) -> ViewOut:
    """The view from a grid of eyes all over the utilised area of a room.

    The sight angle is that of the openings in plan, each aimed at where the eye's own height, or
    what is nearest to it, meets the glass; walls and reveals that hide a part take it away, glazing
    bars do not.  The distance is measured along the opening's normal from the inner surface of its
    wall to what a level ray through the opening meets, and is the median over the sight angle.
    The layers are those that one opening shows.  Rooflights show none.

    Args:
        spacing, margin: of the eyes and off the walls [m].
        eye_height: above the floor [m], 1.2 seated and 1.7 standing.
        hidden: GUIDs of windows that one does not see through.

    Source: EN 17037:2018+A1:2021, 5.2 and annexes A.3 and C.  The standard has no rule for rays:
    the median and the horizon of 5 degrees are those of ClimateStudio's documentation.
    """
    points, _ = sensor_grid(space, spacing=spacing, height=eye_height, margin=margin)
    room, own = opaque_room(space), outdoors.windows_of(space)
    openings = [
        one for one in openings_of(space) if not one.is_horizontal and one.window.guid not in hidden
    ]
    layers = np.zeros((len(points), len(LAYERS)), dtype=bool)
    seen = [np.empty((0, 4))]
    for opening in openings:
        sight = Sight(opening, room, outdoors, own)
        seen.append(sight.intervals(points))
        found = sight.layers(points)
        better = _rank(found) > _rank(layers)
        layers[better] = found[better]
    table = np.concatenate(seen)
    parts = [table[table[:, 0] == i, 1:] for i in range(len(points))]
    return ViewOut(
        points,
        np.degrees([_united_angle(part) for part in parts]),
        np.array([_median_distance(part) for part in parts]),
        layers,
    )


def _count(layers: NDArray[np.bool_]) -> NDArray[np.int64]:
    return np.where(layers[:, 0], layers.sum(axis=1), 0)


def _rank(layers: NDArray[np.bool_]) -> NDArray[np.int64]:
    """What makes one opening's layers [S, 3] better than another's: that count, then all."""
    return 10 * _count(layers) + layers.sum(axis=1)


def _united_angle(seen: FloatArray) -> float:
    """Angle [rad] that intervals [N, (from, to, ..)] of azimuths cover, each under half a turn."""
    turn = 2 * np.pi
    cut: list[tuple[float, float]] = []
    for start, end in seen[:, :2]:
        low = start % turn
        high = low + (end - start)
        cut += [(low, high)] if high <= turn else [(low, turn), (0.0, high - turn)]
    covered, reached = 0.0, -1.0
    for start, end in sorted(cut):
        covered += max(0.0, end - max(start, reached))
        reached = max(reached, end)
    return covered


def _median_distance(seen: FloatArray) -> float:
    """Median of the distances [N, (from, to, distance)] by their angles; 0 where nothing is."""
    if not len(seen):
        return 0.0
    order = np.argsort(seen[:, 2], kind="stable")
    weight = np.cumsum((seen[:, 1] - seen[:, 0])[order])
    return float(seen[order, 2][np.searchsorted(weight, 0.5 * weight[-1])])
