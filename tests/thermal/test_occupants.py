"""People at blinds, against the closed forms of their models."""

from __future__ import annotations

import numpy as np
import pytest

from thermal.occupants import arrivals, haldi_robinson_2010, lightswitch_2002

PRESENT = np.tile((np.arange(24) >= 8) & (np.arange(24) < 18), 3).astype(float)
DAY = np.repeat([0, 1, 2], 24)


def test_the_first_who_come_are_those_of_a_day() -> None:
    assert np.flatnonzero(arrivals(PRESENT, DAY)).tolist() == [8, 32, 56]
    lunch = PRESENT.copy()
    lunch[12] = 0
    assert np.flatnonzero(arrivals(lunch, DAY)).tolist() == [8, 32, 56]


def test_lightswitch_lowers_once_and_raises_in_the_morning() -> None:
    sun = np.zeros(72)
    sun[[6, 10, 33]] = 51.0  # before anybody is there, in the morning, on the second day
    sun[11] = 50.0
    states = lightswitch_2002(sun, PRESENT, DAY, closed=2)
    assert np.flatnonzero(np.diff(states)).tolist() == [9, 31, 32, 55]
    assert set(states) == {0, 2}


def test_haldi_and_robinson_s_first_step_has_the_probability_of_arrival() -> None:
    """4000 open blinds, one step: lowered with p(-7.41 + 1.035e-3 E + 2.17)."""
    lux, count = 5000.0, 4000
    (shares,) = haldi_robinson_2010(lambda hour, open_shares: lux, [40000.0], [1.0], blinds=count, substeps=1)
    expected = 1 / (1 + np.exp(-(-7.41 + 1.035e-3 * lux + 2.17)))
    error = np.sqrt(expected * (1 - expected) / count)
    lowered = shares < 1.0
    assert lowered.mean() == pytest.approx(expected, abs=4 * error)
    whole = 1 / (1 + np.exp(-(-0.27 + 0.91e-6 * 40000.0 - 2.23)))
    error = np.sqrt(whole * (1 - whole) / lowered.sum())
    part = np.exp(-2.294 + 1.522)
    reaches = np.exp(-((1.0 / part) ** 1.708))  # a share of more than all that is open
    all_of = whole + (1 - whole) * reaches
    assert np.mean(shares[lowered] == 0.0) == pytest.approx(all_of, abs=4 * error)


def test_nobody_moves_a_blind_who_is_not_there() -> None:
    shares = haldi_robinson_2010(lambda hour, open_shares: 20000.0, np.full(72, 80000.0), PRESENT, blinds=2, seed=3)
    away = np.flatnonzero(PRESENT == 0)
    away = away[(away > 0)]
    same = [np.array_equal(shares[h], shares[h - 1]) for h in away if PRESENT[h - 1] == 0]
    assert all(same) and (shares[PRESENT > 0] < 1).any()
