"""Moves and hours of shading by group, as tables."""

from __future__ import annotations

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
    table = year.figures(occupied, 24).set_index("group")
    assert table["moves_per_day"].tolist() == [2.0, 0.5]
    assert table["state_0_percent"].tolist() == pytest.approx([40.0, 50.0])
    assert table["state_1_percent"].tolist() == pytest.approx([60.0, 0.0])
    assert table["state_2_percent"].tolist() == pytest.approx([0.0, 50.0])
    times = pd.date_range("2001-01-01 00:30", periods=48, freq="h")
    moves = year.moves(times)
    assert moves["time"].dt.hour.tolist() == [9, 15, 6, 9, 15]
    assert moves["group"].tolist() == ["S", "S", "N", "S", "S"]
    assert moves.iloc[2].tolist()[2:] == ["function", 0, 2]
