"""A year of glare of each state of the windows, kept on disk: a blind that moves reads it there.

A study's cases with the blind up and with the blind down rate every hour; the case whose blind is
controlled takes each hour's rating from the one whose state it is in.
"""

from __future__ import annotations

from collections.abc import Callable

from numpy.typing import NDArray

from mitsuba_cfs.matrices.cache import CacheEntry, digest
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.phase_light import PhaseLight
from scenes.room.windows import RoomWindows


def kept_glare(
    light: PhaseLight, windows: RoomWindows, *asked: object
) -> Callable[[NDArray], CacheEntry] | None:
    """The place of the ratings with each window group in a state [G]; None without a cache.

    Args: asked: all that the ratings follow from beside light and windows.
    """
    traced, sky = light.filled.traced, light.sky
    cache = traced.cache
    if cache is None:
        return None
    seen = digest(
        traced.scene, traced.sampling, traced.five_phase,
        sky.whole, sky.sun, sky.direction, sky.illuminance, *asked,
    )  # fmt: skip

    def entry(state: NDArray) -> CacheEntry:
        rows = zip(windows.systems, state.tolist(), strict=True)
        chosen = [systems[min(j, len(systems) - 1)] for systems, j in rows]
        optics = [[one.visible, one.fine, one.angular] for one in chosen]
        return cache.entry("year of glare", seen, optics, by=hourly_glare.__module__)

    return entry
