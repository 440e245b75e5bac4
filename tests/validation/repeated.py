"""The same run and study again: other numbers of processes and threads, other states of the cache.

    python -m tests.validation repeated

`cfs run --quick` of two rooms and `cfs study` of two orientations, each variant in a folder of its
own; every file is compared with that of the first variant, tables by column.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from scenes.demo import VENETIAN_BLIND, WEATHER
from tests.conftest import REPOSITORY
from tests.scenes.study_files import BOX, FEW_RAYS
from tests.validation.places import STUDY

MODEL = REPOSITORY / "docs" / "tutorials" / "two_rooms.hbjson"
PROCESSES = (1, 2, 4)
TIME = re.compile("^seconds$|_s$")  # columns of computing times


def columns_of(path: Path) -> dict[str, np.ndarray] | None:
    """The columns of a table, or the arrays of a case; None for another file."""
    if path.suffix == ".npz":
        with np.load(path) as data:
            return {name: data[name] for name in data.files if name != "record"}  # holds times
    readers = {".csv": pd.read_csv, ".parquet": pd.read_parquet}
    if path.suffix not in readers:
        return None
    table = readers[path.suffix](path)
    return {name: table[name].to_numpy() for name in table if not TIME.search(name)}


def largest_difference(one: dict, other: dict) -> tuple[float, str]:
    """The largest difference by the largest value of its column, and that column."""
    if list(one) != list(other):
        return np.inf, "columns"
    worst = (0.0, "")
    for name, a in one.items():
        b = other[name]
        if a.shape != b.shape:
            return np.inf, name
        if a.dtype.kind != "f":
            gap = 0.0 if pd.Series(a.ravel()).equals(pd.Series(b.ravel())) else np.inf
        elif (np.isnan(a) != np.isnan(b)).any():
            gap = np.inf
        else:
            a, b = (x[~np.isnan(x)].astype(float) for x in (a, b))
            gap = abs(a - b).max(initial=0.0) / max(abs(a).max(initial=0.0), 1e-300)
        worst = max(worst, (float(gap), name))
    return worst


def compared(first: Path, other: Path) -> str:
    """Files of the same content, others than tables, and the largest difference of a table."""
    files = sorted(path.relative_to(first) for path in first.rglob("*") if path.is_file())
    extra = {path.relative_to(other) for path in other.rglob("*") if path.is_file()} ^ set(files)
    differ = [
        file for file in files if file not in extra and (first / file).read_bytes() != (other / file).read_bytes()
    ]
    gaps, others = [], [str(file) for file in extra]
    for file in differ:
        pair = columns_of(first / file), columns_of(other / file)
        if pair[0] is None or pair[1] is None:
            others.append(str(file))
        elif (gap := largest_difference(pair[0], pair[1]))[0] > 0:
            gaps.append((*gap, str(file)))
    worst = f"{max(gaps)[0]:.1e} ({max(gaps)[2]}, {max(gaps)[1]})" if gaps else "-"
    same = len(files) - len(gaps) - len(others)
    return f"{same} of {len(files)} | {', '.join(others) or '-'} | {worst}"


def main() -> None:
    """One row for each variant."""
    columns = (
        "command",
        "variant",
        "files of the same content, times apart",
        "others that differ",
        "largest difference in a table",
    )
    print("| " + " | ".join(columns) + " |")
    print("|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        study = folder / "study.toml"
        climate = f'[[climate]]\nname = "c"\nweather = "{WEATHER}"'
        text = STUDY.format(box=BOX, blind=VENETIAN_BLIND, rest=FEW_RAYS, climates=climate)
        study.write_text(f"orientations_deg = [0, 90]\n{text}", encoding="utf-8")
        commands = {"run": ["run", MODEL, "--weather", WEATHER, "--quick"], "study": ["study", study]}
        for command, words in commands.items():
            first: Path | None = None
            variants: list[tuple[str, str, dict[str, str]]] = [
                (f"--processes {count}, empty cache", f"--processes={count}", {}) for count in PROCESSES
            ]
            variants.insert(1, ("the same, cache of the first", "", {}))
            variants.append(("--processes 1, one thread of BLAS", "", {"OPENBLAS_NUM_THREADS": "1"}))
            for number, (label, option, environment) in enumerate(variants):
                warm = label.startswith("the same")
                cache = folder / f"cache_{command}_{number - warm}"
                out = folder / f"{command}_{number}"
                result = subprocess.run(
                    [sys.executable, "-m", "scenes.cli", *map(str, words), "--out", out, *option.split()],
                    cwd=REPOSITORY,
                    capture_output=True,
                    text=True,
                    check=False,
                    env=os.environ | environment | {"CFS_CACHE": str(cache)},
                )
                if result.returncode:
                    raise RuntimeError(result.stderr)
                first = first or out
                print(f"| {command} | {label} | {compared(first, out)} |", flush=True)
