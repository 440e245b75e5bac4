"""All daylight metrics of a room at once: per sensor, and for the room as a whole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.metrics import autonomy, en17037, lm83, schedules
from mitsuba_cfs.metrics.en17037 import DaylightProvision
from mitsuba_cfs.sky.weather import Weather


def daylight_factor(illuminance: ArrayLike, outdoor_horizontal: float) -> NDArray[np.float64]:
    """Daylight factor [S] (0 to 1) of sensors [S] [lx] under the CIE overcast sky.

    Args: `outdoor_horizontal` [lx]: unobstructed, of the same sky (`mitsuba_cfs.sky.cie`).

    Source: CIE 16-1970; ISO 15469:2004 for the sky.
    """
    values = np.asarray(illuminance, dtype=float)
    if not outdoor_horizontal > 0:
        raise ValueError(f"outdoor_horizontal: expected more than 0, got {outdoor_horizontal}")
    if not np.all((values >= 0) & (values < np.inf)):
        raise ValueError("illuminance: expected finite values, not negative")
    return values / outdoor_horizontal


FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RoomMetrics:
    """Daylight metrics of a room; shares of time and area in per cent."""

    daylight_autonomy: FloatArray  # [S] 300 lx, LM-83's hours [%]
    continuous_daylight_autonomy: FloatArray  # [S] 300 lx, LM-83's hours [%]
    useful_daylight: FloatArray  # [4, S] below 100, 100 to 300, 300 to 3000, above 3000 lx [%]
    useful_daylight_2005: FloatArray  # [S] 100 to 2000 lx, the limits of 2005 [%]
    mean_illuminance: FloatArray  # [S] [lx] over EN 17037's daylight hours
    sunlit_hours: FloatArray | None  # [S] [h] above 1000 lx of direct sun, LM-83's hours
    spatial_daylight_autonomy: float  # sDA300/50% [%]
    annual_sunlight_exposure: float | None  # ASE1000,250h [%]; None without direct light
    daylight_provision: DaylightProvision  # EN 17037
    areas: FloatArray  # [S] share of the room's area of each sensor

    def by_sensor(self) -> pd.DataFrame:
        """One row per sensor S; shares of time [%]."""
        below, supplementary, autonomous, exceeded = self.useful_daylight
        columns = {
            "daylight_autonomy": self.daylight_autonomy,
            "continuous_daylight_autonomy": self.continuous_daylight_autonomy,
            "udi_below_100": below,
            "udi_100_300": supplementary,
            "udi_300_3000": autonomous,
            "udi_above_3000": exceeded,
            "udi_100_2000": self.useful_daylight_2005,
            "mean_illuminance_lx": self.mean_illuminance,
        }
        if self.sunlit_hours is not None:
            columns["sunlit_hours"] = self.sunlit_hours
        return pd.DataFrame(columns).rename_axis("sensor")

    def of_room(self) -> dict[str, float | str | None]:
        """The room's own figures; shares of time [%] are means over its area."""
        useful = self.useful_daylight @ self.areas
        return {
            "daylight_autonomy": float(self.daylight_autonomy @ self.areas),
            "continuous_daylight_autonomy": float(self.continuous_daylight_autonomy @ self.areas),
            "udi_below_100": float(useful[0]),
            "udi_100_300": float(useful[1]),
            "udi_300_3000": float(useful[2]),
            "udi_above_3000": float(useful[3]),
            "udi_100_2000": float(self.useful_daylight_2005 @ self.areas),
            "mean_illuminance_lx": float(self.mean_illuminance @ self.areas),
            "spatial_daylight_autonomy": self.spatial_daylight_autonomy,
            "annual_sunlight_exposure": self.annual_sunlight_exposure,
            "en17037_target_lx": self.daylight_provision.target_illuminance,
            "en17037_minimum_lx": self.daylight_provision.minimum_illuminance,
        }


def room_metrics(
    illuminance: ArrayLike,
    weather: Weather,
    *,
    direct_illuminance: ArrayLike | None = None,
    areas: ArrayLike | None = None,
    horizontal_openings: bool = False,
    daylight_hours: schedules.Mask | None = None,
) -> RoomMetrics:
    """Daylight metrics of a room, each with the schedule of its standard.

    Args:
        illuminance: [H, S] [lx] of every time step of the weather (`AnnualSky.whole_year` puts
            sun-up hours back into the year).
        direct_illuminance: [H, S] [lx] straight from the sun, blinds open, for ASE.
        areas: [S] area of each sensor; equal unless given.
        horizontal_openings: the room is lit by rooflights (EN 17037, table A.2).
        daylight_hours: [H] of EN 17037, where they are known.
    """
    ten, half = schedules.lm83_hours(weather), daylight_hours
    half = schedules.daylight_hours(weather) if half is None else half
    illuminance = np.asarray(illuminance)
    lit = ase = None
    if direct_illuminance is not None:
        lit = lm83.sunlit_hours(direct_illuminance, ten, step_h=weather.step_h)
        ase = 100.0 * autonomy.area_share(lit > lm83.ASE_HOURS, areas)
    enough = autonomy.daylight_autonomy(illuminance, ten)
    useful = [
        100.0 * autonomy.useful_daylight_illuminance(illuminance, ten, limits)
        for limits in (autonomy.UDI_LIMITS, autonomy.UDI_LIMITS_2005)
    ]
    return RoomMetrics(
        daylight_autonomy=100.0 * enough,
        continuous_daylight_autonomy=100.0 * autonomy.continuous_daylight_autonomy(illuminance, ten),
        useful_daylight=useful[0],
        useful_daylight_2005=useful[1][1:3].sum(axis=0),
        mean_illuminance=np.mean(autonomy.scheduled(illuminance, half), axis=0, dtype=float),
        sunlit_hours=lit,
        spatial_daylight_autonomy=100.0 * autonomy.area_share(enough >= lm83.SDA_TIME, areas),
        annual_sunlight_exposure=ase,
        daylight_provision=en17037.daylight_provision(
            illuminance, half, areas=areas, horizontal_openings=horizontal_openings
        ),
        areas=autonomy.sensor_weights(areas, illuminance.shape[1]),
    )
