"""One picture of a room under one hour's sky, from files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Space
from bim.read_ifc import read_ifc
from bim.sensors import view_point
from bim.to_tracer import exterior_surfaces, interior_surfaces, window_groups
from mitsuba_cfs import variants
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.images.hdr import write_hdr
from mitsuba_cfs.images.view import View, fisheye, fitted, parse_view, pixel_directions
from mitsuba_cfs.methods.optics import BsdfOptics
from mitsuba_cfs.methods.path_light import PathSystems
from mitsuba_cfs.methods.sampling import Sampling
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.annual import annual_sky
from mitsuba_cfs.sky.weather import Weather
from scenes.job.inputs import chosen_spaces, read_system, read_weather
from scenes.pictures import write_falsecolour, write_tone_mapped

SUFFIXES = (".hdr", ".exr", ".png")


@dataclass(frozen=True, slots=True)
class PictureOptions:
    """Inputs and choices."""

    building: Path
    weather: Path
    system: Path
    at: str  # month, day and clock time, `06-21 12:00`
    space: str | None = None  # name or GUID; None: the first room that has a window
    view: str | None = None  # Radiance view options, or a file of them
    eye_height: float = 1.2  # [m] above the floor, where no view is given
    size: int = 800  # [px] of the longer side
    samples: int = 16  # paths of a pixel
    seed: int = 0


@dataclass(frozen=True, slots=True)
class RoomPicture:
    """A picture and what it is of."""

    luminance: NDArray[np.float32]  # [ny, nx] [cd/m2]
    view: View
    room: str
    time: pd.Timestamp  # middle of the hour
    notes: tuple[str, ...]  # of system and weather


def room_picture(options: PictureOptions, progress: Progress = silent) -> RoomPicture:
    """The picture, path-traced; `DataError` where an input cannot be used."""
    system, weather = read_system(options.system), read_weather(options.weather)
    hour = hour_of(weather, options.at)
    building = read_ifc(options.building, progress=part(progress, 0.0, 0.4, "inputs"))
    names = () if options.space is None else (options.space,)
    space = chosen_spaces(building, names, options.building)[0]
    view = room_view(space, options)
    variants.activate()
    scene = DaylightScene(
        interior_surfaces(space, "visible"),
        exterior_surfaces(building, space, "visible"),
        window_groups(space),
        view=view,
    )
    sampling = Sampling(picture_samples=options.samples, seed=options.seed)
    systems = [[BsdfOptics(system.visible, system.fine)]] * len(scene.groups)
    light = PathSystems(scene, systems, sampling).light(
        annual_sky(weather, sampling.subdivision, hours=[hour])
    )
    luminance = light.picture(0, progress=part(progress, 0.4, 1.0, "picture"))
    return RoomPicture(
        luminance, view, space.name or space.guid, weather.midpoints[hour],
        (*system.notes, *weather.notes),
    )  # fmt: skip


def hour_of(weather: Weather, at: str) -> int:
    """The hour of the year that holds a month, day and time of day."""
    try:
        asked = pd.to_datetime(f"2000-{at}", format="%Y-%m-%d %H:%M")
    except ValueError:
        raise ValueError(f"--at {at}: expected month-day hour:minute, as 06-21 12:00") from None
    middles = weather.midpoints
    same_day = (middles.month == asked.month) & (middles.day == asked.day)
    found = np.flatnonzero(same_day & (middles.hour == asked.hour))
    if not len(found):
        raise ValueError(f"--at {at}: the weather of {weather.site} has no such hour")
    return int(found[0])


def room_view(space: Space, options: PictureOptions) -> View:
    """The view asked for with square pixels; by default the room's middle to its biggest window."""
    if options.view is None:
        return fisheye(*view_point(space, options.eye_height), options.size)
    text, file = options.view, None
    if not text.strip().startswith("-v"):
        file = Path(text)
        try:
            lines = file.read_text(encoding="utf-8").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise DataError(f"cannot be read: {error}", file=file, field="--view") from None
        text = next((line for line in lines if "-v" in line), "")
    try:
        return fitted(parse_view(text), options.size)
    except ValueError as error:
        raise DataError(str(error), file=file, field="--view") from None


def write_picture(picture: RoomPicture, path: Path, *, print_like: bool = False) -> None:
    """Write `.hdr`, `.exr`, or `.png`: falsecolour, or tone-mapped if `print_like`."""
    title = f"{picture.room}, {picture.time:%d %B %H:%M}"
    if path.suffix == ".hdr":
        write_hdr(path, picture.luminance, picture.view, comments=(title,))
    elif path.suffix == ".exr":
        from mitsuba_cfs.images.exr import write_exr

        write_exr(path, picture.luminance, picture.view, comment=title)
    elif path.suffix == ".png" and print_like:
        write_tone_mapped(path, picture.luminance, scale=True, title=title)
    elif path.suffix == ".png":
        seen = pixel_directions(picture.view)[1]
        write_falsecolour(path, picture.luminance, title=title, seen=seen)
    else:
        raise ValueError(f"{path}: expected one of {', '.join(SUFFIXES)}")
