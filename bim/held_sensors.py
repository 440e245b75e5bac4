"""Sensor grids and views that a building's file holds, as data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.images.view import View


@dataclass(frozen=True, slots=True, eq=False)
class ModelGrid:
    """A sensor grid of the file."""

    name: str
    points: NDArray[np.float64]  # [S, 3] [m]
    directions: NDArray[np.float64]  # [S, 3] unit vectors

    def __post_init__(self) -> None:
        if self.points.shape != self.directions.shape or self.points.shape[1:] != (3,):
            raise ValueError(f"grid {self.name}: expected points [S, 3], got {self.points.shape}")


@dataclass(frozen=True, slots=True)
class ModelView:
    """A view of the file."""

    name: str
    view: View
