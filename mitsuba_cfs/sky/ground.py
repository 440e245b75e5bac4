"""Luminance of the ground up to the horizon, without modelled surroundings.

`reflected`   diffuse reflection of sky and sun, rho E_gh / pi (gendaymtx)
`gendaylit`   gendaylit's: its share of the sky is that of a CIE sky of the same zenith luminance
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

OVERCAST = 0.777778  # horizontal illuminance over pi times the zenith luminance, CIE overcast sky
CLEAR_FROM = 6.0  # clearness
# the same times F2, in (altitude - pi/4) / (pi/4)
CLEAR_SKY = (2.766521, 0.547665, -0.369832, 0.009237, 0.059229)
INTERMEDIATE_SKY = (3.5556, -2.7152, -1.3081, 1.0660, 0.60227)


def reflected_ground(global_horizontal: FloatArray, reflectance: float | FloatArray) -> FloatArray:
    """Luminance [H] of a diffuse plain, rho E_gh / pi."""
    return reflectance / np.pi * global_horizontal


def gendaylit_ground(
    zenith: FloatArray,
    direct_horizontal: FloatArray,
    clearness: FloatArray,
    sun: FloatArray,
    reflectance: float | FloatArray,
) -> FloatArray:
    """Luminance [H] of the ground by gendaylit, rho (L_z n + E_dh / pi).

    n is that of the CIE overcast sky at clearness 1, of the intermediate one below 6, else of the
    clear one.  `reflected` gives 0.99 to 2.2 times as much over a year of Geneva.

    Args:
        zenith: [H] luminance of the sky's zenith [cd/m2].
        direct_horizontal: [H] illuminance of the ground by the sun [lx].
        clearness: [H] Perez's epsilon; sun: [H, 3] unit vectors to it.

    Source: Radiance `gendaylit.c`, `gensky.c`.
    """
    height = np.arcsin(np.clip(sun[:, 2], 0.0, 1.0))
    from_zenith = np.pi / 2 - height
    x = (height - np.pi / 4) / (np.pi / 4)
    clear = 0.274 * (0.91 + 10.0 * np.exp(-3.0 * from_zenith) + 0.45 * sun[:, 2] ** 2)
    between = (2.739 + 0.9891 * np.sin(0.3119 + 2.6 * height)) * np.exp(
        -from_zenith * (0.4441 + 1.48 * height)
    )
    factor = np.where(
        clearness >= CLEAR_FROM,
        polyval(x, CLEAR_SKY) / clear / np.pi,
        polyval(x, INTERMEDIATE_SKY) / between / np.pi,
    )
    factor = np.where(clearness <= 1.0, OVERCAST, factor)
    return reflectance * (zenith * factor + direct_horizontal / np.pi)
