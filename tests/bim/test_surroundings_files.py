"""Surroundings from files: CityJSON, footprints, meshes, a horizon; and where they stand."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from bim.ifc.building import read_ifc
from bim.model import Georeference, crs_name, local_metres
from bim.shell import enclosed_volume
from bim.shoebox import WindowRectangle, shoebox
from bim.surroundings.placement import horizon_wall, read_horizon, read_surroundings, with_surroundings
from mitsuba_cfs.errors import DataError
from tests.bim.bim_fuzz import mutations, refusals
from tests.bim.small_ifc import box_room
from tests.issues import of_code


@pytest.fixture
def house():
    """A room of 4 x 5 x 3 m with a window to the south; its origin at 50 N, 8 E, 100 m."""
    window = WindowRectangle(1.0, 1.0, 2.0, 1.0)
    box = shoebox(4.0, 5.0, 3.0, windows=[window], latitude_deg=50.0, longitude_deg=8.0)
    return replace(box, elevation=100.0)


def block(low, high) -> tuple[list, list]:
    """Vertices and boundaries of a box as a Solid of CityJSON."""
    (a, b, c), (d, e, f) = low, high
    vertices = [[a, b, c], [d, b, c], [d, e, c], [a, e, c], [a, b, f], [d, b, f], [d, e, f], [a, e, f]]
    faces = [[3, 2, 1, 0], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    return vertices, [[[face] for face in faces]]


def city(blocks: dict[str, tuple], crs="https://www.opengis.net/def/crs/EPSG/0/25832") -> dict:
    """A quarter of blocks; coordinates kept as integers of 1 mm from a corner."""
    vertices, objects = [], {}
    for name, (low, high) in blocks.items():
        own, boundaries = block(low, high)
        start = len(vertices)
        shifted = [[[[i + start for i in r] for r in s] for s in shell] for shell in boundaries]
        vertices += own
        coarse = {"type": "Solid", "lod": "1", "boundaries": [[[[0, 1, 2]]]]}
        fine = {"type": "Solid", "lod": "2.2", "boundaries": shifted}
        objects[name] = {"type": "Building", "geometry": [coarse, fine]}
    corner = np.min(vertices, axis=0)
    return {
        "type": "CityJSON",
        "version": "2.0",
        "metadata": {"referenceSystem": crs},
        "transform": {"scale": [0.001] * 3, "translate": corner.tolist()},
        "vertices": np.rint((np.array(vertices) - corner) * 1000).astype(int).tolist(),
        "CityObjects": objects,
    }


def written(folder, content, name):
    path = folder / name
    path.write_text(json.dumps(content))
    return path


def bounds(building, name):
    (one,) = [e for e in building.elements if e.name == name]
    corners = one.triangles.reshape(-1, 3)
    return corners.min(axis=0), corners.max(axis=0)


def test_a_quarter_stands_where_the_map_conversion_says(house, tmp_path):
    """The model's x axis points north on the map: 10 m north of the origin is x = 10."""
    turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    to_world = np.eye(4)
    to_world[:3, :3] = turn
    to_world[:3, 3] = -turn @ [456000.0, 5430000.0, 110.0]
    house = replace(house, georeference=Georeference("EPSG:25832", to_world))
    quarter = city(
        {
            "tower": ((456000, 5430010, 110), (456020, 5430030, 140)),
            "itself": ((456000, 5430000, 110), (456009, 5430006, 113)),
        }
    )
    found = with_surroundings(house, [written(tmp_path, quarter, "quarter.city.json")])
    low, high = bounds(found, "tower")
    np.testing.assert_allclose(low, [10, -20, 0], atol=2e-3)
    np.testing.assert_allclose(high, [30, 0, 30], atol=2e-3)


def test_the_building_itself_is_left_out(house, tmp_path):
    low = house.spaces[0].shell.reshape(-1, 3).min(axis=0)
    quarter = city({"itself": (low.tolist(), np.add(low, (4, 5, 3)).tolist()), "other": ((20, 0, 0), (30, 10, 9))})
    path = written(tmp_path, quarter, "quarter.city.json")
    found = with_surroundings(house, [path], offset=(0, 0, 0))
    assert [element.name for element in found.elements] == ["other"]
    (said,) = found.issues
    assert said.code == "objects-of-building" and said.values["objects"] == ("itself",)


def test_what_lies_beyond_all_sight_is_left_out(house, tmp_path):
    path = written(tmp_path, city({"far": ((5e5, 0, 0), (5e5 + 9, 9, 9))}), "far.city.json")
    found = with_surroundings(house, [path], offset=(0, 0, 0))
    assert not found.elements
    assert found.issues[0].code == "objects-far-away" and found.issues[0].values["limit_km"] == 20


def test_solids_of_a_quarter_keep_their_volume(tmp_path):
    path = written(tmp_path, city({"a": ((5, 5, 0), (15, 25, 12))}), "a.city.json")
    (one,) = read_surroundings(path).objects
    assert enclosed_volume(one.triangles) == pytest.approx(10 * 20 * 12, rel=1e-6)


def test_footprints_stand_by_latitude_and_longitude(house, tmp_path):
    """A degree at 50 N is 71.696 km east and 111.229 km north: WGS 84, tables of geodesy."""
    lon, lat = 8 + 1 / 60, 50 + 1 / 60
    ring = [[lon, lat], [lon + 1e-4, lat], [lon + 1e-4, lat + 1e-4], [lon, lat + 1e-4], [lon, lat]]
    feature = {
        "type": "Feature",
        "properties": {"building:levels": "4", "name": "block"},
        "geometry": {"type": "Polygon", "coordinates": [ring]},
    }
    collection = {"type": "FeatureCollection", "features": [feature]}
    found = with_surroundings(house, [written(tmp_path, collection, "q.geojson")])
    low, high = bounds(found, "block")
    # on a plane the parallel curves north by 0.13 m here, and a degree is shorter further north
    np.testing.assert_allclose(low, [71696 / 60, 111229 / 60, 0], rtol=5e-4)
    np.testing.assert_allclose(high - low, [7.1696, 11.1229, 12.0], rtol=2e-3)


def test_arcs_agree_with_proj():
    pyproj = pytest.importorskip("pyproj")
    places = np.array([[8.02, 50.01], [7.97, 49.98]])
    plane = pyproj.Proj("+proj=aeqd +lat_0=50 +lon_0=8 +ellps=WGS84")
    east, north = plane(places[:, 0], places[:, 1])
    found = local_metres(places, 8.0, 50.0)
    np.testing.assert_allclose(found, np.column_stack([east, north]), atol=0.01)  # at 3 km


@pytest.mark.parametrize("suffix", ["obj", "stl", "ply", "glb"])
def test_meshes_stand_in_metres(house, tmp_path, suffix):
    """glTF has y up by its standard: a tower of 30 m along y stands 30 m high."""
    extents = (10, 30, 20) if suffix == "glb" else (10, 20, 30)
    mesh = trimesh.creation.box(extents)
    path = tmp_path / f"tower.{suffix}"
    mesh.export(path)
    found = with_surroundings(house, [path], offset=(0, -50, 15))
    corners = np.concatenate([e.triangles.reshape(-1, 3) for e in found.elements])
    np.testing.assert_allclose(np.ptp(corners, axis=0), [10, 20, 30], atol=1e-4)
    np.testing.assert_allclose(corners.mean(axis=0), [0, -50, 15], atol=1e-4)


def test_far_objects_have_fewer_triangles_and_say_how_far_corners_moved(house, tmp_path):
    path = tmp_path / "dome.stl"
    trimesh.creation.icosphere(subdivisions=5, radius=5).export(path)
    near, far = (with_surroundings(house, [path], (0, -y, 0)) for y in (14, 2000))
    count = [sum(len(e.triangles) for e in b.elements) for b in (near, far)]
    assert count[1] < 0.05 * count[0]
    (said,) = of_code(far, "far-objects-simplified")
    assert said.values["moved_deg"] <= 0.2
    volume = enclosed_volume(far.elements[0].triangles)
    assert volume == pytest.approx(4 / 3 * np.pi * 125, rel=0.35)  # still a body of that size


def test_a_horizon_hides_what_lies_below_it(tmp_path):
    """PVGIS counts azimuths from south, west positive: A = -90 is east."""
    rows = [{"A": a, "H_hor": 20.0 if a == -90 else 0.0} for a in range(-180, 180, 45)]
    path = written(tmp_path, {"outputs": {"horizon_profile": rows}}, "horizon.json")
    walls, radius = horizon_wall(read_horizon(path), np.zeros(3), 10.0)
    corners = walls.reshape(-1, 3)
    top = corners[np.argmax(corners[:, 2])]
    np.testing.assert_allclose(top, radius * np.array([1, 0, np.tan(np.radians(20))]), atol=1e-6)
    table = "Latitude: 50\n\nA\tH_hor\n" + "".join(f"{r['A']}\t{r['H_hor']}\n" for r in rows)
    (tmp_path / "h.csv").write_text(table)
    np.testing.assert_array_equal(read_horizon(tmp_path / "h.csv"), read_horizon(path))


def test_systems_have_one_spelling():
    for text in ("EPSG:25832", "urn:ogc:def:crs:EPSG::25832", "EPSG/0/25832", "epsg:25832"):
        assert crs_name(text) == "EPSG:25832"
    assert crs_name("https://www.opengis.net/def/crs/EPSG/0/7415") == "EPSG:7415"
    assert crs_name("urn:ogc:def:crs:OGC:1.3:CRS84") == "OGC:CRS84"


def test_what_cannot_be_placed_is_refused(house, tmp_path):
    house = replace(house, latitude_deg=None)
    path = written(tmp_path, city({"a": ((0, 0, 0), (9, 9, 9))}), "a.city.json")
    with pytest.raises(DataError, match=r"EPSG:25832.*give the offset"):
        with_surroundings(house, [path])


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.city.json", {"type": "City"}, "type: expected CityJSON"),
        ("a.city.json", {"type": "CityJSON", "vertices": [[1, 2]]}, "vertices: expected triples"),
        (
            "a.city.json",
            {
                "type": "CityJSON",
                "vertices": [],
                "CityObjects": {"h": {"geometry": [{"type": "MultiSurface", "lod": 2, "boundaries": [[[0, 1, 9]]]}]}},
            },
            "h: boundaries: expected lists",
        ),
        ("a.city.json", {"type": "CityJSON", "vertices": [[1, 2, 1e305]]}, "vertices: expected finite numbers"),
        (
            "a.geojson",
            {
                "type": "FeatureCollection",
                "features": [
                    {
                        "properties": {"height": 9},
                        "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [1e305, 0], [1e305, 1], [0, 0]]]},
                    }
                ],
            },
            "feature 0: geometry.coordinates: is no polygon",
        ),
        ("a.geojson", {"type": "FeatureCollection", "features": []}, "properties: no polygon states a height"),
        (
            "a.geojson",
            {"type": "FeatureCollection", "features": [{"properties": {"height": "tall"}, "geometry": None}]},
            "feature 0: height: expected metres, got 'tall'",
        ),
        (
            "a.gltf",
            {"buffers": [{"uri": "../../etc/passwd"}]},
            "buffers.uri: ../../etc/passwd: files beside a mesh are not read",
        ),
        ("a.dwg", {}, "surroundings: expected a file of"),
        ("horizon.json", {"outputs": {}}, "expected outputs.horizon_profile"),
    ],
)
def test_faults_are_one_line(house, tmp_path, name, content, said):
    path = written(tmp_path, content, name)
    with pytest.raises(DataError) as caught:
        with_surroundings(house, [path], (0, 0, 0))
    assert str(caught.value).startswith(f"{path}: {said}") and "\n" not in str(caught.value)


@pytest.mark.parametrize("suffix", ["city.json", "geojson", "obj", "stl", "ply", "glb"])
def test_random_bytes_give_one_line(tmp_path, suffix):
    ring = [[8.0, 50.0], [8.001, 50.0], [8.001, 50.001], [8.0, 50.0]]
    if suffix == "city.json":
        whole = json.dumps(city({"a": ((0, 0, 0), (9, 9, 9))})).encode()
    elif suffix == "geojson":
        feature = {
            "type": "Feature",
            "properties": {"height": 9.0},
            "geometry": {"type": "Polygon", "coordinates": [ring]},
        }
        whole = json.dumps({"type": "FeatureCollection", "features": [feature] * 3}).encode()
    else:
        whole = trimesh.creation.box((1, 2, 3)).export(file_type=suffix)
        whole = whole.encode() if isinstance(whole, str) else whole
    path = tmp_path / f"spoilt.{suffix}"
    path.write_bytes(whole)
    assert read_surroundings(path).objects
    refused = refusals(path, mutations(whole, 40), read_surroundings)
    assert refused


def test_an_ifc_says_where_it_lies(tmp_path):
    """Its x axis points north on the map and its true north is that of the map: x = 0, y = 10 m."""
    path, model = tmp_path / "box.ifc", box_room("IFC4")
    context = model.by_type("IfcGeometricRepresentationContext", include_subtypes=False)[0]
    metre = model.createIfcSIUnit(None, "LENGTHUNIT", None, "METRE")
    crs = model.createIfcProjectedCRS("EPSG:25832", None, None, None, None, None, metre)
    model.createIfcMapConversion(context, crs, 456000.0, 5430000.0, 110.0, 0.0, 1.0, None)
    context.TrueNorth = model.createIfcDirection((1.0, 0.0))
    model.write(str(path))
    house = read_ifc(path)
    assert house.georeference.crs == "EPSG:25832"
    place = house.georeference.to_world @ [456000.0, 5430010.0, 115.0, 1.0]
    np.testing.assert_allclose(place[:3], [0, 10, 5], atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["geojson", "city.json"])
def test_a_quarter_around_a_real_house(real_data, tmp_path, kind):
    """A block 30 m north of the FZK house, by longitude and latitude or on the map of UTM 32."""
    house = read_ifc(real_data / "ifc" / "buildings" / "AC20-FZK-Haus.ifc")
    lon, lat = house.longitude_deg, house.latitude_deg
    north, east = 30 / 111_209, 20 / 73_030  # degrees: tables of geodesy for 49 degrees
    low, high = (lon, lat + north), (lon + east, lat + north + north / 3)
    if kind == "geojson":
        ring = [low, (high[0], low[1]), high, (low[0], high[1]), low]
        feature = {
            "type": "Feature",
            "properties": {"height": 9.0, "name": "block"},
            "geometry": {"type": "Polygon", "coordinates": [ring]},
        }
        content = {"type": "FeatureCollection", "features": [feature]}
    else:
        pyproj = pytest.importorskip("pyproj")
        change = pyproj.Transformer.from_crs("OGC:CRS84", "EPSG:25832", always_xy=True)
        (x0, y0), (x1, y1) = change.transform(*low), change.transform(*high)
        floor = house.elevation
        content = city({"block": ((x0, y0, floor), (x1, y1, floor + 9.0))})
    found = with_surroundings(house, [written(tmp_path, content, f"quarter.{kind}")])
    corners = bounds(found, "block")
    # on the map, north is 0.4 degrees from the house's: 0.3 m at 40 m
    np.testing.assert_allclose(corners, [[0, 30, 0], [20, 40, 9]], atol=0.3)
