"""Klems bases and matrices: closed forms, and Radiance's library on asymmetric files."""

from __future__ import annotations

from dataclasses import replace

import bsdf_radiance as radiance
import numpy as np
import pytest

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KLEMS_HALF, KLEMS_QUARTER, STANDARD_BASES, KlemsBasis, KlemsBsdf
from mitsuba_cfs.bsdf.xml import BsdfFile, read_bsdf_xml, write_bsdf_xml
from mitsuba_cfs.directions import incident_azimuth, outgoing_azimuth
from tests.conftest import OWN_BLIND

ASYMMETRIC_FILES = (  # all with other values on the back than on the front
    "klems_full/SquareSlat_genBSDF.xml",
    "klems_full/blinds_20deg_noGlazing_Klems.xml",
    "klems_full/bcl_cl_Tn0.88_blinds.xml",  # back blocks only
    "klems_full/hb_diffuse50.xml",  # front transmission only
    "layered_afc/blinds0.4_sol_blinds_0.024_0.024_45.0.xml",
    "derived_klems_half_quarter/blinds_20deg_klems_half.xml",
    "derived_klems_half_quarter/blinds_20deg_klems_quarter.xml",
)


@pytest.mark.parametrize("basis", STANDARD_BASES, ids=lambda basis: basis.name)
def test_patches_tile_the_hemisphere(basis):
    assert basis.size == {"Full": 145, "Half": 77, "Quarter": 41}[basis.name.split()[-1]]
    assert basis.projected_solid_angles().sum() == pytest.approx(np.pi, rel=1e-12)
    np.testing.assert_array_equal(basis.index(*basis.centres()), np.arange(basis.size))


@pytest.mark.peer
@pytest.mark.parametrize("basis", STANDARD_BASES, ids=lambda basis: basis.name)
def test_patches_are_those_of_windows_engine(basis):
    """Radiance's tables had 73 patches in the half basis once; WINDOW's engine has 77."""
    pywincalc = pytest.importorskip("pywincalc")
    kind = getattr(pywincalc.BSDFBasisType, basis.name.split()[-1].upper())
    hemisphere = pywincalc.BSDFHemisphere.create(kind)
    theirs = hemisphere.get_directions(pywincalc.BSDFDirection.Incoming).lambda_vector()
    np.testing.assert_allclose(basis.projected_solid_angles(), theirs, rtol=1e-12)


def test_angles_within_a_patch_stay_in_it():
    generator = np.random.default_rng(3)
    patch = generator.integers(0, KLEMS_FULL.size, 10_000)
    theta, phi = KLEMS_FULL.angles_within(patch, *generator.uniform(0, 1, (2, 10_000)))
    np.testing.assert_array_equal(KLEMS_FULL.index(theta, phi), patch)


def test_directions_follow_the_stated_azimuths():
    theta, phi = KLEMS_FULL.centres()
    incident, outgoing = KLEMS_FULL.incident_directions(), KLEMS_FULL.outgoing_directions()
    off = theta > 0
    np.testing.assert_allclose(incident_azimuth(incident[off]), phi[off], atol=1e-12)
    np.testing.assert_allclose(outgoing_azimuth(outgoing[off]), phi[off], atol=1e-12)
    np.testing.assert_allclose(outgoing, -incident, atol=1e-15)  # straight through: same patch
    sun = KLEMS_FULL.index(np.radians(40), incident_azimuth([0, 1, 1]))  # high sun, from above
    assert np.degrees(phi[sun]) == pytest.approx(270)


def test_opposite_is_half_a_turn_away():
    np.testing.assert_allclose(
        KLEMS_HALF.incident_directions()[KLEMS_HALF.opposite()],
        KLEMS_HALF.incident_directions() * [-1, -1, 1],
        atol=1e-12,
    )


def test_straight_through_glass_is_a_diagonal_transmission_matrix():
    value = np.diag(0.7 / KLEMS_FULL.projected_solid_angles())
    system = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, transmission_front=value)
    np.testing.assert_allclose(system.transmission_matrix(), 0.7 * np.eye(145), atol=1e-12)
    np.testing.assert_allclose(system.filled().transmission_back, value, rtol=1e-12)


def test_bases_that_cannot_be_are_refused():
    with pytest.raises(ValueError, match="span"):
        KlemsBasis("short", (0.0, 1.0), (1,))
    with pytest.raises(ValueError, match="impossible"):
        KlemsBasis("one patch ring", (0.0, 0.5, np.pi / 2), (1, 1))
    with pytest.raises(ValueError, match="transmission_back"):
        KlemsBsdf(KLEMS_FULL, KLEMS_FULL, transmission_back=np.zeros((145, 144)))


def test_a_polar_angle_beyond_the_hemisphere_is_refused():
    for theta in ([0.1, 1.6], [-0.1, 0.1]):
        with pytest.raises(ValueError, match="expected 0 to pi / 2"):
            KLEMS_FULL.index(theta, [0.0, 0.0])
    assert KLEMS_FULL.index(np.pi / 2, 0.0) == KLEMS_FULL.index(np.radians(80), 0.0)  # along the window


def test_light_from_indoors_comes_from_the_other_side_of_the_window():
    """Window frame: z points outdoors; both sides have the same azimuths and heights."""
    outside, inside = KLEMS_FULL.incident_directions(), KLEMS_FULL.incident_directions(back=True)
    assert (outside[:, 2] > 0).all()
    np.testing.assert_array_equal(inside, outside * [1, 1, -1])
    np.testing.assert_array_equal(KLEMS_FULL.outgoing_directions(front=True), -outside * [1, 1, -1])


def evaluate(system: KlemsBsdf, incident, outgoing):
    """BSDF [N] of a filled system for directions [N, 3] in the window frame."""
    patch_in = system.basis_in.index(np.arccos(abs(incident[:, 2])), incident_azimuth(incident))
    patch_out = system.basis_out.index(np.arccos(abs(outgoing[:, 2])), outgoing_azimuth(outgoing))
    front, reflected = incident[:, 2] > 0, incident[:, 2] * outgoing[:, 2] > 0
    return np.select(
        [front & ~reflected, ~front & ~reflected, front & reflected, ~front & reflected],
        [
            getattr(system, name)[patch_out, patch_in]
            for name in ("transmission_front", "transmission_back", "reflection_front", "reflection_back")
        ],
    )


@pytest.mark.peer
@pytest.mark.parametrize("name", [OWN_BLIND, *ASYMMETRIC_FILES])
def test_values_are_those_of_radiance(bsdf_file, name):
    path = bsdf_file(name)
    incident, outgoing = radiance.random_directions(10_000, seed=1)
    theirs = radiance.query(path, incident, outgoing)
    ours = evaluate(
        radiance.perturbed(read_bsdf_xml(path).band("Visible")).filled(),
        radiance.to_window(incident),
        radiance.to_window(outgoing),
    )
    np.testing.assert_allclose(ours, theirs, rtol=radiance.QUERY_TOLERANCE, atol=1e-9)


@pytest.mark.peer
def test_a_basis_of_the_file_s_own_is_read_as_by_radiance(tmp_path):
    basis = KlemsBasis("Mine", (0.0, 0.2, 0.7, 1.1, np.pi / 2), (1, 6, 10, 4))
    blocks = np.random.default_rng(3).uniform(0.02, 0.12, (4, basis.size, basis.size))
    path = tmp_path / "own.xml"
    write_bsdf_xml(BsdfFile({"Visible": KlemsBsdf(basis, basis, *blocks)}), path, digits=9)
    incident, outgoing = radiance.random_directions(10_000, seed=4)
    theirs = radiance.query(path, incident, outgoing)
    ours = evaluate(
        radiance.perturbed(read_bsdf_xml(path).band("Visible")),
        radiance.to_window(incident),
        radiance.to_window(outgoing),
    )
    np.testing.assert_allclose(ours, theirs, rtol=radiance.QUERY_TOLERANCE)


@pytest.mark.peer
@pytest.mark.parametrize("name", [OWN_BLIND, *ASYMMETRIC_FILES])
def test_hemispherical_values_are_those_of_radiance(bsdf_file, name):
    path = bsdf_file(name)
    incident, _ = radiance.random_directions(1_000, seed=2)
    theirs = radiance.direct_hemispherical(path, incident)
    system = read_bsdf_xml(path).band("Visible").filled()
    ours = hemispherical(system, radiance.to_window(incident))
    np.testing.assert_allclose(ours, theirs, atol=1e-7)  # Radiance keeps values in float32


def hemispherical(system: KlemsBsdf, incident):
    """Share [N] of the light scattered to either side, for directions [N, 3] (window frame)."""
    patch = system.basis_in.index(np.arccos(abs(incident[:, 2])), incident_azimuth(incident))
    front = system.transmission_front + system.reflection_front
    back = system.transmission_back + system.reflection_back
    share = np.where(
        incident[:, 2, None] > 0,
        system.direct_hemispherical(front)[patch, None],
        system.direct_hemispherical(back)[patch, None],
    )
    return share[:, 0]


@pytest.mark.peer
@pytest.mark.parametrize("side", ["front", "back"])
def test_single_rows_are_those_of_radiance_to_float_precision(tmp_path, side):
    """One outgoing patch at a time, `direct_hemi` is one matrix entry without the factor."""
    generator = np.random.default_rng(5)
    incident, _ = radiance.random_directions(200, seed=6)
    for row in generator.integers(0, KLEMS_QUARTER.size, 5):
        block = np.zeros((41, 41))
        block[row] = generator.uniform(0.1, 1, 41)
        blank = np.zeros((41, 41))
        system = KlemsBsdf(
            KLEMS_QUARTER,
            KLEMS_QUARTER,
            **{f"transmission_{side}": block, "reflection_front": blank, "reflection_back": blank},
        )
        path = tmp_path / f"{side}{row}.xml"
        write_bsdf_xml(BsdfFile({"Visible": system}), path, digits=9)
        theirs = radiance.direct_hemispherical(path, incident)
        ours = hemispherical(system.filled(), radiance.to_window(incident))
        np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-9)


@pytest.mark.peer
def test_dummy_back_is_the_front_reversed_as_in_radiance(real_data, tmp_path):
    file = read_bsdf_xml(real_data / "bsdf/klems_full/blinds_20deg_noGlazing_Klems.xml")
    system = file.band("Visible")
    dummy = replace(system, transmission_back=np.zeros_like(system.transmission_back))
    path = tmp_path / "dummy_back.xml"
    write_bsdf_xml(replace(file, bands={"Visible": dummy}), path)
    incident, _ = radiance.random_directions(500, seed=8)
    theirs = radiance.direct_hemispherical(path, incident)
    ours = hemispherical(dummy.filled(), radiance.to_window(incident))
    # Radiance drops the front's constant part from the reversed block; here that is 1e-4
    np.testing.assert_allclose(ours, theirs, atol=2e-4)
    assert ours[incident[:, 2] > 0].min() > 0.1


def test_unlike_bases_and_odd_counts_can_be_reversed():
    basis = KlemsBasis("odd", (0.0, 0.5, np.pi / 2), (1, 5))
    block = np.random.default_rng(1).uniform(0.1, 0.2, (41, 6))
    filled = KlemsBsdf(basis, KLEMS_QUARTER, transmission_front=block).filled()
    assert filled.transmission_back.shape == (41, 6)
    assert filled.transmission_back.min() >= 0.1


@pytest.mark.parametrize(("share", "kept"), [(0.0009, False), (0.0011, True)])
def test_a_back_that_transmits_less_than_a_thousandth_is_a_placeholder(share, kept):
    """The threshold below which Radiance drops a component."""
    front = np.full((41, 41), 0.1)
    back = np.full((41, 41), share / np.pi)
    filled = KlemsBsdf(KLEMS_QUARTER, KLEMS_QUARTER, transmission_front=front, transmission_back=back).filled()
    assert filled.transmission_back is not None
    np.testing.assert_allclose(filled.transmission_back, back if kept else front)


def test_rings_of_the_standard_bases_lie_where_windows_engine_has_them():
    """Middles [degrees] and patches of each ring. Source: LBNL, Windows-CalcEngine, `BSDFHemisphere`."""
    for basis, middles, counts in (
        (KLEMS_FULL, [0, 10, 20, 30, 40, 50, 60, 70, 82.5], [1, 8, 16, 20, 24, 24, 24, 16, 12]),
        (KLEMS_HALF, [0, 13, 26, 39, 52, 65, 80.75], [1, 8, 12, 16, 20, 12, 8]),
        (KLEMS_QUARTER, [0, 18, 36, 54, 76.5], [1, 8, 12, 12, 8]),
    ):
        theta, _ = basis.centres()
        np.testing.assert_allclose(np.degrees(theta[basis.ring_starts]), middles, atol=1e-9)
        assert list(basis.phi_counts) == counts
        assert np.degrees(basis.theta_bounds[-1]) == pytest.approx(90)
