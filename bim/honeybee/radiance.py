"""Modifiers of a honeybee model as Radiance materials; BSDF data and the states of windows.

A surface's modifier is its own, else its room's modifier set's, else the model's global set's.

Source: honeybee-schema, "Modifier" and "ModifierSet".
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bim.fenestration import ShadingState
from bim.honeybee.library import NamedObjects
from bim.polygon_rooms import GlazingValues
from bim.radiance.materials import RadianceMaterial, material_of
from bim.radiance.primitives import VOID, Primitive
from bim.radiance.xform import read_xform
from bim.report.issue import Issue
from mitsuba_cfs.bsdf.angular import glass_table, specular_matrices
from mitsuba_cfs.bsdf.glazing import Glazing, specular_klems
from mitsuba_cfs.bsdf.klems import KLEMS_FULL
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import scratch_folder

COLOURS = ("r", "g", "b")
UP = (0.01, 0.01, 1.0)  # up vector of a BSDF where the file states none: honeybee-schema's default
OPAQUE_FIELDS = {
    "plastic": ("specularity", "roughness"),
    "metal": ("specularity", "roughness"),
    "trans": ("specularity", "roughness", "transmitted_diff", "transmitted_spec"),
    "mirror": (),
}


class ModifierLibrary:
    """Modifiers and modifier sets of a file, read when something refers to them."""

    def __init__(self, radiance: Mapping[str, Any], file: Path) -> None:
        self.file = file
        self.objects = NamedObjects(radiance, ("modifiers",), "modifier", file)
        self._materials: dict[str, RadianceMaterial] = {}
        self._states: dict[str, ShadingState] = {}

    def material(self, name: str) -> RadianceMaterial | None:
        """The Radiance material of a modifier; None where the file has none of that name."""
        if name not in self._materials:
            modifier = self.objects.find("modifiers", name)
            if modifier is None:
                return None
            self._materials[name] = self._material(modifier)
        return self._materials[name]

    def _material(self, modifier: Mapping[str, Any]) -> RadianceMaterial:
        kind = _kind(modifier)
        numbers: list[float] = []
        under = modifier.get("modifier")
        if under is not None and under != VOID and _kind(under) != VOID:
            known = {"modifier": modifier["identifier"], "type": _kind(under) or "?"}
            self.objects.issues.append(Issue("modifier-of-modifier", self.file.name, known))
        if kind in OPAQUE_FIELDS:
            numbers = [self.objects.number(modifier, f"{c}_reflectance", 0.0) for c in COLOURS]
            numbers += [self.objects.number(modifier, field, 0.0) for field in OPAQUE_FIELDS[kind]]
        elif kind == "glass":
            numbers = [self.objects.number(modifier, f"{c}_transmissivity", 0.0) for c in COLOURS]
            index = modifier.get("refraction_index")
            numbers += (
                [] if index is None else [self.objects.number(modifier, "refraction_index", 1.52)]
            )
        elif kind == "BSDF":
            return RadianceMaterial(modifier["identifier"], "BSDF", bsdf=modifier["identifier"])
        name = modifier["identifier"]
        try:
            return material_of(Primitive(VOID, kind, name, (), tuple(numbers), self.file, 0))
        except DataError as error:  # which names a line; there is none
            raise DataError(error.message, file=self.file, element=name) from None

    def state(self, name: str, label: str = "") -> ShadingState | None:
        """The BSDF of a modifier as a shading state; None where it is none."""
        modifier = self.objects.find("modifiers", name) or {}
        if _kind(modifier) != "BSDF":
            return None
        if name not in self._states:
            self._states[name] = self._bsdf(modifier)
        held = self._states[name]
        return ShadingState(name=label, bands=held.bands, angular=held.angular)

    def up_vector(self, name: str) -> NDArray[np.float64] | None:
        """The up vector [3] of a modifier's BSDF, as Radiance takes it; None where it is none.

        Raises: `DataError` for one that is no vector, or that a function file gives.
        """
        modifier = self.objects.find("modifiers", name) or {}
        if _kind(modifier) != "BSDF":
            return None
        stated = modifier.get("up_orientation")
        try:
            up = np.array(UP if stated is None else stated, dtype=float)
        except (TypeError, ValueError):
            up = np.zeros(0)
        if up.shape != (3,) or not 0 < np.linalg.norm(up) < np.inf:
            message = f"expected a vector of three numbers, got {stated!r:.60}"
            raise self.objects.fault(message, modifier, "up_orientation")
        if modifier.get("function_file") not in (None, "", "."):
            message = "function files of a BSDF are not read: state its up_orientation in numbers"
            raise self.objects.fault(message, modifier, "function_file")
        transform = modifier.get("transform")
        if transform:
            try:
                up = read_xform(("xform", *str(transform).split())).copies[0][:3, :3] @ up
            except ValueError as error:
                raise self.objects.fault(str(error), modifier, "transform") from None
        return up / np.linalg.norm(up)

    def pane_state(self, name: str, label: str, values: GlazingValues) -> ShadingState | None:
        """A modifier of glass as a shading state; None where it is none.

        Its sun is the construction's, as much more or less as its light (a tint of one colour).
        """
        material = self.material(name)
        if material is None or material.kind != "glass":
            return None
        table = glass_table([(material.transmissivity, material.index)])
        bands = {"Visible": specular_matrices(table)}
        if values.solar is not None and values.visible:
            tau, rho = float(table.transmittance[0]), float(table.reflectance_front[0])
            through = min(tau * values.solar / values.visible, 1.0 - rho)
            sun = Glazing(name, through, rho, rho, values.panes or 2)
            bands["Solar"] = specular_klems(sun, KLEMS_FULL)
        return ShadingState(name=label, bands=bands, angular=table)

    def _bsdf(self, modifier: Mapping[str, Any]) -> ShadingState:
        name, data = modifier["identifier"], modifier.get("bsdf_data")
        if not isinstance(data, str):
            raise DataError("expected the text of a BSDF XML", file=self.file, element=name,
                            field="bsdf_data")  # fmt: skip
        with scratch_folder() as folder:
            path = folder / "bsdf.xml"
            path.write_bytes(_decoded(data))
            try:
                bands = read_bsdf_xml(path).bands
            except DataError as error:
                raise DataError(error.message, file=self.file, element=name, field="bsdf_data")\
                    from None  # fmt: skip
        return ShadingState(bands=dict(bands))


def _kind(modifier: Any) -> str:
    """Radiance's name of a modifier's type, which files write with either first letter."""
    kind = str(modifier.get("type", "") if isinstance(modifier, Mapping) else modifier)
    return kind if kind.upper() == kind else kind[:1].lower() + kind[1:]


def _decoded(data: str) -> bytes:
    """The XML of a modifier: as text, or in base 64 as some writers keep it."""
    if data.lstrip().startswith("<"):
        return data.encode("utf-8")
    try:
        return base64.b64decode(data, validate=True)
    except ValueError:
        return data.encode("utf-8")
