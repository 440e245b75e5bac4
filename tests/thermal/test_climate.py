"""Weather by time step: interpolation, sky and ground temperature, wind at a wall."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.thermal.rooms import box
from thermal.blackbox import Fenestration
from thermal.climate import SIGMA, sky_temperature, to_steps, undisturbed_ground
from thermal.convection import local_wind_factor
from thermal.network import network, window_mix


def test_steps_lie_on_the_line_between_the_hours_ends():
    steps = to_steps([10.0, 13.0, 7.0], 3)
    # hour 1 ends at 10 and began where the last hour ended (cyclic): 8, 9, 10, then 11, 12, 13
    np.testing.assert_allclose(steps, [8, 9, 10, 11, 12, 13, 11, 9, 7])
    np.testing.assert_allclose(to_steps([1.0, 5.0], 1), [1, 5])


def test_sky_temperature_is_that_of_a_black_sky():
    assert sky_temperature(SIGMA * 263.15**4) == pytest.approx(-10.0)


def test_ground_is_damped_and_late():
    hours = np.arange(8760)
    outdoor = 10.0 - 12.0 * np.cos(2 * np.pi * (hours / 8760 - 20 / 365))
    ground = undisturbed_ground(outdoor, depth=1.0)
    decay = np.sqrt(np.pi / (365 * 0.055))  # at 1 m
    assert ground.mean() == pytest.approx(10.0)
    assert np.ptp(ground) / 2 == pytest.approx(12.0 * np.exp(-decay), rel=1e-3)
    late = (np.argmin(ground) - np.argmin(outdoor)) / 24
    assert late == pytest.approx(decay / (2 * np.pi) * 365, abs=0.5)


def network_of(zone):
    mixes = [window_mix(zone, None, 1)]
    return network([zone], mixes, step_s=600.0, terrain="suburbs", cell=0.02, link=np.zeros((1, 1)))


def test_walls_windows_and_frames_see_their_own_share_of_the_sky():
    glass = Fenestration("glass", 1.2)
    zone = box(window=glass)
    (window,) = zone.windows
    hidden = replace(window, frame_area=0.4, sky_seen=0.25)
    wall = replace(zone.surfaces[0], sky_seen=0.5)
    zone = replace(zone, surfaces=(wall, *zone.surfaces[1:]), windows=(hidden,))
    net = network_of(zone)
    half = np.array([0.5**1.5, 0.5 - 0.5**1.5])
    for face, seen in ((0, 0.5), (1, 1.0), (6, 0.25), (7, 0.25)):
        expected = [*half * seen, 1.0 - 0.5 * seen]
        np.testing.assert_allclose(net.faces.hemisphere[face], expected)


def test_forced_film_takes_the_local_wind_to_its_power():
    net = network_of(box())
    factor = local_wind_factor(1.5, "suburbs")
    # DOE-2 / MoWiTT: 3.26 V^0.89 windward, 3.55 V^0.617 leeward
    np.testing.assert_allclose(net.faces.wind[0], [3.26 * factor**0.89, 3.55 * factor**0.617])
