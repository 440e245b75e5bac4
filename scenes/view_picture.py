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
from mitsuba_cfs.images.view import View, fisheye, fitted, pixel_directions
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.weather import Weather
from scenes.job.drawn_shades import traced_building
from scenes.job.inputs import chosen_spaces, read_system, read_weather
from scenes.job.windows import everywhere
from scenes.methods.paths import path_scene
from scenes.methods.place import Place, Quality, fenestration, skies_of
from scenes.pictures import write_falsecolour, write_tone_mapped
from scenes.room_views import check_eye, given_views

SUFFIXES = (".hdr", ".exr", ".png")


@dataclass(frozen=True, slots=True)
class PictureOptions:
    """Inputs and choices."""

    building: Path
    weather: Path
    system: Path
    at: str  # month, day and clock time, `06-21 12:00`
    space: str | None = None  # name or GUID; None: the first room that has a window
    join: tuple[str, ...] = ()  # rooms to make one, as "Hall + Living"
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


def room_picture(options: PictureOptions, progress: Progress = silent) -> RoomPicture:
    """The picture, path-traced; `DataError` where an input cannot be used."""
    system, weather = read_system(options.system), read_weather(options.weather)
    hour = hour_of(weather, options.at)
    steps = part(progress, 0.0, 0.4, "inputs")
    building = read_ifc(options.building, join=options.join, progress=steps)
    names = () if options.space is None else (options.space,)
    space = chosen_spaces(building, names, options.building)[0]
    view = room_view(space, options)
    building = traced_building(building, everywhere(space, system))
    variants.activate()
    nothing = np.empty((0, 3))
    place = Place(
        interior_surfaces(space, "visible"), exterior_surfaces(building, space, "visible"),
        window_groups(space), view, nothing, nothing,
    )  # fmt: skip
    quality = Quality(path_samples=options.samples, seed=options.seed)
    scene = path_scene(place, "picture", quality=quality)
    lit = scene.behind(fenestration(system.visible, system.fine))
    skies = skies_of(weather, [hour], subdivision=quality.subdivision)
    luminance = lit.picture(skies, 0, progress=part(progress, 0.4, 1.0, "picture"))
    return RoomPicture(luminance, view, space.label, weather.midpoints[hour])


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
    given = given_views(options.view)[0]
    check_eye(given, space)
    if given.view.kind == "parallel":  # one eye's rays in one direction: one colour all over
        message = "a parallel view (-vtl) is not traced; expected -vtv, -vtc, -vth, -vta or -vts"
        raise DataError(message, field="--view")
    return fitted(given.view, options.size)


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
