"""Search for the best points of a space, by few evaluations.

The surrogate is a Gaussian process (scikit-learn; Matern 5/2 with a length for each variable) of
the objective, and one for each limit.  Its lengths are the most probable ones, by the likelihood and a
prior: by the likelihood alone, which a dozen points hardly determine, a limit seems known where it is not, and
the search stays away from the best points that meet it.  The next point has the greatest expected improvement times
the probability that all limits are met.  Several objectives are made one by the augmented
Chebyshev sum with weights that change from point to point (ParEGO).  Everything follows from the
seed.

Source: Jones, Schonlau, Welch 1998, doi:10.1023/A:1008306431147 (expected improvement); Gardner et
    al. 2014, "Bayesian optimization with inequality constraints"; Knowles 2006,
    doi:10.1109/TEVC.2005.851274 (ParEGO); Hvarfner, Hellsten, Nardi 2024, "Vanilla Bayesian optimization
    performs great in high dimensions" (prior of the lengths, by the number of features).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import ndtr
from scipy.stats import qmc

FloatArray = NDArray[np.float64]
Point = tuple[float | int, ...]  # of each variable: the number of its option, or a number
MOST_CANDIDATES = 4000  # points whose expected improvement is computed for the next evaluation
ALWAYS_FITTED = 60  # points up to which the lengths are fitted for each further one
REFITTED = 1.15  # from there on, growth of the number of points after which they are fitted again
LENGTH_PRIOR = np.sqrt(2.0), np.sqrt(3.0)  # mean without log(features) / 2 and deviation of a length's logarithm
AMPLITUDE_PRIOR = 0.0, 1.0  # of the logarithm of the variance, over that of the values
NOISE_PRIOR = float(np.log(1e-4)), 2.0  # of the logarithm of the noise's variance, likewise
FIRST_LENGTHS = 0.7, 0.5  # from which the most probable ones are looked for
BEST = 10  # points near which others are looked for
AUGMENTED = 0.05  # of the sum, beside the greatest of the weighted objectives
TRIED = 50  # points at random for each one that is wanted
FIRST = 2  # evaluations per variable before the first surrogate


@dataclass(frozen=True, slots=True)
class Axis:
    """A variable of a space."""

    options: int  # how many; 0: any number from low to high
    low: float = 0.0
    high: float = 1.0
    scale: tuple[float, ...] = ()  # of ordered options, 0 to 1; none: they have no order

    def sampled(self, u: float) -> float | int:
        """The coordinate at a share of the axis, 0 to 1."""
        if self.options:
            return min(int(u * self.options), self.options - 1)
        return self.low + u * (self.high - self.low)

    def features(self, at: float | int) -> list[float]:
        """The coordinate as numbers whose distance says how unlike two are."""
        if not self.options:
            return [(at - self.low) / (self.high - self.low)]
        if self.scale:
            return [self.scale[int(at)]]
        one = [0.0] * self.options
        one[int(at)] = 1.0
        return one


Space = tuple[Axis, ...]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What an evaluation gives: each objective, least is best, and each limit, met up to 0."""

    objectives: tuple[float, ...]
    limits: tuple[float, ...] = ()

    @property
    def violation(self) -> float:
        """Sum of what the limits are missed by."""
        return sum(max(one, 0.0) for one in self.limits)


# Outcomes of points in their order; None for one that cannot be computed
Evaluate = Callable[[Sequence[Point]], Sequence[Outcome | None]]
Same = Callable[[Point], Point]  # the one point that stands for all that are the same


def itself(point: Point) -> Point:
    """The point: no two are the same."""
    return point


def size(space: Space) -> float:
    """The number of points; infinite where a variable is any number."""
    return float(np.prod([float(axis.options or np.inf) for axis in space]))


def every_point(space: Space) -> Iterator[Point]:
    """All points of a space of options."""
    return product(*(range(axis.options) for axis in space))


def spread_points(space: Space, count: int, seed: int) -> list[Point]:
    """Points, evenly spread: a Latin hypercube."""
    shares = qmc.LatinHypercube(len(space), rng=seed).random(count)
    return [tuple(axis.sampled(u) for axis, u in zip(space, row, strict=True)) for row in shares]


def random_search(
    space: Space, evaluate: Evaluate, budget: int, seed: int, batch: int = 1, same: Same = itself
) -> None:
    """Points at random, each once; fewer where they are hard to find."""
    draw = np.random.default_rng(seed)
    points: dict[Point, None] = {}
    for _ in range(TRIED * budget):
        points[same(_random(space, draw))] = None
        if len(points) == budget:
            break
    ordered = list(points)
    for start in range(0, len(ordered), batch):
        evaluate(ordered[start : start + batch])


def whole_grid(space: Space, evaluate: Evaluate, budget: int, seed: int, batch: int = 1, same: Same = itself) -> None:
    """Every point; budget and seed do not matter."""
    points = list(dict.fromkeys(map(same, every_point(space))))
    for start in range(0, len(points), batch):
        evaluate(points[start : start + batch])


def genetic(space: Space, evaluate: Evaluate, budget: int, seed: int, batch: int = 1, same: Same = itself) -> None:
    """NSGA-II with mixed variables, of pymoo (Deb et al. 2002, doi:10.1109/4235.996017)."""
    from pymoo.algorithms.moo.nsga2 import RankAndCrowdingSurvival
    from pymoo.core.mixed import MixedVariableGA
    from pymoo.core.problem import Problem
    from pymoo.core.variable import Choice, Integer, Real
    from pymoo.termination.max_eval import MaximumFunctionCallTermination

    kinds: dict[str, Any] = {}
    for number, axis in enumerate(space):
        if not axis.options:
            kinds[str(number)] = Real(bounds=(axis.low, axis.high))
        elif axis.scale:
            kinds[str(number)] = Integer(bounds=(0, axis.options - 1))
        else:
            kinds[str(number)] = Choice(options=list(range(axis.options)))
    first = evaluate([same(tuple(axis.sampled(0.5) for axis in space))])[0]
    if first is None:
        shape = (1, 0)
    else:
        shape = (len(first.objectives), len(first.limits))
    problem = Problem(vars=kinds, n_obj=shape[0], n_ieq_constr=shape[1])
    algorithm = MixedVariableGA(pop_size=max(4, min(20, budget // 4)), survival=RankAndCrowdingSurvival())
    algorithm.setup(problem, termination=MaximumFunctionCallTermination(budget - 1), seed=seed, verbose=False)
    bad = Outcome((1e9,) * shape[0], (1e9,) * shape[1])
    while algorithm.has_next():
        asked = algorithm.ask()
        points = [same(tuple(one.X[str(number)] for number in range(len(space)))) for one in asked]
        outcomes = [one or bad for one in evaluate(points)]
        asked.set("F", np.array([one.objectives for one in outcomes]))
        asked.set("G", np.array([one.limits for one in outcomes]).reshape(len(outcomes), shape[1]))
        asked.set("H", np.zeros((len(outcomes), 0)))
        for one in asked:
            one.evaluated.update(("F", "G", "H"))
        algorithm.evaluator.n_eval += len(asked)
        algorithm.tell(infills=asked)


def surrogate(space: Space, evaluate: Evaluate, budget: int, seed: int, batch: int = 1, same: Same = itself) -> None:
    """Expected improvement of a Gaussian process, see the module."""
    draw = np.random.default_rng(seed)
    most = int(min(budget, size(space)))
    first = list(dict.fromkeys(map(same, spread_points(space, min(most, max(FIRST * len(space) + 1, 6)), seed))))
    outcomes: dict[Point, Outcome | None] = dict(zip(first, evaluate(first), strict=True))
    models = _Models(space, seed)
    while len(outcomes) < most:
        known = {point: one for point, one in outcomes.items() if one is not None}
        chosen: list[Point] = []
        for _ in range(min(batch, most - len(outcomes))):
            point = _next(space, models, known, {*outcomes, *chosen}, draw, same)
            if point is None:
                break
            chosen.append(point)
            if len(known) > 1 and batch > 1:  # as if the evaluation gave what is expected of it
                known[point] = models.expected(known, point)
        if not chosen:  # every point is known
            return
        outcomes.update(zip(chosen, evaluate(chosen), strict=True))


METHODS = {"surrogate": surrogate, "NSGA-II": genetic, "random": random_search, "all": whole_grid}


def _random(space: Space, draw: np.random.Generator) -> Point:
    return tuple(axis.sampled(draw.random()) for axis in space)


class _Models:
    """The Gaussian processes of a search; their lengths are fitted when the points have grown."""

    def __init__(self, space: Space, seed: int) -> None:
        self._space, self._seed = space, seed
        self._fitted: dict[str, tuple[int, Any]] = {}  # number of points and kernel, by name

    def features(self, points: Sequence[Point]) -> FloatArray:
        """The points as rows of numbers."""
        return np.array(
            [[x for axis, at in zip(self._space, p, strict=True) for x in axis.features(at)] for p in points]
        )

    def predicted(
        self, name: str, points: Sequence[Point], values: FloatArray, others: Sequence[Point]
    ) -> tuple[FloatArray, FloatArray]:
        """Mean and standard deviation at other points."""
        from sklearn.exceptions import ConvergenceWarning
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel

        if np.ptp(values) == 0:
            return np.full(len(others), values[0]), np.zeros(len(others))
        x = self.features(points)
        count, kernel = self._fitted.get(name, (0, None))
        fit = len(points) != count if len(points) <= ALWAYS_FITTED else len(points) >= REFITTED * count
        if kernel is None:
            lengths = Matern(np.full(x.shape[1], FIRST_LENGTHS[0]), (0.05, 30.0), nu=2.5)
            kernel = ConstantKernel(1.0, (0.05, 50.0)) * lengths + WhiteKernel(1e-4, (1e-8, 0.1))
        process = GaussianProcessRegressor(
            kernel, optimizer=most_probable if fit else None, normalize_y=True, random_state=self._seed
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound: a variable that does nothing
            process.fit(x, values)
        if fit:
            self._fitted[name] = len(points), process.kernel_
        mean, deviation = process.predict(self.features(others), return_std=True)
        return mean, deviation

    def expected(self, known: dict[Point, Outcome], point: Point) -> Outcome:
        """The outcome that is expected of a point."""
        points, outcomes = list(known), list(known.values())
        columns = np.array([(*one.objectives, *one.limits) for one in outcomes])
        means = [
            float(self.predicted(f"value {k}", points, column, [point])[0][0]) for k, column in enumerate(columns.T)
        ]
        count = len(outcomes[0].objectives)
        return Outcome(tuple(means[:count]), tuple(means[count:]))


def most_probable(
    misfit: Callable[..., tuple[float, FloatArray]], start: FloatArray, bounds: FloatArray
) -> tuple[FloatArray, float]:
    """The most probable logarithms of amplitude, lengths and noise of a kernel, by likelihood and priors.

    The prior of a length is lognormal, and its density is that of the length (not of its logarithm).

    Args: misfit: negative log likelihood and its gradient; start: where to begin; bounds: [n, 2].
    """
    count = len(start) - 2
    middle, deviation = LENGTH_PRIOR[0] + 0.5 * np.log(count), LENGTH_PRIOR[1]
    means = np.array([AMPLITUDE_PRIOR[0], *[middle] * count, NOISE_PRIOR[0]])
    deviations = np.array([AMPLITUDE_PRIOR[1], *[deviation] * count, NOISE_PRIOR[1]])
    of_length = np.array([0.0, *[1.0] * count, 0.0])

    def lost(theta: FloatArray) -> tuple[float, FloatArray]:
        value, gradient = misfit(theta, eval_gradient=True)
        z = (theta - means) / deviations
        return value + float(0.5 * z @ z + of_length @ theta), gradient + z / deviations + of_length

    second = start.copy()
    second[1:-1] = np.log(FIRST_LENGTHS[1])
    found = [minimize(lost, at, jac=True, bounds=bounds, method="L-BFGS-B") for at in (start, second)]
    best = min(found, key=lambda one: float(one.fun))
    return best.x, float(best.fun)


def _next(
    space: Space, models: _Models, known: dict[Point, Outcome], taken: set[Point], draw: np.random.Generator, same: Same
) -> Point | None:
    """The point of greatest expected improvement among many; None where no other is left."""
    points, outcomes = list(known), list(known.values())
    if len(known) < 2:
        others = _others(space, points, taken, draw, same)
        return others[int(draw.integers(len(others)))] if others else None
    objectives = np.array([one.objectives for one in outcomes])
    limits = np.array([one.limits for one in outcomes]).reshape(len(outcomes), -1)
    value, name = _one_objective(objectives, draw)
    order = np.lexsort((value, np.array([one.violation for one in outcomes])))
    others = _others(space, [points[number] for number in order[:BEST]], taken, draw, same)
    if not others:
        return None
    met = (limits <= 0).all(axis=1)
    if not met.any():  # first the least that limits are missed by
        missed = np.maximum(limits, 0.0).sum(axis=1)
        mean, deviation = models.predicted("missed", points, missed, others)
        return others[int(np.argmax(_improvement(float(missed.min()), mean, deviation)))]
    likely = np.ones(len(others))
    for k, column in enumerate(limits.T):
        mean, deviation = models.predicted(f"limit {k}", points, column, others)
        likely *= ndtr(-mean / np.maximum(deviation, 1e-9 * max(float(np.ptp(column)), 1e-12)))
    mean, deviation = models.predicted(name, points, value, others)
    return others[int(np.argmax(_improvement(float(value[met].min()), mean, deviation) * likely))]


def _one_objective(objectives: FloatArray, draw: np.random.Generator) -> tuple[FloatArray, str]:
    """The objectives [n, m] as one [n], and the name of its surrogate."""
    count = objectives.shape[1]
    if count == 1:
        return objectives[:, 0], "objective"
    low, high = objectives.min(axis=0), objectives.max(axis=0)
    shares = (objectives - low) / np.where(high > low, high - low, 1.0)
    weights = draw.dirichlet(np.ones(count))
    weighted = shares * weights
    return weighted.max(axis=1) + AUGMENTED * weighted.sum(axis=1), "weighted"


def _improvement(best: float, mean: FloatArray, deviation: FloatArray) -> FloatArray:
    """Expected improvement on the best value."""
    safe = np.maximum(deviation, 1e-12)
    z = (best - mean) / safe
    return (best - mean) * ndtr(z) + safe * np.exp(-0.5 * z * z) / np.sqrt(2 * np.pi)


def _others(
    space: Space, best: Sequence[Point], taken: set[Point], draw: np.random.Generator, same: Same
) -> list[Point]:
    """Points that were not evaluated: all of a small space, else at random and near the best."""
    if size(space) <= MOST_CANDIDATES:
        return [point for point in dict.fromkeys(map(same, every_point(space))) if point not in taken]
    found = {_random(space, draw): None for _ in range(MOST_CANDIDATES // 2)}
    for number in range(MOST_CANDIDATES // 2 if best else 0):
        found[_neighbour(space, best[number % len(best)], draw)] = None
    return [point for point in dict.fromkeys(map(same, found)) if point not in taken]


def _neighbour(space: Space, point: Point, draw: np.random.Generator) -> Point:
    """A point that differs in one variable or two; a number by a tenth of its range or less."""
    changed = list(point)
    for number in draw.choice(len(space), size=min(len(space), int(draw.integers(1, 3))), replace=False):
        axis = space[number]
        if axis.options:
            changed[number] = int(draw.integers(axis.options))
        else:
            width = (axis.high - axis.low) * 10 ** draw.uniform(-3, -1)
            changed[number] = float(np.clip(point[number] + width * draw.normal(), axis.low, axis.high))
    return tuple(changed)
