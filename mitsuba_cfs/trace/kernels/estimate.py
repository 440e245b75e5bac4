"""Monte Carlo results with their standard error, from independent batches."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.errors import check_number
from mitsuba_cfs.matrices.cache import BatchMean, CacheEntry, MatrixCache
from mitsuba_cfs.progress import Progress, silent

BLOCKS = 8  # of the last axis, whose sums have a covariance
IN_CACHE = 1 << 14  # entries of an array
LEAST_BATCHES = 4  # before an error is believed
SAVE_SECONDS = 1.0  # a killed run loses this much work, or the batch under way if that is longer
SAVE_SHARE = 20.0  # ... or so many times what saving takes


@dataclass(frozen=True, slots=True, repr=False)
class Estimate:
    """An array estimated by Monte Carlo, with the standard error of each entry."""

    values: NDArray[np.float64]
    standard_error: NDArray[np.float64]  # same shape; of the mean, from the batches
    covariance: NDArray[np.float64]  # [..., R, R] of the sums of R blocks of the last axis
    batches: int
    seconds: float

    def __repr__(self) -> str:
        """Shape, error and time; not the numbers, which are many."""
        error = f"{self.relative_error:.2g}" if self.values.size else "0"
        return f"Estimate(shape={self.values.shape}, relative_error={error}, seconds={self.seconds:.3g})"

    @property
    def sum_error(self) -> NDArray[np.float64]:
        """Standard error of the sum over the last axis, whose entries may go together."""
        return np.sqrt(np.maximum(self.covariance.sum(axis=(-2, -1)), 0.0))

    def part(self, index: Any) -> Estimate:
        """The estimate of some entries; `index` leaves the last axis whole."""
        return replace(
            self,
            values=self.values[index],
            standard_error=self.standard_error[index],
            covariance=self.covariance[index],
        )

    def shaped(self, shape: tuple[int, ...]) -> Estimate:
        """The same entries as an array of another shape with the same last axis."""
        of_blocks = self.covariance.shape[-2:]
        return replace(
            self,
            values=self.values.reshape(shape),
            standard_error=self.standard_error.reshape(shape),
            covariance=self.covariance.reshape(*shape[:-1], *of_blocks),
        )

    def error_of(self, weights: ArrayLike) -> NDArray[np.float64]:
        """Standard error of the sum over the last axis of `values` times `weights` [..., K]."""
        error: NDArray[np.float64] = np.sqrt(self.variance_of(weights)[0])
        return error

    def variance_of(self, weights: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Variance v of the sum over the last axis of `values` times `weights` [..., K].

            v = sum m_r C_rs m_s + sum (w_k - m_r)^2 e_k^2

        with the covariance C of the sums of blocks r, m_r the mean weight in the block, and entries
        that differ from it taken as independent: exact for equal weights in each block.

        Returns: v, and the sum of v_i^2 / degrees of freedom over its independent parts v_i.
        """
        weights = np.asarray(weights, dtype=float)
        starts, sizes = blocks(self.values.shape[-1], self.covariance.shape[-1])
        mean = np.add.reduceat(weights, starts, axis=-1) / sizes
        together = np.einsum("...r,...rs,...s->...", mean, self.covariance, mean, optimize=True)
        together = np.maximum(together, 0.0)
        alone = ((weights - np.repeat(mean, sizes, axis=-1)) * self.standard_error) ** 2
        squares = together**2 + np.einsum("...k,...k->...", alone, alone)
        return together + alone.sum(axis=-1), squares / max(self.batches - 1, 1)

    def variances_of(self, weights: ArrayLike) -> NDArray[np.float64]:
        """Squares of `error_of` [n, K] of a matrix [n, P] for several weights at once [P, K]."""
        weights = np.asarray(weights, dtype=float)
        starts, sizes = blocks(self.values.shape[-1], self.covariance.shape[-1])
        mean = np.add.reduceat(weights, starts, axis=0) / sizes[:, None]
        together = np.einsum("rk,nrs,sk->nk", mean, self.covariance, mean, optimize=True)
        rest = (weights - np.repeat(mean, sizes, axis=0)) ** 2
        variance: NDArray[np.float64] = np.maximum(together, 0.0) + self.standard_error**2 @ rest
        return variance

    @property
    def relative_error(self) -> float:
        """Root mean square of the standard error over the root mean square of the values."""
        scale = float(np.sqrt(np.mean(self.values**2)))
        return float(np.sqrt(np.mean(self.standard_error**2))) / scale if scale > 0 else 0.0


def blocks(size: int, count: int = BLOCKS) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First entries and sizes of at most so many blocks of an axis, none of them empty."""
    ends = np.linspace(0, size, min(count, size) + 1).astype(np.int64)
    return ends[:-1], np.diff(ends)


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
        np.concatenate([e.covariance for e in estimates]),
        first.batches,
        sum(e.seconds for e in estimates),
    )


def accumulate(
    batch: Callable[[int], NDArray[np.float64]],
    *,
    stopping: Stopping | None = None,
    label: str = "",
    progress: Progress = silent,
    entry: CacheEntry | JoinedEntry | None = None,
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
        return estimate_of(state)
    mean = spread = covariance = np.zeros(())
    count, before = 0, 0.0
    if state is not None:
        mean, spread, covariance = state.mean, state.spread, state.covariance
        count, before = state.count, state.seconds
    keeper = _Keeper(entry, count)
    try:
        while True:
            values = batch(count)
            mean, spread, covariance = _with_another(values, mean, spread, covariance, count)
            count += 1
            state = BatchMean(count, mean, spread, covariance, before + time.monotonic() - start, False)
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
    return estimate_of(state)


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


@dataclass(frozen=True, slots=True)
class JoinedEntry:
    """The cache entries of several matrices that are traced as one, row after row."""

    entries: Sequence[CacheEntry]
    shapes: Sequence[tuple[int, ...]]  # of each matrix; the last axis is the same

    @property
    def _rows(self) -> list[slice]:
        ends = np.cumsum([0, *(math.prod(shape[:-1]) for shape in self.shapes)])
        return [slice(first, end) for first, end in pairwise(ends)]

    def load(self) -> BatchMean | None:
        """The state of all; None unless each has as many batches."""
        states = [entry.load() for entry in self.entries]
        some = [state for state in states if state is not None]
        if len(some) < len(states) or len({(one.count, one.finished) for one in some}) > 1:
            return None
        size = self.shapes[0][-1]

        def joined_of(name: str, last: int) -> NDArray[np.float64]:
            arrays = (getattr(one, name) for one in some)
            return np.concatenate([a.reshape(-1, *a.shape[a.ndim - last :]) for a in arrays])

        mean, spread = joined_of("mean", 1), joined_of("spread", 1)
        if mean.shape[-1] != size:
            return None
        seconds = sum(one.seconds for one in some)
        first = some[0]
        return BatchMean(first.count, mean, spread, joined_of("covariance", 2), seconds, first.finished)

    def save(self, state: BatchMean) -> None:
        """Write the state of each."""
        for entry, shape, rows in zip(self.entries, self.shapes, self._rows, strict=True):
            covariance = state.covariance[rows]
            of_blocks = covariance.shape[-2:]
            share = (rows.stop - rows.start) / len(state.mean)
            entry.save(
                BatchMean(
                    state.count,
                    state.mean[rows].reshape(shape),
                    state.spread[rows].reshape(shape),
                    covariance.reshape(*shape[:-1], *of_blocks),
                    state.seconds * share,
                    state.finished,
                )
            )


class _Keeper:
    """Saves states, seldom enough that saving takes a small share of the time."""

    def __init__(self, entry: CacheEntry | JoinedEntry | None, count: int) -> None:
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
    values: NDArray[np.float64], mean: Any, spread: Any, covariance: Any, count: int
) -> tuple[Any, Any, Any]:
    """Mean, sum of squares about it, and that of products of the blocks, with one more batch.

    They are other arrays than those before: a state that was given out stays as it is.
    """
    shape, count_of_rows, size = values.shape, math.prod(values.shape[:-1]), values.shape[-1]
    starts, _ = blocks(size)
    of_blocks = (*shape[:-1], len(starts), len(starts))
    if not count:  # about itself the first has none
        return np.array(values), np.zeros(shape, values.dtype), np.zeros(of_blocks)
    kind = np.result_type(values, mean)
    results = np.empty(shape, kind), np.empty(shape, kind), np.empty(of_blocks)
    rows = [one.reshape(count_of_rows, size) for one in (values, mean, spread, *results[:2])]
    rows_of_blocks = [one.reshape(count_of_rows, *of_blocks[-2:]) for one in (covariance, results[2])]
    for some in row_slices(count_of_rows, size):
        batch, old_mean, old_spread, new_mean, new_spread = (one[some] for one in rows)
        old, new = (one[some] for one in rows_of_blocks)
        step = batch - old_mean
        np.add(old_mean, step / (count + 1), out=new_mean)
        left = batch - new_mean
        first, second = (np.add.reduceat(one, starts, axis=-1) for one in (step, left))
        np.add(old, first[:, :, None] * second[:, None, :], out=new)
        left *= step
        np.add(left, old_spread, out=new_spread)
    return results


def row_slices(count: int, size: int) -> Iterator[slice]:
    """Slices of rows of so many entries, few enough that several arrays of them fit the processor's cache."""
    rows = max(IN_CACHE // max(size, 1), 1)
    for first in range(0, count, rows):
        yield slice(first, first + rows)


def estimate_of(state: BatchMean) -> Estimate:
    """Mean and standard error of the batches so far."""
    pairs = (state.count - 1) * state.count
    error = state.spread.astype(float)
    np.maximum(error, 0, out=error)
    error /= pairs
    np.sqrt(error, out=error)
    return Estimate(state.mean, error, state.covariance / pairs, state.count, state.seconds)


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
        error = estimate_of(state).relative_error
        fractions.append(1.0 if error <= stopping.target_error else (stopping.target_error / error) ** 2)
    return max(fractions)
