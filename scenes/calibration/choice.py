"""Which method and which glare metric to take: the rules of the dissertation's 3.2.8 and a clock.

- Specular surfaces in the room are outside of what eDGP and sDGP assume, and the phase methods'
  direct sun does not know their reflections: full DGP by point-in-time paths, whatever it takes.
  (Its rule.  Our tracer knows no mirrors in a room either, and the reason says so.)
- The three-phase method only where nothing finer than a Klems matrix that blurs the sun is known.
- Otherwise what is near enough and quick enough; of these the nearest, of equals the quickest, with
  full DGP where it costs no more.  With the dissertation's costs many time steps lead to the
  five-phase method with full DGP and few to point-in-time with eDGP, as it says.
"""

from __future__ import annotations

from dataclasses import dataclass

from scenes.calibration.costs import Calibration, Workload
from scenes.calibration.durations import spoken_time

# Relative root mean square error of DGP against measurement: the dissertation's Table 13
ERRORS = {
    ("three-phase", "DGP"): 0.23,
    ("three-phase", "eDGP"): 0.25,
    ("three-phase", "sDGP"): 0.26,
    ("five-phase", "DGP"): 0.11,
    ("five-phase", "eDGP"): 0.10,
    ("five-phase", "sDGP"): 0.16,
    ("point-in-time", "DGP"): 0.11,
    ("point-in-time", "eDGP"): 0.10,
    ("point-in-time", "sDGP"): 0.15,
}
EQUAL = 0.011  # errors that differ by less are equal: the table has whole per cents
SLACK = 1.25  # times that differ by less are equal: then full DGP, which assumes least
BLURRED, SPECULAR = ("three-phase",), ("point-in-time", "DGP")


@dataclass(frozen=True, slots=True)
class Demand:
    """What is asked for."""

    work: Workload
    time_budget: float  # [s]
    dgp_error: float  # relative
    fine: bool  # every system has a tensor tree, or a matrix with its straight beam apart
    specular: bool  # a surface of a room mirrors


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
    known = {pair: s for pair, s in seconds.items() if demand.fine or pair[0] in BLURRED}
    data = "" if demand.fine else "a system has only a Klems matrix that blurs the sun; "
    near = {pair for pair in known if ERRORS[pair] <= demand.dgp_error}
    quick = {pair for pair in known if known[pair] <= demand.time_budget}
    if near & quick:
        allowed, words = near & quick, f"{len(near & quick)} of {len(known)} meet error and time"
    elif quick:
        allowed, words = quick, "none within the time is near enough: the nearest that is"
    else:
        quickest = min(known, key=known.get)
        allowed, words = {quickest}, "none is quick enough: the quickest"
    best = min(ERRORS[pair] for pair in allowed)
    equals = [pair for pair in allowed if ERRORS[pair] < best + EQUAL]
    least = SLACK * min(known[pair] for pair in equals)
    equals = [pair for pair in equals if known[pair] <= least]
    taken = min(equals, key=lambda pair: (pair[1] != "DGP", known[pair]))
    return _choice(taken, seconds, demand, data + words)


def _choice(pair, seconds: dict, demand: Demand, words: str) -> MethodChoice:
    method, metric = pair
    time, error = seconds[pair], ERRORS[pair]
    why = (
        f"{words}; expected error of DGP {100 * error:.0f} % (asked {100 * demand.dgp_error:.0f} %)"
        f", predicted {spoken_time(time)} (budget {spoken_time(demand.time_budget)}) for "
        f"{demand.work.scenes} room(s) x {demand.work.systems} system(s) x "
        f"{demand.work.steps} steps"
    )
    if time > demand.time_budget:
        why += "; OVER the time budget"
    if error > demand.dgp_error:
        why += "; NOT the error asked for"
    return MethodChoice(method, metric, time, error, why)
