"""Layers in series: Klems matrix algebra, with the absorptance of each layer.

In the window frame light that passes straight through keeps its patch, and so does light that
one layer throws back to the next: the patch that it leaves a layer by is the one it arrives by.
With R and T as power transfer between patches and layers 0 (exterior) to N - 1, the flows towards
the room F_j and back B_j in gap j between layers j - 1 and j follow from

    F_j = Tf_(j-1) F_(j-1) + Rb_(j-1) B_j,      B_j = Rf_j F_j + Tb_j B_(j+1)

in which inter-reflection is a matrix inversion.

Source: Klems 1994, "A new method for predicting the solar heat gain of complex fenestration
systems II", ASHRAE Transactions 100.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.klems import KlemsBsdf


@dataclass(frozen=True)
class LayeredSystem:
    """The BSDF of a stack of layers, and the share of each incident patch that each absorbs."""

    bsdf: KlemsBsdf
    absorptance_front: NDArray[np.float64]  # [N layers, K] of light from outside, layer 0 outermost
    absorptance_back: NDArray[np.float64]  # [N layers, K] of light from the room


def combine_layers(layers: list[KlemsBsdf]) -> LayeredSystem:
    """The system of `layers`, the exterior one first; all on one basis."""
    if not layers:
        raise ValueError("a system needs a layer")
    basis = layers[0].basis_in
    if any(basis not in (layer.basis_in, layer.basis_out) or layer.basis_in != layer.basis_out for layer in layers):
        raise ValueError("the layers are on different bases")
    power = [_power_blocks(layer) for layer in layers]
    identity = np.eye(basis.size)
    zero = np.zeros_like(identity)
    front = _absorbed(power, _flows(power, identity, zero))
    back = _absorbed(power, _flows(power, zero, identity))
    area = basis.projected_solid_angles()[:, None]
    blocks: dict[str, Any] = {
        "transmission_front": front[0],
        "reflection_front": front[1],
        "reflection_back": back[0],
        "transmission_back": back[1],
    }
    bsdf = KlemsBsdf(basis, basis, **{name: np.maximum(p, 0) / area for name, p in blocks.items()})
    return LayeredSystem(bsdf, front[2], back[2])


Power = Sequence[tuple[NDArray[np.float64], ...]]  # Tf, Tb, Rf, Rb of each layer, the outermost first
Flows = list[NDArray[np.float64]]  # [K, K] in each gap


def _power_blocks(layer: KlemsBsdf) -> tuple[NDArray[np.float64], ...]:
    """Tf, Tb, Rf, Rb as power by outgoing patch [K, K] for unit power in the incident one."""
    full: Any = layer.filled()  # no block is None
    area = layer.basis_out.projected_solid_angles()[:, None]
    return tuple(
        area * block
        for block in (full.transmission_front, full.transmission_back, full.reflection_front, full.reflection_back)
    )


def _flows(power: Power, outside: NDArray[np.float64], inside: NDArray[np.float64]) -> tuple[Flows, Flows]:
    """Flows towards the room and back [N + 1] in the gaps, the outer ones given.

    From the room outwards each stack of layers is closed to (what it sends back) = S F + e; going
    inwards again gives the flows.
    """
    back_share, back_own = [np.zeros_like(outside)] * (len(power) + 1), [inside] * (len(power) + 1)
    bounce = [outside] * len(power)
    for j in reversed(range(len(power))):
        tf, tb, rf, rb = power[j]
        # behind layer j: F = Tf F0 + Rb B and B = S F + e, so F = (1 - Rb S)^-1 (Tf F0 + Rb e)
        share, own = back_share[j + 1], back_own[j + 1]
        bounce[j] = np.linalg.inv(np.eye(len(tf)) - rb @ share).astype(np.float64, copy=False)
        back_share[j] = rf + tb @ share @ bounce[j] @ tf
        back_own[j] = tb @ (share @ bounce[j] @ rb @ own + own)
    forward = [outside]
    for j, (tf, _, _, rb) in enumerate(power):
        forward.append(bounce[j] @ (tf @ forward[j] + rb @ back_own[j + 1]))
    backward = [back_share[j] @ forward[j] + back_own[j] for j in range(len(power) + 1)]
    return forward, backward


def _absorbed(power: Power, flows: tuple[Flows, Flows]) -> tuple[NDArray[np.float64], ...]:
    """Power sent to the room, power sent outdoors [K, K], and absorbed by each layer [N, K]."""
    forward, backward = flows
    absorbed = []
    for j, (tf, tb, rf, rb) in enumerate(power):
        kept_front, kept_back = 1 - (tf + rf).sum(axis=0), 1 - (tb + rb).sum(axis=0)
        absorbed.append(kept_front @ forward[j] + kept_back @ backward[j + 1])
    return forward[-1], backward[0], np.array(absorbed)
