"""Fabrics by their data sheets: the reader of tables, its refusals, the BSDF and its layer."""

from __future__ import annotations

import re
import tomllib
from dataclasses import astuple

import numpy as np
import pytest
from click.testing import CliRunner

from mitsuba_cfs.bsdf.evaluate import through_peak
from mitsuba_cfs.bsdf.fabric_table import read_fabric_table
from mitsuba_cfs.bsdf.screens import FabricBand, fabric_klems, fabric_transmittances
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError
from scenes.commands.bsdf import command
from scenes.fenestration.thermal_file import GlazingLayerTable
from tests.bim.bim_fuzz import mutations
from thermal.ratings import REFERENCE_GLAZINGS

SHEET = """Company;Fabric;Colour;Ts [%];Rs [%];Rs back [%];As [%];Tv [%];Rv [%];τv,n-n [%];OF [%];\
Tuv [%];ε;ε';τ_IR [-];Weight [g/m²];thickness [mm]
Weavers;Screen;white;16,2;71,5;70,0;12,3;14,8;76,1;3,9;4,2;5,1;0,85;0,80;0,06;420;0,5
Weavers;Screen;black;4,8;4,5;-;90,7;4,6;4,2;4,1;4,2;4,1;0,85;;;420;0,5
"""
# by EnergyPlus' RB_BEAM, written out by hand: stated whole and direct, then both by angle
ENERGYPLUS = {
    (0.2, 0.05): ((0.191218, 0.042049), (0.161085, 0.014184), (0.131154, 0.0)),
    (0.5, 0.02): ((0.488036, 0.016811), (0.444925, 0.005628), (0.398233, 0.0)),
    (0.04, 0.04): ((0.02998, 0.02998), (0.009968, 0.009968), (0.002663, 0.0)),
}


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "shades.csv"

    def write(text: str):
        path.write_text(text, encoding="utf-8")
        return path

    return write


def generate(path, *words: object):
    """Result of `cfs bsdf generate --shape fabric`; errors come through."""
    out = path.with_name("fabric.xml")
    asked = ["generate", "--shape", "fabric", "--fabrics", path, "--out", out, *words]
    return out, CliRunner().invoke(command, [str(a) for a in asked], catch_exceptions=False)


@pytest.mark.parametrize("stated", ENERGYPLUS)
def test_the_fall_with_the_angle_is_that_of_energyplus(stated):
    band = FabricBand(*stated, 0.3, 0.3)
    whole, straight = fabric_transmittances(band, np.radians([0, 30, 60, 75]))
    np.testing.assert_allclose(np.stack([whole, straight], 1)[0], stated)
    np.testing.assert_allclose(np.stack([whole, straight], 1)[1:], ENERGYPLUS[stated], atol=1e-6)


def test_the_bsdf_holds_what_is_stated_and_is_reciprocal():
    band = FabricBand(0.16, 0.04, 0.7, 0.6)
    bsdf = fabric_klems(band)
    passed = bsdf.direct_hemispherical(bsdf.transmission_front)
    theta = bsdf.basis_in.centres()[0]
    np.testing.assert_allclose(passed[0], 0.16, rtol=1e-3)
    ring = theta < np.radians(75)  # the last is wide
    np.testing.assert_allclose(passed[ring], fabric_transmittances(band, theta[ring])[0], rtol=0.01)
    beam = through_peak(bsdf.transmission_front, bsdf.basis_in).transmittance
    assert beam[0] == pytest.approx(0.04, rel=0.01) and beam[-1] == 0
    there = bsdf.basis_in.opposite()
    block = bsdf.transmission_front
    np.testing.assert_allclose(block[np.ix_(there, there)].T, block, rtol=1e-12, atol=1e-15)
    for side, rho in (("front", 0.7), ("back", 0.6)):
        np.testing.assert_allclose(bsdf.scattered(side)[0], 0.16 + rho, rtol=1e-3)
        assert bsdf.scattered(side).max() <= 0.16 + rho


def test_a_table_of_a_data_sheet(table):
    (white, black), notes = read_fabric_table(table(SHEET))
    assert (white.name, white.manufacturer, white.line) == ("Screen white", "Weavers", 2)
    assert astuple(white.solar) == pytest.approx((0.162, 0.039, 0.715, 0.70))
    assert astuple(white.visible) == pytest.approx((0.148, 0.039, 0.761, 0.761))
    assert (white.openness, white.ultraviolet) == pytest.approx((0.042, 0.051))
    assert (white.emissivity, white.infrared_transmittance) == ((0.85, 0.80), 0.06)
    assert white.thickness == 5e-4
    assert black.emissivity == (0.85, 0.85) and black.infrared_transmittance is None
    assert "rho_e back is not stated: as in front" in black.notes
    assert notes == ("columns not read: Weight [g/m²]", "without a unit, shares of 1 as no value is above it: ε, ε'")


def test_shares_percents_and_spellings_say_the_same(table):
    ours = read_fabric_table(table(SHEET))[0][0]
    titles = 'name,"tau_e,n-h","rho_e,n-h front","rho\'_e,n-h","tau_v,n-h","rho_v,n-h","tau_v,n-n"'
    for values, wanted in (
        ("0.162,0.715,0.70,0.148,0.761,0.039", "shares of 1"),
        ('16.2,71.5,"70,0",14.8,76.1,3.9', "in percent"),
        ("16.2%,71.5 %,70%,14.8%,76.1%,3.9%", ""),
    ):
        (same,), notes = read_fabric_table(table(f"{titles}\n\nScreen,{values}\n"))
        for band in ("solar", "visible"):
            one, other = (getattr(shade, band) for shade in (same, ours))
            assert astuple(one) == pytest.approx(astuple(other), abs=1e-12)
        assert wanted in " ".join(notes) and bool(notes) == bool(wanted)


SHORT = "Fabric;Ts [%];Rs [%];Tv [%];Rv [%];OF [%]\nScreen;16;71;15;76;4\n"


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("16;71", "16;85", "line 2: Rs [%]: tau_e and rho_e make 1.010, above 1"),
        ("15;76", "15;86", "line 2: Rv [%]: tau_v and rho_v make 1.010, above 1"),
        (";4\n", ";16\n", "line 2: OF [%]: 0.160 is open, but tau_v is 0.150"),
        ("16;71", "3;71", "line 2: OF [%]: 0.040 goes straight on, but tau_e is 0.030"),
        ("16;71", "x;71", "line 2: Ts [%]: 'x' is no number"),
        ("16;71", "-16;71", "line 2: Ts [%]: '-16' is no number"),
        ("16;71", "1.016,5;71", "line 2: Ts [%]: '1.016,5' is no number"),
        ("16;71", "116;71", "line 2: Ts [%]: '116' is more than all"),
        ("16;71", ";71", "line 2: Ts [%]: is not stated"),
        ("Rs [%]", "Rs [mm]", "line 1: Rs [mm]: expected a share in [%] or [-]"),
        ("OF [%]", "OF", None),
        (";4\n", ";0,5\n", None),
        ("Rs [%]", "Ts", "line 1: Ts: states the same as 'Ts [%]'"),
        ("Screen;", "Screen;;", "line 2: expected 6 cells as in line 1, got 7"),
        ("Rs [%]", "gloss", "line 2: rho_e: is not stated"),
        ("OF [%]", "gloss", "line 2: tau_v,n-n: is not stated, nor is openness"),
        ("Rv [%]", "As [%]", "line 2: As [%]: with tau_e and rho_e it makes 1.630, not 1"),
        ("OF [%]", "thickness", "line 1: thickness: expected its unit"),
        ("OF [%]", "thickness [m]", "line 2: thickness [m]: '4': expected up to 50 mm"),
        ("Screen;", ";", "line 2: Fabric: is not stated"),
        ("Screen;", '"Screen;', "is no CSV"),
        ("\nScreen;16;71;15;76;4\n", "\n", "expected a line of titles and a row a fabric"),
    ],
)
def test_what_cannot_be_is_refused_with_its_place(table, old, new, message):
    path = table(SHORT.replace(old, new, 1))
    if message is None:
        read_fabric_table(path)
        return
    with pytest.raises(DataError, match=re.escape(message)) as error:
        read_fabric_table(path)
    assert str(error.value).startswith(f"{path}: ") and "\n" not in str(error.value)


@pytest.mark.parametrize("values", ["16;71;15;76;0,5", "16 %;0,71;15 %;76 %;4 %"])
def test_a_small_value_beside_percents_is_not_guessed(table, values):
    """An openness of 0.5 without a unit is 50 % or half a percent."""
    path = table(f"Fabric;Ts;Rs;Tv;Rv;OF\nScreen;{values}\n")
    with pytest.raises(DataError, match=r"line 1: (OF|Rs): values of 0 to 1 beside others"):
        read_fabric_table(path)


def test_the_command_writes_a_bsdf_and_says_the_layer(table):
    out, answer = generate(table(SHEET), "--fabric", "screen WHITE")
    file = read_bsdf_xml(out)
    assert (file.name, file.manufacturer) == ("Screen white", "Weavers")
    assert (file.emissivity_front, file.infrared_transmittance) == (0.85, 0.06)
    for band, wanted in (("Visible", 0.148), ("Solar", 0.162)):
        found = file.band(band).direct_hemispherical(file.band(band).transmission_front)[0]
        assert found == pytest.approx(wanted, rel=1e-3)
    text = next(line for line in answer.output.splitlines() if "layers of a .toml" in line)
    layer = tomllib.loads("layer = " + text.partition(": ")[2])["layer"]
    layer = GlazingLayerTable.model_validate(layer).layer()
    assert layer.emissivity == pytest.approx((0.85, 0.80), abs=1e-4)  # that of the sheet again
    assert layer.infrared_transmittance == 0.06
    assert "note: columns not read: Weight [g/m²]" in answer.output


def test_the_standard_rates_it_by_the_stated_values(table):
    """EN 13363-1, external: tau_e = tau tau_B / (1 - rho rho_B) by the table's own tau, rho."""
    out, _ = generate(table(SHEET), "--fabric", "Screen black")
    words = ["thermal", out, "--place", "external", "--glazing", "C"]
    answer = CliRunner().invoke(command, [str(w) for w in words], catch_exceptions=False)
    glazing = REFERENCE_GLAZINGS["C"]
    row = answer.output.splitlines()[1].split()
    wanted = 0.048 * glazing.transmittance / (1 - 0.045 * glazing.reflectance_outside)
    assert float(row[5]) == pytest.approx(wanted, abs=6e-4)


@pytest.mark.parametrize(
    "words, message",
    [
        ((), "holds 2 fabrics, name one: Screen white; Screen black"),
        (("--fabric", "Screen red"), "has no fabric 'Screen red', but Screen white"),
    ],
)
def test_a_fabric_that_is_not_there(table, words, message):
    with pytest.raises(DataError, match=message):
        generate(table(SHEET), *words)


def test_options_that_do_not_go_together(table):
    _, answer = generate(table(SHEET), "--tensor-tree", 3)
    assert answer.exit_code == 2 and "no tensor tree" in answer.output
    out = table(SHEET).with_name("x.xml")
    words = ["generate", "--shape", "fabric", "--out", str(out)]
    assert "needs --fabrics" in CliRunner().invoke(command, words).output
    words = ["generate", "--fabric", "x", "--out", str(out)]
    assert "belong to --shape fabric" in CliRunner().invoke(command, words).output


def test_spoilt_tables_are_read_or_give_one_line(tmp_path):
    path, refused = tmp_path / "spoilt.csv", 0
    for text in mutations(SHEET.encode(), 400):
        path.write_bytes(text)
        try:
            for shade in read_fabric_table(path)[0]:
                assert shade.solar.transmittance + shade.solar.reflectance_front <= 1 + 1e-9
        except DataError as error:
            refused += 1
            assert "\n" not in str(error) and str(path) in str(error)
    assert refused > 100
