"""The virtual goniophotometer: closed forms, energy, reciprocity, invariance, and genBSDF."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mitsuba_cfs.bsdf import generate
from mitsuba_cfs.bsdf.blinds import slat_profile, venetian_blind, vertical_louvre
from mitsuba_cfs.bsdf.generate import generate_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KLEMS_QUARTER
from mitsuba_cfs.bsdf.periodic import SlatMaterial, plastic
from mitsuba_cfs.bsdf.xml import read_bsdf_xml

REFERENCE = Path(__file__).parent.parent / "reference" / "genbsdf_blind"
BLIND = {"depth": 0.080, "radius": 0.104, "spacing": 0.072}


def hemispherical(bsdf, kind):
    return bsdf.direct_hemispherical(getattr(bsdf, kind))


def sigma(result, kind, channel=0):
    """Standard error [K in] of a block's hemispherical values, its patches being independent."""
    area = result.bsdf[channel].basis_out.projected_solid_angles()
    return np.sqrt(((area[:, None] * getattr(result.error[channel], kind)) ** 2).sum(axis=0))


def test_black_flat_slats_let_through_what_passes_between(variant):
    tilt, depth, spacing = np.radians(30), 0.08, 0.06
    layer = venetian_blind(plastic("black", 0.0), depth=depth, spacing=spacing, tilt=tilt)
    result = generate_klems(layer, KLEMS_QUARTER, samples=4096, seed=1)
    patch = np.repeat(np.arange(41), 20_000)
    theta, phi = KLEMS_QUARTER.angles_within(patch, *np.random.default_rng(1).uniform(size=(2, len(patch))))
    y, z = -np.sin(theta) * np.sin(phi), np.cos(theta)  # towards the light, outdoors
    covered = depth * np.abs(-np.sin(tilt) - np.cos(tilt) * y / z)
    passed = np.maximum(0, 1 - covered / spacing).reshape(41, -1).mean(axis=1)
    found = hemispherical(result.bsdf[0], "transmission_front")
    # t with 15 degrees of freedom: 6 sigma happens once in 4e4; 5e-4 is the reference's own noise
    spread = sigma(result, "transmission_front")
    assert (np.abs(found - passed) < 6 * spread + 5e-4).all()
    assert np.abs(found - passed).mean() < 2e-3
    assert np.count_nonzero(result.bsdf[0].reflection_front) == 0


def test_white_slats_lose_nothing(variant):
    layer = venetian_blind(plastic("white", 1.0), **BLIND, tilt=np.radians(20))
    result = generate_klems(layer, KLEMS_QUARTER, samples=2048)
    for side in ("front", "back"):
        total = sum(hemispherical(result.bsdf[0], f"{kind}_{side}") for kind in ("transmission", "reflection"))
        np.testing.assert_allclose(total, 1, atol=1e-6)


def test_level_mirrors_pass_everything(variant):
    mirror = SlatMaterial("mirror", (0.0,), (0.0,), specular=1.0)
    layer = venetian_blind(mirror, depth=0.08, spacing=0.06, tilt=0.0)
    result = generate_klems(layer, KLEMS_QUARTER, samples=1024)
    np.testing.assert_allclose(hemispherical(result.bsdf[0], "transmission_front"), 1, atol=1e-5)


def test_values_are_reciprocal_within_their_errors(variant):
    layer = venetian_blind(plastic("grey", 0.55, specular=0.05, roughness=0.1), **BLIND, tilt=0.8)
    result = generate_klems(layer, KLEMS_QUARTER, samples=8192, reciprocal=False, seed=2)
    bsdf, error = result.bsdf[0], result.error[0]
    turn = KLEMS_QUARTER.opposite()
    for there, back in (
        ("transmission_front", "transmission_back"),
        ("reflection_front", "reflection_front"),
        ("reflection_back", "reflection_back"),
    ):
        difference = getattr(bsdf, there) - getattr(bsdf, back).T[np.ix_(turn, turn)]
        spread = np.hypot(getattr(error, there), getattr(error, back).T[np.ix_(turn, turn)])
        z = (difference / np.maximum(spread, 1e-12))[spread > 0]
        # t with 15 degrees of freedom and hundreds of values: unit spread, no shift
        assert 0.85 < np.std(z) < 1.25 and abs(np.mean(z)) < 0.15


def test_result_depends_on_the_seed_only(variant, monkeypatch):
    layer = venetian_blind(plastic("grey", 0.5), **BLIND, tilt=0.8)
    whole = generate_klems(layer, KLEMS_QUARTER, samples=64, seed=3).bsdf[0]
    monkeypatch.setattr(generate, "LANES", 4099)
    parts = generate_klems(layer, KLEMS_QUARTER, samples=64, seed=3).bsdf[0]
    other = generate_klems(layer, KLEMS_QUARTER, samples=64, seed=4).bsdf[0]
    for name, block in whole.blocks().items():
        np.testing.assert_allclose(getattr(parts, name), block, atol=1e-12)
        assert not np.allclose(getattr(other, name), block)


def test_channels_are_traced_at_once(variant):
    both = venetian_blind(plastic("two", 0.3, 0.7), **BLIND, tilt=0.8)
    result = generate_klems(both, KLEMS_QUARTER, samples=4096, seed=5)
    for channel, colour in enumerate((0.3, 0.7)):
        alone = replace(both, materials=(plastic("one", colour),))
        single = generate_klems(alone, KLEMS_QUARTER, samples=4096, seed=6)
        difference = hemispherical(result.bsdf[channel], "reflection_front") - hemispherical(
            single.bsdf[0], "reflection_front"
        )
        spread = np.hypot(sigma(result, "reflection_front", channel), sigma(single, "reflection_front"))
        assert np.abs(difference / spread).max() < 5  # 41 directions
    bright, dark = (hemispherical(b, "reflection_front") for b in result.bsdf[::-1])
    assert (bright > 1.5 * dark).all()


def test_vertical_louvres_are_a_turned_blind(variant):
    options = {"depth": 0.08, "spacing": 0.06, "tilt": 0.5}
    flat = generate_klems(venetian_blind(plastic("grey", 0.5), **options), KLEMS_QUARTER, samples=4096, seed=7)
    upright = generate_klems(vertical_louvre(plastic("grey", 0.5), **options), KLEMS_QUARTER, samples=4096, seed=8)
    theta, phi = KLEMS_QUARTER.centres()
    # exterior edge down -> exterior edge right: the sun from above (270) -> from the left (180)
    turned = KLEMS_QUARTER.index(theta, phi - np.pi / 2)
    difference = hemispherical(upright.bsdf[0], "transmission_front")[turned] - hemispherical(
        flat.bsdf[0], "transmission_front"
    )
    spread = np.hypot(sigma(upright, "transmission_front")[turned], sigma(flat, "transmission_front"))
    assert (np.abs(difference) < 6 * spread + 1e-4).all()
    assert np.abs(difference).max() < 0.02


def test_a_slat_bulges_upwards_and_has_its_depth():
    profile = slat_profile(0.08, 0.104, 0.0, 12)
    assert np.ptp(profile[..., 0]) == pytest.approx(0.08)
    assert np.ptp(profile[..., 1]) == pytest.approx(0.104 - np.sqrt(0.104**2 - 0.04**2))
    middle = np.abs(profile[..., 0]).argmin()
    assert profile[..., 1].ravel()[middle] == profile[..., 1].max()
    with pytest.raises(ValueError, match="radius"):
        slat_profile(0.08, 0.03, 0.0, 12)


GENBSDF_SAMPLES = 20_001


@pytest.fixture(scope="module")
def blind_and_genbsdf(variant):
    """Ours and Radiance's BSDF of the same triangles (SOURCE.md there)."""
    material = plastic("grey", 0.55, specular=0.01, roughness=0.06)
    layer = venetian_blind(material, **BLIND, tilt=np.radians(45))
    ours = generate_klems(layer, KLEMS_FULL, samples=32_768, seed=9)
    return ours, read_bsdf_xml(REFERENCE / "tilt45.xml").band("Visible")


@pytest.mark.parametrize("name", ["transmission_front", "transmission_back", "reflection_front", "reflection_back"])
def test_blind_is_that_of_genbsdf(blind_and_genbsdf, name):
    ours, theirs = blind_and_genbsdf
    value, reference = getattr(ours.bsdf[0], name), getattr(theirs, name)
    difference = hemispherical(ours.bsdf[0], name) - hemispherical(theirs, name)
    # the 0.5 % absolute, with 3 sigma of 20 001 samples of a share of up to 0.3 on top
    assert np.abs(difference).max() < 0.005 + 3 * np.sqrt(0.3 * 0.7 / GENBSDF_SAMPLES)
    assert np.sqrt((difference**2).mean()) < 0.0035
    assert abs(difference.mean()) < 0.0007
    # patch by patch: a path's weight is at most 1, so its variance is at most f / (N omega)
    area = theirs.basis_out.projected_solid_angles()[:, None]
    variance = getattr(ours.error[0], name) ** 2 + np.maximum(value, 1e-4) / GENBSDF_SAMPLES / area
    z = (value - reference) / np.sqrt(variance)
    assert np.sqrt((z**2).mean()) < 1.1


@pytest.mark.parametrize("tilt_deg", [5, 70])
def test_hemispherical_values_at_other_tilts_are_those_of_genbsdf(variant, tilt_deg):
    """The dissertation's other two positions; Radiance's shares stored by incident patch."""
    material = plastic("grey", 0.55, specular=0.01, roughness=0.06)
    layer = venetian_blind(material, **BLIND, tilt=np.radians(tilt_deg))
    ours = generate_klems(layer, KLEMS_FULL, samples=8192, seed=10).bsdf[0]
    theirs = np.loadtxt(REFERENCE / f"hemispherical{tilt_deg}.csv", delimiter=",", skiprows=1)
    for column, name in enumerate(ours.blocks()):
        difference = hemispherical(ours, name) - theirs[:, column]
        # 10 001 samples of a share of up to 0.5: sigma 0.005 in each direction, 0.0004 in the mean
        assert np.abs(difference).max() < 0.005 + 3 * np.sqrt(0.25 / 10_001), name
        assert abs(difference.mean()) < 0.0015, name


class Centres:
    """The middles of the patches in place of all of each, as WINDOW's engine takes them."""

    def __init__(self, basis):
        from mitsuba_cfs.bsdf.traced_klems import table

        self.parts = [table(part) for part in (basis.incident_directions() * [1, -1, 1]).T]

    def direction(self, patch, u, v):
        from mitsuba_cfs.bsdf.traced_klems import gather

        return tuple(gather(part, patch) for part in self.parts)


@pytest.mark.parametrize("reflectance, tilt_deg, depth, spacing", [(0.1, 45, 0.016, 0.012), (0.2, 30, 0.018, 0.014)])
def test_flat_diffuse_slats_are_those_of_window(variant, real_data, reflectance, tilt_deg, depth, spacing):
    """WINDOW's engine: Windows-CalcEngine's own test values (`VenetianDirectionalMatrix`)."""
    from mitsuba_cfs.bsdf.generate import TracedLayer
    from mitsuba_cfs.bsdf.traced_klems import TracedBasis

    layer = venetian_blind(plastic("slat", reflectance), depth=depth, spacing=spacing, tilt=np.radians(tilt_deg))
    (sums,), paths = generate.trace_bins(
        TracedLayer(layer), Centres(KLEMS_QUARTER), 41, TracedBasis(KLEMS_QUARTER), 41, rows=1, samples=16_384, seed=1
    )
    shares = sums[0].sum(axis=-1) / paths  # [side in, patch in, side out]
    case = f"T=0_R={reflectance}_Slat={tilt_deg}_nSegments=5_Rise=0.csv"
    area = KLEMS_QUARTER.projected_solid_angles()
    for name, ours in (
        ("Tf", shares[0, :, 1]),
        ("Rf", shares[0, :, 0]),
        ("Tb", shares[1, :, 0]),
        ("Rb", shares[1, :, 1]),
    ):
        path = real_data / f"bsdf/wce_csv/TestVenetianDirectionalMatrix{name}_{case}"
        theirs = area @ np.loadtxt(path, delimiter=",")
        # the engine shares out diffuse light evenly over five strips of a slat: 1 % at grazing
        np.testing.assert_allclose(ours, theirs, atol=0.012, err_msg=name)
        assert np.sqrt(((ours - theirs) ** 2).mean()) < 0.005, name
