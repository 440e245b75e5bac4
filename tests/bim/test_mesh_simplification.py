"""Meshes of many triangles become coarser by a stated error, and slats do not vanish."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from bim.model import Element
from bim.outdoors import FINE, STEPS, simplified, simplified_mesh
from mitsuba_cfs.surfaces import area_vectors


def sphere(count: int) -> np.ndarray:
    """A sphere of radius 0.2 m in 2 x count x count triangles."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, count + 1), np.linspace(0.01, 3.13, count + 1))
    p = 0.2 * np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], axis=-1)
    a, b, c, d = p[:-1, :-1], p[:-1, 1:], p[1:, 1:], p[1:, :-1]
    both = np.stack([np.stack([a, c, b], axis=-2), np.stack([a, d, c], axis=-2)])
    return both.reshape(-1, 3, 3)


def bars(count: int, width: float) -> np.ndarray:
    """Square bars of a metre length along x, each of two crossed strips."""
    z = 0.05 * np.arange(count)
    strip = np.array([[0, 0, 0], [1, 0, 0], [1, width, 0], [0, 0, 0], [1, width, 0], [0, width, 0]])
    return (strip[None] + np.stack([0 * z, 0 * z, z], axis=-1)[:, None]).reshape(-1, 3, 3)


def test_vertices_move_by_no_more_than_is_said():
    fine = sphere(150)
    (element,), (said,) = simplified([Element("g", "Palm", "IfcFurniture", fine, 0.5, 0.5)])
    assert len(element.triangles) <= FINE < len(fine)
    assert said.values["after"] == len(element.triangles)
    corners, error = element.triangles.reshape(-1, 3), simplified_mesh(fine)[1]
    assert 0 < error <= STEPS[-1] * np.sqrt(3)
    assert said.values["moved_mm"] == pytest.approx(1000 * error)
    away = cKDTree(corners).query(fine.reshape(-1, 3))[0]  # to where a vertex may have gone
    assert 0.3 * error < away.max() <= error
    area = np.linalg.norm(area_vectors(element.triangles), axis=1).sum()
    assert area == pytest.approx(4 * np.pi * 0.2**2, rel=0.05)


def test_few_triangles_stay_as_they_are():
    few = sphere(20)
    assert simplified_mesh(few)[0] is few
    assert simplified([Element("g", "Ball", "IfcFurniture", few, 0.5, 0.5)])[1] == []


def test_thin_bars_do_not_vanish():
    thin = bars(4000, 0.004)
    area = np.linalg.norm(area_vectors(thin), axis=1).sum()
    left = np.linalg.norm(area_vectors(simplified_mesh(thin)[0]), axis=1).sum()
    assert left >= 0.9 * area
