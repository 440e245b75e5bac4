"""Moves and hours of shading by group, as tables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from scenes.results import ShadingYear


def test_moves_and_hours_by_state() -> None:
    """Two days: S closes at 9 and opens at 15, N goes to state 2 once and stays."""
    south = np.tile(np.repeat([0, 1, 0], [9, 6, 9]), 2)
    north = np.repeat([0, 2], [30, 18])
    states = np.stack([south, north], axis=1)
    year = ShadingYear(("S", "N"), ("irradiance", "function"), states, np.array([0, 1]))
    occupied = np.tile((np.arange(24) >= 8) & (np.arange(24) < 18), 2)
    times = pd.date_range("2001-01-01 00:30", periods=48, freq="h")
    table = year.figures(occupied, times).set_index("group")
    assert table["moves_per_day"].tolist() == [2.0, 0.5]
    assert table["state_0_percent"].tolist() == pytest.approx([40.0, 50.0])
    assert table["state_1_percent"].tolist() == pytest.approx([60.0, 0.0])
    assert table["state_2_percent"].tolist() == pytest.approx([0.0, 50.0])
    moves = year.moves(times)
    assert moves["time"].dt.hour.tolist() == [9, 15, 6, 9, 15]
    assert moves["group"].tolist() == ["S", "S", "N", "S", "S"]
    assert moves.iloc[2].tolist()[2:] == ["function", "function", 0, 2]
    assert table["most_moves_of_a_day"].tolist() == [2, 1]
    assert year.moves_of_days(times).tolist() == [[2, 0], [2, 1]]
    later = times + pd.Timedelta(hours=12)  # begins at noon: 12 hours, a day, 12 hours
    assert year.moves_of_days(later).tolist() == [[1, 0], [2, 1], [1, 0]]
    seen = replace(year, views=(np.array([True, False]), np.array([True, False, True])))
    assert seen.figures(occupied, times)["view_h"].tolist() == [8.0, 20.0]
    by = np.full_like(states, -1)
    by[[9, 15, 33, 39], 0] = [0, 1, 0, 1]
    caused = replace(year, moved_by=by, reasons=("irradiance", "hold_h"))
    assert caused.moves(times)["moved_by"].tolist()[:3] == ["irradiance", "hold_h", "function"]
    counts = {key: of.tolist() for key, of in caused.moves_by_reason().items()}
    assert counts == {"irradiance": [2, 0], "hold_h": [2, 0], "function": [0, 1]}
