"""What tests share a machine by: one core a worker, garbage collected rarely.

Two workers on two cores, each with two threads of OpenBLAS and two of Dr.Jit that wait for one
another by spinning, and collections that go through all modules and tests over and over took a
third of the processor's time. Dr.Jit has as many threads as the process may use cores, and what a
test starts inherits that.
"""

from __future__ import annotations

import gc
import os

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")

if "PYTEST_XDIST_WORKER" in os.environ:  # before NumPy is imported, which reads them once
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    if hasattr(os, "sched_setaffinity"):
        cores = sorted(os.sched_getaffinity(0))
        own = int(os.environ["PYTEST_XDIST_WORKER"].removeprefix("gw")) % len(cores)
        os.sched_setaffinity(0, {cores[own]})
gc.set_threshold(100_000, 50, 100)


def pytest_collection_finish() -> None:
    """pytest's hook: what is imported and collected stays, and need not be looked through."""
    gc.collect()
    gc.freeze()
