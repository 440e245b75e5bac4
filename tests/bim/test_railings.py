"""Railings and handrails: they shade, and are no part of what a room borders on."""

from bim.ifc.building import read_ifc
from tests.bim.small_ifc import box_model


def test_a_rail_along_a_wall_is_neither_its_face_nor_its_layer(tmp_path) -> None:
    """A handrail let into the east wall, and a guardrail on the wall's outer side."""
    small, _ = box_model()
    small.box("IfcRailing", "handrail", (3.95, 1.0, 0.9), (0.1, 4.0, 0.3))
    small.box("IfcRailing", "guardrail", (4.3, 1.0, 0.5), (0.1, 4.0, 1.5))
    small.model.write(str(tmp_path / "rails.ifc"))
    building = read_ifc(tmp_path / "rails.ifc")
    (space,) = building.spaces
    assert not [face for face in space.faces if "rail" in face.name + face.construction.name]
    walls = [face for face in space.faces if face.kind == "wall"]
    assert {len(face.construction.layers) for face in walls} == {1}
    assert any(one.name == "guardrail" for one in building.elements)
