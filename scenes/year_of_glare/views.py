"""The views that are rated: given ones, or a grid of eyes that look in several directions."""

from __future__ import annotations

from bim.model import Building, Space
from mitsuba_cfs.errors import DataError
from scenes import input_files
from scenes.input_files import InputFiles
from scenes.room_views import NamedView, check_eye, eyes_of, held_fisheyes, parsed_views
from scenes.year_of_glare.options import YearOptions


def chosen_views(building: Building, space: Space, options: YearOptions) -> list[NamedView]:
    """Every view of the options; without any those that the building's file holds for the room.

    Where it holds none, the room's middle towards its biggest window.
    """
    eyes = rated_views(options)
    if not eyes and options.grid is None and options.directions == 1:
        eyes = held_fisheyes(building, space, options.size)
    eyes = eyes or eyes_of(space, options.grid, options.directions, options.eye_height, options.size)
    for each in eyes:
        check_eye(each, space)
    return eyes


def rated_views(options: YearOptions) -> list[NamedView]:
    """The views that the options state; they can be read and rated before a room is known."""
    result = [view for text in options.views for view in parsed_views(text, options.size)]
    for each in result:
        _check_kind(each)
    return result


def read_files(options: YearOptions) -> InputFiles:
    """The small files of a year of glare; its views are checked too, before the building is read.

    Raises: `DataError` for what cannot be used.
    """
    rated_views(options)
    return input_files.read_files(options, light_only=True, temperatures=False)


def _check_kind(each: NamedView) -> None:
    """Refuse views whose glare would mean nothing."""
    view = each.view
    if not view.is_fisheye:
        raise DataError(f"{each.name} is a {view.kind} view: expected a fisheye (-vta or -vth)", field="--view")
    if not view.covers_hemisphere:
        raise DataError(
            f"{each.name} shows {view.horizontal_deg:g} x {view.vertical_deg:g} degrees: "
            "expected 180 x 180 (-vh 180 -vv 180)",
            field="--view",
        )
