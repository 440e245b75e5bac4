"""Ratings by the standards: formulas by hand, limits of classes, the command."""

from __future__ import annotations

import json
from dataclasses import astuple, replace

import numpy as np
import pandas as pd
import pytest

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from scenes import cli
from scenes.fenestration.thermal_file import ThermalFile
from scenes.fenestration.thermal_system import sun_in_layers
from thermal.glazing import Gap, en410_g_value, en673_u_value, gap_conductances
from thermal.glazing_unit import GasGap, GlazingLayer, GlazingUnit, sheet_layer
from thermal.iso15099 import Conditions, Environment, iso15099_g_values, iso15099_u_value
from thermal.ratings import REFERENCE_GLAZINGS, ThermalRating, _known_to_en673, layered_ratings, shade_ratings


def rated(tau: float, g: float) -> ThermalRating:
    return ThermalRating("by hand", 1.2, tau, g)


def test_en_13363_by_hand():
    glazing = REFERENCE_GLAZINGS["C"]
    (external,) = shade_ratings(0.1, 0.5, "external", glazing)
    # 1/L = 1/1.2 + 1/6 + 1/18; g = tau g + alpha L/18 + tau (1 - g) L/6
    whole = 1 / (1 / 1.2 + 1 / 6 + 1 / 18)
    assert external.g_value == pytest.approx(0.0590 + 0.4 * whole / 18 + 0.041 * whole / 6)
    assert external.transmittance == pytest.approx(0.1 * 0.49 / (1 - 0.5 * 0.29))
    internal, kuhn = shade_ratings(0.1, 0.5, "internal", glazing, kappa=0.4)
    # 1/L = 1/1.2 + 1/18; g (1 - g rho - alpha L/18)
    share = 1.125 / 18
    assert internal.g_value == pytest.approx(0.59 * (1 - 0.59 * 0.5 - 0.4 * share))
    bounce = 1 / (1 - 0.5 * 0.27)
    tau = 0.49 * 0.1 + 0.49 * 0.5 * 0.27 * 0.1 * bounce
    back = 0.6 * 0.49 * (1 - 0.49 - 0.27) * 0.5 * bounce
    heat = 0.49 * 0.4 * (1 - 1 / (1 + 18 / 1.2)) * bounce
    assert kuhn.g_value == pytest.approx(tau + 0.59 - 0.49 + back + heat)
    assert "kappa 0.4" in kuhn.method
    more = shade_ratings(0.1, 0.5, "internal", glazing, kappa=1.0)[1]
    assert more.g_value < kuhn.g_value  # what the panes keep of the light thrown back goes out


def test_classes_begin_at_their_limits():
    for g, expected in ((0.5, 0), (0.49, 1), (0.35, 1), (0.15, 2), (0.149, 3), (0.1, 3), (0.09, 4)):
        assert rated(0.0, g).solar_class("g") == expected
    assert rated(0.2, 0.2).solar_class("tau") == 0
    assert rated(0.049, 0.2).solar_class("tau") == 4
    assert rated(0.1, 0.41).solar_class("secondary") == 0
    assert rated(0.1, 0.129).solar_class("secondary") == 4


def test_layers_by_every_standard():
    clear = GlazingLayer(0.004, 1.0, (0.837, 0.837), solar=(0.83, 0.075, 0.075))
    low_e = GlazingLayer(0.004, 1.0, (0.03, 0.837), solar=(0.59, 0.28, 0.26))
    unit = GlazingUnit((clear, low_e), (GasGap(0.016, (("argon", 0.9), ("air", 0.1))),))
    absorbed = sun_in_layers(unit, [0.52], [0.27], [0.0])[0]
    ratings = {r.method: r for r in layered_ratings(unit, 0.52, absorbed)}
    european = ratings["EN 673, EN 410"]
    assert european.u_value == pytest.approx(1.12, abs=0.03)  # sold as 1.1
    assert ratings["ISO 52022-3, summer"].u_value is None
    assert 0.52 < european.g_value < 0.65
    values = [r.g_value for r in ratings.values()]
    assert max(values) - min(values) < 0.03
    shaded = GlazingUnit((*unit.layers, sheet_layer(0.05)), (*unit.gaps, GasGap(0.05)))
    methods = [r.method for r in layered_ratings(shaded, 0.1, np.array([0.2, 0.1, 0.2]))]
    assert "EN 673, EN 410" not in methods and len(methods) == 3


LAYERS = """
shading_position = "internal"
[[layers]]
thickness = 0.006
solar = [0.775, 0.071, 0.071]
gap = { width = 0.016, gas = { argon = 0.9, air = 0.1 } }
[[layers]]
thickness = 0.006
emissivity = [0.05, 0.84]
solar = [0.6, 0.22, 0.17]
gap = { width = 0.05 }
[[layers]]
openness = 0.02
edges = [0.02, 0.02, 0, 0]
"""


def test_command_rates_a_state_and_writes_what_the_balance_takes(tmp_path, shade, capsys):
    shade.with_suffix(".toml").write_text(LAYERS)
    out = [tmp_path / name for name in ("table.csv", "table.json", "again.toml")]
    command = ["bsdf", "thermal", str(shade)]
    assert cli.run([*command, "--out", str(out[0]), "--toml", str(out[2])]) == 0
    said = capsys.readouterr().out
    assert "ISO 52022-3, summer" in said and "ISO 15099, layer by layer" in said
    table = pd.read_csv(out[0])
    assert list(table["method"]) == ["heat balance", "NFRC", "ISO 52022-3, reference", "ISO 52022-3, summer"]
    np.testing.assert_allclose(table["g_tot"] - table["tau_e"], table["q_i"], atol=2e-4)
    assert cli.run([*command, "--out", str(out[1])]) == 0
    record = json.loads(out[1].read_text())
    assert len(record["g by patch"]["sheet"]) == KLEMS_FULL.size
    again = ThermalFile.read(out[2])
    assert again.u_value == pytest.approx(table["U [W/(m2 K)]"][0], abs=1e-4)
    assert again.closure.u_model == "surface" and again.closure.realised_inner_resistance < 0.13
    assert again.shading_position == "internal"


PANES = LAYERS[LAYERS.index("[[layers]]") :].partition("gap = { width = 0.05 }")[0]


def test_written_data_of_panes_give_the_same_resistance_at_any_temperatures(tmp_path, shade):
    shade.with_suffix(".toml").write_text(PANES)
    written = tmp_path / "again.toml"
    assert cli.run(["bsdf", "thermal", str(shade), "--toml", str(written)]) == 0
    layers, again = ThermalFile.read(shade.with_suffix(".toml")), ThermalFile.read(written)
    assert again.closure.u_model == "surface"
    mean, difference = (v.ravel() for v in np.meshgrid(np.linspace(-25.0, 75.0, 23), np.linspace(0.5, 45.0, 31)))
    expected = layers.closure.layers(None).resistance.at(mean, difference)
    np.testing.assert_allclose(again.closure.surface.at(mean, difference), expected, rtol=1e-5)


def test_command_gives_uv_and_colours_of_panes_by_wavelength(tmp_path, shade, capsys):
    """Clear panes by closed form: each grey but for a red cut, which the other passes on."""
    nm = np.arange(300, 2501, 5)
    for name, tau in (("clear", np.full(len(nm), 0.8)), ("red", np.where(nm < 380, 0.1, 0.5))):
        rows = [f"{1e-3 * w:.4f} {t:.4f} 0.0 0.0" for w, t in zip(nm, tau, strict=True)]
        head = ["{Units, Wavelength Units } SI Microns", "{Thickness } 6", "{Coated Side } Front"]
        (tmp_path / f"{name}.dat").write_text("\n".join([*head, *rows]))
    files = '[[layers]]\npane = "clear.dat"\ngap = { width = 0.016 }\n[[layers]]\npane = "red.dat"'
    shade.with_suffix(".toml").write_text(files)
    out = tmp_path / "table.json"
    assert cli.run(["bsdf", "thermal", str(shade), "--out", str(out)]) == 0
    assert "tau_UV" in capsys.readouterr().out
    rows = {row["method"]: row for row in json.loads(out.read_text())["rows"]}
    european = rows["EN 673, EN 410"]
    # no reflection: shares multiply; 0.0907 of the UV lies in the band that 377.5 stands for, 380
    # nm is clear again
    assert european["tau_UV"] == pytest.approx(0.8 * (0.1 + 0.4 * 0.09073 * 0.5), abs=2e-4)
    assert european["R_a"] == pytest.approx(100.0, abs=1e-6)  # grey where it is seen
    assert rows["NFRC"]["tau_UV"] is None


def test_command_says_why_there_is_no_colour(tmp_path, shade, capsys):
    rows = [f"{w} 0.0 0.1 0.1" for w in (0.3, 0.5, 2.5)]
    head = ["{Units, Wavelength Units } SI Microns", "{Thickness } 6", "{Coated Side } Front"]
    (tmp_path / "black.dat").write_text("\n".join([*head, *rows]))
    shade.with_suffix(".toml").write_text('[[layers]]\npane = "black.dat"')
    assert cli.run(["bsdf", "thermal", str(shade)]) == 0
    assert "neither tau_UV nor R_a: colour rendering" in capsys.readouterr().out


def test_command_rates_a_shade_alone(shade, capsys):
    words = ["bsdf", "thermal", str(shade), "--place", "internal", "--glazing", "C"]
    assert cli.run(words) == 0
    said = capsys.readouterr().out
    assert "EN 13363-1, internal" in said and "Kuhn 2006, kappa 0.4" in said


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--place", "internal"], "belong together"),
        (["--place", "internal", "--glazing", "C", "--toml", "a.toml"], "one state"),
    ],
)
def test_command_names_what_does_not_go_together(shade, capsys, options, words):
    assert cli.run(["bsdf", "thermal", str(shade), *options]) != 0
    assert words in capsys.readouterr().err


def test_command_names_a_file_that_is_missing(tmp_path, capsys):
    assert cli.run(["bsdf", "thermal", str(tmp_path / "none.xml")]) != 0
    assert "none.xml" in capsys.readouterr().err


def test_tables_of_en_14501():
    """Annex A: U, g, tau, rho, rho' of the reference glazings; the limits of the classes."""
    printed = {
        "A": (5.8, 0.85, 0.83, 0.08, 0.08),
        "B": (2.9, 0.76, 0.69, 0.14, 0.14),
        "C": (1.2, 0.59, 0.49, 0.29, 0.27),
        "D": (1.1, 0.32, 0.27, 0.29, 0.38),
    }
    assert {name: astuple(glazing) for name, glazing in REFERENCE_GLAZINGS.items()} == printed
    for of, limits in (
        ("g", (0.5, 0.35, 0.15, 0.1)),
        ("secondary", (0.3, 0.2, 0.1, 0.03)),
        ("tau", (0.2, 0.15, 0.1, 0.05)),
    ):
        for number, limit in enumerate(limits):
            for value, expected in ((limit + 1e-9, number), (limit - 1e-9, number + 1)):
                tau = value if of == "tau" else 0.0
                assert rated(tau, tau if of == "tau" else value).solar_class(of) == expected


def test_european_rating_by_the_formulas():
    """EN 673's U with 1 W/(m K) glass, EN 410's q_i over half panes and the gap; by tilt."""
    panes = (
        GlazingLayer(0.006, 1.0, (0.837, 0.837), solar=(0.8, 0.07, 0.07)),
        GlazingLayer(0.008, 0.9, (0.1, 0.837), solar=(0.6, 0.2, 0.2)),
    )
    gap = GasGap(0.016, (("argon", 0.9), ("air", 0.1)))
    found = {}
    for tilt, position in ((90.0, "vertical"), (60.0, "tilted"), (15.0, "horizontal")):
        unit = GlazingUnit(panes, (gap,), tilt_deg=tilt)
        rating = layered_ratings(unit, 0.5, [0.15, 0.12])[-1]
        gaps = [Gap(0.016, gap.gas, (0.837, 0.1))]
        solid = [0.006, 0.008 / 0.9]
        inner = 0.837
        assert rating.u_value == pytest.approx(
            en673_u_value(solid, gaps, position=position, emissivity_in=inner, conductivity=1.0)
        )
        between = 1 / gap_conductances(gaps, position) + (0.006 + 0.008 / 0.9) / 2
        assert rating.g_value == pytest.approx(
            float(en410_g_value(np.array([0.5]), np.array([[0.15, 0.12]]), between)[0])
        )
        found[position] = rating.u_value
    assert found["vertical"] < found["tilted"] < found["horizontal"]
    other = GasGap(0.016, (("argon", 1.0), ("xenon", 0.0)))
    assert _known_to_en673(GlazingUnit(panes, (other,)))
    assert not _known_to_en673(GlazingUnit(panes, (replace(other, gas=(("xenon", 1.0),)),)))


def test_a_shade_within_by_en_13363():
    """Integrated: g tau + g (alpha + (1 - g) rho) L/3 with 1/L = 1/U + 1/3."""
    glazing = REFERENCE_GLAZINGS["B"]
    (within,) = shade_ratings(0.2, 0.5, "integrated", glazing)
    whole = 1 / (1 / 2.9 + 1 / 3)
    by_hand = 0.76 * 0.2 + 0.76 * (0.3 + (1 - 0.76) * 0.5) * whole / 3
    assert within.g_value == pytest.approx(by_hand)
    assert within.transmittance == pytest.approx(0.2 * 0.69 / (1 - 0.5 * 0.14))


def test_european_rating_of_three_panes_by_the_formulas():
    """Panes of three thicknesses; the rooms' side of the last one is coated."""
    thicknesses = (0.004, 0.006, 0.01)
    panes = tuple(
        GlazingLayer(thickness, 1.0, (0.837, inner), solar=(0.8, 0.07, 0.07))
        for thickness, inner in zip(thicknesses, (0.837, 0.837, 0.2), strict=True)
    )
    gaps = (GasGap(0.012, (("argon", 1.0),)),) * 2
    alpha = [0.1, 0.08, 0.06]
    rating = layered_ratings(GlazingUnit(panes, gaps), 0.5, alpha)[-1]
    own = [Gap(0.012, gap.gas, (0.837, 0.837)) for gap in gaps]
    expected = en673_u_value(thicknesses, own, position="vertical", emissivity_in=0.2, conductivity=1.0)
    assert rating.u_value == pytest.approx(expected)
    solid = np.array(thicknesses)
    between = 1 / gap_conductances(own, "vertical") + (solid[:-1] + solid[1:]) / 2
    expected = float(en410_g_value(np.array([0.5]), np.array([alpha]), between)[0])
    assert rating.g_value == pytest.approx(expected)


def test_u_is_that_of_the_winter_of_nfrc_and_g_of_its_summer():
    """NFRC 100: -18 and 21 degC, 5.5 m/s, where the gas moves more than between 32 and 24 degC."""
    clear = GlazingLayer(0.004, 1.0, (0.837, 0.837), solar=(0.83, 0.075, 0.075))
    unit = GlazingUnit((clear, clear), (GasGap(0.012, (("air", 1.0),)),))
    nfrc = layered_ratings(unit, 0.7, np.array([0.1, 0.08]))[0]
    winter = Conditions(Environment(-18.0, 4 + 4 * 5.5), Environment(21.0, None))
    summer = Conditions(Environment(32.0, 4 + 4 * 2.75), Environment(24.0, None), 783.0)
    assert nfrc.method == "NFRC"
    assert nfrc.u_value == pytest.approx(iso15099_u_value(unit, winter), abs=1e-12)
    assert nfrc.u_value != pytest.approx(iso15099_u_value(unit, summer), abs=0.02)
    g = iso15099_g_values(unit, summer, np.array([0.7]), np.array([[0.1, 0.08]]))[0]
    assert nfrc.g_value == pytest.approx(g, abs=1e-12)
