"""Choice of a daylight method and a glare metric, by measured errors and by time.

- Specular surfaces in the room are outside of what eDGP and sDGP assume, and the phase methods'
  direct sun does not know their reflections: full DGP by point-in-time paths, whatever it takes.
  (The rule of the dissertation's 3.2.8.  Our tracer knows no mirrors in a room either, and the
  reason says so.)
- Otherwise a method within the limits of error and time; of these the most accurate, of equals the
  quickest, with full DGP where its time is about equal.  Errors are those measured for similar
  systems, see `scenes.calibration.errors`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scenes.calibration.costs import Calibration, Workload
from scenes.calibration.durations import spoken_time
from scenes.calibration.errors import Pair

EQUAL = 0.011  # errors that differ by less are equal: they are known to a per cent at best
SLACK = 1.25  # times that differ by less are equal: then full DGP, which assumes least
SPECULAR = ("point-in-time", "DGP")


@dataclass(frozen=True, slots=True)
class Demand:
    """What is asked for."""

    work: Workload
    time_budget: float  # [s]
    dgp_error: float  # relative
    errors: Mapping[Pair, float]  # expected of each method and metric, relative
    specular: bool = False  # a surface of a room mirrors
    origin: str = ""  # of the errors, in words


@dataclass(frozen=True, slots=True)
class MethodChoice:
    """A method, a glare metric, and the reason in a sentence or two."""

    method: str
    metric: str
    seconds: float  # predicted
    error: float  # expected, relative
    why: str


def choose(demand: Demand, calibration: Calibration) -> MethodChoice:
    """The method and metric for a demand on the machine of a calibration.

    Where nothing meets both the error and the time, the nearest that the time allows is taken, or
    else the quickest; the reason says so.
    """
    seconds = {pair: calibration.seconds(*pair, demand.work) for pair in calibration.pairs()}
    if demand.specular:
        return _choice(SPECULAR, seconds, demand, "a surface of the room mirrors, which eDGP, sDGP "
                       "and the phase methods do not cover: full pictures by paths (the mirror "
                       "itself is not traced: every surface of a room is diffuse)")  # fmt: skip
    known = {pair: s for pair, s in seconds.items() if pair in demand.errors}
    near = {pair for pair in known if demand.errors[pair] <= demand.dgp_error}
    quick = {pair for pair in known if known[pair] <= demand.time_budget}
    if near & quick:
        allowed, words = near & quick, f"{len(near & quick)} of {len(known)} meet error and time"
    elif quick:
        allowed, words = quick, "none within the time is near enough: the nearest that is"
    else:
        quickest = min(known, key=known.get)
        allowed, words = {quickest}, "none is quick enough: the quickest"
    best = min(demand.errors[pair] for pair in allowed)
    equals = [pair for pair in allowed if demand.errors[pair] < best + EQUAL]
    least = SLACK * min(known[pair] for pair in equals)
    equals = [pair for pair in equals if known[pair] <= least]
    taken = min(equals, key=lambda pair: (pair[1] != "DGP", known[pair]))
    return _choice(taken, seconds, demand, words)


def _choice(pair, seconds: dict[str, Any], demand: Demand, words: str) -> MethodChoice:
    method, metric = pair
    time, error = seconds[pair], demand.errors[pair]
    why = (
        f"{words}; expected error of DGP {100 * error:.2g} % (asked {100 * demand.dgp_error:.0f} %)"
        f", predicted {spoken_time(time)} (budget {spoken_time(demand.time_budget)}) for "
        f"{demand.work.scenes} room(s) x {demand.work.systems} system(s) x "
        f"{demand.work.steps} steps"
    )
    if time > demand.time_budget:
        why += "; OVER the time budget"
    if error > demand.dgp_error:
        why += "; NOT the error asked for"
    if demand.origin:
        why += f"; {demand.origin}"
    return MethodChoice(method, metric, time, error, why)
