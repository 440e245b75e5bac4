"""Glare of hours by any method: DGP of full pictures, eDGP of direct ones, sDGP of illuminance.

    three-phase    E_v = V T D s                                eDGP pictures V_d T D_d s
    five-phase     E_v = V T D s - V_d T D_d s_d + C_ds s_sun   V_d T D_d s_sky + C s_sun
    point-in-time  E_v of a sensor at the eye                   paths of one reflection

Source: Wienold 2009, "Dynamic daylight glare evaluation" (eDGP); the dissertation's 3.2.4 to 3.2.6,
whose equation (20) has the sun twice if its s_d holds it: here s_sky is the sky without the sun.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.glare import indices
from mitsuba_cfs.glare.annual import FIGURES, AnnualGlare, Pictures, annual_glare, figures, full_picture
from mitsuba_cfs.glare.dgp_error import dgp_error, dgp_errors, hours_by_halves, random_signs
from mitsuba_cfs.glare.evaluation import GlareOptions, GlareResult, evaluate
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.glare.sun_disc import SunDisc
from mitsuba_cfs.matrices.cache import CacheEntry, cached_or_computed
from mitsuba_cfs.methods import METRICS, UnknownMethodError
from mitsuba_cfs.methods.light import Light, SeasonalLight, eye_illuminance, illuminance, with_systems
from mitsuba_cfs.methods.optics import States, hourly_states
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.methods.phase_matrices import few_pictures
from mitsuba_cfs.methods.phase_pictures import pictures_by_state, pictures_in_state, with_phase_pictures
from mitsuba_cfs.methods.point_in_time import (
    PathLight,
    discs_of_room,
    path_eye_illuminance,
    picture_of_room,
    picture_with_disc,
    rooms_by_state,
)
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.annual import hour_numbers

DIRECT_DEPTH = 2  # segments of a direct path after the surface that the eye sees: to window, to sky
State = ArrayLike | None  # [G, L] of each window group in each hour, or [L] of all; None: the first
Picture = NDArray[np.float32]  # [ny, nx] [cd/m2]


def hourly_glare(
    light: Light,
    metric: str = "DGP",
    state: State = None,
    *,
    hours: ArrayLike | None = None,
    options: GlareOptions | None = None,
    checkpoint: Path | None = None,
    cached: Callable[[NDArray[np.int64]], CacheEntry] | None = None,
    progress: Progress = silent,
) -> AnnualGlare:
    """Glare of the view in some hours [n] of the light's sky, all by default.

    Args:
        metric: DGP, eDGP or sDGP; the latter gives nothing but DGP and the illuminance.
        state: of the windows in each of the sky's hours.
        options: how glare sources are detected and rated.
        checkpoint: file of the ratings so far, see `annual_glare`.
        cached: cache entry of the ratings of these hours with each window group in a state [G].
            They are stored where that state holds in all hours, and read where it holds in some.
    """
    if metric not in METRICS or metric == "illuminance":
        raise UnknownMethodError(f"metric {metric!r}: expected one of {', '.join(METRICS[:3])}")
    _ = light.scene.eye
    count = len(light.sky.lit)
    chosen = np.arange(count) if hours is None else hour_numbers(hours, count)
    every = hourly_states(state, light.systems, light.sky)
    rows, options = every[:, chosen], options or GlareOptions()
    if isinstance(light, SeasonalLight):
        return _of_seasons(light, metric, chosen, rows, options, progress, checkpoint=checkpoint)
    if isinstance(light, PathLight):
        return _by_path_tracing(light, metric, chosen, every, options, progress)
    if metric == "sDGP":
        return _simplified(eye_illuminance(light, every)[chosen])
    phases, direct = light, metric == "eDGP"
    eye = eye_illuminance(light, every)[chosen] if direct else None
    geometry = GlareView(light.scene.eye)
    table = np.full((len(FIGURES), len(chosen)), np.nan)
    kinds, kind = np.unique(rows, axis=1, return_inverse=True)
    few = not direct and few_pictures(light.matrices, len(chosen))

    @cache
    def of_few() -> list[Pictures]:
        return [made for _, made in pictures_by_state(phases, chosen, rows)]

    def shown(i: int, columns: NDArray[np.int64]) -> Pictures:
        nonlocal phases
        if few:
            return of_few()[i]
        phases = with_phase_pictures(phases, direct=direct)  # unless all ratings are in the cache
        return pictures_in_state(phases, chosen[columns], kinds[:, i].tolist(), direct=direct)

    def rated(i: int, columns: NDArray[np.int64]) -> NDArray[np.float64]:
        glare = annual_glare(
            shown(i, columns),
            geometry=geometry,
            options=options,
            illuminance=None if eye is None else eye[columns],
            checkpoint=_numbered(checkpoint, f"{i}" if i else ""),
            progress=part(progress, i / kinds.shape[1], (i + 1) / kinds.shape[1], "glare"),
        )
        return np.array([getattr(glare, name) for name in FIGURES])

    for i, combination in enumerate(kinds.T):
        columns = np.flatnonzero(kind.ravel() == i)
        entry = None if cached is None else cached(combination)
        if len(columns) == len(chosen):
            table[:, columns] = cached_or_computed(entry, partial(rated, i, columns))
        else:
            stored = None if entry is None else entry.matrix()
            table[:, columns] = rated(i, columns) if stored is None else stored[:, columns]
    return AnnualGlare(**dict(zip(FIGURES, table, strict=True)), rule=options.rule)


def glare_with(
    light: Light,
    systems: Sequence[States],
    hours: NDArray[np.int64],
    metric: str = "DGP",
    state: NDArray[np.int64] | None = None,
    *,
    options: GlareOptions | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """DGP and illuminance at the eye [lx] of some hours [n] of the light with other systems.

    Args: systems, state: as of `with_systems`.
    """
    dgp, eye = np.zeros(len(hours)), np.zeros(len(hours))
    for changed, rows, columns in with_systems(light, systems, hours, state):
        rated = hourly_glare(changed, metric, rows, options=options)
        dgp[columns], eye[columns] = rated.dgp, rated.Ev
    return dgp, eye


def bright_hours(dgp: NDArray[np.float64], count: int) -> NDArray[np.int64]:
    """Hours [n] to try a change on: half of them of the highest DGP, the rest evenly below."""
    order = np.argsort(-dgp, kind="stable")
    top, rest = order[: count // 2], order[count // 2 :]
    steps = np.unique(np.linspace(0, len(rest) - 1, count // 2).astype(np.int64))
    return np.sort(np.concatenate([top, rest[steps] if len(rest) else rest]))


def metric_values(light: Light, metric: str) -> NDArray[np.float64]:
    """A metric of `METRICS` in every hour of the light's sky [L]; illuminance [S, L] in lx."""
    if metric == "illuminance":
        return illuminance(light)
    return hourly_glare(light, metric).dgp


def pictures(
    light: PhaseLight | PathLight, hours: ArrayLike, state: State = None, *, progress: Progress = silent
) -> list[Picture]:
    """Luminance pictures [ny, nx] [cd/m2] of some hours [n] of the light's sky."""
    hours = hour_numbers(hours, len(light.sky.lit))
    rows = hourly_states(state, light.systems, light.sky)[:, hours]
    shown: dict[int, Picture] = {}
    if isinstance(light, PathLight):
        rooms = rooms_by_state(light, rows)
        for i, now in enumerate(rows.T):
            steps = part(progress, i / len(hours), (i + 1) / len(hours), "pictures")
            room = rooms[tuple(now.tolist())]
            shown[i] = picture_of_room(light, room, int(hours[i]), progress=steps)
        return list(shown.values())
    for columns, of_kind in pictures_by_state(light, hours, rows):
        values = of_kind.values(np.arange(len(columns)))
        for c, row in zip(columns.tolist(), values, strict=True):
            shown[c] = full_picture(row, of_kind.pixels, of_kind.view)
    progress("pictures", 1.0)
    return [shown[i] for i in range(len(hours))]


def rated_pictures(
    light: Light,
    hours: ArrayLike,
    state: State = None,
    *,
    options: GlareOptions | None = None,
    progress: Progress = silent,
) -> list[tuple[Picture, GlareResult]]:
    """Luminance pictures of some hours as of `pictures`, and the glare of each."""
    hours, options = hour_numbers(hours, len(light.sky.lit)), options or GlareOptions()
    rows = hourly_states(state, light.systems, light.sky)[:, hours]
    if isinstance(light, SeasonalLight):
        return _rated_in_seasons(light, hours, rows, options, progress)
    results: dict[int, tuple[Picture, GlareResult]] = {}
    geometry, apart = GlareView(light.scene.eye), options.sun == "source"
    if isinstance(light, PathLight):
        made = _path_pictures(light, hours, rows, progress)
    else:
        made = _phase_pictures(light, hours, rows)
    for one in made:
        how: dict[str, Any] = {"options": options, "discs": one.discs if apart else ()}
        rated = evaluate(one.bare if apart else one.shown, geometry, **how)
        if one.noise is not None:
            error = _picture_error(one.bare if apart else one.shown, one.noise, geometry, how)
            rated = replace(rated, dgp_standard_error=error)
        results[one.number] = one.shown, rated
        progress("pictures", len(results) / len(hours))
    return [results[i] for i in range(len(hours))]


def _picture_error(picture: Picture, noise: Picture, geometry: GlareView, how: dict[str, Any]) -> float:
    """Standard error of the DGP of a picture; `how`: options of `evaluate`."""

    def dgp(values: NDArray[np.float32]) -> float:
        return evaluate(values.reshape(picture.shape), geometry, **how).unlimited_dgp

    signs = random_signs(geometry.view, np.arange(picture.size))
    return dgp_error(dgp, picture.ravel(), noise.ravel(), signs)


@dataclass(frozen=True, slots=True)
class _Made:
    """One of several pictures, before it is rated."""

    number: int  # among them
    bare: Picture  # without the sun's disc and its images
    discs: tuple[SunDisc, ...]
    shown: Picture  # with the discs
    noise: Picture | None  # half the difference of two halves of the paths; None: not known


def _path_pictures(
    light: PathLight, hours: NDArray[np.int64], rows: NDArray[np.int64], progress: Progress
) -> Iterator[_Made]:
    """Pictures of hours [n] in their states [G, n], each of its own paths."""
    rooms = rooms_by_state(light, rows)
    for i, (hour, now) in enumerate(zip(hours.tolist(), rows.T, strict=True)):
        steps = part(progress, i / len(hours), (i + 1) / len(hours), "pictures")
        one = picture_with_disc(light, rooms[tuple(now.tolist())], hour, progress=steps)
        yield _Made(i, one.bare, one.discs, one.shown, None)


def _phase_pictures(light: PhaseLight, hours: NDArray[np.int64], rows: NDArray[np.int64]) -> Iterator[_Made]:
    """Pictures of hours [n] in their states [G, n] from matrices."""
    for numbers, of_kind in pictures_by_state(light, hours, rows):
        whole = partial(full_picture, pixels=of_kind.pixels, view=of_kind.view)
        for i, number in enumerate(numbers.tolist()):
            only = np.array([i])
            values, discs = of_kind.without_disc(only)
            noise, bare = whole(of_kind.noise(only)[0]), whole(values[0])
            of_kind.add_disc(values, only)
            yield _Made(number, bare, discs[0], whole(values[0]), noise)


def _of_seasons(
    light: SeasonalLight,
    metric: str,
    chosen: NDArray[np.int64],
    rows: NDArray[np.int64],
    options: GlareOptions,
    progress: Progress,
    *,
    checkpoint: Path | None,
) -> AnnualGlare:
    """Glare of some hours [n] in their states [G, n], season by season."""
    table = np.full((len(FIGURES), len(chosen)), np.nan)
    done = 0
    for i, season in enumerate(_in_seasons(light, chosen, rows)):
        end = (done + len(season.columns)) / len(chosen)
        rated = hourly_glare(
            season.light,
            metric,
            season.state,
            hours=season.hours,
            options=options,
            checkpoint=_numbered(checkpoint, f"season-{i}"),
            progress=part(progress, done / len(chosen), end, "glare"),
        )
        table[:, season.columns] = [getattr(rated, name) for name in FIGURES]
        done += len(season.columns)
    return AnnualGlare(**dict(zip(FIGURES, table, strict=True)), rule=options.rule)


def _rated_in_seasons(
    light: SeasonalLight, hours: NDArray[np.int64], rows: NDArray[np.int64], options: GlareOptions, progress: Progress
) -> list[tuple[Picture, GlareResult]]:
    """The pictures of hours [n] in their states [G, n], season by season, and their glare."""
    results: dict[int, tuple[Picture, GlareResult]] = {}
    for season in _in_seasons(light, hours, rows):
        rated = rated_pictures(season.light, season.hours, season.state, options=options, progress=progress)
        results |= dict(zip(season.columns.tolist(), rated, strict=True))
    return [results[i] for i in range(len(hours))]


@dataclass(frozen=True, slots=True)
class _Season:
    """Those of some hours [n] that are in one season."""

    light: PhaseLight | PathLight
    columns: NDArray[np.int64]  # which of the hours
    hours: NDArray[np.int64]  # their numbers among those of the season
    state: NDArray[np.int64]  # [G, l] of all hours of the season


def _in_seasons(light: SeasonalLight, hours: NDArray[np.int64], rows: NDArray[np.int64]) -> Iterator[_Season]:
    """Hours [n] in their states [G, n], season by season."""
    for one, of_season in light.seasons():
        columns = np.flatnonzero(np.isin(hours, of_season))
        if len(columns):
            among = np.searchsorted(of_season, hours[columns])
            state = np.zeros((len(rows), len(of_season)), dtype=np.int64)
            state[:, among] = rows[:, columns]
            yield _Season(one, columns, among, state)


def _by_path_tracing(
    light: PathLight,
    metric: str,
    hours: NDArray[np.int64],
    state: NDArray[np.int64],
    options: GlareOptions,
    progress: Progress,
) -> AnnualGlare:
    """Glare of some hours, each by its own paths.

    Args: state: [G, L] of all hours of the sky.
    """
    if metric == "sDGP":
        return _simplified(path_eye_illuminance(light, hours, state))
    rows, rooms = state[:, hours], rooms_by_state(light, state[:, hours])
    geometry, apart = GlareView(light.scene.eye), options.sun == "source"

    def rated(i: int, **seed: int) -> list[float]:
        hour, room = int(hours[i]), rooms[tuple(rows[:, i].tolist())]
        known, depth = options, {}
        if metric == "eDGP":
            [eye] = path_eye_illuminance(light, hours[i : i + 1], state)
            known, depth = replace(options, illuminance=float(eye)), {"max_depth": DIRECT_DEPTH}
        picture = picture_of_room(light, room, hour, disc=not apart, **depth, **seed)
        discs = discs_of_room(light, room, hour) if apart else ()
        return figures(evaluate(picture, geometry, options=known, discs=discs))

    values = []
    for i in range(len(hours)):
        values.append(rated(i))
        progress("glare", (i + 1) / len(hours))
    table = np.array(values, dtype=float).reshape(len(hours), len(FIGURES)).T
    again = hours_by_halves(table[0])
    other = np.array([rated(i, seed=light.sampling.seed + 1)[0] for i in again])
    table[-1] = dgp_errors(table[0], again, np.abs(table[0, again] - other) / np.sqrt(2))
    return AnnualGlare(**dict(zip(FIGURES, table, strict=True)), rule=options.rule)


def _simplified(eye: NDArray[np.float64]) -> AnnualGlare:
    """sDGP from the illuminance at the eye [n] [lx]."""
    unknown = np.full(len(eye), np.nan)
    dgp = np.array([indices.simplified_dgp(E) for E in eye.tolist()])
    rest: dict[str, Any] = dict.fromkeys(FIGURES[2:], unknown)
    return AnnualGlare(dgp, np.asarray(eye, dtype=float), **rest)


def _numbered(path: Path | None, name: str) -> Path | None:
    return path if path is None or not name else path.with_stem(f"{path.stem}-{name}")
