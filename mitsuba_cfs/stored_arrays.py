"""Large arrays stored on disk until they are used: the rooms of a building yield gigabytes."""

from __future__ import annotations

import mmap
import pickle
import weakref
from collections.abc import Iterable, Iterator, Sequence
from typing import TypeVar, overload

from mitsuba_cfs.files import unnamed_file

T = TypeVar("T")
BLOCK = 2**26  # [bytes] of a file, at least: each holds a file handle for as long as its arrays
LEAST = 2**12  # [bytes] of an array that goes to disk
ALIGNED = 64  # [bytes] between which arrays begin
PASSED = 8  # things that are looked at until their arrays are out of memory again


class StoredArrays:
    """Unnamed files of arrays, which are read when they are used.

    What has been looked at is out of memory again when the next file is begun, and by `each`.

    Raises: `DataError` where there is no room for them on disk.
    """

    def __init__(self) -> None:
        """Empty; the first array creates a file."""
        self._maps: list[weakref.ref[mmap.mmap]] = []
        self._last: mmap.mmap | None = None
        self._next = 0  # where the next array begins in the last file

    def stored(self, thing: T) -> T:
        """A copy of a picklable object with its large arrays read-only on disk."""
        buffers: list[pickle.PickleBuffer] = []

        def within(buffer: pickle.PickleBuffer) -> bool:
            """Whether an array stays in memory, as small ones do."""
            small = buffer.raw().nbytes < LEAST
            if not small:
                buffers.append(buffer)
            return small

        rest = pickle.dumps(thing, 5, buffer_callback=within)
        return pickle.loads(rest, buffers=[self._stored(buffer.raw()) for buffer in buffers])

    def each(self, things: Iterable[T]) -> Iterator[T]:
        """The objects one after the other; their arrays do not stay in memory."""
        for number, thing in enumerate(things, 1):
            yield thing
            if number % PASSED == 0:
                self.forget()
        self.forget()

    def forget(self) -> None:
        """Release arrays from memory until they are used again."""
        result = [(reference, map_) for reference in self._maps if (map_ := reference()) is not None]
        self._maps = [one for one, _ in result]
        for _, map_ in result:
            if hasattr(map_, "madvise"):
                map_.madvise(mmap.MADV_DONTNEED)

    def _stored(self, data: memoryview) -> memoryview:
        """The bytes in a file, read only."""
        size = -(-data.nbytes // ALIGNED) * ALIGNED
        if self._last is None or self._next + size > len(self._last):
            self.forget()
            self._last, self._next = _file(max(BLOCK, size)), 0
            self._maps.append(weakref.ref(self._last))
        start, self._next = self._next, self._next + size
        result = memoryview(self._last)[start : start + data.nbytes]
        result[:] = data
        return result.toreadonly()


class PassedArrays(Sequence[T]):
    """Objects whose arrays are in a store; each leaves memory once the iteration has passed it."""

    def __init__(self, store: StoredArrays, things: Sequence[T]) -> None:
        """From objects of `kept`, or objects with its arrays."""
        self._store, self._things = store, things

    def __len__(self) -> int:
        return len(self._things)

    @overload
    def __getitem__(self, index: int) -> T: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[T]: ...
    def __getitem__(self, index: int | slice) -> T | Sequence[T]:
        return self._things[index]

    def __iter__(self) -> Iterator[T]:
        return self._store.each(self._things)


def _file(size: int) -> mmap.mmap:
    """An unnamed file of so many bytes, which exists as long as an array refers to it."""
    with unnamed_file(size, f"results of {size / 1e9:.2f} GB") as file:
        return mmap.mmap(file.fileno(), size)
