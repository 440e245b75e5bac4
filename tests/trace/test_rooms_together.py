"""Matrices of several rooms that are traced together: those of each room alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.surfaces import SharedOutdoors, Surfaces, WindowGroup, WindowSurface

from . import rooms

pytestmark = pytest.mark.usefixtures("variant")
SEVERAL = 70  # sensors: more than share hits
FEW = {"samples": 64, "seed": 3}


def sensors(groups: list[WindowGroup], count: int):
    """Sensors [S, 3] behind the first window, below its middle."""
    middle = groups[0].windows[0].triangles.mean(axis=(0, 1)) - 1.5 * groups[0].frame[2]
    points = middle + np.linspace(0.0, 0.5, count)[:, None] - [0.13, 0.0, 0.4]
    return points, np.tile([0.0, 0.0, 1.0], (count, 1))


def elsewhere() -> tuple[Surfaces, list[WindowGroup]]:
    """The test room enlarged, turned and moved, with two windows in groups of their own."""
    turn = 1.2 * np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    walls, (group,) = rooms.test_room()
    glass = group.windows[0].triangles @ turn.T + [40.0, -7.0, 3.0]
    groups = [WindowGroup(str(i), (WindowSurface(str(i), glass[i : i + 1]),)) for i in range(2)]
    return replace(walls, triangles=walls.triangles @ turn.T + [40.0, -7.0, 3.0]), groups


def three_rooms():
    """The test room, one that is turned and elsewhere, the test room with darker walls."""
    from mitsuba_cfs.trace.kernels.rooms import TracedRoom

    first, groups = rooms.test_room()
    turned, others = elsewhere()
    dark, _ = rooms.test_room(scale=0.5)
    return [
        TracedRoom(first, groups, *sensors(groups, 5)),
        TracedRoom(turned, others, *sensors(others, SEVERAL)),
        TracedRoom(dark, groups, *sensors(groups, 3)),
    ]


@pytest.mark.parametrize("depth", [1, 32])
def test_rooms_together_have_the_matrices_of_each_alone(depth):
    from mitsuba_cfs.trace.kernels.path_options import PathOptions
    from mitsuba_cfs.trace.matrices.view import view_matrix, views_of_rooms

    several = three_rooms()
    together = views_of_rooms(several, PathOptions(max_depth=depth, **FEW), with_direct=True)
    for room, (found, direct, _) in zip(several, together, strict=True):
        alone = view_matrix(room.surfaces, room.groups, room.points, room.directions, max_depth=depth, **FEW)
        assert found.values.shape == alone.values.shape
        change = np.abs(found.values - alone.values).sum() / alone.values.sum()
        assert change < 2e-5, f"{change:.1e} of the light"
        error = found.sum_error.mean() / alone.sum_error.mean()
        assert error == pytest.approx(1.0, rel=1e-2)
        again = views_of_rooms([room], PathOptions(max_depth=1, **FEW))[0].whole
        assert np.abs(direct.values - again.values).sum() < 2e-5 * again.values.sum()
        assert np.allclose(found.covariance, alone.covariance, rtol=0.05, atol=1e-6)


def facade():
    """Three rooms that see an obstruction and the windows of each other, and the whole outdoors."""
    from mitsuba_cfs.trace.kernels.rooms import TracedRoom, joined_surfaces

    _, (group,) = rooms.test_room()
    glass, windows, groups = group.windows[0].triangles, [], []
    for number, shift in enumerate(([0, 0, 0], [4.0, 0, 0], [1.0, -7.0, 1.0])):
        side = np.array([1.0, 1.0 if number < 2 else -1.0, 1.0])  # the third one looks back
        pane = glass * side + np.array(shift, dtype=float)
        pane = pane if number < 2 else pane[:, ::-1]
        groups.append([WindowGroup("s", (WindowSurface("w", pane),))])
        out = -0.05 * side[1] * np.array([0.0, 1.0, 0.0])
        windows.append(Surfaces(np.concatenate([pane, pane + out]), np.full(4, 0.6), np.zeros(4)))
    common = rooms.obstruction()
    outdoors = SharedOutdoors(
        joined_surfaces([common, *windows]), np.repeat([-1, 0, 1, 2], [len(common.triangles), 4, 4, 4])
    )
    each = [
        TracedRoom(joined_surfaces([common, *(w for w in windows if w is not windows[i])]), groups[i], number=i)
        for i in range(3)
    ]
    return each, outdoors


@pytest.mark.parametrize("depth", [1, 16])
def test_windows_together_have_the_daylight_of_each_alone(depth):
    from mitsuba_cfs.trace.kernels.path_options import PathOptions
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix, daylight_of_rooms

    each, outdoors = facade()
    options = {"max_depth": depth, "samples": 64, "seed": 2}
    together = daylight_of_rooms(each, outdoors, PathOptions(**options), subdivision=1)
    for room, found in zip(each, together, strict=True):
        alone = daylight_matrix(room.surfaces, room.groups, subdivision=1, **options)
        change = np.abs(found.values - alone.values).sum() / alone.values.sum()
        assert change < 1e-4, f"{change:.1e} of the light"
        assert found.values.sum() == pytest.approx(alone.values.sum(), rel=1e-5)
        assert found.sum_error.mean() == pytest.approx(alone.sum_error.mean(), rel=1e-2)


def test_windows_together_before_a_mountain_have_the_daylight_of_each_alone():
    """Surroundings that reach kilometres do not make the rooms' own windows less exact."""
    from mitsuba_cfs.trace.kernels.path_options import PathOptions
    from mitsuba_cfs.trace.kernels.rooms import joined_surfaces
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix, daylight_of_rooms

    each, outdoors = facade()
    slope = rooms.quad((-900, -6000, 0), (900, -6000, 0), (900, -7000, 800), (-900, -7000, 800))
    mountain = Surfaces(slope, np.full(2, 0.5), np.zeros(2))
    before = SharedOutdoors(joined_surfaces([mountain, outdoors.surfaces]), np.append([-1, -1], outdoors.owner))
    far = [replace(one, surfaces=joined_surfaces([mountain, one.surfaces])) for one in each]
    options = {"max_depth": 16, "samples": 64, "seed": 2}
    together = daylight_of_rooms(far, before, PathOptions(**options), subdivision=1)
    for room, found in zip(far, together, strict=True):
        alone = daylight_matrix(room.surfaces, room.groups, subdivision=1, **options)
        change = np.abs(found.values - alone.values).sum() / alone.values.sum()
        assert change < 1e-3, f"{change:.1e} of the light"
