"""Archives of arrays as of `np.savez`, in which arrays that are mostly zeros take little space and time.

Matrices of windows and patches are 75 to 99 % zeros. Of such an array the archive holds its shape,
one bit for each entry, and the entries that are not 0, all compressed: that is three times as fast as
compressing the zeros, and smaller. Other arrays shrink little by compression, which takes ten times
as long as writing them.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from os import PathLike
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

WHOLE, SPARSE = ".npy", ".sparse"  # endings of the names in the archive
SPARSE_TYPES = (np.float64, np.float32, np.int8)


class ArrayArchive(Mapping[str, NDArray[Any]]):
    """The arrays of an archive by name, each read when it is asked for."""

    def __init__(self, archive: zipfile.ZipFile) -> None:
        """Of an open archive."""
        self._archive = archive
        names = archive.namelist()
        self._sparse = {name.removesuffix(WHOLE).removesuffix(SPARSE): name.endswith(SPARSE) for name in names}

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Read an array.

        Raises: `KeyError` where there is none; one of `mitsuba_cfs.matrices.cache.UNREADABLE` for damage.
        """
        sparse = self._sparse[name]
        with self._archive.open(name + (SPARSE if sparse else WHOLE)) as stream:
            array: NDArray[Any] = _read_sparse(stream) if sparse else npy.read_array(stream, allow_pickle=False)
        return array

    def __iter__(self) -> Iterator[str]:
        """The names of the arrays."""
        return iter(self._sparse)

    def __len__(self) -> int:
        """How many arrays there are."""
        return len(self._sparse)


@contextmanager
def opened_archive(path: str | PathLike[str]) -> Iterator[ArrayArchive]:
    """An archive's arrays while it is open."""
    with zipfile.ZipFile(path) as archive:
        yield ArrayArchive(archive)


def write_archive(path: str | PathLike[str], arrays: Mapping[str, object]) -> None:
    """Write arrays by name; the file is the same for the same arrays."""
    with zipfile.ZipFile(path, "w", compresslevel=1) as archive:
        for name, value in arrays.items():
            array = np.asarray(value, order="C")
            filled = _filled(array)
            archive.compression = zipfile.ZIP_STORED if filled is None else zipfile.ZIP_DEFLATED
            with archive.open(name + (WHOLE if filled is None else SPARSE), "w", force_zip64=True) as stream:
                if filled is None:
                    _write_whole(stream, array)
                else:
                    for part in (np.array(array.shape, int), np.packbits(filled), array.reshape(-1)[filled]):
                        _write_whole(stream, part)


def _filled(array: NDArray[Any]) -> NDArray[np.bool_] | None:
    """Which entries are not 0 [n], of arrays that are mostly zeros or hold bytes with a sign; None for others.

    The latter say which hours see a point. -0.0 counts as filled, so that it comes back, but is a zero too.
    """
    if array.dtype not in SPARSE_TYPES:
        return None
    filled: NDArray[np.bool_] = array.reshape(-1).view(f"u{array.itemsize}") != 0
    half = (array.size + 1) // 2
    sparse = array.dtype == np.int8 or np.count_nonzero(filled) < half or np.count_nonzero(array) < half
    return filled if sparse else None


def _write_whole(stream: IO[bytes], array: NDArray[Any]) -> None:
    """An array in the format of `.npy`, its bytes at once and not copied."""
    npy.write_array_header_1_0(stream, npy.header_data_from_array_1_0(array))
    stream.write(array.reshape(-1).view(np.uint8).data)


def _read_sparse(stream: IO[bytes]) -> NDArray[Any]:
    shape, bits, values = (npy.read_array(stream, allow_pickle=False) for _ in range(3))
    array = np.zeros(shape, dtype=values.dtype)
    array.reshape(-1)[np.unpackbits(bits, count=array.size).view(np.bool_)] = values
    return array
