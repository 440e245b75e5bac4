"""Colour: the plugins in rgb and spectral variants, from the bands CIE-X, Visible and CIE-Z."""

from __future__ import annotations

import bsdf_radiance as radiance
import numpy as np
import pytest
from plugin_setup import UP, context, interaction, random_directions, to_mitsuba
from test_plugin import asymmetric
from test_tensor_tree import random_tree

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.colour import RGB_TO_XYZ, WAVELENGTHS_NM, WHITE, leaf_means, primary_spectra, relative_rgb
from mitsuba_cfs.bsdf.evaluate import bsdf_values
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf
from mitsuba_cfs.bsdf.xml import BsdfFile, write_bsdf_xml


@pytest.fixture
def in_variant():
    """Activates a Mitsuba variant until the test ends."""
    yield variants.activate
    variants.activate("llvm_ad_mono")


def bands(kind: str):
    """X, Y and Z of a made-up system: each entry a mild colour of its own."""
    generator = np.random.default_rng(8)
    if kind == "klems":
        y = asymmetric(seed=5)
    else:
        rank = int(kind[-1])
        y = TensorTreeBsdf(*(random_tree(rank, 30 + n, limit=0.2) for n in range(4)))

    def tinted():
        blocks = {}
        for name, block in y.blocks().items():
            values = block if kind == "klems" else block.values
            values = values * generator.uniform(0.9, 1.1, values.shape)
            tree = values if kind == "klems" else TensorTree(rank, block.depths, values)
            blocks[name] = tree
        if kind == "klems":
            return KlemsBsdf(y.basis_in, y.basis_out, **blocks)
        return TensorTreeBsdf(**blocks)

    return tinted(), y, tinted()


def load(x, y, z, **options):
    import mitsuba as mi

    from mitsuba_cfs.bsdf.plugin import klems_plugin
    from mitsuba_cfs.bsdf.tensor_plugin import tensor_tree_plugin

    make = klems_plugin if isinstance(y, KlemsBsdf) else tensor_tree_plugin
    return mi.load_dict(make(y, colour=(x, z), up=UP, **options))


def expected_rgb(systems, incident, outgoing):
    """Linear sRGB [N, 3] of the three bands' values, by IEC 61966-2-1; neutral at X = Y = Z."""
    xyz = np.stack([bsdf_values(system, incident, outgoing) for system in systems], -1)
    return np.linalg.solve(RGB_TO_XYZ, (xyz * WHITE).T).T


@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
@pytest.mark.parametrize("kind", ["klems", "rank 3", "rank 4"])
def test_values_have_the_colour_of_the_three_bands(in_variant, kind, mode):
    import mitsuba as mi

    in_variant("llvm_ad_rgb")
    systems = bands(kind)
    bsdf = load(*systems)
    wi, wo = random_directions(5000, 1), random_directions(5000, 2)
    si, change = interaction(wi)
    value = np.array(bsdf.eval(context(mode), si, to_mitsuba(wo))).T
    known, other = wi @ change, wo @ change
    pair = (other, known) if mode == "Radiance" else (known, other)
    expected = expected_rgb(systems, *pair) * abs(wo[:, 2:])
    assert np.ptp(expected / expected.mean(axis=1, keepdims=True).clip(1e-9), axis=1).max() > 0.3
    wrong = ~np.isclose(value, expected, rtol=1e-4, atol=1e-6).all(axis=1)
    assert wrong.mean() < 1e-3  # on a cell's border in float32
    u = np.random.default_rng(4).uniform(size=(3, len(wi))).astype(np.float32)
    sample, weight = bsdf.sample(context(mode), si, mi.Float(u[0]), mi.Point2f(u[1:]))
    value, pdf = bsdf.eval_pdf(context(mode), si, sample.wo)
    ratio = (np.array(value) / np.array(pdf)).T
    same = np.isclose(np.array(weight).T, ratio, rtol=1e-3, atol=1e-6).all(axis=1)
    assert same.mean() > 0.998  # the rest fell on a cell's border in float32


def test_scalar_variant_has_the_same_colour(in_variant):
    in_variant("scalar_rgb")
    systems = bands("rank 4")
    bsdf = load(*systems)
    wi, wo = random_directions(2, 6)
    si, change = interaction(wi)
    value = np.array(bsdf.eval(context("Importance"), si, to_mitsuba(wo)))
    pair = ((v @ change)[None] for v in (wi, wo))
    np.testing.assert_allclose(value, expected_rgb(systems, *pair)[0] * abs(wo[2]), rtol=1e-4)


@pytest.mark.parametrize("name", ["llvm_ad_spectral", "scalar_spectral"])
def test_spectra_look_as_the_bands_say(in_variant, name):
    """Value times D65 and the observer's curves, integrated over the wavelengths, gives X, Y, Z."""
    import colour

    in_variant(name)
    systems = bands("klems")
    bsdf = load(*systems)
    wi, wo = random_directions(2, 6)
    si, change = interaction(wi)
    shape = colour.SpectralShape(360, 830, 1)
    seen = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape).values
    seen = seen * colour.SDS_ILLUMINANTS["D65"].copy().align(shape).values[:, None]
    values = []
    for first in range(360, 831, 4):
        si.wavelengths = type(si.wavelengths)(*range(first, first + 4))
        values.append(np.array(bsdf.eval(context("Radiance"), si, to_mitsuba(wo))).ravel())
    spectrum = np.concatenate(values)[: len(seen)]
    found = (spectrum @ seen) / seen.sum(axis=0)
    pair = ((v @ change)[None] for v in (wo, wi))
    incident, outgoing = pair
    expected = [bsdf_values(s, incident, outgoing)[0] * abs(wo[2]) for s in systems]
    # 0.3 %: sRGB is defined by a rounded D65, and spectra are straight lines between 10 nm
    np.testing.assert_allclose(found, expected, rtol=3e-3)
    assert np.ptp(spectrum) > 0.05 * spectrum.mean()


def test_what_is_neutral_is_grey_at_all_wavelengths(in_variant):
    in_variant("llvm_ad_spectral")
    _, y, _ = bands("klems")
    wi, wo = random_directions(500, 1), random_directions(500, 2)
    values = []
    for bsdf in (load(y, y, y), plain(y)):
        si, _ = interaction(wi)
        si.wavelengths = type(si.wavelengths)(400.0, 500.0, 600.0, 700.0)
        values.append(np.array(bsdf.eval(context("Radiance"), si, to_mitsuba(wo))))
    np.testing.assert_allclose(values[0], values[1], rtol=1e-5, atol=1e-7)
    assert values[1].shape == (4, 500) and np.ptp(values[1], axis=0).max() == 0


def plain(y: KlemsBsdf):
    import mitsuba as mi

    from mitsuba_cfs.bsdf.plugin import klems_plugin

    return mi.load_dict(klems_plugin(y, up=UP))


def test_the_primaries_add_up_to_one():
    spectra = primary_spectra()
    assert spectra.shape == (3, len(WAVELENGTHS_NM)) and spectra.min() >= 0
    np.testing.assert_allclose(spectra.sum(axis=0), 1, atol=1e-12)
    peak_nm = WAVELENGTHS_NM[[np.argmax(s[10:25]) + 10 for s in spectra]]
    assert peak_nm[2] < peak_nm[1] < peak_nm[0]


def test_colours_beyond_srgb_keep_their_luminance():
    rgb = relative_rgb([1.0, 0.2, 0.0], [1.0, 1.0, 0.0], [1.0, 0.1, 0.0])
    assert rgb[0] == pytest.approx([1, 1, 1], abs=1e-5) and rgb[2] == pytest.approx(1, abs=1e-5)
    assert rgb[1].min() == 0 and RGB_TO_XYZ[1] @ rgb[1] == pytest.approx(1)


@pytest.mark.parametrize("rank", [3, 4])
def test_means_over_leaves_are_those_of_the_dense_grid(rank):
    tree, other = random_tree(rank, 1), random_tree(rank, 2)
    assert not np.array_equal(tree.depths, other.depths)
    fine = other.sample_grid().ravel()
    leaf = tree.leaf(
        (np.stack(np.indices((1 << other.depth,) * rank), -1).reshape(-1, rank) + 0.5) / (1 << other.depth)
    )
    expected = np.bincount(leaf, fine) / np.bincount(leaf)
    np.testing.assert_allclose(leaf_means(tree, other), expected, rtol=1e-9)


@pytest.mark.peer
def test_a_file_in_colour_is_read_as_by_radiance(in_variant, tmp_path):
    import mitsuba as mi

    x, y, z = bands("klems")
    path = tmp_path / "colour.xml"
    write_bsdf_xml(BsdfFile({"Visible": y, "CIE-X": x, "CIE-Z": z}), path)
    in_variant("llvm_ad_rgb")
    import mitsuba_cfs.bsdf.plugin  # noqa: F401  registers the plugin

    bsdf = mi.load_dict({"type": "klems_bsdf", "filename": str(path), "up": list(UP)})
    incident, outgoing = radiance.random_directions(2000, seed=3)
    theirs = radiance.query_xyz(path, incident, outgoing)
    _, change = interaction(incident[0])
    wi, wo = (radiance.to_window(v) @ change.T for v in (outgoing, incident))
    rgb = np.array(bsdf.eval(context("Radiance"), interaction(wi)[0], to_mitsuba(wo))).T
    ours = rgb @ RGB_TO_XYZ.T / WHITE / abs(wo[:, 2:])
    lit = ours[:, 1] > 1e-3
    ratio = ours[lit] / theirs[lit]
    # Radiance keeps u' and v' in steps of 1/410: 2.4 % of X, 6 % of Z, and as much again where
    # it has taken out the constant part
    assert np.abs(ratio - 1).max() < 0.13
    assert np.abs(ratio.mean(axis=0) - 1).max() < 0.005
    in_variant("llvm_ad_mono")
    grey = mi.load_dict({"type": "klems_bsdf", "filename": str(path), "up": list(UP)})
    value = np.array(grey.eval(context("Radiance"), interaction(wi)[0], to_mitsuba(wo)))
    np.testing.assert_allclose(value.ravel() / abs(wo[:, 2]), ours[:, 1], rtol=1e-4, atol=1e-6)


def test_the_beam_has_the_colour_of_what_goes_straight_on(in_variant):
    import mitsuba as mi

    from mitsuba_cfs.bsdf.klems import KLEMS_QUARTER

    in_variant("llvm_ad_rgb")
    straight = np.diag(0.6 / KLEMS_QUARTER.projected_solid_angles())
    y = KlemsBsdf(KLEMS_QUARTER, KLEMS_QUARTER, straight + 1e-3, straight + 1e-3)
    x = KlemsBsdf(KLEMS_QUARTER, KLEMS_QUARTER, 1.1 * straight, 1.1 * straight)
    bsdf = load(x, y, x, peak=True)
    wi = random_directions(200, 9)
    u = np.random.default_rng(4).uniform(size=(3, 200)).astype(np.float32)
    si, _ = interaction(wi)
    sample, weight = bsdf.sample(context("Radiance"), si, mi.Float(u[0]), mi.Point2f(u[1:]))
    beam = (np.array(sample.sampled_type) & int(mi.BSDFFlags.Null)) > 0
    assert beam.mean() > 0.9
    xyz = np.array(weight).T[beam] @ RGB_TO_XYZ.T / WHITE
    np.testing.assert_allclose(xyz[:, 0] / xyz[:, 1], 1.1, rtol=0.01)
    np.testing.assert_allclose(xyz[:, 2] / xyz[:, 1], 1.1, rtol=0.01)
