"""Terrain as grids of heights: where it stands, how coarse it gets, and bad files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bim.model import Georeference
from bim.rays import ray_mesh
from bim.shoebox import WindowRectangle, shoebox
from bim.surroundings.placement import graded, read_surroundings, with_surroundings
from mitsuba_cfs.errors import DataError
from tests.bim.bim_fuzz import mutations

HEAD = "ncols 4\nnrows 3\nxllcorner 500000\nyllcorner 5600000\ncellsize 50\nNODATA_value -9999\n"
ROWS = "90 91 92 93\n80 81 82 83\n70 71 -9999 73\n"  # from north to south


@pytest.fixture
def house():
    """A room at 500100 E, 5600075 N, 95 m, whose x is the map's east turned by 90 degrees."""
    window = WindowRectangle(1.0, 1.0, 2.0, 1.0)
    box = shoebox(4.0, 5.0, 3.0, windows=[window])
    turned = np.array([[0.0, 1, 0, -5600075], [-1, 0, 0, 500100], [0, 0, 1, -95], [0, 0, 0, 1]])
    return replace(box, georeference=Georeference("EPSG:25832", turned))


def written(folder, text, name="hill.asc"):
    path = folder / name
    path.write_text(text)
    return path


def listed(rows):
    return "".join(f"{x} {y} {z}\n" for x, y, z in rows)


@pytest.mark.parametrize("kind", ["asc", "centre", "xyz"])
def test_nodes_stand_where_the_map_says(house, tmp_path, kind):
    text, name = HEAD + ROWS, "hill.asc"
    if kind == "centre":
        text = text.replace("corner 500000", "center 500025").replace("corner 56", "CENTER 56")
        text = text.replace("5600000", "5600025")
    if kind == "xyz":
        nodes = read_surroundings(written(tmp_path, text)).objects[0].nodes.reshape(-1, 3)
        nodes = np.random.default_rng(1).permutation(nodes[np.isfinite(nodes[:, 2])])
        text, name = listed(nodes), "hill.xyz"
    found = with_surroundings(house, [written(tmp_path, text, name)])
    (terrain,) = (e for e in found.elements if e.ifc_class == "IfcGeographicElement")
    corners = np.unique(terrain.triangles.reshape(-1, 3).round(6), axis=0)
    # east 500025, north 5600025: x = -50, y = 75; 70 m high: -25
    assert [-50.0, 75.0, -25.0] in corners.tolist()
    assert [50.0, -75.0, -2.0] in corners.tolist()  # the north-eastern corner, 93 m high
    assert len(corners) == 10  # the last of the row with the hole is in no cell
    assert len(terrain.triangles) == 9  # of twelve three have the corner without a height
    normals = np.cross(*(terrain.triangles[:, i] - terrain.triangles[:, 0] for i in (1, 2)))
    assert (normals[:, 2] > 0).all()


def test_far_terrain_is_coarser_and_says_by_how_much():
    x = np.arange(-4000.0, 4001, 10)
    x, y = np.meshgrid(x, x)
    nodes = np.stack([x, y, 60 * np.sin(x / 400) * np.cos(y / 300)], -1)
    triangles, worst = graded(nodes, np.zeros(3), 1.0)
    assert 20_000 < len(triangles) < 0.3 * 2 * nodes.shape[0] ** 2
    assert 0.0 < worst < 0.25
    mesh = ray_mesh(triangles)
    rng = np.random.default_rng(2)
    some = nodes.reshape(-1, 3)[rng.integers(0, x.size, 4000)]
    above = some + np.array([0, 0, 500.0])
    down = mesh.first_hits(above, np.tile([0.0, 0.0, -1.0], (4000, 1)))[0]
    flat = np.maximum(np.linalg.norm(some[:, :2], axis=1), 1.0)
    # triangles bend otherwise than the bilinear cells that the error is of
    assert np.degrees(np.arctan2(np.abs(500 - down), flat)).max() < 1.5 * worst
    near = flat < 200
    np.testing.assert_allclose(down[near], 500, atol=0.2)


def test_the_sky_above_a_plane_hill_is_hidden(house, tmp_path):
    """A slope of 45 degrees to the south: what stands on it sees nothing below that."""
    rows = [[1000 - 10 * i] * 100 for i in range(100)]
    text = "ncols 100\nnrows 100\nxllcorner 0\nyllcorner 0\ncellsize 10\n"
    path = written(tmp_path, text + "\n".join(" ".join(map(str, row)) for row in rows))
    found = with_surroundings(house, [path], offset=(-500.0, -1020.0, -1100.0))
    mesh = ray_mesh(np.concatenate([e.triangles for e in found.elements]))
    towards = np.array([[0.0, -np.cos(a), -np.sin(a)] for a in np.radians((40.0, 50.0))])
    hits = mesh.first_hits(np.tile([2.0, -30.0, -70.0 + 2], (2, 1)), towards)[1]
    assert hits[1] >= 0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "ncols"),
        (HEAD.replace("cellsize 50\n", "") + ROWS, "cellsize"),
        (HEAD.replace("cellsize 50", "cellsize x") + ROWS, "cellsize"),
        (HEAD.replace("cellsize 50", "cellsize -5") + ROWS, "cellsize"),
        (HEAD.replace("ncols 4", "ncols 1e400") + ROWS, "ncols"),
        (HEAD.replace("ncols 4", "ncols nan") + ROWS, "ncols"),
        (HEAD.replace("ncols 4", "ncols 5") + ROWS, "15 expected"),
        (HEAD + ROWS.replace("81", "high"), "numbers"),
        (HEAD + ROWS.replace("81", "nan"), "numbers"),
        (HEAD + "-9999 " * 12, "heights"),
    ],
)
def test_a_bad_grid_is_one_line(house, tmp_path, text, said):
    with pytest.raises(DataError, match=r"hill\.asc") as caught:
        with_surroundings(house, [written(tmp_path, text)])
    assert said in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["1 2 3\n", "0 0 1\n1 0 1\n0.3 1 1\n1 1 1\n0 1.7 2\n", "0 0 1\n" * 4, "a b c\n" * 4])
def test_a_bad_list_is_one_line(tmp_path, text):
    with pytest.raises(DataError, match=r"hill\.xyz") as caught:
        read_surroundings(written(tmp_path, text, "hill.xyz"))
    assert "\n" not in str(caught.value)


def test_without_a_map_an_offset_is_asked_for(house, tmp_path):
    with pytest.raises(DataError, match="offset of the surroundings"):
        with_surroundings(replace(house, georeference=None), [written(tmp_path, HEAD + ROWS)])


@pytest.mark.parametrize("name", ["hill.asc", "hill.xyz"])
def test_any_text_is_read_or_refused(house, tmp_path, name):
    rows = "\n".join(" ".join(str(70 + x + y) for x in range(12)) for y in range(12))
    whole = HEAD.replace("ncols 4", "ncols 12").replace("nrows 3", "nrows 12") + rows
    if name.endswith("xyz"):
        whole = listed((x, y, x + y) for x in range(12) for y in range(12))
    read = 0
    for content in mutations(whole.encode(), 150):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        try:
            with_surroundings(house, [path])
            read += 1
        except DataError as error:
            assert name in str(error) and "\n" not in str(error)
    assert read < 150
