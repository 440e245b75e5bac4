"""Order of many whole numbers, of which several make one key."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def order_of(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """The order [n] of numbers of 0 or more, equal ones as they come."""
    bits = len(keys).bit_length()
    if keys.max(initial=0) >> (63 - bits):
        return np.argsort(keys, kind="stable")
    # by numbers that hold both, which NumPy sorts several times as fast as it finds an order
    both = keys << bits
    both += np.arange(len(keys))
    both.sort()
    both &= (1 << bits) - 1
    return both


def joint_keys(columns: NDArray[np.integer]) -> NDArray[np.int64]:
    """Numbers of 0 or more for columns [d, n], in their order, the first row's before all others."""
    keys = np.zeros(columns.shape[1], dtype=np.int64)
    for row in columns if keys.size else ():
        low, high = int(row.min()), int(row.max())
        keys *= high - low + 1
        keys += row
        keys -= low
    return keys
