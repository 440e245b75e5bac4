"""The light of CIE 171's tests by quadrature over the opening: NumPy alone, no tracer, no patches.

    E(x) = integral over the opening of L(omega) tau(omega) cos(sensor) cos(opening) / r^2 dA

The sky is the continuous one of ISO 15469, written out here once more; glass is Fresnel's pane.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
GRADATION = {1: (4.0, -0.7), 5: (0.0, -1.0), 8: (0.0, -1.0), 12: (-1.0, -0.32), 16: None}
INDICATRIX = {1: (0.0, -1.0, 0.0), 5: (0.0, -1.0, 0.0), 8: (10.0, -3.0, 0.45)}
INDICATRIX |= {12: (10.0, -3.0, 0.45)}
CELLS, NODES = 24, 6  # of each side of each part of an opening; Gauss' points of a cell
WALL_NODES = 60  # Gauss' points of each angle at which a wall outdoors sees
INDEX = 1.52  # of the glass, where only its transmittance is stated


@dataclass(frozen=True, slots=True)
class Opening:
    """A rectangle in one plane: a corner, two sides, and its outward normal."""

    corner: tuple[float, float, float]  # [m]
    right: tuple[float, float, float]  # [m]
    up: tuple[float, float, float]  # [m]

    @property
    def normal(self) -> Array:
        """Unit normal outdoors [3]."""
        n = np.cross(self.right, self.up)
        return n / np.linalg.norm(n)


@dataclass(frozen=True, slots=True)
class Overhang:
    """An endless level shelf on top of a black facade, lit by the ground that this stands on."""

    facade: float  # [m] y of the facade
    height: float  # [m] above the ground at z = 0
    depth: float  # [m]
    reflectance: float

    def luminance(self, out: Array) -> Array:
        """Luminance at distances from the facade [m], for a ground of 1.

        A wall below a shelf takes away (1 - x / sqrt(x^2 + h^2)) / 2 of what lies under it.
        """
        return self.reflectance * 0.5 * (1 + out / np.hypot(out, self.height))


@dataclass(frozen=True, slots=True)
class Wall:
    """An endless wall before a black facade, both on the ground, lit by sky and ground."""

    facade: float  # [m] height of the facade
    distance: float  # [m] from the facade
    reflectance: float

    def luminance(self, kind: int, sun: Array, ground: float, heights: Array) -> Array:
        """Luminance at heights [m] under a sky, for an illuminance of 1 on the ground.

        E(z) = integral of L(p, g) cos(g)^2 cos(p) dg dp over the directions before the wall, by
        their profile angle p and the angle g off the section, less what the facade hides.

        Args: ground: reflectance of the ground, which all of the sky lights.
        """
        whole = horizontal_illuminance(kind, sun)

        def sky(ways: Array) -> Array:
            return sky_luminance(kind, ways, sun) / whole

        lit = [self._illuminance(sky, ground / np.pi, at) for at in heights]
        return self.reflectance / np.pi * np.array(lit)

    def _illuminance(self, sky: Callable[[Array], Array], ground: float, z: float) -> float:
        top, foot = np.arctan2(self.facade - z, self.distance), np.arctan2(-z, self.distance)
        parts = [(-np.pi / 2, foot, False), (max(top, 0.0), np.pi / 2, True)]
        if top < 0:
            parts.append((top, 0.0, False))  # the ground behind what the facade hides
        x, w = np.polynomial.legendre.leggauss(WALL_NODES)
        side, w_side = np.pi / 2 * x, np.pi / 2 * w
        total = 0.0
        for low, high, is_sky in parts:
            profile, w_profile = 0.5 * (low + high + (high - low) * x), 0.5 * (high - low) * w
            cos_p, cos_g = np.cos(profile)[:, None], np.cos(side)
            level = [np.broadcast_to(np.sin(side), cos_p.shape[:1] + side.shape), -cos_g * cos_p]
            ways = np.stack([*level, cos_g * np.sin(profile)[:, None]], axis=-1)
            seen = sky(ways) if is_sky else np.full(ways.shape[:2], ground)
            total += float(w_profile @ (seen * cos_g**2 * cos_p) @ w_side)
        return total


def sky_luminance(kind: int, directions: Array, sun: Array) -> Array:
    """Luminance [N] over that of the zenith of an ISO 15469 sky; 16: the overcast one of 1955."""
    height = np.maximum(directions[..., 2], 1e-9)
    if kind == 16:
        return (1 + 2 * height) / 3
    a, b = GRADATION[kind]
    c, d, e = INDICATRIX[kind]
    angle = np.arccos(np.clip(directions @ sun, -1, 1))
    zenith = np.arccos(sun[2])

    def round_sun(g: Array) -> Array:
        return 1 + c * (np.exp(d * g) - np.exp(d * np.pi / 2)) + e * np.cos(g) ** 2

    gradation = (1 + a * np.exp(b / height)) / (1 + a * np.exp(b))
    return gradation * round_sun(angle) / round_sun(zenith)


def horizontal_illuminance(kind: int, sun: Array) -> float:
    """Illuminance of the unobstructed ground by such a sky, for a zenith of 1."""
    x, w = np.polynomial.legendre.leggauss(400)
    altitude, azimuth = np.pi / 4 * (x + 1), np.pi * (x + 1)
    level = np.cos(altitude)[:, None] * np.stack([np.sin(azimuth), np.cos(azimuth)])[:, None]
    directions = np.stack([*level, np.broadcast_to(np.sin(altitude)[:, None], level[0].shape)], -1)
    weight = w[:, None] * w * np.pi / 4 * np.pi * (np.cos(altitude) * np.sin(altitude))[:, None]
    return float((weight * sky_luminance(kind, directions, sun)).sum())


def pane_transmittance(cosine: Array, normal: float, index: float = INDEX) -> Array:
    """Transmittance of a pane of glass by Fresnel and Snell, of that at normal incidence."""
    r0 = ((index - 1) / (index + 1)) ** 2
    # t = (1 - r)^2 a / (1 - r^2 a^2), solved for the absorption a at normal incidence
    root = np.sqrt((1 - r0) ** 4 + 4 * r0**2 * normal**2)
    straight = (root - (1 - r0) ** 2) / (2 * r0**2 * normal)
    sine2 = (1 - cosine**2) / index**2
    inner = np.sqrt(1 - sine2)
    a = straight ** (1 / inner)
    parts = []
    for r in (
        ((cosine - index * inner) / (cosine + index * inner)) ** 2,
        ((index * cosine - inner) / (index * cosine + inner)) ** 2,
    ):
        parts.append((1 - r) ** 2 * a / (1 - (r * a) ** 2))
    return 0.5 * (parts[0] + parts[1])


def sensor_light(
    point: Array,
    normal: Array,
    opening: Opening,
    outdoors: Callable[[Array], Array],
    tau: Callable[[Array], Array] | None = None,
    edges: tuple[float, ...] = (),
) -> float:
    """Illuminance at a point through an opening.

    Args:
        outdoors: luminance [N] of directions [N, 3] from the point.
        tau: transmittance of a cosine of incidence.
        edges: shares of the opening's `up` at which the luminance steps: where it is cut.
    """
    corner, right, up = (np.asarray(v, float) for v in (opening.corner, opening.right, opening.up))
    cuts = np.unique(np.clip([0.0, 1.0, *edges], 0, 1))
    x, w = np.polynomial.legendre.leggauss(NODES)
    total = 0.0
    for low, high in pairwise(cuts):
        u, wu = _composite(0.0, 1.0, x, w)
        v, wv = _composite(low, high, x, w)
        place = corner + u[:, None, None] * right + v[None, :, None] * up
        way = place - point
        r2 = (way**2).sum(-1)
        omega = way / np.sqrt(r2)[..., None]
        at_sensor, at_opening = np.maximum(omega @ normal, 0), np.maximum(omega @ opening.normal, 0)
        value = outdoors(omega) * at_sensor * at_opening / r2
        if tau is not None:
            value = value * tau(np.maximum(at_opening, 1e-9))
        total += float(wu @ value @ wv)
    return total * float(np.linalg.norm(np.cross(right, up)))


def _composite(low: float, high: float, x: Array, w: Array) -> tuple[Array, Array]:
    """Points and weights of Gauss' rule in each of some cells, finer towards both ends."""
    bounds = low + (high - low) * 0.5 * (1 - np.cos(np.pi * np.arange(CELLS + 1) / CELLS))
    half = 0.5 * np.diff(bounds)
    middle = 0.5 * (bounds[1:] + bounds[:-1])
    return (middle[:, None] + half[:, None] * x).ravel(), (half[:, None] * w).ravel()
