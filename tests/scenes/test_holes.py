"""A room with a wall left out: a problem of the room, where a run's results are read."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bim.report.issue import Phrase, issue_text
from bim.shoebox import shoebox
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.surfaces import Surfaces
from scenes.demo import OFFICE
from scenes.fenestration.systems import read_system
from scenes.room.leaks import leak_issues, moved_issue
from scenes.room.light import room_scene
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
    return space, leak_issues(space, scene, cache=cache, progress=quiet)


def test_a_closed_room_has_no_issue():
    assert problems_of()[1] == ()


def test_a_missing_wall_is_named_with_its_place(tmp_path):
    space, (issue,) = problems_of(MatrixCache(tmp_path), missing="back")
    assert issue.where == space.guid
    assert issue.code == "room-leaks-light" and issue.values["side"] == Phrase("side-north")
    assert issue.values["percent"] > 1
    assert "too dark" in issue_text(issue).effect
    assert problems_of(MatrixCache(tmp_path), missing="back")[1] == (issue,)  # from the cache
    twin = replace(space, guid="other", name="2")
    assert moved_issue(issue, twin, space.name).where == "other"
