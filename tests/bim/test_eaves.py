"""A roof over a wall, and its rafters, are no layers of the wall; over a ceiling they are."""

from __future__ import annotations

import numpy as np
import pytest

from bim.bodies import Bodies
from bim.neighbours import Surroundings, what_lies_beyond
from bim.planes import planar_facets
from bim.rays import ray_mesh
from bim.rooms import Piece

SOUTH, UP = np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])
ROOM = ((0.0, 0.0, 0.0), (4.0, 5.0, 2.7))


def body(low, high, rise: float = 0.0) -> np.ndarray:
    """Triangles [12, 3, 3] of a box, sheared upwards towards the north."""
    corner = np.array(np.meshgrid(*np.stack([low, high]).T, indexing="ij")).reshape(3, 8).T
    corner[:, 2] += rise * corner[:, 1]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return np.array([corner[list(q)][list(t)] for q in quads for t in ((0, 1, 2), (0, 2, 3))])


def met_behind(normal: np.ndarray, *bodies: np.ndarray) -> tuple[list[int], str]:
    """Elements behind a room's face of that normal, and what follows them."""
    room = body(*ROOM)
    around = Surroundings(
        Bodies(
            ray_mesh(np.concatenate(bodies)),
            np.repeat(np.arange(len(bodies)), 12),
            np.zeros(12 * len(bodies), dtype=int),
        ),
        ray_mesh(room),
        np.zeros(12, dtype=int),
        ("room",),
        -0.5,
    )
    (facet,) = (f for f in planar_facets(room) if f.plane.normal @ normal > 0.99)
    found = what_lies_beyond(Piece(facet, "room"), around, own=0)
    return [span.element for span in found.spans], found.adjacency


WALL = body((-1.0, -0.3, -0.2), (5.0, 0.0, 4.0))


@pytest.mark.parametrize("rise", [0.3, 0.6, 1.2])
def test_a_roof_that_falls_past_a_wall_is_no_layer_of_it(rise):
    """Its underside goes down before the wall, 0.3 m away at the middle of the room's height."""
    roof = body((-1.0, -1.2, 1.35 + 0.6 * rise), (5.0, -0.31, 1.6 + 0.6 * rise), rise)
    assert met_behind(SOUTH, WALL, roof) == ([0], "outside")


def test_a_rafter_before_one_of_the_samples_is_no_layer_of_the_wall():
    rafter = body((1.95, -0.7, 0.0), (2.05, -0.6, 2.7))
    assert met_behind(SOUTH, WALL, rafter) == ([0], "outside")


def test_a_cladding_before_the_whole_wall_is():
    cladding = body((-1.0, -0.4, -0.2), (5.0, -0.36, 4.0))
    assert met_behind(SOUTH, WALL, cladding) == ([0, 1], "outside")


def test_over_a_ceiling_the_slanting_roof_closes_the_attic():
    ceiling = body((-1.0, -1.0, 2.7), (5.0, 6.0, 2.9))
    roof = body((-1.0, -1.0, 3.0), (5.0, 6.0, 3.2), 0.05)
    steep = body((-1.0, -1.0, 2.0), (5.0, 6.0, 2.2), 0.6)
    assert met_behind(UP, ceiling, roof) == ([0, 1], "outside")
    assert met_behind(UP, ceiling, steep)[0] == [0, 1]


def test_an_upright_wall_that_runs_aslant_behind_another_is_its_layer():
    """At 30 degrees the corner of a facade closes the wedge of air behind a panel."""
    panel = body((-1.0, -0.1, -0.2), (5.0, 0.0, 4.0))
    facade = body((-6.0, -0.15, -0.2), (10.0, 0.15, 4.0))
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    facade = (facade - [2.0, 0.0, 0.0]) @ turn.T + [2.0, -0.7, 0.0]
    elements, beyond = met_behind(SOUTH, panel, facade)
    assert (elements, beyond) == ([0, 1], "outside")
