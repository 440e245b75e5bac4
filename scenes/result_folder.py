"""A folder of results: known by what it holds, replaced when all is written, nothing else touched.

The mark of a folder, `cfs-results.json`, names this program, the command, its inputs and every file
that it wrote. Only those are ever replaced or removed; by a command, only by results of the same
inputs or where `--replace` asks for it.
"""

from __future__ import annotations

import json
import os
import shutil
import weakref
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path, PurePosixPath

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import TEMPORARY, json_text, reason, remove_stale, stale, taken, temporary_folder, write_text

MARK, PROGRAM, FORMAT = "cfs-results.json", "mitsuba-cfs", 1
RENAMED = {"ifc export": "export"}  # commands by their earlier names, which marks may have
EXPLORER = "explore"  # folder of the explorer, inside that of the results
REPORT, FIRST_PLAN, DOSSIER = "report.html", "first_plan.csv", "dossier.html"
CASES = "cases"  # folder of the finished cases of a study, inside that of its results
SYSTEMS = "systems"  # folder of the systems that a design made, inside that of its results


@dataclass(frozen=True, slots=True)
class FolderMark:
    """What a mark says: the command that made the folder, and the files that it wrote."""

    command: str
    files: tuple[str, ...] = ()  # relative, with forward slashes
    removed: tuple[str, ...] = ()  # of finished results: earlier files that go for them
    inputs: tuple[str, ...] = ()  # files, relative to the folder, and names of rules; empty: not recorded

    @classmethod
    def read(cls, folder: Path) -> FolderMark | None:
        """The mark of a folder; None where there is none of ours."""
        try:
            record = json.loads((folder / MARK).read_text(encoding="utf-8"))
            known = record["program"] == PROGRAM and record["format"] == FORMAT
            files, removed = (tuple(map(str, record[key])) for key in ("files", "removed"))
            command = str(record["command"])
            inputs = tuple(map(str, record.get("inputs", ())))  # marks of earlier versions have none
            mark = cls(RENAMED.get(command, command), files, removed, inputs)
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None
        return mark if known and all(map(_inside, mark.files + mark.removed)) else None

    def write(self, folder: Path) -> None:
        """Write the mark into its folder."""
        record = {
            "program": PROGRAM,
            "format": FORMAT,
            "version": metadata.version(PROGRAM),
            "command": self.command,
            "files": sorted(self.files),
            "removed": sorted(self.removed),
            "inputs": sorted(self.inputs),
        }
        write_text(folder / MARK, json_text(record, indent=1, ensure_ascii=False) + "\n")


class ResultFolder:
    """The folder that a command writes its results into.

    Made before the work, it refuses what could not be written at its end; nothing is left of that.
    """

    def __init__(
        self,
        folder: Path,
        command: str,
        *,
        inputs: Iterable[Path | None] = (),
        rules: Iterable[str] = (),
        replacing: bool = True,
        adding: bool = False,
        among: bool = False,
        field: str = "--out",
    ) -> None:
        """Check the folder.

        Args:
            command: that writes; a folder of another command is refused.
            inputs: files of the command; the folder may not be or contain one.
            rules: names of the rules of a check, inputs too.
            replacing: earlier results of other inputs are replaced, not refused.
            adding: earlier results stay.
            among: the folder may hold files of others from the start.
            field: the option that named the folder.

        Raises: `DataError` where the folder is not ours to write into, or cannot be written to.
        """
        self.folder, self._command, self._field = folder, command, field
        self._adding, self._among = adding, among
        self._place = Path(os.path.realpath(folder))
        files = [one for one in inputs if one is not None]
        self._inputs = tuple(sorted({*(_relative(one, self._place) for one in files), *rules}))
        if not adding:
            self._refuse_inputs(files)
        if self._place.exists() and not self._place.is_dir():
            raise self._error("is a file; results need a folder")
        try:
            self._take()
            self._finish_cut_off()
            self._mark = self._own_mark()
            if not replacing:
                self._refuse_other_inputs()
            self._try_to_write()
        except OSError as error:
            raise self._error(f"cannot be written: {reason(error)}") from error

    @contextmanager
    def replaced(self, gone: Callable[[str], bool] | None = None) -> Iterator[Path]:
        """A temporary folder whose files take the place of the earlier results at the end.

        Args: gone: which earlier files go, by name; by default all, or none where the folder is
            for adding to.

        With an error, the earlier results stay as they are. Files of others are never touched:
        where one has the name of a result, the new results go into a folder beside it.
        """
        new = not self._place.exists()
        made = _make_folders(self._place.parent if new else self._place)
        try:
            with temporary_folder(self._place.parent if new else self._place) as part:
                with self._named(part):
                    yield part
                    self._finish(part, gone)
                    if new and _renamed(part, self._place):
                        return
                    self._put_in_place(part)
        finally:
            _remove_empty(made)

    def _finish(self, part: Path, gone: Callable[[str], bool] | None) -> None:
        """Give the finished results their mark, which is all that putting them in place needs."""
        files = tuple(_files(part))
        earlier = set(self._mark.files) - set(files)
        if gone is not None:
            earlier = set(filter(gone, earlier))
        elif self._adding:
            earlier = set()
        FolderMark(self._command, files, tuple(earlier), self._inputs).write(part)

    def checkpoints(self, name: str) -> Path:
        """A folder inside for checkpoints of the command; it is never cleared."""
        made: list[Path] = []
        try:
            made = _make_folders(self._place)
            self._mark.write(self._place)  # first: without it a folder in it would be another's
            made = _make_folders(self._place / name) + made
        except (OSError, DataError) as error:
            _remove_empty(made)
            if isinstance(error, DataError):
                raise
            raise self._error(f"cannot be written: {reason(error)}") from error
        return self.folder / name

    def early(self, files: Mapping[str, str]) -> None:
        """Write texts by file name that stay until `replaced` puts the results in their place.

        None is written where the folder has results of an earlier run, which stay until then.
        """
        if set(self._mark.files) - set(files):
            return
        made: list[Path] = []
        try:
            made = _make_folders(self._place)
            for name in files:
                if name not in self._mark.files and _taken(self._place, name):
                    raise self._error(f"holds {name}, which no earlier run wrote")
            self._mark = replace(self._mark, files=tuple(files))
            self._mark.write(self._place)
            for name, text in files.items():
                write_text(self._place / name, text)
        except OSError as error:
            _remove_empty(made)
            raise self._error(f"cannot be written: {reason(error)}") from error

    def _refuse_inputs(self, inputs: Iterable[Path]) -> None:
        here = Path(os.path.realpath(os.curdir))
        if here.is_relative_to(self._place):
            raise self._error("is or contains the current folder: name one for results alone")
        for one in inputs:
            if Path(os.path.realpath(one)).is_relative_to(self._place):
                raise self._error(f"is or contains the input {one}: name a folder for results alone")

    def _refuse_other_inputs(self) -> None:
        """Raise `DataError` where the folder has results of other inputs, which would be lost."""
        earlier, now = set(self._mark.inputs), set(self._inputs)
        if not earlier or earlier == now or not self._mark.files:
            return
        gone, new = _names(earlier - now, now - earlier)
        if gone and new:
            what = f"of {gone}, not of {new}"
        else:
            what = f"with {gone}" if gone else f"without {new}"
        raise self._error(f"holds results {what}: name another folder, or add --replace to replace them")

    def _take(self) -> None:
        """Have the folder for this process, as long as this object exists."""
        release = taken(self._place)
        if release is None:
            raise self._error("another run of cfs is writing there: wait for it, or name another folder")
        weakref.finalize(self, release)

    def _finish_cut_off(self) -> None:
        """Do what a killed process left: finished results go in place, the rest goes."""
        for part in stale(self._place):
            if part.is_dir() and FolderMark.read(part) is not None:
                self._mark = FolderMark.read(self._place) or FolderMark(self._command)
                self._put_in_place(part)
        remove_stale(self._place)
        remove_stale(self._place.parent)

    def _own_mark(self) -> FolderMark:
        """The mark of the earlier results, or an empty one."""
        mark = FolderMark.read(self._place)
        if mark is None:
            others = self._place.is_dir() and any(not TEMPORARY.fullmatch(one.name) for one in self._place.iterdir())
            if others and not self._among:
                raise self._error(f"holds other files (and no {MARK} of earlier results): name another folder")
            return FolderMark(self._command)
        if mark.command != self._command:
            raise self._error(f"holds results of `cfs {mark.command}`: name another folder")
        return mark

    def _try_to_write(self) -> None:
        made = _make_folders(self._place)
        try:
            with temporary_folder(self._place):
                pass
        finally:
            _remove_empty(made)

    def _put_in_place(self, part: Path) -> None:
        """Move the finished files in; the mark is the last, and a cut is taken up from `part`."""
        done = FolderMark.read(part)
        if self._mark is None or done is None:
            raise RuntimeError("no mark of the earlier results, or of the finished part")
        old = set(self._mark.files)
        moved = sorted(name for name in done.files if os.path.lexists(part / name))
        for name in moved:
            if name not in old and _taken(self._place, name):
                self._set_aside(part, name)
        for name in moved:
            (self._place / name).parent.mkdir(parents=True, exist_ok=True)
            (part / name).replace(self._place / name)
        _remove(self._place, old.intersection(done.removed))
        files = old.difference(done.removed).union(done.files)
        self._mark = FolderMark(done.command, tuple(files), inputs=done.inputs)
        self._mark.write(self._place)

    def _set_aside(self, part: Path, name: str) -> None:
        """Keep finished results that have no place, and say where."""
        number = 1
        while (aside := self._place / f"results-{number}").exists():
            number += 1
        part.replace(aside)
        raise self._error(f"holds {name}, which no earlier run wrote; the new results are in {aside.name}")

    @contextmanager
    def _named(self, part: Path) -> Iterator[None]:
        """Errors that name the temporary folder name the user's in its place."""
        try:
            yield
        except DataError as error:
            if error.file is None or not Path(error.file).is_relative_to(part):
                raise
            file = self.folder / Path(error.file).relative_to(part)
            raise DataError(error.message, file=file, element=error.element, field=error.field) from error
        except OSError as error:
            if error.filename is None or not Path(error.filename).is_relative_to(part):
                raise
            file = self.folder / Path(error.filename).relative_to(part)
            raise DataError(f"cannot be written: {reason(error)}", file=file) from error

    def _error(self, message: str) -> DataError:
        return DataError(message, file=self.folder, field=self._field)


def remove_results(folder: Path) -> None:
    """Remove the results in a folder with what they are resumed from; files of others stay.

    Raises: `DataError` where there are none, where a command writes them, or where they cannot be
        removed.
    """
    mark = None if folder.is_symlink() else FolderMark.read(folder)
    if mark is None:
        raise DataError("is no folder of results", file=folder)
    place = Path(os.path.realpath(folder))
    release = taken(place)
    if release is None:
        raise DataError("another run of cfs is writing there: wait for it", file=folder)
    try:
        _remove(place, mark.files)
        for one in (place / CASES, place / EXPLORER, place / SYSTEMS):
            if one.is_dir() and not one.is_symlink():
                shutil.rmtree(one)
        if any(one.name != MARK for one in place.iterdir()):
            FolderMark(mark.command).write(place)  # so that the command may write there again
            return
        (place / MARK).unlink()
        _remove_empty([place])
    except OSError as error:
        raise DataError(f"cannot be removed: {reason(error)}", file=folder) from error
    finally:
        release()


def _inside(name: str) -> bool:
    """Whether a name of a mark stays inside its folder."""
    path = PurePosixPath(name)
    return bool(name) and not path.is_absolute() and ".." not in path.parts and "\\" not in name


def _relative(file: Path, folder: Path) -> str:
    """A file as seen from a folder, so that both may be moved together."""
    place = os.path.realpath(file)
    try:
        return Path(os.path.relpath(place, folder)).as_posix()
    except ValueError:  # on another drive
        return Path(place).as_posix()


def _names(*groups: Iterable[str]) -> tuple[str, ...]:
    """Groups of inputs in words: the names of the files, with their folders where groups share a name."""
    names = [[PurePosixPath(one).name for one in group] for group in groups]
    if set.intersection(*map(set, names)):
        names = [list(group) for group in groups]
    return tuple(", ".join(sorted(group)) for group in names)


def _files(folder: Path) -> Iterator[str]:
    """The names of all files in a folder and its folders."""
    for path in folder.rglob("*"):
        if path.is_file():
            yield path.relative_to(folder).as_posix()


def _taken(place: Path, name: str) -> bool:
    """Whether a name cannot be given to a result without touching something else."""
    path = place / name
    folders = [parent for parent in path.parents if parent.is_relative_to(place) and parent != place]
    return os.path.lexists(path) or any(os.path.lexists(p) and not p.is_dir() for p in folders)


def _remove(place: Path, names: Iterable[str]) -> None:
    """Remove files of ours, and the folders that are empty then."""
    for name in names:
        path = place / name
        if not Path(os.path.realpath(path.parent)).is_relative_to(place):
            continue  # a link put there since leads elsewhere
        if path.is_file() or path.is_symlink():
            path.unlink(missing_ok=True)
        for folder in path.parents:
            if folder == place:
                break
            with suppress(OSError):  # not empty: something of others is in it
                folder.rmdir()


def _renamed(part: Path, place: Path) -> bool:
    """Whether the finished folder has its name, where there is none of that name."""
    try:
        part.rename(place)
    except OSError:
        if not place.is_dir():
            raise
        return False
    return True


def _make_folders(folder: Path) -> list[Path]:
    """Make a folder with those that it lies in; the ones that were not there."""
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    return missing


def _remove_empty(folders: Iterable[Path]) -> None:
    """Remove folders, the innermost first, that nothing was put into."""
    for folder in folders:
        with suppress(OSError):
            folder.rmdir()
