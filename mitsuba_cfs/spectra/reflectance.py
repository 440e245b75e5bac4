"""Reflectance of surfaces by wavelength."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.spectra.detectors import NANOMETRES, illuminant, sensitivities

FloatArray = NDArray[np.float64]


@cache
def _primaries() -> FloatArray:
    """Reflectances of red, green and blue [3, N], which add up to 1."""
    from colour.recovery import MSDS_BASIS_FUNCTIONS_sRGB_MALLETT2019 as basis

    return np.stack([np.interp(NANOMETRES, basis.wavelengths, column) for column in basis.values.T])


def reflectance_of_colour(linear: ArrayLike) -> FloatArray:
    """Smooth reflectance [.., N] of linear sRGB under D65 [.., 3]; channels are limited to 0 to 1.

    Source: Mallett and Yuksel 2019, "Spectral primary decomposition for rendering with sRGB
    reflectance", Eurographics Symposium on Rendering (tables of colour-science).
    """
    return np.clip(np.asarray(linear, dtype=float), 0.0, 1.0) @ _primaries()


def with_visible(spectrum: ArrayLike, visible: ArrayLike) -> FloatArray:
    """Reflectance [.., N] of the shape of a spectrum whose mean for D65 and V(lambda) is given [..].

    Where that would reflect more than all light at some wavelength, the colour is paler.
    """
    spectrum, visible = np.asarray(spectrum, dtype=float), np.asarray(visible, dtype=float)[..., None]
    weight = illuminant("D65") * sensitivities()[0]
    mean = (spectrum @ weight / weight.sum())[..., None]
    scaled = spectrum * np.divide(visible, mean, out=np.ones_like(mean), where=mean > 0)
    most = scaled.max(axis=-1, keepdims=True)
    share = np.where(most > 1.0, (1.0 - visible) / np.maximum(most - visible, 1e-12), 1.0)
    whole: FloatArray = visible + share * (scaled - visible)
    return whole
