"""The matrices of a view's pixels, kept on disk beside the other traced matrices."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

import numpy as np
from scipy import sparse

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import opened_arrays, replacing
from mitsuba_cfs.glare.annual import PictureMatrix
from mitsuba_cfs.images.view import View
from mitsuba_cfs.matrices.cache import UNREADABLE, MatrixCache
from mitsuba_cfs.trace.kernels.patch_light import PatchLight
from mitsuba_cfs.trace.pictures.annual import ViewMatrices, ViewNoise, view_matrices
from mitsuba_cfs.trace.sun.room_sun import SunlitRows

SPARSE = ("data", "indices", "indptr", "shape")  # the parts of a sparse matrix
LARGEST = 256 << 20  # [bytes] larger ones are traced anew: they would push out all the others

T = TypeVar("T")


def kept_view(
    cache: MatrixCache | None,
    view: View,
    inputs: tuple,
    trace: Callable[..., ViewMatrices],
    *,
    light: PatchLight | None = None,
) -> ViewMatrices:
    """The matrices of a view from the cache, or as `trace` gives them, and then kept.

    Their elements have a file of their own, found again whatever the light is.

    Args:
        inputs: all that they follow from beside the view and the light.
        trace: by `light` and the kept `elements`, None where there are none.
    """
    if cache is None:
        return trace(light=light, elements=None)
    path, beside = _place(cache, view, inputs, light), _elements_place(cache, view, inputs)
    elements = _kept(beside, _read_elements)
    found = _kept(path, lambda file: _read(file, view, elements))
    if found is None:
        found = trace(light=light, elements=elements)
        sunlit = found.elements
        # matrices without the elements that they have would be of no use
        if sunlit is elements or (sunlit is not None and _write(beside, sunlit.arrays())):
            _write(path, _of_view(found))
        cache.trim(keep=path)
    return found


def holds_view(cache: MatrixCache | None, view: View, inputs: tuple) -> bool:
    """Whether the cache has the matrices of a view; arguments as of `kept_view`."""
    if cache is None:
        return False
    return all(place(cache, view, inputs).is_file() for place in (_place, _elements_place))


def _place(cache: MatrixCache, view: View, inputs: tuple, light: PatchLight | None = None) -> Path:
    of_hours = () if light is None else (light.lit, light.later)
    by = view_matrices.__module__
    return cache.entry("view pictures", view, *inputs, *of_hours, by=by).path


def _elements_place(cache: MatrixCache, view: View, inputs: tuple) -> Path:
    return cache.entry("view elements", view, *inputs, by=view_matrices.__module__).path


def _kept(path: Path, read: Callable[[Path], T]) -> T | None:
    """What a file holds; None where it is missing, or cannot be read and goes."""
    try:
        found = read(path)
        os.utime(path)  # used now
    except FileNotFoundError:
        return None
    except UNREADABLE:
        path.unlink(missing_ok=True)
        return None
    return found


def _read(path: Path, view: View, elements: SunlitRows | None) -> ViewMatrices | None:
    """None where these have elements, and theirs are not kept."""
    with opened_arrays(path) as data:
        if data["sunlit"] and elements is None:
            return None
        row, share = data["row"], data["share"]
        parts = (PictureMatrix(data[name], row, share) for name in ("indirect", "lit"))
        noise = ViewNoise(data["indirect_noise"], data["lit_noise"])
        return ViewMatrices(view, data["pixels"], *parts, _sparse(data, "seen"), noise, elements)


def _read_elements(path: Path) -> SunlitRows:
    with opened_arrays(path) as data:
        return SunlitRows.of_arrays(data)


def _write(path: Path, arrays: dict[str, np.ndarray]) -> bool:
    """Write arrays that are not too large; the file is the old one or the new one at any time."""
    if sum(array.nbytes for array in arrays.values()) > LARGEST:
        return False
    # a folder that cannot be written to costs the keeping, not the run
    with suppress(OSError, DataError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as part:
            np.savez(part, **arrays)
        return True
    return False


def _of_view(found: ViewMatrices) -> dict[str, np.ndarray]:
    """The matrices but for their elements."""
    return {
        "pixels": found.pixels,
        "indirect": found.indirect.rows,
        "lit": found.lit.rows,
        "indirect_noise": found.noise.indirect,
        "lit_noise": found.noise.lit,
        "row": found.lit.row,
        "share": found.lit.share,
        "sunlit": np.array(found.elements is not None),
        **_arrays("seen", found.seen),
    }


def _arrays(name: str, matrix: sparse.csr_array) -> dict[str, np.ndarray]:
    """A sparse matrix as the arrays of a file."""
    parts = {part: getattr(matrix, part) for part in SPARSE}
    return {f"{name}_{part}": np.asarray(array) for part, array in parts.items()}


def _sparse(data: Mapping[str, np.ndarray], name: str) -> sparse.csr_array:
    """A sparse matrix from the arrays of a file."""
    *parts, shape = (data[f"{name}_{part}"] for part in SPARSE)
    return sparse.csr_array(tuple(parts), shape=tuple(shape))
