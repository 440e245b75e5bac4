"""The small files and choices of a picture, read and checked before its building is."""

from __future__ import annotations

from dataclasses import dataclass

from bim.building_file import check_building_file
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.systems import Given, given_light
from scenes.picture_options import PictureOptions
from scenes.room.picture_hours import hour_of
from scenes.room_views import NamedView, given_views
from scenes.run.files import check_names
from scenes.run.inputs import read_weather


@dataclass(frozen=True, slots=True)
class PictureFiles:
    """What the files of a picture hold, all but the building."""

    weather: Weather
    hour: int  # of the year
    view: NamedView | None  # None: the room's middle, to its biggest window
    given: Given  # what fills the windows, by flag


def read_files(options: PictureOptions) -> PictureFiles:
    """The hour, the view and the system of a picture, the quick ones first.

    Raises: `DataError` for a file that cannot be used, `PictureHourError` for a wrong hour.
    """
    check_building_file(options.building)
    check_names(() if options.space is None else (options.space,))
    view = None if options.view is None else given_view(options.view)
    weather = read_weather(options.weather)
    hour = hour_of(options.at, weather.midpoints, "--at")
    return PictureFiles(weather, hour, view, given_light(options.system))


def given_view(text: str) -> NamedView:
    """The view of a text, or of the first line of a file that holds one.

    Raises: `DataError` for one that cannot be traced.
    """
    given = given_views(text)[0]
    if given.view.kind == "parallel":  # one eye's rays in one direction: one colour all over
        message = "a parallel view (-vtl) is not traced; expected -vtv, -vtc, -vth, -vta or -vts"
        raise DataError(message, field="--view")
    return given
