"""Atomic files: written under a temporary name beside the target and renamed at the end.

A process holds a lock on what it is writing, so that what a killed one left is known and removed.
"""

from __future__ import annotations

import errno
import hashlib
import json
import math
import os
import re
import secrets
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from os import PathLike
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from mitsuba_cfs.errors import DataError

if TYPE_CHECKING:
    import pandas as pd

try:
    import fcntl
except ImportError:  # Windows: what a killed process left stays
    fcntl = None  # type: ignore[assignment]

FORMULA = ("=", "+", "-", "@", "\t", "\r")  # beginnings of a cell that is computed
TEMPORARY = re.compile(r"\.cfs-[0-9a-f]{8}\.part(\.\w+)?")  # names of our temporaries
REASONS = {
    errno.ENOSPC: "the disk is full",
    errno.EDQUOT: "the disk quota is used up",
    errno.EFBIG: "the file would be larger than allowed (ulimit -f)",
    errno.EROFS: "the file system is read-only",
}


def reason(error: Exception) -> str:
    """Why something could not be read or written, without the number and file that Python adds."""
    words = " ".join(str(error).split())
    if not isinstance(error, OSError):
        return words
    return REASONS.get(error.errno or 0) or error.strerror or words


def wrong_encoding(content: bytes) -> str | None:
    """Why a text is not UTF-8, with line and remedy; None where it is, or states another."""
    if b"encoding" in content[:200] and b"utf-8" not in content[:200].lower():
        return None
    try:
        content.decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        byte = content[error.start]
        return f"line {line}: byte {byte:#04x} is not UTF-8; save the file with encoding UTF-8"
    return None


@contextmanager
def replacing(path: str | PathLike[str], *, field: str | None = None, clears: bool = True) -> Iterator[Path]:
    """A temporary file beside `path`, renamed to it at the end or deleted after an error.

    A link is followed to the file that it names; a device or pipe is written to as it is.

    Args: clears: the folder of temporaries whose process was killed (`remove_stale`) first.

    Raises: `DataError` that names `path` and says why it cannot be written.
    """
    if os.path.isdir(path):
        raise DataError("is a folder; expected a file", file=path, field=field)
    if os.path.exists(path) and not os.path.isfile(path):
        with _told(path, Path(path), field):
            yield Path(path)
        return
    target = Path(os.path.realpath(path))
    with _told(path, target, field):
        if clears:
            remove_stale(target.parent)
        part, release = _held(target.parent, target.suffix, lambda part: part.touch(exist_ok=False))
    try:
        with _told(path, part, field, probe=part):
            yield part
            if target.exists():
                part.chmod(target.stat().st_mode & 0o777)
            part.replace(target)
    except DataError as error:
        part.unlink(missing_ok=True)
        if error.file is None or Path(error.file) != part:
            raise
        raise DataError(error.message, file=path, field=field) from error  # of a writer inside
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    finally:
        release()


@contextmanager
def temporary_folder(parent: Path, *, mode: int = 0o777) -> Iterator[Path]:
    """A folder inside `parent` to fill and then to rename; deleted at the end if still there."""
    part, release = _held(parent, "", partial(Path.mkdir, mode=mode))
    try:
        yield part
    finally:
        shutil.rmtree(part, ignore_errors=True)
        release()


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """A folder for this user in the system's temporary folder; deleted at the end.

    What killed processes left there is removed first.
    """
    parent = Path(tempfile.gettempdir())
    remove_stale(parent)
    with temporary_folder(parent, mode=0o700) as part:
        yield part


def taken(folder: Path) -> Callable[[], None] | None:
    """Function that gives a folder free, which this process has until then; None if another has.

    For processes of one machine, or rather of one temporary folder, where the lock is.
    """
    name = hashlib.sha256(os.fsencode(os.path.realpath(folder))).hexdigest()[:8]
    lock = Path(tempfile.gettempdir()) / f".cfs-{name}.part.lock"
    if fcntl is None:
        return lambda: None
    while True:
        try:
            handle = os.open(lock, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
        except OSError:  # no room for it, or another user's: nothing is known of that folder
            return lambda: None
        try:
            fcntl.lockf(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)  # once more by this process: yes
        except OSError:
            os.close(handle)
            return None
        _locked(handle, wait=False)  # by which `stale` knows that it is in use
        with suppress(OSError):
            if os.path.samestat(os.stat(lock), os.fstat(handle)):
                return partial(_freed, lock, handle)
        os.close(handle)  # another process has just removed it


def _freed(lock: Path, handle: int) -> None:
    lock.unlink(missing_ok=True)
    os.close(handle)


@contextmanager
def unnamed_file(size: int, what: str, folder: Path | None = None) -> Iterator[IO[bytes]]:
    """A file without a name, of so many bytes, to be mapped; it exists as long as its map.

    Args:
        what: the file is for, in words for the message.
        folder: of it; the system's temporary folder by default.

    Raises: `DataError` where there is no room for it.
    """
    with tempfile.TemporaryFile(dir=folder) as file:
        try:
            if hasattr(os, "posix_fallocate"):  # or a full disk ends the process: SIGBUS
                os.posix_fallocate(file.fileno(), 0, size)
            else:
                file.truncate(size)
        except OSError as error:
            message = f"no room for {what}: {reason(error)}"
            raise DataError(message, file=folder or tempfile.gettempdir()) from error
        yield file


def write_text(path: str | PathLike[str], text: str, *, encoding: str = "utf-8") -> None:
    """Write a text file atomically: it is the old one or the new one at any time."""
    with replacing(path) as part:
        part.write_text(text, encoding=encoding)


def read_json(path: Path, *, most_bytes: int = 256 << 20) -> dict[str, Any]:
    """The object that a JSON file holds; memory is up to ten times its size.

    Raises: `DataError` for a file that cannot be read, is too big or is no JSON object.
    """
    try:
        if path.stat().st_size > most_bytes:
            raise DataError(f"is too big: at most {most_bytes >> 20} MiB are read", file=path)
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise DataError(f"cannot be read: {reason(error)}", file=path) from None
    except RecursionError:
        raise DataError("is no JSON: nested too deeply", file=path) from None
    except ValueError as error:  # of JSON, of its text, of a number with too many digits
        if isinstance(error, DataError):
            raise
        message = wrong_encoding(path.read_bytes()) or f"is no JSON: {error}"
        raise DataError(message, file=path) from None
    if not isinstance(content, dict):
        raise DataError("expected a JSON object", file=path)
    return content


def json_text(value: object, **options: Any) -> str:
    """A value as JSON: NaN, which is no value, is null; options of `json.dumps`.

    Raises: `ValueError` for infinity, which no result has.
    """
    try:
        return json.dumps(value, allow_nan=False, **options)
    except ValueError:
        return json.dumps(_without_nan(value), allow_nan=False, **options)


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(one) for one in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def write_bytes(path: str | PathLike[str], data: bytes) -> None:
    """Write a file atomically: it is the old one or the new one at any time."""
    with replacing(path) as part:
        part.write_bytes(data)


@contextmanager
def opened_arrays(path: str | PathLike[str]) -> Iterator[Any]:
    """A NumPy archive of arrays by name, closed even if it is damaged.

    `np.load` of a path leaves the file open where it is no whole archive.
    """
    import numpy as np

    with open(path, "rb") as stream, np.load(stream, allow_pickle=False) as data:
        yield data


def write_table(table: pd.DataFrame, path: str | PathLike[str], **options: object) -> None:
    """Write a pandas table by the suffix, as `.parquet` or text; options of its writer.

    In text, entries of a file's words are no formulas of a spreadsheet (`without_formulas`).

    Raises: `ValueError` for infinity, which no result has; NaN is an empty cell.
    """
    check_finite(table)
    with replacing(path) as part:
        if part.suffix == ".parquet":
            table.to_parquet(part, **options)
        else:
            without_formulas(table).to_csv(part, **options)


def check_finite(table: pd.DataFrame) -> None:
    """Raise `ValueError` for a table of results with infinity; NaN is an empty cell."""
    import numpy as np

    numbers = table.select_dtypes("floating")
    infinite = numbers.columns[np.isinf(numbers.to_numpy()).any(axis=0)]
    if len(infinite):
        raise ValueError(f"infinite results: {', '.join(map(str, infinite))}")


def without_formulas(table: pd.DataFrame) -> pd.DataFrame:
    """The table with its texts, names of columns and rows as `plain_cell`."""
    import pandas as pd

    texts = [k for k, kind in enumerate(table.dtypes) if kind.kind not in "biufcmM"]
    if texts:
        table = table.copy(deep=False)
        for k in texts:
            column = table.iloc[:, k]
            cells = [plain_cell(value) for value in column]
            table.isetitem(k, pd.Series(cells, table.index, dtype=object))
    index = table.index if table.index.dtype.kind in "biufcmM" else table.index.map(plain_cell)
    return table.set_axis(table.columns.map(plain_cell), axis=1).set_axis(index, axis=0)


def plain_cell(value: Any) -> Any:
    """A cell that a spreadsheet does not compute: a text that begins as a formula gets a quote.

    Source: OWASP, "CSV Injection". A number stays one, also as a text.
    """
    if not isinstance(value, str) or not value.lstrip(" ").startswith(FORMULA):
        return value
    try:
        float(value)
    except ValueError:
        return f"'{value}"
    return value


def check_file(path: str | PathLike[str], *, field: str = "--out", inputs: Iterable[Path | None] = ()) -> None:
    """Raise `DataError` if a file cannot be written, or is an input."""
    if any(one is not None and _same(one, path) for one in inputs):
        raise DataError("is an input of this command", file=path, field=field)
    if os.path.isdir(path):
        raise DataError("is a folder; expected a file", file=path, field=field)
    if os.path.exists(path) and not os.path.isfile(path):
        return
    target = Path(os.path.realpath(path))
    if not target.parent.is_dir():
        raise DataError("no such folder", file=target.parent, field=field)
    with _told(path, target, field):
        part, release = _held(target.parent, "", lambda part: part.touch(exist_ok=False))
        part.unlink()
        release()


def remove_stale(folder: Path) -> None:
    """Remove the temporaries in a folder whose process was killed."""
    for part in stale(folder):
        shutil.rmtree(part, ignore_errors=True)
        with suppress(OSError):
            part.unlink(missing_ok=True)


def stale(folder: Path) -> Iterator[Path]:
    """Temporaries in a folder that no process holds, each locked while the caller has it."""
    with suppress(OSError):
        for part in [one for one in folder.iterdir() if TEMPORARY.fullmatch(one.name)]:
            with suppress(OSError):
                handle = os.open(part, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0))
                try:
                    if _locked(handle, wait=False):
                        yield part
                finally:
                    os.close(handle)


def _held(folder: Path, suffix: str, make: Callable[[Path], object]) -> tuple[Path, Callable[[], None]]:
    """A new temporary locked by this process, and the function that unlocks it."""
    while True:
        part = folder / f".cfs-{secrets.token_hex(4)}.part{suffix}"
        make(part)
        if fcntl is None:
            return part, lambda: None
        handle = os.open(part, os.O_RDONLY)
        _locked(handle, wait=True)
        if part.exists():  # else another process took it for a dead one's before it was held
            return part, partial(os.close, handle)
        os.close(handle)


def _locked(handle: int, *, wait: bool) -> bool:
    """Whether this process got the lock; never on a file system without locks."""
    if fcntl is None:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except OSError:
        return False
    return True


@contextmanager
def _told(path: str | PathLike[str], place: Path, field: str | None, *, probe: Path | None = None) -> Iterator[None]:
    """Turn a failure to write `place` into one line about the file that the user named.

    Args: probe: our own file, where a failure without a reason is looked into.
    """
    try:
        yield
    except (OSError, RuntimeError) as error:  # RuntimeError: libraries in C++ on a full disk
        why: OSError | None = None
        if isinstance(error, OSError):
            about = place if error.filename is None else Path(os.fsdecode(error.filename))
            match = TEMPORARY.fullmatch(about.name) and about.parent == place.parent
            if not match and about not in (place, place.parent, Path(path)):
                raise
            why = error
        if probe is not None and getattr(error, "errno", None) is None:
            why = _write_failure(probe) or why
        if why is None:
            raise
        raise DataError(f"cannot be written: {reason(why)}", file=path, field=field) from error


def _write_failure(part: Path) -> OSError | None:
    """Error of writing one more block at the end of the file; None if that works."""
    try:
        with open(part, "ab") as file:
            file.write(bytes(65536))
    except OSError as error:
        return error
    return None


def _same(one: str | PathLike[str], other: str | PathLike[str]) -> bool:
    return os.path.realpath(one) == os.path.realpath(other)


def sha256(path: Path) -> str:
    """Hash of a file's bytes."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
