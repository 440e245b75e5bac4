"""The property set of fenestration data as definitions for other programs."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree

import ifcopenshell
import ifcopenshell.guid
import ifcopenshell.util.pset
import ifcopenshell.validate
import numpy as np
import pytest

from bim.fenestration import ShadingState
from bim.ifc.fenestration_read import THERMAL
from bim.ifc.fenestration_write import BLOCKS, attach_state
from bim.ifc.property_templates import IDS, KINDS, XS, write_ids, write_psd, write_templates
from mitsuba_cfs.bsdf.klems import KLEMS_HALF, KlemsBsdf
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf
from thermal.closure import Closure
from thermal.glazing_unit import GasGap, GlazingLayer, GlazingUnit

NAMES = {"ids": IDS, "xs": XS}


@pytest.fixture(scope="module")
def library(tmp_path_factory) -> ifcopenshell.file:
    path = tmp_path_factory.mktemp("templates") / "templates.ifc"
    write_templates(path)
    return ifcopenshell.open(path)


def test_the_library_is_valid_and_ifcopenshell_finds_the_set_for_windows(library):
    log = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(library, log)
    assert log.statements == []
    sets = ifcopenshell.util.pset.PsetQto("IFC4", templates=[library])
    for kind in ("IfcWindow", "IfcDoor", "IfcWindowType"):
        assert "BlackBox Model" in sets.get_applicable_names(kind)
    assert "BlackBox Model" not in sets.get_applicable_names("IfcWall")


def test_all_that_the_reader_takes_is_there(library):
    names = {one.Name for one in library.by_type("IfcPropertyTemplate")}
    assert set(THERMAL) | set(BLOCKS.values()) | {"BSDF Visible", "BSDF Solar"} <= names


def states() -> list[ShadingState]:
    """Four layers and Klems half; trees of rank 3: the templates were drawn from neither."""
    rng = np.random.default_rng(3)
    block = rng.random((KLEMS_HALF.size, KLEMS_HALF.size))
    pane = GlazingLayer(0.004, 1.0, (0.84, 0.05), solar=(0.6, 0.2, 0.1))
    unit = GlazingUnit((pane,) * 4, (GasGap(0.012, (("air", 1.0),)),) * 3)
    tree = TensorTree(3, np.full(8, 1), rng.random(8))
    return [
        ShadingState(
            "down",
            {"Solar": KlemsBsdf(KLEMS_HALF, KLEMS_HALF, block, reflection_back=block)},
            u_value=1.1,
            closure=Closure("layers", unit=unit),
            shading_position="internal",
        ),
        ShadingState("down", {"Visible": TensorTreeBsdf(tree)}, closure=Closure("linear")),
    ]


@pytest.mark.parametrize(("number", "least"), [(0, 200), (1, 6)])
def test_a_set_that_is_written_matches_its_template(library, number, least):
    model = ifcopenshell.file(schema="IFC4")
    window = model.create_entity("IfcWindow", ifcopenshell.guid.new())
    attach_state(model, [window], states()[number])
    (pset,) = model.by_type("IfcPropertySet")
    (template,) = library.by_type("IfcPropertySetTemplate")
    assert pset.Name == f"{template.Name}: down"
    assert _matched(pset.HasProperties, template.HasPropertyTemplates) > least


def _matched(properties, templates) -> int:
    """How many properties have a template of their name, kind and measure."""
    known, count = {one.Name: one for one in templates}, 0
    for one in properties:
        template = known.get(one.Name) or known[re.sub(r"\d+$", "1", one.Name)]
        assert template.TemplateType == KINDS[one.is_a()], one.Name
        if one.is_a("IfcComplexProperty"):
            count += _matched(one.HasProperties, template.HasPropertyTemplates)
        else:
            values = getattr(one, "ListValues", None) or [
                getattr(one, "NominalValue", None) or getattr(one, "UpperBoundValue", None)
            ]
            assert template.PrimaryMeasureType == values[0].is_a(), one.Name
            assert _unit(template.PrimaryUnit) == _unit(one.Unit), one.Name
        count += 1
    return count


def _unit(one) -> tuple | None:
    return None if one is None else (one.Prefix, one.Name)


def test_two_files_are_the_same(library, tmp_path):
    write_templates(tmp_path / "again.ifc")
    again = ifcopenshell.open(tmp_path / "again.ifc")
    kinds = ("IfcPropertySetTemplate", "IfcPropertyTemplate")
    for kind in kinds:
        guids = [{one.GlobalId for one in file.by_type(kind)} for file in (library, again)]
        assert guids[0] == guids[1]
        assert len(guids[0]) == len(library.by_type(kind))


def test_the_ids_asks_windows_for_u_and_checks_types_and_ranges(tmp_path):
    write_ids(tmp_path / "windows.ids")
    root = ElementTree.parse(tmp_path / "windows.ids").getroot()
    found = {}
    for one in root.iterfind(".//ids:specification", NAMES):
        held = one.find(".//ids:property", NAMES)
        classes = [e.get("value") for e in one.iterfind("ids:applicability//xs:enumeration", NAMES)]
        limits = [(e.tag.partition("}")[2], e.get("value")) for e in held.iterfind("ids:value/xs:restriction/*", NAMES)]
        name = held.findtext("ids:baseName/ids:simpleValue", namespaces=NAMES)
        found[name, held.get("cardinality")] = held.get("dataType"), classes, limits
    u_type = "IFCTHERMALTRANSMITTANCEMEASURE"
    assert found["U-value", "required"] == (u_type, ["IFCWINDOW"], [("minExclusive", "0")])
    kind, classes, limits = found["Shading position", "optional"]
    assert (kind, classes[0], len(classes)) == ("IFCLABEL", "IFCWINDOW", 4)
    assert limits == [("enumeration", p) for p in ("none", "external", "internal", "integrated")]
    assert found["G-value at normal incidence", "optional"][2] == [("minInclusive", "0"), ("maxInclusive", "1")]
    pattern = root.find(".//ids:propertySet/xs:restriction/xs:pattern", NAMES).get("value")
    assert re.fullmatch(pattern, "BlackBox Model") and re.fullmatch(pattern, "BlackBox Model: a")
    assert not re.fullmatch(pattern, "BlackBox Modelled")


# The children that PSD_IFC4.xsd allows in an element, in its order; "*" where any number may follow
PSD = {
    "PropertySetDef": (
        "IfcVersion",
        "Name",
        "Definition",
        "Applicability",
        "ApplicableClasses",
        "ApplicableTypeValue",
        "PropertyDefs",
    ),
    "ApplicableClasses": ("ClassName*",),
    "PropertyDefs": ("PropertyDef*",),
    "PropertyDef": ("Name", "Definition", "PropertyType"),
    "TypeComplexProperty": ("PropertyDef*",),
    "TypePropertySingleValue": ("DataType", "UnitType?"),
    "TypePropertyListValue": ("ListValue",),
    "ListValue": ("DataType", "UnitType?"),
    "TypePropertyBoundedValue": ("ValueRangeDef", "DataType", "UnitType?"),
    "ValueRangeDef": ("LowerBoundValue", "UpperBoundValue"),
}


def _structured(element: ElementTree.Element) -> None:
    """Raise where an element holds what the schema does not know, or in another order."""
    tags = " ".join(child.tag for child in element)
    if element.tag == "PropertyType":
        assert tags in PSD and tags.startswith("Type")  # a choice
    elif element.tag in PSD:
        parts = [re.sub(r"(\w+)([*?]?)", r"(\1 )\2", part) for part in PSD[element.tag]]
        assert re.fullmatch("".join(parts), f"{tags} ")
    else:
        assert not tags
    for child in element:
        _structured(child)


def test_the_psd_has_the_schemas_structure_and_the_librarys_properties(library, tmp_path):
    """Every template of the library is defined in it, with its measure, at its place."""
    write_psd(tmp_path / "set.xml")
    root = ElementTree.parse(tmp_path / "set.xml").getroot()
    _structured(root)
    classes = [one.text for one in root.iterfind("ApplicableClasses/ClassName")]
    (template,) = library.by_type("IfcPropertySetTemplate")
    assert classes == template.ApplicableEntity.split(",")
    guids = [one.get("ifdguid") for one in root.iter() if one.get("ifdguid")]
    assert len(set(guids)) == len(guids)
    places = {ifcopenshell.guid.expand(one.GlobalId) for one in _below(template)}
    assert set(guids) == {place.replace("-", "") for place in places}
    measures = sorted(one.PrimaryMeasureType for one in library.by_type("IfcSimplePropertyTemplate"))
    assert sorted(one.get("type") for one in root.iter("DataType")) == measures


def _below(template):
    yield template
    for one in getattr(template, "HasPropertyTemplates", None) or ():
        yield from _below(one)
