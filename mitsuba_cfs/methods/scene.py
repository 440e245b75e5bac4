"""A scene, room and outdoors without what fills the windows, and how finely it is computed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import check_number
from mitsuba_cfs.images.view import View
from mitsuba_cfs.surfaces import SurfaceGroups, Surfaces, WindowGroup


def _no_points() -> NDArray[np.float64]:
    return np.empty((0, 3))


@dataclass(frozen=True, slots=True)
class AdjacentRoom:
    """The adjacent room that a window group faces; several groups may share it."""

    scene: DaylightScene  # its interior without the glass that is looked through
    transmission: tuple[NDArray[np.float64], ...]  # [G][K, K] T of its window groups
    straight: tuple[NDArray[np.float64], ...]  # [G][K] what T's diagonal has of their beam
    beam: NDArray[np.float64]  # [K] direct transmittance of the group that looks into it


IN_FRONT = 0.01  # of a window's plane, from which a surface is not in it [m]


@dataclass(frozen=True, slots=True)
class DaylightScene:
    """Surfaces and window groups of a room, its outdoors, its sensors, and the view of an eye."""

    interior: Surfaces
    exterior: Surfaces
    groups: Sequence[WindowGroup]  # axis G
    points: NDArray[np.float64] = field(default_factory=_no_points)  # [S, 3] [m]
    normals: NDArray[np.float64] = field(default_factory=_no_points)  # [S, 3]
    view: View | None = None  # of the eye whose glare is rated
    adjacent: tuple[AdjacentRoom, ...] = ()  # behind the last groups; outdoors is behind the others
    by_groups: SurfaceGroups | None = None  # of the interior, by whose reflectances V is derived

    def __post_init__(self) -> None:
        if self.points.shape != self.normals.shape or self.points.shape[1:] != (3,):
            raise ValueError(f"points {self.points.shape}, normals {self.normals.shape}: expected [S, 3] both")
        if not (np.isfinite(self.points).all() and np.isfinite(self.normals).all()):
            raise ValueError("points and normals: expected finite numbers")
        if len(self.adjacent) > len(self.groups):
            raise ValueError(
                f"{len(self.adjacent)} adjacent rooms for {len(self.groups)} window groups: "
                "expected one for each group that looks into a room"
            )

        self._check_sides()

    def _check_sides(self) -> None:
        """Raise `ValueError` for a window whose normal points into the room: it would be dark."""
        corners = self.interior.triangles.reshape(-1, 3)
        for group in self.outdoor_groups:
            for window in group.windows:
                height = (corners - window.triangles[0, 0]) @ window.normal  # above the window's plane [m]
                if len(height) and height.max() > IN_FRONT and height.min() > -IN_FRONT:
                    raise ValueError(
                        f"window {window.name}: its normal points into the room; "
                        "expected vertices counter-clockwise seen from outdoors"
                    )

    @property
    def outdoor_groups(self) -> Sequence[WindowGroup]:
        """The groups that look outdoors: the first ones."""
        return self.groups[: len(self.groups) - len(self.adjacent)]

    @property
    def eye(self) -> View:
        """The view; `ValueError` where the scene has none."""
        if self.view is None:
            raise ValueError("the scene has no view: DaylightScene(..., view=fisheye(...))")
        return self.view

    def sensors(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions and directions [S + 1, 3] of sensors, the eye last; [S, 3] without a view."""
        if self.view is None:
            return self.points, self.normals
        eye, direction = (np.asarray(a, dtype=float)[None] for a in (self.view.position, self.view.direction))
        return np.concatenate([self.points, eye]), np.concatenate([self.normals, direction])


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampling:
    """Numbers of paths, the sky's patches and the seed; the defaults are those of `cfs`."""

    sensor_samples: int = 32_768  # paths of a sensor, for V
    patch_samples: int = 16_384  # paths of a window patch, for D
    # points on each window group for the direct sun and for its beam into the room; and points
    # outdoors for the sun that surfaces reflect
    sun_points: int = 1_024
    view_samples: int = 8  # paths of a pixel, for the matrices of a view; a tile shares them
    outdoor_samples: int = 8  # paths of a pixel straight through the windows
    picture_samples: int = 16  # point-in-time: paths of a pixel under one sky
    hour_samples: int = 2_048  # point-in-time: paths of a sensor under one sky
    subdivision: int = 4  # Reinhart's MF
    window_parts: int = 0  # of each group; 0: choose from the surroundings
    memory: float = 2 * 2**30  # [bytes] of a view's matrices; above it they are on disk
    seed: int = 0

    def __post_init__(self) -> None:
        for name in (
            "sensor_samples",
            "patch_samples",
            "sun_points",
            "view_samples",
            "outdoor_samples",
            "picture_samples",
            "hour_samples",
        ):
            check_number(name, getattr(self, name), 1, whole=True)
        check_number("subdivision", self.subdivision, 1, whole=True)  # Reinhart's MF
        for name in ("window_parts", "memory", "seed"):
            check_number(name, getattr(self, name), 0, whole=name != "memory")
