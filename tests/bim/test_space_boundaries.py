"""Second-level boundaries of a file beside our own: what agrees, and each difference named."""

from __future__ import annotations

import ifcopenshell
import pytest

from bim.ifc.building import read_ifc
from bim.report.issue import Issue
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
        "IfcRelSpaceBoundary",
        GlobalId=ifcopenshell.guid.new(),
        Name="2ndLevel" if level == 2 else "1stLevel",
        RelatingSpace=space,
        RelatedBuildingElement=element,
        ConnectionGeometry=create("IfcConnectionSurfaceGeometry", surface),
        PhysicalOrVirtualBoundary="PHYSICAL",
        InternalOrExternalBoundary=beyond,
    )


def issues(tmp_path, changed=None, schema="IFC4", **how) -> list[Issue]:
    """What is said of the box room's boundaries, some of them changed."""
    small, _ = box_model(schema)
    model = small.model
    (space,) = model.by_type("IfcSpace")
    elements = {one.Name: one for one in model.by_type("IfcBuildingElement")}
    for name, (width, height, hole, beyond) in (SOUND | (changed or {})).items():
        boundary(model, space, elements[name], width, height, hole=hole, beyond=beyond, **how)
    path = tmp_path / "model.ifc"
    model.write(str(path))
    return [i for i in read_ifc(path).issues if i.code.startswith("boundar")]


@pytest.mark.parametrize("curve", ["IfcPolyline", "IfcCompositeCurve"])
@pytest.mark.parametrize("schema", ["IFC2X3", "IFC4"])
@pytest.mark.parametrize("hole", [False, True])
def test_boundaries_that_agree_are_counted(tmp_path, curve, schema, hole):
    south = {"south": (WIDTH, HEIGHT, hole, "EXTERNAL")}
    (said,) = issues(tmp_path, south, schema, curve=curve)
    assert said.code == "boundaries-compared"
    assert said.values == {"count": 5, "pairs": 5, "agreeing": 5, "percent": 5, "unread": 0}


def test_each_difference_is_named(tmp_path):
    changed = {"north": (WIDTH, 0.8 * HEIGHT, False, "EXTERNAL"), "west": (DEPTH, HEIGHT, False, "INTERNAL")}
    head, *rest = issues(tmp_path, changed)
    assert head.values["agreeing"] == 3
    north, west = sorted(rest, key=lambda issue: issue.code)
    area = WIDTH * HEIGHT
    assert [i.code for i in (north, west)] == ["boundary-area-differs", "boundary-neighbour-differs"]
    assert (north.values["element"], north.values["room"]) == ("IfcWall north", "R1 Room")
    areas = [north.values[name] for name in ("stated", "net", "gross")]
    assert areas == pytest.approx([0.8 * area, area, area])
    assert (west.values["element"], west.values["room"]) == ("IfcWall west", "R1 Room")
    assert (west.values["stated"], west.values["computed"]) == ("internal", "outside")


def test_boundaries_of_the_first_level_are_not_compared(tmp_path):
    (said,) = issues(tmp_path, level=1)
    assert (said.code, said.values["count"]) == ("boundaries-first-level", 5)
