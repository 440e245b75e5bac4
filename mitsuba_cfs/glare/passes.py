"""Compiled passes over a whole picture: into scan order with its sums, and the sums of sources."""

from __future__ import annotations

import numpy as np

from mitsuba_cfs.compiled import compiled

EFFICACY = 179.0  # [lm/W] of Radiance's white, for evalglare's rounding


@compiled(nogil=True)
def gather(luminance, weight, projected, picture):
    """Fill picture [nx, ny] in scan order from luminance [ny, nx], and its sums.

    evalglare keeps luminance / 179 in four bytes: the same rounding gives the same pixels above a
    threshold.  Pixels without weight become 0.

    Returns:
        illuminance at the eye [lx], sum of luminance x solid angle [cd/m2 sr], largest luminance
        [cd/m2], number of negative, infinite or NaN pixels (also among those without weight).
    """
    ny, nx = luminance.shape
    illuminance, flux, largest, bad = 0.0, 0.0, 0.0, 0
    tile = 32  # of columns: both arrays stay in the cache
    for start in range(0, nx, tile):
        end = min(start + tile, nx)
        for y in range(ny):
            row = ny - 1 - y
            for x in range(start, end):
                value = luminance[row, x]
                if not (0.0 <= value < np.inf):
                    bad += 1
                    continue
                omega = weight[x, y]
                if omega <= 0.0:
                    picture[x, y] = 0.0
                    continue
                rounded = EFFICACY * np.float64(np.float32(value / EFFICACY))
                picture[x, y] = rounded
                illuminance += projected[x, y] * rounded
                flux += omega * rounded
                largest = max(largest, rounded)
    return illuminance, flux, largest, bad


@compiled(nogil=True)
def brightest_of(labels, luminance, size):
    """Largest luminance [size] of each label [cd/m2]; that of 0 is 0."""
    brightest = np.zeros(size)
    nx, ny = labels.shape
    for x in range(nx):
        for y in range(ny):
            if labels[x, y] > 0:
                brightest[labels[x, y]] = max(brightest[labels[x, y]], luminance[x, y])
    return brightest


@compiled(nogil=True)
def renumber(labels, numbers, luminance, projected, count):
    """Replace labels [nx, ny] by numbers[label]; illuminance [count] [lx] of each number."""
    illuminance = np.zeros(count + 1)
    nx, ny = labels.shape
    for x in range(nx):
        for y in range(ny):
            label = labels[x, y]
            if label > 0:
                number = numbers[label]
                labels[x, y] = number
                illuminance[number] += luminance[x, y] * projected[x, y]
    return illuminance[1:]
