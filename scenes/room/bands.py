"""Bands of a room's results: median, 5 and 95 % by what its inputs are not known to.

Inputs are drawn from normal distributions about their values (`scenes.uncertain_inputs`; `[bands]` of an
operation file has others), 512 at a time by Sobol's sequence.  Light: the illuminance of every sensor
and hour is linear in the inputs, with the derivatives of `scenes.room.sensitivities`; hours above a limit
are then counted, not smoothed.  Heat and lamps: figures are linear in the inputs.

The input that decides most is the one with the largest share of a figure's variance,
corr(figure, input)^2: knowing it would narrow the band most.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import ndtri

from mitsuba_cfs.metrics.en17037 import MINIMUM_AREA, TARGET_AREA
from scenes.results import Bands
from scenes.room.operation_tables import OperationTables
from scenes.uncertain_inputs import INPUTS

Array = NDArray[np.float64]
SAMPLES = 512
TOGETHER = 8  # samples whose illuminance is in memory at once
PERCENTILES = (5.0, 50.0, 95.0)
SDA_ACCEPTED = 55.0  # [%] LM-83-12, "nominally acceptable"
EN17037_TARGET, EN17037_MINIMUM = 300.0, 100.0  # [lx] EN 17037:2018, level "minimum"
HALF = 0.5  # of the daylight hours
GLARE_SHARE = 5.0  # [%] of the hours of use, EN 17037:2018
AT_LEAST_0 = ("_kwh", "_w", "_hours", "degree_hours_26", "_lx")
AT_MOST_100 = ("da300", "sda300_50")


@dataclass(frozen=True, slots=True)
class Margin:
    """How far a rule is met [N], met from 0 on, and as computed."""

    samples: Array
    value: float


@dataclass(frozen=True, slots=True)
class LightSamples:
    """Figures of a room's light for drawn inputs."""

    figures: Mapping[str, tuple[str, float, Array]]  # unit, value as computed, samples [N]
    margins: Mapping[str, Margin] = field(default_factory=dict)  # by rule


def deviations(tables: OperationTables | None) -> dict[str, float]:
    """Standard deviation of each input: the usual one, or that of the operation's `[bands]`."""
    own = {} if tables is None else tables.bands.model_dump(exclude_none=True)
    return {key: float(own.get(key, one.deviation)) for key, one in INPUTS.items()}


def draws(by: Mapping[str, float], seed: int) -> dict[str, Array]:
    """What is added to each input [N] of `INPUTS`."""
    from scipy.stats import qmc  # its import takes half a second, and runs without bands do not draw

    sobol = qmc.Sobol(len(INPUTS), scramble=True, rng=np.random.default_rng(seed))
    normal = ndtri(np.clip(sobol.random(SAMPLES), 1e-9, 1 - 1e-9))
    return {key: by[key] * column for key, column in zip(INPUTS, normal.T, strict=True)}


def lit_samples(
    values: Array, slopes: Mapping[str, Array], drawn: Mapping[str, Array]
) -> Iterator[NDArray[np.float32]]:
    """Illuminance [n, S, L] of some samples after the other.

    Args: values: [S, L]; slopes: by input, per unit of it [S, L].
    """
    keys = list(slopes)
    stacked = np.stack([slopes[key] for key in keys]).astype(np.float32).reshape(len(keys), -1)
    base, added = values.astype(np.float32), np.stack([drawn[key] for key in keys], axis=1).astype(np.float32)
    for first in range(0, SAMPLES, TOGETHER):
        moved = (added[first : first + TOGETHER] @ stacked).reshape(-1, *base.shape)
        yield np.maximum(base + moved, np.float32(0.0))


def provision_margin(lit: NDArray[np.floating], half: NDArray[np.bool_], hours: int) -> Array:
    """How far daylight provision of EN 17037, level "minimum", is met [n]: the lesser share of area.

    Args: lit: [n, S, L]; half: [L] of the daylight hours; hours: number of these.
    """
    some = lit[..., half]
    often = [(some >= limit).sum(axis=-1) >= HALF * hours for limit in (EN17037_TARGET, EN17037_MINIMUM)]
    areas = [one.mean(axis=-1) - area for one, area in zip(often, (TARGET_AREA, MINIMUM_AREA), strict=True)]
    margin: Array = np.minimum(*areas) + 1e-9
    return margin


def room_bands(light: LightSamples, table: pd.DataFrame, drawn: Mapping[str, Array]) -> Bands:
    """The bands of a room.

    Args: table: its sensitivities; figures that `light` has no samples of are linear in the inputs.
    """
    rows = [_row(name, unit, value, samples, drawn) for name, (unit, value, samples) in light.figures.items()]
    for name, of_figure in table.groupby("figure", sort=False):
        if name in light.figures or name in COUNTED:
            continue
        value, unit = float(of_figure["figure_value"].iloc[0]), str(of_figure["figure_unit"].iloc[0])
        samples = value + sum(
            (by * drawn[key] for key, by in zip(of_figure["input"], of_figure["derivative"], strict=True)),
            start=np.zeros(SAMPLES),
        )
        rows.append(_row(str(name), unit, value, _possible(str(name), samples), drawn))
    verdicts = [_verdict(rule, margin, drawn) for rule, margin in light.margins.items()]
    return Bands(pd.DataFrame(rows), pd.DataFrame(verdicts))


COUNTED = ("glare_hours", "melanopic_hours", "melanopic_edi_mean_lx")  # of light alone


def _possible(name: str, samples: Array) -> Array:
    if name.endswith(AT_LEAST_0):
        samples = np.maximum(samples, 0.0)
    return np.minimum(samples, 100.0) if name in AT_MOST_100 else samples


def _row(name: str, unit: str, value: float, samples: Array, drawn: Mapping[str, Array]) -> dict[str, object]:
    low, median, high = np.percentile(samples, PERCENTILES, method="inverted_cdf")
    key, share = deciding(samples, drawn) if low < high else ("", 0.0)
    return {
        "figure": name,
        "unit": unit,
        "value": value,
        "p5": float(low),
        "median": float(median),
        "p95": float(high),
        "decided_by": key,
        "decided_percent": share,
    }


def _verdict(rule: str, margin: Margin, drawn: Mapping[str, Array]) -> dict[str, object]:
    met = margin.samples >= 0
    key, share = deciding(margin.samples, drawn) if met.any() and not met.all() else ("", 0.0)
    return {
        "rule": rule,
        "met": bool(margin.value >= 0),
        "met_percent": 100.0 * float(met.mean()),
        "decided_by": key,
        "decided_percent": share,
    }


def deciding(samples: Array, drawn: Mapping[str, Array]) -> tuple[str, float]:
    """The input with the largest share of a figure's variance, and that share [%]; "" without variance."""
    spread = samples - samples.mean()
    if not spread.any():
        return "", 0.0
    shares = {
        key: float((spread @ (of - of.mean())) ** 2 / ((spread @ spread) * ((of - of.mean()) @ (of - of.mean()))))
        for key, of in drawn.items()
        if of.any()
    }
    key = max(shares, key=lambda one: shares[one]) if shares else ""
    return key, 100.0 * shares.get(key, 0.0)
