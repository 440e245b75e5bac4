"""Triangles of one surface that face one way are one face."""

from __future__ import annotations

import numpy as np

from mitsuba_cfs.trace.kernels.pixel_rows import face_numbers


def test_faces_are_numbered_by_surface_and_then_by_direction():
    up, down, tilted = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 0.6, 0.8)
    surface = np.array([7, 7, 3, 7, 3, 7], dtype=np.uint32)
    normal = np.array([up, down, up, (0.01, 0.0, 1.0), tilted, up])
    assert face_numbers(surface, normal).tolist() == [3, 2, 0, 3, 1, 3]
    assert face_numbers(np.empty(0), np.empty((0, 3))).tolist() == []
