"""The property set of fenestration data as buildingSMART's property set definition (PSD, XML).

Drawn from the same templates as the IFC library and the IDS; complex properties keep their members.

Source: buildingSMART PSD_IFC4.xsd, "PropertySetDef", "PropertyDef", "PropertyType".
"""

from __future__ import annotations

import uuid
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from os import PathLike

from bim.ifc.fenestration_read import HOLDERS
from bim.ifc.fenestration_write import SET_NAME
from bim.ifc.property_templates import (
    NAMESPACE,
    RANGES,
    WHAT,
    XSI,
    PropertyTemplate,
    fenestration_templates,
)
from mitsuba_cfs.files import write_text

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
        made = ElementTree.SubElement(
            owner, "PropertyDef", ifdguid=uuid.uuid5(NAMESPACE, place).hex
        )
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
