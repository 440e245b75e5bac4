"""gbXML files as buildings."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from bim.building_file import read_building_file
from bim.defaults import FACADE_REFLECTANCE
from bim.gbxml import document
from bim.gbxml.building import Constructions, _is_slab, read_gbxml
from bim.gbxml.document import read_document
from bim.shell import open_edges
from mitsuba_cfs.errors import DataError
from tests.bim.bim_fuzz import mutations, refusals
from tests.issues import of_code

MATERIALS = """
<Construction id="wall"><Name>Wall</Name><LayerId layerIdRef="l1"/>
 <Reflectance type="IntVis" unit="Fraction">0.6</Reflectance>
 <Reflectance type="ExtVis" unit="Fraction">0.25</Reflectance>
 <Absorptance type="IntSolar" unit="Fraction">0.35</Absorptance></Construction>
<Layer id="l1"><MaterialId materialIdRef="brick"/><MaterialId materialIdRef="wool"/></Layer>
<Material id="brick"><Name>Brick</Name><Thickness unit="Meters">0.2</Thickness>
 <Conductivity unit="WPerMeterK">0.9</Conductivity><Density unit="KgPerCubicM">1900</Density>
 <SpecificHeat unit="JPerKgK">800</SpecificHeat></Material>
<Material id="wool"><Name>Wool</Name><R-value unit="SquareMeterKPerW">3</R-value></Material>
<WindowType id="unit"><Name>Unit</Name><U-value unit="WPerSquareMeterK">1.1</U-value>
 <SolarHeatGainCoeff unit="Fraction">0.5</SolarHeatGainCoeff>
 <Transmittance type="Visible" unit="Fraction">0.7</Transmittance></WindowType>
"""


def loop(points) -> str:
    def point(corner):
        numbers = "".join(f"<Coordinate>{x}</Coordinate>" for x in corner)
        return f"<CartesianPoint>{numbers}</CartesianPoint>"

    return f"<PlanarGeometry><PolyLoop>{''.join(map(point, points))}</PolyLoop></PlanarGeometry>"


def surface(name, kind, points, spaces, inner="", construction="") -> str:
    refers = f' constructionIdRef="{construction}"' if construction else ""
    beside = "".join(f'<AdjacentSpaceId spaceIdRef="{s}"/>' for s in spaces)
    return f'<Surface id="{name}" surfaceType="{kind}"{refers}>{beside}{loop(points)}{inner}</Surface>'


def two_rooms(azimuth=0.0) -> str:
    """Office 5 x 8 x 3 m and, east of it, hall 4 x 8 x 3 m; a window south, a door between."""

    def box(x0, x1):
        return {
            "south": [(x0, 0, 0), (x1, 0, 0), (x1, 0, 3), (x0, 0, 3)],
            "east": [(x1, 0, 0), (x1, 8, 0), (x1, 8, 3), (x1, 0, 3)],
            "north": [(x1, 8, 0), (x0, 8, 0), (x0, 8, 3), (x1, 8, 3)],
            "west": [(x0, 8, 0), (x0, 0, 0), (x0, 0, 3), (x0, 8, 3)],
            "floor": [(x0, 8, 0), (x1, 8, 0), (x1, 0, 0), (x0, 0, 0)],
            "roof": [(x0, 0, 3), (x1, 0, 3), (x1, 8, 3), (x0, 8, 3)],
        }

    office, hall = box(0, 5), box(5, 9)
    office["north"] = [(5, 8, 0), (0, 8, 0), (0, 8, 3), (5, 8, 3)]
    window = [(1, 0, 0.9), (4, 0, 0.9), (4, 0, 2.4), (1, 0, 2.4)]
    door = [(5, 2, 0), (5, 3, 0), (5, 3, 2), (5, 2, 2)]
    opening = (
        f'<Opening id="window" openingType="FixedWindow" windowTypeIdRef="unit">'
        f"<Name>Window</Name>{loop(window)}</Opening>"
    )
    leaf = f'<Opening id="door" openingType="NonSlidingDoor">{loop(door)}</Opening>'
    types = {"floor": "SlabOnGrade", "roof": "Roof"}
    surfaces = []
    for room, faces in (("Office", office), ("Hall", hall)):
        for side, points in faces.items():
            if (room, side) == ("Hall", "west"):
                continue  # drawn once, by the office
            inner = opening if (room, side) == ("Office", "south") else ""
            spaces, kind = [room], types.get(side, "ExteriorWall")
            if (room, side) == ("Office", "east"):
                spaces, kind, inner = ["Office", "Hall"], "InteriorWall", leaf
            surfaces.append(surface(f"{room}-{side}", kind, points, spaces, inner, "wall"))
    shade = surface("Overhang", "Shade", [(1, 0, 2.5), (4, 0, 2.5), (4, -1, 2.5), (1, -1, 2.5)], [])
    space = '<Space id="{0}" buildingStoreyIdRef="g"><Name>{0}</Name><Area>{1}</Area></Space>'
    return (
        '<?xml version="1.0" encoding="UTF-8"?><gbXML xmlns="http://www.gbxml.org/schema" '
        'lengthUnit="Meters" areaUnit="SquareMeters" volumeUnit="CubicMeters" version="6.01">'
        f'<Campus id="c"><Name>Two rooms</Name><Location><Latitude>50</Latitude>'
        f"<Longitude>8.5</Longitude><CADModelAzimuth>{azimuth}</CADModelAzimuth></Location>"
        f'<Building id="b"><BuildingStorey id="g"><Name>Ground</Name></BuildingStorey>'
        f"{space.format('Office', 40)}{space.format('Hall', 30)}</Building>"
        f"{''.join(surfaces)}{shade}</Campus>{MATERIALS}</gbXML>"
    )


def written(folder: Path, text: str) -> Path:
    path = folder / "two.gbxml"
    path.write_text(text)
    return path


@pytest.fixture
def building(tmp_path):
    return read_gbxml(written(tmp_path, two_rooms()))


def test_rooms_have_their_areas_and_volumes(building):
    office, hall = building.spaces
    assert (office.floor_area, hall.floor_area) == pytest.approx((40, 32), rel=1e-9)
    assert (office.volume, hall.volume) == pytest.approx((120, 96), rel=1e-9)
    assert not open_edges(office.shell) and not open_edges(hall.shell)
    assert (office.storey, building.latitude_deg, building.longitude_deg) == ("Ground", 50, 8.5)


def test_what_a_space_states_otherwise_is_said(building):
    (said,) = of_code(building, "floor-area-differs")
    assert said.values == {"room": "Hall", "stated": 30.0, "drawn": pytest.approx(32.0)}


def test_the_window_looks_out_and_states_its_type(building):
    (window,) = building.windows
    assert window.area == pytest.approx(4.5)
    np.testing.assert_allclose(window.normal, [0, -1, 0], atol=1e-12)
    assert (window.u_value, window.g_value, window.visible_transmittance) == (1.1, 0.5, 0.7)


def test_a_wall_between_rooms_is_seen_from_both(building):
    office, hall = building.spaces
    here = next(f for f in office.faces if f.neighbour == "Hall" and f.kind == "wall")
    there = next(f for f in hall.faces if f.neighbour == "Office" and f.kind == "wall")
    np.testing.assert_allclose(here.normal, -there.normal)
    assert here.area == there.area == pytest.approx(24 - 2)
    assert [layer.name for layer in here.construction.layers] == ["Brick", "Wool"]
    assert [layer.name for layer in there.construction.layers] == ["Wool", "Brick"]
    assert (here.reflectance_visible, there.reflectance_visible) == (0.6, 0.25)
    assert here.reflectance_solar == pytest.approx(0.65)
    assert sum(f.kind == "door" for space in building.spaces for f in space.faces) == 2


def test_level_surfaces_that_are_named_walls_are_floors_and_ceilings(tmp_path):
    """OpenStudio writes adiabatic floors and ceilings as walls."""
    text = two_rooms().replace('"SlabOnGrade"', '"InteriorWall"').replace('"Roof"', '"InteriorWall"')
    found = read_gbxml(written(tmp_path, text))
    assert [s.floor_area for s in found.spaces] == pytest.approx([40, 32])
    kinds = {f.name: (f.kind, f.adjacency) for f in found.spaces[0].faces}
    assert kinds["Office-roof"] == ("ceiling", "adiabatic")
    assert kinds["Office-floor"] == ("floor", "adiabatic")
    assert kinds["Office-south"] == ("wall", "outside")
    (said,) = of_code(found, "walls-level")
    assert said.values == {"count": 4, "type": "InteriorWall"}


def test_a_space_without_surfaces_or_area_is_no_room(tmp_path):
    """OpenStudio writes groups of shades as spaces; one that states an area is a lost room."""
    empty = '<Space id="Shades"><Name>Shades</Name></Space><Space id="Room"><Area>9</Area></Space>'
    text = two_rooms().replace("<BuildingStorey", empty + "<BuildingStorey", 1)
    found = read_gbxml(written(tmp_path, text))
    lost = [p.where for p in found.issues if p.effect.lost == "room"]
    assert (len(found.spaces), lost) == (2, ["Room"])
    assert [i.where for i in of_code(found, "space-without-surfaces")] == ["Shades"]


@pytest.mark.parametrize(("unit", "metres"), [("Meters", 0.2), ("Feet", 0.2 * 0.3048)])
def test_a_thickness_without_unit_has_that_of_the_file(tmp_path, unit, metres):
    """gbXML's schema: lengthUnit is the unit wherever a length states none."""
    text = two_rooms().replace('<Thickness unit="Meters">', "<Thickness>")
    found = read_gbxml(written(tmp_path, text.replace('lengthUnit="Meters"', f'lengthUnit="{unit}"')))
    south = next(f for f in found.spaces[0].faces if f.name == "Office-south")
    assert south.construction.layers[0].thickness == pytest.approx(metres)


def test_a_window_type_of_noughts_states_nothing(tmp_path):
    """Some writers fill a template with 0: a glass of these values would be black."""
    text = two_rooms()
    for value in ('">1.1</U-value', '">0.5</Solar', '">0.7</Trans'):
        text = text.replace(value, '">0<' + value.split("<")[1])
    found = read_gbxml(written(tmp_path, text))
    (window,) = found.windows
    assert (window.u_value, window.g_value, window.visible_transmittance) == (None, None, None)
    assert [i.values["type"] for i in of_code(found, "window-type-of-zeros")] == ["Unit"]


def test_a_material_without_resistance_is_left_out(tmp_path):
    text = two_rooms().replace(">3</R-value>", ">0</R-value>")
    found = read_gbxml(written(tmp_path, text))
    south = next(f for f in found.spaces[0].faces if f.name == "Office-south")
    assert [layer.name for layer in south.construction.layers] == ["Brick"]
    assert [i.values["material"] for i in of_code(found, "resistance-missing")] == ["Wool"]


def test_north_is_turned(tmp_path):
    """The model's y axis points east, so that what is drawn south looks west."""
    (window,) = read_gbxml(written(tmp_path, two_rooms(azimuth=90))).windows
    np.testing.assert_allclose(window.normal, [-1, 0, 0], atol=1e-12)


def test_turning_north_keeps_lengths_and_heights(tmp_path):
    straight, turned = (read_gbxml(written(tmp_path, two_rooms(azimuth=azimuth))).spaces[0] for azimuth in (0, 30))
    assert turned.volume == pytest.approx(straight.volume)
    for before, after in zip(straight.faces, turned.faces, strict=True):
        assert after.area == pytest.approx(before.area)
        assert after.normal[2] == pytest.approx(before.normal[2], abs=1e-12)
        x, y = before.normal[:2]  # turned clockwise, as the azimuth is from north
        c, s = np.cos(np.radians(30)), np.sin(np.radians(30))
        np.testing.assert_allclose(after.normal[:2], [c * x + s * y, c * y - s * x], atol=1e-12)


def test_feet_are_metres(tmp_path):
    text = two_rooms().replace('lengthUnit="Meters"', 'lengthUnit="Feet"')
    assert read_gbxml(written(tmp_path, text)).spaces[0].volume == pytest.approx(120 * 0.3048**3)


def test_air_between_rooms_is_joined(tmp_path):
    text = two_rooms().replace("InteriorWall", "Air")
    (one,) = read_gbxml(written(tmp_path, text), join=["Office + Hall"]).spaces
    assert (one.floor_area, one.volume) == pytest.approx((72, 216))
    # a box of 9 x 8 x 3 m less the window: nothing is left of what was between
    assert sum(face.area for face in one.faces) == pytest.approx(2 * 72 + 2 * 3 * 17 - 4.5)
    assert not open_edges(one.shell)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "<Coordinate>0.9</Coordinate>",
            "<Coordinate>low</Coordinate>",
            "Opening window: Coordinate: expected a number, got 'low'",
        ),
        ('spaceIdRef="Hall"', 'spaceIdRef="Attic"', ": AdjacentSpaceId: no Space 'Attic'"),
        ('lengthUnit="Meters"', 'lengthUnit="Ells"', "gbXML: lengthUnit: 'Ells'"),
        ("gbXML", "cityXML", "expected gbXML, got cityXML"),
        ("</Campus>", "", "is no XML: mismatched tag"),
        ("<gbXML", '<!DOCTYPE x [<!ENTITY a "b">]><gbXML', "declares entities"),
        ("<gbXML", '<!DOCTYPE x [<!ENTITY a SYSTEM "/etc/passwd">]><gbXML', "declares entities"),
    ],
)
def test_faults_are_one_line_with_element_and_field(tmp_path, old, new, said):
    path = written(tmp_path, two_rooms().replace(old, new))
    with pytest.raises(DataError) as caught:
        read_gbxml(path)
    assert str(caught.value).startswith(str(path)) and said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "where", "reason"),
    [
        ('unit="WPerMeterK"', 'unit="x"', "Material brick", "unit 'x'"),
        (">1900</Density>", ">1e-320</Density>", "Material brick", "density: expected a number of"),
        (">0.9</Conductivity>", ">1e-320</Conductivity>", "Material brick", "conductivity: "),
        ('SquareMeterKPerW">3<', 'SquareMeterKPerW">1e-320<', "Material wool", "thickness: "),
        ('materialIdRef="wool"', 'materialIdRef="straw"', "Layer l1", "no Material 'straw'"),
        ('areaUnit="SquareMeters"', 'areaUnit="Acres"', "gbXML", "'Acres'"),
        ("<Latitude>50", "<Latitude>north", "Latitude", "expected a number"),
        ('unit="WPerSquareMeterK">1.1', 'unit="y">1.1', "WindowType unit", "unit 'y'"),
        ('type="IntVis" unit="Fraction">0.6', 'type="IntVis" unit="Fraction">six', "Reflectance", "got 'six'"),
    ],
)
def test_a_value_that_cannot_be_read_is_an_issue_and_refuses_no_file(tmp_path, old, new, where, reason):
    text = two_rooms()
    assert old in text
    building = read_gbxml(written(tmp_path, text.replace(old, new)))
    (issue,) = [one for one in building.issues if one.code == "value-not-read"]
    assert issue.where == where and reason in issue.values["reason"]
    assert len(building.spaces) == 2


def test_glass_with_one_room_on_both_sides_is_an_issue(tmp_path):
    """The surface of the window is made inner, and names its own room twice."""
    text = two_rooms()
    start = text.rindex("<Surface ", 0, text.index('<Opening id="window"'))
    end = text.index("</Surface>", start)
    surface = text[start:end].replace("ExteriorWall", "InteriorWall")
    (room,) = re.findall(r'<AdjacentSpaceId spaceIdRef="[^"]*"\s*/>', surface)
    path = written(tmp_path, text[:start] + surface.replace(room, 2 * room) + text[end:])
    (issue,) = [one for one in read_gbxml(path).issues if one.code == "glass-within-room"]
    assert (issue.where, issue.effect.lost) == ("window", "window")
    assert issue.effect.glass == pytest.approx(4.5)


def test_the_suffix_leads_to_it(tmp_path):
    assert len(read_building_file(written(tmp_path, two_rooms())).spaces) == 2


def test_random_bytes_give_one_line(tmp_path):
    path = tmp_path / "spoilt.gbxml"
    refused = refusals(path, mutations(two_rooms().encode(), 60), read_gbxml)
    assert refused > 20


NIST = {  # to SI; NIST SP 811, appendix B
    "Yards": 0.9144,
    "Feet": 0.3048,
    "Inches": 0.0254,
    "Miles": 1609.344,
    "Kilometers": 1000.0,
    "Centimeters": 0.01,
    "Millimeters": 0.001,
    "SquareYards": 0.8361274,
    "SquareFeet": 0.09290304,
    "SquareInches": 6.4516e-4,
    "SquareMiles": 2.589988e6,
    "SquareKilometers": 1e6,
    "SquareCentimeters": 1e-4,
    "SquareMillimeters": 1e-6,
    "CubicYards": 0.7645549,
    "CubicFeet": 0.02831685,
    "CubicInches": 1.638706e-5,
    "CubicMiles": 4.168182e9,
    "CubicKilometers": 1e9,
    "CubicCentimeters": 1e-6,
    "CubicMillimeters": 1e-9,
    "WattPerSquareFoot": 10.76391,
    "CFMPerSquareFoot": 5.08e-3,
    "LPerSecPerSquareM": 1e-3,
    "CubicMPerHourPerSquareM": 2.777778e-4,
    "LPerSec": 1e-3,
    "CFM": 4.719474e-4,
    "CubicMPerHr": 2.777778e-4,
    "LPerSecPerPerson": 1e-3,
    "CFMPerPerson": 4.719474e-4,
    "BtuPerHourSquareFtF": 5.678263,
    "HrSquareFtFPerBTU": 0.1761102,
    "BtuPerHourFtF": 1.730735,
    "WPerCmC": 100.0,
    "LbsPerCubicFt": 16.01846,
    "LbsPerCubicIn": 27679.90,
    "GramsPerCubicCm": 1000.0,
    "BTUPerLbF": 4186.8,
    "BtuPerHourPerson": 0.2930711,
}


def test_every_unit_has_the_factor_of_the_tables():
    tables = [document.METRES, document.SQUARE_METRES, document.CUBIC_METRES, *document.SI.values()]
    for table in tables:
        for unit, factor in table.items():
            assert factor == pytest.approx(NIST.get(unit, 1.0), rel=1e-6), unit
    assert NIST.keys() <= {unit for table in tables for unit in table}


def changed(folder: Path, *pairs: tuple[str, str], azimuth: float = 0.0):
    """The two rooms with texts replaced, each of which occurs."""
    text = two_rooms(azimuth)
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    return read_gbxml(written(folder, text))


CONSTRUCTION = '<LayerId layerIdRef="l1"/>'


@pytest.mark.parametrize(
    ("stated", "visible", "solar", "outer", "emissivity"),
    [
        ('<Reflectance type="IntSolar">0.4</Reflectance>', None, 0.4, None, None),
        ('<Absorptance type="IntSolar">0.3</Absorptance>', None, 0.7, None, None),
        (
            '<Reflectance type="IntSolar">0.4</Reflectance><Absorptance type="IntSolar">0.3</Absorptance>',
            None,
            0.4,
            None,
            None,
        ),
        ('<Reflectance type="IntVisible" unit="Percent">45</Reflectance>', 0.45, None, None, None),
        ('<Reflectance type="IntVis">1</Reflectance>', 1.0, None, None, None),
        (
            '<Reflectance type="ExtVisible">0.2</Reflectance><Emittance type="IntIR">0.5</Emittance>',
            None,
            None,
            0.2,
            0.5,
        ),
        (
            '<Reflectance type="IntVisible" incidentAngle="60">0.9</Reflectance>'
            '<Reflectance type="IntVisible" incidentAngle="0.0">0.3</Reflectance>',
            0.3,
            None,
            None,
            None,
        ),
    ],
)
def test_the_finish_of_a_construction_is_what_it_states(tmp_path, stated, visible, solar, outer, emissivity):
    start, end = MATERIALS.index(" <Reflectance"), MATERIALS.index("</Construction>")
    text = two_rooms().replace(MATERIALS[start:end], stated)
    finish = Constructions(read_document(written(tmp_path, text))).finish("wall")
    assert finish.visible == (None if visible is None else pytest.approx(visible))
    assert finish.solar == (None if solar is None else pytest.approx(solar))
    assert finish.outer == outer
    assert emissivity is None or finish.emissivity == emissivity


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ('<Reflectance type="IntVisible">1.01</Reflectance>', "expected 0 to 1, got 1.01"),
        ('<Reflectance type="IntVisible" unit="Percent">101</Reflectance>', "101"),
        ('<Reflectance type="IntVisible" unit="Lux">0.1</Reflectance>', "unit 'Lux', expected"),
    ],
)
def test_a_share_that_cannot_be_is_an_issue(tmp_path, stated, words):
    found = changed(tmp_path, (CONSTRUCTION, CONSTRUCTION + stated))
    assert [one for one in found.issues if words in str(one)]


def test_a_construction_that_is_not_there_is_one_issue(tmp_path):
    """Every wall refers to it; the file's elevation is in its own unit, its name may be missing."""
    found = changed(
        tmp_path,
        ('constructionIdRef="wall"', 'constructionIdRef="none"'),
        ("<Longitude>", "<Elevation>100</Elevation><Longitude>"),
        ("<Name>Two rooms</Name>", ""),
        ('lengthUnit="Meters"', 'lengthUnit="Feet"'),
    )
    missing = [one for one in found.issues if "no Construction 'none'" in str(one)]
    assert len(missing) == 1
    assert found.elevation == pytest.approx(30.48) and found.name == "c"
    assert changed(tmp_path).elevation == 0.0


def test_openings_without_a_polygon_or_of_air(tmp_path):
    """Named, and no window; glass that the same room has on both sides is named with its area."""
    window = loop([(1, 0, 0.9), (4, 0, 0.9), (4, 0, 2.4), (1, 0, 2.4)])
    empty = changed(tmp_path, (window, ""))
    assert "opening-without-polygon" in {one.code for one in empty.issues}
    air = changed(tmp_path, ('openingType="FixedWindow"', 'openingType="Air"'))
    assert "opening-of-air" in {one.code for one in air.issues}
    assert not air.spaces[0].windows and not empty.spaces[0].windows
    within = ('<AdjacentSpaceId spaceIdRef="Hall"/>', '<AdjacentSpaceId spaceIdRef="Office"/>')
    glass = ('openingType="NonSlidingDoor"', 'openingType="OperableWindow"')
    both = changed(tmp_path, within, glass)
    (issue,) = [one for one in both.issues if one.code == "glass-within-room"]
    assert issue.effect.glass == pytest.approx(2.0)
    assert "glass-within-room" not in {one.code for one in changed(tmp_path, within).issues}
    odd = changed(tmp_path, ('openingType="FixedWindow"', f'openingType="{"W" * 50}"'))
    assert [one for one in odd.issues if f"'{'W' * 40}', expected of" in str(one)]


def test_surfaces_that_transmit_light_are_named(tmp_path):
    """A wall whose construction has a transmittance; a window in a shade."""
    glass = '<Construction id="glass"><Transmittance type="Visible">0.6</Transmittance></Construction>'
    ring = loop([(2, 0, 2.5), (3, 0, 2.5), (3, -1, 2.5)])
    pane = f'<Opening id="pane" openingType="FixedWindow">{ring}</Opening>'
    shade = '<Surface id="Overhang" surfaceType="Shade">'
    found = changed(
        tmp_path,
        ("</gbXML>", f"{glass}</gbXML>"),
        (shade, shade + pane),
        (
            'id="Office-north" surfaceType="ExteriorWall" constructionIdRef="wall"',
            'id="Office-north" surfaceType="ExteriorWall" constructionIdRef="glass"',
        ),
    )
    said = [(one.where, one.values["material"]) for one in of_code(found, "shade-taken-as-opaque")]
    assert said == [("Office-north", "glass"), ("Overhang", "pane")]


def test_two_spaces_of_one_id_are_refused(tmp_path):
    with pytest.raises(DataError, match="Space Office: id: is the id of another space too"):
        changed(tmp_path, ('<Space id="Hall"', '<Space id="Office"'))


def test_a_door_whose_construction_transmits_light_is_glass(tmp_path):
    """Without a window type; a door of another construction is opaque."""
    glass = (
        '<Construction id="glass"><U-value unit="WPerSquareMeterK">1.4</U-value>'
        '<Transmittance type="Visible">0.6</Transmittance></Construction></gbXML>'
    )
    door = 'openingType="NonSlidingDoor" constructionIdRef="{}"'
    window = 'openingType="FixedWindow" windowTypeIdRef="unit"'
    found = changed(tmp_path, ("</gbXML>", glass), (window, door.format("glass")))
    (pane,) = found.windows
    assert (pane.u_value, pane.visible_transmittance) == (1.4, 0.6)
    assert not changed(tmp_path, (window, door.format("wall"))).windows


def test_a_level_polygon_is_a_slab_wherever_it_lies():
    """A floor of 4 x 5 m, a strip of 5 x 0.05 m and a wall, near the origin and 100 km off."""
    floor = np.array([[0.0, 0, 0], [4, 0, 0], [4, 5, 0], [0, 5, 0]])
    strip, wall = floor * [0.0125, 1, 1], floor[:, [0, 2, 1]]
    for place in ([0.0, 0, 0], [1e5, -1e5, 300]):
        assert [_is_slab(ring + place) for ring in (floor, strip, wall)] == [True, False, False]


def test_a_material_of_a_resistance_and_a_thickness_has_both(tmp_path):
    """Without a conductivity it is the thickness by the resistance."""
    old = '<Conductivity unit="WPerMeterK">0.9</Conductivity>'
    path = written(tmp_path, two_rooms().replace(old, '<R-value unit="SquareMeterKPerW">2.5</R-value>'))
    south = next(f for f in read_gbxml(path).spaces[0].faces if f.name == "Office-south")
    brick, wool = south.construction.layers
    assert (brick.thickness, brick.resistance, wool.resistance) == pytest.approx((0.2, 2.5, 3.0))


def test_the_volume_that_a_space_states_is_kept(tmp_path):
    building = changed(tmp_path, ("<Area>40</Area>", "<Area>40</Area><Volume>125</Volume>"))
    assert [space.stated_volume for space in building.spaces] == [125.0, None]


def test_a_shade_has_the_outer_reflectance_of_its_construction(tmp_path, building):
    """Else that of facades."""
    finished = changed(tmp_path, ('surfaceType="Shade"', 'surfaceType="Shade" constructionIdRef="wall"'))
    values = [
        one.reflectance_visible
        for model in (building, finished)
        for one in model.elements
        if one.ifc_class == "IfcShadingDevice"
    ]
    assert values == [FACADE_REFLECTANCE, 0.25]


@pytest.mark.parametrize(
    ("opening", "doors"),
    [
        ('openingType="NonSlidingDoor" windowTypeIdRef="missing"', 2),
        ('openingType="NonSlidingDoor" windowTypeIdRef="unit"', 0),
        ('openingType="Hatch"', 2),
        ('openingType="Hatch" windowTypeIdRef="missing"', 0),
    ],
)
def test_a_door_is_glass_only_by_a_type_of_window_that_there_is(tmp_path, opening, doors):
    """An opening of an unknown type is glass if it names any."""
    building = changed(tmp_path, ('openingType="NonSlidingDoor"', opening))
    assert sum(face.kind == "door" for space in building.spaces for face in space.faces) == doors


def test_an_area_of_nought_states_nothing(tmp_path):
    building = changed(tmp_path, ("<Area>40</Area>", "<Area>0</Area>"))
    assert building.spaces[0].stated_area is None and not of_code(building, "value-not-read")
