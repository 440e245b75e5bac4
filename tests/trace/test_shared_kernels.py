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
    """The test room eight times as large, turned, elsewhere; two windows, one surface less."""
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])

    def moved(triangles):
        return (8.0 * triangles) @ turn.T + [40.0, -7.0, 3.0]

    interior, (group,) = rooms.test_room()
    glass = group.windows[0].triangles
    panes = tuple(WindowSurface(f"w{i}", moved(glass[i : i + 1])) for i in range(2))
    walls = Surfaces(moved(interior.triangles[:-2]), interior.reflectance[:-2], interior.surface[:-2])
    outside = rooms.obstruction()
    shade = Surfaces(moved(outside.triangles), outside.reflectance, outside.surface)
    return walls, [WindowGroup("south", panes)], shade


def sensors_of(groups: list[WindowGroup], count: int):
    """Sensors [S, 3] behind the first window; for 6 and 7 sums keep their power of two."""
    middle = groups[0].windows[0].triangles.mean(axis=(0, 1)) - 1.5 * groups[0].frame[2]
    points = middle + np.linspace(0.0, 0.3, count)[:, None]
    return points, np.tile([0.0, 0.0, 1.0], (count, 1))


def matrices(interior: Surfaces, groups: list[WindowGroup], exterior: Surfaces, sensors: int):
    """V and D."""
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix
    from mitsuba_cfs.trace.matrices.view import view_matrix

    stopping = Stopping(batches=2)
    view_matrix(interior, groups, *sensors_of(groups, sensors), stopping=stopping, **FEW)
    daylight_matrix(exterior, groups, subdivision=1, stopping=stopping, **FEW)


def the_rest(interior: Surfaces, groups: list[WindowGroup], exterior: Surfaces, sensors: int):
    """Most of what else a room's year is traced by."""
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.kernels.scattering import KlemsScattering
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.matrices.adjacent import absorption_matrix
    from mitsuba_cfs.trace.matrices.straight_view import escaped_view
    from mitsuba_cfs.trace.pictures.annual import view_matrices
    from mitsuba_cfs.trace.sun.direct import direct_sun_matrix
    from mitsuba_cfs.trace.sun.reflected import window_shares

    K, stopping = KLEMS_FULL.size, Stopping(batches=2)
    points, up = sensors_of(groups, sensors)
    absorption_matrix(interior, groups, stopping=stopping, **FEW)
    escaped_view(interior, groups, points, up, **FEW)
    way = KlemsScattering(KLEMS_FULL, np.full((K, K), 0.1), np.full(K, 0.3))
    suns = groups[0].frame[2] + np.linspace(0.0, 0.2, 5 + sensors)[:, None]
    direct_sun_matrix(interior, exterior, groups, [way], points, up, suns=suns, window_points=8, stopping=stopping)
    window_shares(TracedScene(exterior, groups), samples=8)
    view = fisheye(points[0], groups[0].frame[2], 16 + sensors)
    view_matrices(interior, groups, view, samples=2, max_depth=4)


@pytest.mark.parametrize("traced", [matrices, pytest.param(the_rest, marks=pytest.mark.slow)], ids=lambda f: f.__name__)
def test_second_room_compiles_nothing(traced):
    import drjit as dr

    interior, groups = rooms.test_room()
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        traced(interior, groups, rooms.obstruction(), 6)
        first = dr.kernel_history([dr.KernelType.JIT])
        traced(*turned_room(), 7)
        second = dr.kernel_history([dr.KernelType.JIT])
    known = {kernel["hash"] for kernel in first}
    new = [kernel for kernel in second if kernel["hash"] not in known]
    assert len(first) > 5 and not new, f"{len(new)} kernels of {len(second)} are the room's own"


def test_scene_of_the_same_objects_is_found_again_and_no_other():
    from mitsuba_cfs.trace.kernels.scene import SCENES, SceneCache

    (interior, groups), cache = rooms.test_room(), SceneCache()
    first = cache.scene(interior, groups)
    assert cache.scene(interior, list(groups)) is first
    assert SceneCache().scene(interior, groups) is not first
    others = [
        cache.scene(interior, groups, windows_block=False),
        cache.scene(interior, groups, window_reflectance=[0.2]),
        cache.scene(interior, groups, window_reflectance=[0.4]),
        cache.scene(rooms.test_room()[0], groups),
    ]
    assert len({id(scene) for scene in (first, *others)}) == 5
    for _ in range(SCENES):
        cache.scene(rooms.test_room()[0], groups)
    assert cache.scene(interior, groups) is not first


def test_a_scene_is_found_again_whether_its_centre_is_said_or_not() -> None:
    from mitsuba_cfs.trace.kernels.scene import SceneCache

    (interior, groups), cache = rooms.test_room(), SceneCache()
    found = cache.scene(interior, groups)
    assert cache.scene(interior, groups, centre=found.centre) is found
    assert cache.scene(interior, groups, centre=found.centre + 1e-3) is not found


def test_sun_by_mirrors_has_one_kernel_for_all_paths():
    """It follows one mirror after the other; with all of them in its code OptiX would compile it for minutes."""
    import drjit as dr

    from mitsuba_cfs.gloss import mirror
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun.lit_points import SurfacePoints, sunlight
    from mitsuba_cfs.trace.sun.specular_paths import specular_sun_paths

    panes = np.concatenate(
        [
            rooms.quad((x, y, 0), (x + 4, y + turn, 0), (x + 4, y + turn, 3), (x, y, 3))
            for x, y, turn in [(0, -10, -1), (5, -11, 0), (10, -11, 1), (0, 0.5, 1), (5, 1.5, 0)]
        ]
    )
    number = np.repeat(np.arange(5), 2)
    there = Surfaces(panes, np.zeros(10), number, (), (mirror(0.8),) * 5)
    outside = TracedScene(there, rooms.test_room()[1])
    paths = specular_sun_paths(outside)
    places = SurfacePoints(np.zeros((30, 3), np.float32), np.tile([0, -1.0, 0], (30, 1)))
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        sunlight(outside, places, np.array([[0.3, -0.8, 0.5], [0.0, -0.6, 0.8]]))
        kernels = dr.kernel_history([dr.KernelType.JIT])
    lengths = {len(path.planes) for path in paths}
    assert len(paths) > 2 * len(lengths) > 4
    tracing = {k["hash"] for k in kernels if k["operation_count"] > 200}
    assert len(kernels) >= len(paths)
    assert len(tracing) <= 2, [k["operation_count"] for k in kernels]
