"""What every method starts from: a place, skies, and how finely it is computed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.images.view import View
from mitsuba_cfs.sky.matrix import sky_matrix, sky_series
from mitsuba_cfs.sky.weather import Weather
from mitsuba_cfs.surfaces import Surfaces, WindowGroup

if TYPE_CHECKING:
    from mitsuba_cfs.trace.direct_sun import Scattering
    from mitsuba_cfs.trace.lit_room import System

METRICS = ("DGP", "eDGP", "sDGP", "illuminance")


@dataclass(frozen=True, slots=True)
class Place:
    """A scene in the dissertation's sense: outdoors and room, without the fenestration."""

    interior: Surfaces
    exterior: Surfaces
    groups: Sequence[WindowGroup]
    view: View  # of the eye whose glare is rated
    points: NDArray[np.float64]  # [S, 3] of the work plane, for the metric illuminance
    normals: NDArray[np.float64]  # [S, 3]

    def sensors(self, metric: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Points and directions [S, 3] where a metric needs illuminance; none for DGP."""
        if metric == "illuminance":
            return self.points, self.normals
        count = 0 if metric == "DGP" else 1
        eye, direction = (np.asarray(a, float)[None] for a in
                          (self.view.position, self.view.direction))  # fmt: skip
        return eye[:count], direction[:count]


@dataclass(frozen=True, slots=True)
class Fenestration:
    """A fenestration system by the data of each method; the same in all window groups."""

    transmission: NDArray[np.float64]  # [K, K] T of the phase methods
    scattering: Scattering  # the sun of the five-phase method
    system: System  # of paths


def fenestration(coarse: KlemsBsdf, fine: Bsdf | None = None) -> Fenestration:
    """A system by Klems matrices, and by a tensor tree for sun and paths where there is one."""
    from mitsuba_cfs.trace.systems import lit_system, sun_scattering

    fine = fine or coarse
    return Fenestration(coarse.transmission_matrix(), sun_scattering(fine), lit_system(fine))


@dataclass(frozen=True, slots=True)
class Skies:
    """The skies of some hours on Reinhart patches, and their suns."""

    sky: NDArray[np.floating]  # [P, H] luminance without the sun [cd/m2]
    sun: NDArray[np.floating]  # [P, H] the sun alone, spread over patches [cd/m2]
    direction: NDArray[np.float64]  # [H, 3] to the sun
    illuminance: NDArray[np.float64]  # [H] of the sun, normal to it [lx]

    @property
    def hours(self) -> int:
        """H, how many there are."""
        return self.sky.shape[1]

    def part(self, hours: ArrayLike) -> Skies:
        """Some of the hours."""
        return Skies(
            self.sky[:, hours], self.sun[:, hours], self.direction[hours], self.illuminance[hours]
        )


def skies_of(
    weather: Weather, hours: ArrayLike, *, subdivision: int = 4, rotation_deg: float = 0.0
) -> Skies:
    """The skies of some hours [H] of a weather."""
    hours = np.asarray(hours)
    series = sky_series(weather, rotation_deg=rotation_deg)
    sky, sun = (
        sky_matrix(weather, subdivision, parts=part, rotation_deg=rotation_deg, dtype=np.float32)[
            :, hours
        ]
        for part in ("sky", "sun")
    )
    return Skies(sky, sun, series.sun[hours], series.direct_normal[hours])


@dataclass(frozen=True, slots=True)
class Quality:
    """How finely the methods compute; the defaults are those of `cfs`."""

    pixel_samples: int = 32  # paths of a pixel of a view's matrices
    path_samples: int = 16  # paths of a pixel under one sky
    sensor_samples: int = 16_384  # paths of a sensor
    patch_samples: int = 4096  # paths of a window patch
    subdivision: int = 4  # Reinhart's MF
    memory: float = 2 * 2**30  # [bytes] of a view's matrices, above it they lie on disk
    seed: int = 0
