"""Random and low-discrepancy numbers keyed by the seed, the batch and the path number."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

SHIFT_ROUNDS = 8
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


def path_generator(path: mi.UInt32, seed: mi.UInt32) -> mi.PCG32:
    """The random generator of one path, keyed by its number: chunks do not change the result."""
    a, b = mi.sample_tea_32(path, seed)
    return mi.PCG32(initstate=mi.UInt64(a), initseq=mi.UInt64(b))


def opaque(value: int | float, kind: type | None = None) -> Any:
    """A number that may change between calls without a new compilation of the kernel.

    Args: kind: `mi.Float` by default.
    """
    kind = mi.Float if kind is None else kind
    return dr.opaque(kind, float(value) if kind is mi.Float else int(value))


def opaque_vector(values: ArrayLike) -> mi.Vector3f:
    """A direction that may change between calls without a new compilation of the kernel."""
    return mi.Vector3f(*map(opaque, np.asarray(values, dtype=float)))


def vectors(table: ArrayLike, kind: type | None = None) -> Any:
    """A table [n, 3] as a kernel takes it, axis by axis: as a whole its n would be a literal.

    Args: kind: `mi.Vector3f` by default.
    """
    columns = np.ascontiguousarray(np.asarray(table, dtype=np.float32).T)
    return (mi.Vector3f if kind is None else kind)(*map(mi.Float, columns))


def tables(*found: Any) -> list[NDArray[Any]]:
    """What a kernel gives, all from one launch: vectors as tables [n, 3], the others as [n]."""
    dr.eval(*found)
    return [
        np.stack(np.broadcast_arrays(*(axis.numpy() for axis in one)), axis=1)
        if dr.depth_v(one) > 1
        else one.numpy()
        for one in found
    ]


class DiscreteDistribution:
    """Numbers drawn by weights, as `mi.DiscreteDistribution`, whose kernels hang on their count."""

    STEPS = 4  # of the search: kernels differ by so many halvings of the table

    def __init__(self, weights: NDArray[np.float64]) -> None:
        """From weights [n], not all zero."""
        weights = np.asarray(weights, dtype=np.float32)
        climbed = np.cumsum(weights, dtype=float)
        some = np.flatnonzero(weights > 0)
        self._first, self._last = (opaque(end, mi.UInt32) for end in (some[0], some[-1]))
        self._weight, self._climbed = mi.Float(weights), mi.Float(climbed.astype(np.float32))
        self._sum = opaque(climbed[-1])
        self._norm = opaque(np.float32(1) / np.float32(climbed[-1]))
        self._steps = -(-int(some[-1] - some[0] + 1).bit_length() // self.STEPS) * self.STEPS

    def sample_reuse(self, u: mi.Float, active: mi.Bool = True) -> tuple[mi.UInt32, mi.Float]:
        """The number that u in [0, 1) stands for, and u within its share, in [0, 1) again."""
        mark, low, high = u * self._sum, mi.UInt32(self._first), mi.UInt32(self._last)
        for _ in range(self._steps):
            middle = (low + high) >> 1
            above = dr.gather(mi.Float, self._climbed, middle, active) < mark
            low = dr.select(above, dr.minimum(middle + 1, high), low)
            high = dr.select(above, high, middle)
        share = dr.gather(mi.Float, self._weight, low, active) * self._norm
        before = dr.gather(mi.Float, self._climbed, low - 1, active & (low > 0)) * self._norm
        return low, (u - before) / share


def pixel_places(samples: int) -> NDArray[np.float64]:
    """Places [n, 2] within a pixel, evenly spread (R2 sequence)."""
    root = 1.324717957244746  # of x^3 = x + 1
    steps = np.arange(samples)[:, None] * np.array([1 / root, 1 / root**2])
    return np.mod(0.5 + steps, 1.0)
