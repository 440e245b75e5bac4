"""The pixels at the edge of a shadow: those lit unlike a neighbour, neighbour by neighbour."""

import numpy as np
import pytest

from mitsuba_cfs.images.view import View
from mitsuba_cfs.trace.kernels.sampling import pixel_positions
from mitsuba_cfs.trace.sun.pixels import EDGE_SAMPLES, edge_pixels

VIEW = View(width=9, height=6)


def unlike(lit: np.ndarray, pixels: np.ndarray) -> list[int]:
    """Numbers of the pixels that are lit unlike the pixel left, right, above or below."""
    lit_at = {divmod(int(p), VIEW.width): bool(on) for p, on in zip(pixels, lit, strict=True)}
    return [
        number
        for number, (row, column) in enumerate(lit_at)
        if any(
            lit_at.get((row + down, column + across), lit_at[row, column]) != lit_at[row, column]
            for down, across in ((0, 1), (0, -1), (1, 0), (-1, 0))
        )
    ]


@pytest.mark.parametrize("share", [0.0, 0.15, 0.5, 0.9, 1.0])
def test_edges_are_where_neighbours_are_lit_unlike(share: float) -> None:
    random = np.random.default_rng(3)
    # not every pixel shows a surface; what shows none is no neighbour
    pixels = np.flatnonzero(random.random(VIEW.width * VIEW.height) < 0.8)
    lit = random.random((4, len(pixels))) < share
    hour, number = edge_pixels(lit, pixels, VIEW)
    for h in range(len(lit)):
        assert number[hour == h].tolist() == unlike(lit[h], pixels)


def test_no_hour_has_no_edges() -> None:
    hour, number = edge_pixels(np.zeros((0, 5), dtype=bool), np.arange(5), VIEW)
    assert len(hour) == len(number) == 0


@pytest.mark.parametrize("turn", np.radians([0, 20, 45, 70, 90, 120, 150]))
def test_a_strip_of_sun_across_a_pixel_is_as_wide_as_it_is(turn: float) -> None:
    """A twentieth of the pixel, wherever it lies; by 8 places up to a quarter."""
    across = pixel_positions(EDGE_SAMPLES) @ [np.cos(turn), np.sin(turn)]
    for middle in np.linspace(across.min(), across.max(), 40):
        assert (np.abs(across - middle) < 0.025).mean() < 0.16
