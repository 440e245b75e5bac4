"""Mutated files by reader: how many give a result, one line, or anything else.

    python -m tests.validation hostile_files [--only epw] [--number 20000] [--first 0] [--json FILE]

The readers and the mutations are those of `tests/test_hostile_files.py`; a number is a seed.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from tests.test_hostile_files import ROWS, SLOW, outcome


def main(
    *,
    only: Annotated[str, "readers with this in their name"] = "",
    number: Annotated[int, "mutations of each"] = SLOW,
    first: Annotated[int, "number of the first"] = 0,
    json_: Annotated[Path | None, "every reader, as JSON; those that it holds stay"] = None,
) -> None:
    """Table of readers, and a line for each mutation that is neither a result nor one line."""
    rows: dict[str, dict] = {}
    if json_ is not None and json_.exists():
        rows = json.loads(json_.read_text())
    for name in ROWS:
        if only not in name or name in rows:
            continue
        begin = time.process_time()
        with tempfile.TemporaryDirectory() as folder:
            result = outcome(name, Path(folder), range(first, first + number))
        seconds = time.process_time() - begin
        rows[name] = {"number": number, "seconds": seconds} | asdict(result)
        print(name, len(result.faults), file=sys.stderr, flush=True)
        if json_ is not None:
            json_.write_text(json.dumps(rows, indent=1))
    print("| reader | mutations | results | refused in one line | faults | processor time [s] |")
    print("|---|---|---|---|---|---|")
    for name, row in rows.items():
        counts = (row["number"], row["results"], row["refused"], len(row["faults"]))
        print(f"| {name} | {' | '.join(map(str, counts))} | {row['seconds']:.0f} |")
    for row in rows.values():
        print(*row["faults"], sep="\n", end="\n" * bool(row["faults"]))
