"""One picture of a room under one hour's sky, from files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from bim.ifc.building import STAGES, read_ifc
from bim.sensors import view_point
from bim.to_tracer import exterior_surfaces, interior_surfaces
from mitsuba_cfs import variants
from mitsuba_cfs.images.hdr import write_hdr
from mitsuba_cfs.images.view import View, fisheye, fitted, pixel_directions
from mitsuba_cfs.matrices.cache import MatrixCache
from mitsuba_cfs.methods.path_light import PathSystems
from mitsuba_cfs.methods.sampling import Sampling
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.progress import Progress, part, silent, summed
from mitsuba_cfs.sky.annual import annual_sky
from scenes.fenestration import fill_windows, source_notes, window_sources
from scenes.job.drawn_shades import traced_building
from scenes.job.holes import hole_notes
from scenes.job.inputs import chosen_spaces
from scenes.job.windows import room_windows
from scenes.picture_files import PictureFiles, read_files
from scenes.picture_options import SUFFIXES, PictureOptions
from scenes.pictures import write_falsecolour, write_tone_mapped
from scenes.room_views import check_eye


@dataclass(frozen=True, slots=True)
class RoomPicture:
    """A picture and what it is of."""

    luminance: NDArray[np.float32]  # [ny, nx] [cd/m2]
    view: View
    room: str
    time: pd.Timestamp  # middle of the hour
    notes: tuple[str, ...]  # of systems and weather


def room_picture(
    options: PictureOptions, progress: Progress = silent, files: PictureFiles | None = None
) -> RoomPicture:
    """The picture, path-traced; `DataError` where an input cannot be used.

    Args: files: what `read_files` has read of the options; read now without.
    """
    files = files or read_files(options)
    weather, hour = files.weather, files.hour
    reading = summed(part(progress, 0.0, 0.4), "inputs", STAGES)
    building = read_ifc(options.building, join=options.join, progress=reading)
    names = () if options.space is None else (options.space,)
    space = chosen_spaces(building, names, options.building)[0]
    view = fisheye(*view_point(space, options.eye_height), options.size)
    if files.view is not None:
        check_eye(files.view, space)
        view = fitted(files.view.view, options.size)
    filled = fill_windows(space.windows, files.given, options.building)
    filled = {guid: states[:1] for guid, states in filled.items()}
    windows = room_windows(space, filled)
    building = traced_building(building, filled)
    variants.activate()
    scene = DaylightScene(
        interior_surfaces(space, "visible"),
        exterior_surfaces(building, space, "visible"),
        windows.groups,
        view=view,
    )
    sampling = Sampling(picture_samples=options.samples, seed=options.seed)
    light = PathSystems(scene, windows.optics(), sampling).light(
        annual_sky(weather, sampling.subdivision, hours=[hour])
    )
    luminance = light.picture(0, progress=part(progress, 0.4, 1.0, "picture"))
    return RoomPicture(
        luminance, view, space.label, weather.midpoints[hour],
        (*source_notes(window_sources(space.windows, filled)),
         *dict.fromkeys(note for (system,) in filled.values() for note in system.notes),
         *weather.notes, *hole_notes(space, cache=MatrixCache.of_user())),
    )  # fmt: skip


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
