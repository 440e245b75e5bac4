"""Geometry for tracing: opaque triangles, and windows in groups."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.directions import window_frame
from mitsuba_cfs.gloss import Gloss

PLANE = 0.98  # least area of a window's projection on its plane, of its own
MOST_GROUPS = 4  # of surfaces by whose reflectances matrices are derived


@dataclass(frozen=True, slots=True)
class Surfaces:
    """Opaque triangles with equal reflectance on both sides, in one spectral band.

    They reflect diffusely; a surface with a `Gloss` has that besides, and its diffuse reflectance
    falls with what the gloss takes more towards grazing incidence.
    """

    triangles: NDArray[np.float64]  # [N, 3, 3] vertices [m]
    reflectance: NDArray[np.float64]  # [N] diffuse reflectance at normal incidence, 0 to 1
    surface: NDArray[np.int64]  # [N] index of the surface (axis F) that each triangle belongs to
    names: tuple[str, ...] = ()  # [F] name of each surface
    gloss: tuple[Gloss | None, ...] = ()  # [F] of each surface; none of any where empty
    # [F] of panes: transmittance at even steps of the cosine of incidence, 0 to 1, for rays along
    # the normal of their triangles; against it they are passed freely. Opaque: None
    transmittance: tuple[tuple[float, ...] | None, ...] = ()

    def __post_init__(self) -> None:
        for name, kind in (("triangles", float), ("reflectance", float), ("surface", None)):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=kind))
        n = len(self.triangles)
        if self.triangles.shape != (n, 3, 3):
            raise ValueError(f"triangles: expected [N, 3, 3], got {self.triangles.shape}")
        if not np.isfinite(self.triangles).all():
            raise ValueError("triangles: expected finite numbers")
        if self.reflectance.shape != (n,) or self.surface.shape != (n,):
            raise ValueError(f"reflectance and surface: expected one entry for each of {n} triangles")
        if n and not (np.min(self.reflectance) >= 0 and np.max(self.reflectance) <= 1):
            raise ValueError("reflectance: expected values from 0 to 1")
        if self.gloss and n and len(self.gloss) <= np.max(self.surface):
            raise ValueError(f"gloss: {len(self.gloss)} entries, one for each surface is expected")
        if self.gloss:
            diffuse = np.zeros(len(self.gloss))
            np.maximum.at(diffuse, self.surface, self.reflectance)
            for number, gloss in enumerate(self.gloss):
                if gloss is not None and diffuse[number] + gloss.at_normal > 1 + 1e-6:
                    raise ValueError(f"surface {number}: reflects more than it gets")

    @classmethod
    def none(cls) -> Surfaces:
        """No surface at all."""
        return cls(np.empty((0, 3, 3)), np.empty(0), np.empty(0, dtype=np.int64))

    @property
    def areas(self) -> NDArray[np.float64]:
        """Area of each triangle [N] [m2]."""
        return triangle_areas(self.triangles)

    @property
    def glossy(self) -> list[int]:
        """Numbers of the surfaces that have a gloss."""
        return [i for i, gloss in enumerate(self.gloss) if gloss and max(gloss.specular) > 0]

    def some(self, chosen: NDArray[np.bool_]) -> Surfaces:
        """Some of the triangles; the surfaces keep their numbers."""
        return replace(
            self, triangles=self.triangles[chosen], reflectance=self.reflectance[chosen], surface=self.surface[chosen]
        )


@dataclass(frozen=True, slots=True)
class SharedOutdoors:
    """The surroundings of several rooms, their windows among them."""

    surfaces: Surfaces
    owner: NDArray[np.int64]  # [N] the room that a triangle is a window of; -1: of none, these come first


@dataclass(frozen=True, slots=True)
class SurfaceGroups:
    """Groups of surfaces by whose reflectances a matrix is derived, such as floor and walls."""

    names: tuple[str, ...]  # [N] at most `MOST_GROUPS`
    number: NDArray[np.int64]  # [F] group of each surface; -1: of none

    def __post_init__(self) -> None:
        if not 1 <= len(self.names) <= MOST_GROUPS:
            raise ValueError(f"expected 1 to {MOST_GROUPS} groups of surfaces, got {len(self.names)}")
        if len(self.number) and not -1 <= self.number.min() <= self.number.max() < len(self.names):
            raise ValueError(f"number of a surface's group: expected -1 to {len(self.names) - 1}")


@dataclass(frozen=True)
class WindowSurface:
    """A plane glazed aperture; its normal points outdoors."""

    name: str
    triangles: NDArray[np.float64]  # [T, 3, 3] vertices [m], counter-clockwise seen from outside
    up: NDArray[np.float64] | None = None  # [3] up of the BSDF; world up (north if horizontal)
    normal: NDArray[np.float64] = field(init=False)  # [3] unit exterior normal

    def __post_init__(self) -> None:
        t = np.asarray(self.triangles, dtype=float)
        if t.ndim != 3 or t.shape[1:] != (3, 3) or len(t) == 0:
            raise ValueError(f"window {self.name}: expected triangles [T, 3, 3], got {t.shape}")
        if not np.isfinite(t).all():
            raise ValueError(f"window {self.name}: triangles: expected finite numbers")
        vectors = area_vectors(t)
        area_vector = vectors.sum(axis=0)
        length = np.linalg.norm(area_vector)
        if not length > 0:
            raise ValueError(f"window {self.name}: has no area")
        if length < PLANE * np.linalg.norm(vectors, axis=1).sum():
            raise ValueError(f"window {self.name}: its triangles are not in one plane, or face both sides")
        object.__setattr__(self, "triangles", t)
        object.__setattr__(self, "normal", area_vector / length)

    @cached_property
    def area(self) -> float:
        """Glazed area [m2]."""
        return float(triangle_areas(self.triangles).sum())

    @cached_property
    def frame(self) -> NDArray[np.float64]:
        """Rows x, y, z [3, 3] of the window frame (see `mitsuba_cfs.directions`)."""
        return window_frame(self.normal, self.up)


@dataclass(frozen=True, slots=True)
class WindowGroup:
    """Windows of one orientation and one fenestration system: one set of phase matrices."""

    name: str
    windows: tuple[WindowSurface, ...]

    def __post_init__(self) -> None:
        if not self.windows:
            raise ValueError(f"window group {self.name}: has no window")
        first = self.windows[0].frame
        for window in self.windows[1:]:
            if not np.allclose(window.frame, first, atol=1e-3):
                names = f"{window.name} is turned against {self.windows[0].name}"
                raise ValueError(f"window group {self.name}: {names}")

    @property
    def area(self) -> float:
        """Glazed area of all windows [m2]."""
        return sum(window.area for window in self.windows)

    @property
    def frame(self) -> NDArray[np.float64]:
        """Rows x, y, z [3, 3] of the frame that all windows of the group share."""
        return self.windows[0].frame


def even_numbers(count: int) -> NDArray[np.float64]:
    """Numbers [n, 2] in [0, 1), evenly spread: Roberts' low-discrepancy sequence R2 (2018)."""
    root = 1.324717957244746  # of x^3 = x + 1
    steps = np.arange(count)[:, None] * np.array([1 / root, 1 / root**2])
    return np.mod(0.5 + steps, 1.0)


def points_on_triangles(
    triangles: NDArray[np.float64], u: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points [n, 3] spread evenly over triangles [T, 3, 3], and the triangle [n] of each.

    Args: u: [n, 2] numbers in [0, 1), which may be a low-discrepancy set.
    """
    area = triangle_areas(triangles)
    shares = area / area.sum()
    at = np.cumsum(shares)
    chosen = np.minimum(np.searchsorted(at, u[:, 0], side="right"), len(area) - 1)
    reused = np.clip((u[:, 0] - at[chosen] + shares[chosen]) / shares[chosen], 0.0, 1.0)
    root, v = np.sqrt(reused)[:, None], u[:, 1, None]
    a, b, c = (triangles[chosen, k] for k in range(3))
    return a * (1 - root) + b * (root * (1 - v)) + c * (root * v), chosen


def triangle_areas(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Area of each triangle [N] [m2] from vertices [N, 3, 3] [m]."""
    return np.asarray(np.linalg.norm(area_vectors(triangles), axis=-1))


def area_vectors(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Area vectors [T, 3] [m2] of triangles [T, 3, 3]."""
    # written out: np.cross takes nearly three times as long on few triangles
    a = triangles[:, 1] - triangles[:, 0]
    b = triangles[:, 2] - triangles[:, 0]
    x = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    y = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    z = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return 0.5 * np.stack([x, y, z], axis=1)
