"""The property set of fenestration data as definitions: IfcPropertySetTemplate, IDS and PSD.

All are drawn from what `fenestration_write` writes for states that have everything, so that no
second list of the properties exists.  Members that a set holds in any number ("Layer 1", "Layer 2")
are described once.

Sources: dissertation, figures 21 and 22; IFC4 ADD2 TC1, "IfcPropertySetTemplate"; buildingSMART IDS
1.0, whose requirements know single values and lists, but no complex properties; buildingSMART
PSD_IFC4.xsd, "PropertySetDef", "PropertyDef", "PropertyType".
"""

from __future__ import annotations

import re
import uuid
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from os import PathLike
from types import MappingProxyType

import ifcopenshell
import ifcopenshell.guid
import numpy as np

from bim.fenestration import AngularGValue, ShadingState
from bim.ifc.fenestration_read import HOLDERS
from bim.ifc.fenestration_write import POSITION, SET_NAME, attach_state
from bim.ifc.property_sets import Entity, save
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf
from mitsuba_cfs.files import write_text
from thermal.closure import Closure
from thermal.glazing import Gap
from thermal.glazing_unit import GasGap, GlazingLayer, GlazingUnit, Openings
from thermal.gvalue import TYPICAL_SYSTEMS

SCHEMA = "http://buildingSMART-tech.org/xml/psd/PSD_IFC4.xsd"
FIRST = "the first of any number, numbered on"


def write_psd(path: str | PathLike[str]) -> None:
    """Write the definition of the set as a PropertySetDef."""
    ElementTree.register_namespace("xsi", XSI)
    attributes = {
        f"{{{XSI}}}noNamespaceSchemaLocation": SCHEMA,
        "ifdguid": uuid.uuid5(NAMESPACE, SET_NAME).hex,
        "templatetype": "PSET_TYPEDRIVENOVERRIDE",
    }
    root = ElementTree.Element("PropertySetDef", attributes)
    ElementTree.SubElement(root, "IfcVersion", version="IFC4")
    _text(root, "Name", SET_NAME)
    _text(root, "Definition", f"{WHAT}; '{SET_NAME}: STATE' for each further state of its shade.")
    ElementTree.SubElement(root, "Applicability")
    classes = ElementTree.SubElement(root, "ApplicableClasses")
    for holder in HOLDERS:
        _text(classes, "ClassName", holder)
    _text(root, "ApplicableTypeValue", "/".join(HOLDERS))
    held = ElementTree.SubElement(root, "PropertyDefs")
    _define(held, fenestration_templates().values(), SET_NAME)
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    write_text(path, f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n')


def _define(owner: ElementTree.Element, templates: Iterable[PropertyTemplate], within: str) -> None:
    """A PropertyDef of each template, in the schema's order."""
    for one in templates:
        place = f"{within}/{one.name}"
        made = ElementTree.SubElement(owner, "PropertyDef", ifdguid=uuid.uuid5(NAMESPACE, place).hex)
        _text(made, "Name", one.name)
        words = [one.usage, FIRST if one.many else ""]
        _text(made, "Definition", "; ".join(filter(None, words)))
        kind = ElementTree.SubElement(made, "PropertyType")
        if one.kind == "P_COMPLEX":
            held = ElementTree.SubElement(kind, "TypeComplexProperty", name=one.usage)
            _define(held, one.members.values(), place)
        elif one.kind == "P_LISTVALUE":
            listed = ElementTree.SubElement(kind, "TypePropertyListValue")
            _measure(ElementTree.SubElement(listed, "ListValue"), one)
        elif one.kind == "P_BOUNDEDVALUE":
            bounded = ElementTree.SubElement(kind, "TypePropertyBoundedValue")
            _range(ElementTree.SubElement(bounded, "ValueRangeDef"), one)
            _measure(bounded, one)
        else:
            _measure(ElementTree.SubElement(kind, "TypePropertySingleValue"), one)


def _measure(owner: ElementTree.Element, one: PropertyTemplate) -> None:
    ElementTree.SubElement(owner, "DataType", type=one.measure)
    if one.unit is not None:
        ElementTree.SubElement(owner, "UnitType", type=one.unit[0])


def _range(owner: ElementTree.Element, one: PropertyTemplate) -> None:
    limits = RANGES.get(one.measure, {})
    for name, facet in (("LowerBoundValue", "minInclusive"), ("UpperBoundValue", "maxInclusive")):
        ElementTree.SubElement(owner, name, value=limits.get(facet, "?"))


def _text(owner: ElementTree.Element, tag: str, text: str) -> None:
    ElementTree.SubElement(owner, tag).text = text


KINDS = {  # of a property: of its template
    "IfcPropertySingleValue": "P_SINGLEVALUE",
    "IfcPropertyListValue": "P_LISTVALUE",
    "IfcPropertyBoundedValue": "P_BOUNDEDVALUE",
    "IfcComplexProperty": "P_COMPLEX",
}
RANGES = {  # of a measure in the IDS
    "IfcNormalisedRatioMeasure": {"minInclusive": "0", "maxInclusive": "1"},
    "IfcThermalTransmittanceMeasure": {"minExclusive": "0"},
}
VERSIONS = "IFC2X3 IFC4 IFC4X3_ADD2"
WHAT = "Optical and thermal properties of a fenestration system by direction"
IDS, XS = "http://standards.buildingsmart.org/IDS", "http://www.w3.org/2001/XMLSchema"
XSI = "http://www.w3.org/2001/XMLSchema-instance"
NAMESPACE = uuid.uuid5(uuid.NAMESPACE_DNS, "mitsuba-cfs")  # GUIDs are the same in every file


@dataclass(frozen=True, slots=True)
class PropertyTemplate:
    """What a property of the set is."""

    name: str
    kind: str  # one of the values of KINDS
    measure: str = ""  # its IFC type; "" of a complex one
    unit: tuple[str, str | None, str] | None = None  # kind, prefix, name of an IfcSIUnit
    usage: str = ""  # of a complex one
    many: bool = False  # whether others follow it, numbered on
    members: Mapping[str, PropertyTemplate] = field(default_factory=dict)


@cache
def fenestration_templates() -> Mapping[str, PropertyTemplate]:
    """The properties of the set that holds a shading state, by name."""
    templates: Mapping[str, PropertyTemplate] = {}
    for state in _whole_states():
        model = ifcopenshell.file(schema="IFC4")
        window = model.create_entity("IfcWindow", ifcopenshell.guid.new())
        attach_state(model, [window], state)
        (pset,) = model.by_type("IfcPropertySet")
        templates = _merged(templates, _templates(pset.HasProperties))
    return MappingProxyType(templates)


def write_templates(path: str | PathLike[str]) -> None:
    """Write an IFC4 project library with the template of the set."""
    model = ifcopenshell.file(schema="IFC4")
    library = model.create_entity("IfcProjectLibrary", _guid("library"), Name="Fenestration data", Description=WHAT)
    held = [_template(model, one, SET_NAME) for one in fenestration_templates().values()]
    template = model.create_entity(
        "IfcPropertySetTemplate",
        _guid(SET_NAME),
        Name=SET_NAME,
        Description=f"{WHAT}; '{SET_NAME}: STATE' for each further state of its shade",
        TemplateType="PSET_TYPEDRIVENOVERRIDE",
        ApplicableEntity=",".join(HOLDERS),
        HasPropertyTemplates=held,
    )
    model.create_entity("IfcRelDeclares", _guid("declares"), RelatingContext=library, RelatedDefinitions=[template])
    save(model, path)


def write_ids(path: str | PathLike[str]) -> None:
    """Write an IDS that checks type and range of the set's values; windows must have a U."""
    for prefix, name in (("", IDS), ("xs", XS), ("xsi", XSI)):
        ElementTree.register_namespace(prefix, name)
    root = ElementTree.Element(f"{{{IDS}}}ids")
    root.set(f"{{{XSI}}}schemaLocation", f"{IDS} {IDS}/1.0/ids.xsd")
    info = _child(root, "info")
    _child(info, "title").text = f"Windows with a {SET_NAME}"
    _child(info, "description").text = f"{WHAT}; complex properties are beyond an IDS"
    listed = _child(root, "specifications")
    for one in fenestration_templates().values():
        if one.measure == "IfcThermalTransmittanceMeasure":
            _specification(listed, one, HOLDERS[:1], "required")
            _specification(listed, one, HOLDERS[1:], "optional")
        elif one.kind != "P_COMPLEX":
            _specification(listed, one, HOLDERS, "optional")
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    write_text(path, f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n')


def _whole_states() -> Iterator[ShadingState]:
    """States that have between them everything that a state can hold."""
    block = np.zeros((KLEMS_FULL.size, KLEMS_FULL.size))
    klems = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, block, block, block, block)
    leaf = TensorTree(4, np.zeros(1, dtype=np.int64), np.zeros(1))
    tree = TensorTreeBsdf(leaf, leaf, leaf, leaf)
    pane = GlazingLayer(0.004, 1.0, (0.84, 0.84), solar=(0.8, 0.1, 0.1))
    shade = replace(pane, openings=Openings(0.0, 0.0, 0.0, 0.0, 0.1))
    unit = GlazingUnit((pane, shade), (GasGap(0.016, (("air", 1.0),), (0.1, 20.0)),))
    films = (0.07, 0.02)
    closures = (
        Closure("gap", Gap(0.016, (("air", 1.0),), (0.84, 0.84)), *films),
        Closure("linear", slope=0.002),
        Closure("surface", surface=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
        Closure("layers", unit=unit),
    )
    angles = AngularGValue(np.zeros(1), np.zeros(1), np.ones((1, 1)))
    for closure, bsdf in zip(closures, (klems, tree, klems, tree), strict=True):
        yield ShadingState("", {"Visible": bsdf, "Solar": bsdf}, angles, 1.0, 0.5, np.ones(145), closure, "none")


def _templates(properties: Iterable[Entity]) -> dict[str, PropertyTemplate]:
    """The templates of properties by name; of numbered ones the first."""
    templates: dict[str, PropertyTemplate] = {}
    for one in properties:
        kind = KINDS[one.is_a()]
        numbered = re.fullmatch(r"(.* )(\d+)", one.Name)
        if numbered and int(numbered[2]) > 1:
            first = f"{numbered[1]}1"
            if first in templates:
                more = _templates(getattr(one, "HasProperties", None) or ())
                members = _merged(templates[first].members, more)
                templates[first] = replace(templates[first], many=True, members=members)
                continue
        if kind == "P_COMPLEX":
            members = _templates(one.HasProperties)
            templates[one.Name] = PropertyTemplate(
                one.Name, kind, usage=one.UsageName, many=bool(numbered), members=members
            )
        else:
            templates[one.Name] = PropertyTemplate(
                one.Name, kind, _value(one).is_a(), _unit(one.Unit), many=bool(numbered)
            )
    return templates


def _unit(unit: Entity | None) -> tuple[str, str | None, str] | None:
    return None if unit is None else (unit.UnitType, unit.Prefix, unit.Name)


def _value(prop: Entity) -> Entity:
    """A value of a property that is not complex."""
    if prop.is_a("IfcPropertyListValue"):
        return prop.ListValues[0]
    return prop.LowerBoundValue if prop.is_a("IfcPropertyBoundedValue") else prop.NominalValue


def _merged(one: Mapping[str, PropertyTemplate], other: Mapping[str, PropertyTemplate]) -> dict[str, PropertyTemplate]:
    """The templates of both; what both have holds the members of both."""
    merged = dict(one)
    for name, template in other.items():
        known = merged.get(name)
        if known is None:
            merged[name] = template
            continue
        usage = known.usage
        if template.usage not in usage.split(" or "):
            usage = f"{usage} or {template.usage}"
        merged[name] = replace(
            known, usage=usage, many=known.many or template.many, members=_merged(known.members, template.members)
        )
    return merged


def _template(model: ifcopenshell.file, one: PropertyTemplate, within: str) -> Entity:
    path = f"{within}/{one.name}"
    what = "the first of any number" if one.many else None
    if one.kind == "P_COMPLEX":
        held = [_template(model, member, path) for member in one.members.values()]
        return model.create_entity(
            "IfcComplexPropertyTemplate",
            _guid(path),
            Name=one.name,
            Description=what,
            UsageName=one.usage,
            TemplateType="P_COMPLEX",
            HasPropertyTemplates=held,
        )
    unit = None
    if one.unit is not None:
        kind, prefix, name = one.unit
        unit = model.create_entity("IfcSIUnit", UnitType=kind, Prefix=prefix, Name=name)
    return model.create_entity(
        "IfcSimplePropertyTemplate",
        _guid(path),
        Name=one.name,
        Description=what,
        TemplateType=one.kind,
        PrimaryMeasureType=one.measure,
        PrimaryUnit=unit,
    )


def _guid(path: str) -> str:
    return ifcopenshell.guid.compress(uuid.uuid5(NAMESPACE, path).hex)


def _specification(
    listed: ElementTree.Element, one: PropertyTemplate, holders: Sequence[str], cardinality: str
) -> None:
    """What the IDS says of a property of elements of some classes."""
    name = f"{SET_NAME}: {one.name}, {cardinality}"
    made = _child(listed, "specification", name=name, ifcVersion=VERSIONS)
    applicability = _child(made, "applicability", minOccurs="0", maxOccurs="unbounded")
    _values(_child(_child(applicability, "entity"), "name"), [name.upper() for name in holders])
    of_property = _child(
        _child(made, "requirements"), "property", dataType=one.measure.upper(), cardinality=cardinality
    )
    _restricted(_child(of_property, "propertySet"), pattern=f"{SET_NAME}(: .+)?")
    _child(_child(of_property, "baseName"), "simpleValue").text = one.name
    if one.name == POSITION:
        _values(_child(of_property, "value"), list(TYPICAL_SYSTEMS))
    elif one.measure in RANGES:
        _restricted(_child(of_property, "value"), base="xs:double", **RANGES[one.measure])


def _values(owner: ElementTree.Element, values: Iterable[str]) -> None:
    held = ElementTree.SubElement(owner, f"{{{XS}}}restriction", base="xs:string")
    for value in values:
        ElementTree.SubElement(held, f"{{{XS}}}enumeration", value=value)


def _restricted(owner: ElementTree.Element, base: str = "xs:string", **facets: str) -> None:
    held = ElementTree.SubElement(owner, f"{{{XS}}}restriction", base=base)
    for name, value in facets.items():
        ElementTree.SubElement(held, f"{{{XS}}}{name}", value=value)


def _child(owner: ElementTree.Element, tag: str, /, **attributes: str) -> ElementTree.Element:
    return ElementTree.SubElement(owner, f"{{{IDS}}}{tag}", attributes)
