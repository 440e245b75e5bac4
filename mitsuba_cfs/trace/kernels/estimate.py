"""Monte Carlo results with their standard error, from independent batches."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.errors import check_number
from mitsuba_cfs.matrices.cache import BatchMean, CacheEntry, MatrixCache
from mitsuba_cfs.progress import Progress, silent

LEAST_BATCHES = 4  # before an error is believed
SAVE_SECONDS = 1.0  # a killed run loses this much work, or the batch under way if that is longer
SAVE_SHARE = 20.0  # ... or so many times what saving takes


@dataclass(frozen=True, slots=True)
class Estimate:
    """An array estimated by Monte Carlo, with the standard error of each entry."""

    values: NDArray[np.float64]
    standard_error: NDArray[np.float64]  # same shape; of the mean, from the batches
    sum_error: NDArray[np.float64]  # of the sum over the last axis, whose entries may go together
    batches: int
    seconds: float

    def part(self, index: Any) -> Estimate:
        """The estimate of some entries; `index` leaves the last axis whole."""
        return replace(
            self,
            values=self.values[index],
            standard_error=self.standard_error[index],
            sum_error=self.sum_error[index],
        )

    def error_of(self, weights: ArrayLike) -> NDArray[np.float64]:
        """Standard error of the sum over the last axis of `values` times `weights` [..., K].

        Exact for equal weights; for others the entries are taken to go together as much as there.
        """
        alone = np.sqrt((self.standard_error**2).sum(axis=-1))
        together = np.divide(self.sum_error, alone, out=np.ones_like(alone), where=alone > 0)
        weights = np.asarray(weights, dtype=float)
        return together * np.sqrt((self.standard_error**2 * weights**2).sum(axis=-1))

    @property
    def relative_error(self) -> float:
        """Root mean square of the standard error over the root mean square of the values."""
        scale = float(np.sqrt(np.mean(self.values**2)))
        return float(np.sqrt(np.mean(self.standard_error**2))) / scale if scale > 0 else 0.0


@dataclass(frozen=True, slots=True)
class Stopping:
    """When to stop adding batches: at a relative error, after a time, or after so many batches."""

    batches: int = 16
    target_error: float | None = None  # relative error of `Estimate.relative_error`
    time_limit: float | None = None  # [s]
    max_batches: int = 100_000

    def __post_init__(self) -> None:
        check_number("batches", self.batches, 2, whole=True)  # for a standard error
        check_number("max_batches", self.max_batches, 1, whole=True)
        for name in ("target_error", "time_limit"):
            if getattr(self, name) is not None:
                check_number(name, getattr(self, name), 0.0)

    def ahead(self, count: int) -> int:
        """How many more batches are certain to follow the first `count`, the next included."""
        known = self.target_error is None and self.time_limit is None
        return max(min(self.batches, self.max_batches) - count, 1) if known else 1


def joined(estimates: Sequence[Estimate]) -> Estimate:
    """One estimate from several, stacked along the first axis."""
    first = estimates[0]
    if len(estimates) == 1:
        return first
    return Estimate(
        np.concatenate([e.values for e in estimates]),
        np.concatenate([e.standard_error for e in estimates]),
        np.concatenate([e.sum_error for e in estimates]),
        first.batches,
        sum(e.seconds for e in estimates),
    )


def accumulate(
    batch: Callable[[int], NDArray[np.float64]],
    *,
    stopping: Stopping | None = None,
    label: str = "",
    progress: Progress = silent,
    entry: CacheEntry | None = None,
) -> Estimate:
    """Mean of the batches `batch(0)`, `batch(1)`, ... and the standard error of that mean.

    Batches are independent estimates of the same array.  Without a target or a time limit exactly
    `stopping.batches` are run; with one, at least 4 and until the condition holds.

    Args:
        entry: in the cache of matrices.  A finished result there is returned; an unfinished one is
            continued as if it had never stopped.
    """
    stopping = stopping or Stopping()
    start = time.monotonic()
    state = entry.load() if entry is not None else None
    if state is not None and state.finished:
        progress(label, 1.0)
        return _estimate(state)
    mean = spread = sum_spread = np.zeros(())
    count, before = 0, 0.0
    if state is not None:
        mean, spread, sum_spread = state.mean, state.spread, state.sum_spread
        count, before = state.count, state.seconds
    keeper = _Keeper(entry, count)
    try:
        while True:
            values = batch(count)
            mean, spread, sum_spread = _with_another(values, mean, spread, sum_spread, count)
            count += 1
            state = BatchMean(
                count, mean, spread, sum_spread, before + time.monotonic() - start, False
            )
            fraction = _fraction_done(state, stopping)
            progress(label, min(fraction, 1.0))
            if fraction >= 1.0 or count >= stopping.max_batches:
                break
            keeper.offer(state)
    except BaseException:
        keeper.save(state)
        raise
    # no batch follows: seven digits of the error are enough
    state = replace(state, finished=True, spread=state.spread.astype(np.float32))
    keeper.save(state)
    return _estimate(state)


def cache_entry(
    cache: MatrixCache | None, label: str, *inputs: object, by: str, stopping: Stopping | None
) -> CacheEntry | None:
    """The cache entry of a traced matrix; None without a cache.

    The variant is an input too: CUDA and LLVM round differently.

    Args: by: name of the module that traces it.
    """
    if cache is None:
        return None
    return cache.entry(label, mi.variant(), stopping or Stopping(), *inputs, by=by)


class _Keeper:
    """Saves states, seldom enough that saving takes a small share of the time."""

    def __init__(self, entry: CacheEntry | None, count: int) -> None:
        self._entry = entry
        self._saved = (count, False)
        self._next = time.monotonic() + SAVE_SECONDS

    def offer(self, state: BatchMean) -> None:
        """Save the state if the last one is old enough."""
        if time.monotonic() >= self._next:
            self.save(state)

    def save(self, state: BatchMean | None) -> None:
        """Save the state unless it is saved already."""
        if self._entry is None or state is None or (state.count, state.finished) == self._saved:
            return
        start = time.monotonic()
        self._entry.save(state)
        end = time.monotonic()
        self._saved = (state.count, state.finished)
        self._next = end + max(SAVE_SECONDS, SAVE_SHARE * (end - start))


def _with_another(
    values: NDArray[np.float64], mean: Any, spread: Any, sum_spread: Any, count: int
) -> tuple[Any, Any, Any]:
    """Mean, sum of squares about it, and that of the last axis' sums, with one more batch."""
    if not count:  # about itself the first has none
        return np.array(values), np.zeros_like(values), np.zeros(values.shape[:-1])
    step = values - mean
    mean = mean + step / (count + 1)
    left = values - mean
    sum_spread = sum_spread + step.sum(axis=-1) * left.sum(axis=-1)
    left *= step  # the states given out hold other arrays
    left += spread
    return mean, left, sum_spread


def _estimate(state: BatchMean) -> Estimate:
    """Mean and standard error of the batches so far."""
    pairs = (state.count - 1) * state.count
    error = np.sqrt(np.maximum(state.spread.astype(float), 0) / pairs)
    sum_error = np.sqrt(np.maximum(state.sum_spread, 0) / pairs)
    return Estimate(state.mean, error, sum_error, state.count, state.seconds)


def _fraction_done(state: BatchMean, stopping: Stopping) -> float:
    """Progress towards the first stopping condition, 1 when it holds."""
    if stopping.time_limit is None and stopping.target_error is None:
        return state.count / stopping.batches
    if state.count < LEAST_BATCHES:
        return 0.0
    fractions = [0.0]
    if stopping.time_limit is not None:
        fractions.append(state.seconds / stopping.time_limit)
    if stopping.target_error is not None:
        error = _estimate(state).relative_error
        fractions.append(
            1.0 if error <= stopping.target_error else (stopping.target_error / error) ** 2
        )
    return max(fractions)
