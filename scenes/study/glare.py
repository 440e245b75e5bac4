"""Glare of a case in its occupied hours; what systems, orientations and climates share is traced
once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bim.model import Building, Space
from bim.sensors import view_point
from bim.to_tracer import exterior_surfaces, interior_surfaces, window_groups
from mitsuba_cfs.images.view import fisheye
from mitsuba_cfs.sky.weather import Weather
from scenes.job.inputs import System
from scenes.job.options import RoomOptions
from scenes.methods.methods import method_scene
from scenes.methods.place import Place, Quality, fenestration, skies_of
from scenes.study.case import Case

_last: dict[tuple, object] = {}  # one scene: the matrices of its pictures may take gigabytes


def occupied_glare(
    building: Building,
    space: Space,
    system: System,
    weather: Weather,
    hours: NDArray[np.int64],
    case: Case,
) -> NDArray[np.float64]:
    """DGP, eDGP or sDGP [h] by the case's method, in some hours of the year."""
    o = case.options
    key = (case.scene, o.method, case.glare, o.picture_size, quality(o))
    if key not in _last:
        _last.clear()
        _last[key] = method_scene(o.method, case.glare, place(building, space, o), quality(o))
    skies = skies_of(weather, hours, subdivision=o.sky_subdivision)
    behind = _last[key].behind(fenestration(system.visible, system.tree))
    return np.asarray(behind.values(skies), dtype=float)


def place(building: Building, space: Space, options: RoomOptions) -> Place:
    """The room as the glare methods take it: seen from its middle towards the biggest window."""
    nowhere = np.empty((0, 3))
    return Place(
        interior_surfaces(space, "visible"),
        exterior_surfaces(building, space, "visible"),
        window_groups(space),
        fisheye(*view_point(space), options.picture_size),
        nowhere,
        nowhere,
    )


def quality(options: RoomOptions) -> Quality:
    """The options of a room as those of the glare methods."""
    return Quality(
        pixel_samples=options.picture_samples,
        path_samples=max(options.picture_samples // 2, 4),
        sensor_samples=options.sensor_samples,
        patch_samples=options.patch_samples,
        subdivision=options.sky_subdivision,
        seed=options.seed,
    )
