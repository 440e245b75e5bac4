"""A wall is as thick as it is, wherever in it or behind it the next room is drawn to begin."""

from __future__ import annotations

import numpy as np
import pytest

from bim.bodies import Bodies
from bim.planes import planar_facets
from bim.rays import ray_mesh
from bim.rooms import Piece
from bim.surroundings import Beyond, Surroundings, what_lies_beyond
from tests.bim.test_eaves import ROOM, SOUTH, body


def between(begins: float, *bodies: np.ndarray) -> Beyond:
    """What a room has behind its southern face, where the next room begins so far behind it [m]."""
    own, other = body(*ROOM), body((0.0, -4.0, 0.0), (4.0, -begins, 2.7))
    around = Surroundings(
        Bodies(ray_mesh(np.concatenate(bodies)), np.repeat(np.arange(len(bodies)), 12),
               np.zeros(12 * len(bodies), dtype=int)),
        ray_mesh(np.concatenate([own, other])), np.repeat([0, 1], 12), ("own", "other"), -0.5,
    )  # fmt: skip
    (facet,) = (f for f in planar_facets(own) if f.plane.normal @ SOUTH > 0.99)
    return what_lies_beyond(Piece(facet, "room"), around, own=0)


@pytest.mark.parametrize("begins", [0.12, 0.25, 0.3 - 1e-12, 0.3, 0.3 + 1e-12, 0.35])
def test_the_ray_comes_out_of_the_wall(begins):
    found = between(begins, body((-1.0, -0.3, -0.2), (5.0, 0.0, 4.0)))
    assert (found.adjacency, found.neighbour) == ("space", "other")
    (span,) = found.spans
    assert (span.start, span.stop) == pytest.approx((0.0, 0.3), abs=1e-9)


def test_a_door_leaf_that_stands_into_the_next_room_is_thin():
    found = between(0.1, body((-1.0, -0.115, -0.2), (5.0, -0.065, 4.0)))
    (span,) = found.spans
    assert (span.start, span.stop) == pytest.approx((0.065, 0.115), abs=1e-9)


def test_what_stands_in_the_next_room_is_none_of_the_wall():
    """Not even where the wall ends only behind it."""
    wall = body((-1.0, -0.3, -0.2), (5.0, 0.0, 4.0))
    cupboard = body((-1.0, -0.28, -0.2), (5.0, -0.2, 4.0))
    assert [span.element for span in between(0.1, wall, cupboard).spans] == [0]


def test_a_wall_that_the_ray_runs_along_has_no_end():
    found = between(0.3, body((-1.0, -9.0, -0.2), (5.0, 0.0, 4.0)))
    assert [span.stop for span in found.spans] == [np.inf]
