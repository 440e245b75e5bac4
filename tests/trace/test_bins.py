"""Tables looked up in kernels stay inside themselves, whatever the lanes hold that met nothing."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("variant")


def test_a_direction_that_is_none_is_looked_up_inside_the_tables():
    """A ray that met nothing has no direction; its lane was gathered 8 GB before the table."""
    import mitsuba as mi

    from mitsuba_cfs.bsdf.klems import KLEMS_FULL
    from mitsuba_cfs.bsdf.traced_klems import TracedBasis, cell
    from mitsuba_cfs.bsdf.traced_tree import TracedSquares
    from mitsuba_cfs.sky.patches import ReinhartSky
    from mitsuba_cfs.trace.kernels.bins import DirectionBins, SkyBins
    from mitsuba_cfs.trace.kernels.scattering import AngularBeam

    odd = [np.nan, np.inf, -np.inf, 0.6, -0.8]
    x, y, z = (mi.Float(np.array(axis, dtype=np.float32)) for axis in zip(*product(odd, repeat=3), strict=True))
    direction, sky, bins = mi.Vector3f(x, y, z), SkyBins(ReinhartSky(4)), DirectionBins(KLEMS_FULL)
    assert cell(x, 7).numpy().max() <= 7
    assert sky.index(direction).numpy().max() < sky.size
    for basis, size in ((TracedBasis(KLEMS_FULL), bins.size), (TracedSquares(3), 64)):
        assert basis.patch(x, y, z).numpy().max() < size, basis
    assert bins.index(direction).numpy().max() < bins.size
    ones = mi.Float(np.ones(bins.size, dtype=np.float32))
    finite = np.isfinite(np.array([x.numpy(), y.numpy(), z.numpy()])).all(axis=0)
    for found in (bins.between(ones, direction, ends=False), AngularBeam([1.0, 1.0]).at(direction)):
        assert found.numpy()[finite] == pytest.approx(1.0, abs=1e-6)  # float32
