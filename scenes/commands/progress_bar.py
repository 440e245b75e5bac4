"""The bar that shows a `mitsuba_cfs.progress.Progress` on the terminal."""

from __future__ import annotations

import sys
import time
from types import TracebackType

import click
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    SpinnerColumn,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
)


class ProgressBar:
    """A `Progress` callback drawn on stderr: one bar per stage, in the order they come.

    Where stderr is no terminal, one line per finished stage. Use as a context manager:

        with ProgressBar() as progress:
            annual_run(..., progress=progress)
    """

    def __init__(self, *, terminal: bool | None = None) -> None:
        """Draw on a terminal or write lines; by default what stderr is."""
        self._terminal = sys.stderr.isatty() if terminal is None else terminal
        self._bars = Progress(
            SpinnerColumn(finished_text="[green]✓"),
            TextColumn("{task.description}"),
            BarColumn(bar_width=30),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            console=Console(stderr=True),
        )
        self._tasks: dict[str, TaskID] = {}
        self._started: dict[str, float] = {}
        self._written: set[str] = set()
        self._current: str | None = None

    def __enter__(self) -> ProgressBar:
        if self._terminal:
            self._bars.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if error is None:
            self._finish(self._current)
        if self._terminal:
            self._bars.stop()

    def __call__(self, stage: str, fraction: float) -> None:
        """Show that `fraction` (0 to 1) of `stage` is done; a new stage ends the one before."""
        if stage != self._current:
            self._finish(self._current)
            self._current = stage
        self._started.setdefault(stage, time.perf_counter())
        if self._terminal:
            if stage not in self._tasks:
                self._tasks[stage] = self._bars.add_task(stage, total=1.0)
            self._bars.update(self._tasks[stage], completed=min(max(fraction, 0.0), 1.0))
        if fraction >= 1.0:
            self._finish(stage)

    def _finish(self, stage: str | None) -> None:
        if stage is None:
            return
        if self._terminal:
            self._bars.update(self._tasks[stage], completed=1.0)
        elif stage not in self._written:
            self._written.add(stage)
            seconds = time.perf_counter() - self._started[stage]
            click.echo(f"{stage}: {seconds:.1f} s", err=True)
