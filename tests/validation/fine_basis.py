"""Klems bases divided further: matrices of a BSDF at high resolution for the phase methods.

A basis is data, so V, D, T and the matrices of `mitsuba_cfs.bsdf.generate` all take a finer one;
V grows with its patches, T with their square.
"""

from __future__ import annotations

import numpy as np

from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBasis

CAP_AZIMUTHS = 8  # of the first ring round the pole, a multiple of it further out


def fine_basis(division: int, basis: KlemsBasis = KLEMS_FULL) -> KlemsBasis:
    """The basis with each ring divided `division` times, in polar angle and in azimuth.

    The cap becomes a smaller cap and rings round it.  Of the full basis 2 makes 585 patches, with
    rings of 5 degrees, 3 makes 1,321 with rings of 3.3.
    """
    if division < 1:
        raise ValueError(f"division: expected at least 1, got {division}")
    if division == 1:
        return basis
    bounds, counts = [0.0], []
    pairs = zip(basis.theta_bounds, basis.theta_bounds[1:], basis.phi_counts, strict=False)
    for low, high, count in pairs:
        bounds += np.linspace(low, high, division + 1)[1:].tolist()
        if count == 1:
            counts += [1, *(CAP_AZIMUTHS * k for k in range(1, division))]
        else:
            counts += [count * division] * division
    return KlemsBasis(f"{basis.name}, each patch {division} x {division}", tuple(bounds), tuple(counts))
