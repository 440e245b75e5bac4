"""Reinhart's subdivision of the sky: 145, 577, 2305 or 5185 patches, and the ground as patch 0."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.sky.options import SUBDIVISIONS

TREGENZA_ROWS = (30, 30, 24, 24, 18, 12, 6)  # patches in the rows of MF:1, horizon first


@dataclass(frozen=True, slots=True)
class ReinhartSky:
    """The patches in the order of gendaymtx and `reinhart.cal`.

    Patch 0 is the ground.  Then come rows from the horizon up, each of equal altitude; within a
    row the first patch is centred on north and azimuth grows clockwise (to the east).  The last
    patch is a cap around the zenith of half a row's angle.
    """

    subdivision: int  # MF: 1, 2, 4, 6 (any positive number works)
    size: int = field(init=False)  # P, the ground included
    row_height: float = field(init=False)  # [rad]
    row_counts: NDArray[np.int64] = field(init=False)  # [R] patches per row, the cap last
    row_first: NDArray[np.int64] = field(init=False)  # [R] index of each row's first patch
    directions: NDArray[np.float64] = field(init=False)  # [P, 3] centres; straight down for 0
    solid_angles: NDArray[np.float64] = field(init=False)  # [P] [sr]; 2 pi for the ground

    @classmethod
    def of_size(cls, patches: int) -> ReinhartSky:
        """The sky of so many patches, the ground included; `ValueError` where there is none."""
        for subdivision in SUBDIVISIONS:
            sky = cls(subdivision)
            if sky.size == patches:
                return sky
        raise ValueError(f"a sky of {patches} patches is no Reinhart sky of MF 1, 2, 4, 6")

    def __post_init__(self) -> None:
        mf = self.subdivision
        if isinstance(mf, bool) or int(mf) != mf or mf < 1:
            raise ValueError(f"subdivision: expected one of {SUBDIVISIONS}, got {mf!r}")
        height = (np.pi / 2) / (len(TREGENZA_ROWS) * mf + 0.5)
        counts = np.append(np.repeat(np.array(TREGENZA_ROWS) * mf, mf), 1)
        first = 1 + np.concatenate([[0], np.cumsum(counts)[:-1]])
        row = np.repeat(np.arange(len(counts)), counts)
        column = np.concatenate([np.arange(n) for n in counts])
        altitude = np.where(row < len(counts) - 1, height * (row + 0.5), np.pi / 2)
        azimuth = 2 * np.pi * column / counts[row]
        level = np.where(row < len(counts) - 1, np.cos(altitude), 0.0)
        centres = np.stack([level * np.sin(azimuth), level * np.cos(azimuth), np.sin(altitude)], axis=-1)
        edges = np.sin(np.append(height * np.arange(len(counts)), np.pi / 2))
        omega = 2 * np.pi * np.diff(edges) / counts
        values = {
            "size": 1 + len(row),
            "row_height": height,
            "row_counts": counts,
            "row_first": first,
            "directions": np.vstack([[0.0, 0.0, -1.0], centres]),
            "solid_angles": np.concatenate([[2 * np.pi], omega[row]]),
        }
        for name, value in values.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
            object.__setattr__(self, name, value)

    def index(self, directions: ArrayLike) -> NDArray[np.int64]:
        """Patch [...] that each direction [..., 3] (any length) falls in; 0 below the horizon."""
        d = np.asarray(directions, dtype=float)
        altitude = np.arctan2(d[..., 2], np.hypot(d[..., 0], d[..., 1]))
        row = np.clip((altitude / self.row_height).astype(np.int64), 0, len(self.row_counts) - 1)
        count = self.row_counts[row]
        turn = np.mod(np.arctan2(d[..., 0], d[..., 1]) / (2 * np.pi), 1.0)
        column = np.floor(turn * count + 0.5).astype(np.int64) % count
        return np.where(altitude < 0, 0, self.row_first[row] + column)

    @property
    def horizontal_weights(self) -> NDArray[np.float64]:
        """Solid angle times cosine at the centre [P] [sr]: horizontal E = weights @ L."""
        return self.solid_angles * np.maximum(self.directions[:, 2], 0.0)
