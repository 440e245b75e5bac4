"""Boxes of many bodies, to find those near one without looking at each pair."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Boxed(Protocol):
    """What has a box: a room."""

    @property
    def low(self) -> NDArray[np.float64]:
        """Low corner [3] [m]."""

    @property
    def high(self) -> NDArray[np.float64]:
        """High corner [3] [m]."""


@dataclass(frozen=True, slots=True)
class Boxes:
    """Boxes along the axes."""

    low: NDArray[np.float64]  # [N, 3] [m]
    high: NDArray[np.float64]  # [N, 3] [m]

    @classmethod
    def of(cls, bodies: Sequence[Boxed]) -> Boxes:
        """The boxes of bodies that know theirs."""
        return cls(
            np.array([body.low for body in bodies]).reshape(-1, 3),
            np.array([body.high for body in bodies]).reshape(-1, 3),
        )

    @classmethod
    def of_triangles(cls, meshes: Sequence[NDArray[np.float64]]) -> Boxes:
        """The boxes of meshes [N, 3, 3]."""
        corners = [mesh.reshape(-1, 3) for mesh in meshes]
        return cls(
            np.array([points.min(axis=0) for points in corners]).reshape(-1, 3),
            np.array([points.max(axis=0) for points in corners]).reshape(-1, 3),
        )

    def near(self, low: NDArray[np.float64], high: NDArray[np.float64], margin: float = 0.0) -> list[int]:
        """Indices of those that are at most a margin [m] from a box, rising."""
        met = (self.low <= high + margin) & (self.high >= low - margin)
        return np.flatnonzero(met[:, 0] & met[:, 1] & met[:, 2]).tolist()

    def pairs(self, margin: float = 0.0) -> Iterator[tuple[int, int]]:
        """Pairs i < j of those at most a margin [m] apart, in order."""
        for i in range(len(self.low)):
            others = self.near(self.low[i], self.high[i], margin)
            yield from ((i, j) for j in others if j > i)
