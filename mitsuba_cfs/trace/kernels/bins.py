"""Klems patches and Reinhart sky patches looked up inside Dr.Jit kernels."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.klems import KlemsBasis
from mitsuba_cfs.bsdf.traced_klems import cell
from mitsuba_cfs.sky.patches import ReinhartSky


def _around(place: mi.Int32, count: mi.Int32) -> mi.Int32:
    """Index in a ring of `count`, wrapped by one turn at most; 0 if invalid (as `cell`)."""
    place = dr.select(place < 0, place + count, place)
    return dr.maximum(dr.select(place >= count, place - count, place), 0)


class DirectionBins:
    """The patches of a Klems basis: index of a direction, and a direction inside a patch.

    Directions are the local ones of a ray that goes outdoors through the window (z > 0); with the
    azimuth of `mitsuba_cfs.directions` one index serves the incident and the transmitted side.
    """

    def __init__(self, basis: KlemsBasis) -> None:
        variants.activate()
        bounds = np.asarray(basis.theta_bounds, dtype=float)
        counts = np.asarray(basis.phi_counts, dtype=int)
        first = np.concatenate([[0], np.cumsum(counts)[:-1]])
        ring = np.repeat(np.arange(len(counts)), counts)
        self.size = int(counts.sum())
        self.basis = basis
        self._cosine_bounds = np.cos(bounds[1:-1])
        self._count = mi.Float(counts.astype(np.float32))
        self._first = mi.UInt32(first.astype(np.uint32))
        # By patch: cos^2 at both polar bounds, and the azimuth range
        self._cos2_low = mi.Float((np.cos(bounds[:-1]) ** 2)[ring].astype(np.float32))
        self._cos2_high = mi.Float((np.cos(bounds[1:]) ** 2)[ring].astype(np.float32))
        self._phi_step = mi.Float((2 * np.pi / counts)[ring].astype(np.float32))
        tangents = np.tan(np.minimum(bounds, np.pi / 2 - 1e-9))
        self._tangent_low = mi.Float(tangents[:-1][ring].astype(np.float32))
        self._tangent_high = mi.Float(tangents[1:][ring].astype(np.float32))
        self._place = mi.Float((np.arange(self.size) - first[ring]).astype(np.float32))
        # By ring: polar angle of the middles, and where the last is followed by grazing incidence
        self._middles = basis.centres()[0][first]
        self._middle = mi.Float(np.append(self._middles, np.pi / 2).astype(np.float32))

    def index(self, local: mi.Vector3f) -> mi.UInt32:
        """Patch of local direction(s) with z > 0."""
        ring = mi.UInt32(0)
        for cosine in self._cosine_bounds:
            ring += dr.select(local.z <= float(cosine), mi.UInt32(1), mi.UInt32(0))
        count = dr.gather(mi.Float, self._count, ring)
        turn = dr.atan2(-local.y, local.x) * dr.inv_two_pi
        place = _around(mi.Int32(dr.floor(dr.fma(turn, count, 0.5))), mi.Int32(count))
        return dr.gather(mi.UInt32, self._first, ring) + mi.UInt32(place)

    def between(self, values: mi.Float, local: mi.Vector3f, *, ends: bool = True) -> mi.Float:
        """Transmittance at local direction(s) with z > 0, interpolated from the patch centres [K].

        Linear in polar angle between the rings and in azimuth within a ring.

        Args: ends: from the last ring on it falls to 0 at 90 degrees; false: it stays.
        """
        theta = dr.atan2(dr.norm(mi.Vector2f(local.x, local.y)), local.z)
        ring = mi.UInt32(0)
        for middle in self._middles[1:]:
            ring += dr.select(theta >= float(middle), mi.UInt32(1), mi.UInt32(0))
        low, high = (dr.gather(mi.Float, self._middle, ring + k) for k in (0, 1))
        share = dr.clip((theta - low) / (high - low), 0, 1)
        last = ring + 1 >= len(self._middles)
        turn = dr.atan2(-local.y, local.x) * dr.inv_two_pi
        inner = self._within_ring(values, ring, turn)
        outer = self._within_ring(values, dr.select(last, ring, ring + 1), turn)
        return dr.lerp(inner, dr.select(last, 0.0, outer) if ends else outer, share)

    def _within_ring(self, values: mi.Float, ring: mi.UInt32, turn: mi.Float) -> mi.Float:
        """Linear between the two patches of a ring next to an azimuth [turns]."""
        count, first = (dr.gather(mi.Float, self._count, ring), dr.gather(mi.UInt32, self._first, ring))
        place = turn * count
        low = dr.floor(place)
        whole = mi.Int32(count)
        left = _around(mi.Int32(low), whole)
        right = dr.select(left + 1 >= whole, 0, left + 1)
        a, b = (dr.gather(mi.Float, values, first + mi.UInt32(k)) for k in (left, right))
        return dr.lerp(a, b, place - low)

    def sample(self, patch: mi.UInt32, u: mi.Point2f) -> mi.Vector3f:
        """A local direction in the patch, uniform in projected solid angle."""
        low = dr.gather(mi.Float, self._cos2_low, patch)
        high = dr.gather(mi.Float, self._cos2_high, patch)
        cos2 = dr.lerp(low, high, u.x)
        step = dr.gather(mi.Float, self._phi_step, patch)
        phi = (dr.gather(mi.Float, self._place, patch) + u.y - 0.5) * step
        sine = dr.safe_sqrt(1 - cos2)
        return mi.Vector3f(sine * dr.cos(phi), -sine * dr.sin(phi), dr.safe_sqrt(cos2))

    def sector(self, patch: mi.UInt32) -> tuple[mi.Float, mi.Float, mi.Float, mi.Float]:
        """Azimuth atan2(y, x) of the patch's middle, its width, and its polar angles' tangents."""
        step = dr.gather(mi.Float, self._phi_step, patch)
        middle = -dr.gather(mi.Float, self._place, patch) * step
        low = dr.gather(mi.Float, self._tangent_low, patch)
        return middle, step, low, dr.gather(mi.Float, self._tangent_high, patch)


class SkyBins:
    """The patches of a Reinhart sky: index of a world direction, the ground being 0."""

    def __init__(self, sky: ReinhartSky) -> None:
        variants.activate()
        self.size = sky.size
        self._row_height = float(sky.row_height)
        self._last_row = len(sky.row_counts) - 1
        self._count = mi.Float(sky.row_counts.astype(np.float32))
        self._first = mi.UInt32(sky.row_first.astype(np.uint32))

    def index(self, direction: mi.Vector3f) -> mi.UInt32:
        """Patch of unit world direction(s)."""
        altitude = dr.asin(dr.clip(direction.z, -1, 1))
        row = cell(altitude / self._row_height, self._last_row)
        count = dr.gather(mi.Float, self._count, row)
        turn = dr.atan2(direction.x, direction.y) * dr.inv_two_pi
        place = _around(mi.Int32(dr.floor(dr.fma(turn, count, 0.5))), mi.Int32(count))
        patch = dr.gather(mi.UInt32, self._first, row) + mi.UInt32(place)
        return dr.select(direction.z < 0, mi.UInt32(0), patch)
