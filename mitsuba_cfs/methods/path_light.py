"""Point-in-time paths: every hour is traced for itself, through the BSDF as it is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.glare.sun_disc import SunDisc
from mitsuba_cfs.methods.optics import States, hourly_states, in_state
from mitsuba_cfs.methods.sampling import Sampling
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping
from mitsuba_cfs.trace.paths.disc import disc_seen, with_disc
from mitsuba_cfs.trace.paths.point_in_time import point_in_time
from mitsuba_cfs.trace.paths.scene import LitRoom, Sky
from mitsuba_cfs.trace.pictures.point_in_time import point_in_time_picture

BATCHES = 4


class PathSystems:
    """A scene with what fills its windows, ready to be traced in each of its states."""

    def __init__(
        self,
        scene: DaylightScene,
        systems: Sequence[States],
        sampling: Sampling | None = None,
    ) -> None:
        """From the states of each window group [G]."""
        if len(systems) != len(scene.groups):
            raise ValueError(f"systems of {len(systems)} groups for {len(scene.groups)}")
        self.scene, self.systems, self.sampling = scene, systems, sampling or Sampling()
        self._rooms: dict[tuple[int, ...], LitRoom] = {}

    def light(self, sky: AnnualSky, *, progress: Progress = silent) -> PathLight:
        """The light of the sky's hours."""
        return PathLight(self, sky, progress)

    def room(self, state: Sequence[int]) -> LitRoom:
        """The room with each window group in a state [G]."""
        key = tuple(int(j) for j in state)
        if key not in self._rooms:
            scene = self.scene
            paths = [optics.paths for optics in in_state(self.systems, key)]
            self._rooms[key] = LitRoom(scene.interior, scene.exterior, scene.groups, paths)
        return self._rooms[key]


class PathLight:
    """The light of some hours, each traced when it is asked for."""

    def __init__(self, filled: PathSystems, sky: AnnualSky, progress: Progress = silent) -> None:
        """From `PathSystems.light`; the sky must have its sun apart."""
        if sky.sun is None:
            raise ValueError("paths need the sky's sun")
        self.filled, self.sky, self.progress = filled, sky, progress

    def illuminance(self, state: NDArray[np.int64] | None = None) -> NDArray[np.float64]:
        """Illuminance of the scene's sensors [S, L] [lx]; `state` as for `estimate`."""
        return self.estimate(state)[0]

    def estimate(
        self, state: NDArray[np.int64] | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Illuminance of the scene's sensors [S, L] [lx], and the relative error [S] of its mean.

        Args: state: [G, L] of each window group in each hour, or [L] of all; the first by default.
        """
        scene = self.filled.scene
        states = hourly_states(state, len(self.filled.systems), len(self.sky.lit))
        lit = np.zeros((len(scene.points), len(self.sky.lit)))
        variance = np.zeros(len(scene.points))
        for hour, now in enumerate(states.T):
            self.progress("point in time", hour / len(self.sky.lit))
            found = self._sensors(scene.points, scene.normals, hour, now)
            lit[:, hour] = found.values
            variance += found.standard_error**2
        total = lit.sum(axis=1)
        error = np.divide(np.sqrt(variance), total, out=np.zeros_like(total), where=total > 0)
        return lit, error

    def eye(self, hour: int, state: Sequence[int]) -> float:
        """Illuminance at the view's eye in one hour, its number among the sky's [lx]."""
        view = self.filled.scene.view
        place, direction = np.atleast_2d(view.position), np.atleast_2d(view.direction)
        return float(self._sensors(place, direction, hour, state).values[0])

    def picture(
        self, hour: int, state: Sequence[int] | None = None, **options: Any
    ) -> NDArray[np.float32]:
        """Luminance picture [ny, nx] of one hour [cd/m2].

        Args: options: of `point_in_time_picture`; samples and seed are the sampling's.
        """
        chosen, view = self.filled.sampling, self.filled.scene.view
        options = {"samples": chosen.picture_samples, "seed": chosen.seed} | options
        return point_in_time_picture(self._room(state), self.sky_of(hour), view, **options)

    def disc(self, hour: int, state: Sequence[int] | None = None) -> SunDisc | None:
        """The sun's disc in the view in one hour."""
        return disc_seen(self._room(state), self.sky_of(hour), self.filled.scene.view)

    def with_disc(
        self, picture: NDArray[np.float32], hour: int, state: Sequence[int] | None = None
    ) -> NDArray[np.float32]:
        """A picture of `picture(hour, state, disc=False)` with the disc in its pixels."""
        return with_disc(picture, self._room(state), self.sky_of(hour), self.filled.scene.view)

    def _room(self, state: Sequence[int] | None) -> LitRoom:
        return self.filled.room([0] * len(self.filled.systems) if state is None else state)

    def sky_of(self, hour: int) -> Sky:
        """Sky and sun of one hour."""
        sky = self.sky
        luminance = sky.illuminance[hour] / SUN_SOLID_ANGLE
        return Sky(sky.without_sun(hour), sky.direction[hour], luminance)

    def _sensors(
        self,
        points: NDArray[np.float64],
        directions: NDArray[np.float64],
        hour: int,
        state: Sequence[int],
    ) -> Estimate:
        chosen = self.filled.sampling
        return point_in_time(
            self.filled.room(state),
            self.sky_of(hour),
            points,
            directions,
            samples=max(chosen.hour_samples // BATCHES, 1),
            stopping=Stopping(batches=BATCHES),
            seed=chosen.seed * self.sky.hours + int(self.sky.lit[hour]),  # hours scatter apart
        )
