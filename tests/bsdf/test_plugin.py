"""The Klems plugin against Mitsuba's contract, the matrices, and a three-phase calculation."""

from __future__ import annotations

import numpy as np
import pytest
from plugin_setup import UP, context, interaction, random_directions, to_mitsuba
from scipy.stats import chi2

from mitsuba_cfs import variants
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KLEMS_QUARTER, KlemsBsdf
from mitsuba_cfs.directions import incident_azimuth, outgoing_azimuth, window_frame

SIDES = {"front": 1.0, "back": -1.0}


def asymmetric(basis=KLEMS_QUARTER, seed=0) -> KlemsBsdf:
    """A made-up system whose four blocks share nothing, some patches dark."""
    generator = np.random.default_rng(seed)
    blocks = generator.uniform(0, 0.3, (4, basis.size, basis.size)) ** 2
    blocks[blocks < 2e-3] = 0.0
    return KlemsBsdf(basis, basis, *blocks)


def load(klems: KlemsBsdf):
    import mitsuba as mi

    from mitsuba_cfs.bsdf.plugin import klems_plugin

    return mi.load_dict(klems_plugin(klems, up=UP))


def matrix_values(klems: KlemsBsdf, incident, outgoing):
    """BSDF [N] of the matrices for window frame directions [N, 3], in plain NumPy."""
    i = klems.basis_in.index(np.arccos(abs(incident[:, 2])), incident_azimuth(incident))
    o = klems.basis_out.index(np.arccos(abs(outgoing[:, 2])), outgoing_azimuth(outgoing))
    kind = np.where(incident[:, 2] * outgoing[:, 2] > 0, "reflection", "transmission")
    side = np.where(incident[:, 2] > 0, "front", "back")
    return np.array([getattr(klems, f"{k}_{s}")[a, b] for k, s, a, b in zip(kind, side, o, i, strict=True)])


@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
@pytest.mark.parametrize("basis", [KLEMS_FULL, KLEMS_QUARTER], ids=lambda b: b.name)
def test_eval_is_the_matrix_entry_times_cosine(variant, mode, basis):
    klems = asymmetric(basis)
    wi, wo = random_directions(20_000, 1), random_directions(20_000, 2)
    si, basis_change = interaction(wi)
    value = np.array(load(klems).eval(context(mode), si, to_mitsuba(wo))).ravel()
    known, other = wi @ basis_change, wo @ basis_change
    incident, outgoing = (other, known) if mode == "Radiance" else (known, other)
    expected = matrix_values(klems, incident, outgoing) * abs(wo[:, 2])
    wrong = ~np.isclose(value, expected, rtol=1e-5, atol=1e-7)
    assert wrong.mean() < 2e-4  # float32 puts a few directions on a patch's border beyond it


def bins(klems: KlemsBsdf, directions, incident: bool):
    """Cell of [side, patch, 2 x 2 parts] that each window frame direction falls in."""
    basis = klems.basis_in
    azimuth = (incident_azimuth if incident else outgoing_azimuth)(directions)
    theta = np.arccos(np.clip(abs(directions[:, 2]), 0, 1))
    patch = basis.index(theta, azimuth)
    ring = basis.rings[patch]
    sine2 = np.sin(basis.theta_bounds) ** 2
    u = (np.sin(theta) ** 2 - sine2[ring]) / (sine2[ring + 1] - sine2[ring])
    v = np.mod(azimuth / (2 * np.pi) * np.array(basis.phi_counts)[ring] + 0.5, 1)
    part = 2 * (u > 0.5) + (v > 0.5)
    return ((directions[:, 2] < 0) * basis.size + patch) * 4 + part


def bin_probabilities(bsdf, klems, si_for, mode, basis_change):
    """Integral of `pdf` over each cell: pdf / cos is constant in it, by the plugin's contract."""
    basis, incident = klems.basis_in, mode == "Radiance"
    patch = np.repeat(np.arange(basis.size), 4)
    u, v = np.tile([0.25, 0.25, 0.75, 0.75], basis.size), np.tile([0.25, 0.75], 2 * basis.size)
    theta, phi = basis.angles_within(patch, u, v)
    x, y, z = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
    half = np.stack([x, -y, z] if incident else [-x, y, z], -1)
    centres = np.concatenate([half, half * [1, 1, -1]])
    pdf = np.array(bsdf.pdf(context(mode), si_for(len(centres)), to_mitsuba(centres @ basis_change.T)))
    area = np.tile(np.repeat(basis.projected_solid_angles() / 4, 4), 2)
    return pdf / abs(centres[:, 2]) * area


@pytest.mark.parametrize("mode", ["Radiance", "Importance"])
@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("tilt_deg", [3.0, 38.0, 83.0])
def test_samples_follow_the_pdf(variant, mode, side, tilt_deg):
    """Chi-square over both hemispheres at once; weight = f cos / pdf for every sample."""
    import mitsuba as mi

    count, klems = 200_000, asymmetric(seed=3)
    bsdf = load(klems)
    tilt = np.radians(tilt_deg)
    wi = np.array([np.sin(tilt) * 0.6, np.sin(tilt) * 0.8, np.cos(tilt) * SIDES[side]])
    basis_change = interaction(wi)[1]
    u = np.random.default_rng(4).uniform(size=(3, count)).astype(np.float32)
    si = interaction(np.tile(wi, (count, 1)))[0]
    sample, weight = bsdf.sample(context(mode), si, mi.Float(u[0]), mi.Point2f(u[1:]))
    value, pdf = bsdf.eval_pdf(context(mode), si, sample.wo)
    wo = np.array(sample.wo).T
    inside = np.isclose(np.array(pdf), np.array(sample.pdf), rtol=1e-4)
    assert inside.mean() > 1 - 5e-4  # the rest fell on a patch's border in float32
    np.testing.assert_allclose(
        np.array(weight).ravel()[inside], (np.array(value).ravel() / np.array(pdf))[inside], rtol=1e-4
    )
    expected = count * bin_probabilities(bsdf, klems, lambda n: interaction(np.tile(wi, (n, 1)))[0], mode, basis_change)
    cells = bins(klems, wo @ basis_change, incident=mode == "Radiance")
    observed = np.bincount(cells, minlength=len(expected))
    assert expected.sum() == pytest.approx(count, rel=1e-4)
    used = expected > 5
    statistic = ((observed - expected)[used] ** 2 / expected[used]).sum()
    assert chi2.sf(statistic, used.sum() - 1) > 1e-3  # fails once in a thousand for a true pdf
    assert observed[expected == 0].sum() <= 5


def test_weight_is_what_the_direction_scatters(variant):
    import mitsuba as mi

    klems = asymmetric()
    si, basis_change = interaction([[0.3, 0.2, 0.9327379]])
    incident = np.array([[0.3, 0.2, 0.9327379]]) @ basis_change
    patch = klems.basis_in.index(np.arccos(incident[:, 2]), incident_azimuth(incident))
    both = klems.reflection_front + klems.transmission_front
    _, weight = load(klems).sample(context("Importance"), si, mi.Float(0.4), mi.Point2f(0.5, 0.5))
    assert np.array(weight).ravel()[0] == pytest.approx(klems.direct_hemispherical(both)[patch][0], rel=1e-5)


def test_a_context_of_one_kind_samples_only_that_kind(variant):
    import mitsuba as mi

    bsdf, count = load(asymmetric()), 20_000
    si, _ = interaction(np.tile([0.3, 0.2, 0.9327379], (count, 1)))
    u = np.random.default_rng(4).uniform(size=(3, count)).astype(np.float32)
    ctx = context("Radiance")
    both = bsdf.sample(ctx, si, mi.Float(u[0]), mi.Point2f(u[1:]))[1]
    parts = []
    for index, sign in ((0, 1), (1, -1)):
        ctx.component = index
        sample, weight = bsdf.sample(ctx, si, mi.Float(u[0]), mi.Point2f(u[1:]))
        assert (np.array(sample.wo)[2] * sign > 0).all()
        parts.append(np.array(weight).ravel()[0])
    assert sum(parts) == pytest.approx(np.array(both).ravel()[0], rel=1e-5)


def test_scalar_variant_gives_the_same(variant):
    import mitsuba as mi

    klems, count = asymmetric(), 300
    wi, wo = random_directions(count, 5), random_directions(count, 6)
    u = np.random.default_rng(7).uniform(size=(count, 3))
    results = {}
    for name in ("llvm_ad_mono", "scalar_rgb"):
        variants.activate(name)
        bsdf, ctx = load(klems), context("Radiance")
        if name == "scalar_rgb":
            rows = []
            for a, b, c in zip(wi, wo, u, strict=True):
                si = interaction(a)[0]
                sample, weight = bsdf.sample(ctx, si, c[0], mi.Point2f(c[1:]))
                value, pdf = bsdf.eval_pdf(ctx, si, mi.Vector3f(b))
                rows.append([*sample.wo, sample.pdf, weight[0], value[0], pdf])
            results[name] = np.array(rows)
        else:
            si = interaction(wi)[0]
            sample, weight = bsdf.sample(ctx, si, mi.Float(u[:, 0]), mi.Point2f(u[:, 1:].T))
            value, pdf = bsdf.eval_pdf(ctx, si, to_mitsuba(wo))
            results[name] = np.stack(
                [*np.array(sample.wo), *map(np.ravel, map(np.array, (sample.pdf, weight, value, pdf)))], axis=1
            )
    variants.activate("llvm_ad_mono")
    same = np.isclose(results["llvm_ad_mono"], results["scalar_rgb"], rtol=1e-3, atol=1e-4).all(axis=1)
    assert same.mean() > 0.985  # the others lie on a border of patches


def test_path_integrator_sees_what_three_phases_compute(variant):
    """Irradiance at a floor point of a black room closed by the window, under an uneven sky."""
    klems, sky = asymmetric(seed=9), np.array([2.0, 0.3])  # radiance above, below the horizon
    point = np.array([0.4, 1.2, 0.0])
    # the 2 x 2 window is sampled 4e6 times on either side: 0.1 % each (one sigma)
    assert traced_irradiance(klems, sky, point) == pytest.approx(three_phase_irradiance(klems, sky, point), rel=4e-3)


def traced_irradiance(klems, sky, point):
    import mitsuba as mi

    from mitsuba_cfs.bsdf.plugin import klems_plugin

    def wall(origin, target, bsdf, up=(0, 0, 1)):
        to_world = mi.ScalarTransform4f().look_at(origin, target, up)
        return {"type": "rectangle", "to_world": to_world, "bsdf": bsdf}

    black = {"type": "diffuse", "reflectance": 0.0}
    image = np.repeat(sky, 64)[:, None, None] * np.ones((1, 8, 3))
    window = wall([0, 0, 1], [0, -1, 1], klems_plugin(klems))
    on_floor = mi.ScalarTransform4f().translate((point[0], point[1], 1e-3)).scale(1e-3)
    meter = {"type": "rectangle", "to_world": on_floor, "bsdf": black}
    meter["sensor"] = {
        "type": "irradiancemeter",
        "film": {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}},
    }
    turn = mi.ScalarTransform4f().rotate([1, 0, 0], 90)
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 4},
            "sky": {"type": "envmap", "bitmap": mi.Bitmap(image.astype(np.float32)), "to_world": turn},
            "window": window,
            "meter": meter,
            **{
                f"wall{n}": wall(centre, [0, 1, 1], black)
                for n, centre in enumerate(([1, 1, 1], [-1, 1, 1], [0, 2, 1]))
            },
            "floor": wall([0, 1, 0], [0, 1, 1], black, (0, 1, 0)),
            "ceiling": wall([0, 1, 2], [0, 1, 1], black, (0, 1, 0)),
        }
    )
    return float(np.array(mi.render(scene, spp=4_000_000, seed=1)).mean())


def three_phase_irradiance(klems, sky, point):
    """E = V T D s, each factor by plain sampling."""
    basis, generator = klems.basis_in, np.random.default_rng(2)
    u = generator.uniform(size=(2, 41, 4000))
    theta, phi = basis.angles_within(np.arange(41)[:, None], *u)
    frame = window_frame([0, -1, 0])
    to_sky = np.stack([np.sin(theta) * np.cos(phi), -np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    daylight = np.where((to_sky @ frame)[..., 2] > 0, *sky).mean(axis=1)
    room = klems.transmission_matrix() @ daylight
    on_window = generator.uniform([-1, 0, 0], [1, 0, 2], (4_000_000, 3))
    path = point - on_window
    distance = np.linalg.norm(path, axis=1)
    out = (path / distance[:, None]) @ frame.T
    patch = basis.index(np.arccos(-out[:, 2]), outgoing_azimuth(out))
    return 4 * np.mean(room[patch] * -out[:, 2] * (-path[:, 2] / distance) / distance**2)
