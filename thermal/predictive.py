"""States of a zone's windows that cost least over the hours ahead: a dynamic programme.

The state of the programme is the temperature of the mass of a `ReducedZone`, on a grid.  In each
hour a combination of window states costs its lamps, heating and cooling, and a penalty:

    V_t(T) = min over m of  [ w_l lamps + w_h heating + w_c cooling + penalty ](t, m, T) + V_t+1(T')

With a cost of moves c the combination m before is part of the programme's state, and V_t(T, m) the
least over m' of the above for m' plus c for each group whose state differs: found group by group.

The horizon recedes: of each plan only its first hour is carried out.  A horizon of the whole year
is one plan with perfect foresight.

Source: Bellman 1957, Dynamic Programming; EN ISO 13790:2008, annex C.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.compiled import compiled
from thermal.reduced import ReducedZone, responses
from thermal.zone import Dimming, lamp_share

FloatArray = NDArray[np.float64]
AT_A_TIME = 256  # forecasts whose errors are drawn together
COLDEST_C, WARMEST_C, STEPS = 5.0, 45.0, 41  # grid of the mass


@dataclass(frozen=True, slots=True)
class PredictedHours:
    """What acts on a zone in the hours of a year, in M combinations of window states."""

    sun: FloatArray  # [H, M] absorbed indoors [W]
    daylight: FloatArray  # [H, M, Z] at the sensors of the lamps' zones [lx]
    lamps: FloatArray  # [H] full power [W]
    zones: tuple[tuple[float, Dimming | None], ...]  # [Z] share of the lamps; dimmed by the daylight, None: not
    internal: FloatArray  # [H] other heat indoors [W]
    penalty: FloatArray  # [H, M] [Wh] of glare, or of a preference
    counts: tuple[int, ...] = ()  # [N] states of the groups, whose product is M; the last is fast
    move_wh: float = 0.0  # cost of the move of a group [Wh]


@dataclass(frozen=True, slots=True)
class Forecast:
    """How the hours ahead are known, besides the present one."""

    shift: int = 0  # hours: what acted so long ago is expected again; 0: what will come
    # [H, N] factor of sun and daylight, N hours ahead; None: 1; one row for one plan of the year
    sun: NDArray[np.floating] | None = None
    warmer_k: NDArray[np.floating] | None = None  # [H, N] added to the outdoor temperature


@dataclass(frozen=True, slots=True)
class PredictedYear:
    """The states that a plan carries out, and the loads by the reduced model."""

    states: NDArray[np.int64]  # [H] numbers of combinations
    heating: FloatArray  # [H] [W]
    cooling: FloatArray  # [H] [W]
    lamps: FloatArray  # [H] [W]


def noisy_forecast(hours: int, ahead: int, *, sun_error: float, temperature_error_k: float, seed: int = 0) -> Forecast:
    """A forecast whose error grows with the square root of the hours ahead to its value at 24 h.

    Errors of one forecast are a random walk, of two forecasts independent.

    Args:
        sun_error: relative standard deviation of sun and daylight; temperature_error_k: of the
            outdoor temperature [K].
    """
    random = np.random.default_rng(seed)
    made = 1 if ahead >= hours else hours  # forecasts: a plan of the whole year is made once
    walks = np.zeros((2, made, ahead), dtype=np.float32)
    for quantity in range(2):
        for start in range(0, made, AT_A_TIME):
            some = slice(start, min(start + AT_A_TIME, made))
            steps = random.standard_normal((some.stop - start, ahead)).cumsum(axis=1)
            walks[quantity, some] = (steps - steps[:, :1]) / np.sqrt(24.0)  # the first is measured
    walks[0] = np.maximum(1.0 + sun_error * walks[0], 0.0)
    walks[1] *= temperature_error_k
    return Forecast(0, *walks)


def predicted_year(
    zone: ReducedZone,
    hours: PredictedHours,
    *,
    ahead: int = 24,
    forecast: Forecast | None = None,
    weights: tuple[float, float, float] = (1.0, 1.0, 1.0),
    start_c: float = 20.0,
) -> PredictedYear:
    """The year of a zone whose window states are those of the cheapest plan in each hour.

    Args:
        ahead: hours that are planned, the present one with them; all hours of the year: one plan.
        weights: of heating, cooling and lamps.
        start_c: temperature of the mass at the beginning.
    """
    count = len(hours.lamps)
    forecast = forecast or Forecast()
    once = ahead >= count
    none = np.zeros((1, 1), dtype=np.float32)
    counts = hours.counts if hours.move_wh > 0 else ()
    result = np.zeros((count, 4))
    _run(
        np.array(
            [
                zone.opaque,
                zone.mass,
                zone.mass_area,
                zone.area,
                zone.heating_limit,
                zone.cooling_limit,
                *weights,
                start_c,
            ]
        ),
        np.array([(share, one is not None, *(one or Dimming(1.0)).numbers) for share, one in hours.zones]),
        zone.windows,
        zone.air,
        zone.outdoor_c,
        zone.behind_c,
        zone.heating_c,
        zone.cooling_c,
        hours.sun,
        hours.daylight,
        hours.lamps,
        hours.internal,
        hours.penalty,
        count if once else max(ahead, 1),
        once,
        forecast.shift,
        none + 1 if forecast.sun is None else forecast.sun,
        none if forecast.warmer_k is None else forecast.warmer_k,
        np.array(counts or (1,), dtype=np.int64),
        hours.move_wh if counts else 0.0,
        result,
    )
    return PredictedYear(result[:, 0].astype(np.int64), *result[:, 1:].T)


_lamp_share = compiled()(lamp_share)


@compiled()
def _hour(
    constants: NDArray[np.float64],
    zones: NDArray[np.float64],
    windows: float,
    air: float,
    outdoor_c: float,
    behind_c: float,
    sun: float,
    daylight: NDArray[np.float64],
    scale: float,
    lamps: float,
    internal: float,
    out: NDArray[np.float64],
) -> float:
    """Write the `responses` of a combination into out [6]; returns the power of its lamps.

    Args: zones: [Z, 7] of the lamps: share, whether dimmed, `Dimming.numbers`; scale: of the daylight.
    """
    share = 0.0
    for z in range(len(zones)):
        of, dims, needed, read, least_light, least_power, off = zones[z]
        share += of * (_lamp_share(scale * daylight[z], needed, read, least_light, least_power, off) if dims else 1.0)
    lamps *= share
    responses(
        air,
        windows,
        constants[0],
        constants[1],
        constants[2],
        constants[3],
        outdoor_c,
        behind_c,
        internal + lamps,
        sun,
        out,
    )
    return lamps


@compiled()
def _power(mass_c: float, out: NDArray[np.float64], low: float, high: float, constants: NDArray[np.float64]) -> float:
    """Power of heating, negative of cooling, that holds the set points [W]."""
    free = out[0] + out[1] * mass_c
    if free < low:
        return min((low - free) / out[2], constants[4])
    if free > high:
        return max((high - free) / out[2], -constants[5])
    return 0.0


@compiled()
def _value(values: NDArray[np.float64], mass_c: float) -> float:
    """Value at a temperature of the mass, linear between those of the grid."""
    step = (WARMEST_C - COLDEST_C) / (STEPS - 1)
    place = (mass_c - COLDEST_C) / step
    first = min(max(int(np.floor(place)), 0), STEPS - 2)
    share = place - first
    return values[first] * (1.0 - share) + values[first + 1] * share


@compiled()
def _moved(values: NDArray[np.float64], counts: NDArray[np.int64], move: float) -> None:
    """Write the least value after moves into values [M, K]: of each group in its turn."""
    M, K = values.shape
    stride = M
    for count in counts:
        stride //= count
        for first in range(M):
            if (first // stride) % count != 0:
                continue
            for k in range(K):
                least = np.inf
                for j in range(count):
                    least = min(least, values[first + j * stride, k])
                for j in range(count):
                    here = first + j * stride
                    values[here, k] = min(values[here, k], least + move)


@compiled()
def _groups_apart(a: int, b: int, counts: NDArray[np.int64]) -> int:
    """Number of groups whose states differ in two combinations."""
    apart, stride = 0, 1
    for n in range(len(counts) - 1, -1, -1):
        apart += (a // stride) % counts[n] != (b // stride) % counts[n]
        stride *= counts[n]
    return apart


@compiled()
def _run(
    constants: NDArray[np.float64],
    zones: NDArray[np.float64],
    windows: NDArray[np.float64],
    air: NDArray[np.float64],
    outdoor_c: NDArray[np.float64],
    behind_c: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    sun: NDArray[np.float64],
    daylight: NDArray[np.float64],
    lamps: NDArray[np.float64],
    internal: NDArray[np.float64],
    penalty: NDArray[np.float64],
    ahead: int,
    once: bool,
    shift: int,
    factor: NDArray[np.float32],
    warmer: NDArray[np.float32],
    counts: NDArray[np.int64],
    move: float,
    result: NDArray[np.float64],
) -> None:
    """Carry out the plans of the year: state, heating, cooling and lamps into result [H, 4]."""
    H, M = sun.shape
    step = (WARMEST_C - COLDEST_C) / (STEPS - 1)
    out, mass_c = np.zeros(6), constants[9]
    kinds = M if move > 0.0 else 1  # combinations in the hour before that count
    kept = np.zeros((H + 1 if once else ahead + 1, kinds, STEPS))
    last_m = 0
    for hour in range(H):
        if not once or hour == 0:
            last = H - 1 if once else ahead - 1
            kept[last + 1] = 0.0
            for t in range(last, 0, -1):
                at = (hour + t) % H
                known = (at - shift) % H
                row = min(hour, factor.shape[0] - 1)
                scale = factor[row, t] if factor.shape[1] > 1 else 1.0
                more = warmer[row, t] if warmer.shape[1] > 1 else 0.0
                kept[t] = np.inf
                for m in range(M):
                    lit = _hour(
                        constants,
                        zones,
                        windows[m],
                        air[at],
                        outdoor_c[known] + more,
                        behind_c[known] + more,
                        scale * sun[known, m],
                        daylight[known, m],
                        scale,
                        lamps[at],
                        internal[at],
                        out,
                    )
                    base = constants[8] * lit + penalty[at if shift == 0 else known, m]
                    kind = m if kinds > 1 else 0
                    for k in range(STEPS):
                        temperature = COLDEST_C + k * step
                        power = _power(temperature, out, low[at], high[at], constants)
                        cost = constants[6] * power if power > 0 else -constants[7] * power
                        after = out[3] + out[4] * temperature + out[5] * power
                        cost += base + _value(kept[t + 1, kind], after)
                        if cost < kept[t, kind, k]:
                            kept[t, kind, k] = cost
                if kinds > 1:
                    _moved(kept[t], counts, move)
        best, best_after = np.inf, mass_c
        ahead_values = kept[hour + 1] if once else kept[1]
        best_m = 0
        for m in range(M):
            lit = _hour(
                constants,
                zones,
                windows[m],
                air[hour],
                outdoor_c[hour],
                behind_c[hour],
                sun[hour, m],
                daylight[hour, m],
                1.0,
                lamps[hour],
                internal[hour],
                out,
            )
            power = _power(mass_c, out, low[hour], high[hour], constants)
            cost = constants[6] * power if power > 0 else -constants[7] * power
            after = out[3] + out[4] * mass_c + out[5] * power
            kind = m if kinds > 1 else 0
            cost += constants[8] * lit + penalty[hour, m] + _value(ahead_values[kind], after)
            if kinds > 1:
                cost += move * _groups_apart(last_m, m, counts)
            if cost < best:
                best, best_after, best_m = cost, after, m
                result[hour, 0] = m
                result[hour, 1], result[hour, 2] = max(power, 0.0), max(-power, 0.0)
                result[hour, 3] = lit
        mass_c, last_m = best_after, best_m
