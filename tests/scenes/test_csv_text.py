"""The fast writer of tables gives what pandas gives, byte for byte."""

from __future__ import annotations

import csv
import io

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.files import write_table
from scenes.run.csv_text import EXPONENTS, csv_text, six_digits

TIMES = pd.date_range("2021-01-01 00:30", periods=6, freq="h", name="time")
VALUES = [0.0, -1234567.0, 1.5e-7, np.nan, 1e30, 20.12345678]
TABLES = {
    "hours": pd.DataFrame({"operative_c": VALUES, "in use": [True, False] * 3, "state": range(6)}, index=TIMES),
    "words": pd.DataFrame({"where": ["a", "b,c", 'd"e', "f\ng", "", None], "glass": np.float32(VALUES)}),
    "one row": pd.DataFrame([{"sda": 55.0, "name, unit": "x", "none": None}]),
    "objects": pd.DataFrame({"dgp": pd.Series([0.123456789, None], dtype=object)}),
    "named": pd.DataFrame({"x": [1.0]}, index=pd.Index(["A, B"], name="room")),
    "empty": pd.DataFrame({"x": pd.Series([], dtype=float)}),
    "other hours": pd.DataFrame({"x": range(6)}, index=TIMES + pd.Timedelta(hours=6)),
    "seconds": pd.DataFrame({"x": range(6)}, index=(TIMES + pd.Timedelta(seconds=7)).as_unit("s")),
    "a zone": pd.DataFrame({"x": range(6)}, index=TIMES.tz_localize("Europe/Berlin")),
    "no time": pd.DataFrame({"x": [1, 2]}, index=pd.DatetimeIndex(["2021-01-01 00:30", pd.NaT])),
    "midnights": pd.DataFrame({"x": [1.0, 2.0]}, index=pd.date_range("2021-01-01", periods=2)),
}


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("index", [True, False])
def test_as_pandas_writes_it(name, index):
    table = TABLES[name]
    assert csv_text(table, index=index) == table.to_csv(index=index, float_format="%.6g")


def test_a_spreadsheet_computes_no_name(tmp_path):
    """A space of that name would be a formula in summary.csv."""
    evil = '=HYPERLINK("http://a.b","x")'
    names = [evil, "@SUM(1)", "+cmd|x", "-1+1|x", "-5", "R-1", " =1", "\tx"]
    table = pd.DataFrame({"room": names, "lux": range(8), evil: -1.5}, index=pd.Index(names))
    write_table(table, tmp_path / "a.csv")
    for text in ((tmp_path / "a.csv").read_text(), csv_text(table)):
        rows = list(csv.reader(io.StringIO(text)))
        assert rows[0] == ["", "room", "lux", f"'{evil}"]
        quoted = [f"'{name}" if number not in (4, 5) else name for number, name in enumerate(names)]
        assert [row[1] for row in rows[1:]] == [row[0] for row in rows[1:]] == quoted
        assert {row[3] for row in rows[1:]} == {"-1.5"}
    assert table["room"].tolist() == names  # the caller's table stays


def test_six_digits_are_those_of_a_format():
    """Random numbers of all magnitudes, ties of the sixth digit, powers of ten and the numbers next to them."""
    random = np.random.default_rng(1)
    powers = 10.0 ** np.arange(-320, 308)
    digits = random.integers(1, 10**7, 4000)
    values = np.concatenate(
        [
            random.normal(size=4000) * 10.0 ** random.integers(-7, 9, 4000),
            *(digits * 10.0**exponent for exponent in EXPONENTS),  # many end in 5, and many in 0
            *(digits / 2**exponent for exponent in range(12)),  # ties without rounding
            powers,
            np.nextafter(powers, 0.0),
            np.nextafter(powers, np.inf),
            999999.5 * powers[300:340],
            [0.0, np.nan],
        ]
    )
    values = np.concatenate([values, -values])
    written = [row[row != 0].tobytes().decode() for row in six_digits(values)]
    assert written == ["" if value != value else f"{value:.6g}" for value in values.tolist()]
