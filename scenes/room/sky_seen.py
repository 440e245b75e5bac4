"""How much of the sky a room's outer faces and windows see, for their longwave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bim.outer_faces import OuterFaces
from bim.to_thermal import ThermalRoom
from mitsuba_cfs.matrices.cache import MatrixCache, kept_or_found
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.estimate import cache_entry
from mitsuba_cfs.trace.matrices.view_factors import sky_shares

SAMPLES = 4096  # rays from each surface and window


def under_the_sky(
    room: ThermalRoom,
    outer: OuterFaces,
    exteriors: Sequence[tuple[Surfaces, float]],
    *,
    seed: int = 0,
    cache: MatrixCache | None = None,
) -> ThermalRoom:
    """The room, its outer faces and windows with the share of the sky that they see.

    Args:
        exteriors: what stands outdoors, and the share of the year in which it does.
        cache: where the shares are found and kept.
    """
    points = np.concatenate([outer.points, outer.windows])
    normals = np.concatenate([outer.normals, outer.window_normals])
    if not len(points) or not any(len(exterior.triangles) for exterior, _ in exteriors):
        return room

    def seen(exterior: Surfaces) -> NDArray[np.float64]:
        inputs, by = (exterior.triangles, points, normals, SAMPLES, seed), sky_shares.__module__
        entry = cache_entry(cache, "sky shares", *inputs, by=by, stopping=None)
        return kept_or_found(
            entry,
            lambda: sky_shares(exterior, points, normals, samples=SAMPLES, seed=seed)[:, None],
        )[:, 0]

    shares = sum(share * seen(exterior) for exterior, share in exteriors).tolist()
    zone, surfaces = room.zone, list(room.zone.surfaces)
    for number, share in zip(outer.surfaces, shares, strict=False):  # the windows' follow
        surfaces[number] = replace(surfaces[number], sky_seen=share)
    windows = tuple(
        replace(window, sky_seen=share)
        for window, share in zip(zone.windows, shares[len(outer.surfaces) :], strict=True)
    )
    return replace(room, zone=replace(zone, surfaces=tuple(surfaces), windows=windows))
