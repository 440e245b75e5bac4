"""Exported rooms in Radiance itself: taken untouched, closed but for the windows, same light."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bim.ifc.building import read_ifc
from bim.model import Element
from bim.rays import hemisphere, ray_mesh
from bim.shoebox import WindowRectangle, shoebox
from bim.to_radiance import identifier, write_radiance
from tests.bim.small_ifc import box_room

WINDOWS = (WindowRectangle(0.5, 0.9, 3.0, 1.5, frame=0.08), WindowRectangle(1.0, 1.0, 1.0, 2.0, "ceiling"))
# no sharing of values between sensors; every ray counts, however dim
TRACE = "rtrace -h -I -ab 1 -aa 0 -ad 50000 -lw 1e-9 {0}.oct < sensors.pts"
SKY_ALL_ROUND = "void glow white 0 0 4 1 1 1 0\nwhite source all 0 0 4 0 0 1 360\n"


@pytest.fixture(scope="module")
def radiance() -> dict[str, str]:
    pyradiance = pytest.importorskip("pyradiance")
    home = Path(pyradiance.__file__).parent
    path = f"{home / 'bin'}{os.pathsep}{os.environ['PATH']}"
    if shutil.which("rfluxmtx", path=path) is None:
        pytest.skip("Radiance's rfluxmtx is not here")
    return {**os.environ, "PATH": path, "RAYPATH": str(home / "lib")}


def run(command: str, folder: Path, environment: dict[str, str]) -> bytes:
    done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()
    assert b"fatal" not in done.stderr and b"error" not in done.stderr, done.stderr.decode()
    return done.stdout


def matrix(data: bytes) -> np.ndarray:
    """First channel of a Radiance matrix of floats or doubles [rows, columns]."""
    head, body = data.split(b"\n\n", 1)
    size = [int(re.search(rb"%s=\s*(\d+)" % key, head)[1]) for key in (b"NROWS", b"NCOLS", b"NCOMP")]
    dtype = np.float64 if b"FORMAT=double" in head else np.float32
    return np.frombuffer(body, dtype)[: np.prod(size)].reshape(size)[..., 0].astype(float)


def blackened(text: str) -> str:
    """Materials with the same names that reflect nothing."""
    return re.sub(r"5 [\d.]+ [\d.]+ [\d.]+ 0 0", "5 0 0 0 0 0", text)


def sky_share(shell: np.ndarray, points: np.ndarray, rays: int = 100_000) -> np.ndarray:
    """Cosine-weighted share of the upper hemisphere [S] that misses the triangles [N, 3, 3]."""
    directions = hemisphere(np.array([0.0, 0.0, 1.0]), rays)
    mesh = ray_mesh(shell)
    shares = []
    for point in points:
        _, hit = mesh.first_hits(np.tile(point, (rays, 1)), directions)
        shares.append(2 * np.mean(np.where(hit < 0, directions[:, 2], 0.0)))
    return np.array(shares)


@pytest.mark.peer
def test_room_is_dark_but_for_its_windows(tmp_path, radiance):
    building = shoebox(4, 6, 3, windows=WINDOWS, recess=0.2, facing_deg=200)
    space = building.spaces[0]
    files = write_radiance(space, building, tmp_path, spacing=1.0)
    files.materials.write_text(blackened(files.materials.read_text()))
    (tmp_path / "white.rad").write_text(SKY_ALL_ROUND)
    for path in files.windows.values():
        black = path.read_text().replace("glow", "plastic").replace("4 1 1 1 0", "5 0 0 0 0 0")
        (tmp_path / f"shut_{path.name}").write_text(black)
    shut = run(
        "oconv materials.rad room.rad shut_*.rad white.rad > shut.oct && " + TRACE.format("shut"), tmp_path, radiance
    )
    assert np.all(np.array(shut.split(), dtype=float) == 0.0)
    lit = run("oconv materials.rad room.rad white.rad > open.oct && " + TRACE.format("open"), tmp_path, radiance)
    irradiance = np.array(lit.split(), dtype=float).reshape(-1, 3)[:, 0]
    points = np.loadtxt(files.sensors)[:, :3]
    faces = np.concatenate([face.triangles for face in space.faces])
    ours = np.pi * sky_share(faces, points)
    # Radiance seeds by the clock: over 12 runs the darkest sensor spread by 0.7 %; ours is within
    # 0.3 % of 2 million rays
    np.testing.assert_allclose(irradiance, ours, rtol=0.03, atol=0.002)


@pytest.mark.peer
def test_rfluxmtx_takes_the_files_and_finds_the_form_factor(tmp_path, radiance):
    building = shoebox(4, 6, 3, windows=WINDOWS[:1], recess=0.0)
    files = write_radiance(building.spaces[0], building, tmp_path, spacing=2.0)
    files.materials.write_text(blackened(files.materials.read_text()))
    points = np.loadtxt(files.sensors)[:, :3]
    view = run(
        "oconv materials.rad room.rad > room.oct && rfluxmtx -fad -I+ -ab 1 -ad 200000 -lw 1e-9 "
        f"-y {len(points)} - windows_S.rad -i room.oct < sensors.pts",
        tmp_path,
        radiance,
    )
    sums = matrix(view).sum(axis=1)
    exact = np.pi * np.array([window_factor(p, 0.58, 3.42, 0.98, 2.32) for p in points])
    # Radiance seeds by the clock: the darker of the two sensors spread by 0.39 % over 12 runs
    # (1.6 % with 20000 rays): 6 sigma
    np.testing.assert_allclose(sums, exact, rtol=0.024)


def window_factor(point: np.ndarray, x0: float, x1: float, z0: float, z1: float) -> float:
    """View factor from a point facing up to an upright rectangle at y = 0.

    Closed form: the contour integral of the configuration factor, edge by edge (Lambert).
    """
    corners = np.array([[x0, 0, z0], [x1, 0, z0], [x1, 0, z1], [x0, 0, z1]]) - point
    total = 0.0
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        normal = np.cross(a, b)
        angle = np.arctan2(np.linalg.norm(normal), a @ b)
        total += angle * normal[2] / np.linalg.norm(normal)
    return abs(total) / (2 * np.pi)


@pytest.mark.peer
def test_daylight_matrix_of_an_unobstructed_window_sees_everything(tmp_path, radiance):
    building = shoebox(windows=WINDOWS, recess=0.0)
    files = write_radiance(building.spaces[0], building, tmp_path)
    assert set(files.windows) == {"S", "roof"}
    for name in files.windows.values():
        daylight = run(
            f"oconv materials.rad outdoors.rad > outdoors.oct && rfluxmtx -ffd -ab 1 -ad 16 -c 200 "
            f"{name.name} sky.rad -i outdoors.oct",
            tmp_path,
            radiance,
        )
        rows = matrix(daylight)
        assert rows.shape == (145, 146)
        # each row is the share of rays that reach ground and sky: all of them
        np.testing.assert_allclose(rows.sum(axis=1), 1.0, atol=1e-6)


@pytest.mark.peer
def test_rays_of_the_daylight_matrix_go_outdoors(tmp_path, radiance):
    corners = np.array([[-90, -1, -90], [90, -1, -90], [90, -1, 90], [-90, -1, 90]], dtype=float)
    screen = Element("s", "screen", "IfcWall", corners[[[0, 1, 2], [0, 2, 3]]], 0.0, 0.0)
    building = shoebox(windows=WINDOWS[:1], elements=(screen,))
    write_radiance(building.spaces[0], building, tmp_path)
    daylight = run(
        "oconv materials.rad outdoors.rad > outdoors.oct && rfluxmtx -ffd -ab 1 -ad 16 -c 200 "
        "windows_S.rad sky.rad -i outdoors.oct",
        tmp_path,
        radiance,
    )
    # the black screen stops all but rays that run along it, some of the outermost Klems ring
    assert matrix(daylight).sum(axis=1).max() < 0.2


def test_names_are_fit_for_radiance():
    assert identifier("Büro 1/2 'Süd'") == "B_ro_1_2_S_d_"


def test_exported_ifc_room_has_its_reflectances(tmp_path):
    path = tmp_path / "room.ifc"
    box_room().write(str(path))
    building = read_ifc(path)
    files = write_radiance(building.spaces[0], building, tmp_path / "rad")
    text = files.room.read_text()
    for value in (0.3, 0.5, 0.7, 0.8):
        assert f"diffuse_{value:.6f} polygon" in text
    # the window's own frame and pane are no obstruction before it
    assert "W1" not in files.outdoors.read_text()
    assert "south" in files.outdoors.read_text()
