"""What a building's file states of its rooms' use, its sensors and views: used by the commands."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bim.held_sensors import ModelGrid, ModelView
from bim.honeybee.building import read_honeybee
from bim.shoebox import WindowRectangle, shoebox
from bim.use import ALWAYS, ScheduledValue, StatedUse, YearSchedule
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.images.view import View, fisheye
from scenes.demo import WEATHER
from scenes.head import head_of, unused_notes
from scenes.heat.study import run_study
from scenes.heat.study_file import read_study
from scenes.input_files import read_weather
from scenes.room.ground import ground_note
from scenes.room.inputs import FileSensors
from scenes.room.operation import OperationHours, stated_note, unstated_note, with_stated_uses
from scenes.room.operation_tables import OperationTables
from scenes.room.options import RoomOptions
from scenes.room.room import compute_room
from scenes.room_views import held_fisheyes, held_view
from tests.bim.honeybee_models import used_model, write
from tests.conftest import REPOSITORY

TWO_ROOMS = REPOSITORY / "docs" / "tutorials" / "two_rooms.hbjson"


@pytest.fixture(scope="module")
def used(tmp_path_factory):
    return read_honeybee(write(used_model(), tmp_path_factory.mktemp("used"), "used.hbjson"))


@pytest.fixture(scope="module")
def weather():
    return replace(read_weather(WEATHER), first_weekday=0)  # the year begins on a Monday


def hours_of(building, weather, name, tables=None) -> OperationHours:
    tables = with_stated_uses(OperationTables() if tables is None else tables, building)
    return OperationHours(tables.of_room(building, building.space(name)), weather)


def test_the_files_schedules_are_hours_of_the_year(used, weather):
    """By hand: Tuesday 2 January, hour 8 is 0.55 of 4 people of 90 W and of 3 and 6 W/m2."""
    hours = hours_of(used, weather, "Office")
    hour = 24 + 8
    assert hours.lamps(40.0)[hour] == pytest.approx(0.55 * 120)
    assert hours.equipment(40.0)[hour] == pytest.approx(0.55 * 240)
    assert hours.heat(40.0)[hour] == pytest.approx(0.55 * (240 + 4 * 90))
    assert not hours.present[5 * 24 : 7 * 24].any()  # the weekend
    monday = 24 * (31 + 28 + 31 + 30 + 31 + 30 + 1)  # 2 July
    assert np.unique(hours.present[monday : monday + 24]) == 0.5
    loads, air = hours.loads(), hours.outdoor_air()
    assert np.unique(loads.heating_c) == 21 and np.unique(loads.cooling_c) == 25
    assert loads.heating_limit == 900
    assert np.max(air["infiltration_ach"]) == pytest.approx(3e-4 * 94 * 3600 / 120)
    assert air["leakage"].factors == (0.6, 0.0, 0.2, 0.0)
    assert hours.tables.gains.lighting_dimmed is False


def test_holidays_of_the_operation_are_the_files_holidays(used, weather):
    tables = OperationTables(calendar={"holidays": ["01-02"]})
    assert not hours_of(used, weather, "Office", tables).present[24:48].any()


def test_an_operation_file_goes_before_the_buildings(used, weather):
    tables = OperationTables(gains={"equipment_w_m2": 1.0}, rooms=[{"spaces": ["Hall"], "gains": {"persons": 7.0}}])
    office, hall = (hours_of(used, weather, name, tables) for name in ("Office", "Hall"))
    assert office.tables.gains.equipment_w_m2 == hall.tables.gains.equipment_w_m2 == 1.0
    assert (office.tables.gains.persons, hall.tables.gains.persons) == pytest.approx((4.0, 7.0))
    assert hall.lamps(32.0).max() == pytest.approx(256.0)  # what it does not say stays


def test_a_file_without_uses_changes_nothing():
    building, tables = read_honeybee(TWO_ROOMS), OperationTables()
    assert with_stated_uses(tables, building) is tables
    assert not stated_note(building)


def test_a_basement_says_that_its_ground_has_no_sun():
    ground = {"kind": "basement", "perimeter": 20.0, "depth": 2.5, "area": 20.0}
    below = {"ground": ground}
    (note,) = ground_note(OperationTables(envelope=below), shoebox())
    assert "sun and longwave radiation" in note
    one_room = OperationTables(rooms=[{"spaces": ["Cellar"], "envelope": below}])
    assert ground_note(one_room, shoebox()) == (note,)
    slab = {"ground": {"kind": "slab", "perimeter": 20.0}}
    assert not ground_note(OperationTables(envelope=slab), shoebox())
    assert not ground_note(OperationTables(), shoebox())


def test_ground_that_nobody_states_is_named():
    on_ground = shoebox(4, 5, 3, adjacency={"floor": "ground"}, windows=(WindowRectangle(0.5, 1.0, 3.0, 1.5),))
    (note,) = ground_note(OperationTables(), on_ground)
    assert "20 m2 and 4 m of outer walls" in note
    slab = {"ground": {"kind": "slab", "perimeter": 20.0}}
    assert not ground_note(OperationTables(envelope=slab), on_ground)


def test_gains_and_leaks_that_nobody_states_are_named(used):
    building, tables = read_honeybee(TWO_ROOMS), OperationTables(gains={"persons": 0})
    (note,) = unstated_note(tables, building, "use.toml")
    assert note == (
        "Not stated in use.toml: equipment 8 W/m2 (gains.equipment_w_m2), use from 8 to 18 o'clock (gains.occupied), "
        "0.5 air changes per hour (air.infiltration_ach)."
    )
    stated = {"equipment_w_m2": 0, "persons": 0, "occupied": [0, 24]}
    whole = OperationTables(gains=stated, air={"infiltration_ach": 0.5})
    assert not unstated_note(whole, building, "use.toml")
    (note,) = unstated_note(RoomOptions(), building)
    assert note == (
        "Gains and air, as no operation file states them: equipment 8 W/m2, one person of 75 W per 15 m2, "
        "both daily from 8 to 18 o'clock; 0.5 air changes per hour."
    )
    both = replace(used, uses={space.guid: used.uses["Office"] for space in used.spaces})
    assert not unstated_note(OperationTables(), both, "use.toml")
    assert not unstated_note(RoomOptions(), both)


def test_values_that_cannot_be_name_the_file(used):
    use = StatedUse(heating_c=YearSchedule.constant("hot", 90.0))
    wrong = replace(used, uses={"Office": use})
    tables = with_stated_uses(OperationTables(), wrong).of_room(wrong, wrong.space("Office"))
    with pytest.raises(DataError, match=r"hot.*expected -30 to 60 C"):
        OperationHours(tables, read_weather(WEATHER)).check()
    many = replace(used, uses={"Office": StatedUse(persons=ScheduledValue(1e6, ALWAYS))})
    with pytest.raises(DataError, match=r"used.hbjson: gains.persons: expected 0 to 10000"):
        with_stated_uses(OperationTables(), many)


def test_fisheyes_of_the_file_are_the_views_of_its_room(used):
    """One in the office, one in the hall, one outdoors; glare needs the whole hemisphere."""
    views = (
        ModelView("wide", View("perspective", (2, 4, 1.2), (0, -1, 0))),
        ModelView("desk", fisheye((2, 4, 1.2), (0, -1, 0))),
        ModelView("hall", fisheye((7, 4, 1.2), (0, -1, 0))),
        ModelView("lawn", fisheye((2, -4, 1.2), (0, 1, 0))),
    )
    building = replace(used, views=views)
    office, hall = (building.space(name) for name in ("Office", "Hall"))
    (desk,) = held_fisheyes(building, office, 64)
    assert (desk.name, desk.view.width) == ("desk", 64)
    assert [one.name for one in held_fisheyes(building, hall, 64)] == ["hall"]
    assert held_view(building, office).name == "wide"
    assert held_view(used, office) is None
    assert FileSensors.of(building, hall).view == views[2].view


def test_a_grid_of_the_file_has_the_light_of_its_own_sensors(used, weather, variant):
    """Beside the work plane's: at the same sensors the same light, to a wall another; none outside.

    0.15: both sides' noise of 256 paths.
    """
    office = used.space("Office")
    options = RoomOptions.of(
        method="three-phase",
        sky_subdivision=1,
        sensor_samples=256,
        patch_samples=64,
        sensor_spacing=2.0,
        picture_count=0,
    )
    from scenes.fenestration.resolver import fill_windows
    from scenes.fenestration.systems import WindowOverrides
    from scenes.room.light import grid_points

    points = grid_points(office, options.grid)
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    outside = np.array([[2.0, -3.0, 0.8]])
    grids = (
        ModelGrid("plane", np.concatenate([points, outside]), np.concatenate([up, up[:1]])),
        ModelGrid("walls", points[:2], np.tile([0.0, -1.0, 0.0], (2, 1))),
    )
    building = replace(used, grids=grids)
    systems = fill_windows(office.windows, WindowOverrides(), building.file)
    year = compute_room(building, office, systems, weather, options, pictures=False)
    plane, walls = year.daylight.grids
    assert len(plane.sensor_metrics) == len(points) == len(year.daylight.points)
    assert len(walls.sensor_metrics) == 2
    mean = "mean_illuminance_lx"
    own, held = year.daylight.room_metrics[mean], plane.metrics[mean]
    assert own == pytest.approx(held, rel=0.15)
    upwards = plane.sensor_metrics[mean].iloc[:2].mean()
    assert not np.isclose(walls.metrics[mean], upwards, rtol=0.15)


@pytest.mark.slow
def test_cfs_thermal_has_the_files_set_points(tmp_path):
    """The office has a system for 21 degC, the hall none: its air follows the winter."""
    model = used_model()
    del model["properties"]["energy"]["hvacs"][0]["heating_limit"]
    write(model, tmp_path, "used.hbjson")
    study = tmp_path / "study.toml"
    study.write_text(
        f'building = "used.hbjson"\nweather = "{Path(WEATHER).as_posix()}"\nstep_minutes = 60\n'
        "[trace]\npatch_samples = 64\nsensor_samples = 64\nview_factors = false\n"
    )
    years, notes = run_study(read_study(study), lambda *_: None)
    office, hall = (year.hours["air_c"] for year in years)
    assert hall.min() < 15 < office.min()
    assert any(note.startswith("Gains, outdoor air and set points of 2 of 2 rooms are from ") for note in notes)
    assert any(note.startswith("The file states set points (rooms: Hall)") for note in notes)


def test_commands_with_rules_of_their_own_say_what_they_leave_out(used):
    """`cfs comply` has the uses, sensors and eyes of its rules."""
    said = unused_notes(replace(used, grids=(ModelGrid("g", np.zeros((1, 3)), np.eye(3)[2:]),)))
    assert said[-1] == (
        "used.hbjson contains uses of rooms (2), sensor grids (1) and views (0); they are not used here."
    )
    assert not unused_notes(read_honeybee(TWO_ROOMS))
    head = head_of(used)  # which every command shows
    assert any(line.startswith("not used: ") and "set points" in line for line in head.lines)
