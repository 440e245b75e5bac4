"""WINDOW's engine as a source of the Blackbox' data: the reference double glazing, made anew."""

from __future__ import annotations

import json

import numpy as np
import pytest

pywincalc = pytest.importorskip("pywincalc")

from thermal.iso15099 import iso15099_data  # noqa: E402

pytestmark = pytest.mark.peer


def pane(tau: float, front: float, back: float, e_front: float, e_back: float, coated: bool):
    """A pane of 6 mm, clear or coated, with the same values at all wavelengths."""
    kind = pywincalc.MaterialType.COATED if coated else pywincalc.MaterialType.MONOLITHIC
    side = pywincalc.CoatedSide.FRONT if coated else pywincalc.CoatedSide.NEITHER
    spectrum = [pywincalc.WavelengthData(w, tau, front, back) for w in (0.3, 1.0, 2.5)]
    optical = pywincalc.ProductDataOpticalNBand(
        kind, 0.006, spectrum, side, 0.0, 0.0, e_front, e_back
    )
    thermal = pywincalc.ProductDataThermal(0.9, 0.006)
    return pywincalc.ProductDataOpticalAndThermal(optical, thermal)


def test_reference_glazing_comes_out_of_its_layers(reference_data):
    gas = pywincalc.create_gas(
        [(0.9, pywincalc.PredefinedGasType.ARGON), (0.1, pywincalc.PredefinedGasType.AIR)]
    )
    gap = pywincalc.Layers.gap(thickness=0.016, gas=gas)
    clear = pane(0.775, 0.071, 0.071, 0.84, 0.84, coated=False)
    low_e = pane(0.600, 0.220, 0.170, 0.05, 0.84, coated=True)
    panes = [clear, low_e]
    data = iso15099_data(panes, [gap], angles_deg=(0.0, 30.0, 60.0))
    stored = json.loads((reference_data / "energyplus" / "blackbox_dgu.json").read_text())
    angular = {row["theta"]: row for row in stored["angular"]}
    # the same engine and layers: only the glazing's height and rounding differ
    assert data.u_value == pytest.approx(stored["U"][0]["U"], rel=2e-3)
    assert data.r_inner == pytest.approx(stored["U"][0]["R_i"], rel=5e-3)
    for i, theta in enumerate((0, 30, 60)):
        assert data.transmittance[i] == pytest.approx(angular[theta]["tau"], abs=2e-3)
        assert data.g_value[i] == pytest.approx(angular[theta]["g"], abs=5e-3)
    fit = json.loads((reference_data / "energyplus" / "blackbox_R.json").read_text())["dgu_fit"]
    mean, difference = np.array([0.0, 10.0, 25.0]), np.array([10.0, 20.0, 5.0])
    x = mean - 10
    c = fit
    stored_c = c[0] + c[1] * x + c[2] * difference + c[3] * difference**2
    stored_c = stored_c + c[4] * x * difference + c[5] * x**2
    # two fits of 1.3 % rms each to nearly the same points
    np.testing.assert_allclose(data.resistance.at(mean, difference), 1 / stored_c, rtol=0.02)
