"""Buildings as honeybee models, read again."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from bim.exported_glazing import ExportedGlazing
from bim.honeybee.building import read_honeybee
from bim.honeybee.write import write_honeybee
from bim.hosted_windows import hosted_polygons
from bim.model import Element
from bim.shell import open_edges
from bim.shoebox import WindowRectangle, shoebox

WALL = np.array([[[0, -5, 0], [6, -5, 0], [6, -5, 4]]], float)


@pytest.mark.parametrize("recess", [0.0, 0.2])
@pytest.mark.parametrize("frame", [0.0, 0.1])
def test_a_room_comes_back(tmp_path, recess, frame):
    windows = [
        WindowRectangle(0.5, 0.9, 3.0, 1.5, frame=frame),
        WindowRectangle(1.0, 1.0, 1.0, 2.0, "ceiling", frame=frame),
    ]
    wall = Element("wall", "wall", "IfcWall", WALL, 0.4, 0.4)
    box = shoebox(4, 5, 3, windows=windows, recess=recess, elements=(wall,), reflectance_solar={"floor": 0.35})
    write_honeybee(box, tmp_path / "box.hbjson", glazing={"room-window-0": ExportedGlazing(1.1, 0.5)})
    (space,), (own,) = read_honeybee(tmp_path / "box.hbjson").spaces, box.spaces
    assert space.volume == pytest.approx(own.volume, rel=1e-5)
    assert space.floor_area == pytest.approx(own.floor_area, rel=1e-5)
    assert not open_edges(space.shell)
    # a face made for a window is a thousandth wider either way
    areas = sorted(window.area for window in space.windows)
    assert areas == pytest.approx(sorted(window.area for window in own.windows), rel=2.1e-3)
    floor, before = (next(f for f in s.faces if f.kind == "floor") for s in (space, own))
    assert floor.reflectance_visible == pytest.approx(before.reflectance_visible, abs=1e-4)
    assert floor.reflectance_solar == pytest.approx(0.35)
    assert floor.construction.resistance == pytest.approx(before.construction.resistance)
    np.testing.assert_allclose(floor.normal, before.normal, atol=1e-6)


def test_a_pane_is_within_its_face_and_no_face_is_smaller_than_the_tolerance(tmp_path):
    """honeybee 1.64 takes a pane on the outline of its face as outside, and 8 cm2 as nothing."""
    box = shoebox(4, 5, 3, windows=[WindowRectangle(0.5, 0.0, 3.0, 1.5)])
    (space,) = box.spaces
    corner = np.array([[[0, 0, 0], [0.04, 0, 0], [0.04, 0.04, 0]]], dtype=float)
    small = replace(space, faces=(*space.faces, replace(space.faces[0], triangles=corner)))
    (part,) = [part for part in hosted_polygons(small) if part.panes]
    ((_, pane),) = part.panes
    assert pane.boundary.distance(part.polygon.boundary) > 0.9e-4
    assert pane.area == pytest.approx(4.5, rel=1e-4)
    for spaces, tolerance in (((space,), 1e-3), ((small,), 1e-4)):
        write_honeybee(replace(box, spaces=spaces), tmp_path / "box.hbjson")
        model = json.loads((tmp_path / "box.hbjson").read_text())
        assert model["tolerance"] == pytest.approx(tolerance)


def test_what_stands_outdoors_comes_back(tmp_path):
    box = shoebox(elements=(Element("wall", "a wall", "IfcWall", WALL, 0.4, 0.4),))
    write_honeybee(box, tmp_path / "box.hbjson")
    found = [e for e in read_honeybee(tmp_path / "box.hbjson").elements if e.name == "a wall"]
    assert len(found) == 1 and found[0].reflectance_visible == pytest.approx(0.4)
    np.testing.assert_allclose(found[0].triangles.reshape(-1, 3).max(axis=0), [6, -5, 4])


@pytest.mark.parametrize("transmittance", [0.05, 0.4, 0.7, 0.9])
def test_glass_without_a_bsdf_is_a_pane_that_passes_as_much(tmp_path, transmittance):
    """honeybee's Radiance would take its default pane of 0.64."""
    box = shoebox(windows=[WindowRectangle(0.5, 0.9, 3.0, 1.5)])
    data = {"room-window-0": ExportedGlazing(1.1, 0.5, transmittance)}
    write_honeybee(box, tmp_path / "box.hbjson", glazing=data)
    (window,) = read_honeybee(tmp_path / "box.hbjson").windows
    assert window.glass is not None
    assert window.glass.transmittance == pytest.approx(transmittance, abs=1e-6)
    assert (window.u_value, window.g_value) == (1.1, 0.5)
