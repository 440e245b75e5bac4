"""Random and low-discrepancy numbers keyed by the seed, the batch and the path number."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.images.view import View, pixel_rays
from mitsuba_cfs.surfaces import even_numbers

SHIFT_ROUNDS = 8
AT_ONCE = 1 << 15  # rays computed in the processor's cache
PADDED = 1 << 21  # sums from which on their number is what is asked for
ALIGNMENT = 64  # of memory that kernels load whole vectors from [bytes]
_DIMENSIONS = 6  # dimensions of the lattice; later decisions of a path are random


def _lattice_generators(dimensions: int) -> list[int]:
    """32-bit fixed-point generators of the R-sequence (Roberts 2018), a Kronecker sequence.

    The generators are powers of the inverse of the real root of x^(d+1) = x + 1.
    """
    root = 2.0
    for _ in range(64):
        root = (1 + root) ** (1 / (dimensions + 1))
    return [round(root**-k * 2**32) | 1 for k in range(1, dimensions + 1)]


_GENERATORS = _lattice_generators(_DIMENSIONS)


def lattice(sample: mi.UInt32, stream: mi.UInt32, dimension: int) -> mi.Float:
    """Point `sample` of a randomly shifted lattice in one dimension, in [0, 1).

    `stream` keys the shift: samples of one stream are stratified against each other, streams are
    independent.  Wraps exactly in 32-bit integers.
    """
    # Four rounds, or keys next to each other, leave the shifts of two dimensions dependent
    pair, member = divmod(dimension, 2)
    key = mi.UInt32((0x9E3779B9 + pair * 0x85EBCA6B) & 0xFFFFFFFF)
    shift = mi.sample_tea_32(stream, key, SHIFT_ROUNDS)[member]
    bits = sample * mi.UInt32(_GENERATORS[dimension] & 0xFFFFFFFF) + shift
    return mi.Float(bits >> 8) * float(2**-24)


def lattice_2d(sample: mi.UInt32, stream: mi.UInt32, dimension: int) -> mi.Point2f:
    """Two neighbouring dimensions of the shifted lattice."""
    return mi.Point2f(lattice(sample, stream, dimension), lattice(sample, stream, dimension + 1))


def streams(number: NDArray[np.integer], seed: int) -> mi.UInt32:
    """Streams [n] of `lattice` of pixels or rows, others with each seed."""
    return column((number + seed * 1_000_003) & 0xFFFFFFFF, mi.UInt32)


def path_generator(path: mi.UInt32, seed: mi.UInt32) -> mi.PCG32:
    """Random generator keyed by the global path number: chunks do not change the result."""
    a, b = mi.sample_tea_32(path, seed)
    return mi.PCG32(initstate=mi.UInt64(a), initseq=mi.UInt64(b))


def batch_key(seed: int, number: int) -> mi.UInt32:
    """Key of a batch of a seed, distinct from those of neighbouring seeds."""
    return dr.opaque(mi.UInt32, (seed * 1_000_003 + number) & 0xFFFFFFFF)


def opaque(value: int | float, kind: type | None = None) -> Any:
    """A number that may change between calls without compiling the kernel again.

    Args: kind: `mi.Float` by default.
    """
    kind = mi.Float if kind is None else kind
    return dr.opaque(kind, float(value) if kind is mi.Float else int(value))


def opaque_vector(values: ArrayLike) -> mi.Vector3f:
    """A direction that may change between calls without compiling the kernel again."""
    return mi.Vector3f(*map(opaque, np.asarray(values, dtype=float)))


def column(values: ArrayLike, kind: type | None = None) -> Any:
    """Values [n] as a kernel's argument, one for each lane, in aligned memory.

    Dr.Jit compiles one kernel for memory aligned to the width of its vectors and another for any
    other; NumPy's memory may be either.

    Args: kind: `mi.Float` by default.
    """
    kind = mi.Float if kind is None else kind
    names = {mi.Float: np.float32, mi.UInt32: np.uint32, mi.UInt64: np.uint64, mi.Bool: np.bool_}
    given = np.asarray(values, dtype=names[kind])
    memory = np.empty(given.nbytes + ALIGNMENT, dtype=np.uint8)
    start = -memory.ctypes.data % ALIGNMENT
    aligned = memory[start : start + given.nbytes].view(given.dtype)
    aligned[:] = given
    return kind(aligned)


def vectors(table: ArrayLike, kind: type | None = None) -> Any:
    """A table [n, 3] as a kernel's argument, by columns: as a whole, its n would be compiled in.

    Args: kind: `mi.Vector3f` by default.
    """
    return (mi.Vector3f if kind is None else kind)(*map(column, np.asarray(table).T))


def tables(*arrays: Any) -> list[NDArray[Any]]:
    """Results of a kernel from one launch: vectors as tables [n, 3], the others as [n]."""
    dr.eval(*arrays)
    return [
        np.stack(np.broadcast_arrays(*(axis.numpy() for axis in one)), axis=1) if dr.depth_v(one) > 1 else one.numpy()
        for one in arrays
    ]


def empty_sums(count: int) -> mi.Float64:
    """At least `count` zeros for a kernel to add to; `sums_of` reads them.

    Dr.Jit gives each thread a copy of small targets and compiles their size into the kernel: a
    power of two, so that few kernels differ in it.
    """
    return dr.zeros(mi.Float64, count if count > PADDED else 1 << (count - 1).bit_length())


def sums_of(sums: mi.Float64, shape: Sequence[int]) -> NDArray[np.float64]:
    """Sums of a kernel as an array of a shape."""
    return sums.numpy()[: math.prod(shape)].reshape(shape)


class Ranges:
    """Lanes in consecutive ranges, such as one for each room; kernels know no count of either."""

    STEPS = 8  # of the search: kernels differ by so many halvings of the table

    def __init__(self, counts: ArrayLike) -> None:
        """From the number of lanes of each range [R]."""
        ends = np.cumsum(np.asarray(counts, dtype=np.int64))
        self.total = int(ends[-1])
        self.firsts = ends - counts  # [R]
        if self.total >= 2**32:
            raise ValueError(f"{self.total} lanes: a launch must stay below 2**32")
        self._first = column(self.firsts, mi.UInt32)
        self._last = len(ends) - 1

    def of(self, lane: mi.UInt32) -> tuple[mi.UInt32, mi.UInt32]:
        """The range of each lane, and its number within it."""
        low, high = mi.UInt32(0), opaque(self._last, mi.UInt32)
        for _ in range(-(-max(self._last, 1).bit_length() // self.STEPS) * self.STEPS):
            middle = (low + high + 1) >> 1
            reached = dr.gather(mi.UInt32, self._first, middle) <= lane
            low, high = dr.select(reached, middle, low), dr.select(reached, high, middle - 1)
        return low, lane - dr.gather(mi.UInt32, self._first, low)


class DiscreteDistribution:
    """Discrete sampling by weights; unlike `mi.DiscreteDistribution`, its kernels know no count.

    Weights may be those of several groups, of which each lane samples one.
    """

    STEPS = 4  # of the search: kernels differ by so many halvings of the table

    def __init__(self, weights: NDArray[np.float64], group: NDArray[np.integer] | None = None) -> None:
        """From weights [n], not all zero in any group, and their groups [n], rising from 0."""
        weights = np.asarray(weights, dtype=np.float32)
        group = np.zeros(len(weights), dtype=np.int64) if group is None else np.asarray(group, int)
        starts = np.flatnonzero(np.diff(group, prepend=-1))
        climbed = np.concatenate([np.cumsum(part, dtype=float) for part in np.split(weights, starts[1:])])
        some = np.flatnonzero(weights > 0)
        if len(np.unique(group[some])) < len(starts):
            raise ValueError("weights: expected one above 0 in each group")
        first = some[np.searchsorted(group[some], np.arange(len(starts)))]
        last = some[np.searchsorted(group[some], np.arange(len(starts)), side="right") - 1]
        total = climbed[np.append(starts[1:], len(weights)) - 1].astype(np.float32)
        self._weight, self._climbed = mi.Float(weights), mi.Float(climbed.astype(np.float32))
        ends = (first, last, starts)
        self._first, self._last, self._start = (column(table, mi.UInt32) for table in ends)
        self._sum, self._norm = column(total), column(np.float32(1) / total)
        most = int((last - first).max()) + 1
        self._steps = -(-most.bit_length() // self.STEPS) * self.STEPS

    def sample_reuse(
        self, u: mi.Float, active: mi.Bool = True, group: mi.UInt32 | None = None
    ) -> tuple[mi.UInt32, mi.Float]:
        """The sampled number for u in [0, 1), and u rescaled to [0, 1) within its share.

        Args: group: of each lane; all lanes sample the first group by default.
        """

        def of_group(table: Any) -> Any:
            return table if group is None else dr.gather(type(table), table, group, active)

        low, high, start = map(of_group, (self._first, self._last, self._start))
        mark, norm = u * of_group(self._sum), of_group(self._norm)
        low, high = mi.UInt32(low), mi.UInt32(high)
        for _ in range(self._steps):
            middle = (low + high) >> 1
            above = dr.gather(mi.Float, self._climbed, middle, active) < mark
            low = dr.select(above, dr.minimum(middle + 1, high), low)
            high = dr.select(above, high, middle)
        share = dr.gather(mi.Float, self._weight, low, active) * norm
        before = dr.gather(mi.Float, self._climbed, low - 1, active & (low > start)) * norm
        return low, (u - before) / share


def pixel_positions(samples: int) -> NDArray[np.float64]:
    """Positions [n, 2] within a pixel, evenly spread (R2 sequence)."""
    return even_numbers(samples)


def spread_rays(view: View, pixels: NDArray[np.int64], samples: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Rays [n * samples, 3] evenly spread over some pixels [n], and which of them exist."""
    across, down = pixel_positions(samples).T
    directions, exists = np.empty((len(pixels), samples, 3)), np.empty((len(pixels), samples), dtype=bool)
    size = max(1, AT_ONCE // samples)
    for start in range(0, len(pixels), size):
        part = slice(start, start + size)
        directions[part], exists[part] = pixel_rays(view, pixels[part, None], across, down)
    return directions.reshape(-1, 3), exists.reshape(-1)
