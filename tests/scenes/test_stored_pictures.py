"""Pictures of a building's rooms on disk, and rooms' files written beside each other."""

from __future__ import annotations

import errno
import gc
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mitsuba_cfs.errors import DataError
from scenes.result_folder import ResultFolder
from scenes.run import outputs, stored_pictures
from scenes.run.stored_pictures import StoredPictures
from tests.report.synthetic import run_result


def test_pictures_are_as_they_were_whatever_file_they_are_in(monkeypatch):
    monkeypatch.setattr(stored_pictures, "BLOCK", 30_000)  # two pictures of 60 x 60
    rooms, store = run_result(picture_size=60).spaces, StoredPictures()
    kept = [store.kept(room) for room in rooms]
    del store
    gc.collect()
    assert all(room.glare.pictures for room in rooms)
    assert any(room.glare.colour is not None for room in rooms)
    for room, held in zip(rooms, kept, strict=True):
        for picture, shown in zip(room.glare.pictures, held.glare.pictures, strict=True):
            np.testing.assert_array_equal(shown.luminance, picture.luminance)
            assert shown.luminance.dtype == picture.luminance.dtype
            assert not shown.luminance.flags.owndata
            np.testing.assert_array_equal(shown.source_mask, picture.source_mask)
        if room.glare.colour is not None:
            np.testing.assert_array_equal(held.glare.colour.radiance, room.glare.colour.radiance)


def test_pictures_of_which_none_are_shown_take_no_file(monkeypatch):
    """Each file is there for as long as one of its pictures."""
    monkeypatch.setattr(stored_pictures, "BLOCK", 1)  # a file for each
    (room, *_), store = run_result(picture_size=60).spaces, StoredPictures()
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(20):
        store.kept(room)
    assert len(os.listdir("/proc/self/fd")) <= before + 2


def test_a_full_disk_is_said_before_anything_is_written(monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full)
    with pytest.raises(DataError, match=r"no room for pictures of 0\.07 GB: the disk is full"):
        StoredPictures().kept(run_result(picture_size=60).spaces[0])


@pytest.mark.parametrize("processes", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_files_of_rooms_beside_each_other(processes, tmp_path, monkeypatch):
    """The same, and each room is told of."""
    monkeypatch.setattr(outputs, "ROOMS_A_PROCESS", 1)
    result, told = run_result(picture_size=60, pictures=1), []
    for name, count in (("one", 1), ("some", processes)):
        outputs.write_results(
            result, ResultFolder(tmp_path / name, "run"),
            processes=count, progress=lambda stage, share: told.append((stage, share)),
        )  # fmt: skip
    assert told == 2 * [("results", 1 / 3), ("results", 2 / 3)]
    one, some = (_files(tmp_path / name) for name in ("one", "some"))
    assert len(one) > 20
    assert one == some


@pytest.mark.parametrize("processes", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_room_that_cannot_be_written_ends_the_writing(processes, tmp_path, monkeypatch):
    """Nothing is left of it, and the fault is told as it is in this process."""
    monkeypatch.setattr(outputs, "ROOMS_A_PROCESS", 1)
    result = run_result(picture_size=60, pictures=1)
    first, second = result.spaces
    (picture,) = second.glare.pictures
    picture = replace(picture, luminance=-picture.luminance)
    second = replace(second, glare=replace(second.glare, pictures=(picture,)))
    with pytest.raises(ValueError, match="cannot hold negative"):
        outputs.write_results(
            replace(result, spaces=(first, second)),
            ResultFolder(tmp_path / "out", "run"), processes=processes,
        )  # fmt: skip
    assert list(tmp_path.iterdir()) == []


def _files(folder: Path) -> dict[str, bytes]:
    """The contents of all files in a folder by their names."""
    found = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}
