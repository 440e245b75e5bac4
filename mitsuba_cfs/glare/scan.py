"""Compiled scans that group bright pixels into glare sources, in evalglare's order.

Which source a pixel joins depends on the order in which pixels are visited, so the order is part of
the method: columns from left to right, in each column upwards.  All arrays here are in that order,
[x, y] with y = 0 at the bottom.  Labels count from 1; 0 is no source.

Two pixels are near when twice the angle between them is at most the search radius.  The dot product
of a unit vector with itself can exceed 1 by rounding; evalglare's arc cosine then has no value, and
the pixel is not near itself.  That ends the search of its row, so it is kept.
"""

from __future__ import annotations

import math

import numpy as np

from mitsuba_cfs.compiled import compiled

COUNT, OMEGA, FLUX, FLUX_X, FLUX_Y = range(5)  # columns of the sums of a source


@compiled(nogil=True, inline="always")
def near(directions, x, y, other_x, other_y, radius, cosine):
    """Whether twice the angle between two pixels is at most `radius`; cosine = cos(radius/2)."""
    dot = (
        directions[x, y, 0] * directions[other_x, other_y, 0]
        + directions[x, y, 1] * directions[other_x, other_y, 1]
        + directions[x, y, 2] * directions[other_x, other_y, 2]
    )
    if dot > 1.0 or dot < cosine - 1e-9:
        return False
    return dot > cosine + 1e-9 or 2.0 * math.acos(dot) <= radius


@compiled(nogil=True)
def search(labels, directions, omega, x, y, radius, cosine, reach, own, lowest, highest):
    """A label near pixel (x, y), or 0.

    With own = 0 the first labelled pixel found counts (only columns up to x are searched); else the
    first whose source is larger than `own` and than what was found before.  The rows below come
    first, then those above, and what is found above replaces what was found below.  Each row is
    walked left and right from the middle of the previous row's extent.
    """
    nx, ny = labels.shape
    last_x = x if own == 0 else nx - 1
    found = 0
    largest = omega[own] if own > 0 else 0.0
    for step_y in (-1, 1):
        left, right = x, x
        row = y if step_y < 0 else y + 1
        done = False
        while not done and 0 <= row < ny and abs(row - y) <= reach:
            for step_x in (-1, 1):
                column = (left + right) // 2
                while not done and 0 <= column <= last_x:
                    if not near(directions, x, y, column, row, radius, cosine):
                        if step_x < 0:
                            left = column + 1
                        else:
                            right = column - 1
                        break
                    label = labels[column, row]
                    if label > 0:
                        if own == 0:
                            found, done = label, True
                        elif omega[label] > largest and lowest <= label <= highest:
                            found, largest, done = label, omega[label], True
                    column += step_x
            row += step_y
    return found


@compiled(nogil=True)
def label_bright(luminance, valid, directions, threshold, radius, reach, follow):
    """First scan: labels [nx, ny] of the pixels above the threshold, and how many there are.

    `follow`: a pixel whose lower neighbour is bright takes its label without a search.
    """
    nx, ny = luminance.shape
    labels = np.zeros((nx, ny), dtype=np.int32)
    no_omega = np.zeros(1)
    cosine = math.cos(min(radius / 2, math.pi))
    count = 0
    for x in range(nx):
        last = 0
        for y in range(ny):
            if luminance[x, y] > threshold:  # few are: asked first
                if not valid[x, y]:
                    continue
                label = last
                if last == 0 or not follow:
                    label = search(labels, directions, no_omega, x, y, radius, cosine, reach, 0, 0, 0)
                if label == 0:
                    count += 1
                    label = count
                labels[x, y] = label
                last = label
            elif last > 0 and valid[x, y]:
                last = 0
    return labels, count


@compiled(nogil=True)
def sum_sources(labels, luminance, solid_angle, size):
    """Sums [size, 5] of pixels, solid angle, luminance x solid angle, and its moments in x, y."""
    sums = np.zeros((size, 5))
    nx, ny = labels.shape
    for x in range(nx):
        for y in range(ny):
            label = labels[x, y]
            if label > 0:
                add_pixel(sums, label, x, y, luminance[x, y], solid_angle[x, y], 1.0)
    return sums


@compiled(nogil=True, inline="always")
def add_pixel(sums, label, x, y, luminance, omega, sign):
    """Add a pixel to a source (or take it away with sign = -1)."""
    flux = luminance * omega * sign
    sums[label, COUNT] += sign
    sums[label, OMEGA] += omega * sign
    sums[label, FLUX] += flux
    sums[label, FLUX_X] += flux * x
    sums[label, FLUX_Y] += flux * y


@compiled(nogil=True)
def boxes_of(labels, size):
    """Extents [size, 4] of the sources: first and last x, first and last y."""
    nx, ny = labels.shape
    boxes = np.empty((size, 4), dtype=np.int64)
    boxes[:, 0], boxes[:, 1], boxes[:, 2], boxes[:, 3] = nx, -1, ny, -1
    for x in range(nx):
        for y in range(ny):
            label = labels[x, y]
            if label > 0:
                boxes[label, 0] = min(boxes[label, 0], x)
                boxes[label, 1] = max(boxes[label, 1], x)
                boxes[label, 2] = min(boxes[label, 2], y)
                boxes[label, 3] = max(boxes[label, 3], y)
    return boxes


@compiled(nogil=True)
def larger_in_reach(sums, boxes, x, y, own, lowest, highest, reach_x, reach_y):
    """Whether the box of any larger source comes within reach of the pixel (else none is near)."""
    for label in range(lowest, highest + 1):
        if (
            sums[label, OMEGA] > sums[own, OMEGA]
            and boxes[label, 0] - reach_x <= x <= boxes[label, 1] + reach_x
            and boxes[label, 2] - reach_y <= y <= boxes[label, 3] + reach_y
        ):
            return True
    return False


@compiled(nogil=True)
def inside(labels, x, y):
    """Whether all eight neighbours have the pixel's label (never so at the picture's edge)."""
    nx, ny = labels.shape
    if not (1 < x < nx - 2 and 1 < y < ny - 2):
        return False
    label = labels[x, y]
    for neighbour_x in range(x - 1, x + 2):
        for neighbour_y in range(y - 1, y + 2):
            if labels[neighbour_x, neighbour_y] != label:
                return False
    return True


@compiled(nogil=True)
def move_source(labels, sums, boxes, luminance, solid_angle, old, new):
    """Give all pixels of the source `old` to the source `new`."""
    sums[old] = 0.0
    for x in range(boxes[old, 0], boxes[old, 1] + 1):
        for y in range(boxes[old, 2], boxes[old, 3] + 1):
            if labels[x, y] == old:
                labels[x, y] = new
                add_pixel(sums, new, x, y, luminance[x, y], solid_angle[x, y], 1.0)
    for low in (0, 2):
        boxes[new, low] = min(boxes[new, low], boxes[old, low])
        boxes[new, low + 1] = max(boxes[new, low + 1], boxes[old, low + 1])


@compiled(nogil=True)
def merge_sources(labels, sums, luminance, solid_angle, valid, directions, radius, reach, lowest, highest, edges):
    """Second scan: sources near a larger one join it, until none does.

    Only labels lowest..highest take part; `edges`: only pixels with a different neighbour look.
    """
    nx, ny = labels.shape
    if highest <= lowest:
        return
    cosine = math.cos(min(radius / 2, math.pi))
    boxes = boxes_of(labels, sums.shape[0])
    omega = sums[:, OMEGA]
    changed = True
    while changed:
        changed = False
        for x in range(nx):
            for y in range(ny):
                own = labels[x, y]
                if own < lowest or not valid[x, y] or (edges and inside(labels, x, y)):
                    continue
                if not larger_in_reach(sums, boxes, x, y, own, lowest, highest, reach, reach):
                    continue
                new = search(labels, directions, omega, x, y, radius, cosine, reach, own, lowest, highest)
                if new > 0:
                    move_source(labels, sums, boxes, luminance, solid_angle, own, new)
                    changed = True


@compiled(nogil=True)
def smooth(labels, primary, sums, luminance, solid_angle, valid, circle):
    """Add pixels to the sources that fill more than a fifth of the circle [px] around them.

    `primary`: labels before smoothing.  A pixel can count for several sources; its label is the
    last of them.
    """
    nx, ny = labels.shape
    size = sums.shape[0]
    inside_omega = np.zeros(size)
    for x in range(nx):
        for y in range(ny):
            if not valid[x, y] or primary[x, y] > 0:
                continue
            first_x, first_y = max(int(x - circle), 0), max(int(y - circle), 0)
            last_x = int(x + circle) if int(x + circle) <= nx - 1 else nx - 2
            last_y = int(y + circle) if int(y + circle) <= ny - 1 else ny - 2
            total = 0.0
            some = False
            for i in range(first_x, last_x + 1):
                for j in range(first_y, last_y + 1):
                    if math.sqrt((x - i) ** 2 + (y - j) ** 2) <= circle:
                        total += solid_angle[i, j]
                        if primary[i, j] > 0:
                            inside_omega[primary[i, j]] += solid_angle[i, j]
                            some = True
            if some:
                for label in range(1, size):
                    if inside_omega[label] / total > 0.2:
                        add_pixel(sums, label, x, y, luminance[x, y], solid_angle[x, y], 1.0)
                        labels[x, y] = label
                inside_omega[:] = 0.0


@compiled(nogil=True)
def search_peak(labels, directions, x, y, radius, cosine, lowest, highest):
    """The last label lowest..highest near pixel (x, y) in the order of the search, or 0.

    Columns beyond the picture's height are not searched (as evalglare, whose bound for columns is
    the number of rows).
    """
    nx, ny = labels.shape
    last_x = min(nx, ny) - 1
    found = 0
    for step_y in (-1, 1):
        row = y if step_y < 0 else y + 1
        while 0 <= row < ny:
            some = False
            for step_x in (-1, 1):
                column = x if step_x < 0 else x + 1
                while 0 <= column <= last_x:
                    if not near(directions, x, y, column, row, radius, cosine):
                        break
                    some = True
                    if lowest <= labels[column, row] <= highest:
                        found = labels[column, row]
                    column += step_x
            if not some:
                break
            row += step_y
    return found


@compiled(nogil=True)
def peaks_of(source, first, labels, sums, luminance, solid_angle, valid, directions, limit, radius):
    """Take a source's pixels of at least `limit` out of it, into sources first..; the last one."""
    nx, ny = labels.shape
    cosine = math.cos(min(radius / 2, math.pi))
    last = first - 1
    for x in range(nx):
        for y in range(ny):
            if labels[x, y] != source or luminance[x, y] < limit or not valid[x, y]:
                continue
            label = 0
            if last >= first:
                label = search_peak(labels, directions, x, y, radius, cosine, first, last)
            if label == 0:
                last += 1
                label = last
            add_pixel(sums, source, x, y, luminance[x, y], solid_angle[x, y], -1.0)
            add_pixel(sums, label, x, y, luminance[x, y], solid_angle[x, y], 1.0)
            labels[x, y] = label
    return last
