"""Quantities of CIE S 026 against published values."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.spectra.detectors import (
    ALPHA_OPIC,
    D65_EFFICACY,
    DETECTORS,
    NANOMETRES,
    colour_rendering,
    colour_temperature,
    daylight_efficacy_ratio,
    detected,
    illuminant,
    sensitivities,
)

# frudawski.de/cieedq and /ciemedi (CIE S 026 at 1 nm): EDI [lx] of 100 lx, S-, M-, L-cone, rod, mel
FL12 = (35.929, 79.904, 100.440, 50.848, 40.420)
MELANOPIC_A = 49.581


# by the CIE S 026 Toolbox 1.049: its action spectra (in luxpy 1.12.5), CIE 015's illuminants
TOOLBOX = {  # DER by S-, M-, L-cone, rod and melanopsin
    "A": (0.3110, 0.8066, 1.0171, 0.5731, 0.4958),
    "D50": (0.7469, 0.9500, 1.0003, 0.8763, 0.8474),
    "D55": (0.8390, 0.9693, 0.9998, 0.9228, 0.9043),
    "D65": (1.0000, 1.0000, 1.0000, 1.0000, 1.0000),
    "D75": (1.1326, 1.0232, 1.0009, 1.0608, 1.0762),
    "E": (0.9255, 0.9594, 1.0061, 0.9175, 0.9058),
    "FL2": (0.6219, 0.8802, 0.9921, 0.6381, 0.5699),
    "FL7": (0.9986, 0.9868, 0.9936, 0.9406, 0.9234),
    "FL11": (0.5913, 0.8699, 0.9910, 0.6479, 0.5636),
    "LED-B1": (0.2953, 0.7810, 1.0169, 0.4924, 0.4067),
    "LED-B3": (0.6176, 0.8841, 0.9978, 0.6985, 0.6326),
}


@pytest.mark.parametrize("name", TOOLBOX)
def test_ratios_of_standard_illuminants_to_four_digits(name: str) -> None:
    spectrum = illuminant(name)
    own = [float(daylight_efficacy_ratio(spectrum, kind)) for kind in ALPHA_OPIC]
    assert own == pytest.approx(TOOLBOX[name], abs=6e-5)  # half a digit, and D65's rounding


def test_equivalent_daylight_of_fl12() -> None:
    spectrum = illuminant("FL12")
    for name, value in zip(ALPHA_OPIC, FL12, strict=True):
        ratio = float(daylight_efficacy_ratio(spectrum, name))
        assert ratio == pytest.approx(value / 100, abs=5e-5), name  # to four digits


def test_melanopic_ratio_of_illuminant_a() -> None:
    ratio = float(daylight_efficacy_ratio(illuminant("A")))
    assert ratio == pytest.approx(MELANOPIC_A / 100, abs=5e-5)  # to four digits


def test_efficacy_of_d65_is_that_of_the_standard() -> None:
    received = detected(illuminant("D65"))
    for name, efficacy in D65_EFFICACY.items():
        own = received[DETECTORS.index(name)] / received[0]
        assert own == pytest.approx(efficacy, rel=6.2e-5), name  # its digits


def test_action_spectra_peak_where_the_standard_has_them() -> None:
    # CIE S 026, figure 1: S-cone 448, M-cone 541, L-cone 569, rod 507, melanopic 490 nm; to 2 nm
    peaks = NANOMETRES[np.argmax(sensitivities()[1:6], axis=1)]
    assert np.abs(peaks - [448, 541, 569, 507, 490]).max() <= 2


def test_colour_temperature_and_duv() -> None:
    both = np.array([detected(illuminant("D65"))[6:], [0, 0, 0]])
    temperature, distance = colour_temperature(both)
    assert temperature[0] == pytest.approx(6503, abs=10)  # Robertson's table: some kelvin
    assert distance[0] == pytest.approx(0.0032, abs=2e-4)  # ANSI C78.377
    assert np.isnan(temperature[1]) and np.isnan(distance[1])


def test_colour_rendering() -> None:
    # CIE 13.3 and CIE 015, table T.8: R_a 64 of FL2
    index, fidelity = colour_rendering(illuminant("FL2"))
    assert round(index) == 64
    assert fidelity == pytest.approx(70, abs=0.5)  # TM-30's calculator
    assert colour_rendering(illuminant("D65"))[0] == pytest.approx(100, abs=0.05)  # cut at 780 nm


def test_unknown_illuminant() -> None:
    with pytest.raises(ValueError, match="illuminant 'D66'"):
        illuminant("D66")


def test_light_far_from_the_planckian_locus_has_no_colour_temperature() -> None:
    def band(low: float, high: float) -> np.ndarray:
        return illuminant("D65") * ((low <= NANOMETRES) & (high >= NANOMETRES))

    # green: on an isotherm, Duv 0.15; violet and deep red: beyond the isotherms (were 100000 and
    # 1667 K)
    spectra = np.array([illuminant("A"), band(500, 560), band(380, 480), band(650, 780)])
    kelvin, distance = colour_temperature(detected(spectra)[:, -3:])
    assert kelvin[0] == pytest.approx(2856, abs=1) and np.isnan(kelvin[1:]).all()
    assert distance[1] == pytest.approx(0.152, abs=1e-3) and np.isnan(distance[2:]).all()
    assert np.isnan(colour_rendering(spectra[2])).all()  # was -68 and 0


def of_uv(uv: np.ndarray) -> np.ndarray:
    """Tristimulus values of Y = 1 of chromaticities of CIE 1960 [.., 2]."""
    u, v = np.moveaxis(uv, -1, 0)
    return np.stack([1.5 * u / v, np.ones_like(u), (4 - u - 10 * v) / (2 * v)], axis=-1)


def test_a_colour_temperature_is_stated_as_far_from_the_locus_as_cie_015_does() -> None:
    """Up to 0.05 to either side; the distance is stated beyond, too."""
    from colour.temperature import CCT_to_uv_Robertson1968

    stated = np.array([[5000.0, 0.048], [5000.0, -0.048], [5000.0, 0.052], [5000.0, -0.052]])
    temperature, distance = colour_temperature(of_uv(CCT_to_uv_Robertson1968(stated)))
    np.testing.assert_allclose(temperature, [5000, 5000, np.nan, np.nan], rtol=2e-3)
    np.testing.assert_allclose(distance, stated[:, 1], atol=1e-4)


def test_a_colour_temperature_is_stated_within_the_isotherms_and_of_any_amount_of_light() -> None:
    """Robertson's isotherms end at 600 mired, 1,667 K."""
    wavelength = NANOMETRES * 1e-9
    for kelvin in (1600.0, 1700.0, 2856.0):
        planck = wavelength**-5 / np.expm1(1.438777e-2 / (wavelength * kelvin))  # of CODATA's c2
        for amount in (1e-6, 1.0):
            found, _ = colour_temperature(detected(amount * planck / planck.max())[6:])
            assert found == pytest.approx(kelvin, rel=2e-3) if kelvin > 1667 else np.isnan(found)
