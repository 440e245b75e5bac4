"""Perforated, woven and pleated layers: areas, openness, WINDOW's engine, closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.generate import generate_klems
from mitsuba_cfs.bsdf.klems import KLEMS_QUARTER
from mitsuba_cfs.bsdf.periodic import SlatMaterial, plastic
from mitsuba_cfs.bsdf.screens import perforated_screen, pleated_shade, woven_screen

BLACK = plastic("black", 0.0)


def area(triangles):
    edges = triangles[:, 1:] - triangles[:, :1]
    return 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum()


@pytest.mark.parametrize("make", [perforated_screen, woven_screen])
@pytest.mark.parametrize("openness", [0.05, 0.3, 0.6])
def test_the_holes_have_the_openness(make, openness):
    layer = make(BLACK, spacing=0.01, openness=openness, thickness=0.0)
    assert area(layer.triangles) == pytest.approx((1 - openness) * 1e-4, rel=1e-9)


@pytest.mark.parametrize("make", [perforated_screen, woven_screen])
def test_a_thick_sheet_has_two_faces_and_walls(make):
    spacing, openness, thickness = 0.01, 0.3, 0.002
    triangles = make(BLACK, spacing=spacing, openness=openness, thickness=thickness).triangles
    if make is woven_screen:
        outline = 4 * spacing * np.sqrt(openness)
    else:  # 24 sides round the area of the hole
        outline = 2 * spacing * np.sqrt(24 * openness * np.tan(np.pi / 24))
    expected = 2 * (1 - openness) * spacing**2 + outline * thickness
    assert area(triangles) == pytest.approx(expected, rel=1e-9)
    assert (triangles[..., 2].min(), triangles[..., 2].max()) == pytest.approx((-0.001, 0.001))


@pytest.mark.parametrize("make", [perforated_screen, woven_screen])
def test_a_thin_black_sheet_passes_its_openness_at_every_angle(variant, make):
    layer = make(BLACK, spacing=0.01, openness=0.2, thickness=0.0)
    bsdf = generate_klems(layer, KLEMS_QUARTER, samples=4096, seed=1).bsdf[0]
    share = bsdf.direct_hemispherical(bsdf.transmission_front)
    # 41 directions of 4096 paths: 4 sigma of a share of 0.2 drawn at random
    np.testing.assert_allclose(share, 0.2, atol=4 * np.sqrt(0.16 / 4096))
    assert np.count_nonzero(bsdf.reflection_front) == 0


def test_a_thick_woven_sheet_cuts_off(variant):
    """Square holes with walls: light at angles (a, b) passes (1 - t tan a / h)(1 - t tan b / h)."""
    spacing, openness, thickness = 0.002, 0.25, 0.0005
    layer = woven_screen(BLACK, spacing=spacing, openness=openness, thickness=thickness)
    bsdf = generate_klems(layer, KLEMS_QUARTER, samples=8192, seed=2).bsdf[0]
    patch = np.repeat(np.arange(41), 20_000)
    theta, phi = KLEMS_QUARTER.angles_within(patch, *np.random.default_rng(3).uniform(size=(2, len(patch))))
    hole, run = spacing * np.sqrt(openness), thickness * np.tan(theta)
    passed = np.maximum(1 - run * abs(np.cos(phi)) / hole, 0)
    passed = openness * passed * np.maximum(1 - run * abs(np.sin(phi)) / hole, 0)
    expected = passed.reshape(41, -1).mean(axis=1)
    found = bsdf.direct_hemispherical(bsdf.transmission_front)
    np.testing.assert_allclose(found, expected, atol=0.015)  # 3 sigma of 8192 random paths


def test_perforated_sheet_of_windows_engine(variant, real_data):
    """Windows-CalcEngine's test values at normal incidence: 19.05 mm, holes of 6.35 mm, opaque.

    Away from normal it depends on the sheet's thickness, which its test file does not name.
    """
    openness = np.pi / 4 * (6.35 / 19.05) ** 2
    layer = perforated_screen(plastic("sheet", 0.1), spacing=0.01905, openness=openness)
    bsdf = generate_klems(layer, KLEMS_QUARTER, samples=65_536, seed=4).bsdf[0]
    case = "T=0_R=0.1_xSpacing=19.05_ySpacing=19.05_Diameter=6.35.csv"
    weight = KLEMS_QUARTER.projected_solid_angles()
    for block, name in (("Rf", "reflection_front"), ("Tf", "transmission_front")):
        path = real_data / f"bsdf/wce_csv/TestPerforatedCircularMatrix{block}_{case}"
        theirs = (weight @ np.loadtxt(path, delimiter=","))[0]
        found = bsdf.direct_hemispherical(getattr(bsdf, name))[0]
        assert found == pytest.approx(theirs, abs=0.002), name  # 2 sigma of the paths


def test_a_white_pleat_loses_nothing_and_hides_what_is_behind(variant):
    fabric = SlatMaterial("fabric", (0.6,), (0.6,), transmittance=(0.4,))
    layer = pleated_shade(fabric, depth=0.02, spacing=0.025)
    bsdf = generate_klems(layer, KLEMS_QUARTER, samples=2048, seed=5).bsdf[0]
    total = bsdf.direct_hemispherical(bsdf.transmission_front + bsdf.reflection_front)
    np.testing.assert_allclose(total, 1, atol=1e-6)
    flat = 0.4  # what the fabric itself passes; folds throw some light back and forth
    assert (np.abs(bsdf.direct_hemispherical(bsdf.transmission_front) - flat) < 0.12).all()


def test_screens_that_cannot_be_are_refused():
    with pytest.raises(ValueError, match="openness"):
        perforated_screen(BLACK, spacing=0.01, openness=0.8)
    with pytest.raises(ValueError, match="multiple of 4"):
        perforated_screen(BLACK, spacing=0.01, openness=0.1, segments=10)
    with pytest.raises(ValueError, match="openness"):
        woven_screen(BLACK, spacing=0.01, openness=1.0, thickness=0.0)
