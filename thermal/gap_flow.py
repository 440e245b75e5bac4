"""Heat through gaps between layers: convection of closed gaps, air that moves behind shades.

Source: ISO 15099:2003, 5.3.3 (closed gaps) and 7.4 (ventilated gaps).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from thermal.gases import PRESSURE, gas_conductivity, gas_density, gas_heat, gas_viscosity
from thermal.records import inlined

GRAVITY = 9.807  # [m/s2]
REFERENCE_K = 283.0  # of the density that drives the air
HALVINGS = 60  # of the interval in which the air's speed is looked for

FloatArray = NDArray[np.float64]


@inlined
def nusselt(rayleigh: float, aspect: float, tilt: float) -> float:
    """Nusselt number of a closed gap; tilt [rad] from horizontal, heated from below (5.3.3.2)."""
    if tilt < np.pi / 3.0 - 1e-9:
        return _nusselt_flat(rayleigh, tilt)
    if tilt <= np.pi / 2.0 + 1e-9:
        upright = _nusselt_upright(rayleigh, aspect)
        share = (tilt - np.pi / 3.0) / (np.pi / 6.0)
        return _nusselt_sixty(rayleigh, aspect) * (1.0 - share) + upright * share
    return 1.0 + (_nusselt_upright(rayleigh, aspect) - 1.0) * np.sin(tilt)


@inlined
def _nusselt_flat(rayleigh: float, tilt: float) -> float:
    """Below 60 degrees (formula 42)."""
    driven = max(rayleigh * np.cos(tilt), 1e-9)
    first = max(1.0 - 1708.0 / driven, 0.0)
    second = 1.0 - 1708.0 * abs(np.sin(1.8 * tilt)) ** 1.6 / driven
    return 1.0 + 1.44 * first * second + max(np.cbrt(driven / 5830.0) - 1.0, 0.0)


@inlined
def _nusselt_sixty(rayleigh: float, aspect: float) -> float:
    """At 60 degrees (formulas 44 to 47)."""
    g = 0.5 / (1.0 + (rayleigh / 3160.0) ** 20.6) ** 0.1
    first = (1.0 + (0.0936 * rayleigh**0.314 / (1.0 + g)) ** 7) ** (1.0 / 7.0)
    return max(first, (0.104 + 0.175 / aspect) * rayleigh**0.283)


@inlined
def _nusselt_upright(rayleigh: float, aspect: float) -> float:
    """At 90 degrees (formulas 48 to 52)."""
    if rayleigh > 5e4:
        first = 0.0673838 * np.cbrt(rayleigh)
    elif rayleigh > 1e4:
        first = 0.028154 * rayleigh**0.4134
    else:
        first = 1.0 + 1.7596678e-10 * rayleigh**2.2984755
    return max(first, 0.242 * (rayleigh / aspect) ** 0.272)


@inlined
def gap_convection(
    fractions: FloatArray,
    gap: int,
    width: float,
    height: float,
    tilt: float,
    outer: float,
    inner: float,
    mean: float,
) -> float:
    """Conductance [W/(m2 K)] by convection of a gap between two faces [K], its gas at a mean [K].

    The tilt counts from the side of the room: heat that flows down meets the other branch.
    """
    conductivity = gas_conductivity(fractions, gap, mean)
    density = gas_density(fractions, gap, mean)
    viscosity = gas_viscosity(fractions, gap, mean)
    rayleigh = density * density * width**3 * GRAVITY * gas_heat(fractions, gap, mean)
    rayleigh *= abs(outer - inner) / (mean * viscosity * conductivity)
    leaning = tilt if inner >= outer else np.pi - tilt
    return nusselt(rayleigh, height / width, leaning) * conductivity / width


@inlined
def pressure_terms(
    fractions: FloatArray, gap: int, width: float, height: float, impedance: float, mean: float
) -> tuple[float, float]:
    """A and B of A v2 + B v = the pressure that drives the air of a gap [Pa]."""
    density = gas_density(fractions, gap, mean)
    friction = 12.0 * gas_viscosity(fractions, gap, mean) * height / width**2
    return 0.5 * density * (1.0 + impedance), friction


@inlined
def driven_speed(
    quadratic: float, linear: float, first: float, second: float, height: float, tilt: float
) -> float:
    """Speed [m/s] that the difference between two air temperatures [K] drives."""
    density = PRESSURE * 28.97 / (8314.462175 * REFERENCE_K)
    pressure = density * REFERENCE_K * GRAVITY * height * abs(np.sin(tilt))
    pressure *= abs(first - second) / (first * second)
    return (np.sqrt(linear * linear + 4.0 * quadratic * pressure) - linear) / (2.0 * quadratic)


@inlined
def air_in_gap(
    fractions: FloatArray,
    gap: int,
    width: float,
    height: float,
    closed: float,
    speed: float,
    mean: float,
    inlet: float,
    at: float,
) -> tuple[float, float, float]:
    """Outlet and mean temperature [K], and heat given to the faces [W/m2], of moving air.

    Args: closed: convective conductance without movement; mean: of the two faces [K]; at: the
        temperature of the gas' properties [K].
    """
    carried = gas_density(fractions, gap, at) * gas_heat(fractions, gap, at) * speed * width
    if speed <= 1e-12:
        return mean, mean, 0.0
    characteristic = carried / (4.0 * (closed + 2.0 * speed))
    outlet = mean - (mean - inlet) * np.exp(-height / characteristic)
    average = mean - characteristic / height * (outlet - inlet)
    return outlet, average, carried * (inlet - outlet) / height


@inlined
def speed_by_air(
    fractions: FloatArray,
    gap: int,
    width: float,
    height: float,
    tilt: float,
    impedance: float,
    closed: float,
    mean: float,
    inlet: float,
    at: float,
) -> float:
    """Speed [m/s] of a gap's air that comes from and goes to air of one temperature [K]."""
    a, b = pressure_terms(fractions, gap, width, height, impedance, at)
    low, high = 0.0, driven_speed(a, b, mean, inlet, height, tilt)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        average = air_in_gap(fractions, gap, width, height, closed, middle, mean, inlet, at)[1]
        if driven_speed(a, b, average, inlet, height, tilt) > middle:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@inlined
def ends_of_loop(
    fractions: FloatArray,
    gap: int,
    widths: FloatArray,
    height: float,
    closed: float,
    closed_next: float,
    mean: float,
    mean_next: float,
    speed: float,
) -> tuple[float, float]:
    """Temperatures [K] of the air that leaves the first of two gaps around a shade, and the second.

    The air goes round: out of the first gap (`gap`) into the next and back.  Args: closed, mean:
    of the first gap; widths [G]; speed: in the first [m/s].
    """
    turned = speed * widths[gap] / widths[gap + 1]
    stays = _stays(fractions, gap, widths[gap], height, closed, mean, speed)
    stays_next = _stays(fractions, gap + 1, widths[gap + 1], height, closed_next, mean_next, turned)
    out = (1.0 - stays) * mean + stays * (1.0 - stays_next) * mean_next
    out /= max(1.0 - stays * stays_next, 1e-12)
    return out, (1.0 - stays_next) * mean_next + stays_next * out


@inlined
def _stays(
    fractions: FloatArray,
    gap: int,
    width: float,
    height: float,
    closed: float,
    mean: float,
    speed: float,
) -> float:
    """Share of its difference from the faces that air keeps over the height of a gap."""
    if speed <= 1e-12:
        return 0.0
    carried = gas_density(fractions, gap, mean) * gas_heat(fractions, gap, mean) * speed * width
    return np.exp(-height * 4.0 * (closed + 2.0 * speed) / carried)


@inlined
def speed_in_loop(
    fractions: FloatArray,
    gap: int,
    widths: FloatArray,
    height: float,
    tilt: float,
    impedance: FloatArray,
    closed: float,
    closed_next: float,
    mean: float,
    mean_next: float,
) -> float:
    """Speed [m/s] in the first of two gaps whose air goes round a shade between them."""
    width, width_next = widths[gap], widths[gap + 1]
    ratio = width / width_next
    a, b = pressure_terms(fractions, gap, width, height, impedance[gap], mean)
    a2, b2 = pressure_terms(fractions, gap + 1, width_next, height, impedance[gap + 1], mean_next)
    a, b = a + ratio * ratio * a2, b + ratio * b2
    low, high = 0.0, driven_speed(a, b, mean, mean_next, height, tilt)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        out, back = ends_of_loop(
            fractions, gap, widths, height, closed, closed_next, mean, mean_next, middle
        )
        first = air_in_gap(fractions, gap, width, height, closed, middle, mean, back, mean)[1]
        second = air_in_gap(
            fractions,
            gap + 1,
            width_next,
            height,
            closed_next,
            middle * ratio,
            mean_next,
            out,
            mean_next,
        )[1]
        if driven_speed(a, b, first, second, height, tilt) > middle:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
