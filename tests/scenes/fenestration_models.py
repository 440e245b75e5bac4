"""Small IFC models whose windows hold or state something of their fenestration."""

from __future__ import annotations

from collections.abc import Callable
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


_MADE: dict[tuple, bytes] = {}


def once(path: Path, key: tuple, make: Callable[[], object]) -> Path:
    """The file that `make` writes; copied from the second time on, as a BSDF takes it seconds."""
    if key in _MADE:
        path.write_bytes(_MADE[key])
    else:
        make()
        _MADE[key] = path.read_bytes()
    return path


def room(path: Path, stated: dict | None = None, *, schema: str = "IFC4", typed=False) -> Path:
    """A room with one window whose property sets, or its type's, hold the stated values."""
    key = ("room", repr(stated), schema, typed)
    return once(path, key, lambda: _write_room(path, stated, schema, typed))


def _write_room(path: Path, stated: dict | None, schema: str, typed: bool) -> None:
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


def with_attached(path: Path, share: float, *, name: str = "", by_type=False, **heat) -> Path:
    """The model with a grey diffuser attached to its window, or to the window's type."""
    bands = {"Visible": grey(share), "Solar": grey(share)}
    targets = Targets(types=["fixed pane"]) if by_type else Targets(every_window=True)
    state = ShadingState(name, bands, **heat)
    key = (path.read_bytes(), share, name, by_type, repr(heat))
    return once(path, key, lambda: attach(path, path, state, targets))
