"""The exported folder under Radiance alone: its `run.sh` against our matrices."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

from bim.model import Element
from bim.shoebox import WindowRectangle, shoebox
from bim.to_radiance import write_radiance
from bim.to_tracer import exterior_surfaces, interior_surfaces, window_groups
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from scenes.demo import VENETIAN_BLIND

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
    files = write_radiance(
        space, room, folder, filled=[(group, blind) for group in groups], spacing=1.5
    )
    return files, groups, blind.bands["Visible"]


def test_surfaces_have_sensors_that_look_into_the_room(room, tmp_path):
    files, _, _ = exported(room, tmp_path)
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


@pytest.mark.slow
@pytest.mark.peer
def test_the_folder_gives_our_light(room, tmp_path):
    """V T D of Radiance's own programs and ours, under skies that weigh directions differently."""
    pytest.importorskip("pyradiance")
    from mitsuba_cfs.trace.daylight_matrix import daylight_matrix
    from mitsuba_cfs.trace.view_matrix import view_matrix
    from tests.radiance import environment

    files, groups, visible = exported(room, tmp_path)
    rows = np.loadtxt(files.sensors)
    theirs = []
    for _ in range(RUNS):
        subprocess.run(
            [str(files.script)], check=True, capture_output=True,
            env=environment() | {"INDOORS": "20000", "OUTDOORS": "400"},
        )  # fmt: skip
        text = (tmp_path / "coefficients.mtx").read_text()
        theirs.append(np.loadtxt(text.split("\n\n", 1)[1].splitlines()))
    space = room.spaces[0]
    inside, outside = interior_surfaces(space), exterior_surfaces(room, space)
    view = view_matrix(inside, groups, rows[:, :3], rows[:, 3:], samples=60_000).values
    daylight = daylight_matrix(outside, groups, samples=8_000, subdivision=1).values
    passed = visible.transmission_front * visible.basis_in.projected_solid_angles()
    ours = np.einsum("sgk,kj,gjp->sp", view, passed, daylight)
    patches = np.arange(ours.shape[1])
    skies = [np.ones(len(patches)), patches % 30 < 15, patches % 30 >= 15, patches == 0]
    for sky in skies:
        values = np.array([run @ sky for run in theirs])
        mean, spread = values.mean(axis=0), values.std(axis=0, ddof=1)
        error = float(np.sqrt(np.mean((spread / mean) ** 2) / RUNS))
        rms = float(np.sqrt(np.mean((ours @ sky / mean - 1) ** 2)))
        # ours is within 1 % at 60,000 paths; three standard errors of Radiance's mean besides
        assert rms < 0.01 + 3 * error, (rms, error)
