"""The corrections of a model written into the model itself, so that other programs have them too.

What IFC expresses is written: north, outdoor spaces, names, properties of materials, elements left
out.
The other entries stay corrections, in a file beside the new model: both together are read as the
old model with its corrections.
"""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.api.root
import ifcopenshell.util.element

from bim.ifc.corrections import Paint, corrections_beside, corrections_file
from bim.ifc.materials import SURFACES, own_materials
from bim.ifc.north import CONVERGENCE_DEG, MAP_SET, map_conversions
from bim.ifc.project import length_scale, open_ifc
from bim.ifc.property_sets import save
from bim.ifc.source import check_materials
from bim.material_names import MaterialCorrection
from mitsuba_cfs.errors import DataError
from mitsuba_cfs.files import check_file, write_text

WITH_GLASS = ("IfcWindow", "IfcDoor", "IfcCurtainWall", "IfcPlate", "IfcMember")
HEAD = "# Corrections that the model cannot hold; the others are written in it.\n"
PROPERTIES = {  # entity and attribute of IFC2X3, property set and measure of IFC4
    "conductivity": (
        "IfcThermalMaterialProperties",
        "ThermalConductivity",
        "Pset_MaterialThermal",
        "IfcThermalConductivityMeasure",
    ),
    "heat_capacity": (
        "IfcThermalMaterialProperties",
        "SpecificHeatCapacity",
        "Pset_MaterialThermal",
        "IfcSpecificHeatCapacityMeasure",
    ),
    "density": ("IfcGeneralMaterialProperties", "MassDensity", "Pset_MaterialCommon", "IfcMassDensityMeasure"),
    "visible": (
        "IfcOpticalMaterialProperties",
        "VisibleReflectanceFront",
        "Pset_MaterialOptical",
        "IfcPositiveRatioMeasure",
    ),
    "solar": (
        "IfcOpticalMaterialProperties",
        "SolarReflectanceFront",
        "Pset_MaterialOptical",
        "IfcPositiveRatioMeasure",
    ),
}


@dataclass(frozen=True, slots=True)
class Corrected:
    """What was written into a model."""

    north_deg: float | None
    outdoors: int  # spaces
    materials: int
    removed: int  # elements
    left: tuple[str, ...]  # keys of the corrections file that the model cannot hold
    left_file: Path | None  # with their entries


def correct(path: str | PathLike[str], out: str | PathLike[str]) -> Corrected:
    """Write `out`, the model with the corrections beside it, and a file beside `out` of the rest.

    Raises: `DataError` where there are no corrections, or `out` has a corrections file already.
    """
    corrections = corrections_beside(path)
    if not corrections.file:
        raise DataError(f"needs {corrections_file(path).name} beside it", file=path)
    beside = corrections_file(out)
    check_file(out, inputs=[Path(path)])
    if beside.exists():
        raise DataError("exists; give the model another name", file=beside)
    model = open_ifc(path)
    check_materials(model, corrections)
    # every selector chooses from the model as it was
    removed, names = corrections.removed(model), corrections.named(model)
    outdoors = {key for key, value in corrections.stated_outdoors(model).items() if value}
    paints = corrections.painted(model)
    values, are_written = _thermal_values(model, corrections.materials)
    optical = _optical_values(model, paints)
    for step_id, more in optical.items():
        values[step_id] = {**values.get(step_id, {}), **more}
    has_north = corrections.north_deg is not None and _set_north(model, corrections.north_deg)
    for step_id in outdoors:
        _set_outdoors(model.by_id(step_id))
    for step_id, properties in values.items():
        for name, value in properties.items():
            _set_property(model, model.by_id(step_id), name, value)
    rest = tomllib.loads(Path(corrections.file).read_text(encoding="utf-8"))
    painted = _are_painted(model, paints, corrections.paints, set(optical))
    for key, written in (
        ("leave_out", True),
        ("only", True),
        ("outdoors", True),
        ("north", has_north),
        ("material", are_written),
        ("reflectance", painted),
    ):
        if isinstance(written, Sequence):
            rest[key] = [v for v, w in zip(rest.get(key, []), written, strict=True) if not w]
        elif written:
            rest.pop(key, None)
    rest = {key: value for key, value in rest.items() if value != []}
    # other entries may choose spaces by the names that they have now
    by_name = any("name" in str(value).lower() for key, value in rest.items() if key != "room")
    if "room" in rest and not by_name:
        rest.pop("room")
        for step_id, one in names.items():
            space: Any = model.by_id(step_id)
            space.Name = space.Name if one.name is None else one.name
            space.LongName = space.LongName if one.long_name is None else one.long_name
    _remove(model, removed)
    save(model, Path(out))
    if rest:
        write_text(beside, HEAD + _toml(rest))
    north = corrections.north_deg if has_north else None
    left = beside if rest else None
    return Corrected(north, len(outdoors), len(values), len(removed), tuple(rest), left)


def _toml(table: Mapping[str, object]) -> str:
    """A corrections file's table as TOML: values first, then tables; JSON's values are TOML's."""
    lines, tables = [], []
    for key, value in table.items():
        if isinstance(value, list) and all(isinstance(one, dict) for one in value):
            tables += [line for one in value for line in (f"\n[[{key}]]", *_values(one))]
        else:
            lines += _values({key: value})
    return "\n".join([*lines, *tables]) + "\n"


def _values(table: Mapping[str, object]) -> list[str]:
    return [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in table.items()]


def _set_north(model: ifcopenshell.file, angle_deg: float) -> bool:
    """Write the direction of the model's +y axis, from north to east; whether there is a place.

    Map conversions with another north than the map's grid can have there are turned to it.
    """
    angle = math.radians(angle_deg)
    x, y = -math.sin(angle), math.cos(angle)  # north in model axes
    contexts = [
        one
        for one in model.by_type("IfcGeometricRepresentationContext", include_subtypes=False)
        if one.ContextType != "Plan"
    ]
    for context in contexts:
        context.TrueNorth = model.create_entity("IfcDirection", (x, y))
    wrong = [n for one in map_conversions(model) if (n := one.north) and _apart(n, (x, y))]
    if contexts and wrong:
        _turn_map(model, y, x)
    return bool(contexts)


def _apart(north: tuple[float, float], other: tuple[float, float]) -> bool:
    between = north[0] * other[0] + north[1] * other[1]
    return between < math.cos(math.radians(CONVERGENCE_DEG)) * math.hypot(*north)


def _turn_map(model: ifcopenshell.file, x: float, y: float) -> None:
    """Give the model's x axis the direction (x, y) on the map."""
    if model.schema != "IFC2X3":
        for conversion in model.by_type("IfcMapConversion"):
            conversion.XAxisAbscissa, conversion.XAxisOrdinate = x, y
        return
    for pset in model.by_type("IfcPropertySet"):
        for one in pset.HasProperties if pset.Name == MAP_SET else ():
            if one.Name in ("XAxisAbscissa", "XAxisOrdinate"):
                value = x if one.Name == "XAxisAbscissa" else y
                one.NominalValue = model.create_entity("IfcReal", value)


def _set_outdoors(space: Any) -> None:
    """Make a space external."""
    for name in ("PredefinedType", "InteriorOrExteriorSpace"):  # IFC4, IFC2X3
        if hasattr(space, name):
            setattr(space, name, "EXTERNAL")


def _thermal_values(
    model: ifcopenshell.file, corrections: Sequence[MaterialCorrection]
) -> tuple[dict[int, dict[str, float]], list[bool]]:
    """New properties by the STEP id of the material; which corrections these are whole with."""
    values: dict[int, dict[str, float]] = {}
    are_written = [True] * len(corrections)
    for material in model.by_type("IfcMaterial"):
        index = next((i for i, c in enumerate(corrections) if c.matches(material.Name or "")), -1)
        if index < 0:
            continue
        table = dict(corrections[index].values)
        if "u" in table:
            thickness = _thickness(model, material)
            if thickness is None:  # no conductivity gives all layers this U
                are_written[index] = False
                continue
            table["conductivity"] = thickness / max(1 / table.pop("u") - SURFACES, 1e-3)
        values[material.id()] = table
    return values, are_written


def _thickness(model: ifcopenshell.file, material: Any) -> float | None:
    """Thickness of the layers of a material [m]; None without layers or where they differ."""
    users: list[Any] = list(model.get_inverse(material))
    layers = [one for one in users if one.is_a("IfcMaterialLayer")]
    others = [one for one in users if one.is_a("IfcRelAssociatesMaterial")]
    thicknesses = {round(one.LayerThickness * length_scale(model), 6) for one in layers}
    return thicknesses.pop() if len(thicknesses) == 1 and not others else None


def _optical_values(model: ifcopenshell.file, paints: Mapping[int, Paint]) -> dict[int, dict[str, float]]:
    """New reflectances by the STEP id of materials that only elements of one paint have."""
    values = {}
    for material in model.by_type("IfcMaterial"):
        users: set[Any] = ifcopenshell.util.element.get_elements_by_material(model, material)
        of_users = {paints.get(one.id()) for one in users if one.is_a("IfcProduct")}
        paint = of_users.pop() if len(of_users) == 1 else None
        if paint is not None and paint.gloss is None and 0 < min(paint.visible, paint.solar):
            values[material.id()] = {"visible": paint.visible, "solar": paint.solar}
    return values


def _are_painted(
    model: ifcopenshell.file, paints: Mapping[int, Paint], entries: Sequence[Paint], materials: set[int]
) -> list[bool]:
    """For each entry, whether all its elements have materials, and these its reflectances."""
    painted = {id(entry): True for entry in entries}
    for step_id, paint in paints.items():
        element: Any = model.by_id(step_id)
        of_element = {one.id() for one in own_materials(element)}
        is_plain = bool(of_element) and not element.is_a().startswith(WITH_GLASS)
        painted[id(paint)] &= is_plain and of_element <= materials
    return [painted[id(entry)] for entry in entries]


def _set_property(model: ifcopenshell.file, material: Any, name: str, value: float) -> None:
    """Write a property of a material in the schema's place for it."""
    entity, attribute, set_name, measure = PROPERTIES[name]
    if model.schema == "IFC2X3":
        holders = [one for one in model.by_type(entity) if one.Material == material]
        holder = holders[0] if holders else model.create_entity(entity, material)
        setattr(holder, attribute, value)
        return
    nominal = model.create_entity(measure, value)
    sets = [one for one in model.by_type("IfcMaterialProperties") if one.Material == material]
    for one in (p for pset in sets for p in pset.Properties if p.Name == attribute):
        one.NominalValue = nominal
    if not any(p.Name == attribute for pset in sets for p in pset.Properties):
        one = model.create_entity("IfcPropertySingleValue", attribute, None, nominal)
        pset = next((pset for pset in sets if pset.Name == set_name), None)
        if pset is None:
            model.create_entity("IfcMaterialProperties", set_name, None, [one], material)
        else:
            pset.Properties = [*pset.Properties, one]


def _remove(model: ifcopenshell.file, step_ids: set[int]) -> None:
    """Remove elements and spaces; one that holds others keeps its place and loses its body."""
    for step_id in sorted(step_ids):
        product: Any = model.by_id(step_id)
        parts = [p for relation in product.IsDecomposedBy for p in relation.RelatedObjects]
        voids = [v.RelatedOpeningElement for v in getattr(product, "HasOpenings", ())]
        held = parts + [f.RelatedBuildingElement for v in voids for f in v.HasFillings]
        is_holder = any(one.id() not in step_ids for one in held)
        if is_holder or not (product.is_a("IfcElement") or product.is_a("IfcSpace")):
            product.Representation = None
    products: list[Any] = [model.by_id(step_id) for step_id in sorted(step_ids)]
    products = [one for one in products if one.Representation is not None]
    # an element takes its openings with it
    for product in sorted(products, key=lambda one: not one.is_a("IfcOpeningElement")):
        ifcopenshell.api.root.remove_product(model, product=product)
