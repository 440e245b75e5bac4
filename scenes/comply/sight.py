"""What eyes see through one opening: by level rays at its azimuths, and by rays at all heights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bim.rays import RayMesh
from scenes.comply.openings import Opening
from scenes.comply.outdoors import OutdoorMesh

FloatArray = NDArray[np.float64]

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
        ends = np.stack(
            [self._azimuth(one.at(np.full(len(z), x), z) - eyes[before]) for x in (-half, half)],
            axis=1,
        )
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
        found = np.zeros((len(eyes), len(LAYERS)), dtype=bool)
        before = np.flatnonzero((one.centre - eyes) @ one.normal > EDGE)
        # the eye's own height too: the horizon is seen there or not at all
        level = np.clip(eyes[before, 2], z[0], z[-1])
        heights = np.column_stack([np.tile(z, (len(before), 1)), level])
        eye = np.repeat(before, heights.shape[1] * len(x))
        targets = one.at(np.tile(x, heights.size), np.repeat(heights.ravel(), len(x)))
        kinds = self._kinds(eyes[eye], targets - eyes[eye])
        for k in range(len(LAYERS)):
            found[eye[kinds == k], k] = True
        return found

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
        found = np.where(gone & (altitude > 0), LAYERS.index("sky"), -1)
        found[far] = LAYERS.index("landscape")
        found[ground] = LAYERS.index("ground")
        horizon = (ground | (gone & (altitude <= 0))) & (altitude >= -HORIZON_DEG)
        found[horizon] = LAYERS.index("landscape")
        kinds[free] = found
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

    def _aimed(
        self, eyes: FloatArray, azimuths: FloatArray, z: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
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
