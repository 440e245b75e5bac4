"""Colours of surfaces: from an IFC's styles to Radiance's materials, grey kept as it was."""

from __future__ import annotations

import numpy as np
import pytest

from bim.colours import GREY, TO_RADIANCE, hue_of, linear_of_display, luminance, radiance_colour
from bim.ifc.building import read_ifc
from bim.to_radiance import LUMINANCE, write_radiance
from tests.bim.small_ifc import box_room

BRICK = (0.5, 0.2, 0.1)  # linear red, green, blue


def test_the_matrix_is_that_of_the_two_spaces():
    """colour-science's: sRGB under D65 to Radiance's primaries and white, Bradford."""
    import colour

    primaries = np.array([[0.640, 0.330], [0.290, 0.600], [0.150, 0.060]])
    white = np.array([1 / 3, 1 / 3])
    to_xyz = colour.normalised_primary_matrix(primaries, white)
    assert to_xyz[1] == pytest.approx(LUMINANCE, abs=3e-4)  # which Radiance rounds
    radiance = colour.RGB_Colourspace("Radiance", primaries, white, "E", to_xyz, np.linalg.inv(to_xyz))
    found = colour.matrix_RGB_to_RGB(colour.RGB_COLOURSPACES["sRGB"], radiance, "Bradford")
    # the white of sRGB has four digits, so that grey is grey to 1.4e-4 only
    assert pytest.approx(found, abs=3e-4) == TO_RADIANCE
    assert TO_RADIANCE.sum(axis=1) == pytest.approx(np.ones(3), abs=2e-7)


@pytest.mark.parametrize("reflectance", [0.0, 0.05, 0.25, 0.7, 0.99])
@pytest.mark.parametrize("linear", [(1, 1, 1), BRICK, (1, 0, 0), (0, 0, 1), (0.1, 0.8, 0.2)])
def test_a_colour_reflects_as_much_as_the_grey(reflectance, linear):
    found = radiance_colour(reflectance, hue_of(linear), LUMINANCE)
    assert found @ LUMINANCE / sum(LUMINANCE) == pytest.approx(reflectance, abs=1e-9)
    assert found.min() >= 0 and found.max() <= 1 + 1e-9
    if linear == (1, 1, 1):
        assert found == pytest.approx(reflectance * np.ones(3), abs=1e-6)
    elif linear == BRICK and 0 < reflectance < 0.3:  # not so strong that it gets paler
        assert found[0] / found[1] == pytest.approx(2.307, abs=1e-3)  # of sRGB's red and green 2.5


def test_black_has_no_hue():
    assert all(hue_of(linear_of_display((v / 255,) * 3)) == GREY for v in range(256))
    assert luminance(hue_of(BRICK)) == pytest.approx(1.0)


def test_radiance_gets_the_colours_of_the_ifc(tmp_path):
    """A wall's DiffuseColour, a reflectance by the schema, as linear red, green and blue."""
    made = box_room()
    style = next(s for s in made.by_type("IfcSurfaceStyle") if s.Name == "wall")
    for channel, value in zip(("Red", "Green", "Blue"), BRICK, strict=True):
        setattr(style.Styles[0].DiffuseColour, channel, value)
    made.write(str(tmp_path / "room.ifc"))
    building = read_ifc(tmp_path / "room.ifc")
    space = building.spaces[0]
    wall = next(face for face in space.faces if face.kind == "wall")
    assert wall.reflectance_visible == pytest.approx(luminance(BRICK))
    assert wall.reflectance_visible * np.array(wall.hue) == pytest.approx(BRICK)
    assert next(face for face in space.faces if face.kind == "floor").hue == GREY
    files = write_radiance(space, building, tmp_path / "rad")
    coloured, grey = materials(files.materials), materials(files.grey)
    assert coloured.keys() == grey.keys()
    name = next(name for name in coloured if "colour" in name)
    assert f"{name} polygon wall" in files.room.read_text()
    assert coloured[name][:3] @ LUMINANCE == pytest.approx(grey[name][0], rel=1e-5)
    assert coloured[name][0] > 2 * coloured[name][1] > 2 * coloured[name][2]
    assert np.ptp(grey[name][:3]) == 0
    solar = write_radiance(space, building, tmp_path / "solar", band="solar")
    assert solar.materials.read_text() == solar.grey.read_text()


def materials(path) -> dict[str, np.ndarray]:
    """The numbers of each material of a file."""
    parts = path.read_text().split("void ")[1:]
    return {one.split()[1]: np.array(one.split()[5:], dtype=float) for one in parts}
