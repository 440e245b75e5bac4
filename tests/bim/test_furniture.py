"""Furniture of an IFC file in light and views where asked for; curtains at windows never."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bim.defaults import FURNITURE_REFLECTANCE
from bim.ifc.building import read_ifc
from bim.report.issue import issue_text
from bim.sensors import sensor_grid, view_point
from bim.templates import room_features
from bim.to_radiance import write_radiance
from bim.to_tracer import furnished_surfaces, interior_surfaces, window_groups
from mitsuba_cfs.methods.phase_matrices import phase_matrices
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.surfaces import Surfaces
from tests.bim.small_ifc import DEPTH, OPENING, WIDTH, box_model
from tests.issues import of_code

CABINET = (1.5, 2.5, 0.0), (1.0, 1.0, 2.0)  # in the middle of the room: low corner, size [m]
SHELF = (0.05, DEPTH / 2, 0.9), (WIDTH - 0.1, DEPTH / 2 - 0.05, 0.02)  # over its northern half
X, SILL, W, H = OPENING


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("furniture") / "model.ifc"
    small, _ = box_model()
    small.box("IfcFurniture", "Cabinet", *CABINET, small.style("oak", 0.3))
    small.box("IfcFurnishingElement", "Shelf", *SHELF)
    small.box("IfcFurniture", "Bench", (1.0, -3.0, 0.0), (1.0, 0.4, 0.5))
    small.box("IfcFurniture", "Vorhang", (X, 0.1, SILL), (W, 0.02, H))
    small.box("IfcFurniture", "Folding screen", (X, 0.2, SILL), (W, 0.02, H))
    small.box("IfcFurniture", "Gardine", (0.0, 0.1, SILL), (0.2, 0.02, H))  # drawn open
    small.model.write(str(path))
    return path


@pytest.fixture(scope="module")
def room(path):
    return read_ifc(path, furniture=True).spaces[0]


def test_furniture_is_left_out_and_counted_unless_it_is_wanted(path):
    building = read_ifc(path)
    assert building.spaces[0].furniture == ()
    (said,) = of_code(building, "furniture-left-out")
    assert said.values["count"] == 6 and "--furniture" in issue_text(said, "command").fix
    assert "furniture=True" in issue_text(said).fix


def test_each_piece_stands_in_its_room_with_its_reflectance(path, room):
    building = read_ifc(path, furniture=True)
    found = {piece.name: piece.reflectance_visible for piece in room.furniture}
    assert found == {
        "Cabinet": pytest.approx(0.3),
        "Shelf": FURNITURE_REFLECTANCE,
        "Folding screen": FURNITURE_REFLECTANCE,
        "Gardine": FURNITURE_REFLECTANCE,
    }
    assert not {e.name for e in building.elements} & {*found, "Vorhang", "Bench"}
    (bench,) = of_code(building, "furniture-in-no-room")
    assert bench.values["element"] == "IfcFurniture Bench"
    (curtain,) = of_code(building, "curtain-at-window")
    assert (curtain.values["element"], curtain.values["window"]) == ("IfcFurniture Vorhang", "W1")
    assert "cfs ifc attach" in issue_text(curtain, "command").fix


def test_heat_knows_no_furniture_and_light_does(room):
    bare, full = interior_surfaces(room, "solar"), furnished_surfaces(room, "solar")
    assert len(bare.names) == len(room.faces)
    assert full.names[: len(bare.names)] == bare.names
    assert set(full.names[len(bare.names) :]) == {piece.name for piece in room.furniture}


def test_sensors_and_eye_stand_beside_a_cabinet(path, room):
    all_points, _ = sensor_grid(read_ifc(path).spaces[0], 0.5)
    points, _ = sensor_grid(room, 0.5)
    (x, y, _), (w, d, _) = CABINET
    inside = (np.abs(all_points[:, :2] - [x + w / 2, y + d / 2]) < [w / 2, d / 2]).all(axis=1)
    assert inside.any()
    assert np.array_equal(points, all_points[~inside])
    eye, _ = view_point(room)
    assert not (np.abs(eye[:2] - [x + w / 2, y + d / 2]) < [w / 2, d / 2]).all()


def test_shelf_above_the_sensors_takes_their_light(room):
    """Sensors under a shelf lose the window, those south of it keep most of its light."""
    shelf = tuple(piece for piece in room.furniture if piece.name == "Shelf")
    points, normals = sensor_grid(replace(room, furniture=()), 1.0)
    seen = []
    for furniture in ((), shelf):
        surfaces = furnished_surfaces(replace(room, furniture=furniture))
        scene = DaylightScene(surfaces, Surfaces.none(), window_groups(room), points, normals)
        seen.append(phase_matrices(scene, Sampling(sensor_samples=512)).sensors.values.sum(axis=-1))
    ratio = (seen[1] / seen[0]).ravel()
    under = points[:, 1] > SHELF[0][1] + 0.3
    assert ratio[under].max() < 0.2
    assert ratio[points[:, 1] < 1.5].min() > 0.8


def test_furniture_is_exported_and_tells_rooms_apart(path, room, tmp_path):
    bare = read_ifc(path).spaces[0]
    assert len(room_features(room)) == len(room_features(bare)) + len(room.furniture)
    building = read_ifc(path, furniture=True)
    files = write_radiance(building.spaces[0], building, tmp_path)
    assert "furnitureCabinet" in files.room.read_text()
