"""A fenestration system in one state, as each method takes it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.angular import AngularTable
from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.trace.kernels.scattering import (
    AngularBeam,
    AngularScattering,
    Scattering,
    sun_scattering,
)
from mitsuba_cfs.trace.paths.scene import PathOptics, path_optics, without_peaks

PATCH_ANGLES = 32  # of incidence in each patch, for its mean
OVER = 1e-3  # by which shares may be more than 1, for rounding


class SystemOptics(Protocol):
    """Visible band of a system in one state."""

    @property
    def transmission(self) -> NDArray[np.float64]:
        """T [K, K] of the matrix methods."""

    @property
    def scattering(self) -> Scattering:
        """How the five-phase method's sun passes it."""

    @property
    def paths(self) -> PathOptics:
        """What paths meet, from either side."""

    @property
    def reflection(self) -> NDArray[np.float64] | None:
        """Radiance back into the room for radiance from it [K out, K in]; None: black."""

    @property
    def outdoor_reflection(self) -> NDArray[np.float64] | None:
        """The same outdoors."""


States = Sequence[SystemOptics]  # of a window group, such as from open to closed


class BsdfOptics:
    """The optics of BSDF data; each method's form is made when it is first asked for."""

    def __init__(
        self, coarse: KlemsBsdf, fine: Bsdf | None = None, angular: AngularTable | None = None
    ) -> None:
        """From Klems matrices, and the same as finely as it is known.

        Args:
            fine: a tensor tree.
            angular: of a specular system its beam and its mirrors at every angle; the matrices
                then have its means over their patches.
        """
        self._coarse, self._fine = coarse, coarse if fine is None else fine
        self._angular = angular

    @cached_property
    def transmission(self) -> NDArray[np.float64]:
        """See `SystemOptics`."""
        if self._angular is None:
            return self._coarse.transmission_matrix()
        rest = without_peaks(self._coarse, "transmission")
        return rest.transmission_matrix() + np.diag(
            self._angular.patch_means(self._coarse.basis_in)
        )

    @cached_property
    def scattering(self) -> Scattering:
        """See `SystemOptics`."""
        return sun_scattering(self._fine, self._angular)

    @cached_property
    def paths(self) -> PathOptics:
        """See `SystemOptics`."""
        return path_optics(self._fine, self._angular)

    @cached_property
    def reflection(self) -> NDArray[np.float64] | None:
        """See `SystemOptics`."""
        return self._reflected("back")

    @cached_property
    def outdoor_reflection(self) -> NDArray[np.float64] | None:
        """See `SystemOptics`."""
        return self._reflected("front")

    def _reflected(self, side: str) -> NDArray[np.float64] | None:
        """Radiance that a side reflects [K out, K in]."""
        full, mirror, name = self._coarse.filled(), None, f"reflectance_{side}"
        if self._angular is not None and getattr(self._angular, name) is not None:
            full = without_peaks(full, "reflection")
            values = getattr(self._angular, name)
            mirror = np.diag(self._angular.patch_means(full.basis_in, values, 1.0))
        block = getattr(full, f"reflection_{side}")
        if block is None:
            return mirror
        block = block * full.basis_in.projected_solid_angles()
        return block if mirror is None else block + mirror


class AngularOptics:
    """The optics of a layer that passes light by its angle of incidence alone: glass, a weave.

    Exact at every angle for the direct sun, in pictures and for paths; the matrices take the mean
    of each patch.
    """

    def __init__(
        self,
        straight: ArrayLike,
        scattered: ArrayLike = (0.0, 0.0),
        *,
        mirrored: ArrayLike = (0.0, 0.0),
        reflected: ArrayLike = (0.0, 0.0),
    ) -> None:
        """From shares [n] each, at even steps of the cosine of incidence, 0 to 1.

        Args:
            straight: that keeps its beam; scattered: that leaves evenly to all sides.
            mirrored, reflected: of light from the room, straight and evenly.
        """
        shares = (straight, scattered, mirrored, reflected)
        given = [np.asarray(one, dtype=float) for one in shares]
        if any(one.ndim != 1 or len(one) < 2 or (one < 0).any() for one in given):
            raise ValueError("expected shares of at least two angles each, not negative")
        even = np.linspace(0.0, 1.0, max(len(one) for one in given))
        total = sum(np.interp(even, np.linspace(0, 1, len(one)), one) for one in given)
        if total.max() > 1 + OVER:
            raise ValueError(f"more leaves than comes, {total.max():.3f} times")
        self._straight, self._scattered, self._mirrored, self._reflected = given

    @cached_property
    def transmission(self) -> NDArray[np.float64]:
        """See `SystemOptics`."""
        return self._klems().transmission_matrix() + np.diag(self._patch_means(self._straight))

    @cached_property
    def scattering(self) -> Scattering:
        """See `SystemOptics`."""
        return AngularScattering(self._straight, self._scattered)

    @cached_property
    def paths(self) -> PathOptics:
        """See `SystemOptics`."""
        mirror = AngularBeam(self._mirrored) if self._mirrored.any() else None
        rest = None
        if self._scattered.any() or self._reflected.any():
            rest = path_optics(self._klems()).bsdf
        return PathOptics(rest, AngularBeam(self._straight), (None, mirror))

    @cached_property
    def reflection(self) -> NDArray[np.float64] | None:
        """See `SystemOptics`."""
        if not (self._mirrored.any() or self._reflected.any()):
            return None
        even = self._patch_means(self._reflected) / np.pi
        back = np.tile(even, (KLEMS_FULL.size, 1)) * KLEMS_FULL.projected_solid_angles()
        return back + np.diag(self._patch_means(self._mirrored))

    @property
    def outdoor_reflection(self) -> None:
        """See `SystemOptics`; what the front reflects is not among the shares."""

    def _klems(self) -> KlemsBsdf:
        """What is scattered, from either side, and what the room's side reflects."""
        passed, back = (
            np.tile(self._patch_means(shares) / np.pi, (KLEMS_FULL.size, 1))
            for shares in (self._scattered, self._reflected)
        )
        return KlemsBsdf(KLEMS_FULL, KLEMS_FULL, passed, passed, reflection_back=back)

    @staticmethod
    def _patch_means(shares: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean [K] over each patch's projected solid angle."""
        places = (np.arange(PATCH_ANGLES) + 0.5) / PATCH_ANGLES
        theta, _ = KLEMS_FULL.angles_within(np.arange(KLEMS_FULL.size)[:, None], places, 0.5)
        steps = np.linspace(0.0, 1.0, len(shares))
        return np.interp(np.cos(theta), steps, shares).mean(axis=1)


@dataclass(frozen=True)
class MatrixOptics:
    """Optics given for each method by itself; what is not given must not be asked for."""

    transmission: NDArray[np.float64] | None = None  # [K, K]
    scattering: Scattering | None = None
    paths: PathOptics | None = None
    reflection: NDArray[np.float64] | None = None  # [K, K]
    outdoor_reflection: NDArray[np.float64] | None = None  # [K, K]


def hourly_states(state: ArrayLike | None, groups: int, hours: int) -> NDArray[np.int64]:
    """The state of each window group in each hour [G, L].

    Args: state: [G, L], or [L] of all groups; None: the first all the time.

    Raises: `ValueError` for another shape.
    """
    rows = np.zeros(hours, dtype=np.int64) if state is None else np.asarray(state)
    rows = np.tile(rows, (groups, 1)) if rows.ndim == 1 else rows
    if rows.shape != (groups, hours):
        raise ValueError(f"state {rows.shape}: expected [{groups}, {hours}]")
    return rows


def combinations(
    rows: NDArray[np.int64],
) -> Iterator[tuple[tuple[int, ...], NDArray[np.int64]]]:
    """Each combination of the states [G] of some hours [G, L], and the hours that have it."""
    kinds, kind = np.unique(rows, axis=1, return_inverse=True)
    for i, combination in enumerate(kinds.T):
        yield tuple(combination.tolist()), np.flatnonzero(kind.ravel() == i)


def in_state(systems: Sequence[States], state: Sequence[int]) -> list[SystemOptics]:
    """The optics of each group [G] in its state; a group with fewer states is in its last."""
    return [group[min(j, len(group) - 1)] for group, j in zip(systems, state, strict=True)]
