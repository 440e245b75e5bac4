"""Processes that work beside this one, and end with it however it ends."""

from __future__ import annotations

import os
import threading
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import connection, get_context, parent_process


def process_pool(processes: int) -> ProcessPoolExecutor:
    """A pool of fresh interpreters (Dr.Jit does not survive a fork).

    A worker of `concurrent.futures` waits for work for ever once its parent was killed; these end.
    """
    return ProcessPoolExecutor(
        processes, mp_context=get_context("spawn"), initializer=_end_with_parent
    )


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is None:
        return

    def watch() -> None:
        connection.wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, name="end-with-parent", daemon=True).start()
