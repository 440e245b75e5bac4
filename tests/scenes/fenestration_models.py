"""Small IFC models whose windows hold or state something of their fenestration."""

from __future__ import annotations

from pathlib import Path

import ifcopenshell
import ifcopenshell.api.pset
import ifcopenshell.api.root
import ifcopenshell.api.type
import numpy as np

from bim.fenestration import ShadingState
from bim.ifc.attach import attach
from bim.ifc.targets import Targets
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from tests.bim.small_ifc import box_room

GLAZING = "Pset_DoorWindowGlazingType"
COMMON = "Pset_WindowCommon"
STATED = {
    GLAZING: {
        "GlassLayers": 2,
        "VisibleLightTransmittance": 0.7,
        "SolarHeatGainTransmittance": 0.5,
        "SolarTransmittance": 0.42,
    },
    COMMON: {"ThermalTransmittance": 1.2},
}


def grey(share: float) -> KlemsBsdf:
    """A diffuser that passes so much of the light, half of the rest is thrown back."""
    size, total = KLEMS_FULL.size, float(KLEMS_FULL.projected_solid_angles().sum())
    passed = np.full((size, size), share / total)
    back = np.full((size, size), 0.5 * (1 - share) / total)
    return KlemsBsdf(KLEMS_FULL, KLEMS_FULL, passed, passed, back, back)


def room(path: Path, stated: dict | None = None, *, schema: str = "IFC4", typed=False) -> Path:
    """A room with one window whose property sets, or its type's, hold the stated values."""
    model = box_room(schema)
    (window,) = model.by_type("IfcWindow")
    holder = window
    if typed:
        kind = "IfcWindowStyle" if schema == "IFC2X3" else "IfcWindowType"
        holder = ifcopenshell.api.root.create_entity(model, ifc_class=kind, name="fixed pane")
        ifcopenshell.api.type.assign_type(model, related_objects=[window], relating_type=holder)
    for name, values in (stated or {}).items():
        pset = ifcopenshell.api.pset.add_pset(model, product=holder, name=name)
        ifcopenshell.api.pset.edit_pset(model, pset=pset, properties=dict(values))
    model.write(str(path))
    return path


def with_attached(path: Path, share: float, *, name: str = "", by_type=False, **heat) -> Path:
    """The model with a grey diffuser attached to its window, or to the window's type."""
    bands = {"Visible": grey(share), "Solar": grey(share)}
    targets = Targets(types=["fixed pane"]) if by_type else Targets(every_window=True)
    attach(path, path, ShadingState(name, bands, **heat), targets)
    return path
