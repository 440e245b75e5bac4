"""honeybee models as buildings."""

from __future__ import annotations

import json

import numpy as np
import pytest

import bim
from bim.building_file import read_building_file
from bim.honeybee.building import read_honeybee
from bim.shell import open_edges
from mitsuba_cfs.errors import DataError
from tests.bim.bim_fuzz import mutations, odd_values, refusals
from tests.bim.honeybee_models import two_rooms, write
from tests.issues import of_code
from thermal.glazing_unit import Environment, GlazingLayer, GlazingUnit
from thermal.iso15099 import Conditions, iso15099_g_values, iso15099_u_value


@pytest.fixture
def building(tmp_path):
    return read_honeybee(write(two_rooms(), tmp_path))


def test_rooms_have_their_areas_and_volumes(building):
    """By hand: 5 x 8 and 4 x 8 m, 3 m high."""
    office, hall = building.spaces
    assert (office.floor_area, hall.floor_area) == pytest.approx((40, 32), rel=1e-9)
    assert (office.volume, hall.volume) == pytest.approx((120, 96), rel=1e-9)
    assert not open_edges(office.shell) and not open_edges(hall.shell)
    assert building.account.verdict == "usable"


def test_windows_look_out_and_state_their_construction(building):
    (window,) = building.space("Office").windows
    (door,) = building.space("Hall").windows
    assert (window.area, door.area) == pytest.approx((4.5, 2.0))
    np.testing.assert_allclose(window.normal, [0, -1, 0], atol=1e-12)
    assert (window.u_value, window.g_value, window.visible_transmittance) == (1.1, 0.5, 0.7)


def test_faces_have_layers_neighbours_and_modifiers(building):
    office = building.space("Office")
    south = next(f for f in office.faces if f.name == "Office_south")
    names = [layer.name for layer in south.construction.layers]
    assert names == ["Brick", "Wool", "Board"]  # the outermost first
    assert south.construction.layers[1].resistance == pytest.approx(3.0)
    assert south.area == pytest.approx(5 * 3 - 4.5)
    # Radiance's plastic: 0.45 (1 - 0.02) of light is diffuse, less its rise with the angle, which
    # adds under 0.001 at normal incidence; of the sun what the board leaves
    assert south.reflectance_visible == pytest.approx(0.45 * 0.98, abs=1e-3)
    assert south.reflectance_solar == pytest.approx(0.7)
    assert south.emissivity == 0.85
    leaf = next(f for f in office.faces if f.kind == "door")
    assert (leaf.adjacency, leaf.neighbour, leaf.area) == ("space", "Hall", pytest.approx(2.0))


def test_what_stands_outdoors_is_the_building_itself_and_its_shades(building):
    names = {element.name for element in building.elements}
    assert {"Overhang", "Window", "Hall_south", "Office_ceiling"} <= names
    assert "Office_floor" not in names  # on the ground
    assert "Office_east" not in names  # between two rooms


def test_feet_are_metres(tmp_path):
    model = two_rooms() | {"units": "Feet"}
    (office, _) = read_honeybee(write(model, tmp_path)).spaces
    assert office.floor_area == pytest.approx(40 * 0.3048**2)


def test_faces_drawn_inside_out_are_turned(tmp_path):
    model = two_rooms()
    model["rooms"][0]["faces"][4]["geometry"]["boundary"].reverse()
    found = read_honeybee(write(model, tmp_path))
    assert found.space("Office").volume == pytest.approx(120)
    assert of_code(found, "polygons-inside-out")


def test_rooms_open_to_each_other_become_one(tmp_path):
    model = two_rooms()
    for room, face in ((0, 1), (1, 3)):
        model["rooms"][room]["faces"][face] |= {"face_type": "AirBoundary", "doors": None}
    path = write(model, tmp_path)
    apart = read_honeybee(path)
    assert of_code(apart, "room-boundary-open")
    (one,) = read_honeybee(path, join=["Office + Hall"]).spaces
    assert (one.floor_area, one.volume, len(one.windows)) == pytest.approx((72, 216, 2))
    assert not open_edges(one.shell)


def test_a_hole_in_a_window_is_wall(tmp_path):
    """By hand: 3 x 1.5 m of glass around 1 x 0.5 m of wall; the room stays closed."""
    model = two_rooms()
    geometry = model["rooms"][0]["faces"][0]["apertures"][0]["geometry"]
    geometry["holes"] = [[[2, 0, 1.2], [3, 0, 1.2], [3, 0, 1.7], [2, 0, 1.7]]]
    found = read_honeybee(write(model, tmp_path))
    office = found.space("Office")
    assert [window.area for window in office.windows] == pytest.approx([4.0])
    walls = sum(f.area for f in office.faces if f.name.startswith("Office_south"))
    assert walls == pytest.approx(15 - 4.0)
    assert not open_edges(office.shell)
    assert (found.account.glass_used, found.account.glass_out) == pytest.approx((6.0, 6.0))


def test_a_window_beside_its_wall_is_lost_and_said(tmp_path):
    model = two_rooms()
    for point in model["rooms"][0]["faces"][0]["apertures"][0]["geometry"]["boundary"]:
        point[1] -= 0.5
    found = read_honeybee(write(model, tmp_path))
    assert not found.space("Office").windows
    (lost,) = [p for p in found.issues if p.effect.lost == "window"]
    assert lost.effect.glass == pytest.approx(4.5)
    assert found.account.glass_used == pytest.approx(2.0)


def test_panes_and_gaps_give_u_and_g(tmp_path):
    """Clear double glazing 6-12.7-6: tau by hand, U as honeybee-energy 1.126 has it.

    It gives 2.717 W/(m2 K) for glass 1 m high (here 1.5 m, which is 1.5 % of U) and with its own
    simpler balance: 3 %.  A coating counts where it faces the gap, and not where it faces outdoors.
    """
    model = two_rooms()
    pane = {
        "type": "EnergyWindowMaterialGlazing",
        "identifier": "Clear",
        "thickness": 0.006,
        "solar_transmittance": 0.77,
        "solar_reflectance": 0.07,
        "visible_transmittance": 0.88,
        "visible_reflectance": 0.08,
        "conductivity": 1.0,
    }
    gap = {"type": "EnergyWindowMaterialGas", "identifier": "Gap", "thickness": 0.0127}
    default = model["properties"]["energy"]["global_construction_set"]
    default["materials"] += [pane, gap]
    default["constructions"][2]["materials"] = ["Clear", "Gap", "Clear"]
    (window,) = read_honeybee(write(model, tmp_path)).space("Office").windows
    assert window.visible_transmittance == pytest.approx(0.88**2 / (1 - 0.08**2))
    assert window.solar_transmittance == pytest.approx(0.77**2 / (1 - 0.07**2))
    assert window.u_value == pytest.approx(2.717, rel=0.03)
    assert window.panes == 2
    assert 0.596 + 0.05 < window.g_value < 0.596 + 0.16  # of 0.28 absorbed, less than half comes in
    u_values = []
    for side in ("emissivity_back", "emissivity"):
        coated = pane | {"identifier": "Low-e", side: 0.05}
        default["materials"] = [*default["materials"], coated]
        default["constructions"][2]["materials"] = ["Low-e", "Gap", "Clear"]
        (window,) = read_honeybee(write(model, tmp_path)).space("Office").windows
        u_values.append(window.u_value)
    assert u_values[0] < 1.9 and u_values[1] > 2.4


def used_rooms() -> dict:
    """The rooms in centimetres with sensors, views, a use, states of a shade."""
    model = two_rooms()
    model["units"] = "Centimeters"
    energy, radiance = (model["properties"][name] for name in ("energy", "radiance"))
    energy["program_types"] = [{"type": "ProgramTypeAbridged", "identifier": "Office"}]
    model["rooms"][0]["properties"]["energy"]["program_type"] = "Office"
    sensors = [{"pos": [1, 1, 0.8], "dir": [0, 0, 1]}] * 7
    radiance["sensor_grids"] = [{"identifier": "desks", "sensors": sensors}]
    radiance["views"] = [
        {
            "identifier": "desk",
            "position": [200, 300, 120],
            "direction": [0, -1, 0],
            "view_type": "a",
            "h_size": 180,
            "v_size": 180,
        },
        {"identifier": "nowhere", "position": [1, None, "x"]},
    ]
    states = [{"modifier": "a"}, {"modifier": "b"}]
    shade = model["rooms"][0]["faces"][0]["apertures"][0]["outdoor_shades"][0]
    shade["properties"]["radiance"]["states"] = states
    shade["properties"]["energy"]["transmittance_schedule"] = "Tree"
    return model


def test_sensors_and_views_come_along_and_what_is_not_used_is_named(tmp_path):
    model = used_rooms()
    found = read_honeybee(write(model, tmp_path))
    (grid,), (view,) = found.grids, found.views
    assert (grid.name, len(grid.points)) == ("desks", 7)
    np.testing.assert_allclose(grid.points, np.tile([0.01, 0.01, 0.008], (7, 1)))
    np.testing.assert_allclose(grid.directions, np.tile([0.0, 0.0, 1.0], (7, 1)))
    assert (view.name, view.view.kind, view.view.horizontal_deg) == ("desk", "angular", 180)
    np.testing.assert_allclose(view.view.position, [2.0, 3.0, 1.2])
    np.testing.assert_allclose(view.view.direction, [0, -1, 0], atol=1e-12)
    unused = {i.code: i.values for i in found.issues if i.severity == "unused"}
    assert unused["view-unreadable"] == {"view": "nowhere"}
    assert unused["shades-with-states"] == {"count": 1, "shades": ("Overhang",)}
    assert unused["shades-by-schedule"] == {"count": 1, "shades": ("Overhang",)}


def test_states_of_glass_are_states_of_the_window(tmp_path):
    """By hand: a pane of n = 1.52 and transmissivity t passes (1 - F)^2 t / (1 - F^2 t^2)."""
    model = two_rooms()
    modifiers = model["properties"]["radiance"]["modifiers"]
    for name, t in (("clear", 0.9), ("dark", 0.2)):
        modifiers.append(
            {"type": "Glass", "identifier": name, "refraction_index": 1.52} | {f"{c}_transmissivity": t for c in "rgb"}
        )
    window = model["rooms"][0]["faces"][0]["apertures"][0]
    window["properties"]["radiance"] = {
        "modifier": "clear",
        "dynamic_group_identifier": "south",
        "states": [{}, {"modifier": "dark"}, {"modifier": "paint"}],
    }
    building = read_honeybee(write(model, tmp_path))
    (found,) = building.space("Office").windows
    assert [state.name for state in found.states] == ["", "dark"]
    f = (0.52 / 2.52) ** 2
    for state, t in zip(found.states, (0.9, 0.2), strict=True):
        passed = (1 - f) ** 2 * t / (1 - f**2 * t**2)
        assert state.angular.transmitted(0.0) == pytest.approx(passed, rel=1e-9)
        through = (one := state.bands["Visible"]).direct_hemispherical(one.transmission_front)[0]
        assert through == pytest.approx(passed, rel=2e-3)  # mean of a patch of 5 degrees
        assert state.u_value == 1.1
    assert found.states[0].g_normal == 0.5 and found.states[1].g_normal is None
    (lost,) = of_code(building, "states-not-optical")
    assert lost.values == {"element": "Window", "count": 1}


def test_u_is_of_nfrcs_winter_and_g_of_its_summer(tmp_path):
    """NFRC 100: -18 and 21 degC, 5.5 m/s; NFRC 200: 32 and 24 degC, 2.75 m/s, 783 W/m2."""
    model = two_rooms()
    pane = {
        "type": "EnergyWindowMaterialGlazing",
        "identifier": "Clear",
        "thickness": 0.006,
        "solar_transmittance": 0.6,
        "solar_reflectance": 0.1,
        "conductivity": 1.0,
    }
    default = model["properties"]["energy"]["global_construction_set"]
    default["materials"] += [pane]
    default["constructions"][2]["materials"] = ["Clear"]
    (window,) = read_honeybee(write(model, tmp_path)).space("Office").windows
    unit = GlazingUnit((GlazingLayer(0.006, 1.0, (0.84, 0.84)),), (), height=1.5)
    winter = Conditions(Environment(-18.0, 26.0), Environment(21.0, None))
    summer = Conditions(Environment(32.0, 15.0), Environment(24.0, None), 783.0)
    assert window.u_value == pytest.approx(iso15099_u_value(unit, winter), rel=1e-6)
    assert window.g_value == pytest.approx(iso15099_g_values(unit, summer, 0.6, [0.3]), rel=1e-6)
    assert abs(iso15099_u_value(unit, summer) / window.u_value - 1) > 0.05


def test_the_glass_of_a_modifier_goes_before_the_construction(tmp_path):
    model = two_rooms()
    glass = {f"{c}_transmissivity": 0.6975761815 for c in "rgb"}
    model["properties"]["radiance"]["modifiers"].append({"type": "Glass", "identifier": "glass 0.64", **glass})
    window = model["rooms"][0]["faces"][0]["apertures"][0]
    window["properties"]["radiance"] = {"modifier": "glass 0.64"}
    (found,) = read_honeybee(write(model, tmp_path)).space("Office").windows
    assert found.visible_transmittance == pytest.approx(0.64, abs=5e-4)  # as Radiance's trans
    assert found.u_value == 1.1


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda m: m["rooms"][0]["faces"][2].pop("face_type"), "Office_north: face_type"),
        (lambda m: m["rooms"][0]["faces"][0]["geometry"]["boundary"].pop(), None),
        (lambda m: m["rooms"][1]["faces"][1]["geometry"].update(boundary=[[0, 0, 0]]), "Hall_east: geometry.boundary"),
        (
            lambda m: m["rooms"][0]["faces"][0]["geometry"]["boundary"][0].__setitem__(0, "x"),
            "Office_south: geometry.boundary.0.0",
        ),
        (lambda m: m.update(units="Parsecs"), "two_rooms: units"),
        (lambda m: m.update(type="Room"), "type: expected a honeybee Model"),
        (
            lambda m: m["properties"]["energy"]["global_construction_set"]["materials"][0].update(density=-1),
            "Brick: density: expected a number of at least",
        ),
        (
            lambda m: m["properties"]["energy"]["global_construction_set"]["constructions"][0].update(
                materials=["Straw"]
            ),
            "Wall: materials: no material 'Straw'",
        ),
        (
            lambda m: m["properties"]["energy"]["global_construction_set"]["constructions"][0].update(
                materials=[{"type": "EnergyMaterialNoMass", "r_value": 1.0}]
            ),
            "Wall: materials: expected materials with an identifier",
        ),
        (lambda m: m["properties"]["radiance"]["modifiers"][0].update(r_reflectance="red"), "paint: r_reflectance"),
    ],
)
def test_faults_are_one_line_with_object_and_field(tmp_path, change, said):
    model = two_rooms()
    change(model)
    path = write(model, tmp_path)
    if said is None:
        read_honeybee(path)
        return
    with pytest.raises(DataError) as caught:
        read_honeybee(path)
    assert str(caught.value).startswith(f"{path}: {said}") and "\n" not in str(caught.value)


def test_a_bsdf_comes_along(tmp_path):
    from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
    from mitsuba_cfs.bsdf.glazing import Glazing, specular_klems
    from mitsuba_cfs.bsdf.klems import KLEMS_FULL
    from mitsuba_cfs.bsdf.xml import write_bsdf_xml

    clear = specular_klems(Glazing("clear", 0.6, 0.1, 0.1), KLEMS_FULL)
    write_bsdf_xml(BsdfFile({"Visible": clear, "Solar": clear}), tmp_path / "clear.xml")
    model = two_rooms()
    model["properties"]["radiance"]["modifiers"].append(
        {"type": "BSDF", "identifier": "cfs", "bsdf_data": (tmp_path / "clear.xml").read_text()}
    )
    window = model["rooms"][0]["faces"][0]["apertures"][0]
    window["properties"]["radiance"] = {"modifier": "cfs"}
    (found,) = read_honeybee(write(model, tmp_path)).space("Office").windows
    (state,) = found.states
    assert state.u_value == 1.1 and state.g_normal == 0.5
    np.testing.assert_allclose(state.bands["Visible"].transmission_front, clear.transmission_front, atol=1e-4)


def test_the_suffix_leads_to_it(tmp_path):
    assert len(read_building_file(write(two_rooms(), tmp_path)).spaces) == 2
    assert bim.read_honeybee is read_honeybee


def test_random_bytes_give_one_line(tmp_path):
    whole = json.dumps(two_rooms()).encode()
    path = tmp_path / "spoilt.hbjson"
    refused = refusals(path, mutations(whole, 60), read_honeybee)
    assert refused > 20


def test_odd_values_give_one_line(tmp_path):
    refused = 0
    wrong = used_rooms()  # of which no other field says so
    wrong["properties"]["radiance"]["sensor_grids"][0]["sensors"] = 0.5
    for content in (wrong, *odd_values(used_rooms(), 100)):
        path = write(content, tmp_path)
        try:
            read_honeybee(path)
        except DataError as error:
            refused += 1
            assert "\n" not in str(error)
    assert 10 < refused < 90


def _other_side(model):
    model["rooms"][0]["faces"][2]["boundary_condition"] = {"type": "OtherSideTemperature"}


def _green_roof(model):
    energy = model["properties"]["energy"]["global_construction_set"]
    energy["materials"].append(
        {
            "type": "EnergyMaterialVegetation",
            "identifier": "green",
            "thickness": 0.1,
            "conductivity": 0.35,
            "density": 1100,
            "specific_heat": 1200,
            "soil_solar_absorptance": 0.8,
        }
    )
    roof = {"type": "OpaqueConstructionAbridged", "identifier": "roof", "materials": ["green", "Wool"]}
    energy["constructions"].append(roof)
    model["rooms"][0]["faces"][5]["properties"]["energy"]["construction"] = "roof"


def _trans_wall(model):
    trans = {"type": "Trans", "identifier": "tr", "transmitted_diff": 0.5}
    model["properties"]["radiance"]["modifiers"].append(trans | {f"{c}_reflectance": 0.5 for c in "rgb"})
    model["rooms"][0]["faces"][2]["properties"]["radiance"]["modifier"] = "tr"


def _patterned(model):
    model["properties"]["radiance"]["modifiers"][0]["modifier"] = {"type": "Plastic"}


def _missing_set(model):
    model["rooms"][0]["properties"]["energy"]["construction_set"] = "elsewhere"


def _door_of_glazing(model):
    model["rooms"][0]["faces"][1]["doors"][0]["properties"]["energy"]["construction"] = "Glazing"


def _adiabatic_window(model):
    window = model["rooms"][0]["faces"][0]["apertures"][0]
    window["boundary_condition"] = {"type": "Adiabatic"}


@pytest.mark.parametrize(
    ("change", "code", "value"),
    [
        (_other_side, "boundary-not-computed", "OtherSideTemperature"),
        (_green_roof, "vegetation-not-computed", "green"),
        (_trans_wall, "shade-taken-as-opaque", "tr"),
        (_patterned, "modifier-of-modifier", "plastic"),
        (_missing_set, "value-not-read", "'elsewhere' is not in the file"),
        (_door_of_glazing, "value-not-read", "expected an opaque construction"),
        (_adiabatic_window, "value-not-read", "'Adiabatic' in a face"),
    ],
)
def test_what_is_not_computed_is_named(tmp_path, change, code, value):
    model = two_rooms()
    change(model)
    found = read_honeybee(write(model, tmp_path))
    (issue,) = [one for one in found.issues if one.code == code]
    assert any(value in str(one) for one in issue.values.values())
    assert len(found.spaces) == 2 and len(found.windows) == 2
    if change is _green_roof:
        roof = next(f for f in found.spaces[0].faces if f.name == "Office_ceiling")
        assert [layer.name for layer in roof.construction.layers] == ["green", "Wool"]
        (outer,) = [e for e in found.elements if e.name == "Office_ceiling"]
        assert outer.reflectance_visible == pytest.approx(0.2)
    if change is _trans_wall:  # half of it is transmitted
        wall = next(f for f in found.spaces[0].faces if f.name == "Office_north")
        assert wall.reflectance_visible == pytest.approx(0.25, abs=1e-3)


def test_an_object_in_place_of_a_name_is_read(tmp_path):
    """Files that are not abridged have it; two of one name are refused."""
    model = two_rooms()
    window = model["rooms"][0]["faces"][0]["apertures"][0]["properties"]
    unit = {"type": "EnergyWindowMaterialSimpleGlazSys", "identifier": "dark", "u_factor": 2.0, "shgc": 0.3, "vt": 0.25}
    window["energy"]["construction"] = {"type": "WindowConstruction", "identifier": "dark", "materials": [unit]}
    found = read_honeybee(write(model, tmp_path)).space("Office").windows[0]
    assert (found.u_value, found.g_value, found.visible_transmittance) == (2.0, 0.3, 0.25)
    window["energy"]["construction"]["identifier"] = "Glazing"
    with pytest.raises(DataError, match="another one with this identifier"):
        read_honeybee(write(model, tmp_path))


def test_states_of_a_construction_may_be_named(tmp_path):
    model = two_rooms()
    energy = model["properties"]["energy"]
    energy["constructions"] = [
        {"type": "WindowConstructionDynamicAbridged", "identifier": "dynamic", "constructions": ["Glazing", "Glazing"]}
    ]
    window = model["rooms"][0]["faces"][0]["apertures"][0]["properties"]
    window["energy"]["construction"] = "dynamic"
    found = read_honeybee(write(model, tmp_path)).space("Office").windows[0]
    assert (found.u_value, found.g_value) == (1.1, 0.5)


def test_a_global_set_may_be_named(tmp_path):
    """As in the first versions of the format."""
    model = two_rooms()
    energy = model["properties"]["energy"]
    default = energy.pop("global_construction_set") | {"identifier": "Default"}
    energy |= {key: default.pop(key) for key in ("materials", "constructions")}
    energy |= {"construction_sets": [default], "global_construction_set": "Default"}
    found = read_honeybee(write(model, tmp_path)).space("Office").windows[0]
    assert found.u_value == 1.1


def test_windows_of_one_identifier_are_two_windows(tmp_path):
    """Systems go by the identifier; in one room they became a single window."""
    model = two_rooms()
    windows = model["rooms"][0]["faces"][0]["apertures"]
    other = json.loads(json.dumps(windows[0])) | {"outdoor_shades": []}
    other["geometry"]["boundary"] = [[4.2, 0, 0.9], [4.8, 0, 0.9], [4.8, 0, 2.4], [4.2, 0, 2.4]]
    windows.append(other)
    found = read_honeybee(write(model, tmp_path)).space("Office").windows
    assert [one.area for one in found] == pytest.approx([4.5, 0.9])
    assert len({one.guid for one in found}) == 2


def test_two_rooms_of_one_identifier_are_refused(tmp_path):
    model = two_rooms()
    model["rooms"][1]["identifier"] = "Office"
    with pytest.raises(DataError, match="Office: two rooms have this identifier"):
        read_honeybee(write(model, tmp_path))
