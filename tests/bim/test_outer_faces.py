"""Outer faces of walls: beyond the door in its recess, beyond a cladding, before a railing."""

from __future__ import annotations

import numpy as np
import pytest

from bim.model import Element
from bim.outer_faces import OFF_THE_WALL, outer_faces
from bim.shoebox import Plate, shoebox
from bim.to_thermal import thermal_room
from thermal.blackbox import Fenestration


def slab(
    guid: str, near: float, far: float, x: tuple[float, float] = (-10.0, 10.0), z: tuple[float, float] = (-10.0, 10.0)
) -> Element:
    """A plate of 20 x 20 m, from `near` to `far` south of the front wall's inner face [m]."""
    low, high = np.array([x[0], -far, z[0]]), np.array([x[1], -near, z[1]])
    corner = np.array(np.meshgrid(*np.stack([low, high]).T, indexing="ij")).reshape(3, 8).T
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([corner[[q[k] for k in part]] for q in quads for part in ((0, 1, 2), (0, 2, 3))])
    return Element(guid, guid, "IfcWall", triangles, 0.3, 0.3)


def front(*elements: Element) -> tuple[float, np.ndarray]:
    """Depth of the front wall of a box, and the points before it."""
    building = shoebox(4, 5, 3, elements=elements)
    (space,) = building.spaces
    outer = outer_faces(building, space, thermal_room(space, Fenestration("x", 1.0)))
    (at,) = np.flatnonzero(outer.normals[:, 1] < -0.9)
    return outer.depth[at], outer.points[at]


def test_without_a_drawn_wall_it_is_as_thick_as_its_layers():
    building = shoebox(4, 5, 3)
    thickness = next(f for f in building.spaces[0].faces if f.kind == "wall").construction.thickness
    depth, points = front()
    assert depth == pytest.approx(thickness)
    assert points[:, 1] == pytest.approx(-thickness - OFF_THE_WALL)
    x, z = points[:, 0], points[:, 2]
    assert x.min() < 0.5 and x.max() > 3.5 and z.min() < 0.6 and z.max() > 2.4
    glass = (x > 0.5) & (x < 3.5) & (z > 0.9) & (z < 2.7)
    assert not glass.any()


def test_a_panel_in_its_recess_is_followed_to_its_own_outer_face():
    depth, points = front(slab("room-front", 0.31, 0.35))
    assert depth == pytest.approx(0.35)
    assert points[:, 1] == pytest.approx(-0.35 - OFF_THE_WALL)


def test_what_touches_the_wall_belongs_to_it_and_a_railing_does_not():
    wall, cladding = slab("room-front", 0.0, 0.3), slab("cladding", 0.33, 0.36)
    railing = slab("railing", 0.9, 0.95)
    assert front(wall, cladding, railing)[0] == pytest.approx(0.36)
    assert front(wall, railing)[0] == pytest.approx(0.3)


def test_a_wall_inside_another_solid_comes_out_of_it():
    assert front(slab("room-front", 0.0, 0.2), slab("other", 0.1, 0.5))[0] == pytest.approx(0.5)


def test_the_outer_leaf_beyond_the_cavity_of_its_layers_is():
    """The box's layers are 0.39 m thick: what begins within them is one of them."""
    thickness = front()[0]
    inner = slab("room-front", 0.0, 0.1)
    leaf = slab("leaf", thickness - 0.1, thickness)
    assert front(inner, leaf)[0] == pytest.approx(thickness)
    beyond = slab("leaf", thickness + 0.1, thickness + 0.2)
    assert front(inner, beyond)[0] == pytest.approx(0.1)


def test_a_plate_of_the_box_stands_out_of_its_line():
    (plate,) = shoebox(4, 5, 3, plates=[Plate((0, 3), (4, 3), 1.5)], recess=0.2).elements
    assert np.ptp(plate.triangles[..., 1]) == pytest.approx(1.5)
    assert plate.triangles[..., 1].max() == pytest.approx(-0.2)
    assert plate.triangles[..., 2] == pytest.approx(3.0)
    (fin,) = shoebox(4, 5, 3, plates=[Plate((1, 0), (1, 3), 0.5, "left")]).elements
    assert fin.triangles[..., 0].min() == pytest.approx(-0.5)
    assert np.ptp(fin.triangles[..., 1]) == pytest.approx(0.0, abs=1e-12)
    assert plate.reflectance("solar") == 0.2
    with pytest.raises(ValueError, match="depth"):
        shoebox(4, 5, 3, plates=[Plate((0, 3), (4, 3), 0.0)])


def under_eaves(rise: float, overhang: float) -> Element:
    """A roof that falls southwards by `rise`, 0.2 m thick across, 0.1 m over the wall's top."""
    roof = slab("roof", -4.0, 0.3 + overhang, z=(2.7, 2.9))
    triangles = roof.triangles.copy()
    triangles[..., 2] += rise * (triangles[..., 1] + 0.3)
    return Element("roof", "roof", "IfcSlab", triangles, 0.3, 0.3)


@pytest.mark.parametrize("rise", [0.0, 0.1, 0.6], ids=["flat", "10 percent", "31 degrees"])
def test_eaves_that_the_wall_reaches_into_are_not_its_outer_face(rise):
    """Each place stands before the wall, those in the roof's body too: they see nothing."""
    depth, points = front(slab("room-front", 0.0, 0.3), under_eaves(rise, 0.5))
    assert depth == pytest.approx(0.3)
    assert (points[:, 2] > 2.7).sum() >= 4  # behind the eaves
    assert np.all(points[:, 1] <= -0.3 - OFF_THE_WALL + 1e-6)
    assert np.all(points[:, 1] > -0.3 - 2 * OFF_THE_WALL - 0.05)


@pytest.mark.parametrize("part", [{"z": (1.0, 1.2)}, {"x": (0.1, 0.4)}], ids=["balcony", "pier"])
def test_what_stands_out_of_the_wall_is_not_its_outer_face(part):
    _, points = front(slab("room-front", 0.0, 0.3), slab("out", 0.3, 0.9, **part))
    assert np.all(points[:, 1] == pytest.approx(-0.3 - OFF_THE_WALL, abs=1e-4))


def test_a_column_in_the_wall_is():
    column = slab("column", 0.0, 0.4, x=(0.1, 0.5))
    _, points = front(slab("room-front", 0.0, 0.3), column)
    inside = (points[:, 0] > 0.1) & (points[:, 0] < 0.5)
    assert inside.any()
    assert points[inside, 1] == pytest.approx(-0.4 - OFF_THE_WALL)
    assert points[~inside, 1] == pytest.approx(-0.3 - OFF_THE_WALL)
