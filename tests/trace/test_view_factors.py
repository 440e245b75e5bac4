"""View factors against closed forms of a box, reciprocity, closure, and a person's six planes."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_cfs.surfaces import Surfaces

WIDTH, DEPTH, HEIGHT = 4.0, 5.0, 3.0


def box_parts(width=WIDTH, depth=DEPTH, height=HEIGHT) -> Surfaces:
    """Floor, ceiling, south, north, west, east; counter-clockwise seen from outside."""
    x, y, z = width, depth, height
    rectangles = [
        [(0, 0, 0), (0, y, 0), (x, y, 0), (x, 0, 0)],
        [(0, 0, z), (x, 0, z), (x, y, z), (0, y, z)],
        [(0, 0, 0), (x, 0, 0), (x, 0, z), (0, 0, z)],
        [(0, y, 0), (0, y, z), (x, y, z), (x, y, 0)],
        [(0, 0, 0), (0, 0, z), (0, y, z), (0, y, 0)],
        [(x, 0, 0), (x, y, 0), (x, y, z), (x, 0, z)],
    ]
    corners = np.array(rectangles, dtype=float)
    triangles = corners[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)
    return Surfaces(triangles, np.full(12, 0.5), np.repeat(np.arange(6), 2))


def parallel(a: float, b: float, c: float) -> float:
    """Two equal rectangles a x b facing each other at c (Howell C-11)."""
    x, y = a / c, b / c
    first = np.log(np.sqrt((1 + x**2) * (1 + y**2) / (1 + x**2 + y**2)))
    rest = x * np.sqrt(1 + y**2) * np.arctan(x / np.sqrt(1 + y**2))
    rest += y * np.sqrt(1 + x**2) * np.arctan(y / np.sqrt(1 + x**2))
    rest -= x * np.arctan(x) + y * np.arctan(y)
    return 2 / (np.pi * x * y) * (first + rest)


def perpendicular(common: float, width: float, height: float) -> float:
    """From a rectangle common x width to one common x height at right angles (Howell C-14)."""
    h, w = height / common, width / common
    s = h**2 + w**2
    a = (1 + w**2) * (1 + h**2) / (1 + s)
    b = (w**2 * (1 + s) / ((1 + w**2) * s)) ** (w**2)
    c = (h**2 * (1 + s) / ((1 + h**2) * s)) ** (h**2)
    return (
        w * np.arctan(1 / w) + h * np.arctan(1 / h) - np.sqrt(s) * np.arctan(1 / np.sqrt(s)) + 0.25 * np.log(a * b * c)
    ) / (np.pi * w)


def test_box_against_closed_forms(variant):
    from mitsuba_cfs.trace.matrices.view_factors import view_factors

    n = 2**16
    f = view_factors(box_parts(), samples=n)
    expected = {
        (0, 1): parallel(WIDTH, DEPTH, HEIGHT),
        (2, 3): parallel(WIDTH, HEIGHT, DEPTH),
        (4, 5): parallel(DEPTH, HEIGHT, WIDTH),
        (0, 2): perpendicular(WIDTH, DEPTH, HEIGHT),
        (2, 4): perpendicular(HEIGHT, WIDTH, DEPTH),
        (5, 0): perpendicular(DEPTH, HEIGHT, WIDTH),
    }
    for (i, j), exact in expected.items():  # 5 sigma of plain random rays; these do better
        assert f[i, j] == pytest.approx(exact, abs=5 * np.sqrt(exact * (1 - exact) / n)), (i, j)
    np.testing.assert_allclose(f.sum(axis=1), 1.0, atol=1e-4)
    area = np.array([20.0, 20.0, 12.0, 12.0, 15.0, 15.0])
    exchange = area[:, None] * f
    np.testing.assert_allclose(exchange, exchange.T, atol=0.1)  # 5 sigma of both sides
    assert np.all(np.diag(f) == 0.0)
    np.testing.assert_array_equal(f, view_factors(box_parts(), samples=n))


def test_gap_shows_as_a_row_below_one(variant):
    from mitsuba_cfs.trace.matrices.view_factors import view_factors

    whole = box_parts()
    open_ = Surfaces(whole.triangles[:-2], whole.reflectance[:-2], whole.surface[:-2])
    f = view_factors(open_, samples=2**14)
    lost = 1 - f[4].sum()
    exact = parallel(DEPTH, HEIGHT, WIDTH)
    assert lost == pytest.approx(exact, abs=5 * np.sqrt(exact / 2**14))


def test_person_beside_a_wall_sees_it_most(variant):
    from mitsuba_cfs.trace.matrices.view_factors import person_view_factors

    n = 2**15
    middle = person_view_factors(box_parts(4, 4, 4), [2, 2, 2], [0, 1, 0], samples=n)
    assert middle.sum() == pytest.approx(1.0, abs=1e-4)
    # a cube seen from its centre: the sphere's sixths, turned towards the weights ahead and aside
    assert middle[2] == pytest.approx(middle[3], abs=0.005)
    assert middle[3] > middle[5] > middle[1]
    # facing plane of a cube's face at half its edge: four corner rectangles (Howell B-4)
    x = y = 1.0
    corner = (
        x / np.sqrt(1 + x**2) * np.arctan(y / np.sqrt(1 + x**2))
        + y / np.sqrt(1 + y**2) * np.arctan(x / np.sqrt(1 + y**2))
    ) / (2 * np.pi)
    ahead, side = 4 * corner, (1 - 4 * corner) / 4
    exact = (0.30 * ahead + 2 * (0.22 + 0.18) * side) / 1.40
    assert middle[3] == pytest.approx(exact, abs=0.004)
    near = person_view_factors(box_parts(), [0.3, 2.5, 1.2], [0, 1, 0], samples=n)
    assert near.argmax() == 4
    with pytest.raises(ValueError, match="horizontal"):
        person_view_factors(box_parts(), [2, 2, 2], [0, 0, 1])


def plate(width: float, depth: float, height: float) -> Surfaces:
    """A level plate over the plane y = 0, standing out towards -y."""
    corners = [(-width, 0, height), (width, 0, height), (width, -depth, height)]
    corners.append((-width, -depth, height))
    triangles = np.array(corners, dtype=float)[[[0, 1, 2], [0, 2, 3]]]
    return Surfaces(triangles, np.full(2, 0.9), np.zeros(2, dtype=int))


def test_the_sky_below_a_long_overhang(variant):
    from mitsuba_cfs.trace.matrices.view_factors import sky_shares

    depth, down = 1.5, np.array([0.2, 0.8, 1.7, 2.9])
    places = np.stack([0 * down, 0 * down - 1e-3, 3.0 - down], axis=1)
    found = sky_shares(plate(2e3, depth, 3.0), places[:, None], [[0, -1, 0]] * 4, samples=2**15, seed=3)
    # the edge stands at the angle phi over the horizon: of the half space's sky, sin phi is seen
    expected = down / np.hypot(down, depth)
    assert found == pytest.approx(expected, abs=0.008)
    both = sky_shares(plate(2e3, depth, 3.0), places[None], [[0, -1, 0]], samples=2**15)
    assert both == pytest.approx([expected.mean()], abs=0.005)


def test_the_sky_of_planes_that_nothing_hides(variant):
    from mitsuba_cfs.trace.matrices.view_factors import sky_shares

    below = plate(5.0, 5.0, -1.0)  # lies under them, and hides no sky
    up, down, south = [0, 0, 1], [0, 0, -1], [0, -1, 0]
    shares = sky_shares(below, np.zeros((3, 1, 3)), [up, down, south])
    np.testing.assert_array_equal(shares, 1.0)
    covered = sky_shares(plate(1e4, 1e4, 1.0), np.array([[[0, -5e3, 0]]]), [up])
    assert covered == pytest.approx(0.0, abs=1e-3)
    none = Surfaces.none()
    np.testing.assert_array_equal(sky_shares(none, np.zeros((1, 2, 3)), [south]), 1.0)
