"""The sun's directions of a weather: kept, and found again for the same weather alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import scenes.demo
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.sun import sun_directions
from scenes.room import inputs as module

EPW = Path(scenes.demo.__file__).with_name("USA_IL_Chicago-OHare.Intl.AP.725300_TMY3.epw")


@pytest.fixture(scope="module")
def weather():
    return read_epw(EPW)


def test_what_is_kept_is_what_is_computed_for_each_weather(tmp_path, weather, monkeypatch):
    cache, asked = MatrixCache(tmp_path), []

    def computed(weather, model):
        asked.append(model)
        return sun_directions(weather, model=model)

    computed.__module__ = sun_directions.__module__
    monkeypatch.setattr(module, "sun_directions", computed)
    others = [
        replace(weather, latitude_deg=10.0),
        replace(weather, longitude_deg=-80.0),
        replace(weather, timezone_h=-5.0),
        replace(weather, turned_deg=30.0),
        replace(weather, times=weather.times.shift(6, freq="h")),
        replace(weather, dry_bulb_c=weather.dry_bulb_c + 20.0),
    ]
    cases = [(weather, "spa"), (weather, "radiance"), *((one, "spa") for one in others)]
    for again in (False, True):
        for one, model in cases:
            expected = sun_directions(one, model=model)
            np.testing.assert_array_equal(module.cached_sun_directions(one, model, cache), expected)
        assert len(asked) == len(cases), again
