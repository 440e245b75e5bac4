"""Fenestration data out of an IFC model.

The property sets that `fenestration_write` writes, and BSDF files that a document or library
reference of the window or its type names.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlparse

import ifcopenshell
import ifcopenshell.util.element
import numpy as np

from bim.fenestration import AngularGValue, ShadingState
from bim.ifc.damage import entities, type_of
from bim.ifc.fenestration_write import (
    BLOCKS,
    BLOWN,
    CLOSURE,
    G_BY_PATCH,
    G_NORMAL,
    GAP,
    HEAT_OF_LAYER,
    LAYERS,
    OPENINGS,
    POSITION,
    REALISED,
    SET_NAME,
    SLOPE,
    SOLAR_OF_LAYER,
    SURFACE,
    TREE,
    U_MODEL,
)
from bim.ifc.project import definitions_of, open_all
from mitsuba_cfs.bsdf.bsdf_file import Bsdf
from mitsuba_cfs.bsdf.klems import KlemsBasis, KlemsBsdf
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from mitsuba_cfs.errors import DataError
from thermal.closure import Closure
from thermal.glazing import Gap
from thermal.glazing_unit import GasGap, GlazingLayer, GlazingUnit, Openings
from thermal.gvalue import TYPICAL_SYSTEMS

Entity = ifcopenshell.entity_instance
HOLDERS = ("IfcWindow", "IfcDoor", "IfcPlate", "IfcCurtainWall")  # whose sets are read


def read_fenestration(path: str | PathLike[str]) -> dict[str, tuple[ShadingState, ...]]:
    """Shading states that an IFC file holds for its windows, by GUID; see `read_states`."""
    held: dict[str, tuple[ShadingState, ...]] = {}
    for model in open_all([path]).values():
        held = read_states(model, Path(path).parent, file=path) | held
    return held


def read_states(
    model: ifcopenshell.file, folder: str | Path, *, file: str | Path = ""
) -> dict[str, tuple[ShadingState, ...]]:
    """Shading states of each window and door that has any, by GUID; its own before its type's.

    Args: folder: where relative paths of BSDF files start.
    Raises: `DataError` for a set of that name that cannot be understood.
    """
    result: dict[str, tuple[ShadingState, ...]] = {}
    cache: dict[int, ShadingState] = {}
    for kind in HOLDERS:
        for element in model.by_type(kind):
            states: dict[str, ShadingState] = {}
            element_type = type_of(element)
            for source in (element_type, element):
                of_type = None
                if source is not None and source is element_type:
                    of_type = source.Name or ""
                for pset in _own_sets(source):
                    if pset.id() not in cache:
                        cache[pset.id()] = _state(pset, file, element.GlobalId)
                    known = replace(cache[pset.id()], of_type=of_type)
                    states[known.name] = known
                for path in _referenced(source, Path(folder)):
                    known = states.get("", ShadingState())
                    if not known.bands:
                        bands = read_bsdf_xml(path).bands
                        states[""] = replace(known, bands=bands, file=path, of_type=of_type)
            if states:
                result[element.GlobalId] = tuple(states.values())
    return result


def _own_sets(source: Entity | None) -> Iterable[Entity]:
    for one in definitions_of(source):
        name = one.Name or ""
        if one.is_a("IfcPropertySet") and (name == SET_NAME or name.startswith(f"{SET_NAME}:")):
            yield one


def _referenced(source: Entity | None, folder: Path) -> Iterable[Path]:
    """BSDF XML files that documents or libraries associated with an element name."""
    for relation in getattr(source, "HasAssociations", None) or ():
        reference = getattr(relation, "RelatingDocument", None) or getattr(relation, "RelatingLibrary", None)
        location = getattr(reference, "Location", None)
        if not location or not location.lower().endswith(".xml"):
            continue
        url = urlparse(location)
        path = Path(unquote(url.path)) if url.scheme == "file" else folder / location
        if url.scheme in ("", "file"):
            yield path


def _state(pset: Entity, file: str | Path, guid: str) -> ShadingState:
    name = pset.Name[len(SET_NAME) :].lstrip(": ")
    bands: dict[str, Bsdf] = {}
    thermal: dict[str, object] = {}
    try:
        for prop in entities(pset.HasProperties):
            name_of_value = str(prop.Name or "")
            if prop.is_a("IfcComplexProperty") and name_of_value.startswith("BSDF "):
                bands[name_of_value[5:]] = _bsdf(prop)
            elif prop.Name in THERMAL:
                field, read = THERMAL[prop.Name]
                thermal[field] = read(prop)
    except ValueError as error:
        raise DataError(f"cannot be understood: {error}", file=file or None, element=guid, field=pset.Name) from None
    return ShadingState(name, bands, **thermal)


class _Parts(dict[str, Entity]):
    """The properties of a complex property by name; `ValueError` for one that it lacks."""

    def __missing__(self, name: str) -> Entity:
        raise ValueError(f"has no {name!r}")


def _children(prop: Entity) -> _Parts:
    return _Parts({child.Name: child for child in _listed(prop)})


def _listed(prop: Entity) -> list[Entity]:
    """The properties of a complex property in their order."""
    if not prop.is_a("IfcComplexProperty"):
        raise ValueError(f"{prop.Name!r} is no complex property")
    return entities(prop.HasProperties)


def _numbers(prop: Entity, kind: type = float) -> np.ndarray:
    if not prop.is_a("IfcPropertyListValue"):
        raise ValueError(f"{prop.Name!r} is no list")
    # by number: by its name an attribute is looked for each time, three times as long for a BSDF
    values = [value[0] for value in entities(prop.ListValues)]
    try:
        return np.array(values, dtype=kind)
    except TypeError:
        raise ValueError(f"{prop.Name!r} has values that are no numbers") from None


def _wrapped(value: Any, name: str) -> Any:
    """The value in an entity of a measure."""
    if not isinstance(value, Entity):
        raise ValueError(f"{name!r} has no value")
    return value.wrappedValue


def _number(value: Any, name: str) -> float:
    number = _wrapped(value, name)
    if not isinstance(number, int | float):
        raise ValueError(f"{name!r} is no number")
    return float(number)


def _bsdf(prop: Entity) -> Bsdf:
    parts = _children(prop)
    values = _children(parts["Transmittance and reflectance values"])
    if (prop.UsageName or "").startswith(TREE):
        digits = re.search(r"(\d+)$", prop.UsageName)
        if digits is None:
            raise ValueError(f"{prop.UsageName!r} states no rank")
        rank = int(digits[1])
        trees = {
            key: TensorTree(rank, _numbers(parts[f"{name}: depths"], np.int64), _numbers(values[name]))
            for key, name in BLOCKS.items()
            if name in values
        }
        return TensorTreeBsdf(**trees)
    basis_in, basis_out = (_basis(parts, side) for side in ("Incident", "Outgoing"))
    shape = (basis_out.size, basis_in.size)
    blocks = {key: _numbers(values[name]).reshape(shape) for key, name in BLOCKS.items() if name in values}
    return KlemsBsdf(basis_in, basis_out, **blocks)


def _basis(parts: dict[str, Entity], side: str) -> KlemsBasis:
    polar = parts[f"{side} polar angle ranges"]
    ranges = _listed(polar)
    if not ranges:
        raise ValueError(f"{polar.Name!r} is empty")
    lower, upper = (
        [_number(getattr(one, f"{end}BoundValue", None), polar.Name) for one in ranges] for end in ("Lower", "Upper")
    )
    rings = _listed(parts[f"{side} azimuthal angle ranges"])
    sizes = tuple(len(_listed(ring)) for ring in rings)
    return KlemsBasis(str(polar.UsageName), (*lower, upper[-1]), sizes)


def _g_values(prop: Entity) -> AngularGValue:
    parts = _children(prop)
    polar, azimuth = _numbers(parts["Polar angles"]), _numbers(parts["Azimuthal angles"])
    values = _numbers(parts["G-values"]).reshape(len(polar), len(azimuth))
    return AngularGValue(polar, azimuth, values)


def _single(prop: Entity) -> float:
    return _number(getattr(prop, "NominalValue", None), prop.Name)


def _position(prop: Entity) -> str:
    position = _wrapped(getattr(prop, "NominalValue", None), prop.Name)
    if position not in TYPICAL_SYSTEMS:
        raise ValueError(f"{POSITION} {position!r} is not of {', '.join(TYPICAL_SYSTEMS)}")
    return position


def _closure(prop: Entity) -> Closure:
    parts = _children(prop)
    fields = {field: _single(parts[name]) for field, name in REALISED.items() if name in parts}
    if GAP in parts:
        of_gap = _children(parts[GAP])
        fields["gap"] = Gap(*_gas_gap(of_gap), _tuple(of_gap["Emissivities"]))
    if SLOPE in parts:
        fields["slope"] = _single(parts[SLOPE])
    if SURFACE in parts:
        fields["surface"] = _tuple(parts[SURFACE])
    if LAYERS in parts:
        fields["unit"] = _unit(_children(parts[LAYERS]))
    model = _wrapped(getattr(parts[U_MODEL], "NominalValue", None), U_MODEL)
    return Closure(model, **fields)


def _tuple(prop: Entity) -> tuple[float, ...]:
    return tuple(float(value) for value in _numbers(prop))


def _gas_gap(parts: dict[str, Entity]) -> tuple[float, tuple[tuple[str, float], ...]]:
    """Width and gas of a gap."""
    gas = tuple((share.Name, _single(share)) for share in _listed(parts["Gas"]))
    return _single(parts["Width"]), gas


def _unit(parts: dict[str, Entity]) -> GlazingUnit:
    """Layers and gaps of a glazing."""
    layers, gaps = [], []
    for name, prop in parts.items():
        held = _children(prop) if name.startswith(("Layer ", "Gap ")) else {}
        if name.startswith("Layer "):
            thickness, conductivity, infrared = _tuple(held[HEAT_OF_LAYER])
            solar = _tuple(held[SOLAR_OF_LAYER]) if SOLAR_OF_LAYER in held else None
            openings = Openings(*_tuple(held[OPENINGS])) if OPENINGS in held else None
            faces = _tuple(held["Emissivities"])
            layers.append(GlazingLayer(thickness, conductivity, faces, infrared, openings, solar))
        elif name.startswith("Gap "):
            blown = _tuple(held[BLOWN]) if BLOWN in held else None
            gaps.append(GasGap(*_gas_gap(held), blown))
    return GlazingUnit(tuple(layers), tuple(gaps), *_tuple(parts["Height, width, tilt"]))


THERMAL = {  # name of the property: field of the state, and what reads it
    "G-value": ("g_value", _g_values),
    "U-value": ("u_value", _single),
    G_NORMAL: ("g_normal", _single),
    G_BY_PATCH: ("g_by_patch", _numbers),
    CLOSURE: ("closure", _closure),
    POSITION: ("shading_position", _position),
}
