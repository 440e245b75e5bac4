"""Klems matrices made from other data keep directions, sides and energy."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.bsdf.evaluate import (
    BLOCKS,
    ThroughPeak,
    _block,
    _leaves_ahead,
    _peak,
    bsdf_values,
    direct_hemispherical,
    held_beams,
    klems_of,
    neighbours,
    ring_falls,
    specular_exponent,
    tree_position,
)
from mitsuba_cfs.bsdf.klems import KLEMS_FULL, KLEMS_HALF, KlemsBsdf
from mitsuba_cfs.bsdf.tensor_merge import merged_tree
from mitsuba_cfs.bsdf.tensor_tree import TensorTree, TensorTreeBsdf, morton, square_to_disk
from mitsuba_cfs.bsdf.xml import read_bsdf_xml
from scenes.demo import VENETIAN_BLIND


@pytest.mark.parametrize("name", BLOCKS)
def test_a_klems_matrix_comes_back(name) -> None:
    """The blind is the same from neither side nor turned: every convention is in its numbers."""
    bsdf = read_bsdf_xml(VENETIAN_BLIND).band("Visible").filled()
    np.testing.assert_allclose(_block(bsdf, bsdf, name, KLEMS_FULL, 2), getattr(bsdf, name), rtol=1e-9, atol=1e-12)


def test_energy_is_that_of_the_tree() -> None:
    """A lopsided tree of rank 4: each patch sends on what the tree's cells in it do."""
    rng = np.random.default_rng(0)
    tree = TensorTree(4, np.full(256, 2, dtype=np.int64), 0.25 * rng.random(256))
    bsdf = TensorTreeBsdf(transmission_front=tree)
    klems = klems_of(bsdf)
    found = klems.direct_hemispherical(klems.transmission_front)
    towards = KLEMS_FULL.incident_directions()
    middle = direct_hemispherical(bsdf, "transmission_front", towards)
    inside = np.isclose(found, middle, rtol=1e-9)  # patches that lie in one cell of the tree
    assert 20 < inside.sum() < KLEMS_FULL.size
    omega = KLEMS_FULL.projected_solid_angles()
    assert omega @ found == pytest.approx(np.pi * tree.hemispherical().mean(), rel=0.01)
    assert not klems.reflection_front.any()
    np.testing.assert_array_equal(klems_of(klems).transmission_front, klems.transmission_front)
    assert klems_of(bsdf, KLEMS_HALF, samples=4).transmission_front.shape == (77, 77)


@pytest.mark.parametrize("side", ["front", "back"])
def test_the_side_that_a_tree_does_not_have_is_the_other_by_reciprocity(side) -> None:
    """A lopsided tree without a beam; from the other side the matrix is the known one, turned."""
    other = "back" if side == "front" else "front"
    rng = np.random.default_rng(1)
    tree = TensorTree(4, np.full(256, 2, dtype=np.int64), 0.1 + 0.2 * rng.random(256))
    klems = klems_of(TensorTreeBsdf(**{f"transmission_{side}": tree}))
    known = getattr(klems, f"transmission_{side}")
    turned = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, **{f"transmission_{side}": known}).filled()
    expected = getattr(turned, f"transmission_{other}")
    found = getattr(klems, f"transmission_{other}")
    # patches across the tree's cells are means over 64 pairs of directions; not turned it is 0.2
    off = np.abs(found - expected) / expected
    assert off.mean() < 0.01 and np.quantile(off, 0.99) < 0.08
    assert (np.abs(known - expected) / expected).mean() > 0.1


@pytest.mark.parametrize("side", ["front", "back"])
def test_the_beam_of_a_tree_is_all_on_the_diagonal(side) -> None:
    """Half goes straight on in each cell: no patch has any of it beside the diagonal."""
    depth, straight, scattered = 4, 0.5, 0.1 / np.pi
    cells = 1 << depth
    grid = np.full((cells,) * 4, scattered)
    x, y = np.indices((cells, cells))
    grid[x, y, x, y] += straight * cells**2 / np.pi
    order = np.argsort(morton(np.stack(np.indices(grid.shape), -1), depth).ravel())
    tree = TensorTree(4, np.full(grid.size, depth, dtype=np.int64), grid.ravel()[order])
    name = f"transmission_{side}"
    bsdf = TensorTreeBsdf(**{name: tree})
    omega = KLEMS_FULL.projected_solid_angles()
    found = getattr(klems_of(bsdf, samples=4), name)
    beam = (np.diag(found) - scattered) * omega
    np.testing.assert_allclose(beam, straight, rtol=1e-6)
    beside = ~np.eye(len(found), dtype=bool)
    np.testing.assert_allclose(found[beside], scattered, rtol=1e-6)


@pytest.mark.parametrize("kind", ["klems", "rank 3", "rank 4"])
def test_a_system_turned_round_is_seen_from_its_other_side(kind):
    """f(d, o) is that of the system for d and o turned by pi about its up."""
    random = np.random.default_rng(1)
    names = ("transmission_front", "transmission_back", "reflection_front", "reflection_back")
    if kind == "klems":
        blocks = {name: random.uniform(size=(145, 145)) for name in names}
        bsdf = KlemsBsdf(KLEMS_FULL, KLEMS_FULL, **blocks)
    else:
        rank = int(kind[-1])
        blocks = {name: merged_tree(random.uniform(size=(4,) * rank)) for name in names}
        bsdf = TensorTreeBsdf(**blocks)
    incident, outgoing = random.normal(size=(2, 2000, 3))
    incident /= np.linalg.norm(incident, axis=1)[:, None]
    outgoing /= np.linalg.norm(outgoing, axis=1)[:, None]
    turned = np.array([-1.0, 1.0, -1.0])
    expected = bsdf_values(bsdf, incident * turned, outgoing * turned)
    found = bsdf_values(bsdf.turned_round(), incident, outgoing)
    assert np.mean(np.isclose(found, expected, rtol=1e-6)) > 0.995  # but on edges of cells


def test_the_share_that_is_seen_through_stays_and_is_all_by_default() -> None:
    rng = np.random.default_rng(1)
    blocks = rng.uniform(0, 0.1, (4, KLEMS_HALF.size, KLEMS_HALF.size))
    for stated, share in ((None, 1.0), (0.4, 0.4)):
        bsdf = KlemsBsdf(KLEMS_HALF, KLEMS_HALF, *blocks, see_through=stated)
        assert klems_of(bsdf, KLEMS_FULL).see_through == share


def test_an_isotropic_tree_goes_by_the_sine_of_incidence_in_its_first_half():
    """(1 - sin(theta)) / 2, below 1/2 at normal incidence; outgoing light turned by the azimuth."""
    tree = TensorTree(3, np.zeros(1, dtype=np.int64), np.ones(1))
    theta, phi = np.radians([0.0, 30.0, 90.0]), np.radians(70.0)
    incident = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)
    at = tree_position(tree, incident, -incident)
    np.testing.assert_allclose(at[:, 0], [0.5, 0.25, 0.0], atol=2e-6)
    assert at[0, 0] < 0.5
    flat = np.stack([np.sin(theta), np.zeros(3), np.cos(theta)], axis=1)
    np.testing.assert_allclose(at[1:], tree_position(tree, flat, -flat)[1:], atol=1e-9)


@pytest.mark.parametrize("exponent", [2.0, 5.0])
def test_a_fall_towards_grazing_comes_back_from_the_rings(exponent) -> None:
    """Clear glass lies between; a diffuse part, or a ring that is not even, is no specular system."""
    falls = 0.8 * ring_falls(KLEMS_FULL, exponent)[KLEMS_FULL.rings]
    none = np.zeros((KLEMS_FULL.size, KLEMS_FULL.size))
    assert specular_exponent(ThroughPeak(falls, none), KLEMS_FULL) == pytest.approx(exponent, abs=1e-4)
    assert specular_exponent(ThroughPeak(0.1 * falls, none + 0.1), KLEMS_FULL) is None
    uneven = falls * np.where(np.arange(KLEMS_FULL.size) % 2, 1.1, 0.9)
    assert specular_exponent(ThroughPeak(uneven, none), KLEMS_FULL) is None


@pytest.mark.parametrize("basis", [KLEMS_FULL, KLEMS_HALF])
def test_neighbours_are_mutual_and_touch(basis) -> None:
    """A point just beyond each corner and each side's middle of a patch is in a neighbour."""
    near = neighbours(basis)
    for k, others in enumerate(near):
        assert k not in others and all(k in near[other] for other in others)
    theta, phi = basis.centres()
    for k in range(1, basis.size):
        ring, count = basis.rings[k], basis.phi_counts[basis.rings[k]]
        low, high = basis.theta_bounds[ring], basis.theta_bounds[ring + 1]
        step = 1e-6
        beyond = [(theta[k], phi[k] + side * (np.pi / count + step)) for side in (-1, 1)]
        beyond += [(low - step, phi[k] + side * (np.pi / count - step)) for side in (-1, 0, 1)]
        if high < np.pi / 2 - step:
            beyond += [(high + step, phi[k] + side * (np.pi / count - step)) for side in (-1, 0, 1)]
        assert {int(basis.index(*one)) for one in beyond} <= set(near[k].tolist())


def test_a_beam_is_taken_from_the_diagonal_first() -> None:
    """Of T with 0.5 straight on and 0.2 beside it, a beam of 0.6 has 0.5 and 0.1 there."""
    omega, k = KLEMS_FULL.projected_solid_angles(), 5
    beside = next(j for j in neighbours(KLEMS_FULL)[k] if KLEMS_FULL.rings[j] == KLEMS_FULL.rings[k])
    transmission = np.zeros((KLEMS_FULL.size, KLEMS_FULL.size))
    transmission[k, k], transmission[beside, k] = 0.5, 0.2
    beams = np.zeros(KLEMS_FULL.size)
    for beam, straight, aside in ((0.3, 0.3, 0.0), (0.6, 0.5, 0.1), (0.9, 0.5, 0.2)):
        beams[k] = beam
        held = held_beams(transmission, beams, KLEMS_FULL) * omega[:, None] / omega
        assert held[k, k] == pytest.approx(straight) and held[beside, k] == pytest.approx(aside)
        assert held.sum() == pytest.approx(straight + aside)


def test_what_is_around_a_peak_is_a_mean_over_its_solid_angle() -> None:
    """A leaf one level up has four times the solid angle of the smallest."""
    value, depth = np.array([[900.0, 5.0, 1.0, 0.0]]), np.array([[6, 5, 6, -1]])
    peak, around = _peak(value, depth, 6)
    assert peak.tolist() == [[True, False, False, False]]
    assert around == pytest.approx([(4 * 5.0 + 1.0) / 5])


def test_directions_of_every_block_may_be_in_one_call() -> None:
    bsdf = read_bsdf_xml(VENETIAN_BLIND).band("Visible")
    up = np.random.default_rng(5).normal(size=(2, 40, 3))
    incident, outgoing = up / np.linalg.norm(up, axis=-1, keepdims=True)
    together = bsdf_values(bsdf, incident, outgoing)
    alone = [bsdf_values(bsdf, one, other)[0] for one, other in zip(incident, outgoing, strict=True)]
    np.testing.assert_array_equal(together, alone)
    sides = 2 * (incident[:, 2] > 0) + (outgoing[:, 2] > 0)
    assert all((together[sides == side] > 0).any() for side in range(4))


def test_leaves_that_are_looked_at_for_a_beam_lie_round_straight_on() -> None:
    """Within 2.4 widths of the smallest leaf, to each side; straight on is one of them."""
    depth = 5
    cells = 1 << depth
    grid = np.indices((cells,) * 4)
    order = np.argsort(morton(np.stack(grid, -1), depth).ravel())
    tree = TensorTree(4, np.full(order.size, depth, dtype=np.int64), np.zeros(order.size))
    leaves = _leaves_ahead(tree)
    *incident, out_x, out_y = (axis.ravel()[order] for axis in grid)
    place = square_to_disk((np.stack([out_x, out_y], -1) + 0.5) / cells)
    straight = square_to_disk((np.stack(np.unravel_index(np.arange(cells**2), (cells, cells)), -1) + 0.5) / cells)
    width = np.sqrt(np.pi) / cells
    off = (place[leaves] - straight[:, None]) / width
    off[leaves < 0] = 0.0
    far = np.linalg.norm(off, axis=-1)
    assert 2.0 < far.max() < 2.4 + 0.8  # a leaf's middle is up to half its diagonal from a place in it
    assert (far == 0).any(axis=1).all()
    inner = np.linalg.norm(straight, axis=1) < 0.8
    for k in (0, 1):
        assert (off[inner, :, k].max(axis=1) > 1.0).all() and (off[inner, :, k].min(axis=1) < -1.0).all()
    for number, cell in zip(incident, np.unravel_index(np.arange(cells**2), (cells, cells)), strict=True):
        assert (number[leaves] == cell[:, None])[leaves >= 0].all()
