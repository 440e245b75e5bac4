"""Manual behaviour at blinds: published models of when people lower and raise them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.control import StateArray

FloatArray = NDArray[np.float64]
DIRECT_SUN = 50.0  # [W/m2] on the work place: Reinhart 2004
SUBSTEPS = 12  # of an hour: the models of Haldi and Robinson are of five minutes
# Haldi and Robinson 2010, lower blinds: constant, per lux indoors, per unshaded share
LOWER_ON_ARRIVAL = -7.41, 1.035e-3, 2.17
RAISE_ON_ARRIVAL = -1.520, -6.54e-4, -3.139
LOWER_DURING_PRESENCE = -8.013, 8.41e-4, 1.270
RAISE_DURING_PRESENCE = -3.625, -2.76e-4, -2.683
# whether a lowering, a raising is complete: constant, per lux outdoors, per unshaded share
LOWER_WHOLLY = -0.27, 0.91e-6, -2.23
RAISE_WHOLLY = 0.435, -2.31e-5, 1.95
PART = -2.294, 1.522, 1.708  # Weibull: log of the scale, per unshaded share, shape


def arrivals(present: ArrayLike, day: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Rows [H] in which the first people of a day come.

    Args: day: [H] number of the day of each row.
    """
    there = np.asarray(present, dtype=float) > 0
    first = np.zeros(len(there), dtype=bool)
    rows = np.flatnonzero(there)
    first[rows[np.unique(day[rows], return_index=True)[1]]] = True
    return first


def lightswitch_2002(
    direct_sun: ArrayLike, present: ArrayLike, day: NDArray[np.int64], *, closed: int = 1
) -> StateArray:
    """States [H] of a blind of Lightswitch-2002's active user.

    It is raised once a day, by those who come first, and lowered whenever people are there and
    direct sun above 50 W/m2 meets the work place; it stays lowered until the next morning.
    (Its passive user keeps it lowered all year: `always`.)

    Args: direct_sun: [H] irradiance of the work place straight from the sun, behind the open window
        [W/m2]; present: [H] share of people; day: [H] number of the day; closed: the lowered state.

    Source: Reinhart 2004, Solar Energy 77(1), "Lightswitch-2002", section 2.3, from memory and from
    its users' descriptions: the paper was not available.
    """
    sun, there = np.asarray(direct_sun, dtype=float), np.asarray(present, dtype=float) > 0
    first = arrivals(there, day)
    states, lowered = np.zeros(len(sun), dtype=np.int64), False
    for row in range(len(sun)):
        lowered = (lowered and not first[row]) or bool(there[row] and sun[row] > DIRECT_SUN)
        states[row] = closed if lowered else 0
    return states


def haldi_robinson_2010(
    indoors_lx: Callable[[int, FloatArray], float],
    outdoors_lx: ArrayLike,
    present: ArrayLike,
    *,
    blinds: int,
    substeps: int = SUBSTEPS,
    seed: int | tuple[int, ...] = 0,
) -> FloatArray:
    """Mean unshaded share of each blind of a room in every hour [H, N].

    A Markov chain in steps of five minutes while people are there: p = 1/(1 + exp(-(a + b_in E_in +
    b_L L))) that a blind of unshaded share L is lowered, and that it is raised; those of arrival in
    the first step.  A lowering is complete with p(a + b_out E_out + b_L L), else by a share from a
    Weibull distribution of scale exp(-2.294 + 1.522 L) and shape 1.708; a raising that is not
    complete ends anywhere above.  The more probable action is drawn first.

    Args:
        indoors_lx: illuminance of the work plane in an hour with unshaded shares [N] [lx].
        outdoors_lx: [H] horizontal, without obstructions [lx].
        present: [H] share of people.

    Source: Haldi and Robinson 2010, Journal of Building Performance Simulation 3(2) 135-153, by its
    constants in No-MASS (github.com/gitkw/No-MASS), whose b_out and b_L of complete moves are
    exchanged there; the paper was not available.  Deviation: all blinds of a room read one sensor.
    """
    random = np.random.default_rng(seed)
    there, outdoors = np.asarray(present, dtype=float) > 0, np.asarray(outdoors_lx, dtype=float)
    open_share, result = np.ones(blinds), np.ones((len(there), blinds))
    for hour in range(len(there)):
        if not there[hour]:
            result[hour] = open_share
            continue
        came = hour == 0 or not there[hour - 1]
        total = np.zeros(blinds)
        lit, before = indoors_lx(hour, open_share), open_share.copy()
        for step in range(substeps):
            arriving = came and step == 0
            if not np.array_equal(before, open_share):
                lit, before = indoors_lx(hour, open_share), open_share.copy()
            draws = random.random((blinds, 4))
            for n in range(blinds):
                open_share[n] = _moved(open_share[n], lit, outdoors[hour], arriving, draws[n])
            total += open_share
        result[hour] = total / substeps
    return result


def _moved(share: float, indoors_lx: float, outdoors_lx: float, arriving: bool, draws: FloatArray) -> float:
    """The unshaded share of a blind after a step; draws: [4] even random numbers."""
    lowers = LOWER_ON_ARRIVAL if arriving else LOWER_DURING_PRESENCE
    raises = RAISE_ON_ARRIVAL if arriving else RAISE_DURING_PRESENCE
    down = _probability(lowers, indoors_lx, share) if share > 0 else 0.0
    up = _probability(raises, indoors_lx, share) if share < 1 else 0.0
    order = ((down, True), (up, False)) if down >= up else ((up, False), (down, True))
    for draw, (probability, lowered) in zip(draws, order, strict=False):
        if draw < probability:
            return _new_share(share, outdoors_lx, lowered, draws[2], draws[3])
    return share


def _new_share(share: float, outdoors_lx: float, lowered: bool, draw: float, second: float) -> float:
    if draw < _probability(LOWER_WHOLLY if lowered else RAISE_WHOLLY, outdoors_lx, share):
        return 0.0 if lowered else 1.0
    if not lowered:
        return float(share + second * (1.0 - share))
    scale, slope, shape = PART
    part = np.exp(scale + slope * share) * (-np.log1p(-second)) ** (1.0 / shape)
    return float(max(share - part, 0.0))


def _probability(constants: tuple[float, float, float], lux: float, share: float) -> float:
    a, per_lux, per_share = constants
    return float(1.0 / (1.0 + np.exp(-(a + per_lux * lux + per_share * share))))
