"""Property sets given to elements of a model, and the model written to a file."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from pathlib import Path
from uuid import UUID, uuid5

import ifcopenshell
import ifcopenshell.guid
from ifcopenshell.util.element import remove_deep2

from mitsuba_cfs.files import write_text

Entity = ifcopenshell.entity_instance
NAMESPACE = UUID("5f6c8a0e-2a5e-5d0c-9b1f-6d1d3c9a7e42")  # of the GlobalIds that are made here


def owner_of(model: ifcopenshell.file) -> Entity | None:
    """The first owner history, which IFC2X3 demands of every set; None where there is none."""
    histories = model.by_type("IfcOwnerHistory")
    return histories[0] if histories else None


def new_guid(model: ifcopenshell.file, *described: str) -> str:
    """A GlobalId that the model does not have: the same one for the same model and description."""
    for number in count():
        name = "\n".join((*described, str(number)))
        guid = ifcopenshell.guid.compress(uuid5(NAMESPACE, name).hex)
        try:
            model.by_guid(guid)
        except RuntimeError:
            return guid
    raise RuntimeError("no GlobalId is left")


def give_set(
    model: ifcopenshell.file, targets: Sequence[Entity], name: str, description: str, properties: Sequence[Entity]
) -> None:
    """Give elements or types a property set; one of that name that they have is replaced."""
    for target in targets:
        take_off(model, target, name)
    owner = owner_of(model)
    described = [name, *(target.GlobalId for target in targets)]
    pset = model.create_entity(
        "IfcPropertySet", new_guid(model, "set", *described), owner, name, description, list(properties)
    )
    types = [target for target in targets if target.is_a("IfcTypeObject")]
    for target in types:
        target.HasPropertySets = [*(target.HasPropertySets or ()), pset]
    objects = [target for target in targets if not target.is_a("IfcTypeObject")]
    if objects:
        model.create_entity(
            "IfcRelDefinesByProperties", new_guid(model, "relation", *described), owner, None, None, objects, pset
        )


def take_off(model: ifcopenshell.file, target: Entity, name: str) -> bool:
    """Take the property sets of that name off an element or type; whether it had one.

    A set that no other element has is removed with all that it alone refers to.
    """
    if target.is_a("IfcTypeObject"):
        every = target.HasPropertySets or ()
        sets = [one for one in every if one.Name == name]
        target.HasPropertySets = [one for one in every if one.Name != name] or None
    else:
        sets = []
        for relation in list(target.IsDefinedBy or ()):
            pset = getattr(relation, "RelatingPropertyDefinition", None)
            if pset is None or pset.Name != name:
                continue
            sets.append(pset)
            if others := [one for one in relation.RelatedObjects if one != target]:
                relation.RelatedObjects = others
            else:
                model.remove(relation)
    for pset in sets:
        if not model.get_total_inverses(pset):
            remove_deep2(model, pset, do_not_delete=set(model.by_type("IfcOwnerHistory")))
    return bool(sets)


def list_of_numbers(model: ifcopenshell.file, name: str, measure: str, values: Sequence[float]) -> Entity:
    """A property that lists numbers, each an instance of the measure; give it its unit then.

    Read from text, as one by one they take four times as long: a BSDF has 168 000. In seventeen
    digits a real number comes back as it was.
    """
    form = "%d" if all(isinstance(value, int) for value in values) else "%.16E"
    listed = ",".join(map(f"{measure.upper()}({form})".__mod__, values))
    property_ = f"#1=IFCPROPERTYLISTVALUE('',$,({listed}),$);"
    text = f"{STEP_HEAD.format(model.schema_identifier)}{property_}\nENDSEC;\nEND-ISO-10303-21;\n"
    made = model.add(ifcopenshell.file.from_string(text).by_id(1))
    made.Name = name
    return made


STEP_HEAD = """ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_NAME('','',(''),(''),'','','');
FILE_SCHEMA(('{}'));
ENDSEC;
DATA;
"""


def read_again(model: ifcopenshell.file) -> ifcopenshell.file:
    """The model as from its file: the next entities have the numbers of those removed last."""
    return ifcopenshell.file.from_string(model.to_string())


def save(model: ifcopenshell.file, out: str | Path) -> None:
    """Write the model; a file of that name is replaced only once the new one is whole."""
    # not `model.write`: on a full disk it says nothing, or not why, and leaves a file of its own
    write_text(out, model.to_string())
