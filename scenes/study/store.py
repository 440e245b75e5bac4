"""The folder of a study: a file for each finished case, and the tables made of them."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.files import json_text, opened_arrays, write_bytes, write_table, write_text
from mitsuba_cfs.matrices.cache import UNREADABLE
from mitsuba_cfs.progress import Progress, silent
from scenes.result_folder import CASES, EXPLORER, ResultFolder
from scenes.study.plan import Case, requirements
from scenes.user_errors import one_line, user_message
from scenes.workers import Tasks


@dataclass(frozen=True, slots=True)
class CaseResult:
    """What came out of one case: figures of the table, and arrays for the report."""

    key: str
    figures: dict[str, float | str] = field(default_factory=dict)
    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)
    error: str = ""  # one line; then there is nothing else

    def to_bytes(self) -> bytes:
        """The result as the bytes of an `.npz` file."""
        buffer = io.BytesIO()
        text = json.dumps({"key": self.key, "figures": self.figures}, ensure_ascii=False)
        record = np.frombuffer(text.encode(), np.uint8)
        np.savez_compressed(buffer, record=record, **self.arrays)
        return buffer.getvalue()

    @classmethod
    def read(cls, path: Path) -> CaseResult:
        """The result of a file that `to_bytes` made."""
        with opened_arrays(path) as data:
            arrays = {name: data[name] for name in data.files}
        record = json.loads(arrays.pop("record").tobytes())
        key, figures = record["key"], dict(record["figures"])
        if not all(isinstance(value, float | int | str) for value in figures.values()):
            raise ValueError("figures: expected numbers and texts")
        return cls(key, figures, arrays)


class Store:
    """A study's folder: each finished case is kept at once, tables and report come at the end."""

    def __init__(
        self, folder: Path, *, inputs: Iterable[Path | None] = (), command: str = "study", replacing: bool = True
    ) -> None:
        """Raises: `DataError` for a folder that is not the command's or cannot be written to.

        Args:
            inputs: the study's files; the folder may not be or contain one.
            replacing: earlier results of other files are replaced, not refused.
        """
        self.folder, self._command = folder, command
        self.results = ResultFolder(folder, command, inputs=inputs, replacing=replacing)

    def open(self) -> None:
        """Make the folder, for cases to be kept in."""
        self.results.checkpoints(CASES)

    def load(self, key: str) -> CaseResult | None:
        """The finished case of that key; None where there is none, or none that can be read."""
        try:
            result = CaseResult.read(self._place(key))
        except UNREADABLE:
            return None
        return result if result.key == key else None

    def save(self, result: CaseResult) -> None:
        """Keep a finished case."""
        write_bytes(self._place(result.key), result.to_bytes())

    def checkpoints(self, name: str) -> Path:
        """A folder for files that a later run uses again; it is never cleared."""
        return self.results.checkpoints(name)

    def write(
        self,
        rows: Iterable[dict[str, Any]],
        manifest: dict[str, Any],
        report: Callable[[Path], object] | None = None,
        explorer: Callable[[Path], object] | None = None,
        more: Mapping[str, Callable[[Path], object]] | None = None,
    ) -> None:
        """Write the table of all cases, what the study was made of, and its report.

        Args:
            report: writes it to a path; without, an earlier report goes: it tells other numbers;
            explorer: likewise, to a folder, beside the data of its cases;
            more: writers of other files, by name.
        """
        import pandas as pd

        table = pd.DataFrame(list(rows))
        text = json_text(manifest, indent=2, ensure_ascii=False, default=str)
        with self.results.replaced() as place:
            write_table(table, place / "results.parquet", index=False)
            write_table(table, place / "results.csv", index=False, float_format="%.6g")
            write_text(place / f"{self._command}.json", text + "\n")
            for name, write in (more or {}).items():
                write(place / name)
            if report is not None:
                report(place / "report.html")
            if explorer is not None:
                explorer(place / EXPLORER)

    def explorers(self) -> Path:
        """The folder of the cases' explorers, made; it is never cleared."""
        return self.results.checkpoints(EXPLORER)

    def _place(self, key: str) -> Path:
        return self.folder / CASES / f"{key}.npz"


class Compute(Protocol):
    """A function of a module that computes a case."""

    def __call__(self, case: Case, /, *, progress: Progress = ...) -> CaseResult:
        """The result of a case."""
        ...


def computed(
    cases: Sequence[Case],
    compute: Compute,
    *,
    processes: int = 1,
    scheduler: str | None = None,
    progress: Progress = silent,
) -> Generator[CaseResult]:
    """The result of each case, once for each key, in the order in which they are ready.

    A case that fails gives a result with its error.  Closing the generator ends the work.

    Args:
        processes: how many cases at a time on this machine.
        scheduler: address of a Dask scheduler, whose workers compute the cases.  They read the
            input files under the same paths; those that cannot are left out.
        progress: of the case under way, where this process computes the cases itself.
    """
    once = list({case.key: case for case in cases}.values())
    here = processes == 1 and scheduler is None
    of_case = partial(compute, progress=progress) if here else compute
    tasks = Tasks(once, of_case, _failed, key=attrgetter("key"), scene=attrgetter("scene"), needs=requirements(once))
    return tasks.results(processes=processes, scheduler=scheduler)


def _failed(case: Case, error: BaseException) -> CaseResult:
    return CaseResult(case.key, error=failure_line(error))


def failure_line(error: BaseException) -> str:
    """A failure in one line: the message of an expected error, the type of any other."""
    message = user_message(error)
    fault = f"fault of the program: {one_line(repr(error))}; cfs -vv tells where"
    return message or fault
