"""The small files and choices of a picture, read and checked before its building is."""

from __future__ import annotations

from dataclasses import dataclass

from mitsuba_cfs.errors import DataError
from scenes import input_files
from scenes.picture_options import PictureOptions
from scenes.room.picture_hours import hour_of
from scenes.room_views import NamedView, parsed_views


@dataclass(frozen=True, slots=True)
class PictureFiles:
    """Contents of the files of a picture, all but the building."""

    inputs: input_files.InputFiles
    hour: int  # of the year
    view: NamedView | None  # None: the room's middle, to its biggest window


def read_files(options: PictureOptions) -> PictureFiles:
    """The view, the hour and the system of a picture, the quick ones first.

    Raises: `DataError` for a file that cannot be used, `PictureHourError` for a wrong hour.
    """
    view = None if options.view is None else parsed_view(options.view)
    files = input_files.read_files(options, light_only=True, temperatures=False)
    return PictureFiles(files, hour_of(options.at, files.weather.midpoints, "--at"), view)


def parsed_view(text: str) -> NamedView:
    """The view of a text, or of the first line of a file that holds one.

    Raises: `DataError` for one that cannot be traced.
    """
    view = parsed_views(text)[0]
    if view.view.kind == "parallel":  # one eye's rays in one direction: one colour all over
        message = "a parallel view (-vtl) is not traced; expected -vtv, -vtc, -vth, -vta or -vts"
        raise DataError(message, field="--view")
    return view
