"""A small box with a window, a few hours of Chicago's skies and four systems, for runs of a room.

`tests/scenes/conftest.py` gives the fixtures on: what is read here is read once.
"""

from __future__ import annotations

import numpy as np
import pytest

from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.weather import Weather
from scenes.demo import VENETIAN_BLIND, WEATHER
from scenes.fenestration.systems import FenestrationSystem, read_system
from scenes.room.inputs import skies_for
from scenes.room.options import RoomOptions

HOURS = (2122, 4092, 4096, 8460)  # March 30 10 h, June 20 12 h and 16 h, December 19 12 h
SMALL = RoomOptions.of(
    sensor_spacing=1.0,
    sensor_samples=8192,
    patch_samples=4096,
    sun_points=512,
    path_samples=16384,
    picture_size=96,
    picture_samples=8,
    sky_subdivision=1,
)
# Few rays and pictures, and a room with a window in each of two opposite walls
FEW = SMALL.changed(
    sensor_samples=256,
    patch_samples=256,
    sun_points=16,
    picture_size=32,
    picture_samples=2,
    picture_count=1,
    heat_step_s=3600.0,
)
OPENING = {"x": 0.5, "sill": 0.9, "width": 2.0, "height": 1.5}
TWO = shoebox(
    3.0,
    4.0,
    2.8,
    windows=(WindowRectangle(**OPENING), WindowRectangle(**OPENING, side="back")),
    reflectance={"wall": 0.3, "floor": 0.1, "ceiling": 0.4},
)


@pytest.fixture(scope="session")
def weather() -> Weather:
    return read_epw(WEATHER)


@pytest.fixture(scope="session")
def blind() -> FenestrationSystem:
    return read_system(VENETIAN_BLIND)


@pytest.fixture(scope="session")
def glass() -> FenestrationSystem:
    return clear("clear", 0.8)


def clear(name: str, tau: float) -> FenestrationSystem:
    """A pane that passes the share `tau` of all light straight on and reflects a tenth."""
    omega = KLEMS_FULL.projected_solid_angles()
    through, back = np.diag(tau / omega), np.diag(0.1 / omega)
    klems = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, through, through, back, back)
    return FenestrationSystem(name, klems, klems, u_value=2.0, g_value=min(tau + 0.05, 0.87))


@pytest.fixture(scope="session")
def milk() -> FenestrationSystem:
    """A pane that scatters the same to all sides."""
    even = np.full((KLEMS_FULL.size, KLEMS_FULL.size), 0.5 / np.pi)
    nothing = np.zeros_like(even)
    klems = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, even, even, nothing, nothing)
    return FenestrationSystem("milk", klems, klems, u_value=2.0)


@pytest.fixture(scope="session")
def skies(weather) -> AnnualSky:
    """The skies of a few hours, as if the others were dark."""
    return only(skies_for(weather, SMALL.sampling), HOURS)


def only(skies: AnnualSky, hours: tuple[int, ...]) -> AnnualSky:
    chosen = np.searchsorted(skies.lit, hours)
    assert np.array_equal(skies.lit[chosen], hours)
    return skies.part(chosen)


BOX = shoebox(
    3.0,
    4.0,
    2.8,
    windows=(WindowRectangle(0.5, 0.9, 2.0, 1.5),),
    reflectance={"wall": 0.3, "floor": 0.1, "ceiling": 0.4},
)
ROOM = BOX.spaces[0]
