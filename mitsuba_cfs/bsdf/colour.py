"""Colour of BSDF data: linear sRGB and spectra from the bands CIE-X, Visible (Y) and CIE-Z.

Each band is the share of what its own detector sees, so that X = Y = Z is neutral (as Radiance and
WINDOW write and read it).  Colour is kept as linear sRGB over Y: neutral is (1, 1, 1).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mitsuba_cfs.bsdf.tensor_tree import TensorTree
from mitsuba_cfs.spectra.detectors import NANOMETRES, illuminant, sensitivities

COLOUR_BANDS = ("CIE-X", "CIE-Z")
# linear sRGB from CIE XYZ (IEC 61966-2-1, as Mitsuba's `xyz_to_srgb`); its white is D65
XYZ_TO_RGB = np.array(
    [[3.240479, -1.537150, -0.498535], [-0.969256, 1.875991, 0.041556], [0.055648, -0.204043, 1.057311]]
)
RGB_TO_XYZ = np.linalg.inv(XYZ_TO_RGB)
WHITE = RGB_TO_XYZ.sum(axis=1)  # [3] X, Y, Z of what reflects all
WAVELENGTHS_NM = np.arange(360.0, 831.0, 10.0)  # Mitsuba's range


def relative_rgb(x: ArrayLike, y: ArrayLike, z: ArrayLike) -> NDArray[np.float64]:
    """Linear sRGB over Y [.., 3] of values of the three bands; neutral where Y is zero.

    Colours beyond sRGB are moved to its border, their Y kept.
    """
    x, y, z = (np.asarray(band, dtype=float) for band in (x, y, z))
    dark = y <= 0
    scale = 1 / np.where(dark, 1.0, y)
    xyz = np.stack([np.where(dark, 1.0, x * scale), np.ones_like(y), np.where(dark, 1.0, z * scale)])
    rgb = np.maximum(np.tensordot(xyz * WHITE.reshape(-1, *[1] * y.ndim), XYZ_TO_RGB, (0, 1)), 0.0)
    return rgb / (rgb @ RGB_TO_XYZ[1])[..., None]


def leaf_means(tree: TensorTree, other: TensorTree) -> NDArray[np.float64]:
    """Mean of `other`'s values over the cell of each leaf [L] of `tree`, of the same rank."""
    if tree.rank != other.rank:
        raise ValueError("the bands hold trees of different rank")
    sizes = [0.5 ** (each.rank * each.depths) for each in (tree, other)]
    ends, other_ends = (np.concatenate([[0.0], np.cumsum(size)]) for size in sizes)
    amount = np.concatenate([[0.0], np.cumsum(other.values * sizes[1])])
    return np.diff(np.interp(ends, other_ends, amount)) / sizes[0]


@cache
def primary_spectra() -> NDArray[np.float64]:
    """Spectra [3, N] of the primaries at `WAVELENGTHS_NM`: smooth, in 0..1, that add up to one.

    Under D65 each looks as its primary, so that r, g, b times them has the colour (r, g, b), and
    grey is constant over the wavelength.

    Source: after Mallett and Yuksel 2019, "Spectral primary decomposition for rendering with sRGB
    reflectance", EGSR (their conditions; solved here).
    """
    import colour
    from scipy.optimize import lsq_linear

    shape = colour.SpectralShape(360, 830, 10)
    seen = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape).values
    seen = seen * colour.SDS_ILLUMINANTS["D65"].copy().align(shape).values[:, None]
    rgb = XYZ_TO_RGB @ (seen / seen.sum(axis=0) * WHITE).T  # [3, N] each adds up to one
    n = len(WAVELENGTHS_NM)
    rough = np.kron(np.eye(3), np.diff(np.eye(n), 2, axis=0))
    looks = np.kron(np.eye(3), rgb)
    adds = np.tile(np.eye(n), 3)
    weight = 1e4  # of what must hold against what should be smooth
    system = np.concatenate([rough, weight * looks, weight * adds])
    wanted = np.concatenate([np.zeros(len(rough)), weight * np.eye(3).ravel(), np.full(n, weight)])
    spectra = lsq_linear(system, wanted, bounds=(0, 1)).x.reshape(3, n)
    return spectra / spectra.sum(axis=0)


def reflectance_of_colour(linear: ArrayLike) -> NDArray[np.float64]:
    """Smooth reflectance [.., N] at `NANOMETRES` of linear sRGB under D65 [.., 3], 0 to 1 each."""
    primaries = [np.interp(NANOMETRES, WAVELENGTHS_NM, row) for row in primary_spectra()]
    return np.clip(np.asarray(linear, dtype=float), 0.0, 1.0) @ np.array(primaries)


def with_visible(spectrum: ArrayLike, visible: ArrayLike) -> NDArray[np.float64]:
    """Reflectance [.., N] of the shape of a spectrum whose mean for D65 and V(lambda) is given [..].

    Where that would reflect more than all light at some wavelength, the colour is paler.
    """
    spectrum, visible = np.asarray(spectrum, dtype=float), np.asarray(visible, dtype=float)[..., None]
    weight = illuminant("D65") * sensitivities()[0]
    mean = (spectrum @ weight / weight.sum())[..., None]
    scaled = spectrum * np.divide(visible, mean, out=np.ones_like(mean), where=mean > 0)
    most = scaled.max(axis=-1, keepdims=True)
    share = np.where(most > 1.0, (1.0 - visible) / np.maximum(most - visible, 1e-12), 1.0)
    whole: NDArray[np.float64] = visible + share * (scaled - visible)
    return whole
