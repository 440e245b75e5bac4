"""Derivatives of the sensors' illuminance against differences of whole computations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.methods.light import daylight, eye_illuminance, illuminance
from mitsuba_cfs.methods.optics import AngularOptics
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from mitsuba_cfs.methods.sensitivity import by_ground, by_reflectances
from mitsuba_cfs.sky.annual import given_sky
from mitsuba_cfs.surfaces import SurfaceGroups
from tests.methods.test_light import POINTS, UP, VIEW
from tests.trace import rooms

pytestmark = pytest.mark.usefixtures("variant")

GROUPS = SurfaceGroups(("floor", "ceiling", "walls"), np.array([0, 1, 2, 2, 2, 2, 2, 2, 2]))
FEW = Sampling(sensor_samples=8192, patch_samples=128, sun_points=64, subdivision=1, window_parts=1)
# one hour with the sun on the floor, one without sun
SUNS, DIRECT, DIFFUSE = [[0.1, -0.8, 0.6], [0.0, 0.8, 0.6]], [800.0, 0.0], [90.0, 120.0]
ALBEDO = 0.2


def light(method: str, *, group: int = -1, factor: float = 1.0, albedo: float = ALBEDO):
    room, groups = rooms.test_room()
    some = GROUPS.number[room.surface] == group
    room = replace(room, reflectance=np.where(some, factor * room.reflectance, room.reflectance))
    scene = DaylightScene(room, rooms.NOTHING, groups, POINTS, UP, VIEW, by_groups=GROUPS)
    sky = given_sky(SUNS, DIRECT, DIFFUSE, 1, day_of_year=172, ground_reflectance=albedo)
    optics = AngularOptics([0.0, 0.7, 0.7], reflected=[0.2, 0.2])
    return daylight(scene, [[optics]], sky, method=method, sampling=FEW)


def whole(one) -> np.ndarray:
    return np.concatenate([illuminance(one), eye_illuminance(one)[None]])


@pytest.mark.parametrize("method", ["three-phase", "five-phase"])
def test_reflectances(method):
    step, group = 0.1, 2
    derivative = by_reflectances(light(method))[group]
    ends = [whole(light(method, group=group, factor=f)) for f in (1 + step, 1 - step)]
    difference = (ends[0] - ends[1]) / (2 * step)
    # 4 sigma of it, and as much of the difference, whose curvature is below 1 %
    error = 6 * derivative.error_of_sum[:, None] + 0.01 * difference
    assert (np.abs(derivative.illuminance - difference) < error).all()
    # D has 128 paths of a patch
    assert (derivative.error_of_sum < 0.25 * derivative.illuminance.sum(axis=1)).all()


def test_the_ground_is_linear():
    up, down, middle = (whole(light("five-phase", albedo=ALBEDO * f)) for f in (1.5, 0.5, 1.0))
    found = by_ground(light("five-phase"))
    np.testing.assert_allclose(found.illuminance, up - down, rtol=1e-4, atol=1e-4)
    assert (found.illuminance < middle).all() and (found.illuminance > 0).all()


def test_a_scene_without_groups_is_refused():
    one = light("three-phase")
    bare = replace(one, matrices=replace(one.matrices, scene=replace(one.scene, by_groups=None)))
    with pytest.raises(ValueError, match="names no groups of surfaces"):
        by_reflectances(bare)
