"""Second-level boundaries of a file beside our own: what agrees, and each difference named."""

from __future__ import annotations

import ifcopenshell
import pytest

from bim.ifc.building import read_ifc
from tests.bim.small_ifc import DEPTH, HEIGHT, OPENING, WIDTH, box_model

OPENED = OPENING[2] * OPENING[3]
SOUND = {  # width, height, opening in it, what lies beyond
    "south": (WIDTH, HEIGHT, False, "EXTERNAL"),
    "north": (WIDTH, HEIGHT, False, "EXTERNAL"),
    "west": (DEPTH, HEIGHT, False, "EXTERNAL"),
    "floor": (WIDTH, DEPTH, False, "EXTERNAL"),
    "roof": (WIDTH, DEPTH, False, "EXTERNAL"),
}


def boundary(model, space, element, width, height, *, hole, beyond, curve="IfcPolyline", level=2):
    """A rectangle of `width` x `height`, with the window's opening cut out where `hole`."""
    create = model.create_entity

    def ring(w, h):
        corners = ((0.0, 0.0), (w, 0.0), (w, h), (0.0, h), (0.0, 0.0))
        line = create("IfcPolyline", [create("IfcCartesianPoint", c) for c in corners])
        if curve == "IfcPolyline":
            return line
        segment = create("IfcCompositeCurveSegment", "CONTINUOUS", True, line)
        return create("IfcCompositeCurve", [segment], False)

    origin = create("IfcCartesianPoint", (0.0, 0.0, 0.0))
    plane = create("IfcPlane", create("IfcAxis2Placement3D", origin))
    inner = [ring(*OPENING[2:])] if hole else []
    surface = create("IfcCurveBoundedPlane", plane, ring(width, height), inner)
    create(
        "IfcRelSpaceBoundary", GlobalId=ifcopenshell.guid.new(),
        Name="2ndLevel" if level == 2 else "1stLevel", RelatingSpace=space,
        RelatedBuildingElement=element,
        ConnectionGeometry=create("IfcConnectionSurfaceGeometry", surface),
        PhysicalOrVirtualBoundary="PHYSICAL", InternalOrExternalBoundary=beyond,
    )  # fmt: skip


def problems(tmp_path, changed=None, schema="IFC4", **how) -> list[str]:
    """What is said of the box room's boundaries, some of them changed."""
    small, _ = box_model(schema)
    model = small.model
    (space,) = model.by_type("IfcSpace")
    elements = {one.Name: one for one in model.by_type("IfcBuildingElement")}
    for name, (width, height, hole, beyond) in (SOUND | (changed or {})).items():
        boundary(model, space, elements[name], width, height, hole=hole, beyond=beyond, **how)
    path = tmp_path / "model.ifc"
    model.write(str(path))
    return [p.what for p in read_ifc(path).problems if "boundaries" in p.what]


@pytest.mark.parametrize("curve", ["IfcPolyline", "IfcCompositeCurve"])
@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4"])
@pytest.mark.parametrize("hole", [False, True])
def test_boundaries_that_agree_are_counted(tmp_path, curve, schema, hole):
    south = {"south": (WIDTH, HEIGHT, hole, "EXTERNAL")}
    (said,) = problems(tmp_path, south, schema, curve=curve)
    assert said == (
        "has 5 second-level space boundaries of 5 pairs of room and element: 5 agree with ours"
        " within 5 %"
    )


def test_each_difference_is_named(tmp_path):
    changed = {
        "north": (WIDTH, 0.8 * HEIGHT, False, "EXTERNAL"),
        "west": (DEPTH, HEIGHT, False, "INTERNAL"),
    }
    head, *rest = problems(tmp_path, changed)
    assert ": 3 agree" in head
    north, west = sorted(rest)
    area = WIDTH * HEIGHT
    label = "at room R1 Room"
    assert north == (
        f"IfcWall north {label}: {0.8 * area:.2f} m2 by the file's boundaries, {area:.2f} m2 by"
        " ours"
    )
    assert west == f"IfcWall west {label}: internal by the file's boundaries, outside by ours"


def test_boundaries_of_the_first_level_are_not_compared(tmp_path):
    (said,) = problems(tmp_path, level=1)
    assert said == "has 5 space boundaries, none of the second level"
