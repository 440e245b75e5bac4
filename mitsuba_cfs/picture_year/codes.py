"""Sharp parts of a picture as one byte per pixel: few levels, each the mean of its values.

Sunlit patches have true edges and nearly one luminance on each face, so that the bytes of a picture
deflate to a thousandth of it.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LEVELS = 255  # and 0 for none
STEP = 0.04  # of the logarithm between levels, at least
DEFLATED = -15  # raw deflate, as a browser inflates it
SMALL = 1e-3  # of the logarithm: what levels of one step may leave out


@dataclass(frozen=True, slots=True)
class Codes:
    """One level for each pixel, 0 for none."""

    level: NDArray[np.float32]  # [k] level of the codes 1..k
    code: NDArray[np.uint8]  # [n]

    def values(self, otherwise: float) -> NDArray[np.float32]:
        """The level [n] of each pixel, `otherwise` for none."""
        return np.append(np.float32(otherwise), self.level)[self.code]


def coded(values: NDArray[np.floating], chosen: NDArray[np.bool_]) -> Codes:
    """Codes of positive values [n] at chosen pixels [n]."""
    code = np.zeros(len(values), dtype=np.uint8)
    if not chosen.any():
        return Codes(np.empty(0, dtype=np.float32), code)
    logarithm = np.log(values[chosen].astype(float))
    low, high = logarithm.min(), logarithm.max()
    step = max(STEP, (high - low) / (LEVELS - 1) + SMALL)
    place = np.round((logarithm - low) / step).astype(np.int64)
    used, number = np.unique(place, return_inverse=True)
    total = np.bincount(number, values[chosen].astype(float), minlength=len(used))
    level = total / np.bincount(number, minlength=len(used))
    code[chosen] = number + 1
    return Codes(level.astype(np.float32), code)


def packed(*parts: Codes) -> bytes:
    """Several codes, concatenated and deflated; b"" for none.

    Counts of levels (16 bits each), levels (32-bit numbers), then a byte for each place; little
    end first.
    """
    if not any(len(part.level) for part in parts):
        return b""
    counts = np.array([len(part.level) for part in parts], dtype="<u2").tobytes()
    levels = b"".join(part.level.astype("<f4").tobytes() for part in parts)
    codes = b"".join(part.code.tobytes() for part in parts)
    press = zlib.compressobj(9, zlib.DEFLATED, DEFLATED)
    return press.compress(counts + levels + codes) + press.flush()


def unpacked(data: bytes, sizes: tuple[int, ...]) -> list[Codes]:
    """The codes in `packed` for parts of these lengths."""
    if not data:
        empty = np.empty(0, dtype=np.float32)
        return [Codes(empty, np.zeros(size, dtype=np.uint8)) for size in sizes]
    raw = zlib.decompress(data, DEFLATED)
    counts = np.frombuffer(raw, "<u2", len(sizes))
    at, levels, result = 2 * len(sizes), [], []
    for count in counts.tolist():
        levels.append(np.frombuffer(raw, "<f4", count, at))
        at += 4 * count
    for level, size in zip(levels, sizes, strict=True):
        result.append(Codes(level, np.frombuffer(raw, np.uint8, size, at)))
        at += size
    return result
