"""Data of a BSDF plugin: the band of a file, and its colour on Mitsuba's types."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.colour import COLOUR_BANDS, WAVELENGTHS_NM, primary_spectra
from mitsuba_cfs.bsdf.traced_klems import cell, gather, table
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
        raise DataError(f"expected a {kind.__name__}, the file holds {held}", file=path, element=band)
    if band != "Visible" or not all(name in bands for name in COLOUR_BANDS):
        return bsdf, None
    return bsdf, (bands[COLOUR_BANDS[0]], bands[COLOUR_BANDS[1]])


def sees_colour() -> bool:
    """Whether the active variant renders colours."""
    return "rgb" in mi.variant() or "spectral" in mi.variant()


class TracedColour:
    """Linear sRGB over the grey value, by table entry."""

    def __init__(self, relative: NDArray[np.float64]) -> None:
        """`relative` [E, 3], see `mitsuba_cfs.bsdf.colour.relative_rgb`."""
        self.channels = [table(channel) for channel in relative.T]
        if "spectral" in mi.variant():
            self.primaries = [table(spectrum) for spectrum in primary_spectra()]

    def spectrum(self, value, entry, si, active=True):
        """The value [1/sr] of `entry` in colour, at the interaction's wavelengths if it has any."""
        rgb = [value * gather(channel, entry, active) for channel in self.channels]
        if "spectral" not in mi.variant():
            return mi.Spectrum(mi.Color3f(*rgb))
        step = WAVELENGTHS_NM[1] - WAVELENGTHS_NM[0]
        last = len(WAVELENGTHS_NM) - 2
        seen = []
        for nm in si.wavelengths:
            place = dr.clip((nm - WAVELENGTHS_NM[0]) / step, 0.0, last + 0.999)
            below = cell(place, last)
            above = place - mi.Float(below)
            parts = [
                gather(spectrum, below, active) * (1 - above) + gather(spectrum, below + 1, active) * above
                for spectrum in self.primaries
            ]
            seen.append(rgb[0] * parts[0] + rgb[1] * parts[1] + rgb[2] * parts[2])
        return mi.Spectrum(*seen)


class TableParameter:
    """The numbers of a file's table as a differentiable parameter of a plugin; JIT variants alone.

    Directions are drawn with the numbers as they were read: results stay right where the parameter
    differs from these, with more noise, as long as nothing that was 0 becomes larger.
    """

    def __init__(self, values: NDArray[np.float64], numbers: NDArray[np.integer]) -> None:
        """From the values of the file, and which of them [E] is each entry of the plugin's table."""
        self._is_changed = False
        self.values = None
        if not mi.variant().startswith("scalar"):
            self.values = mi.TensorXf(np.ascontiguousarray(values, dtype=np.float32))
            self._numbers = mi.UInt32(np.ascontiguousarray(np.ravel(numbers), dtype=np.uint32))

    def traverse(self, callback, name: str) -> None:
        """Show the parameter."""
        if self.values is not None:
            callback.put(name, self.values, mi.ParamFlags.Differentiable)

    def changed(self) -> None:
        """Take the parameter's values from now on."""
        self._is_changed = True

    def value(self, entry, read, active=True):
        """The value of a table's entry; `read`: as the file has it."""
        if self.values is None or not (self._is_changed or dr.grad_enabled(self.values)):
            return read
        number = dr.gather(mi.UInt32, self._numbers, mi.UInt32(entry), active)
        return dr.gather(mi.Float, self.values.array, number, active)
