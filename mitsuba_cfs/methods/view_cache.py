"""The matrices of a view's pixels in the cache, beside the other traced matrices."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import opened_arrays, replacing
from mitsuba_cfs.glare.annual import PictureMatrix
from mitsuba_cfs.images.view import View
from mitsuba_cfs.matrices.cache import UNREADABLE, MatrixCache
from mitsuba_cfs.trace.kernels.patch_light import PatchLight
from mitsuba_cfs.trace.pictures.annual import ViewMatrices, ViewNoise, view_matrices
from mitsuba_cfs.trace.sun.sunlit_rows import SunlitRows, sparse_arrays, sparse_matrix

LARGEST = 256 << 20  # [bytes] of a file; larger ones would push out all the others

T = TypeVar("T")


def cached_view(
    cache: MatrixCache | None,
    view: View,
    inputs: tuple[object, ...],
    trace: Callable[..., ViewMatrices],
    *,
    light: PatchLight | None = None,
) -> ViewMatrices:
    """The matrices of a view from the cache; traced and stored where they are not in it.

    Their shares of the sunlit surfaces have a file of their own, which serves every light.

    Args:
        inputs: all that they depend on besides the view and the light.
        trace: called with `light` and the cached `sunlit`, None where there are none.
    """
    if cache is None:
        return trace(light=light, sunlit=None)
    path, beside = _view_file(cache, view, inputs, light), _sunlit_file(cache, view, inputs)
    sunlit = _read_or_none(beside, _read_sunlit)
    matrices = _read_or_none(path, lambda file: _read_view(file, view, sunlit))
    if matrices is None:
        matrices = trace(light=light, sunlit=sunlit)
        traced = matrices.sunlit
        # the file of the view is of no use without that of its sunlit surfaces
        if traced is sunlit or (traced is not None and _write(beside, traced.arrays())):
            _write(path, _of_view(matrices))
        cache.trim(keep=path)
    return matrices


def view_is_cached(cache: MatrixCache | None, view: View, inputs: tuple[object, ...]) -> bool:
    """Whether the cache has the matrices of a view; arguments as of `cached_view`."""
    if cache is None:
        return False
    return all(file(cache, view, inputs).is_file() for file in (_view_file, _sunlit_file))


def _view_file(
    cache: MatrixCache, view: View, inputs: tuple[object, ...], light: PatchLight | None = None
) -> Path:
    of_hours = () if light is None else (light.lit, light.later)
    by = view_matrices.__module__
    return cache.entry("view pictures", view, *inputs, *of_hours, by=by).path


def _sunlit_file(cache: MatrixCache, view: View, inputs: tuple[object, ...]) -> Path:
    return cache.entry("view sunlit", view, *inputs, by=view_matrices.__module__).path


def _read_or_none(path: Path, read: Callable[[Path], T]) -> T | None:
    """The content of a file; None where it is missing, or unreadable and therefore deleted."""
    try:
        content = read(path)
        os.utime(path)  # used now
    except FileNotFoundError:
        return None
    except UNREADABLE:
        path.unlink(missing_ok=True)
        return None
    return content


def _read_view(path: Path, view: View, sunlit: SunlitRows | None) -> ViewMatrices | None:
    """None where their shares of the sunlit surfaces are missing from the cache."""
    with opened_arrays(path) as data:
        if data["sunlit"] and sunlit is None:
            return None
        row, share = data["row"], data["share"]
        indirect, lit = (PictureMatrix(data[name], row, share) for name in ("indirect", "lit"))
        noise, seen = (
            ViewNoise(data["indirect_noise"], data["lit_noise"]),
            sparse_matrix(data, "seen"),
        )
        return ViewMatrices(view, data["pixels"], indirect, lit, seen, noise, sunlit)


def _read_sunlit(path: Path) -> SunlitRows:
    with opened_arrays(path) as data:
        return SunlitRows.of_arrays(data)


def _write(path: Path, arrays: dict[str, NDArray[Any]]) -> bool:
    """Write arrays that are not too large; the file is the old one or the new one at any time."""
    if sum(array.nbytes for array in arrays.values()) > LARGEST:
        return False
    # a folder that cannot be written to costs the cache, not the run
    with suppress(OSError, DataError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as part:
            np.savez(part, **arrays)  # type: ignore[arg-type] # its stub takes a flag by name
        return True
    return False


def _of_view(matrices: ViewMatrices) -> dict[str, NDArray[Any]]:
    """The matrices without their shares of the sunlit surfaces."""
    return {
        "pixels": matrices.pixels,
        "indirect": matrices.indirect.rows,
        "lit": matrices.lit.rows,
        "indirect_noise": matrices.noise.indirect,
        "lit_noise": matrices.noise.lit,
        "row": matrices.lit.row,
        "share": matrices.lit.share,
        "sunlit": np.array(matrices.sunlit is not None),
        **sparse_arrays("seen", matrices.seen),
    }
