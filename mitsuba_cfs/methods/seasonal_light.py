"""The light of a year in which what stands outdoors changes: trees with and without leaves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.methods.optics import hourly_states
from mitsuba_cfs.methods.path_light import PathLight, PathSystems
from mitsuba_cfs.methods.phase_light import PhaseLight, PhaseSystems, State
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.sky.annual import AnnualSky

FloatArray = NDArray[np.float64]
T = TypeVar("T")


def hours_by_season(
    each: Sequence[T], season: NDArray[np.int64]
) -> list[tuple[T, NDArray[np.int64]]]:
    """What each season has, with its hours; seasons without hours are left out.

    Where there are no hours at all, the first season with none. Args: season: [L] of each hour.
    """
    parts = [(one, np.flatnonzero(season == i)) for i, one in enumerate(each)]
    return [(one, hours) for one, hours in parts if len(hours)] or parts[:1]


def in_order_of_hours(parts: Sequence[tuple[FloatArray, NDArray[np.int64]]]) -> FloatArray:
    """Values [.., L] of all hours from those of each season [.., l] and its hours [l]."""
    found = np.zeros((*parts[0][0].shape[:-1], sum(len(hours) for _, hours in parts)))
    for values, hours in parts:
        found[..., hours] = values
    return found


class SeasonalLight:
    """The light of some hours, each of them in one of several seasons.

    What does not change with the hours (window groups, sensors, the view, what fills the windows)
    is that of the first season, and so are results without hours, as the daylight factor.
    """

    def __init__(
        self,
        lights: Sequence[PhaseLight] | Sequence[PathLight],
        sky: AnnualSky,
        season: NDArray[np.int64],
    ) -> None:
        """From the light of each season's hours.

        Args: season: [L] of each hour of the sky.
        """
        self.lights: list[Any] = list(lights)
        self.sky, self.season = sky, season
        self.filled: Any = lights[0].filled

    @classmethod
    def of(
        cls,
        filled: Sequence[PhaseSystems] | Sequence[PathSystems],
        sky: AnnualSky,
        season: NDArray[np.int64],
        *,
        progress: Progress = silent,
    ) -> SeasonalLight:
        """From the scene of each season with what fills its windows."""
        every: Sequence[Any] = filled
        lights = [
            one.light(sky.part(np.flatnonzero(season == i)), progress=progress)
            for i, one in enumerate(every)
        ]
        return cls(lights, sky, season)

    def changed(self, change: Callable[[Any], Any]) -> SeasonalLight:
        """The same with the light of each season put through a function."""
        return SeasonalLight([change(light) for light in self.lights], self.sky, self.season)

    def illuminance(self, state: State | None = None) -> FloatArray:
        """Illuminance of the scene's sensors [S, L] [lx]."""
        return self._merged(lambda light, own: light.illuminance(own), state)

    def eye(self, state: State | None = None) -> FloatArray:
        """Illuminance at the view's eye [L] [lx]."""
        return self._merged(lambda light, own: light.eye(own), state)

    def direct_sun(self, state: State | None = None) -> FloatArray | None:
        """Illuminance of the sensors straight from the sun [S, L] [lx]; None by three phases."""
        groups = self.direct_sun_by_group(state)
        return None if groups is None else np.sum(groups, axis=0)

    def direct_sun_by_group(self, state: State | None = None) -> list[FloatArray] | None:
        """The same through each window group alone [G][S, L] [lx]."""
        if not self.filled.traced.five_phase:
            return None
        return list(
            self._merged(lambda light, own: np.stack(light.direct_sun_by_group(own)), state)
        )

    def relative_error(self, state: State | None = None) -> FloatArray:
        """Standard error of each sensor's mean over the hours [S]; seasons as independent."""
        return self.estimate(state)[1]

    def estimate(self, state: State | None = None) -> tuple[FloatArray, FloatArray]:
        """Illuminance of the scene's sensors [S, L], and the relative error [S] of its mean."""
        rows = self._rows(state)
        lit = np.zeros((len(self._points), len(self.sky.lit)))
        variance = np.zeros(len(lit))
        for light, hours in self.parts():
            own = rows[:, hours]
            if isinstance(light, PathLight):
                lit[:, hours], error = light.estimate(own)
            else:
                lit[:, hours], error = light.illuminance(own), light.relative_error(own)
            variance += (error * lit[:, hours].sum(axis=1)) ** 2
        total = lit.sum(axis=1)
        error = np.divide(np.sqrt(variance), total, out=np.zeros_like(total), where=total > 0)
        return lit, error

    @property
    def _points(self) -> FloatArray:
        filled = self.filled
        return (filled.scene if isinstance(filled, PathSystems) else filled.traced.scene).points

    def _rows(self, state: State | None) -> NDArray[np.int64]:
        return hourly_states(state, len(self.filled.systems), len(self.sky.lit))

    def parts(self) -> list[tuple[Any, NDArray[np.int64]]]:
        """The light of the seasons that have hours among the sky's, and these."""
        return hours_by_season(self.lights, self.season)

    def _merged(
        self, of_season: Callable[[Any, State], FloatArray], state: State | None
    ) -> FloatArray:
        """Values [.., L] of all hours, each by the light of its season."""
        rows = self._rows(state)
        parts = self.parts()
        return in_order_of_hours(
            [(of_season(light, rows[:, hours]), hours) for light, hours in parts]
        )


def paths_of(
    light: PhaseLight | SeasonalLight, progress: Progress = silent
) -> PathLight | SeasonalLight:
    """The light of the same hours by paths."""
    if isinstance(light, SeasonalLight):
        return light.changed(lambda own: paths_of(own, progress))
    traced = light.filled.traced
    filled = PathSystems(traced.scene, light.filled.systems, traced.sampling)
    return filled.light(light.sky, progress=progress)
