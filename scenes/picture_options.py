"""Options of `cfs picture`."""

from __future__ import annotations

from dataclasses import dataclass

from scenes.input_options import InputOptions

SUFFIXES = (".hdr", ".exr", ".png")


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureOptions(InputOptions):
    """Options of a picture; of the rooms the first is seen."""

    at: str  # month, day and clock time, `06-21 12:00`
    view: str | None = None  # Radiance view options, or a file of them
    eye_height: float = 1.2  # [m] above the floor, where no view is given
    size: int = 800  # [px] of the longer side
    samples: int = 16  # paths of a pixel
    glare_sources: str = "evalglare"  # bright pixels grouped so, or each of the "pixels"
    glare_sun: str = "source"  # the sun's disc: a source of its own, or part of its "pixels"
    sun_model: str = "spa"  # see `mitsuba_cfs.sky.sun`
    sky_ground: str = "reflected"  # see `mitsuba_cfs.sky.matrix`
    seed: int = 0
    colour: bool = False  # by the surfaces' colours, in three bands
