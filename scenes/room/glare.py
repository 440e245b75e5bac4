"""Stage 4 of a room: glare of every hour, pictures of chosen hours, one picture in colour."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import in_month
from bim.to_tracer import band_scenes
from mitsuba_cfs.glare.annual import AnnualGlare
from mitsuba_cfs.glare.evaluation import GlareOptions
from mitsuba_cfs.matrices.cache import CacheEntry, digest
from mitsuba_cfs.methods.colour_view import coloured_picture, has_colour
from mitsuba_cfs.methods.glare import hourly_glare, rated_pictures
from mitsuba_cfs.methods.glare_map import glare_of_eyes
from mitsuba_cfs.methods.optics import States
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.methods.sun_by_patches import sunny_hour_dgp_error
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.annual import AnnualSky, annual_sky
from scenes.results import DGP_SUNNY_HOUR_ERROR, ColourPicture, GlareMap, GlareResults, LuminancePicture
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight, picture_light
from scenes.room.options import Outputs
from scenes.room.picture_hours import hour_index
from scenes.room.surface_spectra import in_stated_colours
from scenes.room.windows import RoomWindows
from scenes.room_views import eyes_of

COLUMNS = {
    "dgp": "dgp",
    "dgp_standard_error": "dgp_standard_error",
    "ev": "Ev",
    "dgi": "dgi",
    "ugr": "ugr",
    "sources": "sources",
}
MAP_SPACING = 1.0  # of the eyes of a glare map [m], at least
MAP_EYES = 64  # of a room, about: larger rooms have a wider spacing
MAP_DIRECTIONS = 8  # of view at each eye
MAP_SIZE = 16  # pixels of its views, of which no picture is made
EYE_HEIGHT = 1.2  # of a seated person above the floor [m], EN 17037
WORST = 4  # pictures of a rated year without hours asked for
DEFAULT_DAYS = ((3, 21), (6, 21), (12, 21))  # month, day
DEFAULT_CLOCK = (9, 12, 15)  # the hour that begins then, local standard time


def annual_glare(
    room: RoomInputs, light: RoomLight, state: NDArray[np.int64], *, progress: Progress = silent
) -> pd.DataFrame:
    """Glare of every hour with the shading states of that hour [H, G]; NaN in the dark."""
    rows, rating = light.states(state), rating_of(room.options.outputs)
    rated = hourly_glare(light.light, "DGP", rows, options=rating, progress=part(progress, 0.0, 1.0, "annual glare"))
    table = np.full((room.skies.hours, len(COLUMNS)), np.nan)
    table[room.skies.lit] = np.stack([getattr(rated, name) for name in COLUMNS.values()], axis=1)
    frame = pd.DataFrame(table, index=room.weather.midpoints, columns=list(COLUMNS))
    if room.options.method == "three-phase":
        error = sunny_hour_dgp_error(light.light, rated.dgp, state=rows, options=rating)
        frame[DGP_SUNNY_HOUR_ERROR] = np.where(np.isnan(table[:, 0]), np.nan, error)
    return frame.rename_axis("time")


def rated_hours(
    room: RoomInputs,
    light: RoomLight,
    state: NDArray[np.int64],
    metric: str,
    hours: NDArray[np.int64],
    *,
    progress: Progress = silent,
) -> AnnualGlare:
    """A glare metric in some hours of the year [n] with the sun up; ratings are cached on disk."""
    rating, source = rating_of(room.options.outputs), picture_light(room, light)
    columns, cached = np.searchsorted(room.skies.lit, hours), None
    if isinstance(source, PhaseLight) and light.inner is None:
        cached = cached_glare(source, room.windows, metric, columns, rating)
    return hourly_glare(
        source,
        metric,
        light.states(state),
        hours=columns,
        options=rating,
        cached=cached,
        progress=part(progress, 0.0, 1.0, "annual glare"),
    )


def rated_hours_error(
    room: RoomInputs,
    light: RoomLight,
    state: NDArray[np.int64],
    metric: str,
    hours: NDArray[np.int64],
    rated: AnnualGlare,
) -> float:
    """Root mean square error of three-phase DGP in hours with sun; 0 by another method.

    Args: as of `rated_hours`, whose result is `rated`.
    """
    return sunny_hour_dgp_error(
        light.light,
        rated.dgp,
        metric,
        light.states(state),
        hours=np.searchsorted(room.skies.lit, hours),
        options=rating_of(room.options.outputs),
    )


def glare_map(
    room: RoomInputs,
    light: RoomLight,
    state: NDArray[np.int64],
    *,
    eye_height: float = EYE_HEIGHT,
    progress: Progress = silent,
) -> tuple[GlareMap, NDArray[np.float32]]:
    """DGP over the room by direction in the hours of use, and of each of these hours [E, N, U].

    Eyes are 0.5 m or more from the walls, their directions at equal angles from that to the largest
    window.

    Args: state: [H, G] of the shading.
    """
    spacing = max(MAP_SPACING, float(np.sqrt(room.space.floor_area / MAP_EYES)))
    views = [each.view for each in eyes_of(room.space, spacing, MAP_DIRECTIONS, eye_height, MAP_SIZE)]
    eyes = np.array([view.position for view in views[::MAP_DIRECTIONS]])
    directions = np.array([view.direction for view in views[:MAP_DIRECTIONS]])
    rated = glare_of_eyes(light.light, eyes, directions, light.states(state), progress=progress)
    year = np.zeros((*rated.shape[:2], room.skies.hours), dtype=np.float32)
    year[..., room.skies.lit] = rated
    used = year[..., room.occupied]
    return GlareMap.of(eyes, directions, used, spacing=spacing, step_h=room.weather.step_h), used


def worst_hours(year: pd.DataFrame, count: int) -> list[int]:
    """The hours of the year [indices] of the highest DGP, one a day, the worst first."""
    order = np.argsort(-year["dgp"].fillna(-1).to_numpy(), kind="stable")
    chosen: list[int] = []
    days: set = set()
    for hour in order.tolist():
        day = year.index[hour].date()
        if len(chosen) >= count:
            break
        if day not in days and year["dgp"].iloc[hour] == year["dgp"].iloc[hour]:
            chosen.append(hour)
            days.add(day)
    return chosen


def cached_glare(
    light: PhaseLight, windows: RoomWindows, *inputs: object
) -> Callable[[NDArray[Any]], CacheEntry] | None:
    """Cache entry of a year of glare with each window group in a state [G]; None: no cache.

    Cases of a study with the blind up and with the blind down rate every hour; the case whose blind
    is controlled reads each hour from the case whose state holds.

    Args: inputs: what the ratings depend on besides light and windows.
    """
    matrices, sky = light.matrices, light.sky
    cache = matrices.cache
    if cache is None:
        return None
    key = digest(
        matrices.scene,
        matrices.sampling,
        matrices.five_phase,
        sky.whole,
        sky.sun,
        sky.direction,
        sky.illuminance,
        *inputs,
    )

    def entry(state: NDArray[Any]) -> CacheEntry:
        rows = zip(windows.systems, state.tolist(), strict=True)
        chosen = [systems[min(j, len(systems) - 1)] for systems, j in rows]
        optics = [[one.visible, one.fine, one.angular] for one in chosen]
        return cache.entry("year of glare", key, optics, by=hourly_glare.__module__)

    return entry


def rating_of(outputs: Outputs) -> GlareOptions:
    """The rules by which glare sources are recognised."""
    return GlareOptions(grouping=outputs.glare_sources, sun=outputs.glare_sun)


def default_hours(
    times: pd.DatetimeIndex, lit: NDArray[np.int64], eye_illuminance: NDArray[np.float32], count: int
) -> list[int]:
    """The year's brightest hour at the eye, and hours of the equinox and the solstices.

    At most `count` hours; those of the three days at 9, 12 and 15 o'clock if the sun is up.

    Args: eye_illuminance: [L] vertical illuminance at the eye in the lit hours [lx].
    """
    if count <= 0:
        return []
    moments = [datetime(2000, *day, clock) for day in DEFAULT_DAYS for clock in DEFAULT_CLOCK]
    lit_set = set(lit.tolist())
    usual = [hour for moment in moments if (hour := hour_index(moment, times)) in lit_set]
    brightest = int(lit[np.argmax(eye_illuminance)])
    chosen = {brightest, *[hour for hour in usual if hour != brightest][: count - 1]}
    return [hour for hour in dict.fromkeys([*usual, brightest]) if hour in chosen]


def room_glare(
    room: RoomInputs,
    light: RoomLight,
    state: NDArray[np.int64],
    hours: list[int],
    year: pd.DataFrame | None = None,
    *,
    progress: Progress = silent,
) -> GlareResults:
    """Pictures of hours of the year and their glare.

    Args:
        state: [H, G] of the shading.
        hours: indices; none: the worst hours of `year`, else `default_hours`.
        year: `annual_glare`.
    """
    outputs = room.options.outputs
    if not hours and not outputs.picture_count:
        return GlareResults(light.scene.view, (), rating_of(outputs).rule)
    lit_state = light.states(state)
    if not hours and year is not None:
        hours = worst_hours(year, min(WORST, outputs.picture_count))
    if not hours:
        eye = light.eye(state)
        hours = default_hours(room.weather.midpoints, room.skies.lit, eye, outputs.picture_count)
    progress("pictures", 0.0)
    columns, rating = np.searchsorted(room.skies.lit, hours), rating_of(outputs)
    made = rated_pictures(picture_light(room, light), columns, lit_state, options=rating, progress=progress)
    of_all = {}
    if room.options.method == "three-phase":
        of_all[DGP_SUNNY_HOUR_ERROR] = sunny_hour_dgp_error(
            light.light, [result.dgp for _, result in made], state=lit_state, hours=columns, options=rating
        )
    pictures = []
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
            **of_all,
        }
        pictures.append(LuminancePicture(hour, luminance, glare, result.labels > 0))
    progress("pictures", 1.0)
    return GlareResults(light.scene.view, tuple(pictures), rating.rule)


def brightest_picture(glare: GlareResults) -> LuminancePicture:
    """The picture with most light at the eye."""
    return max(glare.pictures, key=lambda picture: picture.glare["ev"])


def coloured(
    room: RoomInputs, light: RoomLight, state: NDArray[np.int64], glare: GlareResults, *, progress: Progress = silent
) -> GlareResults:
    """The pictures, with the brightest of them in colour too."""
    if not glare.pictures:
        return glare
    progress("colour", 0.0)
    hour, groups = brightest_picture(glare).hour, room.windows.groups
    building = in_month(room.building, int(room.weather.midpoints[hour].month))
    sampling = room.options.sampling
    sky = annual_sky(room.weather, sampling.subdivision, hours=[hour], **room.options.sky)
    space = in_stated_colours(room.space, () if room.operation is None else room.operation.surface)
    result = with_colour(
        glare,
        band_scenes(building, space, groups, glare.view),
        room.windows.optics_by_colour(light.light.systems[: len(groups)]),
        sky,
        state=state[hour].tolist(),
        sampling=sampling,
        progress=part(progress, 0.0, 1.0, "colour"),
    )
    progress("colour", 1.0)
    return result


def with_colour(
    glare: GlareResults,
    bands: Sequence[DaylightScene],
    systems: Sequence[Sequence[States]],
    sky: AnnualSky,
    *,
    state: Sequence[int],
    sampling: Sampling,
    progress: Progress,
) -> GlareResults:
    """The pictures with the brightest in colour; without it where that would be grey.

    A room without windows to the outdoors is taken for grey.

    Args:
        bands: the room's scene with its view by red, green and blue.
        systems: of its windows by red, green and blue [3][G][J].
        sky: of the picture's hour alone.
        state: [G] of the window groups in that hour.
    """
    shown = brightest_picture(glare)
    if not bands[0].groups or not has_colour(bands, systems, sky, 0):
        return glare
    rgb = coloured_picture(shown.luminance, bands, systems, sky, 0, sampling=sampling, state=state, progress=progress)
    return replace(glare, colour=ColourPicture(shown.hour, rgb))
