"""Layers of IFC elements and their thermal properties, from a table where the file has none."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import ifcopenshell
import ifcopenshell.util.element
import numpy as np

from bim.ifc.damage import Damage, entities, instances, placement_of
from bim.ifc.project import length_scale
from bim.material_names import MaterialCorrection, NamedMaterial, material_named
from bim.model import MaterialLayer
from bim.report.issue import Issue, Phrase, Term

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
OPTICAL = {"visible": ("VisibleReflectanceFront",), "solar": ("SolarReflectanceFront",)}

SURFACES = 0.17  # resistances of both surfaces of an outer wall: EN ISO 6946:2017 [m2 K/W]
INSULATING = ("insulation", "insulating")  # groups of materials
DEEPEST = 20  # parts of parts of a whole


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
    damage: Damage = field(default_factory=Damage)
    corrections: Sequence[MaterialCorrection] = ()
    issues: dict[str, Issue] = field(default_factory=dict)
    scale: float = field(init=False)  # metres in the file's unit of length
    _aspects: dict[int, str] = field(default_factory=dict)  # names of representation items' aspects
    _contradicting: int = 0  # bodies whose aspect and style name two materials
    _properties: dict[int, dict[str, float]] = field(default_factory=dict)
    _optical: dict[int, dict[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.scale = length_scale(self.model)
        for kind in (
            "IfcMaterialProperties",
            "IfcThermalMaterialProperties",
            "IfcGeneralMaterialProperties",
            "IfcOpticalMaterialProperties",
        ):
            for one in instances(self.model, kind):
                self._gather(one)
        for aspect in self.model.by_type("IfcShapeAspect"):
            for representation in entities(aspect.ShapeRepresentations):
                for item in entities(getattr(representation, "Items", None)):
                    self._aspects.setdefault(item.id(), aspect.Name or "")

    def _gather(self, one: ifcopenshell.entity_instance) -> None:
        """Add the numbers of one property set of a material."""
        material = getattr(one, "Material", None)
        if material is None:
            return
        table = self._properties.setdefault(material.id(), {})
        named = {
            p.Name: getattr(getattr(p, "NominalValue", None), "wrappedValue", None)
            for p in getattr(one, "Properties", None) or getattr(one, "ExtendedProperties", None) or ()
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
        for material in materials_of(element, self.damage):
            optical = self._optical.get(material.id(), {})
            if "visible" in optical or "solar" in optical:
                visible = optical.get("visible", optical.get("solar"))
                return visible, optical.get("solar", visible)
        return None

    def layers_of(self, element: ifcopenshell.entity_instance) -> ElementLayers | None:
        """The element's layers, or None where it has no layer set or only one plain material."""
        element = _with_material(element, self.damage)
        material = _material_of(element, self.damage)
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
            one, known = self.material(layer.Material)
            layers.append(one.of_thickness(thickness))
            stated &= known
        if not layers:
            return None
        name = getattr(layer_set, "LayerSetName", None) or element.Name or element.is_a()
        return ElementLayers(name, tuple(layers), _axis(element, usage, self.damage), stated)

    def single_material(self, element: ifcopenshell.entity_instance):
        """The material of an element without layers: the first one it names, or None."""
        return next(iter(materials_of(element, self.damage)), None)

    def of_items(
        self, element: ifcopenshell.entity_instance, items: Iterable[int]
    ) -> tuple[dict[int, NamedMaterial], bool]:
        """Materials of an element's bodies, and whether the file states them all.

        Files without layer sets draw a wall as a body for each layer, and name their materials as
        a list or as constituents.  A body is of the material that its surface style has the name
        of, else of the constituent that its shape aspect has the name of (IfcShapeAspect).  Where
        the two differ the thickness has borne out the style: Revit 2020 gives aspects of turned
        walls in the order of the type's layers.

        Args: items: STEP ids of the bodies.
        """
        constituents = self._constituents(element)
        named = {one.Name: one for one in constituents.values()}
        layers, stated = {}, True
        for item in items if len(named) > 1 else ():
            styles = self._style_names(item) & set(named)
            of_aspect = constituents.get(self._aspects.get(item, ""))
            material = named[styles.pop()] if len(styles) == 1 else of_aspect
            if material is None:
                continue
            self._contradicting += of_aspect is not None and of_aspect.Name != material.Name
            layers[item], known = self.material(material)
            stated &= known
        if self._contradicting:
            values = {"count": self._contradicting}
            self.issues["shape aspects"] = Issue("aspect-contradicts-style", "", values)
        return layers, stated

    def shares_of(self, element: ifcopenshell.entity_instance) -> tuple[tuple[NamedMaterial, float], ...]:
        """Materials listed without thicknesses, if insulation is one, and their shares of 1.

        By IfcMaterialConstituent.Fraction where each has one, else in equal parts.  A list without
        insulation is no build-up that matters: the first material holds.
        """
        material = _material_of(_with_material(element, self.damage), self.damage)
        if material is None or len(self._constituents(element)) < 2:
            return ()
        parts = getattr(material, "MaterialConstituents", None) or material.Materials
        fractions = [getattr(one, "Fraction", None) for one in parts]
        if not all(fractions) or abs(sum(fractions) - 1) > 0.02:
            fractions = [1 / len(parts)] * len(parts)
        materials = [getattr(one, "Material", one) for one in parts]
        if not any(named_material(one).group in INSULATING for one in materials):
            return ()
        return tuple((self.material(one)[0], f) for one, f in zip(materials, fractions, strict=True))

    def _constituents(self, element: ifcopenshell.entity_instance) -> dict[str, Any]:
        """Materials of an element without layers, by the names of constituents or their own."""
        material = _material_of(_with_material(element, self.damage), self.damage)
        if material is not None and material.is_a("IfcMaterialConstituentSet"):
            parts = material.MaterialConstituents or ()
            return {one.Name: one.Material for one in parts if one.Material is not None}
        if material is not None and material.is_a("IfcMaterialList"):
            return {one.Name: one for one in material.Materials or ()}
        return {}

    def _style_names(self, item: int) -> set[str]:
        """Names of the surface styles of a representation item."""
        try:
            body = self.model.by_id(item)
        except RuntimeError:  # the geometry engine's own
            return set()
        names: set[str] = set()
        for styled in entities(getattr(body, "StyledByItem", None)):
            for style in entities(styled.Styles):
                is_many = style.is_a("IfcPresentationStyleAssignment")
                styles = entities(style.Styles) if is_many else [style]
                names |= {name for one in styles if (name := getattr(one, "Name", None))}
        return names

    def material(self, material) -> tuple[NamedMaterial, bool]:
        """A material with its missing or impossible values by its name, and if the file has all."""
        name = (material.Name or "unnamed") if material is not None else "unnamed"
        stated = self._properties.get(material.id(), {}) if material is not None else {}
        values = {k: v for k, v in stated.items() if _is_physical(k, v)}
        slip = stated.get("heat_capacity", 0.0) * 1000.0
        if "heat_capacity" not in values and _is_physical("heat_capacity", slip):
            values["heat_capacity"] = slip
            issue = Issue("heat-capacity-in-kilojoules", name, {"material": name, "stated": slip / 1000})
            self.issues.setdefault(f"{name} kJ", issue)
        wrong = sorted(set(stated) - set(values))
        values |= self._corrected(name)
        resistance = values.pop("resistance", None)
        missing = sorted(set(NAMES) - set(values) - ({"conductivity"} if resistance else set()))
        default, group = named_material(material), ""
        if missing:
            group = default.group if "conductivity" in missing else ""
            unknown = material is not None and "conductivity" in missing and not default.is_known
            known: dict[str, Any] = {
                "material": name,
                "missing": tuple(map(Phrase, missing)),
                "default": Term(default.layer.name),
                "impossible": tuple(Phrase("impossible-value", {"name": Phrase(k), "value": stated[k]}) for k in wrong),
            }
            code = "material-unknown" if unknown else "material-incomplete"
            code = "material-impossible" if wrong else code
            self.issues.setdefault(name, Issue(code, name, known))
        values = {k: values.get(k, getattr(default.layer, k)) for k in NAMES}
        return NamedMaterial(MaterialLayer(name, 1.0, **values), group, resistance), not missing

    def _corrected(self, name: str) -> dict[str, float]:
        """Properties of a material that the corrections state; of a U-value the resistance."""
        correction = next((one for one in self.corrections if one.matches(name)), None)
        if correction is None:
            return {}
        values = dict(correction.values)
        if "u" in values:
            values["resistance"] = max(1 / values.pop("u") - SURFACES, 1e-3)
        return values


def materials_of(
    element: ifcopenshell.entity_instance, damage: Damage | None = None
) -> list[ifcopenshell.entity_instance]:
    """The materials of an element, its own or those of the whole that it is a part of."""
    return own_materials(_with_material(element, damage), damage)


def own_materials(
    element: ifcopenshell.entity_instance, damage: Damage | None = None
) -> list[ifcopenshell.entity_instance]:
    """The materials of an element or of its type."""
    damage = Damage() if damage is None else damage
    read = ifcopenshell.util.element.get_materials
    return entities(damage.read(read, element, of=element, data="material", default=[]))


def _material_of(element: ifcopenshell.entity_instance, damage: Damage | None) -> ifcopenshell.entity_instance | None:
    """The material associated with an element or its type: a usage, set, list or material."""
    damage = Damage() if damage is None else damage
    material = damage.read(
        ifcopenshell.util.element.get_material,
        element,
        should_skip_usage=False,
        of=element,
        data="material",
        default=None,
    )
    return next(iter(entities(material)), None)


def _with_material(element: ifcopenshell.entity_instance, damage: Damage | None) -> ifcopenshell.entity_instance:
    """The element, or where it has no material the whole that it is a part of and that has one.

    A roof's material is the roof's, its body that of its slabs (IfcRelAggregates).
    """
    damage = Damage() if damage is None else damage
    whole: ifcopenshell.entity_instance | None = element
    for _ in range(DEEPEST):  # a damaged file may hold a loop
        if whole is None or not whole.is_a("IfcElement"):
            break
        if _material_of(whole, damage) is not None:
            return whole
        read = ifcopenshell.util.element.get_aggregate
        aggregate = damage.read(read, whole, of=whole, data="whole", default=None)
        whole = next(iter(entities(aggregate)), None)
    return element


def _is_physical(name: str, value: float) -> bool:
    low, high = PHYSICAL[name]
    return low <= value <= high


def _classified(material: ifcopenshell.entity_instance) -> list[str]:
    """Names of the classification entries of a material (IFC4), such as "Mineral wool slabs"."""
    names = []
    relations = [*(getattr(material, "HasExternalReferences", None) or ())]
    for relation in relations:
        reference = getattr(relation, "RelatingReference", None)
        if reference is not None and reference.is_a("IfcClassificationReference"):
            names.append(reference.Name or "")
    for relation in material.file.get_inverse(material):
        if relation.is_a("IfcRelAssociatesClassification"):
            names.append(getattr(relation.RelatingClassification, "Name", None) or "")
    return names


def named_material(material: ifcopenshell.entity_instance | None) -> NamedMaterial:
    """What a material is: by its classification, else its name, its category or its description."""
    if material is None:
        return material_named("")
    texts = [*_classified(material), material.Name or ""]
    texts += [getattr(material, key, None) or "" for key in ("Category", "Description")]
    candidates = [material_named(text) for text in texts]
    return next((one for one in candidates if one.is_known), candidates[-3])


def _axis(element: ifcopenshell.entity_instance, usage, damage: Damage) -> np.ndarray | None:
    """Direction [3] in model axes along which the layers follow each other."""
    columns = {"AXIS1": 0, "AXIS2": 1, "AXIS3": 2}
    if usage is None or usage.LayerSetDirection not in columns:
        return None
    matrix = placement_of(element, damage)
    if matrix is None:
        return None
    sign = -1.0 if usage.DirectionSense == "NEGATIVE" else 1.0
    return sign * matrix[:3, columns[usage.LayerSetDirection]]
