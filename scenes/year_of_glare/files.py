"""The small files and choices of a year of glare, read and checked before its building is."""

from __future__ import annotations

from dataclasses import dataclass

from bim.building_file import check_building_file
from mitsuba_cfs.sky.weather import Weather
from scenes.fenestration.systems import Given, given_light
from scenes.run.files import check_names
from scenes.run.inputs import read_weather
from scenes.year_of_glare.options import YearOptions
from scenes.year_of_glare.views import rated_views


@dataclass(frozen=True, slots=True)
class YearFiles:
    """What the files of a year of glare hold, all but the building."""

    weather: Weather
    given: Given  # what fills the windows, by flag


def read_files(options: YearOptions) -> YearFiles:
    """The weather and the system of a year; its views are checked too.

    Raises: `DataError` for what cannot be used.
    """
    check_building_file(options.building)
    check_names(() if options.space is None else (options.space,))
    rated_views(options)
    return YearFiles(read_weather(options.weather), given_light(options.system))
