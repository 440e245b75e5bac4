"""Convective film coefficients [W/(m2 K)], compiled, one published correlation per function.

Angles enter as the z component of the surface's normal out of the room: floor -1, ceiling +1.
"""

from __future__ import annotations

import numpy as np
from numba.extending import register_jitable

from thermal.records import INLINED

MINIMUM = 0.1  # EnergyPlus' lower limit of an inside film

# ISO 15099: Rayleigh number at which the air along vertical glass turns turbulent
CRITICAL = float(2.5e5 * np.exp(0.72 * 90.0) ** 0.2)
CRITICAL_CBRT, CRITICAL_ROOT = float(np.cbrt(CRITICAL)), CRITICAL**0.25  # both compiled in

# DOE-2 / MoWiTT: (a, b) of h = a V^b, windward and leeward
DOE2_WINDWARD, DOE2_LEEWARD = (3.26, 0.89), (3.55, 0.617)

# boundary layer depth [m] and exponent of the wind profile (ASHRAE Fundamentals)
TERRAIN = {"country": (270.0, 0.14), "suburbs": (370.0, 0.22), "city": (460.0, 0.33)}


def local_wind_factor(height: float, terrain: str) -> float:
    """Wind speed at a height [m] over a terrain, as a multiple of that of the weather station."""
    if terrain not in TERRAIN:
        raise ValueError(f"terrain {terrain!r} is not of {', '.join(TERRAIN)}")
    depth, exponent = TERRAIN[terrain]
    return float((270.0 / 10.0) ** 0.14 * (max(height, 0.1) / depth) ** exponent)


@register_jitable(**INLINED)
def tarp_inside(surface_c: float, air_c: float, normal_z: float) -> float:
    """Natural convection at an inside face (Walton 1983, TARP; EnergyPlus)."""
    dt = surface_c - air_c
    root = np.cbrt(abs(dt))
    if abs(normal_z) < 1e-3:
        h = 1.31 * root
    elif dt * normal_z < 0.0:  # warm floor, cold ceiling: unstable
        h = 9.482 * root / (7.238 - abs(normal_z))
    else:
        h = 1.810 * root / (1.382 + abs(normal_z))
    return max(h, MINIMUM)


@register_jitable(**INLINED)
def constant_inside(surface_c: float, air_c: float, normal_z: float) -> float:
    """Constant inside films that only know the direction of the heat (Walton 1983, "simple")."""
    unstable = (surface_c - air_c) * normal_z < 0.0
    if abs(normal_z) < 0.3827:
        return 3.076
    if abs(normal_z) < 0.9239:
        return 3.870 if unstable else 2.281
    return 4.040 if unstable else 0.948


@register_jitable(**INLINED)
def iso15099_inside(glass_c: float, air_c: float, height: float, pressure: float) -> float:
    """Natural convection at the room side of vertical glass (ISO 15099:2003, 8.3.2.2); pressure [Pa]."""
    dt = abs(glass_c - air_c)
    if dt < 1e-9:
        return MINIMUM
    film = air_c + 273.15 + 0.25 * (glass_c - air_c)
    conductivity = 2.873e-3 + 7.76e-5 * film
    viscosity = 3.723e-6 + 4.94e-8 * film
    capacity = 1002.737 + 0.012324 * film
    density = pressure * 28.97 / (8314.51 * film)
    rayleigh = density**2 * height**3 * 9.81 * capacity * dt / (film * viscosity * conductivity)
    if rayleigh <= CRITICAL:
        nusselt = 0.56 * np.sqrt(np.sqrt(rayleigh))
    else:
        nusselt = 0.13 * (np.cbrt(rayleigh) - CRITICAL_CBRT) + 0.56 * CRITICAL_ROOT
    return nusselt * conductivity / height


@register_jitable(**INLINED)
def natural_outside(surface_c: float, air_c: float, normal_z: float) -> float:
    """Natural part of the outside film; the outward face of a roof looks up."""
    return tarp_inside(surface_c, air_c, -normal_z)


@register_jitable(**INLINED)
def doe2_outside(surface_c: float, air_c: float, normal_z: float, forced: float, roughness: float) -> float:
    """DOE-2 outside film: h_n + R_f (sqrt(h_n^2 + h_f^2) - h_n), h_f = a V^b of smooth glass."""
    natural = natural_outside(surface_c, air_c, normal_z)
    return natural + roughness * (np.sqrt(natural * natural + forced * forced) - natural)


@register_jitable(**INLINED)
def mowitt_outside(surface_c: float, air_c: float, forced: float) -> float:
    """MoWiTT outside film of smooth glass: sqrt((0.84 |dT|^(1/3))^2 + (a V^b)^2)."""
    natural = 0.84 * np.cbrt(abs(surface_c - air_c))
    return max(np.sqrt(natural * natural + forced * forced), MINIMUM)
