"""A room's picture in colour, beside its luminance pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bim.model import COLOURS, Building, Space
from bim.to_tracer import exterior_surfaces, furnished_surfaces
from mitsuba_cfs.images.view import View
from mitsuba_cfs.methods.colour_view import coloured_picture, has_colour
from mitsuba_cfs.methods.optics import States
from mitsuba_cfs.methods.path_light import PathSystems
from mitsuba_cfs.methods.sampling import Sampling
from mitsuba_cfs.methods.scene import DaylightScene
from mitsuba_cfs.progress import Progress
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.surfaces import WindowGroup
from scenes.results import ColourPicture, GlareResults, LuminancePicture


def band_scenes(
    building: Building,
    space: Space,
    groups: Sequence[WindowGroup],
    view: View,
    bands: Sequence[str] = COLOURS,
) -> tuple[DaylightScene, ...]:
    """The scene of a room with a view in each band."""
    return tuple(
        DaylightScene(
            furnished_surfaces(space, band),
            exterior_surfaces(building, space, band),
            groups,
            view=view,
        )
        for band in bands
    )


def brightest_picture(glare: GlareResults) -> LuminancePicture:
    """The picture with most light at the eye."""
    return max(glare.pictures, key=lambda picture: picture.glare["ev"])


def with_colour(
    glare: GlareResults,
    bands: Sequence[DaylightScene],
    systems: Sequence[States],
    sky: AnnualSky,
    *,
    state: int,
    sampling: Sampling,
    progress: Progress,
) -> GlareResults:
    """The pictures with the brightest in colour; without it where that would be grey.

    Grey too is what no window of the room's own lights.

    Args:
        bands: the room's scene with its view by red, green and blue.
        sky: of the picture's hour alone.
        state: of the shading in that hour.
    """
    shown = brightest_picture(glare)
    if not bands[0].groups or not has_colour(bands, sky, 0):
        return glare
    filled = [PathSystems(band, systems, sampling) for band in bands]
    rgb = coloured_picture(
        shown.luminance, filled, sky, 0, state=[state] * len(systems), progress=progress
    )
    return replace(glare, colour=ColourPicture(shown.hour, rgb))
