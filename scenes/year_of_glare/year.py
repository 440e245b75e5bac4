"""Glare of a room's views in every hour with the sun up, from files to tables."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.building_file import files_beside
from bim.model import Building, Space, season_of
from mitsuba_cfs import variants
from mitsuba_cfs.files import json_text, sha256, write_text
from mitsuba_cfs.glare.annual import FIGURES, AnnualGlare, finished_glare
from mitsuba_cfs.glare.evaluation import GlareOptions, GlareResult
from mitsuba_cfs.images.view import View, format_view
from mitsuba_cfs.matrices.cache import MatrixCache, digest
from mitsuba_cfs.methods.glare import bright_hours, glare_with, hourly_glare, rated_pictures
from mitsuba_cfs.methods.light import SeasonalLight, seasonal_light
from mitsuba_cfs.methods.optics import States
from mitsuba_cfs.methods.phase_light import PhaseLight, phase_light
from mitsuba_cfs.methods.phase_matrices import PhaseMatrices, phase_matrices, with_eye, with_outdoors
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.methods.sun_by_patches import sunny_hour_dgp_error
from mitsuba_cfs.metrics.schedules import working_hours
from mitsuba_cfs.progress import Progress, item, part, silent, summed
from mitsuba_cfs.sky.annual import AnnualSky, annual_sky
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.source_code import code_version
from scenes.fenestration.peaks import lobe_effect
from scenes.head import NO_HEAD, Head
from scenes.input_files import InputFiles
from scenes.inputs import first_states, read_inputs
from scenes.results import DGP_SUNNY_HOUR_ERROR
from scenes.viewed_room import viewed_room
from scenes.year_of_glare.options import YearOptions
from scenes.year_of_glare.views import NamedView, chosen_views, read_files

TRACING = {"daylight": 1.0, "view matrices": 2.0}  # shares of the time
BOTH_WAYS = 16  # hours that compare a beam with a lobe
DARK = 0.0  # DGP of the hours of use without sun, for the share of hours


@dataclass(frozen=True, slots=True)
class ViewYear:
    """A view's ratings, and its pictures of the worst hours."""

    view: NamedView
    ratings: pd.DataFrame  # [L, figures] by the time of each lit hour
    pictures: dict[pd.Timestamp, tuple[NDArray[np.float32], GlareResult]]  # none for sDGP
    seconds: float
    # what the method and an undecided peak do to DGP: `DGP_SUNNY_HOUR_ERROR`, `lobe_effect`
    effects: dict[str, float]


@dataclass(frozen=True, slots=True)
class GlareYear:
    """What all views share."""

    options: YearOptions
    room: str
    views: list[NamedView]
    scene: DaylightScene  # its view is the first
    optics: Sequence[States]  # [G] of each window group, one state
    weather: Weather
    sky: AnnualSky  # of the hours L with the sun up
    used: NDArray[np.bool_]  # [H] hours of use
    digest: str  # of all inputs
    head: Head = NO_HEAD  # what was left out, what was assumed
    notes: tuple[str, ...] = ()  # light that is lost through leaks of the model
    fenestration: Sequence[dict[str, Any]] = ()  # system, source and windows of each, see `resolver`
    space: Space | None = None  # the room, for its plan
    scenes: Sequence[DaylightScene] = ()  # of each season; none where it is always the same
    season: NDArray[np.int64] | None = None  # [L] of each hour of the sky
    lobes: Sequence[States] | None = None  # of `ViewedRoom`


def read_year(
    options: YearOptions,
    progress: Progress = silent,
    files: InputFiles | None = None,
    on_head: Callable[[Head], None] = lambda head: None,
) -> GlareYear:
    """Read and check all inputs, the building last; `DataError` where one cannot be used.

    Args:
        files: of `read_files`; read now by default.
        on_head: called with what was left out and assumed, before anything is traced.
    """
    files = files or read_files(options)
    views: list[NamedView] = []

    def view_of(building: Building, space: Space) -> View:
        views.extend(chosen_views(building, space, options))
        return views[0].view

    steps = part(progress, 0.0, 0.6)
    inputs = read_inputs(options, files, steps, rooms="first", states=first_states)
    weather = inputs.weather
    on_head(inputs.head)
    viewed = viewed_room(inputs, view_of)
    chosen = [options.method, options.metric, options.samples, options.seed, options.join]
    chosen += [options.window_parts, options.glare_sources, options.glare_sun]
    chosen += [options.sun_model, options.sky_ground, options.furniture, options.apertures]
    chosen += [options.surroundings_offset, options.facade_panes, options.albedo]
    # corrections change rooms and surroundings, as --join does, under the same GUID
    files_read = (options.building, options.weather, *files_beside(options.building))
    files_read += (*options.linked, *options.surroundings)
    hashes = [sha256(path) for path in files_read]
    # not of files: the model may name others, which change by themselves
    optics = [[s.visible, s.fine, s.angular] for s in inputs.used_systems]
    key = digest(code_version(__name__), *chosen, *hashes, optics, viewed.space.guid)
    variants.activate()
    leaks = tuple(viewed.leaks())
    sampling = sampling_of(options)
    sky = annual_sky(weather, sampling.subdivision, sun_model=options.sun_model, ground=options.sky_ground)
    progress("inputs", 1.0)
    used = working_hours(weather, *options.occupied)
    return GlareYear(
        options,
        viewed.space.label,
        views,
        viewed.scene,
        viewed.optics,
        weather,
        sky,
        used,
        key,
        inputs.head,
        leaks,
        inputs.sources,
        viewed.space,
        viewed.scenes,
        season_of(viewed.seasons, weather.midpoints[sky.lit].month.to_numpy()),
        viewed.lobes,
    )


def sampling_of(options: YearOptions) -> Sampling:
    """How finely the year is computed."""
    memory = options.memory_gb * 2**30
    return Sampling(view_samples=options.samples, memory=memory, window_parts=options.window_parts, seed=options.seed)


def rating_of(options: YearOptions) -> GlareOptions:
    """How glare is rated."""
    return GlareOptions(grouping=options.glare_sources, sun=options.glare_sun)


def rate_views(year: GlareYear, checkpoints: Path, progress: Progress = silent) -> Iterator[ViewYear]:
    """Rate one view after the other; views in the folder `checkpoints` are read from it."""
    options = year.options
    first = phase_matrices(
        year.scene,
        sampling_of(options),
        five_phase=options.method == "five-phase",
        needs=(),
        cache=MatrixCache.of_user(),
    )
    seasons = [first, *(with_outdoors(first, scene) for scene in year.scenes[1:])]
    times = year.weather.midpoints[year.sky.lit]
    for number, named in enumerate(year.views):
        steps = item(progress, "view", number + 1, len(year.views), named.name, whole=True)
        start = time.monotonic()
        key = digest(year.digest, format_view(named.view), named.view.width)[:24]
        checkpoint = checkpoints / f"{key}.npy"
        result = finished_glare(checkpoint, len(times)) if checkpoint.is_file() else None
        tracing = summed(part(steps, 0.0, 0.3), named.name, TRACING)
        matrices = [with_eye(season, named.view) for season in seasons]
        light = _light(year, matrices, () if result else (options.metric,), tracing)
        result = result or hourly_glare(
            light, options.metric, options=rating_of(options), checkpoint=checkpoint, progress=part(steps, 0.3, 1.0)
        )
        table = pd.DataFrame({name: getattr(result, name) for name in FIGURES}, index=times.rename("time"))
        shown = _pictures(light, year, result)
        stored = checkpoint.with_suffix(".json")
        effects = _stored_effects(stored)
        if effects is None:
            effects = _effects(light, year, result)
            write_text(stored, json_text(effects))
        steps("", 1.0)
        yield ViewYear(named, table, shown, time.monotonic() - start, effects)


def _effects(light: PhaseLight | SeasonalLight, year: GlareYear, result: AnnualGlare) -> dict[str, float]:
    """`ViewYear.effects` of a rated view."""
    metric, rating = year.options.metric, rating_of(year.options)
    error = sunny_hour_dgp_error(light, result.dgp, metric, options=rating)
    effects = {DGP_SUNNY_HOUR_ERROR: error}
    if year.lobes is not None:
        hours = bright_hours(result.dgp, BOTH_WAYS)
        changed = glare_with(light, year.lobes, hours, metric, options=rating)
        effects |= lobe_effect((result.dgp[hours], result.Ev[hours]), changed)
    return effects


def _stored_effects(file: Path) -> dict[str, float] | None:
    """`ViewYear.effects` beside the ratings of a view; None where they are not stored there."""
    try:
        stored = json.loads(file.read_text("utf-8"))
        return {str(name): float(value) for name, value in stored.items()}
    except (OSError, ValueError, AttributeError, TypeError, RecursionError):
        return None


def _light(
    year: GlareYear, matrices: Sequence[PhaseMatrices], needs: Sequence[str], progress: Progress
) -> PhaseLight | SeasonalLight:
    """The light of the year's hours."""
    if len(matrices) == 1 or year.season is None:
        return phase_light(matrices[0], year.optics, year.sky, needs=needs, progress=progress)
    systems = [year.optics] * len(matrices)
    return seasonal_light(matrices, systems, year.sky, year.season, needs=needs, progress=progress)


def _pictures(
    light: PhaseLight | SeasonalLight, year: GlareYear, found: AnnualGlare
) -> dict[pd.Timestamp, tuple[NDArray[np.float32], GlareResult]]:
    """Pictures of the worst lit hours, and their glare."""
    hours = found.worst(year.options.worst)
    if not len(hours) or year.options.metric == "sDGP":
        return {}
    times = year.weather.midpoints[year.sky.lit[hours]]
    made = rated_pictures(light, hours, options=rating_of(year.options))
    return dict(zip(times, made, strict=True))


def used_dgp(year: GlareYear, dgp: NDArray[np.float64]) -> NDArray[np.float64]:
    """DGP of the hours of use [U] from those of the lit hours [L]; dark hours have no glare."""
    whole = np.full(len(year.weather.midpoints), DARK)
    whole[year.sky.lit] = dgp
    return whole[year.used]
