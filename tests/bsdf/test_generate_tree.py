"""Merged trees hold their bound and energy; traced trees agree with traced Klems matrices."""

from __future__ import annotations

import bsdf_radiance as radiance
import numpy as np
import pytest

from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.evaluate import bsdf_values, direct_hemispherical
from mitsuba_cfs.bsdf.generate import generate_klems, generate_tensor_tree
from mitsuba_cfs.bsdf.klems import KLEMS_QUARTER
from mitsuba_cfs.bsdf.periodic import plastic
from mitsuba_cfs.bsdf.tensor_merge import culled_tree, merged_tree, reciprocal_means
from mitsuba_cfs.bsdf.xml import BsdfFile, read_bsdf_xml, write_bsdf_xml


def smooth_grid(rank: int, width: int) -> np.ndarray:
    """Values that vary slowly, with one sharp ridge."""
    axes = np.meshgrid(*[np.linspace(0, 1, width)] * rank, indexing="ij")
    smooth = 0.1 + 0.05 * sum(np.sin(2 * axis) for axis in axes)
    return smooth + 3.0 * (np.abs(axes[0] - axes[-1]) < 1e-9)


@pytest.mark.parametrize("rank", [3, 4])
@pytest.mark.parametrize("relative", [0.0, 0.1, 0.5])
def test_leaves_hold_the_bound_and_the_energy(rank, relative):
    grid = smooth_grid(rank, 16).astype(np.float32)
    tree = merged_tree(grid, relative=relative, absolute=0.01)
    dense = tree.sample_grid()
    bound = np.maximum(relative * dense, 0.01)
    assert (np.abs(grid - dense) <= bound + 1e-6).all()
    assert dense.mean() == pytest.approx(grid.mean(), rel=1e-6)
    assert len(tree.values) < grid.size * (0.9 if relative else 1)


def test_even_values_are_one_leaf():
    tree = merged_tree(np.full((8,) * 4, 0.3, dtype=np.float32))
    assert len(tree.values) == 1 and tree.depth == 0


def test_noise_alone_is_merged_and_structure_is_not():
    generator = np.random.default_rng(1)
    paths, omega = 2000, np.pi / 64
    even = generator.poisson(0.2 * paths * omega, (8,) * 4) / (paths * omega)
    tree = merged_tree(even, relative=0.0, noise=1 / (paths * omega))
    assert len(tree.values) < 0.15 * even.size  # a 3 sigma bound lets some of 4096 cells through
    step = even + np.where(np.arange(8) < 4, 0.0, 0.6)[:, None, None, None]
    low, high = merged_tree(step, relative=0.0, noise=1 / (paths * omega)).sample_grid()[[0, 7]]
    assert high.mean() - low.mean() == pytest.approx(0.6, abs=0.02)


def test_culling_keeps_the_share_asked_for():
    grid = smooth_grid(4, 16)
    tree, bound = culled_tree(grid, 0.9)
    assert len(tree.values) <= 0.1 * grid.size and 0 < bound <= 1
    with pytest.raises(ValueError, match="cull"):
        culled_tree(grid, 1.0)


def test_reciprocal_means_use_both_ways_and_keep_totals():
    there = smooth_grid(4, 4)
    back = there[::-1, ::-1, ::-1, ::-1].transpose(2, 3, 0, 1)
    noise = np.random.default_rng(2).normal(0, 0.02, (2, 4, 4, 4, 4))
    a, b = reciprocal_means(there + noise[0], back + noise[1])
    assert np.std(a - there) < 0.8 * 0.02
    np.testing.assert_allclose(a.mean(axis=(2, 3)), (there + noise[0]).mean(axis=(2, 3)))
    np.testing.assert_allclose(b.mean(axis=(2, 3)), (back + noise[1]).mean(axis=(2, 3)))


@pytest.fixture(scope="module")
def trees(variant):
    """The blind as matrices and as a tree of 1024 cells a hemisphere, only noise merged."""
    layer = venetian_blind(plastic("grey", 0.55), depth=0.08, radius=0.104, spacing=0.072, tilt=np.radians(45))
    matrices = generate_klems(layer, KLEMS_QUARTER, samples=16_384, seed=1).bsdf[0]
    (tree,), bound = generate_tensor_tree(layer, 5, samples=8192, cull=0.0, seed=2)
    assert bound == 0
    return matrices, tree


@pytest.mark.parametrize("side", ["front", "back"])
@pytest.mark.parametrize("kind", ["transmission", "reflection"])
def test_tree_and_matrix_scatter_the_same(trees, kind, side):
    """Hemispherical values averaged over each Klems patch."""
    matrices, tree = trees
    patch = np.repeat(np.arange(41), 2000)
    theta, phi = KLEMS_QUARTER.angles_within(patch, *np.random.default_rng(3).uniform(size=(2, len(patch))))
    z = np.cos(theta) * (1 if side == "front" else -1)
    incident = np.stack([np.sin(theta) * np.cos(phi), -np.sin(theta) * np.sin(phi), z], -1)
    block = f"{kind}_{side}"
    ours = direct_hemispherical(tree, block, incident).reshape(41, -1).mean(axis=1)
    theirs = matrices.direct_hemispherical(getattr(matrices, block))
    # borders differ, and cells of two counts each were merged within three standard errors:
    # 5 % of a share of 0.25 and more; a wrong map or side is off by 0.1 and more
    assert np.abs(ours - theirs).max() < 0.03
    assert np.sqrt(((ours - theirs) ** 2).mean()) < 0.008
    area = KLEMS_QUARTER.projected_solid_angles() / np.pi
    assert (area * (ours - theirs)).sum() == pytest.approx(0, abs=8e-4)


def test_the_sun_that_passes_between_slats_stays_sharp(trees):
    """Light from below the profile angle passes straight on into one cell, 16 times a diffuser."""
    _, tree = trees
    up = np.radians(-30)  # light from below, along the slats' tilt
    d = np.array([[0.0, np.sin(up), np.cos(up)]])
    assert bsdf_values(tree, d, -d)[0] > 16 * 0.3 / np.pi


@pytest.mark.peer
def test_radiance_reads_the_traced_tree(trees, tmp_path):
    path = tmp_path / "traced.xml"
    write_bsdf_xml(BsdfFile({"Visible": trees[1]}), path)
    incident, outgoing = radiance.random_directions(2000, seed=4)
    theirs = radiance.query(path, incident, outgoing)
    tree = radiance.perturbed(read_bsdf_xml(path).band("Visible"))
    ours = bsdf_values(tree, radiance.to_window(incident), radiance.to_window(outgoing))
    assert (~np.isclose(ours, theirs, rtol=radiance.QUERY_TOLERANCE, atol=1e-8)).mean() < 1e-3


def test_an_isotropic_tree_is_the_mean_over_azimuths(variant):
    layer = venetian_blind(plastic("grey", 0.5), depth=0.08, spacing=0.06, tilt=0.5)
    (tree,), _ = generate_tensor_tree(layer, 4, rank=3, samples=16_384, seed=5)
    matrices = generate_klems(layer, KLEMS_QUARTER, samples=8192, seed=6).bsdf[0]
    share = matrices.direct_hemispherical(matrices.transmission_front)
    sine2 = np.sin(KLEMS_QUARTER.theta_bounds) ** 2
    for ring in range(5):
        mean = share[KLEMS_QUARTER.rings == ring].mean()
        steps = np.sqrt(np.linspace(sine2[ring], sine2[ring + 1], 200))
        incident = np.stack([steps, 0 * steps, np.sqrt(1 - steps**2)], -1)
        found = direct_hemispherical(tree, "transmission_front", incident).mean()
        assert found == pytest.approx(mean, abs=0.015)  # steps of sin(theta) 1/8 wide
