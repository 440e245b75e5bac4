"""Glare of a room's views in every hour with the sun up, from files to tables."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.read_ifc import STAGES, read_ifc
from bim.to_tracer import exterior_surfaces, interior_surfaces, window_groups
from mitsuba_cfs import variants
from mitsuba_cfs.glare.annual import AnnualGlare, annual_glare, full_picture, kept_glare
from mitsuba_cfs.glare.simplified import simplified_dgp
from mitsuba_cfs.images.view import format_view
from mitsuba_cfs.metrics.schedules import working_hours
from mitsuba_cfs.progress import Progress, item, part, silent, summed
from mitsuba_cfs.sky.matrix import sun_up
from mitsuba_cfs.sky.weather import Weather
from scenes.job.inputs import chosen_spaces, read_system, read_weather, sha256
from scenes.methods.phases import PhaseSystem, phase_scene
from scenes.methods.place import Fenestration, Place, Quality, Skies, fenestration, skies_of
from scenes.year_of_glare.options import YearOptions
from scenes.year_of_glare.views import NamedView, chosen_views

DARK = 0.0  # DGP of the hours of use without sun, for the share of hours
FIGURES = ("dgp", "Ev", "dgi", "ugr", "cgi", "vcp", "sources", "background_luminance")


@dataclass(frozen=True, slots=True)
class ViewYear:
    """A view's ratings, and its pictures of the worst hours."""

    view: NamedView
    ratings: pd.DataFrame  # [L, figures] by the time of each lit hour
    pictures: dict[pd.Timestamp, NDArray[np.float32]]  # [ny, nx] [cd/m2], none for sDGP
    seconds: float


@dataclass(frozen=True, slots=True)
class Year:
    """What all views share."""

    options: YearOptions
    room: str
    views: list[NamedView]
    place: Place  # its view is the first
    system: Fenestration
    weather: Weather
    lit: NDArray[np.int64]  # [L] hours with the sun up
    skies: Skies  # of these
    used: NDArray[np.bool_]  # [H] hours of use
    digest: str  # of all inputs


def read_year(options: YearOptions, progress: Progress = silent) -> Year:
    """Read and check all inputs, the quick ones first; `DataError` where one cannot be used."""
    system, weather = read_system(options.system), read_weather(options.weather)
    progress("inputs", 0.1)
    building = read_ifc(
        options.building, progress=summed(part(progress, 0.1, 0.6), "inputs", STAGES)
    )
    names = () if options.space is None else (options.space,)
    space = chosen_spaces(building, names, options.building)[0]
    views = chosen_views(space, options)
    variants.activate()
    quality = Quality()
    lit = np.flatnonzero(sun_up(weather))
    skies = skies_of(weather, lit, subdivision=quality.subdivision)
    progress("inputs", 1.0)
    nothing = np.empty((0, 3))
    place = Place(
        interior_surfaces(space, "visible"),
        exterior_surfaces(building, space, "visible"),
        window_groups(space),
        views[0].view,
        nothing,
        nothing,
    )
    chosen = [options.method, options.metric, options.samples, options.seed]
    files = [sha256(p) for p in (options.building, options.weather, options.system)]
    digest = hashlib.sha256(json.dumps([*chosen, *files, space.guid]).encode()).hexdigest()
    used = working_hours(weather, *map(float, options.occupied))
    return Year(
        options, space.name or space.guid, views, place,
        fenestration(system.visible, system.fine), weather, lit, skies, used, digest,
    )  # fmt: skip


def rate_views(year: Year, kept: Path, progress: Progress = silent) -> Iterator[ViewYear]:
    """Rate one view after the other; what lies in the folder `kept` is not computed again."""
    options, scene = year.options, None
    quality = Quality(
        pixel_samples=options.samples, memory=options.memory_gb * 2**30, seed=options.seed
    )
    times = year.weather.midpoints[year.lit]
    for number, named in enumerate(year.views):
        steps = item(progress, "view", number + 1, len(year.views), named.name, whole=True)
        start = time.monotonic()
        text = f"{year.digest} {format_view(named.view)} {named.view.width}"
        keep = kept / f"{hashlib.sha256(text.encode()).hexdigest()[:24]}.npy"
        found = kept_glare(keep, len(times)) if keep.is_file() else None
        system = None
        if found is None or (options.worst and options.metric != "sDGP"):
            place = replace(year.place, view=named.view)
            scene = phase_scene(
                place, options.metric, five_phase=options.method == "five-phase",
                quality=quality, other=scene, progress=part(steps, 0.0, 0.3),
            )  # fmt: skip
            system = scene.behind(year.system)
            found = found or _rated(system, year, keep, part(steps, 0.3, 1.0))
        table = pd.DataFrame(
            {name: getattr(found, name) for name in FIGURES}, index=times.rename("time")
        )
        worst = found.worst(options.worst)
        pictures = _pictures(system, year, worst) if system is not None else {}
        steps("", 1.0)
        yield ViewYear(named, table, pictures, time.monotonic() - start)


def _rated(system: PhaseSystem, year: Year, keep: Path, progress: Progress) -> AnnualGlare:
    """Ratings of the lit hours by the year's metric."""
    metric, skies = year.options.metric, year.skies
    if metric == "sDGP":
        eye = system.illuminance(skies)[0]
        nothing = np.full(len(eye), np.nan)
        rest = {name: nothing for name in FIGURES[2:]}
        return AnnualGlare(dgp=simplified_dgp(eye), Ev=eye, **rest)
    eye = system.illuminance(skies)[0] if metric == "eDGP" else None
    return annual_glare(
        system.pictures(skies), geometry=system.scene.geometry, illuminance=eye, keep=keep,
        progress=progress,
    )  # fmt: skip


def _pictures(
    system: PhaseSystem, year: Year, hours: NDArray[np.int64]
) -> dict[pd.Timestamp, NDArray[np.float32]]:
    """Pictures of some lit hours."""
    if not len(hours) or year.options.metric == "sDGP":
        return {}
    pictures = system.pictures(year.skies.part(hours))
    values = pictures.values(np.arange(len(hours)))
    times = year.weather.midpoints[year.lit[hours]]
    return {
        t: full_picture(row, pictures.pixels, pictures.view)
        for t, row in zip(times, values, strict=True)
    }


def used_dgp(year: Year, dgp: NDArray[np.float64]) -> NDArray[np.float64]:
    """DGP of the hours of use [U] from those of the lit hours [L]; dark hours have no glare."""
    whole = np.full(len(year.weather.midpoints), DARK)
    whole[year.lit] = dgp
    return whole[year.used]
