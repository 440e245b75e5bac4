"""Shading control by a function of each hour: the same states as rules, temperatures, glare."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import scenes as cfs
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.light import eye_illuminance, illuminance
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.room.control_hour import ControlError, ControlHour, controlled_states
from scenes.room.glare import rating_of
from scenes.room.inputs import RoomInputs, room_inputs
from scenes.room.light import room_light
from scenes.room.operation import Operation
from scenes.room.operation_tables import OperationTables
from scenes.room.room import compute_room
from scenes.room.shading import shading_states
from scenes.room.solar import seasonal_outdoors
from scenes.room.windows import in_all_windows
from tests.scenes.small_box import FEW, HOURS, TWO
from thermal.control import cut_off_angle

TILTS = [0.0, 30.0, 60.0]
CUT_OFF = {"rule": "cut-off", "slat_tilts_deg": TILTS, "slat_width": 0.08, "slat_spacing": 0.08}
WARM = {"rule": "operative temperature", "close_above_c": 24.0, "open_below_c": 23.0, "state": 2}
LAMPS = {"gains": {"lighting_w_m2": 8.0}, "loads": {"heating_c": 20.0, "cooling_c": 26.0}}


@pytest.fixture
def inputs(variant, glass, milk, blind, weather, skies):
    def of(function, control: dict | None = None, few_hours: bool = True, **tables) -> RoomInputs:
        operation = OperationTables.model_validate({"control": control or {}, **tables})
        return room_inputs(
            TWO,
            TWO.spaces[0],
            in_all_windows(TWO.spaces[0], glass, milk, blind),
            weather,
            FEW,
            operation=operation,
            skies=skies if few_hours else None,
            controller=function,
        )

    return of


def states_of(room: RoomInputs) -> np.ndarray:
    """The states [H, G] by the room's function."""
    light = room_light(room)
    return controlled_states(room, light, seasonal_outdoors(room, light))


@pytest.mark.parametrize(
    "control",
    [
        CUT_OFF,
        {"rule": "irradiance", "close_above": 150.0, "hold_h": 3.0},
        {"rule": "glare", "limit_lx": 1500.0},
        {"rule": "any", "parts": [CUT_OFF, {"rule": "outdoor temperature", "state": 1}]},
    ],
    ids=["cut-off", "irradiance", "glare", "any"],
)
def test_the_rules_of_a_file_are_a_function_of_the_hour(inputs, control) -> None:
    room = inputs(ControlHour.by_rules, control)
    light, by_file = room_light(room), inputs(None, control)
    outdoors = seasonal_outdoors(room, light)
    expected = shading_states(by_file, light, outdoors)
    assert expected.any()
    assert np.array_equal(controlled_states(room, light, outdoors), expected)


def test_a_function_of_beam_and_profile_angle_is_the_rule_of_cut_off(inputs) -> None:
    limits = np.degrees(cut_off_angle(np.radians(TILTS), 0.08, 0.08))

    def own(hour: ControlHour) -> list[int]:
        stops = hour.profile_deg[:, None] >= limits
        closed = np.where(stops.any(axis=1), stops.argmax(axis=1), len(TILTS) - 1)
        return np.where(hour.beam > 0, closed, 0).tolist()

    expected = shading_states(inputs(None, CUT_OFF))
    assert np.array_equal(states_of(inputs(own)), expected)


def test_light_and_glare_of_a_state_are_those_of_the_year_in_it(inputs) -> None:
    seen = {}

    def own(hour: ControlHour) -> dict[str, int]:
        if hour.index in HOURS:
            mixed = {"S": 2, "N": 1}
            seen[hour.index] = hour.sensors_lx(mixed), hour.eye_lx(mixed), hour.dgp(mixed)
        return {"S": 2, "N": 1} if hour.occupied else {"N": 0}

    room = inputs(own)
    states = states_of(room)
    by_name = {name: states[:, g] for g, name in enumerate(room.control.names)}
    assert room.windows.control.tolist() == [0, 1]
    assert by_name["S"].max() == 2 and by_name["N"].max() == 1
    assert by_name["S"][23] == 2 and by_name["N"][23] == 0  # a group that is not named stays
    light = room_light(room)
    rows = light.states(np.tile(states[HOURS[0]], (8760, 1)))
    lux, eye = illuminance(light.light, rows), eye_illuminance(light.light, rows)
    rated = hourly_glare(light.light, "DGP", rows, options=rating_of(room.options.outputs)).dgp
    for number, hour in enumerate(HOURS):
        assert seen[hour][0] == pytest.approx(lux[:, number], rel=1e-5)
        assert seen[hour][1] == pytest.approx(eye[number], rel=1e-5)
        assert seen[hour][2] == pytest.approx(rated[number], abs=2e-3)  # V of all patches


def test_temperatures_so_far_are_those_of_the_result(glass, milk, blind, weather, skies) -> None:
    """At the end of the hour before; an hour is one step here, so its mean is its end."""
    read = []

    def own(hour: ControlHour) -> int:
        read.append((hour.air_c, hour.operative_c))
        return 2 if hour.operative_c > 24.0 else 0

    space = TWO.spaces[0]
    operation = Operation(Path("own.toml"), OperationTables.model_validate(LAMPS), ())
    year = compute_room(
        TWO,
        space,
        in_all_windows(space, glass, milk, blind),
        weather,
        FEW,
        operation=operation.controlled_by(own),
        skies=skies,
        pictures=False,
    )
    states = year.operation.shading.states
    assert year.operation.shading.rules == ("function",) * 2
    assert 100 < np.count_nonzero(states[:, 0]) < 8000
    air, operative = np.array(read).T
    later = slice(480, None)  # the warm-up day has another choice
    assert air[later] == pytest.approx(year.heat.air_c.to_numpy()[479:-1], abs=0.01)
    assert operative[later] == pytest.approx(year.heat.operative_c.to_numpy()[479:-1], abs=0.05)
    assert np.array_equal(states[:, 0], np.where(operative > 24.0, 2, 0))


def test_a_rule_by_temperature_is_a_function_too(glass, milk, blind, weather, skies) -> None:
    space, found = TWO.spaces[0], []
    tables = OperationTables.model_validate({"control": WARM | {"open_delay_h": 2.0}} | LAMPS)
    for controller in (None, ControlHour.by_rules):
        operation = Operation(Path("own.toml"), tables, (), controller)
        year = compute_room(
            TWO,
            space,
            in_all_windows(space, glass, milk, blind),
            weather,
            FEW,
            operation=operation,
            skies=skies,
            pictures=False,
        )
        found.append(year.operation.shading.states[480:])
    assert found[0].any() and not found[0].all()
    assert np.count_nonzero(found[0] != found[1]) == 0


@pytest.mark.parametrize(
    ("states", "words"),
    [
        (3, "01-01 00:30: state 3: expected 0 to 2"),
        ([0], "1 states for 2 groups"),
        ({"West": 1}, "no group 'West'; there are"),
        ({"S": 0.5}, "state 0.5 of group S"),
    ],
)
def test_what_is_no_state_is_refused_with_its_hour(inputs, states, words) -> None:
    with pytest.raises(ControlError, match=words):
        states_of(inputs(lambda hour: states))


BOX = {"width": 3.0, "depth": 4.0, "height": 2.8, "window": [{"x": 0.5, "sill": 0.9, "width": 2.0, "height": 1.5}]}


def test_a_study_takes_functions_and_computes_them_anew(variant, tmp_path) -> None:
    file = tmp_path / "own.toml"
    glazing = VENETIAN_BLIND.parent / "glazing.xml"
    file.write_text(f'[[system]]\nbsdf = "{glazing}"\n[[system]]\nbsdf = "{VENETIAN_BLIND}"\n')
    calls = []

    def closed(hour: ControlHour) -> int:
        calls.append(hour.index)
        return 1

    study = cfs.Study.model_validate(
        {
            "room": [{"name": "cell", "box": BOX}],
            "system": [{"name": "own", "operation": file, "control": closed}, {"name": "file", "operation": file}],
            "climate": [{"name": "Chicago", "weather": WEATHER}],
            "methods": ["three-phase"],
            "glare": "none",
            "options": {
                "sensor_spacing": 1.0,
                "sensor_samples": 256,
                "patch_samples": 256,
                "sky_subdivision": 1,
                "heat_step_s": 3600.0,
            },
        }
    )
    first = cfs.run_study(study, tmp_path / "out")
    assert not first.first_error and len(calls) == 8760
    light = dict(zip(first.table["system"], first.table["da300"], strict=True))
    assert light["own"] < light["file"]
    again = cfs.run_study(study, tmp_path / "out")
    assert len(calls) == 2 * 8760 and again.reused == 1


def test_a_function_needs_the_states_of_an_operation() -> None:
    with pytest.raises(ValueError, match="control: needs an operation"):
        cfs.simulate(TWO.room(TWO.spaces[0].name), str(VENETIAN_BLIND), str(WEATHER), control=max)


@pytest.mark.parametrize("returned", [None, 1.0, "2"])
def test_what_is_no_state_is_named_with_its_hour(inputs, returned) -> None:
    with pytest.raises(ControlError, match="control at 01-01 00:30: expected a state, one of each"):
        states_of(inputs(lambda hour: returned))


@pytest.fixture
def unequal(glass, milk, blind, weather, skies):
    """A room whose windows move together, the second with two states of three."""

    def of(function, **control) -> RoomInputs:
        south, north = TWO.spaces[0].windows
        tables = {"control": {"groups": "room", **control}, "loads": {"heating_c": 20.0}}
        return room_inputs(
            TWO,
            TWO.spaces[0],
            {south.guid: (glass, milk, blind), north.guid: (glass, milk)},
            weather,
            FEW,
            operation=OperationTables.model_validate(tables),
            skies=skies,
            controller=function,
        )

    return of


def test_a_window_with_fewer_states_is_in_its_last_in_the_balance(unequal) -> None:
    read = []

    def own(hour: ControlHour) -> int:
        if hour.index < 3:
            read.append(hour.air_c)
        return 2

    assert states_of(unequal(own)).max() == 2
    assert np.isfinite(read).all()


def test_plans_are_made_of_windows_with_fewer_states(unequal) -> None:
    room = unequal(None, rule="predictive", predictive={"horizon_h": 2, "glare": "Ev"})
    states = states_of(room)
    assert 0 <= states.min() and states.max() <= 2
