"""Glare of a room: pictures of chosen hours, every hour of a year, one picture in colour."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import COLOURS, Building, Space
from bim.to_tracer import exterior_surfaces, furnished_surfaces
from mitsuba_cfs.glare.evaluation import GlareOptions
from mitsuba_cfs.images.view import View
from mitsuba_cfs.matrices.cache import CacheEntry, digest
from mitsuba_cfs.methods.colour_view import coloured_picture, has_colour
from mitsuba_cfs.methods.glare import hourly_glare, rated_pictures
from mitsuba_cfs.methods.light import SeasonalLight
from mitsuba_cfs.methods.optics import States
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.methods.point_in_time import PathLight
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.progress import Progress, part
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.surfaces import WindowGroup
from scenes.results import ColourPicture, GlareResults, LuminancePicture
from scenes.room.options import Outputs
from scenes.room.picture_hours import hour_index
from scenes.room.windows import RoomWindows

COLUMNS = {
    "dgp": "dgp",
    "dgp_standard_error": "dgp_standard_error",
    "ev": "Ev",
    "dgi": "dgi",
    "ugr": "ugr",
    "sources": "sources",
}


def glare_by_state(
    light: PhaseLight | SeasonalLight, rating: GlareOptions, progress: Progress
) -> NDArray[np.float64]:
    """DGP of every hour in every state [J, H], 0 in the dark."""
    J, count = light.states, len(light.sky.lit)
    lit = [
        hourly_glare(
            light, "DGP", np.full(count, j), options=rating,
            progress=part(progress, j / J, (j + 1) / J, "glare control"),
        ).dgp
        for j in range(J)
    ]  # fmt: skip
    return light.sky.whole_year(np.stack(lit))


def glare_of_year(
    light: PhaseLight | SeasonalLight,
    state: NDArray[np.int64],
    weather: Weather,
    *,
    rating: GlareOptions,
    progress: Progress,
) -> pd.DataFrame:
    """Glare of every hour [H] with the state [L] that holds in it; NaN in the dark."""
    rated = hourly_glare(
        light, "DGP", state, options=rating, progress=part(progress, 0.0, 1.0, "annual glare")
    )
    table = np.full((light.sky.hours, len(COLUMNS)), np.nan)
    table[light.sky.lit] = np.stack([getattr(rated, name) for name in COLUMNS.values()], axis=1)
    frame = pd.DataFrame(table, index=weather.midpoints, columns=list(COLUMNS))
    return frame.rename_axis("time")


def worst_hours(year: pd.DataFrame, count: int) -> list[int]:
    """The hours of the year [indices] of the highest DGP, one a day, the worst first."""
    order = np.argsort(-year["dgp"].fillna(-1).to_numpy(), kind="stable")
    chosen: list[int] = []
    days: set = set()
    for hour in order.tolist():
        day = year.index[hour].date()
        if day not in days and year["dgp"].iloc[hour] == year["dgp"].iloc[hour]:
            chosen.append(hour)
            days.add(day)
        if len(chosen) == count:
            break
    return chosen


def kept_glare(
    light: PhaseLight, windows: RoomWindows, *asked: object
) -> Callable[[NDArray], CacheEntry] | None:
    """Cache entry of a year of glare with each window group in a state [G]; None: no cache.

    Cases of a study with the blind up and with the blind down rate every hour; the case whose blind
    is controlled reads each hour from the case whose state holds.

    Args: asked: what the ratings depend on besides light and windows.
    """
    matrices, sky = light.matrices, light.sky
    cache = matrices.cache
    if cache is None:
        return None
    seen = digest(
        matrices.scene, matrices.sampling, matrices.five_phase,
        sky.whole, sky.sun, sky.direction, sky.illuminance, *asked,
    )  # fmt: skip

    def entry(state: NDArray) -> CacheEntry:
        rows = zip(windows.systems, state.tolist(), strict=True)
        chosen = [systems[min(j, len(systems) - 1)] for systems, j in rows]
        optics = [[one.visible, one.fine, one.angular] for one in chosen]
        return cache.entry("year of glare", seen, optics, by=hourly_glare.__module__)

    return entry


DEFAULT_DAYS = ((3, 21), (6, 21), (12, 21))  # month, day
DEFAULT_CLOCK = (9, 12, 15)  # the hour that begins then, local standard time


def rating_of(outputs: Outputs) -> GlareOptions:
    """How glare is rated."""
    return GlareOptions(grouping=outputs.glare_sources, sun=outputs.glare_sun)


def default_hours(
    times: pd.DatetimeIndex,
    lit: NDArray[np.int64],
    eye_illuminance: NDArray[np.float32],
    count: int,
) -> list[int]:
    """The year's brightest hour at the eye, and with it hours of the equinox and the solstices.

    In all up to `count`; these at 9, 12 and 15 o'clock, as far as the sun is up.

    Args: eye_illuminance: [L] vertical illuminance at the eye in the lit hours [lx].
    """
    moments = [datetime(2000, *day, clock) for day in DEFAULT_DAYS for clock in DEFAULT_CLOCK]
    lit_set = set(lit.tolist())
    found = [hour for moment in moments if (hour := hour_index(moment, times)) in lit_set]
    brightest = int(lit[np.argmax(eye_illuminance)])
    chosen = {brightest, *[hour for hour in found if hour != brightest][: count - 1]}
    return [hour for hour in dict.fromkeys([*found, brightest]) if hour in chosen]


def room_glare(
    light: PhaseLight | PathLight | SeasonalLight,
    view: View,
    state: NDArray[np.int64],
    hours: list[int],
    *,
    rating: GlareOptions,
    progress: Progress,
) -> GlareResults:
    """Pictures of the chosen hours of the year and their glare.

    Args: state: [L] of the windows in each hour with the sun up.
    """
    progress("pictures", 0.0)
    columns = np.searchsorted(light.sky.lit, hours)
    rated = []
    made = rated_pictures(light, columns, state, options=rating, progress=progress)
    for hour, (luminance, result) in zip(hours, made, strict=True):
        glare = {
            "ev": result.Ev,
            "dgp": result.dgp,
            "dgp_standard_error": result.dgp_standard_error,
            "dgp_simplified": result.sdgp,
            "dgi": result.dgi,
            "ugr": result.ugr,
            "vcp": result.vcp,
            "cgi": result.cgi,
            "sources": float(result.count),
            "background_luminance": result.background_luminance,
        }
        rated.append(LuminancePicture(hour, luminance, glare, result.labels > 0))
    progress("pictures", 1.0)
    return GlareResults(view, tuple(rated), rating.rule)


def glare_table(result: GlareResults, times: pd.DatetimeIndex) -> pd.DataFrame:
    """One row for each picture: its time and glare."""
    rows = [{"time": times[p.hour], **p.glare} for p in result.pictures]
    return pd.DataFrame(rows).set_index("time")


def band_scenes(
    building: Building,
    space: Space,
    groups: Sequence[WindowGroup],
    view: View,
    bands: Sequence[str] = COLOURS,
) -> tuple[DaylightScene, ...]:
    """The scene of a room with a view in each band."""
    return tuple(
        DaylightScene(
            furnished_surfaces(space, band),
            exterior_surfaces(building, space, band),
            groups,
            view=view,
        )
        for band in bands
    )


def brightest_picture(glare: GlareResults) -> LuminancePicture:
    """The picture with most light at the eye."""
    return max(glare.pictures, key=lambda picture: picture.glare["ev"])


def with_colour(
    glare: GlareResults,
    bands: Sequence[DaylightScene],
    systems: Sequence[States],
    sky: AnnualSky,
    *,
    state: int,
    sampling: Sampling,
    progress: Progress,
) -> GlareResults:
    """The pictures with the brightest in colour; without it where that would be grey.

    Grey too is what no window of the room's own lights.

    Args:
        bands: the room's scene with its view by red, green and blue.
        sky: of the picture's hour alone.
        state: of the shading in that hour.
    """
    shown = brightest_picture(glare)
    if not bands[0].groups or not has_colour(bands, sky, 0):
        return glare
    rgb = coloured_picture(
        shown.luminance, bands, systems, sky, 0,
        sampling=sampling, state=[state] * len(systems), progress=progress,
    )  # fmt: skip
    return replace(glare, colour=ColourPicture(shown.hour, rgb))
