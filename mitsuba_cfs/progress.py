"""Progress of long computations, reported to a callback."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

Progress = Callable[[str, float], None]
"""Called with a stage's label and the fraction of that stage done, 0 to 1.

A stage is gone through once: its fraction does not fall, and what is done again has another label.
"""

LEAST = 0.05  # share of an item after which the remaining time is shown


class Stage(str):
    """Label of a stage with the number of its item, such as room 3 of 6.

    An empty label is that of items without stages of their own.
    """

    __slots__ = ("noun", "number", "total", "whole")
    noun: str
    number: int
    total: int
    whole: bool

    def __new__(cls, label: str, noun: str, number: int, total: int, *, whole: bool = False) -> Stage:
        """Label of a stage of item `number` of `total`; whole: the stage is all of the item."""
        stage = super().__new__(cls, label)
        stage.noun, stage.number, stage.total, stage.whole = noun, number, total, whole
        return stage

    def items_done(self, fraction: float) -> float:
        """Number of finished items at a `fraction` of this stage."""
        return self.number - 1 + (fraction if self.whole else 0.0)


def silent(stage: str, fraction: float) -> None:
    """Ignore progress: the default of every function that reports it."""


def part(progress: Progress, start: float, end: float, stage: str | None = None) -> Progress:
    """A `Progress` that fills only `start` to `end` of the outer one.

    For a step of one stage; with `stage` it appears under that label.  See `summed` for a step of
    several stages.
    """
    if not 0.0 <= start <= end <= 1.0:
        raise ValueError(f"expected 0 <= start <= end <= 1, got {start} and {end}")

    def inner(label: str, fraction: float) -> None:
        progress(stage or label, start + (end - start) * fraction)

    return inner


def summed(progress: Progress, stage: str, shares: Mapping[str, float]) -> Progress:
    """A `Progress` that joins consecutive steps of known shares into one stage."""
    total, bounds, before = sum(shares.values()), {}, 0.0
    for label, share in shares.items():
        bounds[label] = before / total, (before + share) / total
        before += share

    def inner(label: str, fraction: float) -> None:
        start, end = bounds[label]
        progress(stage, (1.0 - fraction) * start + fraction * end)  # exactly the end at its end

    return inner


def in_shares(progress: Progress, shares: Mapping[str, float]) -> Progress:
    """A `Progress` that scales stages with a share to it; other stages stay whole."""

    def inner(label: str, fraction: float) -> None:
        progress(label, shares.get(label, 1.0) * fraction)

    return inner


def item(progress: Progress, noun: str, number: int, total: int, name: str = "", *, whole: bool = False) -> Progress:
    """A `Progress` of item `number` (from 1) of `total` similar ones: rooms, views, passes.

    Args:
        name: set before the label of each stage.
        whole: the item has one stage, whose fraction is the item's and whose label is the name.
    """
    before = f"{name}: " if name else ""

    def inner(label: str, fraction: float) -> None:
        label = name if whole else before + label
        alone = total == 1 and not whole
        stage = label if alone else Stage(label, noun, number, total, whole=whole)
        progress(stage, fraction)

    return inner


class TimeLeft:
    """Estimate of the remaining time from the durations of finished items."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._first: tuple[float, float] | None = None  # items done, time [s]
        self._last = (0.0, 0.0)

    def seconds(self, stage: Stage, fraction: float) -> float | None:
        """Remaining seconds; None before enough of the first item is done."""
        done, now = stage.items_done(fraction), self._clock()
        if self._first is None:
            self._first = self._last = (done, now)
        if done > self._last[0]:
            self._last = (done, now)
        items, taken = self._last[0] - self._first[0], self._last[1] - self._first[1]
        if items < LEAST:
            return None
        left = (stage.total - self._last[0]) * taken / items
        return max(left - (now - self._last[1]), 0.0)


def spoken_left(seconds: float | None) -> str:
    """The remaining time in words, rounded to its accuracy; empty for None."""
    if seconds is None:
        return ""
    if seconds < 95:
        return f"about {max(round(seconds / 10), 1) * 10} s left"
    if seconds < 95 * 60:
        return f"about {round(seconds / 60)} min left"
    return f"about {round(seconds / 1800) / 2:g} h left"
