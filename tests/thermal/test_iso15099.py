"""ISO 15099 layer by layer: closed forms, its own account of heat, WINDOW's engine beside it."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.conftest import WINDOW_GLAZING
from tests.thermal.rooms import box, climate
from thermal.balance import BalanceOptions, simulate
from thermal.blackbox import Fenestration, layer_absorptances, node_absorptances, with_realised_films
from thermal.climate import no_sun
from thermal.closure import Closure
from thermal.emitters import IdealLoads
from thermal.errors import ThermalInputError
from thermal.glazing_unit import (
    Environment,
    GasGap,
    GlazingLayer,
    GlazingUnit,
    Openings,
    perforated_layer,
    sheet_layer,
    venetian_layer,
    woven_layer,
)
from thermal.iso15099 import (
    NFRC,
    Conditions,
    iso15099_data,
    iso15099_g_values,
    iso15099_u_value,
    prescribed,
    unit_balance,
)
from thermal.layer_balance import SIGMA
from thermal.zone import Layer

ARGON = (("argon", 0.9), ("air", 0.1))
CLEAR = GlazingLayer(0.006, 0.9)
LOW_E = GlazingLayer(0.006, 0.9, (0.05, 0.84))
SEALED = GasGap(0.016, ARGON)
DOUBLE = GlazingUnit((CLEAR, LOW_E), (SEALED,))
ALL_ROUND = Openings(0.03, 0.02, 0.01, 0.015, 0.02)
SHADE = GlazingLayer(0.0005, 0.15, (0.9, 0.9), 0.0, ALL_ROUND)


def shaded(place: str, shade: GlazingLayer = SHADE, width: float = 0.05) -> GlazingUnit:
    """The double glazing with a shade outside, inside or in its gap."""
    air = GasGap(width)
    if place == "external":
        return GlazingUnit((shade, CLEAR, LOW_E), (air, SEALED))
    if place == "internal":
        return GlazingUnit((CLEAR, LOW_E, shade), (SEALED, air))
    return GlazingUnit((CLEAR, shade, LOW_E), (air, air))


def test_black_pane_between_black_bodies_meets_its_closed_form():
    pane = GlazingLayer(0.004, 1.0, (1.0, 1.0))
    conditions = Conditions(Environment(0.0, 20.0), Environment(20.0, 3.0))
    balance = unit_balance(GlazingUnit((pane,)), conditions)
    outer, inner = balance.faces_c + 273.15
    out = 20.0 * (outer - 273.15) + SIGMA * (outer**4 - 273.15**4)
    come = 3.0 * (293.15 - inner) + SIGMA * (293.15**4 - inner**4)
    assert out == pytest.approx(come, abs=1e-6)
    assert (inner - outer) * 1.0 / 0.004 == pytest.approx(come, abs=1e-5)
    assert -balance.heat_in == pytest.approx(come, abs=1e-6)


@pytest.mark.parametrize("place", ["none", "external", "internal", "between"])
def test_heat_that_leaves_indoors_arrives_outdoors(place):
    unit = DOUBLE if place == "none" else shaded(place)
    absorbed = np.array([40.0, 90.0, 150.0])[: len(unit.layers)]
    conditions = prescribed(30.0, 22.0)
    balance = unit_balance(unit, conditions, absorbed)
    outer = balance.faces_c[0] + 273.15
    layer = unit.layers[0]
    sky = conditions.outdoor.radiosity
    assert layer.infrared_transmittance == 0
    heat_out = 20.0 * (outer - 303.15) + layer.emissivity[0] * (SIGMA * outer**4 - sky)
    if place == "external":  # the air behind the shade carries heat outdoors too
        density, heat = 101325 * 28.97 / 8314.462 / 303.15, 1006.5
        carried = density * heat * 0.05 * balance.gap_speed[0] / unit.height
        heat_out += carried * (balance.gap_outlet_c[0] - 30.0)
        tolerance = 0.01  # density and heat capacity of the air at one temperature, by hand
    else:
        tolerance = 1e-7
    assert heat_out + balance.heat_in == pytest.approx(absorbed.sum(), rel=tolerance)


def test_air_that_goes_round_a_shade_gives_back_what_it_took():
    warm = unit_balance(shaded("between"), prescribed(0.0, 20.0), [0.0, 200.0, 0.0])
    shut = GlazingLayer(0.0005, 0.15, (0.9, 0.9), 0.0, Openings())
    still = unit_balance(shaded("between", shut), prescribed(0.0, 20.0), [0.0, 200.0, 0.0])
    assert warm.gap_speed[0] == pytest.approx(warm.gap_speed[1])
    assert warm.gap_speed[0] > 0.02 > 1e-3 > still.gap_speed[0]
    # moving air carries heat past the shade: its faces differ less from the panes
    assert np.ptp(warm.faces_c[1:5]) < np.ptp(still.faces_c[1:5])


def test_shut_openings_are_a_closed_gap():
    shut = replace(SHADE, openings=Openings())
    as_pane = replace(SHADE, openings=None)
    for place in ("external", "internal", "between"):
        u = [iso15099_u_value(shaded(place, s), prescribed(0.0, 20.0)) for s in (shut, as_pane)]
        assert u[0] == pytest.approx(u[1], rel=1e-3)
        opened = iso15099_u_value(shaded(place), prescribed(0.0, 20.0))
        assert opened > u[1] + 0.02


def test_heat_from_below_moves_the_gas_more():
    lying = [iso15099_u_value(replace(DOUBLE, tilt_deg=t), prescribed(0.0, 20.0)) for t in (0, 90)]
    summer = iso15099_u_value(replace(DOUBLE, tilt_deg=0), prescribed(40.0, 20.0))
    assert lying[0] > 1.3 * lying[1]
    assert summer < lying[1]  # heat flows down: the gas stays in layers


def test_g_counts_what_each_layer_sends_inwards():
    alpha = np.array([[0.2, 0.0], [0.0, 0.2], [0.1, 0.1]])
    g = iso15099_g_values(DOUBLE, prescribed(25.0, 24.0, 500.0), np.full(3, 0.5), alpha)
    assert g[0] < g[2] < g[1]
    assert g[2] == pytest.approx(0.5 * (g[0] + g[1]), abs=2e-3)  # nearly linear
    fractions = (g[:2] - 0.5) / 0.2
    assert fractions[0] < 0.15 and fractions[1] > 0.7


@pytest.mark.parametrize("shift", [0.0, 0.1])
@pytest.mark.parametrize("apart", [(-5.0, 20.0), (5.0, 20.0), (20.0, 45.0), (35.0, 60.0), (27.0, 33.0)])
def test_resistance_of_panes_is_that_of_their_balance(apart, shift):
    """Where the gas begins to turn in the gap six coefficients were up to 3 % off: 0.2 K of a sunny room."""
    u_value = iso15099_data(DOUBLE).u_value
    data = iso15099_data(DOUBLE, 1.0 / (1.0 / u_value + shift))
    balance = unit_balance(DOUBLE, prescribed(*apart))
    outer, inner = balance.faces_c[0], balance.faces_c[-1]
    exact = (inner - outer) / -balance.heat_in + shift
    assert data.resistance.at(0.5 * (inner + outer), outer - inner) == pytest.approx(exact, rel=2e-3)


def test_blackbox_of_the_layers_gives_their_u_and_films():
    data = iso15099_data(shaded("internal"))
    fenestration = with_realised_films(
        Fenestration("shade", data.u_value, resistance=data.resistance), r_inner_realised=data.r_inner
    )
    mid, apart = 10.0, 15.0
    resistance = float(fenestration.layer_resistance.at(mid, apart))
    assert data.r_inner < 0.1 < 0.125  # the shade also warms the air behind it
    assert 1 / (data.r_outer + resistance + data.r_inner) == pytest.approx(data.u_value, rel=0.03)
    layer_absorptances(0.05, 0.5, 0.4, data.u_value, r_inner=data.r_inner)


@pytest.mark.parametrize("openness", [0.0, 0.3])
@pytest.mark.parametrize("inner_emissivity", [0.84, 0.05])
@pytest.mark.parametrize("absorbed", [(0.0, 0.0, 0.0), (20.0, 30.0, 150.0), (0.0, 150.0, 20.0)])
@pytest.mark.parametrize("exterior", [False, True])
def test_a_shade_in_the_balance_is_that_of_its_layers(absorbed, inner_emissivity, openness, exterior):
    """Faces, heat to the air and to the room, by hourly balance and by ISO 15099 layer by layer.

    The room is as warm as its air, but where the sun is: the surroundings of the standard.
    """
    panes = GlazingLayer(0.006, 0.9), GlazingLayer(0.006, 0.9, (inner_emissivity, 0.84))
    shade = sheet_layer(openness, thickness=0.0005, conductivity=0.15, edges=(0.05,) * 4)
    gap = GasGap(0.016, (("argon", 0.9), ("air", 0.1)))
    unit = GlazingUnit((*panes, shade), (gap, GasGap(0.05)))
    if exterior:
        unit, absorbed = GlazingUnit((shade, *panes), (GasGap(0.05), gap)), absorbed[::-1]
    data = iso15099_data(unit)
    window = Closure("layers", unit=unit).close(Fenestration("shade", data.u_value))
    surroundings = Conditions(Environment(10.0, 20.0), Environment(25.0, None))
    balance = unit_balance(unit, surroundings, absorbed)
    parts = node_absorptances(np.array([absorbed]), data.shade)
    light = replace(
        no_sun(24, 6, 1),
        absorbed_outer=np.full((24, 1), parts.outer),
        absorbed_middle=np.full((24, 1), parts.middle),
        absorbed_inner=np.full((24, 1), parts.inner),
    )
    room = box(window=window, window_area=0.01, outside="adiabatic", infiltration_ach=0.0, loads=IdealLoads(25.0, 25.0))
    walls = tuple(
        replace(one, outside="known", beyond_c=25.0, layers=(Layer(0.01, 400.0, 0.0, 0.0),)) for one in room.surfaces
    )
    options = BalanceOptions(
        outside_convection="constant", warm_days=400, warm_tolerance=1e-7, tolerance=1e-7, iterations=50
    )
    result = simulate(replace(room, surfaces=walls), climate(24, outdoor=10.0), light, options=options)
    assert np.abs(result.residual).max() < 1e-6
    seen = 0.0 if exterior else data.shade.pane_weight
    shade, pane = balance.faces_c[-1], balance.faces_c[-3]
    # of two temperatures the mean, where longwave has that of their fourth powers
    face, apart = (1.0 - seen) * shade + seen * pane, 0.02 * seen * abs(pane - shade)
    assert result.window_inner_c[-1, 0] == pytest.approx(face, abs=0.1 + apart)
    assert result.window_outer_c[-1, 0] == pytest.approx(balance.faces_c[0], abs=0.1)
    heat = sum(result.heat_flow[name][-1] for name in ("windows", "glass sun", "inside sun"))
    assert heat / 0.01 == pytest.approx(balance.heat_in, abs=0.01 * sum(absorbed) + 0.3)


def test_slats_pass_the_view_factor_of_their_openings():
    layer = venetian_layer(0.02, 0.02, 0.0, emissivity=(1.0, 1.0))
    assert layer.infrared_transmittance == pytest.approx(np.sqrt(2) - 1, abs=1e-12)
    shut = venetian_layer(0.02, 0.02, 89.9)
    assert shut.infrared_transmittance < 2e-3
    assert shut.emissivity[0] == pytest.approx(0.9, abs=2e-3)
    mixed = venetian_layer(0.02, 0.02, 60.0, emissivity=(0.9, 0.1))
    # tilt lowers the outer edge: outdoors sees the upper sides, the room the lower ones
    assert mixed.emissivity[0] > mixed.emissivity[1] + 0.2


def test_sheets_pass_what_they_leave_open():
    thin = perforated_layer(0.001, 0.002, thickness=2e-6)
    assert thin.infrared_transmittance == pytest.approx(np.pi / 16, rel=5e-3)
    assert woven_layer(1e-6, 0.002).infrared_transmittance == pytest.approx(1.0, abs=2e-3)
    assert sheet_layer(0.0).openings == Openings()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: GlazingUnit((CLEAR, LOW_E)), "2 layers, 0 gaps"),
        (lambda: GlazingUnit((SHADE,)), "no pane"),
        (lambda: GasGap(0.016, (("argon", 0.9),)), "fractions sum to 0.9"),
        (lambda: GasGap(0.016, (("neon", 1.0),)), "'neon' is not of"),
        (lambda: GlazingLayer(0.006, 1.0, (0.9, 0.9), 0.2), "absorbs and passes 1.1"),
    ],
)
def test_what_is_no_glazing_is_refused(make, words):
    with pytest.raises(ThermalInputError, match=words):
        make()


# -- WINDOW's engine ------------------------------------------------------------------------------


def engine_pane(tau, front, back, emissivity, coated):
    """A pane of 6 mm with the same values at all wavelengths."""
    import pywincalc

    kind = pywincalc.MaterialType.COATED if coated else pywincalc.MaterialType.MONOLITHIC
    side = pywincalc.CoatedSide.FRONT if coated else pywincalc.CoatedSide.NEITHER
    spectrum = [pywincalc.WavelengthData(w, tau, front, back) for w in (0.3, 1.0, 2.5)]
    optical = pywincalc.ProductDataOpticalNBand(kind, 0.006, spectrum, side, 0.0, 0.0, *emissivity)
    return pywincalc.ProductDataOpticalAndThermal(optical, pywincalc.ProductDataThermal(0.9, 0.006))


def engine_system(unit, solid, conditions, shade_openness=0.02):
    """The unit in WINDOW's engine; its panes are clear and low-e, its shade grey."""
    import pywincalc

    def gap(one):
        kinds = {"air": pywincalc.PredefinedGasType.AIR, "argon": pywincalc.PredefinedGasType.ARGON}
        gas = pywincalc.create_gas([(share, kinds[name]) for name, share in one.gas])
        return pywincalc.Layers.gap(thickness=one.width, gas=gas)

    def environment(one, sun):
        free = one.convection is None
        model = pywincalc.BoundaryConditionsCoefficientModelType
        kelvin = one.air_c + 273.15
        return pywincalc.Environment(
            air_temperature=kelvin,
            pressure=101325.0,
            convection_coefficient=0.0 if free else one.convection,
            coefficient_model=model.CALCULATED_H if free else model.HC_PRESCRIBED,
            radiation_temperature=kelvin,
            emissivity=1.0,
            direct_solar_radiation=sun,
        )

    return pywincalc.GlazingSystem(
        solid_layers=solid,
        gap_layers=[gap(one) for one in unit.gaps],
        width_meters=unit.width,
        height_meters=unit.height,
        tilt_degrees=unit.tilt_deg,
        environment=pywincalc.Environments(
            environment(conditions.outdoor, conditions.sun), environment(conditions.indoor, 0.0)
        ),
    )


def engine_layers(unit):
    import pywincalc

    made = []
    for layer in unit.layers:
        if layer.openings is None:
            coated = layer is LOW_E
            values = (0.600, 0.220, 0.170) if coated else (0.775, 0.071, 0.071)
            made.append(engine_pane(*values, layer.emissivity, coated))
            continue
        o, grey = layer.openings, (0.1, 0.1, 0.55, 0.55) * 2
        optical = pywincalc.ProductDataOpticalDualBandHemispheric(
            *grey, layer.thickness, 0.0, 0.0, *layer.emissivity, o.front, False
        )
        edges = (o.top, o.bottom, o.left, o.right)
        heat = pywincalc.ProductDataThermal(layer.conductivity, layer.thickness, False, *edges)
        made.append(pywincalc.ProductDataOpticalAndThermal(optical, heat))
    return made


TRIPLE = GlazingUnit((CLEAR, CLEAR, LOW_E), (SEALED, GasGap(0.012)), height=1.0)
UNITS = {
    "single": GlazingUnit((CLEAR,)),
    "double": DOUBLE,
    "triple": TRIPLE,
    "roof": replace(DOUBLE, tilt_deg=30.0),
    "external": shaded("external"),
    "internal": shaded("internal", width=0.1),
}


@pytest.mark.peer
@pytest.mark.parametrize("name", UNITS)
@pytest.mark.parametrize("conditions", [NFRC[0], prescribed(0.0, 20.0), prescribed(-25.0, 5.0)])
def test_u_and_temperatures_are_those_of_windows_engine(name, conditions):
    pywincalc = pytest.importorskip("pywincalc")
    unit = UNITS[name]
    system = engine_system(unit, engine_layers(unit), conditions)
    faces = np.array(system.layer_temperatures(pywincalc.TarcogSystemType.U)) - 273.15
    assert iso15099_u_value(unit, conditions) == pytest.approx(system.u(), rel=1e-3)
    np.testing.assert_allclose(unit_balance(unit, conditions).faces_c, faces, atol=0.05)


@pytest.mark.peer
@pytest.mark.parametrize("name", sorted(set(UNITS) - {"roof"}))  # the engine's tilt: see below
@pytest.mark.parametrize("conditions", [NFRC[1], prescribed(25.0, 24.0, 500.0)])
def test_g_is_that_of_windows_engine_for_its_absorptances(name, conditions):
    """Of upright units: below a hot roof pane the gas rests, but the engine lets it rise."""
    pywincalc = pytest.importorskip("pywincalc")
    unit = UNITS[name]
    system = engine_system(unit, engine_layers(unit), conditions)
    optics = system.optical_method_results("SOLAR", 0.0, 0.0)
    alpha = np.array([layer.front.absorptance.total_direct for layer in optics.layer_results])
    through = optics.system_results.front.transmittance
    tau = through.direct_direct + through.direct_diffuse
    g = iso15099_g_values(unit, conditions, np.array([tau]), alpha[None, :])[0]
    assert g == pytest.approx(system.shgc(0.0, 0.0), abs=1e-3)
    faces = system.layer_temperatures(pywincalc.TarcogSystemType.SHGC, 0.0, 0.0)
    ours = unit_balance(unit, conditions, alpha * conditions.sun).faces_c
    np.testing.assert_allclose(ours, np.array(faces) - 273.15, atol=0.05)


@pytest.mark.peer
def test_longwave_of_blinds_and_fabrics_is_that_of_windows_engine(real_data):
    """The engine adds up Klems directions: exact view factors differ by up to 0.013."""
    pywincalc = pytest.importorskip("pywincalc")
    products = real_data / "bsdf" / "products_spectral"
    slat = pywincalc.parse_json_file(str(products / "pella_white_venetian_blind_slat.json"))
    thick, standard = slat.thickness / 1000, pywincalc.load_standard()
    hole = pywincalc.PerforatedGeometry.Type.CIRCULAR
    pairs = [
        (
            pywincalc.create_venetian_blind(pywincalc.VenetianGeometry(tilt, 0.0148, 0.0127, 0.0), slat),
            venetian_layer(0.0148, 0.0127, tilt, slat_thickness=thick),
        )
        for tilt in (0.0, 30.0, 45.0, 70.0)
    ]
    woven = pywincalc.WovenGeometry(0.0005, 0.001, 0.001)
    pairs.append((pywincalc.create_woven_shade(woven, slat), woven_layer(0.0005, 0.001)))
    screen = pywincalc.PerforatedGeometry(0.002, 0.002, 0.0005, 0.0005, hole)  # its radius
    ours = perforated_layer(0.001, 0.002, thickness=thick)
    pairs.append((pywincalc.create_perforated_screen(screen, slat), ours))
    for product, layer in pairs:
        theirs = pywincalc.calc_thermal_ir(standard, product)
        passed = theirs.transmittance_front_diffuse_diffuse
        assert layer.infrared_transmittance == pytest.approx(passed, abs=0.013)
        assert layer.emissivity[0] == pytest.approx(theirs.emissivity_front_hemispheric, abs=0.013)


@pytest.mark.peer
def test_reference_glazing_comes_out_of_its_layers():
    data = iso15099_data(DOUBLE)
    stored = json.loads((WINDOW_GLAZING / "blackbox_dgu.json").read_text())
    # the same layers in WINDOW's engine
    assert data.u_value == pytest.approx(stored["U"][0]["U"], rel=1e-3)
    assert data.r_inner == pytest.approx(stored["U"][0]["R_i"], rel=1e-3)
    points = json.loads((WINDOW_GLAZING / "blackbox_R.json").read_text())["dgu"]
    outer, inner, resistance = (np.array([point[key] for point in points]) for key in ("Tso", "Tsi", "R"))
    table = data.resistance.at(0.5 * (inner + outer), inner - outer)
    np.testing.assert_allclose(table, resistance, rtol=2.5e-3)  # 1/R linear between points 2 K apart
