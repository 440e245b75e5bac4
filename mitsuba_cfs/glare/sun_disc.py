"""The sun's disc as an eye sees it: a glare source with its own luminance, whatever the pixels.

A smooth mirror shows the disc once more, at the mirrored direction and with the luminance times the
reflectance: a source of the same solid angle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.sky.sun import SUN_SOLID_ANGLE


@dataclass(frozen=True, slots=True)
class SunDisc:
    """Visible part of the sun's disc or of an image of it, attenuated by glazing and mirrors."""

    direction: NDArray[np.float64]  # [3] unit vector to the centre of the visible part
    luminance: float  # [cd/m2]
    solid_angle: float  # [sr]


def seen_disc(directions: ArrayLike, luminance: ArrayLike) -> SunDisc | None:
    """The disc from the luminance [n] of equal parts of it in directions [n, 3]; None if hidden.

    Its luminance and solid angle are those that keep both sum L omega and sum L^2 omega of the
    parts: where all of the seen parts are as bright, their luminance and their solid angle.
    """
    L = np.asarray(luminance, dtype=float)
    if not L.any():
        return None
    flux, square = L.sum(), (L**2).sum()
    middle = L @ np.asarray(directions, dtype=float)
    return SunDisc(
        middle / np.linalg.norm(middle), float(square / flux), float(flux**2 / square * SUN_SOLID_ANGLE / len(L))
    )


def spread_sun_dgp(width: float) -> float:
    """Change of DGP, 0 or less, where a lobe spreads the sun's disc: the greatest in amount.

    The lobe has the same flux, so that sum L^2 omega falls by the ratio of the solid angles, and
    DGP by at most 0.092 times its logarithm (`daylight_glare_probability`).

    Args: width: half width at 1/e of the Gaussian lobe [rad], as bright as 2 pi width^2 [sr].
    """
    return -0.092 * float(np.log10(max(2 * np.pi * width**2 / SUN_SOLID_ANGLE, 1.0)))
