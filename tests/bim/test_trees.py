"""Trees: crowns of leaves that let pass what is stated, by month; lists of them; their faults."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from bim.model import in_month, season_of, seasons
from bim.rays import ray_mesh
from bim.report.issue import issue_text
from bim.shoebox import WindowRectangle, shoebox
from bim.surroundings.city_models import BARE, LEAFED, monthly_transmittance, tree_of
from bim.surroundings.placement import crown_elements, read_surroundings, with_surroundings
from mitsuba_cfs.errors import DataError
from tests.issues import of_code

WINTER = (0.46,) * 4 + (0.033,) * 6 + (0.46,) * 2
FIELDS = {"height": 10.0, "crown_radius": 4.0, "crown_base": 2.0, "transmittance": 0.2}


@pytest.fixture
def house():
    window = WindowRectangle(1.0, 1.0, 2.0, 1.0)
    return shoebox(4.0, 5.0, 3.0, windows=[window], latitude_deg=50.0, longitude_deg=8.0)


def crown(tmp_path, **fields):
    return tree_of(FIELDS | fields, [0.0, 0.0], "tree", tmp_path / "trees.toml")


def listed(folder, text, name="trees.toml"):
    path = folder / name
    path.write_text(text)
    return path


def beams(direction, radii, count=40_000):
    """Parallel rays over the shadow of an ellipsoid about the origin, and their paths in it [m]."""
    rng, d = np.random.default_rng(3), np.asarray(direction) / np.linalg.norm(direction)
    reach = max(radii)
    across = np.linalg.svd(d[None])[2][1:]
    origins = rng.uniform(-reach, reach, (count, 2)) @ across
    # |(o + t d) / r| = 1
    a, b = ((d / radii) ** 2).sum(), (origins * d / np.square(radii)).sum(-1)
    root = b**2 - a * (((origins / radii) ** 2).sum(-1) - 1)
    met = root > 0
    return origins[met] - 30 * d, d, 2 * np.sqrt(root[met]) / a


@pytest.mark.parametrize("direction", [(1, 0, 0), (0.5, 0.3, 0.7), (0, 0.1, 1)])
def test_beams_fall_with_their_path_through_the_crown_by_beers_law(tmp_path, direction):
    """The attenuation is that of the closed form: 2 (1 - (1 + x) e^-x) / x^2 of a level beam."""
    radii, rows = np.array([4.0, 4.0, 4.0]), np.array([0.0, 0.0, 6.0])
    for number, stated in enumerate((0.46, 0.2)):
        leaves = crown_elements(crown(tmp_path), (stated,) * 12, f"g{number}", 5.0)
        mesh = ray_mesh(np.concatenate([one.triangles for one in leaves]) - rows)
        origins, d, path = beams(direction, radii)
        passed = mesh.first_hits(origins, np.broadcast_to(d, origins.shape))[1] < 0
        x = next(x for x in np.arange(0, 20, 1e-3)[1:] if _shadow(x) < stated)
        k = x / 8.0
        assert passed.mean() == pytest.approx(stated, abs=0.02)
        for low, high in ((0, 3), (3, 5), (5, 7), (7, 8)):
            some = (path > low) & (path < high)
            # leaves stick out of the hull by their own size: the shortest paths meet more of them
            bar = 0.10 if low == 0 else 0.06
            assert passed[some].mean() == pytest.approx(np.exp(-k * path[some]).mean(), abs=bar)


def _shadow(x):
    return 2 / x**2 * (1 - (1 + x) * np.exp(-x))


def test_leaves_come_and_go_with_the_months(house, tmp_path):
    path = listed(
        tmp_path,
        '[[tree]]\nat = [0.0, -9.0]\nheight = 10\ncrown_radius = 4\ntransmittance = "deciduous"\n'
        "[[tree]]\nat = [9.0, -9.0]\nheight = 10\ncrown_radius = 4\ntransmittance = 0.5\n",
    )
    found = with_surroundings(house, [path])
    full, bare = seasons(found)
    assert (full.months, bare.months) == ((5, 6, 7, 8, 9, 10), (1, 2, 3, 4, 11, 12))
    kept = {e.guid for e in bare.building.elements}
    assert kept < {e.guid for e in full.building.elements} == {e.guid for e in found.elements}
    assert len(in_month(found, 6).elements) == len(found.elements)
    assert len(seasons(in_month(found, 6))) == 1
    assert season_of(seasons(found), np.array([1, 5, 10, 12])).tolist() == [1, 0, 0, 1]
    (one, other) = map(issue_text, of_code(found, "trees-by-month"))
    assert "3 % from May to October, 46 % from November to April" in one.effect
    assert "50 %" in other.effect
    (only,) = seasons(house)
    assert only.building is house and len(only.months) == 12


def test_kinds_have_the_published_transmittances_south_of_the_equator_too(house):
    north, south = (monthly_transmittance("deciduous", d) for d in (50.0, -30.0))
    assert (north[0], north[6]) == (BARE, LEAFED) == (south[6], south[0])
    assert monthly_transmittance("evergreen", 50.0) == (LEAFED,) * 12
    # Konarska et al. 2014, abstract: 1.3 to 5.3 %, 40.2 to 51.9 %
    assert 0.013 < LEAFED < 0.053 and 0.402 < BARE < 0.519


def test_a_crown_without_leaves_in_some_months_and_bigger_leaves_far_away(tmp_path):
    clear = (1.0,) * 6 + (0.2,) * 6
    (layer,) = crown_elements(crown(tmp_path), clear, "g", 5.0)
    assert layer.months == (7, 8, 9, 10, 11, 12)
    assert crown_elements(crown(tmp_path), (1.0,) * 12, "g", 5.0) == []
    (far,) = crown_elements(crown(tmp_path), clear, "g", 90.0)
    assert len(far.triangles) == pytest.approx(len(layer.triangles) / 9, rel=0.01)
    sizes = [
        np.linalg.norm(np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]), axis=1).sum()
        for t in (far.triangles, layer.triangles)
    ]
    assert sizes[0] == pytest.approx(sizes[1])


def test_points_of_a_map_are_trees(house, tmp_path):
    point = {
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": [8.001, 50.0]},
        "properties": FIELDS | {"name": "elm"},
    }
    path = listed(tmp_path, json.dumps({"type": "FeatureCollection", "features": [point]}), "a.geojson")
    found = with_surroundings(house, [path])
    corners = np.concatenate([e.triangles.reshape(-1, 3) for e in found.elements])
    middle, half = (corners.min(0) + corners.max(0)) / 2, np.ptp(corners, axis=0) / 2
    # 0.001 degrees of longitude: 71.7 m at 50 degrees north; leaves stick out a little
    np.testing.assert_allclose(middle, [71.7, 0.0, 6.0], atol=0.5)
    np.testing.assert_allclose(half, [4.0, 4.0, 4.0], atol=0.8)


def test_an_object_of_another_file_is_a_crown(house, tmp_path):
    body = trimesh.creation.box((4.0, 4.0, 4.0))
    body.apply_translation((2.0, -8.0, 4.0))
    mesh = tmp_path / "oak.obj"
    mesh.write_text("o oak\n" + body.export(file_type="obj"))
    trees = listed(tmp_path, '[[tree]]\nobject = "oak"\ntransmittance = 0.3\n')
    name = read_surroundings(mesh).objects[0].name
    trees.write_text(trees.read_text().replace("oak", name))
    found = with_surroundings(house, [mesh, trees])
    (leaves,) = [e for e in found.elements if e.name == name]
    passed = ray_mesh(leaves.triangles)
    rng = np.random.default_rng(0)
    origins = np.column_stack([np.full(9000, -9.0), *rng.uniform((-10, 2), (-6, 6), (9000, 2)).T])
    missed = passed.first_hits(origins, np.tile([1.0, 0.0, 0.0], (9000, 1)))[1] < 0
    assert missed.mean() == pytest.approx(0.3, abs=0.04)
    opened = trimesh.Trimesh(body.vertices, body.faces[2:])
    mesh.write_text("o oak\n" + opened.export(file_type="obj"))
    with pytest.raises(DataError, match="no closed mesh"):
        with_surroundings(house, [mesh, trees])


TREE = "[[tree]]\nat = [0, -9]\nheight = 10\ncrown_radius = 4\ntransmittance = 0.5\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "tree"),
        ("[[tree", "TOML"),
        ("tree = 3", "tree"),
        (TREE.replace("[0, -9]", "[0]"), "at"),
        (TREE.replace("height = 10", ""), "height"),
        (TREE.replace("height = 10", "height = 10\ncrown_base = 12"), "height"),
        (TREE.replace("0.5", "0"), "transmittance"),
        (TREE.replace("0.5", "[0.5, 0.4]"), "transmittance"),
        (TREE.replace("0.5", '"green"'), "transmittance"),
        (TREE + "crown = 3\n", "crown"),
        ('[[tree]]\nobject = "oak"\ntransmittance = 0.5\n', "oak"),
    ],
)
def test_a_bad_list_is_one_line(house, tmp_path, text, said):
    with pytest.raises(DataError, match=r"trees\.toml") as caught:
        with_surroundings(house, [listed(tmp_path, text)])
    assert said in str(caught.value) and "\n" not in str(caught.value)


VALUES = (
    None,
    -1,
    0,
    3,
    40,
    1e6,
    float("nan"),
    "",
    "deciduous",
    True,
    [],
    [8, 50],
    [8, 50, 1],
    [0.5] * 12,
    [0.5, "x"],
    {},
    [float("inf"), 5],
    10**40,
)
KEYS = ("at", "name", "height", "crown_radius", "crown_base", "transmittance")


def test_any_fields_are_a_tree_or_refused(tmp_path):
    """Of a point of GeoJSON, whose values may be anything."""
    rng, read = np.random.default_rng(5), 0
    for _ in range(400):
        chosen = {str(k): VALUES[rng.integers(len(VALUES))] for k in rng.choice(KEYS, 2)}
        place = {"type": "Point", "coordinates": chosen.get("at", [8, 50])}
        point = {"type": "Feature", "properties": FIELDS | chosen, "geometry": place}
        path = listed(tmp_path, json.dumps({"type": "FeatureCollection", "features": [point]}), "a.geojson")
        try:
            read += np.isfinite(read_surroundings(path).objects[0].triangles).all()
        except DataError as error:
            assert "\n" not in str(error)
    assert 20 < read < 380


def test_the_same_tree_has_the_same_leaves_and_another_has_others(tmp_path):
    one, again, other = (crown_elements(crown(tmp_path), WINTER, guid, 5.0)[0].triangles for guid in "aab")
    assert np.array_equal(one, again) and not np.array_equal(one, other)
    assert replace(crown(tmp_path), name="x").foliage == (0.2,) * 12
