"""Matrices cached on disk by the hash of everything they depend on, finished or half done.

A file holds the matrices of a view, or the state of batches of
`mitsuba_cfs.trace.kernels.estimate.accumulate`: a finished matrix is read back, a killed run goes
on after the last batch that was saved.
"""

from __future__ import annotations

import hashlib
import logging
import marshal
import os
import zipfile
import zlib
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from platformdirs import user_cache_path

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import remove_stale, replacing
from mitsuba_cfs.matrices.archive import opened_archive, write_archive
from mitsuba_cfs.source_code import code_version

VARIABLE = "CFS_CACHE"  # environment variable with the folder
DEFAULT_LIMIT = 4 << 30  # [bytes] of all files; the longest unused go first
SMALL = 500  # files of less than the limit divided by this, as a building's, go after all others
UNLISTED = 64  # the limit divided by this is what a process writes before it lists the folder again
RECENT_HASHES = 32  # of dataclasses
PLAIN = {type(None), bool, int, float, str, bytes}  # which `marshal` tells apart
PLAIN_FORMAT = 2  # of `marshal`: the last one whose bytes follow from the values alone
# RuntimeError: of zipfile, for a damaged file that seems encrypted or otherwise compressed
UNREADABLE = (
    OSError,
    ValueError,
    KeyError,
    TypeError,
    IndexError,
    EOFError,
    MemoryError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
)

log = logging.getLogger(__name__)
T = TypeVar("T")
Inputs = tuple[object, ...]
_unlisted: dict[Path, int] = {}  # bytes that this process wrote to a folder since it last listed the files


class RecentResults:
    """The last results of functions of immutable objects, by the identity of these, in memory."""

    def __init__(self, most: int = 4) -> None:
        """Empty; `most`: number of results."""
        self._most = most
        # with their inputs, so that no other object gets the ids in the key
        self._results: OrderedDict[Inputs, tuple[Inputs, Any]] = OrderedDict()

    def of(self, function: Callable[..., T], *inputs: object) -> T:
        """The result of a function of these inputs, computed if it is not among the last ones."""
        key = (function, *map(id, inputs))
        if key not in self._results:
            self._results[key] = inputs, function(*inputs)
        self._results.move_to_end(key)
        while len(self._results) > self._most:
            self._results.popitem(last=False)
        result: T = self._results[key][1]
        return result


@dataclass(frozen=True, slots=True)
class BatchMean:
    """The running mean of batches: enough to go on with the next one."""

    count: int  # batches so far
    mean: NDArray[np.float64]
    spread: NDArray[np.float64]  # same shape; sum of squared deviations from the mean
    covariance: NDArray[np.float64]  # [..., R, R] that of products of R blocks of the last axis
    seconds: float  # spent so far
    finished: bool


def default_folder() -> Path:
    """`$CFS_CACHE`, or the folder `cfs` in the user's cache folder of this platform.

    Raises: `DataError` where $CFS_CACHE names a file.
    """
    chosen = os.environ.get(VARIABLE)
    if chosen:
        folder = Path(chosen).expanduser()
        if any(one.exists() and not one.is_dir() for one in (folder, *folder.parents)):
            raise DataError("is a file; the cache needs a folder", file=folder, field=VARIABLE)
        return folder
    return user_cache_path("cfs", appauthor=False)


class RecentHashes:
    """Hashes of the dataclasses that were hashed last, which nobody writes to.

    The keys of a room's matrices contain the same surfaces some fifteen times, those of a whole
    building among them.
    """

    def __init__(self) -> None:
        """Empty."""
        # with the objects whose ids are the keys, so that no other object gets these ids
        self._hashes: OrderedDict[int, tuple[object, bytes]] = OrderedDict()

    def __reduce__(self) -> tuple[type[RecentHashes], tuple[()]]:
        """Another process gets none of the objects."""
        return RecentHashes, ()

    def of(self, value: object) -> bytes:
        """The hash of a dataclass, computed or recalled."""
        recent = self._hashes.pop(id(value), None) or (value, _hash_of(value))
        self._hashes[id(value)] = recent
        while len(self._hashes) > RECENT_HASHES:
            self._hashes.popitem(last=False)
        return recent[1]


@dataclass(frozen=True, slots=True)
class MatrixCache:
    """A folder of matrices."""

    folder: Path
    limit: int = DEFAULT_LIMIT  # [bytes]
    stores: bool = True  # rather than only read
    hashes: RecentHashes = field(default_factory=RecentHashes, compare=False, repr=False)

    @classmethod
    def of_user(cls) -> MatrixCache:
        """The user's cache, the same one in all of a process."""
        return _of_folder(default_folder())

    def entry(self, label: str, *inputs: object, by: str) -> CacheEntry:
        """The file of the matrix that a module computes from these inputs.

        Args: by: the module's dotted name; its source and what it imports are an input too.
        """
        key = digest(label, code_version(by), *inputs, hashes=self.hashes)
        return CacheEntry(self, self.folder / f"{label.replace(' ', '-')}-{key[:40]}.npz")

    def trim(self, keep: Path | None = None) -> None:
        """Delete the longest unused files until the folder holds less than the limit.

        Small ones go last: they free little space and are often the dearest, as a building's.
        """
        with os.scandir(self.folder) as listed:
            result = [(file.path, _status(file)) for file in listed if file.name.endswith(".npz")]
        files = [(file, status) for file, status in result if status]
        total = sum(status.st_size for _, status in files)
        _unlisted[self.folder] = 0
        if total <= self.limit:
            return
        files.sort(key=lambda item: (item[1].st_size * SMALL < self.limit, item[1].st_mtime))
        for file, status in files:
            if total <= self.limit:
                break
            if file != str(keep):
                Path(file).unlink(missing_ok=True)
                total -= status.st_size

    def trim_seldom(self, written: Path) -> None:
        """`trim` at a process' first file in a folder, and after each 64th of the limit that it writes.

        Every file lists all others otherwise.  The folder holds at most the limit and a 64th of it
        for each process that writes.
        """
        unlisted = _unlisted.get(self.folder, self.limit) + written.stat().st_size
        _unlisted[self.folder] = unlisted
        if unlisted * UNLISTED >= self.limit:
            remove_stale(self.folder)
            self.trim(keep=written)


@dataclass(frozen=True, slots=True)
class CacheEntry:
    """One matrix's file."""

    cache: MatrixCache
    path: Path

    def read(self, content: Callable[[Mapping[str, NDArray[Any]]], T | None]) -> T | None:
        """What `content` makes of the stored arrays; None if there are none that can be read."""
        try:
            with opened_archive(self.path) as data:
                result = content(data)
            os.utime(self.path)  # used now
        except FileNotFoundError:
            return None
        except UNREADABLE as error:
            log.info("%s: ignored, cannot be read: %s", self.path, error)
            return None
        return result

    def write(self, arrays: Mapping[str, object], *, finished: bool = True) -> bool:
        """Write arrays by name; the file is the old one or the new one at any time.

        A folder that cannot be written to costs a warning, not the run.
        """
        if not self.cache.stores:
            return False
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with replacing(self.path, clears=False) as part:
                write_archive(part, arrays)
            if finished:
                self.cache.trim_seldom(self.path)
        except (OSError, DataError) as error:
            log.warning("the matrix is not cached: %s", error)
            return False
        return True

    def load(self) -> BatchMean | None:
        """The stored state of batches; None if there is none, or none that can be read."""
        return self.read(_batch_mean)

    def matrix(self) -> NDArray[np.float64] | None:
        """The matrix of `cached_or_computed`; None if there is none, or none that can be read."""
        return self.read(lambda data: np.asarray(data["matrix"], dtype=float))

    def save(self, state: BatchMean) -> None:
        """Write the state of batches."""
        arrays = {one.name: getattr(state, one.name) for one in fields(state)}
        self.write(arrays, finished=state.finished)


def _batch_mean(data: Mapping[str, NDArray[Any]]) -> BatchMean | None:
    """None where the shapes do not go together."""
    mean, spread, covariance = (data[n].astype(float, copy=False) for n in ("mean", "spread", "covariance"))
    count, seconds, finished = int(data["count"]), float(data["seconds"]), bool(data["finished"])
    shape = mean.shape
    whole = count > 0 and spread.shape == shape and covariance.shape[:-2] == shape[:-1]
    return BatchMean(count, mean, spread, covariance, seconds, finished) if whole else None


def cached_or_computed(entry: CacheEntry | None, compute: Callable[[], NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the cached matrix, or compute and store it: for matrices without batches."""
    cached = None if entry is None else entry.matrix()
    if cached is not None:
        return cached
    matrix = compute()
    if entry is not None:
        entry.write({"matrix": matrix})
    return matrix


@cache
def _of_folder(folder: Path) -> MatrixCache:
    return MatrixCache(folder)


def digest(*values: object, hashes: RecentHashes | None = None) -> str:
    """A hash of numbers, texts, arrays, dataclasses and sequences of them, by value.

    Args: hashes: of dataclasses that earlier calls hashed.
    """
    state = hashlib.sha256()
    for value in values:
        if is_dataclass(value) and not isinstance(value, type):
            state.update(b"record;" + (_hash_of(value) if hashes is None else hashes.of(value)))
        else:
            _feed(state, value)
    return state.hexdigest()


def _hash_of(value: object) -> bytes:
    state = hashlib.sha256()
    _feed(state, value)
    return state.digest()


def _feed(state: hashlib._Hash, value: object) -> None:
    """Add a value with its type and size, so that no two different inputs look alike."""
    if isinstance(value, np.ndarray):
        state.update(f"array {value.dtype.str} {value.shape};".encode())
        state.update(np.ascontiguousarray(value).reshape(-1).view(np.uint8).data)
    elif is_dataclass(value) and not isinstance(value, type):
        state.update(f"{type(value).__qualname__} {len(fields(value))};".encode())
        for item in fields(value):
            _feed(state, getattr(value, item.name))
    elif isinstance(value, (list, tuple)):
        plain = set(map(type, value)) <= PLAIN
        state.update(f"{'plain ' if plain else ''}sequence {len(value)};".encode())
        if plain:
            state.update(marshal.dumps(tuple(value), PLAIN_FORMAT))
        else:
            for item in value:
                _feed(state, item)
    elif value is None or isinstance(value, (bool, int, float, str, bytes, np.generic)):
        text = repr(value).encode()
        state.update(f"{type(value).__name__} {len(text)};".encode() + text)
    else:
        raise ValueError(f"cannot hash a {type(value).__name__}")


def _status(file: os.DirEntry[str]) -> os.stat_result | None:
    try:
        return file.stat()
    except OSError:
        return None
