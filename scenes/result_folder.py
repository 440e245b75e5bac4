"""A folder of results that appears when all is written, in the place of an earlier one."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mitsuba_cfs.errors import DataError

MARK = "run.json"  # a folder that holds it is an earlier result and may be replaced


def check_folder(folder: Path) -> None:
    """Raise `DataError` where results could not be put at the end of a run."""
    if folder.exists() and not folder.is_dir():
        raise DataError("is a file; results need a folder", file=folder, field="--out")
    if folder.is_dir() and any(folder.iterdir()) and not (folder / MARK).is_file():
        raise DataError(
            f"holds other files (and no {MARK} of an earlier run)", file=folder, field="--out"
        )
    try:
        folder.absolute().parent.mkdir(parents=True, exist_ok=True)
        Path(tempfile.mkdtemp(prefix=".cfs-", dir=folder.absolute().parent)).rmdir()
    except OSError as error:
        message = f"cannot be written: {error.strerror or error}"
        raise DataError(message, file=folder, field="--out") from error


@contextmanager
def result_folder(folder: Path) -> Iterator[Path]:
    """A temporary folder that takes the name `folder` at the end, or goes where an error comes.

    Whoever writes into it puts `MARK` there, so that the next run may replace it.
    """
    check_folder(folder)
    target = folder.absolute()
    temporary = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
    try:
        temporary.chmod(0o755)
        yield temporary
        _take_place(temporary, target)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise


def _take_place(temporary: Path, target: Path) -> None:
    """Rename the finished folder, keeping the earlier one until that is done."""
    old = None
    if target.exists():
        old = Path(tempfile.mkdtemp(prefix=f".{target.name}-old-", dir=target.parent))
        target.replace(old)
    try:
        temporary.replace(target)
    except OSError:
        if old is not None:
            old.replace(target)
        raise
    if old is not None:
        shutil.rmtree(old, ignore_errors=True)
