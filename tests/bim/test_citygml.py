"""CityGML as surroundings: two houses as CityJSON has them, links, systems and faults."""

from __future__ import annotations

import gc
import json
from dataclasses import replace

import numpy as np
import pytest

from bim import xml_elements
from bim.model import Georeference, crs_name
from bim.shell import enclosed_volume
from bim.shoebox import shoebox
from bim.surroundings import city_models
from bim.surroundings.placement import read_surroundings, with_surroundings
from mitsuba_cfs.errors import DataError
from tests.bim.bim_fuzz import mutations, refusals

GERMAN = "urn:adv:crs:ETRS89_UTM32*DE_DHHN2016_NH"
CORNER = np.array([456000.0, 5430000.0, 110.0])
# a gable house of 6 x 8 m, eaves at 5 m and the ridge at 8 m: its polygons by name
GABLE = {
    "floor": [[(0, 0, 0), (0, 8, 0), (6, 8, 0), (6, 0, 0)]],
    "south": [[(0, 0, 0), (6, 0, 0), (6, 0, 5), (3, 0, 8), (0, 0, 5)]],
    "north": [[(6, 8, 0), (0, 8, 0), (0, 8, 5), (3, 8, 8), (6, 8, 5)]],
    "west": [[(0, 8, 0), (0, 0, 0), (0, 0, 5), (0, 8, 5)]],
    "east": [[(6, 0, 0), (6, 8, 0), (6, 8, 5), (6, 0, 5)]],
    "west-roof": [[(0, 8, 5), (0, 0, 5), (3, 0, 8), (3, 8, 8)]],
    "east-roof": [[(6, 0, 5), (6, 8, 5), (3, 8, 8), (3, 0, 8)]],
}


def walls(x0, y0, x1, y1, top, inwards=False):
    """The four walls of a box, seen from outside or from its court."""
    plan = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    plan = plan[::-1] if inwards else plan
    pairs = zip(plan, plan[1:] + plan[:1], strict=True)
    return [[[(*a, 0), (*b, 0), (*b, top), (*a, top)]] for a, b in pairs]


def ring(x0, y0, x1, y1, z):
    return [(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]


# a block of 10 x 10 x 6 m with a court of 4 x 4 m through it
COURT = [
    [ring(20, 0, 30, 10, 6), ring(23, 3, 27, 7, 6)[::-1]],
    [ring(20, 0, 30, 10, 0)[::-1], ring(23, 3, 27, 7, 0)],
    *walls(20, 0, 30, 10, 6),
    *walls(23, 3, 27, 7, 6, inwards=True),
]
COARSE = [[ring(0, 0, 6, 8, 0)[::-1]], [ring(0, 0, 6, 8, 6.5)], *walls(0, 0, 6, 8, 6.5)]


def linear(side, points, by_pos):
    points = [CORNER + p for p in [*points, points[0]]]
    texts = [" ".join(f"{value:.3f}" for value in p) for p in points]
    inner = "".join(f"<gml:pos>{t}</gml:pos>" for t in texts)
    if not by_pos:
        inner = f'<gml:posList srsDimension="3">{" ".join(texts)}</gml:posList>'
    return f"<gml:{side}><gml:LinearRing>{inner}</gml:LinearRing></gml:{side}>"


def polygon(rings, name="", by_pos=False):
    named = f' gml:id="{name}"' if name else ""
    sides = ["exterior", *["interior"] * (len(rings) - 1)]
    inner = "".join(linear(*pair, by_pos) for pair in zip(sides, rings, strict=True))
    return f"<gml:Polygon{named}>{inner}</gml:Polygon>"


def solid(level, members):
    inner = "".join(members)
    return (
        f"<bldg:lod{level}Solid><gml:Solid><gml:exterior><gml:CompositeSurface>{inner}"
        f"</gml:CompositeSurface></gml:exterior></gml:Solid></bldg:lod{level}Solid>"
    )


def member(rings, by_pos=False):
    return f"<gml:surfaceMember>{polygon(rings, by_pos=by_pos)}</gml:surfaceMember>"


def boundary(name):
    inner = f"<gml:surfaceMember>{polygon(GABLE[name], name)}</gml:surfaceMember>"
    return (
        "<bldg:boundedBy><bldg:WallSurface><bldg:lod2MultiSurface><gml:MultiSurface>"
        f"{inner}</gml:MultiSurface></bldg:lod2MultiSurface></bldg:WallSurface></bldg:boundedBy>"
    )


LINKS = [f'<gml:surfaceMember xlink:href="#{name}"/>' for name in GABLE]
BOUNDARIES = "".join(map(boundary, GABLE))
TERRAIN_CURVE = """<bldg:lod2TerrainIntersection><gml:MultiCurve><gml:curveMember><gml:LineString>
<gml:posList srsDimension="3">0 0 0 9 9 9</gml:posList></gml:LineString></gml:curveMember>
</gml:MultiCurve></bldg:lod2TerrainIntersection>"""
ADDRESS = """<bldg:address><core:Address gml:id="place"><core:multiPoint><gml:MultiPoint><gml:Point
srsName="EPSG:4326"><gml:pos>8 50 0</gml:pos></gml:Point></gml:MultiPoint></core:multiPoint>
</core:Address></bldg:address>"""


def gable(body):
    return (
        '<core:cityObjectMember><bldg:Building gml:id="gable"><gml:name>Nr. 1</gml:name>'
        f"{body}</bldg:Building></core:cityObjectMember>"
    )


WHOLE = gable(solid(1, [member(one) for one in COARSE]) + solid(2, LINKS) + TERRAIN_CURVE + BOUNDARIES + ADDRESS)
PART = (
    '<core:cityObjectMember><bldg:Building gml:id="block"><bldg:consistsOfBuildingPart>'
    f'<bldg:BuildingPart gml:id="court">{solid(1, [member(one, True) for one in COURT])}'
    "</bldg:BuildingPart></bldg:consistsOfBuildingPart></bldg:Building></core:cityObjectMember>"
)
RELIEF = (
    '<core:cityObjectMember><dem:ReliefFeature gml:id="r"><dem:lod>1</dem:lod>'
    '<dem:reliefComponent><dem:TINRelief gml:id="ground"><dem:lod>1</dem:lod><dem:tin>'
    "<gml:TriangulatedSurface><gml:trianglePatches>"
    + polygon([[(0, 40, 0), (9, 40, 0), (9, 49, 1)]]).replace("Polygon", "Triangle")
    + "</gml:trianglePatches></gml:TriangulatedSurface></dem:tin></dem:TINRelief>"
    "</dem:reliefComponent></dem:ReliefFeature></core:cityObjectMember>"
)
DETAILED = gable(solid(3, [member(GABLE["floor"])])).replace('"gable"', '"detailed"')


def model(*members, system=GERMAN, version="2.0", gml="http://www.opengis.net/gml"):
    envelope = f'<gml:boundedBy><gml:Envelope srsName="{system}"/></gml:boundedBy>'
    names = "".join(
        f' xmlns:{short}="http://www.opengis.net/citygml/{long}{version}"'
        for short, long in (("core", ""), ("bldg", "building/"), ("dem", "relief/"))
    )
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<core:CityModel{names} xmlns:gml="{gml}"'
        ' xmlns:xlink="http://www.w3.org/1999/xlink">\n'
        f"{envelope if system else ''}\n" + "\n".join(members) + "\n</core:CityModel>\n"
    )


def written(folder, content, name="quarter.gml"):
    path = folder / name
    path.write_text(content)
    return path


def as_city_json(folder):
    vertices: list = []

    def indexed(surfaces):
        shell = []
        for rings in surfaces:
            shell.append([])
            for points in rings:
                shell[-1].append(list(range(len(vertices), len(vertices) + len(points))))
                vertices.extend((CORNER + p).tolist() for p in points)
        return [shell]

    fine = {"type": "Solid", "lod": "2", "boundaries": indexed(GABLE.values())}
    coarse = {"type": "Solid", "lod": "1", "boundaries": indexed(COARSE)}
    court = {"type": "Solid", "lod": "1", "boundaries": indexed(COURT)}
    content = {
        "type": "CityJSON",
        "version": "2.0",
        "vertices": vertices,
        "metadata": {"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/25832"},
        "CityObjects": {
            "gable": {"type": "Building", "geometry": [coarse, fine]},
            "block": {"type": "Building", "children": ["court"]},
            "court": {"type": "BuildingPart", "parents": ["block"], "geometry": [court]},
        },
    }
    path = folder / "quarter.city.json"
    path.write_text(json.dumps(content))
    return path


@pytest.fixture
def house():
    return shoebox(4.0, 5.0, 3.0, latitude_deg=50.0, longitude_deg=8.0)


def test_two_houses_are_those_of_city_json(tmp_path, house):
    """A gable house of 6 x 8 x (5 + 3 / 2) m3, and a block of 100 - 16 m2 by 6 m."""
    gml, other = written(tmp_path, model(WHOLE, PART)), as_city_json(tmp_path)
    found, expected = read_surroundings(gml), read_surroundings(other)
    assert (found.crs, found.left_out) == (expected.crs, expected.left_out) == ("EPSG:25832", ())
    assert [one.name for one in found.objects] == ["gable", "court"]
    volumes = [enclosed_volume(one.triangles - CORNER) for one in found.objects]
    assert volumes == pytest.approx([6 * 8 * 6.5, 84 * 6], rel=1e-6)
    to_world = np.eye(4)
    to_world[:3, 3] = [*(-CORNER[:2] - (0, 50)), -110]
    house = replace(house, georeference=Georeference("EPSG:25832", to_world))
    placed = [with_surroundings(house, [path]).elements for path in (gml, other)]
    for one, same in zip(*placed, strict=True):
        assert (one.name, one.ifc_class) == (same.name, same.ifc_class)
        np.testing.assert_allclose(one.triangles, same.triangles, atol=1e-6)


def test_boundary_surfaces_stand_for_a_solid(tmp_path):
    (one,) = read_surroundings(written(tmp_path, model(gable(BOUNDARIES)))).objects
    assert enclosed_volume(one.triangles - CORNER) == pytest.approx(312.0, rel=1e-6)


def test_a_solid_is_made_of_the_surfaces_that_it_names(tmp_path):
    """One face is the solid's own, so that the boundary surfaces alone are no closed body."""
    *linked, last = GABLE
    inner = solid(2, [*LINKS[:-1], member(GABLE[last])])
    body = inner + "".join(map(boundary, linked))
    (one,) = read_surroundings(written(tmp_path, model(gable(body)))).objects
    assert enclosed_volume(one.triangles - CORNER) == pytest.approx(312.0, rel=1e-6)


def test_links_that_lead_nowhere_leave_the_next_complete_geometry(tmp_path):
    whole = gable(solid(2, [*LINKS[:-1], '<gml:surfaceMember xlink:href="#no"/>']) + BOUNDARIES)
    (one,) = read_surroundings(written(tmp_path, model(whole))).objects
    assert enclosed_volume(one.triangles - CORNER) == pytest.approx(312.0, rel=1e-6)
    context = read_surroundings(written(tmp_path, model(gable(solid(2, LINKS)))))
    assert context.left_out == ((city_models.NOT_FOUND, 7),)
    assert not context.objects


def test_links_in_a_circle_end(tmp_path):
    circle = (
        '<bldg:lod2MultiSurface><gml:MultiSurface gml:id="m">'
        + member(GABLE["floor"])
        + '<gml:surfaceMember xlink:href="#m"/>' * 3
        + "</gml:MultiSurface></bldg:lod2MultiSurface>"
    )
    (one,) = read_surroundings(written(tmp_path, model(gable(circle)))).objects
    assert len(one.triangles) == 2


def test_terrain_is_terrain_and_what_is_finer_is_told(tmp_path):
    context = read_surroundings(written(tmp_path, model(RELIEF, DETAILED)))
    (one,) = context.objects
    assert (one.name, one.ifc_class, len(one.triangles)) == ("ground", "IfcGeographicElement", 1)
    assert context.left_out == (("objects-without-geometry", 1),)


def test_version_three_has_other_names(tmp_path):
    """Boundaries that link to the polygons of the solid, geometry of the core."""
    polygons = [f"<gml:surfaceMember>{polygon(r, n)}</gml:surfaceMember>" for n, r in GABLE.items()]
    links = "".join(LINKS)
    body = solid(2, polygons) + (
        "<core:boundary><bldg:WallSurface><bldg:lod2MultiSurface><gml:MultiSurface>"
        f"{links}</gml:MultiSurface></bldg:lod2MultiSurface></bldg:WallSurface></core:boundary>"
    )
    part = PART.replace("consistsOfBuildingPart", "buildingPart")
    content = model(gable(body), part, version="3.0", gml="http://www.opengis.net/gml/3.2")
    gable_house, court = read_surroundings(written(tmp_path, content)).objects
    assert enclosed_volume(gable_house.triangles - CORNER) == pytest.approx(312.0, rel=1e-6)
    assert enclosed_volume(court.triangles - CORNER) == pytest.approx(504.0, rel=1e-6)


@pytest.mark.parametrize(
    ("text", "crs"),
    [
        (GERMAN, "EPSG:25832"),
        ("urn:adv:crs:ETRS89_UTM33*DE_DHHN92_NH", "EPSG:25833"),
        ("ETRS89_UTM31", "EPSG:25831"),
        ("urn:ogc:def:crs,crs:EPSG:6.12:25833,crs:EPSG:6.12:5783", "EPSG:25833"),
        ("urn:adv:crs:ETRS89_UTM320", "urn:adv:crs:ETRS89_UTM320"),
    ],
)
def test_systems_of_the_states_are_known_by_rule(text, crs):
    assert crs_name(text) == crs


def test_other_systems_are_refused_by_name_unless_there_is_an_offset(tmp_path, house):
    system = "urn:adv:crs:DE_DHDN_3GK3*DE_DHHN92_NH"
    path = written(tmp_path, model(WHOLE, system=system))
    with pytest.raises(DataError, match=r"DHDN_3GK3.*give the offset"):
        with_surroundings(house, [path])
    (one,) = with_surroundings(house, [path], offset=-CORNER + (20, 0, 0)).elements
    np.testing.assert_allclose(one.triangles.reshape(-1, 3).max(axis=0), [26, 8, 8], atol=1e-6)


FLOOR = '<gml:posList srsDimension="3">456000.000'


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("CityModel", "FeatureCollection", "expected CityModel, got FeatureCollection"),
        ("</core:CityModel>", "", "is no XML: no element found"),
        (FLOOR, FLOOR[:-10], "gable (from line 4): posList: expected triples of numbers"),
        (FLOOR, FLOOR[:-10] + "east", "gable (from line 4): posList: expected triples of numbers"),
        (FLOOR, FLOOR[:-10] + "1e999", "gable (from line 4): posList: expected finite numbers"),
        ('srsDimension="3"', 'srsDimension="2"', "gable (from line 4): posList: expected srsDim"),
        ("gml:exterior><gml:Lin", "gml:outside><gml:Lin", "is no XML: mismatched tag"),
        ("posList", "coordinates", "gable (from line 4): exterior: expected posList or pos"),
        ("<core:CityModel", '<!DOCTYPE x [<!ENTITY a "b">]><core:CityModel', "declares entities"),
        (
            "</gml:boundedBy>",
            '<gml:Envelope srsName="EPSG:25833"/></gml:boundedBy>',
            "line 3: srsName: EPSG:25832, EPSG:25833: expected one coordinate system",
        ),
        ("<gml:name>", "<a>" * 200 + "</a>" * 200 + "<gml:name>", "line 4: elements nested"),
    ],
)
def test_faults_are_one_line(tmp_path, old, new, said):
    path = written(tmp_path, model(WHOLE, PART).replace(old, new))
    with pytest.raises(DataError) as caught:
        read_surroundings(path)
    assert str(caught.value).startswith(f"{path}: {said}") and "\n" not in str(caught.value)


def test_a_big_file_is_refused(tmp_path, monkeypatch):
    path = written(tmp_path, model(WHOLE))
    monkeypatch.setattr(city_models, "MOST_BYTES", path.stat().st_size)
    assert read_surroundings(path).objects
    monkeypatch.setattr(city_models, "MOST_BYTES", path.stat().st_size - 1)
    with pytest.raises(DataError, match="too big: at most"):
        read_surroundings(path)


def test_a_file_that_is_read_leaves_no_parser(tmp_path):
    """In a circle of references it stayed until garbage was collected: 50 kB a file."""
    path = tmp_path / "city.gml"
    path.write_text(model(WHOLE))
    gc.collect()
    gc.disable()
    try:
        read_surroundings(path)
        assert not [x for x in gc.get_objects() if type(x) is xml_elements._Reader]
    finally:
        gc.enable()


def test_pieces_of_a_file_are_put_together(tmp_path, monkeypatch):
    path = written(tmp_path, model(WHOLE, PART))
    whole = read_surroundings(path).objects
    monkeypatch.setattr(xml_elements, "CHUNK", 7)
    for one, same in zip(read_surroundings(path).objects, whole, strict=True):
        np.testing.assert_array_equal(one.triangles, same.triangles)


def test_random_bytes_give_one_line(tmp_path):
    path = tmp_path / "spoilt.gml"
    refused = refusals(path, mutations(model(WHOLE, PART, RELIEF).encode(), 150), read_surroundings)
    assert refused
