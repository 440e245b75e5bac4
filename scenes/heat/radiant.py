"""Traced view factors of a room: longwave between its surfaces, and what a person in it feels."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bim.model import Space
from bim.sensors import view_point
from bim.to_thermal import ThermalRoom
from mitsuba_cfs.matrices.cache import MatrixCache, cached_or_computed
from mitsuba_cfs.surfaces import Surfaces
from mitsuba_cfs.trace.kernels.estimate import cache_entry
from mitsuba_cfs.trace.matrices.view_factors import person_view_factors, view_factors
from thermal.balance import ZoneResult
from thermal.comfort import mean_radiant_temperature, operative_temperature, room_centre_mrt

FloatArray = NDArray[np.float64]
MOST_LOST = 0.05  # of the rays of a surface that may leave a room that is not quite closed


@dataclass(frozen=True, slots=True)
class RadiantRoom:
    """View factors of a room, N: the zone's surfaces, then its windows."""

    among: FloatArray  # [N, N] between the inside faces
    person: FloatArray  # [N] from somebody seated in the middle, facing the biggest window


def radiant_room(
    space: Space,
    room: ThermalRoom,
    *,
    samples: int = 16384,
    seed: int = 0,
    cache: MatrixCache | None = None,
) -> RadiantRoom | None:
    """Traced view factors of a room, or None where its surfaces do not close it.

    Args: cache: of traced view factors.
    """
    among, person = _view_factors(enclosure(space, room), *view_point(space), samples, seed, cache)
    if min(among.sum(axis=1).min(), person.sum()) < 1.0 - MOST_LOST:
        return None
    return RadiantRoom(among / among.sum(axis=1, keepdims=True), person / person.sum())


def _view_factors(
    parts: Surfaces,
    place: FloatArray,
    facing: FloatArray,
    samples: int,
    seed: int,
    cache: MatrixCache | None,
) -> tuple[FloatArray, FloatArray]:
    """View factors [N, N] among the parts and [N] from a person, traced or kept as one matrix."""
    inputs = (parts, place, facing, samples, seed)
    label, by = "view factors", view_factors.__module__
    entry = cache_entry(cache, label, *inputs, by=by, stopping=None)

    def traced() -> FloatArray:
        among = view_factors(parts, samples=samples, seed=seed)
        person = person_view_factors(parts, place, facing, samples=samples, seed=seed)
        return np.vstack([among, person])

    rows = cached_or_computed(entry, traced)
    return rows[:-1], rows[-1]


def enclosure(space: Space, room: ThermalRoom) -> Surfaces:
    """The triangles round a room's air, numbered by the zone's surfaces and then its windows."""
    parts = [*space.faces, *space.windows]
    windows = len(room.zone.surfaces) + np.arange(len(space.windows))
    number = np.concatenate([room.surface_of_face, windows])
    counts = [len(part.triangles) for part in parts]
    triangles = np.concatenate([part.triangles for part in parts])
    return Surfaces(triangles, np.zeros(len(triangles)), np.repeat(number, counts))


def felt(
    result: ZoneResult, radiant: RadiantRoom | None, rule: str, floor: int, air_speed: float
) -> ZoneResult:
    """The result with the mean radiant and operative temperatures of a rule.

    Args:
        rule: "view factors" (ISO 7726), "room centre" (the dissertation's mean of all surfaces and
            the floor) or "area" (weighted by area and emissivity).
        floor: the surface that is the floor.
        air_speed: [m/s] sets the weight of the air.
    """
    faces = np.concatenate([result.surface_in_c, result.window_inner_c], axis=1)
    if rule == "room centre":
        mrt = room_centre_mrt(faces, result.surface_in_c[:, floor])
    elif rule == "view factors" and radiant is not None:
        mrt = mean_radiant_temperature(faces, radiant.person)
    else:
        mrt = result.mrt_c
    operative = operative_temperature(result.air_c, mrt, air_speed)
    return replace(result, mrt_c=mrt, operative_c=operative)
