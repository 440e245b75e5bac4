"""Absorption behind a pane between two rooms: what is reflected, absorbed and transmitted."""

from __future__ import annotations

import numpy as np
import pytest

from bim.fenestration import pane_transmissivity
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.gloss import STEPS, pane, pane_shares
from mitsuba_cfs.surfaces import Surfaces, WindowGroup, WindowSurface
from mitsuba_cfs.trace.matrices.adjacent import absorption_matrix

TAU, INDEX = 0.8, 1.52
FLOOR, CEILING, WEST, EAST, FRONT, BACK = range(6)


def sides(low, high) -> list[np.ndarray]:
    """Six sides of a box, each of two triangles, normals out of it."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    corners = [
        ((x0, y0, z0), (x0, y1, z0), (x1, y1, z0), (x1, y0, z0)),
        ((x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)),
        ((x0, y0, z0), (x0, y0, z1), (x0, y1, z1), (x0, y1, z0)),
        ((x1, y0, z0), (x1, y1, z0), (x1, y1, z1), (x1, y0, z1)),
        ((x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)),
        ((x0, y1, z0), (x0, y1, z1), (x1, y1, z1), (x1, y1, z0)),
    ]
    return [np.array([c[:3], (c[0], *c[2:])], dtype=float) for c in corners]


def absorbed(reflectance: float, *, through: bool, depth: float = 0.3) -> np.ndarray:
    """Absorption [K, 12] of two rooms: the first with a window in front, a pane for a back wall.

    Surfaces: those of the first room, whose front is the window, a tube through the wall for it,
    and those of the second, whose front is the pane.
    """
    first, second = sides((0, 0, 0), (4, 5, 3)), sides((0, 5 + depth, 0), (4, 9, 3))
    tube = np.concatenate(sides((0, 5, 0), (4, 5 + depth, 3))[:4])
    triangles = [tube if i == FRONT else part for i, part in enumerate(first)] + second
    numbers = np.repeat(np.arange(12), [len(part) for part in triangles])
    panes = (BACK, 6 + FRONT)
    rho = np.array([0.0 if i in panes else reflectance for i in range(12)])
    inner = pane_transmissivity(TAU, INDEX)
    even = tuple(pane_shares(np.linspace(0, 1, STEPS), INDEX, inner)[0].tolist())
    surfaces = Surfaces(
        np.concatenate(triangles),
        rho[numbers],
        numbers,
        gloss=tuple(pane(INDEX, inner) if i in panes else None for i in range(12)),
        transmittance=tuple(even if i in panes and through else None for i in range(12)),
    )
    window = WindowGroup("S", (WindowSurface("w", first[FRONT]),))
    return absorption_matrix(surfaces, [window], samples=2048).values[0]


def test_a_pane_transmits_by_angle_and_nothing_is_lost(variant) -> None:
    """Black rooms: what meets the pane once is reflected, absorbed or goes on to the next room."""
    opaque, clear = absorbed(0.0, through=False), absorbed(0.0, through=True)
    np.testing.assert_allclose(clear.sum(axis=1), 1.0, atol=2e-4)
    assert opaque[:, 6:12].sum() == 0.0  # the room beyond is dark
    inner = pane_transmissivity(TAU, INDEX)
    cosine = np.cos(KLEMS_FULL.centres()[0])
    tau, rho = pane_shares(cosine, INDEX, inner)
    met = opaque[:, BACK] / (1 - rho)
    beyond = clear[:, 6:12].sum(axis=1) + clear[:, FRONT]  # the tube in the wall is black too
    assert beyond[0] / met[0] == pytest.approx(tau[0], abs=0.01)
    assert clear[0, BACK] / met[0] == pytest.approx(1 - tau[0] - rho[0], abs=0.005)
    some = (met > 0.05) & (cosine > 0.5)
    np.testing.assert_allclose(beyond[some] / met[some], tau[some], atol=0.03)


def test_two_rooms_exchange_what_they_reflect(variant) -> None:
    """An even tube of white walls sends part of the light back through the pane."""
    grey = absorbed(0.6, through=True)
    assert grey.sum(axis=1).mean() == pytest.approx(1.0, abs=5e-4)  # but for Russian roulette
    black = absorbed(0.0, through=True)
    assert grey[0, [FLOOR, CEILING, WEST, EAST]].sum() > black[0, [FLOOR, CEILING]].sum() + 0.01
