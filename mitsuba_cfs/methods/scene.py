"""A scene in the dissertation's sense: room and outdoors, without what fills the windows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.images.view import View
from mitsuba_cfs.surfaces import Surfaces, WindowGroup


def _nowhere() -> NDArray[np.float64]:
    return np.empty((0, 3))


@dataclass(frozen=True, slots=True)
class RoomBeyond:
    """The room that a window group of another one looks into; of some groups it may be the same."""

    scene: DaylightScene  # its interior without the glass that is looked through
    transmission: tuple[NDArray[np.float64], ...]  # [G][K, K] T of its window groups
    beam: NDArray[np.float64]  # [K] what goes straight on through the group that looks into it


@dataclass(frozen=True, slots=True)
class DaylightScene:
    """What light meets, the sensors it is taken at, and an eye."""

    interior: Surfaces
    exterior: Surfaces
    groups: Sequence[WindowGroup]  # axis G
    points: NDArray[np.float64] = field(default_factory=_nowhere)  # [S, 3] [m]
    normals: NDArray[np.float64] = field(default_factory=_nowhere)  # [S, 3]
    view: View | None = None  # of the eye whose glare is rated
    beyond: tuple[RoomBeyond, ...] = ()  # what the last of the groups look into, else outdoors

    def __post_init__(self) -> None:
        if self.points.shape != self.normals.shape or self.points.shape[1:] != (3,):
            raise ValueError(
                f"points {self.points.shape}, normals {self.normals.shape}: expected [S, 3] both"
            )

    @property
    def outdoor_groups(self) -> Sequence[WindowGroup]:
        """The groups that look outdoors: the first ones."""
        return self.groups[: len(self.groups) - len(self.beyond)]

    def sensors(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions and directions [S + 1, 3] of sensors, the eye last; [S, 3] without a view."""
        if self.view is None:
            return self.points, self.normals
        eye, direction = (
            np.asarray(a, dtype=float)[None] for a in (self.view.position, self.view.direction)
        )
        return np.concatenate([self.points, eye]), np.concatenate([self.normals, direction])
