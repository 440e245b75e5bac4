"""Radiance's four-byte pixels: shared exponent, and the run-length code of their scanlines.

A pixel is (r, g, b, e): value = (m + 1/2) 2^(e - 136), or 0 where e = 0.  A scanline is stored
flat, in the old code (1, 1, 1, n repeats the last pixel), or, for widths of 8 to 32767, in the new:
2, 2, width high, width low, then each of the four planes as runs (128 + n, byte) and literals.

Source: G. Ward, "Real Pixels", Graphics Gems II (1991), and Radiance's file format notes (facts).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.compiled import compiled

SHORTEST, LONGEST = 8, 32767  # widths that the new run-length code can hold


def pixels_from_rgbe(rgbe: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Values [..., 3] of four-byte pixels [..., 4]."""
    scale = np.ldexp(np.float32(1.0), np.arange(256) - 136).astype(np.float32)
    scale[0] = 0.0
    values = rgbe[..., :3].astype(np.float32)
    values += np.float32(0.5)
    values *= scale[rgbe[..., 3]][..., None]
    return values


def rgbe_from_pixels(pixels: NDArray) -> NDArray[np.uint8]:
    """Four-byte pixels [..., 4] of values [..., 3], cut off so that reading back has no bias."""
    pixels = np.asarray(pixels, dtype=np.float64)
    largest = pixels.max(axis=-1)
    lit = largest > 1e-32
    mantissa, exponent = np.frexp(np.where(lit, largest, 1.0))
    scale = np.where(lit, mantissa * 256.0 / np.where(lit, largest, 1.0), 0.0)
    rgbe = np.empty((*pixels.shape[:-1], 4), dtype=np.uint8)
    rgbe[..., :3] = np.minimum(pixels * scale[..., None], 255.0)
    rgbe[..., 3] = np.where(lit, exponent + 128, 0)
    return rgbe


@compiled(nogil=True)
def decode_scanlines(data, rgbe):
    """Fill rgbe [lines, width, 4] from the bytes `data`; the number of whole lines that it held."""
    lines, width = rgbe.shape[0], rgbe.shape[1]
    at, size = 0, data.shape[0]
    for line in range(lines):
        if at + 4 > size:
            return line
        new = (
            SHORTEST <= width <= LONGEST
            and data[at] == 2
            and data[at + 1] == 2
            and data[at + 2] < 128
        )
        if new:
            if (data[at + 2] << 8 | data[at + 3]) != width:
                return line
            at = _decode_planes(data, at + 4, rgbe[line])
        else:
            at = _decode_old(data, at, rgbe[line])
        if at < 0:
            return line
    return lines


@compiled(nogil=True)
def _decode_planes(data, at, scanline):
    """Read the four planes of one line; the place after them, or -1 where the data ends or lies."""
    width, size = scanline.shape[0], data.shape[0]
    for plane in range(4):
        column = 0
        while column < width:
            if at + 1 >= size:
                return -1
            count = int(data[at])
            at += 1
            run = count > 128
            if run:
                count -= 128
            if count == 0 or column + count > width or at + (1 if run else count) > size:
                return -1
            for step in range(count):
                scanline[column + step, plane] = data[at if run else at + step]
            at += 1 if run else count
            column += count
    return at


@compiled(nogil=True)
def _decode_old(data, at, scanline):
    """Read one flat or old-coded line; the place after it, or -1 where the data ends or lies."""
    width, size = scanline.shape[0], data.shape[0]
    column, shift = 0, 0
    while column < width:
        if at + 4 > size:
            return -1
        repeat = data[at] == 1 and data[at + 1] == 1 and data[at + 2] == 1
        if repeat:
            count = int(data[at + 3]) << shift
            if column == 0 or column + count > width or shift > 24:
                return -1
            for step in range(count):
                scanline[column + step] = scanline[column - 1]
            column += count
            shift += 8
        else:
            scanline[column] = data[at : at + 4]
            column += 1
            shift = 0
        at += 4
    return at


@compiled(nogil=True)
def _encode(rgbe, out):
    """Write the lines of rgbe [lines, width, 4] into `out` in the new code; the bytes used."""
    lines, width = rgbe.shape[0], rgbe.shape[1]
    at = 0
    for line in range(lines):
        out[at], out[at + 1], out[at + 2], out[at + 3] = 2, 2, width >> 8, width & 255
        at += 4
        for plane in range(4):
            column = 0
            while column < width:
                start, run = column, 0
                while start < width:  # find the next run of four or more equal bytes
                    run = 1
                    while (
                        start + run < width
                        and run < 127
                        and rgbe[line, start + run, plane] == rgbe[line, start, plane]
                    ):
                        run += 1
                    if run >= 4:
                        break
                    start += run
                    run = 0
                while column < start:
                    count = min(start - column, 128)
                    out[at] = count
                    for step in range(count):
                        out[at + 1 + step] = rgbe[line, column + step, plane]
                    at += 1 + count
                    column += count
                if run >= 4:
                    out[at], out[at + 1] = 128 + run, rgbe[line, start, plane]
                    at += 2
                    column += run
    return at


def encode_scanlines(rgbe: NDArray[np.uint8]) -> bytes:
    """The bytes of rgbe [lines, width, 4]: run-length coded where the width allows, else flat."""
    rgbe = np.ascontiguousarray(rgbe)
    lines, width, _ = rgbe.shape
    if not SHORTEST <= width <= LONGEST:
        return rgbe.tobytes()
    out = np.empty(lines * (4 + 4 * (width + width // 64 + 2)), dtype=np.uint8)
    return out[: _encode(rgbe, out)].tobytes()
