"""One picture of a room under one hour's sky, from files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
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
from mitsuba_cfs.methods.glare import glare_with, rated_pictures
from mitsuba_cfs.methods.point_in_time import PathLight, path_picture
from mitsuba_cfs.methods.scene import Sampling
from mitsuba_cfs.progress import Progress, part, silent
from mitsuba_cfs.sky.annual import annual_sky
from scenes.fenestration.peaks import lobe_effect, lobe_notes
from scenes.head import NO_HEAD, Head
from scenes.inputs import first_states, read_inputs
from scenes.picture_files import PictureFiles, read_files
from scenes.picture_options import SUFFIXES, PictureOptions
from scenes.pictures import write_falsecolour, write_tone_mapped
from scenes.room_views import check_eye, held_view
from scenes.viewed_room import ViewedRoom, viewed_room

BOTH_WAYS = 200  # [px] of the pictures that compare a beam with a lobe


@dataclass(frozen=True, slots=True)
class RoomPicture:
    """A picture and what it is of."""

    luminance: NDArray[np.float32]  # [ny, nx] [cd/m2]
    view: View
    room: str
    time: pd.Timestamp  # middle of the hour
    head: Head = NO_HEAD  # what was left out, what was assumed
    notes: tuple[str, ...] = ()  # lost light, and what an undecided transmission peak does
    glare: GlareResult | None = None  # of a fisheye of the whole hemisphere
    radiance: NDArray[np.float32] | None = None  # [ny, nx, 3] [W/m2/sr] in colour


def room_picture(
    options: PictureOptions,
    progress: Progress = silent,
    files: PictureFiles | None = None,
    on_head: Callable[[Head], None] = lambda head: None,
) -> RoomPicture:
    """The picture, path-traced; `DataError` where an input cannot be used.

    Args:
        files: of `read_files`; read now by default.
        on_head: called with what was left out and assumed, before anything is traced.
    """
    files = files or read_files(options)
    hour = files.hour

    def view_of(building: Building, space: Space) -> View:
        named = files.view or held_view(building, space)
        if named is None:
            return fisheye(*view_point(space, options.eye_height), options.size)
        check_eye(named, space)
        return fitted(named.view, options.size)

    steps = part(progress, 0.0, 0.4)
    inputs = read_inputs(options, files.inputs, steps, rooms="first", states=first_states)
    weather = inputs.weather
    on_head(inputs.head)
    month = int(weather.midpoints[hour].month)
    viewed = viewed_room(inputs, view_of, colour=options.colour, month=month)
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
    radiance = None
    if options.colour:
        steps = part(progress, end, 1.0, "colour")
        radiance = coloured_picture(luminance, viewed.bands, viewed.tinted, sky, 0, sampling=sampling, progress=steps)
    middle = weather.midpoints[hour]
    notes = (*viewed.leaks(), *([] if rated is None else _as_lobe(light, viewed)))
    return RoomPicture(luminance, view, viewed.space.label, middle, inputs.head, notes, rated, radiance)


def _as_lobe(light: PathLight, viewed: ViewedRoom) -> tuple[str, ...]:
    """What an undecided transmission peak does to the picture's glare, in a small picture."""
    if viewed.lobes is None:
        return ()
    small = fitted(light.scene.eye, min(light.scene.eye.width, BOTH_WAYS))
    light, hour = replace(light, scene=replace(light.scene, view=small)), np.zeros(1, dtype=int)
    both = [glare_with(light, systems, hour) for systems in (light.systems, viewed.lobes)]
    return lobe_notes([lobe_effect(*both)])


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
        white = "; white balance: daylight outdoors" * (pixels.ndim == 3)
        write_tone_mapped(path, pixels, scale=True, title=title + white)
    elif path.suffix == ".png":
        seen = pixel_directions(picture.view)[1]
        write_falsecolour(path, picture.luminance, title=title, seen=seen)
    else:
        raise ValueError(f"{path}: expected one of {', '.join(SUFFIXES)}")
