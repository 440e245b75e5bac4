"""The pictures of a building's rooms, held on disk until they are looked at.

Ten pictures of 600 x 600 and one in colour are 22 MB a room: with 73 rooms more than all else.
"""

from __future__ import annotations

import mmap
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.files import unnamed_file
from scenes.results import RoomYear
from scenes.room.heated import DaylitRoom

R = TypeVar("R", RoomYear, DaylitRoom)
BLOCK = 2**26  # [bytes] of a file, at least: each holds a file handle for as long as its pictures


class StoredPictures:
    """Files without names that hold pictures; these are read when they are looked at.

    Raises: `DataError` where there is no room for them on disk.
    """

    def __init__(self) -> None:
        """No file is made before there is a picture."""
        self._map: mmap.mmap | None = None
        self._next = 0  # where the next picture begins in the last file

    def kept(self, room: R) -> R:
        """A room's results with their pictures on disk."""
        glare = room.glare
        pictures = tuple(
            replace(
                picture,
                luminance=self._stored(picture.luminance),
                source_mask=None
                if picture.source_mask is None
                else self._stored(picture.source_mask),
            )
            for picture in glare.pictures
        )
        colour = glare.colour
        if colour is not None:
            colour = replace(colour, radiance=self._stored(colour.radiance))
        return replace(room, glare=replace(glare, pictures=pictures, colour=colour))

    def _stored(self, values: NDArray) -> NDArray:
        """The values [...] in a file, read only."""
        data = np.ascontiguousarray(values)
        size = -(-data.nbytes // mmap.PAGESIZE) * mmap.PAGESIZE
        if self._map is None or self._next + size > len(self._map):
            self._map, self._next = _file(max(BLOCK, size)), 0
        start, self._next = self._next, self._next + size
        found = np.frombuffer(self._map, data.dtype, data.size, start).reshape(data.shape)
        found[...] = data
        found.flags.writeable = False
        if hasattr(self._map, "madvise"):  # out of memory until it is read
            self._map.madvise(mmap.MADV_DONTNEED, start, size)
        return found


def _file(size: int) -> mmap.mmap:
    """A file without a name of so many bytes, there for as long as anything shows its pictures."""
    with unnamed_file(size, f"pictures of {size / 1e9:.2f} GB") as file:
        return mmap.mmap(file.fileno(), size)
