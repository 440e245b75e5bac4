"""The sun that is reflected before it comes to the sensors, found by shadow rays to its disc.

The sky's patches and the window's, 3 and 10 to 15 degrees wide, put a sunlit spot in the wrong
place, and of a window's paths few meet the patch of the sun after a reflection.  In place of

    V T (D - D_d) s_d              the sun that surfaces outdoors reflect to the windows
    B s_d - B_d s_d                what of this the beam of a cut group shows
    (V - V_d) diag(tau) D_d s_d    the sun's beam that the room reflects

five phases take the same light from places that stand for the surfaces
(`mitsuba_cfs.trace.sun.reflected`) and from cells of the room
(`mitsuba_cfs.trace.sun.room_beam`).  All of it is found in independent batches, of which its
standard error is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.methods.optics import States
from mitsuba_cfs.methods.phase_scene import PhaseScene
from mitsuba_cfs.methods.straight_views import StraightViews
from mitsuba_cfs.phases import times_sky
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.reflected import (
    SunShares,
    outdoor_light,
    view_shares,
    window_shares,
)
from mitsuba_cfs.trace.sun.room_beam import (
    ReflectingCells,
    RoomCells,
    room_cells,
    room_light,
    room_shares,
)

BATCHES = 4  # each with its own paths, places and points
WINDOW_SHARE = 32  # paths of a patch for D, for each that looks for sunlit surfaces
SENSOR_SHARE = 4  # paths of a sensor for V, for each that looks for them
ROOM_SHARE = 2  # paths of a sensor for V, for each that looks for the room's cells
Array = NDArray[np.floating]


class ReflectedSun:
    """What windows and sensors have of the surfaces that the sun can fall on."""

    def __init__(
        self, traced: PhaseScene, systems: Sequence[States], straight: StraightViews
    ) -> None:
        """From the states of each window group [G]; nothing is traced yet."""
        self.traced, self.systems, self.straight = traced, systems, straight
        self._windows: dict[int, SunShares] = {}
        self._rooms: dict[int, NDArray[np.float64]] = {}
        self._views: dict[tuple[int, int, int], SunShares] = {}

    @property
    def outdoors_reflects(self) -> bool:
        """Whether anything stands outdoors."""
        return len(self.traced.scene.exterior.triangles) > 0

    @property
    def room_reflects(self) -> bool:
        """Whether any surface of the room does."""
        return bool((self.traced.scene.interior.reflectance > 0).any())

    @cached_property
    def inside(self) -> TracedScene:
        """The room."""
        return self.traced.scenes.scene(self.traced.scene.interior, self.traced.scene.groups)

    @cached_property
    def outside(self) -> TracedScene:
        """What stands before the parts of the window groups, in the room's coordinates."""
        parts, centre = self.traced.parts.groups, self.inside.centre
        return self.traced.scenes.scene(self.traced.scene.exterior, parts, centre=centre)

    @cached_property
    def cells(self) -> tuple[RoomCells, ReflectingCells]:
        """The room's surfaces, in cells of two widths."""
        samples = self._samples(ROOM_SHARE)
        return room_cells(self.inside, self.traced.scene.interior, samples=samples)

    def seed(self, batch: int) -> int:
        """That of a batch."""
        return self.traced.sampling.seed * BATCHES + batch

    def windows(self, batch: int) -> SunShares:
        """Rows [Q * K]."""
        if batch not in self._windows:
            traced = self.traced
            paths = traced.sampling.patch_samples // WINDOW_SHARE // BATCHES
            samples = paths * len(traced.scene.groups) // len(traced.parts.groups)
            self._windows[batch] = window_shares(
                self.outside, samples=max(samples, 4), places=traced.sampling.sun_points,
                seed=self.seed(batch),
            )  # fmt: skip
        return self._windows[batch]

    def room(self, batch: int) -> NDArray[np.float64]:
        """What sensors have of the room's cells [S, c]."""
        if batch not in self._rooms:
            scene = self.traced.scene
            self._rooms[batch] = room_shares(
                self.cells, self.inside, scene.sensors(),
                samples=self._samples(ROOM_SHARE), seed=self.seed(batch),
            )  # fmt: skip
        return self._rooms[batch]

    def view(self, g: int, j: int, batch: int) -> SunShares | None:
        """Rows [S], through the beam of a cut group in a state; None where it has none."""
        if self.straight.matrix(g, j) is None:
            return None
        if (g, j, batch) not in self._views:
            self._views[g, j, batch] = view_shares(
                self.inside, self.outside, g, self.systems[g][j].scattering,
                self.traced.scene.sensors(), samples=self._samples(SENSOR_SHARE),
                places=self.traced.sampling.sun_points, seed=self.seed(batch),
            )  # fmt: skip
        return self._views[g, j, batch]

    def _samples(self, share: int) -> int:
        return max(self.traced.sampling.sensor_samples // share // BATCHES, 4)

    def light(self, sky: AnnualSky) -> ReflectedSunLight:
        """What is reflected in the sky's hours."""
        return ReflectedSunLight(self, sky)


class ReflectedSunLight:
    """The reflected sun of some hours, in place of what the sky's patches give of it."""

    def __init__(self, found: ReflectedSun, sky: AnnualSky) -> None:
        """From `ReflectedSun.light`."""
        self._found, self._sky = found, sky
        self._shining = np.flatnonzero((sky.illuminance > 0) & (sky.direction[:, 2] > 0))
        self._suns = sky.direction[self._shining], sky.illuminance[self._shining]
        self._before: dict[int, NDArray[np.float32]] = {}

    def sensors(self, g: int, j: int, *, beam: bool) -> Estimate:
        """What is to be added to the sensors' light through a group in a state [S, L].

        Args: beam: whether the sun's beam passes the group.
        """
        beam = beam and self._found.room_reflects
        found = accumulate(
            lambda number: self._batch(number, g, j, beam=beam), stopping=Stopping(BATCHES)
        )
        return replace(
            found,
            values=self._all_hours(found.values) - self._by_patches(g, j),
            standard_error=self._all_hours(found.standard_error),
        )

    def replaced(self, hours: NDArray[np.bool_]) -> Array:
        """Luminance before the windows, the sum over some hours, by shadow rays less by patches.

        Args: hours: [L] which; returns [Q, K].
        """
        if not self._found.outdoors_reflects:
            return np.zeros(self._shape)
        some = hours[self._shining].astype(np.float32)
        mean = sum(self._windows(b) @ some for b in range(BATCHES)) / BATCHES
        return mean - self._reflected_daylight() @ self._sky.totals(hours)[1]

    def before(self, shares: Array | None, hours: NDArray[np.int64]) -> Array:
        """The same of each of some hours [h], as rows of shares [n, Q * K] have it [n, h].

        Without shares [Q * K, h].
        """
        by_patches = self._reflected_daylight().reshape(np.prod(self._shape), -1)
        if shares is not None:
            by_patches = shares @ by_patches
        found, number = np.zeros((len(by_patches), len(hours))), np.full(len(self._sky.lit), -1)
        number[self._shining] = np.arange(len(self._shining))
        some = number[hours][number[hours] >= 0]
        if not self._found.outdoors_reflects or not len(some):
            return found
        light = sum(self._flat(b)[:, some] for b in range(BATCHES)) / np.float32(BATCHES)
        if shares is not None:  # in single precision, as the windows' light is
            light = shares.astype(np.float32) @ light
        found[:, number[hours] >= 0] = light
        return found - times_sky(by_patches, self._sky.sun[:, hours])

    def _batch(self, number: int, g: int, j: int, *, beam: bool) -> Array:
        """The light of the sensors in the hours with sun [S, h]."""
        found = self._found
        light = np.zeros((len(found.traced.scene.sensors()[0]), len(self._shining)))
        if found.outdoors_reflects:
            parts = found.traced.parts.of(g)
            rest = np.concatenate([found.straight.rest(g, j, q) for q in parts], axis=1)
            light += rest.astype(np.float32) @ self._flat(number, parts)
            seen = found.view(g, j, number)
            if seen is not None:
                light += outdoor_light(seen, found.outside, *self._suns)
        if beam:
            light += room_light(
                found.cells[0], found.room(number), (found.inside, found.outside), g,
                found.systems[g][j].scattering, self._suns,
                points=found.traced.sampling.sun_points, seed=found.seed(number),
            )  # fmt: skip
        return light

    def _by_patches(self, g: int, j: int) -> Array | float:
        """What V T D s has of the sun that the outdoors reflect, in the sensors [S, L]."""
        if not self._found.outdoors_reflects:
            return 0.0
        traced, straight, sun = self._found.traced, self._found.straight, self._sky.lit_sun
        daylight = self._reflected_daylight()
        parts = traced.parts.of(g)
        found = sum(straight.rest(g, j, q) @ daylight[q] for q in parts)
        whole, direct = straight.matrix(g, j), straight.matrix(g, j, direct=True)
        if whole is not None:
            found = found + whole.values - direct.values
        return times_sky(found, sun)

    def _reflected_daylight(self) -> Array:
        """D - D_d [Q, K, P]."""
        return self._found.traced.daylight.values - self._found.traced.direct_daylight

    def _windows(self, batch: int) -> NDArray[np.float32]:
        """Luminance before the windows in the hours with sun [Q, K, h]."""
        if batch not in self._before:
            shares, outside = self._found.windows(batch), self._found.outside
            light = outdoor_light(shares, outside, *self._suns)
            self._before[batch] = light.reshape(*self._shape, -1)
        return self._before[batch]

    def _flat(self, batch: int, parts: Sequence[int] | None = None) -> NDArray[np.float32]:
        """The same one part after the other [Q * K, h], of all or of some."""
        found = self._windows(batch)
        if parts is not None and len(parts) < len(found):
            found = found[list(parts)]
        return found.reshape(len(found) * found.shape[1], found.shape[2])

    @property
    def _shape(self) -> tuple[int, ...]:
        return self._found.traced.daylight.values.shape[:2]

    def _all_hours(self, values: Array) -> Array:
        """Values [..., h] of the hours with sun as values [..., L] of all."""
        found = np.zeros((*values.shape[:-1], len(self._sky.illuminance)))
        found[..., self._shining] = values
        return found
