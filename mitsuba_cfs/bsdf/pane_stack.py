"""Panes of glass in series: transmittance, reflectance, and absorptance of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.glazing import Pane, pane_values

FloatArray = NDArray[np.float64]
HEMISPHERE = np.radians(np.linspace(0.0, 89.0, 60))  # angles of diffuse light
LEAST_PASSED = 1e-3  # transmittance below which nothing follows from what passed


@dataclass(frozen=True, slots=True)
class PaneOptics:
    """Transmittance, front and back reflectance of a pane; any shape, such as per angle."""

    tau: FloatArray  # [...]
    rho_front: FloatArray  # [...]
    rho_back: FloatArray  # [...]

    def turned(self) -> PaneOptics:
        """The pane seen from its other side."""
        return PaneOptics(self.tau, self.rho_back, self.rho_front)


@dataclass(frozen=True, slots=True)
class StackOptics:
    """A stack of n panes, for light that meets the first one; `rho_back` for the other side."""

    tau: FloatArray  # [...]
    rho_front: FloatArray  # [...]
    rho_back: FloatArray  # [...]
    absorptance: FloatArray  # [..., n] of each pane


def pane_optics(pane: Pane, theta: ArrayLike) -> PaneOptics:
    """A pane at angles of incidence [...] [rad], see `glazing.pane_values`."""
    return PaneOptics(*pane_values(pane, theta))


def stack(panes: Sequence[PaneOptics]) -> StackOptics:
    """Panes from outside to inside as one glazing, all reflections between them counted.

    Intensities are added, so each polarisation or wavelength needs its own index in the
    arrays where it matters.

    Source: EN 410:2011, formulas (1) to (4), extended pane by pane.
    """
    if not panes:
        raise ValueError("expected at least one pane")
    first = panes[0]
    tau, front, back = first.tau, first.rho_front, first.rho_back
    absorbed, from_inside = [1 - tau - front], [1 - tau - back]
    for pane in panes[1:]:
        # two mirrors at 90 degrees transmit nothing: the denominator is 0 there
        bounce = 1 / np.maximum(1 - back * pane.rho_front, 1e-12)
        inward, kept = tau * bounce, 1 - pane.tau - pane.rho_front
        outward = inward * pane.rho_front
        absorbed = [a + outward * i for a, i in zip(absorbed, from_inside, strict=True)]
        absorbed.append(inward * kept)
        returned = pane.tau * bounce
        from_inside = [i * returned for i in from_inside]
        from_inside.append(1 - pane.tau - pane.rho_back + returned * back * kept)
        front = front + tau * outward
        tau, back = inward * pane.tau, pane.rho_back + returned * back * pane.tau
    return StackOptics(tau, front, back, np.stack(absorbed, axis=-1))


def hemispherical_mean(values: ArrayLike, theta: ArrayLike) -> FloatArray:
    """Mean over the hemisphere of values [T, ...] given at angles [T] [rad] from 0 to pi/2.

    2 int value sin cos dtheta, as for a uniform sky.
    """
    weight = np.diff(np.sin(np.asarray(theta, dtype=float)) ** 2)
    v = np.asarray(values, dtype=float)
    return np.tensordot(weight, 0.5 * (v[1:] + v[:-1]), axes=(0, 0)) / weight.sum()


def absorbed_by_layers(
    layers: Sequence[Pane | None],
    transmittance: ArrayLike,
    reflectance: ArrayLike,
    theta: ArrayLike,
) -> FloatArray:
    """Absorptance of every layer [K, N] of a system; its sum is 1 - tau - rho of the system.

    The panes on the outer side of the shade absorb part of the beam and of the light that the shade
    reflects, (rho - rho_o)/tau_o,dif.  The panes on its room side absorb in
    proportion to the transmission: tau a_i/tau_i,dif.  The shade absorbs the rest.

    Args:
        layers: from outside to inside; None is a shade, of which there is at most one.
        transmittance, reflectance: [K] of the whole system, direction to hemisphere.
        theta: angles of incidence [K] [rad].
    """
    tau, rho, angles = (np.asarray(v, dtype=float) for v in (transmittance, reflectance, theta))
    total = np.maximum(1.0 - tau - rho, 0.0)
    shades = [i for i, layer in enumerate(layers) if layer is None]
    if len(shades) > 1:
        raise ValueError("expected at most one shade")
    panes = [layer for layer in layers if layer is not None]
    if not shades:
        absorbed = _stacked(panes, angles).absorptance
        return absorbed * (total / np.maximum(absorbed.sum(axis=1), 1e-12))[:, None]
    outer = _before(panes[: shades[0]], rho, angles)
    inner = _behind(panes[shades[0] :], tau)
    others = np.concatenate([outer, inner], axis=1)
    # measured optics and the panes' may not quite agree: the shade never gets less than nothing
    scale = np.minimum(1.0, total / np.maximum(others.sum(axis=1), 1e-12))
    outer, inner = outer * scale[:, None], inner * scale[:, None]
    shade = total - outer.sum(axis=1) - inner.sum(axis=1)
    return np.concatenate([outer, np.maximum(shade, 0.0)[:, None], inner], axis=1)


def _before(panes: Sequence[Pane], rho: FloatArray, theta: FloatArray) -> FloatArray:
    """Absorptances [K, n] of panes outside the shade."""
    if not panes:
        return np.zeros((len(theta), 0))
    beam = _stacked(panes, theta)
    passed, absorbed = _diffuse(panes[::-1], from_room=True)
    back = np.maximum(rho - beam.rho_front, 0.0) / max(passed, LEAST_PASSED)
    return beam.absorptance + np.minimum(back, 1.0)[:, None] * absorbed[::-1]


def _behind(panes: Sequence[Pane], tau: FloatArray) -> FloatArray:
    """Absorptances [K, n] of panes inside the shade, which light meets diffuse."""
    if not panes:
        return np.zeros((len(tau), 0))
    passed, absorbed = _diffuse(panes)
    return tau[:, None] * absorbed / max(passed, LEAST_PASSED)


def _diffuse(panes: Sequence[Pane], *, from_room: bool = False) -> tuple[float, FloatArray]:
    """Transmittance and absorptances [n] for diffuse light, as it meets the panes in turn."""
    stacked = _stacked(panes, HEMISPHERE, from_room=from_room)
    passed = hemispherical_mean(stacked.tau, HEMISPHERE)
    return float(passed), hemispherical_mean(stacked.absorptance, HEMISPHERE)


def _stacked(panes: Sequence[Pane], theta: FloatArray, *, from_room: bool = False) -> StackOptics:
    optics = [pane_optics(pane, theta) for pane in panes]
    return stack([optic.turned() for optic in optics] if from_room else optics)
