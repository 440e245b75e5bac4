"""The folder of a study: a file for each finished case, and the tables made of them."""

from __future__ import annotations

import io
import json
import os
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import UNREADABLE

if TYPE_CHECKING:
    import pandas as pd

MARK = "study.json"  # a folder that holds it is a study's


@dataclass(frozen=True, slots=True)
class CaseResult:
    """What came out of one case: figures of the table, and arrays for the report."""

    key: str
    figures: dict[str, float | str] = field(default_factory=dict)
    arrays: dict[str, NDArray] = field(default_factory=dict)
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
        with np.load(path, allow_pickle=False) as data:
            arrays = {name: data[name] for name in data.files}
        record = json.loads(arrays.pop("record").tobytes())
        return cls(record["key"], record["figures"], arrays)


class Store:
    """A study's folder; every file in it is the old one or the new one at any time."""

    def __init__(self, folder: Path) -> None:
        """Raises: `DataError` for a folder that holds other things or cannot be written to."""
        self.folder = folder
        if folder.exists() and not folder.is_dir():
            raise DataError("is a file; a study needs a folder", file=folder, field="--out")
        if folder.is_dir() and any(folder.iterdir()) and not (folder / MARK).is_file():
            message = f"holds other files (and no {MARK} of a study)"
            raise DataError(message, file=folder, field="--out")
        try:
            (folder / "cases").mkdir(parents=True, exist_ok=True)
            self.write("study.json.probe", lambda path: path.write_text(""))
            (folder / "study.json.probe").unlink()
        except OSError as error:
            message = f"cannot be written: {error.strerror or error}"
            raise DataError(message, file=folder, field="--out") from error

    def load(self, key: str) -> CaseResult | None:
        """The finished case of that key; None where there is none, or none that can be read."""
        try:
            result = CaseResult.read(self._place(key))
        except UNREADABLE:
            return None
        return result if result.key == key else None

    def save(self, result: CaseResult) -> None:
        """Keep a finished case."""
        content = result.to_bytes()
        self.write(f"cases/{result.key}.npz", lambda path: path.write_bytes(content))

    def write(self, name: str, write: Callable[[Path], object]) -> None:
        """Make a file by `write(path)` under another name, and give it its own when it is whole."""
        target = self.folder / name
        handle, part = tempfile.mkstemp(dir=target.parent, prefix=".", suffix=target.suffix)
        os.close(handle)
        try:
            write(Path(part))
            os.chmod(part, 0o644)
            os.replace(part, target)
        except BaseException:
            Path(part).unlink(missing_ok=True)
            raise

    def write_tables(self, rows: Iterable[dict]) -> pd.DataFrame:
        """The table of all cases as results.parquet and results.csv."""
        import pandas as pd

        table = pd.DataFrame(list(rows))
        self.write("results.parquet", lambda path: table.to_parquet(path, index=False))
        self.write("results.csv", lambda path: table.to_csv(path, index=False, float_format="%.6g"))
        return table

    def write_mark(self, manifest: dict) -> None:
        """What the study was made of."""
        text = json.dumps(manifest, indent=2, ensure_ascii=False, default=str) + "\n"
        self.write(MARK, lambda path: path.write_text(text, encoding="utf-8"))

    def _place(self, key: str) -> Path:
        return self.folder / "cases" / f"{key}.npz"
