"""Measurements of sensors on the facade and the roof of a room: beam, irradiance, illuminance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bim.to_tracer import exterior_surfaces
from mitsuba_cfs.sky.sun import is_up, sun_directions
from mitsuba_cfs.surfaces import Surfaces, even_numbers, points_on_triangles
from mitsuba_cfs.trace.matrices.daylight import sky_irradiance_matrix
from mitsuba_cfs.trace.sun.shade import sunlit_shares
from scenes.room.inputs import RoomInputs

FloatArray = NDArray[np.float64]
SUN_POINTS = 64  # on each window group, for its sunlit share
DISC_RAYS = 4  # from each of them
CLEAR = 0.01  # [m] of a sensor outside the glass


def window_beam(room: RoomInputs, *, shaded: bool) -> FloatArray:
    """The sun's direct irradiance of each window group in every hour [H, G] [W/m2].

    Args: shaded: by the surroundings; else as if there were none.
    """
    sun, groups = sun_directions(room.weather), room.windows.groups
    normals = np.stack([group.frame[2] for group in groups])
    # an hour of sunset has a beam in the weather, although the sun has set in its middle
    direct = np.where(is_up(sun), room.weather.direct_normal, 0.0)
    beam: FloatArray = direct[:, None] * np.maximum(sun @ normals.T, 0.0)
    if not shaded:
        return beam
    points = np.concatenate(
        [
            points_on_triangles(np.concatenate([w.triangles for w in group.windows]), even_numbers(SUN_POINTS))[0]
            for group in groups
        ]
    )
    facing = np.repeat(normals, SUN_POINTS, axis=0)
    for number, season in enumerate(room.seasons):
        exterior = exterior_surfaces(season.building, room.space, "solar")
        hours = np.flatnonzero((beam > 0).any(axis=1) & (room.season_of_year == number))
        if len(hours) and len(exterior.triangles):
            lit = sunlit_shares(
                exterior, points, facing, sun[hours], samples=DISC_RAYS, seed=room.options.sampling.seed
            )
            beam[hours] *= lit.reshape(len(groups), SUN_POINTS, -1).mean(axis=1).T
    return beam


def roof_irradiance(room: RoomInputs, *, horizontal: bool = False) -> FloatArray:
    """Irradiance of the window groups, or of a level sensor, without surroundings [H, G] [W/m2]."""
    matrix = _sensor_matrix(room, Surfaces.none(), horizontal=horizontal)
    lit: FloatArray = (matrix @ np.asarray(room.skies.solar)).astype(float)
    return room.skies.whole_year(lit).T


def facade_illuminance(room: RoomInputs, sensor: str) -> FloatArray:
    """Illuminance in the middle of the glass of the window groups [H, G] [lx].

    Args: sensor: "window", "roof" without surroundings, or "horizontal" on the roof.
    """
    sky, season = np.asarray(room.skies.whole), room.season_of_year[room.skies.lit]
    lit = np.zeros((len(room.windows.groups), sky.shape[1]))
    for number, one in enumerate(room.seasons):
        around = Surfaces.none()
        if sensor == "window":
            around = exterior_surfaces(one.building, room.space, "visible")
        hours = season == number
        matrix = _sensor_matrix(room, around, horizontal=sensor == "horizontal")
        lit[:, hours] = matrix @ sky[:, hours]
    return room.skies.whole_year(lit).T


def _sensor_matrix(room: RoomInputs, around: Surfaces, *, horizontal: bool) -> FloatArray:
    """Irradiance of sensors in the middle of the window groups per radiance of a patch [G, P]."""
    sampling, groups = room.options.sampling, room.windows.groups
    centres = [np.mean([w.triangles.mean(axis=(0, 1)) for w in g.windows], axis=0) for g in groups]
    normals = np.stack([g.frame[2] for g in groups])
    points = np.stack(centres) + CLEAR * normals
    if horizontal:  # one sensor for all
        points, normals = points[:1], np.array([[0.0, 0.0, 1.0]])
    values: FloatArray = sky_irradiance_matrix(
        around, points, normals, subdivision=sampling.subdivision, seed=sampling.seed, cache=room.cache
    ).values
    return np.tile(values, (len(groups), 1)) if horizontal else values
