"""Moist air and longwave sky radiation: replacements for missing fields of a weather file."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

STEFAN_BOLTZMANN = 5.670374419e-8  # [W/m2K4] CODATA
KELVIN = 273.15

# Magnus coefficients over water (WMO-No. 8, annex 4.B): e = 611.2 exp(17.62 t/(243.12 + t)) Pa
MAGNUS_SLOPE, MAGNUS_OFFSET_C = 17.62, 243.12


def relative_humidity(dry_bulb_c: ArrayLike, dew_point_c: ArrayLike) -> NDArray[np.float64]:
    """Relative humidity, 0 to 1, by the Magnus formula."""
    dry, dew = np.asarray(dry_bulb_c, dtype=float), np.asarray(dew_point_c, dtype=float)
    exponent = MAGNUS_SLOPE * (dew / (MAGNUS_OFFSET_C + dew) - dry / (MAGNUS_OFFSET_C + dry))
    return np.minimum(np.exp(exponent), 1.0)


def dew_point(dry_bulb_c: ArrayLike, humidity: ArrayLike) -> NDArray[np.float64]:
    """Dew point [deg C] of relative humidity (0 to 1; at least 0.1 %), by the Magnus formula."""
    dry = np.asarray(dry_bulb_c, dtype=float)
    humidity = np.maximum(np.asarray(humidity, dtype=float), 1e-3)
    x = np.log(humidity) + MAGNUS_SLOPE * dry / (MAGNUS_OFFSET_C + dry)
    return MAGNUS_OFFSET_C * x / (MAGNUS_SLOPE - x)


def standard_pressure(elevation_m: float) -> float:
    """Air pressure [Pa] of the standard atmosphere (ASHRAE Fundamentals 2021, ch. 1, eq. 3)."""
    return 101325.0 * (1 - 2.25577e-5 * elevation_m) ** 5.2559


def sky_longwave(
    dry_bulb_c: ArrayLike, dew_point_c: ArrayLike, sky_cover: ArrayLike
) -> NDArray[np.float64]:
    """Horizontal infrared irradiance from the sky [W/m2]; `sky_cover` in tenths.

    Source: Walton 1983 / Clark and Allen 1978, as in EnergyPlus's Engineering Reference.
    """
    n = np.asarray(sky_cover, dtype=float)
    dew = np.asarray(dew_point_c, dtype=float) + KELVIN
    dry = np.asarray(dry_bulb_c, dtype=float) + KELVIN
    clear = 0.787 + 0.764 * np.log(dew / 273.0)
    emissivity = clear * (1 + 0.0224 * n - 0.0035 * n**2 + 0.00028 * n**3)
    return emissivity * STEFAN_BOLTZMANN * dry**4
