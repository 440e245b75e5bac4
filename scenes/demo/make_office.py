"""Write the demo's building, a two-room office in IFC4: `python -m scenes.demo.make_office [FILE]`.

Plan (metres, project coordinates; z = 0 is the finished floor, rooms are 3.0 high):

    y=6  +-----------------+--------------+
         |  A              |  B           |
         |  4.0 x 6.0     door  3.5 x 6.0 W   W: window of B, 2.0 x 1.5, faces east
         |                 |              |
    y=0  +----WWWWWWW------+--------------+
         x=0  W: window of A, 3.0 x 1.5, faces south      x=7.625

The project's north is turned by 10 degrees: true north is not +y, so the windows face 170
and 80 degrees from north, clockwise. The site is that of the demo's weather file.
"""

from __future__ import annotations

import sys
import uuid
from pathlib import Path

import ifcopenshell
import ifcopenshell.api.aggregate
import ifcopenshell.api.context
import ifcopenshell.api.georeference
import ifcopenshell.api.project
import ifcopenshell.api.root
import ifcopenshell.api.unit
import numpy as np

from scenes.demo.office_materials import thickness
from scenes.demo.office_parts import Office

HEIGHT = 3.0
DEPTH = 6.0
WIDTH_A, WIDTH_B = 4.0, 3.5
TRUE_NORTH_DEG = -10.0  # angle of true north from +y, counter-clockwise: it lies towards +x
LATITUDE, LONGITUDE, ELEVATION = (41, 58, 48, 0), (-87, -55, -12, 0), 201.0  # O'Hare, as the EPW
NAMESPACE = uuid.UUID("6f0b5f0e-9d1c-4c57-8f5b-5a3c2c0d7a11")  # of the repeatable GlobalIds


def office() -> ifcopenshell.file:
    """The whole model; the same entities with the same GlobalIds at every call."""
    model = ifcopenshell.api.project.create_file(version="IFC4")
    storey, body, axis = project(model)
    parts = Office(model, storey, body, axis)
    _structure(parts)
    _openings(parts)
    _rooms(parts)
    _fix_identity(model)
    return model


def project(model: ifcopenshell.file) -> tuple[ifcopenshell.entity_instance, ...]:
    """The ground floor and the contexts of bodies and axes of a project on the demo's site."""
    create = ifcopenshell.api.root.create_entity
    project = create(model, ifc_class="IfcProject", name="mitsuba-cfs demo office")
    units = [
        ifcopenshell.api.unit.add_si_unit(model, unit_type=kind)
        for kind in ("LENGTHUNIT", "AREAUNIT", "VOLUMEUNIT", "PLANEANGLEUNIT",
                     "THERMODYNAMICTEMPERATUREUNIT")
    ]  # fmt: skip
    ifcopenshell.api.unit.assign_unit(model, units=units)
    project.UnitsInContext.Units = units  # assigned as a set, in an order of their own
    add_context = ifcopenshell.api.context.add_context
    whole = add_context(model, context_type="Model")
    plan = add_context(model, context_type="Plan")
    body = add_context(
        model, context_type="Model", context_identifier="Body", target_view="MODEL_VIEW",
        parent=whole,
    )  # fmt: skip
    axis = add_context(
        model, context_type="Plan", context_identifier="Axis", target_view="GRAPH_VIEW",
        parent=plan,
    )  # fmt: skip
    ifcopenshell.api.georeference.edit_true_north(model, true_north=TRUE_NORTH_DEG)
    site = create(model, ifc_class="IfcSite", name="Site")
    site.RefLatitude, site.RefLongitude, site.RefElevation = LATITUDE, LONGITUDE, ELEVATION
    building = create(model, ifc_class="IfcBuilding", name="Office")
    storey = create(model, ifc_class="IfcBuildingStorey", name="Ground floor")
    storey.Elevation = 0.0
    for child, parent in ((site, project), (building, site), (storey, building)):
        ifcopenshell.api.aggregate.assign_object(model, products=[child], relating_object=parent)
    return storey, body, axis


def _structure(parts: Office) -> None:
    """Slabs and walls; a wall's reference line is its inner face, its layers go outwards."""
    wall, partition = thickness("Outer wall"), thickness("Partition")
    width = WIDTH_A + partition + WIDTH_B
    outline = ((-wall, -wall), (width + wall, -wall), (width + wall, DEPTH + wall),
               (-wall, DEPTH + wall))  # fmt: skip
    parts.slab("Floor", "Ground floor", outline, -thickness("Ground floor"), "Grey floor")
    parts.slab("Roof", "Roof", outline, HEIGHT, "White ceiling")
    corners = {
        "South wall": ((width + wall, 0.0), (-wall, 0.0)),
        "West wall": ((0.0, 0.0), (0.0, DEPTH)),
        "North wall": ((-wall, DEPTH), (width + wall, DEPTH)),
        "East wall": ((width, DEPTH), (width, 0.0)),
    }
    for name, (start, end) in corners.items():
        parts.wall(name, "Outer wall", start, end, HEIGHT, "White wall")
    start, end = (WIDTH_A + partition, 0.0), (WIDTH_A + partition, DEPTH)
    parts.wall("Partition A-B", "Partition", start, end, HEIGHT, "Light partition")


def _openings(parts: Office) -> None:
    """Windows and door; `along` is measured from the start of the wall's reference line."""
    wall, partition = thickness("Outer wall"), thickness("Partition")
    width = WIDTH_A + partition + WIDTH_B
    parts.window("Window A", "South wall", width + wall - 3.5, 0.9, 3.0, 1.5)
    parts.window("Window B", "East wall", DEPTH - 4.0, 0.9, 2.0, 1.5)
    parts.door("Door A-B", "Partition A-B", 4.5, 0.9, 2.1)


def _rooms(parts: Office) -> None:
    left = WIDTH_A + thickness("Partition")
    room_a = parts.space("A", "South office", (0.0, 0.0), (WIDTH_A, DEPTH), HEIGHT)
    parts.space("B", "East office", (left, 0.0), (left + WIDTH_B, DEPTH), HEIGHT)
    parts.desk("Desk A", room_a, np.array([1.2, 1.0, 0.0]))


def _fix_identity(model: ifcopenshell.file) -> None:
    """Give every entity a GlobalId that depends on its place in the file; fix order and date."""
    for relation in model.by_type("IfcRelationship"):
        for name in ("RelatedElements", "RelatedObjects"):
            if hasattr(relation, name):
                ordered = sorted(getattr(relation, name), key=lambda entity: entity.id())
                setattr(relation, name, ordered)
    for number, root in enumerate(model.by_type("IfcRoot")):
        name = f"{number} {root.is_a()} {root.Name}"
        root.GlobalId = ifcopenshell.guid.compress(uuid.uuid5(NAMESPACE, name).hex)
    header = model.header.file_name
    header.name = "office.ifc"
    header.time_stamp = "2026-01-01T00:00:00"
    header.author = ("mitsuba-cfs contributors",)
    header.organization = ("mitsuba-cfs",)
    header.originating_system = "scenes/demo/make_office.py"


def main() -> None:
    """Write the model to the file named, by default the one that is shipped."""
    target = sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent / "office.ifc"
    office().write(str(target))


if __name__ == "__main__":
    main()
