"""Films and resistances of faces at the temperatures of an iterate, compiled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal.blackbox import table_conductance
from thermal.climate import SIGMA
from thermal.convection import constant_inside, doe2_outside, iso15099_inside, mowitt_outside, tarp_inside
from thermal.network import WINDOW, Faces
from thermal.records import Method, OutdoorConditions, inlined

UPRIGHT = 0.7071  # of the normal's z: faces within 45 degrees of upright


@inlined
def cube(a_c: float, b_c: float) -> float:
    """(T_a^2 + T_b^2)(T_a + T_b) [K3]: the difference of fourth powers over that of T."""
    a, b = a_c + 273.15, b_c + 273.15
    return (a * a + b * b) * (a + b)


@inlined
def layer_conductance(kind: int, c: NDArray[np.float64], inner: float, outer: float) -> float:
    """Conductance [W/(m2 K)] between two window layers; c: of `LayerResistance`."""
    x, d = 0.5 * (inner + outer) - 10.0, abs(inner - outer)
    if kind == 0:
        return 1.0 / c[0]
    if kind == 1:
        u = min(max(c[0] + c[1] * x, 0.05), 0.95 / c[2])
        return 1.0 / (1.0 / u - c[2])
    if kind == 3:
        return table_conductance(c, x + 10.0, d)
    return max(c[0] + c[1] * x + c[2] * d + c[3] * d * d + c[4] * x * d + c[5] * x * x, 0.02)


@inlined
def inside_film(faces: Faces, i: int, surface: float, air: float, method: Method) -> float:
    """Convection [W/(m2 K)] of an inside face."""
    nz = faces.normal[i, 2]
    if method.inside == 1:
        return constant_inside(surface, air, nz)
    if method.inside == 2:
        if abs(nz) < UPRIGHT:
            return method.inside_films[0]
        return method.inside_films[1 if (surface - air) * nz < 0.0 else 2]
    if faces.kind[i] == WINDOW and abs(nz) < 0.1:
        return iso15099_inside(surface, air, faces.height[i], method.pressure)
    return tarp_inside(surface, air, nz)


@inlined
def outside_exchange(
    faces: Faces, i: int, surface: float, emissivity: float, weather: OutdoorConditions, t: int, method: Method
) -> tuple[float, float]:
    """Sum of the outside coefficients [W/(m2 K)], and of them times their temperatures."""
    out, sky = weather.outdoor[t], weather.sky[t]
    nx, ny, nz = faces.normal[i]
    faces_wind = abs(nz) > 0.98 or nx * weather.origin[t, 0] + ny * weather.origin[t, 1] >= -1e-9
    if faces_wind:
        forced = faces.wind[i, 0] * weather.windward[t]
    else:
        forced = faces.wind[i, 1] * weather.leeward[t]
    if method.outside == 0:
        h = doe2_outside(surface, out, nz, forced, faces.roughness[i])
    elif method.outside == 1:
        h = mowitt_outside(surface, out, forced)
    else:
        h = method.outside_film
    radiant = SIGMA * emissivity
    h_sky = radiant * faces.hemisphere[i, 0] * cube(surface, sky)
    share = faces.hemisphere[i, 1] + faces.hemisphere[i, 2]
    h_out = h + radiant * share * cube(surface, out)
    return h_sky + h_out, h_sky * sky + h_out * out
