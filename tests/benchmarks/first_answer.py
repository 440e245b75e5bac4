"""Seconds from the prompt to a command's first error, and to its first result, as a user waits.

    python -m tests.benchmarks first_answer --repository . [--repository OLDER] [--json FILE]

Every command is started as a process of its own on the demo's files, a mistaken line and a good
one.  The mistake is in an option or a small file beside a building that takes a while to read
(`--building`).  "Result" is the first line on stdout; the cache of matrices is empty for each.
With two repositories their turns alternate, so that both have the same machine.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

from scenes.demo import make_facade

NO_RESULT = ("A quick run", "note:")  # lines before the first numbers
BOX = """
weather = "{weather}"
{more}
[box]
width = 3.0
depth = 4.0
height = 2.8
facing_deg = 180.0
[[box.window]]
x = 0.5
sill = 0.9
width = 2.0
height = 1.5
[[system]]
bsdf = "{system}"
u_value = 1.4
"""
STUDY = """
[[room]]
name = "box"
[room.box]
width = 3.0
depth = 4.0
height = 2.8
[[room.box.window]]
x = 0.5
sill = 0.9
width = 2.0
height = 1.5
[[system]]
name = "blind"
bsdf = "{system}"
[[climate]]
name = "Chicago"
weather = "{weather}"
"""


@dataclass(frozen=True)
class Answer:
    """How long one line took."""

    command: str
    kind: str  # mistake or result
    seconds: float  # until the first line of the answer
    processor: float  # of the process, until its end [s]
    exit_code: int
    line: str


def lines(folder: Path, building: Path, demo: Path) -> Iterator[tuple[str, str, list[str]]]:
    """Command, kind and arguments of every line that is timed."""
    office, weather = demo / "office.ifc", next(demo.glob("*.epw"))
    system = demo / "venetian_blind.xml"
    files = {"weather": weather, "system": system}
    bad = {name: folder / name for name in ("bad.epw", "bad.xml", "bad.toml", "bad.hdr")}
    for file in bad.values():
        file.write_text("nothing of use\n")
    heat, study = folder / "heat.toml", folder / "study.toml"
    heat.write_text(BOX.format(**files, more=""))
    study.write_text(STUDY.format(**files))
    wrong = folder / "wrong.toml"
    wrong.write_text(BOX.format(**files, more="[air]\nnight = [22, 61]\n"))
    of_run = ["--weather", weather, "--cfs", system, "--out", folder / "run"]
    of_bad = [*of_run[:2], "--cfs", bad["bad.xml"], *of_run[4:]]
    yield "run, BSDF", "mistake", ["run", building, *of_bad]
    yield "run, weather", "mistake", ["run", building, "--weather", bad["bad.epw"], *of_run[2:]]
    yield "run, hour", "mistake", ["run", building, *of_run, "--picture", "13-45 99"]
    yield "run", "result", ["run", office, *of_run, "--quick"]
    yield "run, house", "result", ["run", building, *of_run, "--quick"]
    of_dgp = ["--weather", weather, "--cfs", bad["bad.xml"], "--out", folder / "dgp"]
    yield "dgp", "mistake", ["dgp", building, *of_dgp]
    yield (
        "dgp",
        "result",
        ["dgp", office, "--weather", weather, "--cfs", system, "--size", "100", "--out", folder / "dgp"],
    )
    at = ["--at", "06-21 12:00", "--size", "64", "--out", folder / "picture.png"]
    of_picture = ["--weather", weather, "--cfs", system, *at]
    yield "picture", "mistake", ["picture", building, *of_picture, "--at", "noon"]
    yield "picture", "result", ["picture", office, *of_picture]
    yield "thermal", "mistake", ["thermal", wrong, "--out", folder / "heat"]
    yield "thermal", "result", ["thermal", heat, "--out", folder / "heat"]
    yield "study", "mistake", ["study", bad["bad.toml"], "--out", folder / "study"]
    yield "study", "result", ["study", study, "--out", folder / "study"]
    of_pv = ["--weather", weather, "--out", folder / "pv"]
    yield "pv", "mistake", ["pv", building, "--study", bad["bad.toml"], *of_pv]
    facade = folder / "facade.ifc"
    make_facade.facade().write(str(facade))
    yield "pv", "result", ["pv", facade, "--study", demo / "facade_pv.toml", *of_pv]
    yield "ifc check", "mistake", ["check", bad["bad.toml"]]
    yield "ifc check", "result", ["check", building]
    yield "bsdf check", "mistake", ["bsdf", "check", bad["bad.xml"]]
    yield "bsdf check", "result", ["bsdf", "check", system]
    yield "sky sun", "mistake", ["sky", "positions", bad["bad.epw"], folder / "sun.csv"]
    yield "glare", "mistake", ["glare", bad["bad.hdr"]]
    yield "help", "result", ["--help"]
    yield "sky cie help", "result", ["sky", "cie", "--help"]
    yield "thermal help", "result", ["thermal", "--help"]
    yield "doctor", "result", ["doctor"]


def answer(repository: Path, command: str, kind: str, arguments: list[str]) -> Answer:
    """Run one line of `cfs` from a checkout, and see when it answers."""
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "PYTHONPATH": str(repository), "CFS_CACHE": cache}
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        start = time.perf_counter()
        process = subprocess.Popen(
            [sys.executable, "-m", "scenes.cli", *map(str, arguments)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=repository,
            env=environment,
        )
        if kind == "result":
            line = next((said for said in process.stdout if not said.startswith(NO_RESULT)), "")
            seconds = time.perf_counter() - start
            process.communicate()
        else:
            _, told = process.communicate()
            seconds, line = time.perf_counter() - start, told.strip().splitlines()[-1:]
            line = line[0] if line else ""
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Answer(command, kind, round(seconds, 2), round(processor, 2), process.returncode, line.strip())


def main(
    *,
    repository: Sequence[Path],
    building: Annotated[Path | None, "IFC file beside the mistakes"] = None,
    only: Annotated[str | None, "lines whose name begins so"] = None,
    json_: Path | None = None,
) -> None:
    """Time all lines and print a table."""
    demo = repository[0].absolute() / "scenes" / "demo"
    building = (building or demo / "office.ifc").absolute()
    found: list[list[Answer]] = []
    with tempfile.TemporaryDirectory() as place:
        for command, kind, arguments in lines(Path(place), building, demo):
            if only and not command.startswith(only):
                continue
            row = []
            for checkout in repository:
                for name in ("run", "dgp", "heat", "study", "pv"):
                    shutil.rmtree(Path(place) / name, ignore_errors=True)
                row.append(answer(checkout.absolute(), command, kind, arguments))
            found.append(row)
            cells = [f"{a.seconds:7.2f} s {a.processor:7.2f} s exit {a.exit_code}" for a in row]
            print(f"{command:14} {kind:8} " + "   ".join(cells), flush=True)
            print(f"    {row[-1].line[:110]}", flush=True)
    if json_:
        json_.write_text(json.dumps([[asdict(a) for a in row] for row in found], indent=1))
