"""Glare of hours by any method: DGP of full pictures, eDGP of direct ones, sDGP of illuminance.

    three-phase    E_v = V T D s                                eDGP pictures V_d T D_d s
    five-phase     E_v = V T D s - V_d T D_d s_d + C_ds s_sun   V_d T D_d s_sky + C s_sun
    paths          E_v of a sensor at the eye                   paths of one reflection

Source: Wienold 2009, "Dynamic daylight glare evaluation" (eDGP); the dissertation's 3.2.4 to 3.2.6,
whose equation (20) has the sun twice if its s_d holds it: here s_sky is the sky without the sun.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.glare import indices
from mitsuba_cfs.glare.annual import FIGURES, AnnualGlare, annual_glare, figures, full_picture
from mitsuba_cfs.glare.dgp_error import dgp_errors, hours_by_halves
from mitsuba_cfs.glare.evaluation import GlareOptions, GlareResult, evaluate
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.glare.sun_disc import SunDisc
from mitsuba_cfs.images.view import View
from mitsuba_cfs.matrices.cache import CacheEntry, cached_or_computed
from mitsuba_cfs.methods.few_pictures import pictures_by_state
from mitsuba_cfs.methods.optics import hourly_states
from mitsuba_cfs.methods.path_light import PathLight, PathSystems
from mitsuba_cfs.methods.phase_light import PhaseLight, PhaseSystems
from mitsuba_cfs.methods.seasonal_light import SeasonalLight
from mitsuba_cfs.progress import Progress, part, silent

DIRECT_DEPTH = 2  # segments of a direct-only path behind what the eye sees: to window, to sky
State = ArrayLike | None  # [G, L] of each window group in each hour, or [L] of all; None: the first


def hourly_glare(
    light: PhaseLight | PathLight | SeasonalLight,
    metric: str = "DGP",
    state: State = None,
    *,
    hours: ArrayLike | None = None,
    options: GlareOptions | None = None,
    keep: Path | None = None,
    kept: Callable[[NDArray[np.int64]], CacheEntry] | None = None,
    progress: Progress = silent,
) -> AnnualGlare:
    """Glare of the view in some hours [n] of the light's sky, all by default.

    Args:
        metric: DGP, eDGP or sDGP; the latter has no figures but the illuminance.
        state: of the windows in each of the sky's hours.
        options: what a source is, and the rest of how glare is rated.
        keep: file of the ratings so far, see `annual_glare`.
        kept: the place of these hours' ratings with each window group in a state [G].  They are
            kept where that state holds in all hours, and read where it holds in some.
    """
    chosen = np.arange(len(light.sky.lit)) if hours is None else np.asarray(hours, dtype=np.int64)
    rows = hourly_states(state, len(light.filled.systems), len(light.sky.lit))[:, chosen]
    options = options or GlareOptions()
    if isinstance(light, SeasonalLight):
        return _of_seasons(light, metric, chosen, rows, options, progress, keep=keep)
    if isinstance(light, PathLight):
        return _of_paths(light, metric, chosen, rows, options, progress)
    if metric == "sDGP":
        return _simplified(light.eye(state)[chosen])
    own = light.eye(state)[chosen] if metric == "eDGP" else None
    geometry = light.filled.traced.geometry
    table = np.full((len(FIGURES), len(chosen)), np.nan)
    kinds, kind = np.unique(rows, axis=1, return_inverse=True)

    def found(i: int, columns: NDArray[np.int64]) -> NDArray[np.float64]:
        rated = annual_glare(
            light.pictures(chosen[columns], kinds[:, i], direct=metric == "eDGP"),
            geometry=geometry,
            options=options,
            illuminance=None if own is None else own[columns],
            keep=keep if keep is None or i == 0 else keep.with_stem(f"{keep.stem}-{i}"),
            progress=part(progress, i / kinds.shape[1], (i + 1) / kinds.shape[1], "glare"),
        )
        return np.array([getattr(rated, name) for name in FIGURES])

    for i, combination in enumerate(kinds.T):
        columns = np.flatnonzero(kind.ravel() == i)
        entry = None if kept is None else kept(combination)
        if len(columns) == len(chosen):
            table[:, columns] = cached_or_computed(entry, partial(found, i, columns))
        else:
            known = None if entry is None else entry.load()
            table[:, columns] = found(i, columns) if known is None else known.mean[:, columns]
    return AnnualGlare(**dict(zip(FIGURES, table, strict=True)), rule=options.rule)


def _of_seasons(
    light: SeasonalLight,
    metric: str,
    chosen: NDArray[np.int64],
    rows: NDArray[np.int64],
    options: GlareOptions,
    progress: Progress,
    *,
    keep: Path | None,
) -> AnnualGlare:
    """Glare of some hours [n] in their states [G, n], season by season."""
    table = np.full((len(FIGURES), len(chosen)), np.nan)
    done = 0
    for i, (own, hours) in enumerate(light.parts()):
        columns = np.flatnonzero(np.isin(chosen, hours))
        if not len(columns):
            continue
        among = np.searchsorted(hours, chosen[columns])
        states = np.zeros((len(rows), len(hours)), dtype=np.int64)
        states[:, among] = rows[:, columns]
        end = (done + len(columns)) / len(chosen)
        rated = hourly_glare(
            own, metric, states, hours=among, options=options,
            keep=keep and keep.with_stem(f"{keep.stem}-season-{i}"),
            progress=part(progress, done / len(chosen), end, "glare"),
        )  # fmt: skip
        table[:, columns] = [getattr(rated, name) for name in FIGURES]
        done += len(columns)
    return AnnualGlare(**dict(zip(FIGURES, table, strict=True)), rule=options.rule)


def light_seen_from(
    light: PhaseLight | SeasonalLight, view: View, progress: Progress = silent
) -> PhaseLight | SeasonalLight:
    """The same light seen from another eye: that of the windows is not computed again."""
    if isinstance(light, SeasonalLight):
        return light.changed(lambda own: light_seen_from(own, view, progress))
    traced = light.filled.traced.seen_from(view, progress)
    found = PhaseSystems(traced, light.filled.systems).light(light.sky)
    found.__dict__["windows"] = light.windows
    return found


def pictures(
    light: PhaseLight | PathLight,
    hours: ArrayLike,
    state: State = None,
    *,
    progress: Progress = silent,
) -> list[NDArray[np.float32]]:
    """Luminance pictures [ny, nx] [cd/m2] of some hours [n] of the light's sky."""
    hours = np.asarray(hours, dtype=np.int64)
    rows = hourly_states(state, len(light.filled.systems), len(light.sky.lit))[:, hours]
    found: dict[int, NDArray[np.float32]] = {}
    if isinstance(light, PathLight):
        for i, now in enumerate(rows.T):
            steps = part(progress, i / len(hours), (i + 1) / len(hours), "pictures")
            found[i] = light.picture(int(hours[i]), now, progress=steps)
        return list(found.values())
    for columns, of_kind in pictures_by_state(light, hours, rows):
        values = of_kind.values(np.arange(len(columns)))
        for c, row in zip(columns.tolist(), values, strict=True):
            found[c] = full_picture(row, of_kind.pixels, of_kind.view)
    progress("pictures", 1.0)
    return [found[i] for i in range(len(hours))]


def _simplified(eye: NDArray[np.float64]) -> AnnualGlare:
    nothing = np.full(len(eye), np.nan)
    rest = {name: nothing for name in FIGURES[2:]}
    dgp = np.array([indices.simplified_dgp(E) for E in eye.tolist()])
    return AnnualGlare(dgp=dgp, Ev=np.asarray(eye, dtype=float), **rest)


def rated_pictures(
    light: PhaseLight | PathLight | SeasonalLight,
    hours: ArrayLike,
    state: State = None,
    *,
    options: GlareOptions | None = None,
    progress: Progress = silent,
) -> list[tuple[NDArray[np.float32], GlareResult]]:
    """Luminance pictures of some hours as of `pictures`, and the glare of each."""
    hours, options = np.asarray(hours, dtype=np.int64), options or GlareOptions()
    rows = hourly_states(state, len(light.filled.systems), len(light.sky.lit))[:, hours]
    if isinstance(light, SeasonalLight):
        return _rated_in_seasons(light, hours, rows, options, progress)
    found: dict[int, tuple[NDArray[np.float32], GlareResult]] = {}
    geometry, apart = GlareView(_view(light)), options.sun == "source"
    if isinstance(light, PathLight):
        made = _by_paths(light, hours, rows, progress)
    else:
        made = _by_phases(light, hours, rows)
    for one in made:
        own = {"options": options, "disc": one.disc if apart else None}
        rated = evaluate(one.bare if apart else one.shown, geometry, **own)
        if one.halves:
            add = 0 if apart else one.shown - one.bare
            first, second = (evaluate(half + add, geometry, **own).dgp for half in one.halves)
            rated = replace(rated, dgp_standard_error=abs(first - second) / 2)
        found[one.number] = one.shown, rated
        progress("pictures", len(found) / len(hours))
    return [found[i] for i in range(len(hours))]


@dataclass(frozen=True, slots=True)
class _Made:
    """One of several pictures, before it is rated."""

    number: int  # among them
    bare: NDArray[np.float32]  # [ny, nx] without the sun's disc
    disc: SunDisc | None
    shown: NDArray[np.float32]  # with the disc
    halves: Sequence[NDArray[np.float32]]  # of the paths, without the disc; none: not known


def _by_paths(
    light: PathLight, hours: NDArray[np.int64], rows: NDArray[np.int64], progress: Progress
) -> Iterator[_Made]:
    """Pictures of hours [n] in their states [G, n], each of its own paths."""
    for i, (hour, now) in enumerate(zip(hours.tolist(), rows.T, strict=True)):
        steps = part(progress, i / len(hours), (i + 1) / len(hours), "pictures")
        bare = light.picture(hour, now, disc=False, progress=steps)
        yield _Made(i, bare, light.disc(hour, now), light.with_disc(bare, hour, now), ())


def _by_phases(
    light: PhaseLight, hours: NDArray[np.int64], rows: NDArray[np.int64]
) -> Iterator[_Made]:
    """Pictures of hours [n] in their states [G, n] from matrices."""
    for numbers, found in pictures_by_state(light, hours, rows):
        whole = partial(full_picture, pixels=found.pixels, view=found.view)
        for i, number in enumerate(numbers.tolist()):
            only = np.array([i])
            values, discs = found.without_disc(only)
            noise, bare = found.noise(only)[0], whole(values[0])
            halves = [whole(np.maximum(values[0] + side * noise, 0)) for side in (1, -1)]
            found.add_disc(values, only)
            yield _Made(number, bare, discs[0], whole(values[0]), halves)


def _rated_in_seasons(
    light: SeasonalLight,
    hours: NDArray[np.int64],
    rows: NDArray[np.int64],
    options: GlareOptions,
    progress: Progress,
) -> list[tuple[NDArray[np.float32], GlareResult]]:
    """The pictures of hours [n] in their states [G, n], season by season, and their glare."""
    found: dict[int, tuple[NDArray[np.float32], GlareResult]] = {}
    for own, season in light.parts():
        columns = np.flatnonzero(np.isin(hours, season))
        if not len(columns):
            continue
        at = np.searchsorted(season, hours[columns])
        states = np.zeros((len(rows), len(season)), dtype=np.int64)
        states[:, at] = rows[:, columns]
        rated = rated_pictures(own, at, states, options=options, progress=progress)
        found |= dict(zip(columns.tolist(), rated, strict=True))
    return [found[i] for i in range(len(hours))]


def _view(light: PhaseLight | PathLight) -> View | None:
    filled = light.filled
    return (filled.scene if isinstance(filled, PathSystems) else filled.traced.scene).view


def _of_paths(
    light: PathLight,
    metric: str,
    hours: NDArray[np.int64],
    rows: NDArray[np.int64],
    options: GlareOptions,
    progress: Progress,
) -> AnnualGlare:
    """Glare of some hours, each by its own paths."""
    if metric == "sDGP":
        eye = [light.eye(int(h), now) for h, now in zip(hours, rows.T, strict=True)]
        return _simplified(np.array(eye))
    geometry, apart = GlareView(light.filled.scene.view), options.sun == "source"

    def rated(i: int, **seed: int) -> list[float]:
        hour, now, known, depth = int(hours[i]), rows[:, i], options, {}
        if metric == "eDGP":
            known = replace(options, illuminance=light.eye(hour, now))
            depth = {"max_depth": DIRECT_DEPTH}
        picture = light.picture(hour, now, disc=not apart, **depth, **seed)
        disc = light.disc(hour, now) if apart else None
        return figures(evaluate(picture, geometry, options=known, disc=disc))

    found = []
    for i in range(len(hours)):
        found.append(rated(i))
        progress("glare", (i + 1) / len(hours))
    table = np.array(found, dtype=float).reshape(len(hours), len(FIGURES)).T
    again = hours_by_halves(table[0])
    other = np.array([rated(i, seed=light.filled.sampling.seed + 1)[0] for i in again])
    table[-1] = dgp_errors(table[0], again, np.abs(table[0, again] - other) / np.sqrt(2))
    return AnnualGlare(**dict(zip(FIGURES, table, strict=True)), rule=options.rule)
