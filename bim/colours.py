"""Colours of surfaces: linear red, green and blue of sRGB, and those of Radiance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Colour = tuple[float, float, float]
GREY: Colour = (1.0, 1.0, 1.0)  # the hue of what has no colour
LUMINANCE = (0.2126, 0.7152, 0.0722)  # of linear sRGB, IEC 61966-2-1:1999; grey keeps its value
# Linear sRGB under D65 to Radiance's red, green and blue, whose white is of equal energy: through
# XYZ with Bradford's adaptation of the white, so that grey stays grey.  Primaries: IEC 61966-2-1,
# and `color.h` of Radiance, whose green is (0.29, 0.60)
TO_RADIANCE = np.array(
    [[0.8578111, 0.1350964, 0.0070925], [-0.0066512, 1.0060791, 0.0005721], [-0.0030179, -0.0192267, 1.0222446]]
)


def luminance(linear: Sequence[float]) -> float:
    """Luminance of linear sRGB."""
    return sum(weight * value for weight, value in zip(LUMINANCE, linear, strict=True))


def linear_of_display(colour: Sequence[float]) -> Colour:
    """Linear sRGB of a colour given as display values (IEC 61966-2-1:1999)."""
    red, green, blue = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in colour)
    return red, green, blue


def hue_of(linear: Sequence[float]) -> Colour:
    """The colour of luminance 1; that of black is grey."""
    whole = luminance(linear)
    if whole <= 0 or min(linear) == max(linear):  # a division of equal numbers need not give 1
        return GREY
    red, green, blue = (value / whole for value in linear)
    return red, green, blue


def radiance_colour(reflectance: float, hue: Colour, weights: Sequence[float]) -> NDArray[np.float64]:
    """Reflectance of Radiance's red, green and blue [3] whose weighted sum is the reflectance.

    A hue so strong that a channel would reflect less than nothing or more than all is paler.
    """
    coloured = np.maximum(TO_RADIANCE @ np.array(hue), 0.0)
    ratio = coloured / (coloured @ np.array(weights) / sum(weights))
    most = 1.0 / reflectance if reflectance > 0 else np.inf
    strength = min(1.0, (most - 1.0) / max(ratio.max() - 1.0, 1e-12))
    return reflectance * (1.0 + strength * (ratio - 1.0))
