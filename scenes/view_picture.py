"""One picture of a room under one hour's sky, from files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.sensors import view_point
from mitsuba_cfs import variants
from mitsuba_cfs.glare.evaluation import GlareOptions, GlareResult
from mitsuba_cfs.images.hdr import write_hdr
from mitsuba_cfs.images.view import View, fisheye, fitted, pixel_directions
from mitsuba_cfs.methods.colour_view import coloured_picture
from mitsuba_cfs.methods.glare import rated_pictures
from mitsuba_cfs.methods.point_in_time import PathLight, path_picture
from mitsuba_cfs.methods.scene import Sampling
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.annual import annual_sky
from scenes.picture_files import PictureFiles, read_files
from scenes.picture_options import SUFFIXES, PictureOptions
from scenes.pictures import write_falsecolour, write_tone_mapped
from scenes.room_views import check_eye, held_view
from scenes.run.viewed_room import read_viewed_room


@dataclass(frozen=True, slots=True)
class RoomPicture:
    """A picture and what it is of."""

    luminance: NDArray[np.float32]  # [ny, nx] [cd/m2]
    view: View
    room: str
    time: pd.Timestamp  # middle of the hour
    notes: tuple[str, ...]  # of systems and weather
    glare: GlareResult | None = None  # of a fisheye of the whole hemisphere
    radiance: NDArray[np.float32] | None = None  # [ny, nx, 3] [W/m2/sr] in colour


def room_picture(
    options: PictureOptions, progress: Progress = silent, files: PictureFiles | None = None
) -> RoomPicture:
    """The picture, path-traced; `DataError` where an input cannot be used.

    Args: files: what `read_files` has read of the options; read now without.
    """
    files = files or read_files(options)
    weather, hour = files.weather, files.hour

    def view_of(building: Building, space: Space) -> View:
        named = files.view or held_view(building, space)
        if named is None:
            return fisheye(*view_point(space, options.eye_height), options.size)
        check_eye(named, space)
        return fitted(named.view, options.size)

    steps = part(progress, 0.0, 0.4)
    viewed = read_viewed_room(
        options.building, options.space, options.join, files.given, view_of, steps,
        furniture=options.furniture,
        apertures=options.apertures,
        surroundings=options.surroundings,
        surroundings_offset=options.surroundings_offset,
        colour=options.colour,
        month=int(weather.midpoints[hour].month),
    )  # fmt: skip
    variants.activate()
    sampling = Sampling(picture_samples=options.samples, seed=options.seed)
    place = {"sun_model": options.sun_model, "ground": options.sky_ground}
    sky = annual_sky(weather, sampling.subdivision, hours=[hour], **place)
    light = PathLight(viewed.scene, viewed.optics, sky, sampling)
    end = 0.7 if options.colour else 1.0
    view, steps, rated = viewed.scene.view, part(progress, 0.4, end, "picture"), None
    if view.covers_hemisphere:
        rating = GlareOptions(grouping=options.glare_sources, sun=options.glare_sun)
        [(luminance, rated)] = rated_pictures(light, [0], options=rating, progress=steps)
    else:
        luminance = path_picture(light, 0, progress=steps)
    notes = (*viewed.notes(), *weather.notes)
    radiance = None
    if options.colour:
        steps = part(progress, end, 1.0, "colour")
        radiance = coloured_picture(
            luminance, viewed.bands, viewed.optics, sky, 0, sampling=sampling, progress=steps
        )
    middle = weather.midpoints[hour]
    return RoomPicture(luminance, view, viewed.space.label, middle, notes, rated, radiance)


def write_picture(picture: RoomPicture, path: Path, *, print_like: bool = False) -> None:
    """Write `.hdr`, `.exr`, or `.png`: falsecolour, or tone-mapped if `print_like` or in colour."""
    title = f"{picture.room}, {picture.time:%d %B %H:%M}"
    pixels = picture.luminance if picture.radiance is None else picture.radiance
    if path.suffix == ".hdr":
        write_hdr(path, pixels, picture.view, comments=(title,))
    elif path.suffix == ".exr":
        from mitsuba_cfs.images.exr import write_exr

        write_exr(path, pixels, picture.view, comment=title)
    elif path.suffix == ".png" and (print_like or pixels.ndim == 3):
        write_tone_mapped(path, pixels, scale=True, title=title)
    elif path.suffix == ".png":
        seen = pixel_directions(picture.view)[1]
        write_falsecolour(path, picture.luminance, title=title, seen=seen)
    else:
        raise ValueError(f"{path}: expected one of {', '.join(SUFFIXES)}")
