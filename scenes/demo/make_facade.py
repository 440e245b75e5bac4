"""Write a building with photovoltaic facades in IFC4: `python -m scenes.demo.make_facade FILE`.

The study of its modules, `facade_pv.toml`, is written beside it.

Like the building of the dissertation's section 5.3: four storeys, its long side to the south-east,
a neighbour close to its south-west side, a technical box beside the modules on the roof, two trees
that do not exist.  216 modules in 12 subsystems of 18, all and only they of one material.

    subsystems 1-8   south-east facade, blocks of 6 x 3 modules
               9     roof, tilted 15 degrees to the south-east, the box to their south-west
               10-11 south-west facade, before the neighbour
               12    north-west facade
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

import ifcopenshell
import ifcopenshell.api.aggregate
import ifcopenshell.api.context
import ifcopenshell.api.geometry
import ifcopenshell.api.material
import ifcopenshell.api.project
import ifcopenshell.api.root
import ifcopenshell.api.spatial
import ifcopenshell.api.unit
import numpy as np
from numpy.typing import NDArray

LENGTH, DEPTH, HEIGHT = 21.0, 14.0, 13.5  # [m]
WIDE, HIGH, THICK = 1.65, 0.99, 0.04  # of a module [m]
STUDY = "facade_pv.toml"
GAP = 0.03
BEFORE_WALL = 0.10  # of a module's back [m]
ALLEY = 4.0  # to the neighbour [m]
TILT = np.radians(15.0)
MATERIAL = "PV laminate"

# Building axes: a along the south-east facade to the north-east, b into the building, c up
SOUTH_EAST = np.array([1.0, -1.0, 0.0]) / np.sqrt(2)
A, B, C = np.cross([0.0, 0.0, 1.0], SOUTH_EAST), -SOUTH_EAST, np.array([0.0, 0.0, 1.0])
CUBE = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]


def facade() -> ifcopenshell.file:
    """The whole model."""
    model = ifcopenshell.api.project.create_file(version="IFC4")
    storey, body = _project(model)
    material = ifcopenshell.api.material.add_material(model, name=MATERIAL)

    def add(kind: str, name: str, corner, sides, of=None) -> None:
        element = ifcopenshell.api.root.create_entity(model, ifc_class=kind, name=name)
        points = _corners(np.asarray(corner, dtype=float), np.asarray(sides, dtype=float))
        shape = ifcopenshell.api.geometry.add_mesh_representation(
            model, context=body, vertices=[points.tolist()], faces=[CUBE]
        )
        ifcopenshell.api.geometry.assign_representation(model, product=element, representation=shape)
        ifcopenshell.api.geometry.edit_object_placement(model, product=element, matrix=np.eye(4))
        ifcopenshell.api.spatial.assign_container(model, products=[element], relating_structure=storey)
        if of is not None:
            ifcopenshell.api.material.assign_material(model, products=[element], material=of)

    box = "IfcBuildingElementProxy"
    add(box, "Building", 0 * A, [LENGTH * A, DEPTH * B, HEIGHT * C])
    add(box, "Neighbour", -(ALLEY + 10) * A - 2 * B, [10 * A, 18 * B, 12 * C])
    add(box, "Technical box", 1.0 * A + 3 * B + HEIGHT * C, [3 * A, 5 * B, 2.5 * C])
    for number, along in enumerate((5.0, 15.0), 1):
        add("IfcGeographicElement", f"Tree {number}", along * A - 5 * B, [3 * A, -3 * B, 8 * C])
    for name, corner, wide, high, out in _module_frames():
        sides = [WIDE * wide, HIGH * high, THICK * out]
        add("IfcSolarDevice", name, corner, sides, material)
    return model


def _module_frames():
    """Name, corner [m], directions of width, height and outwards of every module."""
    pitch_w, pitch_h = WIDE + GAP, HIGH + GAP
    start = (LENGTH - 12 * pitch_w) / 2
    for row in range(12):
        for column in range(12):
            block = 1 + (row // 3) * 2 + column // 6
            corner = (start + column * pitch_w) * A + (0.8 + row * pitch_h) * C - BEFORE_WALL * B
            yield f"PV {block:02d} row {row} column {column}", corner, A, C, -B
    up = np.cos(TILT) * B + np.sin(TILT) * C
    for row in range(3):
        for column in range(6):
            corner = (5 + column * pitch_w) * A + (3.5 + 1.4 * row) * B + (HEIGHT + 0.2) * C
            yield f"PV 09 row {row} column {column}", corner, A, up, np.cross(A, up)
    for block, first in ((10, 7.4), (11, 1.2)):
        for row in range(3):
            for column in range(6):
                height = first + row * pitch_h
                corner = (12.0 - column * pitch_w) * B + height * C - BEFORE_WALL * A
                yield f"PV {block} row {row} column {column}", corner, -B, C, -A
    for row in range(3):
        for column in range(6):
            corner = (15 - column * pitch_w) * A + (DEPTH + BEFORE_WALL) * B
            corner = corner + (8 + row * pitch_h) * C
            yield f"PV 12 row {row} column {column}", corner, -A, C, B


def _corners(corner: NDArray[np.float64], sides: NDArray[np.float64]) -> NDArray[np.float64]:
    """The eight corners of a parallelepiped, its faces as in `CUBE` outwards."""
    if np.linalg.det(sides) < 0:
        sides = sides[[1, 0, 2]]
    a, b, c = sides
    bottom = np.array([corner, corner + a, corner + a + b, corner + b])
    return np.concatenate([bottom, bottom + c])


def _project(model: ifcopenshell.file) -> tuple[ifcopenshell.entity_instance, ...]:
    create = ifcopenshell.api.root.create_entity
    project = create(model, ifc_class="IfcProject", name="mitsuba-cfs photovoltaic facade")
    units = [
        ifcopenshell.api.unit.add_si_unit(model, unit_type=kind)
        for kind in ("LENGTHUNIT", "AREAUNIT", "VOLUMEUNIT", "PLANEANGLEUNIT")
    ]
    ifcopenshell.api.unit.assign_unit(model, units=units)
    project.UnitsInContext.Units = units  # assigned as a set, in an order of their own
    whole = ifcopenshell.api.context.add_context(model, context_type="Model")
    body = ifcopenshell.api.context.add_context(
        model, context_type="Model", context_identifier="Body", target_view="MODEL_VIEW", parent=whole
    )
    site = create(model, ifc_class="IfcSite", name="Site")
    building = create(model, ifc_class="IfcBuilding", name="Office")
    storey = create(model, ifc_class="IfcBuildingStorey", name="Ground floor")
    storey.Elevation = 0.0
    for child, parent in ((site, project), (building, site), (storey, building)):
        ifcopenshell.api.aggregate.assign_object(model, products=[child], relating_object=parent)
    return storey, body


def write_facade(path: Path) -> None:
    """Write the building, and beside it the study of its modules."""
    facade().write(str(path))
    shutil.copyfile(Path(__file__).with_name(STUDY), path.with_name(STUDY))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path, nargs="?", default=Path("facade.ifc"))
    target = parser.parse_args().file
    write_facade(target)
    print(f"{target}, and the study of its modules: {target.with_name(STUDY)}")
