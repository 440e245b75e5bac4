"""The views that are rated: given ones, or a grid of eyes that look in several directions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bim.model import Space
from bim.sensors import sensor_grid, view_point
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.images.view import View, fisheye
from scenes.room_views import NamedView, check_eye, given_views
from scenes.year_of_glare.options import YearOptions

MARGIN = 0.5  # [m] of the grid of eyes from the walls


def chosen_views(space: Space, options: YearOptions) -> list[NamedView]:
    """Every view of the options; without any the room's middle towards its biggest window."""
    found = rated_views(options) if options.views else _grid(space, options)
    for each in found:
        check_eye(each, space)
    return found


def rated_views(options: YearOptions) -> list[NamedView]:
    """The views that the options state; they can be read and rated before a room is known."""
    found = [view for text in options.views for view in given_views(text, options.size)]
    for each in found:
        _check_kind(each)
    return found


def _grid(space: Space, options: YearOptions) -> list[NamedView]:
    """Eyes all over the room, or in its middle, and the directions of each."""
    middle, towards = view_point(space, options.eye_height)
    eyes = middle[None]
    if options.grid is not None:
        eyes, _ = sensor_grid(space, options.grid, options.eye_height, MARGIN)
    found = []
    for e, eye in enumerate(eyes):
        for d in range(options.directions):
            direction = turned(towards, 2 * np.pi * d / options.directions)
            view = fisheye(eye, direction, options.size)
            found.append(NamedView(f"eye{e + 1:03d}_{d + 1}", view))
    return found


def turned(direction: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """A direction [3] turned about the vertical, counter-clockwise seen from above."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = direction
    return np.array([c * x - s * y, s * x + c * y, z])


def _check_kind(each: NamedView) -> None:
    """Refuse views whose glare would mean nothing."""
    view = each.view
    if view.kind not in ("angular", "hemispherical"):
        raise DataError(
            f"{each.name} is a {view.kind} view: expected a fisheye (-vta or -vth)", field="--view"
        )
    if min(view.horizontal_deg, view.vertical_deg) < 180:
        raise DataError(
            f"{each.name} shows {view.horizontal_deg:g} x {view.vertical_deg:g} degrees: "
            "expected 180 x 180 (-vh 180 -vv 180)",
            field="--view",
        )


def shown_as(view: View, size: int) -> View:
    """The view in pictures of another size."""
    return replace(view, width=size, height=size)
