"""What the user may choose about a picture; every default is stated here."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

SUFFIXES = (".hdr", ".exr", ".png")


@dataclass(frozen=True, slots=True)
class PictureOptions:
    """Inputs and choices."""

    building: Path
    weather: Path
    system: Path | None  # of every window; None: what the building's file holds
    at: str  # month, day and clock time, `06-21 12:00`
    space: str | None = None  # name or GUID; None: the first room that has a window
    join: tuple[str, ...] = ()  # rooms to make one, as "Hall + Living"
    furniture: bool = False  # whether what stands in the room is in its light and views
    apertures: tuple[str, ...] = ()  # materials of a Radiance scene's windows; none: all of glass
    surroundings: tuple[Path, ...] = ()  # files of what stands around
    surroundings_offset: tuple[float, float, float] | None = None  # of these files [m]
    view: str | None = None  # Radiance view options, or a file of them
    eye_height: float = 1.2  # [m] above the floor, where no view is given
    size: int = 800  # [px] of the longer side
    samples: int = 16  # paths of a pixel
    glare_sources: str = "evalglare"  # bright pixels grouped so, or each of the "pixels"
    glare_sun: str = "source"  # the sun's disc: a source of its own, or part of its "pixels"
    sun_model: str = "spa"  # see `mitsuba_cfs.sky.sun`
    sky_ground: str = "reflected"  # see `mitsuba_cfs.sky.ground`
    seed: int = 0
    colour: bool = False  # by the surfaces' colours, in three bands
