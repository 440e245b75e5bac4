"""CIE skies: overcast, clear, intermediate, uniform, and the fifteen standard general skies."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.sky.patches import ReinhartSky

FloatArray = NDArray[np.float64]

KINDS = ("overcast", "clear", "intermediate", "uniform")

# a, b (gradation), c, d, e (indicatrix) of sky types 1 to 15
# Source: CIE S 011/E:2003 = ISO 15469:2004, table 1
GENERAL_SKIES = np.array(
    [
        [4.0, -0.70, 0, -1.0, 0.00],
        [4.0, -0.70, 2, -1.5, 0.15],
        [1.1, -0.80, 0, -1.0, 0.00],
        [1.1, -0.80, 2, -1.5, 0.15],
        [0.0, -1.00, 0, -1.0, 0.00],
        [0.0, -1.00, 2, -1.5, 0.15],
        [0.0, -1.00, 5, -2.5, 0.30],
        [0.0, -1.00, 10, -3.0, 0.45],
        [-1.0, -0.55, 2, -1.5, 0.15],
        [-1.0, -0.55, 5, -2.5, 0.30],
        [-1.0, -0.55, 10, -3.0, 0.45],
        [-1.0, -0.32, 10, -3.0, 0.45],
        [-1.0, -0.32, 16, -3.0, 0.30],
        [-1.0, -0.15, 16, -3.0, 0.30],
        [-1.0, -0.15, 24, -2.8, 0.15],
    ]
)


def relative_luminance(kind: str | int, directions: ArrayLike, sun: ArrayLike | None = None) -> FloatArray:
    """Luminance over that of the zenith [N] of directions [N, 3] above the horizon.

    Args:
        kind: one of `KINDS`, or 1 to 15 for a standard general sky (16 is `overcast`).
        sun: [3] unit vector to the sun; the overcast and the uniform sky need none.

    Source: ISO 15469:2004 (overcast: its type 16, (1 + 2 sin)/3; clear: type 12 in the form of
    CIE 1973, which gensky has); intermediate: Nakamura, Oki, Hayashi 1985, as in gensky.
    """
    d = np.asarray(directions, dtype=float)
    height = np.clip(d[:, 2], 0.0, 1.0)
    if kind in ("overcast", 16):
        return (1 + 2 * height) / 3
    if kind == "uniform":
        return np.ones(len(d))
    if sun is None:
        raise ValueError(f"a {kind} sky needs the direction to the sun")
    sun = np.asarray(sun, dtype=float)
    zenith_sun = np.arccos(np.clip(sun[2], 0.0, 1.0))
    gamma = np.arccos(np.clip(d @ sun, -1.0, 1.0))
    if kind == "clear":
        at_zenith = -np.expm1(-0.32) * _clear_indicatrix(zenith_sun)
        return _clear_indicatrix(gamma) * -np.expm1(-0.32 / np.maximum(height, 1e-6)) / at_zenith
    if kind == "intermediate":
        zenith = np.arccos(height)
        at_zenith = _intermediate(np.zeros(1), np.array([zenith_sun]), zenith_sun)[0]
        return _intermediate(zenith, gamma, zenith_sun) / at_zenith
    if isinstance(kind, (int, np.integer)) and 1 <= kind <= len(GENERAL_SKIES):
        a, b, c, d_, e = GENERAL_SKIES[kind - 1]

        def gradation(height: FloatArray) -> FloatArray:
            return 1 + a * np.exp(b / np.maximum(height, 1e-6))

        def indicatrix(angle: FloatArray) -> FloatArray:
            return 1 + c * (np.exp(d_ * angle) - np.exp(d_ * np.pi / 2)) + e * np.cos(angle) ** 2

        at_zenith = gradation(np.array(1.0)) * indicatrix(zenith_sun)
        return gradation(height) * indicatrix(gamma) / at_zenith
    raise ValueError(f"kind: expected one of {KINDS} or 1 to 15, got {kind!r}")


def _clear_indicatrix(angle: FloatArray | float) -> FloatArray:
    return 0.91 + 10 * np.exp(-3 * angle) + 0.45 * np.cos(angle) ** 2


def _intermediate(zenith: FloatArray, gamma: FloatArray, zenith_sun: float) -> FloatArray:
    level = (1.35 * np.sin(5.631 - 3.59 * zenith) + 3.12) * np.sin(4.396 - 2.6 * zenith_sun)
    fall = 0.563 * ((2.629 - zenith) * (1.562 - zenith_sun) + 0.812)
    return (level + 6.37 - zenith) * np.exp(-fall * gamma)


def cie_patches(
    kind: str | int,
    sky: ReinhartSky,
    diffuse_horizontal: float,
    *,
    sun: ArrayLike | None = None,
    ground_reflectance: float = 0.2,
    direct_horizontal: float = 0.0,
) -> FloatArray:
    """Luminance of each patch [P] [cd/m2] of a CIE sky without its sun, the ground as patch 0.

    Args:
        diffuse_horizontal: illuminance [lx] of the sky on a horizontal plane; the patches give it
            exactly.  With [W/m2] the result is radiance.
        direct_horizontal: horizontal irradiance of the sun alone.
    """
    if not diffuse_horizontal >= 0 or not direct_horizontal >= 0:
        raise ValueError("expected illuminances that are not negative")
    result = np.empty(sky.size)
    level = relative_luminance(kind, sky.directions[1:], sun)
    result[1:] = level * diffuse_horizontal / (sky.horizontal_weights[1:] @ level)
    result[0] = ground_reflectance / np.pi * (diffuse_horizontal + direct_horizontal)
    return result
