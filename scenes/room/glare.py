"""Fisheye pictures of a room at chosen hours, and their glare."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.glare.evaluation import GlareOptions
from mitsuba_cfs.images.view import View
from mitsuba_cfs.methods.glare import rated_pictures
from mitsuba_cfs.methods.path_light import PathLight
from mitsuba_cfs.methods.phase_light import PhaseLight
from mitsuba_cfs.methods.seasonal_light import SeasonalLight
from mitsuba_cfs.progress import Progress
from scenes.results import GlareResults, LuminancePicture
from scenes.room.options import Outputs
from scenes.room.picture_hours import hour_index

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
