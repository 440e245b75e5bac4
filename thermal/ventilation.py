"""Outdoor air of a zone as frozen data: leaks, fans, opened windows; air between zones.

Published models are functions that give the data.  Wind speeds are those of the place: at the
zone's height for leaks, at 10 m on the site for windows.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import require, require_range

DOE2 = (0.0, 0.0, 0.224, 0.0)  # EnergyPlus Input Output Reference, ZoneInfiltration:DesignFlowRate
BLAST = (0.606, 0.03636, 0.1177, 0.0)
DISCHARGE, PRESSURE = 0.67, 0.75  # of open windows: EN 16798-7:2017, B.1.2.1 and B.1.3.4
WIND, STACK = 0.001, 0.0035  # [1/(m/s)], [(m/s)/(m K)]: EN 16798-7:2017, table 11
DOOR_DISCHARGE = 0.65  # of an open doorway; measured ones lie between 0.4 and 0.8
GRAVITY = 9.81  # [m/s2]
REFERENCE_DENSITY = 1.204  # [kg/m3] of EN 16798-7, 20 degC


@dataclass(frozen=True, slots=True)
class Leakage:
    """Air through leaks: infiltration (a + b dT + c v + d v^2) + sqrt((s dT^m)^2 + (w v^n)^2).

    dT: difference between the zone's air and outdoors [K], v: wind at the zone's height [m/s].
    """

    factors: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)  # a, b, c, d
    stack: float = 0.0  # s [m3/s/K^m]
    stack_exponent: float = 0.5  # m
    wind: float = 0.0  # w [m3/s/(m/s)^n]
    wind_exponent: float = 1.0  # n

    def __post_init__(self) -> None:
        least = min(*self.factors, self.stack, self.wind)
        require(least >= 0, "leakage", f"a coefficient is negative: {least}")


def sherman_grimsrud(area_cm2: float, *, stack: float, wind: float) -> Leakage:
    """Flow through an effective leakage area at 4 Pa: A/1000 sqrt(C_s dT + C_w v^2) [m3/s].

    Args: stack, wind: C_s [(L/s)^2/(cm^4 K)] and C_w [(L/s)^2/(cm^4 (m/s)^2)]; of one storey
        0.000145, and 0.000319 without shelter to 0.000032 behind heavy shelter.

    Source: ASHRAE Handbook of Fundamentals, residential ventilation ("basic model").
    """
    flow = area_cm2 / 1000.0
    return Leakage((1.0, 0.0, 0.0, 0.0), flow * stack**0.5, 0.5, flow * wind**0.5, 1.0)


def aim2(coefficient: float, exponent: float, *, stack: float, wind: float, shelter: float = 1.0) -> Leakage:
    """Flow by the enhanced model: sqrt((c C_s dT^n)^2 + (c C_w (s v)^(2n))^2) [m3/s].

    Args: coefficient, exponent: c [m3/(s Pa^n)] and n of a pressure test; stack, wind: C_s
        [(Pa/K)^n], C_w [(Pa s2/m2)^n]; of one storey without flue 0.054 and 0.156 (slab, n 0.67).

    Source: Walker and Wilson 1998, doi:10.1080/10789669.1998.10391403; ASHRAE Handbook.
    """
    require_range(exponent, 0.5, 1.0, "leakage exponent")
    speed = shelter ** (2 * exponent)
    flows = coefficient * stack, coefficient * wind * speed
    return Leakage((1.0, 0.0, 0.0, 0.0), flows[0], exponent, flows[1], 2 * exponent)


@dataclass(frozen=True, slots=True)
class SupplyAir:
    """Outdoor air of a fan; its heat recovery, or its temperature."""

    ach: NDArray[np.float64] | float  # [H] [1/h]
    temperature_c: NDArray[np.float64] | float | None = None  # [H] as supplied; None: outdoor air
    recovery: float = 0.0  # (T_supply - T_out)/(T_room - T_out)
    bypass_above_c: float = np.inf  # no recovery in warmer rooms where outdoors is cooler
    least_c: float = -np.inf  # supplied air is heated to at least this

    def __post_init__(self) -> None:
        require(bool(np.all(np.asarray(self.ach) >= 0)), "supply air", "negative air change")
        require_range(self.recovery, 0.0, 1.0, "heat recovery")


@dataclass(frozen=True, slots=True)
class WindowAiring:
    """Windows that are opened: sqrt of the greater of w v^2 and s dT, or of their sum [m3/s].

    They cool: opened above `open_above_c`, they are opened in part where the air would fall below
    `close_below_c`, or below the zone's heating set point unless `heating_while_open`.
    """

    wind: float  # w [(m3/s)^2/(m/s)^2]
    stack: float  # s [(m3/s)^2/K]
    both: bool = False  # wind and stack are added: cross ventilation
    share: NDArray[np.float64] | float = 1.0  # [H] of the area that may be opened; 0: shut
    open_above_c: float = -np.inf  # room air; opened windows stay so down to `close_below_c`
    close_below_c: float = -np.inf
    least_difference: float = 0.0  # of the room's air above outdoors [K]
    greatest_wind: float = np.inf  # on the site [m/s]
    least_outdoor_c: float = -np.inf
    heating_while_open: bool = False
    flow: float = 0.0  # besides wind and stack, of open windows [m3/s]
    operative: bool = False  # whether the limits are of the operative temperature
    hybrid: bool = False  # open, they replace the fan; they are shut while the room is cooled

    def __post_init__(self) -> None:
        require(self.wind >= 0 and self.stack >= 0, "opened windows", "negative flow")
        fits = self.close_below_c <= self.open_above_c
        require(fits, "opened windows", "they close in warmer air than they open in")
        share = np.asarray(self.share)
        require(bool(np.all((share >= 0) & (share <= 1))), "opened windows", "a share not in 0..1")


def single_sided(area: float, height: float) -> tuple[float, float]:
    """w and s of windows in one facade: q = A/2 sqrt(max(C_wnd v^2, C_st h dT)).

    Args: area: open [m2]; height: useful for buoyancy [m], `stack_height`.

    Source: EN 16798-7:2017, 6.4.3.5.4.2.
    """
    half = 0.25 * area**2
    return half * WIND, half * STACK * height


def cross_flow(areas: ArrayLike, azimuths_deg: ArrayLike, height: float) -> tuple[float, float]:
    """w and s of windows in several facades: q^2 = (C_D A_cros v)^2 dC_p + (A/2)^2 C_st h dT.

    Args: areas: open [m2] and azimuths of the windows [W].

    Source: EN 16798-7:2017, 6.4.3.5.4.3.
    """
    area, azimuth = np.asarray(areas, dtype=float), np.asarray(azimuths_deg, dtype=float)
    across = []
    for first in (0.0, 45.0):
        quarter = np.floor(np.mod(azimuth - first + 45.0, 360.0) / 90.0).astype(int)
        sides = np.bincount(quarter, weights=area, minlength=4)
        others = area.sum() - sides
        across.append(
            sum(0.25 / np.sqrt(1 / a**2 + 1 / b**2) for a, b in zip(sides, others, strict=True) if a > 0 and b > 0)
        )
    wind = (DISCHARGE * min(across)) ** 2 * PRESSURE
    return float(wind), float(0.25 * area.sum() ** 2 * STACK * height)


def stack_height(bottoms: ArrayLike, tops: ArrayLike) -> float:
    """Useful height [m] for buoyancy of windows [W]: from the lowest bottom to the highest top."""
    pairs = list(product(np.asarray(tops, dtype=float), np.asarray(bottoms, dtype=float)))
    return float(max(top - bottom for top, bottom in pairs))


@dataclass(frozen=True, slots=True)
class AirTransfer:
    """Air that flows one way, from one zone into another."""

    source: str  # names of zones
    target: str
    flow: NDArray[np.float64] | float  # [H] [m3/s]

    def __post_init__(self) -> None:
        item = f"air from {self.source} to {self.target}"
        require(self.source != self.target, item, "expected two zones")
        require(bool(np.all(np.asarray(self.flow) >= 0)), item, "negative flow")


@dataclass(frozen=True, slots=True)
class NeighbourAir:
    """Air exchanged, as much each way, with a neighbour of known temperature: an open door."""

    beside_c: NDArray[np.float64] | float  # [H] or [T] of the neighbour's air
    flow: NDArray[np.float64] | float = 0.0  # [H] each way whatever the temperatures [m3/s]
    buoyant: float = 0.0  # each way at |dT| = T, see `large_opening` [m3/s]
    share: NDArray[np.float64] | float = 1.0  # [H] of the opening that is open

    def __post_init__(self) -> None:
        least = min(np.min(self.flow), self.buoyant, np.min(self.share))
        require(bool(least >= 0), "air beside", f"expected no negative flow, got {least:g}")


def large_opening(width: float, height: float, *, discharge: float = DOOR_DISCHARGE) -> float:
    """Air each way through a tall opening at |dT| = T [m3/s]: q = C_D/3 W sqrt(g H^3 dT/T).

    Warm air leaves above, as much cool air comes below the neutral height, the middle.

    Args: width, height: W and H of the opening [m]; discharge: C_D.

    Source: Brown and Solvason 1962, "Natural convection through rectangular openings in partitions
        1: vertical partitions", Int. J. Heat Mass Transfer 5, 859-868.
    """
    return discharge / 3.0 * width * float(np.sqrt(GRAVITY * height**3))
