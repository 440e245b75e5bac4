"""Derivatives of matrices by reflectance: exact for one reflection, and against differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.surfaces import SurfaceGroups, Surfaces
from tests.trace import rooms

pytestmark = pytest.mark.usefixtures("variant")

# floor, ceiling and the walls of the test room, of which the last has no derivative
GROUPS = SurfaceGroups(("floor", "ceiling", "walls"), np.array([0, 1, 2, 2, 2, 2, 2, 2, -1]))
POINTS = np.array([[1.8, 1.0, 0.8], [0.6, 2.2, 0.8], [1.8, 3.8, 1.6]])
UP = np.tile([0.0, 0.0, 1.0], (3, 1))


def views(interior: Surfaces, *, samples: int, depth: int, by: bool = True, seed: int = 0):
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.kernels.path_options import PathOptions
    from mitsuba_cfs.trace.kernels.rooms import TracedRoom
    from mitsuba_cfs.trace.matrices.view import views_of_rooms

    room = TracedRoom(interior, tuple(rooms.test_room()[1]), POINTS, UP)
    paths = PathOptions(samples, depth, Stopping(batches=4), seed)
    (found,) = views_of_rooms([room], paths, by_groups=[GROUPS] if by else (), with_direct=True)
    return found


def scaled(interior: Surfaces, group: int, factor: float) -> Surfaces:
    """The room with the reflectances of a group times a factor."""
    some = GROUPS.number[interior.surface] == group
    return replace(interior, reflectance=np.where(some, factor * interior.reflectance, interior.reflectance))


def test_the_matrix_is_the_same_with_derivatives():
    interior = rooms.test_room()[0]
    plain, derived = (views(interior, samples=64, depth=32, by=by) for by in (False, True))
    np.testing.assert_array_equal(plain.whole.values, derived.whole.values)
    np.testing.assert_array_equal(plain.direct.values, derived.direct.values)
    assert plain.by_reflectance == () and len(derived.by_reflectance) == 3


def test_of_one_reflection_the_derivatives_add_up_to_it():
    interior = rooms.test_room()[0]
    without = replace(interior, reflectance=np.where(GROUPS.number[interior.surface] < 0, 0.0, interior.reflectance))
    found = views(without, samples=256, depth=2)
    reflected = found.whole.values - found.direct.values
    total = sum(one.values for one in found.by_reflectance)
    assert reflected.sum() > 0
    np.testing.assert_allclose(total, reflected, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("group", [0, 1, 2])
def test_against_differences(group):
    step, samples = 0.15, 8192
    interior = rooms.test_room()[0]
    found = views(interior, samples=samples, depth=32).by_reflectance[group]
    ends = [
        views(scaled(interior, group, f), samples=samples, depth=32, by=False, seed=1) for f in (1 + step, 1 - step)
    ]
    sums = [end.whole.values.sum(axis=(1, 2)) for end in ends]
    difference = (sums[0] - sums[1]) / (2 * step)
    slope, error = found.values.sum(axis=(1, 2)), found.sum_error.sum(axis=1)
    # 4 sigma of the derivative and as much of the difference, whose curvature is below 1 %
    np.testing.assert_allclose(slope, difference, atol=4 * np.hypot(error, 0.01 * slope).max())


def test_of_rooms_together_they_are_those_of_each_alone():
    from mitsuba_cfs.trace.kernels.estimate import Stopping
    from mitsuba_cfs.trace.kernels.path_options import PathOptions
    from mitsuba_cfs.trace.kernels.rooms import TracedRoom
    from mitsuba_cfs.trace.matrices.view import views_of_rooms

    room, groups = rooms.test_room()
    both = [TracedRoom(one, tuple(groups), POINTS, UP) for one in (room, scaled(room, 2, 0.5))]
    few = PathOptions(64, 8, Stopping(batches=2))
    together = views_of_rooms(both, few, by_groups=[GROUPS, GROUPS])
    for one, of_both in zip(both, together, strict=True):
        (alone,) = views_of_rooms([one], few, by_groups=[GROUPS])
        for a, b in zip(alone.by_reflectance, of_both.by_reflectance, strict=True):
            assert abs(a.values.sum() - b.values.sum()) < 1e-3 * a.values.sum()


def test_cells_of_the_sun_have_exact_derivatives():
    from mitsuba_cfs.trace.kernels.scene import TracedScene
    from mitsuba_cfs.trace.sun.sunlit_sensors import room_cells, shares_and_derivatives

    interior, groups = rooms.test_room()

    def shares(surfaces: Surfaces) -> np.ndarray:
        inside = TracedScene(surfaces, groups)
        return shares_and_derivatives(
            room_cells(inside, samples=1024), inside, (POINTS, UP), samples=1024, by_groups=GROUPS
        )

    found, step = shares(interior), 0.02
    for group in range(3):
        ends = [shares(scaled(interior, group, factor))[0] for factor in (1 + step, 1 - step)]
        difference = (ends[0] - ends[1]) / (2 * step)
        assert found[1 + group].sum() > 0
        # the same rays; the last reflection that is counted has a ten thousandth of the light
        np.testing.assert_allclose(found[1 + group].sum(axis=1), difference.sum(axis=1), rtol=0.01)


def test_groups_that_cannot_be_are_refused():
    with pytest.raises(ValueError, match="1 to 4 groups"):
        SurfaceGroups(tuple("abcde"), np.zeros(1, dtype=np.int64))
    with pytest.raises(ValueError, match="-1 to 0"):
        SurfaceGroups(("floor",), np.array([1]))
