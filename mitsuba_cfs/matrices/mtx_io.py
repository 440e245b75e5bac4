"""Radiance matrix files (.mtx, .smx, .vmx): ascii, float and double, of any components.

A matrix in memory is [rows, columns, components]; Radiance's own have three components (RGB).
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from os import PathLike
from typing import Any, BinaryIO, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import reason, replacing

T = TypeVar("T", int, float)

FORMATS = {"ascii": None, "float": np.float32, "double": np.float64}
LUMINANCE_WEIGHTS = (0.265, 0.670, 0.065)  # R, G, B of Radiance; 179 lm/W makes it luminance
DEFAULT_COMPONENTS = 3  # of a header without NCOMP
MAGIC = b"#?RADIANCE"
ASCII_DIGITS = 9  # enough for a float32 to come back the same


@dataclass(frozen=True, slots=True)
class MatrixHeader:
    """Header of a Radiance matrix."""

    rows: int
    columns: int
    components: int
    format: str  # ascii, float, double
    big_endian: bool = False
    exposure: float = 1.0  # values of the file are divided by it
    lines: tuple[str, ...] = ()  # the other lines: commands and remarks


def read_matrix(path: str | PathLike[str]) -> NDArray[np.float64]:
    """The values [rows, columns, components] of a Radiance matrix file.

    Raises: `DataError` where the header lacks a size, or the data do not fit it.
    """
    try:
        with open(path, "rb") as file:
            header = read_header(file, path)
            data = file.read()
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from error
    shape = (header.rows, header.columns, header.components)
    values = _values(data, header, path)
    if values.size != np.prod(shape):
        raise DataError(
            f"expected {shape[0]} x {shape[1]} x {shape[2]} values, got {values.size}", file=path, field="data"
        )
    if not np.isfinite(values).all():
        row, column, _ = np.unravel_index(np.argmin(np.isfinite(values)), shape)
        raise DataError("is not finite", file=path, element=f"row {row}, column {column}")
    return values.reshape(shape).astype(np.float64) / header.exposure


def write_matrix(
    path: str | PathLike[str],
    matrix: ArrayLike,
    *,
    format: str = "float",
    components: int | None = None,
    lines: Iterable[str] = (),
) -> None:
    """Write [rows, columns] or [rows, columns, components] as a Radiance matrix file.

    The file appears whole or not at all.

    Args:
        format: `ascii` (nine digits), `float` or `double`, in this machine's byte order.
        components: repeat a [rows, columns] matrix so many times (Radiance's programs want 3).
        lines: more header lines, such as the command that made the matrix.

    Raises: `ValueError` for a wrong shape or format, `DataError` where it cannot be written.
    """
    values = np.asarray(matrix)
    if not np.issubdtype(values.dtype, np.floating):
        values = values.astype(float)
    if values.ndim == 2:
        count = 1 if components is None else components
        values = np.broadcast_to(values[:, :, None], (*values.shape, count))
    elif values.ndim != 3 or components not in (None, values.shape[-1]):
        raise ValueError(f"expected [rows, columns(, {components or 'any'})], got {values.shape}")
    if format not in FORMATS:
        raise ValueError(f"format: expected one of {tuple(FORMATS)}, got {format!r}")
    lines = [line.strip() for line in lines]
    if any("\n" in line or not line for line in lines):
        raise ValueError("header lines must be single lines with text")
    rows, columns, count = values.shape
    head = [*lines, f"NROWS={rows}", f"NCOLS={columns}", f"NCOMP={count}"]
    if FORMATS[format] is not None:
        head.append(f"BigEndian={int(sys.byteorder == 'big')}")
    text = "\n".join([MAGIC.decode(), *head, f"FORMAT={format}", "", ""])
    with replacing(path) as part, open(part, "wb") as file:
        file.write(text.encode("utf-8"))
        _write_values(file, values, FORMATS[format])


def luminance(matrix: ArrayLike, weights: tuple[float, float, float] = LUMINANCE_WEIGHTS) -> NDArray[np.float64]:
    """Weighted sum [rows, columns] of three components, or the only one."""
    matrix = np.asarray(matrix, dtype=float)
    if matrix.ndim != 3 or matrix.shape[-1] not in (1, 3):
        raise ValueError(f"expected [rows, columns, 1 or 3], got {matrix.shape}")
    return matrix[..., 0] if matrix.shape[-1] == 1 else matrix @ np.array(weights)


def read_header(file: BinaryIO, path: str | PathLike[str]) -> MatrixHeader:
    """Read the header of a Radiance matrix file up to its data."""
    if not file.readline().startswith(b"#?"):
        raise DataError("is not a Radiance matrix: expected a first line #?RADIANCE", file=path)
    fields: dict[str, str] = {}
    others, exposure = [], 1.0
    for line in file:
        text = line.decode("utf-8", errors="replace").rstrip("\r\n")
        if not text.strip():
            break
        key, sign, value = text.partition("=")
        if sign and key in ("NROWS", "NCOLS", "NCOMP", "FORMAT", "BigEndian"):
            fields[key] = value.strip()
        elif sign and key == "EXPOSURE":
            exposure *= _positive(value, float, path, key)
        else:
            others.append(text)
    else:
        raise DataError("ends within its header", file=path)
    for key in ("NROWS", "NCOLS", "FORMAT"):
        if key not in fields:
            raise DataError("missing from the header", file=path, field=key)
    if fields["FORMAT"] not in FORMATS:
        raise DataError(
            f"expected ascii, float or double, got {fields['FORMAT']} (`rmtxop -ff` of Radiance converts it)",
            file=path,
            field="FORMAT",
        )
    return MatrixHeader(
        rows=_positive(fields["NROWS"], int, path, "NROWS"),
        columns=_positive(fields["NCOLS"], int, path, "NCOLS"),
        components=_positive(fields.get("NCOMP", DEFAULT_COMPONENTS), int, path, "NCOMP"),
        format=fields["FORMAT"],
        big_endian=fields.get("BigEndian", "0") == "1",
        exposure=exposure,
        lines=tuple(others),
    )


def _positive(text: str | int, kind: type[T], path: str | PathLike[str], field: str) -> T:
    try:
        value = kind(text)
    except ValueError:
        value = kind(0)
    if not 0 < value < float("inf"):
        raise DataError(f"expected a positive number, got {text!r}", file=path, field=field)
    return value


def _values(data: bytes, header: MatrixHeader, path: str | PathLike[str]) -> NDArray[Any]:
    if header.format == "ascii":
        try:
            return np.array(data.split(), dtype=float)
        except ValueError as error:
            raise DataError(f"expected numbers: {error}", file=path, field="data") from error
    kind = np.dtype(FORMATS[header.format]).newbyteorder(">" if header.big_endian else "<")
    if len(data) % kind.itemsize:
        raise DataError("ends within a number", file=path, field="data")
    return np.frombuffer(data, dtype=kind)


def _write_values(file: BinaryIO, values: NDArray[np.float64], kind: type | None) -> None:
    for row in values:  # [columns, components]: a row at a time bounds the memory
        if kind is not None:
            file.write(np.ascontiguousarray(row, dtype=kind).tobytes())
            continue
        pattern = "\t".join([" ".join([f"%.{ASCII_DIGITS}g"] * row.shape[1])] * row.shape[0])
        file.write((pattern % tuple(row.ravel()) + "\n").encode("ascii"))
