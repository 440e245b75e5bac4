"""What scripts that render scenes share: a folder for these, rows as they come, a file of them."""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Callable, Iterable
from dataclasses import asdict
from pathlib import Path
from typing import TypeVar

Row = TypeVar("Row")


def add_row_options(parser: argparse.ArgumentParser) -> None:
    """Options that `show_rows` reads."""
    parser.add_argument("--keep", type=Path, help="folder for scenes and pictures")
    parser.add_argument("--json", type=Path)


def show_rows(
    options: argparse.Namespace,
    rows: Callable[[Path], Iterable[Row]],
    line: Callable[[Row], str],
) -> None:
    """Print a line of each row, which are dataclasses, made in a folder; write them to `--json`."""
    found = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = (options.keep or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        for row in rows(folder):
            found.append(asdict(row))
            print(line(row), flush=True)
    if options.json:
        options.json.write_text(json.dumps(found, indent=1))
