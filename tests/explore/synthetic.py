"""A made-up room to explore: pictures by formulas, with a bright window and a patch of sun."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.glare.sun_disc import SunDisc
from mitsuba_cfs.images.view import View, pixel_directions
from mitsuba_cfs.picture_year.year import picture_year
from scenes.results import ExploredColour, ExploredRoom, RunResult
from tests.report.synthetic import run_result

TILE = 2  # pixels across of the squares that share their reflected light
SIZE = 96  # pixels of a side of the pictures
STEP = 23  # of the hours with the sun up, one in so many is explored


class MadeUpPictures:
    """Pictures in which what each part of the compression is for occurs."""

    def __init__(self, view: View, suns: NDArray[np.float64], through: float) -> None:
        """Args: suns: [H, 3]; through: transmittance of the windows."""
        self.view, self._suns, self._through = view, suns, through
        directions, counts = pixel_directions(view)
        self.pixels = np.flatnonzero(counts.reshape(-1))
        self._ways = directions.reshape(-1, 3)[self.pixels]
        y, x = np.divmod(self.pixels, view.width)
        tiles = (y // TILE) * view.width + x // TILE
        _, first, row = np.unique(tiles, return_index=True, return_inverse=True)
        self._rows = self._ways[first]
        ahead = self._ways @ np.asarray(view.direction)
        self._window = (ahead > 0.9) & (self._ways[:, 2] > 0)
        share = np.where(self._window, 0.0, 1.0).astype(np.float32)
        self.shared = SimpleNamespace(row=row, share=share)

    @property
    def hours(self) -> int:
        return len(self._suns)

    def by_rows(self, batch):
        suns = self._suns[batch]
        strength = self._through * np.maximum(suns[:, 2:], 0)
        rows = strength * (400 + 300 * (suns @ self._rows.T) + 200 * (suns @ self._rows.T) ** 4)
        own = np.zeros((len(batch), len(self.pixels)), dtype=np.float32)
        towards = suns @ self._ways[self._window].T
        own[:, self._window] = strength * (3000 + 20000 * np.maximum(towards, 0) ** 8)
        place = np.stack([0.6 * suns[:, 0], -np.abs(suns[:, 1]) - 0.1, -0.6 + 0.2 * suns[:, 2]], 1)
        place /= np.linalg.norm(place, axis=1, keepdims=True)
        patch = (place @ self._ways.T > 0.97) & ~self._window
        own += np.where(patch & (suns[:, 1:2] < 0), 9000 * strength, 0.0)
        return rows.astype(np.float32), own.astype(np.float32)

    def discs(self, batch):
        seen = self._suns[batch] @ np.asarray(self.view.direction) > 0.93
        light = 1e9 * self._through
        found = zip(self._suns[batch], seen, strict=True)
        return [(SunDisc(sun, light, 6.8e-5),) if shown else () for sun, shown in found]


RED, WHITE = (1.8, 0.8, 0.6, 0.5), (1.0, 1.0, 1.0, 1.0)  # tints: red, green, blue, melanopic DER


def _colours(years, hours: int, lux: NDArray[np.float32]) -> ExploredColour:
    """Red surfaces and white windows; light of DER 0.8 indoors, 1.2 from the sky, 0.6 from the sun."""
    pixels = []
    for year in years:
        tint = np.tile(np.array(RED, dtype=np.float32), (len(year.pixels), 1))
        tint[year.window] = WHITE
        pixels.append(tint)
    indoors, sky, sun = (np.tile(np.array([1, 1, 1, d], dtype=np.float32), (hours, 1)) for d in (0.8, 1.2, 0.6))
    two = (np.stack([one, one]) for one in (indoors, sun))
    in_two, sun_in_two = two
    return ExploredColour(
        tuple(pixels), in_two, sky, sun_in_two, (0.9 * lux, 0.1 * lux), np.stack([lux.mean(axis=0)] * 2)
    )


def explored_run(*, step: int = STEP, size: int = SIZE) -> RunResult:
    """A run of two rooms, the first of which was computed for the explorer in two states."""
    result = run_result(picture_size=64, pictures=1)
    room = result.spaces[0]
    lit = np.flatnonzero(result.sun[:, 2] > 0.05)[::step]
    view = replace(room.glare.view, width=size, height=size)
    passed = (0.7, 0.1)
    years = tuple(picture_year(MadeUpPictures(view, result.sun[lit], tau)) for tau in passed)
    lux = room.daylight.illuminance[lit].T
    windows = tuple(window.triangles for window in room.space.windows)
    through = [np.full((len(windows), len(lit)), tau) for tau in (passed[0], 0.0)]
    explored = ExploredRoom(
        states=("clear glass", "blind <down>"),
        operated=np.where(result.sun[:, 1] < -0.3, 1, 0),
        lit=lit,
        pictures=years,
        illuminance=(lux, 0.2 * lux),
        eye=np.stack([lux.mean(axis=0), 0.2 * lux.mean(axis=0)]),
        through=np.stack(through).astype(np.float32),
        sun_illuminance=np.full(len(lit), 60_000, dtype=np.float32),
        windows=windows,
        colour=_colours(years, len(lit), lux),
    )
    return replace(result, spaces=(replace(room, explored=explored), *result.spaces[1:]))
