"""A wall is as thick as it is, wherever in it or behind it the next room is drawn to begin."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
import shapely

from bim.bodies import Bodies
from bim.neighbours import Beyond, Surroundings, what_lies_beyond
from bim.planes import Facet, planar_facets, plane_through
from bim.rays import ray_mesh
from bim.rooms import Piece
from tests.bim.test_eaves import ROOM, SOUTH, body


def between(begins: float, *bodies: np.ndarray, again: Sequence[np.ndarray] = ()) -> Beyond:
    """What a room has behind its southern face, where the next room begins so far behind it [m].

    Args: again: further bodies of the own room.
    """
    own, other = body(*ROOM), body((0.0, -4.0, 0.0), (4.0, -begins, 2.7))
    counts = [len(one) for one in bodies]
    around = Surroundings(
        Bodies(
            ray_mesh(np.concatenate(bodies)),
            np.repeat(np.arange(len(counts)), counts),
            np.zeros(sum(counts), dtype=int),
        ),
        ray_mesh(np.concatenate([own, other, *again])),
        np.repeat([0, 1, *(0 for _ in again)], 12),
        ("own", "other"),
        -0.5,
    )
    (facet,) = (f for f in planar_facets(own) if f.plane.normal @ SOUTH > 0.99)
    return what_lies_beyond(Piece(facet, "room"), around, own=0)


@pytest.mark.parametrize("begins", [0.12, 0.25, 0.3 - 1e-12, 0.3, 0.3 + 1e-12, 0.35])
def test_the_ray_comes_out_of_the_wall(begins):
    found = between(begins, body((-1.0, -0.3, -0.2), (5.0, 0.0, 4.0)))
    assert (found.adjacency, found.neighbour) == ("space", "other")
    (span,) = found.spans
    assert (span.start, span.stop) == pytest.approx((0.0, 0.3), abs=1e-9)


def test_faces_of_the_own_room_that_are_drawn_again_are_passed():
    """Before some of the points that are asked: those find the next room too."""
    again = [body((0.0, -0.02, 0.0), (4.0, 1.0, 2.7)), body((0.0, -0.05, 0.0), (2.1, 1.0, 2.7))]
    found = between(0.3, body((-1.0, -0.3, -0.2), (5.0, 0.0, 4.0)), again=again)
    assert (found.adjacency, found.neighbour) == ("space", "other")


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


def test_a_wall_in_one_of_two_rooms_that_touch_is_between_them():
    """Both faces lie at the same side of it: one room is drawn through the wall."""
    beyond = between(0.0, body((-1.0, -0.2, -0.2), (5.0, 0.0, 4.0)))
    within = between(0.0, body((-1.0, 0.0, -0.2), (5.0, 0.2, 4.0)))
    assert [(s.start, s.stop) for s in beyond.spans] == [pytest.approx((0.0, 0.2), abs=1e-9)]
    assert [(s.start, s.stop) for s in within.spans] == [pytest.approx((-0.2, 0.0), abs=1e-9)]


def test_a_room_that_is_drawn_to_the_middle_of_its_wall_has_all_of_it():
    (span,) = between(0.0, body((-1.0, -0.15, -0.2), (5.0, 0.15, 4.0))).spans
    assert (span.start, span.stop) == pytest.approx((-0.15, 0.15), abs=1e-9)


def test_a_stair_along_a_wall_is_none_of_it():
    wall, stair = body((-1.0, -0.3, -0.2), (5.0, 0.0, 4.0)), body((1.0, 0.0, 0.0), (2.1, 0.1, 2.7))
    assert [span.element for span in between(0.5, wall, stair).spans] == [0]


def test_what_covers_the_whole_wall_in_the_room_is_its_first_layer():
    wall, panel = body((-1.0, -0.3, -0.2), (5.0, 0.0, 4.0)), body((0.0, 0.0, 0.0), (4.0, 0.02, 2.7))
    assert [span.element for span in between(0.5, wall, panel).spans] == [1, 0]


def test_a_wall_that_stands_against_another_is_no_layer_of_it():
    """Where it meets the wall the ray runs along it; elsewhere the open air follows."""
    wall = body((-1.0, -0.3, -0.2), (5.0, 0.0, 4.0))
    against = body((1.9, -9.0, -0.2), (2.1, -0.3, 4.0))
    found = between(60.0, wall, against)
    assert ([span.element for span in found.spans], found.adjacency) == ([0], "outside")
    behind_all = between(60.0, wall, body((-1.0, -9.0, -0.2), (5.0, -0.3, 4.0)))
    assert ([s.element for s in behind_all.spans], behind_all.adjacency) == ([0], "adiabatic")


def test_where_a_stair_stands_against_most_of_a_wall_the_rest_says_what_follows():
    wall = body((-1.0, -0.3, -0.2), (5.0, 0.0, 4.0))
    stair = body((1.0, -9.0, -0.2), (2.2, -0.3, 4.0))
    assert between(60.0, wall, stair).adjacency == "outside"


def test_layers_of_two_elements_that_touch_are_both_met():
    first, second = (body((-1.0, -0.1, -0.2), (5.0, 0.0, 4.0)), body((-1.0, -0.3, -0.2), (5.0, -0.1, 4.0)))
    for bodies in ((first, second), (second, first)):
        spans = between(0.3, *bodies).spans
        assert [(s.start, s.stop) for s in spans] == [pytest.approx((0.0, 0.1)), pytest.approx((0.1, 0.3))]


def behind(outline: shapely.Polygon, wall: np.ndarray) -> Beyond:
    """What lies behind a face of that outline to the south, of a room without bodies."""
    none = np.zeros(0, dtype=int)
    around = Surroundings(
        Bodies(ray_mesh(wall), np.zeros(12, dtype=int), np.zeros(12, dtype=int)),
        ray_mesh(np.empty((0, 3, 3))),
        none,
        (),
        -0.5,
    )
    facet = Facet(plane_through(np.zeros(3), SOUTH), outline)
    return what_lies_beyond(Piece(facet, "room"), around, own=0)


def test_two_samples_on_a_wall_outweigh_a_bigger_hole_and_one_does_not():
    outline = shapely.Polygon([(0, 0), (4, 0), (4, 1), (0.5, 1), (0.5, 3), (0, 3)])
    assert behind(outline, body((-9.0, -0.3, 1.1), (9.0, 0.0, 4.0))).spans
    assert not behind(outline, body((-9.0, -0.3, 2.1), (9.0, 0.0, 4.0))).spans


def test_a_ceiling_far_above_a_room_is_its_ceiling_and_a_wall_far_off_is_not():
    room = body(*ROOM)
    up, south = np.array([0.0, 0.0, 1.0]), SOUTH
    for normal, far in (
        (up, body((-1.0, -1.0, 3.9), (5.0, 6.0, 4.1))),
        (south, body((-1.0, -1.4, -1.0), (5.0, -1.2, 5.0))),
    ):
        around = Surroundings(
            Bodies(ray_mesh(far), np.zeros(12, dtype=int), np.zeros(12, dtype=int)),
            ray_mesh(room),
            np.zeros(12, dtype=int),
            ("own",),
            -0.5,
        )
        (facet,) = (f for f in planar_facets(room) if f.plane.normal @ normal > 0.99)
        found = what_lies_beyond(Piece(facet, "room"), around, own=0)
        assert len(found.spans) == (normal is up)
