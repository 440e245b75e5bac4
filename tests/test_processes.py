"""A pool's processes end with the one that started them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

BUSY = """
import os, time
from mitsuba_cfs.processes import process_pool

if __name__ == "__main__":
    pool = process_pool(1)
    print(pool.submit(os.getpid).result(), flush=True)
    time.sleep(600)
"""


def test_workers_end_where_their_parent_is_killed(tmp_path):
    script = tmp_path / "busy.py"
    script.write_text(BUSY)
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True) as process:
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
