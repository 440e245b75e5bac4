"""Layers of IFC elements and their thermal properties, from a table where the file has none."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from dataclasses import dataclass, field

import ifcopenshell
import ifcopenshell.util.element
import ifcopenshell.util.placement
import ifcopenshell.util.unit
import numpy as np

from bim.defaults import MATERIALS, UNKNOWN_MATERIAL
from bim.model import MaterialLayer, Problem
from bim.names import plain_text

PHYSICAL = {  # name -> lowest and highest value of any building material
    "conductivity": (0.005, 500.0),
    "density": (0.5, 12000.0),
    "heat_capacity": (100.0, 5000.0),
}
NAMES = {
    "conductivity": ("ThermalConductivity",),
    "density": ("MassDensity",),
    "heat_capacity": ("SpecificHeatCapacity",),
}
OPTICAL = {
    "visible": ("VisibleReflectanceFront",),
    "solar": ("SolarReflectanceFront",),
}


@dataclass(frozen=True, slots=True)
class ElementLayers:
    """Layers of an element in the order of its material axis, first layer first."""

    name: str
    layers: tuple[MaterialLayer, ...]
    axis: np.ndarray | None  # [3] model axes: from the first layer to the last; None if unknown
    stated: bool  # whether all thermal properties come from the file


@dataclass(slots=True)
class MaterialReader:
    """Reads each material once and gathers what is missing."""

    model: ifcopenshell.file
    problems: dict[str, Problem] = field(default_factory=dict)
    scale: float = 1.0
    _aspects: dict[int, str] = field(default_factory=dict)  # names of representation items' aspects
    _properties: dict[int, dict[str, float]] = field(default_factory=dict)
    _optical: dict[int, dict[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        with contextlib.suppress(Exception):  # reported by length_problems
            self.scale = float(ifcopenshell.util.unit.calculate_unit_scale(self.model))
        for kind in (
            "IfcMaterialProperties",
            "IfcThermalMaterialProperties",
            "IfcGeneralMaterialProperties",
            "IfcOpticalMaterialProperties",
        ):
            with contextlib.suppress(RuntimeError):  # not in this schema
                for one in self.model.by_type(kind):
                    self._gather(one)

        for aspect in self.model.by_type("IfcShapeAspect"):
            with contextlib.suppress(Exception):  # damaged representations
                for representation in aspect.ShapeRepresentations:
                    for item in representation.Items:
                        self._aspects.setdefault(item.id(), aspect.Name or "")

    def _gather(self, one: ifcopenshell.entity_instance) -> None:
        """Add the numbers of one property set of a material."""
        material = getattr(one, "Material", None)
        if material is None:
            return
        table = self._properties.setdefault(material.id(), {})
        named = {
            p.Name: getattr(getattr(p, "NominalValue", None), "wrappedValue", None)
            for p in getattr(one, "Properties", None)
            or getattr(one, "ExtendedProperties", None)
            or ()
        }
        for key, names in NAMES.items():
            for name in names:
                value = getattr(one, name, None) or named.get(name)
                if isinstance(value, int | float) and value > 0:
                    table[key] = float(value)
        for key, names in OPTICAL.items():
            for name in names:
                value = getattr(one, name, None) or named.get(name)
                if isinstance(value, int | float) and 0 < value < 1:
                    self._optical.setdefault(material.id(), {})[key] = float(value)

    def reflectances_of(self, element: ifcopenshell.entity_instance) -> tuple[float, float] | None:
        """Visible and solar reflectance that a material of the element states, if one does.

        Pset_MaterialOptical (IFC4), IfcOpticalMaterialProperties (IFC2X3); the front value.
        """
        with contextlib.suppress(Exception):  # damaged associations
            for material in ifcopenshell.util.element.get_materials(element):
                given = self._optical.get(material.id(), {})
                if "visible" in given or "solar" in given:
                    visible = given.get("visible", given.get("solar"))
                    return visible, given.get("solar", visible)
        return None

    def layers_of(self, element: ifcopenshell.entity_instance) -> ElementLayers | None:
        """The element's layers, or None where it has no layer set or only one plain material."""
        material = None
        with contextlib.suppress(Exception):  # damaged associations
            material = ifcopenshell.util.element.get_material(element, should_skip_usage=False)
        if material is None:
            return None
        usage = material if material.is_a("IfcMaterialLayerSetUsage") else None
        layer_set = usage.ForLayerSet if usage is not None else material
        if not layer_set.is_a("IfcMaterialLayerSet"):
            return None
        layers, stated = [], True
        for layer in layer_set.MaterialLayers or ():
            thickness = float(layer.LayerThickness or 0.0) * self.scale
            if thickness <= 1e-6:
                continue
            one, known = self.layer(layer.Material, thickness)
            layers.append(one)
            stated &= known
        if not layers:
            return None
        name = getattr(layer_set, "LayerSetName", None) or element.Name or element.is_a()
        return ElementLayers(name, tuple(layers), _axis(element, usage), stated)

    def single_material(self, element: ifcopenshell.entity_instance):
        """The material of an element without layers: the first one it names, or None."""
        with contextlib.suppress(Exception):  # damaged associations
            for material in ifcopenshell.util.element.get_materials(element):
                return material
        return None

    def of_items(
        self, element: ifcopenshell.entity_instance, items: Iterable[int]
    ) -> tuple[dict[int, MaterialLayer], bool]:
        """Materials of unit thickness of an element's bodies, and whether the file states them all.

        IFC4 writes walls as a body for each layer, a set of constituents for their materials, and
        shape aspects of the constituents' names that the bodies belong to (IfcShapeAspect).

        Args: items: STEP ids of the bodies.
        """
        material = None
        with contextlib.suppress(Exception):  # damaged associations
            material = ifcopenshell.util.element.get_material(element)
        if material is None or not material.is_a("IfcMaterialConstituentSet"):
            return {}, True
        named = {one.Name: one.Material for one in material.MaterialConstituents or ()}
        found, stated = {}, True
        for item in items:
            name = self._aspects.get(item)
            if name and name in named:
                found[item], known = self.layer(named[name], 1.0)
                stated &= known
        return found, stated

    def layer(self, material, thickness: float) -> tuple[MaterialLayer, bool]:
        """A layer of that material; missing or impossible values from the table by its name."""
        name = (material.Name or "unnamed") if material is not None else "unnamed"
        given = self._properties.get(material.id(), {}) if material is not None else {}
        values = {k: v for k, v in given.items() if _is_physical(k, v)}
        slip = given.get("heat_capacity", 0.0) * 1000.0
        if "heat_capacity" not in values and _is_physical("heat_capacity", slip):
            values["heat_capacity"] = slip
            what = f"material {name}: specific heat capacity of {slip / 1000:g} J/(kg K)"
            self.problems.setdefault(f"{name} kJ", Problem(name, what, "taken as kJ/(kg K)"))
        wrong = sorted(set(given) - set(values))
        missing = sorted(set(NAMES) - set(values))
        if missing:
            default = default_material(name)
            what = f"material {name}: no {', '.join(missing)}"
            if wrong:
                what += f" ({', '.join(f'{k} {given[k]:g} is impossible' for k in wrong)})"
            self.problems.setdefault(
                f"{name}", Problem(name, what, f"taken from {default.name} (EN ISO 10456)")
            )
            values = {k: values.get(k, getattr(default, k)) for k in NAMES}
        return MaterialLayer(name, thickness, **values), not missing


def _is_physical(name: str, value: float) -> bool:
    low, high = PHYSICAL[name]
    return low <= value <= high


def default_material(name: str) -> MaterialLayer:
    """The row of the table whose words occur in the name, in the order of the table."""
    text = plain_text(name)
    for words, material in MATERIALS:
        if any(plain_text(word) in text for word in words):
            return material
    return UNKNOWN_MATERIAL


def _axis(element: ifcopenshell.entity_instance, usage) -> np.ndarray | None:
    """Direction [3] in model axes along which the layers follow each other."""
    if usage is None or element.ObjectPlacement is None:
        return None
    with contextlib.suppress(Exception):  # placements of damaged files
        matrix = ifcopenshell.util.placement.get_local_placement(element.ObjectPlacement)
        column = {"AXIS1": 0, "AXIS2": 1, "AXIS3": 2}[usage.LayerSetDirection]
        sign = -1.0 if usage.DirectionSense == "NEGATIVE" else 1.0
        return sign * np.asarray(matrix)[:3, column]
    return None
