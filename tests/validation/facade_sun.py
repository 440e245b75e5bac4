"""Sun and sky on a facade at every time step, as EnergyPlus computes them.

Hourly EPW irradiance is a mean of its hour: it stands at the half hour and is linear in between;
the sun is where it is at the end of a step.  Sky diffuse by Perez 1990 (pvlib's coefficients), the
circumsolar part included; ground light from the global horizontal irradiance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.sky import sun as solar
from mitsuba_cfs.sky.weather import Weather

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SunSteps:
    """Sun and horizontal irradiances at the steps T of a year."""

    direction: FloatArray  # [T, 3] to the sun, world frame
    direct_normal: FloatArray  # [T] [W/m2]
    diffuse_horizontal: FloatArray  # [T] [W/m2]
    day_of_year: NDArray[np.int64]  # [T]
    elevation_m: float  # of the site


@dataclass(frozen=True, slots=True)
class FacadeSun:
    """Irradiance on one plane at the steps T [W/m2], and where its beam comes from."""

    local: FloatArray  # [T, 3] to the sun in the window frame (z outward)
    beam: FloatArray  # [T]
    sky: FloatArray  # [T] diffuse, circumsolar included
    ground: FloatArray  # [T]
    circumsolar: FloatArray  # [T] the part of `sky` that comes from around the sun

    @property
    def total(self) -> FloatArray:
        """Irradiance of the plane [T]."""
        return self.beam + self.sky + self.ground


def sun_steps(weather: Weather, steps: int) -> SunSteps:
    """The sun at the end of every step, `steps` an hour."""
    hours = len(weather.times)
    instants = (
        weather.times[0]
        - pd.Timedelta(hours=1)
        + pd.to_timedelta((np.arange(hours * steps) + 1) * 3600.0 / steps, unit="s")
    )
    direction = _directions(weather, instants)
    normal = half_hour_steps(weather.direct_normal, steps)
    diffuse = half_hour_steps(weather.diffuse_horizontal, steps)
    up = direction[:, 2] > 1e-5
    return SunSteps(
        direction=direction,
        direct_normal=np.where(up, normal, 0.0),
        diffuse_horizontal=np.where(up, diffuse, 0.0),
        day_of_year=instants.day_of_year.to_numpy(),
        elevation_m=weather.elevation_m,
    )


def _directions(weather: Weather, instants: pd.DatetimeIndex) -> FloatArray:
    """Directions [T, 3] to the sun: Spencer's declination and equation of time (EnergyPlus)."""
    day = instants.day_of_year.to_numpy() - (instants.hour == 0) * (instants.minute == 0)
    hour = (instants.hour + instants.minute / 60 + instants.second / 3600).to_numpy()
    hour = np.where(hour == 0.0, 24.0, hour)
    x = 2 * np.pi * day / 366.0
    declination = np.arcsin(
        0.00561800
        + 0.0657911 * np.sin(x)
        - 0.392779 * np.cos(x)
        + 0.00064440 * np.sin(2 * x)
        - 0.00618495 * np.cos(2 * x)
        - 0.00010101 * np.sin(3 * x)
        - 0.00007951 * np.cos(3 * x)
        - 0.00011691 * np.sin(4 * x)
        + 0.00002096 * np.cos(4 * x)
    )
    equation = (
        0.00021971
        - 0.122649 * np.sin(x)
        + 0.00762856 * np.cos(x)
        - 0.156308 * np.sin(2 * x)
        - 0.0530028 * np.cos(2 * x)
        - 0.00388702 * np.sin(3 * x)
        - 0.00123978 * np.cos(3 * x)
        - 0.00270502 * np.sin(4 * x)
        - 0.00167992 * np.cos(4 * x)
    )
    angle = np.radians(15.0 * (12.0 - (hour + equation)) + (15.0 * weather.timezone_h - weather.longitude_deg))
    latitude = np.radians(weather.latitude_deg)
    up = np.sin(latitude) * np.sin(declination)
    up = up + np.cos(latitude) * np.cos(declination) * np.cos(angle)
    east = np.cos(declination) * np.sin(angle)
    north = np.sin(declination) * np.cos(latitude)
    north = north - np.cos(declination) * np.sin(latitude) * np.cos(angle)
    return np.stack([east, north, up], axis=1)


def half_hour_steps(hourly: FloatArray, steps: int) -> FloatArray:
    """Hourly means [H] as values at the steps' ends [H * steps], linear between half hours."""
    hours = len(hourly)
    at = (np.arange(hours * steps) + 1.0) / steps
    centres = np.arange(-1, hours + 1) + 0.5
    values = np.concatenate([hourly[-1:], hourly, hourly[:1]])
    return np.interp(at, centres, values)


def facade_sun(steps: SunSteps, normal: FloatArray, *, albedo: float = 0.2) -> FacadeSun:
    """Beam, sky and ground light on a plane with an exterior normal [3]."""
    frame = window_frame(normal)
    local = steps.direction @ frame.T
    cosine = np.maximum(local[:, 2], 0.0)
    up = np.maximum(steps.direction[:, 2], 0.0)
    horizontal = steps.diffuse_horizontal + steps.direct_normal * up
    tilt = 0.5 * (1.0 - float(np.asarray(normal)[2] / np.linalg.norm(normal)))
    sky, circumsolar = perez_tilted(steps, np.asarray(normal, dtype=float))
    return FacadeSun(
        local=local,
        beam=steps.direct_normal * cosine,
        sky=sky,
        ground=albedo * horizontal * tilt,
        circumsolar=circumsolar,
    )


def perez_tilted(steps: SunSteps, normal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sky diffuse irradiance [T] of a tilted plane and its circumsolar part (Perez et al. 1990)."""
    from pvlib import irradiance

    day = steps.day_of_year
    tilt = np.degrees(np.arccos(np.clip(normal[2], -1, 1)))
    azimuth = np.degrees(np.arctan2(normal[0], normal[1])) % 360.0
    zenith = np.degrees(np.arccos(np.clip(steps.direction[:, 2], -1, 1)))
    lit = (steps.diffuse_horizontal > 0) & (zenith < 90.0)
    sky, circumsolar = np.zeros(len(day)), np.zeros(len(day))
    thinner = 1.0 - 0.1 * steps.elevation_m / 1000.0  # EnergyPlus' air mass above sea level
    air_mass = thinner / (np.cos(np.radians(zenith[lit])) + 0.15 * (93.885 - zenith[lit]) ** -1.253)
    parts = irradiance.perez(
        tilt,
        azimuth,
        steps.diffuse_horizontal[lit],
        steps.direct_normal[lit],
        np.full(int(lit.sum()), 1353.0),
        zenith[lit],
        np.degrees(solar.azimuth(steps.direction[lit])),
        air_mass,
        model="allsitescomposite1990",
        return_components=True,
    )
    sky[lit], _, circumsolar[lit], _ = parts.values()  # total, isotropic, circumsolar, horizon
    return np.nan_to_num(sky), np.nan_to_num(circumsolar)
