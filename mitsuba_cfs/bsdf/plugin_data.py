"""The band of a BSDF file that a plugin's properties name, with its colour."""

from __future__ import annotations

import mitsuba as mi

from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.colour import COLOUR_BANDS
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError

PREFIXES = ("", "cie_x_", "cie_z_")  # of the tensors of a plugin's grey, X and Z bands


def read_band(props, kind: type[Bsdf]) -> tuple[Bsdf, tuple[Bsdf, Bsdf] | None]:
    """The band `band` (Visible) of the file `filename`, and the X and Z that go with Visible.

    Like a mesh's, the name starts at the folder of the scene file, or at the current one.
    """
    path, band = str(mi.file_resolver().resolve(props["filename"])), props.get("band", "Visible")
    bands = read_bsdf_xml(path).bands
    bsdf = bands.get(band)
    if not isinstance(bsdf, kind):
        held = ", ".join(f"{name} ({type(b).__name__})" for name, b in bands.items())
        raise DataError(
            f"expected a {kind.__name__}, the file holds {held}", file=path, element=band
        )
    if band != "Visible" or not all(name in bands for name in COLOUR_BANDS):
        return bsdf, None
    return bsdf, (bands[COLOUR_BANDS[0]], bands[COLOUR_BANDS[1]])
