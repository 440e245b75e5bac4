"""Fisheye pictures of a room at chosen hours, and their glare."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.errors import CfsError
from mitsuba_cfs.glare.evaluation import evaluate
from mitsuba_cfs.glare.glare_view import GlareView
from mitsuba_cfs.progress import Progress
from scenes.job.pictures import PictureMaker
from scenes.results import GlareResults, LuminancePicture

DEFAULT_DAYS = ("03-21", "06-21", "12-21")
DEFAULT_CLOCK = (9, 12, 15)  # the hour that begins then, local standard time


class PictureHourError(CfsError, ValueError):
    """An hour asked for that the year does not have, or when the sun is down."""


def wanted_hours(
    wanted: tuple[str, ...], times: pd.DatetimeIndex, lit: NDArray[np.int64]
) -> list[int]:
    """Hours of the year [indices] that were asked for.

    Args:
        wanted: "MM-DD HH": the hour that begins then.
        times: [H] middles of the hours; lit: [L] hours with the sun up.
    """
    return [_hour(text, times, set(lit.tolist())) for text in wanted]


def default_hours(
    times: pd.DatetimeIndex,
    lit: NDArray[np.int64],
    eye_illuminance: NDArray[np.float32],
    count: int,
) -> list[int]:
    """The hour of the year that is brightest at the eye, and with it up to `count` of the equinox
    and the solstices at 9, 12 and 15 o'clock, as far as the sun is up.

    Args: eye_illuminance: [L] vertical illuminance at the eye in the lit hours [lx].
    """
    labels = [f"{day} {clock:02d}" for day in DEFAULT_DAYS for clock in DEFAULT_CLOCK]
    lit_set = set(lit.tolist())
    found = [hour for label in labels if (hour := _find(label, times)) in lit_set]
    brightest = int(lit[np.argmax(eye_illuminance)])
    chosen = {brightest, *[hour for hour in found if hour != brightest][: count - 1]}
    return [hour for hour in dict.fromkeys([*found, brightest]) if hour in chosen]


def _hour(text: str, times: pd.DatetimeIndex, lit: set[int]) -> int:
    if not re.fullmatch(r"\d\d-\d\d \d\d", text):
        raise PictureHourError(f"--picture {text!r}: expected month, day and hour as in '06-21 12'")
    hour = _find(text, times)
    if hour is None:
        raise PictureHourError(f"--picture {text!r}: the weather has no such hour")
    if hour not in lit:
        raise PictureHourError(f"--picture {text!r}: the sun is below the horizon then")
    return hour


def _find(text: str, times: pd.DatetimeIndex) -> int | None:
    found = np.flatnonzero(times.strftime("%m-%d %H") == text)
    return int(found[0]) if len(found) else None


def room_glare(maker: PictureMaker, hours: list[int], progress: Progress) -> GlareResults:
    """Pictures of the chosen hours of the year and their glare."""
    progress("pictures", 0.0)
    columns = np.searchsorted(maker.skies.lit, hours)
    view = maker.scene.view
    pictures = maker.of_hours(columns, progress)
    geometry = GlareView(view)
    rated = []
    for hour, luminance in zip(hours, pictures, strict=True):
        result = evaluate(luminance, geometry)
        glare = {
            "ev": result.Ev,
            "dgp": result.dgp,
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
    return GlareResults(view, tuple(rated))


def glare_table(result: GlareResults, times: pd.DatetimeIndex) -> pd.DataFrame:
    """One row for each picture: its time and glare."""
    rows = [{"time": times[p.hour], **p.glare} for p in result.pictures]
    return pd.DataFrame(rows).set_index("time")
