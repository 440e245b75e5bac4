"""Glare of a room's seats by pictures of the year, for the rules that limit it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.light import with_view
from mitsuba_cfs.metrics.schedules import working_hours
from mitsuba_cfs.progress import Progress, part, silent
from scenes.comply.findings import SeatGlare
from scenes.room.glare import rating_of
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight
from scenes.room_views import eyes_of


def seat_glare(
    room: RoomInputs,
    light: RoomLight,
    state: NDArray[np.int64] | None,
    *,
    grid: float | None,
    directions: int,
    eye_height: float,
    progress: Progress = silent,
) -> SeatGlare:
    """DGP of every hour of use at each seat of a room.

    Args:
        state: [G, L] of the window groups in each lit hour; None: the first all year.
        grid, directions, eye_height: of the eyes, see `scenes.room_views.eyes_of`.
    """
    used = working_hours(room.weather, *room.options.occupancy.hours)
    lit = np.flatnonzero(used[room.skies.lit])
    views = eyes_of(room.space, grid, directions, eye_height, room.options.outputs.picture_size)
    rows = []
    for number, each in enumerate(views):
        steps = part(progress, number / len(views), (number + 1) / len(views), "annual glare")
        rated = hourly_glare(
            with_view(light.light, each.view), "DGP", state, hours=lit,
            options=rating_of(room.options.outputs), progress=steps,
        )  # fmt: skip
        whole = np.zeros(room.skies.hours)
        whole[room.skies.lit[lit]] = rated.dgp
        rows.append(whole[used])
    return SeatGlare(
        np.array([each.view.position for each in views]),
        np.array([each.view.direction for each in views]),
        np.stack(rows),
        state is not None,
    )
