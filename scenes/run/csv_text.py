"""Tables as CSV text: columns of characters, which are made and joined as arrays.

Axes: N rows, L characters of a column's widest entry; unused characters are 0.
"""

from __future__ import annotations

import csv
import io
from functools import lru_cache

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.files import check_finite, without_formulas

Characters = NDArray[np.uint8]

DIGITS = "%.6g"
EXPONENTS = range(-4, 6)  # of numbers that `DIGITS` writes without an exponent
POWERS = np.array([float(f"1e{exponent}") for exponent in EXPONENTS])
SCALES = np.array([float(f"1e{5 - exponent}") for exponent in EXPONENTS])  # to six digits before the point
NEAR_A_HALF = 1e-8  # of the sixth digit: more than the product with its scale is off
ZERO, POINT, MINUS = map(ord, "0.-")
WIDTH = len("-0.000123457")
_THOUSAND = np.array([list(f"{number:03d}\0".encode()) for number in range(1000)], dtype=np.uint8).view(np.uint32)[:, 0]
_ENDING_ZEROS = np.array([3, *((number % 10 == 0) + (number % 100 == 0) for number in range(1, 1000))])
_BOOLS = np.array([b"False", b"True"])


def csv_text(table: pd.DataFrame, *, index: bool = True) -> str:
    """What `table.to_csv(float_format="%.6g")` gives of a table `without_formulas`."""
    check_finite(table)
    table = without_formulas(table)
    columns = [_entries(table.iloc[:, k]) for k in range(table.shape[1])]
    names = list(map(str, table.columns))
    if index:
        columns.insert(0, _rows(table.index))
        names.insert(0, "" if table.index.name is None else str(table.index.name))
    if len(columns) == 1:  # an empty line would be no row
        columns = [_quoted_where_empty(columns[0])]
    head = io.StringIO()
    csv.writer(head, lineterminator="\n").writerow(names)
    return head.getvalue() + _joined(columns, len(table))


def _joined(columns: list[Characters], rows: int) -> str:
    """The rows of the columns, with commas between their entries."""
    commas, ends = (np.full((rows, 1), ord(sign), dtype=np.uint8) for sign in ",\n")
    parts = [part for column in columns for part in (column, commas)][:-1]
    characters = np.concatenate([*parts, ends], axis=1) if parts else ends
    return characters.tobytes().translate(None, b"\0").decode()


def _quoted_where_empty(column: Characters) -> Characters:
    empty = ~column.any(axis=1, keepdims=True)
    return np.concatenate([column, np.where(empty, ord('"'), np.zeros(2, dtype=np.uint8))], axis=1, dtype=np.uint8)


def _entries(values: pd.Series) -> Characters:
    """The entries of a column [N, L]."""
    if values.dtype == bool:
        return _characters(_BOOLS[values.to_numpy().astype(int)])
    if values.dtype.kind != "f":
        return _of_text(values.to_frame())
    return six_digits(values.to_numpy(float))


def six_digits(values: NDArray[np.float64]) -> Characters:
    """Numbers [N] as `"%.6g"` writes them [N, L]; NaN is empty."""
    size = np.abs(values)
    which = np.clip(np.searchsorted(POWERS, size, side="right") - 1, 0, len(POWERS) - 1)
    scaled = np.where((size >= POWERS[0]) & (size < 10 * POWERS[-1]), size * SCALES[which], 0.0)
    whole = np.rint(scaled).astype(np.int64)
    carried = whole == 1_000_000
    whole[carried], which[carried] = 100_000, which[carried] + 1
    plain = (whole > 0) & (which < len(POWERS)) & (np.abs(np.abs(scaled - np.floor(scaled)) - 0.5) > NEAR_A_HALF)
    entries = np.zeros((len(values), WIDTH), dtype=np.uint8)
    for number, exponent in enumerate(EXPONENTS):
        rows = np.flatnonzero(plain & (which == number))
        if len(rows):
            entries[rows, 1:] = _without_exponent(whole[rows], exponent)
    entries[plain & (values < 0.0), 0] = MINUS
    entries[values == 0.0, 1] = ZERO
    entries[(values == 0.0) & np.signbit(values), 0] = MINUS
    others = np.flatnonzero(~plain & (size > 0.0))
    if len(others):
        texts = _characters(np.array([(DIGITS % value).encode() for value in values[others].tolist()]))
        entries = np.pad(entries, ((0, 0), (0, max(texts.shape[1] - WIDTH, 0))))
        entries[others, : texts.shape[1]] = texts
    return entries


def _without_exponent(whole: NDArray[np.int64], exponent: int) -> Characters:
    """Numbers from their six digits [N], the first of which counts that power of ten [N, WIDTH - 1]."""
    high, low = whole // 1000, whole % 1000
    digits = np.stack([_THOUSAND[high], _THOUSAND[low]], axis=1).view(np.uint8)[:, [0, 1, 2, 4, 5, 6]]
    significant = 6 - np.where(low > 0, _ENDING_ZEROS[low], 3 + _ENDING_ZEROS[high])
    before = max(exponent + 1, 0)  # digits before the point
    digits[np.arange(6) >= np.maximum(significant, before)[:, None]] = 0
    entries = np.zeros((len(whole), WIDTH - 1), dtype=np.uint8)
    if before:
        entries[:, :before] = digits[:, :before]
        entries[:, before] = np.where(significant > before, POINT, 0)
        entries[:, before + 1 : 7] = digits[:, before:]
    else:
        entries[:, : 1 - exponent] = [ZERO, POINT, *[ZERO] * (-exponent - 1)]
        entries[:, 1 - exponent : 7 - exponent] = digits
    return entries


def _rows(index: pd.Index) -> Characters:
    """The entries of a table's index."""
    if isinstance(index.dtype, np.dtype) and index.dtype.kind == "M":
        return _times(index.to_numpy().tobytes(), index.dtype.str)
    return _of_text(index.to_frame())


@lru_cache(maxsize=2)  # the tables of a run have one index
def _times(values: bytes, dtype: str) -> Characters:
    """Times as entries, from the bytes of an array."""
    return _of_text(pd.DataFrame({"time": np.frombuffer(values, dtype=dtype)}))


def _of_text(column: pd.DataFrame) -> Characters:
    """A column of anything but numbers with a point, by pandas itself."""
    # a second column, as pandas quotes an empty field that is alone; an end that no text holds
    beside = column.assign(**{"": 0})
    text = beside.to_csv(header=False, index=False, lineterminator="\0\n", float_format=DIGITS)
    return _characters(np.array([line.encode() for line in text.split(",0\0\n")[:-1]], dtype=bytes))


def _characters(texts: NDArray[np.bytes_]) -> Characters:
    """Texts [N] as characters [N, L]."""
    return texts.view(np.uint8).reshape(len(texts), texts.itemsize)
