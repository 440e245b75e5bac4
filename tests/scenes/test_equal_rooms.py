"""Rooms that are equal but for their place are computed once, and given the result each."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from bim.model import Building, Element, Space
from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.progress import silent
from scenes.explore.case_files import read_case, read_data
from scenes.explore.folder import write_rooms
from scenes.room.operation import read_operation
from scenes.room.options import RoomOptions
from scenes.room.room import compute_room, lit_room
from scenes.room.series import OutdoorLight, moved_result, same_systems
from scenes.room.windows import in_all_windows
from scenes.run.options import JobOptions
from tests.explore.synthetic import explored_run
from tests.scenes.small_box import BOX, ROOM, SMALL

SHIFT = np.array([10.0, 0.0, 3.0])


def moved(building: Building, offset: tuple[float, float, float], name: str):
    """The building's room somewhere else, under another name."""
    space = building.spaces[0]
    faces = tuple(replace(f, triangles=f.triangles + offset) for f in space.faces)
    windows = tuple(replace(w, triangles=w.triangles + offset, guid=f"{w.guid}-{name}") for w in space.windows)
    return replace(space, faces=faces, windows=windows, guid=f"{name}-guid", name=name)


def seen_alike(building: Building, *rooms: Space) -> bool:
    one, other = (OutdoorLight(building, room, SMALL.sampling, None) for room in rooms)
    return one.same(other)


def test_an_equal_room_has_the_results_of_its_template(variant, weather, skies, glass, blind) -> None:
    """Shifted, the room is computed anew to the same numbers; what shades one alone tells them."""
    twin = moved(BOX, (10.0, 0.0, 3.0), "twin")
    building = replace(BOX, spaces=(ROOM, twin))
    systems = in_all_windows(ROOM, glass) | in_all_windows(twin, glass)
    assert same_systems(ROOM, twin, systems)
    assert not same_systems(ROOM, twin, in_all_windows(ROOM, glass) | in_all_windows(twin, blind))
    assert seen_alike(building, ROOM, twin)
    wall = np.array([[[8, -2, 0], [14, -2, 0], [14, -2, 6]]], dtype=float)
    shaded = replace(building, elements=(Element("w", "wall", "IfcWall", wall, 0.2, 0.2),))
    assert not seen_alike(shaded, ROOM, twin)

    options = SMALL.changed(sensor_samples=2048)
    one, other = (
        compute_room(building, s, systems, weather, options, skies=skies, pictures=False) for s in (ROOM, twin)
    )
    given = moved_result(one, twin)
    assert given.template == "room" and given.space is twin
    np.testing.assert_allclose(given.daylight.points, other.daylight.points, atol=1e-9)
    np.testing.assert_allclose(given.glare.view.position, other.glare.view.position, atol=1e-9)
    mean = given.daylight.illuminance.mean(axis=0)
    # the same random numbers; single paths go another way by rounding of coordinates
    np.testing.assert_allclose(mean, other.daylight.illuminance.mean(axis=0), rtol=0.03)


def test_an_equal_room_is_offered_by_its_name_in_the_explorer(tmp_path) -> None:
    """It has its own plan, and the files of the pictures of its template."""
    run = explored_run()
    one = run.spaces[0]
    twin = replace(
        one.space,
        faces=tuple(replace(f, triangles=f.triangles + SHIFT) for f in one.space.faces),
        windows=tuple(replace(w, triangles=w.triangles + SHIFT) for w in one.space.windows),
        guid="twin-guid",
        name="twin",
    )
    write_rooms(replace(run, spaces=(one, moved_result(one, twin))), tmp_path)
    entries = read_case(tmp_path)["rooms"]
    assert [entry["name"] for entry in entries] == [one.space.label, twin.label]
    assert entries[0]["models"] == entries[1]["models"] and entries[0]["lux"] == entries[1]["lux"]
    outlines = [read_data(tmp_path / f"{entry['file']}.js")["facts"]["plan"]["bounds"] for entry in entries]
    assert np.subtract(*outlines[::-1]).tolist() == [10.0, 0.0, 10.0, 0.0]
    assert not list((tmp_path / "data").glob("room1_state*"))


def test_rooms_whose_people_draw_lots_are_not_interchangeable(weather, glass, tmp_path) -> None:
    from scenes.run import run

    twin = moved(BOX, (10.0, 0.0, 3.0), "twin")
    building = replace(BOX, spaces=(ROOM, twin))
    path, found = tmp_path / "operation.toml", []
    for behaviour in ("Lightswitch-2002", "Haldi-Robinson"):
        path.write_text(f'[control]\nrule = "manual"\nbehaviour = "{behaviour}"\n')
        systems = in_all_windows(ROOM, glass) | in_all_windows(twin, glass)
        inputs = run.Inputs(building, [ROOM, twin], weather, systems, read_operation(path))
        found.append(run._interchangeable(inputs, JobOptions(Path(), Path()), ROOM, twin))
    assert found == [True, False]


def test_a_run_computes_equal_rooms_once(variant, weather, skies, glass, monkeypatch) -> None:
    from scenes.run import run

    twin = moved(BOX, (10.0, 0.0, 3.0), "twin")
    other = shoebox(2.5, 4.0, 2.8, windows=(WindowRectangle(0.5, 0.9, 1.5, 1.5),), name="other")
    spaces = [ROOM, *other.spaces, twin]
    building = replace(BOX, spaces=tuple(spaces))
    systems = {w.guid: (glass,) for s in spaces for w in s.windows}
    computed = []

    def noted(building, space, *others, **options):
        computed.append(space.name)
        return lit_room(building, space, *others, **options, pictures=False)

    monkeypatch.setattr(run, "lit_room", noted)
    room = RoomOptions.of(
        method="three-phase", sky_subdivision=1, sensor_spacing=2.0, sensor_samples=1024, patch_samples=1024
    )
    options = JobOptions(Path(), Path(), cache=False, room=room)
    inputs = run.Inputs(building, spaces, weather, systems, None)
    results, issues, notes = run.computed_rooms(inputs, skies, options, silent)
    assert computed == ["room", "other"] and not issues
    assert [r.space.name for r in results] == ["room", "other", "twin"]
    assert [r.template for r in results] == ["", "", "room"]
    assert len(notes) == 2 and notes[0].startswith("Room twin is equal to room ")
    assert results[2].heat is not results[0].heat
    np.testing.assert_allclose(results[2].heat.air_c, results[0].heat.air_c, atol=0.01)


def test_equal_rooms_that_are_operated_otherwise_are_computed_each(
    variant, tmp_path, weather, skies, glass, monkeypatch, no_pictures
) -> None:
    from scenes.run import run

    twin = moved(BOX, (10.0, 0.0, 3.0), "twin")
    building = replace(BOX, spaces=(ROOM, twin))
    systems = in_all_windows(ROOM, glass) | in_all_windows(twin, glass)
    computed = []

    def noted(building, space, *others, **options):
        computed.append(space.name)
        return SimpleNamespace(template="", space=space)

    monkeypatch.setattr(run, "compute_room", noted)
    monkeypatch.setattr(run, "moved_result", lambda result, space: result)
    options = JobOptions(Path(), Path(), cache=False, room=SMALL, coupled_heat=False)
    path = tmp_path / "operation.toml"
    cooler = '[[rooms]]\nspaces = ["twin"]\n[rooms.loads]\nheating_c = 16\n'
    for rooms, names in (("", ["room"]), (cooler, ["room", "twin"])):
        path.write_text(f"[loads]\nheating_c = 20\n{rooms}")
        inputs = run.Inputs(building, [ROOM, twin], weather, systems, read_operation(path))
        run.computed_rooms(inputs, skies, options, silent)
        assert computed == names
        computed.clear()
