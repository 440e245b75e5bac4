"""Tensor trees: the map, the text, lookups and shares, against closed forms and Radiance."""

from __future__ import annotations

import bsdf_radiance as radiance
import numpy as np
import pytest

from mitsuba_cfs.bsdf.evaluate import bsdf_values, direct_hemispherical
from mitsuba_cfs.bsdf.tensor_text import format_tree
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf, disk_to_square, square_to_disk
from mitsuba_cfs.bsdf.xml import BsdfFile, read_bsdf_xml, write_bsdf_xml

FILES = (
    "tensortree/blinds_20deg_t45.xml",  # rank 4, back transmission only
    "tensortree/clear_t4_6.xml",  # rank 4, one cell wide peak
    "tensortree/pyradiance_room_blindsT3.xml",  # rank 3, all four
    "ignis_synthetic/simple_tensor_d3_t3_refl.xml",  # rank 3
    "ignis_synthetic/simple_tensor_d2_line_refl.xml",
    "ignis_synthetic/simple_tensor_spot_trans.xml",
)


MADE = {"made here, rank 3": 3, "made here, rank 4": 4}


def random_tree(rank: int, seed: int, depth: int = 3, limit: float = 0.2) -> TensorTree:
    """A tree whose branches end at random."""
    generator = np.random.default_rng(seed)
    depths = []

    def grow(level: int) -> None:
        if level == depth or (generator.uniform() < 0.5 and level > 0):
            depths.append(level)
        else:
            for _ in range(1 << rank):
                grow(level + 1)

    grow(0)
    values = generator.uniform(0, limit, len(depths))
    return TensorTree(rank, np.array(depths), values)


def test_square_and_disk_are_inverse_and_keep_areas():
    square = np.random.default_rng(1).uniform(size=(200_000, 2))
    disk = square_to_disk(square)
    np.testing.assert_allclose(disk_to_square(disk), square, atol=1e-12)
    radius2 = (disk**2).sum(axis=1)
    # even on the disk: r2 and the angle are uniform; 5 sigma of a mean of 2e5
    assert abs(radius2.mean() - 0.5) < 5 * np.sqrt(1 / 12 / 2e5)
    assert abs(np.cos(np.arctan2(*disk.T)).mean()) < 5 * np.sqrt(0.5 / 2e5)
    np.testing.assert_allclose(square_to_disk([[1, 0.5], [0.5, 1]]), [[1, 0], [0, 1]], atol=1e-15)


@pytest.mark.parametrize("rank", [3, 4])
def test_text_round_trip(rank):
    tree = random_tree(rank, seed=rank)
    again = TensorTree.from_text("".join(format_tree(rank, tree.depths, tree.values, 17)), rank)
    np.testing.assert_array_equal(again.depths, tree.depths)
    np.testing.assert_array_equal(again.values, tree.values)


def test_dense_grid_is_row_major():
    values = np.arange(4.0**4)
    tree = TensorTree.from_text("{" + " ".join(map(str, values)) + "}", 4)
    np.testing.assert_array_equal(tree.sample_grid(), values.reshape(4, 4, 4, 4))
    position = (np.array([[1, 3, 0, 2]]) + 0.5) / 4
    assert tree.values[tree.leaf(position)] == values.reshape(4, 4, 4, 4)[1, 3, 0, 2]


def test_reversing_exchanges_and_turns_the_squares():
    tree = random_tree(4, seed=5)
    grid, reverse = tree.sample_grid(), tree.reversed().sample_grid()
    np.testing.assert_array_equal(reverse, np.transpose(grid[::-1, ::-1, ::-1, ::-1], (2, 3, 0, 1)))


@pytest.mark.parametrize("rank", [3, 4])
def test_hemispherical_is_the_mean_of_the_outgoing_square(rank):
    tree = random_tree(rank, seed=7)
    expected = np.pi * tree.sample_grid().mean(axis=(-2, -1))
    if rank == 3:
        expected = expected[: len(expected) // 2]
    np.testing.assert_allclose(tree.hemispherical(), expected, atol=1e-12)


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "begin"),
        ("1 2 3", "begin"),
        ("{ 1 2 }", "power of 16"),
        ("{ 1", "match"),
        ("{ 1 } }", "match"),
        ("{ 1 } { 1 }", "match"),
        ("{" + "{ 1 }" * 15 + "}", "16 children"),
        ("{" + "{ 1 }" * 17 + "}", "16 children"),
        ("{" + "{ 1 }" * 16 + " 3 }", "between"),
        ("{ nan }", "finite"),
        ("{ one }", "tensor tree"),
        ("{" * 40 + "1" + "}" * 40, "deeply"),
    ],
)
def test_broken_text_is_refused(text, message):
    with pytest.raises(ValueError, match=message):
        TensorTree.from_text(text, 4)


def share_off(ours, theirs, incident) -> float:
    """Share of the pairs [N] that differ; Radiance's factor is another one where light grazes."""
    tolerance = np.where(abs(incident[:, 2]) > 2e-3, radiance.QUERY_TOLERANCE, 2e-4)
    return float((abs(ours - theirs) > 1e-8 + tolerance * abs(theirs)).mean())


@pytest.mark.peer
@pytest.mark.parametrize("name", FILES)
def test_values_are_those_of_radiance(real_data, name):
    path = real_data / "bsdf" / name
    incident, outgoing = radiance.random_directions(10_000, seed=1)
    if "clear" in name or "spot" in name:  # look where the peak is, too
        outgoing[::2] = -incident[::2]
    theirs = radiance.query(path, incident, outgoing)
    ours = bsdf_values(
        radiance.perturbed(read_bsdf_xml(path).band("Visible")),
        radiance.to_window(incident),
        radiance.to_window(outgoing),
    )
    # pairs on the border of a cell, where rounding decides
    assert share_off(ours, theirs, incident) <= 2e-4


@pytest.mark.peer
@pytest.mark.parametrize("rank", [3, 4])
def test_random_trees_on_all_sides_are_those_of_radiance(tmp_path, rank):
    trees = [random_tree(rank, seed, limit=0.12) for seed in range(10, 14)]
    system = TensorTreeBsdf(*trees)
    path = tmp_path / "trees.xml"
    write_bsdf_xml(BsdfFile({"Visible": system}), path, digits=9)
    incident, outgoing = radiance.random_directions(10_000, seed=2)
    theirs = radiance.query(path, incident, outgoing)
    ours = bsdf_values(radiance.perturbed(system), radiance.to_window(incident), radiance.to_window(outgoing))
    assert share_off(ours, theirs, incident) <= 2e-4


@pytest.mark.peer
@pytest.mark.parametrize("name", [*FILES, *MADE])
def test_hemispherical_values_are_those_of_radiance(request, tmp_path, name):
    if name in MADE:
        path = tmp_path / "trees.xml"
        trees = [random_tree(MADE[name], seed, limit=0.12) for seed in range(10, 14)]
        write_bsdf_xml(BsdfFile({"Visible": TensorTreeBsdf(*trees)}), path, digits=9)
    else:
        path = request.getfixturevalue("real_data") / "bsdf" / name
    incident, _ = radiance.random_directions(300, seed=3)
    incident = incident[abs(incident[:, 2]) > 0.01]  # Radiance loses isotropic light that grazes
    theirs = radiance.direct_hemispherical(path, incident)
    system, local = read_bsdf_xml(path).band("Visible"), radiance.to_window(incident)
    front = local[:, 2] > 0
    ours = np.zeros(len(local))
    for side, chosen in (("front", front), ("back", ~front)):
        if chosen.any():
            ours[chosen] = sum(
                direct_hemispherical(system, f"{kind}_{side}", local[chosen]) for kind in ("transmission", "reflection")
            )
    np.testing.assert_allclose(ours, theirs, atol=1e-3)
