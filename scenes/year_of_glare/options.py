"""Options of `cfs dgp`."""

from __future__ import annotations

from dataclasses import dataclass

from scenes.input_options import InputOptions

METHODS = ("five-phase", "three-phase")
METRICS = ("DGP", "eDGP", "sDGP")


@dataclass(frozen=True, slots=True, kw_only=True)
class YearOptions(InputOptions):
    """Options of a year of glare; of the rooms the first is rated."""

    views: tuple[str, ...] = ()  # Radiance view options, or files of them
    grid: float | None = None  # [m] spacing of eyes all over the room, in place of one
    directions: int = 1  # at every eye, the first towards the biggest window
    eye_height: float = 1.2  # [m] above the floor, a seated eye (EN 17037)
    method: str = "five-phase"
    metric: str = "DGP"
    size: int = 800  # [px] of a side
    samples: int = 32  # paths of a pixel
    memory_gb: float = 2.0  # of a view's matrices, above it they lie on disk
    occupied: tuple[int, int] = (8, 18)  # clock hours, every day
    worst: int = 3  # pictures of each view's worst hours
    hdr: bool = False  # the pictures as .hdr too
    window_parts: int = 0  # subgroups of each window group; 0: choose from the surroundings
    glare_sources: str = "evalglare"  # bright pixels grouped so, or each of the "pixels"
    glare_sun: str = "source"  # the sun's disc: a source of its own, or part of its "pixels"
    sun_model: str = "spa"  # see `mitsuba_cfs.sky.sun`
    sky_ground: str = "reflected"  # see `mitsuba_cfs.sky.matrix`
    seed: int = 0
