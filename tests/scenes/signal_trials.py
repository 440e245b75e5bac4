"""A command that writes, ended by signals at a random moment; the number of a trial is its seed."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from tests.conftest import REPOSITORY, default_signals
from tests.scenes.writing_jobs import JOBS, Place

SIGNALS = {
    "SIGTERM": (signal.SIGTERM,),
    "SIGHUP": (signal.SIGHUP,),
    "SIGINT": (signal.SIGINT,),
    "SIGINT twice": (signal.SIGINT, signal.SIGINT),
}
CODES = {signal.SIGTERM: 143, signal.SIGHUP: 129, signal.SIGINT: 130}
WORDS = {143: "terminated", 129: "terminated", 130: "interrupted"}
TRACING = ("run", "demo", "comply", "pv", "dgp", "study", "picture", "calibrate", "thermal")
LONGEST_S = 20.0  # until the signal of a command that traces rays
LIMIT_S = 120.0  # until a process has to have ended
BY_PYTHON = (-signal.SIGTERM, -signal.SIGHUP, -signal.SIGINT)  # before the program has begun


@dataclass(frozen=True, slots=True)
class Trial:
    """What a signal did to a command."""

    number: int
    command: str
    kind: str  # of `SIGNALS`
    after_s: float  # from the start of the process to the signal
    ended: str  # "by the signal", "before it", or "before the program began"
    seconds: float  # from the signal to the end
    faults: tuple[str, ...]


def trial(number: int, folder: Path) -> Trial:
    """Start a command on an earlier result of it, and send signals.

    Args: folder: empty.
    """
    chance = random.Random(number)
    command = chance.choice(sorted(JOBS))
    kind = chance.choice(sorted(SIGNALS))
    place = Place(JOBS[command], folder / "inputs", folder / "results" / JOBS[command].name)
    scratch = folder / "tmp"
    for one in (place.inputs, place.out.parent, scratch):
        one.mkdir()
    environment = os.environ | {"TMPDIR": str(scratch), "CFS_CACHE": str(folder / "cache")}
    begin = time.monotonic()
    earlier = _started("tests.scenes.quick_work", place, environment)
    _, text = earlier.communicate(timeout=LIMIT_S)
    if earlier.returncode:
        raise RuntimeError(f"{command}: {text}")
    longest = time.monotonic() - begin
    before = place.content()
    traces = command.split()[0] in TRACING
    after = chance.uniform(0.0, max(longest, LONGEST_S) if traces else longest)
    again = chance.uniform(0.0, 0.5)
    process = _started("scenes.cli", place, environment)
    try:
        _, text = process.communicate(timeout=after)
        return Trial(number, command, kind, after, "before it", 0.0, ())
    except subprocess.TimeoutExpired:
        sent = time.monotonic()
        for index, one in enumerate(SIGNALS[kind]):
            time.sleep(again * bool(index))
            process.send_signal(one)
    try:
        _, text = process.communicate(timeout=LIMIT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        return Trial(number, command, kind, after, "by the signal", LIMIT_S, ("did not end",))
    seconds = time.monotonic() - sent
    if os.environ.get("SHOW"):
        print(text)
    code, expected = process.returncode, CODES[SIGNALS[kind][0]]
    faults = []
    ended = "by the signal"
    if code in BY_PYTHON and " in main\n" not in text:
        ended = "before the program began"
    elif "Traceback" in text or "Exception ignored" in text:
        faults.append(f"traceback: {text.strip().splitlines()[-1][:80]}")
    elif code == 0:
        ended = "before it"
    elif code != expected:
        faults.append(f"exit code {code}")
    elif not text.rstrip().endswith(WORDS[expected]):
        faults.append(f"last line: {text.rstrip()[-60:]}")
    if place.temporaries() or any(scratch.iterdir()):
        left = [*place.temporaries(), *scratch.iterdir()]
        faults.append(f"left {', '.join(sorted(one.name for one in left))}")
    if ended != "before it" and place.content() != before:
        faults.append("the earlier result has changed")
    return Trial(number, command, kind, after, ended, seconds, tuple(faults))


def _started(module: str, place: Place, environment: dict[str, str]) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-m", module, *place.words], cwd=REPOSITORY, env=environment,
        text=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL,
        preexec_fn=default_signals,
    )  # fmt: skip
