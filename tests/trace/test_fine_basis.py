"""Bases of high resolution, and the three phases on them."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs import phases
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KLEMS_HALF, KlemsBasis
from tests.trace import rooms
from tests.validation.fine_basis import fine_basis


@pytest.mark.parametrize("basis", [KLEMS_FULL, KLEMS_HALF])
def test_fine_patches_divide_the_coarse_ones(basis):
    fine = fine_basis(3, basis)
    assert set(np.round(basis.theta_bounds, 12)) <= set(np.round(fine.theta_bounds, 12))
    omega = fine.projected_solid_angles()
    assert omega.sum() == pytest.approx(np.pi)
    rings = np.searchsorted(basis.theta_bounds, fine.centres()[0] + 1e-9, side="right") - 1
    of_ring = np.bincount(rings, omega)
    assert of_ring == pytest.approx(np.bincount(basis.rings, basis.projected_solid_angles()))
    assert len(fine.opposite()) == fine.size  # even counts of azimuths
    assert fine_basis(1, basis) is basis
    with pytest.raises(ValueError, match="at least 1"):
        fine_basis(0)


def test_the_sun_through_glass_is_nearer_the_two_phase_matrix_on_a_fine_basis(variant):
    """One sky patch that shines through a clear hole onto sensors in and beside its beam."""
    from mitsuba_cfs.sky.patches import ReinhartSky
    from mitsuba_cfs.trace.matrices.daylight import daylight_matrix, sky_irradiance_matrix
    from mitsuba_cfs.trace.matrices.view import view_matrix

    room, groups = rooms.test_room()
    points = np.array([[1.2, y, 0.8] for y in np.arange(0.2, 2.6, 0.4)])
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    sky = np.zeros((ReinhartSky(2).size, 1))
    sky[ReinhartSky(2).index(np.array([0.25, -0.8, 0.6]))] = 1.0
    exact = sky_irradiance_matrix(room, points, up, subdivision=2, samples=32768, max_depth=32)

    def error(basis: KlemsBasis) -> float:
        view = view_matrix(room, groups, points, up, basis=basis, samples=1024)
        daylight = daylight_matrix(rooms.NOTHING, groups, basis=basis, subdivision=2, samples=4096 * 145 // basis.size)
        found = phases.three_phase(view.values, [np.eye(basis.size)], daylight.values, sky)
        return float(np.sqrt(np.mean((found - exact.values @ sky) ** 2)))

    # steps of 10 and of 3.3 degrees; the error of an edge's blur falls with the step
    assert error(fine_basis(3)) < 0.6 * error(KLEMS_FULL)
