"""Solar optics of glazings from their panes: angles by Fresnel, layers by multiple reflection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import require, require_range

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PaneOptics:
    """Transmittance, front and back reflectance of a pane, per angle."""

    tau: FloatArray  # [...]
    rho_front: FloatArray  # [...]
    rho_back: FloatArray  # [...]


@dataclass(frozen=True, slots=True)
class GlazingOptics:
    """A stack of n panes, per angle."""

    tau: FloatArray  # [...]
    rho: FloatArray  # [...] outside
    rho_back: FloatArray  # [...] room side
    absorptance: FloatArray  # [..., n] of each pane, for light from outside


def uncoated_pane(incidence: ArrayLike, tau_normal: float, rho_normal: float) -> PaneOptics:
    """A pane of clear or tinted glass at angles of incidence [...] [rad].

    Refractive index and absorption follow from the two values at normal incidence; then Fresnel
    for both polarisations, with all reflections inside the pane.

    Source: EnergyPlus Engineering Reference, "Angular properties for uncoated glass"; Furler 1991.
    """
    require_range(tau_normal, 0.01, 1.0, "pane transmittance")
    require_range(rho_normal, 0.01, 0.5, "pane reflectance")
    require(tau_normal + rho_normal <= 1.0, "pane", "tau + rho exceeds 1")
    index, inner = _index_and_inner(tau_normal, rho_normal)
    theta = np.minimum(np.abs(np.asarray(incidence, dtype=float)), np.radians(89.999))
    inside = np.arcsin(np.sin(theta) / index)
    path = inner ** (1.0 / np.cos(inside))
    c, ci = np.cos(theta), np.cos(inside)
    surfaces = (
        ((c - index * ci) / (c + index * ci)) ** 2,
        ((index * c - ci) / (index * c + ci)) ** 2,
    )
    tau, rho = np.zeros_like(theta), np.zeros_like(theta)
    for r in surfaces:
        t = (1 - r) ** 2 * path / (1 - (r * path) ** 2)
        tau += 0.5 * t
        rho += 0.5 * r * (1 + path * t)
    return PaneOptics(tau, rho, rho)


# Polynomials in cos(theta) of WINDOW 4 for clear and bronze glass (tau above and below 0.645)
_CLEAR = ((-0.0015, 3.355, -3.840, 1.460, 0.0288), (0.999, -0.563, 2.043, -2.532, 1.054))
_BRONZE = ((-0.002, 2.813, -2.341, -0.05725, 0.599), (0.997, -1.868, 6.513, -7.862, 3.225))


def coated_pane(
    incidence: ArrayLike, tau_normal: float, rho_front: float, rho_back: float
) -> PaneOptics:
    """A pane with a coating, at angles of incidence [...] [rad], from its values at the normal.

    tau = tau_n t(theta) and rho = rho_n (1 - r) + r, with t and r of uncoated glass.

    Source: Finlayson, Arasteh, Huizenga, Rubin, Reilly 1993, WINDOW 4.0 (LBL-33943); EnergyPlus
    Engineering Reference, "Angular properties for coated glass".
    """
    require_range(tau_normal, 0.0, 1.0, "pane transmittance")
    most = max(rho_front, rho_back)
    require(min(rho_front, rho_back) >= 0, "pane reflectance", "is negative")
    require(tau_normal + most <= 1.0, "pane", "tau + rho exceeds 1")
    through, sum_ = _CLEAR if tau_normal > 0.645 else _BRONZE
    c = np.cos(np.minimum(np.abs(np.asarray(incidence, dtype=float)), np.pi / 2))
    t = np.clip(np.polynomial.polynomial.polyval(c, through), 0.0, 1.0)
    r = np.clip(np.polynomial.polynomial.polyval(c, sum_) - t, 0.0, 1.0)
    tau = tau_normal * t
    front, back = (np.minimum(n * (1 - r) + r, 1.0 - tau) for n in (rho_front, rho_back))
    return PaneOptics(tau, front, back)


def turned(pane: PaneOptics) -> PaneOptics:
    """The pane seen from its other side."""
    return PaneOptics(pane.tau, pane.rho_back, pane.rho_front)


def _index_and_inner(tau: float, rho: float) -> tuple[float, float]:
    """Refractive index and internal transmittance of a pane from its normal tau and rho."""
    beta = tau**2 - rho**2 + 2 * rho + 1
    surface = (beta - np.sqrt(beta**2 - 4 * (2 - rho) * rho)) / (2 * (2 - rho))
    index = (1 + np.sqrt(surface)) / (1 - np.sqrt(surface))
    return float(index), float((rho - surface) / (surface * tau))


def stack(panes: Sequence[PaneOptics]) -> GlazingOptics:
    """Panes from outside to inside as one glazing, all reflections between them counted.

    Source: EN 410:2011, formulas (1) to (4), extended pane by pane.
    """
    require(len(panes) > 0, "glazing", "has no panes")
    first = panes[0]
    absorbed = [1.0 - first.tau - first.rho_front]
    tau, rho, back = first.tau, first.rho_front, first.rho_back
    from_inside = [1.0 - first.tau - first.rho_back]
    for pane in panes[1:]:
        bounce = 1.0 / (1.0 - back * pane.rho_front)
        inward, outward = tau * bounce, tau * bounce * pane.rho_front
        absorbed = [a + outward * b for a, b in zip(absorbed, from_inside, strict=True)]
        absorbed.append(inward * (1.0 - pane.tau - pane.rho_front))
        rho = rho + tau * outward
        returned = pane.tau * bounce
        from_inside = [b * returned for b in from_inside]
        from_inside.append(
            1.0 - pane.tau - pane.rho_back + returned * back * (1.0 - pane.tau - pane.rho_front)
        )
        tau, back = inward * pane.tau, pane.rho_back + returned * back * pane.tau
    return GlazingOptics(tau, rho, back, np.stack(absorbed, axis=-1))


def hemispherical(values: ArrayLike, incidence: ArrayLike) -> FloatArray:
    """Mean over the hemisphere of values [T, ...] given at angles [T] [rad] from 0 to pi/2.

    2 int value sin cos dtheta, as for a uniform sky.
    """
    theta = np.asarray(incidence, dtype=float)
    weight = np.diff(np.sin(theta) ** 2)
    v = np.asarray(values, dtype=float)
    middle = 0.5 * (v[1:] + v[:-1])
    return np.tensordot(weight, middle, axes=(0, 0)) / weight.sum()
