"""Walls with openings have the volume of the drawing, whichever kernel of ifcopenshell cuts them."""

from __future__ import annotations

import numpy as np
import pytest

from bim.ifc import shapes
from bim.ifc.shapes import PRISM_KERNEL, read_shapes
from mitsuba_cfs.surfaces import area_vectors
from tests.bim.small_ifc import SmallIfc, empty_project

LENGTH, THICKNESS, HEIGHT = 6.0, 0.3, 3.0  # of the wall [m]
DOOR = 1.0, 2.1  # width, height [m]
GROWN = 1e-4  # [m] by which a kernel may enlarge an opening at each side, far less than what is drawn


def test_a_door_at_the_floor_is_cut_from_its_wall():
    """The opening's lower side lies in that of the wall: the first kernel cannot cut it."""
    small = empty_project()
    wall = _wall_with_door(small)
    cut = LENGTH * HEIGHT - DOOR[0] * DOOR[1]
    assert _volume(small, wall) == pytest.approx(cut * THICKNESS, abs=THICKNESS * GROWN * 2 * sum(DOOR))


def test_a_sloped_top_is_not_cut_by_the_kernel_that_cannot(monkeypatch):
    """A wall cut by a half-space, 3 m high at one end and 2 m at the other, less its door."""
    small = empty_project()
    wall = _wall_with_door(small)
    _cut_top(small, wall)
    used = []
    iterator = shapes.ifcopenshell.geom.iterator

    def recorded(*arguments, geometry_library, **options):
        used.append(geometry_library)
        return iterator(*arguments, geometry_library=geometry_library, **options)

    monkeypatch.setattr(shapes.ifcopenshell.geom, "iterator", recorded)
    cut = LENGTH * (HEIGHT - 0.5) - DOOR[0] * DOOR[1]
    assert _volume(small, wall) == pytest.approx(cut * THICKNESS, abs=THICKNESS * GROWN * 2 * sum(DOOR))
    assert PRISM_KERNEL not in used


def _wall_with_door(small: SmallIfc):
    wall = small.box("IfcWall", "wall", (0.0, -THICKNESS, 0.0), (LENGTH, THICKNESS, HEIGHT))
    width, height = DOOR
    small.opening(wall, (1.0, -THICKNESS, 0.0), "door", size=(width, THICKNESS, height), axes=True)
    return wall


def _cut_top(small: SmallIfc, wall) -> None:
    create = small.model.create_entity
    body = wall.Representation.Representations[0]
    corner = create("IfcCartesianPoint", (0.0, 0.0, HEIGHT * small.scale))
    normal, along = np.array([1.0, 0.0, LENGTH]), np.array([LENGTH, 0.0, -1.0])
    axes = (create("IfcDirection", tuple(map(float, a / np.linalg.norm(a)))) for a in (normal, along))
    plane = create("IfcPlane", create("IfcAxis2Placement3D", corner, *axes))
    above = create("IfcHalfSpaceSolid", plane, False)
    body.Items = [create("IfcBooleanClippingResult", "DIFFERENCE", body.Items[0], above)]


def _volume(small: SmallIfc, wall) -> float:
    found, issues = read_shapes(small.model)
    assert not issues
    triangles = found[wall.id()].triangles
    return float(np.einsum("ni,ni->", triangles.mean(axis=1), area_vectors(triangles)) / 3)
