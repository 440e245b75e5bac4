"""The bars, or the lines of a log, that show a `mitsuba_cfs.progress.Progress`."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import TracebackType

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TaskID, TaskProgressColumn, TextColumn, TimeElapsedColumn

from mitsuba_cfs.files import json_text
from mitsuba_cfs.interpreter import own_paths, own_python
from mitsuba_cfs.progress import Stage, TimeLeft, spoken_left

NEXT_ITEM_S = 10.0  # of a log: items that are shorter do not get a line each
SILENCE_S = 60.0  # of a log: a longer stage says how far it is
REPORTED_S = 0.2  # of JSON lines: least time between two of one stage


@dataclass(slots=True)
class _Pass:
    """One time through a stage."""

    label: str
    started: float
    fraction: float = 0.0
    done: bool = False
    task: TaskID | None = None


class ProgressBar:
    """A `Progress` callback drawn on stderr: one bar per stage, in the order they come.

    A bar never moves backwards, and a ticked bar stays ticked: a stage that begins again gets a new
    bar.  Of items alike (`mitsuba_cfs.progress.item`) one bar says which is computed and how
    long the others take; only its own stages are shown.  Where stderr is no terminal, one line per
    finished stage, and lines of the items from time to time; with `cfs --progress json` one JSON
    object a line for other programs.  Use as a context manager:

        with ProgressBar() as progress:
            annual_run(..., progress=progress)
    """

    def __init__(self, *, terminal: bool | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        """Draw on a terminal or write lines; by default what stderr is."""
        self._json = os.environ.get("CFS_PROGRESS") == "json"
        self._terminal = sys.stderr.isatty() if terminal is None else terminal
        self._terminal = self._terminal and not self._json
        self._reported = ("", -REPORTED_S)  # label and time of the last JSON line
        self._clock = clock
        self._bars = Progress(
            SpinnerColumn(finished_text="[green]✓"),
            TextColumn("{task.description}", markup=False),
            BarColumn(bar_width=30),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            console=Console(stderr=True),
            redirect_stdout=sys.stdout.isatty(),  # into a file results go past the bars
        )
        self._passes: dict[str, list[_Pass]] = {}
        self._current: _Pass | None = None
        self._item: Stage | None = None
        self._items: TaskID | None = None  # the bar of the items
        self._items_done = 0.0  # what it shows
        self._left, self._seconds = TimeLeft(clock), None
        self._told = clock()  # when the log's last line was written
        self._begun = clock() - NEXT_ITEM_S  # when the log last told of an item

    def __enter__(self) -> ProgressBar:
        if self._terminal:
            self._bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if error is None and not self._json:
            self._finish(self._current)
            self._end_items()
        if self._terminal:
            self._bars.stop()

    def __call__(self, stage: str, fraction: float) -> None:
        """Show that `fraction` (0 to 1) of `stage` is done; a new stage ends the one before."""
        fraction = min(max(fraction, 0.0), 1.0)
        if self._json:
            self._report(stage, fraction)
            return
        if isinstance(stage, Stage):
            self._show_item(stage, fraction)
        elif stage != self._label and self._item is not None:
            self._finish(self._current)
            self._end_items()
        if stage:
            self._show_stage(str(stage), fraction)

    def _report(self, stage: str, fraction: float) -> None:
        """One JSON line: stage and fraction, of items their noun, number, total and time left."""
        now = self._clock()
        if stage == self._reported[0] and fraction < 1.0 and now < self._reported[1] + REPORTED_S:
            return
        self._reported = (str(stage), now)
        line: dict[str, str | int | float | None] = {"stage": str(stage), "fraction": fraction}
        if isinstance(stage, Stage):
            line |= {"item": stage.noun, "number": stage.number, "total": stage.total}
            line["left_s"] = self._left.seconds(stage, fraction)
        click.echo(json_text(line), err=True)

    @property
    def _label(self) -> str:
        return "" if self._current is None else self._current.label

    def _show_stage(self, label: str, fraction: float) -> None:
        one = self._pass_of(label, fraction)
        if one is None:
            return
        if one is not self._current:
            self._finish(self._current)
            self._current = one
        one.fraction = max(one.fraction, fraction)
        if self._terminal:
            if one.task is None:
                one.task = self._bars.add_task(one.label, total=1.0)
            self._bars.update(one.task, completed=one.fraction)
        elif one.fraction < 1.0 and self._clock() - self._told >= SILENCE_S:
            self._write(f"{one.label}: {100 * one.fraction:.0f} %{self._item_text(', ')}")
        if one.fraction >= 1.0:
            self._finish(one)

    def _pass_of(self, label: str, fraction: float) -> _Pass | None:
        """The pass through a stage that is under way, else a new one; None: it is over already."""
        passes = self._passes.setdefault(label, [])
        if passes and not passes[-1].done:
            return passes[-1]
        if passes and fraction >= 1.0:
            return None
        again = f" ({len(passes) + 1})" if passes else ""
        passes.append(_Pass(label + again, self._clock()))
        return passes[-1]

    def _finish(self, one: _Pass | None) -> None:
        if one is None or one.done:
            return
        one.done = True
        if one.task is not None:
            self._bars.update(one.task, completed=1.0)
        if not self._terminal:
            self._write(f"{one.label}: {self._clock() - one.started:.1f} s")

    def _show_item(self, stage: Stage, fraction: float) -> None:
        """Say which item is computed and how long the rest takes."""
        if self._item is not None and stage.noun != self._item.noun:
            self._finish(self._current)
            self._end_items()
        fresh = self._item is None or stage.number != self._item.number
        if fresh:
            self._finish(self._current)
            self._hide_stages()
        self._item = stage
        self._seconds = self._left.seconds(stage, fraction)
        if self._terminal:
            if self._items is None:
                self._items = self._bars.add_task("", total=1.0)
            done = stage.items_done(fraction) / stage.total
            self._items_done = max(self._items_done, done)
            text = self._item_text()
            self._bars.update(self._items, completed=self._items_done, description=text)
        elif fresh and self._clock() - self._begun >= NEXT_ITEM_S:
            self._begun = self._clock()
            self._write(self._item_text())

    def _item_text(self, before: str = "") -> str:
        """Such as "room 3 of 6, about 4 min left"; empty where there are no items."""
        if self._item is None:
            return ""
        left = spoken_left(self._seconds)
        text = f"{self._item.noun} {self._item.number} of {self._item.total}"
        return before + text + (f", {left}" if left else "")

    def _hide_stages(self) -> None:
        """Take the finished bars of the item before away."""
        if self._item is None:
            return
        for one in [p for passes in self._passes.values() for p in passes]:
            if one.task is not None and one.task > (self._items or 0):
                self._bars.update(one.task, visible=False)

    def _end_items(self) -> None:
        """Tick the items' bar."""
        if self._item is None:
            return
        self._hide_stages()
        if self._items is not None:
            noun, total = self._item.noun, self._item.total
            text = f"{total} {noun}{'s' if total > 1 else ''}"
            self._bars.update(self._items, completed=1.0, description=text)
        self._item, self._items, self._items_done = None, None, 0.0
        self._left, self._seconds = TimeLeft(self._clock), None

    def _write(self, line: str) -> None:
        self._told = self._clock()
        click.echo(line, err=True)


COMPILE = "from scenes.commands.progress_bar import compile_now; compile_now()"


@contextmanager
def compiled_beside() -> Iterator[None]:
    """Compile the heat balance in another process meanwhile, if it is not compiled yet.

    That process stores the compiled code in this process's cache; this process waits for it where
    it needs the code (`alone_in_compiling`), and compiles itself if the other failed.
    """
    from mitsuba_cfs.compiled import must_compile
    from thermal.kernel import advance

    if not must_compile(advance) or advance.stats.cache_path is None:
        yield
        return
    nowhere = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL}
    with subprocess.Popen(own_python("-c", COMPILE), env=own_paths(), stderr=subprocess.DEVNULL, **nowhere) as process:
        try:
            yield
        finally:
            process.terminate()


def compile_now() -> None:
    """Compile the glare of a picture, glazing, comfort and the heat balance by computing the smallest of each."""
    import numpy as np

    from mitsuba_cfs.compiled import alone_in_compiling
    from mitsuba_cfs.glare.evaluation import evaluate
    from mitsuba_cfs.images.view import fisheye
    from thermal.balance import simulate
    from thermal.climate import Climate, no_sun
    from thermal.comfort import pmv_ppd, standard_effective_temperature
    from thermal.glazing_unit import GlazingLayer, GlazingUnit
    from thermal.iso15099 import NFRC, unit_balance
    from thermal.kernel import advance
    from thermal.zone import Layer, OpaqueSurface, Zone

    day, up = np.zeros(24), np.array([0.0, 0.0, 1.0])
    roof = OpaqueSurface("roof", 10.0, (Layer(0.1, 1.0, 1000.0, 1000.0),), up)
    climate = Climate(day, day, day, day, day, day + 101325.0)
    picture = np.ones((64, 64), dtype=np.float32)
    picture[30:34:2, 30:34:2] = 1e5  # four sources that are one
    with alone_in_compiling(advance):  # in the order in which a room needs them
        evaluate(picture, fisheye((0, 0, 0), (0, 1, 0), 64))
        unit_balance(GlazingUnit((GlazingLayer(0.006, 0.8),)), NFRC[0])
        simulate(Zone("room", 30.0, (roof,)), climate, no_sun(24, 1, 0))
        pmv_ppd(day, day)
        standard_effective_temperature(day, day)
