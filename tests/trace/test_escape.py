"""Light that leaves a room through a hole: view factors, energy, the place, and the cache."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.estimate import Stopping
from mitsuba_cfs.trace.matrices.straight_view import SIDES, escaped_view
from mitsuba_cfs.trace.matrices.view import view_matrix
from tests.trace.rooms import DEPTH, HEIGHT, WIDTH, test_room

pytestmark = pytest.mark.usefixtures("variant")

UP, NORTH = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)
POINTS = np.array([[1.2, 1.0, 0.8], [1.2, 3.8, 0.8], [3.0, 4.4, 0.8], [1.8, 2.0, 1.2]])
NORMALS = np.array([UP, UP, UP, NORTH])
EAST, NORTH_SIDE, CEILING = (SIDES.index(name) for name in ("east", "north", "ceiling"))
WALLS = {"north": 2, "east": 4, "ceiling": 1}  # number of the test room's surface


def without(wall: str, scale: float = 1.0):
    """The test room less one of its surfaces."""
    room, groups = test_room(scale)
    keep = room.surface != WALLS[wall]
    return Surfaces(room.triangles[keep], room.reflectance[keep], room.surface[keep]), groups


def view_share(point, normal, wall: str, cells: int = 1500) -> float:
    """Share of the view of a sensor that a rectangle is: sum of cos cos dA / (pi r^2)."""
    u = (np.arange(cells) + 0.5) / cells
    a, b = np.meshgrid(u, u, indexing="ij")
    zero = np.zeros_like(a)
    place, area = {
        "north": (np.stack([WIDTH * a, zero + DEPTH, HEIGHT * b], -1), WIDTH * HEIGHT),
        "east": (np.stack([zero + WIDTH, DEPTH * a, HEIGHT * b], -1), DEPTH * HEIGHT),
        "ceiling": (np.stack([WIDTH * a, DEPTH * b, zero + HEIGHT], -1), WIDTH * DEPTH),
    }[wall]
    axis = {"north": 1, "east": 0, "ceiling": 2}[wall]
    to = place - point
    r2 = (to**2).sum(-1)
    facing = np.maximum(to @ np.asarray(normal), 0) * np.abs(to[..., axis])
    return float((facing / (np.pi * r2**2)).sum() * area / cells**2)


@pytest.mark.parametrize("wall", WALLS)
def test_a_missing_wall_of_a_black_room_is_its_view_factor(wall):
    room, groups = without(wall, scale=0.0)
    found = escaped_view(room, groups, POINTS, NORMALS)
    expected = [view_share(p, n, wall) for p, n in zip(POINTS, NORMALS, strict=True)]
    # 4096 stratified paths: the error is well below that of independent ones, 4 sigma of which
    sigma = np.sqrt(np.multiply(expected, np.subtract(1, expected)) / 4096)
    np.testing.assert_allclose(found.share, expected, atol=4 * sigma.max())
    side = found.by_side.sum(axis=0).argmax()
    assert SIDES[side] == wall
    np.testing.assert_allclose(found.by_side.sum(axis=1), found.share)
    plane = {"north": (1, DEPTH), "east": (0, WIDTH), "ceiling": (2, HEIGHT)}[wall]
    assert found.place[side][plane[0]] == pytest.approx(plane[1], abs=1e-4)


def test_windows_hole_and_what_is_absorbed_make_all():
    """A room that absorbs nothing: the row sum of V over pi and the share are 1."""
    room, groups = without("north")
    white = Surfaces(room.triangles, np.ones(len(room.triangles)), room.surface)
    found = escaped_view(white, groups, POINTS, NORMALS, samples=4096, max_depth=400)
    view = view_matrix(white, groups, POINTS, NORMALS, samples=4096, max_depth=400, stopping=Stopping(batches=8))
    whole = view.values.sum(axis=(1, 2)) / np.pi + found.share
    error = np.hypot(view.sum_error[:, 0] / np.pi, found.error)
    assert np.all(np.abs(whole - 1) < 5 * error + 1e-3), whole  # 1e-3: the walls' last bounce


def test_a_closed_room_loses_nothing():
    room, groups = test_room()
    found = escaped_view(room, groups, POINTS, NORMALS)
    assert found.share.max() < 1e-4  # seams between triangles


def test_the_share_is_kept(tmp_path):
    room, groups = without("east")
    cache = MatrixCache(tmp_path)
    first = escaped_view(room, groups, POINTS, NORMALS, cache=cache)
    (file,) = tmp_path.glob("escape-*.npz")
    before = file.stat().st_ino
    again = escaped_view(room, groups, POINTS, NORMALS, cache=cache)
    assert file.stat().st_ino == before
    np.testing.assert_array_equal(first.share, again.share)
    np.testing.assert_array_equal(first.place, again.place)
