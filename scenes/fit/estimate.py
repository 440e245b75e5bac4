"""Least squares with priors and correlated errors.

    y = f(theta) + e,   theta ~ N(m, P),   e_i = s_i sigma z_i,   corr(z_i, z_j) = exp(-|t_i - t_j| / tau)

within a series; series are independent.  s is 1 for temperatures, the model's value for light, whose
errors are relative.  Each step linearises f (Gauss-Newton): sigma and tau maximise the marginal
likelihood of the linear model, theta integrated out, and theta is then its bounded least squares.
Where a usual tau is stated, ln(tau) has it as the mean of a normal prior of deviation `LOG_SPREAD`: few
readings do not tell slow errors from fast ones.

Covariance: C = (J' V^-1 J / k + P^-1)^-1.  k = (t / 1.96)^2, t of Student, widens what is known from few
or correlated readings.  Degrees of freedom: effective number of readings less the number of parameters
that they determine, p - trace(P^-1 C).

Source: restricted likelihood of correlated errors: Harville 1977, doi:10.1080/01621459.1977.10480998.
    Continuous-time first-order autoregression for unequal steps: Jones 1993, "Longitudinal Data with
    Serial Correlation".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear, minimize
from scipy.stats import t as student

Array = NDArray[np.float64]
MOST_STEPS = 12
# prior deviations that a parameter may move from where derivatives were computed: on the way, at the end
FAR, NEAR = 0.3, 0.05
LEAST_SHARE = 0.2  # of a step that is halved
CLOSE = 0.05  # standard errors that the last step may move a parameter
SMALLEST = 1e-6  # of a correlation time, in steps: no correlation
FADED = 0.02  # of the mean reading: least scale of a relative error
NORMAL = 1.959964  # quantile of 95 %
LEAST_FREEDOM = 2.0
LOG_SPREAD = 1.0  # deviation of ln(tau) about that of the usual correlation time


@dataclass(frozen=True, slots=True)
class Readings:
    """Readings of one instrument, in the order of time."""

    name: str
    times: Array  # [n] [h]
    values: Array  # [n]
    group: str  # of instruments whose errors have one deviation and one correlation time
    relative: bool  # whether errors are shares of the value
    correlation_h: float | None = None  # usual correlation time of the group's errors; None: any [h]


@dataclass(frozen=True, slots=True)
class Prior:
    """What is known of the parameters before the fit."""

    mean: Array  # [p]
    deviation: Array  # [p]
    low: Array  # [p]
    high: Array  # [p]
    linear: NDArray[np.bool_]  # [p] in which the model is linear: no reason to compute derivatives again


@dataclass(frozen=True, slots=True)
class ReadingNoise:
    """Errors of the readings about the model, of a group of instruments."""

    deviation: float  # a share where errors are relative
    correlation_h: float  # time after which the correlation has fallen to 1/e [h]
    count: int  # readings
    effective: float  # independent readings that tell as much


@dataclass(frozen=True, slots=True)
class FittedValues:
    """Parameters fitted to readings."""

    value: Array  # [p]
    covariance: Array  # [p, p]
    low: Array  # [p] ends of the 95 % interval, within the bounds
    high: Array
    modelled: Array  # [N] at `value`
    expanded_at: Array  # [p] near `value`, where the derivatives were computed
    noise: dict[str, ReadingNoise]  # by group
    freedom: float  # degrees of freedom of Student's t for intervals
    steps: int
    converged: bool

    @property
    def standard_error(self) -> Array:
        """Of each parameter [p]."""
        error: Array = np.sqrt(np.diag(self.covariance))
        return error

    def of_first(self, count: int) -> FittedValues:
        """The estimate of the first parameters."""
        part = slice(count)
        values = {key: getattr(self, key)[part] for key in ("value", "low", "high", "expanded_at")}
        return replace(self, covariance=self.covariance[part, part], **values)


class Model(Protocol):
    """A model of all readings, one series after the other."""

    def values(self, theta: Array) -> Array:
        """What would be read [N] with parameters [p]."""
        ...

    def derivatives(self, theta: Array) -> Array:
        """Derivatives of the values [N, p]."""
        ...


def estimate(
    model: Model, readings: Sequence[Readings], prior: Prior, report: Callable[[float], None] = lambda share: None
) -> FittedValues:
    """The parameters that readings and prior make most likely, with intervals.

    Derivatives are computed again where a parameter has moved by more than `FAR`, at the end `NEAR`.

    Args: report: called with the share that is done.
    """
    theta = np.clip(prior.mean, prior.low, prior.high)
    values, slopes, of_slopes = model.values(theta), model.derivatives(theta), theta
    whitener, done = _Whitener(readings), False
    moved, log_noise = np.inf, None
    steps = 0
    while not (done and moved <= NEAR) and steps < MOST_STEPS:
        steps += 1
        report(steps / MOST_STEPS)
        moved = _moved(theta, of_slopes, prior)
        if moved > (NEAR if done else FAR):
            slopes, of_slopes = model.derivatives(theta), theta
        whitener.scale_by(values)
        log_noise = _likeliest_noise(whitener, values, slopes, theta, prior, log_noise)
        wanted = _solved(whitener, log_noise, values, slopes, theta, prior)
        error = np.sqrt(np.diag(_covariance(whitener, log_noise, slopes, prior)))
        done = bool(np.all(np.abs(wanted - theta) <= CLOSE * error))
        if not done:
            theta, values = _stepped(model, whitener, log_noise, theta, values, wanted=wanted, prior=prior)
        moved = _moved(theta, of_slopes, prior)
    whitener.scale_by(values)
    log_noise = _likeliest_noise(whitener, values, slopes, theta, prior, log_noise)
    noise = whitener.noise(log_noise)
    left = np.diag(_covariance(whitener, log_noise, slopes, prior)) / prior.deviation**2
    determined = len(theta) - float(left.sum())
    freedom = max(sum(one.effective for one in noise.values()) - determined, LEAST_FREEDOM)
    widened = (student.ppf(0.975, freedom) / NORMAL) ** 2
    covariance = _covariance(whitener, log_noise, slopes, prior, widened)
    half = NORMAL * np.sqrt(np.diag(covariance))
    low, high = np.maximum(theta - half, prior.low), np.minimum(theta + half, prior.high)
    converged = done and moved <= NEAR
    return FittedValues(theta, covariance, low, high, values, of_slopes, noise, freedom, steps, converged)


def _moved(theta: Array, other: Array, prior: Prior) -> float:
    """The farthest that a parameter in which the model is not linear has moved [prior deviations]."""
    return float(np.max((np.abs(theta - other) / prior.deviation)[~prior.linear], initial=0.0))


def _stepped(
    model: Model, w: _Whitener, log_noise: Array, theta: Array, values: Array, *, wanted: Array, prior: Prior
) -> tuple[Array, Array]:
    """Parameters and values after a step, halved until it is no step back."""
    before, share = _misfit(w, log_noise, values, theta, prior), 1.0
    while True:
        tried = theta + share * (wanted - theta)
        new = model.values(tried)
        if share < LEAST_SHARE or _misfit(w, log_noise, new, tried, prior) <= before * (1 + 1e-6):
            return tried, new
        share /= 2


class _Whitener:
    """Turns errors of readings into independent ones of deviation 1."""

    def __init__(self, readings: Sequence[Readings]) -> None:
        self.readings = readings
        self.groups = list(dict.fromkeys(one.group for one in readings))
        self.y = np.concatenate([one.values for one in readings])
        ends = np.cumsum([len(one.values) for one in readings])
        self.parts = [slice(int(end) - len(one.values), int(end)) for one, end in zip(readings, ends, strict=True)]
        self.gaps = [np.diff(one.times) for one in readings]
        self.number = [self.groups.index(one.group) for one in readings]
        self.relative = np.concatenate([np.full(len(one.values), one.relative) for one in readings])
        self.scale = np.ones(len(self.y))
        of_groups = {one.group: one.correlation_h for one in readings}
        self.usual_log_tau = np.log([of_groups[group] or np.nan for group in self.groups])

    def scale_by(self, values: Array) -> None:
        """Take the scales of relative errors from the model's values [N]."""
        least = FADED * float(np.abs(self.y[self.relative]).mean()) if self.relative.any() else 0.0
        self.scale = np.where(self.relative, np.maximum(np.abs(values), max(least, 1e-12)), 1.0)

    def steps_h(self) -> list[tuple[float, float]]:
        """The shortest step and the whole span of each group [h]."""
        found = []
        for number in range(len(self.groups)):
            gaps = [gap for gap, own in zip(self.gaps, self.number, strict=True) if own == number and len(gap)]
            found.append((min(float(g.min()) for g in gaps), max(float(g.sum()) for g in gaps)) if gaps else (1.0, 1.0))
        return found

    def __call__(self, errors: Array, log_noise: Array) -> Array:
        """White errors [N] or [N, p]."""
        white = np.empty_like(errors)
        for part, gap, number in zip(self.parts, self.gaps, self.number, strict=True):
            deviation, tau = np.exp(log_noise[2 * number : 2 * number + 2])
            z = (errors[part].T / (deviation * self.scale[part])).T
            phi = np.exp(-gap / tau)
            left = np.sqrt(-np.expm1(-2 * gap / tau))
            white[part][0] = z[0]
            white[part][1:] = ((z[1:].T - phi * z[:-1].T) / left).T
        return white

    def log_determinant(self, log_noise: Array) -> float:
        """ln det V."""
        total = 2 * float(np.log(self.scale).sum())
        for part, gap, number in zip(self.parts, self.gaps, self.number, strict=True):
            log_deviation, log_tau = log_noise[2 * number : 2 * number + 2]
            total += 2 * (part.stop - part.start) * log_deviation
            total += float(np.log(-np.expm1(-2 * gap / np.exp(log_tau))).sum())
        return total

    def noise(self, log_noise: Array) -> dict[str, ReadingNoise]:
        """The noise of each group."""
        found = {}
        for number, group in enumerate(self.groups):
            deviation, tau = np.exp(log_noise[2 * number : 2 * number + 2])
            counts, effective = 0, 0.0
            for gap, own in zip(self.gaps, self.number, strict=True):
                if own == number:
                    phi = np.exp(-gap / tau)
                    counts += len(gap) + 1
                    effective += 1.0 + float(((1 - phi) / (1 + phi)).sum())
            found[group] = ReadingNoise(float(deviation), float(tau), counts, effective)
        return found


def _likeliest_noise(
    w: _Whitener, values: Array, slopes: Array, theta: Array, prior: Prior, known: Array | None
) -> Array:
    """ln sigma, ln tau of each group [2 G] that are likeliest by the linear model and the usual tau.

    Args: known: of the step before, where the search begins; None: it begins at several correlations.
    """
    spread = slopes * prior.deviation
    residual = w.y - values - slopes @ (prior.mean - theta)

    def minus_log(log_noise: Array) -> float:
        e, X = w(residual, log_noise), w(spread, log_noise)
        A = X.T @ X + np.eye(X.shape[1])
        b = X.T @ e
        unusual = np.nansum(((log_noise[1::2] - w.usual_log_tau) / LOG_SPREAD) ** 2)
        likelihood = w.log_determinant(log_noise) + np.linalg.slogdet(A)[1] + e @ e - b @ np.linalg.solve(A, b)
        return 0.5 * float(likelihood + unusual)

    limits, first = [], []
    for number, (step, span) in enumerate(w.steps_h()):
        own = np.concatenate([np.full(p.stop - p.start, g == number) for p, g in zip(w.parts, w.number, strict=True)])
        size = np.log(max(float(np.std((w.y - values)[own] / w.scale[own])), 1e-9))
        low, high = np.log(SMALLEST * step), np.log(max(span, step))
        limits += [(size - 12.0, size + 5.0), (low, high)]
        first.append((size, [np.log(0.1 * step), np.log(3 * step), 0.5 * (np.log(3 * step) + high)]))
    least, likeliest = np.inf, np.zeros(2 * len(w.groups))
    starts = [np.array([value for size, taus in first for value in (size, taus[n])]) for n in range(3)]
    for x0 in starts if known is None else [known]:
        x0 = np.clip(x0, [low for low, _ in limits], [high for _, high in limits])
        found = minimize(minus_log, x0, method="L-BFGS-B", bounds=limits)
        if found.fun < least - 1e-6:
            least, likeliest = float(found.fun), np.asarray(found.x, dtype=np.float64)
    return likeliest


def _solved(w: _Whitener, log_noise: Array, values: Array, slopes: Array, theta: Array, prior: Prior) -> Array:
    """The parameters of the linear model [p], within their bounds."""
    rows = np.vstack([w(slopes, log_noise) * prior.deviation, np.eye(len(theta))])
    wanted = np.concatenate([w(w.y - values + slopes @ theta - slopes @ prior.mean, log_noise), np.zeros(len(theta))])
    bounds = ((prior.low - prior.mean) / prior.deviation, (prior.high - prior.mean) / prior.deviation)
    solution: Array = prior.mean + prior.deviation * lsq_linear(rows, wanted, bounds=bounds).x
    return solution


def _covariance(w: _Whitener, log_noise: Array, slopes: Array, prior: Prior, widened: float = 1.0) -> Array:
    white = w(slopes, log_noise) * prior.deviation
    inverse = np.linalg.inv(white.T @ white / widened + np.eye(white.shape[1]))
    covariance: Array = prior.deviation[:, None] * inverse * prior.deviation
    return covariance


def _misfit(w: _Whitener, log_noise: Array, values: Array, theta: Array, prior: Prior) -> float:
    white = w(w.y - values, log_noise)
    return float(white @ white + (((theta - prior.mean) / prior.deviation) ** 2).sum())
