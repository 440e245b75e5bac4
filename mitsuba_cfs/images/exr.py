"""OpenEXR pictures: float luminance or radiance for programs that do not read Radiance's `.hdr`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike

from mitsuba_cfs import variants
from mitsuba_cfs.files import write_bytes
from mitsuba_cfs.images.view import View, format_view


def write_exr(path: str | PathLike[str], pixels: ArrayLike, view: View | None = None, *, comment: str = "") -> None:
    """Write a picture in 32-bit floats, whole or not at all, with its VIEW as an attribute.

    Args: pixels: luminance [ny, nx] [cd/m2] (channel Y) or radiance [ny, nx, 3] [W/m2/sr] (R G B).
    """
    variants.activate()
    values = np.asarray(pixels, dtype=np.float32)
    if values.ndim not in (2, 3) or values.shape[2:] not in ((), (3,)):
        raise ValueError(f"pixels of shape {values.shape}: expected [ny, nx] or [ny, nx, 3]")
    grey = values.ndim == 2
    kind = mi.Bitmap.PixelFormat.Y if grey else mi.Bitmap.PixelFormat.RGB
    bitmap = mi.Bitmap(np.ascontiguousarray(values[..., None] if grey else values), kind)
    about = bitmap.metadata()
    about["UNIT"] = "cd/m2" if grey else "W/m2/sr"
    if view is not None:
        about["VIEW"] = format_view(view)
    if comment:
        about["COMMENT"] = comment
    stream = mi.MemoryStream()  # Mitsuba's own file says nothing of a full disk
    with a_second_thread():
        bitmap.write(stream, mi.Bitmap.FileFormat.OpenEXR)
    write_bytes(path, stream.raw_buffer())


@contextmanager
def a_second_thread() -> Iterator[None]:
    """OpenEXR, in Mitsuba, waits forever for a second thread on a single core; provide one."""
    count = dr.thread_count()
    if count < 2:
        dr.set_thread_count(2)
    try:
        yield
    finally:
        if count < 2:
            dr.set_thread_count(count)
