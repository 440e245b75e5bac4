"""Perez's three-part sky (1990) on patches: uniform dome, circumsolar part, horizon band.

    E = D [ (1 - F1) (1 + cos tilt)/2  +  F1 a/b  +  F2 sin tilt ]

with D the diffuse horizontal irradiance, a the cosine at the plane and b that at the ground, at
least cos 85 degrees.  This model is fitted to measured irradiance on tilted planes; the all-weather
luminance (1993) is fitted to a luminance scanner.  Heat uses the former, light the latter;
docs/validation.md compares both with measured facades.

Source: Perez, Ineichen, Seals, Michalsky, Stewart 1990, Solar Energy 44:271, equations 7 to 10 and
table 6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.sky.matrix import SkySeries, sun_on_patches
from mitsuba_cfs.sky.patches import ReinhartSky
from mitsuba_cfs.sky.perez import CLEARNESS_BINS

FloatArray = NDArray[np.float64]

LOWEST_COSINE = np.cos(np.radians(85.0))  # of the sun's zenith angle
# Perez 1990 puts the horizon's light on a line; on patches it is the band of the model of 1987
BAND = np.radians(6.5)

# F11, F12, F13, F21, F22, F23 (Perez 1990, table 6) by category of clearness
BRIGHTENING = np.array(
    [
        [-0.008, 0.588, -0.062, -0.060, 0.072, -0.022],
        [0.130, 0.683, -0.151, -0.019, 0.066, -0.029],
        [0.330, 0.487, -0.221, 0.055, -0.064, -0.026],
        [0.568, 0.187, -0.295, 0.109, -0.152, -0.014],
        [0.873, -0.392, -0.362, 0.226, -0.462, 0.001],
        [1.132, -1.237, -0.412, 0.288, -0.823, 0.056],
        [1.060, -1.600, -0.359, 0.264, -1.127, 0.131],
        [0.678, -0.327, -0.250, 0.156, -1.377, 0.251],
    ]
)


@dataclass(frozen=True, slots=True)
class ThreePartSeries(SkySeries):
    """Series with the sky radiance for tilted planes (Perez 1990)."""

    def brightening(self, hours: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
        """F1 (around the sun, at least 0) and F2 (horizon) of some of the moments [h]."""
        clearness, brightness = self.model.clearness[hours], self.model.brightness[hours]
        zenith = np.arccos(np.clip(self.sun[hours, 2], 0.0, 1.0))
        f = BRIGHTENING[np.searchsorted(CLEARNESS_BINS, clearness, side="right")].T
        around = f[0] + f[1] * brightness + f[2] * zenith
        return np.maximum(around, 0.0), f[3] + f[4] * brightness + f[5] * zenith

    def patches(self, sky: ReinhartSky, hours: NDArray[np.int64]) -> FloatArray:
        """Patch radiance [P - 1, h], without ground and sun.

        Dome and band together give level ground D (1 - F1) and upright planes D ((1 - F1)/2 + F2),
        the mean over all azimuths; a negative band is set to 0.
        """
        around, horizon = self.brightening(hours)
        diffuse = self.diffuse_horizontal[hours]
        omega, up = sky.solid_angles[1:], sky.directions[1:, 2]
        upright = omega * np.sqrt(1.0 - up**2) / np.pi
        band = up < np.sin(BAND)
        level, whole = omega[band] @ up[band], omega @ up
        extra = diffuse * horizon / (upright[band].sum() - level / whole * upright.sum())
        dome = (diffuse * (1.0 - around) - extra * level) / whole
        block = np.maximum(dome + np.outer(band, extra), 0.0)
        sun = self.sun[hours]
        normal = diffuse * around / np.maximum(sun[:, 2], LOWEST_COSINE)
        patch, share = sun_on_patches(sky, sun, normal)
        block[patch - 1, np.arange(len(hours))[:, None]] += share
        return block


def three_part(series: SkySeries) -> ThreePartSeries:
    """Series of the solar band with the three-part sky."""
    return ThreePartSeries(series.sun, series.model, series.diffuse_horizontal, series.direct_normal)
