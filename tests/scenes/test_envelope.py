"""What lies beyond a room by its tables, and its air: from TOML to the zone of the balance."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bim.model import Building
from bim.shoebox import WindowRectangle, shoebox
from bim.to_thermal import ThermalRoom, coupled_rooms, thermal_room
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.weather import Weather
from scenes.demo import WEATHER
from scenes.room.ground import default_ground, ground_note
from scenes.room.operation import OperationHours, check_schedules
from scenes.room.operation_tables import OperationTables
from scenes.room.zone import enveloped, glass_edge
from scenes.toml_file import validated
from thermal.blackbox import Fenestration
from thermal.ground import SOILS, Footprint, basement, slab_on_ground
from thermal.zone import Zone

BOX = shoebox(
    4.0,
    5.0,
    3.0,
    windows=(WindowRectangle(0.5, 1.0, 3.0, 1.5, frame=0.1),),
    adjacency={"floor": "ground", "back": "ground", "left": "space"},
)


@pytest.fixture(scope="module")
def weather() -> Weather:
    return read_epw(WEATHER)


def tables_of(text: str) -> OperationTables:
    return OperationTables.model_validate(tomllib.loads(text))


def room_of(text: str, weather: Weather, building: Building = BOX) -> ThermalRoom:
    """The room of a box with the envelope of some tables."""
    space = building.spaces[0]
    plain = thermal_room(space, Fenestration("glass", 1.1))
    return enveloped(plain, building, space, tables_of(text), weather)


def zone_of(text: str, weather: Weather) -> Zone:
    return room_of(text, weather).zone


def surface(zone: Zone, normal: tuple[float, float, float]):
    """The biggest surface that faces so."""
    facing = [s for s in zone.surfaces if s.normal @ np.array(normal) > 0.9]
    return max(facing, key=lambda s: s.area)


DOWN, NORTH = (0, 0, -1), (0, 1, 0)
BASEMENT = """
[envelope.ground]
kind = "basement"
depth = 2.5
area = 100
perimeter = 40
soil = "clay"
"""


def test_basement_puts_soil_below_floor_and_wall(weather) -> None:
    zone = zone_of(BASEMENT, weather)
    before = thermal_room(BOX.spaces[0], Fenestration("glass", 1.1)).zone
    own_floor, own_wall = surface(before, DOWN), surface(before, NORTH)
    place = Footprint(100.0, 40.0, 0.3, SOILS["clay"])
    resistances = [sum(x.resistance for x in one.layers) for one in (own_floor, own_wall)]
    elements = basement(place, *resistances, 2.5)
    for one, element in zip((surface(zone, DOWN), surface(zone, NORTH)), elements, strict=True):
        assert one.outside == "known"
        whole = element.r_si + sum(layer.resistance for layer in one.layers)
        assert whole == pytest.approx(1.0 / element.u_value)
        assert one.beyond_c.mean() == pytest.approx(weather.dry_bulb_c.mean(), abs=0.1)
    warmest = weather.midpoints[int(np.argmax(surface(zone, DOWN).beyond_c))]
    assert warmest.month == 8  # outdoors July; a month later below the floor
    assert len(zone.surfaces) == len(before.surfaces)


def test_slab_takes_the_rooms_own_floor_without_an_area(weather) -> None:
    box = shoebox(4.0, 5.0, 3.0, adjacency={"floor": "ground"})
    text = "[envelope.ground]\nperimeter = 9.0\nsoil = 'clay'\nedge = [0.5, 1.0]\n"
    floor = surface(room_of(text, weather, box).zone, DOWN)
    before = surface(thermal_room(box.spaces[0], Fenestration("glass", 1.1)).zone, DOWN)
    resistance = sum(layer.resistance for layer in before.layers)
    place = Footprint(20.0, 9.0, 0.3, SOILS["clay"])
    element = slab_on_ground(place, resistance, edge=(0.5, 1.0))
    total = 0.17 + sum(layer.resistance for layer in floor.layers)
    assert total == pytest.approx(1.0 / element.u_value)


def test_ground_that_is_not_stated_is_that_of_iso_13370_for_the_building(weather) -> None:
    """Not soil of the open field at the face of the slab: that takes several times the heat.

    Two rooms of 20 m2 with one outer wall of 4 m each; the floor of the upper one is not on the ground."""
    windows = (WindowRectangle(0.5, 1.0, 3.0, 1.5),)
    box = shoebox(4.0, 5.0, 3.0, windows=windows, adjacency={"floor": "ground"})
    upper = shoebox(4.0, 5.0, 3.0, windows=windows).spaces[0]
    building = replace(box, spaces=(box.spaces[0], box.spaces[0], upper))
    floor = surface(room_of("", weather, building).zone, DOWN)
    before = surface(thermal_room(box.spaces[0], Fenestration("glass", 1.1)).zone, DOWN)
    element = slab_on_ground(Footprint(40.0, 8.0, 0.3, SOILS["sand"]), sum(one.resistance for one in before.layers))
    assert floor.outside == "known"
    assert 0.17 + sum(layer.resistance for layer in floor.layers) == pytest.approx(1.0 / element.u_value)
    assert np.mean(floor.beyond_c) == pytest.approx(np.mean(weather.dry_bulb_c), abs=0.05)


def test_a_room_with_walls_in_the_ground_is_a_basement_as_deep_as_these(weather) -> None:
    zone, place = zone_of("", weather), Footprint(20.0, 8.0, 0.3, SOILS["sand"])
    resistances = [
        sum(
            layer.resistance
            for layer in surface(thermal_room(BOX.spaces[0], Fenestration("glass", 1.1)).zone, at).layers
        )
        for at in (DOWN, (0, 1, 0))
    ]
    floor, wall = basement(place, *resistances, 3.0)
    for one, at, film in ((floor, DOWN, 0.17), (wall, NORTH, 0.13)):
        total = film + sum(layer.resistance for layer in surface(zone, at).layers)
        assert total == pytest.approx(1.0 / one.u_value)


def test_an_interior_room_and_some_days_of_weather_keep_undisturbed_soil(weather) -> None:
    inner = shoebox(4.0, 5.0, 3.0, windows=(), adjacency={"floor": "ground"})
    assert default_ground(inner, inner.spaces[0], weather) is None
    box = shoebox(4.0, 5.0, 3.0, windows=(WindowRectangle(0.5, 1.0, 3.0, 1.5),), adjacency={"floor": "ground"})
    assert default_ground(box, box.spaces[0], weather).perimeter == pytest.approx(4.0)
    days = SimpleNamespace(times=weather.times[:48], step_h=1.0)
    assert default_ground(box, box.spaces[0], days) is None


def test_a_neighbour_that_is_stated_below_a_floor_goes_before_the_assumed_ground(weather) -> None:
    """As in ASHRAE 140: 10 degC at the floor's outer face, without soil before it."""
    windows = (WindowRectangle(0.5, 1.0, 3.0, 1.5),)
    box = shoebox(4.0, 5.0, 3.0, windows=windows, adjacency={"floor": "ground"})
    text = '[[envelope.neighbour]]\nfaces = ["floor"]\ntemperature_c = 10.0\nfilm = 0.0\n'
    floor = surface(room_of(text, weather, box).zone, DOWN)
    own = surface(thermal_room(box.spaces[0], Fenestration("glass", 1.1)).zone, DOWN)
    assert sum(layer.resistance for layer in floor.layers) == pytest.approx(sum(one.resistance for one in own.layers))
    assert set(np.unique(floor.beyond_c)) == {10.0}
    tables = validated(OperationTables, tomllib.loads(text), WEATHER)
    assert not ground_note(tables, box) and ground_note(OperationTables(), box)


def test_neighbours_bridges_and_frames(weather) -> None:
    zone = zone_of(
        """
[[envelope.neighbour]]
faces = ["left"]
temperature_c = "corridor"
[[envelope.bridge]]
psi = 0.1
length = 4.0
number = 2
[[envelope.bridge]]
chi = 0.3
[envelope]
frame_u = 1.3
frame_psi = 0.05
[schedules.corridor]
weekday = [{ hours = [8, 18], value = 20 }]
otherwise = 15
""",
        weather,
    )
    west = surface(zone, (-1, 0, 0))
    assert west.outside == "known" and set(np.unique(west.beyond_c)) == {15.0, 20.0}
    assert west.layers[0].resistance == pytest.approx(0.13)
    assert [s.outside for s in zone.surfaces].count("known") == 3  # floor and back are in the ground
    edge = 2 * (2.8 + 1.3)
    assert glass_edge(BOX.spaces[0].windows[0]) == pytest.approx(edge)
    assert zone.bridges == pytest.approx(0.8 + 0.3 + 0.05 * edge)
    frames = [s for s in zone.surfaces if s.name.startswith("window frame")]
    assert frames
    for frame in frames:
        assert sum(x.resistance for x in frame.layers) == pytest.approx(1 / 1.3 - 0.17)


def test_cooled_ceiling_is_the_rooms_own(weather) -> None:
    zone = zone_of("[loads]\ncooling_c = 24\ncooling_radiant = 0.6\ncooling_faces = ['ceiling']\n", weather)
    ceiling = zone.surfaces[zone.index_of(zone.loads.cooling_surface)]
    assert ceiling.normal[2] > 0.9 and zone.loads.heating_surface == ""


def test_known_neighbour_is_not_coupled(weather) -> None:
    """A wall whose far side has a stated temperature stays apart from the room that is there."""
    space = BOX.spaces[0]
    faces = [replace(f, neighbour="other") if f.name == "left" else f for f in space.faces]
    building = replace(BOX, spaces=(replace(space, faces=tuple(faces)),))
    text = "[[envelope.neighbour]]\nfaces = ['left']\ntemperature_c = 12\n"
    one = room_of(text, weather, building)
    other = replace(building.spaces[0], guid="other")
    _, notes = coupled_rooms([building.spaces[0], other], [one, room_of("", weather)])
    assert notes == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[envelope.ground]\nperimeter = 9\n", "a wall below ground needs kind = 'basement'"),
        ("[[envelope.neighbour]]\nfaces = ['lft']\ntemperature_c = 1\n", "no face 'lft'; there"),
        ("[loads.slab]\nfaces = ['roof']\n", "has no face roof"),
        ("[loads]\ncooling_faces = ['roof']\n", "loads.cooling_faces.*has no face roof"),
    ],
)
def test_faults_of_the_envelope_name_their_place(weather, text, words) -> None:
    with pytest.raises(DataError, match=words):
        room_of(text, weather)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("[[envelope.bridge]]\npsi = 1\n", "give either `psi` with its `length`, or `chi`"),
        ("[envelope.ground]\nperimeter = 9\nkind = 'basement'\n", "depth: goes with a basement"),
        ("[envelope.ground]\nperimetre = 9\n", "did you mean perimeter"),
        ("[[envelope.neighbour]]\nfaces = ['x']\ntemperature_c = 'x'\n", "no schedule 'x'"),
        ("[[envelope.neighbour]]\ntemperature_c = 3\n", "name `faces` or `spaces`"),
        ("[air]\ninfiltration_factors = 'doe'\n", "expected four numbers or one of constant"),
        ("[air]\nsupply_c = 18\nheat_recovery = 0.5\n", "supply_c: leaves nothing to recover"),
        ("[air.windows]\nopen_above_c = 20\nclose_below_c = 22\n", "lies above open_above_c"),
        ("[air.leakage]\nstack = 0.1\nwind = 0.1\n", "give either `area_cm2` or `coefficient`"),
        ("[plant]\nheating_cop = [[5, 3], [2, 2]]\n", "by rising outdoor temperature"),
        ("[loads]\nhumidify_to = 60\ndehumidify_to = 50\n", "humidify_to: lies above"),
        ("[air]\nfan_w_m3_s = 20000\n", "expected 0 to 10000 W/(m3/s)"),
    ],
)
def test_faults_of_tables_are_one_line(tmp_path, table, words) -> None:
    with pytest.raises(DataError) as fault:
        validated(OperationTables, tomllib.loads(table), tmp_path / "x.toml")
    assert words in str(fault.value) and "\n" not in str(fault.value)


def test_a_schedule_within_a_table_is_checked_by_its_place(weather, tmp_path) -> None:
    text = "[air.windows]\nshare = 's'\n[schedules.s]\nweekday = 1.5\n"
    with pytest.raises(DataError, match=r"air.windows.share: schedule 's': expected 0 to 1"):
        check_schedules(tables_of(text), weather, tmp_path / "x.toml")


def test_air_of_the_tables_is_that_of_the_zone(weather) -> None:
    hours = OperationHours(
        tables_of(
            """
[gains]
occupied = [9, 17]
persons = 3
vapour_g_h = 20
[air]
infiltration_ach = 0.2
infiltration_factors = "blast"
ventilation_ach = 2
heat_recovery = 0.8
least_supply_c = 16
[air.leakage]
area_cm2 = 300
stack = 0.000145
wind = 0.000174
[air.windows]
share = 0.2
flow = "cross"
when = "occupied"
"""
        ),
        weather,
    )
    air = hours.outdoor_air()
    assert air["leakage"].factors == (0.606, 0.03636, 0.1177, 0.0)
    assert air["leakage"].stack == pytest.approx(0.3 * 0.000145**0.5)
    assert (air["supply"].recovery, air["supply"].least_c) == (0.8, 16.0)
    present = hours.present > 0
    np.testing.assert_array_equal(air["supply"].ach, 2.0 * present)
    np.testing.assert_allclose(hours.vapour(), (3 * 50 + 20) / 3.6e6 * present)
    windows = thermal_room(BOX.spaces[0], Fenestration("glass", 1.1)).zone.windows
    airing = hours.airing(windows, BOX.spaces[0].volume)
    assert airing.both and set(np.unique(airing.share)) == {0.0, 0.2}
    assert airing.wind == 0.0  # all windows in one facade


def test_air_of_a_neighbour_by_its_table(weather: Weather) -> None:
    """A door by its size and hours, a given flow, the temperature of a schedule."""
    hours = OperationHours(
        tables_of(
            """
[[air.neighbour]]
temperature_c = 18
width = 0.9
height = 2.0
open = "door"
[[air.neighbour]]
temperature_c = "corridor"
m3_h = 72
[[air.neighbour]]
temperature_c = 20
m3_h = 0
[schedules.door]
otherwise = 0.0
weekday = [{ hours = [8, 18], value = 1.0 }]
weekend = 0.0
[schedules.corridor]
weekday = [{ hours = [0, 24], value = 21.0 }]
weekend = 15.0
"""
        ),
        weather,
    )
    door, given, tight = hours.outdoor_air()["beside"]
    assert door.buoyant == pytest.approx(0.65 / 3 * 0.9 * np.sqrt(9.81 * 2.0**3))
    assert (door.beside_c, door.flow) == (18.0, 0.0)
    assert 0.25 < np.mean(door.share) < 0.35 and set(np.unique(door.share)) == {0.0, 1.0}
    assert (given.buoyant, given.flow) == (0.0, 0.02)
    assert set(np.unique(given.beside_c)) == {15.0, 21.0}
    assert (tight.buoyant, tight.flow) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("width = 0.9", "width and height belong together"),
        ("", "give `width` and `height`"),
        ("m3_h = 72\ntemperature = 3", "temperature"),
        ('m3_h = "hours"', "no schedule 'hours'"),
    ],
)
def test_faults_of_a_neighbour_s_air_are_named(keys: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        tables_of(f"[[air.neighbour]]\ntemperature_c = 18\n{keys}")


def test_outside_faces_have_the_absorptance_stated(weather: Weather) -> None:
    """All but frames: inner faces keep their own."""
    text = '[envelope]\noutside_absorptance = 0.3\noutside_roughness = "rough"'
    room, plain = room_of(text, weather), room_of("", weather)
    found = [s for s in room.zone.surfaces if s.absorptance_out == 0.3 and s.roughness == "rough"]
    assert [(s.name, s.outside) for s in found] == [("wall 1", "outdoor")]  # and not its frame
    assert sum(s.outside == "outdoor" for s in room.zone.surfaces) == 2
    assert {s.absorptance_out for s in plain.zone.surfaces} == {0.6}
