"""Temperatures and radiosities of a glazing's layers in the steady state, compiled.

Every layer has two faces.  With G the longwave that meets a face, J what leaves it:

    h (T_f - T_gap) + (k/d) (T_f - T_b) + J_f - G_f = S/2 + q_v/2        front, the back likewise
    J_f = eps_f sigma T_f^4 + rho_f G_f + tau G_b

T^4 is taken along its tangent at the temperatures before; gaps and films follow in turn.

Source: ISO 15099:2003, 5.1 to 5.3 (closed gaps: 5.3.3), 7.4 (ventilated gaps) and 8.3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.compiled import compiled
from thermal.gases import PRESSURE, gas_conductivity, gas_density, gas_heat, gas_viscosity
from thermal.records import ENTRY, inlined

GRAVITY = 9.807  # [m/s2]
REFERENCE_K = 283.0  # of the density that drives the air
HALVINGS = 60  # at most, of the interval in which the air's speed is looked for
LEAST_EXCESS = 1e-10  # [m/s] of the speed that the air drives over the one that it has

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
    fractions: FloatArray, gap: int, width: float, height: float, tilt: float, outer: float, inner: float, mean: float
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
def driven_speed(quadratic: float, linear: float, first: float, second: float, height: float, tilt: float) -> float:
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
    """Speed [m/s] of a gap's air that comes from and goes to air of one temperature [K].

    By the Illinois method (Dowell and Jarratt 1971, doi:10.1007/BF01934364).
    """
    a, b = pressure_terms(fractions, gap, width, height, impedance, at)
    low, high = 0.0, driven_speed(a, b, mean, inlet, height, tilt)
    if high <= 1e-12:
        return 0.0
    # the speed that the air drives less that which it has: above zero at `low`, not so at `high`
    over = high
    under = _drives(fractions, gap, width, height, tilt, closed, mean, inlet, at, a, b, high) - high
    side = 0
    for _ in range(HALVINGS):
        speed = (low * under - high * over) / (under - over)
        excess = _drives(fractions, gap, width, height, tilt, closed, mean, inlet, at, a, b, speed) - speed
        if abs(excess) < LEAST_EXCESS:
            return speed
        if excess > 0.0:
            low, over = speed, excess
            under = 0.5 * under if side > 0 else under
            side = 1
        else:
            high, under = speed, excess
            over = 0.5 * over if side < 0 else over
            side = -1
    return 0.5 * (low + high)


@inlined
def _drives(
    fractions: FloatArray,
    gap: int,
    width: float,
    height: float,
    tilt: float,
    closed: float,
    mean: float,
    inlet: float,
    at: float,
    a: float,
    b: float,
    speed: float,
) -> float:
    """Speed [m/s] that a gap's air drives where it moves with another."""
    average = air_in_gap(fractions, gap, width, height, closed, speed, mean, inlet, at)[1]
    return driven_speed(a, b, average, inlet, height, tilt)


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
    fractions: FloatArray, gap: int, width: float, height: float, closed: float, mean: float, speed: float
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
        out, back = ends_of_loop(fractions, gap, widths, height, closed, closed_next, mean, mean_next, middle)
        first = air_in_gap(fractions, gap, width, height, closed, middle, mean, back, mean)[1]
        second = air_in_gap(
            fractions, gap + 1, width_next, height, closed_next, middle * ratio, mean_next, out, mean_next
        )[1]
        if driven_speed(a, b, first, second, height, tilt) > middle:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


SIGMA = 5.6697e-8  # [W/(m2 K4)] ISO 15099
CLOSED, OUTDOORS, INDOORS, LOOP, FORCED = range(5)  # where the air of a gap comes from
TOLERANCE = 1e-7  # [K] between two rounds
MOST_ROUNDS = 2000
LEAST_RELAXATION = 0.02


class UnitArrays(NamedTuple):
    """A glazing unit as the kernel takes it: N layers and G = N - 1 gaps, outside to inside."""

    conductance: NDArray[np.float64]  # [N] of the solid [W/(m2 K)]
    emissivity: NDArray[np.float64]  # [N, 2] outer and inner face
    infrared: NDArray[np.float64]  # [N] longwave transmittance
    width: NDArray[np.float64]  # [G] [m]
    gas: NDArray[np.float64]  # [G + 1, 4] fractions; the last row is air
    air: NDArray[np.int64]  # [G] CLOSED to FORCED; LOOP: with the next gap
    impedance: NDArray[np.float64]  # [G] Z_in + Z_out of the openings
    forced: NDArray[np.float64]  # [G, 2] speed [m/s] and temperature [K] of FORCED air
    # height [m], tilt [rad] from horizontal, the radiosity [W/m2] of both surroundings
    place: NDArray[np.float64]  # [4]
    films: NDArray[np.float64]  # [2, 2] outdoors, indoors: air [K], convection; < 0: indoors free


class UnitState(NamedTuple):
    """Outputs of the kernel."""

    faces: NDArray[np.float64]  # [2 N] [K]
    radiosity: NDArray[np.float64]  # [2 N] [W/m2]
    gap: NDArray[np.float64]  # [G, 6] conductance, heat to the faces, speed, inlet, outlet, mean [K]
    film: NDArray[np.float64]  # [2] convection outdoors, indoors [W/(m2 K)]
    matrix: NDArray[np.float64]  # [4 N, 4 N + 1] scratch


@compiled(**ENTRY)
def settle(unit: UnitArrays, absorbed: NDArray[np.float64], state: UnitState) -> float:
    """Bring the state to balance; the largest change of the last round [K].

    Where a gap is at a step of its correlation (0.6 % at Ra = 5e4) no state is in balance; the
    change is then that of the temperatures themselves, which end at the step.

    Args: absorbed: by each layer [N] [W/m2].
    """
    relaxation, change = 0.7, 1e9
    for turn in range(MOST_ROUNDS):
        _films(unit, state)
        _gaps(unit, state)
        _assemble(unit, absorbed, state)
        _eliminate(state.matrix)
        change = _take(state, relaxation)
        if change < TOLERANCE:
            break
        if turn % 100 == 99:
            relaxation = max(0.7 * relaxation, LEAST_RELAXATION)
    return change if relaxation > LEAST_RELAXATION else relaxation * change


@inlined
def _films(unit: UnitArrays, state: UnitState) -> None:
    """Convection at the outermost and the innermost face."""
    last = state.faces.size - 1
    state.film[0] = unit.films[0, 1]
    state.film[1] = unit.films[1, 1]
    if unit.films[1, 1] < 0.0:
        state.film[1] = free_convection(state.faces[last], unit.films[1, 0], unit.place[0], unit.place[1], unit.gas)


@inlined
def free_convection(face: float, air: float, height: float, tilt: float, gas: FloatArray) -> float:
    """Film [W/(m2 K)] of still room air at a face [K], tilt [rad] (8.3.2.2); gas: last row air.

    A face warmer than the air is one that looks the other way.
    """
    row = gas.shape[0] - 1
    film = air + 0.25 * (face - air)
    conductivity, viscosity = gas_conductivity(gas, row, film), gas_viscosity(gas, row, film)
    rayleigh = gas_density(gas, row, film) ** 2 * height**3 * GRAVITY * gas_heat(gas, row, film)
    rayleigh *= abs(face - air) / (film * viscosity * conductivity)
    leaning = tilt if air >= face else np.pi - tilt
    degrees = leaning * 180.0 / np.pi
    sine = max(np.sin(leaning), 1e-12)
    if degrees < 15.0:
        number = 0.13 * np.cbrt(rayleigh)
    elif degrees <= 90.0 + 1e-9:
        critical = 2.5e5 * (np.exp(0.72 * degrees) / sine) ** 0.2
        if rayleigh <= critical:
            number = 0.56 * np.sqrt(np.sqrt(rayleigh * sine))
        else:
            number = 0.13 * (np.cbrt(rayleigh) - np.cbrt(critical))
            number += 0.56 * np.sqrt(np.sqrt(critical * sine))
    elif degrees <= 179.0:
        number = 0.56 * np.sqrt(np.sqrt(rayleigh * sine))
    else:
        number = 0.58 * rayleigh**0.2
    return number * conductivity / height


@inlined
def _gaps(unit: UnitArrays, state: UnitState) -> None:
    """Conductance, heat given by moving air, speed, inlet, outlet and mean of every gap."""
    height, tilt = unit.place[0], unit.place[1]
    for g in range(unit.width.size):
        if g > 0 and unit.air[g - 1] == LOOP:
            continue
        mean = 0.5 * (state.faces[2 * g + 1] + state.faces[2 * g + 2])
        at, closed = _still(unit, state, g)
        kind = unit.air[g]
        if kind == LOOP:
            _loop(unit, state, g, at, closed)
            continue
        speed, inlet = 0.0, mean
        if kind == FORCED:
            speed, inlet = unit.forced[g, 0], unit.forced[g, 1]
        elif kind != CLOSED:
            inlet = unit.films[0 if kind == OUTDOORS else 1, 0]
            speed = speed_by_air(unit.gas, g, unit.width[g], height, tilt, unit.impedance[g], closed, mean, inlet, at)
        _moving(unit, state, g, closed, speed, inlet, at)


@inlined
def _still(unit: UnitArrays, state: UnitState, g: int) -> tuple[float, float]:
    """The temperature of a gap's gas [K], and its conductance if the gas did not move along."""
    outer, inner = state.faces[2 * g + 1], state.faces[2 * g + 2]
    at = state.gap[g, 5] if state.gap[g, 5] > 0.0 else 0.5 * (outer + inner)
    return at, gap_convection(unit.gas, g, unit.width[g], unit.place[0], unit.place[1], outer, inner, at)


@inlined
def _loop(unit: UnitArrays, state: UnitState, g: int, at: float, closed: float) -> None:
    """The gaps g and g + 1, between which air goes round a shade."""
    height, tilt = unit.place[0], unit.place[1]
    at_next, closed_next = _still(unit, state, g + 1)
    mean = 0.5 * (state.faces[2 * g + 1] + state.faces[2 * g + 2])
    mean_next = 0.5 * (state.faces[2 * g + 3] + state.faces[2 * g + 4])
    speed = speed_in_loop(unit.gas, g, unit.width, height, tilt, unit.impedance, closed, closed_next, mean, mean_next)
    out, back = ends_of_loop(unit.gas, g, unit.width, height, closed, closed_next, mean, mean_next, speed)
    _moving(unit, state, g, closed, speed, back, at)
    turned = speed * unit.width[g] / unit.width[g + 1]
    _moving(unit, state, g + 1, closed_next, turned, out, at_next)
    # the speeds carry equal volumes, not quite equal masses: what one gap gives the other takes
    moved = 0.5 * (state.gap[g, 1] - state.gap[g + 1, 1])
    state.gap[g, 1], state.gap[g + 1, 1] = moved, -moved


@inlined
def _moving(unit: UnitArrays, state: UnitState, g: int, closed: float, speed: float, inlet: float, at: float) -> None:
    """Note a gap whose air moves with a speed from an inlet temperature."""
    mean = 0.5 * (state.faces[2 * g + 1] + state.faces[2 * g + 2])
    outlet, average, heat = air_in_gap(unit.gas, g, unit.width[g], unit.place[0], closed, speed, mean, inlet, at)
    state.gap[g, 0] = closed + 2.0 * speed
    state.gap[g, 1], state.gap[g, 2] = heat, speed
    state.gap[g, 3], state.gap[g, 4], state.gap[g, 5] = inlet, outlet, average


@inlined
def _assemble(unit: UnitArrays, absorbed: FloatArray, state: UnitState) -> None:
    """Rows of every layer i: front face T, J of the front, J of the back, back face T."""
    a, n = state.matrix, unit.conductance.size
    size = 4 * n
    for row in range(size):
        for column in range(size + 1):
            a[row, column] = 0.0
    for i in range(n):
        at, solid, tau = 4 * i, unit.conductance[i], unit.infrared[i]
        before = state.film[0] if i == 0 else state.gap[i - 1, 0]
        after = state.film[1] if i == n - 1 else state.gap[i, 0]
        a[at, at], a[at, at + 1], a[at, at + 3] = before + solid, 1.0, -solid
        a[at + 3, at + 3], a[at + 3, at + 2], a[at + 3, at] = after + solid, 1.0, -solid
        a[at, size] = a[at + 3, size] = 0.5 * absorbed[i]
        for side in range(2):
            row, face = at + 1 + side, 2 * i + side
            emitted = unit.emissivity[i, side] * SIGMA * state.faces[face] ** 3
            a[row, row] = 1.0
            a[row, at + 3 * side] = -4.0 * emitted
            a[row, size] = -3.0 * emitted * state.faces[face]
        front = 1.0 - unit.emissivity[i, 0] - tau
        back = 1.0 - unit.emissivity[i, 1] - tau
        if i == 0:
            a[at, size] += before * unit.films[0, 0] + unit.place[2]
            a[at + 1, size] += front * unit.place[2]
            a[at + 2, size] += tau * unit.place[2]
        else:
            a[at, at - 1], a[at, at - 2] = -before, -1.0
            a[at, size] += 0.5 * state.gap[i - 1, 1]
            a[at + 1, at - 2], a[at + 2, at - 2] = -front, -tau
        if i == n - 1:
            a[at + 3, size] += after * unit.films[1, 0] + unit.place[3]
            a[at + 1, size] += tau * unit.place[3]
            a[at + 2, size] += back * unit.place[3]
        else:
            a[at + 3, at + 4], a[at + 3, at + 5] = -after, -1.0
            a[at + 3, size] += 0.5 * state.gap[i, 1]
            a[at + 1, at + 5], a[at + 2, at + 5] = -tau, -back


@inlined
def _eliminate(a: FloatArray) -> None:
    """Gauss-Jordan elimination with row exchange; the solution lands in the last column."""
    size = a.shape[0]
    for k in range(size):
        best = k
        for row in range(k + 1, size):
            if abs(a[row, k]) > abs(a[best, k]):
                best = row
        if best != k:
            for column in range(k, size + 1):
                a[k, column], a[best, column] = a[best, column], a[k, column]
        pivot = a[k, k]
        for column in range(k, size + 1):
            a[k, column] /= pivot
        for row in range(size):
            share = a[row, k]
            if row != k and share != 0.0:
                for column in range(k, size + 1):
                    a[row, column] -= share * a[k, column]


@inlined
def _take(state: UnitState, relaxation: float) -> float:
    """Move the temperatures towards the solution; the largest step that was asked for [K]."""
    size = state.matrix.shape[0]
    change = 0.0
    for i in range(size // 4):
        for side in range(2):
            fresh = state.matrix[4 * i + 3 * side, size]
            step = fresh - state.faces[2 * i + side]
            change = max(change, abs(step))
            state.faces[2 * i + side] += relaxation * step
            state.radiosity[2 * i + side] = state.matrix[4 * i + 1 + side, size]
    return change
