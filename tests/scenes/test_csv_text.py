"""The fast writer of tables gives what pandas gives, byte for byte."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from scenes.run.outputs import csv_text

TIMES = pd.date_range("2021-01-01 00:30", periods=6, freq="h", name="time")
VALUES = [0.0, -1234567.0, 1.5e-7, np.nan, np.inf, 20.12345678]
TABLES = {
    "hours": pd.DataFrame(
        {"operative_c": VALUES, "in use": [True, False] * 3, "state": range(6)}, index=TIMES
    ),
    "words": pd.DataFrame(
        {"where": ["a", "b,c", 'd"e', "f\ng", "", None], "glass": np.float32(VALUES)}
    ),
    "one row": pd.DataFrame([{"sda": 55.0, "name, unit": "x", "none": None}]),
    "objects": pd.DataFrame({"dgp": pd.Series([0.123456789, None], dtype=object)}),
    "named": pd.DataFrame({"x": [1.0]}, index=pd.Index(["A, B"], name="room")),
    "empty": pd.DataFrame({"x": pd.Series([], dtype=float)}),
    "midnights": pd.DataFrame({"x": [1.0, 2.0]}, index=pd.date_range("2021-01-01", periods=2)),
}


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("index", [True, False])
def test_as_pandas_writes_it(name, index):
    table = TABLES[name]
    assert csv_text(table, index=index) == table.to_csv(index=index, float_format="%.6g")
