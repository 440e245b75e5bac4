"""Klems matrices of any BSDF, for the matrix methods."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.evaluate import bsdf_values, direct_hemispherical
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis, KlemsBsdf
from mitsuba_cfs.bsdf.tensor_peak import without_beam
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf

BLOCKS = ("transmission_front", "transmission_back", "reflection_front", "reflection_back")


def klems_of(bsdf: Bsdf, basis: KlemsBasis = KLEMS_FULL, *, samples: int = 64) -> KlemsBsdf:
    """The BSDF on a Klems basis, all four blocks: means over pairs of patches.

        f[o, i] = mean of f(omega_o, omega_i) over both patches, weighted by their cosines

    Each column is scaled to the share of light that the block sends on from its patch, which is
    known better than the mean of so many pairs.  The through beam of a tree, whose cells lie across
    patches, is all on the diagonal, where the matrix methods expect direct transmission.

    Args: samples: pairs of directions for each pair of patches.
    """
    if isinstance(bsdf, KlemsBsdf) and bsdf.basis_in == bsdf.basis_out == basis:
        return bsdf.filled()
    rest = without_beam(bsdf) if isinstance(bsdf, TensorTreeBsdf) else bsdf
    blocks = {name: _block(bsdf, rest, name, basis, samples) for name in BLOCKS}
    straight = bsdf.see_through if bsdf.see_through is not None else 1.0
    return KlemsBsdf(basis, basis, **blocks, see_through=straight)


def _block(
    bsdf: Bsdf, rest: Bsdf, name: str, basis: KlemsBasis, samples: int
) -> NDArray[np.float64]:
    """One block [K out, K in] [1/sr]; `rest`: the same without its beam."""
    from scipy.stats import qmc  # half a second, for trees only

    transmits, front = name.startswith("transmission"), name.endswith("front")
    K, patches = basis.size, np.arange(basis.size)
    total, towards = np.zeros((K, K)), []
    if isinstance(bsdf, TensorTreeBsdf) and bsdf.lookup(name)[0] is None:
        return total
    for u_in, v_in, u_out, v_out in qmc.Sobol(4, seed=0).random(samples):
        incident = _directions(basis, patches, u_in, v_in) * [1, -1, 1 if front else -1]
        outgoing = _directions(basis, patches, u_out, v_out) * [-1, 1, -1]
        if front != transmits:  # it leaves outdoors
            outgoing[:, 2] *= -1
        values = bsdf_values(rest, np.tile(incident, (K, 1)), np.repeat(outgoing, K, axis=0))
        total += values.reshape(K, K)
        towards.append(incident)
    incident, omega = np.concatenate(towards), basis.projected_solid_angles()
    share = _sent_on(rest, name, incident, samples)
    beams = transmits and rest is not bsdf
    whole = _sent_on(bsdf, name, incident, samples) if beams else share
    sampled = omega @ total
    scattered = total * np.divide(share, sampled, out=np.ones(K), where=sampled > 0)
    return scattered + np.diag((whole - share) / omega)


def _sent_on(
    bsdf: Bsdf, name: str, incident: NDArray[np.float64], samples: int
) -> NDArray[np.float64]:
    """Share [K] of the light of each patch that a block sends on, the mean of its directions."""
    return direct_hemispherical(bsdf, name, incident).reshape(samples, -1).mean(axis=0)


def _directions(
    basis: KlemsBasis, patches: NDArray[np.int64], u: float, v: float
) -> NDArray[np.float64]:
    """Components [K, 3] of a point of each patch, z upwards; see `KlemsBasis`."""
    theta, phi = basis.angles_within(patches, u, v)
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)
