"""Shading states by window group: order of windows, neighbours, cut-off, light and heat of each."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bim.model import Building, Element
from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.light import eye_illuminance, illuminance, with_view
from mitsuba_cfs.sky.sun import is_up, sun_directions
from scenes.room.control_groups import control_groups
from scenes.room.heat import heat_of, step_issues
from scenes.room.inputs import RoomInputs, room_inputs, skies_for
from scenes.room.light import room_light
from scenes.room.operation import Operation, OperationHours, check_schedules
from scenes.room.operation_tables import OperationTables
from scenes.room.room import compute_room, explored_combinations, operated_zone
from scenes.room.shading import control_signals, room_conditions, shading_states, temperature_conditions
from scenes.room.solar import seasonal_outdoors, solar_gains
from scenes.room.window_sensors import window_beam
from scenes.room.windows import in_all_windows, room_windows
from scenes.room.zone import RoomZone, balances, zone_surfaces
from tests.scenes.small_box import FEW, HOURS, TWO, clear
from thermal.control import RoomCondition

BESIDE = shoebox(
    6.0,
    4.0,
    2.8,
    windows=(WindowRectangle(0.5, 0.9, 2.0, 1.5), WindowRectangle(3.5, 0.9, 2.0, 1.5)),
    reflectance={"wall": 0.3, "floor": 0.1, "ceiling": 0.4},
)
TILTS = [0.0, 30.0, 60.0]
CUT_OFF = {"rule": "cut-off", "slat_tilts_deg": TILTS, "slat_width": 0.08, "slat_spacing": 0.08}


def turned_round(building: Building) -> Building:
    """The building with the windows of its room in the opposite order."""
    space = building.spaces[0]
    return replace(building, spaces=(replace(space, windows=space.windows[::-1]),))


@pytest.fixture(scope="module")
def year(weather):
    return skies_for(weather, FEW.sampling)


@pytest.fixture
def inputs(variant, glass, milk, blind, weather, year):
    def of(control: dict, building: Building = TWO, skies=year, **tables: dict) -> RoomInputs:
        space = building.spaces[0]
        operation = OperationTables.model_validate({"control": control, **tables})
        return room_inputs(
            building,
            space,
            in_all_windows(space, glass, milk, blind),
            weather,
            FEW,
            operation=operation,
            skies=skies,
            cache=MatrixCache.of_user(),
        )

    return of


def by_group(room: RoomInputs) -> dict[str, np.ndarray]:
    """States [H] of each control group, by the rules."""
    signals = control_signals(room)
    light = room_light(room) if signals & {"eye", "dgp"} else None
    outdoors = seasonal_outdoors(room) if "irradiance" in signals else None
    states = shading_states(room, light, outdoors)
    shading = room.shading(states)
    return dict(zip(shading.groups, shading.states.T, strict=True))


@pytest.mark.parametrize(
    "control",
    [
        {"rule": "irradiance", "close_above": 150.0},
        CUT_OFF,
        {"rule": "glare", "limit_lx": 1500.0},
        {"rule": "irradiance", "close_above": 150.0, "groups": "window"},
        CUT_OFF | {"groups": "room"},
    ],
    ids=["irradiance", "cut-off", "glare", "single windows", "whole room"],
)
def test_the_order_of_windows_changes_no_hour(inputs, control) -> None:
    first, second = (by_group(inputs(control, one)) for one in (TWO, turned_round(TWO)))
    assert first.keys() == second.keys() and any(states.any() for states in first.values())
    for name, states in first.items():
        assert np.count_nonzero(states != second[name]) == 0, name


def test_each_facade_has_its_profile_angle(inputs, weather) -> None:
    """The closed form: the shadow of a slat, (sin tilt + cos tilt tan phi) width, >= spacing."""
    room = inputs(CUT_OFF)
    found, sun = by_group(room), sun_directions(weather)
    for name, towards in (("S", -1.0), ("N", 1.0)):
        facing = towards * sun[:, 1]
        shines = (facing > 0) & (weather.direct_normal > 0) & is_up(sun)
        tangent = sun[:, 2] / np.where(shines, facing, 1.0)
        expected = np.full(len(sun), len(TILTS) - 1)
        for j in reversed(range(len(TILTS))):
            tilt = np.radians(TILTS[j])
            covers = np.sin(tilt) + np.cos(tilt) * tangent >= 1.0
            expected[covers] = j
        assert np.array_equal(found[name], np.where(shines, expected, 0)), name
    assert np.count_nonzero(found["S"] != found["N"]) > 1000


WALL = Element(
    "w",
    "wall",
    "IfcWall",
    np.array(
        [[[-9, -0.1, -5], [3, -0.1, -5], [3, -0.1, 20]], [[-9, -0.1, -5], [3, -0.1, 20], [-9, -0.1, 20]]], dtype=float
    ),
    0.2,
    0.2,
)


def test_no_blind_tilts_for_a_sun_that_a_neighbour_shades(inputs) -> None:
    """A wall right before one of two windows of a facade."""
    shaded = replace(BESIDE, elements=(WALL,))
    control = CUT_OFF | {"groups": "window"}
    found = by_group(inputs(control, shaded))
    hidden, free = (found[w.name] for w in BESIDE.spaces[0].windows)
    as_on_the_roof = by_group(inputs(control | {"sensor": "roof"}, shaded))
    alone = by_group(inputs(control, BESIDE))
    assert not hidden[free == 0].any() and np.mean(hidden > 0) < 0.2 * np.mean(free > 0)
    for name in found:
        assert np.array_equal(as_on_the_roof[name], alone[name])
        assert np.array_equal(as_on_the_roof[name], alone[BESIDE.spaces[0].windows[1].name])


def test_irradiance_is_that_behind_the_neighbour_or_on_the_roof(inputs) -> None:
    control = {"rule": "irradiance", "close_above": 150.0, "groups": "window"}
    shaded = replace(BESIDE, elements=(WALL,))
    hidden, free = by_group(inputs(control, shaded)).values()
    assert np.mean(hidden > 0) < 0.2 * np.mean(free > 0)
    on_roof = by_group(inputs(control | {"sensor": "roof"}, shaded)).values()
    alone, _ = by_group(inputs(control, BESIDE)).values()
    for states in on_roof:  # D is a mean over patches, the roof's sensor is traced by itself
        assert np.mean(states != alone) < 0.01


def test_direct_sun_of_a_half_shaded_window(inputs, weather) -> None:
    """A wall far above and beside: its shadow on the window by similar triangles at noon."""
    room = inputs(CUT_OFF, replace(BESIDE, elements=(WALL,)))
    beam, bare = (window_beam(room, shaded=shaded)[:, 0] for shaded in (True, False))
    assert np.all(beam <= bare + 1e-9)
    share = beam[bare > 0] / bare[bare > 0]
    assert 0.4 < np.median(share) < 0.6, "one of two equal windows is in the sun"


def test_light_of_a_room_is_the_sum_over_its_groups(variant, glass, weather, skies) -> None:
    """Panes that reflect the same: what one window reflects of the light of another is equal."""
    space, L = TWO.spaces[0], len(skies.lit)
    systems = in_all_windows(space, glass, clear("dark", 0.2))
    light = room_light(room_inputs(TWO, space, systems, weather, FEW, skies=skies))

    def lit(*states: int) -> np.ndarray:
        return illuminance(light.light, np.repeat(np.array(states)[:, None], L, axis=1))

    np.testing.assert_allclose(lit(0, 1) + lit(1, 0), lit(0, 0) + lit(1, 1), rtol=1e-4)
    assert not np.allclose(lit(0, 1), lit(1, 0), rtol=0.1)


def test_sun_of_a_room_is_the_sum_over_its_groups(inputs, skies) -> None:
    room = inputs({}, skies=skies)
    outdoors, surfaces = seasonal_outdoors(room), zone_surfaces(room)

    def transmitted(*states: int) -> np.ndarray:
        hours = np.tile(states, (skies.hours, 1))
        solar, gains, _ = solar_gains(room, outdoors, surfaces.room, surfaces.outer, hours, thermals=surfaces.thermals)
        assert np.array_equal(solar.state, hours[:, room.windows.group])
        return gains["transmitted_w"][list(HOURS)]

    np.testing.assert_allclose(transmitted(0, 2) + transmitted(2, 0), transmitted(0, 0) + transmitted(2, 2), rtol=1e-6)
    assert not np.allclose(transmitted(0, 2), transmitted(2, 0), rtol=0.1)


def test_a_year_has_a_column_for_each_group(glass, blind, weather, skies, variant) -> None:
    space = TWO.spaces[0]
    control = {"rule": "always", "group": [{"facades": ["N"], "state": 1}]}
    tables = OperationTables.model_validate(
        {"control": control, "gains": {"lighting_w_m2": 8.0}, "loads": {"heating_c": 20.0}}
    )
    found = compute_room(
        TWO,
        space,
        in_all_windows(space, glass, blind),
        weather,
        FEW,
        operation=Operation(Path("o.toml"), tables, ()),
        skies=skies,
        explore=True,
    )
    hours = found.operation.hours
    assert set(hours["shading_state_N"]) == {1} and set(hours["shading_state_S"]) == {0}
    assert "shading_state" not in hours
    assert found.operation.shading.of_windows[0].tolist() == [0, 1]
    explored = found.explored
    assert explored.states == ("clear", explored.states[1], f"N: {explored.states[1]}, S: clear")
    assert set(explored.operated[list(HOURS)]) == {2}
    as_run = explored.illuminance[2]
    np.testing.assert_allclose(as_run, found.daylight.illuminance[list(HOURS)].T, rtol=1e-5)


def test_combinations_that_the_explorer_shows(inputs, skies) -> None:
    room = inputs({}, skies=skies)
    state = np.zeros((skies.hours, 2), dtype=np.int64)
    state[HOURS[0]], state[HOURS[1]], state[5] = (1, 1), (2, 0), (0, 2)  # hour 5 is dark
    combinations, operated = explored_combinations(room, 3, state)
    assert combinations.tolist() == [[0, 0], [1, 1], [2, 2], [2, 0]]
    assert operated[list(HOURS)].tolist() == [1, 3, 0, 0]


def test_groups_by_window_facade_and_rule(inputs, weather) -> None:
    south, north = TWO.spaces[0].windows
    control = CUT_OFF | {"group": [{"name": "door", "windows": [north.name], "rule": "always", "state": 2}]}
    room = inputs(control)
    assert room.control.names == ("door", "S")
    assert room.control.rules[0].slat_tilts_deg == tuple(TILTS), "other keys are those of control"
    states = by_group(room)
    assert set(states["door"]) == {2} and set(states["S"]) == {0, 1, 2}
    frame = window_frame(south.normal, south.up)
    assert not states["S"][(sun_directions(weather) @ frame.T)[:, 2] <= 0].any()
    together = by_group(inputs({"groups": "room"} | CUT_OFF))
    assert list(together) == ["all"]


def test_rules_are_combined(inputs) -> None:
    """The sun on the windows, and only from 8 to 18 o'clock; the blind waits before it opens."""
    sun = {"rule": "irradiance", "close_above": 150.0}
    used = {"rule": "schedule", "schedule": [0] * 8 + [2] * 10 + [0] * 6}
    cut_off = CUT_OFF | {"sensor": "roof"}
    single = [by_group(inputs(one)) for one in (sun, used, cut_off)]
    both = by_group(inputs({"rule": "all", "parts": [sun, used]}))
    nested = {"rule": "any", "parts": [{"rule": "all", "parts": [sun, used]}, cut_off]}
    either = by_group(inputs(nested))
    waiting = by_group(inputs(sun | {"open_delay_h": 2.0}))
    resting = by_group(inputs(sun | {"hold_h": 4.0}))
    for name in ("S", "N"):
        by_sun, by_clock, by_angle = (states[name] for states in single)
        assert np.array_equal(both[name], np.minimum(by_sun, by_clock))
        assert np.array_equal(either[name], np.maximum(both[name], by_angle))
        opens = np.flatnonzero(np.diff(waiting[name]) < 0) + 1
        assert all(not by_sun[row - 2 : row + 1].any() for row in opens)
        assert np.all(waiting[name] >= by_sun)
        moves = np.flatnonzero(np.diff(resting[name]))
        assert len(moves) < np.count_nonzero(np.diff(by_sun)) and np.diff(moves).min() >= 4


def test_rules_by_weather(inputs, weather) -> None:
    """Closed in warm hours; an exterior blind that is raised in strong wind and in rain."""
    warm = {"rule": "outdoor temperature", "close_above_c": 20.0, "open_below_c": 17.0}
    calm, dry = {"rule": "wind", "open_above_m_s": 8.0}, {"rule": "rain", "state": 1}
    together = by_group(inputs({"rule": "all", "parts": [warm, calm, dry | {"state": 2}]}))["S"]
    single = [by_group(inputs(one))["S"] for one in (warm, calm, dry)]
    air, rains = weather.dry_bulb_c, np.nan_to_num(weather.rain_mm) > 0
    assert 20 < rains.sum() < 40
    assert (single[0][air > 20] == 2).all() and not single[0][air < 17].any()
    between = (air[1:] >= 17) & (air[1:] <= 20)
    assert np.array_equal(single[0][1:][between], single[0][:-1][between])
    assert np.array_equal(single[1], np.where(weather.wind_speed > 8.0, 0, 2))
    assert np.array_equal(single[2], np.where(rains, 0, 1))
    shut = single[0] * (single[1] > 0) * (single[2] > 0)
    assert np.array_equal(together, shut) and 0 < np.count_nonzero(shut)


def test_a_rule_that_the_weather_cannot_answer_is_refused_first(weather) -> None:
    tables = OperationTables.model_validate({"control": {"rule": "any", "parts": [{"rule": "rain"}]}})
    airing = OperationTables.model_validate({"air": {"windows": {"closed_in_rain": True}}})
    check_schedules(tables, weather)
    for rain in (None, np.zeros_like(weather.dry_bulb_c)):
        dry = replace(weather, rain_mm=rain)
        for table, field in ((tables, "control.rule"), (airing, "air.windows.closed_in_rain")):
            with pytest.raises(DataError, match="has no rain") as error:
                check_schedules(table, dry)
            assert error.value.field == field
    windy = OperationTables.model_validate({"control": {"rule": "wind"}})
    with pytest.raises(DataError, match="has no wind"):
        check_schedules(windy, replace(weather, wind_speed=None))


def test_windows_are_tilted_while_nobody_is_there_and_shut_in_rain(weather) -> None:
    air = {"windows": {"share": 0.3, "absent_share": 0.02, "closed_in_rain": True}}
    tables = OperationTables.model_validate({"air": air, "gains": {"occupied": [8, 18]}})
    window = SimpleNamespace(glazing_height=1.5, height=1.6, area=3.0, normal=np.array([0.0, 1.0, 0.0]))
    share = OperationHours(tables, weather).airing([window], 60.0).share
    clock, rains = weather.midpoints.hour.to_numpy(), np.nan_to_num(weather.rain_mm) > 0
    expected = np.where((clock >= 8) & (clock < 18), 0.3, 0.02)
    assert np.array_equal(share, np.where(rains, 0.0, expected))


def test_little_of_a_window_is_open_by_night(weather) -> None:
    air = {"night": [22, 6], "windows": {"share": 0.3, "when": "always", "night_share": 0.02}}
    tables = OperationTables.model_validate({"air": air})
    window = SimpleNamespace(glazing_height=1.5, height=1.6, area=3.0, normal=np.array([0.0, 1.0, 0.0]))
    share = OperationHours(tables, weather).airing([window], 60.0).share
    clock = weather.midpoints.hour.to_numpy()
    assert np.array_equal(share, np.where((clock >= 22) | (clock < 6), 0.02, 0.3))


WARM = {"rule": "operative temperature", "close_above_c": 22.0, "open_below_c": 21.0}


def test_rules_by_room_temperature_are_computed_both_ways(inputs) -> None:
    sun, slow = ({"rule": "irradiance", "close_above": 150.0}, WARM | {"open_delay_h": 2, "hold_h": 3})
    room = inputs({"rule": "all", "parts": [sun, slow, slow]})
    (condition,) = temperature_conditions(room)
    assert condition == RoomCondition(22.0, 21.0, "operative", 2, 3)
    outdoors, by_sun = seasonal_outdoors(room), by_group(inputs(sun))["S"]
    cold, warm = (shading_states(room, None, outdoors, met={condition: met})[:, 0] for met in (False, True))
    assert not cold.any() and np.array_equal(warm, by_sun)


def test_rules_that_combine_room_temperatures_wait(inputs) -> None:
    """Each is a condition of its own, inner ones before the rules that read them."""
    sun, fresh = {"rule": "irradiance", "close_above": 150.0}, {"rule": "outdoor temperature"}
    cool = {"rule": "air temperature", "close_above_c": 20.0}
    inner = {"rule": "all", "hold_h": 3, "parts": [sun, WARM]}
    room = inputs({"rule": "any", "open_delay_h": 2, "parts": [inner, {"rule": "all", "parts": [fresh, cool]}]})
    outdoors = seasonal_outdoors(room)
    conditions, read = room_conditions(room, None, outdoors)
    warm, cold, held_one, outer, *others = conditions
    by_sun, by_air = (by_group(inputs(one))["S"] > 0 for one in (sun, fresh))
    assert by_sun.any() and by_air.any() and not by_sun.all()
    assert (held_one.reads, outer.reads) == ((warm,), (held_one, cold))
    assert (held_one.hold_rows, outer.open_delay_rows, outer.hold_rows) == (3, 2, 0)
    assert held_one.states == outer.states == (0, 2)
    assert not held_one.asked[0].any() and np.array_equal(held_one.asked[1], by_sun)
    expected = [np.zeros_like(by_sun), np.ones_like(by_sun), by_air, np.ones_like(by_sun)]
    np.testing.assert_array_equal(outer.asked, expected)
    assert outer in read and warm not in read and len(read) == len(others) // 2 + 1
    for level in (0, 1):
        levels = dict.fromkeys(read, level)
        assert (shading_states(room, None, outdoors, met=levels) == 2 * level).all()


@pytest.mark.parametrize(
    ("control", "key"),
    [
        ({"rule": "any", "hold_h": 1.0, "parts": [WARM, {"rule": "glare"}]}, "control.hold_h"),
        (WARM | {"open_below_c": 23.0}, "control.open_below_c"),
        ({"rule": "any", "parts": [WARM, WARM | {"open_below_c": 23.0}]}, "control.parts.1.open_below_c"),
    ],
)
def test_what_a_rule_by_room_temperature_cannot_do_is_refused(control, key) -> None:
    fault = OperationTables.model_validate({"control": control}).control_fault(3)
    assert fault is not None and fault[0] == key


def test_coupled_rooms_whose_light_and_heat_have_other_states_say_so(glass, blind, weather, skies, variant) -> None:
    """The states of the balance alone are those of the light; a warm neighbour closes more."""
    tables = OperationTables.model_validate({"control": WARM | {"state": 1}})
    space = TWO.spaces[0]
    room = room_inputs(TWO, space, in_all_windows(space, glass, blind), weather, FEW, operation=tables, skies=skies)
    zone = operated_zone(room)
    alone, others = (
        heat_of([zone_in], weather, 3600.0)[0]
        for zone_in in (replace(zone, shading=replace(zone.shading, states=chosen(zone, weather))), zone)
    )
    assert [issue.code for issue in alone[0].issues] == []
    (issue,) = others[0].issues  # its light is that of open blinds
    assert issue.code == "shading-by-coupled-temperature" and issue.values["hours"] > 100
    assert np.array_equal(alone[1].shading.states, others[1].shading.states)


def test_shading_by_room_temperature_is_checked_by_half_the_step(glass, blind, weather, skies, variant) -> None:
    """The year of a room that stays open is not that which half the step gives."""
    tables = OperationTables.model_validate({"control": WARM})
    space = TWO.spaces[0]
    room = room_inputs(TWO, space, in_all_windows(space, glass, blind), weather, FEW, operation=tables, skies=skies)
    zone = operated_zone(room)
    shaded = balances([zone], weather, 3600.0)
    opened = balances([replace(zone, alternatives=None)], weather, 3600.0)
    assert step_issues([zone], shaded, weather, 3600.0) == ((),)
    ((issue,),) = step_issues([zone], opened, weather, 3600.0)
    assert issue.code == "time-step-too-long"
    assert step_issues([replace(zone, alternatives=None)], shaded, weather, 3600.0) == ((),)


def chosen(zone: RoomZone, weather) -> np.ndarray:
    """The states that the balance of a room alone chooses."""
    (result,) = balances([zone], weather, 3600.0)
    return zone.in_alternatives(result.alternative).shading.states


def test_a_rule_against_glare_is_combined_with_others(inputs, skies) -> None:
    glare = {"rule": "glare", "limit_lx": 1500.0}
    alone = by_group(inputs(glare, skies=skies))
    always = {"rule": "always", "state": 1}
    both = by_group(inputs({"rule": "any", "parts": [glare, always]}, skies=skies))
    for name, states in alone.items():
        assert np.array_equal(both[name], np.maximum(states, 1))


@pytest.mark.parametrize(
    ("control", "words"),
    [
        ({"group": [{"windows": ["nowhere"]}]}, r"control.group.0.windows.*nowhere.*has: .*window 1"),
        ({"rule": "glare", "seat": [99.0, 0.0, 1.2]}, r"control.seat.*outside the room"),
    ],
)
def test_what_a_control_cannot_name_is_refused(inputs, control, words) -> None:
    with pytest.raises(DataError, match=words):
        inputs(control)


@pytest.mark.parametrize("looks_deg", [0.0, pytest.param(180.0, marks=pytest.mark.slow)])
def test_glare_at_a_seat_takes_the_most_open_combination(inputs, skies, looks_deg) -> None:
    """Of all nine combinations of three states of two equal windows, by the light at that seat."""
    limit, seat = 1500.0, (1.5, 2.0, 1.2)
    control = {"rule": "glare", "limit_lx": limit, "seat": seat, "looks_deg": looks_deg}
    room = inputs(control, skies=skies)
    angle = np.radians(looks_deg)
    view = fisheye(seat, (np.sin(angle), np.cos(angle), 0.0), 32)
    light = with_view(room_light(room).light, view)
    eye = {
        kind: eye_illuminance(light, np.repeat(np.array(kind)[:, None], len(HOURS), axis=1))
        for kind in np.ndindex(3, 3)
    }
    found = shading_states(room, room_light(room))[list(HOURS)]
    assert len(np.unique(found, axis=0)) > 1
    for hour, chosen in enumerate(map(tuple, found.tolist())):
        fine = {kind for kind in eye if eye[kind][hour] < limit}
        if not fine:
            assert chosen == (2, 2)
            continue
        openest = min(map(sum, fine))
        best = min((k for k in fine if sum(k) == openest), key=lambda k: eye[k][hour])
        assert chosen == best


def test_a_wrong_part_of_a_rule_is_named() -> None:
    parts = {"rule": "any", "parts": [{"rule": "always"}, {"rule": "always", "state": 5}]}
    tables = OperationTables.model_validate({"control": parts})
    assert tables.control_fault(2)[0] == "control.parts.1.state"
    empty = OperationTables.model_validate({"control": {"rule": "all"}})
    assert empty.control_fault(2)[0] == "control.parts"


def test_a_room_that_was_sent_to_another_process_has_the_same_groups():
    """Its arrays are copies: windows are known by their number, not by these."""
    for space in (TWO.spaces[0], BESIDE.spaces[0]):
        sent = pickle.loads(pickle.dumps(space))
        assert control_groups(sent).number.tolist() == control_groups(space).number.tolist()
        systems = {window.guid: (SimpleNamespace(name="clear"),) for window in space.windows}
        one, other = room_windows(space, systems), room_windows(sent, systems)
        assert [group.name for group in one.groups] == [group.name for group in other.groups]
