"""The hours of a year that pictures are asked for, as "MM-DD HH" or "MM-DD HH:MM"."""

from __future__ import annotations

from datetime import datetime

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.errors import CfsError

FORMS = ("%Y-%m-%d %H", "%Y-%m-%d %H:%M")


class PictureHourError(CfsError, ValueError):
    """An hour asked for that the year does not have, or when the sun is down."""


def wanted_hours(
    wanted: tuple[str, ...], times: pd.DatetimeIndex, lit: NDArray[np.int64]
) -> list[int]:
    """Hours of the year [indices] that `cfs run --picture` asked for.

    Args:
        wanted: as of `hour_of`.
        times: [H] middles of the hours; lit: [L] hours with the sun up.
    """
    hours, lit_set = [hour_of(text, times, "--picture") for text in wanted], set(lit.tolist())
    for text, hour in zip(wanted, hours, strict=True):
        if hour not in lit_set:
            raise PictureHourError(f"--picture {text!r}: the sun is below the horizon then")
    return hours


def check_hours(wanted: tuple[str, ...], times: pd.DatetimeIndex | None = None) -> None:
    """Raise `PictureHourError` for a text that is no hour, or none of the year where it is given.

    Where the sun is then is another matter, and takes longer to know.
    """
    for text in wanted:
        if times is None:
            _moment(text, "--picture")
        else:
            hour_of(text, times, "--picture")


def hour_of(text: str, times: pd.DatetimeIndex, flag: str) -> int:
    """The index of the hour that holds a month, day and time of day.

    Args: times: [H] middles of the hours; flag: what the text was given by.
    """
    found = hour_index(_moment(text, flag), times)
    if found is None:
        raise PictureHourError(f"{flag} {text!r}: the weather has no such hour")
    return found


def hour_index(moment: datetime, times: pd.DatetimeIndex) -> int | None:
    """The index of the hour that holds a moment of any year; None where the year has none."""
    same_day = (times.month == moment.month) & (times.day == moment.day)
    found = np.flatnonzero(same_day & (times.hour == moment.hour))
    return int(found[0]) if len(found) else None


def _moment(text: str, flag: str) -> datetime:
    for form in FORMS:
        try:
            return datetime.strptime(f"2000-{text}", form)  # a leap year
        except ValueError:
            continue
    raise PictureHourError(
        f"{flag} {text!r}: expected month, day and hour, as '06-21 12' or '06-21 12:30'"
    )
