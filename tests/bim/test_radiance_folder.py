"""The exported folder under Radiance alone: its `run.sh` against our matrices."""

from __future__ import annotations

import os
import re
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from bim.model import Element
from bim.outdoors import before_windows
from bim.shoebox import WindowRectangle, shoebox
from bim.to_radiance import FilledGroup, write_radiance
from bim.to_tracer import window_groups
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from scenes.demo import VENETIAN_BLIND, WEATHER
from tests.trace.test_pictures import random_tree_system

WALL = np.array([[[0, -5, 0], [6, -5, 0], [6, -5, 4]], [[0, -5, 0], [6, -5, 4], [0, -5, 4]]], float)
RUNS = 3  # of Radiance, whose seeds are the clock's


@pytest.fixture
def room():
    """A room whose blind sends light up, before a wall on one side: nothing is symmetric."""
    wall = Element("wall", "wall", "IfcWall", WALL, 0.4, 0.4)
    window = WindowRectangle(0.5, 0.9, 2.0, 1.5)
    return shoebox(4, 5, 3, windows=[window], recess=0.2, elements=(wall,))


def exported(room, folder):
    space = room.spaces[0]
    blind = read_bsdf_xml(VENETIAN_BLIND)
    groups = window_groups(space)
    files = write_radiance(space, room, folder, filled=[FilledGroup(g, blind) for g in groups], spacing=1.5)
    return files, blind


def test_surfaces_have_sensors_that_look_into_the_room(room, tmp_path):
    files, _ = exported(room, tmp_path)
    rows = np.loadtxt(files.surfaces)
    space = room.spaces[0]
    low, high = (f(space.shell.reshape(-1, 3), axis=0) for f in (np.min, np.max))
    assert np.all((rows[:, :3] > low) & (rows[:, :3] < high))
    inwards = rows[:, :3] + rows[:, 3:]
    assert np.all((inwards > low - 0.2) & (inwards < high + 0.2))
    floor = rows[rows[:, 5] == 1]
    assert len(floor) == 9 and np.allclose(floor[:, 2], 0.01)  # 0.75, 2.25, 3.75 m both ways


def test_without_a_bsdf_the_script_says_what_to_do(room, tmp_path):
    files = write_radiance(room.spaces[0], room, tmp_path)
    done = subprocess.run([str(files.script)], capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "windows_NAME.xml" in done.stderr


def test_the_script_and_the_makefile_are_sound(room, tmp_path):
    files, _ = exported(room, tmp_path)
    assert subprocess.run(["sh", "-n", str(files.script)], check=False).returncode == 0
    done = subprocess.run(
        [str(files.script)], capture_output=True, text=True, check=False, env=os.environ | {"PHASES": "4"}
    )
    assert done.returncode == 1 and "PHASES=4: 3 or 5" in done.stderr
    text = (tmp_path / "Makefile").read_text()
    named = re.search(r"SCENE = (.*)", text).group(1).split()
    assert all((tmp_path / name).is_file() for name in named)
    assert "\t./run.sh $(abspath $(WEATHER))" in text


def test_the_sun_meets_the_finest_data_of_a_window(room, tmp_path):
    space, blind = room.spaces[0], read_bsdf_xml(VENETIAN_BLIND)
    fine = BsdfFile({"Visible": random_tree_system(0)}, "fine")
    groups = [FilledGroup(group, blind, fine) for group in window_groups(space)]
    files = write_radiance(space, room, tmp_path, filled=groups)
    materials = files.systems.read_text().split()
    assert materials[:2] == ["void", "aBSDF"]
    found = read_bsdf_xml(tmp_path / materials[4])
    assert isinstance(found.bands["Visible"], TensorTreeBsdf)


def test_only_what_a_window_may_see_stands_before_the_sun():
    """A stair in the room is left out, a wall across a window's plane is cut there."""
    within = WALL + np.array([0.0, 7.0, 0.0])  # y = 2
    stair = Element("s", "stair", "IfcStair", within, 0.4, 0.4)
    across = Element("w", "fin", "IfcWall", WALL[:, :, [1, 0, 2]], 0.4, 0.4)  # y from 0 to 6
    across = replace(across, triangles=across.triangles - [0, 3, 0])
    window = WindowRectangle(0.5, 0.9, 2.0, 1.5)
    space = shoebox(4, 5, 3, windows=[window], recess=0.2).spaces[0]
    glass = space.windows[0].centre[1]
    assert len(before_windows([stair], space.windows)) == 0
    found = before_windows([across], space.windows)
    assert found[..., 1].max() == pytest.approx(glass) and found[..., 1].min() == -3
    sides = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])
    assert 0.5 * np.linalg.norm(sides, axis=1).sum() == pytest.approx(4 * (3 + glass))
    assert before_windows([], space.windows).shape == (0, 3, 3)


@pytest.mark.peer
def test_a_room_without_windows_has_no_light(tmp_path):
    """Its folder runs too, in either band; `getbbox` and `oconv` take every scene of it."""
    pytest.importorskip("pyradiance")
    from tests.benchmarks.radiance import environment, run

    street = Element("street", "street", "IfcSite", WALL, 0.2, 0.2)
    building = shoebox(4, 5, 3, windows=(), elements=(street,))
    for band, result in (("visible", "illuminance.txt"), ("solar", "irradiance.txt")):
        folder = tmp_path / band
        files = write_radiance(building.spaces[0], building, folder, band=band, spacing=2)
        (folder / "hour.wea").write_text(
            "place x\nlatitude 45\nlongitude 0\ntime_zone 0\nsite_elevation 0\n"
            "weather_data_file_units 1\n6 21 12.5 800 200\n6 21 13.5 700 200\n"
        )
        call = [str(files.script), str(folder / "hour.wea")]
        done = subprocess.run(call, check=True, capture_output=True, env=environment())
        assert b"error" not in done.stderr and b"warning" not in done.stderr
        found = np.loadtxt(folder / result)
        assert found.shape == (len(np.loadtxt(files.sensors)), 2) and not found.any()
        box = np.array(run("getbbox -h room.rad", folder).split(), dtype=float)
        assert box == pytest.approx([0, 4, 0, 5, 0, 3])


@pytest.mark.slow
@pytest.mark.peer
def test_the_folder_gives_our_light(room, tmp_path):
    """Radiance's own programs and ours: under skies that weigh directions, and in hours of sun."""
    pytest.importorskip("pyradiance")
    from tests.validation import radiance_folder as folder

    files, blind = exported(room, tmp_path)
    weather = folder.three_days(WEATHER, tmp_path)
    held_to_ours(folder.Room(room, room.spaces[0], blind, files, weather), 20_000, RUNS)


@pytest.mark.slow
@pytest.mark.peer
def test_the_folder_of_a_real_room_gives_our_light(real_data, tmp_path):
    """The FZK house's living room, 50 degrees from north, with a stair that reaches into it."""
    pytest.importorskip("pyradiance")
    from tests.validation import radiance_folder as folder

    house = real_data / "ifc" / "buildings" / "AC20-FZK-Haus.ifc"
    room = folder.Room.exported(house, "5 Wohnen", tmp_path / "room", WEATHER)
    held_to_ours(room, 2_000, 2)


def held_to_ours(room, rays: int, runs: int) -> None:
    """Both sides' light under skies that weigh directions, and in hours of sun."""
    from tests.validation import radiance_folder as folder

    theirs = [folder.theirs(room, rays, 400) for _ in range(runs)]
    ours = [folder.ours(room, seed) for seed in range(runs)]
    patches = np.arange(theirs[0][0].shape[1])
    skies = [np.ones(len(patches)), patches % 30 < 15, patches % 30 >= 15, patches == 0]
    pairs = [[[whole @ sky for whole, _ in side] for side in (ours, theirs)] for sky in skies]
    bright = np.mean([hours for _, hours in theirs], axis=0) > folder.LEAST
    assert bright.sum() > 50
    pairs.append([[hours[bright] for _, hours in side] for side in (ours, theirs)])
    for a, b in pairs:
        mean, spread = np.mean(b, axis=0), np.std(b, axis=0, ddof=1)
        error = float(np.sqrt(np.mean((spread / mean) ** 2) / runs))
        rms = float(np.sqrt(np.mean((np.mean(a, axis=0) / mean - 1) ** 2)))
        # ours is within 1 % at these paths; three standard errors of Radiance's mean besides
        assert rms < 0.01 + 3 * error, (rms, error)
