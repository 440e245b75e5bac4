"""Rows of scripts that render scenes: made in a folder, printed as they come, written to a file."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import asdict
from pathlib import Path
from typing import TypeVar

Row = TypeVar("Row")


def show_rows(
    file: Path | None, rows: Callable[[Path], Iterable[Row]], line: Callable[[Row], str]
) -> None:
    """Print a line of each row, which are dataclasses, made in a folder; write them to a file."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for row in rows(Path(folder).resolve()):
            found.append(asdict(row))
            print(line(row), flush=True)
    if file:
        file.write_text(json.dumps(found, indent=1))
