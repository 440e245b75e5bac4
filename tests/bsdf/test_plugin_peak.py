"""Peak extraction: what goes straight on passes undisturbed, the rest is scattered as before."""

from __future__ import annotations

import numpy as np
import pytest
from plugin_setup import UP, context, interaction, random_directions, sampled, to_mitsuba

from mitsuba_cfs.bsdf.evaluate import direct_hemispherical, tree_peak
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf, morton
from mitsuba_cfs.bsdf.xml import read_bsdf_xml

KLEMS_GLASS = "klems_full/SingleClear_WINDOW.xml"
TREE_GLASS = "tensortree/clear_t4_6.xml"
TREE_BLIND = "tensortree/blinds_20deg_t45.xml"


def load(path, peak):
    import mitsuba as mi

    from mitsuba_cfs.bsdf import plugin, tensor_plugin

    kind = plugin.PLUGIN if "klems" in str(path) else tensor_plugin.PLUGIN
    return mi.load_dict({"type": kind, "filename": str(path), "peak": peak, "up": [0.2, 0.1, 1.0]})


def nulls(sample):
    import mitsuba as mi

    return (np.array(sample.sampled_type) & int(mi.BSDFFlags.Null)) > 0


@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
@pytest.mark.parametrize("name", [KLEMS_GLASS, TREE_GLASS])
def test_glass_lets_the_view_through_undisturbed(variant, real_data, name, mode):
    path, wi = real_data / "bsdf" / name, np.array([0.36, 0.48, -0.8])
    sample, weight, _, change = sampled(load(path, True), context(mode), wi, 20_000, seed=1)
    straight = nulls(sample)
    assert np.abs(np.array(sample.wo).T[straight] + wi).max() < 1e-6
    file = read_bsdf_xml(path).band("Visible")
    # from the camera the light comes from outside, from a light source it starts indoors: the
    # glass is alike on both sides, and what is reflected is the share of the other samples
    local = (wi @ change)[None]
    transmitted = direct_hemispherical(file, "transmission_back", local)[0]
    reflected = direct_hemispherical(file, "reflection_back", local)[0]
    share = transmitted / (transmitted + reflected)
    assert straight.mean() == pytest.approx(share, abs=4 * np.sqrt(share * (1 - share) / 20_000) + 0.02)
    np.testing.assert_allclose(weight, transmitted + reflected, rtol=0.02)
    transmits = np.array(sample.wo)[2] > 0
    assert (transmits & ~straight).mean() < 0.02  # next to nothing of it is scattered


def test_what_scatters_evenly_has_no_beam(variant):
    import mitsuba as mi

    from mitsuba_cfs.bsdf.klems import KLEMS_QUARTER, KlemsBsdf
    from mitsuba_cfs.bsdf.plugin import klems_plugin

    flat = np.full((41, 41), 0.4 / np.pi)
    bsdf = mi.load_dict(klems_plugin(KlemsBsdf(KLEMS_QUARTER, KLEMS_QUARTER, flat), peak=True))
    sample, weight, _, _ = sampled(bsdf, context("Radiance"), [0.0, 0.6, -0.8], 1000, seed=2)
    assert not nulls(sample).any()
    np.testing.assert_allclose(weight, 0.4, rtol=1e-5)


@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
def test_a_blind_keeps_all_it_lets_through(variant, real_data, mode):
    """Beam and rest add up to what the plugin without extraction scatters, for any direction."""
    path = real_data / "bsdf" / TREE_BLIND
    wi = random_directions(4000, 3)
    si, _ = interaction(wi)
    u = np.random.default_rng(4).uniform(size=(3, len(wi))).astype(np.float32)
    import mitsuba as mi

    results = [load(path, peak).sample(context(mode), si, mi.Float(u[0]), mi.Point2f(u[1:])) for peak in (False, True)]
    whole, parts = (np.array(weight).ravel() for _, weight in results)
    np.testing.assert_allclose(parts, whole, rtol=1e-3, atol=1e-5)
    straight = nulls(results[1][0])
    assert 0.1 < straight.mean() < 0.6  # slats 20 degrees down let much of the light straight on
    assert not nulls(results[0][0]).any()


def test_eval_leaves_the_beam_out(variant, real_data):
    path, wi = real_data / "bsdf" / KLEMS_GLASS, random_directions(2000, 5)
    si, _ = interaction(wi)
    values = [
        np.array(load(path, peak).eval(context("Radiance"), si, to_mitsuba(-wi))).ravel() for peak in (False, True)
    ]
    assert (values[1] < 0.02 * values[0]).all()


def test_peaks_of_a_tree_are_its_straight_leaves(real_data):
    tree = read_bsdf_xml(real_data / "bsdf" / TREE_BLIND).band("Visible").transmission_back
    rest, beams = tree_peak(tree)
    lost = tree.hemispherical() - rest.hemispherical()
    np.testing.assert_allclose(beams, lost, atol=1e-12)
    assert (rest.values >= 0).all() and (rest.values <= tree.values + 1e-12).all()


def isotropic_glass(straight: float = 0.8, diffuse: float = 0.05, depth: int = 5) -> TensorTree:
    """Rank 3: light goes straight on, into the two cells either side of azimuth zero."""
    cells = 1 << depth
    grid = np.full((cells,) * 3, diffuse / np.pi)
    for cell in range(cells // 2):
        grid[cell, cells - 1 - cell, cells // 2 - 1 : cells // 2 + 1] += straight * cells**2 / np.pi / 2
    return tree_of(grid)


def test_the_peak_of_an_isotropic_tree_is_taken_out_whole():
    tree = isotropic_glass()
    rest, beams = tree_peak(tree)
    assert beams.shape == (16,)
    np.testing.assert_allclose(beams, 0.8, rtol=1e-9)
    np.testing.assert_allclose(rest.values, 0.05 / np.pi, rtol=1e-9)
    np.testing.assert_allclose(tree.hemispherical() - rest.hemispherical(), beams, rtol=1e-9)
    assert tree_peak(rest)[1].max() == 0
    np.testing.assert_array_equal(tree_peak(isotropic_glass(depth=2))[1], 0)  # cells too wide


def tree_of(grid: np.ndarray) -> TensorTree:
    """A tree of a dense grid [1/sr], all its leaves of the same size."""
    depth = int(np.log2(len(grid)))
    order = np.argsort(morton(np.stack(np.indices(grid.shape), -1), depth).ravel())
    return TensorTree(grid.ndim, np.full(grid.size, depth), grid.ravel()[order])


@pytest.mark.parametrize("rank", [3, 4])
@pytest.mark.parametrize("times, share", [(7.9, 0.0), (9.0, 8.0)])
def test_a_peak_is_more_than_eight_times_what_surrounds_it(rank, times, share):
    """In leaves of its own size, as aBSDF has it: up to there they are all one peak, and none."""
    cells, level = 16, 0.1
    grid = np.full((cells,) * rank, level)
    for i in range(cells):
        if rank == 4:
            grid[i, range(cells), i, range(cells)] = times * level
        elif i < cells // 2:
            grid[i, cells - 1 - i, cells // 2 - 1 : cells // 2 + 1] = times * level
    rest, beams = tree_peak(tree_of(grid))
    leaves = 1 if rank == 4 else 2
    assert beams.max() == pytest.approx(leaves * share * level * np.pi / cells**2)
    assert rest.values.max() == pytest.approx(level if share else times * level)


def test_a_peak_of_several_leaves_is_a_beam_of_all_of_them():
    """Measured data blur it: what lies in the leaves beside the straight one belongs to it."""
    cells, level = 16, 0.02
    grid = np.full((cells,) * 4, level)
    a, b = np.meshgrid(np.arange(cells), np.arange(cells - 1), indexing="ij")
    grid[a, b, a, b] = 5.0
    grid[a, b, a, b + 1] = 3.0  # to one side
    rest, beams = tree_peak(tree_of(grid))
    assert beams[:, :-1] == pytest.approx((8.0 - 2 * level) * np.pi / cells**2)
    assert rest.values.max() == pytest.approx(level)


def coarse_blind(bright: float, dark: float) -> TensorTree:
    """Scattering in small leaves round the direction straight on, in large ones elsewhere."""
    cells = 16
    grid = np.full((cells,) * 4, dark)
    grid[8:10, 8:10, 8:10, 8:10] = bright * (1 + 0.1 * np.random.default_rng(0).random((2,) * 4))
    depths = np.full(cells**4, 4)
    tree = tree_of(grid)
    corner = tree.corners()
    inside = ((corner >= 8) & (corner < 10)).all(axis=1)
    coarse = ~inside & ((corner % 2) == 0).all(axis=1)
    keep = inside | coarse
    return TensorTree(4, np.where(coarse, 3, depths)[keep], tree.values[keep])


def test_scattering_that_is_known_in_small_leaves_is_no_beam():
    """Radiance's aBSDF makes one of it: 1.6 times what surrounds it (a blind in 256 cells)."""
    assert tree_peak(coarse_blind(0.033, 0.02))[1].max() == 0
    assert tree_peak(coarse_blind(0.066, 0.02))[1].max() > 5e-4


@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
@pytest.mark.parametrize("side", [-1, 1])
def test_isotropic_glass_lets_the_view_through_undisturbed(variant, mode, side):
    """Only the front's transmission is given: the back's beam is the same by reciprocity."""
    import mitsuba as mi

    from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin

    glass = TensorTreeBsdf(transmission_front=isotropic_glass())
    wi = np.array([0.36, 0.48, 0.8 * side])
    bsdf = mi.load_dict(tensor_tree_plugin(glass, up=UP, peak=True))
    sample, weight, si, _ = sampled(bsdf, context(mode), wi, 20_000, seed=1)
    straight = nulls(sample)
    assert np.abs(np.array(sample.wo).T[straight] + wi).max() < 1e-6
    # 5 sigma, and 2 %: the resampled way back is not quite as even as the way there
    assert straight.mean() == pytest.approx(0.8 / 0.85, abs=5 * 0.0017 + 0.02)
    assert weight.mean() == pytest.approx(0.85, rel=0.02)
    assert np.array(bsdf.eval(context(mode), si, to_mitsuba(-wi))).max() < 0.02


@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
@pytest.mark.parametrize("side", [-1, 1])
def test_the_beam_is_that_of_the_side_the_light_comes_from(variant, mode, side):
    import mitsuba as mi

    from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin

    pane = TensorTreeBsdf(transmission_front=isotropic_glass(0.8), transmission_back=isotropic_glass(0.3))
    bsdf = mi.load_dict(tensor_tree_plugin(pane, up=UP, peak=True))
    # in mode Radiance the light goes to where `wi` points, in mode Importance it comes from there
    straight = 0.8 if (side > 0) == (mode == "Importance") else 0.3
    weight = sampled(bsdf, context(mode), np.array([0.36, 0.48, 0.8 * side]), 5000, seed=1)[1]
    assert weight.mean() == pytest.approx(straight + 0.05, rel=0.03)


def test_an_isotropic_blind_keeps_all_it_lets_through(variant, real_data):
    """A real tree of rank 3: beam and rest add up to what it scatters without extraction."""
    path = real_data / "bsdf/tensortree/pyradiance_room_blindsT3.xml"
    wi = random_directions(4000, 3)
    import mitsuba as mi

    si, _ = interaction(wi)
    u = np.random.default_rng(4).uniform(size=(3, len(wi))).astype(np.float32)
    whole, parts = (
        load(path, peak).sample(context("Importance"), si, mi.Float(u[0]), mi.Point2f(u[1:])) for peak in (False, True)
    )
    np.testing.assert_allclose(np.array(parts[1]), np.array(whole[1]), rtol=1e-3, atol=1e-5)
    assert 0.02 < nulls(parts[0]).mean() < 0.6


@pytest.mark.parametrize("rank", [3, 4])
def test_the_sun_and_paths_have_the_beam_and_the_rest_of_a_tree(variant, real_data, rank):
    """Either rank: what goes straight on and what scatters are together what the tree passes."""
    import mitsuba as mi

    from mitsuba_cfs.trace.kernels.scattering import sun_scattering
    from mitsuba_cfs.trace.paths.scene import path_optics

    if rank == 3:
        tree = TensorTreeBsdf(transmission_front=isotropic_glass(0.5, 0.2))
    else:
        tree = read_bsdf_xml(real_data / "bsdf" / TREE_BLIND).band("Visible")
    suns = np.array([[0.3, 0.5, 0.8], [-0.2, 0.1, 0.97], [0.6, -0.4, 0.7]])
    suns /= np.linalg.norm(suns, axis=1)[:, None]
    whole = direct_hemispherical(tree, "transmission_front", suns)
    u = np.random.default_rng(3).random((2, 100_000))
    r, phi = np.sqrt(u[0]), 2 * np.pi * u[1]
    outward = mi.Vector3f(np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - u[0])]))
    way, paths, beams = sun_scattering(tree), path_optics(tree), []
    for given, passed in zip(suns, whole, strict=True):
        sun = mi.Vector3f(*map(float, given))
        beam = float(way.through(sun).numpy()[0])
        assert float(paths.straight(sun).numpy()[0]) == pytest.approx(beam)
        beams.append(beam)
        values = np.pi * way.scattered(sun, outward).numpy()
        noise = 5 * values.std() / np.sqrt(len(values))
        assert beam + values.mean() == pytest.approx(passed, abs=noise + 1e-4)
    assert max(beams) > 0.1  # there is a beam at all
