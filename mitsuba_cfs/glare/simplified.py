"""Simplified glare of many hours: eDGP from direct-only pictures, sDGP from illuminance alone.

For each method the illuminance at the eye is its own calculation, with all interreflections:

    three-phase    E_v = V T D s                                pictures V_d T D_d s
    five-phase     E_v = V T D s - V_d T D_d s_d + C_ds s_sun   pictures V_d T D_d s_sky + C s_sun
    paths          E_v of a sensor at the eye                   pictures of paths of one reflection

Source: Wienold 2009, "Dynamic daylight glare evaluation" (eDGP); the dissertation's 3.2.4 to 3.2.6,
whose equation (20) has the sun twice if its s_d holds it: here s_sky is the sky without the sun.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.glare import indices
from mitsuba_cfs.glare.annual import PictureMatrix, Pictures, annual_glare

Matrices = TypeVar("Matrices")
DIRECT_DEPTH = 2  # segments of a direct-only path behind what the eye sees: to window, to sky


def direct_only(matrices: Matrices) -> Matrices:
    """A view's matrices with V_d in place of V: what was reflected more than once is left out.

    Args: matrices: with the parts `indirect`, `lit` and `seen`, as `view_matrices` gives them.
    """
    lit = matrices.lit
    nothing = PictureMatrix(
        np.zeros((1, lit.rows.shape[1]), dtype=np.float32), np.zeros_like(lit.row), lit.share
    )
    return replace(matrices, indirect=nothing, elements=None)


def enhanced_simplified_dgp(
    direct: Pictures, illuminance: ArrayLike, **options: Any
) -> NDArray[np.float64]:
    """eDGP [H]: sources of direct-only pictures, illuminance [H] of its own calculation [lx].

    Args: options: of `annual_glare`.
    """
    return annual_glare(direct, illuminance=illuminance, **options).dgp


def simplified_dgp(illuminance: ArrayLike) -> NDArray[np.float64]:
    """sDGP = 6.22e-5 E_v + 0.184 [H], at most 1; see `indices.simplified_dgp`."""
    return np.array([indices.simplified_dgp(float(E)) for E in np.asarray(illuminance).ravel()])
