"""The simple window model: pinned to its polynomials' values, energy kept, g given back."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.simple_glazing import (
    solar_reflectance,
    solar_transmittance,
    visible_reflectances,
)


@pytest.mark.parametrize(
    ("u", "g", "expected"),
    [(1.0, 0.1, 0.04104), (1.2, 0.5, 0.418463), (5.8, 0.5, 0.33666), (5.8, 0.82, 0.764253),
     (3.95, 0.5, (0.418463 + 0.33666) / 2)],
)  # fmt: skip
def test_solar_transmittance_is_that_of_the_polynomials(u, g, expected) -> None:
    assert solar_transmittance(u, g) == pytest.approx(expected, abs=2e-6)


def test_shares_of_one_in_the_whole_range() -> None:
    for u in np.linspace(0.3, 5.8, 12):
        for g in np.linspace(0.02, 0.95, 20):
            tau = solar_transmittance(u, g)
            rho = solar_reflectance(u, g, tau)
            assert 0 < tau <= g and 0 <= rho < 1 - tau
            # what is absorbed suffices for what of it goes inwards
            assert g - tau <= 1 - tau - rho + 1e-9
    for tau in np.linspace(0.01, 1, 30):
        assert all(0 <= rho <= 1 - tau for rho in visible_reflectances(tau))
