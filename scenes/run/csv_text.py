"""Tables as CSV with six significant digits, in less than half the time that pandas takes.

A year of a room's temperatures has 200,000 numbers; pandas formats each by itself.
"""

from __future__ import annotations

import csv
import io

import pandas as pd

DIGITS = "%.6g"


def csv_text(table: pd.DataFrame, *, index: bool = True) -> str:
    """What `table.to_csv(float_format="%.6g")` gives, byte for byte."""
    columns = [_texts(table.iloc[:, k]) for k in range(table.shape[1])]
    names = list(map(str, table.columns))
    if index:
        columns.insert(0, _lines(table.index.to_frame()))
        names.insert(0, "" if table.index.name is None else str(table.index.name))
    if len(columns) == 1:  # an empty line would be no row
        columns = [[text or '""' for text in columns[0]]]
    head = io.StringIO()
    csv.writer(head, lineterminator="\n").writerow(names)
    return head.getvalue() + "".join(f"{','.join(row)}\n" for row in zip(*columns, strict=True))


def _texts(values: pd.Series) -> list[str]:
    """A column's entries as they stand in the file."""
    if values.dtype.kind != "f":
        return _lines(values.to_frame())
    lines = (f"{DIGITS}\n" * len(values)) % tuple(values.tolist())
    return ["" if text == "nan" else text for text in lines.splitlines()]


def _lines(column: pd.DataFrame) -> list[str]:
    """A column of anything but numbers with a point, by pandas itself."""
    # a second column, as pandas quotes an empty field that is alone; an end that no text holds
    beside = column.assign(**{"": 0})
    text = beside.to_csv(header=False, index=False, lineterminator="\0\n", float_format=DIGITS)
    return text.split(",0\0\n")[:-1]
