"""A wall's modes against its nodes' linear system, solved directly."""

from __future__ import annotations

import numpy as np
import pytest

from tests.thermal.rooms import CONCRETE, INSULATION, PLASTER
from thermal.conduction import u_value, wall_grid
from thermal.errors import ThermalInputError
from thermal.zone import Layer

AIR = Layer(0.02, 0.1, 0.0, 0.0)  # two cells without any heat, and beside another such layer one


@pytest.mark.parametrize("step_s", [60.0, 600.0, 3600.0])
@pytest.mark.parametrize("layers", [(PLASTER,), (PLASTER, INSULATION, CONCRETE), (AIR, AIR, PLASTER)])
def test_modes_go_as_the_nodes_do(layers: tuple[Layer, ...], step_s: float) -> None:
    grid = wall_grid(layers)
    modes, capacity = grid.modes(step_s), grid.capacity[1:-1] / step_s
    conductance, matrix = grid.conductance, grid.inner_matrix(step_s)
    node, amplitude = np.full(len(capacity), 20.0), 20.0 * modes.even
    pipes = len(capacity) // 2
    for outer, inner, power in ((-5.0, 21.0, 0.0), (3.0, 22.0, 40.0), (30.0, 24.0, 0.0)):
        right = capacity * node
        right[0] += conductance[0] * outer
        right[-1] += conductance[-1] * inner
        right[pipes] += power
        fresh = np.linalg.solve(matrix, right)
        moved = modes.decay * amplitude + modes.from_out * outer + modes.from_in * inner
        moved += modes.from_nodes[pipes] * power
        assert modes.at_out @ moved == pytest.approx(fresh[0], abs=1e-9)
        assert modes.at_in @ moved == pytest.approx(fresh[-1], abs=1e-9)
        stored = capacity @ (fresh - node)
        assert modes.heat @ (moved - amplitude) == pytest.approx(stored, abs=1e-7)
        node, amplitude = fresh, moved


def test_u_value_of_iso_6946_by_hand():
    """R = 0.04 + 0.1/0.5 + 0.2/0.04 + 0.13 m2 K/W; other films where they are named."""
    layers = (Layer(0.1, 0.5, 1000.0, 900.0), Layer(0.2, 0.04, 0.0, 0.0))
    assert u_value(layers) == pytest.approx(1 / 5.37)
    assert u_value(layers, r_outer=0.1, r_inner=0.2) == pytest.approx(1 / 5.5)


def test_the_cells_of_a_wall_hold_its_heat_and_resistance():
    layers = (Layer(0.1, 0.5, 1000.0, 900.0), Layer(0.05, 0.04, 0.0, 0.0))
    grid = wall_grid(layers, cell=0.02)
    assert grid.capacity.sum() == pytest.approx(0.1 * 1000 * 900)
    assert (1 / grid.conductance).sum() == pytest.approx(0.1 / 0.5 + 0.05 / 0.04)
    # five cells of 20 mm, half of each at its ends; two of the layer without heat
    np.testing.assert_allclose(grid.width, [0.02] * 5 + [0.025] * 2)
    np.testing.assert_allclose(grid.capacity, np.array([9, 18, 18, 18, 18, 9, 0, 0]) * 1e3)


def test_the_node_of_a_pipe_is_the_nearest_inner_one_below_the_inside_face():
    grid = wall_grid((Layer(0.1, 0.5, 1000.0, 900.0), Layer(0.06, 1.0, 2000.0, 900.0)), cell=0.02)
    # inner nodes 20 mm apart, the outermost at 0.14 m below the inside face
    for depth, node in ((0.141, 0), (0.119, 1), (0.051, 4), (0.02, 6), (0.001, 6)):
        assert grid.node_at(depth, "pipe") == node
    with pytest.raises(ThermalInputError, match=r"pipe.*0.161 m lies below its layers"):
        grid.node_at(0.161, "pipe")
    # cells of 20 mm outside, of 15 mm inside: inner nodes at .11, .09, .07, .05, .03 and .015 m
    uneven = wall_grid((Layer(0.1, 0.5, 1000.0, 900.0), Layer(0.03, 1.0, 2000.0, 900.0)), cell=0.02)
    assert [uneven.node_at(depth, "pipe") for depth in (0.068, 0.052, 0.016)] == [2, 3, 5]


@pytest.mark.parametrize(("thickness", "cells"), [(0.005, 2), (0.14, 7), (0.1801, 10)])
def test_cells_are_at_most_as_wide_as_wanted_and_two_at_least(thickness, cells):
    grid = wall_grid((Layer(thickness, 0.5, 1000.0, 900.0),), cell=0.02)
    np.testing.assert_allclose(grid.width, [thickness / cells] * cells)
    with pytest.raises(ThermalInputError, match="has no layers"):
        wall_grid(())
