"""Klems angle bases and the matrices of BSDF values on them.

A basis divides the hemisphere into rings of polar angle and each ring into equal azimuths; its
first patch is the polar cap.  Azimuth zero is the centre of a ring's first patch.  What azimuth
means for incident and for outgoing light is stated in `mitsuba_cfs.directions`.

Source: Klems 1994, "A new method for predicting the solar heat gain of complex fenestration
systems", ASHRAE Transactions 100; the half (77) and quarter (41) bases as in Radiance 6
and in WINDOW's engine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

# A transmission block that transmits less than this of any direction's light is a placeholder
# (the threshold below which Radiance drops a component).
DUMMY_HEMISPHERICAL = 1e-3


@dataclass(frozen=True)
class KlemsBasis:
    """A division of the hemisphere into rings and azimuths."""

    name: str
    theta_bounds: tuple[float, ...]  # [R + 1] polar angles between the rings, 0 to pi / 2 [rad]
    phi_counts: tuple[int, ...]  # [R] patches in each ring

    def __post_init__(self) -> None:
        bounds = np.asarray(self.theta_bounds, dtype=float)
        if len(bounds) != len(self.phi_counts) + 1 or len(bounds) < 2:
            raise ValueError(f"basis {self.name}: expected one more polar bound than rings")
        if abs(bounds[0]) > 1e-9 or abs(bounds[-1] - np.pi / 2) > 1e-6:
            raise ValueError(f"basis {self.name}: polar bounds do not span 0 to 90 degrees")
        if not np.all(np.diff(bounds) > 0):
            raise ValueError(f"basis {self.name}: polar bounds do not rise")
        if min(self.phi_counts) < 1 or 1 in self.phi_counts[1:]:
            raise ValueError(f"basis {self.name}: a ring has an impossible number of azimuths")

    @property
    def size(self) -> int:
        """Number of patches K."""
        return sum(self.phi_counts)

    @property
    def ring_starts(self) -> NDArray[np.int64]:
        """Index of the first patch of each ring [R]."""
        return np.concatenate([[0], np.cumsum(self.phi_counts)[:-1]])

    @property
    def rings(self) -> NDArray[np.int64]:
        """Ring that each patch belongs to [K]."""
        return np.repeat(np.arange(len(self.phi_counts)), self.phi_counts)

    def projected_solid_angles(self) -> NDArray[np.float64]:
        """Integral of cos(theta) over each patch [K] [sr]: pi (cos2 t0 - cos2 t1) / n."""
        return _projected_solid_angles(self)

    def centres(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Polar angle and azimuth of each patch's centre [K], [K] [rad]; the cap's is the pole."""
        bounds, rings = np.asarray(self.theta_bounds), self.rings
        middle = 0.5 * (bounds[:-1] + bounds[1:])
        if self.phi_counts[0] == 1:
            middle[0] = 0.0
        within = np.arange(self.size) - self.ring_starts[rings]
        return middle[rings], 2 * np.pi * within / np.asarray(self.phi_counts)[rings]

    def index(self, theta: ArrayLike, phi: ArrayLike) -> NDArray[np.int64]:
        """Patch [..] that holds polar angle `theta` (0 to pi / 2) and azimuth `phi` [rad]."""
        theta, phi = np.asarray(theta, dtype=float), np.asarray(phi, dtype=float)
        if not np.all((theta >= 0) & (theta <= np.pi / 2 + 1e-6)):
            raise ValueError("polar angle: expected 0 to pi / 2")
        ring = np.searchsorted(np.asarray(self.theta_bounds)[1:-1], theta, side="right")
        count = np.asarray(self.phi_counts)[ring]
        within = np.floor(phi / (2 * np.pi) * count + 0.5).astype(np.int64) % count
        return self.ring_starts[ring] + within

    def angles_within(
        self, patch: ArrayLike, u: ArrayLike, v: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Polar angle, azimuth [..] [rad] at (u, v) of `patch`, uniform in cos(theta) d_omega."""
        ring = self.rings[np.asarray(patch)]
        count = np.asarray(self.phi_counts)[ring]
        sine2 = np.sin(np.asarray(self.theta_bounds)) ** 2
        sine2 = sine2[ring] + np.asarray(u) * (sine2[ring + 1] - sine2[ring])
        phi = 2 * np.pi * (np.asarray(patch) - self.ring_starts[ring] + np.asarray(v) - 0.5) / count
        return np.arcsin(np.sqrt(np.clip(sine2, 0, 1))), np.mod(phi, 2 * np.pi)

    def incident_directions(self, *, back: bool = False) -> NDArray[np.float64]:
        """Unit vectors [K, 3] in the window frame from each patch's centre towards the light."""
        x, y, z = self._components()
        return np.stack([x, -y, -z if back else z], axis=-1)

    def outgoing_directions(self, *, front: bool = False) -> NDArray[np.float64]:
        """Unit vectors [K, 3] in the window frame that the light leaves along, to the room."""
        x, y, z = self._components()
        return np.stack([-x, y, z if front else -z], axis=-1)

    def opposite(self) -> NDArray[np.int64]:
        """Patch [K] half a turn of azimuth away; `ValueError` where a ring has an odd count."""
        if any(count % 2 for count in self.phi_counts if count > 1):
            raise ValueError(f"basis {self.name}: a ring has an odd number of azimuths")
        theta, phi = self.centres()
        return self.index(theta, phi + np.pi)

    def _components(self) -> tuple[NDArray[np.float64], ...]:
        theta, phi = self.centres()
        return np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)


@cache
def _projected_solid_angles(basis: KlemsBasis) -> NDArray[np.float64]:
    cosine2 = np.cos(np.asarray(basis.theta_bounds)) ** 2
    areas = np.pi * (cosine2[:-1] - cosine2[1:]) / np.asarray(basis.phi_counts)
    areas = areas[basis.rings]
    areas.setflags(write=False)
    return areas


def _basis(name: str, bounds_deg: list[float], phi_counts: list[int]) -> KlemsBasis:
    return KlemsBasis(name, tuple(np.radians(bounds_deg).tolist()), tuple(phi_counts))


KLEMS_FULL = _basis("LBNL/Klems Full", [0, 5, 15, 25, 35, 45, 55, 65, 75, 90], [1, 8, 16, 20, 24, 24, 24, 16, 12])
KLEMS_HALF = _basis("LBNL/Klems Half", [0, 6.5, 19.5, 32.5, 45.5, 58.5, 71.5, 90], [1, 8, 12, 16, 20, 12, 8])
KLEMS_QUARTER = _basis("LBNL/Klems Quarter", [0, 9, 27, 45, 63, 90], [1, 8, 12, 12, 8])
STANDARD_BASES = (KLEMS_FULL, KLEMS_HALF, KLEMS_QUARTER)


@dataclass(frozen=True)
class KlemsBsdf:
    """BSDF values [1/sr] of one spectral band on Klems bases, indexed [outgoing, incident].

    "Front" is the exterior: `transmission_front` is light from outside to the room.  A block that
    the file does not have is None; `filled` gives its replacement.
    """

    basis_in: KlemsBasis
    basis_out: KlemsBasis
    transmission_front: NDArray[np.float64] | None = None  # [K out, K in] [1/sr]
    transmission_back: NDArray[np.float64] | None = None  # [K out, K in] [1/sr]
    reflection_front: NDArray[np.float64] | None = None  # [K out, K in] [1/sr]
    reflection_back: NDArray[np.float64] | None = None  # [K out, K in] [1/sr]
    see_through: float | None = None  # share of its peak that passes straight on; None: by the data

    def __post_init__(self) -> None:
        shape = (self.basis_out.size, self.basis_in.size)
        for name, block in self.blocks().items():
            if block.shape != shape:
                raise ValueError(f"{name}: expected {shape}, got {block.shape}")

    def blocks(self) -> dict[str, NDArray[np.float64]]:
        """The blocks that are there, by name."""
        names = ("transmission_front", "transmission_back", "reflection_front", "reflection_back")
        return {name: block for name in names if (block := getattr(self, name)) is not None}

    def direct_hemispherical(self, block: NDArray[np.float64]) -> NDArray[np.float64]:
        """Share of each incident patch's light that `block` sends on [K in], 0 to 1."""
        return self.basis_out.projected_solid_angles() @ block

    def scattered(self, side: str) -> NDArray[np.float64]:
        """Share of each incident patch's light from `side` that all blocks send on [K in]."""
        blocks = self.blocks().items()
        shares = [self.direct_hemispherical(block) for name, block in blocks if name.endswith(side)]
        return sum(shares, np.zeros(self.basis_in.size))

    def incident_weights(self, count: int) -> NDArray[np.float64]:
        """Projected solid angle of each incident patch [K in] [sr]; `count` is K in."""
        return self.basis_in.projected_solid_angles()

    def is_dummy(self, block: NDArray[np.float64] | None) -> bool:
        """Whether a block transmits nothing and is treated as absent, as in Radiance."""
        return block is None or self.direct_hemispherical(block).max() <= DUMMY_HEMISPHERICAL

    def filled(self) -> KlemsBsdf:
        """The same system with all four blocks.

        A transmission that is absent or a placeholder is replaced by the other side's by
        reciprocity, f(i -> o) = f(o -> i); an absent reflection is zero.  That is how Radiance
        reads such files.
        """
        front, back = self.transmission_front, self.transmission_back
        if back is not None and self.is_dummy(front) and not self.is_dummy(back):
            front = self._reversed(back)
        elif front is not None and self.is_dummy(back) and not self.is_dummy(front):
            back = self._reversed(front)
        zero = np.zeros((self.basis_out.size, self.basis_in.size))
        return replace(
            self,
            transmission_front=zero if front is None else front,
            transmission_back=zero if back is None else back,
            reflection_front=zero if self.reflection_front is None else self.reflection_front,
            reflection_back=zero if self.reflection_back is None else self.reflection_back,
        )

    def _reversed(self, block: NDArray[np.float64]) -> NDArray[np.float64]:
        """The other side's transmission by reciprocity: f(o -> i), azimuths half a turn on.

        Exact on one basis with even counts of azimuths (all standard ones), else by the middles.
        """
        back_in = self._opposite(self.basis_out, self.basis_in)
        back_out = self._opposite(self.basis_in, self.basis_out)
        return block[np.ix_(back_out, back_in)].T

    @staticmethod
    def _opposite(basis: KlemsBasis, other: KlemsBasis) -> NDArray[np.int64]:
        """Patch of `other` half a turn away from the middle of each patch of `basis`."""
        theta, phi = basis.centres()
        return other.index(theta, phi + np.pi)

    def turned_round(self) -> KlemsBsdf:
        """The same system with its back outdoors, turned by pi about its up."""
        mirrored = []
        for basis in (self.basis_out, self.basis_in):
            theta, phi = basis.centres()
            mirrored.append(basis.index(theta, np.pi - phi))

        return with_sides_exchanged(self, lambda block: block[np.ix_(*mirrored)])

    def transmission_matrix(self) -> NDArray[np.float64]:
        """T [K out, K in]: radiance into the room for radiance from the sky, L_o = T L_i.

        T = f cos(theta_i) d_omega_i, the T of the three-phase method's V T D s.
        """
        front = self.filled().transmission_front
        if front is None:
            raise ValueError("neither side of the BSDF transmits light")
        return front * self.basis_in.projected_solid_angles()


Bsdf = TypeVar("Bsdf")


def with_sides_exchanged(bsdf: Bsdf, turned: Callable[..., object]) -> Bsdf:
    """A BSDF with front and back exchanged, and each block that it has turned by a function."""
    blocks = {}
    for kind in ("transmission", "reflection"):
        for side, other in (("front", "back"), ("back", "front")):
            block = getattr(bsdf, f"{kind}_{other}")
            blocks[f"{kind}_{side}"] = None if block is None else turned(block)
    return replace(bsdf, **blocks)  # type: ignore[type-var]
