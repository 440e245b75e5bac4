"""Random numbers of the tracer: even in every pair of dimensions, whatever keys them."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from scipy import stats

pytestmark = pytest.mark.usefixtures("variant")

COUNT, CELLS = 1 << 18, 16


def chi_square(u: np.ndarray, v: np.ndarray) -> float:
    """Probability of so uneven a histogram of the unit square."""
    counts = np.histogram2d(u, v, bins=CELLS, range=[[0, 1], [0, 1]])[0]
    return stats.chisquare(counts.ravel()).pvalue


def test_first_points_of_many_lattices_fill_every_pair_of_dimensions_evenly():
    """Few samples of a stream rely on its random shifts, which must not know of each other."""
    import drjit as dr
    import mitsuba as mi

    from mitsuba_cfs.trace.kernels.sampling import lattice

    number = dr.arange(mi.UInt32, COUNT)
    streams = {
        "counted": number,
        "hashed": mi.sample_tea_32(number, mi.UInt32(12345))[0],
        "by key": mi.sample_tea_32(mi.UInt32(7), number)[0],
    }
    for name, stream in streams.items():
        u = [lattice(mi.UInt32(0), stream, d).numpy() for d in range(6)]
        values = {pair: chi_square(u[pair[0]], u[pair[1]]) for pair in combinations(range(6), 2)}
        # 45 histograms: the least of as many fair probabilities is below 1e-4 once in 220
        assert min(values.values()) > 1e-4, (name, values)


def test_one_lattice_is_stratified():
    import drjit as dr
    import mitsuba as mi

    from mitsuba_cfs.trace.kernels.sampling import lattice

    u = [lattice(dr.arange(mi.UInt32, 4096), mi.UInt32(3), d).numpy() for d in range(6)]
    for a, b in ((0, 1), (2, 3), (4, 5)):  # what `lattice_2d` joins
        counts = np.histogram2d(u[a], u[b], bins=8, range=[[0, 1], [0, 1]])[0]
        assert counts.std() < 0.5 * 8, (a, b)  # random points: the root of 64


def test_generators_of_paths_are_even():
    import drjit as dr
    import mitsuba as mi

    from mitsuba_cfs.trace.kernels.sampling import path_generator

    generator = path_generator(dr.arange(mi.UInt32, COUNT), mi.UInt32(1))
    u = [generator.next_float32().numpy() for _ in range(4)]
    for a, b in combinations(range(4), 2):
        assert chi_square(u[a], u[b]) > 1e-4
    for one in u:  # paths next to each other
        assert chi_square(one[:-1], one[1:]) > 1e-4


def test_every_seed_has_paths_of_its_own():
    """The first bounce of a picture's paths was the same with every seed."""
    from mitsuba_cfs.images.view import fisheye
    from tests.trace import rooms
    from tests.trace.pixel_pictures import picture_matrix_blocks

    room, groups = rooms.test_room()
    view = fisheye((1.8, 2.5, 1.2), (0.5, 1.0, 0.0), 8)  # of walls alone

    def rows(seed: int) -> np.ndarray:
        ((_, matrix),) = picture_matrix_blocks(room, groups, view, samples=2, max_depth=1, seed=seed)
        return matrix

    np.testing.assert_array_equal(rows(1), rows(1))
    lit = rows(0).sum(axis=(1, 2)) > 0
    assert lit.sum() > 30
    same = np.all(rows(0) == rows(1), axis=(1, 2))
    assert not same[lit].any()


@pytest.mark.parametrize("samples", [1, 3, 8])
def test_rays_spread_over_pixels_are_those_of_each_place_in_them(monkeypatch, samples):
    from mitsuba_cfs.images.view import fisheye, pixel_rays
    from mitsuba_cfs.trace.kernels import sampling

    view = fisheye((0, 0, 1.2), (0.3, 1.0, 0.1), 20, kind="hemispherical")
    pixels = np.random.default_rng(2).integers(0, 400, 50)
    across, down = np.tile(sampling.pixel_positions(samples), (50, 1)).T
    expected = pixel_rays(view, np.repeat(pixels, samples), across, down)
    monkeypatch.setattr(sampling, "AT_ONCE", 40)
    for found, one in zip(sampling.spread_rays(view, pixels, samples), expected, strict=True):
        np.testing.assert_array_equal(found, one)
    assert not expected[1].all() and not expected[0][~expected[1]].any()
