"""`cfs run` balances the heat of the rooms of a building together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from bim.ifc.building import read_ifc
from bim.model import Building, Space
from bim.shoebox import shoebox
from bim.to_thermal import same_surfaces
from mitsuba_cfs.progress import silent
from mitsuba_cfs.stored_arrays import StoredArrays
from scenes.demo import OFFICE, VENETIAN_BLIND, WEATHER
from scenes.heat.study import run_study
from scenes.heat.study_file import read_study
from scenes.room.heat import DaylitRoom, coupled_years, heat_alone
from scenes.room.inputs import room_inputs, skies_for
from scenes.room.operation import read_operation
from scenes.room.operation_tables import OperationTables
from scenes.room.room import operated_zone
from scenes.room.windows import in_all_windows
from scenes.run import run as rooms
from scenes.run.options import JobOptions
from tests.scenes.small_box import SMALL

EMPTY = {"gains": {"equipment_w_m2": 0.0, "persons": 0.0}, "air": {"infiltration_ach": 0.0}}
WARM = {"heating_c": 22.0}


def two_boxes() -> list[Space]:
    """Boxes without windows side by side: a shared wall, the second one's other side outdoors."""
    west, east = (shoebox(4.0, 5.0, 3.0, windows=(), name=name).spaces[0] for name in "we")
    sides = {"w": {1.0: "e"}, "e": {-1.0: "w", 1.0: None}}
    found = []
    for space in (west, east):
        faces = []
        for face in space.faces:
            beyond, other = "adiabatic", None
            if round(face.normal[0], 3) in sides[space.name]:
                other = sides[space.name][round(face.normal[0], 3)]
                beyond = "outside" if other is None else "space"
            faces.append(replace(face, adjacency=beyond, neighbour=other))
        found.append(replace(space, guid=space.name, faces=tuple(faces)))
    return found


def lit(space: Space, tables: dict, weather, skies) -> DaylitRoom:
    """A room in the dark as the run has it before its heat."""
    building = Building("box", (space,), (), ())
    operation = OperationTables.model_validate(EMPTY | tables)
    room = room_inputs(building, space, {}, weather, SMALL, operation=operation, skies=skies)
    return DaylitRoom(space, None, None, operated_zone(room), {})


def test_heat_flows_through_the_wall_as_its_resistance_says(variant, weather, skies) -> None:
    """Steady: the warm room's heat is A dT / R of the shared wall, and nothing else."""
    hours = len(weather.dry_bulb_c)
    cold = replace(weather, dry_bulb_c=np.zeros(hours), horizontal_infrared=np.full(hours, 315.6))
    spaces = two_boxes()
    rooms = [lit(s, {"loads": WARM} if s.name == "w" else {}, cold, skies) for s in spaces]
    for room in rooms:
        for name in ("inside", "facade"):
            getattr(room.zone.solar, name)[:] = 0.0
    found, said = coupled_years(rooms, cold, 3600.0, OperationTables())
    warm, between = found[0], f"wall {_shared(rooms[0])} (e)_c"
    through = warm.heat.temperatures[between] - found[1].heat.temperatures[f"wall {_shared(rooms[1])} (w)_c"]
    wall = rooms[0].zone.zone.surfaces[_shared(rooms[0]) - 1]
    expected = wall.area * through / sum(layer.resistance for layer in wall.layers)
    late = slice(4000, 8000)
    got = warm.operation.hours["heating_w"]
    assert got[late].mean() > 100.0
    assert got[late].mean() == pytest.approx(expected[late].mean(), rel=1e-3)
    assert 2.0 < found[1].heat.air_c[late].mean() < 20.0
    assert len(said) == 1 and "15.0 m2" in said[0]
    alone, _ = heat_alone(rooms[1].zone, cold, 3600.0)
    assert alone.air_c[late].mean() < 0.5


def _shared(room: DaylitRoom) -> int:
    """The number of the surface that another room lies behind, from 1."""
    (found,) = [i for i, guid in enumerate(room.zone.room.neighbours) if guid]
    return found + 1


def test_rooms_held_on_disk_have_the_same_year(variant, weather, skies) -> None:
    rooms = [lit(s, {"loads": WARM} if s.name == "w" else {}, weather, skies) for s in two_boxes()]
    store = StoredArrays()
    held = [store.stored(room) for room in rooms]
    found, _ = coupled_years(rooms, weather, 3600.0, OperationTables())
    again, _ = coupled_years(held, weather, 3600.0, OperationTables(), store=store)
    for one, other in zip(found, again, strict=True):
        for name in ("temperatures", "gains", "comfort"):
            table, held_table = getattr(one.heat, name), getattr(other.heat, name)
            pd.testing.assert_frame_equal(table, held_table, check_freq=False)
        pd.testing.assert_frame_equal(one.operation.hours, other.operation.hours)
        assert one.heat.comfort_summary == other.heat.comfort_summary
        assert not other.heat.temperatures["air_c"].to_numpy().flags.owndata


def test_a_room_moved_to_its_equal_has_that_ones_neighbours(variant, weather, skies) -> None:
    west, _ = two_boxes()
    faces = tuple(replace(f, neighbour=f.neighbour and "other") for f in west.faces)
    twin = replace(west, guid="twin", name="twin", faces=faces)
    assert same_surfaces(west, twin)
    shut = tuple(replace(f, adjacency="adiabatic", neighbour=None) for f in faces)
    assert not same_surfaces(west, replace(twin, faces=shut))
    zone = lit(west, {}, weather, skies).zone.moved_to(twin)
    assert zone.zone.name == twin.label and zone.space is twin
    assert [guid for guid in zone.room.neighbours if guid] == ["other"]


OPERATED = """
[gains]
equipment_w_m2 = 5
[air]
door_m3_s = 0.02
[[rooms]]
spaces = ["East office"]
[rooms.loads]
heating_c = 24
"""
TRACE = """
[trace]
view_factors = false
method = "three-phase"
patch_samples = 512
sensor_samples = 256
sensor_spacing = 2.0
"""


def test_a_run_has_the_temperatures_of_a_coupled_study(variant, weather, blind, tmp_path) -> None:
    """The demo's rooms, one heated, an open door: `cfs thermal` with `couple` is the same."""
    (tmp_path / "operation.toml").write_text(OPERATED)
    path = tmp_path / "study.toml"
    path.write_text(
        f'building = "{OFFICE}"\nweather = "{WEATHER}"\ncouple = true\nstep_minutes = 60\n'
        f'[[system]]\nbsdf = "{VENETIAN_BLIND}"\n{OPERATED}{TRACE}'
    )
    study = read_study(path)
    expected, _ = run_study(study, silent)
    building = read_ifc(OFFICE)
    systems = in_all_windows(building, blind)
    operation = read_operation(tmp_path / "operation.toml")
    inputs = rooms.Inputs(building, list(building.spaces), weather, systems, operation)
    room = study.options.changed(picture_size=32, picture_samples=1, picture_count=1)
    skies = skies_for(weather, room.sampling, **room.sky)
    options = JobOptions(OFFICE, WEATHER, cache=False, room=room)
    heard: list[str] = []
    found, issues, notes = rooms.computed_rooms(
        inputs,
        skies,
        options,
        silent,
        on_light=lambda room: heard.append(f"light of {room.space.name}"),
        on_room=lambda room: heard.append(room.space.name),
    )
    names = [space.name for space in building.spaces]
    assert heard == [f"light of {name}" for name in names] + names and not issues
    assert "it flows through 18.0 m2" in notes[-1]
    for year, theirs in zip(found, expected, strict=True):
        np.testing.assert_allclose(year.heat.air_c, theirs.hours["air_c"], atol=1e-3)
        own = year.operation.summary["heating_kwh"]
        assert own == pytest.approx(theirs.summary["heating_kwh"], abs=0.1)
