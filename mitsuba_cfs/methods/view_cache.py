"""The matrices of a view's pixels, kept on disk beside the other traced matrices."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np
from scipy import sparse

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import opened_arrays, replacing
from mitsuba_cfs.glare.annual import PictureMatrix
from mitsuba_cfs.images.view import View
from mitsuba_cfs.matrices.cache import UNREADABLE, MatrixCache
from mitsuba_cfs.trace.annual_pictures import ViewMatrices, ViewNoise, view_matrices
from mitsuba_cfs.trace.room_sun import EdgePlaces, SunElements
from mitsuba_cfs.trace.sun_paths import Places

SPARSE = ("data", "indices", "indptr", "shape")  # the parts of a sparse matrix
LARGEST = 256 << 20  # [bytes] larger ones are traced anew: they would push out all the others


def kept_view(
    cache: MatrixCache | None, view: View, inputs: tuple, trace: Callable[[], ViewMatrices]
) -> ViewMatrices:
    """The matrices of a view from the cache, or as `trace` gives them, and then kept.

    Args: inputs: all that they follow from beside the view.
    """
    if cache is None:
        return trace()
    path = _place(cache, view, inputs)
    try:
        return _read(path, view)
    except FileNotFoundError:
        pass
    except UNREADABLE:
        path.unlink(missing_ok=True)
    found = trace()
    if 4 * found.lit.rows.nbytes <= LARGEST:
        _write(path, found)
        cache.trim(keep=path)
    return found


def holds_view(cache: MatrixCache | None, view: View, inputs: tuple) -> bool:
    """Whether the cache has the matrices of a view; arguments as of `kept_view`."""
    return cache is not None and _place(cache, view, inputs).is_file()


def _place(cache: MatrixCache, view: View, inputs: tuple) -> Path:
    return cache.entry("view pictures", view, *inputs, by=view_matrices.__module__).path


def _read(path: Path, view: View) -> ViewMatrices:
    with opened_arrays(path) as data:
        row, share = data["row"], data["share"]
        parts = (PictureMatrix(data[name], row, share) for name in ("indirect", "lit"))
        elements: list[SunElements | None] = [None, None]
        if "places_point" in data:
            places = Places(data["places_point"], data["places_normal"])
            more = Places(data["more_point"], data["more_normal"])
            ends = _sparse(data, "smooth"), EdgePlaces(more, _sparse(data, "beside"))
            elements = [
                SunElements(places, _sparse(data, f"far{i}"), _sparse(data, f"near{i}"), *ends)
                for i in range(2)
            ]
        noise = ViewNoise(data["indirect_noise"], data["lit_noise"], elements[1])
        seen = _sparse(data, "seen")
        found = ViewMatrices(view, data["pixels"], *parts, seen, noise, elements[0])
    os.utime(path)  # used now
    return found


def _write(path: Path, found: ViewMatrices) -> None:
    """Write the matrices; the file is the old one or the new one at any time."""
    # a folder that cannot be written to costs the keeping, not the run
    with suppress(OSError, DataError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as part:
            np.savez(
                part,
                pixels=found.pixels,
                indirect=found.indirect.rows,
                lit=found.lit.rows,
                indirect_noise=found.noise.indirect,
                lit_noise=found.noise.lit,
                row=found.lit.row,
                share=found.lit.share,
                **_arrays("seen", found.seen),
                **_of_elements(found.elements, found.noise.elements),
            )


def _of_elements(*elements: SunElements | None) -> dict[str, np.ndarray]:
    """The elements, and those of their noise, which are in the same places."""
    arrays: dict[str, np.ndarray] = {}
    for i, found in enumerate(elements):
        if found is not None:
            arrays |= _arrays(f"far{i}", found.share) | _arrays(f"near{i}", found.near)
            arrays |= _arrays("smooth", found.smooth)
            arrays |= _arrays("beside", found.edges.beside)
            for name, places in (("places", found.places), ("more", found.edges.places)):
                arrays |= {f"{name}_point": places.point, f"{name}_normal": places.normal}
    return arrays


def _arrays(name: str, matrix: sparse.csr_array) -> dict[str, np.ndarray]:
    """A sparse matrix as the arrays of a file."""
    parts = {part: getattr(matrix, part) for part in SPARSE}
    return {f"{name}_{part}": np.asarray(array) for part, array in parts.items()}


def _sparse(data: Mapping[str, np.ndarray], name: str) -> sparse.csr_array:
    """A sparse matrix from the arrays of a file."""
    *parts, shape = (data[f"{name}_{part}"] for part in SPARSE)
    return sparse.csr_array(tuple(parts), shape=tuple(shape))
