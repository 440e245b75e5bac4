"""Processes of our own end with the one that started them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

POOL = """
import os, time
from mitsuba_cfs.processes import process_pool

if __name__ == "__main__":
    pool = process_pool(1)
    print(pool.submit(os.getpid).result(), flush=True)
    time.sleep(600)
"""
APART = """
from mitsuba_cfs.processes import answer_apart
from tests.test_processes import sleeps

answer_apart(sleeps, limit_s=600, told=lambda line: print(line, flush=True))
"""


def sleeps(tell):
    """Tells its process and stays at work."""
    tell(str(os.getpid()))
    time.sleep(600)


@pytest.mark.parametrize("busy", [POOL, APART], ids=["pool", "apart"])
def test_workers_end_where_their_parent_is_killed(tmp_path, busy):
    script = tmp_path / "busy.py"
    script.write_text(busy)
    root = str(Path(__file__).parents[1])
    environment = os.environ | {"PYTHONPATH": root}
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True, env=environment) as process:
        worker = int(process.stdout.readline())
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        limit = time.monotonic() + 60  # s: a busy machine
        while running(worker) and time.monotonic() < limit:
            time.sleep(0.05)
        still = running(worker)
        if still:
            os.kill(worker, signal.SIGKILL)
    assert not still


def running(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


INTERRUPTED = """
import threading
from mitsuba_cfs.processes import answer_apart
from tests.test_processes import sleeps

begin = threading.Timer.start

def start(timer):
    begin(timer)
    raise KeyboardInterrupt

threading.Timer.start = start
answer_apart(sleeps, limit_s=600)
"""


def test_a_signal_at_the_start_of_a_task_ends_the_program():
    """It comes while the timer of the task starts; the exit would wait for that for 600 s."""
    root = Path(__file__).parents[1]
    process = subprocess.run(
        [sys.executable, "-c", INTERRUPTED], cwd=root, capture_output=True, text=True, timeout=120, check=False
    )
    assert process.stderr.rstrip().endswith("KeyboardInterrupt")
