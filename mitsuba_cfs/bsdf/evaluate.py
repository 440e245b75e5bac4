"""BSDF values and hemispherical shares for directions, from either form of data."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf, disk_to_square
from mitsuba_cfs.directions import incident_azimuth, outgoing_azimuth

ISOTROPIC_EDGE = 0.5 - 1e-6  # of (1 - sin(theta)) / 2: normal incidence lies within the used half


def bsdf_values(bsdf: Bsdf, incident: ArrayLike, outgoing: ArrayLike) -> NDArray[np.float64]:
    """BSDF [N] [1/sr] for unit vectors to the light source and along the outgoing light [N, 3].

    Both in the window frame; which of the four blocks applies follows from their sides.
    """
    incident, outgoing = np.atleast_2d(incident), np.atleast_2d(outgoing)
    incident, outgoing = np.broadcast_arrays(incident, outgoing)
    values = np.zeros(len(incident))
    front = incident[:, 2] > 0
    reflected = front == (outgoing[:, 2] > 0)
    for side, chosen in (("front", front), ("back", ~front)):
        for kind, mask in (
            ("reflection", chosen & reflected),
            ("transmission", chosen & ~reflected),
        ):
            if mask.any():
                values[mask] = _block_values(bsdf, f"{kind}_{side}", incident[mask], outgoing[mask])
    return values


def direct_hemispherical(bsdf: Bsdf, block: str, incident: ArrayLike) -> NDArray[np.float64]:
    """Share [N] of the light from the directions [N, 3] that `block` scatters."""
    incident = np.atleast_2d(incident)
    if isinstance(bsdf, KlemsBsdf):
        full = bsdf.filled()
        return full.direct_hemispherical(getattr(full, block))[_patches(full, incident)]
    tree, turned = bsdf.lookup(block)
    if tree is None:
        return np.zeros(len(incident))
    if turned:
        tree = tree.reversed()
    shares = tree.hemispherical()
    if tree.rank == 3:
        cell = (_isotropic_position(incident) * (1 << tree.depth)).astype(int)
        return shares[np.minimum(cell, len(shares) - 1)]
    cell = np.minimum(
        (disk_to_square(incident_disk(incident)) * len(shares)).astype(int), len(shares) - 1
    )
    return shares[cell[:, 0], cell[:, 1]]


def incident_disk(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Point of the disk [N, 2], sin(theta) (cos(phi), sin(phi)), that incident light has."""
    return directions[..., :2] * [1.0, -1.0]


def outgoing_disk(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Point of the disk [N, 2] that outgoing light has; opposite to that of incident light."""
    return directions[..., :2] * [-1.0, 1.0]


def tree_position(
    tree: TensorTree, incident: NDArray[np.float64], outgoing: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Position [.., rank] in the tree's hypercube of pairs of directions [.., 3]."""
    if tree.rank == 4:
        squares = disk_to_square(incident_disk(incident)), disk_to_square(outgoing_disk(outgoing))
        return np.concatenate(squares, axis=-1)
    x, y = np.moveaxis(incident_disk(incident), -1, 0)
    sine = np.hypot(x, y)
    c = np.divide(x, sine, out=np.ones_like(x), where=sine > 0)
    s = np.divide(y, sine, out=np.zeros_like(y), where=sine > 0)
    u, v = np.moveaxis(outgoing_disk(outgoing), -1, 0)
    turned = disk_to_square(np.stack([u * c + v * s, v * c - u * s], -1))
    return np.concatenate([_isotropic_position(incident)[..., None], turned], axis=-1)


def _isotropic_position(incident: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.minimum(0.5 - 0.5 * np.hypot(incident[..., 0], incident[..., 1]), ISOTROPIC_EDGE)


def _block_values(
    bsdf: Bsdf, block: str, incident: NDArray[np.float64], outgoing: NDArray[np.float64]
) -> NDArray[np.float64]:
    if isinstance(bsdf, KlemsBsdf):
        full = bsdf.filled()
        theta = np.arccos(np.clip(np.abs(outgoing[:, 2]), 0, 1))
        patch_out = full.basis_out.index(theta, outgoing_azimuth(outgoing))
        return getattr(full, block)[patch_out, _patches(full, incident)]
    return _tree_values(bsdf, block, incident, outgoing)


def _tree_values(
    bsdf: TensorTreeBsdf, block: str, incident: NDArray[np.float64], outgoing: NDArray[np.float64]
) -> NDArray[np.float64]:
    tree, turned = bsdf.lookup(block)
    if tree is None:
        return np.zeros(len(incident))
    if turned:  # the other side's tree by reciprocity
        incident, outgoing = outgoing, incident
    return tree.values[tree.leaf(tree_position(tree, incident, outgoing))]


def _patches(full: KlemsBsdf, incident: NDArray[np.float64]) -> NDArray[np.int64]:
    theta = np.arccos(np.clip(np.abs(incident[:, 2]), 0, 1))
    return full.basis_in.index(theta, incident_azimuth(incident))
