"""How finely the methods compute."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampling:
    """Numbers of paths, the sky's patches and the seed; the defaults are those of `cfs`."""

    sensor_samples: int = 32_768  # paths of a sensor, for V
    patch_samples: int = 16_384  # paths of a window patch, for D
    # places on each window group that the direct sun is taken at, and its beam into the room; and
    # places outdoors that the sun is taken at for all that reflect it
    sun_points: int = 1_024
    view_samples: int = 8  # paths of a pixel, for the matrices of a view; a tile shares them
    outdoor_samples: int = 8  # paths of a pixel straight through the windows
    picture_samples: int = 16  # point-in-time: paths of a pixel under one sky
    hour_samples: int = 2_048  # point-in-time: paths of a sensor under one sky
    subdivision: int = 4  # Reinhart's MF
    window_parts: int = 0  # of each group; 0: as many as what stands outdoors asks for
    memory: float = 2 * 2**30  # [bytes] of a view's matrices; above it they lie on disk
    seed: int = 0
