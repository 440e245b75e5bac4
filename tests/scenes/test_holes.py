"""A room with a wall left out: a problem of the room, where a run's results are read."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bim.shoebox import shoebox
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.surfaces import Surfaces
from scenes.demo import OFFICE
from scenes.fenestration.systems import read_system
from scenes.room.daylight import room_scene
from scenes.room.leaks import hole_problems, moved_problem
from scenes.room.options import SensorGrid
from scenes.room.windows import in_all_windows, room_windows

pytestmark = pytest.mark.usefixtures("variant")
BLIND = OFFICE.parent / "venetian_blind.xml"


def quiet(stage: str, fraction: float) -> None:
    """No progress."""


def problems_of(cache=None, *, missing: str = ""):
    """The problems of the box room, without the wall `missing`."""
    building = shoebox()
    (space,) = building.spaces
    windows = room_windows(space, in_all_windows(space, read_system(BLIND)))
    scene = room_scene(building, space, windows, [SensorGrid()], 64)
    if missing:
        room = scene.interior
        keep = room.surface != [face.name for face in space.faces].index(missing)
        parts = (part[keep] for part in (room.triangles, room.reflectance, room.surface))
        scene = replace(scene, interior=Surfaces(*parts))
    return space, hole_problems(space, scene, cache=cache, progress=quiet)


def test_a_closed_room_has_no_problem():
    assert problems_of()[1] == ()


def test_a_missing_wall_is_named_with_its_place(tmp_path):
    space, (problem,) = problems_of(MatrixCache(tmp_path), missing="back")
    assert problem.where == space.guid
    assert "is open" in problem.what and "to the north near" in problem.what
    assert "sensor" in problem.what and "% of what" in problem.what
    assert "too dark" in problem.consequence
    assert problems_of(MatrixCache(tmp_path), missing="back")[1] == (problem,)  # from the cache
    twin = replace(space, guid="other", name="2")
    assert moved_problem(problem, twin, space.name).where == "other"
