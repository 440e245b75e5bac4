"""The hours of a year that pictures are asked for, as "MM-DD HH"."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.errors import CfsError


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
    check_hours(wanted, times)
    return [_hour(text, times, set(lit.tolist())) for text in wanted]


def check_hours(wanted: tuple[str, ...], times: pd.DatetimeIndex | None = None) -> None:
    """Raise `PictureHourError` for a text that is no hour, or none of the year where it is given.

    Where the sun is then is another matter, and takes longer to know.
    """
    for text in wanted:
        if not re.fullmatch(r"\d\d-\d\d \d\d", text):
            message = f"--picture {text!r}: expected month, day and hour as in '06-21 12'"
            raise PictureHourError(message)
        if times is not None and hour_index(text, times) is None:
            raise PictureHourError(f"--picture {text!r}: the weather has no such hour")


def hour_index(text: str, times: pd.DatetimeIndex) -> int | None:
    """The index of the hour that begins then; None where the year has no such hour."""
    found = np.flatnonzero(times.strftime("%m-%d %H") == text)
    return int(found[0]) if len(found) else None


def _hour(text: str, times: pd.DatetimeIndex, lit: set[int]) -> int:
    hour = hour_index(text, times)
    if hour is None or hour not in lit:
        raise PictureHourError(f"--picture {text!r}: the sun is below the horizon then")
    return hour
