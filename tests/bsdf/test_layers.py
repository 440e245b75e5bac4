"""Layer algebra and panes: closed forms, energy, Fresnel's own numbers."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

from mitsuba_cfs.bsdf.glazing import (
    Glazing,
    Pane,
    coated_values,
    glazing_values,
    pane_values,
    roos_factor,
    specular_klems,
    uncoated_values,
)
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KLEMS_QUARTER, KlemsBasis, KlemsBsdf
from mitsuba_cfs.bsdf.layers import combine_layers


def diffuser(transmittance, reflectance_front, reflectance_back, basis=KLEMS_QUARTER) -> KlemsBsdf:
    """A sheet that scatters evenly: three constant values."""
    flat = np.full((basis.size, basis.size), 1 / np.pi)
    return KlemsBsdf(
        basis, basis, transmittance * flat, transmittance * flat, reflectance_front * flat, reflectance_back * flat
    )


def scatterer(seed: int, basis=KLEMS_QUARTER) -> KlemsBsdf:
    """A sheet of four unlike blocks that scatters at most 0.9."""
    generator = np.random.default_rng(seed)
    blocks = generator.uniform(0, 1, (4, basis.size, basis.size)) ** 4
    blocks *= 0.45 / np.max(basis.projected_solid_angles() @ blocks)
    return KlemsBsdf(basis, basis, *blocks)


def test_two_diffusers_are_the_series_of_their_bounces():
    outer, inner = diffuser(0.4, 0.3, 0.5), diffuser(0.6, 0.2, 0.1)
    system = combine_layers([outer, inner]).bsdf
    hemispherical = system.direct_hemispherical
    bounces = 1 / (1 - 0.5 * 0.2)
    assert hemispherical(system.transmission_front) == pytest.approx(0.4 * 0.6 * bounces)
    assert hemispherical(system.transmission_back) == pytest.approx(0.6 * 0.4 * bounces)
    assert hemispherical(system.reflection_front) == pytest.approx(0.3 + 0.4**2 * 0.2 * bounces)
    assert hemispherical(system.reflection_back) == pytest.approx(0.1 + 0.6**2 * 0.5 * bounces)


def test_what_is_absorbed_is_the_rest():
    layers = [scatterer(1), diffuser(0.3, 0.2, 0.4), scatterer(2), scatterer(3)]
    system = combine_layers(layers)
    for side, absorbed in (("front", system.absorptance_front), ("back", system.absorptance_back)):
        sent = sum(
            system.bsdf.direct_hemispherical(getattr(system.bsdf, f"{kind}_{side}"))
            for kind in ("transmission", "reflection")
        )
        np.testing.assert_allclose(sent + absorbed.sum(axis=0), 1, atol=1e-12)
        assert absorbed.shape == (4, 41) and absorbed.min() > 0


def test_a_system_of_one_layer_is_that_layer():
    layer = scatterer(9)
    system = combine_layers([layer])
    for name, block in layer.blocks().items():
        np.testing.assert_allclose(getattr(system.bsdf, name), block, atol=1e-14)
    absorbed = 1 - layer.direct_hemispherical(layer.transmission_front)
    absorbed -= layer.direct_hemispherical(layer.reflection_front)
    np.testing.assert_allclose(system.absorptance_front, [absorbed], atol=1e-12)


def test_layers_can_be_put_together_in_any_grouping():
    a, b, c = (scatterer(seed) for seed in (4, 5, 6))
    at_once = combine_layers([a, b, c]).bsdf
    in_steps = combine_layers([combine_layers([a, b]).bsdf, c]).bsdf
    for name, block in at_once.blocks().items():
        np.testing.assert_allclose(getattr(in_steps, name), block, atol=1e-12)


def test_order_matters():
    a, b = scatterer(7), scatterer(8)
    forth, back = combine_layers([a, b]).bsdf, combine_layers([b, a]).bsdf
    assert not np.allclose(forth.transmission_front, back.transmission_front, rtol=0.1)


def test_uncoated_glass_is_fresnel():
    """Glass of index 1.5 that absorbs nothing: 4 % a surface, Brewster's angle, grazing."""
    reflectance = 2 * 0.04 / 1.04
    tau, rho = uncoated_values(1 - reflectance, reflectance, np.radians([0, 30, 60, 89.99]))
    np.testing.assert_allclose(tau + rho, 1, atol=1e-9)
    assert tau[0] == pytest.approx(1 - reflectance, abs=1e-12)
    # two polarisations at 60 degrees: r = 0.176572, 0.001802 -> 2 r / (1 + r) each, by hand
    assert rho[2] == pytest.approx(0.5 * (2 * 0.176572 / 1.176572 + 2 * 0.001802 / 1.001802), abs=1e-4)
    assert rho[3] > 0.99


@pytest.mark.parametrize("coated", [False, True])
def test_panes_keep_their_normal_values_and_energy(coated):
    pane = Pane("pane", 0.7, 0.08, 0.08 if not coated else 0.2, coated=coated)
    tau, front, back = pane_values(pane, np.radians(np.linspace(0, 90, 91)))
    # the published shape of coated panes is 0.2 % off at normal incidence
    assert (tau[0], front[0], back[0]) == pytest.approx(
        (0.7, 0.08, pane.reflectance_back), abs=2e-3 if coated else 1e-12
    )
    assert (tau + np.maximum(front, back)).max() <= 1 + 1e-12
    assert np.all(np.diff(tau[20:]) < 0)


def test_a_coated_pane_at_60_degrees_is_as_published():
    """Clear shape at cos 0.5, by hand: t = 0.9003, t + r = 0.977625."""
    pane = Pane("coated", 0.7, 0.08, 0.2, coated=True)
    tau, front, back = pane_values(pane, np.radians(60))
    assert (tau, front, back) == pytest.approx(
        (0.7 * 0.9003, 0.08 * (1 - 0.077325) + 0.077325, 0.2 * (1 - 0.077325) + 0.077325), abs=1e-5
    )
    bronze = pane_values(Pane("dark", 0.4, 0.08, 0.2, coated=True), np.radians(60))[0]
    # -0.002 + 1.4065 - 0.58525 - 0.00715625 + 0.0374375
    assert bronze == pytest.approx(0.4 * 0.84953, abs=1e-5)


def test_a_pane_passes_light_straight_on():
    klems = specular_klems(Pane("clear", 0.9, 0.08, 0.08), KLEMS_FULL)
    share = klems.direct_hemispherical(klems.transmission_front)
    assert share[0] == pytest.approx(0.9, abs=1e-3)  # mean over the cap of 5 degrees
    assert np.count_nonzero(klems.transmission_front) == 145


def test_panes_that_cannot_be_are_refused():
    with pytest.raises(ValueError, match="shares of 1"):
        Pane("gain", 0.9, 0.2, 0.2)
    with pytest.raises(ValueError, match="alike"):
        Pane("uncoated", 0.7, 0.1, 0.2)
    with pytest.raises(ValueError, match="different bases"):
        combine_layers([diffuser(0.3, 0.1, 0.1), diffuser(0.3, 0.1, 0.1, KLEMS_FULL)])


def test_roos_factor_is_as_published():
    assert roos_factor([0.0, np.pi / 2], panes=2, category=4) == pytest.approx([1, 0], abs=1e-12)
    # by hand: z = 2/3, a = 8, b = 0.0625, alpha = 8, gamma = 8.62
    assert roos_factor(np.radians(60), panes=2, category=4) == pytest.approx(0.87439, abs=1e-5)
    with pytest.raises(ValueError, match="category"):
        roos_factor(0.0, panes=2, category=11)


def test_a_glazing_unit_keeps_its_values_and_energy():
    unit = Glazing("low-e", 0.53, 0.27, 0.22, panes=2, category=3)
    tau, front, back = glazing_values(unit, np.radians([0, 60, 75, 90]))
    assert (tau[0], front[0], back[0]) == pytest.approx((0.53, 0.27, 0.22))
    np.testing.assert_allclose((1 - tau - front)[:3], 0.2, atol=1e-12)
    assert (tau[3], front[3]) == pytest.approx((0, 1))
    klems = specular_klems(unit, KLEMS_QUARTER)
    assert (klems.scattered("front") <= 1 + 1e-12).all()


ENGINE = """
import json, sys, pywincalc
from pathlib import Path
standard = Path(pywincalc.__file__).parent / "standards" / "W5_NFRC_2003.std"
panes = [pywincalc.parse_optics_file(path) for path in sys.argv[1:]]
gaps = [pywincalc.Layers.gap(pywincalc.PredefinedGasType.AIR, 0.012)] * (len(panes) - 1)
system = pywincalc.GlazingSystem(
    optical_standard=pywincalc.load_standard(str(standard)), solid_layers=panes, gap_layers=gaps
)
found = []
for theta in (0, 30, 50, 60, 70):
    results = system.optical_method_results("PHOTOPIC", theta, 0)
    front = results.system_results.front
    found.append(
        [
            front.transmittance.direct_direct,
            front.reflectance.direct_direct,
            *(layer.front.absorptance.total_direct for layer in results.layer_results),
        ]
    )
print(json.dumps(found), flush=True)
"""


@pytest.mark.peer
def test_a_double_glazing_is_that_of_windows_engine(real_data):
    """Two clear panes, 6 and 3 mm, visible band: transmittance, reflectance, each pane's heat."""
    folder = real_data / "bsdf/products_spectral"
    answer = subprocess.run(
        [sys.executable, "-c", ENGINE, str(folder / "CLEAR_6.DAT"), str(folder / "CLEAR_3.DAT")],
        capture_output=True,
        text=True,
        timeout=60,
    )
    if answer.returncode:
        pytest.skip(f"the engine failed: {answer.stderr[-200:]}")
    theirs = np.array(json.loads(answer.stdout))
    # the engine's own values of either pane alone at normal incidence (NFRC, photopic)
    panes = [Pane("6 mm", 0.88365, 0.08040, 0.08040), Pane("3 mm", 0.89926, 0.08256, 0.08256)]
    for row, theta_deg in zip(theirs, (0, 30, 50, 60, 70), strict=True):
        ring = narrow_basis(np.radians(theta_deg))
        system = combine_layers([specular_klems(pane, ring) for pane in panes])
        bsdf, patch = system.bsdf, ring.index(max(np.radians(theta_deg), 1e-5), 0.0)
        found = [
            bsdf.direct_hemispherical(bsdf.transmission_front)[patch],
            bsdf.direct_hemispherical(bsdf.reflection_front)[patch],
            *system.absorptance_front[:, patch],
        ]
        # the engine takes each wavelength's own index, we that of the mean
        np.testing.assert_allclose(np.ravel(found), row, atol=0.006, err_msg=str(theta_deg))


def narrow_basis(theta: float) -> KlemsBasis:
    """A basis one of whose rings is a hundredth of a degree wide, at `theta`."""
    half = np.radians(0.005)
    inner = [theta - half] if theta > half else []
    bounds = (0.0, *inner, theta + half, np.pi / 2)
    return KlemsBasis("narrow", bounds, (1,) + (4,) * (len(bounds) - 2))


def test_coated_panes_by_the_shapes_of_window_4():
    """Finlayson et al. 1993: polynomials in cos(theta) of clear and of bronze glass, at 60 deg."""
    for normal, tau, whole in (
        (0.7, (-0.0015, 3.355, -3.840, 1.460, 0.0288), (0.999, -0.563, 2.043, -2.532, 1.054)),
        (0.645, (-0.002, 2.813, -2.341, -0.05725, 0.599), (0.997, -1.868, 6.513, -7.862, 3.225)),
    ):
        t, both = (sum(k * 0.5**n for n, k in enumerate(shape)) for shape in (tau, whole))
        r = both - t
        found = coated_values(normal, 0.1, 0.2, np.radians(60.0))
        expected = (normal * t, 0.1 * (1 - r) + r, 0.2 * (1 - r) + r)
        assert [float(value) for value in found] == pytest.approx(expected)
        np.testing.assert_allclose([float(value) for value in coated_values(normal, 0.1, 0.2, 0.0)], [normal, 0.1, 0.2])
    assert coated_values(0.7, 0.1, 0.2, np.radians(89.999))[0] == pytest.approx(0.0, abs=1e-3)


def test_shares_of_a_pane_that_cannot_be():
    for values in ((-0.1, 0.1, 0.1), (0.5, -0.1, -0.1), (0.5, 0.1, -0.1), (0.9, 0.11, 0.11), (0.9, 0.05, 0.11)):
        with pytest.raises(ValueError, match="expected shares of 1"):
            Pane("p", *values, coated=True)
    Pane("p", 0.9, 0.1, 0.05, coated=True)
    with pytest.raises(ValueError, match="alike on both sides"):
        Pane("p", 0.5, 0.1, 0.2)


def test_roos_by_its_formula():
    for panes, category in ((1, 1), (3, 10), (2, 4.5)):
        z = 0.6
        a, b = 8.0, 0.25 / category
        gamma = 5.26 + 0.06 * panes + (0.73 + 0.04 * panes) * category
        by_hand = 1 - a * z ** (5.2 + 0.7 * category) - b * z**2 - (1 - a - b) * z**gamma
        found = roos_factor(0.3 * np.pi, panes=panes, category=category)
        assert found == pytest.approx(np.clip(by_hand, 0, 1))
    for panes, category in ((0, 4), (4, 4), (2, 0.9), (2, 10.1)):
        with pytest.raises(ValueError, match="expected 1 to 3 panes"):
            roos_factor(0.5, panes=panes, category=category)


def test_layers_that_do_not_fit_together():
    with pytest.raises(ValueError, match="needs a layer"):
        combine_layers([])
    with pytest.raises(ValueError, match="different bases"):
        combine_layers([diffuser(0.5, 0.2, 0.2), diffuser(0.5, 0.2, 0.2, KLEMS_FULL)])
