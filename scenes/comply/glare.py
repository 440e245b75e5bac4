"""Glare of a room's seats for the rules that limit it, by pictures where a glare map leaves the verdict open."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.glare.classes import hour_not_exceeded
from mitsuba_cfs.images.view import View, fisheye
from mitsuba_cfs.methods.glare import hourly_glare
from mitsuba_cfs.methods.light import with_view
from mitsuba_cfs.progress import Progress, part, silent
from scenes.comply.findings import SeatGlare
from scenes.results import MAP_ERROR
from scenes.room.glare import glare_map, rating_of
from scenes.room.inputs import RoomInputs
from scenes.room.light import RoomLight
from scenes.room_views import eyes_of

PICTURED = 2  # seats of a map whose hours are rated by pictures, at most


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
    """DGP of every hour of use at each seat of a room, by pictures.

    Args:
        state: [G, L] of the window groups in each lit hour; None: the first all year.
        grid, directions, eye_height: of the eyes, see `scenes.room_views.eyes_of`.
    """
    used = room.occupied
    lit = np.flatnonzero(used[room.skies.lit])
    views = eyes_of(room.space, grid, directions, eye_height, room.options.outputs.picture_size)
    rows = []
    for number, each in enumerate(views):
        steps = part(progress, number / len(views), (number + 1) / len(views), "annual glare")
        whole = np.zeros(room.skies.hours)
        whole[room.skies.lit[lit]] = _by_pictures(room, light, each.view, state, lit, steps)
        rows.append(whole[used])
    return SeatGlare(
        np.array([each.view.position for each in views]),
        np.array([each.view.direction for each in views]),
        np.stack(rows),
        state is not None,
    )


def worst_seat_glare(
    room: RoomInputs,
    light: RoomLight,
    state: NDArray[np.int64] | None,
    *,
    limits: Iterable[tuple[float, float]],
    eye_height: float,
    progress: Progress = silent,
) -> SeatGlare:
    """DGP of every hour of use at the worst seats of a room's glare map.

    Hours that may decide a limit are rated by pictures, see `open_hours`; others have the map's DGP.

    Args:
        state: [H, G] of the window groups; None: the first all year.
        limits: of DGP, each with the share of the hours of use that may exceed it.
    """
    moved = state is not None
    if state is None:
        state = np.zeros((room.skies.hours, len(room.windows.groups)), dtype=np.int64)
    plan, of_map = glare_map(room, light, state, eye_height=eye_height, progress=progress)
    worst = plan.worst(PICTURED)
    dgp = np.stack([of_map[seat] for seat in worst]).astype(float)
    known = open_hours(dgp, limits)
    used = np.flatnonzero(room.occupied)
    column = np.searchsorted(room.skies.lit, used)  # of the hours of use among the lit ones
    lit = np.isin(used, room.skies.lit)
    for number, (e, n) in enumerate(worst):
        hours = np.flatnonzero(known[number] & lit)
        if not len(hours):
            continue
        view = fisheye(plan.eyes[e], plan.directions[n], room.options.outputs.picture_size)
        steps = part(progress, number / len(worst), (number + 1) / len(worst), "annual glare")
        dgp[number, hours] = _by_pictures(room, light, view, light.states(state), column[hours], steps)
    seats, ways = np.array(worst).T
    return SeatGlare(plan.eyes[seats], plan.directions[ways], dgp, moved, plan, (known & lit).sum(axis=1))


def _by_pictures(
    room: RoomInputs,
    light: RoomLight,
    view: View,
    state: NDArray[np.int64] | None,
    hours: NDArray[np.int64],
    progress: Progress,
) -> NDArray[np.float64]:
    """DGP of a view in some of the lit hours [n]; state: [G, L] of all of them."""
    options = rating_of(room.options.outputs)
    seen = with_view(light.light, view)
    return hourly_glare(seen, "DGP", state, hours=hours, options=options, progress=progress).dgp


def open_hours(
    dgp: NDArray[np.float64], limits: Iterable[tuple[float, float]], error: float = MAP_ERROR
) -> NDArray[np.bool_]:
    """The hours [V, U] whose exact DGP may decide whether some seat exceeds a limit.

    A limit is decided where the DGP that its share of the hours exceeds is further from it than the
    error at the worst seat.  Else it is open at the seats that may exceed it, in the hours whose DGP
    is within the error of it.

    Args: dgp: [V, U] of seats in the hours of use, within the error; limits: as of `worst_seat_glare`.
    """
    found = np.zeros(dgp.shape, dtype=bool)
    for limit, share in limits:
        reached = np.array([hour_not_exceeded(row, share) for row in dgp])
        if reached.max() <= limit + error:
            possible = reached > limit - error
            found |= possible[:, None] & (np.abs(dgp - limit) <= error)
    return found
