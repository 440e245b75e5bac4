"""The sun's disc in path-traced pictures: in their pixels, or as a separate glare source."""

from __future__ import annotations

from collections.abc import Callable

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.glare.sun_disc import SunDisc, seen_disc
from mitsuba_cfs.images.view import View, pixel_directions, pixel_solid_angles
from mitsuba_cfs.trace.kernels.sampling import vectors
from mitsuba_cfs.trace.kernels.scene import TracedScene
from mitsuba_cfs.trace.paths.scene import PathTracingScene, Sky
from mitsuba_cfs.trace.paths.sun import by_plane, straight_to_sky
from mitsuba_cfs.trace.sun.pixels import before_eye, disc_in_view, disc_parts, disc_rays, disc_reach

DISC_STEP = np.radians(0.005)  # between rays to the sun's disc


def disc_seen(room: PathTracingScene, sky: Sky, view: View) -> SunDisc | None:
    """The sun's disc as the eye sees it through the straight beam; None where it is hidden."""
    sun, radiance = sky.sun.numpy().ravel(), float(sky.sun_radiance.numpy()[0])
    directions, counts = pixel_directions(view)
    shown = directions.reshape(-1, 3)[counts.reshape(-1)]
    if not radiance or not disc_in_view(shown, sun, pixel_size(view)):
        return None
    ways = disc_parts(sun)
    return seen_disc(ways, _straight(room, view, ways) * before_eye(view, ways) * radiance)


def with_disc(
    picture: NDArray[np.float32], room: PathTracingScene, sky: Sky, view: View
) -> NDArray[np.float32]:
    """A picture [ny, nx] with the disc added to its pixels."""
    whole = picture.astype(float).ravel()
    add_disc(whole, room, sky, view)
    return whole.astype(np.float32).reshape(picture.shape)


def add_disc(picture: NDArray[np.float64], room: PathTracingScene, sky: Sky, view: View) -> None:
    """Add the disc seen through the straight beam to pixels [ny * nx], by its share of each."""
    sun = sky.sun.numpy().ravel()
    _add(picture, sky, view, sun, lambda ways: _straight(room, view, ways))


def add_mirrored_discs(
    picture: NDArray[np.float64], room: PathTracingScene, sky: Sky, view: View
) -> None:
    """Add the images of the disc in smooth mirrors to pixels [ny * nx]."""
    sun = sky.sun.numpy().ravel()
    for tracer in (room.inside, room.outside):
        for plane in [] if tracer.gloss is None else tracer.gloss.mirrors:
            normal = tracer.gloss.normals[plane]
            turned = sun - 2 * (sun @ normal) * normal
            _add(picture, sky, view, turned, _by_plane(room, view, tracer, int(plane)))


def _by_plane(
    room: PathTracingScene, view: View, tracer: TracedScene, plane: int
) -> Callable[[NDArray[np.float64]], NDArray[np.float32]]:
    """Transmittance [n] from the eye in directions [n, 3] by a mirror plane to the sky."""
    normal = tracer.gloss.normals[plane]

    def shown(ways: NDArray[np.float64]) -> NDArray[np.float32]:
        onwards = ways - 2 * (ways @ normal)[:, None] * normal
        towards, beyond = (vectors(v) for v in (ways, onwards))
        return by_plane(
            room, tracer, mi.Int32(plane), eye_of(room, view), towards, onwards=beyond,
            outdoors=mi.Bool(False), active=dr.full(mi.Bool, True, len(ways)),
        ).numpy()  # fmt: skip

    return shown


def _add(
    picture: NDArray[np.float64],
    sky: Sky,
    view: View,
    sun: NDArray[np.float64],
    passed: Callable[[NDArray[np.float64]], NDArray[np.float32]],
) -> None:
    """Add a disc about `sun`; `passed`: transmittance in each direction."""
    size = pixel_size(view)
    directions, counts = pixel_directions(view)
    shown = np.flatnonzero(counts.reshape(-1))
    near = shown[directions.reshape(-1, 3)[shown] @ sun > np.cos(disc_reach(size))]
    pixel, way, share = disc_rays(view, near, np.tile(sun, (len(near), 1)), size, step=DISC_STEP)
    if not len(pixel) or not sky.sun_radiance.numpy()[0]:
        return
    seen = np.bincount(pixel, passed(way), minlength=len(near))
    picture[near] += seen * share * sky.sun_radiance.numpy()[0]


def _straight(room: PathTracingScene, view: View, ways: NDArray[np.float64]) -> NDArray[np.float32]:
    """Transmittance [n] from the eye straight to the sky in directions [n, 3]."""
    towards = vectors(ways)
    active = dr.full(mi.Bool, True, len(ways))
    return straight_to_sky(room, eye_of(room, view), towards, mi.Bool(False), active).numpy()


def pixel_size(view: View) -> float:
    """The largest angle [rad] across a pixel."""
    return float(np.sqrt(pixel_solid_angles(view).max()))


def eye_of(room: PathTracingScene, view: View) -> mi.Point3f:
    """The eye in the tracer's coordinates."""
    return room.inside.place(view.position)
