"""Panes by wavelength: files, stacks with closed forms, WINDOW's engine on its test products."""

from __future__ import annotations

import json

import numpy as np
import pytest

from mitsuba_cfs.bsdf.glazing import Pane, pane_values
from mitsuba_cfs.bsdf.spectral_pane import SpectralPane, read_spectral_pane, solar_average, spectral_glazing
from mitsuba_cfs.errors import DataError
from thermal.glazing_unit import GasGap, GlazingLayer, GlazingUnit
from thermal.iso15099 import NFRC, iso15099_g_values, iso15099_u_value, unit_balance

NM = np.arange(280.0, 2601.0, 5.0)


def pane(tau, front, back=None, coated=False):
    values = (np.broadcast_to(v, NM.shape) for v in (tau, front, front if back is None else back))
    return SpectralPane("pane", NM, *values, 0.004, coated=coated)


def test_a_grey_stack_meets_its_closed_form():
    one = spectral_glazing([pane(0.6, 0.1, 0.2, coated=True), pane(0.5, 0.3, 0.3)])
    bounce = 1 / (1 - 0.2 * 0.3)
    for band in ("Solar", "Visible"):
        assert one[band].transmittance[0] == pytest.approx(0.6 * 0.5 * bounce)
        assert one[band].reflectance_front[0] == pytest.approx(0.1 + 0.6 * 0.6 * 0.3 * bounce)
        inner = 0.6 * bounce * 0.2
        outer = 0.3 + 0.6 * bounce * 0.3 * (1 - 0.6 - 0.2)
        np.testing.assert_allclose(one[band].absorptance[0], [outer, inner])


def test_panes_that_pass_other_colours_pass_nothing_together():
    red, blue = (np.where(NM > 700, 0.8, 0.0), np.where(NM <= 700, 0.8, 0.0))
    apart = [spectral_glazing([pane(t, 0.0)])["Solar"].transmittance[0] for t in (red, blue)]
    both = spectral_glazing([pane(red, 0.0), pane(blue, 0.0)])["Solar"]
    assert min(apart) > 0.3 and both.transmittance[0] < 0.01
    assert both.absorptance[0].sum() == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("coated", [False, True])
def test_angles_are_those_of_a_grey_pane(coated):
    theta = np.radians([0.0, 30.0, 60.0, 80.0])
    spectral = spectral_glazing([pane(0.7, 0.08, 0.08, coated)], theta)["Solar"]
    tau, front, _ = pane_values(Pane("grey", 0.7, 0.08, 0.08, coated), theta)
    # a coated pane's polynomials give 0.999 of its value at the normal
    np.testing.assert_allclose(spectral.transmittance, tau, atol=1.2e-3)
    np.testing.assert_allclose(spectral.reflectance_front, front, atol=3e-3)


def test_energy_goes_somewhere_at_every_angle():
    theta = np.radians([0.0, 45.0, 75.0, 88.0])
    for values in spectral_glazing([pane(0.7, 0.2, 0.1, True), pane(0.8, 0.07)], theta).values():
        total = values.transmittance + values.reflectance_front + values.absorptance.sum(axis=1)
        np.testing.assert_allclose(total, 1, atol=1e-12)


def test_both_kinds_of_file_hold_the_same_pane(real_data):
    folder = real_data / "bsdf" / "products_spectral"
    text, product = (read_spectral_pane(folder / f"CLEAR_3.{kind}") for kind in ("DAT", "json"))
    assert text.thickness == pytest.approx(product.thickness, rel=1e-6) == 0.003048
    assert text.emissivity == pytest.approx(product.emissivity, rel=1e-6)
    assert not text.coated
    np.testing.assert_allclose(text.transmittance, product.transmittance, atol=1e-6)
    low_e = read_spectral_pane(folder / "nfrc_2191.json")
    assert low_e.coated and low_e.emissivity == pytest.approx((0.84, 0.068))
    assert low_e.turned().emissivity == low_e.emissivity[::-1]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{ Thickness } 3\n0.3 0.1 0.1 0.1\n0.3 0.1 0.1 0.1\n", "twice"),
        ("{ Thickness } 3\n0.3 0.8 0.5 0.1\n0.4 0.1 0.1 0.1\n", "T . R reaches 1.3"),
        ("0.3 0.1 0.1 0.1\n0.4 0.1 0.1 0.1\n", "no thickness"),
        ("{ Thickness } 3\nsome words\n", "no spectral row"),
        (json.dumps({"measured_data": {}}), "no IGSDB product"),
    ],
)
def test_what_is_no_pane_is_named(tmp_path, text, words):
    path = tmp_path / "pane.dat"
    path.write_text(text)
    with pytest.raises(DataError, match=words) as caught:
        read_spectral_pane(path)
    assert "pane.dat" in str(caught.value)


PRODUCTS = [
    ("CLEAR_3.DAT",),
    ("CLEAR_3.DAT", "CLEAR_6.DAT"),
    ("nfrc_2191.json", "CLEAR_3.json"),
    ("nfrc_6046.json",),
    ("nfrc_6400.json", "CLEAR_3.json"),
    ("nfrc_11561.json", "CLEAR_3.DAT", "nfrc_9962.json"),
]


@pytest.mark.peer
@pytest.mark.parametrize("names", PRODUCTS)
def test_u_and_shgc_are_those_of_windows_engine(real_data, names):
    pywincalc = pytest.importorskip("pywincalc")
    files = [real_data / "bsdf" / "products_spectral" / name for name in names]
    parse = {".json": pywincalc.parse_json_file, ".DAT": pywincalc.parse_optics_file}
    table = pywincalc.standard_path / "ASTM E891 Table 1 Direct AM1_5.ssp"  # of NFRC 300
    rows = [line.split() for line in table.read_text().splitlines()]
    sun = np.array([row for row in rows if len(row) == 2 and row[0][0].isdigit()], dtype=float)
    sun = sun[(sun[:, 0] >= 0.3) & (sun[:, 0] <= 2.5)] * [1000.0, 1.0]

    def system(environment):
        return pywincalc.GlazingSystem(
            solid_layers=[parse[path.suffix](str(path)) for path in files],
            gap_layers=[pywincalc.Layers.gap(thickness=0.0127)] * (len(files) - 1),
            environment=environment,
        )

    panes = [read_spectral_pane(path) for path in files]
    layers = [GlazingLayer(p.thickness, p.conductivity, p.emissivity, p.infrared_transmittance) for p in panes]
    unit = GlazingUnit(tuple(layers), (GasGap(0.0127),) * (len(files) - 1), height=1.0)
    band = spectral_glazing(panes, spectrum=sun)["Solar"]
    g = iso15099_g_values(unit, NFRC[1], band.transmittance, band.absorptance)[0]
    summer = system(pywincalc.nfrc_shgc_environments())
    assert g == pytest.approx(summer.shgc(0.0, 0.0), abs=1e-3)
    winter = system(pywincalc.nfrc_u_environments())
    assert iso15099_u_value(unit, NFRC[0]) == pytest.approx(winter.u(), rel=1e-3)
    faces = np.array(winter.layer_temperatures(pywincalc.TarcogSystemType.U)) - 273.15
    np.testing.assert_allclose(unit_balance(unit, NFRC[0]).faces_c, faces, atol=0.05)


def test_the_spectrum_of_the_sun_matters_where_glass_absorbs_the_infrared():
    values = np.where(NM < 1000, 0.8, 0.1)
    found = [solar_average(name)(NM, values) for name in ("EN 410", "ASTM G173 direct")]
    assert 0.01 < abs(found[0] - found[1]) < 0.05


def test_an_unknown_spectrum_is_named():
    with pytest.raises(ValueError, match="EN 410"):
        solar_average("moonlight")
