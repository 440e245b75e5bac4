"""The hours that pictures are asked for: one way to say them, for every command."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from scenes.room.picture_hours import PictureHourError, check_hours, hour_of, wanted_hours

YEAR = pd.date_range("2021-01-01 00:30", periods=8760, freq="h")
NOON = (31 + 28 + 31 + 30 + 31 + 20) * 24 + 12  # of 21 June


@pytest.mark.parametrize("text", ["06-21 12", "06-21 12:00", "06-21 12:59", "6-21 12"])
def test_an_hour_is_said_with_or_without_minutes(text: str) -> None:
    assert hour_of(text, YEAR, "--at") == NOON
    assert wanted_hours((text,), YEAR, np.array([NOON])) == [NOON]


@pytest.mark.parametrize("text", ["noon", "06-31 12", "06-21", "06-21 24", "06-21T12", "06-21 12:60"])
def test_what_is_no_hour_is_refused_by_its_flag(text: str) -> None:
    with pytest.raises(PictureHourError, match=f"--at '{text}': expected month, day and hour"):
        hour_of(text, YEAR, "--at")
    with pytest.raises(PictureHourError, match="--picture"):
        check_hours((text,))


def test_a_day_that_the_year_has_not_is_said() -> None:
    with pytest.raises(PictureHourError, match="no such hour"):
        check_hours(("02-29 12",), YEAR)
    check_hours(("02-29 12",))
