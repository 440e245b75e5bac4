"""Pictures of EXR files, read back."""

from __future__ import annotations

import mitsuba as mi
import numpy as np

from mitsuba_cfs import variants
from mitsuba_cfs.images.exr import a_second_thread
from mitsuba_cfs.images.view import parse_view


def read_exr(path):
    """Pixels [ny, nx] or [ny, nx, 3] of an EXR file, and the view that it was written with."""
    variants.activate()
    with a_second_thread():
        bitmap = mi.Bitmap(str(path), mi.Bitmap.FileFormat.OpenEXR)
    values = np.array(bitmap.convert(component_format=mi.Struct.Type.Float32))
    height, width = values.shape[:2]
    about = bitmap.metadata()
    view = parse_view(str(about["VIEW"]), width, height) if "VIEW" in about else None
    return (values[..., 0] if values.shape[2:] == (1,) else values), view
