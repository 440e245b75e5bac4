"""Weather by time step: interpolation, sky and ground temperature, wind at a wall."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.thermal.rooms import box
from thermal.blackbox import Fenestration
from thermal.climate import SIGMA, Climate, Solar, no_sun, sky_temperature, to_steps, undisturbed_ground
from thermal.convection import local_wind_factor
from thermal.errors import ThermalInputError
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
    np.testing.assert_allclose(undisturbed_ground(outdoor, depth=0.5), undisturbed_ground(outdoor))
    assert np.ptp(ground) / 2 == pytest.approx(12.0 * np.exp(-decay), rel=1e-4)
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


LIMITS = {
    "outdoor_c": (-90.0, 70.0),
    "sky_c": (-150.0, 70.0),
    "wind_speed": (0.0, 100.0),
    "wind_direction_deg": (0.0, 360.0),
    "ground_c": (-60.0, 60.0),
    "pressure": (3e4, 1.2e5),
}


@pytest.mark.parametrize("name", LIMITS)
def test_weather_is_refused_from_its_limits_on(name):
    low, high = LIMITS[name]
    middle = {one: np.full(3, sum(pair) / 2) for one, pair in LIMITS.items()}
    assert Climate(**middle | {name: [low, high, low]}).hours == 3
    for wrong in (np.nextafter(low, -np.inf), np.nextafter(high, np.inf), np.nan):
        with pytest.raises(ThermalInputError, match=f"{name}: 1 hours outside .*first .1"):
            Climate(**middle | {name: [low, wrong, high]})
    with pytest.raises(ThermalInputError, match=r"expected \[3\] values|expected \[4\] values"):
        Climate(**middle | {name: [low] * 4})


@pytest.mark.parametrize("name", ["absorbed_outer", "absorbed_inner", "inside", "facade"])
def test_sun_is_refused_with_its_array(name):
    dark = no_sun(2, 6, 1)
    assert dark.inside.shape == (2, 6) and dark.absorbed_outer.shape == (2, 1)
    parts = {one: getattr(dark, one) for one in ("absorbed_outer", "absorbed_inner", "inside")}
    parts["facade"] = dark.facade
    assert not dark.facade.any() and not dark.absorbed_inner.any()
    for wrong, words in (
        (np.zeros(2), "expected two axes"),
        (np.array([[0.0, -2e-6]]), "negative or missing"),
        (np.array([[0.0, np.nan]]), "negative or missing"),
        (np.array([[0.0, np.inf]]), "negative or missing"),
    ):
        with pytest.raises(ThermalInputError, match=f"solar {name}: {words}"):
            Solar(**parts | {name: wrong})
    Solar(**parts | {name: np.array([[5.0, -0.5e-6]])})  # what remains of a difference
