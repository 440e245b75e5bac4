"""Translucent diffuse slats at normal incidence: radiosity, as in Windows-CalcEngine's own tests.

Flat slats see each other whole, so that their exchange is a small linear system (crossed strings).
With one and two strips a slat it must give the engine's published test values (slats of 10 mm,
10 mm apart, at 45 degrees, transmittance 0.1, reflectance 0.7: `VenetianScatteringLayer1`,
`VenetianCellFlat45_1`); with many it is the truth that the tracing must meet.
"""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.generate import trace_bins
from mitsuba_cfs.bsdf.klems import KLEMS_QUARTER
from mitsuba_cfs.bsdf.periodic import SlatMaterial

TILT = np.pi / 4


def radiosity(transmittance, reflectance, depth, spacing, strips):
    """Direct, scattered transmittance and reflectance of light at normal incidence."""
    along = np.linspace(-depth / 2, depth / 2, strips + 1)  # towards the outer edge, the lower one
    lower = np.stack([-np.sin(TILT) * along, np.cos(TILT) * along], -1)
    upper = lower + np.array([spacing, 0.0])

    def seen(a, b):
        """Share of what each strip between points `a` sends that arrives between points `b`."""
        (a0, a1), (b0, b1) = (
            (p[:-1][:, None], p[1:][:, None]) if p is a else (p[:-1][None], p[1:][None]) for p in (a, b)
        )

        def distance(p, q):
            return np.linalg.norm(p - q, axis=-1)

        strings = distance(a0, b1) + distance(a1, b0) - distance(a0, b0) - distance(a1, b1)
        return np.abs(strings) / 2 / distance(a0, a1)

    up, down = seen(lower, upper), seen(upper, lower)
    rooms = [seen(slat, np.stack([lower[0], upper[0]]))[:, 0] for slat in (lower, upper)]
    sky = [seen(slat, np.stack([lower[-1], upper[-1]]))[:, 0] for slat in (lower, upper)]
    np.testing.assert_allclose(up.sum(axis=1) + rooms[0] + sky[0], 1)
    lit = np.full(strips, np.sin(TILT))  # the upper faces, whole: the next slat shades nothing
    one = np.eye(strips)
    exchange = np.block(
        [[one - transmittance * down, -reflectance * up], [-reflectance * down, one - transmittance * up]]
    )
    leaving = np.linalg.solve(exchange, np.concatenate([reflectance * lit, transmittance * lit]))
    flow = leaving * depth / strips / spacing
    return 1 - depth * np.sin(TILT) / spacing, flow @ np.ravel(rooms), flow @ np.ravel(sky)


def test_radiosity_is_that_of_windows_engine():
    direct, *one = radiosity(0.1, 0.7, 0.010, 0.010, strips=1)
    assert direct == pytest.approx(0.292893, abs=1e-6)
    assert one == pytest.approx([0.162897, 0.356835], abs=1e-6)
    _, *two = radiosity(0.1, 0.7, 0.010, 0.010, strips=2)
    assert two == pytest.approx([0.158538, 0.359395], abs=1e-6)


class Normal:
    """Incident light of one direction, along the normal."""

    def direction(self, patch, u, v):
        import mitsuba as mi

        return mi.Float(0), mi.Float(0), mi.Float(1)


@pytest.mark.parametrize(
    "transmittance, reflectance, depth, spacing",
    [(0.1, 0.7, 0.010, 0.010), (0.1, 0.7, 0.016, 0.012), (0.2, 0.6, 0.016, 0.012)],
)
def test_traced_slats_are_those_of_radiosity(variant, transmittance, reflectance, depth, spacing):
    from mitsuba_cfs.bsdf.generate import TracedLayer
    from mitsuba_cfs.bsdf.traced_klems import TracedBasis

    slat = SlatMaterial("slat", (reflectance,), (reflectance,), transmittance=(transmittance,))
    layer = venetian_blind(slat, depth=depth, spacing=spacing, tilt=TILT)
    (sums,), paths = trace_bins(
        TracedLayer(layer), Normal(), 1, TracedBasis(KLEMS_QUARTER), 41, rows=1, samples=1 << 18, seed=1
    )
    shares = sums[0, :, 0].sum(axis=-1) / paths  # [side in, side out]
    direct, through, back = radiosity(transmittance, reflectance, depth, spacing, strips=100)
    # 5 sigma of a share of 0.5 in 262 144 paths
    np.testing.assert_allclose(shares[0], [back, direct + through], atol=5 * 0.5 / 512)
    np.testing.assert_allclose(shares[1], [direct + through, back], atol=5 * 0.5 / 512)
