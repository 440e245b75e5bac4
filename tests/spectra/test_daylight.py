"""Spectra of sky and sun."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.spectra.channels import channels_of
from mitsuba_cfs.spectra.daylight import (
    daylight_components,
    daylight_shares,
    sky_temperature,
    spectral_sky,
    sun_spectra,
    water_vapour_cm,
)
from mitsuba_cfs.spectra.detectors import NANOMETRES, colour_temperature, detected, illuminant


def test_daylight_is_that_of_the_standard_illuminants() -> None:
    # CIE 015: D55 and D75 are CIE daylight of 5503 and 7504 K
    for name, kelvin in (("D55", 5503.0), ("D75", 7504.0)):
        own = daylight_shares(kelvin) @ daylight_components()
        table = illuminant(name)
        scale = detected(table)[0] / detected(own)[0]
        assert np.abs(scale * own / table - 1).max() < 2e-3, name  # M_1, M_2 rounded to 3 digits


def test_overcast_sky_and_clear_sky() -> None:
    assert sky_temperature(8000.0, 0.0) == pytest.approx(6514)
    # specsky: 1e6 / (-132.1 + 59.77 log10 L)
    assert sky_temperature(8000.0, 1.0) == pytest.approx(1e6 / (-132.1 + 59.77 * np.log10(8000.0)))
    assert sky_temperature(1.0, 1.0) == pytest.approx(25000)


def test_low_sun_is_red_and_water_takes_little_of_the_visible() -> None:
    low, high = colour_temperature(detected(sun_spectra([0.1, 0.9]))[:, -3:])[0]
    assert low < 3500 < 5000 < high
    dry, moist = detected(sun_spectra([0.7, 0.7], [0.5, 4.0]))[:, 0]
    assert 0.97 < moist / dry < 1.0


def test_water_vapour_rises_with_warm_moist_air() -> None:
    cold, warm = water_vapour_cm([0.0, 25.0], [0.8, 0.8])
    assert cold == pytest.approx(0.90, abs=0.01) and warm == pytest.approx(4.0, abs=0.05)


def test_photopic_sky_is_the_luminance_of_its_patches() -> None:
    luminance = np.array([[300.0, 800.0], [5000.0, 0.0], [9000.0, 200.0]], dtype=np.float32)
    weights, beam, height = np.array([0.0, 1.5, 1.6]), np.array([8e4, 0.0]), np.array([0.5, 0.1])
    sky, channels = spectral_sky(luminance, weights, beam, height), channels_of(81)
    per_lumen = detected(daylight_components())[:, 0]
    light = np.einsum("k,kpl->pl", per_lumen, sky.amount)
    light[0] = detected(sky.ground)[:, 0] * sky.ground_luminance
    assert light == pytest.approx(luminance, rel=2e-4, abs=1e-3)
    assert channels.power(sky.sun) @ channels.detection[0] == pytest.approx(1.0, rel=2e-4)
    # the ground has the colour of the whole: between the sun's and the sky's
    of = [colour_temperature(detected(s)[..., -3:])[0] for s in (sky.sun[0], sky.ground[0])]
    assert of[0] < of[1] < 6514


def test_coloured_ground_keeps_its_luminance_and_turns_the_daylight_on_it() -> None:
    weights, luminance = np.array([0.0, np.pi]), np.full((2, 3), 1000.0)
    beam, height = np.array([0.0, 50_000.0, 0.0]), np.array([0.3, 0.6, 0.1])
    luminance[1, 2] = 0.0  # dark
    green = np.interp(NANOMETRES, [500.0, 550.0, 600.0], [0.05, 0.2, 0.05])
    neutral, lawn = (spectral_sky(luminance, weights, beam, height, ground=g) for g in (None, green))
    np.testing.assert_array_equal(neutral.ground_luminance, lawn.ground_luminance)
    assert detected(lawn.ground)[:, 0] == pytest.approx(1.0)  # per lumen
    shape = lawn.ground[:2] / neutral.ground[:2] / green
    assert shape == pytest.approx(np.broadcast_to(shape[:, :1], shape.shape))
    np.testing.assert_array_equal(lawn.horizontal, neutral.horizontal)
