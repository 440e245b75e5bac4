"""The matrices of a view's pixels, kept on disk beside the other traced matrices."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
from scipy import sparse

from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import opened_arrays, replacing
from mitsuba_cfs.glare.annual import PictureMatrix
from mitsuba_cfs.images.view import View
from mitsuba_cfs.matrices.cache import UNREADABLE, MatrixCache
from mitsuba_cfs.trace.annual_pictures import ViewMatrices, view_matrices

LARGEST = 256 << 20  # [bytes] larger ones are traced anew: they would push out all the others


def kept_view(
    cache: MatrixCache | None, view: View, inputs: tuple, trace: Callable[[], ViewMatrices]
) -> ViewMatrices:
    """The matrices of a view from the cache, or as `trace` gives them, and then kept.

    Args: inputs: all that they follow from beside the view.
    """
    if cache is None:
        return trace()
    path = cache.entry("view pictures", view, *inputs, by=view_matrices.__module__).path
    try:
        return _read(path, view)
    except FileNotFoundError:
        pass
    except UNREADABLE:
        path.unlink(missing_ok=True)
    found = trace()
    if 2 * found.lit.rows.nbytes <= LARGEST:
        _write(path, found)
        cache.trim(keep=path)
    return found


def _read(path: Path, view: View) -> ViewMatrices:
    with opened_arrays(path) as data:
        row, share = data["row"], data["share"]
        parts = (PictureMatrix(data[name], row, share) for name in ("indirect", "lit"))
        seen = tuple(data[f"seen_{name}"] for name in ("data", "indices", "indptr"))
        found = ViewMatrices(
            view, data["pixels"], *parts, sparse.csr_array(seen, shape=tuple(data["seen_shape"]))
        )
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
                row=found.lit.row,
                share=found.lit.share,
                seen_data=found.seen.data,
                seen_indices=found.seen.indices,
                seen_indptr=found.seen.indptr,
                seen_shape=np.array(found.seen.shape),
            )
