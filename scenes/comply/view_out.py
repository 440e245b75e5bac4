"""View out of EN 17037: sight angle, outside distance and layers from the eyes of a room."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bim.model import Space, Window
from bim.rays import RayMesh
from bim.sensors import sensor_grid
from mitsuba_cfs.notes import Note
from scenes.comply.openings import Opening, openings_of
from scenes.comply.outdoors import OutdoorMesh, opaque_room
from scenes.fenestration.sight import SightThrough, sight_through
from scenes.fenestration.systems import States


def windows_without_view(
    windows: Iterable[Window], systems: Mapping[str, States]
) -> tuple[frozenset[str], tuple[str, ...]]:
    """GUIDs of the windows that one does not see through when open, and a sentence on each state.

    Windows whose system is not known are seen through.
    """
    known: dict[int, SightThrough] = {}
    hidden, notes = set(), {}
    for window in windows:
        if window.guid not in systems:
            continue
        for number, system in enumerate(systems[window.guid]):
            if id(system) not in known:
                known[id(system)] = sight_through(system)
            sight = known[id(system)]
            notes[system.name] = Note(
                "{system}: direct visible transmittance {direct:.0f} % at normal incidence, haze "
                "{haze:.0f} %; {verdict}.",
                system=system.name,
                direct=100 * sight.straight,
                haze=100 * sight.haze,
                verdict=_view_words(sight, closed=number > 0),
            )
            if number == 0 and not sight.is_view:
                hidden.add(window.guid)
    return frozenset(hidden), tuple(notes.values())


def _view_words(sight: SightThrough, *, closed: bool) -> Note:
    """What a state, open or closed, means for the view."""
    if closed and sight.is_view:
        return Note("the view remains when closed")
    if closed:
        return Note("blocks the view")
    return Note("counts as a view") if sight.is_view else Note("does not count as a view")


AZIMUTHS = 24  # rays to an opening, side by side; what changes between two is halved
DISTANCES = 12  # level rays through what is seen of it
HALVINGS = 10  # of the angle between two rays: 0.01 degree of 150
LAYER_AZIMUTHS, LAYER_HEIGHTS = 7, 9  # rays to an opening that look for layers
EDGE = 1e-4  # rays keep so far off the edges of the glass [m]
HORIZON_DEG = 5.0  # what goes out no further below the horizon meets landscape, not ground
LEAST_DISTANCE = 6.0  # along the normal; nearer things are an obstruction, no layer [m]
LAYERS = ("landscape", "sky", "ground")


@dataclass(frozen=True, slots=True)
class Sight:
    """An opening, the room before it and the outdoors behind."""

    opening: Opening
    room: RayMesh
    outdoors: OutdoorMesh
    own: NDArray[np.bool_]  # [E] of the elements outdoors: the room's windows

    def intervals(self, eyes: FloatArray) -> FloatArray:
        """What eyes [S, 3] see of the opening in plan, as narrow intervals.

        Returns: [N, 4]: eye, azimuth from and to [rad] (counter-clockwise from x), distance [m].
        """
        one, flat = self.opening, self._flat
        before = np.flatnonzero((one.centre - eyes) @ flat > EDGE)
        half = max(one.width / 2 - EDGE, 0.0)
        z = np.clip(eyes[before, 2], one.sill + EDGE, one.head - EDGE)
        ends = np.stack([self._azimuth(one.at(np.full(len(z), x), z) - eyes[before]) for x in (-half, half)], axis=1)
        low, high = ends.min(axis=1), ends.max(axis=1)
        azimuths = low[:, None] + np.linspace(0, 1, AZIMUTHS) * (high - low)[:, None]
        rows = np.repeat(np.arange(len(before)), AZIMUTHS)
        seen = self._free(eyes[before[rows]], azimuths.ravel(), z[rows]).reshape(azimuths.shape)
        eye, start, end = self._edges(eyes[before], azimuths, seen, z)
        width = (end - start) / DISTANCES
        middle = (start[:, None] + width[:, None] * (np.arange(DISTANCES) + 0.5)).ravel()
        eye, half_width = np.repeat(eye, DISTANCES), np.repeat(width, DISTANCES) / 2
        distance = self._distances(eyes[before[eye]], middle, z[eye])
        turn = np.arctan2(flat[1], flat[0])
        low, high = turn + middle - half_width, turn + middle + half_width
        return np.column_stack([before[eye], low, high, distance])

    def layers(self, eyes: FloatArray) -> NDArray[np.bool_]:
        """Whether each eye [S] sees each of LAYERS [S, 3]."""
        one = self.opening
        x = np.linspace(-0.5, 0.5, LAYER_AZIMUTHS) * (one.width - 2 * EDGE)
        z = np.linspace(one.sill + EDGE, one.head - EDGE, LAYER_HEIGHTS)
        seen = np.zeros((len(eyes), len(LAYERS)), dtype=bool)
        before = np.flatnonzero((one.centre - eyes) @ one.normal > EDGE)
        # the eye's own height too: the horizon is seen there or not at all
        level = np.clip(eyes[before, 2], z[0], z[-1])
        heights = np.column_stack([np.tile(z, (len(before), 1)), level])
        eye = np.repeat(before, heights.shape[1] * len(x))
        targets = one.at(np.tile(x, heights.size), np.repeat(heights.ravel(), len(x)))
        kinds = self._kinds(eyes[eye], targets - eyes[eye])
        for k in range(len(LAYERS)):
            seen[eye[kinds == k], k] = True
        return seen

    def _kinds(self, origins: FloatArray, towards: FloatArray) -> NDArray[np.int64]:
        """Which of LAYERS each ray [R] meets; -1: none."""
        length = np.linalg.norm(towards, axis=1)
        rays = towards / length[:, None]
        free = self.room.first_hits(origins, rays)[0] >= length - EDGE
        kinds = np.full(len(rays), -1, dtype=np.int64)
        start, rays = origins[free] + towards[free], rays[free]
        distance, element = self.outdoors.first_hits(start, rays, self.own)
        altitude = np.degrees(np.arcsin(rays[:, 2]))
        gone = element < 0
        far = ~gone & (distance * (rays @ self._flat) >= LEAST_DISTANCE)
        ground = (gone & (altitude < 0)) | (far & self.outdoors.terrain[element])
        layer = np.where(gone & (altitude > 0), LAYERS.index("sky"), -1)
        layer[far] = LAYERS.index("landscape")
        layer[ground] = LAYERS.index("ground")
        horizon = (ground | (gone & (altitude <= 0))) & (altitude >= -HORIZON_DEG)
        layer[horizon] = LAYERS.index("landscape")
        kinds[free] = layer
        return kinds

    @property
    def _flat(self) -> FloatArray:
        """The opening's normal [3] in plan."""
        flat = self.opening.normal * [1.0, 1.0, 0.0]
        return flat / np.linalg.norm(flat)

    def _azimuth(self, towards: FloatArray) -> FloatArray:
        """Azimuths [N] [rad] of directions [N, 3] in plan, from the opening's normal."""
        flat = self._flat
        return np.arctan2(towards @ np.array([-flat[1], flat[0], 0.0]), towards @ flat)

    def _aimed(self, eyes: FloatArray, azimuths: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Level directions [N, 3] and the points [N, 3] in the glass that they are aimed at."""
        flat = self._flat
        across = np.array([-flat[1], flat[0], 0.0])
        level = np.outer(np.cos(azimuths), flat) + np.outer(np.sin(azimuths), across)
        line = self.opening.at(np.zeros(len(z)), z)
        reach = ((line - eyes) @ flat) / (level @ flat)
        points = eyes + reach[:, None] * level
        points[:, 2] = z
        return level, points

    def _free(self, eyes: FloatArray, azimuths: FloatArray, z: FloatArray) -> NDArray[np.bool_]:
        """Whether the glass is seen past walls and reveals, by ray [N]."""
        towards = self._aimed(eyes, azimuths, z)[1] - eyes
        length = np.linalg.norm(towards, axis=1)
        return self.room.first_hits(eyes, towards / length[:, None])[0] >= length - EDGE

    def _edges(
        self, eyes: FloatArray, azimuths: FloatArray, seen: NDArray[np.bool_], z: FloatArray
    ) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
        """Where the glass is seen: eye [N] and azimuths from [N] and to [N] [rad].

        Args: azimuths, seen: [S, AZIMUTHS]; what changes between two of them is halved.
        """
        eye, change = np.nonzero(seen[:, 1:] != seen[:, :-1])
        low, high = azimuths[eye, change], azimuths[eye, change + 1]
        for _ in range(HALVINGS if len(eye) else 0):
            middle = 0.5 * (low + high)
            same = self._free(eyes[eye], middle, z[eye]) == seen[eye, change]
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        first, last = np.flatnonzero(seen[:, 0]), np.flatnonzero(seen[:, -1])
        eye = np.concatenate([first, eye, last])
        edge = np.concatenate([azimuths[first, 0], 0.5 * (low + high), azimuths[last, -1]])
        order = np.lexsort((edge, eye))
        eye, edge = eye[order], edge[order]
        return eye[::2], edge[::2], edge[1::2]

    def _distances(self, eyes: FloatArray, azimuths: FloatArray, z: FloatArray) -> FloatArray:
        """Distance [N] [m] along the normal from the inner wall to what level rays meet."""
        level, points = self._aimed(eyes, azimuths, z)
        distance, _ = self.outdoors.first_hits(points, level, self.own)
        return distance * (level @ self._flat) + self.opening.recess


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
    openings = [one for one in openings_of(space) if not one.is_horizontal and one.window.guid not in hidden]
    layers = np.zeros((len(points), len(LAYERS)), dtype=bool)
    seen = [np.empty((0, 4))]
    for opening in openings:
        sight = Sight(opening, room, outdoors, own)
        seen.append(sight.intervals(points))
        layers_seen = sight.layers(points)
        better = _rank(layers_seen) > _rank(layers)
        layers[better] = layers_seen[better]
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
