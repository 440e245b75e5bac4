"""Longwave exchange: between the inside faces of a room, and from outside faces to the sky."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import require


def exchange_from_view_factors(
    area: ArrayLike, emissivity: ArrayLike, view_factors: ArrayLike
) -> NDArray[np.float64]:
    """Exchange areas X [N, N] [m2] of grey surfaces: Q_ij = X_ij sigma (T_i^4 - T_j^4).

    Hottel's total exchange areas; X is symmetric, and A_i eps_i = sum_j X_ij with j = i included.
    The view factors are first made to obey reciprocity and to sum to one (a few Sinkhorn steps),
    so that traced ones with their noise conserve energy.

    Source: Hottel and Sarofim 1967, Radiative Transfer, ch. 3.
    """
    a, eps = np.asarray(area, dtype=float), np.asarray(emissivity, dtype=float)
    f = np.asarray(view_factors, dtype=float)
    n = len(a)
    require(f.shape == (n, n), "view factors", f"expected [{n}, {n}], got {f.shape}")
    require(bool(np.all(f >= -1e-9)), "view factors", "negative")
    sums = f.sum(axis=1)
    require(bool(np.all(np.abs(sums - 1.0) < 0.1)), "view factors", f"rows sum to {sums.round(3)}")
    direct = closed_exchange(a[:, None] * f, a)
    rho_over = (1.0 - eps) / a
    radiosity = np.linalg.inv(np.eye(n) - rho_over[:, None] * direct)
    return (eps[:, None] * direct) @ radiosity * eps[None, :]


def closed_exchange(direct: ArrayLike, area: ArrayLike) -> NDArray[np.float64]:
    """Direct exchange areas [N, N] made symmetric with rows that sum to the areas [N]."""
    s = np.asarray(direct, dtype=float)
    s = 0.5 * (s + s.T)
    a = np.asarray(area, dtype=float)
    for _ in range(200):
        scale = np.sqrt(a / np.maximum(s.sum(axis=1), 1e-12))
        s = s * scale[:, None] * scale[None, :]
        if np.max(np.abs(s.sum(axis=1) - a)) < 1e-10 * a.max():
            break
    return s


def exchange_star(area: ArrayLike, emissivity: ArrayLike) -> NDArray[np.float64]:
    """Exchange areas X [N, N] [m2] of a mean radiant star, for rooms without view factors.

    Each surface sees a common radiant node through A/(1/F + (1 - eps)/eps); the F close the
    enclosure.  The node is eliminated: X_ij = g_i g_j / sum g.

    Source: Carroll 1980, A comparison of methods for modelling radiant heat exchange, ASHRAE
    Transactions 86; EnergyPlus Engineering Reference ("CarrollMRT").
    """
    a, eps = np.asarray(area, dtype=float), np.asarray(emissivity, dtype=float)
    f = np.ones_like(a)
    for _ in range(500):
        fresh = 1.0 / np.maximum(1.0 - a * f / np.sum(a * f), 1e-3)
        if np.max(np.abs(fresh - f)) < 1e-12:
            break
        f = 0.5 * (f + fresh)
    g = a / (1.0 / f + (1.0 - eps) / np.maximum(eps, 1e-6))
    return g[:, None] * g[None, :] / g.sum()


def area_view_factors(area: ArrayLike, normals: ArrayLike) -> NDArray[np.float64]:
    """View factors [N, N] by area among surfaces that do not face the same way (EnergyPlus)."""
    a, n = np.asarray(area, dtype=float), np.asarray(normals, dtype=float)
    apart = (n @ n.T) < np.cos(np.radians(10.0))
    seen = apart * a[None, :]
    total = seen.sum(axis=1, keepdims=True)
    require(bool(np.all(total > 0)), "view factors", "a surface sees no other")
    return seen / total


def outside_factors(normal_z: float, sky_seen: float = 1.0) -> tuple[float, float, float]:
    """Shares (sky, air, ground) of the longwave exchange of an outside face.

    The sky half of a tilted face splits into sky and air by beta = sqrt((1 + cos tilt)/2)
    (Walton 1983; EnergyPlus).  What hides the sky counts with the ground, at the temperature of
    the air: F_sky = sky_seen (1 + cos tilt)/2 (EnergyPlus; ISO 52016-1 6.5.13.3 likewise takes the
    sky's share with obstacles off).

    Args: normal_z: z component of the exterior normal; sky_seen: share of the sky that is not
        hidden by obstructions.
    """
    half = 0.5 * (1.0 + normal_z)
    beta, seen = np.sqrt(half), half * sky_seen
    return float(seen * beta), float(seen * (1.0 - beta)), float(1.0 - seen)
