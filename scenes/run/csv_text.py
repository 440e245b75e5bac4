"""Tables as CSV with six significant digits, in less than half the time that pandas takes.

A year of a room's temperatures has 200,000 numbers; pandas formats each by itself.
"""

from __future__ import annotations

import csv
import io
from itertools import chain

import pandas as pd

from mitsuba_cfs.files import without_formulas

DIGITS = "%.6g"


def csv_text(table: pd.DataFrame, *, index: bool = True) -> str:
    """What `table.to_csv(float_format="%.6g")` gives of a table `without_formulas`."""
    table = without_formulas(table)
    columns = [_entries(table.iloc[:, k]) for k in range(table.shape[1])]
    names = list(map(str, table.columns))
    if index:
        columns.insert(0, ("%s", _lines(table.index.to_frame())))
        names.insert(0, "" if table.index.name is None else str(table.index.name))
    if len(columns) == 1 and columns[0][0] == "%s":  # an empty line would be no row
        columns = [("%s", [text or '""' for text in columns[0][1]])]
    head = io.StringIO()
    csv.writer(head, lineterminator="\n").writerow(names)
    row = ",".join(form for form, _ in columns) + "\n"
    entries = chain.from_iterable(zip(*(values for _, values in columns), strict=True))
    return head.getvalue() + (row * len(table)) % tuple(entries)  # all at once, in C


def _entries(values: pd.Series) -> tuple[str, list]:
    """A column's entries, and how each is written."""
    if values.dtype == bool:
        return "%s", values.tolist()
    if values.dtype.kind != "f":
        return "%s", _lines(values.to_frame())
    if not values.hasnans:
        return DIGITS, values.tolist()
    return "%s", ["" if value != value else DIGITS % value for value in values.tolist()]


def _lines(column: pd.DataFrame) -> list[str]:
    """A column of anything but numbers with a point, by pandas itself."""
    # a second column, as pandas quotes an empty field that is alone; an end that no text holds
    beside = column.assign(**{"": 0})
    text = beside.to_csv(header=False, index=False, lineterminator="\0\n", float_format=DIGITS)
    return text.split(",0\0\n")[:-1]
