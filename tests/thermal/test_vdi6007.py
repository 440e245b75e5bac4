"""VDI 6007-1's test cases: the room balance with constant films and longwave coefficient."""

from __future__ import annotations

import numpy as np
import pytest

from tests.validation.vdi6007 import POWER, TOLERANCE, apart, cases, run
from thermal.balance import BalanceOptions
from thermal.errors import ThermalInputError


@pytest.mark.parametrize("number", [4, 7, 12])  # radiant gains, limited power, sun and air
def test_the_norms_results_within_its_tolerance(number):
    unit = "W" if number in POWER else "K"
    difference = apart(number, run(cases()[number]))
    assert np.max(np.abs(difference)) <= TOLERANCE[unit]


def test_stated_films_belong_to_their_convection():
    for options in ({"inside_films": (2.5, 5.0, 0.7)}, {"inside_convection": "stated"}):
        with pytest.raises(ThermalInputError, match="inside_films"):
            BalanceOptions(**options)
