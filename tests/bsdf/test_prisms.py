"""Clear bodies: a slab by Fresnel's equations, prisms by Snell's law, energy and reciprocity."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.generate import generate_klems
from mitsuba_cfs.bsdf.glazing import uncoated_values
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KLEMS_QUARTER
from mitsuba_cfs.bsdf.layers import combine_layers
from mitsuba_cfs.bsdf.periodic import PeriodicLayer, SlatMaterial, clear_body, plastic
from mitsuba_cfs.bsdf.screens import prism_panel

INDEX = 1.5


@pytest.fixture(scope="module")
def slab(variant):
    return generate_klems(
        prism_panel(INDEX, pitch=0.01, angle=0.0, thickness=0.004), KLEMS_QUARTER, samples=8192, seed=1
    ).bsdf[0]


def stacked(layers: list[PeriodicLayer], gaps: list[float]) -> PeriodicLayer:
    """Layers in series as one layer, the exterior one first, all on cells of one size.

    Args:
        gaps: clear distance between neighbouring layers [m].
    """
    if len(gaps) != len(layers) - 1 or min(gaps, default=1) <= 0:
        raise ValueError("expected a positive gap between each two layers")
    if len({layer.period for layer in layers}) != 1:
        raise ValueError("the layers' cells are of different sizes")
    triangles, material = [], []
    materials: tuple[SlatMaterial, ...] = ()
    top = 0.0
    for layer, gap in zip(layers, [*gaps, 0.0], strict=True):
        triangles.append(layer.triangles + np.array([0, 0, top - layer.depth_range[1]]))
        material.append(layer.material + len(materials))
        materials += layer.materials
        top -= layer.thickness + gap
    return PeriodicLayer(np.concatenate(triangles), np.concatenate(material), materials, layers[0].period)


def test_a_slab_is_fresnel(slab):
    """(1 - r) / (1 + r), r the mean of both polarisations at one surface, averaged over rings.

    The polarisations are mixed anew at every surface; kept apart, as `glazing` does, a slab passes
    up to 0.02 more at grazing.
    """
    sine2 = np.sin(KLEMS_QUARTER.theta_bounds) ** 2
    step = (np.arange(400) + 0.5) / 400
    theta = np.arcsin(np.sqrt(sine2[:-1, None] + np.diff(sine2)[:, None] * step))
    outer, inner = np.cos(theta), np.sqrt(1 - (np.sin(theta) / INDEX) ** 2)
    r_s = ((outer - INDEX * inner) / (outer + INDEX * inner)) ** 2
    r_p = ((INDEX * outer - inner) / (INDEX * outer + inner)) ** 2
    r = 0.5 * (r_s + r_p)
    expected = ((1 - r) / (1 + r)).mean(axis=1)[KLEMS_QUARTER.rings]
    found = slab.direct_hemispherical(slab.transmission_front)
    np.testing.assert_allclose(found, expected, atol=0.015)  # 3 sigma of 8192 paths at 0.65
    assert np.abs((found - expected).mean()) < 2e-3
    normal = 2 * r[0, 0] / (1 + r[0, 0])
    apart, _ = uncoated_values(1 - normal, normal, theta)
    assert 0 < apart[-1].mean() - expected[-1] < 0.03


def test_a_slab_does_not_bend_light(slab):
    share = slab.direct_hemispherical(slab.transmission_front)
    straight = np.diag(slab.transmission_front) * KLEMS_QUARTER.projected_solid_angles()
    np.testing.assert_allclose(straight, share, rtol=2e-3)  # borders in float32


@pytest.mark.parametrize("angle_deg", [0, 25, 45])
def test_clear_bodies_lose_nothing(variant, angle_deg):
    layer = prism_panel(INDEX, pitch=0.01, angle=np.radians(angle_deg), thickness=0.002)
    bsdf = generate_klems(layer, KLEMS_QUARTER, samples=1024, seed=2).bsdf[0]
    for side in ("front", "back"):
        np.testing.assert_allclose(bsdf.scattered(side), 1, atol=2e-3)


def test_the_long_face_of_a_prism_has_its_angle():
    angle = np.radians(33)
    triangles = prism_panel(INDEX, pitch=0.01, angle=angle, thickness=0.002).triangles
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # outdoors; towards the room and down, as the panel is thicker above; the short level face
    faces = [[0, 0, 1], [0, -np.sin(angle), -np.cos(angle)], [0, 1, 0]]
    for normal in normals:
        assert np.abs(normal - faces).max(axis=1).min() < 1e-12
    for face in faces:
        assert np.abs(normals - face).max(axis=1).min() < 1e-12


def test_a_prism_bends_as_snell_says(variant):
    """Light at normal incidence from outside leaves the long face bent by asin(n sin a) - a."""
    angle = np.radians(20)
    layer = prism_panel(INDEX, pitch=0.01, angle=angle, thickness=0.002)
    bsdf = generate_klems(layer, KLEMS_FULL, samples=8192, seed=3).bsdf[0]
    bend = np.arcsin(INDEX * np.sin(angle)) - angle
    patch = int(np.argmax(bsdf.transmission_front[:, 0] * KLEMS_FULL.projected_solid_angles()))
    out = KLEMS_FULL.outgoing_directions()[patch]
    # light bends to where the glass is thicker: upwards
    assert np.degrees(np.arctan2(out[1], -out[2])) == pytest.approx(np.degrees(bend), abs=6)
    assert abs(out[0]) < 1e-9


def clear_pane(index: float, thickness: float, period: tuple[float, float], *, channels: int = 1) -> PeriodicLayer:
    """A pane of clear glass on a cell of any size: its two faces."""
    width, height = period
    outside = np.array([[0, 0, 0], [width, 0, 0], [width, height, 0], [0, height, 0]], dtype=float)
    inside = outside[::-1] - [0, 0, thickness]
    triangles = np.array([face[[0, a, a + 1]] for face in (outside, inside) for a in (1, 2)])
    material = clear_body("glass", index, channels=channels)
    return PeriodicLayer(triangles, np.zeros(4, dtype=np.int64), (material,), period)


def test_a_blind_before_glass_traced_at_once_and_by_layer_algebra(variant):
    """A grey blind 5 mm before a clear pane: one tracing, or two and matrix algebra."""
    blind = venetian_blind(plastic("grey", 0.5), depth=0.03, spacing=0.025, tilt=np.radians(35))
    pane = clear_pane(INDEX, 0.004, blind.period)
    at_once = generate_klems(stacked([blind, pane], [0.005]), KLEMS_FULL, samples=16_384, seed=4).bsdf[0]
    parts = [generate_klems(part, KLEMS_FULL, samples=16_384, seed=5).bsdf[0] for part in (blind, pane)]
    by_algebra = combine_layers(parts).bsdf
    for name, block in at_once.blocks().items():
        found = by_algebra.direct_hemispherical(getattr(by_algebra, name))
        share = at_once.direct_hemispherical(block)
        # matrices forget where in a patch and behind which slat the light is: what a pane throws
        # back at normal incidence meets the gap it came through, 0.012 more than by algebra
        assert np.abs(found - share).max() < 0.05, name
        assert np.sqrt(((found - share) ** 2).mean()) < 0.01, name
    assert not np.allclose(parts[0].reflection_back, by_algebra.reflection_back)


def test_bodies_that_cannot_be_are_refused():
    with pytest.raises(ValueError, match="index"):
        clear_body("thin air", 0.9)
    with pytest.raises(ValueError, match="no colour"):
        SlatMaterial("tinted", (0.1,), (0.1,), index=1.5)
    with pytest.raises(ValueError, match="angle"):
        prism_panel(1.5, pitch=0.01, angle=2.0, thickness=0.001)
