"""Hours of a year given as "MM-DD HH" or "MM-DD HH:MM"."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.errors import CfsError

FORMS = ("%Y-%m-%d %H", "%Y-%m-%d %H:%M")


class PictureHourError(CfsError, ValueError):
    """An hour that the year does not contain, or with the sun below the horizon."""


def wanted_hours(wanted: tuple[str, ...], times: pd.DatetimeIndex, lit: NDArray[np.int64]) -> list[int]:
    """Indices of the hours of the year that `cfs run --picture` names.

    Args:
        wanted: texts, see `hour_of`.
        times: [H] middles of the hours; lit: [L] hours with the sun up.
    """
    hours, lit_set = [hour_of(text, times, "--picture") for text in wanted], set(lit.tolist())
    for text, hour in zip(wanted, hours, strict=True):
        if hour not in lit_set:
            raise PictureHourError(f"--picture {text!r}: the sun is below the horizon then")
    return hours


def check_hours(wanted: tuple[str, ...], times: pd.DatetimeIndex | None = None) -> None:
    """Raise `PictureHourError` for a text that is no hour, or no hour of `times`.

    The position of the sun takes longer to compute and is checked by `wanted_hours`.
    """
    for text in wanted:
        if times is None:
            _moment(text, "--picture")
        else:
            hour_of(text, times, "--picture")


def hour_of(text: str, times: pd.DatetimeIndex, flag: str) -> int:
    """The index of the hour that contains a month, day and time of day.

    Args: times: [H] middles of the hours; flag: option that gave the text.
    """
    hour = hour_index(_moment(text, flag), times)
    if hour is None:
        raise PictureHourError(f"{flag} {text!r}: the weather has no such hour")
    return hour


def hour_index(moment: datetime, times: pd.DatetimeIndex) -> int | None:
    """The index of the hour that contains a moment of any year; None without such an hour."""
    same_day = (times.month == moment.month) & (times.day == moment.day)
    hours = np.flatnonzero(same_day & (times.hour == moment.hour))
    return int(hours[0]) if len(hours) else None


def _moment(text: str, flag: str) -> datetime:
    for form in FORMS:
        try:
            return datetime.strptime(f"2000-{text}", form)  # a leap year
        except ValueError:
            continue
    raise PictureHourError(f"{flag} {text!r}: expected month, day and hour, as '06-21 12' or '06-21 12:30'")
