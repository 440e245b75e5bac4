"""How the paths of a matrix are traced, as one value that functions pass on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.matrices.cache import CacheEntry, MatrixCache
from mitsuba_cfs.progress import Progress, silent
from mitsuba_cfs.trace.kernels.estimate import Estimate, Stopping, accumulate, cache_entry
from mitsuba_cfs.trace.kernels.scene import SceneCache


@dataclass(frozen=True, slots=True)
class PathOptions:
    """Number, length and seed of the paths of a matrix, and where results and scenes are kept."""

    samples: int  # paths of each row (sensor, or window patch) in each batch
    max_depth: int  # most segments of a path; Russian roulette ends most before
    stopping: Stopping | None = None
    seed: int = 0
    progress: Progress = silent
    cache: MatrixCache | None = None  # of traced matrices
    scenes: SceneCache = field(default_factory=SceneCache)

    def entry(self, label: str, *inputs: object, by: str) -> CacheEntry | None:
        """The cache entry of a matrix of these paths; None without a cache.

        Args: inputs: all else that it depends on; by: the module whose code traces it.
        """
        paths = self.samples, self.max_depth, self.seed
        return cache_entry(self.cache, label, *inputs, *paths, by=by, stopping=self.stopping)

    def estimate(self, label: str, batch: Callable[[int], NDArray[np.float64]], *inputs: object, by: str) -> Estimate:
        """The mean of batches, from the cache where it is there; arguments as of `entry`."""
        entry = self.entry(label, *inputs, by=by)
        return accumulate(batch, stopping=self.stopping, label=label, progress=self.progress, entry=entry)
