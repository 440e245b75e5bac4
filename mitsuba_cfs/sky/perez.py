"""Perez all-weather sky (1993) and luminous efficacy (1990), from two measured irradiances.

The tables are Perez's own; the limits on clearness, brightness and zenith angle are those of
Radiance's gendaylit and gendaymtx, which judge this module.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

SOLAR_CONSTANT = 1367.0  # [W/m2] Perez 1990
LEAST_ZENITH, MOST_ZENITH = np.radians(3.0), np.radians(90.0)  # gendaymtx's limits
CLEARNESS_LIMITS = (1.0, 11.9)
BRIGHTNESS_LIMITS = (0.01, 0.6)

# Upper bounds of the first seven categories of sky clearness (Perez 1990, table 1)
CLEARNESS_BINS = np.array([1.065, 1.230, 1.500, 1.950, 2.800, 4.500, 6.200])

# a, b, c, d, e, each with 4 coefficients (Perez 1993, table 1), by category of clearness
LUMINANCE_COEFFICIENTS = np.array(
    """
     1.3525 -0.2576 -0.2690 -1.4366  -0.7670  0.0007  1.2734 -0.1233   2.8000   0.6004   1.2375  1.0000   1.8734  0.6297  0.9738  0.2809   0.0356 -0.1246 -0.5718  0.9938
    -1.2219 -0.7730  1.4148  1.1016  -0.2054  0.0367 -3.9128  0.9156   6.9750   0.1774   6.4477 -0.1239  -1.5798 -0.5081 -1.7812  0.1080   0.2624  0.0672 -0.2190 -0.4285
    -1.1000 -0.2515  0.8952  0.0156   0.2782 -0.1812 -4.5000  1.1766  24.7219 -13.0812 -37.7000 34.8438  -5.0000  1.5218  3.9229 -2.6204  -0.0156  0.1597  0.4199 -0.5562
    -0.5484 -0.6654 -0.2672  0.7117   0.7234 -0.6219 -5.6812  2.6297  33.3389 -18.3000 -62.2500 52.0781  -3.5000  0.0016  1.1477  0.1062   0.4659 -0.3296 -0.0876 -0.0329
    -0.6000 -0.3566 -2.5000  2.3250   0.2937  0.0496 -5.6812  1.8415  21.0000  -4.7656 -21.5906  7.2492  -3.5000 -0.1554  1.4062  0.3988   0.0032  0.0766 -0.0656 -0.1294
    -1.0156 -0.3670  1.0078  1.4051   0.2875 -0.5328 -3.8500  3.3750  14.0000  -0.9999  -7.1406  7.5469  -3.4000 -0.1078 -1.0750  1.5702  -0.0672  0.4016  0.3017 -0.4844
    -1.0000  0.0211  0.5025 -0.5119  -0.3000  0.1922  0.7023 -1.6317  19.0000  -5.0000   1.2438 -1.9094  -4.0000  0.0250  0.3844  0.2656   1.0468 -0.3788 -2.4517  1.4656
    -1.0500  0.0289  0.4260  0.3590  -0.3250  0.1156  0.7781  0.0025  31.0625 -14.5000 -46.1148 55.3750  -7.2312  0.4050 13.3500  0.6234   1.5000 -0.6426  1.8564  0.5636
    """.split(),  # noqa: E501
    dtype=float,
).reshape(8, 5, 4)

# a, b, c, d of the diffuse and the direct luminous efficacy (Perez 1990, table 4)
DIFFUSE_EFFICACY = np.array(
    [
        [97.24, -0.46, 12.00, -8.91],
        [107.22, 1.15, 0.59, -3.95],
        [104.97, 2.96, -5.53, -8.77],
        [102.39, 5.59, -13.95, -13.90],
        [100.71, 5.94, -22.75, -23.74],
        [106.42, 3.83, -36.15, -28.83],
        [141.88, 1.90, -53.24, -14.03],
        [152.23, 0.35, -45.27, -7.98],
    ]
)
DIRECT_EFFICACY = np.array(
    [
        [57.20, -4.55, -2.98, 117.12],
        [98.99, -3.46, -1.21, 12.38],
        [109.83, -4.90, -1.71, -8.81],
        [110.34, -5.84, -1.99, -4.56],
        [106.36, -3.97, -1.75, -6.16],
        [107.19, -1.25, -1.51, -26.73],
        [105.75, 0.77, -1.26, -34.44],
        [101.18, 1.58, -1.10, -8.29],
    ]
)


@dataclass(frozen=True, slots=True)
class PerezSky:
    """The all-weather model of H moments: shape coefficients and luminous efficacies."""

    coefficients: FloatArray  # [5, H] a, b, c, d, e
    sun: FloatArray  # [H, 3] unit vector to the sun, its zenith angle within the model's limits
    clearness: FloatArray  # [H]
    brightness: FloatArray  # [H]
    diffuse_efficacy: FloatArray  # [H] diffuse illuminance over irradiance [lm/W]
    direct_efficacy: FloatArray  # [H] direct illuminance over irradiance [lm/W]

    def relative_luminance(self, directions: ArrayLike) -> FloatArray:
        """Luminance of directions [N, 3] above the horizon in each moment [N, H], unscaled."""
        d = np.asarray(directions, dtype=float)
        cosine = np.clip(d @ self.sun.T, -1.0, 1.0)
        return relative_luminance(self.coefficients, d[:, 2], cosine)


def perez_sky(
    direct_normal: ArrayLike,
    diffuse_horizontal: ArrayLike,
    sun: ArrayLike,
    *,
    day_of_year: ArrayLike,
    dew_point_c: ArrayLike = 11.0,
) -> PerezSky:
    """The all-weather model for irradiances [H] [W/m2] and directions [H, 3] to the sun.

    `dew_point_c` sets the precipitable water of the efficacies; 11 is Perez's typical value.

    Source: Perez et al. 1990, Solar Energy 44:271; Perez, Seals, Michalsky 1993, 50:235 and 51:423.
    """
    direct = np.atleast_1d(np.asarray(direct_normal, dtype=float))
    diffuse = np.atleast_1d(np.asarray(diffuse_horizontal, dtype=float))
    sun = np.atleast_2d(np.asarray(sun, dtype=float))
    zenith = np.clip(np.arccos(np.clip(sun[:, 2], -1.0, 1.0)), LEAST_ZENITH, MOST_ZENITH)
    clearness = sky_clearness(direct, diffuse, zenith)
    brightness = sky_brightness(diffuse, zenith, np.asarray(day_of_year, dtype=float))
    category = np.searchsorted(CLEARNESS_BINS, clearness, side="right")
    water = np.exp(0.07 * np.asarray(dew_point_c, dtype=float) - 0.075)  # [cm]
    a, b, c, d = DIFFUSE_EFFICACY[category].T
    diffuse_efficacy = a + b * water + c * np.cos(zenith) + d * np.log(brightness)
    a, b, c, d = DIRECT_EFFICACY[category].T
    direct_efficacy = a + b * water + c * np.exp(5.73 * zenith - 5.0) + d * brightness
    level = np.hypot(sun[:, 0], sun[:, 1])
    flat = np.divide(sun[:, :2].T, level, out=np.zeros((2, len(sun))), where=level > 0)
    limited = np.column_stack([*(flat * np.sin(zenith)), np.cos(zenith)])
    return PerezSky(
        coefficients=luminance_coefficients(category, clearness, brightness, zenith),
        sun=limited,
        clearness=clearness,
        brightness=brightness,
        diffuse_efficacy=diffuse_efficacy,
        direct_efficacy=np.maximum(direct_efficacy, 0.0),
    )


def sky_clearness(direct: FloatArray, diffuse: FloatArray, zenith: FloatArray) -> FloatArray:
    """Perez's epsilon [H] from normal and diffuse irradiance, within its limits."""
    cube = 1.041 * zenith**3
    ratio = np.divide(direct, diffuse, out=np.full(direct.shape, 1e9), where=diffuse > 0)
    return np.clip((1.0 + ratio + cube) / (1.0 + cube), *CLEARNESS_LIMITS)


def sky_brightness(diffuse: FloatArray, zenith: FloatArray, day_of_year: FloatArray) -> FloatArray:
    """Perez's Delta [H], within its limits."""
    outside = SOLAR_CONSTANT * eccentricity(day_of_year)
    return np.clip(diffuse * air_mass(zenith) / outside, *BRIGHTNESS_LIMITS)


def air_mass(zenith: ArrayLike) -> FloatArray:
    """Relative optical air mass [...] (Kasten 1966) at zenith angles [rad] up to 90 degrees."""
    zenith = np.asarray(zenith, dtype=float)
    return 1.0 / (np.cos(zenith) + 0.15 * (93.885 - np.degrees(zenith)) ** -1.253)


def eccentricity(day_of_year: ArrayLike) -> FloatArray:
    """Square of mean over actual distance to the sun [...] (Spencer 1971)."""
    angle = 2 * np.pi / 365.0 * (np.asarray(day_of_year, dtype=float) - 1.0)
    return (
        1.00011
        + 0.034221 * np.cos(angle)
        + 0.00128 * np.sin(angle)
        + 0.000719 * np.cos(2 * angle)
        + 0.000077 * np.sin(2 * angle)
    )


def luminance_coefficients(
    category: NDArray[np.int64], clearness: FloatArray, brightness: FloatArray, zenith: FloatArray
) -> FloatArray:
    """a, b, c, d, e [5, H] (Perez 1993, equations 6 to 8)."""
    limited = np.where((clearness > 1.065) & (clearness < 2.8), 0.2, 0.0)
    delta = np.maximum(brightness, limited)
    x = np.moveaxis(LUMINANCE_COEFFICIENTS[category], 0, -1)  # [5, 4, H]
    result = x[:, 0] + x[:, 1] * zenith + delta * (x[:, 2] + x[:, 3] * zenith)
    overcast = category == 0
    c, d = x[2][:, overcast], x[3][:, overcast]
    z, delta = zenith[overcast], delta[overcast]
    result[2, overcast] = np.exp((delta * (c[0] + c[1] * z)) ** c[2]) - c[3]
    result[3, overcast] = -np.exp(delta * (d[0] + d[1] * z)) + d[2] + delta * d[3]
    return result


def relative_luminance(coefficients: FloatArray, cos_zenith: FloatArray, cos_sun: FloatArray) -> FloatArray:
    """[1 + a exp(b/cos zeta)] [1 + c exp(d gamma) + e cos^2 gamma], at least 0: [N, H].

    Args: `cos_zenith` [N] > 0, `cos_sun` [N, H] cosine of the angle gamma to the sun.
    """
    a, b, c, d, e = coefficients
    levels, which = np.unique(cos_zenith, return_inverse=True)  # rows of patches share one
    gradation = (1.0 + a * np.exp(b / np.maximum(levels, 1e-6)[:, None]))[which]
    indicatrix = np.arccos(cos_sun)
    indicatrix *= d
    np.exp(indicatrix, out=indicatrix)
    indicatrix *= c
    indicatrix += 1.0 + e * cos_sun**2
    indicatrix *= gradation
    return np.maximum(indicatrix, 0.0, out=indicatrix)
