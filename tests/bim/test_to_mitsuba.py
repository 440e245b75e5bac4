"""The Mitsuba scene of a room: loaded as written, dark but for its window, seen from inside."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from bim.ifc.building import read_ifc
from bim.to_mitsuba import write_mitsuba
from mitsuba_cfs.variants import activate
from tests.bim.small_ifc import GLASS_AREA, box_room


@pytest.fixture
def scene_file(tmp_path):
    path = tmp_path / "room.ifc"
    box_room().write(str(path))
    building = read_ifc(path)
    return write_mitsuba(building.spaces[0], building, tmp_path / "mitsuba")


def test_scene_is_rendered_and_its_shell_lets_no_light_in(scene_file):
    activate()
    scene = mi.load_file(str(scene_file))
    shapes = {shape.id(): shape for shape in scene.shapes()}
    assert shapes["glass_0"].surface_area()[0] == pytest.approx(GLASS_AREA, rel=1e-5)
    names = {path.name for path in (scene_file.parent / "meshes").iterdir()}
    assert {"room_floor_0.3000.ply", "room_wall_0.5000.ply", "outdoors_0.5000.ply"} <= names
    image = np.array(mi.render(scene, spp=16))[..., :3].mean(axis=2)
    assert 0.02 < image.mean() < 0.9
    # the sky of radiance 1 is seen through a pane that passes some 92 %, mirrored or reflected less
    assert image.max() < 1.2
    text = scene_file.read_text().replace("thindielectric", "diffuse")
    text = text.replace('<float name="int_ior" value="1.52" />', "")
    scene_file.write_text(text)
    shut = np.array(mi.render(mi.load_file(str(scene_file)), spp=16))
    assert shut.max() == 0.0
