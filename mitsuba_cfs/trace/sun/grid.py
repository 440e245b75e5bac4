"""Which places outdoors the sun reaches in many hours, by shadow rays to a grid of directions.

The suns of a year stand close to each other, and neighbours reach the same places but for those
that the edge of a shadow lies across.  Each place has rays to the nodes of a grid fixed on the
sphere.  Where the three nodes about a sun agree, so does the sun; where they do not, it has a ray
of its own.  Of those that agree one in `CHECKED` has one too, which corrects for all of these:

    share = s                       nodes agree; s = sum over them of a_i v(n_i)
            s + CHECKED (v - s)     they do, and the pair of place and sun is one that is checked
            v                       they do not

What is thinner than the grid so has its right mean, with noise in place of a bias.  Grid and checks
follow from a sun's direction alone: an hour's light does not hang on those computed with it.

Source: control variates, Hammersley and Handscomb 1964, "Monte Carlo Methods", section 5.5; the
grid is even in Lambert's azimuthal equal-area projection (Snyder 1987, "Map projections", 24).
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.trace.kernels.sampling import column, vectors
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.sun.discs import SPREAD
from mitsuba_cfs.trace.sun.lit_points import Places, place_and_hour, sunlight_of_pairs
from mitsuba_cfs.trace.sun.specular_paths import SunWay, sun_ways

STEP = float(np.radians(4.0))  # between nodes, about the zenith
CHECKED = 8  # of places whose nodes agree, one in so many has a ray to the sun itself
MIRRORED = 32  # the same of the sun in a mirror, which few places have
KEY = 2**32  # of a node's number along one axis, to hold both


@dataclass(frozen=True)
class SunGrid:
    """The nodes about some suns; axis h of these."""

    suns: NDArray[np.float64]  # [h, 3]
    nodes: NDArray[np.float64]  # [n, 3] unit
    corner: NDArray[np.int64]  # [h, 3] number of the nodes about each sun
    weight: NDArray[np.float64]  # [h, 3] of each, 1 in sum
    first: NDArray[np.int64]  # [h] of `MIRRORED` places in a row, one that is checked

    @classmethod
    def about(cls, suns: NDArray[np.float64]) -> SunGrid:
        """The triangles that directions [h, 3] lie in."""
        place = suns[:, :2] * np.sqrt(2 / np.maximum(1 + suns[:, 2:], 1e-9)) / STEP
        low = np.floor(place).astype(np.int64)
        x, y = (place - low).T
        second = low + np.where((y > x)[:, None], [0, 1], [1, 0])
        key = np.stack([low, second, low + 1], axis=1) @ np.array([KEY, 1])
        found, corner = np.unique(key, return_inverse=True)
        along = (found + KEY // 2) // KEY
        flat = np.stack([along, found - along * KEY], axis=1) * STEP
        square = np.minimum((flat**2).sum(axis=1), 4.0)
        nodes = np.column_stack([flat * np.sqrt(1 - square / 4)[:, None], 1 - square / 2])
        nodes /= np.linalg.norm(nodes, axis=1)[:, None]
        more, less = np.maximum(x, y), np.minimum(x, y)
        weight = np.column_stack([1 - more, more - less, less])
        bits = suns.astype(np.float32).view(np.uint32).astype(np.uint64)
        mixed = (bits @ np.array([0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D], dtype=np.uint64)) >> 12
        return cls(suns, nodes, corner.reshape(-1, 3), weight, mixed.astype(np.int64) % MIRRORED)

    def light(self, way: SunWay, places: Places) -> mi.Float:
        """Cosine times the share of the suns that reaches places by a way [m * h]."""
        nodes, suns = way.turned(self.nodes), way.turned(self.suns)
        point, normal, to_node = place_and_hour(places, nodes)
        at = way.reaching(mi.Ray3f(point, to_node), dr.dot(normal, to_node) > 0)
        dr.eval(at)
        count = dr.opaque(mi.UInt32, len(suns))
        place = dr.arange(mi.UInt32, places.size * len(suns))
        place, hour = place // count, place % count
        each = MIRRORED if way.mirrors else CHECKED
        start, share, lit = place * dr.opaque(mi.UInt32, len(nodes)), mi.Float(0), mi.UInt32(0)
        for corner, weight in zip(self.corner.T, self.weight.T, strict=True):
            number = dr.gather(mi.UInt32, column(corner, mi.UInt32), hour)
            value = dr.gather(mi.Float, at, start + number)
            share += dr.gather(mi.Float, column(weight), hour) * value
            lit += dr.select(value > 0, mi.UInt32(1), mi.UInt32(0))
        cosine = dr.dot(
            dr.gather(mi.Vector3f, places.normals(), place),
            dr.gather(mi.Vector3f, vectors(suns), hour),
        )
        differ, level = (lit > 0) & (lit < 3), dr.abs(cosine) <= SPREAD
        first = dr.gather(mi.UInt32, column(self.first, mi.UInt32), hour)
        checked = (place + first) % each == 0
        own = level | ((cosine > 0) & (differ | checked))
        found = dr.select((cosine > 0) & ~level, cosine * share, 0.0)
        times = dr.select(differ | level, mi.Float(1), mi.Float(each))
        dr.eval(found, own, times)
        pair = dr.compress(own)
        if dr.width(pair):
            before, more = (dr.gather(mi.Float, of, pair) for of in (found, times))
            exact = sunlight_of_pairs(way, places, suns, pair)
            dr.scatter(found, before + more * (exact - before), pair)
        return found


def sunlight_of_many(
    outside: TracedScene, places: Places, suns: NDArray[np.float64]
) -> NDArray[np.float32]:
    """`sunlight` of many places [m, h], their sum with its expected value: see above."""
    grid = SunGrid.about(suns)
    light = sum(grid.light(way, places) for way in sun_ways(outside))
    return light.numpy().reshape(places.size, len(suns))
