"""The layers of a glazing as tables of a TOML file: panes, shades and the gaps behind them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from mitsuba_cfs.bsdf.spectral_pane import (
    SpectralPane,
    read_spectral_pane,
    spectral_glazing,
)
from scenes import plausible
from scenes.toml_file import Positive, Share, TomlTable
from thermal.gases import GAS_NAMES
from thermal.glazing_unit import GasGap, GlazingLayer, GlazingUnit
from thermal.shade_layers import perforated_layer, sheet_layer, venetian_layer, woven_layer

Length = Annotated[Positive, plausible.LAYER]
Both = tuple[Share, Share]  # front (outdoors) and back
SHADES = ("slats", "threads", "holes", "openness")  # what makes a layer a shade


class LayerGapTable(TomlTable):
    """The space behind a layer, towards the room."""

    width: Annotated[Positive, plausible.GAP]  # [m]
    gas: dict[Literal[GAS_NAMES], Share] = Field({"air": 1.0})  # volume fractions


class SlatTable(TomlTable):
    """The slats of a venetian blind."""

    width: Length
    spacing: Length
    tilt_deg: Annotated[float, Field(ge=-90, le=90)] = 0.0  # positive lowers the outer edge
    thickness: Length = 0.0005


class CellTable(TomlTable):
    """Threads of a fabric or round holes of a screen: their diameter and spacing."""

    diameter: Length
    spacing: Length


class GlazingLayerTable(TomlTable):
    """A pane, from a file by wavelength or by its values; or a shade."""

    pane: Path | None = None  # Optics or IGSDB file
    turned: bool = False  # the pane's back is outdoors
    thickness: Length | None = None  # [m]
    conductivity: Annotated[float, plausible.CONDUCTIVITY] | None = None  # [W/(m K)]
    emissivity: Both | None = None  # of a shade: of its material
    infrared_transmittance: Share | None = None
    solar: tuple[Share, Share, Share] | None = None  # transmittance, reflectance front and back
    visible: tuple[Share, Share, Share] | None = None  # the same; without: as the sun's
    slats: SlatTable | None = None
    threads: CellTable | None = None
    holes: CellTable | None = None
    openness: Share | None = None  # open share of a shade of no known cell
    edges: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # [m] top, bottom, left, right
    gap: LayerGapTable | None = None  # none behind the innermost layer

    @model_validator(mode="after")
    def _is_one_kind(self) -> GlazingLayerTable:
        kinds = [name for name in ("pane", *SHADES) if getattr(self, name) is not None]
        if len(kinds) > 1:
            raise ValueError(f"{kinds[0]} and {kinds[1]} exclude each other")
        shade = self.is_shade
        if not kinds and self.thickness is None:
            raise ValueError("expected a pane (a file, or its thickness) or one of " + _listed())
        for key in ("solar", "visible") if shade else ():
            if getattr(self, key) is not None:
                raise ValueError(f"{key}: is of panes; what a shade absorbs follows from the BSDF")
        if not shade and any(self.edges):
            raise ValueError("edges: are of shades: " + _listed())
        return self

    @property
    def is_shade(self) -> bool:
        """Whether the layer is no pane."""
        return any(getattr(self, name) is not None for name in SHADES)

    def layer(self) -> GlazingLayer:
        """The layer; `DataError` for a pane's file that cannot be read."""
        stated = {"conductivity": self.conductivity, "emissivity": self.emissivity}
        given = {name: value for name, value in stated.items() if value is not None}
        if self.slats is not None:
            s = self.slats
            return venetian_layer(
                s.width, s.spacing, s.tilt_deg,
                slat_thickness=s.thickness, edges=self.edges, **given,
            )  # fmt: skip
        if self.thickness is not None:
            given["thickness"] = self.thickness
        if self.pane is not None:
            return self._of_file()
        if self.infrared_transmittance is not None and self.openness is None:
            given["infrared_transmittance"] = self.infrared_transmittance
        if self.threads is not None:
            return woven_layer(
                self.threads.diameter, self.threads.spacing, edges=self.edges, **given
            )
        if self.holes is not None:
            return perforated_layer(
                self.holes.diameter, self.holes.spacing, edges=self.edges, **given
            )
        if self.openness is not None:
            passed = self.infrared_transmittance
            return sheet_layer(
                self.openness, edges=self.edges, infrared_transmittance=passed, **given
            )
        return GlazingLayer(solar=self.solar, **given)

    def spectral(self) -> SpectralPane:
        """The pane of the file, as it is turned."""
        pane = read_spectral_pane(self.pane, thickness=self.thickness)
        return pane.turned() if self.turned else pane

    def _of_file(self) -> GlazingLayer:
        pane = self.spectral()
        sun = spectral_glazing([pane])["Solar"]
        values = (sun.transmittance, sun.reflectance_front, sun.reflectance_back)
        return GlazingLayer(
            self.thickness or pane.thickness,
            self.conductivity or pane.conductivity,
            self.emissivity or pane.emissivity,
            pane.infrared_transmittance,
            solar=self.solar or tuple(float(v[0]) for v in values),
        )


def spectral_panes(layers: Sequence[GlazingLayerTable]) -> tuple[SpectralPane, ...]:
    """The panes of layers that all come from files of spectra; none where one does not."""
    if any(layer.pane is None for layer in layers):
        return ()
    return tuple(layer.spectral() for layer in layers)


def _listed() -> str:
    return ", ".join(SHADES)


def glazing_unit(
    layers: tuple[GlazingLayerTable, ...], height: float, tilt_deg: float
) -> GlazingUnit:
    """The unit of layers from outside to inside; `ThermalInputError` where they are none."""
    gaps = tuple(
        GasGap(one.gap.width, tuple(one.gap.gas.items())) for one in layers if one.gap is not None
    )
    return GlazingUnit(tuple(one.layer() for one in layers), gaps, height, 1.0, tilt_deg)
