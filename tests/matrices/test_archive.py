"""Archives of arrays: each array comes back as it was, and zeros take little space."""

from __future__ import annotations

import zlib

import numpy as np
import pytest

from mitsuba_cfs.matrices.archive import opened_archive, write_archive
from mitsuba_cfs.matrices.cache import UNREADABLE


def few(shape, kind) -> np.ndarray:
    """An array in which every ninth entry is not 0."""
    array = np.zeros(shape, dtype=kind)
    array.reshape(-1)[::9] = np.linspace(1, 99, array.reshape(-1)[::9].size)
    return array


ARRAYS = {
    "mostly zeros": few((7, 11, 13), float),
    "single precision": few((50, 3), np.float32),
    "bytes": few((40, 9), np.int8),
    "full bytes": np.full(30, -3, dtype=np.int8),
    "zeros": np.zeros((4, 5)),
    "repeated": np.broadcast_to(0.0, (4, 5)),
    "signs and gaps": np.array([0.0, -0.0, np.nan, 0.0, 0.0, np.inf, 0.0]),
    "dense": np.linspace(0.1, 1.0, 60).reshape(3, 20),
    "by columns": np.asfortranarray(few((8, 9), float)),
    "every other": np.arange(40.0).reshape(5, 8)[:, ::2],
    "number": np.int64(3),
    "zero": np.float64(0.0),
    "none": np.empty((0, 3)),
    "truth": np.array([True, False]),
    "text": np.array(["a", "bc"]),
    "3 numbered": np.arange(4, dtype=np.uint32),
}


def test_arrays_come_back_to_the_last_bit(tmp_path):
    write_archive(tmp_path / "a.npz", ARRAYS)
    with opened_archive(tmp_path / "a.npz") as data:
        stored = {name: data[name] for name in data}
        assert len(data) == len(ARRAYS) and "other" not in data
        with pytest.raises(KeyError):
            data["other"]
    assert list(stored) == list(ARRAYS)
    for name, value in ARRAYS.items():
        expected = np.asarray(value)
        assert stored[name].shape == expected.shape and stored[name].dtype == expected.dtype, name
        assert stored[name].tobytes() == expected.tobytes(), name


def test_zeros_take_less_space_than_compressed(tmp_path):
    array = np.zeros((40, 145, 146), dtype=np.float32)
    array[::3, ::7, ::5] = np.linspace(0.1, 0.9, array[::3, ::7, ::5].size).reshape(array[::3, ::7, ::5].shape)
    write_archive(tmp_path / "a.npz", {"cells": array})
    assert (tmp_path / "a.npz").stat().st_size < 0.9 * len(zlib.compress(array.tobytes(), 1))


def test_negative_zeros_take_little_space_too(tmp_path):
    """Normals along the axes, which come from a product with -1."""
    normals = -np.tile(np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]], dtype=np.float32), (5000, 1))
    write_archive(tmp_path / "a.npz", {"normals": normals})
    assert (tmp_path / "a.npz").stat().st_size < normals.nbytes / 20
    with opened_archive(tmp_path / "a.npz") as data:
        assert data["normals"].tobytes() == normals.tobytes()


@pytest.mark.parametrize("name", ["mostly zeros", "dense", "bytes"])
def test_each_wrong_byte_is_an_error_or_harmless(tmp_path, name):
    file = tmp_path / "a.npz"
    write_archive(file, {"a": ARRAYS[name]})
    content = file.read_bytes()
    for place in range(0, len(content), 3):
        damaged = bytearray(content)
        damaged[place] ^= 0x55
        file.write_bytes(damaged)
        try:
            with opened_archive(file) as data:
                stored = data["a"]
        except UNREADABLE:
            continue
        assert stored.tobytes() == ARRAYS[name].tobytes(), place
