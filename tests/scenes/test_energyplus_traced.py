"""The reference set's systems as BSDFs, and (slow) one traced case beside EnergyPlus."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from tests.validation.energyplus_traced import compare, traced_system
from tests.validation.reference_systems import Optics

OMEGA = KLEMS_FULL.projected_solid_angles()
BACK = {"tau_back": 0.1, "rho_back": 0.25}


def blind(order: np.ndarray) -> Optics:
    """A system by patches, its list in another order than ours: no two entries alike."""
    theta, phi = (v[order] for v in KLEMS_FULL.centres())
    scatter = np.random.default_rng(2).uniform(0.0, 1e-3, (KLEMS_FULL.size,) * 2)
    tau = scatter.sum(axis=0)
    return Optics(theta, phi, tau, 0.5 * tau, tau, np.zeros((2, 3)), scatter, BACK)


def test_each_patch_keeps_its_own_light() -> None:
    order = np.random.default_rng(1).permutation(KLEMS_FULL.size)
    optics = blind(order)
    solar = traced_system("ext_blind", optics).solar
    own = np.argsort(order)
    through = solar.direct_hemispherical(solar.transmission_front)
    assert through == pytest.approx(optics.tau[own])
    out, into = 17, 90
    expected = optics.scatter[own[out], own[into]] / OMEGA[out]
    assert solar.transmission_front[out, into] == pytest.approx(expected)
    assert solar.direct_hemispherical(solar.reflection_back) == pytest.approx(0.25)
    assert solar.direct_hemispherical(solar.reflection_front) == pytest.approx(0.5 * through)


def test_other_directions_are_refused() -> None:
    optics = blind(np.arange(KLEMS_FULL.size))
    optics.phi[5] += 0.1
    with pytest.raises(ValueError, match="patches"):
        traced_system("ext_blind", optics)


def test_panes_send_light_straight_on_and_shades_to_all_sides() -> None:
    angles = np.radians([0.0, 45.0, 90.0])
    optics = Optics(angles, None, np.array([0.5, 0.4, 0.0]), np.full(3, 0.2), angles, np.zeros((2, 3)), None, BACK)
    panes, shade = (traced_system(n, optics).solar for n in ("dgu", "ext_shade"))
    # means over patches: five degrees of the first
    assert panes.transmission_front[0, 0] == pytest.approx(0.5 / OMEGA[0], rel=5e-3)
    assert np.count_nonzero(panes.transmission_front) <= KLEMS_FULL.size
    assert shade.transmission_front[:, 0] == pytest.approx(0.5 / np.pi, rel=5e-3)


@pytest.mark.slow
def test_shades_outside_meet_their_bars_with_traced_sun(reference_data, real_data) -> None:
    """Air 0.15 K behind the shade, 0.5 behind the blind (chapter 4's bars), south, Frankfurt."""
    reference = reference_data / "energyplus"
    if not (reference / "ep_Frankfurt.parquet").is_file():
        pytest.skip("EnergyPlus' hours (../shared/reference/energyplus) are not here")
    found = compare(reference, real_data / "epw", ["Frankfurt"], ["S"]).set_index("system")
    air = np.sqrt(found["air square"])
    assert air["ext_shade"] < 0.15 and air["ext_blind"] < 0.5


@pytest.mark.slow
def test_glass_meets_its_bar_where_it_passes_the_sky_as_energyplus(reference_data, real_data) -> None:
    """Air within 0.2 K (chapter 4's bar), south, Frankfurt; by its own angles it is further off."""
    reference = reference_data / "energyplus"
    if not (reference / "ep_Frankfurt.parquet").is_file():
        pytest.skip("EnergyPlus' hours (../shared/reference/energyplus) are not here")
    case = reference, real_data / "epw", ["Frankfurt"], ["S"], ["dgu"]
    own, theirs = (np.sqrt(compare(*case, one_diffuse=one)["air square"].item()) for one in (False, True))
    # 0.158: `sky_light` spreads this light indoors as a diffuse window does, as EnergyPlus
    assert theirs < 0.2
    assert theirs < 0.7 * own
