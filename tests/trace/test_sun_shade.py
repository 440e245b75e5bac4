"""Shade of the exact sun, and receivers that take up less at grazing incidence."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.surfaces import Surfaces

pytestmark = pytest.mark.usefixtures("variant")

UP = np.array([[0.0, 0.0, 1.0]])


def sunlit_shares(*arguments, **options):
    from mitsuba_cfs.trace.sun.shade import sunlit_shares

    return sunlit_shares(*arguments, **options)


def sky_irradiance_matrix(*arguments, **options):
    from mitsuba_cfs.trace.matrices.daylight import sky_irradiance_matrix

    return sky_irradiance_matrix(*arguments, **options)


def half_plane(x: float, z: float = 10.0, size: float = 500.0) -> Surfaces:
    """A black plane at height z over everything with a coordinate below x."""
    low, high = np.array([x - size, -size, z]), np.array([x, size, z])
    a, b, c, d = low, [high[0], low[1], z], high, [low[0], high[1], z]
    triangles = np.array([[a, b, c], [a, c, d]])
    return Surfaces(triangles, np.zeros(2), np.zeros(2, dtype=int))


def test_half_hidden_disc_is_half():
    shares = sunlit_shares(half_plane(0.0), [[0, 0, 0]], UP, UP, samples=4096)
    # the edge stands before the middle of the disc: a binomial of 4096 has sigma 0.008
    assert shares[0, 0] == pytest.approx(0.5, abs=0.02)


def test_receiver_under_an_edge_is_shaded_by_its_own_share():
    sides = np.array([[[2.0, 0, 0], [0, 1.0, 0]]])
    for edge in (-0.6, 0.0, 0.5):
        found = sunlit_shares(half_plane(edge), [[0, 0, 0]], UP, UP, edges=sides, samples=4096)
        # lit beyond the edge: (1 - edge) / 2; the penumbra of 9 cm is symmetric
        assert found[0, 0] == pytest.approx((1 - edge) / 2, abs=0.02)


def test_sun_behind_a_receiver_gives_nothing_and_chunks_change_nothing(monkeypatch):
    rng = np.random.default_rng(0)
    suns = rng.normal(size=(40, 3))
    normals = rng.normal(size=(7, 3))
    points = rng.uniform(-3, 3, (7, 3))
    whole = sunlit_shares(half_plane(0.0), points, normals, suns, samples=8)
    behind = normals @ suns.T < -0.02 * np.linalg.norm(normals, axis=1)[:, None] * 4
    assert behind.any() and not whole[behind].any()
    monkeypatch.setattr("mitsuba_cfs.trace.sun.shade.RAYS", 500)
    np.testing.assert_array_equal(sunlit_shares(half_plane(0.0), points, normals, suns, samples=8), whole)


def test_accepted_light_of_a_uniform_sky_is_the_weighted_integral():
    nothing = half_plane(-400.0, -50.0, 1.0)
    theta = np.linspace(0, np.pi / 2, 91)
    acceptance = np.cos(theta)  # total: integral of cos^2 over the hemisphere, 2 pi / 3
    matrix = sky_irradiance_matrix(nothing, [[0, 0, 0]], UP, acceptance=acceptance, samples=65536)
    # the table is linear between whole degrees: cos^2 is off by 3e-5 there
    assert matrix.values.sum() == pytest.approx(2 * np.pi / 3, rel=2e-4)
    full = sky_irradiance_matrix(nothing, [[0, 0, 0]], UP, samples=65536)
    assert full.values.sum() == pytest.approx(np.pi, rel=1e-6)
    high, low = slice(-3, None), slice(1, 61)  # patches at the zenith keep, the horizon's lose
    assert matrix.values[0, high].sum() == pytest.approx(full.values[0, high].sum(), rel=0.05)
    assert matrix.values[0, low].sum() < 0.1 * full.values[0, low].sum()


def test_faulty_acceptance_is_named():
    with pytest.raises(ValueError, match="acceptance"):
        sky_irradiance_matrix(half_plane(0.0), [[0, 0, 0]], UP, acceptance=[1.0, -0.1])
