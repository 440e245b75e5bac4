"""EN 410's integrated values: closed forms, the WINDOW engine, published colour rendering."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mitsuba_cfs.bsdf.en410 import (
    SOLAR_NM,
    SOLAR_SHARE,
    UV_SHARE,
    colour_rendering_index,
    solar_value,
    ultraviolet_value,
    visible_value,
)

WHOLE = np.arange(280, 2501, 5.0)


def spectral_file(path):
    """Wavelength [nm], transmittance and both reflectances of an IGDB text file."""
    rows = [line.split() for line in path.read_text().splitlines() if line and line[0] != "{"]
    data = np.array([row for row in rows if len(row) == 4], dtype=float)
    return 1000 * data[:, 0], *data[:, 1:].T


def test_tables_are_normalised_as_printed():
    assert len(SOLAR_NM) == len(SOLAR_SHARE) == 56
    assert SOLAR_SHARE.sum() == pytest.approx(1, abs=1e-3)
    assert UV_SHARE.sum() == pytest.approx(1, abs=2e-3)


def test_a_grey_pane_has_its_value_everywhere():
    grey = np.full(len(WHOLE), 0.42)
    for average in (solar_value, visible_value, ultraviolet_value):
        assert average(WHOLE, grey) == pytest.approx(0.42, rel=1e-12)
    assert colour_rendering_index(WHOLE, grey) == pytest.approx(100, abs=1e-9)


def test_between_the_data_values_are_linear():
    """Data at both ends of the spectrum alone: grey is grey, and a ramp has its middle."""
    ends = np.array([280.0, 2500.0])
    assert solar_value(ends, np.array([0.42, 0.42])) == pytest.approx(0.42)
    ramp = visible_value(ends, (ends - 280) / 2220)
    assert ramp == pytest.approx((560 - 280) / 2220, abs=0.005)  # centre of V(lambda) and D65: 560
    with pytest.raises(ValueError, match=r"from 280 to 700 nm: expected .* to 2500 nm"):
        solar_value([280.0, 700.0], [0.42, 0.42])


def test_each_band_looks_at_its_wavelengths():
    def only(low, high):
        return ((low <= WHOLE) & (high >= WHOLE)).astype(float)

    assert visible_value(WHOLE, only(780, 2500)) < 1e-3
    assert visible_value(WHOLE, only(380, 780)) == pytest.approx(1)
    assert ultraviolet_value(WHOLE, only(385, 2500)) == 0
    assert solar_value(WHOLE, only(380, 780)) == pytest.approx(0.570, abs=0.002)  # by hand


def test_a_deep_filter_renders_colours_badly():
    red = 1 / (1 + np.exp(-(WHOLE - 600) / 8))
    assert colour_rendering_index(WHOLE, red) < 0
    tint = 1 - 0.1 * (WHOLE < 500)
    assert 90 < colour_rendering_index(WHOLE, tint) < 99


def test_clear_float_glass_is_as_known(real_data):
    """6 mm clear float: EN 410 data sheets give 88 to 89 %, 79 to 83 % and R_a 97 to 99."""
    nm, tau, front, _ = spectral_file(real_data / "bsdf/products_spectral/CLEAR_6.DAT")
    assert visible_value(nm, tau) == pytest.approx(0.885, abs=0.005)
    assert visible_value(nm, front) == pytest.approx(0.080, abs=0.005)
    assert 0.77 < solar_value(nm, tau) < 0.83
    assert 97 <= colour_rendering_index(nm, tau) <= 99.5


ENGINE = """
import json, sys, pywincalc
from pathlib import Path
standard = Path(pywincalc.__file__).parent / "standards" / "prEN_410.std"
system = pywincalc.GlazingSystem(
    optical_standard=pywincalc.load_standard(str(standard)),
    solid_layers=[pywincalc.parse_optics_file(sys.argv[1])],
)
front = system.optical_method_results("PHOTOPIC").system_results.front
print(json.dumps([front.transmittance.direct_direct, front.reflectance.direct_direct]), flush=True)
"""


@pytest.mark.peer
@pytest.mark.parametrize("name", ["CLEAR_6.DAT", "CLEAR_3.DAT"])
def test_visible_values_are_those_of_window(real_data, name):
    """WINDOW's engine with its own EN 410 tables, in a process of its own (it may crash)."""
    path = real_data / "bsdf/products_spectral" / name
    answer = subprocess.run([sys.executable, "-c", ENGINE, str(path)], capture_output=True, text=True, timeout=60)
    transmittance, reflectance = json.loads(answer.stdout)
    nm, tau, front, _ = spectral_file(path)
    # the engine takes V(lambda) D65 from ISO 9050's table, rounded to four digits
    assert visible_value(nm, tau) == pytest.approx(transmittance, abs=0.001)
    assert visible_value(nm, front) == pytest.approx(reflectance, abs=0.0005)


@pytest.mark.peer
def test_solar_values_are_those_of_windows_table(real_data):
    """The weights of the engine's table file, summed.

    (The engine itself takes trapezoids over these weights, whose steps differ: 0.746 for this pane
    in place of 0.777.)
    """
    pywincalc = pytest.importorskip("pywincalc")
    table = Path(pywincalc.__file__).parent / "standards" / "prEN 410 Table 2 AM1_0.ssp"
    rows = [line.split() for line in table.read_text().splitlines()[3:]]
    theirs, weight = np.array([row for row in rows if len(row) == 2], dtype=float).T
    nm, tau, _, _ = spectral_file(real_data / "bsdf/products_spectral/CLEAR_6.DAT")
    assert weight.sum() == pytest.approx(1, abs=1e-6)
    assert solar_value(nm, tau) == pytest.approx(np.interp(theirs, nm, tau) @ weight, abs=1e-9)


def test_data_that_do_not_reach_are_refused():
    with pytest.raises(ValueError, match="expected 300"):
        solar_value(WHOLE[50:], np.ones(len(WHOLE) - 50))
    with pytest.raises(ValueError, match="expected 380"):
        colour_rendering_index(WHOLE[30:], np.ones(len(WHOLE) - 30))
    # files of panes begin at 300 nm, the table of the UV at 297.5
    assert ultraviolet_value(WHOLE[4:], np.ones(len(WHOLE) - 4)) == pytest.approx(1)
    with pytest.raises(ValueError, match="rising"):
        visible_value(WHOLE[::-1], np.ones(len(WHOLE)))
    fine = np.arange(300.0, 2500.25, 0.5)
    assert solar_value(fine, np.full(len(fine), 0.7)) == pytest.approx(0.7)


def test_colour_rendering_is_that_of_colour_science():
    """A tint off the daylight locus whose nearest daylight is D65, CIE 1995's reference then."""
    import colour
    from colour.models import UCS_to_uv, XYZ_to_UCS
    from colour.temperature import uv_to_CCT_Robertson1968
    from scipy.optimize import brentq

    nm, shape = np.arange(380, 781, 5.0), colour.SpectralShape(380, 780, 5)
    d65 = colour.SDS_ILLUMINANTS["D65"].copy().align(shape).values
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape).values

    def kelvins(light):
        return uv_to_CCT_Robertson1968(UCS_to_uv(XYZ_to_UCS(light @ observer)))[0]

    def tint(red):
        blue = 0.4 * np.exp(-(((nm - 450) / 40) ** 2))
        return 1 - blue - red * np.exp(-(((nm - 650) / 50) ** 2))

    red = brentq(lambda red: kelvins(d65 * tint(red)) - kelvins(d65), 0, 0.95)
    theirs = colour.colour_rendering_index(colour.SpectralDistribution(d65 * tint(red), nm))
    assert 70 < theirs < 85
    # 0.02: their D65 is that of a formula, 0.007 of R_a from the table's
    assert colour_rendering_index(nm, tint(red)) == pytest.approx(theirs, abs=0.02)
