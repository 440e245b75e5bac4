"""A fenestration layer or system: its description and its BSDF in each spectral band."""

from __future__ import annotations

from dataclasses import dataclass

from mitsuba_cfs.bsdf.klems import KlemsBsdf
from mitsuba_cfs.bsdf.tensor_tree import TensorTreeBsdf

Bsdf = KlemsBsdf | TensorTreeBsdf


@dataclass(frozen=True)
class BsdfFile:
    """Contents of a BSDF XML file: description of the layer and its BSDF in each spectral band."""

    bands: dict[str, Bsdf]  # by "Visible", "Solar", "CIE-X", ...
    name: str = ""
    manufacturer: str = ""
    device_type: str = "Other"
    thickness: float | None = None  # [m]
    width: float | None = None  # [m]
    height: float | None = None  # [m]
    emissivity_front: float | None = None  # hemispherical, long wave
    emissivity_back: float | None = None
    infrared_transmittance: float | None = None
    conductivity: float | None = None  # [W/(m K)]
    notes: tuple[str, ...] = ()  # what the reader assumed or ignored

    def band(self, name: str) -> Bsdf:
        """The BSDF of band `name`; `ValueError` where the file has none."""
        if name not in self.bands:
            raise ValueError(f"no {name} band: the file has {', '.join(self.bands)}")
        return self.bands[name]
