"""Groups of windows of several rooms: one state for all of them, in any order of rooms and windows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bim.model import Building, Element, SpaceGroup
from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.matrices.cache import MatrixCache
from scenes.demo import WEATHER
from scenes.fenestration.resolver import WindowOverrides
from scenes.input_files import InputFiles
from scenes.inputs import Inputs, inputs_of
from scenes.room.control_groups import control_groups, shared_groups
from scenes.room.inputs import skies_for
from scenes.room.operation import Operation
from scenes.room.operation_tables import OperationTables
from scenes.room.room import asked_year, compute_room, inputs_of_room
from scenes.room.shared_states import with_shared_states
from scenes.run.options import JobOptions
from scenes.run.run import run_inputs
from tests.scenes.small_box import FEW, OPENING
from tests.scenes.test_equal_rooms import moved
from tests.trace.rooms import quad

# Rooms side by side with windows to the south and the north; a wall before the south window of "far" alone
BOX = shoebox(
    3.0,
    4.0,
    2.8,
    windows=(WindowRectangle(**OPENING), WindowRectangle(**OPENING, side="back")),
    reflectance={"wall": 0.3, "floor": 0.1, "ceiling": 0.4},
)
WALL = Element("wall", "Wall", "IfcWall", quad((9, -1.5, 0), (16, -1.5, 0), (16, -1.5, 5), (9, -1.5, 5)), 0.2, 0.2)
NEAR = replace(BOX.spaces[0], guid="near-guid", name="near", storey="Ground")
ROOMS = (
    NEAR,
    replace(moved(BOX, (10.0, 0.0, 0.0), "far"), storey="Ground"),
    replace(moved(BOX, (0.0, 0.0, 6.0), "up"), storey="First"),
)
TWO_ZONES = (
    SpaceGroup("House", "", tuple(space.guid for space in ROOMS)),
    SpaceGroup("Flat 1", "", ("near-guid", "up-guid")),
)
BUILDING = replace(BOX, spaces=ROOMS, elements=(WALL,), zones=TWO_ZONES)
SUN = {"rule": "irradiance", "close_above": 150.0, "open_below": 100.0}


def turned_round(building: Building) -> Building:
    """The building with its rooms, and the windows of each, in the opposite order."""
    spaces = [replace(space, windows=space.windows[::-1]) for space in building.spaces]
    return replace(building, spaces=tuple(spaces[::-1]))


@pytest.fixture(scope="module")
def year(weather):
    return skies_for(weather, FEW.sampling)


@pytest.fixture
def shared(variant, glass, milk, blind, weather, year):
    """The operation of some control with the states of its groups of several rooms."""

    def of(control: dict, building: Building = BUILDING, **tables: dict) -> Operation:
        operation = Operation(Path("o.toml"), OperationTables.model_validate({"control": control, **tables}), ())
        systems = {window.guid: (glass, milk, blind) for window in building.windows}
        return with_shared_states(
            operation, building, building.spaces, systems, weather, FEW, skies=year, cache=MatrixCache.of_user()
        )

    return of


@pytest.fixture
def room_of(glass, milk, blind, weather, year):
    """The inputs of a room under an operation."""

    def of(operation: Operation, name: str, building: Building = BUILDING):
        systems = {window.guid: (glass, milk, blind) for window in building.windows}
        space = building.space(name)
        cache = MatrixCache.of_user()
        return inputs_of_room(building, space, systems, weather, FEW, operation=operation, skies=year, cache=cache)

    return of


def states_by_room(operation: Operation, room_of, building: Building = BUILDING) -> dict[str, np.ndarray]:
    """The states [H, W] of the windows of each room, in the order of their GUIDs."""
    found = {}
    for space in building.spaces:
        room = room_of(operation, space.name, building)
        states = asked_year(room).states[:, room.control.number]
        found[space.name] = states[:, np.argsort([window.guid for window in space.windows])]
    return found


@pytest.mark.parametrize(
    "control",
    [
        {**SUN, "across": "building"},
        {**SUN, "across": "storey", "hold_h": 3, "most_moves": 2},
        {"rule": "cut-off", "slat_tilts_deg": [0, 30, 60], "across": "building"},
        {"rule": "glare", "limit_lx": 2000, "across": "storey"},
        {"rule": "wind", "open_above_m_s": 5.0, "across": "zone"},
    ],
    ids=lambda control: f"{control['rule']}, {control['across']}",
)
def test_rooms_of_a_group_have_one_state_and_their_order_changes_no_hour(shared, room_of, control) -> None:
    operation = shared(control)
    states = states_by_room(operation, room_of)
    together = {"building": ("near", "far", "up"), "storey": ("near", "far"), "zone": ("near", "up")}
    first, *others = together[control["across"]]
    for other in others:  # south and north are groups of their own
        assert np.array_equal(states[first], states[other])
    assert np.ptp(states[first], axis=0).all()
    other_way = turned_round(BUILDING)
    turned = states_by_room(shared(control, other_way), room_of, other_way)
    assert {name: int((states[name] != turned[name]).sum()) for name in states} == dict.fromkeys(states, 0)


def test_without_a_common_group_the_shaded_room_moves_alone(shared, room_of) -> None:
    """The wall before "far": what the tests above join is not the same of itself."""
    states = states_by_room(shared(SUN), room_of)
    assert (states["near"] != states["far"]).sum() > 100


def test_one_sensor_moves_the_others(shared, room_of) -> None:
    """The rule reads one room; without a name the group closes where any room asks for it."""
    alone = states_by_room(shared(SUN), room_of)
    for name in ("near", "far"):
        one = states_by_room(shared({**SUN, "across": "building", "sensor_rooms": [name]}), room_of)
        for room in ("near", "far", "up"):
            assert np.array_equal(one[room], alone[name])
    every = states_by_room(shared({**SUN, "across": "storey"}), room_of)
    assert np.array_equal(every["near"], np.maximum(alone["near"], alone["far"]))
    assert np.array_equal(every["up"], alone["up"])


def test_a_seat_names_its_room(shared, room_of) -> None:
    seat = {"rule": "glare", "limit_lx": 1500, "seat": [11.5, 2.0, 1.2], "looks_deg": 180.0}
    far = states_by_room(shared(seat | {"across": "building"}), room_of)
    assert np.array_equal(far["near"], far["far"])
    named = states_by_room(shared(seat | {"across": "building", "sensor_rooms": ["far"]}), room_of)
    assert np.array_equal(far["up"], named["up"])
    with pytest.raises(DataError, match="no room with windows of the group contains"):
        shared(seat | {"across": "building", "seat": [50.0, 2.0, 1.2]})


def test_moves_a_day_are_those_of_the_group(shared, room_of) -> None:
    control = {**SUN, "across": "building", "most_moves": 1}
    operation = shared(control)
    room = room_of(operation, "far")
    days = np.arange(len(room.weather.times)) // 24
    moves = np.concatenate([[0], np.diff(asked_year(room).states[:, 0]) != 0])
    assert np.bincount(days, moves).max() == 1
    reasons = operation.shared["S"].reasons
    assert {reasons[n] for n in operation.shared["S"].moved_by if n >= 0} >= {"irradiance"}


def test_a_rule_by_the_temperature_of_one_room_moves_the_others(shared, room_of) -> None:
    control = {"rule": "operative temperature", "close_above_c": 24.0, "across": "building", "sensor_rooms": ["near"]}
    states = states_by_room(shared(control), room_of)
    assert np.ptp(states["near"]) == 2
    assert np.array_equal(states["near"], states["far"])
    with pytest.raises(DataError, match="name one as `sensor_rooms`"):
        shared({**control, "sensor_rooms": [], "hold_h": 2})


def test_entries_name_rooms_by_storey_zone_and_name(shared, room_of) -> None:
    control = {
        "rule": "always",
        "group": [
            {"name": "low", "facades": ["S"], "storeys": ["ground"], "across": "building", **SUN},
            {"zones": ["Flat 1"], "facades": ["N"], "rule": "schedule", "schedule": [0] * 12 + [1] * 12},
            {"spaces": ["far"], "rule": "always", "state": 2},
        ],
    }
    groups = {
        name: control_groups(BUILDING.space(name), OperationTables(control=control).control, BUILDING)
        for name in ("near", "far", "up")
    }
    assert groups["near"].names == ("low", "N") and groups["near"].shared == ("low", "")
    assert groups["far"].names == ("low", "all")
    assert groups["up"].names == ("N", "S")
    states = states_by_room(shared(control), room_of)
    assert np.array_equal(states["near"].max(axis=1) > 0, states["near"].any(axis=1))
    assert (states["far"] == 2).all(axis=0).any() and not states["up"].all(axis=1).any()


def test_a_zone_within_a_zone_counts(shared) -> None:
    groups = shared_groups(BUILDING, OperationTables.model_validate({"control": {**SUN, "across": "zone"}}))
    assert {g.name: sorted(g.windows) for g in groups} == {
        "N Flat 1": ["near-guid", "up-guid"],
        "N House": ["far-guid"],
        "S Flat 1": ["near-guid", "up-guid"],
        "S House": ["far-guid"],
    }
    crossing = replace(BUILDING, zones=(*TWO_ZONES, SpaceGroup("Fire", "", ("near-guid", "far-guid"))))
    with pytest.raises(DataError, match="in several zones"):
        shared_groups(crossing, OperationTables.model_validate({"control": {**SUN, "across": "zone"}}))


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"control": {"sensor_rooms": ["near"]}}, "state `across`"),
        ({"control": {"groups": "window", "across": "storey"}}, "each window moves alone"),
        ({"control": {"across": "building", "sensor_rooms": ["nowhere"]}}, "nowhere"),
        ({"control": {"group": [{"facades": ["S"], "storeys": ["Attic"]}]}}, "no storey 'Attic'; there are: First"),
        ({"control": {"group": [{"windows": ["W1"], "across": "building"}]}}, "need one"),
        (
            {"control": {**SUN, "across": "building"}, "rooms": [{"spaces": ["up"], "control": {"close_above": 300}}]},
            "other rules here than in near",
        ),
    ],
)
def test_what_cannot_move_together_is_refused(tables, words) -> None:
    with pytest.raises(ValueError, match=words):
        shared_groups(BUILDING, OperationTables.model_validate(tables)) or [
            OperationTables.model_validate(tables).of_room(BUILDING, space) for space in BUILDING.spaces
        ]


def test_windows_with_other_numbers_of_states_do_not_move_together(variant, glass, milk, blind, weather, year) -> None:
    operation = Operation(
        Path("o.toml"), OperationTables.model_validate({"control": {**SUN, "across": "building"}}), ()
    )
    systems = {w.guid: (glass, blind) for w in BUILDING.windows}
    systems |= {w.guid: (glass, milk, blind) for w in BUILDING.space("up").windows}
    with pytest.raises(DataError, match=r"2 states .* and 3"):
        with_shared_states(operation, BUILDING, BUILDING.spaces, systems, weather, FEW, skies=year)


def test_a_run_and_its_parts_have_the_states_of_the_group(variant, glass, milk, blind, weather) -> None:
    """All rooms, one of them alone, and the rooms in another order: no hour differs."""
    tables = OperationTables.model_validate({"control": {**SUN, "across": "storey", "hold_h": 2}})
    operation = Operation(Path(__file__), tables, (glass, milk, blind))
    found = {}
    for case, (building, spaces) in {
        "all": (BUILDING, ()),
        "one": (BUILDING, ("far",)),
        "turned": (turned_round(BUILDING), ()),
    }.items():
        options = JobOptions(Path(__file__), WEATHER, spaces=spaces, colour=False, room=FEW)
        overrides = WindowOverrides(states=operation.systems)
        inputs = inputs_of(building, options, InputFiles(weather, overrides, operation))
        assert isinstance(inputs, Inputs)
        for room in run_inputs(inputs, options).spaces:
            order = np.argsort([window.guid for window in room.space.windows])
            found[case, room.space.name] = room.operation.shading.of_windows[:, order]
    whole = found["all", "far"]
    assert np.array_equal(found["all", "near"], whole) and whole.any()
    for key in (("one", "far"), ("turned", "near"), ("turned", "far")):
        assert int((found[key] != whole).sum()) == 0
    assert not np.array_equal(found["all", "up"], whole)


def test_a_function_in_several_rooms_moves_the_group_by_the_most_closed(
    variant, glass, milk, blind, weather, year
) -> None:
    def control(hour) -> int:
        return 2 if hour.beam.max() > 100 else 0

    tables = OperationTables.model_validate({"control": {"across": "storey"}})
    operation = Operation(Path("o.toml"), tables, (glass, milk, blind), control)
    systems = {window.guid: (glass, milk, blind) for window in BUILDING.windows}
    room = BUILDING, ROOMS[:2], systems, weather, FEW
    shared = with_shared_states(operation, *room, skies=year, cache=MatrixCache.of_user())
    assert set(shared.shared) == {"S Ground", "N Ground"}
    found = [
        compute_room(BUILDING, space, systems, weather, FEW, operation=shared, skies=year, cache=MatrixCache.of_user())
        for space in ROOMS[:2]
    ]
    near, far = (one.operation.shading.of_windows for one in found)
    assert np.array_equal(near, far) and near.any()
