"""The same run and study again: other numbers of processes and threads, other states of the cache.

    python -m tests.validation repeated

`cfs run --quick` of two rooms and `cfs study` of two orientations, each variant in a folder of its
own; every file is compared with that of the first variant, tables by column.
"""

from __future__ import annotations

import os
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
TABLES = {".csv": pd.read_csv, ".parquet": pd.read_parquet}


def largest_difference(one: Path, other: Path) -> tuple[float, str]:
    """Of two tables: the largest difference by the largest value of its column, and the column."""
    pair = [TABLES[path.suffix](path) for path in (one, other)]
    if list(pair[0]) != list(pair[1]) or len(pair[0]) != len(pair[1]):
        return np.inf, "columns or rows"
    worst = (0.0, "")
    for column in pair[0]:
        a, b = (table[column] for table in pair)
        if not pd.api.types.is_float_dtype(a):
            same = a.equals(b)
            worst = max(worst, (0.0 if same else np.inf, str(column)))
        elif (gap := np.nanmax(abs(a - b), initial=0.0)) > 0 or (a.isna() != b.isna()).any():
            largest = max(np.nanmax(abs(a)), np.nanmax(abs(b)))
            worst = max(worst, (float(gap / largest) if gap > 0 else np.inf, str(column)))
    return worst


def compared(first: Path, other: Path) -> str:
    """Files, those that differ, and the largest difference of a table with its column."""
    files = sorted(path.relative_to(first) for path in first.rglob("*") if path.is_file())
    extra = {path.relative_to(other) for path in other.rglob("*") if path.is_file()} ^ set(files)
    differ = [
        file for file in files
        if file not in extra and (first / file).read_bytes() != (other / file).read_bytes()
    ]  # fmt: skip
    tables = [file for file in differ if file.suffix in TABLES]
    gaps = [(*largest_difference(first / file, other / file), file) for file in tables]
    worst = f"{max(gaps)[0]:.1e} ({max(gaps)[2]}, {max(gaps)[1]})" if gaps else "-"
    others = [str(file) for file in [*differ, *extra] if file not in tables]
    return f"{len(files) - len(differ)} of {len(files)} | {', '.join(others) or '-'} | {worst}"


def main() -> None:
    """One row for each variant."""
    print(
        "| command | variant | files of the same bytes | others | largest difference in a table |"
    )
    print("|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        study = folder / "study.toml"
        climate = f'[[climate]]\nname = "c"\nweather = "{WEATHER}"'
        text = STUDY.format(box=BOX, blind=VENETIAN_BLIND, rest=FEW_RAYS, climates=climate)
        study.write_text(f"orientations_deg = [0, 90]\n{text}", encoding="utf-8")
        commands = {
            "run": ["run", MODEL, "--weather", WEATHER, "--quick"],
            "study": ["study", study],
        }
        for command, words in commands.items():
            first: Path | None = None
            variants: list[tuple[str, str, dict[str, str]]] = [
                (f"{count} processes, empty cache", f"--processes={count}", {})
                for count in PROCESSES
            ]
            variants.insert(1, ("the same, cache of the first", "", {}))
            variants.append(("1 process, one thread of BLAS", "", {"OPENBLAS_NUM_THREADS": "1"}))
            for number, (label, option, environment) in enumerate(variants):
                warm = label.startswith("the same")
                cache = folder / f"cache_{command}_{number - warm}"
                out = folder / f"{command}_{number}"
                result = subprocess.run(
                    [sys.executable, "-m", "scenes.cli", *map(str, words), "--out", out,
                     *option.split()],
                    cwd=REPOSITORY, capture_output=True, text=True, check=False,
                    env=os.environ | environment | {"CFS_CACHE": str(cache)},
                )  # fmt: skip
                if result.returncode:
                    raise RuntimeError(result.stderr)
                first = first or out
                print(f"| {command} | {label} | {compared(first, out)} |", flush=True)
