"""Predictive control of a room: the cheapest combination without glare, rated by its pictures."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.light import with_pictures
from scenes.heat.study_file import StudyFile
from scenes.room.control_groups import control_groups
from scenes.room.control_hour import ControlHour, controlled_states
from scenes.room.control_year import ControlYear
from scenes.room.glare import rating_of
from scenes.room.inputs import room_inputs
from scenes.room.light import room_light
from scenes.room.operation import SharedYear
from scenes.room.operation_tables import OperationTables
from scenes.room.predictive import Planner, predictive_states
from scenes.room.solar import seasonal_outdoors
from scenes.room.windows import in_all_windows
from tests.scenes.small_box import HOURS
from tests.scenes.test_control_function import FEW, TWO

TABLES = {"gains": {"lighting_w_m2": 10.0, "occupied": [0, 24]}, "loads": {"heating_c": 20.0, "cooling_c": 26.0}}


@pytest.fixture(scope="module")
def of(variant, glass, milk, blind, weather, skies):
    """The year of the room with a table of `predictive`, and keys of its control."""

    def year(limit: float, controller=None, gains=None, shared=None, **predictive) -> ControlYear:
        control = {"rule": "predictive", "limit_dgp": limit, "predictive": predictive}
        if shared:
            control["group"] = [{"facades": ["S"], "across": "building"}]
        tables = TABLES | {"gains": TABLES["gains"] | (gains or {})}
        room = room_inputs(
            TWO,
            TWO.spaces[0],
            in_all_windows(TWO.spaces[0], glass, milk, blind),
            weather,
            FEW,
            operation=OperationTables.model_validate({"control": control} | tables),
            skies=skies,
            controller=controller,
            shared=shared,
        )
        light = room_light(room)
        return ControlYear(room, light, seasonal_outdoors(room, light))

    return year


@pytest.fixture(scope="module")
def every_dgp(of) -> np.ndarray:
    """DGP of each combination in the four hours [M, 4], rated each for itself."""
    year = of(0.4)
    light = with_pictures(year.light.light)
    rated = []
    for states in year.combinations:
        rows = year.light.states(np.tile(year.of_windows(states), (8760, 1)))
        rows_of = rating_of(FEW.outputs)
        rated.append(hourly_glare(light, "DGP", rows, options=rows_of).dgp)
    return np.array(rated)


@pytest.mark.parametrize("limit", [0.25, 0.32])
def test_an_hour_takes_the_cheapest_combination_without_glare(of, every_dgp, limit) -> None:
    """Horizon of one hour: the hour's energy of all nine combinations, by the same model."""
    year = of(limit, horizon_h=1, forecast="perfect")
    found = predictive_states(year)
    planner = Planner(year, year.room.operation, year.room.control.rules[0])
    planner.glare[list(HOURS)], planner.rated[:] = every_dgp.T, True
    known = planner.plan()
    assert (every_dgp.min(axis=0) < limit).any() and (every_dgp.max(axis=0) > limit).any()
    for number, hour in enumerate(HOURS):
        chosen = year.number_of(found[hour])
        assert chosen == known.states[hour]
        fine = every_dgp[:, number] <= limit
        if fine.any():
            assert fine[chosen]
        else:
            assert chosen == every_dgp[:, number].argmin()


def test_plans_rate_glare_with_the_error_of_the_tracing(of) -> None:
    """Two standard errors above the DGP that a control function reads."""
    year, hours = of(0.32), np.array(HOURS)
    planner = Planner(year, year.room.operation, year.room.control.rules[0])
    assert planner.rate(np.zeros(8760, dtype=np.int64)) == len(HOURS)
    first = tuple(year.combinations[0].tolist())
    dgp, above = year.dgp_of(first, hours), year.dgp_of(first, hours, sigmas=2.0)
    assert (above > dgp).all() and (above < dgp + 0.1).all()
    assert planner.glare[hours, 0] == pytest.approx(above)
    assert year.dgp(first, HOURS[0]) == dgp[0]


def test_plans_are_the_control_of_a_file(of) -> None:
    """As states of the window groups, and as a function of the hour."""
    year = of(0.32)
    expected = predictive_states(year)[:, year.room.windows.control]
    assert np.array_equal(controlled_states(year.room, year.light, year.outdoors), expected)
    called = of(0.32, ControlHour.by_rules)
    states = controlled_states(called.room, called.light, called.outdoors)
    assert np.array_equal(states, expected)


def test_the_glare_term_of_the_eye_is_used_where_it_is_asked_for(of) -> None:
    year = of(0.32, glare="Ev")
    planner = Planner(year, year.room.operation, year.room.control.rules[0])
    assert planner.rated.all()
    eye = np.stack([year.eye_lx(tuple(s)) for s in year.combinations.tolist()], axis=1)
    assert planner.glare[list(HOURS)] == pytest.approx(6.2e-5 * eye + 0.184)
    room = of(0.32).room
    by_picture = Planner(of(0.32), room.operation, room.control.rules[0])
    assert by_picture.glare[list(HOURS)] == pytest.approx(0.95 * 5.87e-5 * eye + 0.159)
    assert not by_picture.rated.any()


def test_plans_keep_the_states_of_a_group_that_other_rooms_share(of) -> None:
    """The south windows as they are told; the plans choose for the north windows alone."""
    told = np.arange(8760) % 3
    year = of(0.32, shared={"S": SharedYear(told, np.full(8760, -1), ())})
    south = year.groups.index("S")
    found = predictive_states(year)
    assert np.array_equal(found[:, south], told)
    free = predictive_states(of(0.32))
    assert not np.array_equal(free[:, south], told)
    called = of(0.32, lambda hour: 0, shared={"S": SharedYear(told, np.full(8760, -1), ())})
    states = controlled_states(called.room, called.light, called.outdoors)
    assert np.array_equal(states[:, called.room.windows.control == south][:, 0], told)
    assert not states[:, called.room.windows.control != south].any()


def test_plans_dim_each_zone_of_lamps_by_its_own_sensor(of) -> None:
    """The lamps of the plan are those of the room's year in its states; a zone of all lamps changes nothing."""
    facade = {"name": "facade", "at": [1.5, 0.5], "share": 0.6, "lighting_target_lx": 300.0}
    zones = [facade, {"name": "back", "share": 0.4, "lighting_dimmed": False}]
    year = of(0.32, gains={"lighting_zone": zones})
    plan = Planner(year, year.room.operation, year.room.control.rules[0]).plan()
    hours, lamps = list(HOURS), []
    for hour in hours:
        states = tuple(year.combinations[plan.states[hour]].tolist())
        lamps.append(year.heat(states).lamps[hour])
    assert plan.lamps[hours] == pytest.approx(lamps)
    assert min(lamps) >= 0.4 * 10.0 * year.room.space.floor_area, "the back is not dimmed"
    assert min(lamps) < 0.9 * 10.0 * year.room.space.floor_area
    whole = of(0.32, gains={"lighting_zone": [{"name": "all", "share": 1.0}]})
    assert np.array_equal(predictive_states(whole), predictive_states(of(0.32)))


def test_plans_are_of_all_groups_and_need_light() -> None:
    groups = [{"facades": ["N"], "rule": "always"}]
    with pytest.raises(ValueError, match="plans all groups"):
        OperationTables.model_validate({"control": {"rule": "predictive", "group": groups}})
    study = {"weather": "a.epw", "building": "a.ifc", "control": {"rule": "predictive"}}
    with pytest.raises(ValueError, match="is of `cfs run`"):
        StudyFile.model_validate(study)


def test_keys_that_plans_do_not_follow_are_refused() -> None:
    with pytest.raises(ValueError, match=r"hold_h: the rule .* does not wait"):
        OperationTables.model_validate({"control": {"rule": "predictive", "hold_h": 2.0}})
    (space,) = TWO.spaces
    group = {"windows": [space.windows[1].guid], "limit_dgp": 0.3}
    tables = {"control": {"rule": "predictive", "group": [group]}}
    with pytest.raises(DataError, match=r"control\.limit_dgp: .* one for all groups of a room"):
        control_groups(space, OperationTables.model_validate(tables).control)


def test_groups_of_an_entry_of_rooms_are_planned_with_the_others() -> None:
    entry = {"spaces": ["A"], "control": {"group": [{"windows": ["w"], "rule": "glare"}]}}
    tables = OperationTables.model_validate({"control": {"rule": "predictive"}, "rooms": [entry]})
    faults = [one.control_fault(3) for one in tables.variants]
    assert faults[0] is None and faults[1] is not None
    assert faults[1][0] == "control.group.0.rule" and "plans all groups" in faults[1][1]
