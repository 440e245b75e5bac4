"""Optics of a fenestration system in one shading state, in the form that each method needs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.angular import AngularTable
from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.evaluate import klems_of, peak_kind
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf
from mitsuba_cfs.sky.annual import AnnualSky
from mitsuba_cfs.trace.kernels.scattering import AngularBeam, AngularScattering, Scattering, patch_beams, sun_scattering
from mitsuba_cfs.trace.paths.scene import PathOptics, path_optics, without_peaks

PATCH_ANGLES = 32  # angles of incidence in each patch, for its mean
ROUNDING = 1e-3  # by which the sum of shares may exceed 1


class SystemOptics(Protocol):
    """Visible band of a system in one state."""

    @property
    def transmission(self) -> NDArray[np.float64]:
        """T [K, K] of the matrix methods."""

    @property
    def scattering(self) -> Scattering:
        """Transmission of the sun's disc, for the five-phase method."""

    @property
    def paths(self) -> PathOptics:
        """BSDF, direct beam and mirrors for path tracing, from either side."""

    @property
    def reflection(self) -> NDArray[np.float64] | None:
        """Reflection of the room's light [K out, K in]; None: black."""

    @property
    def outdoor_reflection(self) -> NDArray[np.float64] | None:
        """Reflection of outdoor light [K out, K in]; None: black."""


States = Sequence[SystemOptics]  # shading states of a window group, such as open and closed


@dataclass(frozen=True)
class BetweenOptics:
    """Two optics whose mean is the optics of a state between them."""

    low: BsdfOptics
    high: BsdfOptics
    share: float  # of `high`, 0 to 1


class BsdfOptics:
    """The optics of BSDF data; the form of each method is made at its first use."""

    def __init__(
        self,
        bsdf: Bsdf,
        fine: Bsdf | None = None,
        angular: AngularTable | None = None,
        between: BetweenOptics | None = None,
    ) -> None:
        """From one band of a BSDF file.

        Args:
            bsdf: a tensor tree is averaged over Klems patches for the matrices.
            fine: tensor tree of the same system, where `bsdf` is its Klems matrices.
            angular: transmittance and reflectances of a specular system by angle; the matrices
                have their means over patches.
            between: two optics that `bsdf` is the mean of. Where both are states of the same
                window, the sensors' light is the mean of theirs and is not traced.
        """
        self.between = between
        coarse = bsdf if isinstance(bsdf, KlemsBsdf) else klems_of(bsdf)
        self._coarse = coarse if angular is None else replace(coarse, see_through=1.0)
        self._fine, self._angular = bsdf if fine is None else fine, angular

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        """Pickle the data without the forms that have been made."""
        return BsdfOptics, (self._coarse, self._fine, self._angular, self.between)

    @property
    def peak(self) -> str:
        """Kind of the transmission peak, see `mitsuba_cfs.bsdf.evaluate.peak_kind`."""
        if self._angular is not None:
            return ""
        return peak_kind(self._coarse, self._fine if isinstance(self._fine, TensorTreeBsdf) else None)

    def tinted(self, theta: NDArray[np.float64], factor: NDArray[np.float64]) -> BsdfOptics:
        """The same with its transmission times factors [A] at angles of incidence [A] [rad].

        A tensor tree without a table by angle stays as it is.
        """
        if isinstance(self._fine, KlemsBsdf):
            bsdf = _tinted_klems(self._fine, theta, factor)
        elif self._angular is not None:
            bsdf = _tinted_klems(self._coarse, theta, factor)
        else:
            return self
        angular = self._angular
        if angular is not None:
            passed = angular.transmittance * np.interp(angular.theta, theta, factor)
            most = np.ones_like(passed)
            for reflected in (angular.reflectance_front, angular.reflectance_back):
                if reflected is not None:
                    most = np.minimum(most, 1 - reflected)
            angular = replace(angular, transmittance=np.clip(passed, 0, most))
        return BsdfOptics(bsdf, None, angular)

    @cached_property
    def transmission(self) -> NDArray[np.float64]:
        """See `SystemOptics`."""
        if self._angular is None:
            return self._coarse.transmission_matrix()
        rest = without_peaks(self._coarse, "transmission")
        return rest.transmission_matrix() + np.diag(self._angular.patch_means(self._coarse.basis_in))

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
        """Reflection of a side [K out, K in]."""
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


def _tinted_klems(bsdf: KlemsBsdf, theta: NDArray[np.float64], factor: NDArray[np.float64]) -> KlemsBsdf:
    """Klems matrices with their transmission times factors by the angle outdoors."""
    front, back = bsdf.transmission_front, bsdf.transmission_back
    if front is not None:
        front = front * np.interp(bsdf.basis_in.centres()[0], theta, factor)
    if back is not None:
        back = back * np.interp(bsdf.basis_out.centres()[0], theta, factor)[:, None]
    return replace(bsdf, transmission_front=front, transmission_back=back)


class AngularOptics:
    """The optics of a layer that depends on the angle of incidence alone: glass, a woven shade.

    The direct sun, pictures and paths have its value at every angle; matrices have the mean of each
    patch.
    """

    def __init__(
        self,
        straight: ArrayLike,
        scattered: ArrayLike = (0.0, 0.0),
        *,
        mirrored: ArrayLike = (0.0, 0.0),
        reflected: ArrayLike = (0.0, 0.0),
    ) -> None:
        """From shares [n] of the light, at even steps of the cosine of incidence, 0 to 1.

        Args:
            straight: transmitted directly; scattered: transmitted diffusely (Lambertian).
            mirrored, reflected: of light from the room, reflected specularly and diffusely.
        """
        shares = {
            name: np.asarray(values, dtype=float)
            for name, values in (
                ("straight", straight),
                ("scattered", scattered),
                ("mirrored", mirrored),
                ("reflected", reflected),
            )
        }
        for name, values in shares.items():
            if values.ndim != 1 or len(values) < 2 or not (values >= 0).all():
                raise ValueError(f"{name}: expected shares of two angles or more, none negative, got {values}")
        cosine = np.linspace(0.0, 1.0, max(map(len, shares.values())))
        each = [np.interp(cosine, np.linspace(0, 1, len(v)), v) for v in shares.values()]
        total = np.sum(each, axis=0)
        if total.max() > 1 + ROUNDING:
            raise ValueError(f"the shares of an angle sum to {total.max():.3f}: expected at most 1")
        self._straight, self._scattered, self._mirrored, self._reflected = shares.values()

    def __reduce__(self) -> tuple[Callable[..., object], tuple[object, ...]]:
        """Pickle the shares without the forms that have been made."""
        back = partial(AngularOptics, mirrored=self._mirrored, reflected=self._reflected)
        return back, (self._straight, self._scattered)

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
        """See `SystemOptics`; the shares do not include it."""

    def _klems(self) -> KlemsBsdf:
        """Diffuse transmission from either side, and diffuse reflection of the room's side."""
        passed, back = (
            np.tile(self._patch_means(shares) / np.pi, (KLEMS_FULL.size, 1))
            for shares in (self._scattered, self._reflected)
        )
        return KlemsBsdf(KLEMS_FULL, KLEMS_FULL, passed, passed, reflection_back=back)

    @staticmethod
    def _patch_means(shares: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean [K] over each patch's projected solid angle."""
        middles = (np.arange(PATCH_ANGLES) + 0.5) / PATCH_ANGLES
        theta, _ = KLEMS_FULL.angles_within(np.arange(KLEMS_FULL.size)[:, None], middles, 0.5)
        steps = np.linspace(0.0, 1.0, len(shares))
        return np.interp(np.cos(theta), steps, shares).mean(axis=1)


@dataclass(frozen=True)
class MatrixOptics:
    """Optics stated for each method by themselves; a method uses its own alone."""

    transmission: NDArray[np.float64] | None = None  # [K, K]
    scattering: Scattering | None = None
    paths: PathOptics | None = None
    reflection: NDArray[np.float64] | None = None  # [K, K]
    outdoor_reflection: NDArray[np.float64] | None = None  # [K, K]


def check_systems(systems: Sequence[States], scene_groups: Sequence[object]) -> None:
    """Raise `ValueError` unless there are states of every window group."""
    if len(systems) != len(scene_groups):
        raise ValueError(f"systems of {len(systems)} groups for {len(scene_groups)} window groups")
    for number, states in enumerate(systems):
        if not isinstance(states, Sequence) or not states:
            raise ValueError(f"systems[{number}]: expected a list of states, got {states!r:.60}")
        for state in states:
            if not hasattr(type(state), "paths"):  # of every `SystemOptics`
                raise ValueError(f"systems[{number}]: expected BsdfOptics or AngularOptics, got {state!r:.60}")


def neighbours(states: States, j: int) -> tuple[int, int, float] | None:
    """Numbers of two states that a state is the mean of, and the share of the second; else None."""
    optics = states[j]
    if not isinstance(optics, BsdfOptics) or optics.between is None:
        return None
    numbers = {id(one): number for number, one in enumerate(states)}
    of = optics.between
    if id(of.low) not in numbers or id(of.high) not in numbers:
        return None
    return numbers[id(of.low)], numbers[id(of.high)], of.share


def straight_transmittance(optics: SystemOptics) -> NDArray[np.float64]:
    """The part of T's diagonal that goes straight on [K]."""
    beam = patch_beams([optics.scattering], KLEMS_FULL)[0]
    return np.minimum(beam, np.diag(optics.transmission))


def hourly_states(state: ArrayLike | None, systems: Sequence[States], sky: AnnualSky) -> NDArray[np.int64]:
    """The state of each window group in each hour of a sky [G, L].

    Args:
        state: [G, L] or [L] of all groups, or of all hours of the year, [G, H] or [H]; None: the
            first all the time.  A group with fewer states than others is then in its last.
        systems: of each window group its states [G][J].

    Raises: `ValueError` for another shape, and for what is no number of a state.
    """
    groups, hours = len(systems), len(sky.lit)
    rows = np.zeros(hours, dtype=np.int64) if state is None else np.asarray(state)
    if not np.issubdtype(rows.dtype, np.integer):
        raise ValueError(f"state: expected whole numbers, got an array of {rows.dtype}")
    rows = np.tile(rows, (groups, 1)) if rows.ndim == 1 else rows
    if rows.shape == (groups, sky.hours):
        rows = rows[:, sky.lit]
    if rows.shape != (groups, hours):
        year = f"[{groups}, {sky.hours}] of the year"
        raise ValueError(f"state {rows.shape}: expected [{groups}, {hours}], or {year}")
    last = max((len(states) for states in systems), default=1) - 1
    if not 0 <= rows.min(initial=0) <= rows.max(initial=0) <= last:
        worst = rows.max() if rows.max() > last else rows.min()
        raise ValueError(f"state {worst}: expected 0 to {last}, the number of a system")
    return rows


def combinations(rows: NDArray[np.int64]) -> Iterator[tuple[tuple[int, ...], NDArray[np.int64]]]:
    """Each combination of the states [G] of some hours [G, L], and the hours that have it."""
    kinds, kind = np.unique(rows, axis=1, return_inverse=True)
    for i, combination in enumerate(kinds.T):
        yield tuple(combination.tolist()), np.flatnonzero(kind.ravel() == i)


def in_state(systems: Sequence[States], state: Sequence[int]) -> list[SystemOptics]:
    """The optics of each group [G] in its state; a group with fewer states is in its last."""
    return [group[min(j, len(group) - 1)] for group, j in zip(systems, state, strict=True)]
