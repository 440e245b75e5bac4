"""A room drawn as a box under a pitched roof is cut where it reaches through the roof."""

from __future__ import annotations

import numpy as np
import pytest

from bim.ifc.cut_rooms import cut_rooms
from bim.ifc.shapes import Shape
from bim.ifc.spaces import SpaceRecord
from bim.rays import ray_mesh
from bim.report.issue import issue_text
from bim.rooms import room_solid
from bim.solids import solid_of
from tests.bim.test_eaves import body

ROOM = body((0.0, 0.0, 0.0), (4.0, 6.0, 3.0))
# its underside is 2 m above the floor at the south wall and rises by 0.5: 3 m at 2 m from there
PITCHED = body((-1.0, -1.0, 2.0), (5.0, 7.0, 2.2), 0.5)
DORMER = body((-0.5, -0.5, 3.2), (4.5, 6.5, 3.4))


def _cut(*roofs: np.ndarray) -> tuple[SpaceRecord, list]:
    solid = solid_of(ROOM)
    record = SpaceRecord(room_solid("r", "r", solid.manifold), "r", "", "", 72.0, None, None, step_id=1)
    lids = [
        Shape("g", i, "IfcRoof", "", mesh, (), np.full(len(mesh), -1), np.zeros(len(mesh), int))
        for i, mesh in enumerate(roofs)
    ]
    (record,), issues = cut_rooms([record], lids, ray_mesh(np.concatenate(roofs)))
    return record, issues


def test_the_part_above_the_roof_is_outdoors():
    record, (issue,) = _cut(PITCHED)
    # a wedge of 2 m by 1 m across the room's width, the roof's body included
    assert record.volume == pytest.approx(72.0 - 4.0, rel=0.01)
    assert issue.code == "room-cut" and issue.values["before"] == 72.0
    text = issue_text(issue, "command").what
    assert text == "Space r extends through the sloping roof or ceiling that covers it"


def test_a_dormer_is_kept():
    record, issues = _cut(PITCHED, DORMER)
    assert record.volume == 72.0 and not issues


def test_a_room_below_the_roof_is_as_drawn():
    record, issues = _cut(PITCHED + np.array([0.0, 0.0, 1.2]))
    assert record.volume == 72.0 and not issues
