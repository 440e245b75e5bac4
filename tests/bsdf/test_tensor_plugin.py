"""The tensor tree plugin: values, chi-square in all hemispheres and modes, weights, scalar."""

from __future__ import annotations

import numpy as np
import pytest
from plugin_setup import UP, context, interaction, random_directions, sampled, to_mitsuba
from scipy.stats import chi2
from test_tensor_tree import random_tree

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.evaluate import bsdf_values, incident_disk, outgoing_disk
from mitsuba_cfs.bsdf.tensor_sampling import sampling_tree
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf, disk_to_square, square_to_disk

MODES = ("Radiance", "Importance")
LEVELS = 3


def system(rank: int, seed: int = 20) -> TensorTreeBsdf:
    """Four unlike trees that end at random, some leaves dark."""
    trees = [random_tree(rank, seed + n, LEVELS, limit=0.25) for n in range(4)]
    for tree in trees:
        tree.values[tree.values < 0.02] = 0.0
    return TensorTreeBsdf(*trees)


def load(bsdf: TensorTreeBsdf):
    import mitsuba as mi

    from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin

    return mi.load_dict(tensor_tree_plugin(bsdf, up=UP))


def pair(known, other, mode):
    """Incident and outgoing direction."""
    return (other, known) if mode == "Radiance" else (known, other)


@pytest.mark.parametrize("rank", [3, 4])
def test_masses_of_the_root_are_the_hemispherical_values(rank):
    tree = random_tree(rank, seed=4)
    tables = sampling_tree(tree)
    cells = (1 << int(tables.heights[0])) ** (rank - 2)
    root = np.pi * tables.masses[: 4 * cells].reshape(-1, 4).mean(axis=1)
    expected = tree.hemispherical().ravel()
    np.testing.assert_allclose(root[: len(expected)], expected, atol=1e-12)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("rank", [3, 4])
def test_eval_is_the_leaf_times_cosine(variant, mode, rank):
    bsdf = system(rank)
    wi, wo = random_directions(20_000, 1), random_directions(20_000, 2)
    si, change = interaction(wi)
    value = np.array(load(bsdf).eval(context(mode), si, to_mitsuba(wo))).ravel()
    expected = bsdf_values(bsdf, *pair(wi @ change, wo @ change, mode)) * abs(wo[:, 2])
    wrong = ~np.isclose(value, expected, rtol=1e-5, atol=1e-7)
    assert wrong.mean() < 3e-4  # float32 puts a few directions beyond a cell's border


def cells(rank: int, known, directions):
    """Cell [side, 2^n x 2^n] of the outgoing square, turned as the tree is, of directions."""
    u, v = outgoing_disk(directions).T
    if rank == 3:
        x, y = incident_disk(known)
        c, s = np.array([x, y]) / np.hypot(x, y)
        u, v = u * c + v * s, v * c - u * s
    width = 1 << LEVELS
    cell = np.minimum((disk_to_square(np.stack([u, v], -1)) * width).astype(int), width - 1)
    return ((directions[:, 2] < 0) * width + cell[:, 0]) * width + cell[:, 1]


def cell_centres(rank: int, known):
    """Direction at the middle of each of `cells`."""
    width = 1 << LEVELS
    axis = (np.arange(width) + 0.5) / width
    u, v = square_to_disk(np.stack(np.meshgrid(axis, axis, indexing="ij"), -1).reshape(-1, 2)).T
    if rank == 3:
        x, y = incident_disk(known)
        c, s = np.array([x, y]) / np.hypot(x, y)
        u, v = u * c - v * s, v * c + u * s
    z = np.sqrt(1 - u**2 - v**2)
    half = np.stack([-u, v, z], -1)
    return np.concatenate([half, half * [1, 1, -1]])


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["front", "back"])
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("rank", [3, 4])
def test_samples_follow_the_pdf(variant, rank, mode, side):
    """Chi-square over both hemispheres; pdf / cos is constant in each cell."""
    count, bsdf = 200_000, load(system(rank))
    wi = np.array([0.36, 0.48, 0.8 * side])
    sample, weight, si, change = sampled(bsdf, context(mode), wi, count, seed=4)
    known = wi @ change
    value, pdf = (np.array(x).ravel() for x in bsdf.eval_pdf(context(mode), si, sample.wo))
    inside = np.isclose(pdf, np.array(sample.pdf), rtol=1e-4)
    assert inside.mean() > 1 - 1e-3  # the rest fell on a cell's border in float32
    np.testing.assert_allclose(weight[inside], (value / pdf)[inside], rtol=2e-4, atol=1e-6)
    centres = cell_centres(rank, known)
    many, _ = interaction(np.tile(wi, (len(centres), 1)))
    density = np.array(bsdf.pdf(context(mode), many, to_mitsuba(centres @ change.T)))
    area = np.pi / 4**LEVELS
    expected = count * density / abs(centres[:, 2]) * area
    assert expected.sum() == pytest.approx(count, rel=1e-4)
    found = cells(rank, known, np.array(sample.wo).T @ change)
    observed = np.bincount(found, minlength=len(expected))
    used = expected > 5
    statistic = ((observed - expected)[used] ** 2 / expected[used]).sum()
    assert chi2.sf(statistic, used.sum() - 1) > 1e-3
    assert observed[expected == 0].sum() <= 5


@pytest.mark.parametrize("mode", MODES)
def test_weight_of_rank_4_is_what_is_scattered(variant, mode):
    _, weight, _, _ = sampled(load(system(4)), context(mode), [0.36, 0.48, 0.8], 1000, seed=5)
    assert np.ptp(weight) < 1e-5 * weight[0]


def test_rank_3_from_the_camera_has_the_right_mean(variant):
    """Mean weight = integral of f cos over where the light comes from, by plain sampling."""
    bsdf, wi = system(3), np.array([0.36, 0.48, 0.8])
    _, weight, _, change = sampled(load(bsdf), context("Radiance"), wi, 400_000, seed=6)
    generator = np.random.default_rng(7)
    disk = square_to_disk(generator.uniform(size=(400_000, 2)))
    z = np.sqrt(1 - (disk**2).sum(axis=1)) * np.where(np.arange(len(disk)) % 2, 1, -1)
    light = np.concatenate([disk, z[:, None]], axis=1)
    values = 2 * np.pi * bsdf_values(bsdf, light, np.tile(wi @ change, (len(light), 1)))
    sigma = np.hypot(values.std(), weight.std()) / np.sqrt(400_000)
    assert abs(values.mean() - weight.mean()) < 4 * sigma


def test_a_real_file_with_one_transmission(variant, real_data):
    import mitsuba as mi

    from mitsuba_cfs.bsdf import tensor_plugin  # noqa: F401  (registers the plugin)
    from mitsuba_cfs.bsdf.xml import read_bsdf_xml

    path = real_data / "bsdf/tensortree/blinds_20deg_t45.xml"
    bsdf = mi.load_dict({"type": "tensor_tree_bsdf", "filename": str(path)})
    wi, wo = random_directions(20_000, 8), random_directions(20_000, 9)
    si, _ = interaction(wi, normal=(0, -1, 0), spin=0.0)
    value = np.array(bsdf.eval(context("Radiance"), si, to_mitsuba(wo))).ravel()
    expected = bsdf_values(read_bsdf_xml(path).band("Visible"), wo, wi) * abs(wo[:, 2])
    assert (~np.isclose(value, expected, rtol=1e-4, atol=1e-6)).mean() < 2e-3


def test_scalar_variant_gives_the_same(variant):
    import mitsuba as mi

    count, data = 200, system(4)
    wi, u = random_directions(count, 5), np.random.default_rng(7).uniform(size=(count, 3))
    bsdf = load(data)
    sample, weight = bsdf.sample(context("Radiance"), interaction(wi)[0], mi.Float(u[:, 0]), mi.Point2f(u[:, 1:].T))
    vector = np.stack([*np.array(sample.wo), np.array(sample.pdf), np.array(weight).ravel()], 1)
    variants.activate("scalar_rgb")
    try:
        bsdf, rows = load(data), []
        for direction, point in zip(wi, u, strict=True):
            si = interaction(direction)[0]
            sample, weight = bsdf.sample(context("Radiance"), si, point[0], mi.Point2f(point[1:]))
            rows.append([*sample.wo, sample.pdf, weight[0]])
    finally:
        variants.activate("llvm_ad_mono")
    same = np.isclose(vector, np.array(rows), rtol=1e-3, atol=1e-4).all(axis=1)
    assert same.mean() > 0.98  # the others lie on a cell's border


def test_a_single_value_is_a_diffuser(variant):
    """Lambertian 0.5: weight 0.5 everywhere."""
    one = TensorTree(4, np.zeros(1, dtype=np.int64), np.array([0.5 / np.pi]))
    bsdf = load(TensorTreeBsdf(transmission_front=one))
    _, weight, _, _ = sampled(bsdf, context("Radiance"), [0.0, 0.6, -0.8], 100, seed=1)
    np.testing.assert_allclose(weight, 0.5, rtol=1e-5)
