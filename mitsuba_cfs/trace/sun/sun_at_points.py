"""Irradiance of points outdoors by the suns of a year, a byte for each pair of point and sun.

    E[m, h] = c[m, h] cosine(normal m, sun h)

The share c of the direct sun that `sunlight_of_many` gives is 0 or 1, or CHECKED and 1 - CHECKED where a
ray to the sun differs from the grid.  Other pairs, as those with the sun in a mirror or a sun level with
the surface, have their irradiance as a number.  All of it is geometry: it is the same for all systems in
the windows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.lit_points import SurfacePoints, sunlight_of_many
from mitsuba_cfs.trace.sun.specular_paths import SPREAD

LANES = 2**22  # shadow rays at once
OTHER = -128  # share of a pair whose irradiance is a number
MOST_SHARE = 100  # of a byte
ROUNDING = 2e-6  # of a cosine in single precision


@dataclass(frozen=True, slots=True)
class SunAtPoints:
    """Irradiance of some points by some suns, per unit normal to these."""

    share: NDArray[np.int8]  # [m, h] of the direct sun
    others: NDArray[np.float32]  # irradiance of the pairs with the share OTHER, in their order by sun

    @classmethod
    def of(cls, light: NDArray[np.float32], places: SurfacePoints, suns: NDArray[np.float64]) -> SunAtPoints:
        """From the irradiance [m, h]."""
        cosine = _cosines(places, suns)
        share = np.rint(light / np.where(cosine > SPREAD, cosine, np.float32(1)))
        share[(cosine <= SPREAD) | (np.abs(share) > MOST_SHARE)] = 0
        is_share = np.abs(light - share * cosine) <= ROUNDING * np.maximum(np.abs(share), 1)
        is_share &= (share != 0) | (light == 0)
        share[~is_share] = OTHER
        return cls(share.astype(np.int8), light.T[~is_share.T].astype(np.float32))

    def light(
        self, places: SurfacePoints, suns: NDArray[np.float64], hours: slice = slice(None)
    ) -> NDArray[np.float32]:
        """Irradiance [m, n] by some of the suns."""
        share = self.share[:, hours]
        values = share * _cosines(places, suns[hours])
        other = share.T == OTHER
        if len(self.others) and other.any():
            before = np.count_nonzero(self.share[:, : hours.start or 0] == OTHER)
            values.T[other] = self.others[before : before + np.count_nonzero(other)]
        return values

    @staticmethod
    def joined(parts: Sequence[SunAtPoints], size: int) -> SunAtPoints:
        """The same points by one set of suns after the other; size: number of points."""
        none = np.empty((size, 0), dtype=np.int8), np.empty(0, dtype=np.float32)
        return SunAtPoints(
            np.concatenate([none[0], *(part.share for part in parts)], axis=1),
            np.concatenate([none[1], *(part.others for part in parts)]),
        )


def sun_at_points(outside: TracedScene, sets: Sequence[SurfacePoints], suns: NDArray[np.float64]) -> list[SunAtPoints]:
    """The suns [h, 3] at the points of each set, those of several in one launch as long as it is small."""
    found: list[SunAtPoints] = []
    for block in together([places.size * len(suns) for places in sets]):
        some = sets[block]
        places, counts = SurfacePoints.joined(list(some)), [one.size for one in some]
        number, ends = np.concatenate([np.arange(n) for n in counts]), np.cumsum([0, *counts])
        parts: list[list[SunAtPoints]] = [[] for _ in some]
        for hours in blocks(places.size, len(suns)):
            light = sunlight_of_many(outside, places, suns[hours], number)
            for i, one in enumerate(some):
                parts[i].append(SunAtPoints.of(light[ends[i] : ends[i + 1]], one, suns[hours]))
        found += [SunAtPoints.joined(part, size) for part, size in zip(parts, counts, strict=True)]
    return found


def together(sizes: Sequence[int]) -> list[slice]:
    """Neighbours whose sizes sum to `LANES` at most, and larger ones alone."""
    found, first, total = [], 0, 0
    for i, size in enumerate(sizes):
        if i > first and total + size > LANES:
            found.append(slice(first, i))
            first, total = i, 0
        total += size
    return [*found, slice(first, len(sizes))] if sizes else found


def blocks(places: int, hours: int) -> list[slice]:
    """Blocks of hours whose shadow rays are traced at once."""
    step = max(1, LANES // max(places, 1))
    return [slice(start, min(start + step, hours)) for start in range(0, hours if places else 0, step)]


def _cosines(places: SurfacePoints, suns: NDArray[np.float64]) -> NDArray[np.float32]:
    values: NDArray[np.float32] = places.normal @ suns.T.astype(np.float32)
    return values
