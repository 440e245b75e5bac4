"""Error measures of the EnergyPlus comparison: by system, orientation, climate; comfort."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from mitsuba_cfs.sky.weather import Weather
from tests.validation.energyplus_cases import FIRST_HOUR, QUANTITIES, EnergyPlusCase, errors
from thermal.comfort import comfort_by_outdoors
from thermal.zone import work_hours

FloatArray = NDArray[np.float64]
WEATHER_NAMES = ("direct normal", "diffuse horizontal", "outdoor temperature")


def case_row(ours: EnergyPlusCase, theirs: EnergyPlusCase) -> dict[str, object]:
    """Mean square and mean error of every quantity of one case (model less reference)."""
    row: dict[str, object] = {
        "model": ours.model,
        "system": ours.system,
        "orientation": ours.orientation,
        "climate": ours.climate,
    }
    for quantity, error in errors(ours, theirs).items():
        row[f"{quantity} square"] = float(np.mean(error**2))
        row[f"{quantity} bias"] = float(np.mean(error))
        row[f"{quantity} largest"] = float(np.max(np.abs(error)))
    return row


def pooled(cases: pd.DataFrame, by: list[str]) -> pd.DataFrame:
    """RMSE and bias [K] pooled over the cases of each group."""
    groups = cases.groupby(by, sort=False)
    out = {}
    for quantity in QUANTITIES:
        out[f"{quantity} rmse"] = np.sqrt(groups[f"{quantity} square"].mean())
        out[f"{quantity} bias"] = groups[f"{quantity} bias"].mean()
    return pd.DataFrame(out)


def weather_correlations(
    ours: list[EnergyPlusCase], theirs: list[EnergyPlusCase], weathers: dict[str, Weather]
) -> pd.DataFrame:
    """Pearson and Spearman correlation of the absolute window error with the weather.

    p is the chance of such a correlation between independent values; hours follow each other, so
    it says less than it seems to: the number of hours is large and they are not independent.
    """
    error = np.concatenate([np.abs(errors(o, t)["window"]) for o, t in zip(ours, theirs, strict=True)])
    rows = []
    for index, name in enumerate(WEATHER_NAMES):
        value = np.concatenate([_weather_series(weathers[o.climate])[index] for o in ours])
        pearson, spearman = stats.pearsonr(value, error), stats.spearmanr(value, error)
        rows.append(
            {
                "weather": name,
                "pearson": pearson.statistic,
                "pearson p": pearson.pvalue,
                "spearman": spearman.statistic,
                "spearman p": spearman.pvalue,
            }
        )
    return pd.DataFrame(rows)


def _weather_series(weather: Weather) -> tuple[FloatArray, ...]:
    series = (weather.direct_normal, weather.diffuse_horizontal, weather.dry_bulb_c)
    return tuple(np.asarray(s)[FIRST_HOUR:] for s in series)


@dataclass(frozen=True, slots=True)
class Classification:
    """Comfortable or not: counts of hours, reference against model."""

    true_positive: int
    false_positive: int
    false_negative: int
    true_negative: int

    @property
    def agreement(self) -> float:
        """Share of hours judged alike."""
        total = self.true_positive + self.false_positive + self.false_negative
        return (self.true_positive + self.true_negative) / (total + self.true_negative)

    @property
    def true_positive_rate(self) -> float:
        """Share of the reference's comfortable hours that the model finds comfortable."""
        return self.true_positive / (self.true_positive + self.false_negative)

    @property
    def true_negative_rate(self) -> float:
        """Share of the reference's uncomfortable hours that the model finds so."""
        return self.true_negative / (self.true_negative + self.false_positive)

    def __add__(self, other: Classification) -> Classification:
        return Classification(
            self.true_positive + other.true_positive,
            self.false_positive + other.false_positive,
            self.false_negative + other.false_negative,
            self.true_negative + other.true_negative,
        )


def classify(ours: ArrayLike, theirs: ArrayLike) -> Classification:
    """Counts from two masks [H] of comfortable hours."""
    a, b = np.asarray(ours, dtype=bool), np.asarray(theirs, dtype=bool)
    counts = (a & b, a & ~b, ~a & b, ~a & ~b)
    return Classification(*(int(c.sum()) for c in counts))


def comfort_classification(
    ours: EnergyPlusCase, theirs: EnergyPlusCase, outdoor_c: FloatArray, band: str
) -> Classification:
    """Working hours (8 to 18) judged by both programs' operative temperature at the centre."""
    chosen = work_hours(8, 18, len(outdoor_c)) > 0
    chosen[:FIRST_HOUR] = False
    both = [comfort_by_outdoors(c.centre, outdoor_c, band, per_day=24) for c in (ours, theirs)]
    return classify(*(comfort.comfortable[chosen] for comfort in both))
