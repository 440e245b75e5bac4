"""Arrays of many things on disk until they are looked at."""

from __future__ import annotations

import errno
import gc
import os
import sys
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs import stored_arrays
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.stored_arrays import PassedArrays, StoredArrays

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="asks Linux what is in memory")


@dataclass(frozen=True)
class Thing:
    """Something with arrays of all sorts."""

    name: str
    values: np.ndarray
    table: pd.DataFrame
    by_name: dict[str, np.ndarray]


def thing(number: int) -> Thing:
    rng = np.random.default_rng(number)
    table = pd.DataFrame({"a": rng.random(2000), "b": rng.random(2000) > 0.5})
    tall = np.asfortranarray(rng.random((300, 7)))
    by_name = {"tall": tall, "small": rng.random(3), "none": np.zeros((5000, 0))}
    return Thing(f"thing {number}", rng.random((700, 3)).astype(np.float32), table, by_name)


def test_arrays_are_as_they_were_whatever_file_they_are_in(monkeypatch):
    monkeypatch.setattr(stored_arrays, "BLOCK", 30_000)
    things, store = [thing(number) for number in range(5)], StoredArrays()
    kept = PassedArrays(store, [store.stored(one) for one in things])
    del store
    gc.collect()
    assert len(kept) == 5 and [one.name for one in kept[1:3]] == ["thing 1", "thing 2"]
    for one, held in zip(things, kept, strict=True):
        np.testing.assert_array_equal(held.values, one.values)
        assert held.values.dtype == one.values.dtype
        assert not held.values.flags.owndata and not held.values.flags.writeable
        pd.testing.assert_frame_equal(held.table, one.table)
        for name, values in one.by_name.items():
            np.testing.assert_array_equal(held.by_name[name], values)


@LINUX
def test_arrays_of_which_none_are_shown_take_no_file(monkeypatch):
    """Each file is there for as long as one of its arrays."""
    monkeypatch.setattr(stored_arrays, "BLOCK", 1)  # a file for each
    one, store = thing(1), StoredArrays()
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(20):
        store.stored(one)
    gc.collect()
    assert len(os.listdir("/proc/self/fd")) <= before + 2


@LINUX
def test_what_is_passed_is_out_of_memory(monkeypatch):
    """Of 64 arrays of 1 MB no more than those of `PASSED` and of a file or two are in memory."""
    monkeypatch.setattr(stored_arrays, "BLOCK", 2**23)
    store, before = StoredArrays(), _resident()
    arrays = [store.stored(np.full(2**17, float(number))) for number in range(64)]
    written, most = _resident() - before, 0.0
    kept = PassedArrays(store, arrays)
    for number, values in enumerate(kept):
        assert values.min() == number == values.max()
        most = max(most, _resident() - before)
    left = _resident() - before
    sums = sum(float(values.sum()) for values in arrays)  # not passed: all of them stay
    assert sums == 2**17 * sum(range(64))
    assert _resident() - before > 60.0
    assert written < 12.0 and most < 24.0 and left < 2.0


def test_a_full_disk_is_said_before_anything_is_written(monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full)
    with pytest.raises(DataError, match=r"no room for results of 0\.07 GB: the disk is full"):
        StoredArrays().stored(np.zeros(1000))


def _resident() -> float:
    """Mapped pages of this process that are in memory [MB]."""
    with open("/proc/self/status") as status:
        found = dict(line.split(":", 1) for line in status)
    return sum(int(found[key].split()[0]) for key in ("RssFile", "RssShmem")) / 1024
