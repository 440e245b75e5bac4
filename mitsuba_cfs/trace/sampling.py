"""Random and low-discrepancy numbers keyed by the seed, the batch and the path number."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

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


def opaque(value: int | float, kind: type) -> object:
    """A number that may change between calls without a new compilation of the kernel."""
    return dr.opaque(kind, value)


def pixel_places(samples: int) -> NDArray[np.float64]:
    """Places [n, 2] within a pixel, evenly spread (R2 sequence)."""
    root = 1.324717957244746  # of x^3 = x + 1
    steps = np.arange(samples)[:, None] * np.array([1 / root, 1 / root**2])
    return np.mod(0.5 + steps, 1.0)
