"""The EnergyPlus model of a study holds what the balance has, face by face and hour by hour."""

from __future__ import annotations

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from bim.energyplus_twin import FILE, EnergyPlusTwin, TwinAir, TwinRoom
from bim.energyplus_windows import AIR, TYPICAL, WindowOptics, complex_state
from bim.model import Building
from bim.shoebox import WindowRectangle, shoebox
from bim.to_thermal import thermal_room
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.errors import DataError
from thermal.blackbox import Fenestration, LayerAbsorptances
from thermal.climate import Climate
from thermal.emitters import IdealLoads
from thermal.glazing_unit import GasGap, GlazingLayer, GlazingUnit, Openings
from thermal.zone import Gains

HOURS = 8760
WINDOW = WindowRectangle(0.5, 0.9, 2.0, 1.5, frame=0.06)
PRESENT = np.resize(np.repeat([0.0, 1.0, 0.0], [8, 10, 6]), HOURS)
GROUND = 10.0 + 5.0 * np.sin(np.arange(HOURS) / HOURS * 2 * np.pi)
FLOOR_OF = {"floor": "ground"}


def optics(seed: int = 0) -> WindowOptics:
    """A system of whose matrices no two entries are alike."""
    random = np.random.default_rng(seed)
    size = KLEMS_FULL.size
    blocks = [random.uniform(0.0, 0.1, (size, size)) for _ in range(4)]
    data = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, *blocks)
    absorbed = LayerAbsorptances(np.linspace(0.1, 0.2, size), np.linspace(0.02, 0.01, size), 0.0)
    return WindowOptics(data, data, Fenestration("system", 1.1), absorbed, 0.25)


def climate(hours: int = HOURS) -> Climate:
    flat = np.zeros(hours)
    return Climate(flat, flat - 10.0, flat + 2.0, flat, np.resize(GROUND, hours), flat + 1e5)


def room(states: int = 1) -> tuple[Building, TwinRoom]:
    building = shoebox(4, 5, 3, windows=[WINDOW], adjacency=FLOOR_OF)
    (space,) = building.spaces
    found = thermal_room(
        space,
        Fenestration("system", 1.1),
        gains=Gains(convective=100.0 * PRESENT, radiant=50.0),
        loads=IdealLoads(heating_c=16.0 + 5.0 * PRESENT, heating_limit=900.0),
    )
    one, systems = found.zone.surfaces[0], [optics(j) for j in range(states)]
    painted = replace(one, absorptance_out=0.31, roughness="smooth")
    found = replace(found, zone=replace(found.zone, surfaces=(painted, *found.zone.surfaces[1:])))
    state = np.minimum(PRESENT.astype(int), states - 1)
    return building, TwinRoom(space, found, {space.windows[0].guid: systems}, state[:, None])


def twin(states: int = 1) -> tuple[EnergyPlusTwin, TwinRoom]:
    building, one = room(states)
    return EnergyPlusTwin(building, [one], climate()), one


def ring(entry: dict) -> np.ndarray:
    return np.array([list(corner.values()) for corner in entry["vertices"]])


def area(entry: dict) -> float:
    corners = ring(entry)
    total = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    return 0.5 * float(np.linalg.norm(total))


def outer_and_inner(model: dict, entry: dict) -> tuple[dict, dict]:
    """The materials at the two faces of a surface."""
    layers = list(model["Construction"][entry["construction_name"]].values())
    known = model["Material"] | model["Material:NoMass"]
    return known[layers[0]], known[layers[-1]]


def test_each_face_keeps_its_area_and_its_own_absorptance():
    found, one = twin()
    for index, surface in enumerate(one.zone.surfaces):
        mine = [
            entry
            for name, entry in found.model["BuildingSurface:Detailed"].items()
            if f"{name}.".startswith(f"Z0 {one.zone.name} S{index}.")
        ]
        if not mine:
            assert surface.name.startswith("window frame")
            continue
        assert sum(map(area, mine)) == pytest.approx(surface.area, rel=1e-3)
        outer, inner = outer_and_inner(found.model, mine[0])
        assert inner["solar_absorptance"] == pytest.approx(surface.absorptance_in)
        if surface.outside == "outdoor":
            assert outer["solar_absorptance"] == pytest.approx(surface.absorptance_out)
            assert outer["roughness"] == surface.roughness.title().replace(" ", "")
        for entry in mine:
            corners = ring(entry)
            out = np.cross(corners[1] - corners[0], corners[2] - corners[1])
            assert out @ surface.normal > 0


def test_the_ground_has_the_balance_s_temperature(tmp_path):
    found, _ = twin()
    (floor,) = [entry for entry in found.model["BuildingSurface:Detailed"].values() if entry["surface_type"] == "Floor"]
    assert floor["outside_boundary_condition"] == "OtherSideCoefficients"
    beyond = found.model["SurfaceProperty:OtherSideCoefficients"]
    (schedule,) = {one["constant_temperature_schedule_name"] for one in beyond.values()}
    found.write(tmp_path)
    column = found.model["Schedule:File"][schedule]["column_number"] - 1
    with (tmp_path / FILE).open(newline="") as stream:
        rows = list(csv.reader(stream))[1:]
    assert len(rows) == HOURS
    assert np.allclose([float(row[column]) for row in rows], GROUND, atol=1e-3)
    assert json.loads((tmp_path / "model.epJSON").read_text()) == found.model


def test_gains_set_points_and_limits_are_those_of_the_hours():
    found, one = twin()
    columns, model = found.schedules.columns, found.model
    name = f"Z0 {one.zone.name}"
    assert np.array_equal(columns[f"{name} convective W"], 100.0 * PRESENT)
    assert np.array_equal(columns[f"{name} heating C"], 16.0 + 5.0 * PRESENT)
    radiant = model["OtherEquipment"][f"{name} radiant"]
    assert radiant["fraction_radiant"] == 1.0
    assert model["Schedule:Constant"][radiant["schedule_name"]]["hourly_value"] == 50.0
    (plant,) = model["ZoneHVAC:IdealLoadsAirSystem"].values()
    assert plant["maximum_sensible_heating_capacity"] == 900.0
    assert "cooling_limit" not in plant


def panes() -> GlazingUnit:
    """Two panes of which no two numbers are alike."""
    outer = GlazingLayer(0.004, 0.9, (0.81, 0.82))
    inner = GlazingLayer(0.006, 1.0, (0.05, 0.83))
    return GlazingUnit((outer, inner), (GasGap(0.014, (("argon", 0.85), ("air", 0.15))),))


def test_two_known_panes_are_written_with_their_gas():
    model: dict = {}
    complex_state(model, "glass", replace(optics(), unit=panes()), panes=True)
    state = model["Construction:ComplexFenestrationState"]["glass"]
    outer, inner = (model["WindowMaterial:Glazing"][state[key]] for key in ("outside_layer_name", "layer_2_name"))
    assert "layer_3_name" not in state
    assert (outer["thickness"], inner["thickness"]) == (0.004, 0.006)
    assert outer["back_side_infrared_hemispherical_emissivity"] == 0.82
    assert inner["front_side_infrared_hemispherical_emissivity"] == 0.05
    gap = model["WindowMaterial:Gap"][state["gap_1_name"]]
    mixture = model["WindowMaterial:GasMixture"][gap["gas_or_gas_mixture_"]]
    assert gap["thickness"] == 0.014
    assert (mixture["gas_1_type"], mixture["gas_1_fraction"]) == ("Argon", 0.85)
    assert (mixture["gas_2_type"], mixture["gas_2_fraction"]) == ("Air", 0.15)
    assert model["Matrix:TwoDimension"]["glass layer 2 back"]["values"][0]["value"] == 0.25


def test_panes_among_states_or_behind_a_shade_are_a_resistance():
    shade = GlazingLayer(0.0005, 0.15, (0.9, 0.9), openings=Openings(top=0.1))
    shaded = GlazingUnit((shade, *panes().layers), (GasGap(0.1), *panes().gaps))
    one = replace(optics(), unit=panes())
    for name, system, alone in (("switched", one, False), ("shade", replace(one, unit=shaded), True)):
        model: dict = {}
        complex_state(model, name, system, panes=alone)
        assert "layer_4_name" in model["Construction:ComplexFenestrationState"][name]
        assert "WindowMaterial:GasMixture" not in model


def test_a_window_has_its_matrices_and_the_resistance_of_the_blackbox():
    found, _ = twin()
    model, system = found.model, optics()
    ((_, state),) = model["Construction:ComplexFenestrationState"].items()
    matrices = {
        name: np.array([v["value"] for v in one["values"]]).reshape(one["number_of_rows"], -1)
        for name, one in model["Matrix:TwoDimension"].items()
    }
    front = matrices[state["solar_optical_complex_front_transmittance_matrix_name"]]
    assert np.allclose(front, system.solar.transmission_front, rtol=1e-6)  # a row: one outgoing
    back = matrices[state["solar_optical_complex_back_reflectance_matrix_name"]]
    assert np.allclose(back, system.solar.reflection_back, rtol=1e-6)
    outer = matrices[state["outside_layer_directional_front_absorptance_matrix_name"]]
    assert np.allclose(outer, system.absorptances.outer, rtol=1e-6)
    gaps = [model["WindowMaterial:Gap"][v]["thickness"] for k, v in state.items() if "gap_" in k]
    resistance = system.fenestration.layer_resistance.at(*TYPICAL)
    assert sum(gaps) / AIR == pytest.approx(float(resistance))
    assert max(gaps) < 0.01  # air does not flow in it
    basis = matrices[state["basis_matrix_name"]]
    assert basis[:, 1].sum() == KLEMS_FULL.size
    assert basis[-1, 0] == pytest.approx(82.5)


def test_shading_states_follow_their_hours():
    one_state, _ = twin()
    assert "EnergyManagementSystem:Sensor" not in one_state.model
    found, one = twin(states=2)
    assert len(found.model["Construction:ComplexFenestrationState"]) == 2
    (sensor,) = found.model["EnergyManagementSystem:Sensor"].values()
    schedule = sensor["output_variable_or_output_meter_index_key_name"]
    assert np.array_equal(found.schedules.columns[schedule], one.state[:, 0])


def coupled() -> EnergyPlusTwin:
    """Two rooms, the right wall of one the left wall of the other."""
    building, one = room()
    sides = {face.name: k for k, face in enumerate(one.space.faces)}
    rooms = []
    for name, side, other in (("a", "right", "b"), ("b", "left", "a")):
        mine, partner = (
            one.zone.surfaces[one.room.surface_of_face[sides[s]]]
            for s in (side, {"left": "right", "right": "left"}[side])
        )
        surfaces = tuple(replace(s, outside=other, partner=partner.name) if s is mine else s for s in one.zone.surfaces)
        zone = replace(one.zone, name=name, surfaces=surfaces)
        rooms.append(replace(one, room=replace(one.room, zone=zone)))
    air = TwinAir(np.array([[0.0, 0.03], [0.03, 0.0]]))
    return EnergyPlusTwin(building, rooms, climate(), air=air)


def test_the_faces_of_a_shared_wall_name_each_other_and_turn_its_layers_round():
    model = coupled().model
    walls = model["BuildingSurface:Detailed"]
    shared = {n: w for n, w in walls.items() if w["outside_boundary_condition"] == "Surface"}
    (a, first), (b, second) = shared.items()
    assert first["outside_boundary_condition_object"] == b
    assert second["outside_boundary_condition_object"] == a
    there, back = (list(model["Construction"][w["construction_name"]].values()) for w in (first, second))
    assert there == back[::-1]
    assert area(first) == pytest.approx(area(second))
    mixing = list(model["ZoneMixing"].values())
    assert {m["source_zone_or_space_name"] for m in mixing} == {"Z0 a", "Z1 b"}
    flow = mixing[0]["schedule_name"]
    assert model["Schedule:Constant"][flow]["hourly_value"] == 0.03


def test_a_part_of_a_year_is_refused():
    building, one = room()
    with pytest.raises(DataError, match="takes a year"):
        EnergyPlusTwin(building, [one], climate(48))
