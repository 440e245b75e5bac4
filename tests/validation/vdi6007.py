"""The twelve test cases of VDI 6007-1 in the room balance.

    python -m tests.validation vdi6007

Rooms, loads and results are those of the public Modelica library IBPSA
(`ThermalZones/ReducedOrder/Validation/VDI6007/TestCase*.mo`, which states the norm's values), the
layers of the rooms S and L those of TEASER (`examplefiles/VDI6007_Room1.json`, `_Room3.json`).  The
norm's model has one capacity for all inner and one for all outer walls: "two capacities" has these
as layers, so that only the balance is compared; "layers" has the walls themselves.  Films and
longwave exchange are the norm's constants.  The norm's tolerance is 0.1 K and 1 W besides the
rounding.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from thermal.balance import AIR_GAS_CONSTANT, BalanceOptions, ZoneResult, simulate
from thermal.climate import KELVIN, Climate, Solar
from thermal.records import AIR_HEAT
from thermal.zone import Gains, IdealLoads, Layer, OpaqueSurface, Zone

FloatArray = NDArray[np.float64]
RESULTS = Path(__file__).parents[1] / "reference" / "vdi6007" / "results.csv"
ROWS_H = 6  # of an hour: profiles are steps, to which an hour is too long
COOLED = 11  # the case of the cooled ceiling
# that library's check of it: 100 W in the first two minutes after heating turns into cooling
SUBSTITUTE, SUBSTITUTED = 100.0, 2
DAYS = 60
SOUTH, UP = np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])
OUTER_FILM, RADIATION = 25.0, 5.0  # [W/(m2 K)]
TOLERANCE = {"K": 0.15, "W": 1.5}  # the norm's 0.1 K and 1 W, and half a digit of the results
THIN = 0.01  # [m] of a layer that is a capacity
POWER = (6, 7, 11)  # cases whose result is heating (cooling: negative) [W]

OUTDOOR = np.array(
    [
        18.8,
        17.1,
        16.5,
        16.1,
        16.5,
        17.8,
        20.3,
        22.8,
        24.8,
        26.7,
        28.1,
        29.0,
        29.7,
        30.4,
        30.9,
        31.0,
        30.8,
        30.1,
        28.9,
        27.0,
        24.7,
        22.9,
        21.9,
        20.9,
    ]
)
SUN = np.array(
    [
        [0, 0, 0, 0, 17, 38, 59, 98, 186, 287, 359, 385, 359, 287, 186, 98, 59, 38, 17, 0, 0, 0, 0, 0],
        [0, 0, 0, 0, 17, 36, 51, 64, 74, 84, 92, 100, 180, 344, 475, 528, 492, 359, 147, 0, 0, 0, 0, 0],
    ],
    dtype=float,
)  # behind the glass of two facades [W/m2]
WALL_SUN = np.array(
    [
        [0, 0, 0, 0, 24, 58, 91, 203, 348, 472, 553, 581, 553, 472, 348, 203, 91, 58, 24, 0, 0, 0, 0, 0],
        [0, 0, 0, 0, 23, 53, 77, 97, 114, 131, 144, 159, 372, 557, 685, 733, 666, 474, 177, 0, 0, 0, 0, 0],
    ],
    dtype=float,
)
SKY = np.array(
    [
        362.5,
        364,
        364.5,
        364,
        380.5,
        390.5,
        400.5,
        414,
        427.5,
        439,
        448.5,
        457,
        459.5,
        460,
        457.5,
        452.5,
        445,
        438.5,
        437,
        420,
        412.5,
        405,
        397.5,
        390,
    ]
)  # longwave of the sky [W/m2]
BLIND_ABOVE, BLIND = 100.0, 0.15  # [W/m2] and what a closed blind passes
SUN_TO_AIR, WALL_ABSORPTANCE = 0.09, 0.7
GLASS = 7.0  # [m2] of a facade
FACADES = {0: (), 1: (None,), 2: (10.5, 15.0)}  # [m2] by their number; None: all outer walls


def _stack(*layers: tuple[float, float, float, float]) -> tuple[Layer, ...]:
    return tuple(Layer(*layer) for layer in layers)


LAYERED = {  # facade, window, inner wall, door, slab [m, W/(m K), kg/m3, J/(kg K)]
    "S": (
        _stack((0.025, 0.45, 1300, 1050), (0.062, 0.047, 75, 840), (0.24, 2.035, 2100, 920)),
        _stack((0.024, 0.07834934897, 0, 0)),
        _stack((0.24, 0.56, 1300, 1050)),
        _stack((0.04, 0.14, 700, 2520)),
        _stack((0.15, 2.035, 2400, 1050), (0.012, 0.06, 50, 840), (0.045, 1.4, 2200, 1050), (0.002, 0.21, 1300, 1470)),
    ),
    "L": (
        _stack((0.01, 0.14, 500, 2520), (0.064, 0.047, 75, 840), (0.01, 0.14, 500, 2520)),
        _stack((0.024, 0.07834934897, 0, 0)),
        _stack((0.12, 0.4, 1200, 1050)),
        _stack((0.04, 0.14, 500, 2520)),
        _stack(
            (0.001, 58.0, 7800, 480),
            (0.02, 0.047, 75, 840),
            (0.2, 1.085, 1, 1200),
            (0.12, 2.035, 2100, 920),
            (0.02, 0.047, 75, 840),
            (0.03, 1.4, 2200, 1050),
        ),
    ),
}


@dataclass(frozen=True, slots=True)
class TwoCapacities:
    """A room by the norm's parameters: resistances [K/W] and capacities [J/K]."""

    outer_area: float  # [m2], with windows
    outer: tuple[float, float, float]  # rest to outdoors, inside, capacity
    inner_area: float
    inner: tuple[float, float]
    films: tuple[float, float] = (2.7, 2.24)  # inside, of outer and of inner walls [W/(m2 K)]
    outer_film: float = OUTER_FILM

    def surfaces(self) -> tuple[OpaqueSurface, ...]:
        """Outer and inner walls; the inner ones lie flat, so that each has a film of its own."""
        rest, inside, capacity = self.outer
        outer = (
            _resistance(rest * self.outer_area),
            _capacity(capacity / self.outer_area),
            _resistance(inside * self.outer_area),
        )
        r, c = self.inner
        inner = (_capacity(c / self.inner_area), _resistance(r * self.inner_area))
        return (
            _surface("outer", self.outer_area, outer, SOUTH, "outdoor"),
            _surface("inner", self.inner_area, inner, UP, "adiabatic"),
        )


S = TwoCapacities(10.5, (0.03895919557, 0.00436791293674, 1600848.94), 75.5, (0.000595693407511, 14836354.6282))
L = TwoCapacities(10.5, (0.039330865, 0.00404935160802, 47900.0), 75.5, (0.003237138, 7297100.0))
CORNER = TwoCapacities(
    25.5, (0.01913729904, 0.0017362530106, 5259932.23), 60.5, (0.000668895639141, 12391363.8631), (2.7, 2.12)
)
OVER_CELLAR = TwoCapacities(
    28.0,
    (0.011638548, 0.00171957697767797, 4338751.41),
    58.0,
    (0.000779671554640369, 12333949.4129606),
    (2.4, 2.398),
    9.75,
)


@dataclass(frozen=True, slots=True)
class Case:
    """Loads and surroundings of a case; profiles [24] of a day."""

    room: TwoCapacities
    convective: FloatArray = field(default_factory=lambda: np.zeros(24))  # [W]
    radiant: FloatArray = field(default_factory=lambda: np.zeros(24))
    outdoor: FloatArray = field(default_factory=lambda: np.full(24, 22.0))  # equivalent [degC]
    sun: FloatArray = field(default_factory=lambda: np.zeros((0, 24)))  # by facade [W/m2]
    loads: IdealLoads = field(default_factory=IdealLoads)
    air_m3_h: FloatArray = field(default_factory=lambda: np.zeros(24))
    start_c: float = 22.0


def _resistance(value: float) -> Layer:
    return Layer(0.01, 0.01 / value, 0.0, 0.0)


def _capacity(value: float) -> Layer:
    return Layer(THIN, 500.0, value / (THIN * 1e4), 1e4)


def _surface(
    name: str, area: float, layers: tuple[Layer, ...], normal: FloatArray, outside: str, partner: str = ""
) -> OpaqueSurface:
    """A black face inside, and no longwave exchange outdoors beside the film."""
    return OpaqueSurface(name, area, layers, normal, outside, partner, emissivity_in=1.0, emissivity_out=0.0)


def cases() -> dict[int, Case]:
    """The norm's twelve cases."""
    day = _hours(6, 18)
    machines, used = 1000.0 * day, _hours(7, 17)
    people = {"convective": 280.0 * used, "radiant": 80.0 * used, "outdoor": OUTDOOR}
    held = 22.0 + 5.0 * day
    free = IdealLoads(held, held)
    limited = replace(free, heating_limit=500.0, cooling_limit=500.0)
    fifth = Case(S, sun=SUN[:1], **people)
    eighth = replace(fifth, room=CORNER, sun=SUN, outdoor=_outdoors(OUTDOOR))
    return {
        1: Case(S, convective=machines),
        2: Case(S, radiant=machines),
        3: Case(L, convective=machines),
        4: Case(L, radiant=machines),
        5: fifth,
        6: Case(S, radiant=machines, loads=free),
        7: Case(S, radiant=machines, loads=limited),
        8: eighth,
        9: replace(eighth, outdoor=_outdoors(OUTDOOR, SKY)),
        10: replace(fifth, room=OVER_CELLAR, start_c=17.6, outdoor=OUTDOOR + 0.6291235190524047 * (15.0 - OUTDOOR)),
        11: Case(
            replace(S, films=(2.7, 3.0)),
            radiant=machines,
            loads=replace(limited, cooling_radiant=1.0, cooling_surface="inner"),
        ),
        12: replace(fifth, air_m3_h=np.where(used > 0, 50.0, 100.0)),
    }


def _hours(start: int, end: int) -> FloatArray:
    hour = np.arange(24)
    return ((hour >= start) & (hour < end)).astype(float)


def _outdoors(outdoor: FloatArray, sky: FloatArray | None = None) -> FloatArray:
    """The norm's equivalent temperature of the corner room's walls and windows [24]."""
    longwave = np.zeros(24)
    if sky is not None:
        longwave = (65.99081593 * sky**0.25 - KELVIN - outdoor) * RADIATION / OUTER_FILM
    walls, glass = (0.05796831135677373, 0.13249899738691134), 0.4047663456281575
    total = np.array(outdoor)
    for share, sun, behind in zip(walls, WALL_SUN, SUN, strict=True):
        total += share * (longwave + WALL_ABSORPTANCE * sun / OUTER_FILM)
        closed = behind > BLIND_ABOVE
        total += glass * longwave * np.where(closed, BLIND, 1.0)
    return total


def run(case: Case, surfaces: tuple[OpaqueSurface, ...] | None = None, *, rows_h: int = ROWS_H) -> ZoneResult:
    """60 days of a case from its start; surfaces: other walls than its own; rows_h: of an hour."""
    rows = DAYS * 24 * rows_h
    faces = case.room.surfaces() if surfaces is None else surfaces

    def profile(day: FloatArray) -> FloatArray:
        return np.resize(np.repeat(day, rows_h), rows)

    outdoor = profile(case.outdoor)
    # the mass flow of the norm's air, 1.189 kg/m3, that a volume flow of ours has
    pressure = 0.000330375898 * 3600.0 * 1005.0 / AIR_HEAT * AIR_GAS_CONSTANT * (outdoor + KELVIN)
    climate = Climate(outdoor, outdoor, np.zeros(rows), np.zeros(rows), np.full(rows, 10.0), np.full(rows, pressure))
    loads = case.loads
    if np.ndim(loads.heating_c):
        held = profile(np.asarray(loads.heating_c))
        loads = replace(loads, heating_c=held, cooling_c=held)
    volume = 52.5
    to_air, walls = _sun(case, np.array([face.area for face in faces]))
    zone = Zone(
        "room",
        volume,
        faces,
        infiltration_ach=0.0,
        loads=loads,
        air_capacity_factor=0.0,
        other_air_ach=profile(case.air_m3_h) / volume,
        gains=Gains(profile(case.convective + to_air), profile(case.radiant)),
    )
    upright, flat = case.room.films
    options = BalanceOptions(
        inside_convection="stated",
        inside_films=(upright, flat, flat),
        inside_radiation=RADIATION,
        outside_convection="constant",
        outside_film=case.room.outer_film,
        warm_days=0,
        start_c=case.start_c,
        tolerance=1e-6,
        iterations=20,
    )
    none, inside = np.zeros((rows, 0)), np.stack([profile(column) for column in walls.T], axis=1)
    solar = Solar(none, none, inside, np.zeros_like(inside))
    return simulate(zone, climate, solar, step_s=60.0, row_s=3600.0 / rows_h, options=options)


def _sun(case: Case, areas: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sun [24] of the glass that warms the air, and [24, F] all walls but those of its facade."""
    air, walls = np.zeros(24), np.zeros((24, len(areas)))
    for sun, facade in zip(case.sun, FACADES[len(case.sun)], strict=True):
        passed = GLASS * np.where(sun > BLIND_ABOVE, BLIND, 1.0) * sun
        air += SUN_TO_AIR * passed
        lit = areas - np.where(np.arange(len(areas)) == 0, facade or areas[0], 0.0)
        walls += (1.0 - SUN_TO_AIR) * passed[:, None] * lit / lit.sum()
    return air, walls


def published() -> pd.DataFrame:
    """The norm's results by hour of the end, a column for each case [degC] or [W]."""
    table = pd.read_csv(RESULTS, index_col="hour")
    return table.rename(columns=int)


def hourly(number: int, year: ZoneResult) -> FloatArray:
    """Our hourly means [H] of what the case asks for: air [degC], or the power [W]."""
    values = year.heating - year.cooling if number in POWER else year.air_c
    return values.reshape(-1, ROWS_H).mean(axis=1)


def apart(number: int, hours: FloatArray) -> FloatArray:
    """Our hourly means [H] less the norm's results in its hours [72]."""
    results = published()[number]
    return hours[results.index.to_numpy() - 1] - results.to_numpy()


def as_the_library(cooled: ZoneResult) -> FloatArray:
    """Hourly powers [H] of the cooled ceiling, in rows of a minute, as the library checks them."""
    power = cooled.heating - cooled.cooling
    (turned,) = np.nonzero((power[1:] < 0.0) & (power[:-1] > 0.0) & (power[1:] > -400.0))
    for minute in turned + 1:
        power[minute : minute + SUBSTITUTED] = SUBSTITUTE
    return power.reshape(-1, 60).mean(axis=1)


def layered(name: str) -> tuple[OpaqueSurface, ...]:
    """The walls of room S or L, layer by layer; the slab's other face is that of its equal."""
    facade, window, inner, door, slab = LAYERED[name]
    back = np.array([0.0, 1.0, 0.0])
    return (
        _surface("facade", 3.5, facade, SOUTH, "outdoor"),
        _surface("window", 7.0, window, SOUTH, "outdoor"),
        _surface("walls", 38.5, inner, back, "twin"),
        _surface("door", 2.0, door, back, "twin"),
        _surface("floor", 17.5, slab, -UP, "room", "ceiling"),
        _surface("ceiling", 17.5, tuple(reversed(slab)), UP, "room", "floor"),
    )


def _row(number: int, walls: str, hours: FloatArray) -> dict[str, object]:
    unit = "W" if number in POWER else "K"
    difference = apart(number, hours)
    outside = int(np.sum(np.abs(difference) > TOLERANCE[unit] + 1e-9))
    return {
        "case": number,
        "walls": walls,
        "unit": unit,
        "largest": float(np.max(np.abs(difference))),
        "mean": float(difference.mean()),
        "RMS": float(np.sqrt(np.mean(difference**2))),
        "hours outside": outside,
    }


def main() -> dict[str, pd.DataFrame]:
    """Every case with the norm's two capacities, and rooms S and L by their layers."""
    rows = [_row(n, "two capacities", hourly(n, run(case))) for n, case in cases().items()]
    cooled = as_the_library(run(cases()[COOLED], rows_h=60))
    rows.append(_row(COOLED, "two capacities, checked as that library", cooled))
    for number, name in ((1, "S"), (2, "S"), (3, "L"), (4, "L")):
        case = replace(cases()[number], room=replace(cases()[number].room, films=(2.7, 1.7)))
        rows.append(_row(number, "layers", hourly(number, run(case, layered(name)))))
    return {"Cases": pd.DataFrame(rows)}
