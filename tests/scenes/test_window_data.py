"""Window data from files: panes, gas and shade, the closure that follows, in TOML and in IFC."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bim.fenestration import ShadingState
from bim.ifc.attach import attach
from bim.ifc.fenestration_read import read_fenestration
from bim.ifc.targets import Targets
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.errors import DataError
from scenes.fenestration.systems import FenestrationSystem, read_system
from scenes.fenestration.thermal_file import ThermalFile
from scenes.fenestration.thermal_system import scattered_share, sun_in_layers, thermal_system, with_likely_layers
from scenes.room.operation import read_operation
from tests.scenes.fenestration_models import grey, room
from thermal.blackbox import R_INNER, R_OUTER, Fenestration
from thermal.closure import ERRORS, Closure
from thermal.errors import ThermalInputError
from thermal.glazing_unit import GasGap, GlazingLayer, GlazingUnit, Openings
from thermal.iso15099 import STATED_G, iso15099_data, iso15099_g_values, iso15099_u_value, prescribed, yearly_g_values
from thermal.window_model import layered_thermal_data, window_model

BLIND = Path(__file__).parents[2] / "scenes" / "demo" / "venetian_blind.xml"
ROOT = Path(__file__).parents[2]
CLEAR = GlazingLayer(0.006, 0.9, solar=(0.775, 0.071, 0.071))
LOW_E = GlazingLayer(0.006, 0.9, (0.05, 0.84), solar=(0.600, 0.220, 0.170))
ARGON = GasGap(0.016, (("argon", 0.9), ("air", 0.1)))
SHADE = GlazingLayer(0.0005, 0.15, (0.9, 0.9), openings=Openings(0.05, 0.05, 0.05, 0.05))
INTERNAL = GlazingUnit((CLEAR, LOW_E, SHADE), (ARGON, GasGap(0.05)))
EXTERNAL = GlazingUnit((SHADE, CLEAR, LOW_E), (GasGap(0.1), ARGON))
LAYERS = """
[[system.layers]]
thickness = 0.006
conductivity = 0.9
solar = [0.775, 0.071, 0.071]
gap = { width = 0.016, gas = { argon = 0.9, air = 0.1 } }
[[system.layers]]
thickness = 0.006
conductivity = 0.9
emissivity = [0.05, 0.84]
solar = [0.6, 0.22, 0.17]
gap = { width = 0.05 }
[[system.layers]]
openness = 0.0
edges = [0.05, 0.05, 0.05, 0.05]
"""


def grey_system(**more) -> FenestrationSystem:
    """A system that scatters."""
    return FenestrationSystem("grey", grey(0.2), grey(0.2), **more)


@pytest.mark.parametrize(
    ("stated", "known"),
    [
        ({"u_value": 1.1, "g_value": 0.4, "shading_position": "internal"}, True),
        ({"u_value": 1.1, "shading_position": "internal"}, False),
        ({"g_value": 0.4, "shading_position": "internal"}, False),
        ({}, False),
    ],
)
def test_the_error_against_energyplus_belongs_to_stated_values(stated, known):
    """The cases that it was found in had U, g and the shade's position."""
    model = thermal_system(grey_system(**stated)).model
    assert ("RMS error against EnergyPlus in 128 cases" in model) == known
    assert ("error unknown: it was compared" in model) != known


def test_layers_give_u_g_films_and_resistance_by_default():
    heat = thermal_system(grey_system(closure=Closure("layers", unit=INTERNAL)))
    data = iso15099_data(INTERNAL)
    assert heat.fenestration.u_value == pytest.approx(data.u_value)
    shade, panes = heat.fenestration.shade, heat.fenestration.layer_resistance
    assert shade.inward == pytest.approx(data.shade.inward) and shade.width == data.shade.width
    assert panes.coefficients == pytest.approx(data.shade.panes.coefficients, abs=1e-9)
    series = heat.fenestration.in_series()
    assert series.r_inner == pytest.approx(data.r_inner, rel=0.2)
    assert float(series.layer_resistance.at(10.0, 16.0)) == pytest.approx(
        float(data.resistance.at(10.0, 16.0)), rel=0.1
    )
    assert np.asarray(heat.absorptances.middle).min() > 0.0
    assert heat.transmittance[0] < heat.g_value[0] < 0.9
    assert "ISO 15099, layer by layer, with films of the shade" in heat.model
    assert len(heat.notes) == 2  # U and g are from the layers
    known = thermal_system(grey_system(closure=Closure("layers", unit=INTERNAL), u_value=1.0, g_value=0.4))
    assert known.fenestration.u_value == 1.0
    # g is stated for a sunny summer state; that of the year differs by the air flow at the shade
    theta = KLEMS_FULL.centres()[0]
    absorbed = sun_in_layers(INTERNAL, known.transmittance, known.reflectance, theta)
    first = known.transmittance[:1], absorbed[:1]
    summer = iso15099_g_values(INTERNAL, prescribed(*STATED_G), *first)[0]
    tau = known.transmittance
    scale = (0.4 - tau[0]) / (summer - tau[0])
    np.testing.assert_allclose(known.g_value - tau, scale * (heat.g_value - tau), rtol=1e-6)
    assert known.g_value[0] == pytest.approx(0.4, abs=0.02)
    assert not known.notes


def test_a_measured_u_shifts_the_resistance_of_the_layers():
    data = iso15099_data(EXTERNAL, 0.9)
    assert data.u_value == 0.9
    free = iso15099_data(EXTERNAL)
    apart = data.resistance.at(10.0, 15.0) - free.resistance.at(10.0, 15.0)
    assert float(apart) == pytest.approx(1 / 0.9 - 1 / free.u_value, rel=0.02)
    with pytest.raises(ThermalInputError, match="more than the layers let through"):
        iso15099_data(EXTERNAL, 6.9)


@pytest.mark.parametrize("unit", [INTERNAL, EXTERNAL])
def test_what_layers_absorb_adds_up_and_panes_get_their_part(unit):
    theta = np.radians([0.0, 40.0, 70.0])
    tau, rho = np.array([0.1, 0.1, 0.05]), np.array([0.4, 0.4, 0.5])
    absorbed = sun_in_layers(unit, tau, rho, theta)
    np.testing.assert_allclose(absorbed.sum(axis=1), 1 - tau - rho)
    assert np.all(absorbed >= 0)
    shade = 2 if unit is INTERNAL else 0
    if unit is EXTERNAL:  # behind the shade only what passes: the panes' share of 0.1
        assert absorbed[0, shade] > 0.4 and absorbed[0, 1:].max() < 0.06
    else:
        assert absorbed[0, :2].min() > 0.15
    g = layered_thermal_data(unit, tau, rho, absorbed).g_value
    inward = (g - tau) / (1 - tau - rho)
    # of the shade's own heat nearly all comes in from inside, nearly none from outside
    assert inward[0] > 0.4 if unit is INTERNAL else inward[0] < 0.2


def test_layers_absorb_as_windows_engine_has_it(reference_data):
    """The interior shade of the reference set: shares of each layer, from its tau and rho."""
    from tests.validation.reference_systems import layers, read_optics

    folder = reference_data / "energyplus"
    import json

    for name in ("dgu", "int_shade", "ext_shade"):
        rows = json.loads((folder / f"blackbox_{name}.json").read_text())["angular"]
        row = min(rows, key=lambda one: one["theta"])
        optics = read_optics(folder, name)
        ours = sun_in_layers(layers(name), optics.tau[:1], optics.rho[:1], optics.theta[:1])[0]
        # the engine's directions and a diffuse shade: a hundredth of the sun
        np.testing.assert_allclose(ours, row["alpha_layers"], atol=0.01)


def test_place_of_a_shade_gives_its_typical_films_unless_stated():
    for place, unit in (("internal", INTERNAL), ("external", EXTERNAL)):
        heat = thermal_system(grey_system(u_value=1.1, g_value=0.4, shading_position=place))
        assert "films of the shade" in heat.model
        film = "r_inner" if place == "internal" else "r_outer"
        # a shade between panes and air loses heat on both sides: about half the nominal film
        own = getattr(iso15099_data(unit), film)
        assert getattr(heat.fenestration.in_series(), film) == pytest.approx(own, rel=0.2)
        assert own < 0.65 * (R_INNER if place == "internal" else R_OUTER)
    stated = Closure("constant", realised_inner_resistance=0.1)
    heat = thermal_system(grey_system(u_value=1.1, shading_position="internal", closure=stated))
    assert heat.fenestration.r_inner == 0.1


def test_g_by_direction_of_assumed_layers_is_windows_engine_s(reference_data):
    """U and g at normal incidence, tau and rho of the engine: its diffuse g comes back.

    With one inward share for all directions the blind's is 0.12 off for sky and ground light.
    """
    from tests.validation.reference_systems import read_optics, system

    folder = reference_data / "energyplus"
    for name, bound in (("dgu", 0.005), ("ext_shade", 0.005), ("ext_blind", 0.02), ("int_shade", 0.015)):
        expected = read_optics(folder, name).diffuse[:, 2]
        found = system(folder, name, "typical").optics.diffuse[:, 2]
        np.testing.assert_allclose(found, expected, atol=bound, err_msg=name)


@pytest.mark.parametrize("shaded", [False, True])
def test_assumed_layers_find_another_glazing_by_u_and_g(shaded):
    """Clear double glazing, whose layers are not the assumed low-e ones: g for diffuse light."""
    from tests.validation.energyplus_by_study import clear_system

    optics, unit = clear_system(shaded=shaded)
    known = optics.tau, optics.rho, optics.theta
    absorbed = sun_in_layers(unit, *known)
    u = iso15099_data(unit).u_value
    first = optics.tau[:1], absorbed[:1]
    g = float(iso15099_g_values(unit, prescribed(*STATED_G), *first)[0])
    place = "internal" if shaded else "none"
    window = window_model(*known, place, Closure(), absorbed=sun_in_layers, u_value=u, g_normal=g, item="clear")
    expected = yearly_g_values(unit, optics.tau, absorbed)
    assert np.abs(window.data.g_value - expected).max() < 0.012
    closed = window.closure.close(Fenestration("clear", u)).layer_resistance
    for mean, apart in ((5.0, 15.0), (25.0, 10.0)):
        data = iso15099_data(unit)
        own = (data.shade.panes if data.shade else data.resistance).at(mean, apart)
        assert closed.at(mean, apart) == pytest.approx(float(own), rel=0.03)


def test_a_blind_that_lets_most_light_straight_through_is_still_a_shade():
    """Three quarters of what the demo's blind transmits leave straight on."""
    blind, glazing = (
        replace(read_system(BLIND.with_name(f"{name}.xml")), g_by_patch=None, shading_position=None)
        for name in ("venetian_blind", "glazing")
    )
    assert 0.2 < scattered_share(blind.solar) < 0.35 and scattered_share(glazing.solar) < 1e-9
    assert any("taken as external" in note for note in thermal_system(blind).notes)
    assert not any("taken as" in note for note in thermal_system(glazing).notes)


def test_layers_assumed_are_named_with_the_range_of_g():
    notes = thermal_system(grey_system(u_value=1.1, g_value=0.4, shading_position="internal")).notes
    (note,) = (one for one in notes if "layers assumed" in one)
    used, low, high = (float(v) for v in re.findall(r"0\.\d{3}", note))
    assert low <= used <= high and low < high
    assert "2 panes" in note and "shade internal" in note
    stated = thermal_system(grey_system(closure=Closure("layers", unit=INTERNAL))).notes
    assert not any("layers assumed" in one for one in stated)


def test_likely_layers_have_the_same_u_and_g_and_another_diffuse_g():
    system = grey_system(u_value=1.1, g_value=0.4, shading_position="internal")
    assumed = thermal_system(system)
    low, high = (thermal_system(with_likely_layers(system, number)) for number in (0, 1))
    weight = KLEMS_FULL.projected_solid_angles() / np.pi
    for heat in (low, high):
        assert heat.fenestration.u_value == pytest.approx(assumed.fenestration.u_value)
        assert "layers assumed" not in " ".join(heat.notes) and not heat.likely
    diffuse = [float(weight @ heat.g_value) for heat in (low, assumed, high)]
    assert diffuse == sorted(diffuse) and diffuse[2] > diffuse[0] + 0.003
    stated = grey_system(closure=Closure("layers", unit=INTERNAL))
    assert with_likely_layers(stated, 0) is stated


def test_a_shade_is_not_taken_for_a_pane_by_silence():
    said = thermal_system(grey_system()).notes
    assert any("State shading_position" in note for note in said)
    stated = thermal_system(grey_system(shading_position="none")).notes
    assert not any("shading_position" in note for note in stated)
    guessed = thermal_system(grey_system(u_value=1.1, g_value=0.4)).notes
    assert any("from g at normal incidence it is taken as" in note for note in guessed)
    wrong = grey_system(closure=Closure("layers", unit=INTERNAL), shading_position="external")
    with pytest.raises(ThermalInputError, match="layers have their shade 'internal'"):
        thermal_system(wrong)


def operation(tmp_path: Path, text: str) -> FenestrationSystem:
    path = tmp_path / "operation.toml"
    path.write_text(f'[[system]]\nbsdf = "{BLIND}"\n{text}')
    return read_operation(path).systems[0]


def test_toml_says_panes_gases_and_shade(tmp_path):
    unit = operation(tmp_path, LAYERS).closure.unit
    assert unit == replace(INTERNAL, layers=(CLEAR, LOW_E, replace(SHADE, infrared_transmittance=0.0)))
    u = iso15099_u_value(unit, prescribed(0.0, 20.0))
    assert 1.1 < u < 1.2
    wide = operation(tmp_path, f"glazing_width = 3.0\n{LAYERS}").closure.unit
    # of the air behind the shade, less passes the sides of a wide one
    assert wide == replace(unit, width=3.0) and iso15099_u_value(wide, prescribed(0.0, 20.0)) < u
    sloped = operation(tmp_path, "u_slope = 0.004\n").closure
    assert (sloped.u_model, sloped.slope) == ("linear", 0.004)
    fit = operation(tmp_path, "surface = [1.2, 0.005, 0.03, -1e-4, -3e-4, 7e-5]\n").closure
    assert fit.u_model == "surface"
    angles = operation(tmp_path, "g_value_by_angle = [[0, 0.5], [60, 0.4], [90, 0]]\n")
    theta = KLEMS_FULL.centres()[0]
    expected = np.interp(np.degrees(theta), [0, 60, 90], [0.5, 0.4, 0.0])
    np.testing.assert_allclose(angles.g_by_patch, expected)
    assert operation(tmp_path, "shading_position = 'external'\n").shading_position == "external"


def test_a_panes_file_lies_beside_the_toml(tmp_path, real_data):
    source = real_data / "bsdf" / "products_spectral" / "CLEAR_3.DAT"
    (tmp_path / "CLEAR_3.DAT").write_bytes(source.read_bytes())
    text = '[[system.layers]]\npane = "CLEAR_3.DAT"\n'
    (layer,) = operation(tmp_path, text).closure.unit.layers
    assert layer.thickness == pytest.approx(0.003048)
    assert layer.solar[0] == pytest.approx(0.834, abs=0.005)  # NFRC's, in CLEAR_3.json
    (tmp_path / "CLEAR_3.DAT").unlink()
    with pytest.raises(DataError, match=r"CLEAR_3.DAT.*cannot be read"):
        operation(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("u_slope = 0.1\n", "u_slope"),
        ("u_slope = 0.005\nsurface = [1, 0, 0, 0, 0, 0]\n", "exclude each other"),
        ("conductance = { mean_c = [0, 10], difference_k = [1, 5], values = [[1, 2]] }\n", "expected 2 rows of 2"),
        ("conductance = { mean_c = [0, 10, 12], difference_k = [1, 5], values = [[1, 2]] }\n", "equal steps"),
        ('u_model = "constant"\nu_slope = 0.005\n', 'belongs to u_model "linear"'),
        ('u_model = "layers"\n', "belong together"),
        (LAYERS.replace("emissivity", "emisivity"), r"layers.*emisivity.*emissivity"),
        (LAYERS.replace("argon = 0.9", "neon = 0.9"), "layers"),
        (LAYERS.replace("width = 0.016", "width = 16"), r"gap.*width.*16"),
        ("[[system.layers]]\nopenness = 0.1\npane = 'a'\n", "exclude each other"),
        ("[[system.layers]]\nemissivity = [0.8, 0.8]\n", "expected a pane"),
        ("[[system.layers]]\nthickness = 0.006\nedges = [1, 1, 1, 1]\n", "edges: are of shades"),
        ("g_value_by_angle = [[60, 0.4], [0, 0.5]]\n", "rising angles"),
        ("shading_position = 'inside'\n", "shading_position"),
    ],
)
def test_a_fault_of_the_window_data_names_its_key(tmp_path, text, words):
    with pytest.raises(DataError, match=words):
        operation(tmp_path, text)


def test_the_file_beside_a_bsdf_holds_the_same(tmp_path):
    path = tmp_path / "system.toml"
    head = 'shading_position = "internal"\nkappa = 0.4\n'
    path.write_text(head + LAYERS.replace("system.", ""))
    read = ThermalFile.read(path)
    assert read.shading_position == "internal" and read.closure.u_model == "layers"
    assert len(read.closure.unit.layers) == 3


@pytest.mark.parametrize(
    "closure",
    [
        Closure("layers", unit=INTERNAL),
        Closure("layers", unit=replace(EXTERNAL, gaps=(GasGap(0.1, blown=(0.2, 15.0)), ARGON))),
        Closure("linear", slope=0.003, realised_inner_resistance=0.07),
        Closure("surface", surface=(1.2, 0.005, 0.03, -1e-4, -3e-4, 7e-5)),
    ],
    ids=["layers", "blown", "slope", "surface"],
)
@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4"])
def test_ifc_holds_every_closure(tmp_path, closure, schema):
    path = tmp_path / "room.ifc"
    room(path, schema=schema)
    state = ShadingState("", u_value=1.1, closure=closure)
    attach(path, tmp_path / "with.ifc", state, Targets(every_window=True))
    (held,) = next(iter(read_fenestration(tmp_path / "with.ifc").values()))
    assert held.closure == closure


def test_the_errors_that_a_result_names_are_those_of_the_docs():
    page = (ROOT / "docs" / "thermal.md").read_text()
    for place, models in ERRORS.items():
        for model, (air, window) in models.items():
            assert f"{air:.2f}, {window:.2f}" in page, (place, model)


def test_reads_a_plain_file_as_before():
    system = read_system(BLIND)
    assert system.closure is None
    heat, by_name = thermal_system(system), thermal_system(replace(system, closure=Closure("typical")))
    assert heat.model == by_name.model
    assert heat.fenestration == by_name.fenestration
