"""The matrices of rooms that are traced together: cached for each room, equal to its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.phase_matrices import matrices_together, phase_matrices
from mitsuba_cfs.methods.scene import DaylightScene, Sampling
from tests.trace import rooms
from tests.trace.test_rooms_together import facade, sensors

pytestmark = pytest.mark.usefixtures("variant")
FEW = Sampling(sensor_samples=256, patch_samples=256, subdivision=1, seed=5)
MATRICES = ("daylight", "sensors")
DIRECT = ("direct_daylight", "straight_daylight", "direct_sensors")


def test_rooms_find_the_matrices_that_were_traced_together(tmp_path, monkeypatch):
    each, outdoors = facade()
    interior, groups = rooms.test_room()
    points, up = sensors(groups, 4)
    shift = np.array([4.0, 0.0, 0.0])
    moved = replace(interior, triangles=interior.triangles + shift)
    scenes = [
        DaylightScene(interior, each[0].surfaces, each[0].groups, points, up),
        DaylightScene(moved, each[1].surfaces, each[1].groups, points + shift, up),
    ]
    apart = [phase_matrices(scene, FEW) for scene in scenes]
    cache = MatrixCache(tmp_path)
    together = matrices_together(scenes, outdoors, FEW, cache=cache)
    files = {file.name for file in tmp_path.iterdir()}
    for scene, one, other in zip(scenes, apart, together, strict=True):
        stored = phase_matrices(scene, FEW, cache=MatrixCache(tmp_path, stores=False))
        for name in MATRICES:
            alone, found = (getattr(matrices, name).values for matrices in (one, other))
            assert np.abs(found - alone).sum() < 1e-4 * alone.sum(), name
            np.testing.assert_array_equal(getattr(stored, name).values, found)
        for name in DIRECT:
            alone, found = (getattr(matrices, name) for matrices in (one, other))
            assert np.abs(found - alone).sum() < 1e-4 * alone.sum(), name
            np.testing.assert_array_equal(getattr(stored, name), found)
    assert {file.name for file in tmp_path.iterdir()} == files
    empty = tmp_path / "empty"
    empty.mkdir()
    phase_matrices(scenes[0], FEW, cache=MatrixCache(empty, stores=False))
    assert not any(empty.iterdir())
