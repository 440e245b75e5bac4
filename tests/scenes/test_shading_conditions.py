"""Conditions of shading: depth of the sun, lux, use, loads, moves; people; named scenarios."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.methods.light import direct_sun_by_group, illuminance
from mitsuba_cfs.sky.sun import is_up, sun_directions
from scenes.room.control_groups import control_groups
from scenes.room.control_hour import FollowedCondition
from scenes.room.heat import heat_alone
from scenes.room.inputs import room_inputs, skies_for
from scenes.room.light import room_light
from scenes.room.operation import Operation
from scenes.room.operation_tables import OperationTables
from scenes.room.predictive import predictive_states
from scenes.room.room import lit_room
from scenes.room.shading import control_signals, room_conditions, ruled_year, shading_states, temperature_conditions
from scenes.room.shading_rules import ShadingRule, scenarios
from scenes.room.solar import seasonal_outdoors
from scenes.room.window_sensors import facade_illuminance, window_beam
from scenes.room.windows import in_all_windows
from scenes.toml_file import validated
from tests.scenes.small_box import FEW, TWO
from thermal.control import RoomCondition, by_threshold, delayed

SUN = {"rule": "irradiance", "close_above": 150.0, "sensor": "roof"}


@pytest.fixture(scope="module")
def year(weather):
    return skies_for(weather, FEW.sampling)


@pytest.fixture
def inputs(variant, glass, milk, blind, weather, year):
    def of(control: dict, **tables):
        space = TWO.spaces[0]
        return room_inputs(
            TWO,
            space,
            in_all_windows(space, glass, milk, blind),
            weather,
            tables.pop("options", FEW),
            operation=OperationTables.model_validate({"control": control, **tables}),
            skies=year,
        )

    return of


def by_group(room):
    """States [H] of each control group by the rules."""
    signals = control_signals(room)
    light = room_light(room) if signals & {"eye", "plane", "direct"} else None
    outdoors = seasonal_outdoors(room) if "irradiance" in signals else None
    states = room.shading(shading_states(room, light, outdoors))
    return dict(zip(states.groups, states.states.T, strict=True))


def test_depth_of_the_sun_on_the_floor(inputs, weather) -> None:
    """The head of the glass is 2.4 m above the floor: depth = 2.4 m / tan(profile angle)."""
    room = inputs({"rule": "sun depth", "deepest_m": 1.5, "beam_above": 30.0})
    found, sun, beam = by_group(room), sun_directions(weather), window_beam(room, shaded=True)
    for g, (name, towards) in enumerate((("S", -1.0), ("N", 1.0))):
        assert room.windows.groups[g].name.startswith(name)
        facing = towards * sun[:, 1]
        depth = 2.4 * facing / np.maximum(sun[:, 2], 1e-9)
        expected = 2 * ((depth > 1.5) & (beam[:, g] > 30.0))
        assert np.array_equal(found[name], expected), name
    assert 0 < np.count_nonzero(found["S"]) < np.count_nonzero(beam[:, 0] > 30.0)
    higher = by_group(inputs({"rule": "sun depth", "deepest_m": 1.5, "plane_height_m": 0.8}))["S"]
    lower = by_group(inputs({"rule": "sun depth", "deepest_m": 1.5}))["S"]
    assert 0 < np.count_nonzero(higher) < np.count_nonzero(lower)
    assert not lower[higher > 0].min() == 0


def test_lux_of_the_facade_and_of_a_level_sensor(inputs, weather) -> None:
    room = inputs({"rule": "illuminance", "close_above_lx": 20000.0, "open_below_lx": 15000.0})
    lux, found = facade_illuminance(room, "window"), by_group(room)
    for g, name in enumerate(("S", "N")):
        assert found[name][lux[:, g] > 20000].min(initial=2) == 2
        assert found[name][lux[:, g] < 15000].max(initial=0) == 0
    assert 100 < np.count_nonzero(found["N"]) < np.count_nonzero(found["S"])
    level = facade_illuminance(room, "horizontal")
    assert np.array_equal(level[:, 0], level[:, 1])
    # the patches' sum is the file's global horizontal illuminance, but for the efficacy models
    total = weather.global_horizontal_illuminance.sum()
    assert level[:, 0].sum() == pytest.approx(total, rel=0.06)
    watts = by_group(inputs(SUN | {"sensor": "horizontal", "close_above": 400.0}))
    assert np.array_equal(watts["N"], watts["S"])
    apart = (watts["N"] > 0) != (weather.global_horizontal > 400.0)
    assert np.mean(apart) < 0.01, "the sun over patches turns some hours near the limit"


def test_daylight_of_the_work_plane_is_limited_or_left(inputs) -> None:
    limited = inputs({"rule": "work plane", "close_above_lx": 800.0})
    light = room_light(limited)
    states = shading_states(limited, light)
    lux = illuminance(light.light, light.states(states)).mean(axis=0)
    closed = np.array([illuminance(light.light, np.full((2, len(lux)), j)).mean(axis=0) for j in range(3)]).min(axis=0)
    assert np.all((lux <= 800.0 * (1 + 1e-5)) | (closed > 790.0))
    assert len(np.unique(states)) == 3
    target = inputs({"rule": "daylight", "target_lx": 300.0})
    states = shading_states(target, light)
    left = illuminance(light.light, light.states(states)).mean(axis=0)
    opened = illuminance(light.light).mean(axis=0)
    assert np.all((left >= 300.0 * (1 - 1e-5)) | (opened < 301.0))
    assert left.mean() < 0.8 * opened.mean()


def test_use_of_the_room_day_and_night(inputs, weather) -> None:
    up = is_up(sun_directions(weather))
    clock = np.arange(8760) % 24
    used = (clock >= 9) & (clock < 17)
    for rule, expected in (("day", up), ("night", ~up), ("occupied", used), ("unoccupied", ~used)):
        found = by_group(inputs({"rule": rule, "state": 1}, gains={"occupied": [9, 17]}))["S"]
        assert np.array_equal(found, expected.astype(int)), rule
        other = by_group(inputs({"rule": rule, "inverse": True}, gains={"occupied": [9, 17]}))["S"]
        assert np.array_equal(other, 2 * ~expected), rule


def test_few_moves_and_no_opening_before_an_event(inputs, weather) -> None:
    free = by_group(inputs(SUN))["S"]
    few = by_group(inputs(SUN | {"most_moves": 1}))["S"]
    per_day = (np.concatenate([[0], np.abs(np.diff(few))]) > 0).reshape(365, 24).sum(axis=1)
    assert per_day.max() == 1 and np.count_nonzero(np.diff(free)) > 365
    up = is_up(sun_directions(weather))
    ends = {
        "midnight": np.arange(8760) % 24 == 0,
        "sunset": ~up,
        "sunrise": up & ~np.roll(up, 1),
        "arrival": np.arange(8760) % 24 == 8,
    }
    for until, end in ends.items():
        late = by_group(inputs(SUN | {"until": until}))["S"]
        opens = np.flatnonzero(np.diff(late) < 0) + 1
        assert len(opens) > 50 and end[opens].all(), until
        assert np.all(late >= free)


def test_what_moved_the_windows_is_known(inputs) -> None:
    """Sun while the room is used, or a late hour: each move has the condition that changed."""
    late = {"rule": "schedule", "schedule": [0] * 20 + [1] * 4}
    control = {"rule": "any", "parts": [{"rule": "all", "parts": [SUN, {"rule": "occupied"}]}, late]}
    room = inputs(control | {"hold_h": 2.0})
    ruled = ruled_year(room, None, None)
    assert ruled.reasons == ("irradiance", "occupied", "schedule", "hold_h")
    shading = room.shading(ruled.states[:, room.windows.control], ruled.moved_by, ruled.reasons)
    moves = shading.moves(room.weather.midpoints)
    south = moves[moves["group"] == "S"]
    hours = south["time"].dt.hour
    assert set(south["moved_by"]) == set(ruled.reasons)
    assert set(hours[south["moved_by"] == "schedule"]) == {20, 0}
    assert set(hours[south["moved_by"] == "occupied"]) <= {8, 18}
    assert (south["to_state"][hours == 20] == 1).all()
    counts = shading.moves_by_reason()
    assert sum(int(one.sum()) for one in counts.values()) == len(moves)
    assert shading.moves_of_days(room.weather.midpoints).sum() == len(moves)


def test_view_is_preferred_where_states_are_equally_good(inputs) -> None:
    """The first state is clear, the second milk glass, the third a blind with level slats."""
    limit = {"rule": "work plane", "close_above_lx": 900.0}
    plain, seen = inputs(limit), inputs(limit | {"prefer": "view"})
    light = room_light(plain)
    years = [room.shading(shading_states(room, light)) for room in (plain, seen)]
    views = [year.figures(plain.occupied, plain.weather.midpoints)["view_h"].to_numpy() for year in years]
    assert [view.tolist() for view in years[0].views] == [[True, False, True]] * 2
    assert views[1].sum() > 1.1 * views[0].sum()
    assert np.count_nonzero(years[1].states == 1) < np.count_nonzero(years[0].states == 1)


def test_lm83_and_lightswitch_follow_the_direct_sun(inputs, weather) -> None:
    options = FEW.changed(method="five-phase")
    room = inputs({"rule": "manual", "behaviour": "LM-83"}, options=options)
    light = room_light(room)
    through = np.stack(direct_sun_by_group(light.light))
    found = ruled_year(room, light).states
    lit = room.skies.lit
    sunny = (through.sum(axis=0) >= 1000).mean(axis=0) > 0.02
    assert np.array_equal((found[lit] > 0).any(axis=1), sunny) and sunny.sum() > 300
    active = inputs({"rule": "manual"}, options=options)
    states = ruled_year(active, light).states
    south = states[:, active.control.names.index("S")]
    clock = np.arange(8760) % 24
    opens = np.flatnonzero(np.diff(south) < 0) + 1
    closes = np.flatnonzero(np.diff(south) > 0) + 1
    assert len(opens) > 20 and set(clock[opens]) == {8}, "raised by those who come first"
    assert ((clock[closes] >= 8) & (clock[closes] < 18)).all()
    assert through[:, :, np.isin(lit, closes)].max(axis=(0, 1)).min() > 0
    three = inputs({"rule": "manual"}, options=FEW.changed(method="three-phase"))
    with pytest.raises(DataError, match="direct sun"):
        shading_states(three, room_light(three))


@pytest.mark.slow
def test_haldi_and_robinson_s_people_have_seeds(inputs) -> None:
    control = {"rule": "manual", "behaviour": "Haldi-Robinson"}
    room = inputs(control)
    light = room_light(room)
    first, again = (ruled_year(room, light).states for _ in range(2))
    assert np.array_equal(first, again)
    other = ruled_year(inputs(control | {"seed": 1}), light).states
    assert 0 < np.mean(first != other)
    empty = np.arange(8760) % 24
    outside = (empty > 18) | (empty < 8)
    moved = np.concatenate([[False], (np.diff(first, axis=0) != 0).any(axis=1)])
    assert not moved[outside].any() and moved.any()


def test_every_scenario_is_a_rule_with_a_source(inputs) -> None:
    for name, scenario in scenarios().items():
        assert scenario["source"]
        rule = ShadingRule.model_validate({"scenario": name})
        assert rule.scenario == name and "$" not in rule.model_dump_json()
        if rule.rule != "schedule":
            assert rule.fault(3, {}) is None, name
        for key in scenario.get("set_points", {}):
            changed = ShadingRule.model_validate({"scenario": name, key: 0.45})
            assert changed.model_dump_json().count("0.45") == 2, (name, key)
    own = ShadingRule.model_validate({"scenario": "LM-83", "state": 1})
    assert own.state == 1 and own.behaviour == "LM-83"
    groups = {"scenario": "EN ISO 13790", "group": [{"facades": ["N"], "rule": "always"}]}
    control = OperationTables.model_validate({"control": groups}).control
    north, south = control_groups(TWO.spaces[0], control).rules
    assert (north.rule, north.scenario) == ("always", "")
    assert (south.rule, south.close_above, south.scenario) == ("irradiance", 300.0, "EN ISO 13790")


def test_a_scenario_of_a_group_is_itself(inputs) -> None:
    """Neither keys of [control] nor of its scenario change a group's own scenario or rule."""
    control = {
        "scenario": "EnergyPlus OnIfHighHorizontalSolar",
        "setpoint": 600.0,
        "most_moves": 1,
        "state": 1,
        "group": [{"facades": ["S"], "scenario": "EnergyPlus AlwaysOff"}, {"facades": ["N"], "rule": "irradiance"}],
    }
    table = OperationTables.model_validate({"control": control}).control
    (_, whole), (_, south), (_, north) = table.rules
    assert (whole.sensor, whole.close_above, whole.setpoint) == ("horizontal", 600.0, 600.0)
    alone = ShadingRule.model_validate({"scenario": "EnergyPlus AlwaysOff"})
    assert south.model_dump() == alone.model_dump()
    assert (north.sensor, north.close_above, north.setpoint) == ("window", 200.0, None)
    assert (north.most_moves, north.state) == (1, 1), "keys beside the scenario"
    rooms = [
        {"spaces": ["A"], "control": {"scenario": "EnergyPlus AlwaysOff"}},
        {"spaces": ["B"], "control": {"rule": "irradiance"}},
    ]
    del control["group"]
    tables = OperationTables.model_validate({"control": control, "rooms": rooms})
    first, second = (tables.with_rooms(one).control.rule_of(None) for one in tables.rooms)
    assert first.model_dump() == alone.model_dump()
    assert second.model_dump() == north.model_dump()


def test_delays_of_inverse_rules_by_the_room_delay_opening(inputs) -> None:
    """Closed while the room is cold: it closes at once, and opens two hours late."""
    rule = {"rule": "air temperature", "inverse": True, "open_delay_h": 2.0}
    room = inputs(rule | {"groups": "room"})
    (condition, waits), read = room_conditions(room, None, None)
    assert read == (waits,) and condition == RoomCondition(24.0, 24.0)
    assert (waits.open_delay_rows, waits.states) == (2, (0, 2))
    followed = [FollowedCondition(condition), FollowedCondition(waits)]
    felt, found = 24.0 + 2.0 * np.sin(np.arange(200) / 3.0), []
    for hour, value in enumerate(felt.tolist()):
        levels = {}
        for one in followed:
            one.follow({"air": value}, levels, hour)
            levels[one.condition] = one.level
        found.append(shading_states(room, met={waits: levels[waits]})[hour, 0])
    expected = delayed(2 - by_threshold(felt, 24.0, closed=2), 2)
    assert np.array_equal(found, expected) and 0 < np.count_nonzero(expected) < 200


def test_plans_of_other_steps_than_hours_are_refused(inputs) -> None:
    room = inputs({"rule": "predictive"})
    half = replace(room, weather=replace(room.weather, step_h=0.5))
    with pytest.raises(DataError, match="steps of 30 minutes"):
        predictive_states(SimpleNamespace(room=half))


@pytest.mark.parametrize("rule", ["cooling", "heating"])
def test_rules_by_loads_need_a_set_point(inputs, rule) -> None:
    other = {"cooling": {"heating_c": 20.0}, "heating": {"cooling_c": 26.0}}[rule]
    room = inputs({"rule": rule}, loads=other)
    with pytest.raises(DataError, match=f"loads.{rule}_c"):
        temperature_conditions(room)


def test_a_place_outside_the_room_is_refused(inputs) -> None:
    with pytest.raises(DataError, match="outside the room"):
        inputs({"rule": "work plane", "at": [100.0, 0.0, 1.0]})


@pytest.mark.parametrize(
    ("control", "words"),
    [
        ({"scenario": "EnergyPlus AlwaysOn", "state": 1}, "state: .*combines"),
        ({"scenario": "Lightswitch-2002 passive", "sensor": "roof"}, "sensor: .*combines"),
        ({"scenario": "LM 83"}, "did you mean 'LM-83'"),
        ({"scenario": "LM-83", "setpoint": 3.0}, "no such set point"),
        ({"setpoint": 3.0}, "belongs to a `scenario`"),
    ],
)
def test_an_unknown_scenario_or_set_point_is_refused(control, words, tmp_path) -> None:
    with pytest.raises(DataError, match=words):
        validated(OperationTables, {"control": control}, tmp_path)


@pytest.mark.parametrize(
    ("rule", "key"),
    [
        ({"rule": "cut-off", "slat_tilts_deg": [0, 1, 2], "sensor": "horizontal"}, "sensor"),
        ({"rule": "glare", "inverse": True}, "inverse"),
        ({"rule": "illuminance", "open_below_lx": 30000.0}, "open_below_lx"),
        ({"rule": "cooling", "until": "sunset"}, "until"),
        ({"rule": "any", "parts": [{"rule": "manual"}, {"rule": "manual", "seed": 1}]}, "parts"),
        ({"rule": "all", "parts": [{"rule": "glare"}, {"rule": "work plane"}]}, "parts"),
        (
            {
                "rule": "any",
                "parts": [
                    {"rule": "all", "parts": [{"rule": "glare"}, {"rule": "occupied"}]},
                    {"rule": "all", "parts": [{"rule": "work plane"}, {"rule": "unoccupied"}]},
                ],
            },
            "parts",
        ),
    ],
)
def test_keys_that_do_not_fit_a_rule_are_refused(rule, key) -> None:
    assert ShadingRule.model_validate(rule).fault(3, {})[0] == key


@pytest.mark.slow
def test_day_and_rule_by_loads(inputs) -> None:
    """A rule by the cooling of the step before is a condition of the room."""
    tables = OperationTables.model_validate(
        {"control": {"rule": "cooling", "close_above_w": 200.0}, "loads": {"cooling_c": 24.0}}
    )
    room = inputs({}, loads={"cooling_c": 24.0})
    space = TWO.spaces[0]
    lit = lit_room(
        TWO,
        space,
        room.systems,
        room.weather,
        FEW,
        operation=Operation(Path("o"), tables, ()),
        skies=room.skies,
        pictures=False,
    )
    year = lit.with_heat(heat_alone(lit.zone, room.weather, 3600.0, lambda *_: None))
    hours = year.operation.hours
    state = hours["shading_state_S"].to_numpy()
    power = hours["cooling_w"].to_numpy()
    assert np.array_equal(state[1:] > 0, power[:-1] > 200.0)
    assert 0 < np.count_nonzero(state) < 8000
    assert set(year.operation.shading.moves(room.weather.midpoints)["moved_by"]) == {"the room's temperature or load"}


def test_the_page_lists_every_scenario() -> None:
    page = (Path(__file__).parents[2] / "docs" / "control.md").read_text("utf-8")
    for name, scenario in scenarios().items():
        points = ", ".join(f"{v:g}" for v in scenario.get("set_points", {}).values())
        row = f"| `{name}` | {points} | {scenario['source']} | {scenario.get('missing', '')} |"
        assert row in page, name
