"""Outdoor daylight of real weather files against the figures that EN 17037 prints for capitals."""

from __future__ import annotations

from mitsuba_cfs.metrics import en17037
from mitsuba_cfs.metrics.schedules import daylight_hours
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.matrix import sky_series


def test_median_diffuse_illuminance_of_reykjavik(real_data):
    """Table A.3 of EN 17037 has 11,500 lx for Reykjavik, rounded to hundreds.

    It rests on the same weather data (IWEC), so that schedule and efficacy are both judged.
    """
    weather = read_epw(real_data / "epw" / "ISL_Reykjavik.040300_IWEC.epw")
    hours = daylight_hours(weather)
    for diffuse in (sky_series(weather).diffuse_horizontal, weather.diffuse_horizontal_illuminance):
        assert abs(en17037.median_diffuse(diffuse, hours) - 11_500) <= 50
