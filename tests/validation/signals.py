"""Signals at random moments over all commands that write (`tests.scenes.signal_trials`).

    python -m tests.validation signals --trials 200 [--first 0] [--json FILE]

The number of a trial is its seed: command, signal and moment follow from it, as a share of the
time that the command takes on this machine.
"""

from __future__ import annotations

import json
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from tests.scenes.signal_trials import SIGNALS, Earlier, Trial, trial


def main(
    *,
    trials: Annotated[int, "number of trials"] = 200,
    first: Annotated[int, "seed of the first"] = 0,
    json_: Annotated[Path | None, "every trial, as JSON; none of these is tried again"] = None,
) -> None:
    """Table of trials by signal, and one line for each fault."""
    results: list[Trial] = []
    if json_ is not None and json_.exists():
        results = [Trial(**one) for one in json.loads(json_.read_text())]
    done = {one.number for one in results}
    with tempfile.TemporaryDirectory() as folder:
        earlier: dict[str, Earlier] = {}

        def earlier_of(command: str) -> Earlier:
            """A result that no trial has changed."""
            if command not in earlier or not earlier[command].unchanged:
                earlier[command] = Earlier.of(command, Path(tempfile.mkdtemp(dir=folder)))
            return earlier[command]

        for number in sorted(set(range(first, first + trials)) - done):
            one = trial(number, earlier_of)
            results.append(one)
            print(
                one.number,
                one.command,
                one.kind,
                f"{one.after_s:.2f}",
                one.ended,
                f"{one.seconds:.1f}",
                "; ".join(one.faults),
                file=sys.stderr,
                flush=True,
            )
            if json_ is not None:
                json_.write_text(json.dumps([asdict(one) for one in results], indent=1))
    print(
        "| signal | trials | ended by it | before the program began | ended before | faults |"
        " longest time to the end [s] |"
    )
    print("|---|---|---|---|---|---|---|")
    for kind in SIGNALS:
        rows = [one for one in results if one.kind == kind]
        ways = ("by the signal", "before the program began", "before it")
        counts = [sum(one.ended == way for one in rows) for way in ways]
        faults = sum(bool(one.faults) for one in rows)
        longest = max((one.seconds for one in rows), default=0.0)
        print(f"| {kind} | {len(rows)} | {' | '.join(map(str, counts))} | {faults} | {longest:.1f} |")
    for one in results:
        for fault in one.faults:
            print(f"trial {one.number}: {one.command}, {one.kind} after {one.after_s:.2f} s: {fault}")
