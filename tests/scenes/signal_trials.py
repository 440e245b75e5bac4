"""A command that writes, ended by signals at a random moment; the number of a trial is its seed."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
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
PROMPT_S = 2.0  # after a signal, in which a result may still take its place
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


@dataclass(frozen=True, slots=True)
class Earlier:
    """A command's earlier result in a folder, where trials follow each other."""

    place: Place
    environment: dict[str, str]
    scratch: Path
    content: dict[str, bytes]
    seconds: float  # that it took

    @classmethod
    def of(cls, command: str, folder: Path) -> Earlier:
        """Make it. Args: folder: empty."""
        place = Place(JOBS[command], folder / "inputs", folder / "results" / JOBS[command].name)
        scratch = folder / "tmp"
        for one in (place.inputs, place.out.parent, scratch):
            one.mkdir()
        environment = os.environ | {"TMPDIR": str(scratch), "CFS_CACHE": str(folder / "cache")}
        begin = time.monotonic()
        process = _started("tests.scenes.quick_work", place, environment)
        _, text = process.communicate(timeout=LIMIT_S)
        if process.returncode:
            raise RuntimeError(f"{command}: {text}")
        seconds = time.monotonic() - begin
        return cls(place, environment, scratch, place.content(), seconds)

    @property
    def unchanged(self) -> bool:
        """Whether the result is still that one, without files left beside it."""
        return self.content == self.place.content() and not self.left()

    def left(self) -> list[Path]:
        """Temporary files."""
        return [*self.place.temporaries(), *self.scratch.iterdir()]


def trial(number: int, earlier_of: Callable[[str], Earlier]) -> Trial:
    """Start a command on an earlier result of it, and send signals."""
    chance = random.Random(number)
    command = chance.choice(sorted(JOBS))
    kind = chance.choice(sorted(SIGNALS))
    earlier = earlier_of(command)
    place, environment, longest = earlier.place, earlier.environment, earlier.seconds
    traces = command.split()[0] in TRACING
    after = chance.uniform(0.0, max(longest, LONGEST_S) if traces else longest)
    again = chance.uniform(0.0, 0.5)
    shutil.rmtree(place.out / "cases", ignore_errors=True)  # made-up ones, and those of trials
    process = _started("scenes.cli", place, environment)
    try:
        _, text = process.communicate(timeout=after)
        return Trial(number, command, kind, after, "before it", 0.0, ())
    except subprocess.TimeoutExpired:
        sent, sent_at = time.monotonic(), time.time()
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
    if (code in BY_PYTHON or "KeyboardInterrupt" in text) and " in main\n" not in text:
        ended = "before the program began"
    elif "Traceback" in text or "Exception ignored" in text:
        faults.append(f"traceback: {text.strip().splitlines()[-1][:80]}")
    elif code == 0:
        ended = "before it"
        late = place.newest() - sent_at
        if late > PROMPT_S:
            faults.append(f"the signal was lost: a result {late:.1f} s after it, exit code 0")
    elif code != expected:
        faults.append(f"exit code {code}")
    elif not text.rstrip().endswith(WORDS[expected]):
        faults.append(f"last line: {text.rstrip()[-60:]}")
    if left := earlier.left():
        faults.append(f"left {', '.join(sorted(one.name for one in left))}")
    one_file = not place.job.folder  # takes its place at once: the one or the other
    if ended != "before it" and not one_file and place.content() != earlier.content:
        faults.append("the earlier result has changed")
    return Trial(number, command, kind, after, ended, seconds, tuple(faults))


def _started(module: str, place: Place, environment: dict[str, str]) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-m", module, *place.words],
        cwd=REPOSITORY,
        env=environment,
        text=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        stdin=subprocess.DEVNULL,
        preexec_fn=default_signals,
    )
