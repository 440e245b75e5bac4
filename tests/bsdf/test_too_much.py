"""BSDF files that are too much: in bytes, in numbers, in leaves, in light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_tensor_tree import random_tree

from mitsuba_cfs.bsdf import xml
from mitsuba_cfs.bsdf.bsdf_file import BsdfFile
from mitsuba_cfs.bsdf.checks import check_bsdf
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KlemsBsdf
from mitsuba_cfs.bsdf.tensor_plugin import plugin_trees
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf, disk_to_square, square_to_disk
from mitsuba_cfs.bsdf.xml import read_bsdf_xml, write_bsdf_xml
from mitsuba_cfs.errors import DataError


def diffuse(share: float, grazing: float) -> KlemsBsdf:
    """Reflects `share` of every direction diffusely, and `grazing` of the outermost ring."""
    block = np.full((145, 145), share / np.pi)
    block[:, -12:] = grazing / np.pi
    zero = np.zeros((145, 145))
    return KlemsBsdf(KLEMS_FULL, KLEMS_FULL, zero, zero, zero, block)


def written(tmp_path, bsdf: KlemsBsdf | TensorTreeBsdf):
    path = tmp_path / "system.xml"
    write_bsdf_xml(BsdfFile({"Visible": bsdf, "Solar": bsdf}), path)
    return path


def test_a_grazing_ring_above_one_is_noted_and_used(tmp_path):
    path = written(tmp_path, diffuse(0.6, 1.08))
    file = read_bsdf_xml(path)
    assert file.band("Visible").reflection_back[0, -1] == pytest.approx(1.08 / np.pi, rel=1e-6)
    assert "12 of 145 directions" in file.notes[0]
    assert "108.0 %" in file.notes[0]
    found = check_bsdf(read_bsdf_xml(path, energy_limit=np.inf))
    assert {finding.severity for finding in found} == {"warning", "note"}


@pytest.mark.parametrize(("share", "grazing"), [(1.03, 0.9), (0.6, 1.6)], ids=["all", "much"])
def test_a_hemisphere_above_one_or_a_direction_far_above_is_refused(tmp_path, share, grazing):
    path = written(tmp_path, diffuse(share, grazing))
    with pytest.raises(DataError, match=r"reflection back: incident direction .* scatters 1"):
        read_bsdf_xml(path)
    findings = check_bsdf(read_bsdf_xml(path, energy_limit=np.inf))
    assert "error" in {finding.severity for finding in findings}


@pytest.mark.parametrize("rank", [3, 4])
def test_cells_of_a_tree_weigh_as_their_projected_solid_angle(rank):
    tree = random_tree(rank, seed=1, depth=3)
    weights = TensorTreeBsdf(tree).incident_weights(tree.hemispherical().size)
    if rank == 4:
        np.testing.assert_allclose(weights, weights[0])
        return
    sine = 1 - (np.arange(len(weights) * 100) + 0.5) / (len(weights) * 100)
    expected = sine.reshape(-1, 100).mean(axis=1)
    np.testing.assert_allclose(weights / weights.sum(), expected / expected.sum(), rtol=1e-12)


def test_a_big_file_is_refused_before_it_is_parsed(tmp_path, monkeypatch):
    path = written(tmp_path, diffuse(0.5, 0.5))
    monkeypatch.setattr(xml, "MOST_BYTES", path.stat().st_size)
    read_bsdf_xml(path)
    monkeypatch.setattr(xml, "MOST_BYTES", path.stat().st_size - 1)
    monkeypatch.setattr(xml.ElementTree, "fromstring", None)
    with pytest.raises(DataError, match="too big: at most"):
        read_bsdf_xml(path)


def test_a_sparse_giant_is_refused_before_it_is_parsed(tmp_path, monkeypatch):
    path = tmp_path / "giant.xml"
    with open(path, "wb") as file:
        file.write(b"<WindowElement>")
        file.truncate(505_000_000)
    monkeypatch.setattr(xml.ElementTree, "fromstring", None)  # 86 s
    with pytest.raises(DataError, match=r"giant\.xml: is too big"):
        read_bsdf_xml(path)


def test_a_matrix_of_far_too_many_numbers_is_refused_before_they_are_read(tmp_path, monkeypatch):
    path = written(tmp_path, diffuse(0.5, 0.5))
    start = "<ScatteringData>"
    path.write_text(path.read_text().replace(start, start + "0, " * 500_000, 1))
    monkeypatch.setattr(xml, "parse_numbers", None)
    with pytest.raises(DataError, match=r"145 x 145 = 21025 values .*, got far more"):
        read_bsdf_xml(path)


@pytest.mark.parametrize(
    ("tag", "text", "expected"), [("Thickness", "-0.003", "of at least 0"), ("EmissivityFront", "8.4", "from 0 to 1")]
)
def test_impossible_descriptions_are_refused(tmp_path, tag, text, expected):
    path = tmp_path / "system.xml"
    system = BsdfFile({"Visible": diffuse(0.5, 0.5)}, thickness=0.024, emissivity_front=0.84)
    write_bsdf_xml(system, path)
    for old in ("0.024", "0.84"):
        if f">{old}</{tag}>" in path.read_text():
            path.write_text(path.read_text().replace(f">{old}</{tag}>", f">{text}</{tag}>"))
    with pytest.raises(DataError, match=f"{tag}: expected a number {expected}, got {text}"):
        read_bsdf_xml(path)


def dense(depth: int) -> TensorTree:
    values = np.random.default_rng(2).uniform(0.1, 0.2, 8**depth)
    return TensorTree(3, np.full(8**depth, depth), values)


def test_an_isotropic_tree_reversed_is_the_mean_of_the_way_back():
    """Against the definition, at the same 64 points of a few cells of a dense grid."""
    tree, cells = dense(3), 8
    grid = tree.reversed().sample_grid()
    step = (np.arange(4) + 0.5) / 4
    generator = np.random.default_rng(3)
    for cell in generator.integers(0, [4, 8, 8], (40, 3)):
        axes = [(index + step) / cells for index in cell]
        point = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
        sine_in, out = 1 - 2 * point[:, :1], square_to_disk(point[:, 1:])
        sine_out = np.hypot(*out.T)[:, None]
        back = disk_to_square(sine_in * out * [1, -1] / sine_out)
        place = np.concatenate([0.5 - 0.5 * sine_out, back], axis=1)
        expected = tree.values[tree.leaf(place)].mean()
        assert grid[tuple(cell)] == pytest.approx(expected, rel=1e-12)
    assert not grid[4:].any()


def test_a_tree_is_turned_and_summed_once(monkeypatch):
    """All that a plugin needs of a file: each tree's way back once, its hemisphere once."""
    calls = []
    work = TensorTree._reversed_isotropic
    monkeypatch.setattr(TensorTree, "_reversed_isotropic", lambda tree: calls.append(tree) or work(tree))
    tree = dense(3)
    bsdf = TensorTreeBsdf(transmission_front=tree)
    plugin_trees(bsdf, True)
    assert len({id(one) for one in calls}) == len(calls)
    assert tree.hemispherical() is tree.hemispherical()
    assert replace(tree).hemispherical() is not tree.hemispherical()
