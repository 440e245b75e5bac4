"""Directions at a window: its local frame, and the azimuths that BSDF files index by.

World: x east, y north, z up.  Window frame: z is the exterior normal, y the up vector projected
on the window plane, x = y cross z (to the right for someone who looks at the facade from outside).

LBNL WINDOW XML files index directions by polar angle and azimuth.  In the window frame, for a unit
vector `d` that points from the window to where the light comes from, and `o` to where it goes,
on either side of the window and for transmission as for reflection:

    incident azimuth = atan2(-d_y, d_x)        outgoing azimuth = atan2(o_y, -o_x)

so that light which passes straight through (o = -d) keeps its index, and the sun above a vertical
window has azimuth 270 degrees.  The "Front" of a file is the exterior side.  Radiance's own BSDF
frame has z into the room: (x, y, z)_Radiance = (-x, y, -z) of ours.

Source: Radiance `BSDFdirections` note and `bsdf_m.c` (facts); tested against `pyradiance.bsdf`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def normalize(vectors: ArrayLike) -> NDArray[np.float64]:
    """Vectors [..., 3] scaled to unit length; `ValueError` for one without length."""
    vectors = np.asarray(vectors, dtype=float)
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    if not np.all(length > 0):
        raise ValueError("a direction has no length")
    return vectors / length


def sensors_of(points: ArrayLike, directions: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions [S, 3] and unit normals [S, 3] of sensors, also of a single one given as [3]."""
    points, directions = (np.atleast_2d(np.asarray(v, dtype=float)) for v in (points, directions))
    if points.shape != directions.shape or points.shape[1:] != (3,):
        raise ValueError(f"points {points.shape} and directions {directions.shape}: need [S, 3] each")
    return points, normalize(directions)


def default_up(normal: ArrayLike) -> NDArray[np.float64]:
    """World up [3], or north where the window is within half a degree of horizontal."""
    normal = normalize(normal)
    return np.array([0.0, 0.0, 1.0] if abs(normal[2]) < 0.99996 else [0.0, 1.0, 0.0])


def window_frame(normal: ArrayLike, up: ArrayLike | None = None) -> NDArray[np.float64]:
    """Rows x, y, z [3, 3] of the window frame: `frame @ v` takes a world vector to local."""
    z = normalize(normal)
    up = default_up(z) if up is None else normalize(up)
    y = normalize(up - (up @ z) * z)
    return np.stack([np.cross(y, z), y, z])


def incident_azimuth(d: ArrayLike) -> NDArray[np.float64]:
    """Azimuth [rad, 0..2 pi) of the local direction(s) [..., 3] that point to the light source."""
    d = np.asarray(d, dtype=float)
    return np.mod(np.arctan2(-d[..., 1], d[..., 0]), 2 * np.pi)


def outgoing_azimuth(o: ArrayLike) -> NDArray[np.float64]:
    """Azimuth [rad, 0..2 pi) of the local direction(s) [..., 3] along which light leaves."""
    o = np.asarray(o, dtype=float)
    return np.mod(np.arctan2(o[..., 1], -o[..., 0]), 2 * np.pi)
