"""U and g by the standards, against the worked values of EQUATIONS.md and WINDOW's engine."""

from __future__ import annotations

import json

import numpy as np
import pytest

from mitsuba_cfs.bsdf.glazing import roos_factor
from tests.conftest import WINDOW_GLAZING
from thermal.errors import ThermalInputError
from thermal.glazing import Gap, en410_g_value, en673_u_value
from thermal.gvalue import (
    InternalShade,
    external_shade_g,
    integrated_shade_g,
    internal_shade_g,
    position_of_share,
    thermal_data,
)

ARGON = (("argon", 0.9), ("air", 0.1))
AIR = (("air", 1.0),)


@pytest.mark.parametrize(
    ("panes", "gap", "count", "expected"),
    [
        ([0.004] * 2, Gap(0.016, ARGON, (0.837, 0.03)), 1, 1.10),
        ([0.004] * 2, Gap(0.016, AIR, (0.837, 0.837)), 1, 2.73),
        ([0.004] * 3, Gap(0.012, ARGON, (0.837, 0.03)), 2, 0.71),
        ([0.006] * 2, Gap(0.016, ARGON, (0.84, 0.05)), 1, 1.16),
    ],
)
def test_en673_gives_the_u_values_of_catalogues(panes, gap, count, expected):
    # catalogues print two decimals
    assert en673_u_value(panes, [gap] * count) == pytest.approx(expected, abs=0.005)


def test_en410_agrees_with_window_s_engine():
    data = json.loads((WINDOW_GLAZING / "blackbox_dgu.json").read_text())
    normal = data["angular"][0]
    gap = 1 / Gap(0.016, ARGON, (0.84, 0.05)).conductance(15.0) + 0.006
    g = en410_g_value(normal["tau"], normal["alpha_layers"], [gap])
    # EN 410's films differ from ISO 15099's: 0.6026 against 0.6017
    assert g == pytest.approx(normal["g"], abs=0.002)


def test_roos_factor():
    # EQUATIONS.md 3.6: f(60 deg; p = 2, q = 4) = .87439
    assert roos_factor(np.radians(60.0), panes=2, category=4.0) == pytest.approx(0.87439, abs=5e-6)
    np.testing.assert_allclose(roos_factor([0.0, np.pi / 2], panes=2, category=4.0), [1.0, 0.0], atol=1e-12)


def test_roos_factor_follows_the_reference_glazing():
    data = json.loads((WINDOW_GLAZING / "blackbox_dgu.json").read_text())
    theta = np.radians([row["theta"] for row in data["angular"]])
    g = np.array([row["g"] for row in data["angular"]])
    model = g[0] * roos_factor(theta, panes=2, category=3)
    assert np.sqrt(np.mean((model - g) ** 2)) < 0.009  # EQUATIONS.md: .008 rms


def test_en13363_on_the_reference_shade():
    arguments = (0.10, 0.55, 0.602, 1.227)
    # EQUATIONS.md 3.3
    assert external_shade_g(*arguments) == pytest.approx(0.0853, abs=5e-5)
    assert external_shade_g(*arguments, conductances=(5, 10)) == pytest.approx(0.0987, abs=5e-5)
    assert internal_shade_g(*arguments) == pytest.approx(0.389, abs=5e-4)
    assert internal_shade_g(*arguments, conductance=30) == pytest.approx(0.394, abs=5e-4)
    integrated = integrated_shade_g(*arguments)
    assert external_shade_g(*arguments) < integrated < internal_shade_g(*arguments)


def test_kuhn_s_interior_shade_and_kappa():
    shade = InternalShade(0.4724, 0.205, 0.6017, 0.388, 0.2438, 1.2266, 0.10, 0.55, 0.10, 0.55)
    # EQUATIONS.md 3.4: .473, .429, .363 for kappa 0, .4, 1
    for kappa, expected in ((0.0, 0.473), (0.4, 0.429), (1.0, 0.363)):
        assert shade.kuhn(kappa=kappa)[2] == pytest.approx(expected, abs=5e-4)


def test_g_per_direction_keeps_the_given_g_and_says_what_it_assumed():
    tau, rho = np.array([0.47, 0.40, 0.10]), np.array([0.21, 0.25, 0.70])
    known = thermal_data(tau, rho, u_value=1.2, g_normal=0.60)
    assert known.g_value[0] == pytest.approx(0.60)
    assert known.assumptions == ()
    assert np.all((known.g_value > tau) & (known.g_value < 1 - rho))
    guessed = thermal_data(tau, rho, shading_position="external")
    assert len(guessed.assumptions) == 2 and "no U-value given" in str(guessed.assumptions[0])
    assert np.all(guessed.g_value < known.g_value)


def test_g_below_transmittance_is_refused():
    with pytest.raises(ThermalInputError, match=r"g: 0\.3 is below the solar transmittance 0\.470"):
        thermal_data([0.47], [0.2], u_value=1.2, g_normal=0.3)
    with pytest.raises(ThermalInputError, match="U"):
        thermal_data([0.47], [0.2], u_value=12.0)


def test_position_of_a_shade_from_its_inward_share():
    shares = {0.072: "external", 0.098: "external", 0.30: "integrated", 0.595: "internal"}
    assert {share: position_of_share(share) for share in shares} == shares
