"""Accuracy and speed against other programs: `python -m tests.benchmarks [NAME ...]`.

The names are those of the comparisons and of the scripts; `--list` prints both, and no name runs
all comparisons.  A script takes the options after its name.

    ratio = (their time x their error^2) / (our time x our error^2)

first in elapsed time, then in processor time.  Kernels are compiled before the clock starts.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.benchmarks import harness
from tests.scripts import USAGE, run_script, scripts

PACKAGE = "tests.benchmarks"


def main(arguments: Sequence[str]) -> int:
    """Run the benchmarks that the arguments name; the exit code."""
    if arguments and arguments[0] in scripts(PACKAGE):
        return run_script(PACKAGE, arguments)
    parser = argparse.ArgumentParser(prog=f"python -m {PACKAGE}", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--list", action="store_true", help="print the names and stop")
    parser.add_argument("--json", type=Path, help="write every figure to this file")
    options = parser.parse_args(arguments)
    comparisons = harness.benchmarks()
    if options.list:
        print("\n".join([*comparisons, ""]))
        return run_script(PACKAGE, ["--list"])
    unknown = [name for name in options.names if name not in comparisons]
    if unknown:
        parser.exit(USAGE, f"no benchmark {unknown[0]!r}; there are {', '.join(comparisons)}\n")
    if options.json is not None and not options.json.absolute().parent.is_dir():
        parser.exit(USAGE, f"--json: no folder {options.json.absolute().parent}\n")
    records = []
    for name in options.names or comparisons:
        try:
            result = comparisons[name](_no_progress)
        except harness.PeerMissing as missing:
            print(f"{name}: left out, {missing}")
            continue
        records.append(result.record())
        print(table(result), flush=True)
        if options.json is not None:  # after each, so that an interrupted run keeps what it has
            options.json.write_text(json.dumps(records, indent=1) + "\n")
    if not records:
        print("no benchmark could run", file=sys.stderr)
    return 0 if records else 1


def _no_progress(stage: str, fraction: float) -> None:
    """Progress of a benchmark is not shown."""


def table(result: harness.Comparison) -> str:
    """The outcome as a few lines."""
    lines = [f"{result.name}: {result.of}"]
    for run in (result.ours, result.peer):
        error = "" if run.error is None else f"   error {run.error:.3g}"
        lines.append(f"  {run.program:<12} {run.seconds:9.3f} s   processor {run.cpu_seconds:9.3f} s{error}")
    lines.append(f"  ratio {result.ratio:.1f}, in processor time {result.cpu_ratio:.1f}")
    lines += [f"  {result.note}"] if result.note else []
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
