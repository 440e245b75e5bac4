"""Standard errors of DA and sDA from the noise of the illuminance."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.metrics.autonomy import daylight_autonomy, daylight_autonomy_error
from mitsuba_cfs.metrics.lm83 import spatial_daylight_autonomy_error


def test_the_error_of_da_is_its_spread() -> None:
    """Illuminance even between 0 and 1,000 lx, scaled by noise of 2 %: DA = 0.7 -+ 0.3 x 0.02."""
    lux, hours = np.arange(0.05, 1000, 0.1)[:, None], np.ones(10_000, dtype=bool)
    random = np.random.default_rng(1)
    spread = np.std([daylight_autonomy(lux * f, hours)[0] for f in random.normal(1, 0.02, 400)])
    found = daylight_autonomy_error(lux, hours, np.array([0.02]))[0]
    assert found == pytest.approx(0.3 * 0.02, rel=0.02)
    assert spread == pytest.approx(found, rel=0.15)  # 400 trials: 3.5 %


def test_sensors_near_the_limit_make_the_error_of_sda() -> None:
    found = spatial_daylight_autonomy_error([0.5, 0.9, 0.1, 0.5], [0.01, 0.01, 0.01, 0.0])
    assert found == pytest.approx(0.25 * 0.5)
    assert spatial_daylight_autonomy_error([0.9], [0.01]) == pytest.approx(0.0, abs=1e-9)
