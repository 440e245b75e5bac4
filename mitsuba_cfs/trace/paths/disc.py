"""The sun's disc in path-traced pictures: in their pixels, or as a separate glare source."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.glare.sun_disc import SunDisc, seen_disc
from mitsuba_cfs.images.view import View, pixel_directions, pixel_solid_angles
from mitsuba_cfs.trace.kernels.sampling import vectors
from mitsuba_cfs.trace.paths.scene import PathTracingScene, Sky
from mitsuba_cfs.trace.paths.sun import by_mirror, straight_to_sky, through_window
from mitsuba_cfs.trace.sun.pixels import before_eye, disc_in_view, disc_parts, disc_rays, disc_reach
from mitsuba_cfs.trace.sun.specular_paths import SpecularPath, specular_sun_paths

Transmittance = Callable[[NDArray[np.float64]], NDArray[np.float32]]  # of directions [n, 3]
DISC_STEP = np.radians(0.005)  # between rays to the sun's disc


def discs_seen(room: PathTracingScene, sky: Sky, view: View) -> tuple[SunDisc, ...]:
    """The sun's disc and its images in smooth mirrors, as far as the eye sees them."""
    radiance, size = float(sky.sun_radiance.numpy()[0]), pixel_size(view)
    if not radiance:
        return ()
    directions, counts = pixel_directions(view)
    shown = directions.reshape(-1, 3)[counts.reshape(-1)]
    discs = []
    for sun, transmittance in _images(room, sky, view):
        if not disc_in_view(shown, sun, size):
            continue
        ways = disc_parts(sun)
        discs.append(seen_disc(ways, transmittance(ways) * before_eye(view, ways) * radiance))
    return tuple(disc for disc in discs if disc is not None)


def with_discs(picture: NDArray[np.float32], room: PathTracingScene, sky: Sky, view: View) -> NDArray[np.float32]:
    """A picture [ny, nx] with the disc and its images added to its pixels."""
    whole = picture.astype(float).ravel()
    add_discs(whole, room, sky, view)
    return whole.astype(np.float32).reshape(picture.shape)


def add_discs(picture: NDArray[np.float64], room: PathTracingScene, sky: Sky, view: View) -> None:
    """Add the disc and its images to pixels [ny * nx], by their shares of each."""
    size, radiance = pixel_size(view), float(sky.sun_radiance.numpy()[0])
    if not radiance:
        return
    directions, counts = pixel_directions(view)
    shown = np.flatnonzero(counts.reshape(-1))
    for sun, transmittance in _images(room, sky, view):
        near = shown[directions.reshape(-1, 3)[shown] @ sun > np.cos(disc_reach(size))]
        suns = np.tile(sun, (len(near), 1))
        pixel, way, share = disc_rays(view, near, suns, size, step=DISC_STEP)
        if len(pixel):
            seen = np.bincount(pixel, transmittance(way), minlength=len(near))
            picture[near] += seen * share * radiance


def _images(room: PathTracingScene, sky: Sky, view: View) -> Iterator[tuple[NDArray[np.float64], Transmittance]]:
    """Apparent direction [3] of the sun and transmittance from the eye, straight and by mirrors."""
    sun, gloss = sky.sun.numpy().reshape(1, 3).astype(float), room.inside.gloss
    for path in specular_sun_paths(room.outside):
        (apparent,) = path.apparent(sun)
        yield apparent, partial(_transmittance, room, view, path, None)
        for plane in [] if gloss is None else gloss.mirrors:
            normal = gloss.normals[plane]
            mirrored = apparent - 2 * (apparent @ normal) * normal
            yield mirrored, partial(_transmittance, room, view, path, int(plane))


def _transmittance(
    room: PathTracingScene, view: View, path: SpecularPath, plane: int | None, ways: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Transmittance [n] from the eye in directions [n, 3] to the sky.

    Args: path: from a window on; plane: mirror of the room that the eye looks at.
    """
    active, tau = dr.full(mi.Bool, True, len(ways)), mi.Float(1)
    position, towards = eye_of(room, view), vectors(ways)
    if plane is not None:
        number = mi.Int32(plane)
        tau, position, towards = by_mirror(room.inside, number, position, towards, active)
        active &= tau > 0
    if not path.mirrors:
        tau *= straight_to_sky(room, position, towards, mi.Bool(False), active)
    else:
        beam, start = through_window(room, position, towards, mi.Bool(False), active)
        tau *= beam * path.transmittance(mi.Ray3f(start, towards), active & (beam > 0))
    return dr.select(active, tau, 0.0).numpy()


def pixel_size(view: View) -> float:
    """The largest angle [rad] across a pixel."""
    return float(np.sqrt(pixel_solid_angles(view).max()))


def eye_of(room: PathTracingScene, view: View) -> mi.Point3f:
    """The eye in the tracer's coordinates."""
    return room.inside.place(view.position)
