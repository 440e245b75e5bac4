"""Shares of light among the surfaces of a room by closed forms, as EnergyPlus has them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from thermal.errors import require


def absorbed_after_reflections(
    first_hit: ArrayLike, reflectance: ArrayLike, exchange: ArrayLike
) -> NDArray[np.float64]:
    """Light that each surface keeps in the end [H, N] [W], all diffuse reflections counted.

    a = (1 - rho) (I - F^T diag(rho))^-1 first_hit.  With a window in N (rho: its diffuse
    reflectance from the room) what it keeps leaves through it or warms its panes.

    Args:
        first_hit: [H, N] light that falls on each surface the first time [W].
        reflectance: [N]; exchange: [N, N] view factors, rows sum to 1.
    """
    hit, rho = np.asarray(first_hit, dtype=float), np.asarray(reflectance, dtype=float)
    f = np.asarray(exchange, dtype=float)
    n = len(rho)
    require(hit.shape[-1] == n, "first hit", f"expected [H, {n}], got {hit.shape}")
    require(f.shape == (n, n), "view factors", f"expected [{n}, {n}], got {f.shape}")
    require(bool(np.all((rho >= 0) & (rho < 1))), "reflectance", "expected 0 to less than 1")
    total = np.linalg.inv(np.eye(n) - f.T * rho[None, :])
    return hit @ total.T * (1.0 - rho)


def spread_evenly(first_hit: ArrayLike, reflectance: ArrayLike, area: ArrayLike) -> NDArray[np.float64]:
    """Light kept [H, N] [W] where the reflected part spreads by area times absorptance.

    What EnergyPlus does: every surface keeps its share of the first hit, the reflected remainder
    is uniform in the room.
    """
    hit, rho = np.asarray(first_hit, dtype=float), np.asarray(reflectance, dtype=float)
    weight = np.asarray(area, dtype=float) * (1.0 - rho)
    reflected = hit @ rho
    return hit * (1.0 - rho) + reflected[..., None] * weight / weight.sum()


def window_share(absorbed: ArrayLike, tau_back: float, alpha_back_inner: float, rho_back: float) -> NDArray[np.float64]:
    """Part [...] of the room's light absorbed by a window that heats its inner layer.

    absorbed: [...] light not reflected into the room; the rest, tau_back and the outer panes'
    share, is lost.  alpha_back_inner: room-side diffuse absorptance of the inner layer.
    """
    whole = 1.0 - rho_back
    require(whole > 0, "window", "reflects all light of the room")
    fits = alpha_back_inner + tau_back <= whole + 1e-6
    require(fits, "window", "room-side absorptance and transmittance exceed 1 - reflectance")
    return np.asarray(absorbed, dtype=float) * (alpha_back_inner / whole)


def area_view_factors(area: ArrayLike, normals: ArrayLike) -> NDArray[np.float64]:
    """View factors [N, N] by area among surfaces that do not face the same way (EnergyPlus)."""
    a, n = np.asarray(area, dtype=float), np.asarray(normals, dtype=float)
    apart = (n @ n.T) < np.cos(np.radians(10.0))
    seen = apart * a[None, :]
    total = seen.sum(axis=1, keepdims=True)
    require(bool(np.all(total > 0)), "view factors", "a surface sees no other")
    return seen / total
