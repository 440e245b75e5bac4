"""VDI 6007-1's test cases: the room balance with constant films and longwave coefficient."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.validation.vdi6007 import POWER, TOLERANCE, apart, as_the_library, cases, hourly, run
from thermal.balance import BalanceOptions
from thermal.errors import ThermalInputError


@pytest.mark.parametrize("number", [4, 7, 12])  # radiant gains, limited power, sun and air
def test_the_norms_results_within_its_tolerance(number):
    unit = "W" if number in POWER else "K"
    difference = apart(number, hourly(number, run(cases()[number])))
    assert np.max(np.abs(difference)) <= TOLERANCE[unit]


def test_cooled_ceiling_acts_at_its_surface():
    """Case 11: 0.9 W rms and 5.3 W where heating turns into cooling; at all faces 22 and 109 W."""
    case = cases()[11]
    difference = apart(11, hourly(11, run(case)))
    assert np.sqrt(np.mean(difference**2)) < 1.0 and np.max(np.abs(difference)) < 6.0
    assert np.sum(np.abs(difference) > TOLERANCE["W"]) == 2
    spread = replace(case, loads=replace(case.loads, cooling_surface=""))
    assert np.sqrt(np.mean(apart(11, hourly(11, run(spread))) ** 2)) > 10.0


def test_cooled_ceiling_as_the_library_checks_it():
    """With its substitute for two minutes of two hours: 5.3 -> 1.8 W (bar 1.5 W), once."""
    difference = apart(11, as_the_library(run(cases()[11], rows_h=60)))
    assert np.max(np.abs(difference)) < 2.0 and np.sum(np.abs(difference) > TOLERANCE["W"]) <= 1


def test_stated_films_belong_to_their_convection():
    for options in ({"inside_films": (2.5, 5.0, 0.7)}, {"inside_convection": "stated"}):
        with pytest.raises(ThermalInputError, match="inside_films"):
            BalanceOptions(**options)
