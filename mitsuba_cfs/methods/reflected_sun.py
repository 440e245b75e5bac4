"""The sun that is reflected before it comes to the sensors, found by shadow rays to its disc.

The sky's patches and the window's, 3 and 10 to 15 degrees wide, put a sunlit spot in the wrong
place, and of a window's paths few meet the patch of the sun after a reflection.  In place of

    V T (D - D_d) s_d              the sun that surfaces outdoors reflect to the windows
    B s_d - B_d s_d                what of this the beam of a cut group shows
    (V - V_d) diag(tau) D_d s_d    the sun's beam that the room reflects

five phases take the same light from places that stand for the surfaces
(`mitsuba_cfs.trace.reflected_sun`).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.methods.optics import States, in_state
from mitsuba_cfs.methods.phase_scene import PhaseScene
from mitsuba_cfs.methods.straight_views import StraightViews
from mitsuba_cfs.phases import times_sky
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.trace.reflected_sun import (
    SunShares,
    outdoor_light,
    view_shares,
    window_shares,
)
from mitsuba_cfs.trace.room_beam import RoomCells, room_cells, room_light
from mitsuba_cfs.trace.scene import TracedScene

WINDOW_SHARE = 32  # paths of a patch for D, for each that looks for sunlit surfaces
SENSOR_SHARE = 4  # paths of a sensor for V, for each that looks for them
Array = NDArray[np.floating]


class ReflectedSun:
    """What windows and sensors have of the surfaces that the sun can fall on."""

    def __init__(
        self, traced: PhaseScene, systems: Sequence[States], straight: StraightViews
    ) -> None:
        """From the states of each window group [G]; nothing is traced yet."""
        self.traced, self.systems, self.straight = traced, systems, straight
        self._views: dict[tuple[int, int], SunShares] = {}

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
        return TracedScene(self.traced.scene.interior, self.traced.scene.groups)

    @cached_property
    def outside(self) -> TracedScene:
        """What stands before the parts of the window groups."""
        return TracedScene(self.traced.scene.exterior, self.traced.parts.groups)

    @cached_property
    def windows(self) -> SunShares:
        """Rows [Q * K]."""
        chosen, parts = self.traced.sampling, len(self.traced.parts.groups)
        samples = chosen.patch_samples * len(self.traced.scene.groups) // parts // WINDOW_SHARE
        return window_shares(self.outside, samples=max(samples, 8), seed=chosen.seed)

    @cached_property
    def room(self) -> RoomCells:
        """The room's surfaces as the sensors see them."""
        scene, chosen = self.traced.scene, self.traced.sampling
        return room_cells(
            self.inside, scene.interior, scene.sensors(), samples=self._samples, seed=chosen.seed
        )

    def view(self, g: int, j: int) -> SunShares | None:
        """Rows [S], through the beam of a cut group in a state; None where it has none."""
        if self.straight.matrix(g, j) is None:
            return None
        if (g, j) not in self._views:
            self._views[g, j] = view_shares(
                self.inside, self.outside, g, self.systems[g][j].scattering,
                self.traced.scene.sensors(), samples=self._samples, seed=self.traced.sampling.seed,
            )  # fmt: skip
        return self._views[g, j]

    @property
    def _samples(self) -> int:
        return max(self.traced.sampling.sensor_samples // SENSOR_SHARE, 8)

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
        self._rooms: dict[int, NDArray[np.float32]] = {}

    @cached_property
    def windows(self) -> Array | None:
        """What is to be added to the luminance before the windows [Q, K, L]; None: nothing."""
        if not self._found.outdoors_reflects:
            return None
        traced, shares = self._found.traced, self._found.windows
        by_patches = times_sky(traced.daylight.values - traced.direct_daylight, self._sky.sun)
        return self._outdoors(shares).reshape(by_patches.shape) - by_patches

    def sensors(self, g: int, j: int, *, beam: bool) -> Array | float:
        """What is to be added to the sensors' light through a group in a state [S, L].

        Args: beam: whether the sun's beam passes the group.
        """
        return self.straight(g, j) + (
            self.room(g, j) if beam and self._found.room_reflects else 0.0
        )

    def straight(self, g: int, j: int) -> Array | float:
        """What is to be added to the straight view of a group in a state [S, L]."""
        shares = self._found.view(g, j) if self._found.outdoors_reflects else None
        if shares is None:
            return 0.0
        traced, straight = self._found.traced, self._found.straight
        whole, direct = straight.matrix(g, j), straight.matrix(g, j, direct=True)
        found = self._outdoors(shares) - times_sky(whole.values - direct.values, self._sky.sun)
        beam = straight.beam(g, j)
        for q in traced.parts.of(g):
            found -= (traced.direct_sensors[:, q] * beam) @ self.windows[q]
        return found

    def room(self, g: int, j: int) -> Array:
        """The beam through a group in a state that the room reflects to the sensors [S, L]."""
        found = self._found
        if j not in self._rooms:
            ways = [o.scattering for o in in_state(found.systems, [j] * len(found.systems))]
            scenes = found.inside, found.outside
            self._rooms[j] = self._all_hours(room_light(found.room, scenes, ways, *self._suns))
        return self._rooms[j][g]

    def _outdoors(self, shares: SunShares) -> Array:
        return self._all_hours(outdoor_light(shares, self._found.outside, *self._suns))

    def _all_hours(self, values: Array) -> Array:
        """Values [..., h] of the hours with sun as values [..., L] of all."""
        found = np.zeros((*values.shape[:-1], len(self._sky.illuminance)), dtype=np.float32)
        found[..., self._shining] = values
        return found
