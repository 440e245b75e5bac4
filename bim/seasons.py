"""Surroundings by month: trees with and without leaves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bim.model import Building

MONTHS = range(1, 13)


@dataclass(frozen=True, slots=True)
class Season:
    """Months in which the same stands outdoors."""

    months: tuple[int, ...]  # 1 to 12
    building: Building  # with the surroundings of these months


def seasons(building: Building) -> tuple[Season, ...]:
    """The seasons of a building, that with most leaves first; one where nothing changes."""
    stands: dict[tuple[bool, ...], list[int]] = {}
    for month in MONTHS:
        kind = tuple(not e.months or month in e.months for e in building.elements)
        stands.setdefault(kind, []).append(month)
    if len(stands) == 1:
        return (Season(tuple(MONTHS), building),)
    found = [Season(tuple(months), in_month(building, months[0])) for months in stands.values()]
    return tuple(sorted(found, key=lambda season: -_triangles(season.building)))


def in_month(building: Building, month: int) -> Building:
    """The building with the surroundings of a month, 1 to 12, as if they were there all year."""
    if not any(element.months for element in building.elements):
        return building
    kept = (e for e in building.elements if not e.months or month in e.months)
    return replace(building, elements=tuple(replace(e, months=()) for e in kept))


def season_of(seasons: tuple[Season, ...], month: NDArray[np.integer]) -> NDArray[np.int64]:
    """The number of the season [n] of each month [n]."""
    of_month = np.zeros(13, dtype=np.int64)
    for number, season in enumerate(seasons):
        of_month[list(season.months)] = number
    return of_month[np.asarray(month)]


def _triangles(building: Building) -> int:
    return sum(len(element.triangles) for element in building.elements)
