"""Dense BSDF values made into a tensor tree: siblings that hardly differ become one leaf."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.tensor_text import row_major_order
from mitsuba_cfs.bsdf.tensor_tree import TensorTree

SIGMAS = 3.0
DARK = 1e-3 / np.pi  # [1/sr] what differs by less than a 0.1 % diffuser may be merged


def merged_tree(
    grid: NDArray[np.floating], *, relative: float = 0.1, absolute: float = 0.0, noise: float = 0.0
) -> TensorTree:
    """The tree of a dense grid [2^n] * rank [1/sr] within an error bound.

    Every leaf is the mean of its cells, so that energy is conserved, and none of
    those, nor of the leaves that would divide it, differs from it by more than

        max(relative x leaf, absolute) + 3 sqrt(noise x leaf / cells).

    Args:
        noise: variance of a traced cell's value over its value [1/sr], 1 / (paths x solid angle).
    """
    rank, levels = grid.ndim, int(np.log2(len(grid)))
    if grid.shape != (1 << levels,) * rank:
        raise ValueError(f"grid: expected 2^n cells along each axis, got {grid.shape}")
    width = 1 << rank
    values = grid.ravel()[row_major_order(rank, levels)].astype(np.float32)
    lowest = highest = values
    codes, result = [], []  # leaves: Morton code at the deepest level, (depth, value)
    whole = np.ones(len(values), dtype=bool)  # cells of this level that are one leaf so far
    for depth in range(levels, 0, -1):
        families = values.reshape(-1, width)
        mean = families.mean(axis=1, dtype=np.float64).astype(np.float32)
        low, high = lowest.reshape(-1, width).min(axis=1), highest.reshape(-1, width).max(axis=1)
        bound = np.maximum(relative * mean, absolute)
        single = SIGMAS * np.sqrt(noise * mean)
        fits = whole.reshape(-1, width).all(axis=1)
        fits &= np.maximum(high - mean, mean - low) <= bound + single
        spread = np.maximum(families.max(axis=1) - mean, mean - families.min(axis=1))
        fits &= spread <= bound + single / np.sqrt(float(width ** (levels - depth)))
        index = np.flatnonzero(whole & ~np.repeat(fits, width))
        codes.append(index << (rank * (levels - depth)))
        result.append((np.full(len(index), depth), values[index]))
        values, lowest, highest, whole = mean, low, high, fits
    if whole[0]:
        codes.append(np.zeros(1, dtype=np.int64))
        result.append((np.zeros(1, dtype=np.int64), values))
    order = np.argsort(np.concatenate(codes), kind="stable")
    depths = np.concatenate([depth for depth, _ in result])[order]
    return TensorTree(rank, depths, np.concatenate([v for _, v in result])[order].astype(float))


def culled_tree(grid: NDArray[np.floating], cull: float, *, noise: float = 0.0) -> tuple[TensorTree, float]:
    """The tree that keeps at most 1 - `cull` of a grid's cells, and the relative bound it took.

    As `rttree_reduce -t` does by percentage; the bound is found by bisection, and is at most 1.
    """
    if not 0 <= cull < 1:
        raise ValueError(f"cull: expected a share from 0 to below 1, got {cull}")

    def merged(relative: float) -> TensorTree:
        return merged_tree(grid, relative=relative, absolute=DARK, noise=noise)

    tree = merged(0.0)
    if len(tree.values) <= (1 - cull) * grid.size:
        return tree, 0.0
    low, high = 0.0, 1.0
    tree = merged(high)
    for _ in range(6):
        middle = 0.5 * (low + high)
        trial = merged(middle)
        if len(trial.values) <= (1 - cull) * grid.size:
            high, tree = middle, trial
        else:
            low = middle
    return tree, high


def reciprocal_means(
    there: NDArray[np.floating], back: NDArray[np.floating]
) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Two dense rank 4 grids, each the mean of itself and of the other one reversed.

    The total that each incident cell scatters is kept, because it is more accurate.
    """

    def reverse(grid: NDArray[np.floating]) -> NDArray[np.floating]:
        return grid[::-1, ::-1, ::-1, ::-1].transpose(2, 3, 0, 1)

    def rescaled(mean: NDArray[np.floating], own: NDArray[np.floating]) -> NDArray[np.floating]:
        total, shared = (v.mean(axis=(2, 3), keepdims=True) for v in (own, mean))
        return mean * np.divide(total, shared, out=np.ones_like(total), where=shared > 0)

    mean = 0.5 * (there + reverse(back))
    return rescaled(mean, there), rescaled(reverse(mean), back)
