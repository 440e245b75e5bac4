"""The light of a scene in the hours of a sky, by any method, and the illuminance that it gives.

A function that lacks a matrix or the light of the sensors computes it for that call alone; `needs`
of `daylight` names the metrics that several calls ask for.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.images.view import View
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods import METHODS, UnknownMethodError
from mitsuba_cfs.methods import phase_light as phases
from mitsuba_cfs.methods.optics import States, hourly_states
from mitsuba_cfs.methods.phase_light import (
    EYE,
    PhaseLight,
    coefficients_in_state,
    illuminance_of_all,
    phase_light,
    with_sensor_light,
)
from mitsuba_cfs.methods.phase_matrices import DEFAULT_NEEDS, PhaseMatrices, phase_matrices, with_eye
from mitsuba_cfs.methods.phase_pictures import with_phase_pictures
from mitsuba_cfs.methods.point_in_time import BATCHES, PathLight, path_eye_illuminance, path_illuminance
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.methods.standard_error import NoiseOfSums, noise_of_sums
from mitsuba_cfs.metrics.noise import Noise
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.annual import AnnualSky

Array = NDArray[np.float64]
State = NDArray[np.int64]  # [G, L] state of each window group in each hour, or [L] of all groups
T = TypeVar("T")


@dataclass(frozen=True)
class SeasonalLight:
    """The light of hours L of which each is in a season with outdoors of its own (trees' leaves).

    What does not change with the hours (window groups, sensors, the view, systems) is that of the
    first season, and so are results without hours, such as the daylight factor.
    """

    lights: tuple[PhaseLight, ...] | tuple[PathLight, ...]  # of each season's hours
    sky: AnnualSky  # of all hours
    season: NDArray[np.int64]  # [L] of each hour

    @property
    def scene(self) -> DaylightScene:
        """The scene in the first season."""
        return self.lights[0].scene

    @property
    def systems(self) -> Sequence[States]:
        """The systems in the first season [G][J]."""
        return self.lights[0].systems

    @property
    def sampling(self) -> Sampling:
        """How finely the seasons are computed."""
        return self.lights[0].sampling

    @property
    def states(self) -> int:
        """J, how many states the group has that has most."""
        return self.lights[0].states

    def seasons(self) -> list[tuple[PhaseLight | PathLight, NDArray[np.int64]]]:
        """The light of the seasons that have hours among the sky's, and these hours."""
        return hours_by_season(self.lights, self.season)


Light: TypeAlias = PhaseLight | PathLight | SeasonalLight
ByPhases: TypeAlias = PhaseLight | SeasonalLight


def seasons_of(light: Light) -> list[tuple[PhaseLight | PathLight, NDArray[np.int64]]]:
    """The light of each season and its hours; without seasons the light itself and all hours."""
    if isinstance(light, SeasonalLight):
        return light.seasons()
    return [(light, np.arange(len(light.sky.lit)))]


def daylight(
    scene: DaylightScene,
    systems: Sequence[States],
    sky: AnnualSky,
    *,
    method: str = "five-phase",
    sampling: Sampling | None = None,
    needs: Collection[str] = DEFAULT_NEEDS,
    matrices: PhaseMatrices | None = None,
    cache: MatrixCache | None = None,
    progress: Progress = silent,
) -> PhaseLight | PathLight:
    """The light of a scene with systems in its windows, in the hours of a sky.

    Args:
        systems: of each window group its states [G][J], such as open and closed.
        method: one of `METHODS`.
        needs: metrics (`METRICS`) that are asked for more than once.
        matrices: of the scene by this method, where they have been traced for other systems.
        cache: of traced matrices, `MatrixCache.of_user()`.
    """
    if method not in METHODS:
        raise UnknownMethodError(f"method {method!r}: expected one of {', '.join(METHODS)}")
    if method == "point-in-time":
        return PathLight(scene, systems, sky, sampling or Sampling())
    if matrices is None:
        matrices = phase_matrices(
            scene,
            sampling,
            five_phase=method == "five-phase",
            needs=needs,
            cache=cache,
            progress=part(progress, 0.0, 0.7),
        )
    return phase_light(matrices, systems, sky, needs=needs, progress=part(progress, 0.7, 1.0))


def seasonal_light(
    matrices: Sequence[PhaseMatrices],
    systems: Sequence[Sequence[States]],
    sky: AnnualSky,
    season: NDArray[np.int64],
    *,
    needs: Collection[str] = DEFAULT_NEEDS,
    progress: Progress = silent,
) -> SeasonalLight:
    """The light of hours from the matrices and the systems of each season.

    Args: season: [L] of each hour of the sky.
    """
    lights, count = [], len(matrices)
    for i, (of_season, filled) in enumerate(zip(matrices, systems, strict=True)):
        hours = np.flatnonzero(season == i)
        lights.append(
            phase_light(
                of_season,
                filled,
                sky.part(hours),
                needs=needs if len(hours) else (),
                progress=part(progress, i / count, (i + 1) / count),
            )
        )
    return SeasonalLight(tuple(lights), sky, season)


def illuminance(light: Light, state: State | None = None, *, progress: Progress = silent) -> Array:
    """Illuminance of the scene's sensors [S, L] [lx].

    Args: state: [G, L] of each window group in each hour, or [L] of all; the first by default.
    """
    if isinstance(light, SeasonalLight):
        return _by_season(light, state, lambda one, rows: illuminance(one, rows))
    if isinstance(light, PathLight):
        return path_illuminance(light, state, progress=progress)[0]
    light = with_sensor_light(light, progress=progress)
    return illuminance_of_all(light, state)[: len(light.scene.points)]


def with_systems(
    light: Light, systems: Sequence[States], hours: NDArray[np.int64], state: State | None = None
) -> Iterator[tuple[PhaseLight | PathLight, State, NDArray[np.int64]]]:
    """The light of some hours [n] with other systems, season by season.

    Each season has its light, the states [G, m] of its hours, and which [m] of the n they are.

    Args: systems: [G][J] optics of each window group; state: of the light's own hours.
    """
    rows = hourly_states(state, light.systems, light.sky)[:, hours]
    for one, of_season in seasons_of(light):
        columns = np.flatnonzero(np.isin(hours, of_season))
        if not len(columns):
            continue
        among = np.searchsorted(of_season, hours[columns])
        sky = one.sky.part(among)
        if isinstance(one, PhaseLight):
            sun = None if one.reflected is None else one.reflected.part(among)
            changed: PhaseLight | PathLight = phase_light(one.matrices, systems, sky, needs=(), reflected=sun)
        else:
            changed = replace(one, systems=systems, sky=sky)
        yield changed, rows[:, columns], columns


def illuminance_with_systems(
    light: Light, systems: Sequence[States], hours: NDArray[np.int64], state: State | None = None
) -> Array:
    """Illuminance of the sensors in some hours with other systems [S, n] [lx].

    Args: as of `with_systems`.
    """
    values = np.zeros((len(light.scene.points), len(hours)))
    for changed, rows, columns in with_systems(light, systems, hours, state):
        values[:, columns] = illuminance(changed, rows)
    return values


def illuminance_with_error(
    light: Light, state: State | None = None, *, progress: Progress = silent
) -> tuple[Array, Array]:
    """Illuminance of the sensors [S, L] [lx], and the relative standard error of its mean [S].

    The error is that of tracing, with Student's factor of its batches.
    """
    lit, noise = illuminance_with_noise(light, state, progress=progress)
    return lit, relative_error_of_mean(lit, noise)


def relative_error_of_mean(illuminance: Array, noise: NoiseOfSums) -> Array:
    """Relative standard error [S] of the mean over the hours of the illuminance [S, L]."""
    total, error = illuminance.sum(axis=1), noise(None).standard_error()
    return np.divide(error, total, out=np.zeros_like(total), where=total > 0)


def illuminance_with_noise(
    light: Light, state: State | None = None, *, progress: Progress = silent
) -> tuple[Array, NoiseOfSums]:
    """Illuminance of the sensors [S, L] [lx], and the noise [S] of its sums over the hours.

    The noise is by weights [S, L] of the hours, each sensor's own, not negative, and 0 in most
    hours; None: 1 everywhere.  Hours of path tracing and seasons are taken as independent.
    """
    if isinstance(light, PathLight):
        lit, variance = path_illuminance(light, state, progress=progress)
        return lit, _noise_of_paths(variance)
    if isinstance(light, PhaseLight):
        light, count = with_sensor_light(light, progress=progress), len(light.scene.points)
        whole = illuminance_of_all(light, state)
        of_all, eye = noise_of_sums(light, state, whole), np.zeros_like(whole[count:])

        def of_phases(weights: Array | None) -> Noise:
            rows = None if weights is None else np.concatenate([weights, eye])
            return of_all(rows).part(slice(count))

        return whole[:count], of_phases
    rows = _states(light, state)
    lit = np.zeros((len(light.scene.points), len(light.sky.lit)))
    seasons: list[tuple[NoiseOfSums, NDArray[np.int64]]] = []
    for one, hours in light.seasons():
        lit[:, hours], noise = illuminance_with_noise(one, rows[:, hours])
        seasons.append((noise, hours))

    def of_seasons(weights: Array | None) -> Noise:
        parts = (n(None if weights is None else weights[:, hours]) for n, hours in seasons)
        return sum(parts, start=Noise.none(len(lit)))

    return lit, of_seasons


def _noise_of_paths(variance: Array) -> NoiseOfSums:
    """From the variance of each hour [S, L]."""

    def noise(weights: Array | None) -> Noise:
        of_hours = variance if weights is None else variance * weights**2
        return Noise.of(of_hours.sum(axis=1), (of_hours**2).sum(axis=1) / (BATCHES - 1))

    return noise


def eye_illuminance(light: Light, state: State | None = None) -> Array:
    """Vertical illuminance at the view's eye [L] [lx]; `ValueError` without a view."""
    _ = light.scene.eye
    if isinstance(light, SeasonalLight):
        return _by_season(light, state, lambda one, rows: eye_illuminance(one, rows))
    if isinstance(light, PathLight):
        return path_eye_illuminance(light, np.arange(len(light.sky.lit)), state)
    return illuminance_of_all(with_sensor_light(light), state, EYE)[0]


def direct_sun(light: ByPhases, state: State | None = None) -> Array | None:
    """Illuminance of the sensors directly from the sun [S, L] [lx]; None for three phases."""
    groups = direct_sun_by_group(light, state)
    return None if groups is None else np.sum(groups, axis=0)


def direct_sun_by_group(light: ByPhases, state: State | None = None) -> list[Array] | None:
    """The same through each window group alone [G][S, L] [lx]."""
    if isinstance(light, PhaseLight):
        return phases.direct_sun_by_group(with_sensor_light(light), state)
    rows, of_seasons = _states(light, state), []
    for one, hours in light.seasons():
        groups = direct_sun_by_group(_by_phases(one), rows[:, hours])
        if groups is None:
            return None
        of_seasons.append((np.stack(groups), hours))
    return list(in_order_of_hours(of_seasons))


def daylight_coefficients(light: ByPhases, state: int = 0) -> Array:
    """Illuminance of the sensors per unit luminance of each sky patch [S, P].

    V T D, with what windows reflect, and with the straight view through the windows.

    Args: state: of all groups; a group with fewer states is in its last.
    """
    first = light.lights[0] if isinstance(light, SeasonalLight) else light
    return coefficients_in_state(with_sensor_light(_by_phases(first)), state)


def group_shares(light: ByPhases) -> Array:
    """Sum over hours and sensors of the illuminance by each group in its first state [G] [lx]."""
    lights = [light] if isinstance(light, PhaseLight) else [one for one, _ in light.seasons()]
    return sum(
        (phases.group_shares(with_sensor_light(_by_phases(one))) for one in lights),
        start=np.zeros(len(light.scene.groups)),
    )


def with_view(light: ByPhases, view: View) -> ByPhases:
    """The same light for another eye: what depends on the windows alone is not computed again."""
    if isinstance(light, SeasonalLight):
        return replace(light, lights=tuple(_with_view(one, view) for one in light.lights))
    return _with_view(light, view)


def with_pictures(
    light: ByPhases, *, direct: bool = False, by_states: bool = False, progress: Progress = silent
) -> ByPhases:
    """The light with the matrices of the view's pixels, for several calls that need them.

    Args:
        direct: those of eDGP.
        by_states: whether what the pictures in a combination of states share is stored too.
    """
    if isinstance(light, SeasonalLight):
        lights: list[PhaseLight] = []
        count = len(light.lights)
        for i, one in enumerate(map(_by_phases, light.lights)):
            steps = part(progress, i / count, (i + 1) / count)
            lights.append(_with_pictures(one, direct, by_states, steps))
        return replace(light, lights=tuple(lights))
    return _with_pictures(light, direct, by_states, progress)


def _with_pictures(light: PhaseLight, direct: bool, by_states: bool, progress: Progress) -> PhaseLight:
    shown = with_phase_pictures(light, direct=direct, progress=progress)
    return replace(shown, views={}) if by_states else shown


def path_light_of(light: ByPhases) -> PathLight | SeasonalLight:
    """The light of the same scene, systems and hours by path tracing."""
    if isinstance(light, SeasonalLight):
        return replace(light, lights=tuple(map(_by_path_tracing, light.lights)))
    return _by_path_tracing(light)


def hours_by_season(each: Sequence[T], season: NDArray[np.int64]) -> list[tuple[T, NDArray[np.int64]]]:
    """The item of each season, with its hours; seasons without hours are left out.

    Where there are no hours at all, the first season with none.

    Args: season: [L] of each hour.
    """
    parts = [(one, np.flatnonzero(season == i)) for i, one in enumerate(each)]
    return [(one, hours) for one, hours in parts if len(hours)] or parts[:1]


def in_order_of_hours(parts: Sequence[tuple[Array, NDArray[np.int64]]]) -> Array:
    """Values [.., L] of all hours from those of each season [.., l] and its hours [l]."""
    whole = np.zeros((*parts[0][0].shape[:-1], sum(len(hours) for _, hours in parts)))
    for values, hours in parts:
        whole[..., hours] = values
    return whole


def _by_season(
    light: SeasonalLight, state: State | None, of_season: Callable[[PhaseLight | PathLight, State], Array]
) -> Array:
    """Values [.., L] of all hours, each by the light of its season."""
    rows = _states(light, state)
    return in_order_of_hours([(of_season(one, rows[:, hours]), hours) for one, hours in light.seasons()])


def _states(light: SeasonalLight, state: State | None) -> State:
    return hourly_states(state, light.systems, light.sky)


def _with_view(light: PhaseLight | PathLight, view: View) -> PhaseLight:
    light = _by_phases(light)
    return replace(light, matrices=with_eye(light.matrices, view), sensors=None)


def _by_path_tracing(light: PhaseLight | PathLight) -> PathLight:
    return PathLight(light.scene, light.systems, light.sky, light.sampling)


def _by_phases(light: PhaseLight | PathLight) -> PhaseLight:
    if isinstance(light, PathLight):
        raise ValueError("path tracing has no matrices: expected the light of a phase method")
    return light
