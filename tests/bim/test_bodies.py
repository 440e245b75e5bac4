"""Which bodies a ray goes through, as files draw them: touching, inside out, without a side."""

from __future__ import annotations

import numpy as np
import pytest

from bim.bodies import Bodies
from bim.rays import ray_mesh
from tests.bim.test_eaves import body

Y = np.array([0.0, 1.0, 0.0])
START = np.array([0.3, -1.0, 0.2])  # off the edges between a box's triangles


def plate(begin: float, end: float) -> np.ndarray:
    """A box across the y axis, from one place on it to another."""
    return body((-1.0, begin, -1.0), (1.0, end, 1.0))


def met(*elements: list[np.ndarray], reach: float = 5.0) -> list[tuple[int, float, float]]:
    """Elements that a ray along y from -1 on goes through, from where to where in y."""
    triangles = [np.concatenate(parts) for parts in elements]
    counts = [len(own) for own in triangles]
    items = np.concatenate([np.repeat(np.arange(len(e)), [len(p) for p in e]) for e in elements])
    bodies = Bodies(ray_mesh(np.concatenate(triangles)), np.repeat(np.arange(len(counts)), counts), items)
    found = bodies.along(START, Y, reach)
    return [(s.element, round(s.start - 1.0, 9), round(s.stop - 1.0, 9)) for s in found]


def test_all_hits_are_those_of_each_triangle():
    rng = np.random.default_rng(5)
    triangles = rng.normal(size=(300, 3, 3))
    mesh = ray_mesh(triangles)
    for origin, ray in rng.normal(size=(40, 2, 3)):
        ray = ray / np.linalg.norm(ray)
        distance, hit = mesh.all_hits(origin, ray, 2.0)
        alone = [(ray_mesh(t[None]).first_hits(origin[None], ray[None])[0][0], k) for k, t in enumerate(triangles)]
        expected = sorted((d, k) for d, k in alone if d <= 2.0)
        assert hit.tolist() == [k for _, k in expected]
        assert distance == pytest.approx([d for d, _ in expected])


@pytest.mark.parametrize("as_items", [True, False])
def test_bodies_of_an_element_that_touch_are_one(as_items):
    parts = [plate(0.0, 0.1), plate(0.1, 0.25), plate(0.25, 0.3)]
    element = parts if as_items else [np.concatenate(parts)]
    assert met(element) == [(0, 0.0, 0.3)]


def test_elements_that_touch_are_two():
    assert met([plate(0.0, 0.1)], [plate(0.1, 0.3)]) == [(0, 0.0, 0.1), (1, 0.1, 0.3)]


def test_a_cavity_within_an_element_is_none_of_it():
    assert met([plate(0.0, 0.1), plate(0.15, 0.3)]) == [(0, 0.0, 0.1), (0, 0.15, 0.3)]


@pytest.mark.parametrize("parts", [[(0.0, 0.3), (0.1, 0.2)], [(0.0, 0.2), (0.1, 0.3)], [(0.0, 0.3), (0.0, 0.3)]])
def test_bodies_within_each_other_are_one(parts):
    both = [plate(*part) for part in parts]
    assert met(both) == met([np.concatenate(both)]) == [(0, 0.0, 0.3)]


@pytest.mark.parametrize("seed", range(8))
def test_any_boxes_are_the_union_of_their_intervals(seed):
    """Of three elements, items and bodies without order, some inside out, some of equal faces."""
    rng = np.random.default_rng(seed)
    elements, expected = [], []
    for number in range(3):
        ends = np.sort(rng.integers(0, 30, (rng.integers(1, 6), 2)) / 10, axis=1)
        ends[:, 1] += 0.1
        parts = [plate(*end) for end in ends]
        elements.append([part[:, ::-1] if rng.random() < 0.3 else part for part in parts])
        joined: list[list[float]] = []
        for begin, end in sorted(ends.tolist()):
            if joined and begin <= joined[-1][1] + 1e-9:
                joined[-1][1] = max(joined[-1][1], end)
            else:
                joined.append([begin, end])
        expected += [(number, begin, end) for begin, end in joined]
    found = met(*elements, reach=9.0)
    assert [e for e, _, _ in sorted(found)] == [e for e, _, _ in expected]
    assert np.array([f[1:] for f in sorted(found)]) == pytest.approx(np.array([e[1:] for e in expected]))


def test_a_body_drawn_inside_out_is_where_it_is():
    turned = plate(0.0, 0.3)[:, ::-1]
    assert met([turned]) == [(0, 0.0, 0.3)]
    # one item of a body that is drawn well and one that is not
    assert met([np.concatenate([plate(0.0, 0.1), plate(0.2, 0.3)[:, ::-1]])]) == [(0, 0.0, 0.1), (0, 0.2, 0.3)]


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_where_a_side_is_not_drawn_the_others_say_where_it_would_be(side):
    box = plate(0.0, 0.05)
    across = np.cross(box[:, 1] - box[:, 0], box[:, 2] - box[:, 0])
    across /= np.linalg.norm(across, axis=1)[:, None]
    assert met([box[side * across[:, 1] < 0.5]]) == [(0, 0.0, 0.05)]


def test_an_edge_between_two_triangles_is_one_face():
    """On the way in the ray meets the diagonal of a side, on the way out it does not."""
    box = plate(0.0, 0.3)
    back = np.all(box[..., 1] == 0.3, axis=1)
    a, b, c, d = box[back][0, 0], box[back][0, 1], box[back][0, 2], box[back][1, 2]
    other = np.array([[b, c, d], [b, d, a]])
    mixed = np.concatenate([box[~back], other, plate(1.0, 1.1)])
    bodies = Bodies(ray_mesh(mixed), np.zeros(24, dtype=int), np.zeros(24, dtype=int))
    first, _ = bodies.along(np.array([0.2, -1.0, 0.2]), Y, 5.0)
    assert (first.start, first.stop) == pytest.approx((1.0, 1.3))


def test_a_ray_that_begins_in_a_body_or_ends_in_one():
    assert met([plate(-3.0, 0.3)]) == [(0, -1.0, 0.3)]
    assert met([plate(0.0, 9.0)]) == [(0, 0.0, np.inf)]
