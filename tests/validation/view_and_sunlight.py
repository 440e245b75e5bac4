"""Exposure to sunlight against pvlib and view out against closed forms: the largest deviations.

python -m tests.validation view_and_sunlight
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pvlib import solarposition

from bim.model import Building, Element
from bim.shoebox import WindowRectangle, shoebox
from mitsuba_cfs.sky.epw import read_epw
from mitsuba_cfs.sky.weather import Weather
from scenes.comply.outdoors import outdoors_of
from scenes.comply.sunlight import sun_day, sun_exposure
from scenes.comply.view_out import view_out
from scenes.demo import WEATHER

LEAST = 11.0  # altitude of the sun [deg]
DAYS = ((2, 1), (2, 20), (3, 21))
Shade = Callable[[NDArray, NDArray], NDArray]  # altitude, azimuth from the facade [deg] -> free


def wall(corners: list[tuple[float, float, float]]) -> Element:
    """A plane element of four corners."""
    a, b, c, d = np.array(corners, dtype=float)
    return Element("e", "e", "IfcWall", np.array([[a, b, c], [a, c, d]]), 0.3, 0.3)


def opposite(distance: float, height: float) -> Element:
    """A long wall before a south facade at y = 0."""
    y = -distance
    return wall([(-900, y, -50), (900, y, -50), (900, y, height), (-900, y, height)])


def sun_cases() -> Iterator[tuple[str, Building, float, Shade]]:
    """Name, building, direction of the facade [deg] and what lets the sun through."""
    for facing in (180.0, 135.0, 100.0, 300.0):
        yield f"open site, {facing:g}", shoebox(facing_deg=facing), facing, lambda a, z: a > -90
    for recess in (0.2, 0.4):
        window = WindowRectangle(1.4, 0.0, 1.2, 3.0)
        widest = np.degrees(np.arctan2(0.6, recess))
        building = shoebox(windows=[window], recess=recess)
        yield f"reveals, {recess:g} m", building, 180.0, lambda a, z, w=widest: np.abs(z) < w
    for top, far in ((7.0, 15.0), (5.0, 12.0), (4.0, 8.0)):
        building = shoebox(elements=[opposite(far, 1.2 + top)])

        def over(a: NDArray, z: NDArray, slope: float = top / far) -> NDArray:
            return np.tan(np.radians(a)) > slope * np.cos(np.radians(z))

        yield f"wall {top:g} m higher, {far:g} m off", building, 180.0, over
    slab = wall([(-90, 0, 2.2), (90, 0, 2.2), (90, -1.5, 2.2), (-90, -1.5, 2.2)])

    def under(a: NDArray, z: NDArray) -> NDArray:
        return np.tan(np.radians(a)) < np.cos(np.radians(z)) / 1.5

    yield "overhang, 1.5 m", shoebox(elements=[slab]), 180.0, under


def by_seconds(weather: Weather, day: tuple[int, int], facing: float, free: Shade) -> float:
    """Hours of sun by pvlib's position at every second."""
    times = pd.date_range(pd.Timestamp(weather.midpoints[0].year, *day), periods=86400, freq="s")
    sun = solarposition.get_solarposition(
        (times - pd.Timedelta(hours=weather.timezone_h)).tz_localize("UTC"),
        weather.latitude_deg,
        weather.longitude_deg,
        weather.elevation_m,
        pressure=float(np.mean(weather.pressure_pa)),
        temperature=float(np.mean(weather.dry_bulb_c)),
    )
    altitude = sun["apparent_elevation"].to_numpy()
    aside = (sun["azimuth"].to_numpy() - facing + 180) % 360 - 180
    lit = (altitude >= LEAST) & (np.abs(aside) < 90) & free(altitude, aside)
    return np.count_nonzero(lit) / 3600


def sunlight() -> None:
    """Print the hours of each case by both, and their difference."""
    weather = read_epw(WEATHER)
    print("| case | day | hours | pvlib, seconds counted | difference [min] |\n|---|---|---|---|---|")
    for name, building, facing, free in sun_cases():
        for day in DAYS:
            ours = sun_exposure(building.spaces[0], outdoors_of(building), sun_day(weather, *day, LEAST)).hours
            wanted = by_seconds(weather, day, facing, free)
            when = f"{day[0]:02d}-{day[1]:02d}"
            print(f"| {name} | {when} | {ours:.3f} | {wanted:.3f} | {60 * (ours - wanted):+.2f} |")


def view() -> None:
    """Print the largest deviations of sight angle and distance over the eyes of rooms."""
    worst = {"sight angle [deg]": 0.0, "distance [m]": 0.0}
    count = 0
    for width, depth, recess, far in ((3.0, 6.0, 0.0, 17.43), (1.0, 4.0, 0.35, 8.2), (2.2, 9.0, 0.2, 61.0)):
        window = WindowRectangle(0.5, 0.9, width, 1.8)
        building = shoebox(4.0, depth, windows=[window], recess=recess, elements=[opposite(far, 90)])
        found = view_out(building.spaces[0], outdoors_of(building))
        x, y = found.points[:, 0], found.points[:, 1]
        right = np.minimum(*(np.arctan2(0.5 + width - x, y + r) for r in (0.0, recess)))
        left = np.maximum(*(np.arctan2(0.5 - x, y + r) for r in (0.0, recess)))
        wanted = np.degrees(np.maximum(right - left, 0.0))
        seen = wanted > 0.1
        count += len(x)
        angle = np.abs(found.sight_angle_deg - wanted)[seen].max()
        distance = np.abs(found.distance - far)[seen].max()
        worst["sight angle [deg]"] = max(worst["sight angle [deg]"], float(angle))
        worst["distance [m]"] = max(worst["distance [m]"], float(distance))
    for name, value in worst.items():
        print(f"{name}: {value:.5f} at the most, {count} eyes")


def main() -> None:
    """Both tables."""
    sunlight()
    view()
