"""Rooms share their kernels: nothing is compiled again for a room of another shape and place.

What a building of many rooms costs hangs on this: compiling took three quarters of a first run.
"""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.surfaces import Surfaces, WindowGroup, WindowSurface

from . import rooms

pytestmark = pytest.mark.usefixtures("variant")
FEW = {"samples": 8, "max_depth": 4}


def turned_room() -> tuple[Surfaces, list[WindowGroup], Surfaces]:
    """The test room, larger, turned and elsewhere, with two windows and one surface less."""
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])

    def moved(triangles):
        return (1.3 * triangles) @ turn.T + [40.0, -7.0, 3.0]

    interior, (group,) = rooms.test_room()
    glass = group.windows[0].triangles
    panes = tuple(WindowSurface(f"w{i}", moved(glass[i : i + 1])) for i in range(2))
    walls = Surfaces(
        moved(interior.triangles[:-2]), interior.reflectance[:-2], interior.surface[:-2]
    )
    outside = rooms.obstruction()
    shade = Surfaces(moved(outside.triangles), outside.reflectance, outside.surface)
    return walls, [WindowGroup("south", panes)], shade


def traced(interior: Surfaces, groups: list[WindowGroup], exterior: Surfaces, sensors: int):
    """Most of what a room's year is traced by."""
    from mitsuba_cfs.trace.absorption_matrix import absorption_matrix
    from mitsuba_cfs.trace.annual_pictures import view_matrices
    from mitsuba_cfs.trace.daylight_matrix import daylight_matrix
    from mitsuba_cfs.trace.direct_sun import KlemsScattering, direct_sun_matrix
    from mitsuba_cfs.trace.escape import escaped_view
    from mitsuba_cfs.trace.estimate import Stopping
    from mitsuba_cfs.trace.reflected_sun import window_shares
    from mitsuba_cfs.trace.scene import TracedScene
    from mitsuba_cfs.trace.view_matrix import view_matrix

    K, stopping = KLEMS_FULL.size, Stopping(batches=2)
    middle = groups[0].windows[0].triangles.mean(axis=(0, 1)) - 1.5 * groups[0].frame[2]
    points = middle + np.linspace(0.0, 0.3, sensors)[:, None]
    up = np.tile([0.0, 0.0, 1.0], (sensors, 1))
    view_matrix(interior, groups, points, up, stopping=stopping, **FEW)
    daylight_matrix(exterior, groups, subdivision=1, stopping=stopping, **FEW)
    absorption_matrix(interior, groups, stopping=stopping, **FEW)
    escaped_view(interior, groups, points, up, **FEW)
    way = KlemsScattering(KLEMS_FULL, np.full((K, K), 0.1), np.full(K, 0.3))
    suns = groups[0].frame[2] + np.linspace(0.0, 0.2, 5 + sensors)[:, None]
    direct_sun_matrix(
        interior, exterior, groups, [way], points, up,
        suns=suns, window_points=8, stopping=stopping,
    )  # fmt: skip
    window_shares(TracedScene(exterior, groups), samples=8)
    view = fisheye(middle, groups[0].frame[2], 16 + sensors)
    view_matrices(interior, groups, view, samples=2, max_depth=4)


def test_second_room_compiles_nothing():
    import drjit as dr

    interior, groups = rooms.test_room()
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        traced(interior, groups, rooms.obstruction(), 5)
        first = dr.kernel_history([dr.KernelType.JIT])
        traced(*turned_room(), 6)
        second = dr.kernel_history([dr.KernelType.JIT])
    known = {kernel["hash"] for kernel in first}
    new = [kernel for kernel in second if kernel["hash"] not in known]
    assert len(first) > 20 and not new, f"{len(new)} kernels of {len(second)} are the room's own"
