"""Shades of the IGSDB (CGDB): products of type "shading", their geometry and their material.

Read are venetian blinds, woven shades and perforated screens with round or square holes on a square
grid.  The material's reflectances are the means of its spectrum, all of it diffuse; its front is
the upper side of a slat and the outdoor side of a sheet.  Lengths of the file are millimetres; a
slat's curvature is its radius, its tilt is positive where the outer edge is lowered.
"""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from mitsuba_cfs.bsdf.blinds import venetian_blind
from mitsuba_cfs.bsdf.en410 import solar_value
from mitsuba_cfs.bsdf.periodic import PeriodicLayer, SlatMaterial
from mitsuba_cfs.bsdf.screens import perforated_screen, thread_screen, woven_screen
from mitsuba_cfs.bsdf.spectral_pane import PaneFile, product_pane, read_product_file
from mitsuba_cfs.errors import DataError

KINDS = {
    "venetian": ("slat_width", "slat_spacing", "slat_tilt", "slat_curvature"),
    "woven": ("thread_diameter", "thread_spacing"),
    "perforated-screen": ("dimension_x", "spacing_x", "spacing_y"),
}
LONGEST_MM = 1000.0


@dataclass(frozen=True, slots=True)
class ShadeFile:
    """Data in the file of a shade."""

    path: Path
    name: str
    manufacturer: str
    kind: str  # of `KINDS`
    geometry: dict[str, float]  # of the kind's lengths [m] and `slat_tilt` [rad]
    round_holes: bool
    material: PaneFile

    def sheet(self) -> SlatMaterial:
        """The material in the visible and the solar band, all of it diffuse."""
        spectrum = self.material.spectrum
        pane = self.material.visible_pane()
        nm = spectrum[:, 0]
        if not len(nm) or nm[0] > 400 or nm[-1] < 2000:
            raise DataError("has no solar spectrum", file=self.path, field="spectral_data")
        tau, front, back = (float(solar_value(nm, column)) for column in spectrum[:, 1:].T)
        return SlatMaterial(
            self.material.name,
            (pane.reflectance_front, front),
            (pane.reflectance_back, back),
            transmittance=(pane.transmittance, tau),
        )

    def layer(self) -> PeriodicLayer:
        """The shade's geometry with its material, in the visible and the solar band."""
        size, sheet = self.geometry, self.sheet()
        try:
            if self.kind == "venetian":
                return venetian_blind(
                    sheet,
                    depth=size["slat_width"],
                    spacing=size["slat_spacing"],
                    tilt=size["slat_tilt"],
                    radius=size["slat_curvature"] or np.inf,
                )
            if self.kind == "woven":
                diameter, spacing = size["thread_diameter"], size["thread_spacing"]
                return thread_screen(sheet, diameter=diameter, spacing=spacing)
            thickness, spacing = self.material.thickness or 0.0, size["spacing_x"]
            make = perforated_screen if self.round_holes else woven_screen
            return make(sheet, spacing=spacing, openness=self.openness, thickness=thickness)
        except ValueError as error:  # sizes that do not go together
            raise DataError(str(error), file=self.path, field="geometry") from None

    @property
    def openness(self) -> float:
        """Direct transmittance of a sheet at normal incidence; 0 for a blind."""
        size = self.geometry
        if self.kind == "venetian":
            return 0.0
        if self.kind == "woven":
            return (1 - size["thread_diameter"] / size["thread_spacing"]) ** 2
        hole = size["dimension_x"] / size["spacing_x"]
        return np.pi * hole**2 if self.round_holes else hole**2

    def thermal_layer(self) -> str:
        """The shade as an inline table of `[[layers]]`."""
        size = self.geometry
        if self.kind == "venetian":
            tilt = np.degrees(size["slat_tilt"])
            cell = f"width = {size['slat_width']:g}, spacing = {size['slat_spacing']:g}, "
            keys = [f"slats = {{ {cell}tilt_deg = {tilt:g} }}"]
        else:
            names = ("thread_diameter", "thread_spacing")
            diameter, spacing = (
                (size[name] for name in names) if self.kind == "woven" else (2 * size["dimension_x"], size["spacing_x"])
            )
            cell = "threads" if self.kind == "woven" else "holes"
            keys = [f"{cell} = {{ diameter = {diameter:g}, spacing = {spacing:g} }}"]
            if self.kind != "woven" and not self.round_holes:
                keys = [f"openness = {self.openness:.4g}"]
        front, back = self.material.emissivity
        if front is not None and back is not None:
            keys.append(f"emissivity = [{front:g}, {back:g}]")
        if self.material.conductivity:
            keys.append(f"conductivity = {self.material.conductivity:g}")
        return "{ " + ", ".join(keys) + " }"


def read_shade_file(path: str | PathLike[str]) -> ShadeFile:
    """The shade of an IGSDB product's JSON file; `DataError` with the field that cannot be used."""
    path = Path(path)
    product = read_product_file(path)
    kind = product.get("subtype")
    if product.get("type") != "shading" or not isinstance(kind, str) or kind not in KINDS:
        message = f"expected shading, {', '.join(KINDS)}; got {product.get('type')}, {kind}"
        raise DataError(message[:120], file=path, field="subtype")
    parts = product.get("composition")
    if not isinstance(parts, list) or len(parts) != 1 or not isinstance(parts[0], dict):
        raise DataError("expected one material", file=path, field="composition")
    child = parts[0].get("child_product")
    if not isinstance(child, dict):
        raise DataError("expected a product", file=path, field="child_product")
    extra = parts[0].get("extra_data")
    table = extra.get("geometry") if isinstance(extra, dict) else None
    if not isinstance(table, dict):
        raise DataError("expected a table", file=path, field="geometry")
    return ShadeFile(
        path=path,
        name=str(product.get("name") or path.stem),
        manufacturer=str(product.get("manufacturer_name") or ""),
        kind=kind,
        geometry=_geometry(table, kind, path),
        round_holes=_are_round(table, path) if kind == "perforated-screen" else False,
        material=product_pane(child, path, material=True),
    )


def _geometry(table: dict[str, Any], kind: str, path: Path) -> dict[str, float]:
    """The lengths [m] of a kind and the tilt [rad]."""
    geometry = {}
    for name in KINDS[kind]:
        try:
            value = float(table.get(name) or 0.0)
        except (TypeError, ValueError, OverflowError):
            value = np.nan
        low, high = (-90.0, 90.0) if name == "slat_tilt" else (0.0, LONGEST_MM)
        may_be_zero = name in ("slat_tilt", "slat_curvature")
        if not low <= value <= high or (value == 0 and not may_be_zero):
            message = f"expected a number from {low:g} to {high:g}, got {str(table.get(name))[:40]!r}"
            raise DataError(message, file=path, field=name)
        geometry[name] = float(np.radians(value)) if name == "slat_tilt" else value / 1000
    if kind == "perforated-screen" and geometry["spacing_x"] != geometry["spacing_y"]:
        raise DataError("differs from spacing_x: no square grid", file=path, field="spacing_y")
    return geometry


def _are_round(table: dict[str, Any], path: Path) -> bool:
    """Whether holes are round, where `dimension_x` is their radius; else they are squares."""
    kind = str(table.get("perforation_type")).casefold()
    if kind not in ("circular", "square"):
        message = f"expected circular or square, got {kind[:40]!r}"
        raise DataError(message, file=path, field="perforation_type")
    return kind == "circular"
